//! Directories of campaigns: `run.yaml`, `run.db` and `critical/*.ava`; those of studies have `study.yaml` and `study.db`.
//!
//! A directory is begun when its settings stand in it. What a kill leaves before that counts as empty, so the
//! directory can be begun again; what it leaves after that can be resumed. One process at a time works in it.
//!
//! The database is the source of truth, and has the text of each scenario, too. A missing scenario is written again, and an
//! edited one is named. The same holds for the copy of the space, whose meaning the settings record.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::files::{self, Lock};
use avastra_campaign::oracle::Found;
use avastra_campaign::run::{
    self, Conditions, DatabaseError, EpisodeSummary, Near, Numbered, Shard, Units, VERSION, WrittenScenario,
    scenario_name,
};
use avastra_drivers::external::{Attached, ExternalSettings};
use avastra_lang::check::normal;
use avastra_lang::syntax::{ast, print, read_yaml};
use avastra_world::action::ActionTable;
use avastra_world::sim::ENGINE;

use super::campaign::{Campaign, KINDS, Kind, Outside};
use super::error::Failure;
use super::files::{folder, make, make_first, remove, write, write_answers, write_named};
use super::load;
use super::output::{Output, for_shell, plural};
use super::{pack, shard};

/// The folders that a run, a training or an estimate writes into.
const FOLDERS: [&str; 5] = ["critical", "failures", KEPT, "policy", pack::SPACE];

/// The folder of episodes in which nothing was found, and which were asked for all the same.
pub const KEPT: &str = "kept";

/// A directory that no other process works in while this lives.
pub struct Held {
    pub path: PathBuf,
    /// The lock is on the directory itself.
    _lock: Lock,
}

/// The directory of a campaign, with its database.
pub struct Directory<C: Campaign> {
    pub path: PathBuf,
    pub database: C::Database,
    _held: Held,
}

/// Makes a new directory, or the next free `runs/NNNN`.
pub fn create_empty(out: Option<&Path>) -> Result<Held, Failure> {
    match out {
        Some(path) => make_empty(path),
        None => {
            let runs = folder(Path::new(""), "runs")?;
            hold(&make_first(|number| runs.join(format!("{number:04}")))?)
        }
    }
}

/// Makes a directory for scenarios, with a copy of their space, and returns the path of the copy, too. In the copy, they can be
/// looked at as they were recorded, even if the author changes the space. It is self-contained if it lies beside them.
pub fn create(
    out: Option<&Path>,
    shard: Shard,
    space: &Path,
    is_self_contained: bool,
) -> Result<(Held, PathBuf), Failure> {
    let held = create_empty(out)?;
    let critical = folder(&held.path, "critical")?;
    shard::keep(&held.path, shard)?;
    let copy = pack::pack_space(space, if is_self_contained { &critical } else { &held.path })?;
    Ok((held, copy))
}

/// Takes a directory for this process alone.
pub fn hold(path: &Path) -> Result<Held, Failure> {
    let lock = Lock::of_folder(path).map_err(|_| {
        let path = path.shown();
        Failure::usage(format!(
            "another avastra is at work in `{path}`: wait for it, or name another directory"
        ))
    })?;
    Ok(Held { path: path.to_owned(), _lock: lock })
}

/// An external driving system as settings in `directory` record it. Its working directory is relative to `directory`, so
/// the same program starts wherever the run is resumed from. If the folder is missing on this machine, the path follows
/// from the names alone.
///
/// # Errors
/// If this process has no folder that it works in.
pub fn to_record(directory: &Path, attached: Attached) -> Result<Attached, Failure> {
    let folder = attached.settings.working_directory.as_deref().unwrap_or(Path::new("."));
    let by_names = || load::path_between(&pack::absolute(directory)?, &pack::absolute(folder)?);
    let between = load::relative(directory, folder).or_else(|_| by_names())?;
    let working_directory = Some(PathBuf::from(between));
    Ok(Attached { settings: ExternalSettings { working_directory, ..attached.settings }, ..attached })
}

