//! `avastra merge`: the shards of a run, a study or an estimate as the directory that one machine would have made.
//!
//! The units of all shards are taken over into one database, whichever shard has them, with the scenarios that were written
//! of them. Their texts are in the database, so their files may be edited or gone. The result is a directory in which all is
//! played. It is ended by the code of `run`, `study` or `estimate`, which settles the database and writes the results.
//! There is no second writer, so the bytes are the same as in the unsharded directory.
//!
//! Shards may have been copied from where they were played. Their settings name files outside of them, the space above all.
//! Each file is looked for at its path, and else by the end of its path, from the working directory, the shard's directory
//! and the folders above them. Any file that means the same serves.
//!
//! Until it is whole, the directory has the name `OUT.partial`. It gets its own name only if its space still means what it
//! meant; then it is ended. A merge that was killed in between is ended by the next one. Two merges into one directory are kept
//! apart by a lock on the mark in it.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::DirEntry;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::files::{self, Lock, PlainName};
use avastra_campaign::run::{
    DatabaseError, Numbered, PolicyReference, Shard, Units, WrittenScenario, settings_differences,
};
use avastra_drivers::external::Attached;
use avastra_lang::syntax::ast::{Expr, ExprKind, FileId, ItemKind};
use avastra_lang::syntax::{parse, print_expr};

use super::arguments::MergeArguments;
use super::campaign::{Cut, Item, Kind, costs};
use super::error::Failure;
use super::files::{folder, make, remove, write};
use super::output::{Output, plural};
use super::{cell_times, load, pack, run_directory, shard};

/// Marks a directory as a merge's, and not a user's. The merge has it locked.
const MARK: &str = "merge.partial";

/// Brings shards together, or says which are missing.
pub fn merge(output: &Output, arguments: &MergeArguments) -> Result<(), Failure> {
    let mut directories = Vec::new();
    for path in &arguments.directories {
        // A shard that was killed at once is as good as one that was never played.
        match path.is_dir() && run_directory::is_unbegun(path).unwrap_or(false) {
            true => output.aside(&format!("{}: nothing was begun there", path.shown())),
            false => directories.push(path.clone()),
        }
    }
    let Some(first) = directories.first() else {
        return Err(Failure::usage("none of the directories holds a run, a study or an estimate"));
    };
    let out = arguments.out.as_deref();
    match run_directory::what_was_begun(first) {
        Some(Kind { merge: Some(merge), .. }) => merge(output, &directories, out),
        Some(Kind { what, .. }) => Err(Failure::usage(format!(
            "`{}` holds a {what}, which is one piece: each episode is chosen with what was learned before",
            first.shown()
        ))),
        None => Err(Failure::usage(format!("`{}` holds no run, study or estimate", first.shown()))),
    }
}

/// The files that the settings of all shards name outside of them.
struct Outside {
    space: PathBuf,
    policy: Option<PathBuf>,
}

/// From one directory to another, and what lies outside both.
struct Way<'a> {
    from: &'a Path,
    to: &'a Path,
    outside: &'a Outside,
}

/// A directory of a shard.
struct Played<C: Cut> {
    path: PathBuf,
    /// The settings as they would stand in the merged directory.
    settings: C,
    /// The text of the settings as they stand in it.
    begun: String,
    shard: Shard,
    /// `None` if nothing was kept before a kill.
    database: Option<C::Database>,
    units: Vec<Numbered>,
}

impl<C: Cut> Played<C> {
    fn file(&self) -> PathBuf {
        C::KIND.database(&self.path)
    }

    fn text(&self) -> String {
        serde_yaml::to_string(&self.settings).expect("settings are plain strings and numbers")
    }

    /// Reads the settings of a directory; `to` is one beside the merged directory, or itself.
    fn read(path: &Path, to: &Path, outside: &Outside) -> Result<Played<C>, Failure> {
        let what = C::KIND.what;
        if run_directory::what_was_begun(path).is_none_or(|found| found.what != what) {
            let path = path.shown();
            return Err(Failure::usage(format!("`{path}` holds no {what}, which the first directory does")));
        }
        let (settings, begun) = run_directory::settings_of::<C>(path)?;
        Ok(Played {
            path: path.to_owned(),
            settings: Way { from: path, to, outside }.settings(settings)?,
            begun,
            shard: shard::kept(path)?,
            database: None,
            units: Vec::new(),
        })
    }

