//! What is asked of the commands that take emitted scenarios, and maps.

use std::path::PathBuf;

use avastra_exchange::import::{VARIATIONS_MAX, VARIATIONS_USUAL};
use avastra_lang::model::REPLAYS_MAX;
use clap::{Args, ValueEnum};

use crate::cli::help::Named;

#[derive(Debug, Clone, Args)]
pub struct FilesArguments {
    /// Scenarios, as `avastra run` writes them; `replay` and `export --to ava` take policies, too; `shrink` takes the directory of a
    /// run: the worst finding of each kind that recurs.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Worker threads over files [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}

/// Another driving system than the one that scenarios were found with.
#[derive(Debug, Args)]
pub struct AgainstArguments {
    /// Driving system to play against: a name, a profile, or a command as `avastra run --ads` takes it [default: the one
    /// that each scenario was found with; one of your own by its recorded answers].
    #[arg(long, value_name = "NAME|FILE|COMMAND", value_parser = Named::ADS)]
    pub ads: Option<String>,
}

#[derive(Debug, Args)]
pub struct ReplayArguments {
    #[command(flatten)]
    pub against: AgainstArguments,
    /// Play each scenario up to N times more under other noise, and say of each finding whether it recurs.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=i64::from(REPLAYS_MAX)))]
    pub repeat: u32,
    /// Write what a driving system of your own was told and answered in one scenario, step by step, as lines of JSON. The program
    /// is not needed; with `--ads` it is asked, and its times and standard error are there, too.
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct DiagnoseArguments {
    #[command(flatten)]
    pub against: AgainstArguments,
    /// Profile that says how good each module should be [default: `modular` as it comes].
    #[arg(long, value_name = "FILE")]
    pub baseline: Option<PathBuf>,
    /// Look at `modular` as at any other driving system: change what it is told and what becomes of its commands, not its modules.
    #[arg(long, conflicts_with = "baseline")]
    pub outside: bool,
    /// Instead of causes, the moment of no return. It says how likely the finding was at each moment before
    /// it, and until when a careful driver could have avoided it. At each moment, branches begin under other noise.
    #[arg(long, conflicts_with_all = ["outside", "baseline"])]
    pub moment: bool,
    /// Write the moments around the rise into each file, as claims that `avastra replay` checks and `avastra report` draws.
    #[arg(long, requires = "moment")]
    pub write: bool,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct ShrinkArguments {
    /// Where to write, if there is one file [default: a folder `shrunk` beside the scenarios].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub against: AgainstArguments,
    /// Test in up to N plays under other noise whether what recurs still does; 0 to let that go [default: 20 if the scenario
    /// claims a recurrence, else 0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(REPLAYS_MAX)))]
    pub repeat: Option<u32>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct TriageArguments {
    /// Directories of runs and trainings.
    #[arg(required = true, value_name = "DIR")]
    pub directories: Vec<PathBuf>,
    /// The file of known failures: a list in YAML, each with a `name` and a rule over the facts of a finding (`where`).
    #[arg(long, value_name = "FILE")]
    pub known: PathBuf,
    /// Add each new kind to FILE. A file that is not there is begun.
    #[arg(long)]
    pub add: bool,
    /// Exit with status 4 if there is a new kind.
    #[arg(long)]
    pub fail_on_new: bool,
}

#[derive(Debug, Args)]
pub struct ExportArguments {
    /// What to write: `openscenario` (`.xosc`, with its map beside it), `commonroad` (XML 2020a), `csv` (a row for each
    /// road user and tick), or `ava`: copies of scenarios and policies with all that they use, in a folder that can be moved.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub to: ExportFormat,
    /// The folder to write to [default: a folder `exported` beside the scenarios].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The ego vehicle: it drives as recorded; by a controller `ads` of the player's (OpenSCENARIO); or the player has it, in
    /// CommonRoad as a planning problem, which is there in any case [default: `trajectory`, `none` for `commonroad`].
    #[arg(long, value_enum)]
    pub ego: Option<ExportEgo>,
    /// Other road users as actions that a person would write (speeds, lane changes, routes, triggers), which come near to
    /// the recording, instead of exact trajectories (OpenSCENARIO).
    #[arg(long)]
    pub natural: bool,
    /// The player that is to read it: `carla` is OpenSCENARIO 1.0 as CARLA's ScenarioRunner reads it, always natural; what it
    /// cannot say is told.
    #[arg(long, value_enum, value_name = "PLAYER")]
    pub profile: Option<ExportProfile>,
    #[command(flatten)]
    pub many: FilesArguments,
}

#[derive(Debug, Args)]
pub struct ImportArguments {
    /// OpenSCENARIO XML files (`.xosc`, 1.0 to 1.3) with their maps and catalogues where they name them.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The folder to write to [default: a folder `imported` beside the files].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The entity that is the ego vehicle [default: the one that is called so].
    #[arg(long, value_name = "NAME")]
    pub ego: Option<String>,
    /// Give a parameter that the file declares another value; may be given several times.
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Refuse a file with more variations than this, up to 60,000, which take up to 1 ms each.
    #[arg(long, value_name = "N", default_value_t = VARIATIONS_USUAL, value_parser = clap::value_parser!(u32).range(1..=i64::from(VARIATIONS_MAX)))]
    pub variations: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    Openscenario,
    Commonroad,
    Csv,
    Ava,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportEgo {
    Trajectory,
    Controller,
    None,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportProfile {
    Carla,
}

#[derive(Debug, Args)]
pub struct TestArguments {
    /// Scenarios, directories of them, and run directories.
    #[arg(required = true, value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// Let pass what crashes with another obstacle than its scenario says, or in a way that does not count.
    #[arg(long)]
    pub allow_changed: bool,
    /// Where space, rules, driving system or engine have changed: say of each scenario what differs in meaning.
    #[arg(long)]
    pub review: bool,
    /// The same, and write into the scenarios what is so now.
    #[arg(long)]
    pub accept: bool,
    #[command(flatten)]
    pub against: AgainstArguments,
    /// Play each scenario up to N times more under other noise: it is `fixed` once its rate of failures is certainly below
    /// `--below` [default: 20 with a program that is not deterministic, else 0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(REPLAYS_MAX)), conflicts_with_all = ["review", "accept"])]
    pub repeat: Option<u32>,
    /// The rate of failures below which a scenario is fixed, with 95 %.
    #[arg(long, value_name = "RATE", default_value_t = 0.1, value_parser = rate)]
    pub below: f64,
    /// Write the results as JUnit XML, too.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Worker threads over files [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}

/// A rate that a test can be sure of.
fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (0.001..=0.5).contains(&rate) => Ok(rate),
        _ => Err("a rate from 0.001 to 0.5 is due".to_owned()),
    }
}

#[derive(Debug, Args)]
pub struct ReportArguments {
    /// A directory that `run`, `train`, `study` or `estimate` wrote, or a folder of scenarios; or scenarios.
    #[arg(required = true, value_name = "DIR|FILE")]
    pub paths: Vec<PathBuf>,
    /// Where to write [default: DIR/report.html, STEM.html].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
    /// Another driving system, whose drives are shown beside: a name, a profile, or a command as `avastra run --ads` takes it.
    #[arg(long, value_name = "NAME|FILE|COMMAND", value_parser = Named::ADS)]
    pub ads: Option<String>,
    /// Heat maps of how actions ended by two parameters (`road` is one, too); may be given several times. A run of `every-row` has
    /// one by its two main parameters without it.
    #[arg(long, value_name = "PARAMETER[,PARAMETER]")]
    pub by: Vec<String>,
    /// Scenarios to show at most; one of each kind of failure comes first.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub most: u32,
    /// Worker threads [default: one for each core].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}

#[derive(Debug, Args)]
pub struct RenderArguments {
    /// The scenario.
    pub file: PathBuf,
    /// Moments to draw, in s since the start; several make a strip: `--at 2,9.5`.
    #[arg(long, value_delimiter = ',', value_name = "T", allow_negative_numbers = true)]
    pub at: Vec<f64>,
    /// What stands behind moments that a blank separates; it is refused with a hint.
    #[arg(hide = true)]
    pub rest: Vec<String>,
    /// A strip of five moments, the last at the first collision.
    #[arg(long, conflicts_with = "at")]
    pub strip: bool,
    /// Where to write [default: STEM.svg here; `-` is stdout].
    #[arg(long = "out", short = 'o')]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub against: AgainstArguments,
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
