//! Every setting of a learning agent, and how a file changes them.
//!
//! Sources: the paper, its published package (iSE-UET-VNU/AVASTRA), DeepCollision's paper and code.
//! "Ours" marks what they leave open. A policy file records the whole of it.

use core::fmt::Display;
use core::ops::RangeInclusive;

use serde_json::Value;

use crate::mdp::{ProcKind, RewardSettings};
use crate::syntax::{listed, nearest, settings_mistake, yaml_mistake};

use super::network::Initialization;
use super::presets;
use super::replay::Priorities;

/// Settings of a learning agent. Presets give the values; there is no other default.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// The preset that this began as, for the reader; every value is here in full.
    pub preset: String,

    // What the agent sees and may do.
    /// State variables that the agent sees (RQ2).
    pub state: StateSet,
    /// How these variables go into the network.
    pub encoding: Encoding,
    /// Names of the actions and groups that the agent may choose from (RQ2); empty: all.
    pub actions: Vec<String>,
    /// Whether the agent chooses only among rows that the rules allow. If not, a forbidden choice loses
    /// the step.
    pub masks_choice: bool,
    /// Whether the learning target considers only rows that the rules allow.
    pub masks_target: bool,
    /// Steps that must pass between two changes of weather or time; 0: no gate. Published package: 5. A
    /// quirk (see `quirks`).
    pub environment_gate_steps: u32,

    // The step and its reward.
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

    // The network.
    /// Widths of the hidden layers, each 1 to 4096; one to four of them.
    pub hidden_units: Vec<usize>,
    /// Whether the network has a dueling head (Wang et al., 2016).
    pub dueling: bool,
    pub initialization: Initialization,

    // Its training.
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
    /// What acts in the end is the running mean of the online network over its updates, and this is the share of the
    /// mean that an update keeps, in `[0, 1)`: 0.99 averages over some hundred updates. 0: the last network acts.
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

    // Replay.
    /// Transitions that the replay keeps.
    pub replay_capacity: usize,
    /// α of prioritised replay, in `[0, 1]`; 0 draws uniformly.
    pub priority_exponent: f64,
    /// Added to the size of each TD error, so that no priority is 0; above 0.
    pub priority_floor: f64,
    /// Priority of the first transition, above 0.
    pub priority_first: f64,
    /// β at the first update, in `[0, 1]`.
    pub importance_begin: f64,
    /// β after `importance_updates` updates and from then on.
    pub importance_end: f64,
    /// Updates over which β goes from `importance_begin` to `importance_end`.
    pub importance_updates: u64,

    // Exploration.
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

    // The readable rules that are distilled from the network at the end (VIPER, Bastani et al., 2018). The
    // numbers are ours.
    /// Most leaves of the decision tree, and so lines of rules; 0: no rules are distilled.
    pub rules_leaves: usize,
    /// Largest depth of the tree, and so tests in a line.
    pub rules_depth: usize,
    /// Rounds of DAgger: the network drives in the first, the rules of the round before in each later one.
    pub rules_rounds: u32,
    /// Episodes in a round, on each road.
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
    /// These, and what tells when: how long the light stays, how far the next conflict is, where the second obstacle
    /// is, and what an action made appear last. Ours.
    Timed,
}

/// How a variable goes into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// The variable as it is, as in all published code.
    Raw,
    /// Divided by a fixed scale; categories one-hot.
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
    /// `Exponential` up to the time constant, then the end: the published package.
    ExponentialThenEnd,
}

