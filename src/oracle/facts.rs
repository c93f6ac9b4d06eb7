//! What kind of collision each collision of a log was, and which of them count.
//!
//! The rule that combines these facts into "counted" is the space's own `verdict`.

use crate::episode;
use crate::episode::EpisodeLog;
use crate::model::{Avoidability, OutcomeFacts, Space};

use super::avoidable::Judgement;

/// The facts about one collision of a log; `judgement` is the verdict on it.
pub fn facts(log: &EpisodeLog, index: usize, judgement: &Judgement) -> OutcomeFacts {
    let avoidable = judgement.class == Avoidability::Avoidable;
    OutcomeFacts { avoidable, ..episode::collision_facts(&log.collisions[index], &log.collisions[..index]) }
}

/// Whether the space's verdict counts a collision of a log.
pub fn counts(space: &Space, log: &EpisodeLog, index: usize, judgement: &Judgement) -> bool {
    space.counts(facts(log, index, judgement), log.memory_after(log.collisions[index].step))
}

/// Indices of the collisions that the space's verdict counts. `judgements` has one for each collision.
pub fn counted(space: &Space, log: &EpisodeLog, judgements: &[Judgement]) -> Vec<usize> {
    let is_counted = |index: &usize| counts(space, log, *index, &judgements[*index]);
    (0..log.collisions.len()).filter(is_counted).collect()
}
