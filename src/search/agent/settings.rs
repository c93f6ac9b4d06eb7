//! How the settings of an agent are read and recorded. Each agent's own stand beside it; `checked` says what may be wrong.

use std::sync::Arc;

use serde_json::{Map, Value};

use crate::mdp::{ProcKind, RewardSettings};
use avastra_lang::syntax::{listed, read_yaml};

use super::checked::{SettingsError, changed, record};
use super::choice::Rows;
use super::learner::LearnerSettings;
use super::presets::Preset;
use super::registry::{Entry, Kind, REGISTRY};
use super::search::{BanditSettings, ConstantSettings};
use super::trainable::{Configured, Trainable};

/// All settings of one agent. In a file, the names of the settings tell which kind of agent it is.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Settings {
    Learning(Box<LearnerSettings>),
    Constant(ConstantSettings),
    Bandit(BanditSettings),
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
        .map(|read| read.map_err(elsewhere))
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
    let own = changes.get("preset").and_then(Value::as_str);
    if let (Some(own), Some(asked)) = (own, preset)
        && own != asked
    {
        return Err(SettingsError::TwoPresets { own: own.to_owned(), asked: asked.to_owned() });
    }
    let name = own.or(preset).unwrap_or(presets[0].name);
    let Some(base) = presets.iter().find(|known| known.name == name) else {
        let known = listed(&presets.iter().map(|preset| preset.name).collect::<Vec<_>>());
        return Err(SettingsError::Preset { name: name.to_owned(), known });
    };
    Ok(Settings::Learning(Box::new(changed(&(base.settings)(), changes)?)))
}

/// The settings of a YAML text by name.
fn lines(text: &str) -> Result<Map<String, Value>, SettingsError> {
    let read: Option<Value> = read_yaml(text).map_err(SettingsError::Text)?;
    match read {
        None | Some(Value::Null) => Ok(Map::new()),
        Some(Value::Object(lines)) => Ok(lines),
        Some(_) => Err(SettingsError::Text("settings are lines like `discount: 0.9`".to_owned())),
    }
}

/// For a name that is no setting of an agent: which agents have it, if there are any.
fn elsewhere(error: SettingsError) -> SettingsError {
    let SettingsError::Unknown { name, hint } = error else { return error };
    let default = |entry: &Entry| match &entry.kind {
        Kind::Ready(_) | Kind::OneRow(_) => None,
        Kind::Learning(presets) => Some(Settings::Learning(Box::new((presets[0].settings)()))),
        Kind::Searching(read) => read(Map::new()).ok(),
    };
    let has_it = |entry: &&Entry| default(entry).is_some_and(|other| record(&other).contains_key(&name));
    let owners: Vec<&str> = REGISTRY.iter().filter(has_it).map(|entry| entry.name).collect();
    match owners.is_empty() {
        true => SettingsError::Unknown { name, hint },
        false => SettingsError::Elsewhere { name, owners: listed(&owners) },
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
