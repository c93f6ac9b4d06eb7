//! The content of a study file, field by field. Unknown fields are refused.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::run::DEFAULT_ADS;
use avastra_lang::syntax::read_yaml;

/// A study file. Paths are relative to it.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// The question that it answers, in a sentence; printed above the result.
    pub question: Option<String>,
    /// The space (`.ava`).
    pub space: String,
    /// Roads of the space, each compared by itself; none named: all.
    #[serde(default)]
    pub roads: Vec<String>,
    /// Driving system under test.
    #[serde(default = "default_ads")]
    pub ads: String,
    /// Profile of the `modular` driving system; without one it has its default settings.
    pub ads_config: Option<String>,
    /// Vehicles of ambient traffic around the ego vehicle.
    #[serde(default)]
    pub ambient: u32,
    /// How other vehicles drive: the name of a traffic profile, or a file; without it as they usually do.
    pub traffic: Option<String>,
    /// All seeds of trainings and evaluations are derived from this one, each kind by a separate stream.
    #[serde(default = "default_seed")]
    pub first_seed: u64,
    #[serde(default)]
    pub evaluation: EvaluationPlan,
    /// Whether the cause of each counted collision is looked for; takes some twenty replays for each.
    #[serde(default)]
    pub causes: bool,
    /// The agents to compare. Their labels must differ.
    pub agents: Vec<AgentFile>,
    /// Labels of the agents that each other agent is compared with.
    #[serde(default)]
    pub baselines: Vec<String>,
    /// Published figures that the result is held against by `avastra study results`.
    #[serde(default)]
    pub published: Vec<PublishedTable>,
    /// The meaning of the result, and why it differs from published figures; printed by `avastra study results`.
    pub remarks: Option<String>,
}

/// Figures that others published.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedTable {
    /// Where they stand.
    pub source: String,
    /// The measure of ours that they are compared with, by its name in `results.json`.
    pub measure: String,
    /// By agent and road.
    pub figures: BTreeMap<String, BTreeMap<String, f64>>,
}

/// How an agent is judged once it is ready.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EvaluationPlan {
    /// Episodes of one seed: what a number of collisions refers to. Paper: 15.
    pub episodes: u32,
    /// Seeds over which a number is averaged, for each training or repetition. Paper: 5.
    pub seeds: u32,
    /// The restricted mean of the time to the first counted collision is taken up to here, s. Ours: most episodes
    /// have ended by then.
    pub horizon_s: f64,
}

impl Default for EvaluationPlan {
    fn default() -> EvaluationPlan {
        EvaluationPlan { episodes: 15, seeds: 5, horizon_s: 60.0 }
    }
}

/// One agent of a study.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgentFile {
    /// The agent, as in `avastra run --agent` and `avastra train --agent`.
    pub name: String,
    /// Its name in the result; by default `name`.
    pub label: Option<String>,
    /// The preset of a learning agent; by default its own.
    pub preset: Option<String>,
    /// Settings that differ from the preset: the name of a file, or the settings themselves.
    pub config: Option<Value>,
    /// Independent trainings of a learning agent; without a number 10.
    pub trainings: Option<u32>,
    /// Episodes of a training, on all its roads together; without a number 750. Of an agent that does not learn, episodes
    /// that it searches on each road before it is judged; without a number none.
    pub episodes: Option<u32>,
    /// Roads that one training goes round, to be evaluated on each road of the study; none named: a training
    /// for each road of the study, on that road alone.
    #[serde(default)]
    pub train_roads: Vec<String>,
    /// Whether the trained network is shown states of other episodes when it is judged: what it loses by it, it owed
    /// to knowing when. Trainings are as without it.
    #[serde(default)]
    pub shuffled_states: bool,
    /// Independent repetitions of the evaluation, of an agent that has nothing to learn; without a number 10.
    pub repeats: Option<u32>,
    /// Profile of the driving system for this agent, in place of the study's: the name of a file, or the settings
    /// that differ from the default.
    pub ads_config: Option<Value>,
    /// Rules switched off for this agent.
    #[serde(default)]
    pub without: Vec<String>,
    /// Optional rules switched on for this agent.
    #[serde(default)]
    pub with: Vec<String>,
}

fn default_ads() -> String {
    DEFAULT_ADS.to_owned()
}

fn default_seed() -> u64 {
    1
}

impl StudyFile {
    /// Reads the text of a study file.
    ///
    /// # Errors
    /// If the text has another form: the reason, with its place.
    pub fn from_yaml(text: &str) -> Result<StudyFile, String> {
        read_yaml(text)
    }
}
