//! Settings of any trainable agent, and the agents that are built from them.

use std::sync::Arc;

use serde::de::DeserializeOwned;

use crate::mdp::{ProcKind, RewardSettings};
use crate::syntax::yaml_mistake;

use super::hyperparameters::{Hyperparameters, RewardSource, SettingsError};
use super::learner::Learner;
use super::q_policy::Rows;
use super::registry::{Entry, Kind};
use super::search::{
    AvFuzzer, AvFuzzerSettings, Bandit, BanditSettings, Constant, ConstantSettings, MapElites,
    MapElitesSettings,
};
use super::trainable::Trainable;

/// All settings of one agent. In a file, the names of the settings tell which kind of agent it is.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Settings {
    Learning(Box<Hyperparameters>),
    AvFuzzer(AvFuzzerSettings),
    Constant(ConstantSettings),
    Bandit(BanditSettings),
    MapElites(MapElitesSettings),
}

impl Settings {
    /// The settings of an agent, as a YAML text changes them; `None` if it has nothing to learn.
    ///
    /// # Errors
    /// A preset of an agent that has none, and as [`Hyperparameters::from_yaml`].
    pub fn from_yaml(
        entry: &Entry,
        preset: Option<&str>,
        text: &str,
    ) -> Option<Result<Settings, SettingsError>> {
        let read = match entry.kind {
            Kind::Ready(_) => return None,
            Kind::Learning(presets) => {
                return Some(
                    Hyperparameters::from_yaml(presets, preset, text).map(Box::new).map(Settings::Learning),
                );
            }
            Kind::Searching(read) => read,
        };
        Some(match preset {
            Some(preset) => {
                Err(SettingsError::Text(format!("no preset `{preset}`: `{}` has none", entry.name)))
            }
            None => read(text),
        })
    }

    /// The settings of a search: its defaults with the changes of a YAML text, checked.
    pub(super) fn of_search<T: DeserializeOwned + Default>(
        text: &str,
        check: fn(&T) -> Result<(), SettingsError>,
        settings: fn(T) -> Settings,
    ) -> Result<Settings, SettingsError> {
        let read: Option<T> =
            serde_yaml::from_str(text).map_err(|error| SettingsError::Text(yaml_mistake(&error, text)))?;
        let read = read.unwrap_or_default();
        check(&read)?;
        Ok(settings(read))
    }

    /// An agent that knows nothing yet.
    pub fn build(&self, rows: Arc<Rows>, seed: u64) -> Box<dyn Trainable> {
        match self {
            Settings::Learning(settings) => {
                Box::new(Learner::new(Arc::new(Hyperparameters::clone(settings)), rows, seed))
            }
            Settings::AvFuzzer(settings) => Box::new(AvFuzzer::new(settings, rows.allowed.len())),
            Settings::Constant(settings) => Box::new(Constant::new(settings, rows.allowed.len())),
            Settings::Bandit(settings) => Box::new(Bandit::new(settings, rows.allowed.len())),
            Settings::MapElites(settings) => Box::new(MapElites::new(settings, rows.allowed.len())),
        }
    }

    /// The agent that was saved; `None` if the bytes are not those of an agent with such settings.
    pub fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Box<dyn Trainable>> {
        Some(match self {
            Settings::Learning(settings) => {
                Box::new(Learner::restore(Arc::new(Hyperparameters::clone(settings)), rows, bytes)?)
            }
            Settings::AvFuzzer(settings) => Box::new(AvFuzzer::restore(settings, rows.allowed.len(), bytes)?),
            Settings::Constant(settings) => Box::new(Constant::restore(settings, rows.allowed.len(), bytes)?),
            Settings::Bandit(settings) => Box::new(Bandit::restore(settings, rows.allowed.len(), bytes)?),
            Settings::MapElites(settings) => {
                Box::new(MapElites::restore(settings, rows.allowed.len(), bytes)?)
            }
        })
    }

    /// The settings, if they are those of a learner.
    pub fn hyperparameters(&self) -> Option<&Hyperparameters> {
        match self {
            Settings::Learning(settings) => Some(settings.as_ref()),
            Settings::AvFuzzer(_) | Settings::Constant(_) | Settings::Bandit(_) | Settings::MapElites(_) => {
                None
            }
        }
    }

    /// The preset that the settings began as; `search` for a search, which has none.
    pub fn preset(&self) -> &str {
        self.hyperparameters().map_or("search", |settings| &settings.preset)
    }

    /// Names of the actions and groups that the agent may choose from; empty: all.
    pub fn actions(&self) -> &[String] {
        self.hyperparameters().map_or(&[], |settings| &settings.actions)
    }

    /// Observation period in place of the space's own, s.
    pub fn observation_period_s(&self) -> Option<f64> {
        self.hyperparameters().and_then(|settings| settings.observation_period_s)
    }

    /// Formula of the collision probability.
    pub fn proc(&self) -> ProcKind {
        self.hyperparameters().map_or(ProcKind::Avastra, |settings| settings.proc)
    }

    /// Constants of the reward; `None`: the space's own reward. A search reports the reward, but does not
    /// use it.
    pub fn reward(&self) -> Option<RewardSettings> {
        match self.hyperparameters() {
            Some(settings) if settings.reward == RewardSource::Equation => Some(settings.reward_settings()),
            _ => None,
        }
    }
}
