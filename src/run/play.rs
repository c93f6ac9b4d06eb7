//! A run: the same space, roads, driving system and agent over many seeds.
//!
//! Episodes are independent of each other and of the number of workers; each has its own seed,
//! derived from the run's.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};

use crate::action::ActionTable;
use crate::ads;
use crate::ads::{ModularConfig, Selected};
use crate::agent;
use crate::agent::{Agent, Kind, QPolicy};
use crate::episode;
use crate::episode::{Choice, EpisodeLog, Moment, Script, Watch};
use crate::mdp::ProcKind;
use crate::model::{RulesInForce, Scenario, Space};
use crate::oracle;
use crate::oracle::{AvoidabilitySettings, ClaimResult, Judgement, Replays};
use crate::rng;
use crate::rng::Stream;
use crate::sim::{ENGINE, Scene, Start};
use crate::syntax::listed;

use crate::run::arena::{Arena, choose};
use crate::run::gauges::Gauges;
use crate::run::profile::{Profile, under_test};
use crate::run::summary::EpisodeSummary;

/// Everything that is needed to repeat a run; written to `run.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    /// Version of avastra that wrote it.
    pub avastra: String,
    /// Version of the simulated world.
    pub engine: String,
    /// Path of the space, from the run directory.
    pub space: String,
    /// Digest of the space with all that it uses.
    pub space_digest: String,
    pub roads: Vec<String>,
    pub ads: String,
    /// Settings of the driving system, if it has any; without them it is as it comes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    pub agent: String,
    /// The policy that the agent follows, from the run directory, and its digest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy: Option<PolicyReference>,
    /// Episodes on each road.
    pub episodes: u32,
    pub seed: u64,
    /// Vehicles of ambient traffic.
    #[serde(default)]
    pub ambient: u32,
    /// Whether each counted collision is diagnosed.
    #[serde(default)]
    pub causes: bool,
    /// Rules switched off.
    pub without: Vec<String>,
    /// Optional rules switched on.
    pub with: Vec<String>,
    /// By what it is told whether a collision was avoidable.
    #[serde(default)]
    pub avoidability: AvoidabilitySettings,
}

/// A policy file that a run was begun with.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyReference {
    pub file: String,
    pub digest: String,
    /// Which of its faces acts.
    #[serde(default)]
    pub face: agent::Face,
}

