//! A trained network that is shown states of other episodes: what it then still achieves, it owes to the rows that it
//! likes anywhere, and what it loses, to knowing when.

use std::sync::Arc;

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::acting::{Agent, Mask};
use super::q_policy::{QPolicy, best};
use super::random::any;

/// States that it is shown: those of the last choices in training, when the rate of random choices has fallen.
pub(super) const STATES: usize = 1000;

/// A policy and the states that it is shown. The mask is that of the moment, and so is the rate of random choices.
pub(super) struct Shuffled {
    pub policy: QPolicy,
    /// Network inputs, one state each.
    pub states: Arc<Vec<Vec<f32>>>,
}

impl Agent for Shuffled {
    fn begin(&mut self, seed: u64) {
        self.policy.begin(seed);
    }

    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.open(legal)?;
        let explores = rng::unit(rng) < self.policy.settings.exploration.evaluation_epsilon;
        let row = if explores || self.states.is_empty() {
            any(&open, rng)
        } else {
            let state = &self.states[rng::below(rng, self.states.len() as u32) as usize];
            best(self.policy.values(state).view(), &open)
        }?;
        self.policy.chosen(row);
        Some(row)
    }

    fn looks_at_mask(&self) -> bool {
        self.policy.looks_at_mask()
    }
}
