//! Parts: what an estimate consists of, played on any number of threads.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::episode::{EpisodeLog, Outcome};
use crate::run::{EpisodeSummary, on_threads};

use crate::estimate::plan::Plan;
use crate::estimate::probing::probe;
use crate::estimate::ready::Estimate;
use crate::estimate::settings::Method;

/// An independent part of an estimate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part {
    /// Index among the roads of the estimate.
    pub road: usize,
    /// Number of the part on its road, from 0.
    pub number: u32,
}

/// The result of a part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PartRecord {
    pub part: Part,
    /// Estimate of the probability of the event in an episode.
    pub probability: f64,
    /// Episodes that were played from their start to their end, and, summed over them, how far and how long they went.
    pub episodes: u32,
    pub driven_m: f64,
    pub duration_s: f64,
    /// Episodes and trials with the event.
    pub events: u32,
    /// Sum of the squared weights of the episodes; and the largest weight that any episode could have had, as far as
    /// the part came.
    pub weight_squares: f64,
    pub weight_max: f64,
    /// Everything that was simulated, trials and the ticks that lead up to them included, s. The replays of
    /// verdicts are not in it, with any method.
    pub simulated_s: f64,
    /// Episodes that an external driving system failed in: such a part says nothing, and is not kept.
    pub failed: u32,
}

/// An event that a part met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Number of the episode in its part.
    pub episode: u32,
    /// The step that it belongs to, and the row that was carried out there, if one was.
    pub step: usize,
    pub row: Option<usize>,
    /// For how many of the part's episodes it counts.
    pub weight: f64,
}

/// An event with the episode that it happened in, judged.
pub struct Met {
    pub event: Event,
    pub log: EpisodeLog,
    pub summary: EpisodeSummary,
}

/// A part that was played.
pub struct Played {
    pub record: PartRecord,
    pub met: Vec<Met>,
}

/// Plays parts on so many threads and hands each to `on`, on this one. Stops early when `stop` is set or `on` fails;
/// a part that is not finished then is lost. The plan is for the method that tries rows out.
///
/// # Errors
/// The first error of `on`.
pub fn play_parts<E>(
    estimate: &Estimate,
    parts: &[Part],
    plan: &Plan,
    threads: usize,
    stop: &AtomicBool,
    on: &mut dyn FnMut(Played) -> Result<(), E>,
) -> Result<(), E> {
    let work = |&part: &Part, tell: &mut dyn FnMut(Played) -> bool| {
        let mut played = Played { record: PartRecord { part, ..PartRecord::default() }, met: Vec::new() };
        for number in 0..estimate.settings().run.episodes {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let events = match estimate.settings().method {
                Method::Count => count(estimate, number, &mut played.record),
                Method::Probe => probe(estimate, number, plan, &mut played.record),
            };
            played.note_sample(estimate, events);
        }
        tell(played);
    };
    on_threads(parts, threads, stop, work, on)
}

/// Crude Monte Carlo: an episode of a part from its start. Its event, if it met one.
fn count(estimate: &Estimate, number: u32, record: &mut PartRecord) -> Vec<(Event, EpisodeLog)> {
    let setup = estimate.setup(record.part, number);
    let log = estimate.run().played(&setup);
    record.note_whole(&log);
    record.simulated_s += log.duration_s;
    record.weight_max = 1.0;
    let event = estimate.event(&setup, &log).map(|found| {
        let row = match log.steps.get(found.step).map(|step| &step.outcome) {
            Some(Outcome::Done { draw, .. }) => Some(draw.row),
            _ => None,
        };
        (Event { episode: number, step: found.step, row, weight: 1.0 }, log)
    });
    event.into_iter().collect()
}

impl Played {
    /// Takes in what an episode, with what was tried beside it, met.
    fn note_sample(&mut self, estimate: &Estimate, events: Vec<(Event, EpisodeLog)>) {
        let record = &mut self.record;
        let sample: f64 = events.iter().map(|(event, _)| event.weight).sum();
        // The mean of the samples so far.
        record.probability += (sample - record.probability) / f64::from(record.episodes);
        record.weight_squares += sample * sample;
        record.weight_max = record.weight_max.max(sample);
        record.events += events.len() as u32;
        for (event, log) in events {
            let summary = estimate.judged(record.part, event.episode, &log);
            self.met.push(Met { event, log, summary });
        }
    }
}

impl PartRecord {
    /// Takes in an episode that was played from start to end.
    pub(super) fn note_whole(&mut self, log: &EpisodeLog) {
        self.episodes += 1;
        self.driven_m += log.distance_m;
        self.duration_s += log.duration_s;
        self.failed += u32::from(log.failure.is_some());
    }
}
