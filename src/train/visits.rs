//! The states that a policy comes to, and what its network thinks of each.

use std::sync::{Arc, Mutex, PoisonError};

use ndarray::ArrayView1;

use crate::action::ActionTable;
use crate::agent::{Agent, QPolicy, Visit};
use crate::episode;
use crate::episode::Moment;
use crate::mdp::Observation;
use crate::model::Policy;
use crate::rng;
use crate::rng::{Rng, Stream};
use crate::run::{Arena, RunError, choose, trained_against};

use crate::train::training::with_period;

/// A policy that acts as it would, and notes every state that it chooses in with its legal rows, also
/// where its settings would not ask what is legal. States in which no row is open are left out.
pub(super) struct Recorder {
    policy: QPolicy,
    visits: Arc<Mutex<Vec<Visit>>>,
}

/// Where recorders note what they see: one after another, each for an episode.
#[derive(Default)]
pub(super) struct Record(Arc<Mutex<Vec<Visit>>>);

impl Record {
    pub fn of(&self, policy: &QPolicy) -> Recorder {
        Recorder { policy: policy.clone(), visits: self.0.clone() }
    }

    /// All that was seen.
    pub fn visits(self) -> Vec<Visit> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Agent for Recorder {
    fn begin(&mut self) {
        self.policy.begin();
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.legal_rows(legal);
        if let Some(best) = self.policy.greedy(observation, &open) {
            let q_values = self.policy.q_values(observation).to_vec();
            let visit = Visit { observation: observation.clone(), open, q_values, best };
            self.visits.lock().unwrap_or_else(PoisonError::into_inner).push(visit);
        }
        self.policy.choose(observation, legal, rng)
    }
}

/// The conditions that a policy was trained in, on these roads: its observation period, the driving system and
/// the rules. `acting` is the policy, ready to act.
///
/// # Errors
/// If a road, a rule, the driving system or its settings do not exist (any more).
pub fn training_arena(
    table: &ActionTable,
    policy: &Policy,
    acting: &QPolicy,
    roads: &[String],
) -> Result<Arena, RunError> {
    let table = with_period(table.clone(), acting.settings().observation_period_s);
    let origin = &policy.origin;
    Arena::new(table, roads, trained_against(policy)?, &origin.with, &origin.without)
}

/// The states of so many episodes on each road; seeds come from a stream, numbered from `first`.
pub(super) fn visits(
    arena: &Arena,
    policy: &QPolicy,
    episodes: u64,
    (seed, stream, first): (u64, Stream, u64),
) -> Vec<Visit> {
    let record = Record::default();
    for number in 0..episodes * arena.roads() as u64 {
        let seed = rng::child_seed(seed, stream, first + number);
        let setup = arena.setup((number % arena.roads() as u64) as usize, seed);
        let mut agent = record.of(policy);
        agent.begin();
        episode::run(&setup, &mut |moment: &Moment| choose(&mut agent, moment), &mut |_, _, _| {});
    }
    record.visits()
}
