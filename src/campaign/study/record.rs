//! The record of a job: every evaluated episode with its collisions, and the learning curve.

use std::collections::BTreeSet;

use crate::episode::EpisodeLog;
use crate::oracle;
use crate::run::{EpisodeSummary, Finding, kind};
use crate::train::TrainedEpisode;
use avastra_lang::model::vocabulary::Word;

/// The result of one training or one repetition of an agent, on one road.
#[derive(Debug, Clone, PartialEq)]
pub struct CellRecord {
    /// Label of the agent.
    pub agent: String,
    pub road: String,
    /// Number of the training or repetition, from 0.
    pub number: u32,
    /// The seed for `avastra train --seed`, if it was trained.
    pub training_seed: Option<u64>,
    /// The training, episode by episode; of an agent that does not learn, what it searched before it was judged.
    pub trained: Vec<TrainedRecord>,
    /// All evaluated episodes, seed by seed.
    pub episodes: Vec<EpisodeRecord>,
    /// The kinds of failures that recur, among all that it found.
    pub kinds: BTreeSet<String>,
    /// `None` if it is not known; `study.db` does not keep it.
    pub spent: Option<Spent>,
}

/// Time that a cell took on this machine; no part of the result.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Spent {
    pub wall_s: f64,
    /// Processor time of the thread, s, where the system tells.
    pub cpu_s: Option<f64>,
}

/// An episode of a training.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedRecord {
    pub ended: String,
    /// Sum of its rewards, not discounted.
    pub sum: f64,
    pub collisions: u32,
    /// Collisions that the verdict counts.
    pub counted: u32,
    pub exploration_epsilon: f64,
    pub loss: Option<f64>,
    /// Time simulated for it, s.
    pub simulated_s: f64,
}

/// An evaluated episode.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeRecord {
    /// The seed for `avastra run --seed`: that of the evaluation, not of the episode.
    pub seed: u64,
    /// Number of the episode under that seed.
    pub number: u32,
    pub ended: String,
    pub duration_s: f64,
    pub distance_m: f64,
    pub red_runs: u32,
    /// Time above the speed limit, s.
    pub speeding_s: f64,
    /// Time beside the lane, s.
    pub astray_s: f64,
    pub collisions: Vec<CollisionRecord>,
    /// Digest of the trace.
    pub trace: String,
}

/// A collision of an evaluated episode.
#[derive(Debug, Clone, PartialEq)]
pub struct CollisionRecord {
    pub time_s: f64,
    pub counted: bool,
    pub repeated: bool,
    pub sudden: bool,
    pub struck: bool,
    pub avoidability: String,
    /// The road user that had priority: `ego`, `other` or `none`.
    pub priority: String,
    pub failure: FailureClass,
}

/// The features that similar collisions have in common: as in the groups of a run (see `run::groups`), but without the
/// shape of the ego vehicle's way.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct FailureClass {
    /// `pedestrian`, `car` or `large vehicle`.
    pub kind: String,
    /// The obstacle's verb.
    pub manoeuvre: String,
    /// How the obstacle moved.
    pub approach: String,
    /// Where the ego vehicle was hit.
    pub side: String,
    /// Modules at fault, if they were looked for; empty if none was found.
    pub cause: Option<String>,
}

impl TrainedRecord {
    pub fn new(episode: &TrainedEpisode) -> TrainedRecord {
        TrainedRecord {
            ended: episode.log.end.name().to_owned(),
            sum: episode.sum,
            collisions: episode.log.collisions.len() as u32,
            counted: episode.summary.counted() as u32,
            exploration_epsilon: episode.exploration_epsilon,
            loss: episode.lesson.loss,
            simulated_s: episode.simulated_s,
        }
    }
}

impl TrainedRecord {
    /// Of an agent that does not learn: it is paid nothing.
    pub fn of_search(summary: &EpisodeSummary, log: &EpisodeLog) -> TrainedRecord {
        TrainedRecord {
            ended: log.end.name().to_owned(),
            sum: 0.0,
            collisions: log.collisions.len() as u32,
            counted: summary.counted() as u32,
            exploration_epsilon: 1.0,
            loss: None,
            simulated_s: log.duration_s,
        }
    }
}

impl EpisodeRecord {
    /// `seed` is that of the evaluation.
    pub fn new(seed: u64, summary: &EpisodeSummary, log: &EpisodeLog) -> EpisodeRecord {
        EpisodeRecord {
            seed,
            number: summary.episode as u32,
            ended: log.end.name().to_owned(),
            duration_s: log.duration_s,
            distance_m: log.distance_m,
            red_runs: log.red_runs,
            speeding_s: summary.manners.speeding_s,
            astray_s: summary.manners.astray_s,
            collisions: summary.collisions.iter().map(CollisionRecord::new).collect(),
            trace: avastra_lang::model::digest_text(&log.trace()),
        }
    }

    pub fn counted(&self) -> usize {
        self.collisions.iter().filter(|collision| collision.counted).count()
    }

    /// Time of the first counted collision, s.
    pub fn first_counted_s(&self) -> Option<f64> {
        self.collisions.iter().find(|collision| collision.counted).map(|collision| collision.time_s)
    }
}

impl CollisionRecord {
    fn new(finding: &Finding) -> CollisionRecord {
        let severity = oracle::severity(&finding.collision);
        CollisionRecord {
            time_s: finding.collision.contact.time_s,
            counted: finding.counted,
            repeated: finding.facts.repeated,
            sudden: finding.facts.sudden,
            struck: finding.facts.struck,
            avoidability: finding.judgement.class.name().to_owned(),
            priority: finding.facts.priority.name().to_owned(),
            failure: FailureClass {
                kind: kind(finding.collision.body.like.name()).to_owned(),
                manoeuvre: finding.collision.verb.name().to_owned(),
                approach: severity.approach.to_owned(),
                side: severity.side.to_owned(),
                cause: finding.cause_in_words(),
            },
        }
    }
}