/// The same as it is to be started.
pub fn from_record(directory: &Path, attached: Attached) -> Attached {
    let working_directory = attached.settings.working_directory.map(|folder| directory.join(folder));
    Attached { settings: ExternalSettings { working_directory, ..attached.settings }, ..attached }
}

/// The fields with which all settings begin.
#[derive(serde::Deserialize)]
pub struct Begun {
    avastra: String,
    engine: String,
    pub space: Option<String>,
    space_digest: Option<String>,
}

/// The beginning of settings of any kind and version, and whether an earlier build wrote them, without `conditions`.
pub fn begun_in(text: &str) -> Option<(Begun, bool)> {
    let (fields, has_conditions) = run::flat(text)?;
    Some((serde_json::from_value(fields.into()).ok()?, !has_conditions))
}

/// A directory that is gone on with.
pub struct Resumed<S> {
    pub settings: S,
    /// The settings as they stand in the file.
    pub text: String,
    pub table: ActionTable,
    pub held: Held,
}

/// The settings of an interrupted campaign, and the table of its space, if neither the space nor avastra has changed since.
/// With `is_played`, nothing of it is left to play, and no program is started.
pub fn resume<C: Campaign>(
    output: &Output,
    directory: &Path,
    is_played: bool,
) -> Result<Resumed<C>, Failure> {
    let Kind { file: kind, what, .. } = C::KIND;
    let path = C::KIND.settings(directory);
    if let Some(Kind { command, .. }) = what_was_begun(directory).filter(|found| found.what != what) {
        return Err(Failure::usage(format!(
            "`{}` was begun by `avastra {command}`: go on with `avastra {command} --resume {}`",
            directory.shown(),
            for_shell(directory)
        )));
    }
    if !path.is_file() {
        return Err(Failure::usage(format!(
            "`{}` is no {kind} directory: it has no {kind}.yaml; begin one in a new directory with `--out`",
            directory.shown()
        )));
    }
    let held = hold(directory)?;
    tidy(directory)?;
    // The scenarios of a run whose database is lost cannot be told from new ones.
    let database = C::KIND.database(directory);
    let left = load::sources_in(&directory.join("critical")).unwrap_or_default();
    let lost = lost(&database);
    if let Some(how) = lost.filter(|_| !left.is_empty()) {
        return Err(Failure::usage(format!(
            "`{}` is {how}, and `critical` has scenarios: begin a new {what}, or delete them to begin this one anew",
            database.shown()
        )));
    }
    let (mut settings, text) = settings_of::<C>(directory)?;
    // Whatever else is wrong with edited settings, that they were edited is the reason.
    if let Some(edited) = lost.is_none().then(|| C::Database::edited(&database, &text)).flatten() {
        return Err(Failure::file("open", &database, edited));
    }
    let Outside { space, space_digest, external, .. } = settings.outside();
    let table = load::table(output, &directory.join(space.as_str()))?;
    let meaning = &table.space().meaning;
    if !meaning.is_sealed_by(space_digest) {
        let differences = meaning.differences(space_digest);
        let differences = differences.map_or_else(String::new, |found| format!(" ({found})"));
        return Err(Failure::usage(format!(
            "`{}` has changed since the {what} was begun{differences}: begin a new one",
            table.space().path.shown()
        )));
    }
    if C::KIND.keeps_space {
        restore_copy(output, directory, (space.as_str(), space_digest), &table.space().path)?;
    }
    *external = external
        .take()
        .map(|attached| Attached { is_recorded: is_played, ..from_record(directory, attached) });
    // Git keeps no empty folder.
    if C::Database::keeps_scenarios() {
        folder(directory, "critical")?;
    }
    // A directory that cannot be resumed does not begin anew either.
    if let Some(how) = lost {
        output.tell(&format!("`{}` is {how}: the {what} begins anew", database.shown()));
    }
    if let Some(attached) = external.as_ref().filter(|attached| !attached.is_recorded) {
        // Nothing on the command line names it.
        output.say(&named_in(&path, &attached.settings));
    }
    Ok(Resumed { settings, text, table, held })
}

