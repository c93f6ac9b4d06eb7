//! What is measured of a cell: one number each, over whose trainings or repetitions the statistics go.

use std::collections::BTreeSet;

use crate::study::statistics::{Lifetime, restricted_mean};

use crate::study::file::EvaluationPlan;
use crate::study::record::{CellRecord, CollisionRecord, EpisodeRecord, Failure};

/// Something that is measured of a cell.
pub struct Measure {
    pub name: &'static str,
    /// For people, with its unit.
    pub title: &'static str,
    /// Whether agents are compared by it.
    pub is_compared: bool,
    /// None where there is none: a training of an agent that learns nothing, a time of no collision.
    pub of: fn(&CellRecord, &EvaluationPlan) -> Option<f64>,
}

/// Every measure. Where not said otherwise, a number is of the episodes of one seed, averaged over the seeds.
pub const MEASURES: &[Measure] = &[
    Measure {
        name: "counted",
        title: "counted collisions",
        is_compared: true,
        of: |cell, plan| number(cell, plan, |found| found.counted),
    },
    Measure {
        name: "collisions",
        title: "all collisions",
        is_compared: true,
        of: |cell, plan| number(cell, plan, |_| true),
    },
    Measure {
        name: "avoidable",
        title: "avoidable by a careful driver",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.avoidability == "avoidable"),
    },
    Measure {
        name: "beyond_reference",
        title: "avoidable without any delay only",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.avoidability == "beyond_reference"),
    },
    Measure {
        name: "unavoidable",
        title: "unavoidable",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.avoidability == "unavoidable"),
    },
    Measure {
        name: "repeated",
        title: "with an obstacle hit before",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.repeated),
    },
    Measure {
        name: "sudden",
        title: "just after it appeared",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.sudden),
    },
    Measure {
        name: "struck",
        title: "the other ran into the ego vehicle",
        is_compared: false,
        of: |cell, plan| number(cell, plan, |found| found.struck),
    },
    Measure {
        name: "colliding",
        title: "episodes with a counted collision",
        is_compared: true,
        of: |cell, plan| per_seed(cell, plan, |episode| f64::from(episode.counted() > 0)),
    },
    Measure { name: "distinct", title: "distinct failures", is_compared: true, of: distinct },
    Measure {
        name: "distinct_all",
        title: "distinct failures under all seeds together",
        is_compared: false,
        of: |cell, _| Some(failures(&cell.episodes).len() as f64),
    },
    Measure {
        name: "ttfc_s",
        title: "time to the first counted collision, where there is one, s",
        is_compared: false,
        of: |cell, _| ttfc_s(cell),
    },
    Measure {
        name: "ttfc_restricted_s",
        title: "time to the first counted collision, restricted mean, s",
        is_compared: true,
        of: |cell, plan| restricted_mean(&lifetimes(&cell.episodes), plan.horizon_s),
    },
    Measure {
        name: "red_runs",
        title: "red lights run",
        is_compared: false,
        of: |cell, plan| per_seed(cell, plan, |episode| f64::from(episode.red_runs)),
    },
    Measure {
        name: "speeding_share",
        title: "share of time above the speed limit",
        is_compared: false,
        of: |cell, _| time_share(cell, |episode| episode.speeding_s),
    },
    Measure {
        name: "astray_share",
        title: "share of time beside the lane",
        is_compared: false,
        of: |cell, _| time_share(cell, |episode| episode.astray_s),
    },
    Measure {
        name: "arrived_share",
        title: "share of episodes that end at the goal",
        is_compared: false,
        of: |cell, _| Some(mean(cell.episodes.iter().map(|episode| f64::from(episode.ended == "arrived")))),
    },
    Measure {
        name: "evaluation_h",
        title: "simulated time of the evaluation, h",
        is_compared: false,
        of: |cell, _| {
            Some(
                cell.episodes.iter().map(|episode| episode.duration_s + episode.branched_s).sum::<f64>()
                    / 3600.0,
            )
        },
    },
    Measure {
        name: "training_h",
        title: "simulated time of the training, h",
        is_compared: false,
        of: |cell, _| {
            of_training(cell, |cell| {
                cell.trained.iter().map(|episode| episode.simulated_s).sum::<f64>() / 3600.0
            })
        },
    },
    Measure {
        name: "training_counted",
        title: "counted collisions of the training",
        is_compared: false,
        of: |cell, _| {
            of_training(cell, |cell| cell.trained.iter().map(|episode| f64::from(episode.counted)).sum())
        },
    },
];

/// Failures that differ among the counted collisions of episodes.
pub(super) fn failures<'a>(episodes: impl IntoIterator<Item = &'a EpisodeRecord>) -> BTreeSet<&'a Failure> {
    let collisions = episodes.into_iter().flat_map(|episode| &episode.collisions);
    collisions.filter(|found| found.counted).map(|found| &found.failure).collect()
}

/// How long each episode lasted, or until its first counted collision.
pub(super) fn lifetimes<'a>(episodes: impl IntoIterator<Item = &'a EpisodeRecord>) -> Vec<Lifetime> {
    let lifetime = |episode: &EpisodeRecord| match episode.first_counted_s() {
        Some(time_s) => Lifetime { time_s, failed: true },
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

/// Collisions of a kind.
fn number(
    cell: &CellRecord,
    plan: &EvaluationPlan,
    is_meant: impl Fn(&CollisionRecord) -> bool,
) -> Option<f64> {
    per_seed(cell, plan, |episode| episode.collisions.iter().filter(|found| is_meant(found)).count() as f64)
}

fn distinct(cell: &CellRecord, plan: &EvaluationPlan) -> Option<f64> {
    let of_seeds = cell.episodes.chunk_by(|one, other| one.seed == other.seed);
    Some(of_seeds.map(|episodes| failures(episodes).len() as f64).sum::<f64>() / f64::from(plan.seeds))
}

/// The paper's mean: over the episodes that collide.
fn ttfc_s(cell: &CellRecord) -> Option<f64> {
    let times: Vec<f64> = cell.episodes.iter().filter_map(EpisodeRecord::first_counted_s).collect();
    (!times.is_empty()).then(|| mean(times.iter().copied()))
}

fn time_share(cell: &CellRecord, of: impl Fn(&EpisodeRecord) -> f64) -> Option<f64> {
    let all_s: f64 = cell.episodes.iter().map(|episode| episode.duration_s).sum();
    (all_s > 0.0).then(|| cell.episodes.iter().map(of).sum::<f64>() / all_s)
}

fn of_training(cell: &CellRecord, of: impl Fn(&CellRecord) -> f64) -> Option<f64> {
    cell.training_seed.map(|_| of(cell))
}
