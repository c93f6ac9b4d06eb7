//! What an episode amounts to: its collisions, each with the facts of its verdict.

use crate::episode::Collision;
use crate::episode::EpisodeLog;
use crate::model::OutcomeFacts;
use crate::model::Space;
use crate::oracle;
use crate::oracle::Judgement;

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
    pub judgement: Judgement,
    pub counted: bool,
}

impl EpisodeSummary {
    /// Applies the space's verdict to every collision of a log; `judgements` has one for each.
    pub fn new(
        space: &Space,
        episode: usize,
        log: &EpisodeLog,
        judgements: Vec<Judgement>,
    ) -> EpisodeSummary {
        let find = |(number, judgement)| {
            let facts = oracle::facts(log, number, &judgement);
            let counted = space.counts(facts);
            Finding { number, collision: log.collisions[number], facts, judgement, counted }
        };
        EpisodeSummary { episode, collisions: judgements.into_iter().enumerate().map(find).collect() }
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
