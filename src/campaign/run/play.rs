//! A run that is ready: the same space, roads, driving system and agent over many seeds.
//!
//! Episodes are independent of each other and of the number of workers; each has its own seed,
//! derived from the run's.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::episode;
use crate::episode::{Choice, EpisodeLog, Moment, Script, Watch};
use crate::oracle;
use crate::oracle::AvoidabilitySettings;
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_lang::model::Space;
use avastra_search::agent::{Agent, Kind, QPolicy};
use avastra_world::action::ActionTable;
use avastra_world::sim::World;

use crate::run::arena::{Arena, Offers, choose};
use crate::run::gauges::Gauges;
use crate::run::offered::Offered;
use crate::run::settings::{Budget, RunError, RunSettings, agent_named, check_episodes};
use crate::run::summary::EpisodeSummary;
use crate::run::threads::on_threads;

/// Makes the agent of an episode on the nth of the roads, for a row if it plays one.
type MakeAgent = dyn Fn(usize) -> Box<dyn Agent> + Send + Sync;

/// A run that is ready to play.
pub struct Run {
    arena: Arena,
    settings: RunSettings,
    agent: Box<MakeAgent>,
    /// A road and a row for each block of episodes, of an agent that plays each row.
    plan: Vec<(usize, usize)>,
}

impl Run {
    /// Looks everything up that the settings name.
    ///
    /// # Errors
    /// If the settings name a road, a driving system, an agent or a rule that does not exist, a name
    /// twice, or a number of episodes that is not possible.
    pub fn new(table: ActionTable, settings: RunSettings) -> Result<Run, RunError> {
        match agent_named(&settings.agent)?.kind {
            Kind::Ready(build) => Run::with_agent(table, settings, Box::new(move |_| build())),
            Kind::OneRow(_) if settings.budget.is_some() => {
                Err(RunError::BudgetOfRows { name: settings.agent })
            }
            Kind::OneRow(build) => {
                let before: Vec<Vec<usize>> = {
                    let space = table.space();
                    space.rows.iter().map(|row| space.rows_before(row)).collect()
                };
                let build = move |row: usize| build(row, before.get(row).cloned().unwrap_or_default());
                let mut run = Run::with_agent(table, settings, Box::new(build))?;
                run.plan = run.arena.rows_on_roads();
                run.settings.rows = u32::try_from(run.plan.len()).unwrap_or(u32::MAX);
                if run.plan.is_empty() { Err(RunError::NoRow) } else { Ok(run) }
            }
            Kind::Learning(_) | Kind::Searching(_) => Err(RunError::Untrained { name: settings.agent }),
        }
    }

    /// As [`Run::new`], with a trained policy as the agent.
    ///
    /// # Errors
    /// As [`Run::new`].
    pub fn with_policy(table: ActionTable, settings: RunSettings, policy: QPolicy) -> Result<Run, RunError> {
        Run::with_agent(table, settings, Box::new(move |_| Box::new(policy.clone())))
    }

    fn with_agent(table: ActionTable, settings: RunSettings, agent: Box<MakeAgent>) -> Result<Run, RunError> {
        settings.budget.as_ref().map_or(Ok(()), Budget::check)?;
        if settings.budget.is_some_and(|budget| budget.until.is_some()) && !oracle::can_tell(settings.replays)
        {
            return Err(RunError::UntilUntold);
        }
        check_episodes(settings.episodes)?;
        if settings.avoidability != AvoidabilitySettings::default() {
            return Err(RunError::Avoidability);
        }
        let arena = Arena::under(table, &settings.conditions)?;
        if settings.causes && arena.ads().profile().is_none() {
            return Err(RunError::NoModules(oracle::NoModules { ads: arena.ads_name() }));
        }
        Ok(Run { arena, settings, agent, plan: Vec::new() })
    }

    pub fn table(&self) -> &ActionTable {
        self.arena.table()
    }

    pub fn space(&self) -> &Arc<Space> {
        self.arena.table().space()
    }

    pub fn settings(&self) -> &RunSettings {
        &self.settings
    }

    /// Where its episodes are played.
    pub fn arena(&self) -> &Arena {
        &self.arena
    }

    /// Number of episodes on all roads together.
    pub fn episodes(&self) -> usize {
        self.settings.all_episodes()
    }

    /// Plays one episode; numbers run through the roads one after another, with a budget round and round.
    pub fn episode(&self, number: usize) -> EpisodeLog {
        played_by(&self.setup(number), self.agent_of(number).as_mut())
    }

    /// Plays an episode of a setup with a fresh agent.
    pub fn played(&self, setup: &episode::Setup) -> EpisodeLog {
        played_by(setup, self.agent().as_mut())
    }

