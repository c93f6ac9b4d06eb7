//! The training loop, one episode at a time, and what an episode teaches.
//!
//! Single-threaded: every episode depends on all before it. Whoever calls it keeps the records.

use std::sync::Arc;

use ndarray::Array1;

use crate::action::ActionTable;
use crate::agent;
use crate::agent::Agent;
use crate::agent::Experience;
use crate::agent::Hyperparameters;
use crate::agent::Kind;
use crate::agent::Learner;
use crate::agent::Lesson;
use crate::agent::QPolicy;
use crate::agent::RewardSource;
use crate::agent::Rows;
use crate::agent::Trajectory;
use crate::episode;
use crate::episode::Choice;
use crate::episode::End;
use crate::episode::EpisodeLog;
use crate::episode::Outcome;
use crate::mdp;
use crate::mdp::Observation;
use crate::mdp::StepOutcome;
use crate::model::Space;
use crate::oracle::AvoidabilitySettings;
use crate::rng;
use crate::rng::Stream;
use crate::study::arena::Arena;
use crate::study::arena::carry_out;
use crate::study::arena::legal;
use crate::study::profile::Profile;
use crate::study::run::RunError;
use crate::study::run::check_episodes;
use crate::study::summary::EpisodeSummary;
use crate::syntax::listed;

/// Everything that is needed to repeat a training; written to `run.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainSettings {
    /// Version of avastra that wrote it.
    pub avastra: String,
    /// Version of the simulated world.
    pub engine: String,
    /// Path of the space, from the run directory.
    pub space: String,
    /// Digest of the space with all that it uses.
    pub space_digest: String,
    /// Episodes go round them, one each.
    pub roads: Vec<String>,
    pub ads: String,
    /// Settings of the driving system, if it was given any; without them it is as it comes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    pub agent: String,
    /// Episodes on all roads together.
    pub episodes: u32,
    pub seed: u64,
    /// Vehicles of ambient traffic.
    #[serde(default)]
    pub ambient: u32,
    /// Rules switched off.
    pub without: Vec<String>,
    /// Optional rules switched on.
    pub with: Vec<String>,
    pub hyperparameters: Hyperparameters,
}

/// A training that is ready to go on.
pub struct Training {
    arena: Arena,
    settings: TrainSettings,
    learner: Learner,
    /// Number of the next episode.
    next: usize,
}

/// An episode, and what it taught.
pub struct TrainedEpisode {
    pub log: EpisodeLog,
    pub summary: EpisodeSummary,
    /// Sum of its rewards.
    pub sum: f64,
    /// The exploration rate at its beginning.
    pub exploration_epsilon: f64,
    pub lesson: Lesson,
    /// Choices made in the training up to its end.
    pub steps: u64,
}

impl Training {
    /// A training from the beginning.
    ///
    /// # Errors
    /// If the settings name something that does not exist, name it twice, or name an agent that has
    /// nothing to learn.
    pub fn new(table: ActionTable, settings: TrainSettings) -> Result<Training, RunError> {
        let (arena, rows) = prepared(table, &settings)?;
        let hyperparameters = Arc::new(settings.hyperparameters.clone());
        let learner = Learner::new(hyperparameters, rows, settings.seed);
        Ok(Training { arena, settings, learner, next: 0 })
    }

    /// A training as a checkpoint left it after so many episodes.
    ///
    /// # Errors
    /// As [`Training::new`], and if the checkpoint is not of such a training.
    pub fn resumed(
        table: ActionTable,
        settings: TrainSettings,
        episodes: usize,
        checkpoint: &[u8],
    ) -> Result<Training, RunError> {
        let (arena, rows) = prepared(table, &settings)?;
        let hyperparameters = Arc::new(settings.hyperparameters.clone());
        let learner = Learner::restore(hyperparameters, rows, checkpoint).ok_or(RunError::Checkpoint)?;
        Ok(Training { arena, settings, learner, next: episodes })
    }

    pub fn settings(&self) -> &TrainSettings {
        &self.settings
    }

    pub fn arena(&self) -> &Arena {
        &self.arena
    }

    pub fn table(&self) -> &ActionTable {
        self.arena.table()
    }

    /// The policy as learned so far.
    pub fn policy(&self) -> &QPolicy {
        self.learner.policy()
    }

    /// Episodes done.
    pub fn episodes(&self) -> usize {
        self.next
    }

    pub fn is_done(&self) -> bool {
        self.next >= self.settings.episodes as usize
    }

    /// The learner as bytes, for [`Training::resumed`].
    pub fn checkpoint(&self) -> Vec<u8> {
        self.learner.save()
    }

