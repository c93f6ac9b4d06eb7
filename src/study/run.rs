//! A run: the same space, roads, driving system and agent over many seeds.
//!
//! Episodes are independent of each other and of the number of workers; each has its own seed,
//! derived from the run's.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering;
use std::sync::mpsc;

use ndarray::Array1;

use crate::action::ActionTable;
use crate::action::ActiveRules;
use crate::action::Offer;
use crate::ads;
use crate::agent;
use crate::agent::Agent;
use crate::episode;
use crate::episode::Choice;
use crate::episode::EpisodeLog;
use crate::episode::Moment;
use crate::episode::Script;
use crate::episode::Watch;
use crate::model::Scenario;
use crate::model::Space;
use crate::oracle;
use crate::oracle::AvoidabilitySettings;
use crate::oracle::Judgement;
use crate::rng;
use crate::rng::Stream;
use crate::sim::ENGINE;
use crate::sim::Scene;
use crate::sim::Start;
use crate::syntax::listed;

use super::summary::EpisodeSummary;

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
    pub agent: String,
    /// Episodes on each road.
    pub episodes: u32,
    pub seed: u64,
    /// Rules switched off.
    pub without: Vec<String>,
    /// Optional rules switched on.
    pub with: Vec<String>,
    /// By what it is told whether a collision was avoidable.
    #[serde(default)]
    pub avoidability: AvoidabilitySettings,
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
    #[error(transparent)]
    Rule(#[from] crate::action::UnknownRule),
    #[error("`{name}` is asked for twice, or both on and off")]
    Twice { name: String },
    #[error("{found} episodes a road: from 1 to {EPISODES_MAX} are possible")]
    Episodes { found: u32 },
    #[error("`{scenario}` was made in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike")]
    Engine { scenario: String, engine: String },
}

/// Most episodes that a run may have on each road.
pub const EPISODES_MAX: u32 = 1_000_000;

/// A run that is ready to play.
pub struct Run {
    table: ActionTable,
    rules: ActiveRules,
    settings: RunSettings,
    ads: &'static ads::Entry,
    agent: &'static agent::Entry,
    /// Index of each road in the space, with its scene.
    roads: Vec<(usize, Arc<Scene>)>,
}

impl Run {
    /// Looks everything up that the settings name.
    ///
    /// # Errors
    /// If the settings name a road, a driving system, an agent or a rule that does not exist, a name
    /// twice, or a number of episodes that is not possible.
    pub fn new(table: ActionTable, settings: RunSettings) -> Result<Run, RunError> {
        if !(1..=EPISODES_MAX).contains(&settings.episodes) {
            return Err(RunError::Episodes { found: settings.episodes });
        }
        if let Some(name) =
            twice(&settings.roads).or_else(|| twice(settings.with.iter().chain(&settings.without)))
        {
            return Err(RunError::Twice { name });
        }
        let space = table.space();
        let roads = settings.roads.iter().map(|name| {
            let index = space.roads.iter().position(|road| &road.name == name);
            let index = index.ok_or_else(|| {
                let known = listed(&space.roads.iter().map(|road| road.name.as_str()).collect::<Vec<_>>());
                RunError::Road { name: name.clone(), known }
            })?;
            Ok((index, Arc::new(episode::scene(&space.roads[index]))))
        });
        let roads = roads.collect::<Result<_, RunError>>()?;
        let ads = driving_system(&settings.ads)?;
        let agent = agent::by_name(&settings.agent).ok_or_else(|| {
            let known = listed(&agent::REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>());
            RunError::Agent { name: settings.agent.clone(), known }
        })?;
        let rules = ActiveRules::new(space, &settings.with, &settings.without)?;
        Ok(Run { table, rules, settings, ads, agent, roads })
    }

    pub fn table(&self) -> &ActionTable {
        &self.table
    }

    pub fn space(&self) -> &Arc<Space> {
        self.table.space()
    }

    pub fn settings(&self) -> &RunSettings {
        &self.settings
    }

    /// Number of episodes on all roads together.
    pub fn episodes(&self) -> usize {
        self.roads.len() * self.settings.episodes as usize
    }

    /// Plays one episode; numbers run through the roads one after another.
    pub fn episode(&self, number: usize) -> EpisodeLog {
        let mut agent = (self.agent.build)();
        self.play(number, &mut |moment| choose(&self.table, agent.as_mut(), moment), &mut |_, _, _| {})
    }

