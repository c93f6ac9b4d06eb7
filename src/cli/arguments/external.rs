//! What is asked of `avastra ads`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

#[derive(Debug, Args)]
pub struct AdsArguments {
    #[command(subcommand)]
    pub command: AdsCommand,
}

#[derive(Debug, Subcommand)]
pub enum AdsCommand {
    /// Check that a driving system follows the protocol and gives equal answers to equal questions, and how fast it is.
    Check(AdsCheckArguments),
    /// Print the JSON Schema of every message.
    Schema,
    /// Be a small driving system that speaks the protocol over stdin and stdout, well or not.
    Toy(ToyArguments),
}

#[derive(Debug, Args)]
pub struct AdsCheckArguments {
    /// The driving system: its profile, a YAML file with an `ads` block; or the command that starts it, `tcp:HOST:PORT` or
    /// `unix:PATH`.
    #[arg(long, value_name = "FILE|COMMAND")]
    pub ads: String,
    /// The space whose first road it drives [default: a space of avastra's own].
    #[arg(long, value_name = "FILE")]
    pub space: Option<PathBuf>,
    /// Road to drive [default: the first of the space].
    #[arg(long)]
    pub road: Option<String>,
    /// Drive each road of the space N times alone and N times in light traffic, too, under the law, and say what is unfit.
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "2", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub drive: Option<u32>,
    /// Seed of the episodes.
    #[arg(long, default_value_t = 1, value_parser = super::seed)]
    pub seed: u64,
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
    /// A group of fields that it also wants.
    #[arg(long, value_name = "GROUP")]
    pub wants: Vec<String>,
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
    CrashBeforeReset,
    Hang,
    Garbage,
    Nan,
    Late,
    LateOnce,
    Twice,
    Early,
    WrongSeq,
    HugeLine,
    CloseStdout,
    FloodStderr,
    Error,
    Forgetful,
    Fickle,
}
