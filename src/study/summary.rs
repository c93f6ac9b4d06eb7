//! What an episode amounts to: its collisions, each with the facts of its verdict.

use crate::episode;
use crate::episode::Collision;
use crate::episode::EpisodeLog;
use crate::episode::Script;
use crate::episode::Setup;
use crate::model::OutcomeFacts;
use crate::model::Space;
use crate::oracle;
use crate::oracle::AvoidabilitySettings;
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
    /// Judges every collision of a log, by playing it again from its setup, and applies the space's
    /// verdict.
    pub fn judged(
        setup: &Setup,
        number: usize,
        log: &EpisodeLog,
        settings: &AvoidabilitySettings,
    ) -> EpisodeSummary {
        let script = Script::of_log(log);
        let judgements = oracle::judge(log, settings, &mut |watch| {
            episode::run(setup, &mut |moment| script.choose(setup.table, moment), watch);
        });
        EpisodeSummary::new(setup.table.space(), number, log, judgements)
    }

    /// Applies the space's verdict to every collision of a log; `judgements` has one for each.
    pub fn new(space: &Space, number: usize, log: &EpisodeLog, judgements: Vec<Judgement>) -> EpisodeSummary {
        let find = |(index, judgement)| {
            let facts = oracle::facts(log, index, &judgement);
            let counted = space.counts(facts);
            Finding { number: index, collision: log.collisions[index], facts, judgement, counted }
        };
        EpisodeSummary { episode: number, collisions: judgements.into_iter().enumerate().map(find).collect() }
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
