//! Deep Q-learning: DQN (Mnih et al., 2015), Double DQN (van Hasselt et al., 2016), prioritised replay
//! and n-step returns, as the settings say.

use std::sync::Arc;

use ndarray::{Array2, ArrayView1};

use crate::mdp::Observation;
use crate::rng;
use crate::rng::{Rng, Stream};

use super::hyperparameters::{Exploration, Hyperparameters, Loss};
use super::network::{Adam, Network};
use super::q_policy::{QPolicy, Rows, any, best};
use super::registry::Agent;
use super::replay::{Priorities, Replay, Transition};
use super::trainable::Trainable;
use super::trajectory::{Lesson, Trajectory};

/// A learning agent.
pub struct Learner {
    /// The online network, and how it acts.
    pub(super) policy: QPolicy,
    pub(super) target: Network,
    pub(super) adam: Adam,
    pub(super) replay: Replay,
    /// Choices made.
    pub(super) steps: u64,
    /// Updates made.
    pub(super) updates: u64,
    /// How likely each row is when a row is chosen at random, shape `(rows,)`.
    pub(super) random_weights: Vec<f64>,
}

impl Learner {
    /// An agent that knows nothing; its first weights come from the seed.
    pub fn new(settings: Arc<Hyperparameters>, rows: Arc<Rows>, seed: u64) -> Learner {
        let shape = QPolicy::shape(&settings, rows.allowed.len());
        let mut rng = rng::stream(seed, Stream::Initialization, 0);
        let network = Network::new(shape, settings.initialization, &mut rng);
        Learner {
            target: network.clone(),
            adam: Adam::new(network.parameters().len()),
            replay: Replay::new(settings.replay_capacity, priorities(&settings)),
            steps: 0,
            updates: 0,
            random_weights: vec![1.0; rows.allowed.len()],
            policy: QPolicy::new(settings, rows, network),
        }
    }

    /// One transition for each step, with the rewards of up to `n_step` steps.
    fn transitions(&self, episode: &Trajectory) -> Vec<Transition> {
        let settings = self.policy.settings();
        let features = &self.policy.features;
        let inputs: Vec<Vec<f32>> =
            episode.steps.iter().map(|step| features.encode(&step.observation)).collect();
        let rewards = if settings.delayed_credit {
            credited(episode, settings.collision_reward)
        } else {
            episode.steps.iter().map(|step| step.reward).collect()
        };
        let count = episode.steps.len();
        let transition = |at: usize| {
            let end = (at + settings.n_step).min(count);
            let (mut reward, mut discount) = (0.0, 1.0);
            for &next in &rewards[at..end] {
                reward += discount * next;
                discount *= settings.discount;
            }
            if end == count && episode.terminal && settings.arrival_is_terminal {
                discount = 0.0;
            }
            let (next_inputs, legal) = match episode.steps.get(end) {
                Some(step) => (inputs[end].clone(), &step.legal),
                None => (features.encode(&episode.last), &episode.last_legal),
            };
            let allowed = self.policy.rows.allowed.iter().zip(legal);
            Transition {
                inputs: inputs[at].clone(),
                row: episode.steps[at].row as u32,
                reward: reward as f32,
                discount: discount as f32,
                next_inputs,
                next_legal: allowed.map(|(&row, &legal)| row && (legal || !settings.masks_target)).collect(),
            }
        };
        (0..count).map(transition).collect()
    }

    /// One step of Adam on a batch; its loss.
    fn update(&mut self, rng: &mut Rng) -> f64 {
        let settings = self.policy.settings.clone();
        let samples = self.replay.sample(settings.batch_len, importance(&settings, self.updates), rng);
        let batch: Vec<&Transition> = samples.iter().map(|sample| self.replay.get(sample.index)).collect();
        let weights: Vec<f32> = samples.iter().map(|sample| sample.weight).collect();
        let (loss, td_errors) =
            improve(&mut self.policy.network, &self.target, &mut self.adam, &settings, &batch, &weights);
        for (sample, td_error) in samples.iter().zip(td_errors) {
            self.replay.update(sample.index, f64::from(td_error));
        }
        self.updates += 1;
        if self.updates.is_multiple_of(settings.target_period_updates) {
            self.target.copy_from(&self.policy.network);
        }
        loss
    }

    /// A random row among those that are open, by the weights that fall with use.
    fn explore(&mut self, open: &[bool], rng: &mut Rng) -> Option<usize> {
        let decay = self.policy.settings.random_decay;
        if decay == 0.0 {
            return any(open, rng);
        }
        let weight = |row: usize| if open[row] { self.random_weights[row] } else { 0.0 };
        let total: f64 = (0..open.len()).map(weight).sum();
        let mut mass = rng::unit(rng) * total;
        let mut row = open.iter().rposition(|&is_open| is_open)?;
        for candidate in 0..row {
            if mass < weight(candidate) {
                row = candidate;
                break;
            }
            mass -= weight(candidate);
        }
        let lost = self.random_weights[row] * decay;
        let others = self.random_weights.len().max(2) - 1;
        self.random_weights.iter_mut().for_each(|weight| *weight += lost / others as f64);
        self.random_weights[row] -= lost + lost / others as f64;
        Some(row)
    }
}

impl Agent for Learner {
    fn begin(&mut self) {
        self.policy.begin();
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        let open = self.policy.open(legal);
        let is_drawn = rng::unit(rng) < self.exploration_epsilon();
        let explores = is_drawn != self.policy.settings.exploration_inverted;
        self.steps += 1;
        let row = if explores { self.explore(&open, rng) } else { self.policy.greedy(observation, &open) }?;
        self.policy.chosen(row);
        Some(row)
    }
}

