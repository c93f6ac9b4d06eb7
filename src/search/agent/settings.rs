//! How the settings of an agent are read, checked and recorded. Each agent's own stand beside it.

use core::fmt::Display;
use core::ops::Bound::{Excluded, Included};
use core::ops::RangeBounds;
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::mdp::{ProcKind, RewardSettings};
use avastra_lang::syntax::{listed, nearest, settings_mistake, yaml_mistake};

use super::learner::LearnerSettings;
use super::presets::Preset;
use super::q_policy::Rows;
use super::registry::{Entry, Kind, REGISTRY};
use super::search::{BanditSettings, ConstantSettings};
use super::trainable::Trainable;

/// All settings of one agent. In a file, the names of the settings tell which kind of agent it is.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Settings {
    Learning(Box<LearnerSettings>),
    Constant(ConstantSettings),
    Bandit(BanditSettings),
}

/// What the settings of every agent can do.
pub(super) trait Configured: Serialize + DeserializeOwned {
    type Trained: Trainable;

    /// # Errors
    /// If a value is out of range.
    fn check(&self) -> Result<(), SettingsError>;

    /// An agent that knows nothing yet.
    fn build(&self, rows: Arc<Rows>, seed: u64) -> Self::Trained;

    /// The agent that was saved; `None` if the bytes are not those of an agent with such settings and rows.
    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Self::Trained>;
}

/// Why settings are refused.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    #[error("{0}")]
    Text(String),
    #[error("no preset `{name}` for this agent: it has {known}")]
    Preset { name: String, known: String },
    #[error("no setting `{name}`{hint}")]
    Unknown { name: String, hint: String },
    #[error("this agent has no setting `{name}`: it is one of {owners}")]
    Elsewhere { name: String, owners: String },
    #[error("`{name}` is {value}, but must be {wanted}")]
    Range { name: &'static str, value: String, wanted: &'static str },
}

/// The one of some names that is most like an unknown one, as the end of a message; empty if none is.
pub(super) fn hint<'a>(unknown: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    nearest(unknown, names).map_or(String::new(), |name| format!(": did you mean `{name}`?"))
}

/// Does the same with the settings of whichever agent they are of.
macro_rules! each {
    ($settings:expr, $own:ident => $done:expr) => {
        match $settings {
            Settings::Learning($own) => $done,
            Settings::Constant($own) => $done,
            Settings::Bandit($own) => $done,
        }
    };
}

impl Settings {
    /// The settings of an agent, as a YAML text changes them; `None` if it has nothing to learn. A line `preset` in the
    /// text takes precedence over the argument; without both, an agent that has presets begins with its first.
    ///
    /// # Errors
    /// Text that is no map, an unknown preset, a setting that the agent does not have, a value of the wrong kind or out
    /// of range.
    pub fn from_yaml(
        entry: &Entry,
        preset: Option<&str>,
        text: &str,
    ) -> Option<Result<Settings, SettingsError>> {
        let no_presets =
            |name: &str| Err(SettingsError::Text(format!("no preset `{name}`: `{}` has none", entry.name)));
        match (&entry.kind, preset) {
            (Kind::Ready(_) | Kind::OneRow(_), _) => None,
            (Kind::Learning(presets), _) => Some(from_preset(presets, preset, text)),
            (Kind::Searching(_), Some(name)) => Some(no_presets(name)),
            (Kind::Searching(read), None) => Some(lines(text).and_then(read)),
        }
    }

    /// An agent that knows nothing yet.
    pub fn build(&self, rows: Arc<Rows>, seed: u64) -> Box<dyn Trainable> {
        each!(self, own => Box::new(own.build(rows, seed)))
    }

    /// The agent that was saved; `None` if the bytes are not those of an agent with such settings and rows.
    pub fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Box<dyn Trainable>> {
        each!(self, own => Some(Box::new(own.restore(rows, bytes)?)))
    }

    /// The settings, if they are those of a learner.
    pub fn learner(&self) -> Option<&LearnerSettings> {
        match self {
            Settings::Learning(settings) => Some(settings),
            _ => None,
        }
    }

    /// The preset that the settings began as; `search` for a search, which has none.
    pub fn preset(&self) -> &str {
        self.learner().map_or("search", |settings| &settings.preset)
    }

    /// Names of the actions and groups that the agent may choose from; empty: all.
    pub fn actions(&self) -> &[String] {
        self.learner().map_or(&[], |settings| &settings.choice.actions)
    }

    /// Observation period in place of the space's own, s.
    pub fn observation_period_s(&self) -> Option<f64> {
        self.learner().and_then(|settings| settings.payment.observation_period_s)
    }

    /// Formula of the collision probability.
    pub fn proc(&self) -> ProcKind {
        self.learner().map_or(ProcKind::Avastra, |settings| settings.payment.proc)
    }

    /// Constants of the reward; `None`: the space's own reward. A search reports the reward, but does not
    /// use it.
    pub fn reward(&self) -> Option<RewardSettings> {
        self.learner().and_then(|settings| settings.payment.equation())
    }
}

