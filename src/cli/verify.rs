//! `avastra verify`: emitted files, scenarios and policies alike, every claim checked.

use std::path::Path;
use std::path::PathBuf;

use crate::action::ActionTable;
use crate::agent::QPolicy;
use crate::model::Policy;
use crate::model::digest_text;
use crate::sim::ENGINE;
use crate::study;
use crate::study::evaluate;

use super::arguments::ReplayArguments;
use super::arguments::VerifyArguments;
use super::error::Failure;
use super::load;
use super::load::Emitted;
use super::output::Output;
use super::progress::plural;
use super::replay;

/// Replays scenarios, and lets policies show again what they claim.
pub fn verify(output: &Output, arguments: &VerifyArguments) -> Result<(), Failure> {
    let (mut scenarios, mut policies) = (Vec::new(), Vec::new());
    for path in &arguments.files {
        match load::emitted(output, path)? {
            Emitted::Scenario => scenarios.push(path.clone()),
            Emitted::Policy(table, policy) => policies.push((path, table, *policy)),
        }
    }
    let mut refuted = 0;
    let mut results = Vec::new();
    for (path, table, policy) in policies {
        let wrong = judge(&table, &policy)?;
        refuted += wrong.len();
        report(output, path, &policy, &wrong);
        results.push(serde_json::json!({ "file": path, "policy": policy.name, "refuted": wrong }));
    }
    if !scenarios.is_empty() {
        // Its result comes after the policies': a failure of theirs must not hide it.
        let jobs = arguments.jobs;
        let recorded = ReplayArguments { files: scenarios, ads: None, ads_config: None, jobs };
        let outcome = replay::replay(output, &recorded);
        match outcome {
            Err(Failure::Refuted { claims }) => refuted += claims,
            other => other?,
        }
    }
    output.result("verify", serde_json::json!({ "refuted": refuted, "policies": results }));
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

/// The claims that do not hold, each with what was found.
fn judge(table: &ActionTable, policy: &Policy) -> Result<Vec<String>, Failure> {
    let origin = &policy.origin;
    if origin.engine != ENGINE {
        let (name, engine) = (&policy.name, &origin.engine);
        return Err(Failure::usage(format!(
            "`{name}` was trained in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike"
        )));
    }
    let acting = acting(table, policy)?;
    let Some(claims) = &policy.claims else { return Ok(Vec::new()) };
    let rules = (origin.with.as_slice(), origin.without.as_slice());
    let test = (claims.episodes, claims.seed);
    let ads = study::trained_against(policy).map_err(|error| Failure::usage(error.to_string()))?;
    let found = evaluate(table.clone(), &acting, &origin.roads, &ads, rules, test)
        .map_err(|error| Failure::usage(error.to_string()))?;
    let trace = digest_text(&found.trace);
    let pairs = [
        ("collisions", claims.collisions.to_string(), found.collisions.to_string()),
        ("counted", claims.counted.to_string(), found.counted.to_string()),
        ("colliding", claims.colliding.to_string(), found.colliding.to_string()),
        ("trace", claims.trace.clone(), trace),
    ];
    let wrong = pairs.into_iter().filter(|(_, claimed, found)| claimed != found);
    Ok(wrong.map(|(name, claimed, found)| format!("{name}: claimed {claimed}, found {found}")).collect())
}

/// A policy that can act on a table.
///
/// # Errors
/// If its settings cannot be read, or its network is not what they describe.
pub fn acting(table: &ActionTable, policy: &Policy) -> Result<QPolicy, Failure> {
    QPolicy::read(policy, table).map_err(|error| Failure::usage(format!("`{}`: {error}", policy.name)))
}

fn report(output: &Output, path: &Path, policy: &Policy, wrong: &[String]) {
    let path: PathBuf = path.to_owned();
    match (&policy.claims, wrong) {
        (None, _) => output.say(&format!("{}: {} makes no claim", path.display(), policy.name)),
        (Some(claims), []) => {
            let episodes = claims.episodes as usize * policy.origin.roads.len();
            let text = plural(episodes, "episode");
            output.tell(&format!("{}: {} holds, {text} played again", path.display(), policy.name));
        }
        (Some(_), wrong) => {
            output.say(&format!("{}: {} is refuted", path.display(), policy.name));
            wrong.iter().for_each(|line| output.say(&format!("  {line}")));
        }
    }
}