/// Why a run or a replay cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("no road `{name}` in this space: it has {known}")]
    Road { name: String, known: String },
    #[error("no driving system `{name}`: there are {known}")]
    Ads { name: String, known: String },
    #[error("no agent `{name}`: there are {known}")]
    Agent { name: String, known: String },
    #[error("`{name}` has to be trained first: `avastra train`, then `avastra run --policy FILE`")]
    Untrained { name: String },
    #[error("`{name}` has nothing to learn: `avastra run --agent {name}` plays it")]
    Unteachable { name: String },
    #[error("the checkpoint is not of a training with such settings: begin a new one")]
    Checkpoint,
    #[error(transparent)]
    Settings(#[from] agent::SettingsError),
    #[error(transparent)]
    Rule(#[from] crate::model::UnknownRule),
    #[error("`{name}` is asked for twice, or both on and off")]
    Twice { name: String },
    #[error("{found} episodes a road: from 1 to {EPISODES_MAX} are possible")]
    Episodes { found: u32 },
    #[error(transparent)]
    Avoidability(#[from] oracle::AvoidabilityError),
    #[error(transparent)]
    NoModules(#[from] oracle::NoModules),
    #[error(transparent)]
    NoSettings(#[from] ads::NoSettings),
    #[error("the profile of `{name}`: {error}")]
    Profile { name: String, error: ads::ConfigError },
    #[error(
        "{what} was made with settings of `{ads}` that mean something else in this version: nothing need \
         happen alike; name a profile with `--ads-config FILE` to see what happens with that"
    )]
    ProfileDigest { what: String, ads: String },
    #[error("`{scenario}` was made in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike")]
    Engine { scenario: String, engine: String },
}

/// Most episodes that a run may have on each road.
pub const EPISODES_MAX: u32 = 1_000_000;

/// Makes the agent of an episode.
type MakeAgent = dyn Fn() -> Box<dyn Agent> + Send + Sync;

/// # Errors
/// If a run cannot have so many episodes on a road.
pub(crate) fn check_episodes(episodes: u32) -> Result<(), RunError> {
    let fits = (1..=EPISODES_MAX).contains(&episodes);
    if fits { Ok(()) } else { Err(RunError::Episodes { found: episodes }) }
}

/// A run that is ready to play.
pub struct Run {
    arena: Arena,
    settings: RunSettings,
    agent: Box<MakeAgent>,
}

impl Run {
    /// Looks everything up that the settings name.
    ///
    /// # Errors
    /// If the settings name a road, a driving system, an agent or a rule that does not exist, a name
    /// twice, or a number of episodes that is not possible.
    pub fn new(table: ActionTable, settings: RunSettings) -> Result<Run, RunError> {
        let agent = agent::by_name(&settings.agent).ok_or_else(|| {
            let known = listed(&agent::REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>());
            RunError::Agent { name: settings.agent.clone(), known }
        })?;
        match agent.kind {
            Kind::Ready(build) => Run::with_agent(table, settings, Box::new(build)),
            Kind::Learning(_) | Kind::Searching(_) => Err(RunError::Untrained { name: settings.agent }),
        }
    }

    /// The same with a trained policy for an agent.
    ///
    /// # Errors
    /// As [`Run::new`].
    pub fn with_policy(table: ActionTable, settings: RunSettings, policy: QPolicy) -> Result<Run, RunError> {
        Run::with_agent(table, settings, Box::new(move || Box::new(policy.clone())))
    }

    fn with_agent(table: ActionTable, settings: RunSettings, agent: Box<MakeAgent>) -> Result<Run, RunError> {
        check_episodes(settings.episodes)?;
        settings.avoidability.check()?;
        let ads = under_test(&settings.ads, settings.profile.as_ref())?;
        let arena = Arena::new(table, &settings.roads, ads, &settings.with, &settings.without)?;
        if settings.causes && !arena.has_modules() {
            return Err(RunError::NoModules(oracle::NoModules { ads: settings.ads }));
        }
        Ok(Run { arena, settings, agent })
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

    /// Number of episodes on all roads together.
    pub fn episodes(&self) -> usize {
        self.arena.roads() * self.settings.episodes as usize
    }

    /// Plays one episode; numbers run through the roads one after another.
    pub fn episode(&self, number: usize) -> EpisodeLog {
        let mut agent = (self.agent)();
        agent.begin();
        self.play(number, &mut |moment| choose(agent.as_mut(), moment), &mut |_, _, _| {})
    }

    /// Plays one episode and judges its collisions.
    pub fn judged(&self, number: usize) -> (EpisodeSummary, EpisodeLog) {
        self.judged_by(number, (self.agent)().as_mut())
    }

    /// The same with another agent than the run's own.
    pub fn judged_by(&self, number: usize, agent: &mut dyn Agent) -> (EpisodeSummary, EpisodeLog) {
        agent.begin();
        let mut gauges = Gauges::default();
        let log = self.play(number, &mut |moment| choose(agent, moment), &mut |world, _, contacts| {
            gauges.note(world, contacts)
        });
        let setup = self.setup(number);
        let mut summary = EpisodeSummary::judged(&setup, number, &log, &self.settings.avoidability);
        (summary.criticality, summary.pet_s) = gauges.of_steps(&log);
        for (finding, shape) in summary.collisions.iter_mut().zip(gauges.shapes()) {
            finding.shape = *shape;
        }
        summary.manners = gauges.manners();
        summary.branched_s = agent.branched_s();
        if self.settings.causes {
            summary.find_causes(&setup, &log).expect("a run with causes is against a system of modules");
        }
        (summary, log)
    }

    /// Plays one episode's beginning with other choices: a replay of it, for example.
    pub fn play(
        &self,
        number: usize,
        choose: &mut dyn FnMut(&Moment) -> Choice,
        watch: &mut Watch,
    ) -> EpisodeLog {
        episode::run(&self.setup(number), choose, watch)
    }

    /// The beginning of an episode.
    pub fn setup(&self, number: usize) -> episode::Setup<'_> {
        let seed = rng::child_seed(self.settings.seed, Stream::Episode, number as u64);
        let mut setup = self.arena.setup(number / self.settings.episodes as usize, seed);
        setup.start.ambient = self.settings.ambient;
        setup
    }
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
    let next = AtomicUsize::new(0);
    let abandoned = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..jobs.min(numbers.len()) {
            let sender = sender.clone();
            scope.spawn(|| {
                // Moved in, so that the channel closes when the last worker is done.
                let sender = sender;
                while !stop.load(Ordering::Relaxed) && !abandoned.load(Ordering::Relaxed) {
                    let Some(&number) = numbers.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                    if sender.send(run.judged(number)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (summary, log) in receiver {
            if let Err(error) = done(summary, log) {
                abandoned.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(())
    })
}

/// A scenario that is ready to play: its road and the rules that it was made with.
pub struct Stage<'a> {
    table: &'a ActionTable,
    scenario: &'a Scenario,
    rules: RulesInForce,
    scene: Arc<Scene>,
    avoidability: AvoidabilitySettings,
}

impl<'a> Stage<'a> {
    /// # Errors
    /// If the scenario is of another world or other rules, or does not say how its verdicts are told.
    pub fn new(table: &'a ActionTable, scenario: &'a Scenario) -> Result<Stage<'a>, RunError> {
        let origin = &scenario.origin;
        if let Some(engine) = origin.engine.as_ref().filter(|engine| engine.as_str() != ENGINE) {
            return Err(RunError::Engine { scenario: scenario.name.clone(), engine: engine.clone() });
        }
        let rules = RulesInForce::new(table.space(), &origin.with, &origin.without)?;
        let scene = Arc::new(episode::scene(&table.space().roads[scenario.road]));
        let line = origin.avoidability.as_deref();
        let avoidability = line.map(AvoidabilitySettings::from_line).transpose()?.unwrap_or_default();
        Ok(Stage { table, scenario, rules, scene, avoidability })
    }

    /// By what it is told whether a collision was avoidable: as recorded.
    pub fn avoidability(&self) -> &AvoidabilitySettings {
        &self.avoidability
    }

    /// The beginning of its episode, with any driving system.
    pub fn setup(&self, ads: &Selected) -> episode::Setup<'_> {
        let space = self.table.space();
        let start = &self.scenario.start;
        let seed = self.scenario.origin.seed.unwrap_or(0);
        let memory = start.memory.clone();
        episode::Setup {
            table: self.table,
            road: &space.roads[self.scenario.road],
            scene: self.scene.clone(),
            rules: &self.rules,
            ads: ads.clone(),
            seed,
            start: Start {
                signal_phase_s: start.signal_phase_s,
                seed: start.traffic_seed.unwrap_or(seed),
                ambient: start.ambient,
                ..episode::start(space, &memory, seed)
            },
            memory,
            period_shifts: Vec::new(),
            proc: ProcKind::default(),
        }
    }

    /// Plays it as it is written down.
    pub fn play(&self, ads: &Selected, watch: &mut Watch) -> EpisodeLog {
        let script = Script::of_scenario(self.scenario);
        episode::run(&self.setup(ads), &mut |moment| script.choose(self.table, moment), watch)
    }

    /// Checks its claims against a log of it.
    pub fn verify(&self, ads: &Selected, log: &EpisodeLog) -> Vec<ClaimResult> {
        let setup = self.setup(ads);
        let judgements = self.judge(ads, log);
        let replays = Replays {
            cause: &|index| Ok(oracle::diagnose(&setup, log, index, &ModularConfig::default())?.cause),
            spare_steps: &|index| oracle::spare_steps(&setup, log, index, &judgements, &self.avoidability),
        };
        oracle::verify(self.table.space(), self.scenario, log, &judgements, &replays)
    }

    /// Judges the collisions of its log, by playing it again.
    pub fn judge(&self, ads: &Selected, log: &EpisodeLog) -> Vec<Judgement> {
        oracle::judge(log, &self.avoidability, &mut |watch| {
            self.play(ads, watch);
        })
    }
}
