//! Run directories: `run.yaml`, `run.db` and `critical/*.ava`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::action::ActionTable;
use crate::emit;
use crate::episode::EpisodeLog;
use crate::run::{Database, EpisodeSummary, VERSION};
use crate::sim::ENGINE;

use super::error::Failure;
use super::files::write;
use super::load;
use super::output::Output;

/// A run directory on disk.
pub struct RunDirectory {
    pub path: PathBuf,
    pub database: Database,
}

/// Makes a new directory, or the next free `runs/NNNN`.
pub fn create_empty(out: Option<&Path>) -> Result<PathBuf, Failure> {
    match out {
        Some(path) => {
            make_empty(path)?;
            Ok(path.to_owned())
        }
        None => next_free(Path::new("runs")),
    }
}

/// Makes a run directory, with `critical/` for its scenarios.
pub fn create(out: Option<&Path>) -> Result<PathBuf, Failure> {
    let path = create_empty(out)?;
    let critical = path.join("critical");
    std::fs::create_dir_all(&critical).map_err(|error| Failure::file("create", &critical, error))?;
    Ok(path)
}

/// Writes `run.yaml`. It comes before the database: from then on the run can be resumed.
pub fn write_settings(directory: &Path, settings: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_yaml::to_string(settings).expect("settings are plain strings and numbers");
    write(&directory.join("run.yaml"), &text)
}

/// What every kind of settings begins with.
#[derive(serde::Deserialize)]
struct Begun {
    avastra: String,
    engine: String,
    space: PathBuf,
    space_digest: String,
}

/// The settings of an interrupted run, training or study, and the table of its space, if neither the space nor
/// avastra has changed since. The settings are in the file `KIND.yaml`; `what` is what was begun, in a word.
pub fn resume<S: serde::de::DeserializeOwned>(
    output: &Output,
    directory: &Path,
    kind: &str,
    what: &str,
) -> Result<(S, ActionTable), Failure> {
    let path = directory.join(format!("{kind}.yaml"));
    if !path.is_file() {
        let directory = directory.display();
        return Err(Failure::usage(format!("`{directory}` is no {kind} directory: it has no {kind}.yaml")));
    }
    let text = load::text(&path)?;
    let settings = serde_yaml::from_str(&text).map_err(|error| Failure::file("read", &path, error))?;
    let begun: Begun = serde_yaml::from_str(&text).map_err(|error| Failure::file("read", &path, error))?;
    if (begun.engine.as_str(), begun.avastra.as_str()) != (ENGINE, VERSION) {
        return Err(Failure::usage(format!(
            "the {what} was begun by avastra {} in world `{}`, this is avastra {VERSION} in `{ENGINE}`: begin a new one",
            begun.avastra, begun.engine
        )));
    }
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
    Ok((settings, table))
}

impl RunDirectory {
    /// An existing directory, with its database.
    pub fn open(path: PathBuf) -> Result<RunDirectory, Failure> {
        let file = path.join("run.db");
        let database = Database::open(&file).map_err(|error| Failure::file("open", &file, error))?;
        Ok(RunDirectory { path, database })
    }

    /// Writes the counted collisions of an episode as a scenario, `critical/ROAD_NNNN.ava`. `agent` is the one that
    /// played it, `rules` are those switched off and those switched on.
    pub fn write_critical(
        &self,
        command: &str,
        table: &ActionTable,
        (log, summary): (&EpisodeLog, &EpisodeSummary),
        agent: &str,
        [without, with]: [&[String]; 2],
    ) -> Result<(), Failure> {
        let name = format!("{}_{:04}", log.road, summary.episode);
        let critical = self.path.join("critical");
        let space_path = load::relative(&critical, &table.space().path)?;
        let (name, space_path, episode) = (name.as_str(), space_path.as_str(), summary.episode);
        let source = emit::Provenance { command, name, space_path, episode, agent, without, with };
        let file = emit::scenario(table, log, summary, &source);
        write(&critical.join(format!("{name}.ava")), &crate::syntax::print(&file))
    }
}

fn make_empty(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| Failure::file("create", path, error))?;
    let mut entries = std::fs::read_dir(path).map_err(|error| Failure::file("read", path, error))?;
    if entries.next().is_some() {
        return Err(Failure::usage(format!(
            "`{}` is not empty: name a new directory, or go on with `--resume {}`",
            path.display(),
            path.display()
        )));
    }
    Ok(())
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
