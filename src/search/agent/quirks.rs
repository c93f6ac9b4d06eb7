//! Quirks: what the published packages do that no paper describes.
//!
//! The presets `released` turn them on to reproduce the packages; every other preset has none, and without
//! a quirk its method here changes nothing. So the learner reads like its papers. Masks, schedules and
//! bootstrapping through arrival are choices that the papers leave open: they are plain settings.

use avastra_base::rng;
use avastra_base::rng::Rng;

use super::checkpoint::{Reader, Writer};
use super::learner::LearnerSettings;
use super::random::any;
use super::trajectory::Trajectory;

/// The quirks of one agent, and what they remember.
#[derive(Debug, Clone, Default)]
pub(super) struct Quirks {
    /// AVASTRA's package: so many steps must pass between two changes of weather or time, and a change must
    /// differ from the last one; 0: no gate.
    environment_gate_steps: u32,
    /// AVASTRA's package: a collision pays this at the step that made its obstacle appear, and a third of it
    /// at the step at which it happened. It replaces the rewards of both steps.
    delayed_credit: Option<f64>,
    /// DeepCollision's code: ε is the share of greedy choices, not of random ones.
    exploration_inverted: bool,
    /// AVASTRA's package: the share of its weight that a row loses to the other rows each time that it is
    /// chosen at random; 0: random choices are uniform.
    random_decay: f64,
    /// How likely each row is when a row is chosen at random, shape `(rows,)`.
    random_weights: Vec<f64>,
    /// The last row of this episode that changed weather or time, and the steps since then.
    last_environment: Option<(usize, u32)>,
}

impl Quirks {
    /// The quirks that the settings turn on, for an agent with `rows` rows.
    pub fn new(settings: &LearnerSettings, rows: usize) -> Quirks {
        Quirks {
            environment_gate_steps: settings.choice.environment_gate_steps,
            delayed_credit: settings.payment.delayed_credit.then_some(settings.payment.collision_reward),
            exploration_inverted: settings.exploration.exploration_inverted,
            random_decay: settings.exploration.random_decay,
            random_weights: vec![1.0; rows],
            last_environment: None,
        }
    }

    pub fn save(&self, bytes: &mut Writer) {
        bytes.f64s(&self.random_weights);
    }

    /// Takes on what was saved; `None` if the bytes end too soon.
    pub fn restore(&mut self, bytes: &mut Reader<'_>) -> Option<()> {
        self.random_weights = bytes.f64s(self.random_weights.len())?;
        Some(())
    }

    /// A new episode begins, with the gate open.
    pub fn begin(&mut self) {
        self.last_environment = None;
    }

    /// Whether the gate lets a row pass; `is_environment`: whether the row changes weather or time.
    pub fn lets_pass(&self, row: usize, is_environment: bool) -> bool {
        let period = self.environment_gate_steps;
        match self.last_environment {
            Some((last, since)) if period > 0 && is_environment => since >= period && row != last,
            _ => true,
        }
    }

    /// Tells the gate which row was chosen in this step.
    pub fn chosen(&mut self, row: usize, is_environment: bool) {
        if is_environment {
            self.last_environment = Some((row, 1));
        } else if let Some((_, since)) = &mut self.last_environment {
            *since += 1;
        }
    }

    /// Whether a choice is random, when the algorithm would have it so.
    pub fn explores(&self, explores: bool) -> bool {
        explores != self.exploration_inverted
    }

    /// A random row among the open ones, of shape `(rows,)`; none if no row is open.
    pub fn random_row(&mut self, open: &[bool], rng: &mut Rng) -> Option<usize> {
        debug_assert_eq!(open.len(), self.random_weights.len());
        if self.random_decay == 0.0 {
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
        let lost = self.random_weights[row] * self.random_decay;
        let others = self.random_weights.len().max(2) - 1;
        self.random_weights.iter_mut().for_each(|weight| *weight += lost / others as f64);
        self.random_weights[row] -= lost + lost / others as f64;
        Some(row)
    }

    /// The reward of each step of an episode, shape `(steps,)`.
    pub fn rewards(&self, episode: &Trajectory) -> Vec<f64> {
        let mut rewards: Vec<f64> = episode.steps.iter().map(|step| step.reward).collect();
        let Some(collision_reward) = self.delayed_credit else { return rewards };
        for (at, step) in episode.steps.iter().enumerate() {
            for &origin in step.hits.iter().filter(|&&origin| origin < at) {
                rewards[origin] = collision_reward;
                rewards[at] = collision_reward / 3.0;
            }
        }
        rewards
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::learner::tests::episode;
    use crate::agent::presets::paper;
    use avastra_base::rng::{Stream, stream};

    #[test]
    fn without_a_quirk_nothing_changes() {
        let mut quirks = Quirks::new(&paper(), 3);
        let mut trajectory = episode(&[-1.0, -1.0, 7.5]);
        trajectory.steps[2].hits = vec![0];
        assert_eq!(quirks.rewards(&trajectory), [-1.0, -1.0, 7.5]);
        quirks.chosen(0, true);
        assert!(quirks.lets_pass(0, true) && quirks.explores(true) && !quirks.explores(false));
        let (mut rng, mut twin) = (stream(1, Stream::Exploration, 0), stream(1, Stream::Exploration, 0));
        for _ in 0..20 {
            let open = [true, false, true];
            assert_eq!(quirks.random_row(&open, &mut rng), any(&open, &mut twin));
        }
    }

    #[test]
    fn credit_goes_back_to_where_the_obstacle_appeared() {
        let quirks = Quirks { delayed_credit: Some(7.5), ..Quirks::default() };
        let mut trajectory = episode(&[-1.0, -1.0, -1.0]);
        trajectory.steps[2].hits = vec![0];
        trajectory.steps[1].hits = vec![1];
        assert_eq!(quirks.rewards(&trajectory), [7.5, -1.0, 2.5]);
    }

    #[test]
    fn the_gate_keeps_weather_from_changing_at_every_step() {
        let mut quirks = Quirks { environment_gate_steps: 3, ..Quirks::default() };
        let environment = [true, true, false];
        let mut pass = |row: usize| {
            quirks.chosen(row, environment[row]);
            [0, 1, 2].map(|row| quirks.lets_pass(row, environment[row]))
        };
        assert_eq!(pass(0), [false, false, true]);
        assert_eq!(pass(2), [false, false, true]);
        assert_eq!(pass(2), [false, true, true]);
    }

    #[test]
    fn a_row_that_was_chosen_at_random_becomes_rarer() {
        let mut quirks = Quirks { random_decay: 0.05, random_weights: vec![1.0; 3], ..Quirks::default() };
        let row = quirks.random_row(&[false, true, false], &mut stream(1, Stream::Exploration, 0));
        assert_eq!((row, quirks.random_weights), (Some(1), vec![1.025, 0.95, 1.025]));
    }
}
