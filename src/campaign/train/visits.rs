//! The states that a policy visits, with the Q-values of its network in each.

use std::sync::{Arc, Mutex, PoisonError};

use crate::episode;
use crate::episode::Moment;
use crate::run::{Arena, RunError, choose, trained_against, trained_in};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::Policy;
use avastra_search::agent::{Agent, Mask, QPolicy, Visit};
use avastra_search::mdp::Observation;
use avastra_world::action::ActionTable;

use crate::train::training::with_period;

/// A policy that acts as usual and records every state in which it chooses, with the legal rows, even if its
/// settings ignore what is legal. States without an open row are left out. Each clone serves one episode; all record into
/// one list.
#[derive(Clone)]
pub(super) struct VisitingPolicy {
    policy: QPolicy,
    visits: Arc<Mutex<Vec<Visit>>>,
}

impl VisitingPolicy {
    pub fn new(policy: &QPolicy) -> VisitingPolicy {
        VisitingPolicy { policy: policy.clone(), visits: Arc::default() }
    }

    /// All recorded visits.
    pub fn visits(self) -> Vec<Visit> {
        std::mem::take(&mut *self.visits.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Agent for VisitingPolicy {
    fn begin(&mut self, seed: u64) {
        self.policy.begin(seed);
    }

    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.legal_rows(legal.all()?.view());
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
    let table = with_period(table.clone(), acting.settings().payment.observation_period_s);
    let origin = &policy.origin;
    let arena = Arena::new(table, roads, trained_against(policy)?, &origin.with, &origin.without)?;
    Ok(arena.with_traffic(trained_in(policy)?))
}

/// The visits of `episodes` episodes on each road; their seeds come from a stream, numbered from `first`.
pub(super) fn visits(
    arena: &Arena,
    policy: &QPolicy,
    episodes: u64,
    (seed, stream, first): (u64, Stream, u64),
) -> Vec<Visit> {
    let visiting = VisitingPolicy::new(policy);
    for number in 0..episodes * arena.roads() as u64 {
        let seed = rng::child_seed(seed, stream, first + number);
        let setup = arena.setup((number % arena.roads() as u64) as usize, seed);
        let mut agent = visiting.clone();
        agent.begin(seed);
        episode::run(&setup, &mut |moment: &Moment| choose(&mut agent, moment));
    }
    visiting.visits()
}
