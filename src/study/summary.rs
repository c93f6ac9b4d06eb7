//! What an episode amounts to: its collisions, each with the facts of its verdict.

use crate::episode::Collision;
use crate::episode::EpisodeLog;
use crate::model::OutcomeFacts;
use crate::model::Space;
use crate::oracle;

/// An episode, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeSummary {
    /// Number of the episode in its run, from 0.
    pub episode: usize,
    pub collisions: Vec<Finding>,
}

/// A collision, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Index among the collisions of its episode.
    pub number: usize,
    pub collision: Collision,
    pub facts: OutcomeFacts,
    pub counted: bool,
}

impl EpisodeSummary {
    /// Judges every collision of a log by the space's verdict.
    pub fn new(space: &Space, episode: usize, log: &EpisodeLog) -> EpisodeSummary {
        let judge = |number: usize| {
            let facts = oracle::facts(log, number);
            Finding { number, collision: log.collisions[number], counted: space.counts(facts), facts }
        };
        EpisodeSummary { episode, collisions: (0..log.collisions.len()).map(judge).collect() }
    }

    /// Number of counted collisions.
    pub fn counted(&self) -> usize {
        self.collisions.iter().filter(|finding| finding.counted).count()
    }

    /// Time to the first counted collision (TTFC), s.
    pub fn first_counted_s(&self) -> Option<f64> {
        let counted = self.collisions.iter().find(|finding| finding.counted)?;
        Some(counted.collision.contact.time_s)
    }
}
