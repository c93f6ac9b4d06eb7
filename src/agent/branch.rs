//! Trying rows out before one is chosen: the handle that an agent gets for a moment of an episode.
//!
//! What drives and judges the branches stands right of here; an agent sees what came of them.

/// The moment at which an agent is to choose, to be tried out in copies of the world.
pub trait Branch {
    /// Carries a legal row out and drives for one observation period.
    fn try_row(&self, row: usize) -> Trial;
}

/// What came of a row in a branch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trial {
    /// Largest collision probability of the observation period, in `[0, 1]`.
    pub proc: f64,
    /// A contact began.
    pub collided: bool,
    /// A contact began that the verdict counts.
    pub counted: bool,
    /// Time driven, s.
    pub simulated_s: f64,
}
