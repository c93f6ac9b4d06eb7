//! Measures: what is computed for each cell. The statistics run over the cells, that is over trainings or
//! repetitions, and need nothing of a cell but its measures ([`MeasuredCell`]).

use std::collections::BTreeSet;

use crate::episode::End;
use crate::run::PEDESTRIAN;
use avastra_base::statistics::{Lifetime, restricted_mean};

use crate::study::file::EvaluationPlan;
use crate::study::record::{CellRecord, CollisionRecord, EpisodeRecord, FailureClass, TrainedRecord};

/// Computes a number; `None` if the cell has no such number, for example the time to a collision without any
/// collision.
type Compute = fn(&CellRecord, &EvaluationPlan) -> Option<f64>;

/// A number that is computed for each cell.
pub struct Measure {
    pub name: &'static str,
    /// Whether agents are compared by it.
    pub is_compared: bool,
    /// Whether it is a number of events.
    pub is_count: bool,
    pub of: Compute,
}

const fn compared(name: &'static str, of: Compute) -> Measure {
    Measure { name, is_compared: true, is_count: false, of }
}

const fn shown(name: &'static str, of: Compute) -> Measure {
    Measure { name, is_compared: false, is_count: false, of }
}

const fn count(measure: Measure) -> Measure {
    Measure { is_count: true, ..measure }
}

/// Every measure. If not said otherwise, a number is a total over the episodes of one seed, averaged over the
/// seeds.
pub const MEASURES: &[Measure] = &[
    count(compared("counted", |cell, plan| number(cell, plan, |found| found.counted))),
    count(compared("collisions", |cell, plan| number(cell, plan, |_| true))),
    // Avoidable by a careful driver.
    count(shown("avoidable", |cell, plan| number(cell, plan, |found| found.avoidability == "avoidable"))),
    // Avoidable without any delay only.
    count(shown("beyond_reference", |cell, plan| {
        number(cell, plan, |found| found.avoidability == "beyond_reference")
    })),
    count(shown("unavoidable", |cell, plan| number(cell, plan, |found| found.avoidability == "unavoidable"))),
    // At most one pedestrian an episode, as the published package counts.
    count(compared("counted_one_pedestrian", |cell, plan| per_seed(cell, plan, counted_one_pedestrian))),
    // With an obstacle hit before.
    count(shown("repeated", |cell, plan| number(cell, plan, |found| found.repeated))),
    // Just after it appeared.
    count(shown("sudden", |cell, plan| number(cell, plan, |found| found.sudden))),
    // The other ran into the ego vehicle.
    count(shown("struck", |cell, plan| number(cell, plan, |found| found.struck))),
    // The ego vehicle had priority.
    count(shown("wronged", |cell, plan| number(cell, plan, |found| found.priority == "ego"))),
    // The other had.
    count(shown("wrong", |cell, plan| number(cell, plan, |found| found.priority == "other"))),
    // Episodes with a counted collision.
    count(compared("colliding", |cell, plan| {
        per_seed(cell, plan, |episode| f64::from(episode.counted() > 0))
    })),
    count(compared("distinct", distinct)),
    // Distinct failures under all seeds together.
    count(shown("distinct_all", |cell, _| Some(failures(&cell.episodes).len() as f64))),
    // Time to the first counted collision, where there is one, s.
    shown("ttfc_s", |cell, _| ttfc_s(cell)),
    // Time to the first counted collision, restricted mean, s.
    compared("ttfc_restricted_s", |cell, plan| {
        restricted_mean(&lifetimes(&cell.episodes, plan.horizon_s), plan.horizon_s)
    }),
    // Red lights run.
    count(shown("red_runs", |cell, plan| per_seed(cell, plan, |episode| f64::from(episode.red_runs)))),
    // Share of time above the speed limit.
    shown("speeding_share", |cell, _| time_share(cell, |episode| episode.speeding_s)),
    // Share of time beside the lane.
    shown("astray_share", |cell, _| time_share(cell, |episode| episode.astray_s)),
    // Share of episodes that end at the goal.
    shown("arrived_share", |cell, _| {
        Some(mean(cell.episodes.iter().map(|episode| f64::from(episode.ended == End::Arrived.name()))))
    }),
    // Simulated time of the evaluation, h.
    shown("evaluation_h", |cell, _| Some(evaluation_h(cell))),
    // Simulated time of the training, h.
    shown("training_h", |cell, _| {
        of_training(cell, |episode| episode.simulated_s).map(|all_s| all_s / 3600.0)
    }),
    // Counted collisions of the training.
    shown("training_counted", |cell, _| of_training(cell, |episode| f64::from(episode.counted))),
    // Counted collisions of an hour of everything that was simulated: trainings and evaluations.
    compared("counted_per_h", |cell, _| {
        let counted = cell.episodes.iter().map(|episode| episode.counted() as f64).sum::<f64>();
        per_h(cell, counted + of_training(cell, |episode| f64::from(episode.counted)).unwrap_or(0.0))
    }),
    // Kinds of failures that recur, among all that was found while it trained and was judged.
    count(compared("kinds", |cell, _| Some(cell.kinds.len() as f64))),
    // The same of an hour of everything that was simulated.
    compared("kinds_per_h", |cell, _| per_h(cell, cell.kinds.len() as f64)),
];

