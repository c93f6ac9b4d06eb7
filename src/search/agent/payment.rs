//! The reward that a step of an episode pays the learner.

use crate::mdp::{ProcKind, RewardSettings};
use avastra_lang::model::TICK_MS;

use super::checked::{Requirement, SettingsError, require, unit, within};
use super::trajectory::Trajectory;

/// The step and its reward.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PaymentSettings {
    /// Observation period (OTP), s, which replaces the space's own (RQ3).
    pub observation_period_s: Option<f64>,
    /// Formula of the collision probability.
    pub proc: ProcKind,
    /// Where rewards come from.
    pub reward: RewardSource,
    /// Reward of a step with a collision, R_col (RQ3).
    pub collision_reward: f64,
    /// Reward of a step whose collision the space's verdict does not count.
    pub uncounted_reward: f64,
    /// A step is safe if its collision probability is below this, in `[0, 1]`.
    pub safe_proc_max: f64,
    /// Whether a probability equal to `safe_proc_max` is safe too.
    pub bound_is_safe: bool,
    /// Reward of a safe step.
    pub safe_reward: f64,
    /// Whether a collision pays at the step that made its obstacle appear, and a third at its own step.
    /// Published package: yes. A quirk (see `quirks`).
    pub delayed_credit: bool,
    /// Whether a collision that counts pays R_col at the step whose choice made its obstacle appear, and its own step
    /// then earns `uncounted_reward`: it only happened there. Ours; needs `reward: equation`.
    pub pays_maker: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RewardSource {
    /// The paper's Eq. 8, with the constants here.
    Equation,
    /// The `reward` block of the space; the constants here are not used.
    Space,
}

impl PaymentSettings {
    /// # Errors
    /// If a value is out of range, or `pays_maker` contradicts another setting.
    pub fn check(&self) -> Result<(), SettingsError> {
        let reward = |name, value: f64| within(name, value, -1e6..=1e6, "from -1e6 to 1e6");
        require([
            unit("safe_proc_max", self.safe_proc_max),
            reward("collision_reward", self.collision_reward),
            reward("uncounted_reward", self.uncounted_reward),
            reward("safe_reward", self.safe_reward),
        ])?;
        let period = |period_s: f64| {
            // In ticks of the simulation it is a whole number, as a space's `step` is, but for rounding.
            let ticks = period_s * 1000.0 / TICK_MS as f64;
            let is_met = (0.5..=60.0).contains(&period_s) && (ticks - ticks.round()).abs() < 1e-9;
            let wanted = "from 0.5 to 60, a multiple of 0.02";
            Requirement { name: "observation_period_s", is_met, value: period_s.to_string(), wanted }
        };
        require(self.observation_period_s.map(period))?;
        if self.pays_maker && (self.delayed_credit || self.reward == RewardSource::Space) {
            let message = "`pays_maker` needs `reward: equation` and `delayed_credit: false`; or say `pays_maker: false`";
            return Err(SettingsError::Text(message.to_owned()));
        }
        Ok(())
    }

    /// Constants of the reward; `None`: it comes from the space.
    pub fn equation(&self) -> Option<RewardSettings> {
        (self.reward == RewardSource::Equation).then_some(RewardSettings {
            collision: self.collision_reward,
            uncounted: self.uncounted_reward,
            safe_proc_max: self.safe_proc_max,
            bound_is_safe: self.bound_is_safe,
            safe: self.safe_reward,
        })
    }

    /// The reward of each step of an episode, shape `(steps,)`, where a collision that counts pays R_col at the step
    /// that made its obstacle appear. The step at which it happened is not paid for it: its choice had no part.
    ///
    /// A collision whose obstacle no choice made pays where it happened.
    pub(super) fn paid_to_makers(&self, episode: &Trajectory) -> Vec<f64> {
        let mut rewards: Vec<f64> = episode.steps.iter().map(|step| step.reward).collect();
        let crashes = || {
            let steps = episode.steps.iter().enumerate();
            steps.flat_map(|(at, step)| step.crashes.iter().map(move |maker| (at, maker.unwrap_or(at))))
        };
        for (at, _) in crashes() {
            rewards[at] = self.uncounted_reward;
        }
        for (_, maker) in crashes() {
            rewards[maker] = self.collision_reward;
        }
        rewards
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::presets::paper;

    #[test]
    fn an_observation_period_is_a_number_of_ticks() {
        let with = |period_s| PaymentSettings { observation_period_s: Some(period_s), ..paper().payment };
        // As binary fractions the first three are no exact multiples.
        for period_s in [0.58, 2.3, 1.14, 0.5, 6.0, 60.0] {
            assert!(with(period_s).check().is_ok(), "{period_s}");
        }
        for period_s in [0.57, 2.301, 0.48, 60.02, f64::NAN] {
            assert!(with(period_s).check().is_err(), "{period_s}");
        }
    }
}
