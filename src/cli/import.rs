//! `avastra import`: OpenSCENARIO files of others as spaces of the language.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra_base::outside::{Shown, in_line};
use avastra_campaign::episode::{End, Outcome};
use avastra_campaign::files::PlainName;
use avastra_campaign::run::{Stage, recorded};
use avastra_exchange::import::{self, Files, Refusal, Request};
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

/// Writes every file's space, with its maps beside it. A part that the language cannot express is listed, and nothing is
/// written for its file.
pub fn import(output: &Output, arguments: &ImportArguments) -> Result<(), Failure> {
    let targets = targets(arguments)?;
    let parameters = parameters(arguments)?;
    let mut written: BTreeSet<PathBuf> = BTreeSet::new();
    let (mut refused, mut results) = (Vec::new(), Vec::new());
    for (file, target) in arguments.files.iter().zip(targets) {
        let taken = match one(file, &target, arguments, &parameters) {
            // One of many files does not keep the others from being read.
            Err(failure) if arguments.files.len() > 1 => {
                let reason = failure.to_string();
                Err(vec![Refusal { scenario: None, line: 1, element: "OpenSCENARIO".to_owned(), reason }])
            }
            taken => taken?,
        };
        match taken {
            Ok(taken) => {
                let (space, scenario) = (&taken.space, &taken.scenario);
                let paths: Vec<String> =
                    space.iter().chain(scenario).map(|path| path.shown().to_string()).collect();
                output.say(&format!("{}: {}", file.shown(), paths.join(", ")));
                for note in &taken.notes {
                    output.tell(&format!("  {}", in_line(note)));
                }
                results.push(serde_json::json!({
                    "file": file, "space": space, "scenario": scenario, "notes": taken.notes, "refused": [],
                }));
                written.extend(taken.space.into_iter().chain(taken.scenario).chain(taken.maps));
            }
            Err(refusals) => {
                for Refusal { scenario, line, element, reason } in &refusals {
                    let place = match scenario {
                        Some(scenario) => folder_of(file).join(slashed(scenario)),
                        None => file.clone(),
                    };
                    let (element, reason) = (in_line(element), in_line(reason));
                    output.say(&format!("{}:{line}: {element}: {reason}", place.shown()));
                }
                results.push(serde_json::json!({
                    "file": file, "space": null, "scenario": null, "notes": [], "refused": refusals,
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

/// The files written for an imported file.
struct Taken {
    /// `None` of a file that avastra exported: its scenario stands alone.
    space: Option<PathBuf>,
    /// `None` if the space has more than one row.
    scenario: Option<PathBuf>,
    maps: Vec<PathBuf>,
    notes: BTreeSet<String>,
}

/// Imports one file.
fn one(
    file: &Path,
    target: &Path,
    arguments: &ImportArguments,
    parameters: &BTreeMap<String, String>,
) -> Result<Result<Taken, Vec<Refusal>>, Failure> {
    let text = load::text(file)?;
    let beside = folder_of(file);
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let request = Request {
        name: &name,
        ego: arguments.ego.as_deref(),
        parameters,
        variations_max: arguments.variations,
    };
    let imported = match import::openscenario(&text, &request, &Beside { folder: beside }) {
        Ok(imported) => imported,
        Err(refusals) => return Ok(Err(refusals)),
    };
    let refused = |reason: String| {
        vec![Refusal { scenario: None, line: 1, element: "OpenSCENARIO".to_owned(), reason }]
    };
    // Where each map lies beside the space, and where it comes from.
    let mut maps: BTreeMap<PathBuf, PathBuf> = BTreeMap::new();
    for map in &imported.maps {
        let source = beside.join(slashed(map));
        // The name of the copy comes from the file, and the copy must lie beside the space.
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let name = PlainName::new(name).map_err(|error| Failure::file("import", file, error))?;
        if let Some(other) = maps.insert(target.with_file_name(&*name), source.clone()) {
            let (other, source) = (other.shown(), source.shown());
            return Ok(Err(refused(format!("two maps have one name: `{other}` and `{source}`"))));
        }
    }
    let stem = target.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let space = imported.space.map(|text| (target.to_owned(), text));
    // A space and its scenario are two files: what uses the space has no use for the scenario.
    let beside_it = || target.with_file_name(format!("{stem}_scenario.ava"));
    let at = if space.is_some() { beside_it() } else { target.to_owned() };
    let scenario = imported.scenario.map(|text| (at, text));
    let texts: Vec<&(PathBuf, String)> = space.iter().chain(&scenario).collect();
    if let Err(reason) = plays(&texts, &maps) {
        return Ok(Err(refused(reason)));
    }
    // Nothing is written if something of it cannot be.
    let is_other = |(path, text): &&&(PathBuf, String)| {
        path.symlink_metadata().is_ok() && load::read(path).ok().as_ref() != Some(text)
    };
    if let Some((path, _)) = texts.iter().find(is_other) {
        let message = format!(
            "`{}` is there already, and says something else: name another folder with `--out`",
            path.shown()
        );
        return Err(Failure::usage(message));
    }
    match &arguments.out {
        Some(named) => make(named)?,
        None => drop(folder(beside, FOLDER)?),
    }
    for (map, source) in &maps {
        copy_map(source, map)?;
    }
    for (path, text) in texts.iter().filter(|(path, _)| path.symlink_metadata().is_err()) {
        write_new(path, text)?;
    }
    let [space, scenario] = [space, scenario].map(|written| written.map(|(path, _)| path));
    Ok(Ok(Taken { space, scenario, maps: maps.into_keys().collect(), notes: imported.notes }))
}

/// Whether the space compiles, and everyone appears when its scenario, the last of the texts, is played with the driving
/// system `modular`.
fn plays(texts: &[&(PathBuf, String)], maps: &BTreeMap<PathBuf, PathBuf>) -> Result<(), String> {
    let maps: BTreeMap<PathBuf, &PathBuf> =
        maps.iter().map(|(map, source)| (check::normal(map), source)).collect();
    let read = |path: &Path| {
        if let Some(source) = maps.get(path) {
            return load::read_used(source);
        }
        let own = texts.iter().find(|(own, _)| check::normal(own) == path);
        own.map(|(_, text)| text.clone()).ok_or_else(|| ReadError::new("it uses its maps alone".to_owned()))
    };
    let Some((last, _)) = texts.last() else { return Ok(()) };
    let loaded = check::load(last, &read).map_err(|error| error.to_string())?;
    if let Some(mistake) = loaded.diagnostics.iter().find(|diagnostic| diagnostic.is_error()) {
        return Err(format!("as a space of the language it does not compile: {}", mistake.message));
    }
    let Some(space) = loaded.space else { return Err("it gives no space".to_owned()) };
    let Some(scenario) = loaded.scenario else { return Ok(()) };
    let table = ActionTable::new(space);
    let ads = recorded(&scenario).map_err(|error| error.to_string())?;
    let stage = Stage::new(&table, &scenario).map_err(|error| error.to_string())?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    // A scenario of avastra's own may say that nothing happens at first, or at all.
    let acts_first = scenario.steps.iter().any(|step| step.number == 0 && step.row.is_some());
    match log.steps.first().map(|step| &step.outcome) {
        Some(Outcome::Refused { reason, .. }) => Err(format!("what it places cannot appear: {reason}")),
        Some(Outcome::Passed) if acts_first && log.end != End::Arrived => {
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
    fn scenario(&self, path: &str) -> Result<String, String> {
        let path = self.folder.join(slashed(path));
        load::read_named(&path, &["xosc"], "no scenario (`.xosc`)").map_err(|error| error.to_string())
    }

    fn map(&self, path: &str) -> Result<String, String> {
        load::read_used(&self.folder.join(slashed(path))).map_err(|error| error.to_string())
    }

    fn catalogues(&self, folder: &str) -> Result<Vec<(String, String)>, String> {
        let folder = self.folder.join(slashed(folder));
        let files = load::files_in(&folder, "xosc").map_err(|error| load::reason(&error))?;
        let stem = |file: &Path| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let read = |file: &PathBuf| Some((stem(file), load::read(file).ok()?));
        Ok(files.iter().take(CATALOGUES_MAX).filter_map(read).collect())
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
                format!("two files would be written to `{}`: import them to two folders", target.shown());
            return Err(Failure::usage(message));
        }
        targets.push(target);
    }
    Ok(targets)
}

/// The folder in which a file lies.
fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// A path as other systems may write it.
fn slashed(path: &str) -> PathBuf {
    PathBuf::from(path.replace('\\', "/"))
}
