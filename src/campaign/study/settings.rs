//! The settings of a study in full, as `study.yaml` keeps them, and how they follow from a study file.

use std::collections::BTreeSet;
use std::path::Path;

use crate::oracle::AvoidabilitySettings;
use crate::run::{Conditions, EPISODES_MAX, Profile, RunError, TrafficRecord, agent_named};
use avastra_drivers::external::{Attached, ExternalSettings};
use avastra_drivers::{EXTERNAL, ModularConfig};
use avastra_lang::syntax::listed;
use avastra_search::agent::{Kind, Settings};
use avastra_world::action::ActionTable;

use crate::study::file::{AgentFile, EvaluationPlan, PublishedTable, StudyFile};
use crate::study::job::Job;
use crate::study::measures::MEASURES;

/// Everything that is needed to repeat a study; written to `study.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudySettings {
    /// Rules are switched for each agent.
    pub conditions: Conditions,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub question: Option<String>,
    pub first_seed: u64,
    pub evaluation: EvaluationPlan,
    pub causes: bool,
    /// Whether it was cut down only to see that it works.
    pub quick: bool,
    pub agents: Vec<AgentSettings>,
    pub baselines: Vec<String>,
    pub avoidability: AvoidabilitySettings,
}

/// One agent of a study.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgentSettings {
    pub label: String,
    pub name: String,
    /// Independent trainings, or repetitions where nothing is learned.
    pub repeats: u32,
    /// Episodes that it searches before it is judged, if it does not learn.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub searched: u32,
    /// How it is trained, if it learns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub training: Option<TrainingPlan>,
    /// The profile of the driving system that this agent meets, in place of the study's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    pub without: Vec<String>,
    pub with: Vec<String>,
}

/// How an agent of a study is trained.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingPlan {
    /// Episodes on all roads together.
    pub episodes: u32,
    /// Roads that a training goes round; empty: the one on which it is evaluated.
    pub roads: Vec<String>,
    pub hyperparameters: Settings,
    /// Whether it is judged on states of other episodes.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub shuffled_states: bool,
}

/// Why a study cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error("no agent is named: list at least one under `agents`")]
    NoAgent,
    #[error("two agents are called `{label}`: give one of them another `label`")]
    LabelTwice { label: String },
    #[error("no agent is called `{label}`, which `baselines` names: there are {known}")]
    Baseline { label: String, known: String },
    #[error("`baselines` names `{label}` twice")]
    BaselineTwice { label: String },
    #[error("`published` names the {what} `{name}`, which the study does not have: there are {known}")]
    Published { what: &'static str, name: String, known: String },
    #[error("agent `{label}`: `{field}` is for agents that learn, `{name}` does not")]
    NotLearning { label: String, name: String, field: &'static str },
    #[error("agent `{label}`: `repeats` is for agents that do not learn, `{name}` does; say `trainings`")]
    Learning { label: String, name: String },
    #[error(
        "agent `{label}`: its `ads_config` names a driving system of its own (`ads`), but agents are compared against one: \
         write it as the `ads_config` of the study, or make a study for each"
    )]
    AgentsOwnAds { label: String },
    #[error("agent `{label}`: {error}")]
    Agent { label: String, error: RunError },
    #[error("agent `{label}`: {reason}")]
    Settings { label: String, reason: String },
    #[error("`{field}` is {found}: {wanted} is possible")]
    Range { field: &'static str, found: String, wanted: &'static str },
}

/// Largest number of trainings or repetitions of one agent. Ours.
const REPEATS_MAX: u32 = 10_000;
/// Number of trainings or repetitions if the file gives none. Ours.
const REPEATS: u32 = 10;
/// Episodes of a training if the file gives no number: the default of `avastra train`.
const TRAINING_EPISODES: u32 = 750;
/// With `--quick`, at most this many trainings or repetitions of an agent, and episodes of a training, are left. Ours.
pub const QUICK_REPEATS: u32 = 2;
pub const QUICK_EPISODES: u32 = 12;

