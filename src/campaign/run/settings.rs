//! The settings of a run, as `run.yaml` keeps them, and why it cannot begin.

use crate::oracle;
use crate::oracle::AvoidabilitySettings;
use avastra_drivers as ads;
use avastra_drivers::external::{Attached, Failure, RecordError};
use avastra_lang::model::Space;
use avastra_lang::syntax::{listed, nearest, read_yaml};
use avastra_search::agent;
use avastra_world::sim::{ENGINE, TrafficError};

use crate::run::left::NextHour;
use crate::run::profile::{DEFAULT_ADS, Profile, TrafficRecord};

/// Version of avastra, as settings record it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Where episodes play, against which driving system and under which circumstances: what runs, trainings and studies have in
/// common.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Version of avastra that wrote it.
    pub avastra: String,
    /// Version of the simulated world.
    pub engine: String,
    /// Path of the space, from the directory in which this is written.
    pub space: String,
    /// A digest of the space's meaning: see `model::Meaning`.
    pub space_digest: String,
    pub roads: Vec<String>,
    pub ads: String,
    /// Settings of the driving system; without them it has its defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<Profile>,
    /// The identity that an external driving system stated, and how it is reached and asked. Its working directory is
    /// relative to the directory in which this is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub external: Option<Attached>,
    /// Vehicles of ambient traffic.
    #[serde(default)]
    pub ambient: u32,
    /// How other vehicles drive, if not as in the default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traffic: Option<TrafficRecord>,
    /// Rules switched off.
    pub without: Vec<String>,
    /// Optional rules switched on.
    pub with: Vec<String>,
}

impl Conditions {
    /// All roads of a space and the default driving system, with every option off. The caller changes what it wants otherwise.
    pub fn of(space: &Space) -> Conditions {
        Conditions {
            avastra: VERSION.to_owned(),
            engine: ENGINE.to_owned(),
            space: space.path.to_string_lossy().into_owned(),
            space_digest: space.meaning.seal(),
            roads: space.roads.iter().map(|road| road.name.clone()).collect(),
            ads: DEFAULT_ADS.to_owned(),
            profile: None,
            external: None,
            ambient: 0,
            traffic: None,
            without: Vec::new(),
            with: Vec::new(),
        }
    }
}

/// The fields of settings in which nothing is nested: those under `conditions` stand beside the others, as in settings of earlier
/// builds; and whether there are `conditions`. `None` if the text is no settings.
pub fn flat(settings: &str) -> Option<(serde_json::Map<String, serde_json::Value>, bool)> {
    let mut fields: serde_json::Map<String, serde_json::Value> = read_yaml(settings).ok()?;
    let Some(serde_json::Value::Object(conditions)) = fields.remove("conditions") else {
        return Some((fields, false));
    };
    fields.extend(conditions);
    Some((fields, true))
}

/// Everything that is needed to repeat a run; written to `run.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSettings {
    pub conditions: Conditions,
    pub agent: String,
    /// The policy that the agent follows, from the run directory, and its digest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy: Option<PolicyReference>,
    /// Episodes on each road; of an agent that plays each row, those of each row on a road. With a budget, the most that there
    /// can be.
    pub episodes: u32,
    /// Ends the run by time in place of a number of episodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
    /// How many rows on roads such an agent plays; 0 of others.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rows: u32,
    pub seed: u64,
    /// Whether each counted collision is diagnosed.
    #[serde(default)]
    pub causes: bool,
    /// Replays of each finding under other chance, to say how often it recurs; 0 for none.
    #[serde(default)]
    pub replays: u32,
    /// Episodes in which nothing was found that are kept as scenarios, too: collisions that do not count, then the nearest misses.
    /// `None`: some, if the whole run found nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep: Option<u32>,
    /// How the avoidability of collisions is judged: in one way, of which this is the record.
    #[serde(default)]
    pub avoidability: AvoidabilitySettings,
}

/// When a run ends that has no number of episodes. Its episodes go round the roads, and it looks after every few rounds.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// Simulated time, h.
    pub hours: f64,
    /// Ends it sooner: once an hour more shows a new kind with at most this chance, by the upper end of its interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

