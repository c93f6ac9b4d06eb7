//! Trying rows out before choosing one: what an agent may do at a moment of an episode.
//!
//! `run` drives and judges the branches; an agent sees only their outcomes.

/// The moment at which an agent is to choose, to be tried out in copies of the world.
pub trait Branch {
    /// Carries a legal row out and drives for one observation period.
    fn try_row(&self, row: usize) -> Trial;
}

/// The outcome of a row in a branch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trial {
    /// Largest collision probability of the observation period, in `[0, 1]`.
    pub proc: f64,
    /// Whether a contact began.
    pub collided: bool,
    /// Whether a contact began that the verdict counts.
    pub counted: bool,
    /// Time driven, s.
    pub simulated_s: f64,
}
