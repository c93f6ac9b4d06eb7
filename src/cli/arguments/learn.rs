//! What is asked of the commands that train, explain and compare agents.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::drive::{ShardArguments, UnderTestArguments};
use super::language::RuleArguments;
use crate::cli::help::Named;

#[derive(Debug, Args)]
pub struct TrainArguments {
    /// The space.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// Road to drive; with several, episodes go round them [default: all of the space].
    #[arg(long)]
    pub road: Vec<String>,
    #[command(flatten)]
    pub under_test: UnderTestArguments,
    /// Who learns.
    #[arg(long, default_value = "ddqn", value_parser = Named::TRAINED)]
    pub agent: String,
    /// Settings to begin with, see docs/reference/settings.md; searches have none [default: the agent's first].
    #[arg(long, value_parser = Named::PRESET)]
    pub preset: Option<String>,
    /// Settings that differ from the preset, as YAML.
    #[arg(long, value_name = "YAML")]
    pub config: Option<PathBuf>,
    /// Episodes on all roads together.
    #[arg(long, default_value_t = 750, value_parser = clap::value_parser!(u32).range(1..=i64::from(avastra_campaign::run::EPISODES_MAX)))]
    pub episodes: u32,
    /// Train for so many simulated hours in place of a number of episodes.
    #[arg(long, value_name = "H", conflicts_with = "episodes")]
    pub hours: Option<f64>,
    /// Episodes on each road that judge what was learned; 0 for none, and then the policy claims nothing.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub evaluate: u32,
    /// Seed of the whole training.
    #[arg(long, default_value_t = 1, value_parser = super::seed)]
    pub seed: u64,
    /// How other vehicles drive: a name, or a profile like scenarios/traffic/careful.yaml [default: careful].
    #[arg(long, value_name = "NAME|FILE", value_parser = Named::TRAFFIC)]
    pub traffic: Option<String>,
    #[command(flatten)]
    pub rules: RuleArguments,
    /// Run directory, new or empty [default: the next free runs/NNNN].
    #[arg(long, short)]
    pub out: Option<PathBuf>,
    /// Put the space and its maps into `critical/space`, so that the scenarios can be moved with them.
    #[arg(long)]
    pub self_contained: bool,
    /// Go on with an interrupted run directory; its own settings hold, and the program that they name is started.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "road", "ads", "agent", "preset", "config", "episodes", "hours", "evaluate", "seed", "traffic", "out", "self_contained", "without", "with"])]
    pub resume: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct PolicyArguments {
    #[command(subcommand)]
    pub command: PolicyCommand,
}

#[derive(Debug, Subcommand)]
pub enum PolicyCommand {
    /// Say which rows it favours and when, what it expects of them, and which variables matter to it.
    Explain(ExplainPolicyArguments),
    /// Distil readable rules from its network once more, with other settings.
    Distil(DistilArguments),
    /// Write the weights of its network as safetensors, for other tools.
    Weights(WeightsArguments),
}

#[derive(Debug, Args)]
pub struct DistilArguments {
    /// The policy.
    pub file: PathBuf,
    /// Lines, at most [default: as the policy was trained with, like the others].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub leaves: Option<u32>,
    /// Episodes of a round, on each road.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub episodes: Option<u32>,
    /// Where to write [default: STEM.distilled.ava beside the file].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ExplainPolicyArguments {
    /// The policy.
    pub file: PathBuf,
    /// Values in place of the mean state's, for example `ego_speed: 12 m/s, time: Night`.
    #[arg(long)]
    pub state: Option<String>,
    /// Road to drive; may be given several times [default: those of the training].
    #[arg(long)]
    pub road: Vec<String>,
    /// Episodes on each road.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub episodes: u32,
    /// Seed of the episodes and of the shuffles.
    #[arg(long, default_value_t = 1, value_parser = super::seed)]
    pub seed: u64,
    /// Shuffles of each variable.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub repeats: u32,
}

#[derive(Debug, Args)]
pub struct WeightsArguments {
    /// The policy.
    pub file: PathBuf,
    /// Where to write [default: STEM.safetensors beside the file].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct StudyArguments {
    #[command(subcommand)]
    pub command: Option<StudyCommand>,
    /// The study, for example scenarios/studies/rq1.yaml.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// Driving system in place of the study's: a name, a profile, or a command as `avastra run --ads` takes it.
    #[arg(long, value_name = "NAME|FILE|COMMAND", value_parser = Named::ADS)]
    pub ads: Option<String>,
    /// Directory of the study, new or empty [default: the next free runs/NNNN].
    #[arg(long, short)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub shard: ShardArguments,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    /// Go on with an interrupted study; its own settings hold, and the program that they name is started.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "ads", "out", "shard", "dry_run", "quick"])]
    pub resume: Option<PathBuf>,
    /// Take over the cells that another study has played already: those of agents with the same settings, on the same
    /// roads, with the same seeds. The result is the same as without.
    #[arg(long, value_name = "DIR")]
    pub reuse: Vec<PathBuf>,
    /// Cut it down to see that it works: two short trainings, few episodes. No result.
    #[arg(long)]
    pub quick: bool,
}

#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Write what a folder of studies found as one Markdown file, beside published figures.
    Results(ResultsArguments),
}

#[derive(Debug, Args)]
pub struct ResultsArguments {
    /// Folder of studies; what was kept of playing `NAME.yaml` is `NAME.jsonl` beside it.
    #[arg(default_value = "scenarios/studies")]
    pub studies: PathBuf,
    /// Keep what a study's directory holds, finished or not, for the study that asks the same question.
    #[arg(long, value_name = "DIR")]
    pub add: Vec<PathBuf>,
    /// What avastra was built from when it played them.
    #[arg(long, requires = "add")]
    pub commit: Option<String>,
    /// Where to write.
    #[arg(long, short, default_value = "RESULTS.md")]
    pub out: PathBuf,
}