/// Why settings are refused.
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
    /// A preset with the changes of a YAML text. A line `preset` in the text takes precedence over the
    /// argument; without both, the first of `presets` is taken.
    ///
    /// # Errors
    /// Text that is no map, an unknown preset or setting, a value of the wrong kind or out of range.
    pub fn from_yaml(
        presets: &[presets::Preset],
        preset: Option<&str>,
        text: &str,
    ) -> Result<Hyperparameters, SettingsError> {
        let changes: Option<Value> =
            serde_yaml::from_str(text).map_err(|error| SettingsError::Text(yaml_mistake(&error, text)))?;
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
        let base = presets::paper();
        if let Some(missing) = base.record().keys().find(|name| !record.contains_key(*name)) {
            return Err(SettingsError::Text(format!("the setting `{missing}` is missing")));
        }
        base.changed(record.clone())
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

    /// ε of training after so many steps, when a share of the training's episodes is over.
    pub(super) fn exploration_epsilon(&self, steps: u64, over: f64) -> f64 {
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

    /// β of prioritised replay after so many updates.
    pub(super) fn importance_exponent(&self, updates: u64) -> f64 {
        let share = (updates as f64 / self.importance_updates as f64).min(1.0);
        self.importance_begin + (self.importance_end - self.importance_begin) * share
    }

    /// How TD errors become priorities.
    pub(super) fn priorities(&self) -> Priorities {
        Priorities {
            exponent: self.priority_exponent,
            floor: self.priority_floor,
            first: self.priority_first,
        }
    }

    fn changed(&self, changes: serde_json::Map<String, Value>) -> Result<Hyperparameters, SettingsError> {
        let mut record = self.record();
        for (name, value) in changes {
            if !record.contains_key(&name) {
                let suggestion = nearest(&name, record.keys().map(String::as_str)).map(str::to_owned);
                return Err(SettingsError::Unknown { name, suggestion });
            }
            // Each change is tried alone, so that an error names the setting that is wrong.
            let mut alone = self.record();
            alone.insert(name.clone(), value.clone());
            serde_json::from_value::<Hyperparameters>(Value::Object(alone))
                .map_err(|error| format!("`{name}`: {}", settings_mistake(&error.to_string(), None)))
                .map_err(SettingsError::Text)?;
            record.insert(name, value);
        }
        let settings: Hyperparameters = serde_json::from_value(Value::Object(record))
            .map_err(|error| SettingsError::Text(settings_mistake(&error.to_string(), None)))?;
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), SettingsError> {
        let unit = |name, value: f64| within(name, value, 0.0..=1.0, "from 0 to 1");
        let positive = |name, value: f64| Requirement {
            is_met: value > 0.0 && value <= 1e6,
            ..within(name, value, 0.0..=1e6, "above 0, and at most 1e6")
        };
        let reward = |name, value: f64| within(name, value, -1e6..=1e6, "from -1e6 to 1e6");
        let count = |name, value: u64, most: u64| {
            within(name, value, 1..=most, "a whole number from 1, and not enormous")
        };
        let widths = &self.hidden_units;
        require([
            unit("safe_proc_max", self.safe_proc_max),
            unit("discount", self.discount),
            unit("priority_exponent", self.priority_exponent),
            unit("importance_begin", self.importance_begin),
            unit("importance_end", self.importance_end),
            unit("exploration_begin", self.exploration_begin),
            unit("exploration_end", self.exploration_end),
            unit("random_decay", self.random_decay),
            Requirement {
                is_met: (0.0..1.0).contains(&self.average_decay),
                ..within("average_decay", self.average_decay, 0.0..=1.0, "at least 0, and below 1")
            },
            unit("evaluation_epsilon", self.evaluation_epsilon),
            positive("learning_rate", self.learning_rate),
            positive("priority_floor", self.priority_floor),
            positive("priority_first", self.priority_first),
            reward("collision_reward", self.collision_reward),
            reward("uncounted_reward", self.uncounted_reward),
            reward("safe_reward", self.safe_reward),
            count("batch_len", self.batch_len as u64, 4096),
            count("n_step", self.n_step as u64, 100),
            count("replay_capacity", self.replay_capacity as u64, 1_000_000),
            count("target_period_updates", self.target_period_updates, 1_000_000_000),
            count("importance_updates", self.importance_updates, 1_000_000_000),
            count("exploration_steps", self.exploration_steps, 1_000_000_000),
            within(
                "learning_starts",
                self.learning_starts,
                1..=self.replay_capacity,
                "from 1 to `replay_capacity`",
            ),
            within("rules_leaves", self.rules_leaves, 0..=256, "up to 256"),
            within("rules_depth", self.rules_depth, 1..=32, "from 1 to 32"),
            within("rules_rounds", self.rules_rounds, 1..=1000, "from 1 to 1000"),
            within("rules_episodes", self.rules_episodes, 1..=1000, "from 1 to 1000"),
            within("updates_per_step", self.updates_per_step, 0..=64, "up to 64"),
            Requirement {
                name: "hidden_units",
                is_met: (1..=4).contains(&widths.len())
                    && widths.iter().all(|width| (1..=4096).contains(width)),
                value: format!("{widths:?}"),
                wanted: "one to four widths from 1 to 4096",
            },
        ])?;
        let deviation = match self.initialization {
            Initialization::Normal(deviation) => Some(deviation),
            Initialization::He => None,
        };
        // What is absent needs no value.
        let optional = [
            self.gradient_norm_max.map(|length| positive("gradient_norm_max", length)),
            self.observation_period_s
                .map(|period_s| within("observation_period_s", period_s, 0.5..=60.0, "from 0.5 to 60")),
            deviation
                .map(|value| within("initialization", value, 0.0..=10.0, "`he`, or normal from 0 to 10")),
            self.exploration_share.map(|share| Requirement {
                is_met: share > 0.0 && share <= 1.0,
                ..within("exploration_share", share, 0.0..=1.0, "above 0, and at most 1")
            }),
        ];
        require(optional.into_iter().flatten())?;
        if self.pays_maker && (self.delayed_credit || self.reward == RewardSource::Space) {
            let message = "`pays_maker` needs `reward: equation` and `delayed_credit: false`; or say `pays_maker: false`";
            return Err(SettingsError::Text(message.to_owned()));
        }
        Ok(())
    }
}

/// What a setting must be, and whether it is.
pub(super) struct Requirement {
    pub name: &'static str,
    pub is_met: bool,
    pub value: String,
    pub wanted: &'static str,
}

/// The requirement that a value lies in a range; `wanted` is the range in words.
pub(super) fn within<T: PartialOrd + Display>(
    name: &'static str,
    value: T,
    range: RangeInclusive<T>,
    wanted: &'static str,
) -> Requirement {
    Requirement { name, is_met: range.contains(&value), value: value.to_string(), wanted }
}

/// Refuses settings by the first requirement that is not met.
pub(super) fn require(requirements: impl IntoIterator<Item = Requirement>) -> Result<(), SettingsError> {
    match requirements.into_iter().find(|requirement| !requirement.is_met) {
        Some(Requirement { name, value, wanted, .. }) => Err(SettingsError::Range { name, value, wanted }),
        None => Ok(()),
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
    fn exploration_falls_as_the_settings_say() {
        let at = |exploration, steps| {
            let settings = Hyperparameters {
                exploration,
                exploration_begin: 1.0,
                exploration_end: 0.1,
                exploration_steps: 100,
                exploration_share: None,
                random_steps: 10,
                ..presets::avastra()
            };
            settings.exploration_epsilon(steps, 0.5)
        };
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(at(Exploration::Linear, 9), 1.0);
        near(at(Exploration::Linear, 50), 0.55);
        near(at(Exploration::Linear, 500), 0.1);
        near(at(Exploration::Exponential, 100), 0.1 + 0.9 * 0.367_879_441_171);
        near(at(Exploration::ExponentialThenEnd, 100), 0.1 + 0.9 * 0.367_879_441_171);
        near(at(Exploration::ExponentialThenEnd, 101), 0.1);
        let by_share = Hyperparameters {
            exploration_begin: 1.0,
            exploration_end: 0.1,
            exploration_share: Some(0.4),
            ..presets::avastra()
        };
        near(by_share.exploration_epsilon(1_000_000, 0.0), 1.0);
        near(by_share.exploration_epsilon(0, 0.2), 0.55);
        near(by_share.exploration_epsilon(0, 0.9), 0.1);
    }

    #[test]
    fn a_record_has_every_setting() {
        let now = Hyperparameters { exploration_share: None, ..presets::avastra() };
        let mut record = now.record();
        assert_eq!(Hyperparameters::from_record(&record).unwrap(), now);
        record.remove("discount");
        assert!(Hyperparameters::from_record(&record).unwrap_err().to_string().contains("`discount`"));
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
            message("loss: cubed").ends_with("there is no `cubed`; there are `squared` and `huber`"),
            "{}",
            message("loss: cubed")
        );
        assert!(message("- 3").contains("lines like"));
        assert!(message("pays_maker: true\ndelayed_credit: true").starts_with("`pays_maker` needs"));
        assert_eq!(message("average_decay: 1"), "`average_decay` is 1, but must be at least 0, and below 1");
    }
}
