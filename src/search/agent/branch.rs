//! Trying rows out before choosing one: what an agent may do at a moment of an episode.
//!
//! `run` drives and judges the branches; an agent sees only their outcomes.

/// The moment at which an agent is to choose: carries a legal row out in a copy of the world and drives for one
/// observation period.
pub type Branch<'a> = dyn Fn(usize) -> Trial + 'a;

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
