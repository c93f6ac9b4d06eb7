//! Settings of the learner: those of the algorithm itself, and those of its parts, which stand beside each part.
//!
//! Sources: the paper, its published package (iSE-UET-VNU/AVASTRA), DeepCollision's paper and code. "Ours" marks what
//! they leave open. `presets` has the values. A file has all settings in one list, by the names of the fields, and a
//! policy file records the whole of it.

use serde_json::{Map, Value};

use crate::agent::checked::{Checked, SettingsError, count, positive, record, require, unit, within};
use crate::agent::choice::ChoiceSettings;
use crate::agent::decision::RulesSettings;
use crate::agent::exploration::ExplorationSettings;
use crate::agent::network::NetworkSettings;
use crate::agent::payment::PaymentSettings;
use crate::agent::replay::ReplaySettings;

/// How a TD error becomes a loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    Squared,
    /// Squared within 1, linear beyond.
    Huber,
}

/// Settings of [`super::Learner`]. Presets give the values; there is no other default.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnerSettings {
    /// The preset that this began as, for the reader; every value is here in full.
    pub preset: String,
    #[serde(flatten)]
    pub choice: ChoiceSettings,
    #[serde(flatten)]
    pub payment: PaymentSettings,
    #[serde(flatten)]
    pub network: NetworkSettings,

    // The training of the network.
    /// Learning rate of Adam, above 0.
    pub learning_rate: f64,
    pub loss: Loss,
    /// A longer gradient is scaled down to this length, above 0.
    pub gradient_norm_max: Option<f64>,
    /// Transitions in one update.
    pub batch_len: usize,
    /// Transitions that the replay must hold before the first update.
    pub learning_starts: usize,
    /// Updates for each step of an episode; they are made when the episode ends.
    pub updates_per_step: u32,
    /// Updates between two copies of the online network to the target network.
    pub target_period_updates: u64,
    /// The running mean of the online network over its updates acts in the end. This is the share of the mean that
    /// an update keeps, in `[0, 1)`: 0.99 averages over some hundred updates. 0: the last network acts.
    pub average_decay: f64,

    // The target.
    /// Double DQN: the online network chooses the next row, the target network values it.
    pub double: bool,
    /// γ, in `[0, 1]`.
    pub discount: f64,
    /// Rewards that are summed before the bootstrapped value: the n of n-step returns, at least 1.
    pub n_step: usize,
    /// Whether no value is expected after arrival. The published packages bootstrap there too. An episode
    /// that was cut off (stalled, step limit) is bootstrapped in any case.
    pub arrival_is_terminal: bool,

    #[serde(flatten)]
    pub replay: ReplaySettings,
    #[serde(flatten)]
    pub exploration: ExplorationSettings,
    #[serde(flatten)]
    pub rules: RulesSettings,
}

impl LearnerSettings {
    /// Every setting by name.
    pub fn record(&self) -> Map<String, Value> {
        record(self)
    }
}

impl Checked for LearnerSettings {
    fn check(&self) -> Result<(), SettingsError> {
        self.payment.check()?;
        self.network.check()?;
        self.replay.check()?;
        self.exploration.check()?;
        self.rules.check()?;
        require([
            unit("discount", self.discount),
            within("average_decay", self.average_decay, 0.0..1.0, "at least 0, and below 1"),
            positive("learning_rate", self.learning_rate),
            count("batch_len", self.batch_len as u64, 4096),
            count("n_step", self.n_step as u64, 100),
            count("target_period_updates", self.target_period_updates, 1_000_000_000),
            within(
                "learning_starts",
                self.learning_starts,
                1..=self.replay.replay_capacity,
                "from 1 to `replay_capacity`",
            ),
            within("updates_per_step", self.updates_per_step, 0..=64, "up to 64"),
        ])?;
        require(self.gradient_norm_max.map(|length| positive("gradient_norm_max", length)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::network::Initialization;
    use crate::agent::presets;
    use crate::agent::presets::{DDQN, DEEP_COLLISION};
    use crate::agent::{Settings, by_name};

    /// Settings of `ddqn` by a preset and the changes of a text.
    fn ddqn(preset: Option<&str>, text: &str) -> LearnerSettings {
        let entry = by_name("ddqn").expect("it is registered");
        let read = Settings::from_yaml(entry, preset, text).expect("it is trained");
        read.expect("the settings are sound").learner().expect("it learns").clone()
    }

    #[test]
    fn every_preset_is_sound_and_survives_its_record() {
        for preset in DDQN.iter().chain(DEEP_COLLISION) {
            let settings = (preset.settings)();
            assert_eq!(settings.preset, preset.name);
            assert_eq!(presets::of_record(&settings.record()).unwrap(), settings);
        }
    }

    #[test]
    fn a_file_changes_what_it_names() {
        let text =
            "preset: paper\ncollision_reward: 10\nhidden_units: [64, 64]\ninitialization: { normal: 0.1 }\n";
        let mut expected = presets::paper();
        expected.payment.collision_reward = 10.0;
        expected.network.hidden_units = vec![64, 64];
        expected.network.initialization = Initialization::Normal(0.1);
        assert_eq!(ddqn(None, text), expected);
        assert_eq!(ddqn(None, ""), presets::avastra());
        assert_eq!(ddqn(Some("released"), ""), presets::released());
    }

    #[test]
    fn a_record_has_every_setting() {
        let now = ddqn(None, "exploration_share: null");
        let mut record = now.record();
        assert_eq!(presets::of_record(&record).unwrap(), now);
        record.remove("discount");
        assert!(presets::of_record(&record).unwrap_err().to_string().contains("`discount`"));
    }

    #[test]
    fn a_record_with_a_name_of_no_setting_is_no_learner() {
        let mut record = presets::paper().record();
        assert!(serde_json::from_value::<LearnerSettings>(record.clone().into()).is_ok());
        record.insert("discuont".to_owned(), 0.5.into());
        assert!(serde_json::from_value::<LearnerSettings>(record.into()).is_err());
    }
}
