//! The claims of a policy, checked by playing its evaluation again.

use std::path::Path;
use std::sync::Arc;

use crate::cli::error::Failure;
use crate::cli::output::{Output, plural};
use avastra_base::outside::Shown;
use avastra_campaign::train::{evaluate, judge_rules, rounded, training_arena};
use avastra_lang::model::policy::RulesClaims;
use avastra_lang::model::{Policy, digest_text};
use avastra_search::agent::Face;
use avastra_world::action::ActionTable;

use super::{acting, same_world};

/// The claims that do not hold, each with what was found.
pub fn judge(table: &ActionTable, policy: &Policy) -> Result<Vec<String>, Failure> {
    same_world(policy)?;
    let acting = acting(table, policy, Face::Network)?;
    let Some(claims) = &policy.claims else { return Ok(Vec::new()) };
    let arena = training_arena(table, policy, &acting, &policy.origin.roads)?;
    let test = (claims.episodes, claims.seed);
    let found = evaluate(&arena, &|| Box::new(acting.clone()), test, &mut |_, _| {});
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

/// Says whether a policy holds what it claims.
pub fn report(output: &Output, path: &Path, policy: &Policy, wrong: &[String]) {
    match (&policy.claims, wrong) {
        (None, _) => output.say(&format!("{}: {} makes no claim", path.shown(), policy.name)),
        (Some(claims), []) => {
            let episodes = claims.episodes as usize * policy.origin.roads.len();
            let text = plural(episodes, "episode");
            let faces = if claims.rules.is_some() { " by each of its faces" } else { "" };
            output.tell(&format!("{}: {} holds, {text} played again{faces}", path.shown(), policy.name));
        }
        (Some(_), wrong) => {
            output.say(&format!("{}: {} is refuted", path.shown(), policy.name));
            wrong.iter().for_each(|line| output.say(&format!("  {line}")));
        }
    }
}
