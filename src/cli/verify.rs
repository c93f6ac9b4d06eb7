//! `avastra verify`: checks every claim of emitted scenarios and policies.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::action::ActionTable;
use crate::agent::{Face, QPolicy};
use crate::model::policy::RulesClaims;
use crate::model::{Policy, digest_text};
use crate::sim::ENGINE;
use crate::train::{evaluate, judge_rules, rounded, training_arena};

use super::arguments::VerifyArguments;
use super::error::Failure;
use super::load::Emitted;
use super::output::Output;
use super::output::plural;
use super::parallel::each_file;
use super::replay::Played;
use super::{load, replay};

/// What was found about a file.
enum Verified {
    Scenario(Played),
    /// With the claims that do not hold.
    Policy(PathBuf, Box<Policy>, Vec<String>),
}

/// Replays scenarios, and plays the evaluations of policies again.
pub fn verify(output: &Output, arguments: &VerifyArguments) -> Result<(), Failure> {
    let asked = load::asked(arguments.against.ads.as_deref())?;
    let verified =
        each_file(output, &arguments.many, asked.external.as_ref(), |path| {
            match load::emitted(output, path)? {
                Emitted::Scenario(table, scenario) => {
                    replay::play_recorded(&table, &scenario, path, &asked).map(Verified::Scenario)
                }
                Emitted::Policy(table, policy) => {
                    let wrong = judge(&table, &policy)?;
                    Ok(Verified::Policy(path.clone(), policy, wrong))
                }
            }
        })?;
    let (mut scenarios, mut policies, mut refuted) = (Vec::new(), Vec::new(), 0);
    for found in &verified.done {
        match found {
            Verified::Scenario(played) => scenarios.push(played),
            Verified::Policy(path, policy, wrong) => {
                refuted += wrong.len();
                report(output, path, policy, wrong);
                policies.push(serde_json::json!({ "file": path, "policy": policy.name, "refuted": wrong }));
            }
        }
    }
    let tally = replay::tell(output, scenarios.iter().copied());
    refuted += tally.refuted;
    output.result(serde_json::json!({
        "refuted": refuted, "untried": tally.untried, "policies": policies,
        "scenarios": scenarios.iter().map(|played| &played.result).collect::<Vec<_>>(),
        "failed": verified.failed_in_json(),
    }));
    verified.complete("verified")?;
    replay::refutation(refuted)
}

/// The claims that do not hold, each with what was found.
fn judge(table: &ActionTable, policy: &Policy) -> Result<Vec<String>, Failure> {
    same_world(policy)?;
    let acting = acting(table, policy, Face::Network)?;
    let Some(claims) = &policy.claims else { return Ok(Vec::new()) };
    let arena = training_arena(table, policy, &acting, &policy.origin.roads)?;
    let test = (claims.episodes, claims.seed);
    let found = evaluate(&arena, &|| Box::new(acting.clone()), test);
    let trace = digest_text(&found.trace);
    let pairs = [
        ("collisions", claims.collisions.to_string(), found.collisions.to_string()),
        ("counted", claims.counted.to_string(), found.counted.to_string()),
        ("colliding", claims.colliding.to_string(), found.colliding.to_string()),
        ("return", claims.return_mean.to_string(), rounded(found.return_mean).to_string()),
        ("trace", claims.trace.clone(), trace),
    ];
    let mut pairs = Vec::from(pairs.map(|(name, claimed, found)| (name.to_owned(), claimed, found)));
    if let Some(claims) = &claims.rules {
        let lines = Arc::new(policy.rules.clone());
        let found = judge_rules(&arena, &acting, &lines, test);
        pairs.extend(
            figures(claims)
                .into_iter()
                .zip(figures(&found))
                .map(|((name, claimed), (_, found))| (format!("rules: {name}"), claimed, found)),
        );
    }
    let wrong = pairs.into_iter().filter(|(_, claimed, found)| claimed != found);
    Ok(wrong.map(|(name, claimed, found)| format!("{name}: claimed {claimed}, found {found}")).collect())
}

/// The claims about rules by name, as text.
fn figures(claims: &RulesClaims) -> [(&'static str, String); 8] {
    [
        ("states", claims.states.to_string()),
        ("fidelity", claims.fidelity.to_string()),
        ("regret", claims.regret.to_string()),
        ("collisions", claims.collisions.to_string()),
        ("counted", claims.counted.to_string()),
        ("colliding", claims.colliding.to_string()),
        ("return", claims.return_mean.to_string()),
        ("trace", claims.trace.clone()),
    ]
}

/// Checks that a policy was trained in this version of the simulated world.
///
/// # Errors
/// If it was not.
pub fn same_world(policy: &Policy) -> Result<(), Failure> {
    let (name, engine) = (&policy.name, &policy.origin.engine);
    if engine == ENGINE {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "`{name}` was trained in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike"
    )))
}

/// The policy ready to act on a table, by its network or by its rules.
///
/// # Errors
/// If its settings cannot be read, its network does not fit them, or its rules are to act and it has none.
pub fn acting(table: &ActionTable, policy: &Policy, face: Face) -> Result<QPolicy, Failure> {
    let acting = QPolicy::read(policy, table)
        .map_err(|error| Failure::usage(format!("`{}`: {error}", policy.name)))?;
    match face {
        Face::Network => Ok(acting),
        Face::Rules if policy.rules.is_empty() => {
            Err(Failure::usage(format!("`{}` has no rules: `avastra distill FILE` makes some", policy.name)))
        }
        Face::Rules => Ok(acting.with_rules(Arc::new(policy.rules.clone()))),
    }
}

fn report(output: &Output, path: &Path, policy: &Policy, wrong: &[String]) {
    match (&policy.claims, wrong) {
        (None, _) => output.say(&format!("{}: {} makes no claim", path.display(), policy.name)),
        (Some(claims), []) => {
            let episodes = claims.episodes as usize * policy.origin.roads.len();
            let text = plural(episodes, "episode");
            let faces = if claims.rules.is_some() { " by each of its faces" } else { "" };
            output.tell(&format!("{}: {} holds, {text} played again{faces}", path.display(), policy.name));
        }
        (Some(_), wrong) => {
            output.say(&format!("{}: {} is refuted", path.display(), policy.name));
            wrong.iter().for_each(|line| output.say(&format!("  {line}")));
        }
    }
}
