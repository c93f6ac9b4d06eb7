//! Episodes, stepped from Python one by one or many at once on threads of Rust.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use avastra::agent::{Features, Hyperparameters, Kind, Settings, by_name};
use avastra::cli::embedded::{Conditions, run};
use avastra::episode::{Collision, EpisodeLog, Outcome};
use avastra::mdp::{Observation, RewardSettings};
use avastra::model::digest_text;
use avastra::model::policy::VARIABLES;
use avastra::model::vocabulary::Word as _;
use avastra::oracle;
use avastra::rng::{Stream, child_seed};
use avastra::run::{Finding, Run, Stepped};
use numpy::{PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::space::Space;

create_exception!(avastra, EpisodeError, PyRuntimeError, "An episode cannot be stepped so.");

/// Episodes of a space on one road against one driving system, one at a time.
#[pyclass(frozen, module = "avastra")]
pub struct Episodes {
    run: Arc<Run>,
    view: View,
    /// The episode under way; locked only while Python's lock is released.
    now: Mutex<Option<Stepped>>,
}

/// A kept moment of an episode.
#[pyclass(frozen, module = "avastra")]
pub struct Snapshot {
    kept: Mutex<Stepped>,
    run: Arc<Run>,
}

/// How an episode is shown to a learner.
#[derive(Clone)]
struct View {
    /// `None`: all variables as they are.
    features: Option<Arc<Features>>,
    /// `None`: the space's own reward.
    reward: Option<RewardSettings>,
}

/// What a learner gets after a reset or a step.
struct Seen {
    observation: Vec<f32>,
    legal: Vec<bool>,
    seed: u64,
    step: Option<Step>,
}

/// What became of a step.
struct Step {
    reward: f64,
    time_s: f64,
    proc: f64,
    row: Option<usize>,
    refused: Option<String>,
    collisions: usize,
    /// Counted collisions of the step, where they are judged at once.
    counted: Option<usize>,
    ended: Option<Ended>,
}

/// An episode that has ended, judged.
struct Ended {
    log: EpisodeLog,
    findings: Vec<Finding>,
}

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (space, road, *, ads="modular", ads_config=None, ambient=0, traffic=None, with_rules=Vec::new(), without_rules=Vec::new(), observation="raw", reward="space"))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        space: &Space,
        road: String,
        ads: &str,
        ads_config: Option<PathBuf>,
        ambient: u32,
        traffic: Option<String>,
        with_rules: Vec<String>,
        without_rules: Vec<String>,
        observation: &str,
        reward: &str,
    ) -> PyResult<Episodes> {
        let preset = preset();
        let features = match observation {
            "raw" => None,
            "scaled" => Some(Arc::new(Features::new(preset.state, preset.encoding))),
            other => {
                return Err(PyValueError::new_err(format!("no observation `{other}`: `raw` or `scaled`")));
            }
        };
        let reward = match reward {
            "space" => None,
            "judged" => Some(preset.reward_settings()),
            other => return Err(PyValueError::new_err(format!("no reward `{other}`: `space` or `judged`"))),
        };
        let conditions = Conditions {
            roads: vec![road],
            ads: ads.to_owned(),
            ads_config,
            ambient,
            traffic,
            with: with_rules,
            without: without_rules,
        };
        let table = space.table.clone();
        let run = py.detach(|| run(table, &conditions)).map_err(PyValueError::new_err)?;
        Ok(Episodes { run: Arc::new(run), view: View { features, reward }, now: Mutex::new(None) })
    }

    /// Other episodes under the same conditions. They share the road, which is not read again.
    fn sibling(&self) -> Episodes {
        Episodes { run: Arc::clone(&self.run), view: self.view.clone(), now: Mutex::new(None) }
    }

    /// Length of an observation.
    #[getter]
    fn observation_len(&self) -> usize {
        self.view.features.as_ref().map_or(VARIABLES.len(), |features| features.len())
    }

    /// Number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.run.table().rows().len()
    }

    fn reset<'py>(&self, py: Python<'py>, seed: u64) -> PyResult<(Array<'py, f32>, Array<'py, bool>)> {
        let seen = py.detach(|| self.begin(seed));
        Ok((PyArray1::from_vec(py, seen.observation), PyArray1::from_vec(py, seen.legal)))
    }

    #[pyo3(signature = (row))]
    #[allow(clippy::type_complexity, reason = "the tuple that Python gets")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        row: Option<usize>,
    ) -> PyResult<(Array<'py, f32>, f64, Option<&'static str>, Bound<'py, PyDict>)> {
        let seen = py.detach(|| self.advance(row)).map_err(EpisodeError::new_err)?;
        let info = info(py, &seen)?;
        info.set_item("action_mask", PyArray1::from_slice(py, &seen.legal))?;
        let step = seen.step.as_ref();
        let reward = step.map_or(0.0, |step| step.reward);
        let end = step.and_then(Step::end);
        Ok((PyArray1::from_vec(py, seen.observation), reward, end, info))
    }

    /// The collisions of the episode so far, judged.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let judged = || {
            let mut now = self.now();
            let stepped = now.as_mut().ok_or(NOT_BEGUN)?;
            Ok(stepped.findings().to_vec())
        };
        let found = py.detach(judged).map_err(|reason: &str| EpisodeError::new_err(reason))?;
        findings(py, &found)
    }

    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        let kept = py.detach(|| self.now().clone()).ok_or_else(|| EpisodeError::new_err(NOT_BEGUN))?;
        Ok(Snapshot { kept: Mutex::new(kept), run: Arc::clone(&self.run) })
    }

    fn restore<'py>(
        &self,
        py: Python<'py>,
        snapshot: &Snapshot,
    ) -> PyResult<(Array<'py, f32>, Array<'py, bool>)> {
        if !Arc::ptr_eq(&self.run, &snapshot.run) {
            return Err(EpisodeError::new_err("the snapshot is of episodes under other conditions"));
        }
        let seen = py.detach(|| {
            let kept = locked(&snapshot.kept).clone();
            let seen = self.view.of(&kept);
            *self.now() = Some(kept);
            seen
        });
        Ok((PyArray1::from_vec(py, seen.observation), PyArray1::from_vec(py, seen.legal)))
    }

    fn __repr__(&self) -> String {
        let settings = self.run.settings();
        let road = settings.roads.join(", ");
        format!("<avastra.Episodes on {road} against {}>", self.run.ads_name())
    }
}