    /// Opens its database.
    fn open(&mut self) -> Result<(), DatabaseError> {
        let file = self.file();
        if run_directory::lost(&file).is_some() {
            return Ok(());
        }
        let (database, damaged) = match C::Database::open_without_damaged(&file, &self.begun) {
            // A kill left a journal, by which the file became empty.
            Err(DatabaseError::Empty) => return Ok(()),
            opened => opened?,
        };
        if let Some(&number) = damaged.first() {
            return Err(DatabaseError::Rows { unit: C::Database::LAYOUT.unit, number });
        }
        self.units = self.settings.numbered(&database)?;
        self.database = Some(database);
        Ok(())
    }
}

/// Brings the shards of one kind together. Without `out`, only says what is missing.
pub fn merged<C: Cut>(output: &Output, directories: &[PathBuf], out: Option<&Path>) -> Result<(), Failure> {
    let outside = Outside::of::<C>(&directories[0])?;
    let Some(out) = out else {
        // Paths in settings are made to lead from one place, to be compared; any place serves.
        let survey = Survey::of::<C>(directories, (Path::new("."), &outside), Some(output))?;
        match survey.missing.is_empty() {
            true => output.aside("nothing is missing"),
            false => output.say(&survey.named()),
        }
        let Survey { shards, missing, .. } = survey;
        output.result(serde_json::json!({ "directory": null, "shards": shards, "missing": missing }));
        return Ok(());
    };
    let (partial, lock) = begin_partial(out)?;
    let brought = Survey::of::<C>(directories, (&partial, &outside), None).and_then(|survey| {
        survey.complete()?;
        bring_together::<C>(output, directories, (&partial, &outside), &survey.settings)?;
        publish::<C>(output, out, (&partial, &outside), &survey.settings)?;
        Ok(survey.shards)
    });
    // Once the directory has its name, another merge may have begun one of the old name.
    if brought.is_err() && lock.is_at(&partial.join(MARK)) {
        discard(&partial)?;
    }
    let shards = brought?;
    // Not how many directories were named: one shard may have been named twice, or copied.
    output.tell(&format!("{}: {} brought together", out.shown(), plural(shards as usize, "shard")));
    C::conclude(output, out)?;
    output.result(serde_json::json!({ "directory": out, "shards": shards, "missing": [] }));
    Ok(())
}

/// The content of the shards' directories.
struct Survey {
    /// The text of the settings in the merged directory.
    settings: String,
    shards: u32,
    /// The numbers of the shards that lack a unit.
    missing: BTreeSet<u32>,
}

impl Survey {
    /// Looks at all directories; `to` is the merged one, or one beside it. A shard whose database is torn is to be played again:
    /// with an output this is said, without one it is an error.
    fn of<C: Cut>(
        directories: &[PathBuf],
        (to, outside): (&Path, &Outside),
        output: Option<&Output>,
    ) -> Result<Survey, Failure> {
        let mut wanted: Option<(String, Vec<Item>)> = None;
        let mut have: BTreeSet<i64> = BTreeSet::new();
        let mut cut: Option<(Shard, &Path)> = None;
        for path in directories {
            // One after another: there may be more shards than files that a process may have open.
            let mut played = Played::<C>::read(path, to, outside)?;
            if let Err(error) = played.open() {
                let told = output.filter(|_| error.is_torn());
                let failure = run_directory::unopened::<C>(path, &error);
                match told {
                    Some(output) => output.warn(&failure.to_string()),
                    None => return Err(failure),
                }
            }
            if played.settings.is_one_piece() {
                let path = path.shown();
                return Err(Failure::usage(format!(
                    "`{path}` is one piece, because it ends by time: there is nothing to merge"
                )));
            }
            let text = played.text();
            let (first, _) = wanted.get_or_insert_with(|| (text.clone(), played.settings.work()));
            if let Some(what) = settings_differences(first, &text) {
                let (path, first) = (path.shown(), directories[0].shown());
                return Err(Failure::usage(format!(
                    "`{path}` is no shard of the {} in `{first}`, where {what}",
                    C::KIND.what
                )));
            }
            have.extend(played.units.iter().map(|(_, place)| place));
            if !played.shard.is_whole() {
                let (known, known_path) = cut.get_or_insert((played.shard, path));
                if known.count() != played.shard.count() {
                    let (path, shard, known_path) = (path.shown(), played.shard, known_path.shown());
                    return Err(Failure::usage(format!(
                        "`{path}` is shard {shard}, `{known_path}` is shard {known}: play all with one number of shards"
                    )));
                }
            }
        }
        let (settings, work) = wanted.expect("there is a directory");
        let shards = cut.map_or(1, |(shard, _)| shard.count());
        let of_items = Shard::of_items(&costs(&work), shards);
        let lacks = |(item, _): &(&Item, u32)| !item.is_in(&have);
        let missing = work.iter().zip(of_items).filter(lacks).map(|(_, shard)| shard).collect();
        Ok(Survey { settings, shards, missing })
    }