/// How a database is lost, if it is: a kill may leave an empty file before anything is in it.
pub fn lost(database: &Path) -> Option<&'static str> {
    match std::fs::metadata(database) {
        Err(_) if is_gone(database) => Some("missing"),
        Err(_) if database.is_symlink() => Some("a link that leads nowhere"),
        Err(_) => Some("unreadable"),
        Ok(found) => (found.is_file() && found.len() == 0).then_some("empty"),
    }
}

/// Says what a directory's settings start or reach, and how.
fn named_in(file: &Path, settings: &ExternalSettings) -> String {
    let (file, command) = (file.shown(), settings.command.text());
    if settings.command.is_socket() {
        return format!("`{file}` names the driving system, which is reached now: {command}");
    }
    let folder = settings.working_directory.as_deref().map(normal);
    let folder = folder.filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(PathBuf::from("."));
    let env: String = settings.env.iter().map(|(name, value)| format!("{name}={value} ")).collect();
    format!("`{file}` names the driving system, which is started now in `{}`: {env}{command}", folder.shown())
}

/// The copy of the space in a directory.
enum Copied {
    Sound,
    Edited,
    Gone,
}

/// The state of a space's copy in a directory. `space` is the path of the space from there, `digest` its recorded meaning.
fn copied(directory: &Path, space: &str, digest: &str) -> Copied {
    let folder = directory.join(pack::SPACE);
    let space = Path::new(space);
    // The campaign plays the copy itself, which is compared whenever it is read.
    let is_inside = space.is_relative() && !space.starts_with("..");
    if is_inside {
        return Copied::Sound;
    }
    if is_gone(&folder) {
        return Copied::Gone;
    }
    let silent = Output::silent();
    let is_it = |file: &&PathBuf| {
        file.file_name() == space.file_name()
            && load::table(&silent, file).is_ok_and(|table| table.space().meaning.is_sealed_by(digest))
    };
    let files = load::everything_in(&folder).unwrap_or_default();
    if files.values().any(|file| is_it(&file)) { Copied::Sound } else { Copied::Edited }
}

/// A remark on the copy of its space in a directory, if it was edited or is gone.
pub fn remark_on_copy(directory: &Path) -> Option<String> {
    let kind = what_was_begun(directory).filter(|kind| kind.keeps_space)?;
    let text = load::read(&kind.settings(directory)).ok()?;
    let (Begun { space: Some(space), space_digest: Some(space_digest), .. }, _) = begun_in(&text)? else {
        return None;
    };
    let copy = directory.join(pack::SPACE);
    let copy = copy.shown();
    match copied(directory, &space, &space_digest) {
        Copied::Sound => None,
        Copied::Edited => Some(format!(
            "`{copy}` was edited since it was written: it is not the space of this {} any more, and is not used; delete it, and \
             `--resume` writes it again",
            kind.what
        )),
        Copied::Gone => Some(format!(
            "`{copy}`, the copy of the space of this {}, is gone: `--resume` writes it again",
            kind.what
        )),
    }
}

/// Writes the copy of a space again if it is gone, and names one that was edited. `space` is the path of the space from the
/// directory, with what it means; `there` is its file, which means that.
fn restore_copy(
    output: &Output,
    directory: &Path,
    (space, digest): (&str, &str),
    there: &Path,
) -> Result<(), Failure> {
    match copied(directory, space, digest) {
        Copied::Sound => {}
        Copied::Edited => remark_on_copy(directory).iter().for_each(|remark| output.warn(remark)),
        Copied::Gone => {
            let copy = pack::pack_space(there, directory)?;
            output.tell(&format!("{}: was missing, is written again", copy.shown()));
        }
    }
    Ok(())
}

/// Makes a directory ready to be resumed: refuses folders that are links, and removes partial files that a kill left.
fn tidy(directory: &Path) -> Result<(), Failure> {
    files::sweep(directory).map_err(|error| Failure::file("tidy", directory, error))?;
    for name in FOLDERS {
        let folder = directory.join(name);
        files::own_folder(&folder).map_err(|error| Failure::file("use", &folder, error))?;
        if folder.is_dir() {
            // The copy of a space has subfolders.
            files::sweep_all(&folder).map_err(|error| Failure::file("tidy", &folder, error))?;
        }
    }
    Ok(())
}