impl Trainable for Learner {
    /// Keeps what the episode showed, and makes the updates that its steps are worth.
    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Lesson {
        for transition in self.transitions(episode) {
            self.replay.push(transition);
        }
        let settings = self.policy.settings.clone();
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
        let settings = self.policy.settings();
        if self.steps < settings.random_steps { 1.0 } else { epsilon(settings, self.steps) }
    }

    fn actor(&self) -> Box<dyn Agent> {
        Box::new(self.policy.clone())
    }

    fn policy(&self) -> Option<&QPolicy> {
        Some(&self.policy)
    }

    fn save(&self) -> Vec<u8> {
        self.to_bytes()
    }
}

/// One update of the online network on a batch: the loss, and the TD error of each transition.
///
/// `weights` are the importance weights, as many as transitions.
pub fn improve(
    online: &mut Network,
    target: &Network,
    adam: &mut Adam,
    settings: &Hyperparameters,
    batch: &[&Transition],
    weights: &[f32],
) -> (f64, Vec<f32>) {
    let stacked = |inputs: fn(&Transition) -> &Vec<f32>| {
        let columns = inputs(batch[0]).len();
        let values = batch.iter().flat_map(|transition| inputs(transition)).copied().collect();
        Array2::from_shape_vec((batch.len(), columns), values).expect("all states have the same features")
    };
    let inputs = stacked(|transition| &transition.inputs);
    let next_inputs = stacked(|transition| &transition.next_inputs);
    let values = target.q_values(next_inputs.view());
    let choices = if settings.double { Some(online.q_values(next_inputs.view())) } else { None };
    let goals: Vec<f32> = (0..batch.len())
        .map(|at| {
            let choosing = choices.as_ref().unwrap_or(&values);
            td_target(batch[at], choosing.row(at), values.row(at))
        })
        .collect();
    let (mut loss, mut td_errors) = (0.0, Vec::with_capacity(batch.len()));
    let mut gradient = online.gradient(inputs.view(), |q_values| {
        let mut slopes = Array2::zeros(q_values.dim());
        for (at, transition) in batch.iter().enumerate() {
            let row = transition.row as usize;
            let td_error = q_values[[at, row]] - goals[at];
            let (cost, slope) = cost(settings.loss, td_error);
            loss += f64::from(weights[at] * cost) / batch.len() as f64;
            slopes[[at, row]] = weights[at] * slope / batch.len() as f32;
            td_errors.push(td_error);
        }
        slopes
    });
    if let Some(norm_max) = settings.gradient_norm_max {
        shorten(&mut gradient, norm_max);
    }
    adam.step(online.parameters_mut(), &gradient, settings.learning_rate);
    (loss, td_errors)
}

/// The value that a transition's Q-value should have: the rewards, and what the next state is worth by
/// the target network in the row that `choosing` likes best of those that are legal there.
///
/// With `choosing` of the online network this is Double DQN, with that of the target network DQN.
fn td_target(transition: &Transition, choosing: ArrayView1<f32>, values: ArrayView1<f32>) -> f32 {
    match best(choosing, &transition.next_legal) {
        Some(row) if transition.discount > 0.0 => transition.reward + transition.discount * values[row],
        _ => transition.reward,
    }
}

/// What a TD error costs, and the derivative.
fn cost(loss: Loss, td_error: f32) -> (f32, f32) {
    match loss {
        Loss::Squared => (td_error * td_error, 2.0 * td_error),
        Loss::Huber if td_error.abs() < 1.0 => (td_error * td_error / 2.0, td_error),
        Loss::Huber => (td_error.abs() - 0.5, td_error.signum()),
    }
}

/// Scales a gradient down to a length.
fn shorten(gradient: &mut [f32], norm_max: f64) {
    let squares: f64 = gradient.iter().map(|&slope| f64::from(slope) * f64::from(slope)).sum();
    let share = norm_max / (libm::sqrt(squares) + 1e-6);
    if share < 1.0 {
        gradient.iter_mut().for_each(|slope| *slope *= share as f32);
    }
}

/// Rewards in which a collision is paid for where its obstacle appeared: in full there, and a third
/// where it came to pass (published package).
fn credited(episode: &Trajectory, collision_reward: f64) -> Vec<f64> {
    let mut rewards: Vec<f64> = episode.steps.iter().map(|step| step.reward).collect();
    for (at, step) in episode.steps.iter().enumerate() {
        for &origin in step.hits.iter().filter(|&&origin| origin < at) {
            rewards[origin] = collision_reward;
            rewards[at] = collision_reward / 3.0;
        }
    }
    rewards
}

/// ε after so many steps.
fn epsilon(settings: &Hyperparameters, steps: u64) -> f64 {
    let (begin, end) = (settings.exploration_begin, settings.exploration_end);
    let share = steps as f64 / settings.exploration_steps as f64;
    match settings.exploration {
        Exploration::Linear => begin + (end - begin) * share.min(1.0),
        Exploration::ExponentialThenEnd if share > 1.0 => end,
        Exploration::Exponential | Exploration::ExponentialThenEnd => end + (begin - end) * libm::exp(-share),
    }
}

/// β after so many updates.
fn importance(settings: &Hyperparameters, updates: u64) -> f64 {
    let share = (updates as f64 / settings.importance_updates as f64).min(1.0);
    settings.importance_begin + (settings.importance_end - settings.importance_begin) * share
}

pub(super) fn priorities(settings: &Hyperparameters) -> Priorities {
    Priorities {
        exponent: settings.priority_exponent,
        floor: settings.priority_floor,
        first: settings.priority_first,
    }
}

#[cfg(test)]
mod tests;
