//! A study that is ready to play: its jobs, their seeds, and the training and evaluations of each.

use crate::run::{Conditions, Run, RunError, RunSettings};
use crate::train::{TrainSettings, Training, with_period};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_drivers::external::Attached;
use avastra_world::action::ActionTable;

use crate::study::job::Job;
use crate::study::settings::{AgentSettings, StudyError, StudySettings, check};

/// A study that is ready to play.
pub struct Study {
    table: ActionTable,
    settings: StudySettings,
}

impl Study {
    /// Looks up everything that the settings name, so that nothing turns out to be missing hours later.
    ///
    /// # Errors
    /// If something does not exist, is named twice, or is out of range.
    pub fn new(table: ActionTable, settings: StudySettings) -> Result<Study, StudyError> {
        check(&settings)?;
        let mut study = Study { table, settings };
        let mut attached = None;
        for job in study.settings.jobs().iter().filter(|job| job.number == 0) {
            let agent = study.agent(job);
            let refuse = |error| StudyError::Agent { label: agent.label.clone(), error };
            if agent.training.is_some() {
                study.training(job).map_err(refuse)?;
            }
            for &road in &job.roads {
                study.search(job, &study.settings.conditions.roads[road]).map_err(refuse)?;
                let run = study.evaluation(job, 0, &study.settings.conditions.roads[road]).map_err(refuse)?;
                attached = run.arena().attached();
            }
        }
        // The jobs, and a later `--resume`, must meet the same driving system. One that was not started has no identity to add.
        if study.settings.conditions.external.as_ref().is_none_or(|external| !external.is_recorded) {
            study.settings.conditions.external = attached;
        }
        Ok(study)
    }

    pub fn table(&self) -> &ActionTable {
        &self.table
    }

    pub fn settings(&self) -> &StudySettings {
        &self.settings
    }

    /// The driving system under test: its name here, or what an external one calls itself.
    pub fn ads_name(&self) -> String {
        let Conditions { ads, external, .. } = &self.settings.conditions;
        external.as_ref().map_or_else(|| ads.clone(), Attached::name)
    }

    pub(super) fn agent(&self, job: &Job) -> &AgentSettings {
        &self.settings.agents[job.agent]
    }

    /// Seed of the nth training. It depends neither on agent nor on road, so all agents meet identical episodes.
    pub fn training_seed(&self, number: u32) -> u64 {
        rng::child_seed(self.settings.first_seed, Stream::StudyTraining, u64::from(number))
    }

    /// Seed of an evaluation after the nth training. It depends on the training's number, not on agent or road:
    /// agents meet identical episodes, and trainings stay independent.
    pub fn evaluation_seed(&self, number: u32, seed: u32) -> u64 {
        let index = u64::from(number) * u64::from(self.settings.evaluation.seeds) + u64::from(seed);
        rng::child_seed(self.settings.first_seed, Stream::StudyEvaluation, index)
    }

    /// The training of a job, from its beginning.
    pub(super) fn training(&self, job: &Job) -> Result<Training, RunError> {
        let agent = self.agent(job);
        let plan = agent.training.as_ref().expect("only agents that learn are trained");
        let roads = match plan.roads.as_slice() {
            [] => job.roads.iter().map(|&road| self.settings.conditions.roads[road].clone()).collect(),
            named => named.to_vec(),
        };
        let settings = TrainSettings {
            conditions: self.conditions(agent, roads),
            agent: agent.name.clone(),
            episodes: plan.episodes,
            hours: None,
            evaluation: 0,
            seed: self.training_seed(job.number),
            hyperparameters: plan.hyperparameters.clone(),
        };
        Training::new(self.table.clone(), settings)
    }

    /// What an agent that does not learn searches before it is judged, on one road: with the seed of the trainings, so that
    /// it meets their episodes. `None` if it searches nothing.
    pub(super) fn search(&self, job: &Job, road: &str) -> Result<Option<Run>, RunError> {
        let agent = self.agent(job);
        if agent.searched == 0 {
            return Ok(None);
        }
        let conditions = self.conditions(agent, vec![road.to_owned()]);
        let settings = RunSettings {
            avoidability: self.settings.avoidability.clone(),
            ..RunSettings::new(conditions, &agent.name, agent.searched, self.training_seed(job.number))
        };
        Run::new(self.table.clone(), settings).map(Some)
    }

    /// The evaluation under one seed on one road. For a trained agent it is a run of `none`, with which the caller
    /// plays the trained agent (see [`Run::judged_by`]).
    pub(super) fn evaluation(&self, job: &Job, seed: u32, road: &str) -> Result<Run, RunError> {
        let agent = self.agent(job);
        let conditions = self.conditions(agent, vec![road.to_owned()]);
        let (episodes, seed) = (self.settings.evaluation.episodes, self.evaluation_seed(job.number, seed));
        let settings = RunSettings {
            causes: self.settings.causes,
            avoidability: self.settings.avoidability.clone(),
            ..RunSettings::new(conditions, &agent.name, episodes, seed)
        };
        let Some(plan) = &agent.training else { return Run::new(self.table.clone(), settings) };
        let table = with_period(self.table.clone(), plan.hyperparameters.observation_period_s());
        Run::new(table, RunSettings { agent: "none".to_owned(), ..settings })
    }

    /// The conditions under which an agent trains or is judged on some roads.
    fn conditions(&self, agent: &AgentSettings, roads: Vec<String>) -> Conditions {
        let study = &self.settings.conditions;
        Conditions {
            roads,
            profile: agent.profile.as_ref().or(study.profile.as_ref()).cloned(),
            without: agent.without.clone(),
            with: agent.with.clone(),
            ..study.clone()
        }
    }
}