type Array<'py, T> = Bound<'py, PyArray1<T>>;

const NOT_BEGUN: &str = "no episode has begun: reset first";

impl Episodes {
    fn now(&self) -> MutexGuard<'_, Option<Stepped>> {
        locked(&self.now)
    }

    fn begin(&self, seed: u64) -> Seen {
        let stepped = Stepped::new(Arc::clone(&self.run), 0, seed);
        let seen = self.view.of(&stepped);
        *self.now() = Some(stepped);
        seen
    }

    fn advance(&self, row: Option<usize>) -> Result<Seen, String> {
        let mut now = self.now();
        let stepped = now.as_mut().ok_or(NOT_BEGUN)?;
        stepped.step(row).map_err(|error| error.to_string())?;
        let step = self.view.step(stepped);
        Ok(Seen { step: Some(step), ..self.view.of(stepped) })
    }
}

/// A lock's content. It is whole even if a thread panicked while it held the lock: only whole episodes are put there.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl View {
    fn of(&self, stepped: &Stepped) -> Seen {
        let observation = stepped.observation();
        let raw =
            |observation: &Observation| (0..VARIABLES.len()).map(|index| observation.get(index)).collect();
        Seen {
            observation: self
                .features
                .as_ref()
                .map_or_else(|| raw(observation), |features| features.encode(observation)),
            legal: stepped.legal().to_vec(),
            seed: stepped.seed(),
            step: None,
        }
    }

    /// The last step of an episode.
    fn step(&self, stepped: &mut Stepped) -> Step {
        let judged = self.reward.map(|constants| stepped.judged_reward(&constants));
        let last = stepped.steps().len() - 1;
        let is_now = |collision: &Collision| collision.step == last;
        let collisions = stepped.collisions().iter().filter(|collision| is_now(collision)).count();
        let counts = |finding: &&Finding| finding.counted && is_now(&finding.collision);
        let counted = judged.map(|_| stepped.findings().iter().filter(counts).count());
        let step = &stepped.steps()[last];
        let (row, refused) = match &step.outcome {
            Outcome::Done { draw, .. } => (Some(draw.row), None),
            Outcome::Passed => (None, None),
            Outcome::Refused { rule, reason, .. } => {
                (None, Some(rule.as_ref().map_or(reason.clone(), |rule| format!("{rule}: {reason}"))))
            }
        };
        let (time_s, proc, reward) = (step.time_s, step.proc, judged.unwrap_or(step.reward));
        let ended =
            stepped.end().map(|_| Ended { log: stepped.log(), findings: stepped.findings().to_vec() });
        Step { reward, time_s, proc, row, refused, collisions, counted, ended }
    }
}

impl Step {
    fn end(&self) -> Option<&'static str> {
        self.ended.as_ref().map(|ended| ended.log.end.name())
    }
}

/// The settings that `avastra train` has by default.
fn preset() -> Hyperparameters {
    let entry = by_name("ddqn").filter(|entry| matches!(entry.kind, Kind::Learning(_)));
    match entry.and_then(|entry| Settings::from_yaml(entry, None, "")) {
        Some(Ok(Settings::Learning(settings))) => *settings,
        _ => unreachable!("ddqn learns, and its preset is sound"),
    }
}

