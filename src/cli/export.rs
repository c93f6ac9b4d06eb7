//! `avastra export`: emitted scenarios as files of other tools.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use avastra_base::outside::Shown;
use avastra_campaign::run::recorded;
use avastra_exchange::export::{self, ExportError, Recording, record};

use super::arguments::{ExportArguments, ExportEgo, ExportFormat, ExportProfile};
use super::error::Failure;
use super::files::{copy_map, folder, make, target, write};
use super::output::{Output, plural};
use super::parallel::each_file;
use super::replay::refutation;
use super::{export_space, look, pack};

/// The folder of what is written, beside the scenarios, unless another one is named.
pub const FOLDER: &str = "exported";

/// Writes every file's scenario, played again, in another tool's format. A scenario that does not replay is refused.
pub fn export(output: &Output, arguments: &ExportArguments) -> Result<(), Failure> {
    refuse_senseless(arguments)?;
    if export_space::is_asked(arguments) {
        return export_space::export_spaces(output, arguments);
    }
    if arguments.to == ExportFormat::Ava {
        let Some(folder) = &arguments.out else {
            return Err(Failure::usage("`--to ava` needs `--out DIR`, the folder that can be moved"));
        };
        return pack::pack(output, &arguments.many.files, folder);
    }
    let targets = targets(arguments)?;
    let maps = Mutex::new(());
    let exported = each_file(output, &arguments.many, None, |file| {
        let (table, scenario) = look::unchanged(output, file)?;
        let ads = recorded(&scenario)?;
        let recording = match record(&table, &scenario, &ads) {
            Ok(recording) => recording,
            Err(ExportError::Run(error)) => return Err(error.into()),
            Err(error @ ExportError::Refuted { .. }) => {
                let written = Err(error.to_string());
                return Ok(Exported {
                    file: file.clone(),
                    written,
                    left_out: Vec::new(),
                    refused: Vec::new(),
                });
            }
        };
        // A scenario with refused actions is exported only as a CSV table, to look for the reason.
        if !recording.refused.is_empty() && arguments.to != ExportFormat::Csv {
            let written = Err(format!("it does not replay: {}", recording.refused.join("; ")));
            return Ok(Exported { file: file.clone(), written, left_out: Vec::new(), refused: Vec::new() });
        }
        let (written, left_out) = write_all(arguments, &recording, &targets[file], &maps)?;
        Ok(Exported { file: file.clone(), written: Ok(written), left_out, refused: recording.refused })
    })?;
    let mut refuted = 0;
    for Exported { file, written, left_out, refused } in &exported.done {
        refused.iter().for_each(|step| output.warn(&format!("{}: {step}", file.shown())));
        if !left_out.is_empty() {
            output.aside(&format!("{}: left out: {}", file.shown(), left_out.join("; ")));
        }
        match written {
            Ok(files) => output.tell(&format!("{}: {}", file.shown(), files[0].shown())),
            Err(reason) => {
                refuted += 1;
                output.say(&format!("{}: {reason}", file.shown()));
            }
        }
    }
    let written: BTreeSet<&PathBuf> =
        exported.done.iter().filter_map(|exported| exported.written.as_ref().ok()).flatten().collect();
    if !exported.is_single() {
        let done = exported.done.len() - refuted;
        output.say(&format!("{}: {} written", plural(done, "scenario"), plural(written.len(), "file")));
    }
    let left_out: Vec<serde_json::Value> = exported
        .done
        .iter()
        .filter(|exported| !exported.left_out.is_empty())
        .map(|exported| serde_json::json!({ "file": exported.file, "what": exported.left_out }))
        .collect();
    output.result(serde_json::json!({
        "files": written, "left_out": left_out, "refuted": refuted, "failed": exported.failed_in_json(),
    }));
    exported.complete("exported")?;
    refutation(refuted)
}

/// The result for one file: the files that were written, or why it does not replay.
struct Exported {
    file: PathBuf,
    written: Result<Vec<PathBuf>, String>,
    /// The parts of the scenario that its file leaves out, or has otherwise than asked for.
    left_out: Vec<String>,
    /// The written actions that do not happen.
    refused: Vec<String>,
}