/// The settings of a directory and their text, if they were written by this version of avastra.
pub fn settings_of<C: Campaign>(directory: &Path) -> Result<(C, String), Failure> {
    let text = load::text(&C::KIND.settings(directory))?;
    // Settings of another version may have other fields: this comes first.
    match begun_elsewhere::<C>(directory, &text) {
        Some(failure) => Err(failure),
        None => Ok((settings_in(directory, &text)?, text)),
    }
}

/// The settings of a directory, whichever version wrote them.
///
/// # Errors
/// If they have another form: that another avastra wrote them, or else the reason with its place.
pub fn settings_in<C: Campaign>(directory: &Path, text: &str) -> Result<C, Failure> {
    let settings = load::parsed(&C::KIND.settings(directory), text);
    settings.map_err(|failure| begun_elsewhere::<C>(directory, text).unwrap_or(failure))
}

/// That another avastra wrote the settings of a directory, if it did.
fn begun_elsewhere<C: Campaign>(directory: &Path, text: &str) -> Option<Failure> {
    let (begun, is_earlier) = begun_in(text)?;
    let is_other = is_earlier || (&*begun.engine, &*begun.avastra) != (ENGINE, VERSION);
    let (what, shown, Begun { avastra, engine, .. }) = (C::KIND.what, directory.shown(), begun);
    let earlier = if is_earlier { "an earlier build of " } else { "" };
    is_other.then(|| {
        Failure::usage(format!(
            "the {what} in `{shown}` was begun by {earlier}avastra {avastra} in world `{engine}`, this is avastra {VERSION} in \
             `{ENGINE}`: begin a new one"
        ))
    })
}

/// The kind of campaign that a directory holds, if any.
pub fn what_was_begun(directory: &Path) -> Option<Kind> {
    KINDS.into_iter().find(|kind| (kind.is_in)(directory))
}

/// The scenarios of a run or a training that are about the worst finding of each kind that recurs.
///
/// # Errors
/// If its settings or its database cannot be read, or nothing recurs in it.
pub fn worst_of_each_kind(directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let (settings, file) = (directory.join("run.yaml"), directory.join("run.db"));
    let shown = directory.shown();
    let settings = load::text(&settings)?;
    let unread = |error| Failure::file("read", &file, error);
    let (database, _) = open_to_read::<run::Database>(&file, &settings)?;
    let left = database.left(read_yaml(&settings).ok().as_ref()).map_err(unread)?;
    // Only names that a scenario has are names of files.
    let written = written(directory, database.scenarios().map_err(unread)?);
    let is_worst = |path: &Path| {
        let name = path.file_stem().unwrap_or_default();
        left.kinds.iter().any(|kind| kind.worst.as_deref().is_some_and(|worst| name == worst))
    };
    let found: Vec<PathBuf> =
        written.into_iter().map(|(path, _)| path).filter(|path| is_worst(path)).collect();
    if found.is_empty() {
        return Err(Failure::usage(format!(
            "no scenario of `{shown}` is about a finding that recurs: name scenarios"
        )));
    }
    Ok(found)
}

/// Whether the settings in `run.yaml` are those of a training; `None` if they cannot be read.
pub fn is_training(directory: &Path) -> Option<bool> {
    let text = load::read(&directory.join("run.yaml")).ok()?;
    let fields: serde_json::Map<String, serde_json::Value> = read_yaml(&text).ok()?;
    Some(fields.contains_key("hyperparameters"))
}

/// A scenario of a directory: its file, and its text from the database.
pub type WrittenFile = (PathBuf, String);

/// The files of scenarios in a directory.
pub fn written(directory: &Path, scenarios: Vec<WrittenScenario>) -> Vec<WrittenFile> {
    let critical = directory.join("critical");
    scenarios.into_iter().map(|found| (critical.join(found.name), found.text)).collect()
}

/// Whether the file of a scenario exists and differs from the text in the database.
pub fn is_edited((path, text): &WrittenFile) -> bool {
    match load::read(path) {
        Ok(found) => found != *text,
        Err(_) => !is_gone(path),
    }
}

