//! Every setting of a learning agent, its presets, and how a file changes them.
//!
//! Sources: the paper, its published package (iSE-UET-VNU/AVASTRA), DeepCollision's paper and code.
//! "Ours" marks what they leave open. A policy file records the whole of it.

use serde_json::Value;

use crate::mdp::{ProcKind, RewardSettings};
use crate::syntax::{listed, nearest};

use super::network::Initialization;
use super::presets;

/// Settings of a learning agent. Presets give the values; there is no other default.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// The preset that this began as, for the reader; every value is here in full.
    pub preset: String,

    // What the agent sees and may do.
    /// Which variables it sees (RQ2).
    pub state: StateSet,
    /// How they go into the network.
    pub encoding: Encoding,
    /// Names of the actions and groups that it may choose from (RQ2); empty: all.
    pub actions: Vec<String>,
    /// Whether rows that the rules forbid are left out when it chooses. Where not, a forbidden choice
    /// is a step lost.
    pub masks_choice: bool,
    /// Whether they are left out of the learning target too.
    pub masks_target: bool,
    /// Steps that must pass between two changes of weather or time; 0: none. Published package: 5.
    pub environment_gate_steps: u32,

    // The step and its reward.
    /// Observation period (OTP), s, in place of the space's own (RQ3).
    pub observation_period_s: Option<f64>,
    /// How collision probabilities are reckoned.
    pub proc: ProcKind,
    /// Where rewards come from.
    pub reward: RewardSource,
    /// R_col (RQ3).
    pub collision_reward: f64,
    /// For a collision that the space's verdict does not count.
    pub uncounted_reward: f64,
    /// A collision probability up to this is safe, in `[0, 1]`.
    pub safe_proc_max: f64,
    /// Whether that bound itself is safe.
    pub bound_is_safe: bool,
    /// For a safe step.
    pub safe_reward: f64,
    /// Whether the step at which an obstacle appeared gets the collision reward that comes of it, and
    /// the step of the collision a third. Published package: yes.
    pub delayed_credit: bool,

    // The network.
    /// Widths of the hidden layers, each 1 to 4096; one to four of them.
    pub hidden_units: Vec<usize>,
    pub dueling: bool,
    pub initialization: Initialization,

    // Its training.
    /// Of Adam, above 0.
    pub learning_rate: f64,
    pub loss: Loss,
    /// The gradient is shortened to this length.
    pub gradient_norm_max: Option<f64>,
    /// Transitions of one update.
    pub batch_len: usize,
    /// Transitions that must be there before the first update.
    pub learning_starts: usize,
    /// Updates for each step of an episode; made when it ends.
    pub updates_per_step: u32,
    /// Updates between two copies of the online network to the target network.
    pub target_period_updates: u64,

    // The target.
    /// Double DQN: the online network chooses the next row, the target network values it.
    pub double: bool,
    /// γ, in `[0, 1]`.
    pub discount: f64,
    /// Rewards before the bootstrapped value (n-step), at least 1.
    pub n_step: usize,
    /// Whether arrival ends the sum of rewards. The published packages bootstrap through it. A truncated
    /// episode (stalled, step limit) is bootstrapped in any case.
    pub arrival_is_terminal: bool,

    // Replay.
    /// Transitions that are kept.
    pub replay_capacity: usize,
    /// α of prioritised replay; 0: none.
    pub priority_exponent: f64,
    /// Added to the TD error, above 0.
    pub priority_floor: f64,
    /// Of the first transition.
    pub priority_first: f64,
    /// β at the first update, in `[0, 1]`.
    pub importance_begin: f64,
    /// β after `importance_updates` updates and from then on.
    pub importance_end: f64,
    pub importance_updates: u64,

    // Exploration.
    /// How ε falls with the steps.
    pub exploration: Exploration,
    pub exploration_begin: f64,
    /// The floor of ε (RQ3).
    pub exploration_end: f64,
    /// How many steps that takes; the time constant of an exponential.
    pub exploration_steps: u64,
    /// Steps at the beginning that are all random.
    pub random_steps: u64,
    /// Whether ε is the share of greedy choices, as in DeepCollision's published code.
    pub exploration_inverted: bool,
    /// By how much the weight of a row falls each time that it is chosen at random, as a share; the
    /// others rise. Published package: 0.05.
    pub random_decay: f64,
    /// ε of the trained policy.
    pub evaluation_epsilon: f64,

    // The readable rules that are distilled from the network at the end (VIPER, Bastani et al., 2018). The
    // numbers are ours.
    /// Leaves of the decision tree, at most, which is lines of rules; 0: none are distilled.
    pub rules_leaves: usize,
    /// Its depth, at most.
    pub rules_depth: usize,
    /// Rounds of DAgger: in the first the network drives, then the rules of the round before.
    pub rules_rounds: u32,
    /// Episodes of a round, on each road.
    pub rules_episodes: u32,
}

