//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use super::help::Named;

/// Finds out which of the things that may happen around a self-driving car make it crash.
#[derive(Debug, Parser)]
#[command(name = "avastra", version, max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub output: OutputArguments,
}

// Values have no help of their own, here and below: with any, clap prints every option in three lines.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Every command")]
pub struct OutputArguments {
    /// How to print.
    #[arg(long, global = true, value_enum, default_value_t = Format::Human)]
    pub format: Format,
    /// When to use colour.
    #[arg(long, global = true, value_enum, default_value_t = When::Auto, value_name = "WHEN")]
    pub color: When,
    /// Print results and errors only.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print all: whole lists, and notes about used files.
    #[arg(long, short, global = true)]
    pub verbose: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    Human,
    Plain,
    Json,
    Sarif,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum When {
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check files and list every mistake.
    Check(CheckArguments),
    /// Write the typed action table of a space, with masks per road.
    Compile(CompileArguments),
    /// Print the action table.
    Table(TableArguments),
    /// Say whether a row is legal here, and which rule says no.
    Why(WhyArguments),
    /// Format files in the one style.
    Fmt(FmtArguments),
    /// Say what a code like AV0101 means, or list all.
    Explain(ExplainArguments),
    /// Say how two spaces differ in rows, rules and draws.
    Diff(DiffArguments),
    /// Print a space as Markdown.
    Doc(DocArguments),
    /// Write a small space with its road, to begin with.
    New(NewArguments),
    /// Print a script by which a shell completes this command line.
    Completions(CompletionsArguments),
    /// Serve an editor: mistakes as you type, and all else that it asks for, over stdin and stdout.
    Lsp,
    /// Write the parts of the VS Code extension that follow from the language.
    #[command(hide = true)]
    EditorFiles(EditorFilesArguments),
    /// Play episodes and write the crashes back as scenarios.
    Run(RunArguments),
    /// Train an agent and write what it learned as a policy.
    Train(TrainArguments),
    /// Distil readable rules from a policy's network once more, with other settings.
    Distill(DistillArguments),
    /// Say which rows a policy favours and when, what it expects of them, and which variables matter to it.
    ExplainPolicy(ExplainPolicyArguments),
    /// Write the weights of a policy's network as safetensors, for other tools.
    ExportWeights(ExportWeightsArguments),
    /// Compare agents over roads and independent trainings, with statistics.
    Study(StudyArguments),
    /// Say how often a crash would happen: its probability in an episode and its rate, with intervals.
    Estimate(EstimateArguments),
    /// Play two driving systems in the same episodes and say which one crashes more often.
    Compare(CompareArguments),
    /// Run emitted scenarios again and check every claim they make.
    Replay(ReplayArguments),
    /// Check every claim of emitted scenarios and policies.
    Verify(VerifyArguments),
    /// Say which module of the driving system an emitted scenario's crash is the fault of.
    Diagnose(DiagnoseArguments),
    /// Find the smallest scenario that still makes the same crash.
    Shrink(ShrinkArguments),
    /// Copy scenarios and policies with all that they use into a folder that can be moved.
    Pack(PackArguments),
    /// Play emitted scenarios as a regression suite for a driving system.
    Test(TestArguments),
    /// Draw moments of an emitted scenario as SVG.
    Render(RenderArguments),
    /// Print or draw a map, and a route through it.
    Road(RoadArguments),
    /// Attach a driving system of your own: check it, print the schema of the messages, play with a toy.
    Ads(AdsArguments),
}

#[derive(Debug, Args)]
pub struct AdsArguments {
    #[command(subcommand)]
    pub command: AdsCommand,
}

#[derive(Debug, Subcommand)]
pub enum AdsCommand {
    /// Check that a driving system follows PROTOCOL.md, answers alike to the like, and how fast.
    Check(AdsCheckArguments),
    /// Print the JSON Schema of every message.
    Schema,
    /// Be a small driving system that speaks the protocol over stdin and stdout, well or not.
    Toy(ToyArguments),
}

#[derive(Debug, Args)]
pub struct AdsCheckArguments {
    /// The program and its arguments, after `--`; or `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(last = true, required_unless_present = "ads_config", value_name = "COMMAND")]
    pub program: Vec<String>,
    /// Its profile, with an `ads` block.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// The space whose first road it drives [default: a space of avastra's own].
    #[arg(long, value_name = "FILE")]
    pub space: Option<PathBuf>,
    /// Road to drive [default: the first of the space].
    #[arg(long)]
    pub road: Option<String>,
    /// Seed of the episodes.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Length of each of the four episodes, in steps of an agent (6 s), at most.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub steps: u32,
}

#[derive(Debug, Args)]
pub struct ToyArguments {
    /// The kind of its answers.
    #[arg(long, value_enum, default_value_t = ToyAnswer::Acceleration)]
    pub answer: ToyAnswer,
    /// Drive on whatever is in the way.
    #[arg(long)]
    pub blind: bool,
    /// What it does wrong, from the twentieth step on.
    #[arg(long, value_enum)]
    pub misbehave: Option<Misbehaviour>,
    /// How late it is, s, if it is late.
    #[arg(long, default_value_t = 3.0)]
    pub late: f64,
    /// The version that it says to be.
    #[arg(long, value_name = "VERSION", default_value = "1")]
    pub as_version: String,
    /// Say that it may answer otherwise when asked the same again.
    #[arg(long)]
    pub not_deterministic: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ToyAnswer {
    Control,
    Pedals,
    Trajectory,
    Acceleration,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Misbehaviour {
    CrashAtStart,
    CrashInEpisode,
    CrashAtReset,
    Hang,
    Garbage,
    Nan,
    Late,
    Twice,
    WrongSeq,
    HugeLine,
    CloseStdout,
    FloodStderr,
    Error,
    Forgetful,
}

#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Spaces, scenarios, policies.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// List each rule, the rows it binds and where it is enforced.
    #[arg(long)]
    pub audit: bool,
    /// Take warnings for errors.
    #[arg(long)]
    pub strict: bool,
    /// Print a stage of the pipeline as JSON.
    #[arg(long, value_enum)]
    pub dump: Option<Dump>,
    /// Make the changes that the diagnostics offer, in the files named here.
    #[arg(long)]
    pub fix: bool,
}

#[derive(Debug, Args)]
pub struct EditorFilesArguments {
    /// The folder of the extension.
    pub directory: PathBuf,
}

#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// A code, for example AV0401, or `json`: what `--format json` prints [default: list all].
    pub code: Option<String>,
}

#[derive(Debug, Args)]
pub struct DiffArguments {
    /// A space.
    pub old: PathBuf,
    /// The space that it became.
    pub new: PathBuf,
}

#[derive(Debug, Args)]
pub struct DocArguments {
    /// The space.
    pub file: PathBuf,
    /// Where to write [default: stdout].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct NewArguments {
    /// Write an example instead, with the files that it uses.
    #[arg(long, value_name = "NAME", value_parser = super::new::template_names())]
    pub template: Option<String>,
    /// Made if need be; no file in it is replaced.
    pub directory: PathBuf,
}

#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Dump {
    Ast,
    Actions,
}