/// Whether nothing is at a path, not even a link that leads nowhere.
fn is_gone(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_err_and(|error| error.kind() == ErrorKind::NotFound)
}

/// Remarks for a page about scenarios that were edited or are missing.
pub fn remarks_on(written: &[WrittenFile]) -> Vec<String> {
    let edited = written.iter().filter(|file| is_edited(file));
    let edited = edited.map(|(path, _)| format!("{} was edited since it was written", path.shown()));
    let gone = written.iter().filter(|(path, _)| is_gone(path)).count();
    let gone = (gone > 0).then(|| {
        format!("{} gone from `critical`: `--resume` writes what is missing again", plural(gone, "scenario"))
    });
    edited.chain(gone).collect()
}

/// The scenarios in `critical` that a database does not name: files of the user's own, for example.
fn foreign(directory: &Path, written: &[WrittenFile]) -> Vec<PathBuf> {
    let known: BTreeSet<&Path> = written.iter().map(|(path, _)| path.as_path()).collect();
    let mut files = load::sources_in(&directory.join("critical")).unwrap_or_default();
    files.retain(|file| !known.contains(file.as_path()));
    files
}

/// Says which scenarios in `critical` are [`foreign`], if any.
pub fn foreign_text(kind: &Kind, directory: &Path, written: &[WrittenFile]) -> Option<String> {
    let files = foreign(directory, written);
    let named: Vec<String> = files.iter().take(NAMED_MAX).map(|path| path.shown().to_string()).collect();
    let more = files.len() - named.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!files.is_empty()).then(|| {
        format!(
            "{}{more}: not written by this {}, as far as `{}` tells",
            named.join(", "),
            kind.what,
            kind.database(directory).shown()
        )
    })
}

/// As [`foreign_text`], by the database of a directory. Nothing if it cannot be read, or if rows were changed: then it does not
/// tell what was written.
pub fn foreign_in<C: Campaign>(directory: &Path) -> Option<String> {
    let settings = load::text(&C::KIND.settings(directory)).ok()?;
    let file = C::KIND.database(directory);
    let (database, damaged) = C::Database::open_without_damaged(&file, &settings).ok()?;
    let scenarios = database.scenarios().ok().filter(|_| damaged.is_empty())?;
    foreign_text(&C::KIND, directory, &written(directory, scenarios))
}

/// Opens the database of a directory to read it. Units whose rows were changed are left out, and a remark says so.
pub fn open_to_read<D: Units>(file: &Path, settings: &str) -> Result<(D, Option<String>), Failure> {
    let (database, damaged) =
        D::open_without_damaged(file, settings).map_err(|error| Failure::file("read", file, error))?;
    let remark = || format!("{}: they count for nothing", changed::<D>(file, &damaged));
    let remark = (!damaged.is_empty()).then(remark);
    Ok((database, remark))
}

/// Why the database of a directory cannot be opened. Where rows were changed, it says what to do.
pub fn unopened<C: Campaign>(directory: &Path, error: &DatabaseError) -> Failure {
    let Kind { command, merge, .. } = C::KIND;
    let advice = match error {
        DatabaseError::Rows { .. } if merge.is_some() => {
            format!(": `avastra {command} --resume {}` plays them again", for_shell(directory))
        }
        // Each episode of a training is chosen with what was learned before.
        DatabaseError::Rows { .. } => ", and later ones learned from it: begin a new training".to_owned(),
        _ => String::new(),
    };
    Failure::file("open", &C::KIND.database(directory), format!("{error}{advice}"))
}

/// Most changed units that a message names.
const NAMED_MAX: usize = 8;

/// Says that rows of units were changed.
fn changed<D: Units>(file: &Path, damaged: &[i64]) -> String {
    let named: Vec<String> = damaged.iter().take(NAMED_MAX).map(|&number| D::called(number)).collect();
    let more = damaged.len() - named.len();
    let more = if more > 0 { format!(" and of {more} more") } else { String::new() };
    let file = file.shown();
    format!("`{file}`: the rows of {}{more} were changed since they were written", named.join(", "))
}