/// Options that mean nothing for a format are mistakes.
fn refuse_senseless(arguments: &ExportArguments) -> Result<(), Failure> {
    let is_openscenario = arguments.to == ExportFormat::Openscenario;
    if arguments.natural && !is_openscenario {
        return Err(Failure::usage("`--natural` is for `--to openscenario`"));
    }
    if arguments.profile.is_some() && !is_openscenario {
        return Err(Failure::usage("`--profile` is for `--to openscenario`"));
    }
    match (arguments.to, arguments.ego) {
        (ExportFormat::Commonroad, Some(ExportEgo::Controller)) => Err(Failure::usage(
            "CommonRoad has no controllers: `--ego controller` is for `--to openscenario`",
        )),
        (ExportFormat::Csv, Some(_)) => {
            Err(Failure::usage("`--ego` is not for `--to csv`: the ego vehicle is number 0"))
        }
        (ExportFormat::Ava, Some(_)) => {
            Err(Failure::usage("`--ego` is not for `--to ava`: the files stay as they are"))
        }
        _ => Ok(()),
    }
}

/// Where each file goes: no two to one place.
fn targets(arguments: &ExportArguments) -> Result<BTreeMap<PathBuf, PathBuf>, Failure> {
    let mut targets = BTreeMap::new();
    let mut sources: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    for file in &arguments.many.files {
        let target = target(file, arguments.out.as_ref(), FOLDER, extension(arguments.to))?;
        if let Some(other) = sources.insert(target.clone(), file).filter(|other| other != file) {
            return Err(Failure::usage(format!(
                "`{}` and `{}` would both be written to `{}`: export them to two folders",
                other.shown(),
                file.shown(),
                target.shown()
            )));
        }
        targets.insert(file.clone(), target);
    }
    Ok(targets)
}

fn extension(format: ExportFormat) -> &'static str {
    match format {
        ExportFormat::Openscenario => "xosc",
        ExportFormat::Commonroad => "xml",
        ExportFormat::Csv => "csv",
        ExportFormat::Ava => "ava",
    }
}

/// Writes the file of a scenario, and the files that it needs beside it. Returns all paths, the scenario's own first, and
/// the parts left out. Scenarios share `maps`, so that two of them do not write the same map at once.
fn write_all(
    arguments: &ExportArguments,
    recording: &Recording,
    target: &Path,
    maps: &Mutex<()>,
) -> Result<(Vec<PathBuf>, Vec<String>), Failure> {
    let into = target.parent().unwrap_or(Path::new(""));
    match &arguments.out {
        Some(named) => make(named)?,
        None => drop(folder(into.parent().unwrap_or(Path::new("")), FOLDER)?),
    }
    match arguments.to {
        ExportFormat::Openscenario => {
            let name = map_name(&recording.map_path)?;
            let map = target.with_file_name(name);
            {
                let _one_at_a_time = maps.lock().unwrap_or_else(PoisonError::into_inner);
                copy_map(&recording.map_path, &map)?;
            }
            let export::Written { text, left_out } = export::openscenario(recording, name, style(arguments));
            write(target, &text)?;
            Ok((vec![target.to_owned(), map], left_out))
        }
        ExportFormat::Commonroad => {
            let with_ego = arguments.ego == Some(ExportEgo::Trajectory);
            write(target, &export::commonroad(recording, with_ego))?;
            Ok((vec![target.to_owned()], Vec::new()))
        }
        ExportFormat::Csv => {
            write(target, &export::csv(recording))?;
            Ok((vec![target.to_owned()], Vec::new()))
        }
        ExportFormat::Ava => unreachable!("files of our own are copied before anything is played"),
    }
}

/// How an OpenSCENARIO file is to be.
fn style(arguments: &ExportArguments) -> export::Style {
    let version = match arguments.profile {
        Some(ExportProfile::Carla) => export::Version::Carla,
        None => export::Version::V1_2,
    };
    let ego = match arguments.ego {
        None | Some(ExportEgo::Trajectory) => export::Ego::Trajectory,
        Some(ExportEgo::Controller) => export::Ego::Controller,
        Some(ExportEgo::None) => export::Ego::None,
    };
    let others = if arguments.natural { export::Others::Natural } else { export::Others::Exact };
    export::Style { version, ego, others }
}

/// The name by which a file refers to the map beside it.
pub fn map_name(map: &Path) -> Result<&str, Failure> {
    map.file_name().and_then(|name| name.to_str()).ok_or_else(|| {
        Failure::usage(format!(
            "no OpenSCENARIO file can name the map `{}`: give it a name in UTF-8",
            map.shown()
        ))
    })
}
