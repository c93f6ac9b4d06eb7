//! The training loop, one episode at a time, and what an episode teaches.
//!
//! Single-threaded: every episode depends on all before it. The caller keeps the records.

use std::sync::Arc;

use ndarray::Array1;

use crate::episode;
use crate::episode::{Choice, End, EpisodeLog, Moment, Play, Script, Setup};
use crate::run::{
    Arena, Budget, Conditions, EpisodeSummary, Finding, Offers, RunError, agent_named, check_episodes, legal,
};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_lang::model::Space;
use avastra_search::agent::{
    Diverged, Experience, Kind, Lesson, Mask, Rows, Settings, Trainable, Trajectory,
};
use avastra_search::mdp;
use avastra_search::mdp::{Observation, ProcKind, StepOutcome};
use avastra_world::action::ActionTable;

/// Everything that is needed to repeat a training; written to `run.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainSettings {
    /// Episodes go round its roads, one each.
    pub conditions: Conditions,
    pub agent: String,
    /// Episodes on all roads together. With `hours`, the most that there can be.
    pub episodes: u32,
    /// Ends it by simulated time in place of a number of episodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hours: Option<f64>,
    /// Episodes on each road that judge what was learned; 0 for none.
    pub evaluation: u32,
    pub seed: u64,
    /// The agent's hyperparameters.
    pub hyperparameters: Settings,
}

impl TrainSettings {
    /// Episodes on all roads together that judge what was learned.
    pub fn judging(&self) -> usize {
        self.evaluation as usize * self.conditions.roads.len()
    }
}

/// A training that is ready to go on.
pub struct Training {
    arena: Arena,
    settings: TrainSettings,
    agent: Box<dyn Trainable>,
    /// Number of the next episode.
    next: usize,
    /// Simulated time so far, s.
    simulated_s: f64,
}

/// An episode, and what it taught.
pub struct TrainedEpisode {
    pub log: EpisodeLog,
    pub summary: EpisodeSummary,
    /// Sum of its rewards, not discounted.
    pub sum: f64,
    /// The exploration rate at its beginning.
    pub exploration_epsilon: f64,
    pub lesson: Lesson,
    /// Choices made in the training up to its end.
    pub steps: u64,
    /// Time simulated for it, s.
    pub simulated_s: f64,
}

impl Training {
    /// A training from the beginning.
    ///
    /// # Errors
    /// If the settings name something that does not exist, name it twice, or name an agent that has
    /// nothing to learn.
    pub fn new(table: ActionTable, settings: TrainSettings) -> Result<Training, RunError> {
        let (arena, rows) = prepared(table, &settings)?;
        let agent = settings.hyperparameters.build(rows, settings.seed);
        Ok(Training { arena, settings, agent, next: 0, simulated_s: 0.0 })
    }

