//! `avastra replay`: emitted scenarios again, every claim checked.

use std::path::Path;

use crate::model::Avoidability;
use crate::model::Scenario;
use crate::oracle;
use crate::study;

use super::arguments::ReplayArguments;
use super::error::Failure;
use super::load;
use super::output::Output;
use super::progress::plural;

/// Replays the scenario of every file; with `--ads` only tells what happens.
pub fn replay(output: &Output, arguments: &ReplayArguments) -> Result<(), Failure> {
    let (mut refuted, mut confirmed) = (0, 0);
    let mut results = Vec::new();
    for path in &arguments.files {
        let (table, scenario) = load::scenario(output, path)?;
        let ads = arguments.ads.as_deref();
        let log = study::replay(&table, &scenario, ads, &mut |_, _, _| {})
            .map_err(|error| Failure::usage(error.to_string()))?;
        let judgements = study::judge_replay(&table, &scenario, ads, &log)
            .map_err(|error| Failure::usage(error.to_string()))?;
        if let Some(ads) = ads {
            let counted = oracle::counted(table.space(), &log, &judgements).len();
            let collisions = plural(log.collisions.len(), "collision");
            let avoidable = judgements.iter().filter(|j| j.class == Avoidability::Avoidable).count();
            output.say(&format!(
                "{} against {ads}: {collisions}, {counted} counted, {avoidable} avoidable",
                path.display()
            ));
            results.push(serde_json::json!({
                "file": path, "scenario": scenario.name, "ads": ads,
                "collisions": log.collisions.len(), "counted": counted, "judgements": judgements,
            }));
            continue;
        }
        let verdicts = oracle::verify(table.space(), &scenario, &log, &judgements);
        let wrong = verdicts.iter().filter(|verdict| !verdict.confirmed).count();
        refuted += wrong;
        confirmed += verdicts.len() - wrong;
        report(output, path, &scenario, &verdicts);
        results.push(serde_json::json!({ "file": path, "scenario": scenario.name, "claims": verdicts }));
    }
    output.result(
        "replay",
        serde_json::json!({ "confirmed": confirmed, "refuted": refuted, "scenarios": results }),
    );
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

fn report(output: &Output, path: &Path, scenario: &Scenario, verdicts: &[oracle::ClaimResult]) {
    let wrong: Vec<&oracle::ClaimResult> = verdicts.iter().filter(|verdict| !verdict.confirmed).collect();
    if verdicts.is_empty() {
        output.say(&format!("{}: {} makes no claim", path.display(), scenario.name));
        return;
    }
    if wrong.is_empty() {
        let claims = plural(verdicts.len(), "claim");
        output.tell(&format!("{}: {} holds, {claims} confirmed", path.display(), scenario.name));
        return;
    }
    output.say(&format!("{}: {} is refuted", path.display(), scenario.name));
    for verdict in wrong {
        output.say(&format!("  claimed {}\n  found   {}", verdict.claim, verdict.found));
    }
}