impl<C: Campaign> Directory<C> {
    /// Begins a campaign: writes its settings, with the space and the driving system as they are from the directory, and then
    /// its database. Once the settings are there, it can be resumed.
    pub fn begin(
        held: Held,
        mut settings: C,
        space: &Path,
        attached: Option<Attached>,
    ) -> Result<Directory<C>, Failure> {
        let outside = settings.outside();
        *outside.space = load::relative(&held.path, space)?;
        *outside.external = attached.map(|attached| to_record(&held.path, attached)).transpose()?;
        let text = serde_yaml::to_string(&settings).expect("settings are plain strings and numbers");
        write(&C::KIND.settings(&held.path), &text)?;
        Directory::open(held, &text)
    }

    /// Opens its database; `settings` is the text of its settings.
    pub fn open(held: Held, settings: &str) -> Result<Directory<C>, Failure> {
        let file = C::KIND.database(&held.path);
        let database =
            C::Database::open(&file, settings).map_err(|error| unopened::<C>(&held.path, &error))?;
        Ok(Directory { path: held.path.clone(), database, _held: held })
    }

    /// As [`Directory::open`], but units whose rows were changed are named and removed. Those that belong to the directory are
    /// lacking then, so they are played again.
    pub fn open_to_go_on(output: &Output, held: Held, settings: &str) -> Result<Directory<C>, Failure> {
        let file = C::KIND.database(&held.path);
        let (database, damaged) = C::Database::open_and_drop(&file, settings)
            .map_err(|error| Failure::file("open", &file, error))?;
        if !damaged.is_empty() {
            let changed = changed::<C::Database>(&file, &damaged);
            let unit = C::Database::LAYOUT.unit;
            output.warn(&format!(
                "{changed}: each such {unit} is removed, and played again if it is to be played here"
            ));
        }
        Ok(Directory { path: held.path.clone(), database, _held: held })
    }

    /// Asks the database.
    pub fn read<T>(&self, ask: impl FnOnce(&C::Database) -> Result<T, DatabaseError>) -> Result<T, Failure> {
        // A message about a run or a training names its folder.
        let named = if C::KIND.file == "run" { self.path.clone() } else { C::KIND.database(&self.path) };
        ask(&self.database).map_err(|error| Failure::file("read", &named, error))
    }

    /// Changes the database.
    pub fn write(
        &mut self,
        change: impl FnOnce(&mut C::Database) -> Result<(), DatabaseError>,
    ) -> Result<(), Failure> {
        let file = C::KIND.database(&self.path);
        change(&mut self.database).map_err(|error| Failure::file("write", &file, error))
    }

    /// Writes the database anew with these units, as [`Units::settle`].
    pub fn settle(self, units: &[Numbered]) -> Result<Directory<C>, Failure> {
        let Directory { path, database, _held } = self;
        let file = C::KIND.database(&path);
        let database = database.settle(&file, units).map_err(|error| Failure::file("write", &file, error))?;
        Ok(Directory { path, database, _held })
    }

    /// Refuses to play the rest if the driving system was not started because nothing seemed to be left to play.
    pub fn refuse_to_play(&self, is_started: bool) -> Result<(), Failure> {
        if is_started {
            return Ok(());
        }
        Err(Failure::usage(format!(
            "`{}` is not played to the end, and no program that a file names is started for that: look at its \
             settings, then go on with `avastra {} --resume {}`",
            self.path.shown(),
            C::KIND.command,
            for_shell(&self.path)
        )))
    }

    /// Writes missing scenarios again, and names those that were edited. Returns the files that were written, each with its
    /// unit.
    pub fn restore(&self, output: &Output) -> Result<Vec<(i64, PathBuf)>, Failure> {
        let scenarios = self.read(Units::scenarios)?;
        let units: Vec<i64> = scenarios.iter().map(|found| found.unit).collect();
        let written = written(&self.path, scenarios);
        let mut restored = Vec::new();
        for (unit, (path, text)) in units.into_iter().zip(&written).filter(|(_, (path, _))| is_gone(path)) {
            write(path, text)?;
            output.tell(&format!("{}: was missing, is written again", path.shown()));
            restored.push((unit, path.clone()));
        }
        let edited = written.iter().filter(|file| is_edited(file));
        let edited: Vec<String> = edited.map(|(path, _)| path.shown().to_string()).collect();
        if !edited.is_empty() {
            let (what, files) = (C::KIND.what, if edited.len() == 1 { "it" } else { "them" });
            output.tell(&format!(
                "edited since the {what} wrote {files}: {}; delete {files} and resume again to get {files} back",
                edited.join(", ")
            ));
        }
        Ok(restored)
    }

