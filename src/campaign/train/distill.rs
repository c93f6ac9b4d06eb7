//! Rules from a network: rounds of DAgger (Ross et al., 2011) as VIPER uses them.
//!
//! In the first round the network drives, in each further round the rules of the round before. So the states are
//! those that the rules reach, and for all of them the network says what it would have chosen. VIPER keeps the best
//! of its rounds; here the last is kept, which has learned from all states.

use std::sync::Arc;

use crate::run::Arena;
use avastra_base::rng::Stream;
use avastra_lang::model::digest_text;
use avastra_lang::model::policy::{PolicyRule, RulesClaims};
use avastra_search::agent::{QPolicy, Visit, chosen_by, distilled};

use crate::train::evaluation::evaluate;
use crate::train::visits::{VisitingPolicy, visits};

/// Rules that imitate a policy, with the limits that its settings give; empty if the policy never made a choice.
pub fn distill(arena: &Arena, policy: &QPolicy, seed: u64) -> Vec<PolicyRule> {
    let settings = &policy.settings().rules;
    let episodes = u64::from(settings.rules_episodes);
    let mut lessons: Vec<Visit> = Vec::new();
    let mut student = policy.clone();
    let mut found = Vec::new();
    for round in 0..u64::from(settings.rules_rounds) {
        let first = round * episodes * arena.roads() as u64;
        lessons.extend(visits(arena, &student, episodes, (seed, Stream::Distillation, first)));
        if lessons.is_empty() {
            continue;
        }
        found = distilled(&lessons, policy.variables(), settings.rules_leaves, settings.rules_depth);
        student = policy.with_rules(Arc::new(found.clone()));
    }
    found
}

/// The figures of rules when they drive, and how often they choose as the network. `test` is the number of episodes
/// on each road, and their seed.
pub fn judge_rules(
    arena: &Arena,
    policy: &QPolicy,
    rules: &Arc<Vec<PolicyRule>>,
    test: (u64, u64),
) -> RulesClaims {
    let visiting = VisitingPolicy::new(&policy.with_rules(rules.clone()));
    let evaluation = evaluate(arena, &|| Box::new(visiting.clone()), test, &mut |_, _| {});
    let (mut states, mut same, mut lost) = (0_u64, 0_u64, 0.0);
    for visit in visiting.visits() {
        let row = chosen_by(rules, &visit.observation, &visit.open);
        states += 1;
        same += u64::from(row == Some(visit.best));
        lost += visit.loss(row);
    }
    let count = states.max(1) as f64;
    RulesClaims {
        states,
        fidelity: rounded(same as f64 / count),
        regret: rounded(lost / count),
        collisions: evaluation.collisions,
        counted: evaluation.counted,
        colliding: evaluation.colliding,
        return_mean: rounded(evaluation.return_mean),
        trace: digest_text(&evaluation.trace),
    }
}

/// A figure rounded to the four decimals of a claim.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
