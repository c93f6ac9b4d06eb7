//! `avastra replay`: emitted scenarios again, every claim checked.

use std::path::Path;

use crate::ads::ModularConfig;
use crate::ads::Selected;
use crate::model::Avoidability;
use crate::model::Scenario;
use crate::oracle;
use crate::study;
use crate::study::RunError;
use crate::study::Stage;

use super::arguments::ReplayArguments;
use super::error::Failure;
use super::load;
use super::output::Output;
use super::progress::plural;

/// Replays the scenario of every file; with `--ads` or another profile only tells what happens.
pub fn replay(output: &Output, arguments: &ReplayArguments) -> Result<(), Failure> {
    let (mut refuted, mut confirmed) = (0, 0);
    let mut results = Vec::new();
    let profile = arguments.ads_config.as_deref().map(load::profile).transpose()?;
    for path in &arguments.files {
        let (table, scenario) = load::scenario(output, path)?;
        let (ads, is_recorded) = driver(arguments, profile.as_ref(), &scenario)
            .map_err(|error| Failure::usage(error.to_string()))?;
        let name = match &arguments.ads_config {
            Some(path) => format!("{} with {}", ads.name(), path.display()),
            None => ads.name().to_owned(),
        };
        let stage = Stage::new(&table, &scenario).map_err(|error| Failure::usage(error.to_string()))?;
        let log = stage.play(&ads, &mut |_, _, _| {});
        if !is_recorded {
            let judgements = stage.judge(&ads, &log);
            let counted = oracle::counted(table.space(), &log, &judgements).len();
            let collisions = plural(log.collisions.len(), "collision");
            let avoidable = judgements.iter().filter(|j| j.class == Avoidability::Avoidable).count();
            output.say(&format!(
                "{} against {name}: {collisions}, {counted} counted, {avoidable} avoidable",
                path.display()
            ));
            results.push(serde_json::json!({
                "file": path, "scenario": scenario.name, "ads": name,
                "collisions": log.collisions.len(), "counted": counted, "judgements": judgements,
            }));
            continue;
        }
        let verdicts = stage.verify(&ads, &log);
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

/// Who drives, and whether that is who the scenario was made with.
fn driver(
    arguments: &ReplayArguments,
    profile: Option<&ModularConfig>,
    scenario: &Scenario,
) -> Result<(Selected, bool), RunError> {
    if arguments.ads.is_none() && profile.is_none() {
        return Ok((study::recorded(scenario)?, true));
    }
    let recorded = scenario.origin.ads.as_deref().unwrap_or(study::DEFAULT_ADS);
    let ads = study::driving_system(arguments.ads.as_deref().unwrap_or(recorded))?;
    let Some(profile) = profile else { return Ok((ads, false)) };
    let same = arguments.ads.is_none() && scenario.origin.profile_digest == Some(profile.digest());
    Ok((ads.with_profile(*profile)?, same))
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
