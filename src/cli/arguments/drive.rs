//! What is asked of the commands that play episodes: who drives, under which conditions, how many.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::language::RuleArguments;
use crate::cli::help::Named;
use avastra_campaign::estimate::Method;
use avastra_campaign::oracle::REPLAYS;
use avastra_campaign::run::Shard;
use avastra_search::agent::Face;

/// The driving system under test.
#[derive(Debug, Args)]
pub struct UnderTestArguments {
    /// Driving system under test: a name; a profile of `modular` or of a program of your own, a YAML file; a command
    /// that starts your own, `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "NAME|FILE|COMMAND", default_value = avastra_campaign::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
}

/// Which piece of a run, a study or an estimate is played.
#[derive(Debug, Args)]
pub struct ShardArguments {
    /// Play one of N pieces of it, on a machine of its own; `avastra merge` brings them together [default: as a Slurm array or a
    /// Kubernetes Indexed Job says, else all].
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Play nothing and write nothing: say what would be played, and into how many shards it can be cut.
    #[arg(long)]
    pub dry_run: bool,
}

/// The conditions of episodes besides space and driving system.
#[derive(Debug, Args)]
pub struct ConditionArguments {
    /// Road to drive; may be given several times [default: all of the space].
    #[arg(long)]
    pub road: Vec<String>,
    /// Who chooses the actions.
    #[arg(long, default_value = "random", value_parser = Named::AGENT)]
    pub agent: String,
    /// Seed of everything.
    #[arg(long, default_value_t = 1, value_parser = super::seed)]
    pub seed: u64,
    /// Vehicles of ambient traffic around the ego vehicle, besides those that actions make appear.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(avastra_lang::model::AMBIENT_MAX)))]
    pub ambient: u32,
    /// How other vehicles drive: a name, or a profile like scenarios/traffic/careful.yaml [default: careful].
    #[arg(long, value_name = "NAME|FILE", value_parser = Named::TRAFFIC)]
    pub traffic: Option<String>,
    #[command(flatten)]
    pub rules: RuleArguments,
}

#[derive(Debug, Args)]
pub struct RunArguments {
    /// The space [default: the one compiled last here].
    pub file: Option<PathBuf>,
    /// Driving system under test: a name; a profile of `modular` or of a program of your own, a YAML file; a command
    /// that starts your own, `tcp:HOST:PORT` or `unix:PATH` [default: modular, or that of the policy].
    #[arg(long, value_name = "NAME|FILE|COMMAND", value_parser = Named::ADS)]
    pub ads: Option<String>,
    #[command(flatten)]
    pub conditions: ConditionArguments,
    /// Let a trained policy choose the actions. It plays as it was trained: on its space and roads, against its driving system and
    /// traffic, with its rules. What you name takes their place.
    #[arg(long, value_name = "POLICY", conflicts_with = "agent")]
    pub policy: Option<PathBuf>,
    /// Which face of the policy acts: its network, or the rules distilled from it.
    #[arg(long, requires = "policy", default_value = "network", value_parser = one_of::<Face>(["network", "rules"]))]
    pub face: Face,
    /// Episodes on each road, of `every-row` of each row on each [default: 100, of `every-row` 1].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=i64::from(avastra_campaign::run::EPISODES_MAX)))]
    pub episodes: Option<u32>,
    /// Play for this much simulated time, in hours, in place of a number of episodes. The roads are driven by turns, and it ends after
    /// four rounds, or eight, and so on.
    #[arg(long, value_name = "H", conflicts_with_all = ["episodes", "dry_run"])]
    pub hours: Option<f64>,
    /// Stop sooner: once the chance that an hour more shows a new kind of failure is at most this, by the upper end of its
    /// 90 % interval.
    #[arg(long, value_name = "CHANCE", requires = "hours")]
    pub until: Option<f64>,
    /// Say of each counted collision which module of the driving system is at fault; takes some twenty
    /// replays for each.
    #[arg(long)]
    pub causes: bool,
    /// Play each finding up to N times more with other sensor errors, and others who react a little sooner or later, to say
    /// whether it recurs; 0 for never. It stops once that is certain.
    #[arg(long = "repeat", value_name = "N", default_value_t = REPLAYS, value_parser = clap::value_parser!(u32).range(0..=i64::from(avastra_lang::model::REPLAYS_MAX)))]
    pub replays: u32,
    /// Keep N episodes in which nothing was found as scenarios in `kept`, too. First come those with a collision that does not
    /// count, then those that did not arrive, then the nearest misses [default: 3 if a run of an embedded driving system found
    /// nothing, else 0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub keep: Option<u32>,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    /// Run directory, new or empty [default: the next free runs/NNNN].
    #[arg(long, short)]
    pub out: Option<PathBuf>,
    /// Put the space and its maps into `critical/space`, so that the scenarios can be moved with them.
    #[arg(long)]
    pub self_contained: bool,
    #[command(flatten)]
    pub shard: ShardArguments,
    /// Go on with an interrupted run directory; its own settings hold, and the program that they name is started.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "road", "ads", "agent", "policy", "face", "episodes", "hours", "until", "seed", "ambient", "traffic", "causes", "replays", "keep", "out", "self_contained", "shard", "dry_run", "without", "with"])]
    pub resume: Option<PathBuf>,
    /// Exit with status 4 if this was found: `recurring` (a counted collision or a breach that recurs), `collision` (any that
    /// counts), `breach` (any), `stalled` (an episode that stalled without a collision). With it, a failure of a
    /// driving system of your own in any episode exits with status 5.
    #[arg(long, value_name = "WHAT", value_enum, value_delimiter = ',')]
    pub fail_on: Vec<FailOn>,
}

