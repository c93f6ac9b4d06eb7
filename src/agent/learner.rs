//! Deep Q-learning: DQN (Mnih et al., 2015, Algorithm 1), Double DQN (van Hasselt, Guez and Silver, 2016)
//! and prioritised replay (Schaul et al., 2016, Algorithm 1), as the settings say.
//!
//! [`improve`] is one update: targets, TD errors, loss, gradient, step. `n_step` makes the transitions,
//! `replay` keeps and draws them, and `quirks` holds what only the published packages do.

use std::sync::Arc;

use ndarray::{Array2, ArrayView1, ArrayView2};

use crate::mdp::Observation;
use crate::rng;
use crate::rng::{Rng, Stream};

use super::hyperparameters::{Hyperparameters, Loss};
use super::n_step::transitions;
use super::network::{Adam, Network};
use super::q_policy::{QPolicy, Rows, best};
use super::registry::Agent;
use super::replay::{Replay, Transition};
use super::shuffled::{STATES, Shuffled};
use super::trainable::Trainable;
use super::trajectory::{Lesson, Trajectory};

/// A learning agent.
pub struct Learner {
    /// The online network, and how it acts.
    pub(super) policy: QPolicy,
    /// The mean of the online networks, which acts in the end, if the settings ask for one.
    pub(super) average: Option<QPolicy>,
    pub(super) target: Network,
    pub(super) adam: Adam,
    pub(super) replay: Replay,
    /// Choices made.
    pub(super) steps: u64,
    /// Updates made.
    pub(super) updates: u64,
    /// The share of the training's episodes that are over.
    over: f64,
}

impl Learner {
    /// An agent that knows nothing; its first weights come from the seed.
    pub fn new(settings: Arc<Hyperparameters>, rows: Arc<Rows>, seed: u64) -> Learner {
        let shape = QPolicy::shape(&settings, rows.allowed.len());
        let mut rng = rng::stream(seed, Stream::Initialization, 0);
        let network = Network::new(shape, settings.initialization, &mut rng);
        let (target, adam) = (network.clone(), Adam::new(network.parameters().len()));
        let replay = Replay::new(settings.replay_capacity, settings.priorities());
        let policy = QPolicy::new(settings.clone(), rows, network);
        let average = (settings.average_decay > 0.0).then(|| policy.clone());
        Learner { policy, average, target, adam, replay, steps: 0, updates: 0, over: 0.0 }
    }

    /// What acts after the training.
    fn trained(&self) -> &QPolicy {
        self.average.as_ref().unwrap_or(&self.policy)
    }

    /// Draws a batch, improves the online network by it and renews its priorities; its loss.
    fn update(&mut self, rng: &mut Rng) -> f64 {
        let settings = self.policy.settings.clone();
        let importance_exponent = settings.importance_exponent(self.updates);
        let samples = self.replay.sample(settings.batch_len, importance_exponent, rng);
        let batch: Vec<&Transition> = samples.iter().map(|sample| self.replay.get(sample.index)).collect();
        let weights: Vec<f32> = samples.iter().map(|sample| sample.weight).collect();
        let online = &mut self.policy.network;
        let (loss, td_errors) = improve(online, &self.target, &mut self.adam, &settings, &batch, &weights);
        for (sample, td_error) in samples.iter().zip(td_errors) {
            self.replay.update(sample.index, f64::from(td_error));
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
        loss
    }
}

impl Agent for Learner {
    fn begin(&mut self) {
        self.policy.begin();
    }

    /// ε-greedy over the open rows.
    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.open(legal);
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
        self.policy.looks_at_mask() || self.policy.settings().masks_target
    }
}

impl Trainable for Learner {
    fn progress(&mut self, over: f64) {
        self.over = over;
    }

    /// Keeps what the episode showed, and makes the updates that its steps are worth.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Lesson {
        let rewards = match self.policy.settings().pays_maker {
            true => paid_to_makers(episode, self.policy.settings()),
            false => self.policy.quirks.rewards(episode),
        };
        for transition in transitions(episode, &rewards, &self.policy) {
            self.replay.push(transition);
        }
        let settings = self.policy.settings();
        if self.replay.len() < settings.learning_starts {
            return Lesson::default();
        }
        let updates = episode.steps.len() as u64 * u64::from(settings.updates_per_step);
        let losses: f64 = (0..updates).map(|_| self.update(rng)).sum();
        Lesson { updates, loss: (updates > 0).then(|| losses / updates as f64) }
    }

    fn steps(&self) -> u64 {
        self.steps
    }

    fn exploration_epsilon(&self) -> f64 {
        self.policy.settings().exploration_epsilon(self.steps, self.over)
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
        self.to_bytes()
    }
}

/// The reward of each step of an episode, shape `(steps,)`, where a collision that counts pays R_col at the step that
/// made its obstacle appear, and not where it happened: that choice had no part in it.
///
/// A collision whose obstacle no choice made pays where it happened.
fn paid_to_makers(episode: &Trajectory, settings: &Hyperparameters) -> Vec<f64> {
    let mut rewards: Vec<f64> = episode.steps.iter().map(|step| step.reward).collect();
    let crashes = || {
        episode
            .steps
            .iter()
            .enumerate()
            .flat_map(|(at, step)| step.crashes.iter().map(move |maker| (at, maker.unwrap_or(at))))
    };
    for (at, _) in crashes() {
        rewards[at] = settings.uncounted_reward;
    }
    for (_, maker) in crashes() {
        rewards[maker] = settings.collision_reward;
    }
    rewards
}

