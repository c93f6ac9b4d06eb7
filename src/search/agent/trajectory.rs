//! The record of an ended episode that a learning agent is given.
//!
//! Learning waits for the end, because only then it is known which collisions count. It costs a lag of one
//! episode, and between two episodes nothing is under way, so that a checkpoint is complete.

use ndarray::Array1;

use crate::mdp::Observation;

/// The choices of one episode, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    pub steps: Vec<Experience>,
    /// The observation that the agent would have seen next.
    pub last: Observation,
    /// Rows that would have been legal then, shape `(rows,)`.
    pub last_legal: Array1<bool>,
    /// Whether the episode ended by itself (arrival), as opposed to being cut off.
    pub terminal: bool,
}

/// One choice and what it was worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Experience {
    pub observation: Observation,
    /// Rows that were legal, shape `(rows,)`.
    pub legal: Array1<bool>,
    pub row: usize,
    pub reward: f64,
    /// For each contact of this step: the index in `steps` of the choice that made the obstacle appear.
    pub hits: Vec<usize>,
    /// For each collision of this step that counts: the index in `steps` of the choice that made the
    /// obstacle appear; `None` if no choice did.
    pub crashes: Vec<Option<usize>>,
}

/// The updates with which an agent learned from an episode.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lesson {
    pub updates: u64,
    /// Mean loss of these updates; `None` if there was no update.
    pub loss: Option<f64>,
}

impl Trajectory {
    /// Sum of the rewards, not discounted.
    pub fn sum(&self) -> f64 {
        self.steps.iter().map(|step| step.reward).sum()
    }
}

/// Experiences for the tests of agents: nothing is seen, nothing comes near.
#[cfg(test)]
impl Experience {
    pub fn plain(row: usize, reward: f64, rows: usize) -> Experience {
        let (observation, legal) = (Observation::zeros(), Array1::from_elem(rows, true));
        Experience { observation, legal, row, reward, hits: Vec::new(), crashes: Vec::new() }
    }
}

#[cfg(test)]
impl Trajectory {
    /// It ends by arrival.
    pub fn plain(steps: Vec<Experience>, rows: usize) -> Trajectory {
        Trajectory {
            steps,
            last: Observation::zeros(),
            last_legal: Array1::from_elem(rows, true),
            terminal: true,
        }
    }
}
