//! Run directories: `run.yaml`, `run.db` and `critical/*.ava`; those of studies have `study.yaml` and `study.db`.
//!
//! A directory is begun when its settings stand in it. What a kill leaves before that counts as empty, so the
//! directory can be begun again; what it leaves after that can be resumed. One process at a time works in it.

use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::action::ActionTable;
use crate::ads::external::{Attached, ExternalSettings};
use crate::emit;
use crate::episode::EpisodeLog;
use crate::model::digest;
use crate::run::{Database, EpisodeSummary, Units, VERSION};
use crate::sim::ENGINE;
use crate::syntax::yaml_mistake;

use super::error::Failure;
use super::files::{write, write_answers};
use super::load;
use super::output::Output;
use super::pack;

/// A directory that no other process works in while this lives.
pub struct Held {
    pub path: PathBuf,
    /// The lock is on the directory itself, and ends with the process however that ends.
    _lock: Option<File>,
}

/// A run directory on disk.
pub struct RunDirectory {
    pub path: PathBuf,
    pub database: Database,
    _held: Held,
}

/// Makes a new directory, or the next free `runs/NNNN`.
pub fn create_empty(out: Option<&Path>) -> Result<Held, Failure> {
    match out {
        Some(path) => make_empty(path),
        None => hold(&next_free(Path::new("runs"))?),
    }
}

/// Makes a run directory, with `critical/` for its scenarios.
pub fn create(out: Option<&Path>) -> Result<Held, Failure> {
    let held = create_empty(out)?;
    let critical = held.path.join("critical");
    std::fs::create_dir_all(&critical).map_err(|error| Failure::file("create", &critical, error))?;
    Ok(held)
}

/// Takes a directory for this process alone.
pub fn hold(path: &Path) -> Result<Held, Failure> {
    // Where folders cannot be opened or locked, as on some network drives, there is no lock.
    let lock = File::open(path).ok();
    if let Some(Err(TryLockError::WouldBlock)) = lock.as_ref().map(File::try_lock) {
        let path = path.display();
        return Err(Failure::usage(format!(
            "another avastra is at work in `{path}`: wait for it, or name another directory"
        )));
    }
    Ok(Held { path: path.to_owned(), _lock: lock })
}

/// Writes the settings, `run.yaml` or `study.yaml`, and returns their text. They come before the database: from then
/// on the run can be resumed.
pub fn write_settings(
    directory: &Path,
    kind: &str,
    settings: &impl serde::Serialize,
) -> Result<String, Failure> {
    let text = serde_yaml::to_string(settings).expect("settings are plain strings and numbers");
    write(&directory.join(format!("{kind}.yaml")), &text)?;
    Ok(text)
}

/// An external driving system as settings in `directory` record it: its working directory is one from there, so that the
/// same program is started wherever the run is resumed from.
///
/// # Errors
/// If one of the two folders does not exist.
pub fn to_record(directory: &Path, attached: Attached) -> Result<Attached, Failure> {
    let folder = attached.settings.working_directory.as_deref().unwrap_or(Path::new("."));
    let working_directory = Some(PathBuf::from(load::relative(directory, folder)?));
    Ok(Attached { settings: ExternalSettings { working_directory, ..attached.settings }, ..attached })
}

/// The same as it is to be started.
pub fn from_record(directory: &Path, attached: Attached) -> Attached {
    let working_directory = attached.settings.working_directory.map(|folder| directory.join(folder));
    Attached { settings: ExternalSettings { working_directory, ..attached.settings }, ..attached }
}

/// What every kind of settings begins with.
#[derive(serde::Deserialize)]
struct Begun {
    avastra: String,
    engine: String,
    space: PathBuf,
    space_digest: String,
}

/// A directory that is gone on with.
pub struct Resumed<S> {
    pub settings: S,
    /// The settings as they stand in the file.
    pub text: String,
    pub table: ActionTable,
    pub held: Held,
}