    /// The missing shards: `3,17`, as a scheduler takes them.
    fn named(&self) -> String {
        self.missing.iter().map(u32::to_string).collect::<Vec<_>>().join(",")
    }

    /// Refuses if something is missing.
    fn complete(&self) -> Result<(), Failure> {
        let (count, named) = (self.shards, self.named());
        let (missing, them) = match self.missing.len() {
            0 => return Ok(()),
            1 => (format!("shard {named} of {count} is"), "it"),
            _ => (format!("shards {named} of {count} are"), "them"),
        };
        Err(Failure::usage(format!(
            "{missing} missing or not played to the end: play {them} (`--shard I/{count}`) or go on with {them} (`--resume`), then \
             merge again"
        )))
    }
}

/// Makes an empty directory beside the merged one, in place of what a killed merge left, and takes it for this process.
fn begin_partial(out: &Path) -> Result<(PathBuf, Lock), Failure> {
    let mut name = out.file_name().ok_or_else(|| Failure::usage("`--out` needs a name"))?.to_owned();
    name.push(".partial");
    let beside = out.parent().unwrap_or(Path::new(""));
    make(beside)?;
    loop {
        let partial = folder(beside, &name)?;
        let mark = partial.join(MARK);
        if !besides_mark(&partial)?.is_empty() && !mark.is_file() {
            return Err(Failure::usage(format!(
                "`{}` is in the way: a merge is written there before it has its name",
                partial.shown()
            )));
        }
        match Lock::of_file(&mark) {
            Ok(lock) if lock.is_at(&mark) => {
                clear(&partial)?;
                return Ok((partial, lock));
            }
            // A merge that ended at this moment has removed it.
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                return Err(Failure::usage(format!(
                    "another merge is at work in `{}`: wait for it, or name another directory",
                    partial.shown()
                )));
            }
            Err(error) => return Err(Failure::file("write", &mark, error)),
        }
    }
}

/// The entries in the directory of a merge besides its mark.
fn besides_mark(partial: &Path) -> Result<Vec<DirEntry>, Failure> {
    let entries = std::fs::read_dir(partial).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let mut entries = entries.map_err(|error| Failure::file("read", partial, error))?;
    entries.retain(|entry| entry.file_name() != MARK);
    Ok(entries)
}

/// Removes what is in the directory of a merge, but for its mark.
fn clear(partial: &Path) -> Result<(), Failure> {
    let failed = |error| Failure::file("remove", partial, error);
    for entry in besides_mark(partial)? {
        let (path, is_folder) = (entry.path(), entry.file_type().map_err(failed)?.is_dir());
        if is_folder { files::remove_all(&path) } else { files::remove(&path) }.map_err(failed)?;
    }
    Ok(())
}

/// Removes an unfinished merge; its mark goes last.
fn discard(partial: &Path) -> Result<(), Failure> {
    clear(partial)?;
    remove(&partial.join(MARK))?;
    // Another merge may have begun in it at this moment.
    let _ = files::remove_empty(partial);
    Ok(())
}

