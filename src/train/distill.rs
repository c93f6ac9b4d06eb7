//! Rules from a network: rounds of DAgger (Ross et al., 2011) as VIPER uses them.
//!
//! In the first round the network drives, then the rules of the round before: so the states are those
//! that the rules come to, and in all of them the network says what it would have done. VIPER keeps the
//! best of its rounds; here the last is kept, which has learned from all states.

use std::sync::Arc;

use crate::action::ActionTable;
use crate::ads::Selected;
use crate::agent::{Agent, QPolicy, Visit, chosen_by, distilled};
use crate::model::digest_text;
use crate::model::policy::{PolicyRule, RulesClaims};
use crate::rng::Stream;
use crate::run::RunError;
use crate::train::{evaluate_agent, with_period};

use crate::train::visits::{Record, arena, visits};

/// Rules that imitate a policy, as its settings want them; none if it never came to a choice. `rules`
/// are those of the space that are switched on and off.
///
/// # Errors
/// If a road or a rule does not exist.
pub fn distill(
    table: &ActionTable,
    policy: &QPolicy,
    roads: &[String],
    ads: &Selected,
    rules: (&[String], &[String]),
    seed: u64,
) -> Result<Vec<PolicyRule>, RunError> {
    let settings = policy.settings();
    let arena = arena(table, policy, roads, ads, rules)?;
    let episodes = u64::from(settings.rules_episodes);
    let mut lessons: Vec<Visit> = Vec::new();
    let mut student = policy.clone();
    let mut found = Vec::new();
    for round in 0..u64::from(settings.rules_rounds) {
        let first = round * episodes * arena.roads() as u64;
        lessons.extend(visits(&arena, &student, episodes, (seed, Stream::Distillation, first)));
        if lessons.is_empty() {
            continue;
        }
        found = distilled(&lessons, policy.variables(), settings.rules_leaves, settings.rules_depth);
        student = policy.with_rules(Arc::new(found.clone()));
    }
    Ok(found)
}

/// What rules achieve, and how near they come to their network there. `test` is the number of episodes on
/// each road and their seed.
///
/// # Errors
/// As [`distill`].
pub fn judge_rules(
    table: &ActionTable,
    policy: &QPolicy,
    found: &Arc<Vec<PolicyRule>>,
    roads: &[String],
    ads: &Selected,
    rules: (&[String], &[String]),
    test: (u64, u64),
) -> Result<RulesClaims, RunError> {
    let student = policy.with_rules(found.clone());
    let record = Record::default();
    let at_its_pace = with_period(table.clone(), policy.settings().observation_period_s);
    let make = || -> Box<dyn Agent> { Box::new(record.of(&student)) };
    let evaluation = evaluate_agent(at_its_pace, &make, roads, ads, rules, test)?;
    let (mut states, mut same, mut lost) = (0_u64, 0_u64, 0.0);
    for visit in record.visits() {
        let row = chosen_by(found, &visit.observation, &visit.open);
        states += 1;
        same += u64::from(row == Some(visit.best));
        lost += visit.loss(row);
    }
    let count = states.max(1) as f64;
    Ok(RulesClaims {
        states,
        fidelity: rounded(same as f64 / count),
        regret: rounded(lost / count),
        collisions: evaluation.collisions,
        counted: evaluation.counted,
        colliding: evaluation.colliding,
        return_mean: rounded(evaluation.return_mean),
        trace: digest_text(&evaluation.trace),
    })
}

/// A figure as a claim states it: to four decimals.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