/// The settings of an interrupted run, training or study, and the table of its space, if neither the space nor
/// avastra has changed since. The settings are in the file `KIND.yaml`; `what` is what was begun, in a word.
pub fn resume<S: serde::de::DeserializeOwned>(
    output: &Output,
    directory: &Path,
    kind: &str,
    what: &str,
) -> Result<Resumed<S>, Failure> {
    let path = directory.join(format!("{kind}.yaml"));
    let found = what_was_begun(directory);
    if found.is_some_and(|found| found != what) {
        let (found, directory) = (found.unwrap_or_default(), directory.display());
        let command = if found == "training" { "train" } else { found };
        return Err(Failure::usage(format!(
            "`{directory}` holds a {found}: go on with `avastra {command} --resume {directory}`"
        )));
    }
    if !path.is_file() {
        let directory = directory.display();
        return Err(Failure::usage(format!(
            "`{directory}` is no {kind} directory: it has no {kind}.yaml; begin one with `--out {directory}`"
        )));
    }
    let held = hold(directory)?;
    // The scenarios of a run whose database is lost cannot be told from new ones.
    let database = directory.join(format!("{kind}.db"));
    let left = load::sources_in(&directory.join("critical")).unwrap_or_default();
    // A kill may leave an empty file before anything is in it.
    let lost = match std::fs::metadata(&database) {
        Err(_) => Some("missing"),
        Ok(found) => (found.len() == 0).then_some("empty"),
    };
    match lost {
        Some(how) if !left.is_empty() => {
            return Err(Failure::usage(format!(
                "`{}` is {how}, and `critical` has scenarios: begin a new {what}, or delete them to begin this one anew",
                database.display()
            )));
        }
        Some(how) => output.tell(&format!("`{}` is {how}: the {what} begins anew", database.display())),
        None => {}
    }
    let (settings, text) = settings_of(directory, kind, what)?;
    let begun: Begun = serde_yaml::from_str(&text).expect("it was read so before");
    let table = load::table(output, &directory.join(&begun.space))?;
    let meaning = &table.space().meaning;
    if !meaning.is_sealed_by(&begun.space_digest) {
        let differences = meaning.differences(&begun.space_digest);
        let differences = differences.map_or_else(String::new, |found| format!(" ({found})"));
        return Err(Failure::usage(format!(
            "`{}` has changed since the {what} was begun{differences}: begin a new one",
            table.space().path.display()
        )));
    }
    Ok(Resumed { settings, text, table, held })
}

/// The settings in the file `KIND.yaml` and their text, if they were written by this version of avastra.
pub fn settings_of<S: serde::de::DeserializeOwned>(
    directory: &Path,
    kind: &str,
    what: &str,
) -> Result<(S, String), Failure> {
    let path = directory.join(format!("{kind}.yaml"));
    let text = load::text(&path)?;
    let refuse = |error| Failure::file("read", &path, yaml_mistake(&error, &text));
    // Settings of another version may have other fields: this comes first.
    let begun: Begun = serde_yaml::from_str(&text).map_err(refuse)?;
    if (begun.engine.as_str(), begun.avastra.as_str()) != (ENGINE, VERSION) {
        return Err(Failure::usage(format!(
            "the {what} in `{}` was begun by avastra {} in world `{}`, this is avastra {VERSION} in `{ENGINE}`: begin a new one",
            directory.display(),
            begun.avastra,
            begun.engine
        )));
    }
    let settings = serde_yaml::from_str(&text).map_err(refuse)?;
    Ok((settings, text))
}

/// `run`, `training`, `study` or `estimate`, if the directory holds one.
pub fn what_was_begun(directory: &Path) -> Option<&'static str> {
    if let Some(kind) =
        ["study", "estimate"].into_iter().find(|kind| directory.join(format!("{kind}.yaml")).is_file())
    {
        return Some(kind);
    }
    let text = load::read(&directory.join("run.yaml")).ok()?;
    let settings: serde_json::Map<String, serde_json::Value> = serde_yaml::from_str(&text).ok()?;
    Some(if settings.contains_key("hyperparameters") { "training" } else { "run" })
}

impl RunDirectory {
    /// A directory with its database; `settings` is the text of `run.yaml`.
    pub fn open(held: Held, settings: &str) -> Result<RunDirectory, Failure> {
        let file = held.path.join("run.db");
        let database =
            Database::open(&file, settings).map_err(|error| Failure::file("open", &file, error))?;
        Ok(RunDirectory { path: held.path.clone(), database, _held: held })
    }

    /// Writes an episode that an external driving system failed in: `failures/ROAD_NNNN.txt` says how, and a scenario of
    /// that name ends so.
    pub fn write_failure(
        &self,
        command: &str,
        table: &ActionTable,
        (log, summary): (&EpisodeLog, &EpisodeSummary),
        agent: &str,
        [without, with]: [&[String]; 2],
    ) -> Result<(), Failure> {
        let Some(failure) = &log.failure else { return Ok(()) };
        let folder = self.path.join("failures");
        std::fs::create_dir_all(&folder).map_err(|error| Failure::file("create", &folder, error))?;
        let name = format!("{}_{:04}", log.road, summary.episode);
        let space_path = load::relative(&folder, &table.space().path)?;
        let (name, space_path, episode) = (name.as_str(), space_path.as_str(), summary.episode);
        let source = emit::Provenance { command, name, space_path, episode, agent, without, with };
        let path = folder.join(format!("{name}.ava"));
        let mut text = format!("{}\n{}\n", failure.in_words(), failure.problem.advice());
        if !failure.stderr.is_empty() {
            text.push_str(&format!("\nthe end of its standard error:\n{}", failure.stderr));
        }
        write(&path.with_extension("txt"), &text)?;
        // Without a step there is nothing to replay.
        if log.steps.is_empty() {
            return Ok(());
        }
        write_answers(&path, log)?;
        let file = emit::failure(table, log, &failure.in_words(), &source);
        write(&path, &crate::syntax::print(&file))
    }