/// Writes settings, database and scenarios.
fn bring_together<C: Cut>(
    output: &Output,
    directories: &[PathBuf],
    (partial, outside): (&Path, &Outside),
    text: &str,
) -> Result<(), Failure> {
    write(&C::KIND.settings(partial), text)?;
    let file = C::KIND.database(partial);
    let mut into = C::Database::open(&file, text).map_err(|error| Failure::file("open", &file, error))?;
    for path in directories {
        let _held = run_directory::hold(path)?;
        let mut played = Played::<C>::read(path, partial, outside)?;
        played.open().map_err(|error| run_directory::unopened::<C>(path, &error))?;
        if let Some(database) = &played.database {
            let written =
                database.scenarios().map_err(|error| Failure::file("read", &played.file(), error))?;
            let way = Way { from: path, to: partial, outside };
            let moved = if C::Database::keeps_scenarios() { way.files(output, written)? } else { Vec::new() };
            C::take_beside([path, partial])?;
            into.take(&played.file(), &played.units, &moved)
                .map_err(|error| Failure::file("merge", &played.file(), error))?;
        }
    }
    Ok(())
}

/// Gives the merged directory its name, unless the same directory stands there already. `text` is the text of its settings.
fn publish<C: Cut>(
    output: &Output,
    out: &Path,
    (partial, outside): (&Path, &Outside),
    text: &str,
) -> Result<(), Failure> {
    // Its warnings are told when the directory is ended; why it cannot be is told here.
    let resumed = |output| run_directory::resume::<C>(output, partial, true).map(drop);
    resumed(&Output::silent()).or_else(|_| resumed(output))?;
    if !out.exists() || std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_none()) {
        // In this order: a kill in between leaves a whole directory, and not a partial one that no command would end.
        files::rename(partial, out).map_err(|error| Failure::file("write", out, error))?;
        return remove(&out.join(MARK));
    }
    let silent = Output::silent();
    C::conclude(&silent, partial)?;
    // A merge that was killed after the rename left a directory in which all is played, but whose results are missing.
    if holds_all::<C>(out, (partial, outside), text).unwrap_or(false) {
        C::conclude(&silent, out)?;
    }
    let (mut merged, known) = (load::everything_in(partial)?, load::everything_in(out)?);
    // Machines need not have taken the same time.
    for name in [MARK, cell_times::FILE] {
        merged.remove(Path::new(name));
    }
    let is_equal = |(name, path): (&PathBuf, &PathBuf)| -> Result<bool, Failure> {
        let Some(known) = known.get(name) else { return Ok(false) };
        files::are_equal(known, path).map_err(|error| Failure::file("read", known, error))
    };
    // Further files, a page for example, do not make it another directory.
    let equal: Vec<bool> = merged.iter().map(is_equal).collect::<Result<_, _>>()?;
    discard(partial)?;
    match equal.contains(&false) {
        false => remove(&out.join(MARK)),
        true => Err(Failure::usage(format!("`{}` is not empty: name a new directory", out.shown()))),
    }
}

/// Whether a directory has the settings and the units of the merged one, so that it can be ended without playing anything.
fn holds_all<C: Cut>(out: &Path, (partial, outside): (&Path, &Outside), text: &str) -> Result<bool, Failure> {
    let places = |path: &Path| -> Result<(String, BTreeSet<i64>), Failure> {
        let mut played = Played::<C>::read(path, partial, outside)?;
        played.open().map_err(|error| run_directory::unopened::<C>(path, &error))?;
        Ok((played.text(), played.units.iter().map(|(_, place)| *place).collect()))
    };
    let ((settings, there), (_, merged)) = (places(out)?, places(partial)?);
    Ok(settings == text && there.is_superset(&merged))
}

impl Outside {
    /// The files that the settings of a directory name, at their paths or elsewhere, if their meaning is unchanged.
    fn of<C: Cut>(directory: &Path) -> Result<Outside, Failure> {
        let (mut settings, _) = run_directory::settings_of::<C>(directory)?;
        let named = settings.outside();
        let silent = Output::silent();
        let (path, seal, policy) =
            (&*named.space, named.space_digest, named.policy.as_deref().and_then(Option::as_ref));
        let is_sealed = |file: &PathBuf| {
            load::table(&silent, file).is_ok_and(|table| table.space().meaning.is_sealed_by(seal))
        };
        let direct = directory.join(path);
        let space = match found("space", path, directory, &is_sealed) {
            Err(_) if direct.is_file() => {
                // Changes of the space are said before the directory is published. A policy cannot be read in such a space.
                let policy = policy.map(|policy| directory.join(&policy.file));
                return Ok(Outside { space: direct, policy });
            }
            found => found?,
        };
        let policy = policy.map(|policy| {
            let is_it = |file: &PathBuf| {
                load::policy(&silent, file).is_ok_and(|(_, found)| found.digest == policy.digest)
            };
            found("policy", &policy.file, directory, &is_it)
        });
        Ok(Outside { space, policy: policy.transpose()? })
    }
}

