//! The results of a study: measures with intervals, comparisons with tests.
//!
//! Computed from the cells alone. While some are missing, the result covers those that are there, and says so.

use std::collections::BTreeMap;

use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_base::statistics::{
    Estimate, Interval, PairedTest, RankTest, holm, mann_whitney, mean, poisson, ratio_of_means,
    signed_ranks, superiority, wilson,
};

use crate::study::file::EvaluationPlan;
use crate::study::measures::{MEASURES, Measure, MeasuredCell, failures};
use crate::study::record::{CellRecord, EpisodeRecord, FailureClass};
use crate::study::settings::StudySettings;

/// Points of a learning curve. Ours: few enough to read.
const CURVE_POINTS: usize = 15;

/// The result of a study; written to `results.json`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StudyResults {
    /// Raised whenever a field changes its meaning or goes away.
    pub schema: u32,
    pub question: Option<String>,
    /// Whether it was cut down: then it shows that the study works, and nothing more.
    pub quick: bool,
    /// The evaluation plan, to which every number of collisions refers.
    pub evaluation: EvaluationPlan,
    /// Number of cells that are there, and of all cells.
    pub cells: usize,
    pub cells_wanted: usize,
    pub roads: Vec<RoadResults>,
    /// Each agent on all roads together.
    pub together: Vec<Together>,
}

/// All agents on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RoadResults {
    pub road: String,
    pub agents: Vec<AgentResults>,
    pub comparisons: Vec<BaselineComparison>,
}

/// One agent on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct AgentResults {
    pub agent: String,
    /// Trainings or repetitions.
    pub cells: usize,
    /// Mean over trainings or repetitions of each measure, by the names of [`MEASURES`].
    pub measures: BTreeMap<&'static str, Estimate>,
    /// Over all episodes together.
    pub episodes: Pooled,
    /// Counted collisions by cause, if causes were looked for; the names of modules that are only together at fault
    /// are joined by a space.
    pub causes: BTreeMap<String, usize>,
    /// Distinct failures of all cells together, with how often each was found.
    pub failures: Vec<FoundFailure>,
    /// The learning curve, if there was anything to learn.
    pub curve: Vec<CurvePoint>,
    pub seeds: Vec<CellSeeds>,
}

/// An agent on all roads together.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Together {
    pub agent: String,
    pub episodes: Pooled,
}

/// Rates over all episodes together. Their intervals assume independent events. Collisions of one episode or of one
/// trained policy are not quite independent, so these intervals are somewhat too short. The intervals of
/// [`AgentResults::measures`] are sound: there each value comes from a separate training.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Pooled {
    pub episodes: usize,
    pub driven_km: f64,
    pub simulated_h: f64,
    /// Share of episodes with a counted collision, with Wilson's interval.
    pub colliding: Rate,
    /// Events in 1,000 km, with Garwood's exact interval.
    pub collisions_per_1000_km: Rate,
    pub counted_per_1000_km: Rate,
    pub red_runs_per_1000_km: Rate,
}

/// A rate with its interval.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Rate {
    pub events: u64,
    /// `None` if nothing was driven.
    pub rate: Option<f64>,
    #[serde(flatten)]
    pub interval: Option<Interval>,
}

/// A failure and how often it was found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FoundFailure {
    #[serde(flatten)]
    pub failure: FailureClass,
    pub count: usize,
}

/// A point of the learning curve: a span of episodes, averaged over all trainings.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CurvePoint {
    /// Number of the span's last episode, from 1.
    pub episode: usize,
    /// Means over the episodes of the span.
    pub reward: f64,
    pub counted: f64,
    pub exploration_epsilon: f64,
}

/// The seeds by which a cell can be repeated.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CellSeeds {
    pub number: u32,
    /// The seed for `avastra train --seed`; text, because numbers in JSON cannot hold 64 bits.
    pub training: Option<String>,
    /// The seeds for `avastra run --seed`.
    pub evaluation: Vec<String>,
}

