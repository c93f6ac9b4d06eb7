//! What learners and searches have in common: they get better from episode to episode.

use crate::rng::Rng;

use super::q_policy::QPolicy;
use super::registry::Agent;
use super::trajectory::{Lesson, Trajectory};

/// An agent in training. An episode is: `progress`, `beginning`, [`Agent::begin`], a choice for each
/// step, `learn`.
pub trait Trainable: Agent {
    /// The share of the training's episodes that are over, in `[0, 1)`; told before each episode.
    fn progress(&mut self, over: f64) {
        let _ = over;
    }

    /// Where the next episode begins, on the nth of the roads. `fresh` is a seed that no episode had
    /// before; an agent that returns to an old start gives that start's seed instead.
    fn beginning(&mut self, road: usize, fresh: u64) -> Beginning {
        let _ = road;
        Beginning { seed: fresh, from: None }
    }

    /// Takes in an episode that has been judged.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Lesson;

    /// Moments of the last episode that the agent may return to: the number by which it will ask for each,
    /// and the step. A number that is given again stands for the new moment.
    fn keepsakes(&mut self) -> Vec<(usize, usize)> {
        Vec::new()
    }

    /// Choices made in training.
    fn steps(&self) -> u64;

    /// The present share of random choices.
    fn exploration_epsilon(&self) -> f64;

    /// What it has learned, ready to act for one episode on any start.
    fn actor(&self) -> Box<dyn Agent>;

    /// The same, but at each choice it is shown the state of another episode, drawn from the last ones of the training;
    /// `None` if it is no network.
    fn shuffled(&self) -> Option<Box<dyn Agent>> {
        None
    }

    /// What it has learned as a network, if there is one.
    fn policy(&self) -> Option<&QPolicy> {
        None
    }

    /// The whole agent as bytes; see [`super::Settings::restore`].
    fn save(&self) -> Vec<u8>;
}

/// Where an episode of a training begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beginning {
    /// Seed of the start.
    pub seed: u64,
    /// A moment of an earlier episode of that seed to go on from: its number (see
    /// [`Trainable::keepsakes`]) and its step. If the moment was not kept, the training plays up to it, and
    /// the agent repeats its choices.
    pub from: Option<(usize, usize)>,
}
