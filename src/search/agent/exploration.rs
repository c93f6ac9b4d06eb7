//! ε of ε-greedy exploration: how often a choice is random.

use core::ops::Bound::{Excluded, Included};

use super::checked::{SettingsError, count, require, unit, within};

/// How ε falls in a training, and what it is afterwards.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ExplorationSettings {
    /// How ε falls with the steps.
    pub exploration: Exploration,
    /// ε at the first step.
    pub exploration_begin: f64,
    /// The floor of ε (RQ3).
    pub exploration_end: f64,
    /// Steps until ε is at its floor; for an exponential, its time constant.
    pub exploration_steps: u64,
    /// In place of `exploration_steps`: the share of the training's episodes until ε is at its floor, above 0 and at
    /// most 1. So a short training explores as large a part of it as a long one.
    pub exploration_share: Option<f64>,
    /// Number of first steps in which ε is 1.
    pub random_steps: u64,
    /// Whether ε is the share of greedy choices, as in DeepCollision's published code. A quirk (see
    /// `quirks`).
    pub exploration_inverted: bool,
    /// Share of its weight that a row loses to the others each time that it is chosen at random; 0: random
    /// choices are uniform. Published package: 0.05. A quirk (see `quirks`).
    pub random_decay: f64,
    /// ε of the trained policy.
    pub evaluation_epsilon: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exploration {
    Linear,
    /// End + (begin - end) · exp(-steps / time constant).
    Exponential,
    /// `Exponential` up to the time constant, then the end: the published package.
    ExponentialThenEnd,
}

impl ExplorationSettings {
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        require([
            unit("exploration_begin", self.exploration_begin),
            unit("exploration_end", self.exploration_end),
            unit("random_decay", self.random_decay),
            unit("evaluation_epsilon", self.evaluation_epsilon),
            count("exploration_steps", self.exploration_steps, 1_000_000_000),
        ])?;
        let above_0 = (Excluded(0.0), Included(1.0));
        let share = |share: f64| within("exploration_share", share, above_0, "above 0, and at most 1");
        require(self.exploration_share.map(share))
    }

    /// ε of training after so many steps, when a share of the training's episodes is over.
    pub fn epsilon(&self, steps: u64, over: f64) -> f64 {
        if steps < self.random_steps {
            return 1.0;
        }
        let (begin, end) = (self.exploration_begin, self.exploration_end);
        let share = match self.exploration_share {
            Some(share) => over / share,
            None => steps as f64 / self.exploration_steps as f64,
        };
        match self.exploration {
            Exploration::Linear => begin + (end - begin) * share.min(1.0),
            Exploration::ExponentialThenEnd if share > 1.0 => end,
            Exploration::Exponential | Exploration::ExponentialThenEnd => {
                end + (begin - end) * libm::exp(-share)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::presets;

    #[test]
    fn exploration_falls_as_the_settings_say() {
        let at = |exploration, steps| {
            let settings = ExplorationSettings {
                exploration,
                exploration_begin: 1.0,
                exploration_end: 0.1,
                exploration_steps: 100,
                exploration_share: None,
                random_steps: 10,
                ..presets::avastra().exploration
            };
            settings.epsilon(steps, 0.5)
        };
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(at(Exploration::Linear, 9), 1.0);
        near(at(Exploration::Linear, 50), 0.55);
        near(at(Exploration::Linear, 500), 0.1);
        near(at(Exploration::Exponential, 100), 0.1 + 0.9 * 0.367_879_441_171);
        near(at(Exploration::ExponentialThenEnd, 100), 0.1 + 0.9 * 0.367_879_441_171);
        near(at(Exploration::ExponentialThenEnd, 101), 0.1);
        let by_share = ExplorationSettings {
            exploration_begin: 1.0,
            exploration_end: 0.1,
            exploration_share: Some(0.4),
            ..presets::avastra().exploration
        };
        near(by_share.epsilon(1_000_000, 0.0), 1.0);
        near(by_share.epsilon(0, 0.2), 0.55);
        near(by_share.epsilon(0, 0.9), 0.1);
    }
}