/// An agent compared with a baseline by one measure.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BaselineComparison {
    pub agent: String,
    pub baseline: String,
    pub measure: &'static str,
    /// Mean of the agent divided by the mean of the baseline, with a percentile bootstrap interval; `None` if the
    /// baseline's mean is 0.
    pub ratio: Option<f64>,
    pub ratio_interval: Option<Interval>,
    /// Mann–Whitney.
    #[serde(flatten)]
    pub test: RankTest,
    /// `p` after Holm's correction over all comparisons of the study by the same measure.
    pub p_holm: f64,
    /// The same by pairs: the nth trainings or repetitions of both meet the same episodes. `None` without pairs.
    pub paired: Option<PairedTest>,
    /// Â12: how probable it is that a value of the agent is larger than one of the baseline.
    pub superiority: f64,
    pub superiority_interval: Interval,
}

impl StudyResults {
    /// The result over cells in any order.
    pub fn new(settings: &StudySettings, cells: &[CellRecord]) -> StudyResults {
        let measured: Vec<MeasuredCell> =
            cells.iter().map(|cell| MeasuredCell::new(cell, &settings.evaluation)).collect();
        let mut cells: Vec<&CellRecord> = cells.iter().collect();
        cells.sort_by_key(|cell| {
            (settings.conditions.roads.iter().position(|road| *road == cell.road), cell.number)
        });
        let roads = measured_roads(settings, &measured).into_iter().map(|measured| {
            let agents = measured.agents.into_iter().map(|agent| {
                let own = cells.iter().filter(|cell| cell.agent == agent.agent && cell.road == measured.road);
                let own: Vec<&CellRecord> = own.copied().collect();
                agent_results(agent, &own)
            });
            RoadResults { agents: agents.collect(), road: measured.road, comparisons: measured.comparisons }
        });
        let together = settings.agents.iter().map(|agent| {
            let own = cells.iter().filter(|cell| cell.agent == agent.label);
            Together {
                agent: agent.label.clone(),
                episodes: Pooled::new(own.flat_map(|cell| &cell.episodes)),
            }
        });
        let repeats: usize = settings.agents.iter().map(|agent| agent.repeats as usize).sum();
        StudyResults {
            schema: 1,
            question: settings.question.clone(),
            quick: settings.quick,
            evaluation: settings.evaluation.clone(),
            cells: cells.len(),
            cells_wanted: repeats * settings.conditions.roads.len(),
            together: together.collect(),
            roads: roads.collect(),
        }
    }
}

/// The results of a study's cells on one road.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRoad {
    pub road: String,
    /// The agents that have cells, in the study's order.
    pub agents: Vec<MeasuredAgent>,
    pub comparisons: Vec<BaselineComparison>,
}

/// The measures of an agent on one road.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredAgent {
    pub agent: String,
    /// Trainings or repetitions.
    pub cells: usize,
    /// Mean over them of each measure, by the names of [`MEASURES`].
    pub measures: BTreeMap<&'static str, Estimate>,
}

/// The statistics of a study, from the measures of its cells in any order.
pub fn measured_roads(settings: &StudySettings, cells: &[MeasuredCell]) -> Vec<MeasuredRoad> {
    let mut roads: Vec<MeasuredRoad> = Vec::new();
    for road in &settings.conditions.roads {
        let of = |agent: &str| {
            let own = cells.iter().filter(|cell| cell.agent == agent && cell.road == *road);
            let mut own: Vec<&MeasuredCell> = own.collect();
            own.sort_by_key(|cell| cell.number);
            own
        };
        let groups: Vec<_> =
            settings.agents.iter().map(|agent| (agent.label.as_str(), of(&agent.label))).collect();
        let agents = groups.iter().filter(|(_, cells)| !cells.is_empty());
        roads.push(MeasuredRoad {
            road: road.clone(),
            agents: agents.map(|(label, cells)| measured_agent(label, cells)).collect(),
            comparisons: comparisons(settings, &groups),
        });
    }
    correct(&mut roads);
    roads
}

fn measured_agent(label: &str, cells: &[&MeasuredCell]) -> MeasuredAgent {
    let named = |measure: &Measure| Some((measure.name, estimate(measure.name, cells)?));
    MeasuredAgent {
        agent: label.to_owned(),
        cells: cells.len(),
        measures: MEASURES.iter().filter_map(named).collect(),
    }
}