/// What is said of a moment beside observation, reward and mask.
fn info<'py>(py: Python<'py>, seen: &Seen) -> PyResult<Bound<'py, PyDict>> {
    let info = PyDict::new(py);
    info.set_item("seed", seen.seed)?;
    let Some(step) = &seen.step else { return Ok(info) };
    info.set_item("time_s", step.time_s)?;
    info.set_item("proc", step.proc)?;
    info.set_item("row", step.row.map_or(-1, |row| row as i64))?;
    info.set_item("refused", &step.refused)?;
    info.set_item("collisions", step.collisions)?;
    if let Some(counted) = step.counted {
        info.set_item("counted", counted)?;
    }
    if let Some(Ended { log, findings: found }) = &step.ended {
        let end = PyDict::new(py);
        end.set_item("end", log.end.name())?;
        end.set_item("duration_s", log.duration_s)?;
        end.set_item("distance_m", log.distance_m)?;
        end.set_item("red_runs", log.red_runs)?;
        end.set_item("trace", digest_text(&log.trace()))?;
        end.set_item("counted", found.iter().filter(|finding| finding.counted).count())?;
        end.set_item("findings", findings(py, found)?)?;
        info.set_item("ended", end)?;
    }
    Ok(info)
}

/// Judged collisions as dicts, with the names of `run.db`'s columns.
fn findings<'py>(py: Python<'py>, found: &[Finding]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for Finding { collision, facts, judgement, counted, own_body, .. } in found {
        let severity = oracle::severity(collision);
        let one = PyDict::new(py);
        one.set_item("step", collision.step)?;
        one.set_item("time_s", collision.contact.time_s)?;
        one.set_item("counted", counted)?;
        one.set_item("avoidability", judgement.class.name())?;
        one.set_item("priority", facts.priority.name())?;
        one.set_item("body", collision.body.like.name())?;
        one.set_item("own_body", own_body)?;
        one.set_item("verb", collision.verb.name())?;
        one.set_item("side", severity.side)?;
        one.set_item("approach", severity.approach)?;
        one.set_item("ego_speed_mps", collision.contact.ego_speed_mps)?;
        one.set_item("closing_speed_mps", collision.contact.closing_speed_mps)?;
        one.set_item("delta_v_mps", severity.delta_v_mps)?;
        list.append(one)?;
    }
    Ok(list)
}

/// Steps several episodes at once, on threads of Rust without Python's lock; one whose `seeds` has a number begins anew
/// instead.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "the tuple that Python gets")]
pub fn step_all<'py>(
    py: Python<'py>,
    worlds: Vec<Py<Episodes>>,
    rows: Vec<Option<usize>>,
    seeds: Vec<Option<u64>>,
    threads: usize,
) -> PyResult<(
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<bool>>,
    Array<'py, f64>,
    Vec<Option<&'static str>>,
    Vec<Bound<'py, PyDict>>,
)> {
    if rows.len() != worlds.len() || seeds.len() != worlds.len() {
        return Err(PyValueError::new_err("`rows` and `seeds` have one value for each of the episodes"));
    }
    let worlds: Vec<&Episodes> = worlds.iter().map(Py::get).collect();
    let seen = py.detach(|| play_all(&worlds, &rows, &seeds, threads)).map_err(EpisodeError::new_err)?;
    let infos = seen.iter().map(|seen| info(py, seen)).collect::<PyResult<_>>()?;
    let ends = seen.iter().map(|seen| seen.step.as_ref().and_then(Step::end)).collect();
    let rewards = seen.iter().map(|seen| seen.step.as_ref().map_or(0.0, |step| step.reward)).collect();
    let (mut observations, mut masks) = (Vec::new(), Vec::new());
    let (width, rows) = seen.first().map_or((0, 0), |seen| (seen.observation.len(), seen.legal.len()));
    let len = seen.len();
    for one in seen {
        observations.extend(one.observation);
        masks.extend(one.legal);
    }
    let observations = PyArray1::from_vec(py, observations).reshape([len, width])?;
    let masks = PyArray1::from_vec(py, masks).reshape([len, rows])?;
    Ok((observations, masks, PyArray1::from_vec(py, rewards), ends, infos))
}

fn play_all(
    worlds: &[&Episodes],
    rows: &[Option<usize>],
    seeds: &[Option<u64>],
    threads: usize,
) -> Result<Vec<Seen>, String> {
    let next = AtomicUsize::new(0);
    let slots: Vec<Mutex<Option<Result<Seen, String>>>> = worlds.iter().map(|_| Mutex::new(None)).collect();
    let work = || {
        while let Some((index, world)) = next_of(worlds, &next) {
            let seen = seeds[index].map_or_else(|| world.advance(rows[index]), |seed| Ok(world.begin(seed)));
            *locked(&slots[index]) = Some(seen);
        }
    };
    std::thread::scope(|scope| {
        // This thread works, too.
        for _ in 1..threads.clamp(1, worlds.len().max(1)) {
            scope.spawn(work);
        }
        work();
    });
    let seen = slots.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner));
    seen.map(|seen| seen.expect("every episode is someone's work")).collect()
}

fn next_of<'a>(worlds: &[&'a Episodes], next: &AtomicUsize) -> Option<(usize, &'a Episodes)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    worlds.get(index).map(|world| (index, *world))
}

/// The seed of the nth episode of a run of a seed, as `avastra run --seed` derives it.
#[pyfunction]
pub fn episode_seed(seed: u64, number: u64) -> u64 {
    child_seed(seed, Stream::Episode, number)
}