    /// Plays one episode and judges its collisions.
    pub fn judged(&self, number: usize) -> (EpisodeSummary, EpisodeLog) {
        let log = self.episode(number);
        let script = Script::of_log(&log);
        let judgements = oracle::judge(&log, &self.settings.avoidability, &mut |watch| {
            self.play(number, &mut |moment| script.choose(&self.table, moment), watch);
        });
        (EpisodeSummary::new(self.space(), number, &log, judgements), log)
    }

    /// Plays one episode's beginning with other choices: a replay of it, for example.
    pub fn play(
        &self,
        number: usize,
        choose: &mut dyn FnMut(&Moment) -> Choice,
        watch: &mut Watch,
    ) -> EpisodeLog {
        let (index, scene) = &self.roads[number / self.settings.episodes as usize];
        let seed = rng::child_seed(self.settings.seed, Stream::Episode, number as u64);
        let memory = self.space().initial_memory(seed);
        let setup = episode::Setup {
            table: &self.table,
            road: &self.space().roads[*index],
            scene: scene.clone(),
            rules: &self.rules,
            ads: self.ads,
            seed,
            start: episode::start(self.space(), &memory, seed),
            memory,
        };
        episode::run(&setup, choose, watch)
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

/// Plays a scenario, with its own driving system or another, under the rules that it was made with.
///
/// # Errors
/// If there is no such driving system, or the scenario is of another world or other rules.
pub fn replay(
    table: &ActionTable,
    scenario: &Scenario,
    ads: Option<&str>,
    watch: &mut Watch,
) -> Result<EpisodeLog, RunError> {
    let origin = &scenario.origin;
    if let Some(engine) = origin.engine.as_ref().filter(|engine| engine.as_str() != ENGINE) {
        return Err(RunError::Engine { scenario: scenario.name.clone(), engine: engine.clone() });
    }
    let ads = driving_system(ads.or(origin.ads.as_deref()).unwrap_or(DEFAULT_ADS))?;
    let space = table.space();
    let rules = ActiveRules::new(space, &origin.with, &origin.without)?;
    let road = &space.roads[scenario.road];
    let seed = origin.seed.unwrap_or(0);
    let memory = scenario.start.memory.clone();
    let setup = episode::Setup {
        table,
        road,
        scene: Arc::new(episode::scene(road)),
        rules: &rules,
        ads,
        seed,
        start: Start {
            signal_phase_s: scenario.start.signal_phase_s,
            seed: scenario.start.traffic_seed.unwrap_or(seed),
            ..episode::start(space, &memory, seed)
        },
        memory,
    };
    let script = Script::of_scenario(scenario);
    Ok(episode::run(&setup, &mut |moment| script.choose(table, moment), watch))
}

/// Judges the collisions of a replay, by playing it again.
///
/// # Errors
/// As [`replay`].
pub fn judge_replay(
    table: &ActionTable,
    scenario: &Scenario,
    ads: Option<&str>,
    log: &EpisodeLog,
) -> Result<Vec<Judgement>, RunError> {
    let mut failure = None;
    let judgements = oracle::judge(log, &AvoidabilitySettings::default(), &mut |watch| {
        failure = replay(table, scenario, ads, watch).err();
    });
    failure.map_or(Ok(judgements), Err)
}

/// Who drives where nobody is named.
pub const DEFAULT_ADS: &str = "modular";

fn driving_system(name: &str) -> Result<&'static ads::Entry, RunError> {
    ads::by_name(name).ok_or_else(|| {
        let known = listed(&ads::REGISTRY.iter().map(|entry| entry.name).collect::<Vec<_>>());
        RunError::Ads { name: name.to_owned(), known }
    })
}

/// Lets an agent choose among the offers of the moment. With nothing legal, the step passes.
fn choose(table: &ActionTable, agent: &mut dyn Agent, moment: &Moment) -> Choice {
    let mut offers = table.offers(moment.situation);
    let legal: Array1<bool> = offers.iter().map(|offer| matches!(offer, Offer::Legal(_))).collect();
    if !legal.iter().any(|&is_legal| is_legal) {
        return Choice::Pass;
    }
    let mut rng = rng::stream(moment.situation.seed, Stream::Exploration, moment.step as u64);
    let row = agent.choose(moment.state, legal.view(), &mut rng);
    match offers.swap_remove(row) {
        Offer::Legal(draw) => Choice::Act(draw),
        Offer::Refused(refusal) => Choice::Refused { row, rule: refusal.rule, reason: refusal.reason },
    }
}

/// The first name that comes a second time.
fn twice<'a>(names: impl IntoIterator<Item = &'a String>) -> Option<String> {
    let mut seen = BTreeSet::new();
    names.into_iter().find(|name| !seen.insert(*name)).cloned()
}