#[derive(Debug, Args)]
pub struct CompileArguments {
    /// The space.
    pub file: PathBuf,
    /// Where to write the table [default: build/STEM.table.yaml].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct TableArguments {
    /// The space.
    pub file: PathBuf,
    /// Only what this road allows, with the reason where it does not.
    #[arg(long)]
    pub road: Option<String>,
    /// Carry every row out on the road, or on all of them, without other traffic, and judge whether it does what it says.
    #[arg(long)]
    pub r#try: bool,
    #[command(flatten)]
    pub trials: TrialArguments,
}

#[derive(Debug, Args)]
pub struct TrialArguments {
    /// Tries of each row on each road, at most.
    #[arg(long, requires = "try", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub tries: u32,
    /// Undisturbed drives of each road, from whose steps the tries set out.
    #[arg(long, requires = "try", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub drives: u32,
    /// Driving system of the ego vehicle.
    #[arg(long, requires = "try", default_value = crate::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
    /// Seed of the drives and tries.
    #[arg(long, requires = "try", default_value_t = 1)]
    pub seed: u64,
    /// Write one try of each row and road as a scenario, one that failed if there is any.
    #[arg(long, requires = "try", value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct WhyArguments {
    /// The space.
    pub file: PathBuf,
    /// Number of the row in the table.
    #[arg(long)]
    pub row: usize,
    /// Road of the question [default: the first of the space].
    #[arg(long)]
    pub road: Option<String>,
    /// States at that moment, for example `time: Night, sky: { Rain: High }`.
    #[arg(long)]
    pub state: Option<String>,
    #[command(flatten)]
    pub rules: RuleArguments,
}