/// A cell without its episodes: all that the statistics need, and a line of a study that is kept (see `played`).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredCell {
    pub agent: String,
    pub road: String,
    /// Number of the training or repetition, from 0.
    pub number: u32,
    /// Time that it took on the machine that played it, as in `Spent`; `None` if it is not known.
    pub wall_s: Option<f64>,
    pub cpu_s: Option<f64>,
    /// In the order of [`MEASURES`]; in a line, in that of the study's head.
    pub values: Vec<Option<f64>>,
}

impl MeasuredCell {
    pub fn new(cell: &CellRecord, plan: &EvaluationPlan) -> MeasuredCell {
        MeasuredCell {
            agent: cell.agent.clone(),
            road: cell.road.clone(),
            number: cell.number,
            wall_s: cell.spent.map(|spent| spent.wall_s),
            cpu_s: cell.spent.and_then(|spent| spent.cpu_s),
            values: MEASURES.iter().map(|measure| (measure.of)(cell, plan)).collect(),
        }
    }

    /// The value of a measure, by its name.
    pub fn value(&self, measure: &str) -> Option<f64> {
        self.values[MEASURES.iter().position(|one| one.name == measure)?]
    }
}

/// The distinct failures among the counted collisions of episodes.
pub(super) fn failures<'a>(
    episodes: impl IntoIterator<Item = &'a EpisodeRecord>,
) -> BTreeSet<&'a FailureClass> {
    let collisions = episodes.into_iter().flat_map(|episode| &episode.collisions);
    collisions.filter(|found| found.counted).map(|found| &found.failure).collect()
}

/// How long each episode lasted, or until its first counted collision. An ego vehicle that has arrived cannot fail any
/// more, so it survives the horizon. To count its arrival as censored would say that it might have failed like the
/// others, although vehicles in danger arrive late.
pub(super) fn lifetimes<'a>(
    episodes: impl IntoIterator<Item = &'a EpisodeRecord>,
    horizon_s: f64,
) -> Vec<Lifetime> {
    let lifetime = |episode: &EpisodeRecord| match episode.first_counted_s() {
        Some(time_s) => Lifetime { time_s, failed: true },
        None if episode.ended == End::Arrived.name() => {
            Lifetime { time_s: episode.duration_s.max(horizon_s), failed: false }
        }
        None => Lifetime { time_s: episode.duration_s, failed: false },
    };
    episodes.into_iter().map(lifetime).collect()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    values.sum::<f64>() / count as f64
}

fn per_seed(cell: &CellRecord, plan: &EvaluationPlan, of: impl Fn(&EpisodeRecord) -> f64) -> Option<f64> {
    Some(cell.episodes.iter().map(of).sum::<f64>() / f64::from(plan.seeds))
}

/// The number of collisions for which `is_meant` holds.
fn number(
    cell: &CellRecord,
    plan: &EvaluationPlan,
    is_meant: impl Fn(&CollisionRecord) -> bool,
) -> Option<f64> {
    per_seed(cell, plan, |episode| episode.collisions.iter().filter(|found| is_meant(found)).count() as f64)
}

/// Simulated time of the evaluation, h.
fn evaluation_h(cell: &CellRecord) -> f64 {
    cell.episodes.iter().map(|episode| episode.duration_s).sum::<f64>() / 3600.0
}

/// Counted collisions of an episode, of which at most one with a pedestrian: the published package calls every
/// further one repeated.
fn counted_one_pedestrian(episode: &EpisodeRecord) -> f64 {
    let counted = || episode.collisions.iter().filter(|found| found.counted);
    let pedestrians = counted().filter(|found| found.failure.kind == PEDESTRIAN).count();
    (counted().count() - pedestrians.saturating_sub(1)) as f64
}

fn distinct(cell: &CellRecord, plan: &EvaluationPlan) -> Option<f64> {
    let of_seeds = cell.episodes.chunk_by(|one, other| one.seed == other.seed);
    Some(of_seeds.map(|episodes| failures(episodes).len() as f64).sum::<f64>() / f64::from(plan.seeds))
}

/// Mean time to the first counted collision over the episodes that have one, as in the paper.
fn ttfc_s(cell: &CellRecord) -> Option<f64> {
    let times: Vec<f64> = cell.episodes.iter().filter_map(EpisodeRecord::first_counted_s).collect();
    (!times.is_empty()).then(|| mean(times.iter().copied()))
}

fn time_share(cell: &CellRecord, of: impl Fn(&EpisodeRecord) -> f64) -> Option<f64> {
    let all_s: f64 = cell.episodes.iter().map(|episode| episode.duration_s).sum();
    (all_s > 0.0).then(|| cell.episodes.iter().map(of).sum::<f64>() / all_s)
}

/// The total over the episodes of the training, or of what was searched; `None` if there was neither.
fn of_training(cell: &CellRecord, of: impl Fn(&TrainedRecord) -> f64) -> Option<f64> {
    (!cell.trained.is_empty()).then(|| cell.trained.iter().map(of).sum())
}

/// A number of an hour of everything that was simulated.
fn per_h(cell: &CellRecord, number: f64) -> Option<f64> {
    let all_h = evaluation_h(cell) + of_training(cell, |episode| episode.simulated_s).unwrap_or(0.0) / 3600.0;
    (all_h > 0.0).then(|| number / all_h)
}