/// One update of the online network on a batch: its loss, and the TD errors, shape `(batch,)`.
///
/// `weights` are the importance weights, shape `(batch,)`.
pub fn improve(
    online: &mut Network,
    target: &Network,
    adam: &mut Adam,
    settings: &Hyperparameters,
    batch: &[&Transition],
    weights: &[f32],
) -> (f64, Vec<f32>) {
    let states = stacked(batch, |transition| &transition.inputs);
    let next_states = stacked(batch, |transition| &transition.next_inputs);

    let next_values = target.q_values(next_states.view());
    // The only difference between the two algorithms is the network that chooses the next row.
    let targets = if settings.double {
        targets(batch, online.q_values(next_states.view()).view(), next_values.view())
    } else {
        targets(batch, next_values.view(), next_values.view())
    };
    let pass = online.forward(states.view());
    let td_errors = td_errors(batch, pass.q_values.view(), &targets);
    let (loss, slopes) = loss(settings.loss, &td_errors, weights);
    let mut gradient = online.gradient(&pass, placed(batch, &slopes, pass.q_values.dim()));
    if let Some(norm_max) = settings.gradient_norm_max {
        shorten(&mut gradient, norm_max);
    }
    adam.step(online.parameters_mut(), &gradient, settings.learning_rate);
    (loss, td_errors)
}

/// States of a batch, one a row: shape `(batch, inputs)`.
fn stacked(batch: &[&Transition], inputs: fn(&Transition) -> &Vec<f32>) -> Array2<f32> {
    let shape = (batch.len(), inputs(batch[0]).len());
    let values = batch.iter().flat_map(|transition| inputs(transition)).copied().collect();
    Array2::from_shape_vec(shape, values).expect("all states have the same features")
}

/// What the Q-values should have been, shape `(batch,)`: the reward, and the discounted value of the next
/// state by the target network, in the legal row that `choosing` likes best there.
///
/// Both arrays are Q-values of the next states, shape `(batch, rows)`: `values` by the target network, and
/// `choosing` by the online network (Double DQN, Eq. 4) or by the target network too (DQN).
fn targets(batch: &[&Transition], choosing: ArrayView2<f32>, values: ArrayView2<f32>) -> Vec<f32> {
    debug_assert_eq!(choosing.dim(), values.dim());
    debug_assert_eq!(values.nrows(), batch.len());
    let target = |(at, transition): (usize, &&Transition)| {
        debug_assert_eq!(transition.next_legal.len(), values.ncols());
        match best(choosing.row(at), &transition.next_legal) {
            Some(row) if transition.discount > 0.0 => {
                transition.reward + transition.discount * values[[at, row]]
            }
            _ => transition.reward,
        }
    };
    batch.iter().enumerate().map(target).collect()
}

/// The Q-value of the row that was chosen, less its target: shape `(batch,)`, from Q-values of shape
/// `(batch, rows)`.
fn td_errors(batch: &[&Transition], q_values: ArrayView2<f32>, targets: &[f32]) -> Vec<f32> {
    debug_assert_eq!((q_values.nrows(), targets.len()), (batch.len(), batch.len()));
    let chosen = batch.iter().enumerate().map(|(at, transition)| q_values[[at, transition.row as usize]]);
    chosen.zip(targets).map(|(q_value, target)| q_value - target).collect()
}

/// The weighted mean loss of a batch, and its derivative by each TD error, shape `(batch,)`.
fn loss(kind: Loss, td_errors: &[f32], weights: &[f32]) -> (f64, Vec<f32>) {
    debug_assert_eq!(td_errors.len(), weights.len());
    let count = td_errors.len();
    let (mut mean, mut slopes) = (0.0, Vec::with_capacity(count));
    for (&td_error, &weight) in td_errors.iter().zip(weights) {
        let (cost, slope) = match kind {
            Loss::Squared => (td_error * td_error, 2.0 * td_error),
            Loss::Huber if td_error.abs() < 1.0 => (td_error * td_error / 2.0, td_error),
            Loss::Huber => (td_error.abs() - 0.5, td_error.signum()),
        };
        mean += f64::from(weight * cost) / count as f64;
        slopes.push(weight * slope / count as f32);
    }
    (mean, slopes)
}

/// The derivative by every Q-value, of the given shape `(batch, rows)`: 0 but for the rows that were chosen.
fn placed(batch: &[&Transition], slopes: &[f32], shape: (usize, usize)) -> Array2<f32> {
    debug_assert_eq!((slopes.len(), shape.0), (batch.len(), batch.len()));
    let mut placed = Array2::zeros(shape);
    for (at, transition) in batch.iter().enumerate() {
        placed[[at, transition.row as usize]] = slopes[at];
    }
    placed
}

/// Scales a gradient down to a length.
fn shorten(gradient: &mut [f32], norm_max: f64) {
    let squares: f64 = gradient.iter().map(|&slope| f64::from(slope) * f64::from(slope)).sum();
    let share = norm_max / (libm::sqrt(squares) + 1e-6);
    if share < 1.0 {
        gradient.iter_mut().for_each(|slope| *slope *= share as f32);
    }
}

#[cfg(test)]
pub(super) mod tests;