/// What a continuous build fails on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FailOn {
    Recurring,
    Collision,
    Breach,
    Stalled,
}

#[derive(Debug, Args)]
pub struct EstimateArguments {
    /// The space.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// What is looked for in an episode: `counted` (a collision that the space counts), `collision` (any), `breach` (of any
    /// requirement), or the name of a requirement.
    #[arg(long, value_name = "EVENT", default_value = "counted")]
    pub event: String,
    /// How: `count` plays every episode from its start; `probe` tries dangerous rows out beside those that chance chooses, each
    /// with its weight, which pays where a crash comes in fewer than one of a hundred episodes or so, and says what it
    /// gained or lost. Both are unbiased with a fixed number of parts.
    #[arg(long, default_value = "count", value_parser = one_of::<Method>(["count", "probe"]))]
    pub method: Method,
    /// Independent parts on each road, at most.
    #[arg(long, default_value_t = 20)]
    pub parts: u32,
    /// Episodes of a part [default: 50; with `--than`, 250 on each road].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=i64::from(avastra_campaign::run::EPISODES_MAX)))]
    pub episodes: Option<u32>,
    /// Stop when half the width of the interval is at most this share of the probability; looks when a quarter, half and all
    /// parts are done. The interval allows for the looks; the probability itself gets a small bias.
    #[arg(long, value_name = "SHARE")]
    pub precision: Option<f64>,
    /// Stop, at such a look, when so many hours were simulated. Holds the interval and biases the probability likewise.
    #[arg(long, value_name = "H")]
    pub hours: Option<f64>,
    #[command(flatten)]
    pub under_test: UnderTestArguments,
    /// Play this driving system, too, in the same episodes, and say which of the two crashes more often; nothing is kept.
    #[arg(long, value_name = "NAME|FILE|COMMAND", value_parser = Named::ADS, conflicts_with_all = ["method", "parts", "precision", "hours", "out", "shard", "dry_run"])]
    pub than: Option<String>,
    #[command(flatten)]
    pub conditions: ConditionArguments,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    /// Directory, new or empty [default: the next free runs/NNNN].
    #[arg(long, short)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub shard: ShardArguments,
    /// Go on with an interrupted estimate; its own settings hold, and the program that they name is started.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "event", "method", "parts", "precision", "hours", "episodes", "ads", "than", "road", "agent", "seed", "ambient", "traffic", "out", "shard", "dry_run", "without", "with"])]
    pub resume: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Directories of shards of one run, study or estimate, in any order.
    #[arg(required = true, value_name = "DIR")]
    pub directories: Vec<PathBuf>,
    /// The directory of the whole, new or empty.
    #[arg(long, short, value_name = "DIR", required_unless_present = "missing")]
    pub out: Option<PathBuf>,
    /// Write nothing; print the numbers of the shards that are to be run again, or gone on with.
    #[arg(long, conflicts_with = "out")]
    pub missing: bool,
}

/// Parses the words by which a type is written in settings, too.
fn one_of<T>(words: [&'static str; 2]) -> impl TypedValueParser<Value = T>
where
    T: serde::de::DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(words)
        .map(|word| serde_json::from_value(word.into()).expect("the type has these words"))
}
