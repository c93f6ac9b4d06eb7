//! Deep Q-learning: DQN (Mnih et al., 2015, Algorithm 1), Double DQN (van Hasselt, Guez and Silver, 2016)
//! and prioritised replay (Schaul et al., 2016, Algorithm 1), as the settings say.
//!
//! `update` improves the network by one batch, `n_step` makes the transitions, `replay` keeps and draws them, and
//! `quirks` holds what only the published packages do. `settings` puts the parts together.

mod settings;
mod update;

pub use settings::{LearnerSettings, Loss};
pub use update::improve;

use std::sync::Arc;

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

use super::acting::{Agent, Mask};
use super::checkpoint::{Reader, Writer};
use super::choice::Rows;
use super::exploration::ExplorationSettings;
use super::n_step::transitions;
use super::network::{Adam, Network};
use super::q_policy::QPolicy;
use super::replay::{Replay, Transition};
use super::shuffled::{STATES, Shuffled};
use super::trainable::{Configured, Diverged, Trainable};
use super::trajectory::{Lesson, Trajectory};

impl Configured for LearnerSettings {
    type Trained = Learner;

    /// The learner with its parts; the first weights come from the seed.
    fn build(&self, rows: Arc<Rows>, seed: u64) -> Learner {
        let shape = QPolicy::shape(self, rows.allowed.len());
        let mut rng = rng::stream(seed, Stream::Initialization, 0);
        let network = Network::new(shape, self.network.initialization, &mut rng);
        let adam = Adam::new(network.parameters().len(), self.learning_rate);
        let policy = QPolicy::new(Arc::new(self.clone()), rows, network);
        Learner::new(policy, Replay::new(self.replay), adam, self.exploration)
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Learner> {
        self.build(rows, 0).restored(bytes)
    }
}

/// A learning agent.
pub struct Learner {
    settings: Arc<LearnerSettings>,
    /// The online network, and how it acts.
    policy: QPolicy,
    /// The mean of the online networks, which acts in the end, if the settings ask for one.
    average: Option<QPolicy>,
    target: Network,
    adam: Adam,
    replay: Replay,
    exploration: ExplorationSettings,
    /// Choices made.
    steps: u64,
    /// Updates made.
    updates: u64,
    /// The share of the training's episodes that are over.
    over: f64,
}

impl Learner {
    /// A learner that has learned nothing: its first network, an empty replay, an optimiser for this network, and how ε
    /// falls.
    pub fn new(policy: QPolicy, replay: Replay, adam: Adam, exploration: ExplorationSettings) -> Learner {
        let (settings, target) = (policy.settings.clone(), policy.network.clone());
        let average = (settings.average_decay > 0.0).then(|| policy.clone());
        Learner {
            settings,
            policy,
            average,
            target,
            adam,
            replay,
            exploration,
            steps: 0,
            updates: 0,
            over: 0.0,
        }
    }

    /// A new learner as the one that was saved; `None` if the bytes are not those of a learner with such settings and rows.
    pub(super) fn restored(mut self, bytes: &[u8]) -> Option<Learner> {
        let mut bytes = Reader::new(bytes)?;
        self.steps = bytes.u64()?;
        self.updates = bytes.u64()?;
        self.policy.quirks.restore(&mut bytes)?;
        let networks = [Some(&mut self.policy.network), Some(&mut self.target)];
        let average = self.average.as_mut().map(|average| &mut average.network);
        for network in networks.into_iter().chain([average]).flatten() {
            let parameters = network.parameters().len();
            network.parameters_mut().copy_from_slice(&bytes.f32s(parameters)?);
        }
        self.adam.restore(&mut bytes)?;
        let sizes = (self.policy.features.len(), self.policy.rows.allowed.len());
        self.replay = Replay::restored(self.settings.replay, sizes, &mut bytes)?;
        bytes.is_at_end().then_some(self)
    }

    /// The policy that acts after the training.
    fn trained(&self) -> &QPolicy {
        self.average.as_ref().unwrap_or(&self.policy)
    }

