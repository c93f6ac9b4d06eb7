//! `avastra import`: OpenSCENARIO files of others as scenarios of the language.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra_campaign::episode::{End, Outcome};
use avastra_campaign::files::PlainName;
use avastra_campaign::run::{Stage, recorded};
use avastra_exchange::import::{self, Files, Imported, Refusal};
use avastra_lang::check::{self, ReadError};
use avastra_world::action::ActionTable;

use super::arguments::ImportArguments;
use super::error::Failure;
use super::files::{copy_map, folder, make, target, write_new};
use super::load;
use super::output::{Output, plural};

/// The folder of what is written, beside the files, unless another one is named.
const FOLDER: &str = "imported";

/// Files of a folder of catalogues that are read at most.
const CATALOGUES_MAX: usize = 100;

/// Writes every file's scenario, with its map beside it. What the language cannot say is listed, and nothing is written.
pub fn import(output: &Output, arguments: &ImportArguments) -> Result<(), Failure> {
    let targets = targets(arguments)?;
    let parameters = parameters(arguments)?;
    let mut written: BTreeSet<PathBuf> = BTreeSet::new();
    let (mut refused, mut results) = (Vec::new(), Vec::new());
    for (file, target) in arguments.files.iter().zip(targets) {
        match one(file, &target, arguments, &parameters)? {
            Ok((imported, map)) => {
                output.say(&format!("{}: {}", file.display(), target.display()));
                for note in &imported.notes {
                    output.tell(&format!("  {note}"));
                }
                results.push(serde_json::json!({
                    "file": file, "scenario": target, "notes": imported.notes, "refused": [],
                }));
                written.extend([target, map]);
            }
            Err(refusals) => {
                for Refusal { line, element, reason } in &refusals {
                    output.say(&format!("{}:{line}: {element}: {reason}", file.display()));
                }
                results.push(serde_json::json!({
                    "file": file, "scenario": null, "notes": [], "refused": refusals,
                }));
                refused.push(refusals);
            }
        }
    }
    if arguments.files.len() > 1 {
        let imported = arguments.files.len() - refused.len();
        output.say(&format!("{}: {imported} imported", plural(arguments.files.len(), "file")));
    }
    output.result(serde_json::json!({ "files": written, "imported": results }));
    match refused.len() {
        0 => Ok(()),
        _ => Err(Failure::Source { errors: refused.iter().map(Vec::len).sum() }),
    }
}

/// Imports one file: what it says and where its map lies now, or all that is refused.
fn one(
    file: &Path,
    target: &Path,
    arguments: &ImportArguments,
    parameters: &BTreeMap<String, String>,
) -> Result<Result<(Imported, PathBuf), Vec<Refusal>>, Failure> {
    let text = load::text(file)?;
    let beside = file.parent().unwrap_or(Path::new(""));
    let (name, ego) = (file.file_stem().unwrap_or_default().to_string_lossy(), arguments.ego.as_deref());
    let imported = match import::openscenario(&text, &name, ego, parameters, &Beside { folder: beside }) {
        Ok(imported) => imported,
        Err(refusals) => return Ok(Err(refusals)),
    };
    let source = beside.join(slashed(&imported.map));
    // The name of the copy comes from the file, and the copy must lie beside the scenario.
    let name = source.file_name().unwrap_or_default().to_string_lossy();
    let name = PlainName::new(name).map_err(|error| Failure::file("import", file, error))?;
    let map = target.with_file_name(&*name);
    if let Err(reason) = plays(&imported, target, &map, &source) {
        return Ok(Err(vec![Refusal { line: 1, element: "OpenSCENARIO".to_owned(), reason }]));
    }
    match &arguments.out {
        Some(named) => make(named)?,
        None => drop(folder(beside, FOLDER)?),
    }
    copy_map(&source, &map)?;
    match load::read(target) {
        Ok(there) if there == imported.text => {}
        _ => write_new(target, &imported.text)?,
    }
    Ok(Ok((imported, map)))
}

/// Whether the scenario compiles, and everyone appears when it is played with the driving system `modular`.
fn plays(imported: &Imported, target: &Path, map: &Path, source: &Path) -> Result<(), String> {
    let (own, map) = (check::normal(target), check::normal(map));
    let read = |path: &Path| match path {
        path if path == own => Ok(imported.text.clone()),
        path if path == map => load::read_used(source),
        _ => Err(ReadError("the scenario uses its map alone".to_owned())),
    };
    let loaded = check::load(target, &read).map_err(|error| error.to_string())?;
    if let Some(mistake) = loaded.diagnostics.iter().find(|diagnostic| diagnostic.is_error()) {
        return Err(format!("as a scenario of the language it does not compile: {}", mistake.message));
    }
    let (Some(space), Some(scenario)) = (loaded.space, loaded.scenario) else {
        return Err("it gives no scenario".to_owned());
    };
    let table = ActionTable::new(space);
    let ads = recorded(&scenario).map_err(|error| error.to_string())?;
    let stage = Stage::new(&table, &scenario).map_err(|error| error.to_string())?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    match log.steps.first().map(|step| &step.outcome) {
        Some(Outcome::Refused { reason, .. }) => Err(format!("what it places cannot appear: {reason}")),
        Some(Outcome::Passed) if log.end != End::Arrived => {
            Err("the moment at which its road user appears does not come".to_owned())
        }
        _ => Ok(()),
    }
}

/// The files beside a scenario.
struct Beside<'a> {
    folder: &'a Path,
}

impl Files for Beside<'_> {
    fn map(&self, path: &str) -> Result<String, String> {
        load::read_used(&self.folder.join(slashed(path))).map_err(|error| error.to_string())
    }

    fn catalogues(&self, folder: &str) -> Result<Vec<String>, String> {
        let folder = self.folder.join(slashed(folder));
        let files = load::files_in(&folder, "xosc").map_err(|error| error.to_string())?;
        Ok(files.iter().take(CATALOGUES_MAX).filter_map(|file| load::read(file).ok()).collect())
    }
}

/// The values of `--set`, by name.
fn parameters(arguments: &ImportArguments) -> Result<BTreeMap<String, String>, Failure> {
    let pair = |text: &String| match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err(Failure::usage(format!("`--set {text}`: write NAME=VALUE"))),
    };
    arguments.set.iter().map(pair).collect()
}

/// Where each file's scenario goes: no two to one place.
fn targets(arguments: &ImportArguments) -> Result<Vec<PathBuf>, Failure> {
    let mut targets: Vec<PathBuf> = Vec::new();
    for file in &arguments.files {
        let target = target(file, arguments.out.as_ref(), FOLDER, "ava")?;
        if targets.contains(&target) {
            let message =
                format!("two files would be written to `{}`: import them to two folders", target.display());
            return Err(Failure::usage(message));
        }
        targets.push(target);
    }
    Ok(targets)
}

/// A path as other systems may write it.
fn slashed(path: &str) -> PathBuf {
    PathBuf::from(path.replace('\\', "/"))
}