/// The file that the settings of a directory name, where they say or elsewhere.
fn found(
    what: &str,
    path: &str,
    directory: &Path,
    is_it: &dyn Fn(&PathBuf) -> bool,
) -> Result<PathBuf, Failure> {
    let direct = directory.join(path);
    if is_it(&direct) {
        return Ok(direct);
    }
    elsewhere(path, directory).into_iter().find(is_it).ok_or_else(|| {
        let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy();
        let reason = format!(
            "its {what} is not at `{path}` from there, or has changed since, and no `{name}` that means the same is found from \
             the folder that you work in: merge in the folder that the shards were played from"
        );
        Failure::file("merge", directory, reason)
    })
}

/// Files that a relative path may mean if it leads nowhere because its directory was moved. Candidates are the path without
/// its way up, then ever shorter ends of it. Each is tried from the working directory, the directory, and the folders above.
fn elsewhere(path: &str, directory: &Path) -> Vec<PathBuf> {
    let parts: Vec<Component> =
        Path::new(path).components().filter(|part| matches!(part, Component::Normal(_))).collect();
    let folders: Vec<PathBuf> =
        [Path::new("."), directory].iter().filter_map(|folder| folder.canonicalize().ok()).collect();
    let mut found: Vec<PathBuf> = Vec::new();
    for begin in 0..parts.len() {
        let end: PathBuf = parts[begin..].iter().collect();
        let files = folders.iter().flat_map(|folder| folder.ancestors()).map(|folder| folder.join(&end));
        let new: Vec<PathBuf> = files.filter(|file| file.is_file() && !found.contains(file)).collect();
        found.extend(new);
    }
    found
}

