//! The common interface of learners and searches: both get better from episode to episode.

use std::sync::Arc;

use avastra_base::rng::Rng;

use super::acting::Agent;
use super::checked::Checked;
use super::choice::Rows;
use super::q_policy::QPolicy;
use super::trajectory::{Lesson, Trajectory};

/// A network's values are no numbers any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the network diverged in update {update}: lower `learning_rate`, or set `gradient_norm_max`")]
pub struct Diverged {
    pub update: u64,
}

/// An agent in training. An episode is: `progress`, [`Agent::begin`], a choice for each step, `learn`.
pub trait Trainable: Agent {
    /// The share of the training's episodes that are over, in `[0, 1)`; told before each episode.
    fn progress(&mut self, _over: f64) {}

    /// Takes in an episode that has been judged.
    ///
    /// # Errors
    /// If a network's weights have grown beyond all bounds: nothing can be learned from there on.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Result<Lesson, Diverged>;

    /// Choices made in training.
    fn steps(&self) -> u64;

    /// The present share of random choices: all of them in a search that follows no record.
    fn exploration_epsilon(&self) -> f64 {
        1.0
    }

    /// The learned agent, ready to act for one episode on any start.
    fn actor(&self) -> Box<dyn Agent>;

    /// The same, but at each choice it is shown the state of another episode, drawn from the last ones of the training;
    /// `None` if it is no network.
    fn shuffled(&self) -> Option<Box<dyn Agent>> {
        None
    }

    /// The learned network, if there is one.
    fn policy(&self) -> Option<&QPolicy> {
        None
    }

    /// The whole agent as bytes; see [`super::Settings::restore`].
    fn save(&self) -> Vec<u8>;
}

/// The interface of every agent's settings.
pub(super) trait Configured: Checked {
    type Trained: Trainable;

    /// An agent that knows nothing yet.
    fn build(&self, rows: Arc<Rows>, seed: u64) -> Self::Trained;

    /// The agent that was saved; `None` if the bytes are not those of an agent with such settings and rows.
    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Self::Trained>;
}