impl Budget {
    /// Longest budget, h.
    pub const HOURS_MAX: f64 = 1000.0;

    /// Whether `until` can end it before its hours are over: a chance is small only after some hours, even if nothing is found.
    pub fn can_end_sooner(&self) -> bool {
        self.until.is_none_or(|until| NextHour::after(self.hours, 0, 0).high <= until)
    }

    /// Whether it is possible.
    pub(crate) fn check(&self) -> Result<(), RunError> {
        let fits = self.hours > 0.0
            && self.hours <= Budget::HOURS_MAX
            && self.until.is_none_or(|chance| chance > 0.0 && chance < 1.0);
        let found = || match self.until {
            None => format!("{} h", self.hours),
            Some(chance) => format!("{} h, until {chance}", self.hours),
        };
        if fits { Ok(()) } else { Err(RunError::Budget { found: found() }) }
    }

    /// The most episodes that it can pay for on one of so many roads: hardly any is shorter than this.
    pub fn episodes(&self, roads: usize) -> u32 {
        const SHORT_S: f64 = 4.0;
        ((self.hours * 3600.0 / SHORT_S / roads as f64).ceil() as u32).max(EPISODES as u32)
    }
}

/// Rounds of the roads between two looks at a budget, and the fewest episodes. Ours: some minutes, and work for many threads.
const ROUNDS: usize = 4;
const EPISODES: usize = 16;

fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl RunSettings {
    /// Number of episodes on all roads together.
    pub fn all_episodes(&self) -> usize {
        let times = if self.rows > 0 { self.rows as usize } else { self.conditions.roads.len() };
        times * self.episodes as usize
    }

    /// The round of an episode that is about no row, and the place of its road in it.
    pub fn turn(&self, number: usize) -> (usize, usize) {
        match self.budget {
            None => (number % self.episodes as usize, number / self.episodes as usize),
            Some(_) => (number / self.conditions.roads.len(), number % self.conditions.roads.len()),
        }
    }

    /// The first episode on the nth of the roads.
    pub fn first_on(&self, road: usize) -> usize {
        if self.budget.is_some() { road } else { road * self.episodes as usize }
    }

    /// Episodes between two looks at a budget.
    pub fn block(&self) -> usize {
        let roads = self.conditions.roads.len();
        roads * ROUNDS.max(EPISODES.div_ceil(roads))
    }

    /// The same settings with a budget in place of a number of episodes.
    #[must_use]
    pub fn within(self, budget: Budget) -> RunSettings {
        let episodes = budget.episodes(self.conditions.roads.len());
        RunSettings { episodes, budget: Some(budget), ..self }
    }

    /// A run with every option off. The caller changes what it wants otherwise.
    pub fn new(conditions: Conditions, agent: &str, episodes: u32, seed: u64) -> RunSettings {
        RunSettings {
            conditions,
            agent: agent.to_owned(),
            policy: None,
            episodes,
            budget: None,
            rows: 0,
            seed,
            causes: false,
            replays: 0,
            keep: None,
            avoidability: AvoidabilitySettings::default(),
        }
    }
}

