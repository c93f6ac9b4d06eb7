//! One row of the table, once: an episode of a protocol.

use ndarray::ArrayView1;

use crate::mdp::Observation;
use avastra_base::rng::Rng;

use super::registry::Agent;

/// Chooses its row as soon as that is legal, and nothing after that.
#[derive(Debug)]
pub struct OneRow {
    row: usize,
    was_chosen: bool,
}

impl OneRow {
    pub fn new(row: usize) -> OneRow {
        OneRow { row, was_chosen: false }
    }
}

impl Agent for OneRow {
    fn begin(&mut self) {
        self.was_chosen = false;
    }

    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, _: &mut Rng) -> Option<usize> {
        let chooses = !self.was_chosen && legal[self.row];
        self.was_chosen |= chooses;
        chooses.then_some(self.row)
    }

    fn only(&self) -> Option<usize> {
        Some(self.row)
    }
}
