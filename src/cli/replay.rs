//! `avastra replay`: emitted scenarios again, every claim checked.

use std::path::Path;

use crate::ads::ModularConfig;
use crate::ads::Selected;
use crate::episode::Collision;
use crate::model::Avoidability;
use crate::model::Scenario;
use crate::model::vocabulary::Word;
use crate::oracle;
use crate::study;
use crate::study::Measures;
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
        let (ads, is_recorded) = driver(arguments.ads.as_deref(), profile.as_ref(), &scenario)
            .map_err(|error| Failure::usage(error.to_string()))?;
        let name = match &arguments.ads_config {
            Some(path) => format!("{} with {}", ads.name(), path.display()),
            None => ads.name().to_owned(),
        };
        let stage = Stage::new(&table, &scenario).map_err(|error| Failure::usage(error.to_string()))?;
        let mut measures = Measures::default();
        let log = stage.play(&ads, &mut |world, _, contacts| measures.note(world, contacts));
        let (criticality, pet_s) = measures.of_steps(&log);
        let severities: Vec<oracle::Severity> = log.collisions.iter().map(oracle::severity).collect();
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
                "severities": severities, "criticality": criticality, "pet_s": pet_s,
            }));
            continue;
        }
        let verdicts = stage.verify(&ads, &log);
        let wrong = verdicts.iter().filter(|verdict| !verdict.confirmed).count();
        refuted += wrong;
        confirmed += verdicts.len() - wrong;
        report(output, path, &scenario, &verdicts);
        log.collisions.iter().zip(&severities).for_each(|(collision, severity)| {
            output.tell(&severity_text(collision, severity));
        });
        results.push(serde_json::json!({ "file": path, "scenario": scenario.name, "claims": verdicts,
            "severities": severities, "criticality": criticality, "pet_s": pet_s }));
    }
    output.result(
        "replay",
        serde_json::json!({ "confirmed": confirmed, "refuted": refuted, "scenarios": results }),
    );
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

/// Who drives, and whether that is who the scenario was made with.
pub fn driver(
    ads: Option<&str>,
    profile: Option<&ModularConfig>,
    scenario: &Scenario,
) -> Result<(Selected, bool), RunError> {
    if ads.is_none() && profile.is_none() {
        return Ok((study::recorded(scenario)?, true));
    }
    let recorded = scenario.origin.ads.as_deref().unwrap_or(study::DEFAULT_ADS);
    let selected = study::driving_system(ads.unwrap_or(recorded))?;
    let Some(profile) = profile else { return Ok((selected, false)) };
    let same = ads.is_none() && scenario.origin.profile_digest == Some(profile.digest());
    Ok((selected.with_profile(*profile)?, same))
}

/// How hard a collision was, in a line.
fn severity_text(collision: &Collision, severity: &oracle::Severity) -> String {
    format!(
        "  {} npc#{} ({}) hit at {:.2} s by the ego vehicle's {}: closing at {:.1} m/s, delta-v {:.1} m/s, the other's {:.1} m/s",
        collision.body.name(),
        collision.contact.obstacle,
        severity.approach,
        collision.contact.time_s,
        severity.side,
        severity.closing_speed_mps,
        severity.delta_v_mps,
        severity.obstacle_delta_v_mps
    )
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
