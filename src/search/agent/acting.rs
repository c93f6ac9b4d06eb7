//! What an agent is.

use ndarray::{Array1, ArrayView1};

use crate::mdp::Observation;
use avastra_base::rng::Rng;
use avastra_world::action::RowOdds;

/// Chooses rows of the action table.
pub trait Agent: Send {
    /// An episode of that seed begins.
    fn begin(&mut self, _seed: u64) {}

    /// A step begins, in which the space gives the rows these odds.
    fn weigh(&mut self, _odds: &dyn Fn() -> Vec<RowOdds>) {}

    /// The row to carry out next, or none. `legal` has shape `(rows,)`; at least one is true.
    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize>;

    /// Whether the choice, or what is learned of it, depends on which rows are legal. If not, only the chosen row is
    /// drawn, and all others pass for legal.
    fn looks_at_mask(&self) -> bool {
        true
    }

    /// The rows that it may choose now, the one that it wants first; none if it asks about all.
    fn only(&self) -> &[usize] {
        &[]
    }

    /// A step begins in an episode of that seed: where in their ranges the drawn values of the row shall lie, each in
    /// `[0, 1)`, by parameter; what is left out is drawn by chance.
    fn draw_shares(&mut self, _step: usize, _seed: u64) -> &[f64] {
        &[]
    }

    /// The probability with which each row is chosen, shape `(rows,)`, where it depends on nothing but what is legal;
    /// `None` for an agent that knows no probabilities.
    fn chances(&self, _legal: ArrayView1<bool>) -> Option<Array1<f64>> {
        None
    }
}
