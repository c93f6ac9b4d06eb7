//! The figures of an agent while it does not learn. They can be checked by playing again.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};

use crate::episode;
use crate::episode::{End, EpisodeLog};
use crate::run::{Arena, EpisodeSummary, choose};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_drivers::external::FailureKind;
use avastra_search::agent::Agent;

/// The outcome of a number of episodes.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Evaluation {
    /// Episodes on each road.
    pub episodes: u64,
    pub seed: u64,
    pub collisions: u64,
    /// Collisions that the space's verdict counts.
    pub counted: u64,
    /// Episodes with a counted collision.
    pub colliding: u64,
    /// Mean sum of the space's rewards in an episode.
    pub return_mean: f64,
    /// SHA-256 over the traces of all episodes, in order.
    pub trace: [u8; 32],
    /// Time simulated, s.
    pub simulated_s: f64,
    /// Episodes that ended because an external driving system failed, by how it failed.
    pub failures: BTreeMap<FailureKind, u64>,
}

/// Plays a number of episodes on each road; `make` gives a fresh agent for each, and `watch` sees what came of it.
pub fn evaluate(
    arena: &Arena,
    make: &dyn Fn() -> Box<dyn Agent>,
    (episodes, seed): (u64, u64),
    watch: &mut dyn FnMut(EpisodeSummary, &EpisodeLog),
) -> Evaluation {
    let mut traces = Sha256::new();
    let mut found = Evaluation { episodes, seed, ..Evaluation::default() };
    let mut sum = 0.0;
    for number in 0..episodes * arena.roads() as u64 {
        let seed = rng::child_seed(seed, Stream::Evaluation, number);
        let setup = arena.setup((number % arena.roads() as u64) as usize, seed);
        let mut agent = make();
        agent.begin(seed);
        let mut choose = |moment: &episode::Moment| choose(agent.as_mut(), moment);
        let log = episode::run(&setup, &mut choose);
        let summary = EpisodeSummary::judged(&setup, number as usize, &log);
        let counted = summary.counted() as u64;
        sum += log.steps.iter().map(|step| step.reward).sum::<f64>();
        found.collisions += log.collisions.len() as u64;
        found.counted += counted;
        found.colliding += u64::from(counted > 0);
        found.simulated_s += log.duration_s;
        if let End::Failed(kind) = log.end {
            *found.failures.entry(kind).or_default() += 1;
        }
        traces.update(log.trace());
        watch(summary, &log);
    }
    let return_mean = sum / (episodes * arena.roads() as u64).max(1) as f64;
    Evaluation { return_mean, trace: traces.finalize().into(), ..found }
}
