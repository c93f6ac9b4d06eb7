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
use crate::ads::ModularConfig;
use crate::ads::Selected;
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
use crate::rng;
use crate::rng::Stream;
use crate::sim::ENGINE;
use crate::sim::Scene;
use crate::sim::Start;
use crate::syntax::listed;

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
    /// Episodes on each road.
    pub episodes: u32,
    pub seed: u64,
    /// Rules switched off.
    pub without: Vec<String>,
    /// Optional rules switched on.
    pub with: Vec<String>,
}

/// Settings of a driving system, and a digest that tells whether they still mean the same.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    pub digest: String,
    pub settings: ModularConfig,
}

impl Profile {
    pub fn new(settings: &ModularConfig) -> Profile {
        Profile { digest: settings.digest(), settings: *settings }
    }
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
    #[error(transparent)]
    NoSettings(#[from] ads::NoSettings),
    #[error("the profile of `{scenario}`: {error}")]
    Profile { scenario: String, error: ads::ConfigError },
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

/// A run that is ready to play.
pub struct Run {
    table: ActionTable,
    rules: ActiveRules,
    settings: RunSettings,
    ads: Selected,
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
        let mut ads = driving_system(&settings.ads)?;
        if let Some(profile) = &settings.profile {
            if profile.settings.digest() != profile.digest {
                return Err(RunError::ProfileDigest { what: "the run".to_owned(), ads: settings.ads });
            }
            ads = ads.with_profile(profile.settings)?;
        }
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
            ads: self.ads.clone(),
            seed,
            start: episode::start(self.space(), &memory, seed),
            memory,
        };
        episode::run(&setup, choose, watch)
    }
}

/// Plays episodes on `jobs` threads and hands each log to `done` on this one, in the order in which
/// they end. Stops early, between episodes, when `stop` is set or `done` fails.
///
/// # Errors
/// The first error of `done`.
pub fn play<E>(
    run: &Run,
    numbers: &[usize],
    jobs: usize,
    stop: &AtomicBool,
    done: &mut dyn FnMut(usize, EpisodeLog) -> Result<(), E>,
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
                    if sender.send((number, run.episode(number))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for (number, log) in receiver {
            if let Err(error) = done(number, log) {
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
    let ads = match ads {
        Some(name) => driving_system(name)?,
        None => recorded(scenario)?,
    };
    replay_with(table, scenario, ads, watch)
}

/// Plays a scenario with any driving system, under the rules that it was made with.
///
/// # Errors
/// If the scenario is of another world or other rules.
pub fn replay_with(
    table: &ActionTable,
    scenario: &Scenario,
    ads: Selected,
    watch: &mut Watch,
) -> Result<EpisodeLog, RunError> {
    let origin = &scenario.origin;
    if let Some(engine) = origin.engine.as_ref().filter(|engine| engine.as_str() != ENGINE) {
        return Err(RunError::Engine { scenario: scenario.name.clone(), engine: engine.clone() });
    }
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

/// Who drives where nobody is named.
pub const DEFAULT_ADS: &str = "modular";

/// The driving system that a scenario was made with, and its settings.
///
/// # Errors
/// If there is none of that name, or its settings do not exist any more or mean something else.
pub fn recorded(scenario: &Scenario) -> Result<Selected, RunError> {
    let origin = &scenario.origin;
    let mut ads = driving_system(origin.ads.as_deref().unwrap_or(DEFAULT_ADS))?;
    if let Some(line) = &origin.profile {
        let profile = ModularConfig::from_yaml(line)
            .map_err(|error| RunError::Profile { scenario: scenario.name.clone(), error })?;
        ads = ads.with_profile(profile)?;
    }
    let digest = ads.profile().map(ModularConfig::digest);
    match &origin.profile_digest {
        Some(recorded) if Some(recorded) != digest.as_ref() => {
            Err(RunError::ProfileDigest { what: format!("`{}`", scenario.name), ads: ads.name().to_owned() })
        }
        _ => Ok(ads),
    }
}

/// The driving system of that name, as it comes.
///
/// # Errors
/// If there is none.
pub fn driving_system(name: &str) -> Result<Selected, RunError> {
    ads::by_name(name).map(Selected::new).ok_or_else(|| {
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
