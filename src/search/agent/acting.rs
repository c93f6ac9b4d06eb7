//! The interface of agents.

use ndarray::{Array1, ArrayView1, aview1};

use crate::mdp::Observation;
use avastra_base::rng::Rng;
use avastra_world::action::RowOdds;

/// Which rows are legal now. To judge a row takes time, so that an agent that needs a few asks for these alone.
pub trait Mask {
    /// Whether a row is legal.
    fn is_legal(&mut self, row: usize) -> bool;

    /// Whether each row is legal, shape `(rows,)`; `None` if none is.
    fn all(&mut self) -> Option<Array1<bool>>;

    /// The number of rows.
    fn rows(&self) -> usize;

    /// Whether any row is legal.
    fn any(&mut self) -> bool {
        (0..self.rows()).any(|row| self.is_legal(row))
    }
}

/// A mask that is known for all rows already.
impl Mask for Vec<bool> {
    fn is_legal(&mut self, row: usize) -> bool {
        self[row]
    }

    fn all(&mut self) -> Option<Array1<bool>> {
        self.contains(&true).then(|| aview1(self).to_owned())
    }

    fn rows(&self) -> usize {
        self.len()
    }
}

/// Chooses rows of the action table.
pub trait Agent: Send {
    /// An episode of that seed begins.
    fn begin(&mut self, _seed: u64) {}

    /// A step begins, in which the space gives the rows these odds.
    fn weigh(&mut self, _odds: &dyn Fn() -> Vec<RowOdds>) {}

    /// The row to carry out next, or none.
    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize>;

    /// Whether the choice, or what is learned of it, depends on which rows are legal. If not, all rows pass for legal in what
    /// it learns.
    fn looks_at_mask(&self) -> bool {
        true
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