impl Way<'_> {
    /// The path of the space in one directory as it stands in another. A space inside the directory stays there.
    fn space(&self, path: &str) -> Result<String, Failure> {
        let is_inside = Path::new(path).is_relative() && !Path::new(path).starts_with("..");
        if is_inside { Ok(path.to_owned()) } else { load::relative(self.to, &self.outside.space) }
    }

    /// The driving system is not started here, so its working directory need not exist on this machine.
    fn external(&self, external: Option<Attached>) -> Result<Option<Attached>, Failure> {
        let moved = external.map(|external| run_directory::from_record(self.from, external));
        moved.map(|attached| run_directory::to_record(self.to, attached)).transpose()
    }

    /// Settings as they stand in the other directory.
    fn settings<C: Cut>(&self, mut settings: C) -> Result<C, Failure> {
        let named = settings.outside();
        *named.space = self.space(named.space)?;
        *named.external = self.external(named.external.take())?;
        if let Some(policy) = named.policy {
            let moved = policy.take().zip(self.outside.policy.as_deref()).map(|(policy, found)| {
                load::relative(self.to, found).map(|file| PolicyReference { file, ..policy })
            });
            *policy = moved.transpose()?;
        }
        Ok(settings)
    }

    /// Takes over the files of a directory with these scenarios, and returns the scenarios with their texts in the other one.
    fn files(
        &self,
        output: &Output,
        written: Vec<WrittenScenario>,
    ) -> Result<Vec<(WrittenScenario, String)>, Failure> {
        let [from, to] = self.within("critical")?;
        folder(self.to, "critical")?;
        let critical = Way { from: &from, to: &to, ..*self };
        if from.join(pack::SPACE).is_dir() {
            copy_folder(OsStr::new(pack::SPACE), [&from, &to])?;
        }
        let remark = run_directory::remark_on_copy(self.from);
        remark.iter().for_each(|remark| output.warn(remark));
        // Copies of one meaning may differ in comments: that of the first directory is kept.
        if remark.is_none() && self.from.join(pack::SPACE).is_dir() && !self.to.join(pack::SPACE).exists() {
            copy_folder(OsStr::new(pack::SPACE), [self.from, self.to])?;
        }
        let copied = |found: WrittenScenario| {
            let file = (from.join(&found.name), found.text.clone());
            if run_directory::is_edited(&file) {
                let path = file.0.shown();
                output.warn(&format!("{path} was edited since it was written: what was written is taken"));
            }
            let text = copy_scenario(&found.name, &found.text, &critical)?;
            Ok::<_, Failure>((found, text))
        };
        let moved = written.into_iter().map(copied).collect::<Result<_, _>>()?;
        self.failures()?;
        Ok(moved)
    }

    /// Takes over the episodes that an external driving system failed in.
    fn failures(&self) -> Result<(), Failure> {
        let [from, to] = self.within("failures")?;
        if !from.is_dir() {
            return Ok(());
        }
        let failures = Way { from: &from, to: &to, ..*self };
        folder(self.to, "failures")?;
        let failed = |error| Failure::file("read", &from, error);
        for entry in std::fs::read_dir(&from).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = PlainName::new(path.file_name().unwrap_or_default().to_string_lossy());
            let name = name.map_err(|error| Failure::file("merge", &path, error))?;
            match path.extension().and_then(OsStr::to_str) {
                Some("ava") => drop(copy_scenario(&name, &own_text(&path)?, &failures)?),
                Some("txt") => copy_text(&to.join(name), &own_text(&path)?)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Folders of this name in both directories. The first may be missing, and must be no link.
    fn within(&self, folder: &str) -> Result<[PathBuf; 2], Failure> {
        let [from, to] = [self.from, self.to].map(|directory| directory.join(folder));
        files::own_folder(&from).map_err(|error| Failure::file("merge", &from, error))?;
        Ok([from, to])
    }
}

/// Writes a scenario of a shard, with the recorded answers that lie beside it there. Returns its text, in which paths are
/// relative to the new file.
fn copy_scenario(name: &PlainName, text: &str, way: &Way) -> Result<String, Failure> {
    let text = moved_scenario(text, way)?;
    copy_text(&way.to.join(name), &text)?;
    let answers = load::answers_path(&way.from.join(name));
    if answers.is_file() {
        copy_text(&load::answers_path(&way.to.join(name)), &own_text(&answers)?)?;
        let said = load::stderr_path(&way.from.join(name));
        if said.is_file() {
            copy_text(&load::stderr_path(&way.to.join(name)), &own_text(&said)?)?;
        }
    }
    Ok(text)
}

/// The text of a file in a shard, which must be no link.
fn own_text(file: &Path) -> Result<String, Failure> {
    files::own_file(file).map_err(|error| Failure::file("merge", file, error))?;
    load::text(file)
}

/// Writes a text where none is; one that is there must be the same.
fn copy_text(to: &Path, text: &str) -> Result<(), Failure> {
    match to.exists() {
        false => write(to, text),
        true if load::text(to)? == *text => Ok(()),
        true => {
            let name = to.file_name().unwrap_or_default().to_string_lossy();
            Err(Failure::usage(format!("two of the directories have another `{name}`: one was edited")))
        }
    }
}

/// The text of an emitted scenario with the path of its space as it is from another folder.
fn moved_scenario(text: &str, way: &Way) -> Result<String, Failure> {
    let (file, _) = parse(FileId::default(), text);
    let mut moved = text.to_owned();
    for item in file.items.iter().rev() {
        let ItemKind::Use(used) = &item.kind else { continue };
        let path = ExprKind::Text(way.space(&used.path.value)?);
        moved.replace_range(used.path.span.start..used.path.span.end, &print_expr(&Expr::built(path)));
    }
    Ok(moved)
}

/// Copies the folder `name` of one directory into another, with all that is in it.
fn copy_folder(name: &OsStr, [from, to]: [&Path; 2]) -> Result<(), Failure> {
    let (from, to) = (from.join(name), folder(to, name)?);
    let failed = |error| Failure::file("merge", &from, error);
    files::own_folder(&from).map_err(failed)?;
    for entry in std::fs::read_dir(&from).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name();
        match entry.file_type().map_err(failed)?.is_dir() {
            true => copy_folder(&name, [&from, &to])?,
            // A kill left it, or its maker is still at work.
            false if name.to_str().is_some_and(files::is_temporary) => {}
            false => copy_text(&to.join(&name), &own_text(&entry.path())?)?,
        }
    }
    Ok(())
}
