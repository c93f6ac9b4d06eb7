//! What is asked of the commands that read and write the language.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::help::Named;

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
    /// Print the whole space as Markdown instead: actions, rules, states, with their documentation and what was proved of them.
    #[arg(long, conflicts_with_all = ["road", "try", "row"])]
    pub markdown: bool,
    /// Carry every row out on the road, or on all of them, without other traffic, and judge whether it does what it says.
    #[arg(long, group = "asked", conflicts_with = "row")]
    pub r#try: bool,
    #[command(flatten)]
    pub trials: TrialArguments,
    #[command(flatten)]
    pub why: WhyArguments,
}

#[derive(Debug, Args)]
pub struct TrialArguments {
    /// Tries of each row on each road, at most.
    #[arg(long, requires = "try", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub tries: u32,
    /// Driving system of the ego vehicle: a name, or a profile of `modular`.
    #[arg(long, requires = "try", value_name = "NAME|FILE", default_value = avastra_campaign::run::DEFAULT_ADS, value_parser = Named::ADS)]
    pub ads: String,
    /// Seed of the drives and tries.
    #[arg(long, requires = "try", default_value_t = 1, value_parser = super::seed)]
    pub seed: u64,
    /// Write one try of each row and road as a scenario, one that failed if there is any.
    #[arg(long, requires = "try", value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// A question about one row.
#[derive(Debug, Args)]
pub struct WhyArguments {
    /// Only the row of this number: whether it is legal at the start of the road (the first of the space if none is named), and
    /// which rule says no.
    #[arg(long, group = "asked")]
    pub row: Option<usize>,
    /// States at that moment, for example `time: Night, sky: { Rain: High }`.
    #[arg(long, requires = "row", conflicts_with = "try")]
    pub state: Option<String>,
    /// With `--row` or `--try`: switch a rule off; may be given several times.
    #[arg(long, requires = "asked", value_name = "RULE")]
    pub without: Vec<String>,
    /// With `--row` or `--try`: switch an optional rule on.
    #[arg(long, requires = "asked", value_name = "RULE")]
    pub with: Vec<String>,
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
pub struct NewArguments {
    /// Write an example instead, with the files that it uses.
    #[arg(long, value_name = "NAME", value_parser = crate::cli::new::template_names())]
    pub template: Option<String>,
    /// Take an OpenDRIVE map of your own: routes through its junctions are proposed, and the space drives them.
    #[arg(long, value_name = "FILE", conflicts_with = "template")]
    pub map: Option<PathBuf>,
    /// Made if need be; no file in it is replaced.
    pub directory: PathBuf,
}

#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
pub struct EditorFilesArguments {
    /// The folder of the extension.
    pub directory: PathBuf,
}