/// The settings of a learner: those of a preset with the changes of a YAML text.
fn from_preset(presets: &[Preset], preset: Option<&str>, text: &str) -> Result<Settings, SettingsError> {
    let changes = lines(text)?;
    let name = changes.get("preset").and_then(Value::as_str).or(preset).unwrap_or(presets[0].name);
    let Some(base) = presets.iter().find(|known| known.name == name) else {
        let known = listed(&presets.iter().map(|preset| preset.name).collect::<Vec<_>>());
        return Err(SettingsError::Preset { name: name.to_owned(), known });
    };
    Ok(Settings::Learning(Box::new(changed(&(base.settings)(), changes)?)))
}

/// The settings of a YAML text by name.
fn lines(text: &str) -> Result<Map<String, Value>, SettingsError> {
    let read: Option<Value> =
        serde_yaml::from_str(text).map_err(|error| SettingsError::Text(yaml_mistake(&error, text)))?;
    match read {
        None | Some(Value::Null) => Ok(Map::new()),
        Some(Value::Object(lines)) => Ok(lines),
        Some(_) => Err(SettingsError::Text("settings are lines like `discount: 0.9`".to_owned())),
    }
}

/// Settings with changes by name, checked.
pub(super) fn changed<T: Configured>(base: &T, changes: Map<String, Value>) -> Result<T, SettingsError> {
    let read = |record| {
        serde_json::from_value::<T>(Value::Object(record))
            .map_err(|error| settings_mistake(&error.to_string(), None))
    };
    let mut whole = record(base);
    for (name, value) in changes {
        if !whole.contains_key(&name) {
            return Err(no_setting(name, &whole));
        }
        // Each change is tried alone, so that an error names the setting that is wrong.
        let mut alone = record(base);
        alone.insert(name.clone(), value.clone());
        read(alone).map_err(|mistake| SettingsError::Text(format!("`{name}`: {mistake}")))?;
        whole.insert(name, value);
    }
    let settings = read(whole).map_err(SettingsError::Text)?;
    settings.check()?;
    Ok(settings)
}

/// Every setting by name.
pub(super) fn record(settings: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(settings).expect("settings are plain data") {
        Value::Object(record) => record,
        _ => unreachable!("a struct is an object"),
    }
}

/// A name that is not among the settings of an agent: those agents that have it, or else a name that is like it.
fn no_setting(name: String, own: &Map<String, Value>) -> SettingsError {
    let default = |entry: &Entry| Settings::from_yaml(entry, None, "").and_then(Result::ok);
    let has_it = |entry: &&Entry| default(entry).is_some_and(|other| record(&other).contains_key(&name));
    let owners: Vec<&str> = REGISTRY.iter().filter(has_it).map(|entry| entry.name).collect();
    if !owners.is_empty() {
        return SettingsError::Elsewhere { name, owners: listed(&owners) };
    }
    let hint = hint(&name, own.keys().map(String::as_str));
    SettingsError::Unknown { name, hint }
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
    range: impl RangeBounds<T>,
    wanted: &'static str,
) -> Requirement {
    Requirement { name, is_met: range.contains(&value), value: value.to_string(), wanted }
}

/// The requirement that a value is a share or a probability.
pub(super) fn unit(name: &'static str, value: f64) -> Requirement {
    within(name, value, 0.0..=1.0, "from 0 to 1")
}

pub(super) fn positive(name: &'static str, value: f64) -> Requirement {
    within(name, value, (Excluded(0.0), Included(1e6)), "above 0, and at most 1e6")
}

pub(super) fn count(name: &'static str, value: u64, most: u64) -> Requirement {
    within(name, value, 1..=most, "a whole number from 1, and not enormous")
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
    use crate::agent::by_name;

    #[test]
    fn mistakes_are_named() {
        let message = |agent: &str, text: &str| {
            let entry = by_name(agent).expect("it is registered");
            Settings::from_yaml(entry, None, text).expect("it is trained").unwrap_err().to_string()
        };
        let ddqn = |text: &str| message("ddqn", text);
        assert_eq!(ddqn("discuont: 0.9"), "no setting `discuont`: did you mean `discount`?");
        assert_eq!(ddqn("discount: 1.5"), "`discount` is 1.5, but must be from 0 to 1");
        assert_eq!(
            ddqn("preset: papre"),
            "no preset `papre` for this agent: it has `avastra`, `paper` and `released`"
        );
        assert!(
            ddqn("loss: cubed").ends_with("there is no `cubed`; there are `squared` and `huber`"),
            "{}",
            ddqn("loss: cubed")
        );
        assert!(ddqn("- 3").contains("lines like"));
        assert!(ddqn("pays_maker: true\ndelayed_credit: true").starts_with("`pays_maker` needs"));
        assert_eq!(ddqn("average_decay: 1"), "`average_decay` is 1, but must be at least 0, and below 1");
        assert_eq!(
            ddqn("doubt: 0.5"),
            "this agent has no setting `doubt`: it is one of `constant` and `bandit`"
        );
        assert_eq!(
            message("bandit", "discount: 0.5"),
            "this agent has no setting `discount`: it is one of `ddqn` and `deep_collision`"
        );
        assert_eq!(message("bandit", "record_share: 2"), "`record_share` is 2, but must be from 0 to 1");
    }
}