#[derive(Debug, Args)]
pub struct FmtArguments {
    /// Files to rewrite; `-` reads stdin and writes stdout.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Change nothing; exit 2 if a file is not formatted.
    #[arg(long)]
    pub check: bool,
}

#[derive(Debug, Clone, Default, Args)]
pub struct RuleArguments {
    /// Switch a rule off; may be given several times.
    #[arg(long, value_name = "RULE")]
    pub without: Vec<String>,
    /// Switch an optional rule on.
    #[arg(long, value_name = "RULE")]
    pub with: Vec<String>,
}

#[derive(Debug, Args)]
pub struct RunArguments {
    /// The space [default: the one compiled last here].
    pub file: Option<PathBuf>,
    /// Road to drive; may be given several times [default: all of the space].
    #[arg(long)]
    pub road: Vec<String>,
    /// Driving system under test.
    #[arg(long, default_value = crate::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
    /// Profile of the `modular` driving system, for example scenarios/ads/cautious.yaml, or of one of your own, with an
    /// `ads` block [default: as it comes].
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
    /// Who chooses the actions.
    #[arg(long, default_value = "random", value_parser = Named::AGENT)]
    pub agent: String,
    /// Let a trained policy choose them; without FILE on its own space.
    #[arg(long, value_name = "POLICY", conflicts_with = "agent")]
    pub policy: Option<PathBuf>,
    /// Which face of the policy acts: its network, or the rules distilled from it.
    #[arg(long, value_enum, requires = "policy", default_value_t = FaceArgument::Network)]
    pub face: FaceArgument,
    /// Episodes on each road.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=i64::from(crate::run::EPISODES_MAX)))]
    pub episodes: u32,
    /// Seed of the whole run.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Vehicles of ambient traffic around the ego vehicle, besides those that actions make appear.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(crate::model::AMBIENT_MAX)))]
    pub ambient: u32,
    /// How other vehicles drive: a name, or a profile like scenarios/traffic/careful.yaml [default: careful].
    #[arg(long, value_name = "NAME|FILE", value_parser = Named::TRAFFIC)]
    pub traffic: Option<String>,
    /// Say of each counted collision which module of the driving system is at fault; takes some twenty
    /// replays for each.
    #[arg(long)]
    pub causes: bool,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    #[command(flatten)]
    pub rules: RuleArguments,
    /// Run directory, new or empty [default: the next free runs/NNNN].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Put the space and its maps into `critical/space`, so that the scenarios can be moved with them.
    #[arg(long)]
    pub self_contained: bool,
    /// Go on with an interrupted run directory; its own settings hold.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "road", "ads", "ads_config", "ads_cmd", "agent", "policy", "face", "episodes", "seed", "ambient", "traffic", "causes", "out", "self_contained", "without", "with"])]
    pub resume: Option<PathBuf>,
    /// Exit with status 4 if a counted collision was found.
    #[arg(long)]
    pub fail_on_collision: bool,
}