    /// Plays the next episode and learns from it.
    pub fn episode(&mut self) -> TrainedEpisode {
        let Training { arena, settings, learner, next } = self;
        let number = *next;
        let seed = rng::child_seed(settings.seed, Stream::Episode, number as u64);
        let mut setup = arena.setup(number % arena.roads(), seed);
        setup.start.ambient = settings.ambient;
        let exploration_epsilon = learner.exploration_epsilon();
        let mut choices = Vec::new();
        let mut last = None;
        learner.begin();
        let log = episode::run_to_last(
            &setup,
            &mut |moment| {
                let offers = arena.table().offers(moment.situation);
                let legal = legal(&offers);
                let choice = carry_out(offers, legal.view(), learner, moment);
                let row = match &choice {
                    Choice::Act(draw) => Some(draw.row),
                    Choice::Refused { row, .. } => Some(*row),
                    Choice::Pass | Choice::Stop => None,
                };
                let observation = moment.observation.clone();
                choices.extend(row.map(|row| Chosen { step: moment.step, observation, legal, row }));
                choice
            },
            &mut |_, _, _| {},
            &mut |moment| {
                let legal = legal(&arena.table().offers(moment.situation));
                last = Some((moment.observation.clone(), legal));
            },
        );
        let summary = EpisodeSummary::judged(&setup, number, &log, &AvoidabilitySettings::default());
        let (last, last_legal) = last.expect("every episode has a last moment");
        let trajectory = Trajectory {
            steps: experiences(&settings.hyperparameters, choices, &log, &summary),
            last,
            last_legal,
            terminal: log.end == End::Arrived,
        };
        let mut rng = rng::stream(settings.seed, Stream::Replay, number as u64);
        let lesson = learner.learn(&trajectory, &mut rng);
        *next += 1;
        let (sum, steps) = (trajectory.sum(), learner.steps());
        TrainedEpisode { log, summary, sum, exploration_epsilon, lesson, steps }
    }
}

/// A choice of the agent and what it was made on.
struct Chosen {
    step: usize,
    observation: Observation,
    legal: Array1<bool>,
    row: usize,
}

/// What each choice was worth. Steps in which nothing could be chosen teach nothing.
fn experiences(
    settings: &Hyperparameters,
    choices: Vec<Chosen>,
    log: &EpisodeLog,
    summary: &EpisodeSummary,
) -> Vec<Experience> {
    let steps: Vec<usize> = choices.iter().map(|choice| choice.step).collect();
    let made_by = |obstacle: u32| {
        let made = |outcome: &Outcome| matches!(outcome, Outcome::Done { spawned, .. } if spawned.contains(&obstacle));
        steps.iter().position(|&step| made(&log.steps[step].outcome))
    };
    let experience = |choice: Chosen| {
        let step = &log.steps[choice.step];
        let findings = || summary.collisions.iter().filter(|one| one.collision.step == choice.step);
        let outcome = StepOutcome {
            proc: step.proc,
            collided: findings().next().is_some(),
            counted: findings().any(|finding| finding.counted),
        };
        let reward = match settings.reward {
            RewardSource::Equation => mdp::reward(&settings.reward_settings(), outcome),
            RewardSource::Space => step.reward,
        };
        let hits = findings().filter_map(|one| made_by(one.collision.contact.obstacle)).collect();
        let Chosen { observation, legal, row, .. } = choice;
        Experience { observation, legal, row, reward, hits }
    };
    choices.into_iter().map(experience).collect()
}

/// Looks everything up that the settings name.
fn prepared(table: ActionTable, settings: &TrainSettings) -> Result<(Arena, Arc<Rows>), RunError> {
    check_episodes(settings.episodes)?;
    let agent = agent::by_name(&settings.agent).ok_or_else(|| {
        let known = listed(&agent::REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>());
        RunError::Agent { name: settings.agent.clone(), known }
    })?;
    if !matches!(agent.kind, Kind::Learning(_)) {
        return Err(RunError::Unteachable { name: settings.agent.clone() });
    }
    let table = with_period(table, settings.hyperparameters.observation_period_s);
    let rows = Arc::new(Rows::new(&table, &settings.hyperparameters.actions)?);
    let rules = (settings.with.as_slice(), settings.without.as_slice());
    let mut arena = Arena::new(table, &settings.roads, &settings.ads, rules)?;
    if let Some(profile) = &settings.profile {
        arena.set_profile(profile)?;
    }
    Ok((arena, rows))
}

/// The table with another observation period.
pub(in crate::study) fn with_period(table: ActionTable, period_s: Option<f64>) -> ActionTable {
    let Some(step_s) = period_s else { return table };
    let mut space = Space::clone(table.space());
    space.episode.step_s = step_s;
    ActionTable::new(Arc::new(space))
}