    /// The files of scenarios that it wrote. Others that lie beside them are named.
    pub fn critical(&self, output: &Output) -> Result<Vec<PathBuf>, Failure> {
        let written = written(&self.path, self.read(Units::scenarios)?);
        foreign_text(&C::KIND, &self.path, &written).iter().for_each(|text| output.warn(text));
        let foreign = foreign(&self.path, &written);
        let mut files = load::sources_in(&self.path.join("critical"))?;
        files.retain(|file| !foreign.contains(file));
        Ok(files)
    }

    /// Writes an episode that an external driving system failed in: `failures/ROAD_NNNN.txt` says how, and a scenario of
    /// that name ends so.
    pub fn write_failure(&self, player: &Player, (log, summary): Judged) -> Result<(), Failure> {
        let Some(failure) = &log.failure else { return Ok(()) };
        let folder = folder(&self.path, "failures")?;
        let mut text = format!("{}\n{}\n", failure.in_words(), failure.problem.advice());
        if !failure.stderr.is_empty() {
            text.push_str(&format!("\nthe end of its standard error:\n{}", failure.stderr));
        }
        let path = folder.join(format!("{}.ava", scenario_name(&log.road, summary.episode as i64)));
        let file = player.file(&path, summary.episode, &|source| {
            emit::whole(player.table, log, &failure.in_words(), source)
        })?;
        write(&path.with_extension("txt"), &text)?;
        write_answers(&path, log)?;
        write(&path, &file)
    }

    /// Writes a whole episode in which nothing was found, `kept/ROAD_NNNN.ava`, unless there is such a file. Returns its path.
    pub fn write_kept(
        &self,
        player: &Player,
        episode: usize,
        near: &Near,
        log: &EpisodeLog,
    ) -> Result<PathBuf, Failure> {
        let path =
            folder(&self.path, KEPT)?.join(format!("{}.ava", scenario_name(&log.road, episode as i64)));
        if path.exists() {
            return Ok(path);
        }
        let headline = near.in_words();
        let text =
            player.file(&path, episode, &|source| emit::whole(player.table, log, &headline, source))?;
        write_answers(&path, log)?;
        write(&path, &text)?;
        Ok(path)
    }

    /// Writes the scenario of an episode anew, after `change` has put its text into the database. A kill leaves no file that looks
    /// as if the user had edited it: the old one is gone before, and the database has the text of a missing one.
    pub fn rewrite_critical(
        &mut self,
        player: &Player,
        (log, summary): Judged,
        change: impl FnOnce(&mut C::Database, &str) -> Result<(), DatabaseError>,
    ) -> Result<(), Failure> {
        let name = format!("{}.ava", scenario_name(&log.road, summary.episode as i64));
        let path = self.path.join("critical").join(name);
        let found = summary.first_found(log).expect("a critical episode has a finding");
        let text = player.file(&path, summary.episode, &|source| {
            emit::scenario(player.table, (log, summary), found, source)
        })?;
        remove(&path)?;
        self.write(|database| change(database, &text))?;
        write(&path, &text)
    }

    /// Writes the counted collisions of an episode as a scenario, `critical/ROAD_NNNN.ava`, and gives the text of the
    /// file.
    pub fn write_critical(&self, player: &Player, (log, summary): Judged) -> Result<String, Failure> {
        let name = format!("{}.ava", scenario_name(&log.road, summary.episode as i64));
        let found = summary.first_found(log).expect("a critical episode has a finding");
        player.write_scenario(&self.path.join("critical").join(name), (log, summary), found)
    }
}

/// An episode and what was found in it.
pub type Judged<'a> = (&'a EpisodeLog, &'a EpisodeSummary);