/// Sets of state variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateSet {
    /// The paper's 19.
    Full,
    /// The 12 of the driving system (paper, Table 2).
    Internal,
    /// The 7 of the surroundings (paper, Table 1).
    External,
    /// DeepCollision's 12: pose, weather, clock, signal, speed.
    DeepCollision,
    /// The paper's 19 and where the nearest obstacle and the road ahead are: ours.
    Extended,
}

/// How a variable goes into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// As it is, like all published code.
    Raw,
    /// By a fixed scale, categories one-hot.
    Scaled,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RewardSource {
    /// The paper's Eq. 8, with the constants here.
    Equation,
    /// The `reward` block of the space; the constants here are not used.
    Space,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    Squared,
    /// Squared within 1, linear beyond.
    Huber,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exploration {
    Linear,
    /// End + (begin - end) · exp(-steps / time constant).
    Exponential,
    /// The same up to the time constant, and the end from then on: the published package.
    ExponentialThenEnd,
}

/// Why settings cannot be taken.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    #[error("{0}")]
    Text(String),
    #[error("no preset `{name}` for this agent: it has {known}")]
    Preset { name: String, known: String },
    #[error("no setting `{name}`{}", hint(suggestion))]
    Unknown { name: String, suggestion: Option<String> },
    #[error("`{name}` is {value}, but must be {wanted}")]
    Range { name: &'static str, value: String, wanted: &'static str },
}

fn hint(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map_or(String::new(), |name| format!(": did you mean `{name}`?"))
}

impl Hyperparameters {
    /// A preset of an agent with what a YAML text changes. The text's own `preset` comes before
    /// `preset`; the first of `presets` is the default.
    ///
    /// # Errors
    /// Text that is no map, an unknown preset or setting, a value of the wrong kind or out of range.
    pub fn from_yaml(
        presets: &[presets::Preset],
        preset: Option<&str>,
        text: &str,
    ) -> Result<Hyperparameters, SettingsError> {
        let changes: Option<Value> =
            serde_yaml::from_str(text).map_err(|error| SettingsError::Text(error.to_string()))?;
        let changes = match changes {
            None | Some(Value::Null) => serde_json::Map::new(),
            Some(Value::Object(changes)) => changes,
            Some(_) => return Err(SettingsError::Text("settings are lines like `discount: 0.9`".to_owned())),
        };
        let name = changes.get("preset").and_then(Value::as_str).or(preset).unwrap_or(presets[0].name);
        let base = presets.iter().find(|known| known.name == name).ok_or_else(|| {
            let known = listed(&presets.iter().map(|preset| preset.name).collect::<Vec<_>>());
            SettingsError::Preset { name: name.to_owned(), known }
        })?;
        (base.settings)().changed(changes)
    }

    /// Settings as a policy file records them.
    ///
    /// # Errors
    /// As [`Hyperparameters::from_yaml`], and if one is missing.
    pub fn from_record(record: &serde_json::Map<String, Value>) -> Result<Hyperparameters, SettingsError> {
        let known = (presets::DDQN[0].settings)().record();
        if let Some(missing) = known.keys().find(|name| !record.contains_key(*name)) {
            return Err(SettingsError::Text(format!("the setting `{missing}` is missing")));
        }
        (presets::DDQN[0].settings)().changed(record.clone())
    }

    /// Every setting by name.
    pub fn record(&self) -> serde_json::Map<String, Value> {
        match serde_json::to_value(self).expect("settings are plain data") {
            Value::Object(record) => record,
            _ => unreachable!("a struct is an object"),
        }
    }

    /// Constants of the reward.
    pub fn reward_settings(&self) -> RewardSettings {
        RewardSettings {
            collision: self.collision_reward,
            uncounted: self.uncounted_reward,
            safe_proc_max: self.safe_proc_max,
            bound_is_safe: self.bound_is_safe,
            safe: self.safe_reward,
        }
    }