fn agent_results(measured: MeasuredAgent, cells: &[&CellRecord]) -> AgentResults {
    let episodes = || cells.iter().flat_map(|cell| &cell.episodes);
    let counted = || episodes().flat_map(|episode| &episode.collisions).filter(|found| found.counted);
    let mut causes: BTreeMap<String, usize> = BTreeMap::new();
    for cause in counted().filter_map(|found| found.failure.cause.as_ref()) {
        let name = if cause.is_empty() { "none found" } else { cause };
        *causes.entry(name.to_owned()).or_default() += 1;
    }
    let mut found: Vec<FoundFailure> = failures(episodes())
        .into_iter()
        .map(|failure| FoundFailure {
            failure: failure.clone(),
            count: counted().filter(|found| found.failure == *failure).count(),
        })
        .collect();
    found.sort_by_key(|failure| core::cmp::Reverse(failure.count));
    AgentResults {
        agent: measured.agent,
        cells: measured.cells,
        measures: measured.measures,
        episodes: Pooled::new(episodes()),
        causes,
        failures: found,
        curve: curve(cells),
        seeds: cells.iter().map(|cell| seeds(cell)).collect(),
    }
}

/// A measure's mean over cells. No measure is below 0, so the interval is cut off there. If all cells are 0, Student's
/// interval has no spread. A count then gets the interval of Poisson's distribution, which assumes that collisions are
/// independent and all trainings have the same rate.
pub(super) fn estimate(measure: &str, cells: &[&MeasuredCell]) -> Option<Estimate> {
    let found = mean(&values(measure, cells))?;
    let is_count = MEASURES.iter().any(|one| one.name == measure && one.is_count);
    let interval = match found.interval {
        Some(interval) => Some(Interval { low: interval.low.max(0.0), ..interval }),
        None if is_count && found.mean == 0.0 => {
            let Interval { low, high } = poisson(0);
            Some(Interval { low, high: high.map(|high| high / found.values.len() as f64) })
        }
        None => None,
    };
    Some(Estimate { interval, ..found })
}

pub(super) fn values(measure: &str, cells: &[&MeasuredCell]) -> Vec<f64> {
    cells.iter().filter_map(|cell| cell.value(measure)).collect()
}

fn seeds(cell: &CellRecord) -> CellSeeds {
    let by_seed = cell.episodes.chunk_by(|one, other| one.seed == other.seed);
    CellSeeds {
        number: cell.number,
        training: cell.training_seed.map(|seed| seed.to_string()),
        evaluation: by_seed.map(|episodes| episodes[0].seed.to_string()).collect(),
    }
}

impl Pooled {
    fn new<'a>(episodes: impl Iterator<Item = &'a EpisodeRecord>) -> Pooled {
        let episodes: Vec<&EpisodeRecord> = episodes.collect();
        let driven_km = episodes.iter().map(|episode| episode.distance_m).sum::<f64>() / 1000.0;
        let total = |of: &dyn Fn(&EpisodeRecord) -> usize| -> u64 {
            episodes.iter().map(|episode| of(episode) as u64).sum()
        };
        let colliding = total(&|episode| usize::from(episode.counted() > 0));
        let (low, high) = wilson(colliding as u32, episodes.len() as u32);
        let count = episodes.len();
        Pooled {
            episodes: count,
            driven_km,
            simulated_h: episodes.iter().map(|episode| episode.duration_s).sum::<f64>() / 3600.0,
            colliding: Rate {
                events: colliding,
                rate: (count > 0).then(|| colliding as f64 / count as f64),
                interval: (count > 0).then_some(Interval { low, high: Some(high) }),
            },
            collisions_per_1000_km: per_1000_km(total(&|episode| episode.collisions.len()), driven_km),
            counted_per_1000_km: per_1000_km(total(&EpisodeRecord::counted), driven_km),
            red_runs_per_1000_km: per_1000_km(total(&|episode| episode.red_runs as usize), driven_km),
        }
    }
}