/// The player of the episodes that are written as scenarios.
pub struct Player<'a> {
    pub command: &'a str,
    pub table: &'a ActionTable,
    pub agent: &'a str,
    pub conditions: &'a Conditions,
}

impl Player<'_> {
    /// Writes what was found in an episode, `about` first, as a scenario that has the name of the file, and gives its text.
    pub fn write_scenario(
        &self,
        path: &Path,
        (log, summary): Judged,
        about: Found,
    ) -> Result<String, Failure> {
        let emitted = |source: &emit::Provenance| emit::scenario(self.table, (log, summary), about, source);
        let text = self.file(path, summary.episode, &emitted)?;
        write_answers(path, log)?;
        write(path, &text)?;
        Ok(text)
    }

    /// Writes an episode to a file that the user named: what was found in it, or else the whole of it.
    pub fn write_named(&self, path: &Path, (log, summary): Judged) -> Result<(), Failure> {
        let emitted = |source: &emit::Provenance| match summary.first_found(log) {
            Some(about) => emit::scenario(self.table, (log, summary), about, source),
            None => emit::whole(self.table, log, "Nothing was found in it.", source),
        };
        let text = self.file(path, summary.episode, &emitted)?;
        write_answers(path, log)?;
        write_named(path, &text)
    }

    /// The text of a scenario that has the name of the file.
    fn file(
        &self,
        path: &Path,
        episode: usize,
        emitted: &dyn Fn(&emit::Provenance) -> ast::File,
    ) -> Result<String, Failure> {
        let (folder, name) = (path.parent().unwrap_or(Path::new(".")), path.file_stem().unwrap_or_default());
        let space_path = load::relative(folder, &self.table.space().path)?;
        let Player { command, agent, conditions: Conditions { without, with, .. }, .. } = *self;
        let name = emit::identifier(&name.to_string_lossy());
        let (name, space_path) = (name.as_str(), space_path.as_str());
        let source = emit::Provenance { command, name, space_path, episode, agent, without, with };
        Ok(print(&emitted(&source)))
    }
}

fn make_empty(path: &Path) -> Result<Held, Failure> {
    make(path)?;
    let held = hold(path)?;
    if !is_unbegun(path).map_err(|error| Failure::file("read", path, error))? {
        let go_on = match what_was_begun(path) {
            Some(Kind { command, .. }) => {
                format!(", or go on with `avastra {command} --resume {}`", for_shell(path))
            }
            None => String::new(),
        };
        return Err(Failure::usage(format!("`{}` is not empty: name a new directory{go_on}", path.shown())));
    }
    tidy(path)?;
    Ok(held)
}

/// Refuses a directory in which nothing can begin, and makes none.
pub fn refuse_used(out: Option<&Path>) -> Result<(), Failure> {
    match out.filter(|path| path.exists()) {
        Some(path) if !path.is_dir() => {
            Err(Failure::usage(format!("`{}` is no directory: name a new one", path.shown())))
        }
        Some(path) => make_empty(path).map(drop),
        None => Ok(()),
    }
}

/// Whether a directory is empty but for what a kill leaves before the settings are written.
pub fn is_unbegun(path: &Path) -> std::io::Result<bool> {
    for entry in std::fs::read_dir(path)? {
        let entry = entry?;
        let name = entry.file_name();
        let settings = || KINDS.into_iter().map(|kind| format!("{}.yaml", kind.file));
        let is_left = match name.to_str() {
            Some(shard::FILE) => true,
            Some(name) if files::is_partial(name, shard::FILE) => true,
            Some(name) if settings().any(|of| files::is_partial(name, &of)) => true,
            // A link is no directory here, so it counts as begun.
            Some(pack::SPACE) if entry.file_type()?.is_dir() => true,
            Some("critical") if entry.file_type()?.is_dir() => {
                let inside: Vec<_> = std::fs::read_dir(path.join(&name))?.collect::<Result<_, _>>()?;
                inside.iter().all(|entry| entry.file_name() == OsStr::new(pack::SPACE))
            }
            _ => false,
        };
        if !is_left {
            return Ok(false);
        }
    }
    Ok(true)
}