    fn changed(&self, changes: serde_json::Map<String, Value>) -> Result<Hyperparameters, SettingsError> {
        let mut record = self.record();
        for (name, value) in changes {
            if !record.contains_key(&name) {
                let suggestion = nearest(&name, record.keys().map(String::as_str)).map(str::to_owned);
                return Err(SettingsError::Unknown { name, suggestion });
            }
            // A mistake is put at its own setting's door: all others are good already.
            let mut alone = self.record();
            alone.insert(name.clone(), value.clone());
            serde_json::from_value::<Hyperparameters>(Value::Object(alone))
                .map_err(|error| SettingsError::Text(format!("`{name}`: {error}")))?;
            record.insert(name, value);
        }
        let settings: Hyperparameters = serde_json::from_value(Value::Object(record))
            .map_err(|error| SettingsError::Text(error.to_string()))?;
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), SettingsError> {
        let mut wrong = None;
        let mut require = |name, is_right: bool, value: String, wanted| {
            if !is_right && wrong.is_none() {
                wrong = Some(SettingsError::Range { name, value, wanted });
            }
        };
        let unit = 0.0..=1.0;
        for (name, value) in [
            ("safe_proc_max", self.safe_proc_max),
            ("discount", self.discount),
            ("priority_exponent", self.priority_exponent),
            ("importance_begin", self.importance_begin),
            ("importance_end", self.importance_end),
            ("exploration_begin", self.exploration_begin),
            ("exploration_end", self.exploration_end),
            ("random_decay", self.random_decay),
            ("evaluation_epsilon", self.evaluation_epsilon),
        ] {
            require(name, unit.contains(&value), value.to_string(), "from 0 to 1");
        }
        for (name, value) in [
            ("learning_rate", self.learning_rate),
            ("priority_floor", self.priority_floor),
            ("priority_first", self.priority_first),
            ("gradient_norm_max", self.gradient_norm_max.unwrap_or(1.0)),
        ] {
            require(name, value > 0.0 && value <= 1e6, value.to_string(), "above 0, and at most 1e6");
        }
        for (name, value) in [
            ("collision_reward", self.collision_reward),
            ("uncounted_reward", self.uncounted_reward),
            ("safe_reward", self.safe_reward),
        ] {
            require(name, value.abs() <= 1e6, value.to_string(), "from -1e6 to 1e6");
        }
        for (name, value, most) in [
            ("batch_len", self.batch_len, 4096),
            ("n_step", self.n_step, 100),
            ("replay_capacity", self.replay_capacity, 1_000_000),
            ("target_period_updates", self.target_period_updates as usize, 1_000_000_000),
            ("importance_updates", self.importance_updates as usize, 1_000_000_000),
            ("exploration_steps", self.exploration_steps as usize, 1_000_000_000),
        ] {
            let is_right = (1..=most).contains(&value);
            require(name, is_right, value.to_string(), "a whole number from 1, and not enormous");
        }
        let begins = (1..=self.replay_capacity).contains(&self.learning_starts);
        require("learning_starts", begins, self.learning_starts.to_string(), "from 1 to `replay_capacity`");
        require("rules_leaves", self.rules_leaves <= 256, self.rules_leaves.to_string(), "up to 256");
        let is_right = (1..=32).contains(&self.rules_depth);
        require("rules_depth", is_right, self.rules_depth.to_string(), "from 1 to 32");
        for (name, value) in [("rules_rounds", self.rules_rounds), ("rules_episodes", self.rules_episodes)] {
            require(name, (1..=1000).contains(&value), value.to_string(), "from 1 to 1000");
        }
        require(
            "updates_per_step",
            self.updates_per_step <= 64,
            self.updates_per_step.to_string(),
            "up to 64",
        );
        let period_s = self.observation_period_s.unwrap_or(6.0);
        let is_right = (0.5..=60.0).contains(&period_s);
        require("observation_period_s", is_right, period_s.to_string(), "from 0.5 to 60");
        let widths = &self.hidden_units;
        let fits = (1..=4).contains(&widths.len()) && widths.iter().all(|width| (1..=4096).contains(width));
        require("hidden_units", fits, format!("{widths:?}"), "one to four widths from 1 to 4096");
        if let Initialization::Normal(deviation) = self.initialization {
            let fits = (0.0..=10.0).contains(&deviation);
            require("initialization", fits, deviation.to_string(), "`he`, or normal from 0 to 10");
        }
        wrong.map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use presets::{DDQN, DEEP_COLLISION};

    #[test]
    fn every_preset_is_sound_and_survives_its_record() {
        for preset in DDQN.iter().chain(DEEP_COLLISION) {
            let settings = (preset.settings)();
            assert_eq!(settings.preset, preset.name);
            assert_eq!(Hyperparameters::from_record(&settings.record()).unwrap(), settings);
        }
    }

    #[test]
    fn a_file_changes_what_it_names() {
        let text =
            "preset: paper\ncollision_reward: 10\nhidden_units: [64, 64]\ninitialization: { normal: 0.1 }\n";
        let settings = Hyperparameters::from_yaml(DDQN, None, text).unwrap();
        let expected = Hyperparameters {
            collision_reward: 10.0,
            hidden_units: vec![64, 64],
            initialization: Initialization::Normal(0.1),
            ..presets::paper()
        };
        assert_eq!(settings, expected);
        assert_eq!(Hyperparameters::from_yaml(DDQN, None, "").unwrap(), presets::avastra());
        assert_eq!(Hyperparameters::from_yaml(DDQN, Some("released"), "").unwrap(), presets::released());
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| Hyperparameters::from_yaml(DDQN, None, text).unwrap_err().to_string();
        assert_eq!(message("discuont: 0.9"), "no setting `discuont`: did you mean `discount`?");
        assert_eq!(message("discount: 1.5"), "`discount` is 1.5, but must be from 0 to 1");
        assert_eq!(
            message("preset: papre"),
            "no preset `papre` for this agent: it has `avastra`, `paper` and `released`"
        );
        assert!(
            message("loss: cubed").starts_with("`loss`: unknown variant `cubed`"),
            "{}",
            message("loss: cubed")
        );
        assert!(message("- 3").contains("lines like"));
    }
}