    /// Plays one episode and judges its collisions.
    pub fn judged(&self, number: usize) -> (EpisodeSummary, EpisodeLog) {
        self.judged_by(number, self.agent_of(number).as_mut())
    }

    /// As [`Run::judged`], with another agent than the run's own.
    pub fn judged_by(&self, number: usize, agent: &mut dyn Agent) -> (EpisodeSummary, EpisodeLog) {
        let setup = self.setup(number);
        agent.begin(setup.seed);
        let mut gauges = Gauges::default();
        let mut offered = Offered::default();
        let own = self.planned(number).map(|(_, row)| row);
        let mut choose = |moment: &Moment| {
            let mut offers = Offers::of(agent, moment);
            let row = offers.chosen_by(agent);
            offered.note(offers.judged(), own);
            offers.choice(row)
        };
        let log = self.play(number, &mut choose, &mut |world, _, contacts| gauges.note(world, contacts));
        let mut summary = EpisodeSummary::judged(&setup, number, &log);
        summary.find_keepers(&setup, &log);
        if let Some(last) = summary.last_step(&log) {
            let mut script = Script::of_log(&log);
            script.steps.truncate(last + 1);
            summary.find_recurrence(&setup, &script, &log, self.settings.replays);
        }
        (summary.criticality, summary.pet_s) = gauges.of_steps(&log);
        summary.top_speeds_mps = gauges.top_speeds_mps(&log);
        summary.manners = gauges.manners();
        summary.offered = offered;
        if self.settings.causes {
            summary.find_causes(&setup, &log).expect("a run with causes is against a system of modules");
        }
        (summary, log)
    }

    /// Plays one episode with other choices than the agent's: a replay, for example.
    pub fn play(
        &self,
        number: usize,
        choose: &mut dyn FnMut(&Moment) -> Choice,
        watch: &mut Watch,
    ) -> EpisodeLog {
        episode::run_watched(&self.setup(number), choose, watch)
    }

    /// Everything that the nth episode is made of but the choices.
    pub fn setup(&self, number: usize) -> episode::Setup {
        let seed = rng::child_seed(self.settings.seed, Stream::Episode, number as u64);
        let (_, turn) = self.settings.turn(number);
        self.setup_of(self.planned(number).map_or(turn, |(road, _)| road), seed)
    }

    /// A fresh agent for the nth episode.
    fn agent_of(&self, number: usize) -> Box<dyn Agent> {
        (self.agent)(self.planned(number).map_or(0, |(_, row)| row))
    }

    /// The road and the row that an episode of a protocol is about.
    fn planned(&self, number: usize) -> Option<(usize, usize)> {
        self.plan.get(number / self.settings.episodes as usize).copied()
    }

    /// An episode of any seed on the nth of the roads.
    pub fn setup_of(&self, road: usize, seed: u64) -> episode::Setup {
        let mut setup = self.arena.setup(road, seed);
        setup.start.ambient = self.settings.conditions.ambient;
        setup
    }

    /// How many vehicles of ambient traffic are there at the beginning of an episode on each road, by its name.
    pub fn ambient_at_start(&self) -> Vec<(String, u32)> {
        let found = (0..self.settings.conditions.roads.len()).map(|road| {
            let first = self.settings.first_on(road) as u64;
            let seed = rng::child_seed(self.settings.seed, Stream::Episode, first);
            let setup = self.setup_of(road, seed);
            let world = World::new(Arc::clone(&setup.scene), &setup.start);
            let ambient = world.obstacles().filter(|obstacle| obstacle.is_ambient()).count();
            (setup.road().name.clone(), ambient as u32)
        });
        found.collect()
    }

    /// A fresh agent for one episode.
    pub fn agent(&self) -> Box<dyn Agent> {
        (self.agent)(0)
    }
}

/// Plays an episode of a setup with an agent.
fn played_by(setup: &episode::Setup, agent: &mut dyn Agent) -> EpisodeLog {
    agent.begin(setup.seed);
    episode::run(setup, &mut |moment: &Moment| choose(agent, moment))
}

/// Plays and judges episodes on `jobs` threads and hands each to `done` on this one, in the order in
/// which they end. Stops early, between episodes, when `stop` is set or `done` fails.
///
/// # Errors
/// The first error of `done`.
pub fn play<E>(
    run: &Run,
    numbers: &[usize],
    jobs: usize,
    stop: &AtomicBool,
    done: &mut dyn FnMut(EpisodeSummary, EpisodeLog) -> Result<(), E>,
) -> Result<(), E> {
    let work = |&number: &usize, tell: &mut dyn FnMut(_) -> bool| {
        tell(run.judged(number));
    };
    on_threads(numbers, jobs, stop, work, &mut |(summary, log)| done(summary, log))
}
