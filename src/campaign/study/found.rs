//! What a cell found, kind by kind: a kind counts if one of its findings recurs (see `run::left`).

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use avastra_lang::model::Space;

use crate::episode::{EpisodeLog, Script, Setup};
use crate::oracle::{Breached, REPLAYS, Recurrence};
use crate::run::{EpisodeSummary, kind_name};

/// Findings of a kind that are played again, those with the shortest scenarios. If none of them recurs, the kind is not counted.
/// Ours: against a detector that flickers most collisions are flukes, and one training finds many.
const TRIED: usize = 20;

/// The findings of a cell.
#[derive(Default, Clone)]
pub(super) struct Found {
    by_kind: BTreeMap<String, Vec<Rc<Example>>>,
}

/// An episode with a finding.
struct Example {
    setup: Setup,
    summary: EpisodeSummary,
    log: EpisodeLog,
    /// The step of its last finding.
    last: usize,
}

impl Found {
    /// Notes what an episode has. `setup` is that of the episode.
    pub fn note(&mut self, setup: impl FnOnce() -> Setup, summary: &EpisodeSummary, log: &EpisodeLog) {
        let Some(last) = summary.last_step(log) else { return };
        let summary = EpisodeSummary { breached: Breached::all(log), ..summary.clone() };
        let setup = setup();
        let kinds: BTreeSet<String> =
            kinds(setup.table.space(), &summary, log).into_iter().map(|(kind, _)| kind).collect();
        let example = Rc::new(Example { setup, summary, log: log.clone(), last });
        for kind in kinds {
            let all = self.by_kind.entry(kind).or_default();
            let place = all.partition_point(|one| one.last <= last);
            if place < TRIED {
                all.insert(place, example.clone());
                all.truncate(TRIED);
            }
        }
    }

    /// The kinds that recur.
    pub fn recurring(&self) -> BTreeSet<String> {
        let mut recurring = BTreeSet::new();
        for (kind, examples) in &self.by_kind {
            for example in examples {
                if recurring.contains(kind) {
                    break;
                }
                recurring.extend(example.recurring());
            }
        }
        recurring
    }
}

impl Example {
    /// The kinds of its findings that recur.
    fn recurring(&self) -> Vec<String> {
        let mut script = Script::of_log(&self.log);
        script.steps.truncate(self.last + 1);
        let mut summary = self.summary.clone();
        summary.find_recurrence(&self.setup, &script, &self.log, REPLAYS);
        let all = kinds(self.setup.table.space(), &summary, &self.log);
        let again = all.into_iter().filter(|(_, found)| found.is_some_and(Recurrence::recurs));
        again.map(|(kind, _)| kind).collect()
    }
}

/// The kind of each finding that has one, and how often it recurs.
fn kinds(space: &Space, summary: &EpisodeSummary, log: &EpisodeLog) -> Vec<(String, Option<Recurrence>)> {
    let counted = summary.collisions.iter().filter(|finding| finding.counted);
    let collisions = counted.filter_map(|finding| {
        let precrash = log.collisions[finding.number].kind;
        let kind = kind_name(precrash.number(), precrash.name(), finding.cause_in_words().as_deref())?;
        Some((kind, finding.recurrence))
    });
    let breaches = summary.breached.iter().filter_map(|breached| {
        let kind = kind_name(None, &space.requirements[breached.requirement].name, None)?;
        Some((kind, breached.recurrence))
    });
    collisions.chain(breaches).collect()
}
