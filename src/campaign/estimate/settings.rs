//! The settings of an estimate in full, as `estimate.yaml` keeps them.

use crate::episode::{Breach, EpisodeLog, Setup};
use crate::oracle::Found;
use crate::run::{EpisodeSummary, RunError, RunSettings};
use avastra_lang::model::vocabulary::EVENTS;
use avastra_lang::model::{RulesInForce, Space};
use avastra_lang::syntax::{listed, nearest};

use crate::estimate::part::Part;
use crate::estimate::results::Probability;

/// The event of an estimate: either it happens in an episode or not. In words `counted`, `collision`, `breach`, or the name
/// of a requirement.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(from = "String", into = "String")]
pub enum EventKind {
    /// A collision that the space's verdict counts.
    #[default]
    Counted,
    /// Any collision.
    Collision,
    /// A breach of any requirement that is in force.
    Breach,
    /// A breach of the requirement of that name.
    Requirement(String),
}

impl From<String> for EventKind {
    fn from(word: String) -> EventKind {
        match word.as_str() {
            "counted" => EventKind::Counted,
            "collision" => EventKind::Collision,
            "breach" => EventKind::Breach,
            _ => EventKind::Requirement(word),
        }
    }
}

impl From<EventKind> for String {
    fn from(event: EventKind) -> String {
        match event {
            EventKind::Counted => "counted".to_owned(),
            EventKind::Collision => "collision".to_owned(),
            EventKind::Breach => "breach".to_owned(),
            EventKind::Requirement(name) => name,
        }
    }
}

impl EventKind {
    /// The first of the event in an episode.
    pub(super) fn first(&self, setup: &Setup, log: &EpisodeLog) -> Option<Found> {
        match self {
            EventKind::Collision if log.collisions.is_empty() => None,
            EventKind::Collision => Some(Found::Collision(0)),
            EventKind::Counted if log.collisions.is_empty() => None,
            EventKind::Counted => {
                let summary = EpisodeSummary::judged(setup, 0, log);
                summary.collisions.iter().position(|finding| finding.counted).map(Found::Collision)
            }
            EventKind::Breach | EventKind::Requirement(_) => self.first_breach(setup.table.space(), log),
        }
    }

    /// The first breach that is meant, if a requirement is.
    pub fn first_breach(&self, space: &Space, log: &EpisodeLog) -> Option<Found> {
        let is_meant = |breach: &Breach| match self {
            EventKind::Breach => true,
            EventKind::Requirement(name) => space.requirements[breach.requirement].name == *name,
            EventKind::Collision | EventKind::Counted => false,
        };
        log.breaches.iter().position(is_meant).map(Found::Breach)
    }

    /// Whether it is about a requirement.
    pub fn is_breach(&self) -> bool {
        matches!(self, EventKind::Breach | EventKind::Requirement(_))
    }

    /// The word behind the number of collisions, for example `met` in `3 collisions met`.
    pub fn noun(&self) -> &'static str {
        match self {
            EventKind::Counted => "counted",
            EventKind::Collision => "met",
            EventKind::Breach | EventKind::Requirement(_) => "breached",
        }
    }

    /// The event in words.
    pub fn in_words(&self) -> String {
        match self {
            EventKind::Counted => "a counted collision".to_owned(),
            EventKind::Collision => "a collision".to_owned(),
            EventKind::Breach => "a breach".to_owned(),
            EventKind::Requirement(name) => format!("a breach of `{name}`"),
        }
    }

    /// # Errors
    /// If it is about a requirement that is not in force.
    pub fn check(&self, space: &Space, rules: &RulesInForce) -> Result<(), EstimateError> {
        let in_force = || rules.required().map(|index| space.requirements[index].name.as_str());
        let known: Vec<&str> = in_force().collect();
        match self {
            EventKind::Counted | EventKind::Collision => Ok(()),
            EventKind::Breach if known.is_empty() => Err(EstimateError::NoRequirement),
            EventKind::Requirement(name) if !known.contains(&name.as_str()) => {
                let all: Vec<&str> = EVENTS.into_iter().chain(known).collect();
                let meant = nearest(name, all.iter().copied());
                let meant = meant.map_or(String::new(), |meant| format!("did you mean `{meant}`? "));
                Err(EstimateError::Event { name: name.clone(), meant, known: listed(&all) })
            }
            EventKind::Breach | EventKind::Requirement(_) => Ok(()),
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

/// When an estimate has played enough. It looks when a quarter, half and all of the parts are done, on every road. Results
/// between two looks do not count, so the result depends on no number of threads.
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
        "this method tries out the actions that make appear whom the ego vehicle hits; what makes it breach a requirement \
         cannot be told so: estimate by counting (`--method count`)"
    )]
    BreachProbed,
    #[error("no requirement of this space is in force, so none can be breached")]
    NoRequirement,
    #[error("no event `{name}`: {meant}there are {known}")]
    Event { name: String, meant: String, known: String },
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
        let roads = self.run.conditions.roads.len();
        (0..self.parts).flat_map(|number| (0..roads).map(move |road| Part { road, number })).collect()
    }

    /// The place of a part among all, which is its number in `estimate.db`.
    pub fn place(&self, part: Part) -> i64 {
        i64::from(part.number) * self.run.conditions.roads.len() as i64 + part.road as i64
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
        self.is_precise(found) || self.stopping.hours.is_some_and(|hours| found.simulated_h >= hours)
    }

    /// Whether a precision was wanted, and is reached.
    fn is_precise(&self, found: &Probability) -> bool {
        let half = half_width(found);
        self.stopping.precision.zip(half).is_some_and(|(share, half)| half <= share * found.probability)
    }

    /// Which goals were missed, in words, once nothing is left to play; none without goals.
    pub(super) fn missed_goals(&self, found: &Probability) -> Vec<String> {
        let Stopping { precision, hours } = self.stopping;
        // A precision that is reached stops it before.
        if self.is_precise(found) {
            return Vec::new();
        }
        let missed_precision = precision.map(|wanted| match half_width(found) {
            Some(half) if found.probability > 0.0 => {
                let reached = half / found.probability;
                format!("a precision of {wanted} was wanted, {reached:.2} is reached")
            }
            _ => format!("a precision of {wanted} was wanted, and the event was never met"),
        });
        let missed_hours = hours.filter(|&hours| found.simulated_h < hours).map(|hours| {
            format!("{hours} h were wanted, {:.2} h were simulated in all parts", found.simulated_h)
        });
        missed_precision.into_iter().chain(missed_hours).collect()
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
        if self.method != Method::Count && self.run.conditions.external.is_some() {
            return Err(EstimateError::External);
        }
        if self.method != Method::Count && self.event.is_breach() {
            return Err(EstimateError::BreachProbed);
        }
        Ok(())
    }
}

/// Half of the width of the interval of a probability; `None` where it has no upper end.
fn half_width(found: &Probability) -> Option<f64> {
    found.interval.high.map(|high| (high - found.interval.low) / 2.0)
}