    /// A training as a checkpoint left it after so many episodes, and so much simulated time, s.
    ///
    /// # Errors
    /// As [`Training::new`], and if the checkpoint is not of such a training.
    pub fn resumed(
        table: ActionTable,
        settings: TrainSettings,
        (episodes, simulated_s): (usize, f64),
        checkpoint: &[u8],
    ) -> Result<Training, RunError> {
        let (arena, rows) = prepared(table, &settings)?;
        let agent = settings.hyperparameters.restore(rows, checkpoint).ok_or(RunError::Checkpoint)?;
        Ok(Training { arena, settings, agent, next: episodes, simulated_s })
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

    /// The agent, as trained so far. [`Training::resumed`] takes what it saves.
    pub fn agent(&self) -> &dyn Trainable {
        self.agent.as_ref()
    }

    /// Episodes done.
    pub fn episodes(&self) -> usize {
        self.next
    }

    pub fn is_done(&self) -> bool {
        self.over() >= 1.0
    }

    /// How much of it is over; 1 at its end.
    fn over(&self) -> f64 {
        let of_episodes = self.next as f64 / f64::from(self.settings.episodes);
        let of_time = self.settings.hours.map(|hours| self.simulated_s / (3600.0 * hours));
        of_time.map_or(of_episodes, |of_time| of_time.max(of_episodes))
    }

    /// Simulated time so far, s.
    pub fn simulated_s(&self) -> f64 {
        self.simulated_s
    }

    /// Plays the next episode and learns from it.
    ///
    /// # Errors
    /// If nothing can be learned any more.
    pub fn episode(&mut self) -> Result<TrainedEpisode, Diverged> {
        let number = self.next;
        self.agent.progress(self.over());
        let exploration_epsilon = self.agent.exploration_epsilon();
        let setup = self.setup(number);
        self.agent.begin(setup.seed);
        let played = play(&setup, self.agent.as_mut());

        let log = played.log;
        let summary = EpisodeSummary::judged(&setup, number, &log);
        let (last, last_legal) = played.last.expect("every episode has a last moment");
        let trajectory = Trajectory {
            steps: experiences(&self.settings.hyperparameters, played.choices, &log, &summary),
            last,
            last_legal,
            terminal: log.end == End::Arrived,
        };
        let mut rng = rng::stream(self.settings.seed, Stream::Replay, number as u64);
        let lesson = self.agent.learn(&trajectory, &mut rng)?;
        self.next += 1;
        self.simulated_s += log.duration_s;
        Ok(TrainedEpisode {
            sum: trajectory.sum(),
            exploration_epsilon,
            lesson,
            steps: self.agent.steps(),
            simulated_s: log.duration_s,
            log,
            summary,
        })
    }

    /// Everything that the nth episode is made of but the choices.
    pub fn setup(&self, number: usize) -> Setup {
        let seed = rng::child_seed(self.settings.seed, Stream::Episode, number as u64);
        let mut setup = self.arena.setup(number % self.arena.roads(), seed);
        setup.start.ambient = self.settings.conditions.ambient;
        setup.proc = self.settings.hyperparameters.proc();
        setup
    }

    /// The log of an episode with the collision probabilities that the space defines, where the agent learns with
    /// others.
    pub fn log_of_space(&self, log: &EpisodeLog) -> EpisodeLog {
        if self.settings.hyperparameters.proc() == ProcKind::default() {
            return log.clone();
        }
        let road = (0..self.arena.roads()).find(|&road| self.arena.road(road).name == log.road);
        let mut setup = self.arena.setup(road.expect("it was played here"), log.seed);
        setup.start = log.start;
        let script = Script::of_log(log);
        let again = episode::run(&setup, &mut |moment| script.choose(moment));
        EpisodeLog { end: log.end, ..again }
    }
}

/// An episode of a training, before it is judged.
struct Unjudged {
    log: EpisodeLog,
    choices: Vec<Chosen>,
    /// The observation after the last step, and the rows that were legal then, shape `(rows,)`.
    last: Option<(Observation, Array1<bool>)>,
}

fn play(setup: &Setup, agent: &mut dyn Trainable) -> Unjudged {
    let mut choices = Vec::new();
    let mut last = None;
    let looks_at_mask = agent.looks_at_mask();
    let mut make_choice = |moment: &Moment| {
        let mut offers = Offers::of(agent, moment);
        let row = offers.chosen_by(agent);
        let legal = match looks_at_mask {
            true => offers.legal(),
            false => Array1::from_elem(offers.rows(), true),
        };
        let choice = offers.choice(row);
        let row = match &choice {
            Choice::Act(draw) => Some(draw.row),
            Choice::Await(action) => Some(action.row),
            Choice::Refused { row, .. } => Some(*row),
            Choice::Pass | Choice::Stop => None,
        };
        let observation = moment.observation.clone();
        choices.extend(row.map(|row| Chosen { step: moment.step, observation, legal, row }));
        choice
    };
    let mut at_last = |moment: &Moment| {
        let table = &moment.setup().table;
        let legal = match looks_at_mask {
            true => legal(&table.offers(moment.situation)),
            false => Array1::from_elem(table.rows().len(), true),
        };
        last = Some((moment.observation.clone(), legal));
    };
    let log = episode::run_from(Play::new(setup), &mut make_choice, &mut |_, _, _| {}, &mut at_last);
    Unjudged { log, choices, last }
}

/// A choice of the agent, with the observation and the legal rows that it was made on.
struct Chosen {
    step: usize,
    observation: Observation,
    legal: Array1<bool>,
    row: usize,
}

/// The reward and the consequences of each choice. A step in which nothing could be chosen teaches nothing.
fn experiences(
    settings: &Settings,
    choices: Vec<Chosen>,
    log: &EpisodeLog,
    summary: &EpisodeSummary,
) -> Vec<Experience> {
    let steps: Vec<usize> = choices.iter().map(|choice| choice.step).collect();
    let made_by =
        |obstacle: u32| steps.iter().position(|&step| log.steps[step].outcome.spawned().contains(&obstacle));
    let experience = |choice: Chosen| {
        let step = &log.steps[choice.step];
        let findings = || summary.collisions.iter().filter(|one| one.collision.step == choice.step);
        let outcome = StepOutcome {
            proc: step.proc,
            collided: findings().next().is_some(),
            counted: findings().any(|finding| finding.counted),
        };
        let reward = settings.reward().map_or(step.reward, |constants| mdp::reward(&constants, outcome));
        let makers = |finding: &Finding| made_by(finding.collision.contact.obstacle);
        let hits = findings().filter_map(makers).collect();
        let crashes = findings().filter(|finding| finding.counted).map(makers).collect();
        let Chosen { observation, legal, row, .. } = choice;
        Experience { observation, legal, row, reward, hits, crashes }
    };
    choices.into_iter().map(experience).collect()
}

/// Looks everything up that the settings name.
fn prepared(table: ActionTable, settings: &TrainSettings) -> Result<(Arena, Arc<Rows>), RunError> {
    settings.hours.map_or(Ok(()), |hours| Budget { hours, until: None }.check())?;
    check_episodes(settings.episodes)?;
    if matches!(agent_named(&settings.agent)?.kind, Kind::Ready(_) | Kind::OneRow(_)) {
        return Err(RunError::Unteachable { name: settings.agent.clone() });
    }
    let table = with_period(table, settings.hyperparameters.observation_period_s());
    let rows = Arc::new(Rows::new(&table, settings.hyperparameters.actions())?);
    Ok((Arena::under(table, &settings.conditions)?, rows))
}

/// The table with another observation period.
pub(crate) fn with_period(table: ActionTable, period_s: Option<f64>) -> ActionTable {
    let Some(step_s) = period_s else { return table };
    let mut space = Space::clone(table.space());
    space.episode.step_s = step_s;
    ActionTable::new(Arc::new(space))
}
