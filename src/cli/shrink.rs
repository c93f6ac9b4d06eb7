//! `avastra shrink`: the smallest scenario that still makes the same crash.

use std::path::Path;
use std::path::PathBuf;

use crate::emit;
use crate::episode::Outcome;
use crate::episode::Script;
use crate::episode::Setup;
use crate::model::Claim;
use crate::oracle;
use crate::study;
use crate::study::EpisodeSummary;
use crate::study::Stage;

use super::arguments::ShrinkArguments;
use super::error::Failure;
use super::load;
use super::output::Output;
use super::progress::plural;
use super::run_directory::write;

/// Writes the file's scenario as small as it gets, and checks every claim of what it wrote.
pub fn shrink(output: &Output, arguments: &ShrinkArguments) -> Result<(), Failure> {
    let usage = |error: study::RunError| Failure::usage(error.to_string());
    let (table, scenario) = load::scenario(output, &arguments.file)?;
    let ads = study::recorded(&scenario).map_err(usage)?;
    let stage = Stage::new(&table, &scenario).map_err(usage)?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    let judgements = stage.judge(&ads, &log);
    let Some(&index) = oracle::counted(table.space(), &log, &judgements).first() else {
        let name = &scenario.name;
        return Err(Failure::usage(format!("`{name}` has no counted collision that could be kept")));
    };
    let before = Script::of_log(&log);
    let shrunk = oracle::shrink(&stage.setup(&ads), &log, index, &judgements);

    let path = arguments.output.clone().unwrap_or_else(|| beside(&arguments.file));
    let folder = path.parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() {
        std::fs::create_dir_all(folder).map_err(|error| Failure::file("create", folder, error))?;
    }
    let origin = &scenario.origin;
    let source = emit::Provenance {
        command: "shrink",
        name: &scenario.name,
        space_path: &load::relative(folder, &table.space().path)?,
        episode: origin.episode.unwrap_or(0) as usize,
        agent: origin.policy.as_deref().unwrap_or("none"),
        without: &origin.without,
        with: &origin.with,
    };
    let mut summary = EpisodeSummary::new(table.space(), source.episode, &shrunk.log, shrunk.judgements);
    if scenario.claims.iter().any(|claim| matches!(claim, Claim::Cause { .. })) {
        let setup = Setup { start: shrunk.start, ..stage.setup(&ads) };
        summary.find_causes(&setup, &shrunk.log).map_err(|error| Failure::usage(error.to_string()))?;
    }
    write(&path, &crate::syntax::print(&emit::scenario(&table, &shrunk.log, &summary, &source)))?;
    let refuted = refuted(output, &path)?;

    let (steps, actions) = size(&before);
    let (steps_left, actions_left) = size(&shrunk.script);
    output.say(&format!(
        "{}: {} with {} became {} with {} ({} played)",
        path.display(),
        plural(steps, "step"),
        plural(actions, "action"),
        plural(steps_left, "step"),
        plural(actions_left, "action"),
        plural(shrunk.plays as usize, "episode")
    ));
    for step in &shrunk.log.steps {
        if let Outcome::Done { draw, .. } = &step.outcome {
            output.tell(&format!("  {}", emit::action_text(&table, draw)));
        }
    }
    output.result(
        "shrink",
        serde_json::json!({
            "file": arguments.file, "output": path, "scenario": scenario.name,
            "steps_before": steps, "actions_before": actions,
            "steps": steps_left, "actions": actions_left,
            "plays": shrunk.plays, "refuted": refuted,
        }),
    );
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

/// Number of claims of a written file that do not hold.
fn refuted(output: &Output, path: &Path) -> Result<usize, Failure> {
    let usage = |error: study::RunError| Failure::usage(error.to_string());
    let (table, scenario) = load::scenario(output, path)?;
    let ads = study::recorded(&scenario).map_err(usage)?;
    let stage = Stage::new(&table, &scenario).map_err(usage)?;
    let log = stage.play(&ads, &mut |_, _, _| {});
    let claims = stage.verify(&ads, &log);
    Ok(claims.iter().filter(|claim| !claim.confirmed).count())
}

/// Steps, and how many of them do something.
fn size(script: &Script) -> (usize, usize) {
    (script.steps.len(), script.steps.iter().flatten().count())
}

fn beside(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{stem}.shrunk.ava"))
}