    /// The file with the scenario of an episode.
    pub fn critical(&self, road: &str, episode: usize) -> PathBuf {
        self.path.join("critical").join(format!("{}.ava", scenario_name(road, episode)))
    }

    /// Writes the counted collisions of an episode as a scenario, `critical/ROAD_NNNN.ava`, and gives the digest of the
    /// file. `agent` is the one that played it, `rules` are those switched off and those switched on.
    pub fn write_critical(
        &self,
        command: &str,
        table: &ActionTable,
        (log, summary): (&EpisodeLog, &EpisodeSummary),
        agent: &str,
        rules: [&[String]; 2],
    ) -> Result<String, Failure> {
        let path = self.critical(&log.road, summary.episode);
        write_scenario(&path, command, table, (log, summary), agent, rules)
    }
}

/// Writes the counted collisions of an episode as a scenario that has the name of the file, and gives its digest. `agent`
/// is the one that played it, `rules` are those switched off and those switched on.
pub fn write_scenario(
    path: &Path,
    command: &str,
    table: &ActionTable,
    (log, summary): (&EpisodeLog, &EpisodeSummary),
    agent: &str,
    [without, with]: [&[String]; 2],
) -> Result<String, Failure> {
    let (folder, name) = (path.parent().unwrap_or(Path::new(".")), path.file_stem().unwrap_or_default());
    let space_path = load::relative(folder, &table.space().path)?;
    let name = name.to_string_lossy();
    let (name, space_path, episode) = (&*name, space_path.as_str(), summary.episode);
    let source = emit::Provenance { command, name, space_path, episode, agent, without, with };
    let file = emit::scenario(table, log, summary, &source);
    let text = crate::syntax::print(&file);
    write_answers(path, log)?;
    write(path, &text)?;
    Ok(digest(text.as_bytes()))
}

pub fn scenario_name(road: &str, episode: usize) -> String {
    format!("{road}_{episode:04}")
}

fn make_empty(path: &Path) -> Result<Held, Failure> {
    std::fs::create_dir_all(path).map_err(|error| Failure::file("create", path, error))?;
    let held = hold(path)?;
    if !is_unbegun(path).map_err(|error| Failure::file("read", path, error))? {
        return Err(Failure::usage(format!(
            "`{}` is not empty: name a new directory, or go on with `--resume {}`",
            path.display(),
            path.display()
        )));
    }
    Ok(held)
}

/// Refuses a directory in which nothing can begin, and makes none.
pub fn refuse_used(out: Option<&Path>) -> Result<(), Failure> {
    match out.filter(|path| path.exists()) {
        Some(path) if !path.is_dir() => {
            Err(Failure::usage(format!("`{}` is no directory: name a new one", path.display())))
        }
        Some(path) => make_empty(path).map(drop),
        None => Ok(()),
    }
}

/// Whether a directory is empty but for what a kill leaves before the settings are written.
pub fn is_unbegun(path: &Path) -> std::io::Result<bool> {
    for entry in std::fs::read_dir(path)? {
        let name = entry?.file_name();
        let is_left = match name.to_str() {
            Some("run.yaml.partial" | "study.yaml.partial" | "estimate.yaml.partial") => true,
            Some("shard.yaml" | "shard.yaml.partial" | pack::SPACE) => true,
            Some("critical") => {
                let inside: Vec<_> = std::fs::read_dir(path.join(name))?.collect::<Result<_, _>>()?;
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

/// Makes the first directory `NNNN` that does not exist yet.
fn next_free(runs: &Path) -> Result<PathBuf, Failure> {
    std::fs::create_dir_all(runs).map_err(|error| Failure::file("create", runs, error))?;
    for number in 1.. {
        let path = runs.join(format!("{number:04}"));
        match std::fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(Failure::file("create", &path, error)),
        }
    }
    unreachable!("there is always a next number")
}
