//! The settings of an estimate in full, as `estimate.yaml` keeps them.

use crate::episode::{EpisodeLog, Setup};
use crate::run::{EpisodeSummary, RunError, RunSettings};

use crate::estimate::part::Part;
use crate::estimate::results::Probability;

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
    /// The first collision of an episode that is the event.
    pub(super) fn first(self, setup: &Setup, log: &EpisodeLog) -> Option<usize> {
        match self {
            _ if log.collisions.is_empty() => None,
            EventKind::Collision => Some(0),
            EventKind::Counted => {
                let summary = EpisodeSummary::judged(setup, 0, log);
                summary.collisions.iter().position(|finding| finding.counted)
            }
        }
    }

    /// What so many of them are called, after their number.
    pub fn noun(self) -> &'static str {
        match self {
            EventKind::Counted => "counted",
            EventKind::Collision => "met",
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
    /// Importance sampling of rows: dangerous ones are tried out beside those that chance chooses.
    Probe,
}

/// Everything that is needed to repeat an estimate; written to `estimate.yaml`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EstimateSettings {
    pub event: EventKind,
    pub method: Method,
    /// Independent parts on each road.
    pub parts: u32,
    /// When to stop before all parts are played, if ever.
    #[serde(flatten)]
    pub stopping: Stopping,
    /// Space, driving system, agent and conditions; `episodes` are those of a part.
    #[serde(flatten)]
    pub run: RunSettings,
}

/// When an estimate has played enough. It looks when a quarter, half and all of the parts are done, on every road; what it
/// finds between two looks does not count, so the result depends on no number of threads.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Stopping {
    /// Stops when half the width of the interval is at most this share of the probability.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub precision: Option<f64>,
    /// Stops when so much was simulated, h.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hours: Option<f64>,
}

/// Share of estimates whose interval may miss the truth.
pub(super) const MISSING: f64 = 0.05;

/// An estimate that may stop looks when one part in so many is done. Ours.
const LOOKS: [u32; 3] = [4, 2, 1];

/// Largest number of parts of a road. Ours.
const PARTS_MAX: u32 = 100_000;

/// Why an estimate cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error("{found} parts: from 2 to {PARTS_MAX} are possible")]
    Parts { found: u32 },
    #[error("a precision of {found}: it is a share of the probability, above 0 and at most 1")]
    Precision { found: f64 },
    #[error("{found} hours: a limit above 0 is possible")]
    Hours { found: f64 },
    #[error(
        "this method goes on from moments in the middle of episodes, which a program of its own cannot do: estimate by \
         counting (`--method count`)"
    )]
    External,
    #[error(
        "`{agent}` does not say how likely it chooses a row, so what is tried out beside it has no weight: estimate by \
         counting (`--method count`), or with `--agent random`"
    )]
    NoChances { agent: String },
}

impl EstimateSettings {
    /// All parts: the first of every road before the second of any, so that an unfinished estimate says something
    /// about all roads.
    pub fn all_parts(&self) -> Vec<Part> {
        let roads = self.run.roads.len();
        (0..self.parts).flat_map(|number| (0..roads).map(move |road| Part { road, number })).collect()
    }

    /// The place of a part among all, which is its number in `estimate.db`.
    pub fn place(&self, part: Part) -> i64 {
        i64::from(part.number) * self.run.roads.len() as i64 + part.road as i64
    }

    /// The numbers of parts of a road after which it is looked whether to stop; all parts are the last.
    pub fn looks(&self) -> Vec<u32> {
        if self.stopping == Stopping::default() {
            return vec![self.parts];
        }
        let mut looks: Vec<u32> = LOOKS.iter().map(|share| self.parts.div_ceil(*share).max(2)).collect();
        looks.dedup();
        looks
    }

    /// Share in which the interval of one look may miss the truth, so that those of all looks together keep theirs
    /// (Bonferroni): whichever look the estimate stops at, its interval is valid.
    pub(super) fn missing_at_look(&self) -> f64 {
        MISSING / self.looks().len() as f64
    }

    /// Whether what was found so far is enough.
    pub fn is_enough(&self, found: &Probability) -> bool {
        let Stopping { precision, hours } = self.stopping;
        let half = found.interval.high.map(|high| (high - found.interval.low) / 2.0);
        let is_precise = precision.zip(half).is_some_and(|(share, half)| half <= share * found.probability);
        is_precise || hours.is_some_and(|hours| found.simulated_h >= hours)
    }

    /// # Errors
    /// If a number is out of range, or the method is not possible with this driving system.
    pub fn check(&self) -> Result<(), EstimateError> {
        if !(2..=PARTS_MAX).contains(&self.parts) {
            return Err(EstimateError::Parts { found: self.parts });
        }
        if let Some(found) = self.stopping.precision.filter(|share| !(*share > 0.0 && *share <= 1.0)) {
            return Err(EstimateError::Precision { found });
        }
        if let Some(found) = self.stopping.hours.filter(|hours| !(hours.is_finite() && *hours > 0.0)) {
            return Err(EstimateError::Hours { found });
        }
        if self.method != Method::Count && self.run.external.is_some() {
            return Err(EstimateError::External);
        }
        Ok(())
    }
}
