//! Permutation importance (Breiman, 2001; Fisher et al., 2019) says how much worse a policy chooses when the values of
//! one variable are shuffled among the states that it visited.
//!
//! A state weighs as much as its stake (see `Visit::stake`), so a choice that makes no difference counts for
//! nothing. Variables are shuffled one at a time, so two variables that carry the same information both seem
//! unimportant.

use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_lang::model::policy::{VARIABLES, variable_index};
use avastra_search::agent::{QPolicy, Visit};
use avastra_search::mdp::{Observation, STATE_LEN};

/// How much a policy's choices depend on a variable.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Importance {
    /// Its name in the rules of a policy.
    pub variable: &'static str,
    /// Its name in the paper, or in the observation if the paper does not have it.
    pub observed_as: &'static str,
    /// Whether it is one of the paper's 19.
    pub of_paper: bool,
    /// Whether the network sees it at all.
    pub seen: bool,
    /// Share of the stake in states where shuffling changes the choice; mean over the repeats, in `[0, 1]`.
    pub change: f64,
    /// Its standard deviation over the repeats.
    pub change_deviation: f64,
    /// Mean Q-value that a choice loses by shuffling.
    pub loss: f64,
    /// Its standard deviation over the repeats.
    pub loss_deviation: f64,
}

/// The importance of the paper's 19 variables and of all others that the policy sees, most important
/// first.
pub(super) fn importance(policy: &QPolicy, visits: &[Visit], repeats: u64, seed: u64) -> Vec<Importance> {
    let seen = |variable: usize| policy.variables().contains(&variable);
    let variables = (0..VARIABLES.len()).filter(|&variable| variable < STATE_LEN || seen(variable));
    let mut all: Vec<Importance> = variables
        .map(|variable| {
            let measured: Vec<(f64, f64)> = (0..repeats)
                .map(|repeat| {
                    let index = variable as u64 * repeats + repeat;
                    shuffled(policy, visits, variable, rng::stream(seed, Stream::Permutation, index))
                })
                .collect();
            let (change, change_deviation) = mean_and_deviation(measured.iter().map(|pair| pair.0));
            let (loss, loss_deviation) = mean_and_deviation(measured.iter().map(|pair| pair.1));
            Importance {
                variable: VARIABLES[variable].name,
                observed_as: VARIABLES[variable].observed_as,
                of_paper: variable < STATE_LEN,
                seen: seen(variable),
                change,
                change_deviation,
                loss,
                loss_deviation,
            }
        })
        .collect();
    all.sort_by(|a, b| b.loss.total_cmp(&a.loss).then(b.change.total_cmp(&a.change)));
    all
}

/// One shuffle: share of the stake in states where the choice changes, and mean Q-value lost.
fn shuffled(policy: &QPolicy, visits: &[Visit], variable: usize, mut rng: rng::Rng) -> (f64, f64) {
    let mut order: Vec<usize> = (0..visits.len()).collect();
    for at in (1..order.len()).rev() {
        order.swap(at, rng::below(&mut rng, at as u32 + 1) as usize);
    }
    let together = together(variable);
    let (mut changed, mut stakes, mut lost) = (0.0, 0.0, 0.0);
    for (visit, &from) in visits.iter().zip(&order) {
        let mut observation = visit.observation.clone();
        for &one in &together {
            set(&mut observation, one, visits[from].observation.get(one));
        }
        let row = policy.greedy(&observation, &visit.open);
        stakes += visit.stake();
        if row != Some(visit.best) {
            changed += visit.stake();
            lost += visit.loss(row);
        }
    }
    (if stakes > 0.0 { changed / stakes } else { 0.0 }, lost / visits.len().max(1) as f64)
}

/// The variables that are shuffled together with this one because they carry the same information: the paper's one
/// number for the weather, and its three parts, which a network sees in its place.
fn together(variable: usize) -> Vec<usize> {
    let index = |name| variable_index(name).expect("it is a variable");
    let mut all = vec![variable];
    if variable == index("weather") {
        all.extend(["rain", "fog", "wetness"].map(index));
    }
    all
}

/// Sets a variable of an observation.
pub(super) fn set(observation: &mut Observation, variable: usize, value: f32) {
    if variable < STATE_LEN {
        observation.state[variable] = value;
    } else {
        observation.beyond[variable - STATE_LEN] = value;
    }
}

fn mean_and_deviation(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean) * (value - mean)).sum();
    (mean, libm::sqrt(squares / (count - 1.0).max(1.0)))
}
