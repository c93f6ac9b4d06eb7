//! What every agent can do that gets better from episode to episode: learners and searches alike.

use crate::rng::Rng;

use super::q_policy::QPolicy;
use super::registry::Agent;
use super::trajectory::{Lesson, Trajectory};

/// An agent in training. An episode is: `beginning`, [`Agent::begin`], a choice for each step, `learn`.
pub trait Trainable: Agent {
    /// Where the next episode begins, on the nth of the roads. `fresh` is a seed that no episode had
    /// before; an agent that wants to see an old start again gives that one's.
    fn beginning(&mut self, road: usize, fresh: u64) -> Beginning {
        let _ = road;
        Beginning { seed: fresh, from: None }
    }

    /// Takes in an episode that has been judged.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Lesson;

    /// Moments of the episode just learned from that it may want to return to: the number that it will
    /// ask for them by, and the step. A number that has been used already stands for the new moment.
    fn keepsakes(&mut self) -> Vec<(usize, usize)> {
        Vec::new()
    }

    /// Choices made in training.
    fn steps(&self) -> u64;

    /// The share of random choices at the moment.
    fn exploration_epsilon(&self) -> f64;

    /// What it has learned, ready to act for one episode on any start.
    fn actor(&self) -> Box<dyn Agent>;

    /// The network behind that, where there is one.
    fn policy(&self) -> Option<&QPolicy> {
        None
    }

    /// The whole of it as bytes; see [`super::Settings::restore`].
    fn save(&self) -> Vec<u8>;
}

/// Where an episode of a training begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beginning {
    /// Seed of the start.
    pub seed: u64,
    /// A moment of an earlier episode of that seed to go on from, and its step. Whoever has not kept it
    /// plays up to it: the agent chooses there as it did before.
    pub from: Option<(usize, usize)>,
}
