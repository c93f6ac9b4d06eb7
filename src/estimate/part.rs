//! Parts: what an estimate consists of, played on any number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::episode::EpisodeLog;
use crate::run::on_threads;

use crate::estimate::ready::Estimate;
use crate::estimate::settings::Method;
use crate::estimate::splitting::split;

/// An independent part of an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part {
    /// Index among the roads of the estimate.
    pub road: usize,
    /// Number of the part on its road, from 0.
    pub number: u32,
}

/// What a part found.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRecord {
    pub part: Part,
    /// Estimate of the probability of the event in an episode.
    pub probability: f64,
    /// Episodes that were played from their start to their end, and, summed over them, how far and how long they went.
    /// Branches are not among them.
    pub episodes: u32,
    pub driven_m: f64,
    pub duration_s: f64,
    /// Episodes (and branches that are alive in the end) with the event.
    pub events: u32,
    /// Everything that was simulated, branches and the ticks that lead up to them included, s. The replays of
    /// verdicts are not in it, with either method.
    pub simulated_s: f64,
    /// Levels that the method went through; 0 if it counts.
    pub levels: u32,
    /// Episodes that an external driving system failed in: such a part says nothing, and is not kept.
    pub failed: u32,
}

/// Plays parts on so many threads and hands each to `on`, on this one. Stops early when `stop` is set or `on` fails;
/// a part that is not finished then is lost.
///
/// # Errors
/// The first error of `on`.
pub fn play_parts<E>(
    estimate: &Estimate,
    parts: &[Part],
    threads: usize,
    stop: &AtomicBool,
    on: &mut dyn FnMut(PartRecord) -> Result<(), E>,
) -> Result<(), E> {
    let work = |part: &Part, tell: &mut dyn FnMut(PartRecord) -> bool| {
        let record = match estimate.settings().method {
            Method::Count => count(estimate, *part, stop),
            Method::Split => split(estimate, *part, stop),
        };
        if let Some(record) = record {
            tell(record);
        }
    };
    on_threads(parts, threads, stop, work, on)
}

/// Crude Monte Carlo: every episode from its start. `None` if it was stopped.
fn count(estimate: &Estimate, part: Part, stop: &AtomicBool) -> Option<PartRecord> {
    let mut record = PartRecord::new(part);
    for number in 0..estimate.settings().run.episodes {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let setup = estimate.setup(part, number);
        let (log, branched_s) = estimate.run().played(&setup);
        record.note_whole(&log);
        record.simulated_s += log.duration_s + branched_s;
        record.events += u32::from(estimate.happened(&setup, &log));
    }
    record.probability = f64::from(record.events) / f64::from(record.episodes);
    Some(record)
}

impl PartRecord {
    pub(super) fn new(part: Part) -> PartRecord {
        PartRecord {
            part,
            probability: 0.0,
            episodes: 0,
            driven_m: 0.0,
            duration_s: 0.0,
            events: 0,
            simulated_s: 0.0,
            levels: 0,
            failed: 0,
        }
    }

    /// Takes in an episode that was played from start to end.
    pub(super) fn note_whole(&mut self, log: &EpisodeLog) {
        self.episodes += 1;
        self.driven_m += log.distance_m;
        self.duration_s += log.duration_s;
        self.failed += u32::from(log.failure.is_some());
    }
}