#[derive(Debug, Args)]
pub struct EstimateArguments {
    /// The space.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// What is looked for in an episode.
    #[arg(long, value_enum, default_value_t = EventArgument::Counted)]
    pub event: EventArgument,
    /// How: `count` plays every episode from its start, `split` goes on from dangerous moments (unbiased, and says what it gained or lost).
    #[arg(long, value_enum, default_value_t = MethodArgument::Count)]
    pub method: MethodArgument,
    /// Independent parts on each road; the interval of `split` comes from their spread, so give it twenty or more.
    #[arg(long, default_value_t = 20)]
    pub parts: u32,
    /// Episodes of a part.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=i64::from(crate::run::EPISODES_MAX)))]
    pub episodes: u32,
    /// Driving system under test.
    #[arg(long, default_value = crate::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
    /// Profile of the `modular` driving system, or of one of your own, with an `ads` block [default: as it comes].
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
    #[command(flatten)]
    pub conditions: ConditionArguments,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    /// Directory, new or empty [default: the next free runs/NNNN].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Go on with an interrupted estimate; its own settings hold.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "event", "method", "parts", "episodes", "ads", "ads_config", "ads_cmd", "road", "agent", "seed", "ambient", "traffic", "out", "without", "with"])]
    pub resume: Option<PathBuf>,
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
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Vehicles of ambient traffic around the ego vehicle, besides those that actions make appear.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(crate::model::AMBIENT_MAX)))]
    pub ambient: u32,
    /// How other vehicles drive: a name, or a profile like scenarios/traffic/careful.yaml [default: careful].
    #[arg(long, value_name = "NAME|FILE", value_parser = Named::TRAFFIC)]
    pub traffic: Option<String>,
    #[command(flatten)]
    pub rules: RuleArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EventArgument {
    Counted,
    Collision,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodArgument {
    Count,
    Split,
}

#[derive(Debug, Args)]
pub struct CompareArguments {
    /// The space.
    pub file: PathBuf,
    /// The first driving system: a name like `modular`, or a profile like scenarios/ads/default.yaml (of one of your own,
    /// with an `ads` block).
    pub first: String,
    /// The second one, likewise.
    pub second: String,
    /// What is looked for in an episode.
    #[arg(long, value_enum, default_value_t = EventArgument::Counted)]
    pub event: EventArgument,
    /// Episodes on each road.
    #[arg(long, default_value_t = 250, value_parser = clap::value_parser!(u32).range(1..=i64::from(crate::run::EPISODES_MAX)))]
    pub episodes: u32,
    #[command(flatten)]
    pub conditions: ConditionArguments,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}

#[derive(Debug, Args)]
pub struct TrainArguments {
    /// The space.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// Road to drive; with several, episodes go round them [default: all of the space].
    #[arg(long)]
    pub road: Vec<String>,
    /// Driving system under test.
    #[arg(long, default_value = crate::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
    /// Profile of the `modular` driving system, or of one of your own [default: as it comes].
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
    /// Who learns.
    #[arg(long, default_value = "ddqn", value_parser = Named::TRAINED)]
    pub agent: String,
    /// Settings to begin with; searches have none [default: the agent's first].
    #[arg(long, value_parser = Named::PRESET)]
    pub preset: Option<String>,
    /// Settings that differ from the preset, as YAML.
    #[arg(long, value_name = "YAML")]
    pub config: Option<PathBuf>,
    /// Episodes on all roads together.
    #[arg(long, default_value_t = 750, value_parser = clap::value_parser!(u32).range(1..=i64::from(crate::run::EPISODES_MAX)))]
    pub episodes: u32,
    /// Seed of the whole training.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How other vehicles drive: a name, or a profile like scenarios/traffic/careful.yaml [default: careful].
    #[arg(long, value_name = "NAME|FILE", value_parser = Named::TRAFFIC)]
    pub traffic: Option<String>,
    #[command(flatten)]
    pub rules: RuleArguments,
    /// Run directory, new or empty [default: the next free runs/NNNN].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Put the space and its maps into `critical/space`, so that the scenarios can be moved with them.
    #[arg(long)]
    pub self_contained: bool,
    /// Go on with an interrupted run directory; its own settings hold.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "road", "ads", "ads_config", "ads_cmd", "agent", "preset", "config", "episodes", "seed", "traffic", "out", "self_contained", "without", "with"])]
    pub resume: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FaceArgument {
    Network,
    Rules,
}

#[derive(Debug, Args)]
pub struct DistillArguments {
    /// The policy.
    pub file: PathBuf,
    /// Lines, at most [default: as the policy was trained with, like the others].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub leaves: Option<u32>,
    /// Tests that a line may take, at most.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=32))]
    pub depth: Option<u32>,
    /// Rounds; the rules of each drive the next.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: Option<u32>,
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
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Shuffles of each variable.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub repeats: u32,
}

#[derive(Debug, Args)]
pub struct ExportWeightsArguments {
    /// The policy.
    pub file: PathBuf,
    /// Where to write [default: STEM.safetensors beside the file].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct StudyArguments {
    /// The study, for example scenarios/studies/rq1.yaml.
    #[arg(required_unless_present = "resume")]
    pub file: Option<PathBuf>,
    /// Driving system of your own in place of the study's: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND")]
    pub ads_cmd: Option<String>,
    /// Directory of the study, new or empty [default: the next free runs/NNNN].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Worker threads; the result does not depend on it [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
    /// Go on with an interrupted study; its own settings hold.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["file", "ads_cmd", "out", "quick"])]
    pub resume: Option<PathBuf>,
    /// Cut it down to see that it works: two short trainings, few episodes. No result.
    #[arg(long)]
    pub quick: bool,
}

#[derive(Debug, Clone, Args)]
pub struct FilesArguments {
    /// Scenarios, as `avastra run` writes them; `verify` takes policies, too.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Worker threads over files [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}

#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// Driving system of your own that the scenarios were made against, to be asked anew: a command (PROTOCOL.md),
    /// `tcp:HOST:PORT` or `unix:PATH` [default: its recorded answers].
    #[arg(long, value_name = "COMMAND")]
    pub ads_cmd: Option<String>,
    /// Its profile, with an `ads` block.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// Replay against another driving system: shows what happens, checks no claim.
    #[arg(long, value_parser = Named::ADS)]
    pub ads: Option<String>,
    /// Replay against another profile of `modular`, or of a driving system of your own: claims are checked only if it
    /// means the same as the recorded one.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct DiagnoseArguments {
    /// Another profile of `modular` than the recorded one. Only `modular` is made of modules that can be told apart.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Profile that says how good each module should be [default: `modular` as it comes].
    #[arg(long, value_name = "FILE", conflicts_with = "mechanisms")]
    pub baseline: Option<PathBuf>,
    /// Say also how many of N small variations of timing, speeds and sensor errors still crash.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with = "mechanisms")]
    pub likelihood: Option<u32>,
    /// Instead of modules, the documented weaknesses: the share of the collisions of all files
    /// that vanish when one alone is switched off as the obstacle appears, beside the share that other sensor noise
    /// alone makes vanish.
    #[arg(long)]
    pub mechanisms: bool,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct ShrinkArguments {
    /// Where to write, if there is one file [default: a folder `shrunk` beside the scenarios].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
    /// Driving system of your own that the scenarios were made against: a command (PROTOCOL.md), `tcp:HOST:PORT` or
    /// `unix:PATH`.
    #[arg(long, value_name = "COMMAND")]
    pub ads_cmd: Option<String>,
    /// Its profile, with an `ads` block.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct PackArguments {
    /// Scenarios and policies.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The folder that they are copied to.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct TestArguments {
    /// Scenarios, directories of them, and run directories.
    #[arg(required = true, value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// Let pass what crashes with another obstacle, or is hit from another side, than its scenario says.
    #[arg(long)]
    pub allow_changed: bool,
    /// Where the space has changed, take the change over into the scenarios that still play as they claim.
    #[arg(long)]
    pub accept: bool,
    /// Driving system under test [default: the one that each scenario was found with].
    #[arg(long, value_parser = Named::ADS)]
    pub ads: Option<String>,
    /// Profile of the `modular` driving system, or of one of your own.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
    /// Write the results as JUnit XML, too.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct RenderArguments {
    /// The scenario.
    pub file: PathBuf,
    /// Moments to draw, in s since the start; several make a strip.
    #[arg(long, value_delimiter = ',', value_name = "T", allow_negative_numbers = true)]
    pub at: Vec<f64>,
    /// A strip of the six seconds up to the first collision.
    #[arg(long, conflicts_with = "at")]
    pub strip: bool,
    /// Where to write [default: STEM.svg here; `-` is stdout].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
    /// Draw the drive of another driving system.
    #[arg(long, value_parser = Named::ADS)]
    pub ads: Option<String>,
    /// Draw the drive of another profile of `modular`, or of a driving system of your own.
    #[arg(long, value_name = "FILE")]
    pub ads_config: Option<PathBuf>,
    /// Driving system of your own: a command (PROTOCOL.md), `tcp:HOST:PORT` or `unix:PATH`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "ads")]
    pub ads_cmd: Option<String>,
}

#[derive(Debug, Args)]
pub struct RoadArguments {
    /// An OpenDRIVE map, or a space (`.ava`) whose road is meant.
    pub file: PathBuf,
    /// Road of the space [default: its first].
    #[arg(long)]
    pub road: Option<String>,
    /// Where a route starts, for example `1/-1@12.5`: road, lane, station of the road in m.
    #[arg(long, value_name = "PLACE", requires = "to", allow_hyphen_values = true)]
    pub from: Option<String>,
    /// Where it ends.
    #[arg(long, value_name = "PLACE", requires = "from", allow_hyphen_values = true)]
    pub to: Option<String>,
    /// Draw it to a file as well; `-` is stdout, and nothing else is printed.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}