fn per_1000_km(events: u64, driven_km: f64) -> Rate {
    if driven_km <= 0.0 {
        return Rate { events, rate: None, interval: None };
    }
    let scaled = |count: f64| count * 1000.0 / driven_km;
    let Interval { low, high } = poisson(events);
    let interval = Interval { low: scaled(low), high: high.map(scaled) };
    Rate { events, rate: Some(scaled(events as f64)), interval: Some(interval) }
}

/// The learning curve; of an agent that does not learn it has no points.
fn curve(cells: &[&CellRecord]) -> Vec<CurvePoint> {
    if cells.iter().any(|cell| cell.training_seed.is_none()) {
        return Vec::new();
    }
    let episodes = cells.iter().map(|cell| cell.trained.len()).min().unwrap_or(0);
    let points = CURVE_POINTS.min(episodes);
    let point = |number: usize| {
        let span = number * episodes / points..(number + 1) * episodes / points;
        let of_span = || cells.iter().flat_map(|cell| &cell.trained[span.clone()]);
        let count = (span.len() * cells.len()) as f64;
        CurvePoint {
            episode: span.end,
            reward: of_span().map(|episode| episode.sum).sum::<f64>() / count,
            counted: of_span().map(|episode| f64::from(episode.counted)).sum::<f64>() / count,
            exploration_epsilon: of_span().map(|episode| episode.exploration_epsilon).sum::<f64>() / count,
        }
    };
    (0..points).map(point).collect()
}

/// Every agent compared with every baseline but itself, two baselines once, not yet corrected.
fn comparisons(settings: &StudySettings, groups: &[(&str, Vec<&MeasuredCell>)]) -> Vec<BaselineComparison> {
    let mut found = Vec::new();
    for baseline in &settings.baselines {
        let Some(at) = groups.iter().position(|(label, _)| label == baseline) else { continue };
        let theirs = &groups[at].1;
        for (index, (label, own)) in groups.iter().enumerate() {
            let is_baseline = settings.baselines.iter().any(|one| one == label);
            if index == at || is_baseline && index < at {
                continue;
            }
            for measure in MEASURES.iter().filter(|measure| measure.is_compared) {
                found.extend(comparison(settings, measure.name, (label, own), (baseline, theirs)));
            }
        }
    }
    found
}

/// `None` if one of the samples is still empty.
fn comparison(
    settings: &StudySettings,
    measure: &'static str,
    (agent, own_cells): (&str, &[&MeasuredCell]),
    (baseline, their_cells): (&str, &[&MeasuredCell]),
) -> Option<BaselineComparison> {
    let (own, theirs) = (values(measure, own_cells), values(measure, their_cells));
    let test = mann_whitney(&own, &theirs)?;
    let (superiority, superiority_interval) = superiority(&own, &theirs)?;
    let mut rng = rng::stream(settings.first_seed, Stream::Bootstrap, 0);
    let pairs = own_cells.iter().filter_map(|own| {
        let theirs = their_cells.iter().find(|cell| cell.number == own.number)?;
        Some((own.value(measure)?, theirs.value(measure)?))
    });
    let (first, second): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let ratio = ratio_of_means(&own, &theirs, &mut rng);
    Some(BaselineComparison {
        agent: agent.to_owned(),
        baseline: baseline.to_owned(),
        measure,
        ratio: ratio.map(|(ratio, _)| ratio),
        ratio_interval: ratio.map(|(_, interval)| interval),
        test,
        p_holm: test.p,
        paired: signed_ranks(&first, &second),
        superiority,
        superiority_interval,
    })
}

/// Holm's correction over all roads, agents and baselines, for each measure by itself.
fn correct(roads: &mut [MeasuredRoad]) {
    for measure in MEASURES {
        let mut family: Vec<&mut BaselineComparison> = roads
            .iter_mut()
            .flat_map(|road| &mut road.comparisons)
            .filter(|comparison| comparison.measure == measure.name)
            .collect();
        let corrected = holm(&family.iter().map(|comparison| comparison.test.p).collect::<Vec<_>>());
        for (comparison, p) in family.iter_mut().zip(corrected) {
            comparison.p_holm = p;
        }
    }
}
