//! The kind of each collision of a log, and which of them count.
//!
//! The rule that combines these facts into "counted" is the space's own `verdict`.

use crate::episode;
use crate::episode::EpisodeLog;
use avastra_lang::model::{Avoidability, OutcomeFacts, Space};

use super::avoidable::Judgement;

/// The facts about one collision of a log; `judgement` is the verdict on it.
pub fn facts(log: &EpisodeLog, index: usize, judgement: &Judgement) -> OutcomeFacts {
    facts_if(log, index, judgement.class == Avoidability::Avoidable)
}

fn facts_if(log: &EpisodeLog, index: usize, avoidable: bool) -> OutcomeFacts {
    let breached = log.breached_in(log.collisions[index].step);
    let facts = episode::collision_facts(&log.collisions[index], &log.collisions[..index]);
    OutcomeFacts { avoidable, breached, ..facts }
}

/// Whether the space's verdict counts a collision of a log.
pub fn counts(space: &Space, log: &EpisodeLog, index: usize, judgement: &Judgement) -> bool {
    counts_by(space, log, index, facts(log, index, judgement))
}

/// The clauses of the space's verdict that a collision of a log does not meet; empty if it counts.
pub fn unmet<'a>(space: &'a Space, log: &EpisodeLog, index: usize, judgement: &Judgement) -> Vec<&'a str> {
    space.unmet(facts(log, index, judgement), log.memory_after(log.collisions[index].step))
}

fn counts_by(space: &Space, log: &EpisodeLog, index: usize, facts: OutcomeFacts) -> bool {
    space.counts(facts, log.memory_after(log.collisions[index].step))
}

/// Indices of the collisions that the space's verdict counts. `judgements` has one for each collision.
pub fn counted(space: &Space, log: &EpisodeLog, judgements: &[Judgement]) -> Vec<usize> {
    let is_counted = |index: &usize| counts(space, log, *index, &judgements[*index]);
    (0..log.collisions.len()).filter(is_counted).collect()
}

/// As [`counted`]. Judgements take many replays, so `judge` is called only if avoidability decides.
pub fn counted_at_need(
    space: &Space,
    log: &EpisodeLog,
    judge: impl FnOnce() -> Vec<Judgement>,
) -> Vec<usize> {
    let counted_if = |avoidable: bool| -> Vec<usize> {
        let counts = |&index: &usize| counts_by(space, log, index, facts_if(log, index, avoidable));
        (0..log.collisions.len()).filter(counts).collect()
    };
    let if_avoidable = counted_if(true);
    if if_avoidable == counted_if(false) { if_avoidable } else { counted(space, log, &judge()) }
}