impl StudySettings {
    /// The settings that a file asks for, in full. `read` gives the text of a file that it names.
    ///
    /// # Errors
    /// If the file asks for something that does not exist or is not possible.
    pub fn new(
        file: StudyFile,
        table: &ActionTable,
        (profile, external): (Option<Profile>, Option<Attached>),
        traffic: Option<TrafficRecord>,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<StudySettings, StudyError> {
        let space = table.space();
        let roads = match file.roads.as_slice() {
            [] => space.roads.iter().map(|road| road.name.clone()).collect(),
            _ => file.roads,
        };
        let published = file.published;
        let agents = file.agents.into_iter().map(|agent| agent_settings(agent, read));
        let settings = StudySettings {
            conditions: Conditions {
                roads,
                ads: if external.is_some() { EXTERNAL.to_owned() } else { file.ads },
                profile,
                external,
                ambient: file.ambient,
                traffic,
                ..Conditions::of(space)
            },
            question: file.question,
            first_seed: file.first_seed,
            evaluation: file.evaluation,
            causes: file.causes,
            quick: false,
            agents: agents.collect::<Result<_, _>>()?,
            baselines: file.baselines,
            avoidability: AvoidabilitySettings::default(),
        };
        published.iter().try_for_each(|table| settings.has_what_is_published(table))?;
        Ok(settings)
    }

    /// Whether a table of published figures speaks of this study.
    fn has_what_is_published(&self, table: &PublishedTable) -> Result<(), StudyError> {
        let among = |what, name: &str, known: &[&str]| match known.contains(&name) {
            true => Ok(()),
            false => Err(StudyError::Published { what, name: name.to_owned(), known: listed(known) }),
        };
        let measures: Vec<&str> = MEASURES.iter().map(|measure| measure.name).collect();
        let labels: Vec<&str> = self.agents.iter().map(|agent| agent.label.as_str()).collect();
        let roads: Vec<&str> = self.conditions.roads.iter().map(String::as_str).collect();
        among("measure", &table.measure, &measures)?;
        for (label, figures) in &table.figures {
            among("agent", label, &labels)?;
            figures.keys().try_for_each(|road| among("road", road, &roads))?;
        }
        Ok(())
    }

    /// All jobs. The first training or repetition of every agent comes before the second of any, so that an
    /// unfinished study says something about all of them.
    pub fn jobs(&self) -> Vec<Job> {
        let most = self.agents.iter().map(|agent| agent.repeats).max().unwrap_or(0);
        let mut jobs = Vec::new();
        for number in 0..most {
            let repeated = self.agents.iter().enumerate().filter(|(_, agent)| number < agent.repeats);
            for (agent, settings) in repeated {
                let all = (0..self.conditions.roads.len()).collect::<Vec<_>>();
                match &settings.training {
                    Some(training) if !training.roads.is_empty() => {
                        jobs.push(Job { agent, roads: all, number })
                    }
                    _ => jobs.extend(all.into_iter().map(|road| Job { agent, roads: vec![road], number })),
                }
            }
        }
        jobs
    }

    /// Episodes of a job, trainings and evaluations together.
    pub fn episodes(&self, job: &Job) -> u64 {
        let EvaluationPlan { episodes, seeds, .. } = self.evaluation;
        let training = self.agents[job.agent].training.as_ref();
        let training = training.map_or(0, |training| u64::from(training.episodes));
        let searched = u64::from(self.agents[job.agent].searched);
        training + (searched + u64::from(episodes) * u64::from(seeds)) * job.roads.len() as u64
    }

    /// All cells in the order of the jobs: agent, road, and number of the training or repetition.
    pub fn cells(&self) -> impl Iterator<Item = (&str, &str, u32)> {
        self.jobs().into_iter().flat_map(move |job| {
            let agent = self.agents[job.agent].label.as_str();
            job.roads.into_iter().map(move |road| (agent, self.conditions.roads[road].as_str(), job.number))
        })
    }

    /// Cuts the study down to a minute or two: enough to see that it works, not enough to learn anything from.
    pub fn quick(mut self) -> StudySettings {
        self.quick = true;
        self.evaluation.episodes = self.evaluation.episodes.min(3);
        self.evaluation.seeds = self.evaluation.seeds.min(1);
        for agent in &mut self.agents {
            agent.repeats = agent.repeats.min(QUICK_REPEATS);
            agent.searched = agent.searched.min(QUICK_EPISODES);
            if let Some(training) = &mut agent.training {
                training.episodes = training.episodes.min(QUICK_EPISODES);
            }
        }
        self
    }
}

/// Whether nothing is searched: then the settings do not say so.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// One agent's settings in full.
fn agent_settings(
    file: AgentFile,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<AgentSettings, StudyError> {
    let label = file.label.unwrap_or_else(|| file.name.clone());
    let entry = agent_named(&file.name).map_err(|error| StudyError::Agent { label: label.clone(), error })?;
    let mut searched = 0;
    let (repeats, training) = match entry.kind {
        Kind::Ready(_) => {
            let learning = [
                ("trainings", file.trainings.is_some()),
                ("preset", file.preset.is_some()),
                ("config", file.config.is_some()),
                ("train_roads", !file.train_roads.is_empty()),
                ("shuffled_states", file.shuffled_states),
            ];
            if let Some((field, _)) = learning.into_iter().find(|(_, is_there)| *is_there) {
                return Err(StudyError::NotLearning { label, name: file.name, field });
            }
            searched = file.episodes.unwrap_or(0);
            (file.repeats, None)
        }
        Kind::OneRow(_) => {
            return Err(StudyError::Agent { label, error: RunError::OneRow { name: file.name } });
        }
        Kind::Learning(_) | Kind::Searching(_) => {
            if file.repeats.is_some() {
                return Err(StudyError::Learning { label, name: file.name });
            }
            let refuse = |reason: String| StudyError::Settings { label: label.clone(), reason };
            let text = settings_text(file.config.as_ref(), read).map_err(refuse)?;
            let hyperparameters = Settings::from_yaml(entry, file.preset.as_deref(), &text)
                .expect("an agent that is trained has settings")
                .map_err(|error| refuse(error.to_string()))?;
            let shuffled_states = file.shuffled_states;
            if shuffled_states && hyperparameters.learner().is_none() {
                return Err(refuse(format!(
                    "`shuffled_states` is for networks, and `{}` has none",
                    file.name
                )));
            }
            let (episodes, roads) = (file.episodes.unwrap_or(TRAINING_EPISODES), file.train_roads);
            (file.trainings, Some(TrainingPlan { episodes, roads, hyperparameters, shuffled_states }))
        }
    };
    let refuse = |reason| StudyError::Settings { label: label.clone(), reason };
    let profile = match &file.ads_config {
        None => None,
        given => {
            let text = settings_text(given.as_ref(), read).map_err(refuse)?;
            if ExternalSettings::from_yaml(&text, Path::new("")).is_some_and(|block| block.is_ok()) {
                return Err(StudyError::AgentsOwnAds { label });
            }
            let settings = ModularConfig::from_yaml(&text).map_err(|error| refuse(error.to_string()))?;
            Some(Profile::new(&settings))
        }
    };
    Ok(AgentSettings {
        label,
        name: file.name,
        repeats: repeats.unwrap_or(REPEATS),
        searched,
        training,
        profile,
        without: file.without,
        with: file.with,
    })
}

/// Settings as text: the text of the named file, or the settings that are given in place.
fn settings_text(
    given: Option<&serde_json::Value>,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<String, String> {
    match given {
        None => Ok(String::new()),
        Some(serde_json::Value::String(path)) => {
            read(path).map_err(|reason| format!("cannot read `{path}`: {reason}"))
        }
        // JSON is YAML.
        Some(settings @ serde_json::Value::Object(_)) => Ok(settings.to_string()),
        Some(_) => Err("settings are the name of a file, or `{ name: value, … }`".to_owned()),
    }
}

/// Checks what can be checked without the space.
///
/// # Errors
/// If there is no agent, two have one label, a baseline is no label, or a number is out of range.
pub(super) fn check(settings: &StudySettings) -> Result<(), StudyError> {
    let range = |field, found: String, wanted| Err(StudyError::Range { field, found, wanted });
    let EvaluationPlan { episodes, seeds, horizon_s } = settings.evaluation;
    if !(1..=EPISODES_MAX).contains(&episodes) {
        return range("evaluation.episodes", episodes.to_string(), "from 1 to 1000000");
    }
    if !(1..=1000).contains(&seeds) {
        return range("evaluation.seeds", seeds.to_string(), "from 1 to 1000");
    }
    if !(1.0..=1e6).contains(&horizon_s) {
        return range("evaluation.horizon_s", horizon_s.to_string(), "from 1 to 1e6");
    }
    if settings.conditions.ambient > avastra_lang::model::AMBIENT_MAX {
        return range(
            "ambient",
            settings.conditions.ambient.to_string(),
            "what `avastra run --ambient` takes",
        );
    }
    if settings.agents.is_empty() {
        return Err(StudyError::NoAgent);
    }
    let mut labels = BTreeSet::new();
    for agent in &settings.agents {
        if !labels.insert(agent.label.as_str()) {
            return Err(StudyError::LabelTwice { label: agent.label.clone() });
        }
        if !(1..=REPEATS_MAX).contains(&agent.repeats) {
            let field = if agent.training.is_some() { "trainings" } else { "repeats" };
            return range(field, agent.repeats.to_string(), "from 1 to 10000");
        }
    }
    for (index, baseline) in settings.baselines.iter().enumerate() {
        if settings.baselines[..index].contains(baseline) {
            return Err(StudyError::BaselineTwice { label: baseline.clone() });
        }
        if !labels.contains(baseline.as_str()) {
            let known = listed(&settings.agents.iter().map(|agent| agent.label.as_str()).collect::<Vec<_>>());
            return Err(StudyError::Baseline { label: baseline.clone(), known });
        }
    }
    Ok(())
}
