//! The settings of an estimate in full, as `estimate.yaml` keeps them.

use crate::episode::{EpisodeLog, Setup};
use crate::run::{EpisodeSummary, RunError, RunSettings};

/// What is counted: whether it happens in an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A collision that the space's verdict counts.
    #[default]
    Counted,
    /// Any collision.
    Collision,
}

impl EventKind {
    /// Whether it is in an episode, judged by the settings of a run.
    pub(super) fn happened(self, setup: &Setup, log: &EpisodeLog, run: &RunSettings) -> bool {
        match self {
            EventKind::Collision => !log.collisions.is_empty(),
            EventKind::Counted => EpisodeSummary::judged(setup, 0, log, &run.avoidability).counted() > 0,
        }
    }

    /// The event in words.
    pub fn in_words(self) -> &'static str {
        match self {
            EventKind::Counted => "a counted collision",
            EventKind::Collision => "a collision",
        }
    }
}

/// How a probability is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Crude Monte Carlo.
    #[default]
    Count,
    /// Adaptive multilevel splitting.
    Split,
}

/// Everything that is needed to repeat an estimate; written to `estimate.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EstimateSettings {
    pub event: EventKind,
    pub method: Method,
    /// Independent parts on each road.
    pub parts: u32,
    /// Space, driving system, agent and conditions; `episodes` are those of a part.
    #[serde(flatten)]
    pub run: RunSettings,
}

/// Largest number of parts of a road. Ours.
const PARTS_MAX: u32 = 100_000;
/// A part that splits needs at least so many episodes. Ours: with fewer, most parts die out.
const SPLIT_EPISODES_MIN: u32 = 10;

/// Why an estimate cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error("{found} parts: from 2 to {PARTS_MAX} are possible")]
    Parts { found: u32 },
    #[error("{found} episodes a part: splitting needs at least {SPLIT_EPISODES_MIN}")]
    Episodes { found: u32 },
    #[error(
        "splitting goes on from moments in the middle of episodes, which a program of its own cannot do: estimate by \
         counting (`--method count`)"
    )]
    External,
    #[error(
        "splitting lets chance fall otherwise after a moment, and `{agent}` has looked at what comes after: estimate by \
         counting (`--method count`)"
    )]
    Ahead { agent: String },
}

impl EstimateSettings {
    /// # Errors
    /// If a number is out of range, or the method is not possible with this driving system.
    pub fn check(&self) -> Result<(), EstimateError> {
        if !(2..=PARTS_MAX).contains(&self.parts) {
            return Err(EstimateError::Parts { found: self.parts });
        }
        if self.method == Method::Split {
            if self.run.episodes < SPLIT_EPISODES_MIN {
                return Err(EstimateError::Episodes { found: self.run.episodes });
            }
            if self.run.external.is_some() {
                return Err(EstimateError::External);
            }
        }
        Ok(())
    }
}
