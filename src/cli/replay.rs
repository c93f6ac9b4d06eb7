//! `avastra replay`: plays emitted scenarios again and checks every claim.

use std::path::Path;

use crate::ads::ModularConfig;
use crate::episode::Collision;
use crate::model::vocabulary::{Priority, Word};
use crate::model::{Avoidability, Scenario};
use crate::oracle;
use crate::run;
use crate::run::{Gauges, Stage};

use super::arguments::ReplayArguments;
use super::error::Failure;
use super::load;
use super::output::Output;
use super::output::plural;
use super::parallel::each_file;

/// Replays the scenario of every file; with `--ads` or another profile only tells what happens.
pub fn replay(output: &Output, arguments: &ReplayArguments) -> Result<(), Failure> {
    let profile = arguments.ads_config.as_deref().map(load::profile).transpose()?;
    let played = each_file(&arguments.many, |path| play(output, arguments, profile.as_ref(), path));
    let (mut refuted, mut confirmed, mut refuted_files) = (0, 0, 0);
    let (mut results, mut failed) = (Vec::new(), None);
    for (path, played) in arguments.many.files.iter().zip(played) {
        let played = match played {
            Ok(played) => played,
            // A broken file does not hide the results of the others.
            Err(failure) => {
                if arguments.many.files.len() > 1 {
                    output.tell(&format!("{}: {failure}", path.display()));
                }
                failed = failed.or(Some(failure));
                continue;
            }
        };
        match &played.claims {
            None => output.say(&format!("{} against {}", path.display(), played.told)),
            Some(verdicts) => {
                let wrong = verdicts.iter().filter(|verdict| !verdict.confirmed).count();
                refuted += wrong;
                confirmed += verdicts.len() - wrong;
                refuted_files += usize::from(wrong > 0);
                report(output, path, &played.scenario, verdicts);
                if !played.told.is_empty() {
                    output.tell(&played.told);
                }
            }
        }
        results.push(played.result);
    }
    if arguments.many.files.len() > 1 && confirmed + refuted > 0 {
        let files = plural(results.len(), "scenario");
        output.say(&format!(
            "\n{files}: {} confirmed, {refuted} refuted in {refuted_files} of them",
            plural(confirmed, "claim")
        ));
    }
    output.result(
        "replay",
        serde_json::json!({ "confirmed": confirmed, "refuted": refuted, "scenarios": results }),
    );
    if let Some(failure) = failed {
        return Err(failure);
    }
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

/// What a replay of one file found.
struct Played {
    scenario: Scenario,
    /// Its claims, if it was played as it was recorded.
    claims: Option<Vec<oracle::ClaimResult>>,
    /// What happened, in words.
    told: String,
    result: serde_json::Value,
}

fn play(
    output: &Output,
    arguments: &ReplayArguments,
    profile: Option<&ModularConfig>,
    path: &Path,
) -> Result<Played, Failure> {
    let (table, scenario) = load::scenario(output, path)?;
    let (ads, is_recorded) = run::selected_for(arguments.ads.as_deref(), profile, &scenario)?;
    let stage = Stage::new(&table, &scenario)?;
    let mut gauges = Gauges::default();
    let log = stage.play(&ads, &mut |world, _, contacts| gauges.note(world, contacts));
    let (criticality, pet_s) = gauges.of_steps(&log);
    let severities: Vec<oracle::Severity> = log.collisions.iter().map(oracle::severity).collect();
    let priorities: Vec<&str> =
        log.collisions.iter().map(|collision| collision.contact.priority.name()).collect();
    if is_recorded {
        let claims = stage.verify(&ads, &log);
        let result = serde_json::json!({ "file": path, "scenario": scenario.name, "claims": claims,
            "severities": severities, "priorities": priorities, "criticality": criticality, "pet_s": pet_s });
        let lines = log.collisions.iter().zip(&severities);
        let told = lines.map(|(collision, severity)| severity_text(collision, severity));
        let told = told.collect::<Vec<_>>().join("\n");
        return Ok(Played { claims: Some(claims), told, result, scenario });
    }
    let name = match &arguments.ads_config {
        Some(path) => format!("{} with {}", ads.name(), path.display()),
        None => ads.name().to_owned(),
    };
    let judgements = stage.judge(&ads, &log);
    let counted = oracle::counted(table.space(), &log, &judgements).len();
    let collisions = plural(log.collisions.len(), "collision");
    let avoidable = judgements.iter().filter(|j| j.class == Avoidability::Avoidable).count();
    let told = format!("{name}: {collisions}, {counted} counted, {avoidable} avoidable");
    let result = serde_json::json!({
        "file": path, "scenario": scenario.name, "ads": name,
        "collisions": log.collisions.len(), "counted": counted, "judgements": judgements,
        "severities": severities, "priorities": priorities, "criticality": criticality, "pet_s": pet_s,
    });
    Ok(Played { claims: None, told, result, scenario })
}

/// How hard a collision was, in a line.
fn severity_text(collision: &Collision, severity: &oracle::Severity) -> String {
    format!(
        "  {} npc#{} ({}) hit at {:.2} s by the ego vehicle's {}: closing at {:.1} m/s, delta-v {:.1} m/s, the other's {:.1} m/s; {}",
        collision.body.name(),
        collision.contact.obstacle,
        severity.approach,
        collision.contact.time_s,
        severity.side,
        severity.closing_speed_mps,
        severity.delta_v_mps,
        severity.obstacle_delta_v_mps,
        priority_text(collision.contact.priority)
    )
}

/// Who had to give way, in words.
pub fn priority_text(priority: Priority) -> &'static str {
    match priority {
        Priority::Ego => "the ego vehicle had priority",
        Priority::Other => "the other had priority",
        Priority::None => "neither had priority",
    }
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