    /// Draws a batch, improves the online network by it and renews its priorities; its loss.
    fn update(&mut self, rng: &mut Rng) -> Result<f64, Diverged> {
        let settings = &self.settings;
        let samples = self.replay.sample(settings.batch_len, self.updates, rng);
        let batch: Vec<&Transition> = samples.iter().map(|&(index, _)| self.replay.get(index)).collect();
        let weights: Vec<f32> = samples.iter().map(|&(_, weight)| weight).collect();
        let online = &mut self.policy.network;
        let (loss, td_errors) = improve(online, &self.target, &mut self.adam, settings, &batch, &weights);
        if !loss.is_finite() || td_errors.iter().any(|error| !error.is_finite()) {
            return Err(Diverged { update: self.updates + 1 });
        }
        for (&(index, _), td_error) in samples.iter().zip(td_errors) {
            self.replay.update(index, f64::from(td_error));
        }
        self.updates += 1;
        if self.updates.is_multiple_of(settings.target_period_updates) {
            self.target.copy_from(&self.policy.network);
        }
        if let Some(average) = &mut self.average {
            // At first it is the plain mean, or the first weights, which know nothing, would stay in it for long.
            let decay = settings.average_decay.min(1.0 - 1.0 / self.updates as f64);
            average.network.approach(&self.policy.network, (1.0 - decay) as f32);
        }
        Ok(loss)
    }
}

impl Agent for Learner {
    fn begin(&mut self, seed: u64) {
        self.policy.begin(seed);
    }

    /// ε-greedy over the open rows.
    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.open(legal)?;
        let explores = rng::unit(rng) < self.exploration_epsilon();
        self.steps += 1;
        let row = if self.policy.quirks.explores(explores) {
            self.policy.quirks.random_row(&open, rng)
        } else {
            self.policy.greedy(observation, &open)
        }?;
        self.policy.chosen(row);
        Some(row)
    }

    fn looks_at_mask(&self) -> bool {
        self.policy.looks_at_mask() || self.settings.choice.masks_target
    }
}

impl Trainable for Learner {
    fn progress(&mut self, over: f64) {
        self.over = over;
    }

    /// Keeps what the episode showed, and makes the updates that its steps are worth.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Result<Lesson, Diverged> {
        let rewards = self.policy.rewards(episode);
        for transition in transitions(episode, &rewards, &self.policy) {
            self.replay.push(transition);
        }
        let settings = &self.settings;
        if self.replay.len() < settings.learning_starts {
            return Ok(Lesson::default());
        }
        let updates = episode.steps.len() as u64 * u64::from(settings.updates_per_step);
        let mut losses = 0.0;
        for _ in 0..updates {
            losses += self.update(rng)?;
        }
        Ok(Lesson { updates, loss: (updates > 0).then(|| losses / updates as f64) })
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn exploration_epsilon(&self) -> f64 {
        self.exploration.epsilon(self.steps, self.over)
    }

    fn actor(&self) -> Box<dyn Agent> {
        Box::new(self.trained().clone())
    }

    fn shuffled(&self) -> Option<Box<dyn Agent>> {
        let states = self.replay.latest(STATES).map(|transition| transition.inputs.clone()).collect();
        Some(Box::new(Shuffled { policy: self.trained().clone(), states: Arc::new(states) }))
    }

    fn policy(&self) -> Option<&QPolicy> {
        Some(self.trained())
    }

    fn save(&self) -> Vec<u8> {
        let mut bytes = Writer::new();
        bytes.u64(self.steps);
        bytes.u64(self.updates);
        self.policy.quirks.save(&mut bytes);
        bytes.f32s(self.policy.network.parameters());
        bytes.f32s(self.target.parameters());
        if let Some(average) = &self.average {
            bytes.f32s(average.network.parameters());
        }
        self.adam.save(&mut bytes);
        self.replay.save(&mut bytes);
        bytes.into_bytes()
    }
}

#[cfg(test)]
pub(super) mod tests;
