//! Jobs: what a study consists of, played on any number of threads.

use std::sync::atomic::AtomicBool;

use crate::run::on_threads;
use crate::train::Training;
use avastra_search::agent::{Agent, Diverged};

use crate::study::found::Found;
use crate::study::ready::Study;
use crate::study::record::{CellRecord, EpisodeRecord, Spent, TrainedRecord};
use crate::study::settings::AgentSettings;

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

/// An event while jobs are played.
pub enum Event {
    /// An episode is over; the number of its counted collisions.
    Episode { counted: usize },
    /// A job is done: a cell for each of its roads.
    Done(Vec<CellRecord>),
    /// The training of an agent, by its number, cannot go on.
    Diverged { agent: String, number: u32, why: Diverged },
}

/// Plays jobs on several threads, and calls `on` on this thread with what happens. Stops early when `stop` is set or
/// `on` fails; a job that is not finished then is lost. `clock` says what the calling thread has spent so far.
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
    let work = |job: &Job, tell: &mut dyn FnMut(Event) -> bool| {
        let played = play(study, job, clock, &mut |counted| tell(Event::Episode { counted }));
        match played {
            Ok(Some(cells)) => drop(tell(Event::Done(cells))),
            Ok(None) => {}
            Err(why) => {
                let agent = study.agent(job).label.clone();
                tell(Event::Diverged { agent, number: job.number, why });
            }
        }
    };
    on_threads(jobs, threads, stop, work, on)
}

/// The agent that a training made, as the study judges it.
fn actor(training: &Training, settings: &AgentSettings) -> Box<dyn Agent> {
    let shuffled = settings.training.as_ref().is_some_and(|plan| plan.shuffled_states);
    let shuffled = shuffled.then(|| training.agent().shuffled().expect("only networks are shuffled"));
    shuffled.unwrap_or_else(|| training.agent().actor())
}

/// Plays one job. `tell` gets the counted collisions of every episode and says whether to go on; if not, the
/// result is `None`.
///
/// # Errors
/// If the training cannot go on.
fn play(
    study: &Study,
    job: &Job,
    clock: &dyn Fn() -> Spent,
    tell: &mut dyn FnMut(usize) -> bool,
) -> Result<Option<Vec<CellRecord>>, Diverged> {
    let mut begun = clock();
    let agent = study.agent(job);
    let (mut trained, mut found) = (Vec::new(), Found::default());
    let mut training = agent
        .training
        .is_some()
        .then(|| study.training(job).expect("the study was checked when it was made"));
    if let Some(training) = &mut training {
        while !training.is_done() {
            let episode = training.episode()?;
            trained.push(TrainedRecord::new(&episode));
            found.note(|| training.setup(training.episodes() - 1), &episode.summary, &episode.log);
            if !tell(episode.summary.counted()) {
                return Ok(None);
            }
        }
    }
    let mut cells = Vec::new();
    for &road in &job.roads {
        let road = &study.settings().conditions.roads[road];
        let mut found = found.clone();
        if let Some(search) = study.search(job, road).expect("the study was checked when it was made") {
            trained.clear();
            for number in 0..search.episodes() {
                let (summary, log) = search.judged(number);
                trained.push(TrainedRecord::of_search(&summary, &log));
                found.note(|| search.setup(number), &summary, &log);
                if !tell(summary.counted()) {
                    return Ok(None);
                }
            }
        }
        let mut episodes = Vec::new();
        for seed in 0..study.settings().evaluation.seeds {
            let run = study.evaluation(job, seed, road).expect("the study was checked when it was made");
            for number in 0..run.episodes() {
                let (summary, log) = match &training {
                    Some(training) => run.judged_by(number, actor(training, agent).as_mut()),
                    None => run.judged(number),
                };
                episodes.push(EpisodeRecord::new(run.settings().seed, &summary, &log));
                found.note(|| run.setup(number), &summary, &log);
                if !tell(summary.counted()) {
                    return Ok(None);
                }
            }
        }
        let kinds = found.recurring();
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
            kinds,
            spent: Some(spent),
        });
    }
    Ok(Some(cells))
}