/// The policy file that a run plays.
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
    #[error("no agent `{name}`: {meant}there are {known}")]
    Agent { name: String, meant: String, known: String },
    #[error("`{name}` has to be trained first: `avastra train`, then `avastra run --policy FILE`")]
    Untrained { name: String },
    #[error("`{name}` has nothing to learn: `avastra run --agent {name}` plays it")]
    Unteachable { name: String },
    #[error("`{name}` plays each row of a table once: `avastra run --agent {name}` does so")]
    OneRow { name: String },
    #[error("no row can run on these roads: `avastra check --audit` says which rule forbids each")]
    NoRow,
    #[error("the checkpoint is not of a training with such settings: begin a new one")]
    Checkpoint,
    #[error(transparent)]
    Settings(#[from] agent::SettingsError),
    #[error(transparent)]
    Rule(#[from] avastra_lang::model::UnknownRule),
    #[error(transparent)]
    Start(#[from] avastra_lang::model::NoStart),
    #[error(transparent)]
    Time(#[from] avastra_lang::prove::BrokenByTime),
    #[error("`{name}` is asked for twice, or both on and off")]
    Twice { name: String },
    #[error(
        "the budget is {found}: hours above 0 up to {} are possible, and a chance above 0 and below 1",
        Budget::HOURS_MAX
    )]
    Budget { found: String },
    #[error("`--until` asks what recurs, which takes at least 7 replays: leave out `--repeat`, or raise it")]
    UntilUntold,
    #[error("`{name}` plays each row so many times, whatever time that takes: `--hours` is for other agents")]
    BudgetOfRows { name: String },
    #[error("{found} episodes a road: from 1 to {EPISODES_MAX} are possible")]
    Episodes { found: u32 },
    #[error(
        "its settings say that avoidability was judged in another way (`avoidability`), which is not possible here: begin a new one"
    )]
    Avoidability,
    #[error(transparent)]
    NoModules(#[from] oracle::NoModules),
    #[error(transparent)]
    NoSettings(#[from] ads::NoSettings),
    #[error("the profile of `{name}`: {error}")]
    Profile { name: String, error: ads::ConfigError },
    #[error(
        "{what} was made with settings of `{ads}` that mean something else in this version: nothing need \
         happen alike; name a profile with `--ads FILE` to see what happens with that"
    )]
    ProfileDigest { what: String, ads: String },
    #[error("the traffic of `{name}`: {error}")]
    Traffic { name: String, error: TrafficError },
    #[error(
        "{what} was made with a traffic profile that means something else in this version: nothing need happen alike"
    )]
    TrafficDigest { what: String },
    #[error("{}", external_text(.0))]
    External(Box<Failure>),
    #[error("it was begun against {begun}, and the same command now starts {found}: begin a new one")]
    OtherProgram { begun: String, found: String },
    #[error("an external driving system has no name here: give it with `--ads 'COMMAND'` or `--ads FILE`")]
    ExternalUnnamed,
    #[error(
        "`{name}` was made against {ads}, and its recorded answers are not beside it: give the driving system with \
         `--ads`"
    )]
    NoAnswers { name: String, ads: String },
    #[error(
        "`{name}` was trained against an external driving system, which a policy does not name: `avastra run --policy` \
         plays it against the one that `--ads` names; its training cannot be looked at again"
    )]
    TrainedExternal { name: String },
    #[error("the recorded answers of `{name}`: {error}")]
    Answers { name: String, error: RecordError },
    #[error("`{name}` does not say which external driving system it was made against: {reason}")]
    Attached { name: String, reason: String },
    #[error(
        "`{scenario}` was made in world `{engine}`; this is `{ENGINE}`, where nothing need happen alike: \
         `avastra test --review` plays it here and says what differs"
    )]
    Engine { scenario: String, engine: String },
}

/// Why an external driving system is of no use, what to do, and the end of its standard error.
fn external_text(failure: &Failure) -> String {
    let mut text =
        format!("the driving system cannot be used: {}\n  {}", failure.in_words(), failure.problem.advice());
    for line in failure.stderr_lines(STDERR_LINES) {
        text.push_str(&format!("\n  | {line}"));
    }
    text
}

/// Lines of standard error that an error shows.
const STDERR_LINES: usize = 12;

/// Most episodes that a run may have on each road.
pub const EPISODES_MAX: u32 = 1_000_000;

/// The agent of that name.
///
/// # Errors
/// If there is none.
pub(crate) fn agent_named(name: &str) -> Result<&'static agent::Entry, RunError> {
    agent::by_name(name).ok_or_else(|| {
        let known: Vec<&str> = agent::REGISTRY.iter().map(|entry| entry.name).collect();
        let meant = nearest(name, known.iter().copied());
        let meant = meant.map_or(String::new(), |meant| format!("did you mean `{meant}`? "));
        RunError::Agent { name: name.to_owned(), meant, known: listed(&known) }
    })
}

/// Checks how many episodes a run is to play on each road.
///
/// # Errors
/// If it is none, or more than [`EPISODES_MAX`].
pub(crate) fn check_episodes(episodes: u32) -> Result<(), RunError> {
    let fits = (1..=EPISODES_MAX).contains(&episodes);
    if fits { Ok(()) } else { Err(RunError::Episodes { found: episodes }) }
}
