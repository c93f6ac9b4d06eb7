//! Jobs: what a study consists of, played on any number of threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

use crate::study::record::{CellRecord, EpisodeRecord, Spent, TrainedRecord};
use crate::study::study::Study;

/// One training, or one repetition of an agent that has nothing to learn, with its evaluation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// Index of the agent.
    pub agent: usize,
    /// Indices of the roads on which it is evaluated.
    pub roads: Vec<usize>,
    /// Number of the training or repetition, from 0.
    pub number: u32,
}

/// What happens while jobs are played.
pub enum Event {
    /// An episode is over, with so many counted collisions.
    Episode { counted: usize },
    /// A job is done: a cell for each of its roads.
    Done(Vec<CellRecord>),
}

/// Plays jobs on so many threads and hands what happens to `on`, on this one. Stops early when `stop` is set or
/// `on` fails; what was under way is lost then. `clock` says what the thread that asks has spent so far.
///
/// # Errors
/// The first error of `on`.
pub fn play_jobs<E>(
    study: &Study,
    jobs: &[Job],
    threads: usize,
    stop: &AtomicBool,
    clock: &(dyn Fn() -> Spent + Sync),
    on: &mut dyn FnMut(Event) -> Result<(), E>,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let abandoned = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (sender, receiver) = mpsc::channel();
        for _ in 0..threads.min(jobs.len()) {
            let sender = sender.clone();
            scope.spawn(|| {
                // Moved in, so that the channel closes when the last worker is done.
                let sender = sender;
                let is_over = || stop.load(Ordering::Relaxed) || abandoned.load(Ordering::Relaxed);
                // A receiver that is gone has abandoned the study.
                let mut tell = |counted| !is_over() && sender.send(Event::Episode { counted }).is_ok();
                while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let Some(cells) = play(study, job, clock, &mut tell) else { break };
                    if sender.send(Event::Done(cells)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        for event in receiver {
            if let Err(error) = on(event) {
                abandoned.store(true, Ordering::Relaxed);
                return Err(error);
            }
        }
        Ok(())
    })
}

/// Plays one job; `tell` hears of every episode and says whether to go on. None if it says no.
fn play(
    study: &Study,
    job: &Job,
    clock: &dyn Fn() -> Spent,
    tell: &mut dyn FnMut(usize) -> bool,
) -> Option<Vec<CellRecord>> {
    let mut begun = clock();
    let agent = study.agent(job);
    let mut trained = Vec::new();
    let mut training = agent
        .training
        .is_some()
        .then(|| study.training(job).expect("the study was checked when it was made"));
    if let Some(training) = &mut training {
        while !training.is_done() {
            let episode = training.episode();
            trained.push(TrainedRecord::new(&episode));
            if !tell(episode.summary.counted()) {
                return None;
            }
        }
    }
    let mut cells = Vec::new();
    for &road in &job.roads {
        let road = &study.settings().roads[road];
        let mut episodes = Vec::new();
        for seed in 0..study.settings().evaluation.seeds {
            let run = study.evaluation(job, seed, road).expect("the study was checked when it was made");
            for number in 0..run.episodes() {
                let (summary, log) = match &training {
                    Some(training) => run.judged_by(number, training.actor().as_mut()),
                    None => run.judged(number),
                };
                episodes.push(EpisodeRecord::new(run.settings().seed, &summary, &log));
                if !tell(summary.counted()) {
                    return None;
                }
            }
        }
        let now = clock();
        let spent = Spent {
            wall_s: now.wall_s - begun.wall_s,
            cpu_s: now.cpu_s.zip(begun.cpu_s).map(|(now_s, begun_s)| now_s - begun_s),
        };
        begun = now;
        cells.push(CellRecord {
            agent: agent.label.clone(),
            road: road.clone(),
            number: job.number,
            training_seed: agent.training.is_some().then(|| study.training_seed(job.number)),
            trained: trained.clone(),
            episodes,
            spent,
        });
    }
    Some(cells)
}
