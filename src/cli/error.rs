//! Why a command failed, and the exit status that says so.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::estimate::EstimateError;
use avastra_campaign::run::RunError;

/// Every way in which a command can fail.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("{message}")]
    Usage { message: String },
    #[error("cannot {doing} `{}`: {reason}", path.shown())]
    File { doing: &'static str, path: PathBuf, reason: String },
    /// The diagnostics are on stderr already.
    #[error("{count} in the source", count = super::output::plural(*errors, "mistake"))]
    Source { errors: usize },
    #[error("{count} not formatted", count = super::output::plural(*files, "file"))]
    Unformatted { files: usize },
    #[error("{count} refuted", count = super::output::plural(*claims, "claim"))]
    Refuted { claims: usize },
    /// What the user asked a run to fail on.
    #[error("{what}")]
    Found { what: String },
    /// The external driving system is not the one that the campaign was begun with.
    #[error("{message}")]
    OtherProgram { message: String },
    /// A scenario whose space means something else now. The diagnostic is on stderr already.
    #[error("what it uses does not mean what it meant")]
    Outdated,
    #[error("{count} could not be played", count = super::output::plural(*scenarios, "scenario"))]
    NotPlayed { scenarios: usize, in_source: bool },
    /// An external driving system failed.
    #[error("the driving system failed {count}", count = super::output::plural(*findings, "time"))]
    Ads { findings: usize },
    /// An external driving system failed in replays, so that they do not say whether a finding recurs.
    #[error("the driving system failed in {count}", count = super::output::plural(*failed, "replay"))]
    Replays { failed: usize },
    /// Checks of an external driving system that it does not pass.
    #[error("{count} not passed", count = super::output::plural(*checks, "check"))]
    Unfit { checks: usize },
    /// An external driving system was given up: what was played is saved.
    #[error(
        "the driving system could not be reached again and again, so the rest was not played: {reason}\n  when it \
         answers, go on with `avastra {command} --resume {}`",
        super::output::for_shell(directory)
    )]
    Unreached { command: &'static str, directory: PathBuf, reason: String },
    #[error("{count} failing", count = super::output::plural(*scenarios, "scenario"))]
    Failing { scenarios: usize },
    /// Ctrl-C: this file, or some of several.
    #[error("interrupted: not done")]
    Stopped,
    /// Ctrl-C: what was done is saved.
    #[error("interrupted; go on with `avastra {command} --resume {}`", super::output::for_shell(directory))]
    Interrupted { command: &'static str, directory: PathBuf },
}

impl Failure {
    pub fn usage(message: impl ToString) -> Failure {
        Failure::Usage { message: message.to_string() }
    }

    pub fn file(doing: &'static str, path: &Path, reason: impl ToString) -> Failure {
        Failure::File { doing, path: path.to_owned(), reason: reason.to_string() }
    }

    /// Exit status, as documented in `--help`.
    pub fn status(&self) -> u8 {
        match self {
            Failure::Usage { .. } | Failure::File { .. } | Failure::NotPlayed { in_source: false, .. } => 1,
            Failure::Source { .. }
            | Failure::Unformatted { .. }
            | Failure::Outdated
            | Failure::OtherProgram { .. }
            | Failure::NotPlayed { in_source: true, .. } => 2,
            Failure::Refuted { .. } => 3,
            Failure::Found { .. } | Failure::Failing { .. } => 4,
            Failure::Ads { .. }
            | Failure::Replays { .. }
            | Failure::Unfit { .. }
            | Failure::Unreached { .. } => 5,
            // A shell reports this status for a process that SIGINT ended.
            Failure::Stopped | Failure::Interrupted { .. } => 130,
        }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Failure {
        match error {
            RunError::OtherProgram { .. } => Failure::OtherProgram { message: error.to_string() },
            _ => Failure::usage(error),
        }
    }
}

impl From<EstimateError> for Failure {
    fn from(error: EstimateError) -> Failure {
        match error {
            EstimateError::Run(error) => error.into(),
            _ => Failure::usage(error),
        }
    }
}
