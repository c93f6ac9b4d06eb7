//! Episodes, stepped from Python, and how they are shown to a learner.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use avastra::action::ActionTable;
use avastra::agent::Features;
use avastra::cli::embedded::{Conditions, Layer, Trained, preset, run, save_policy};
use avastra::episode::{Collision, EpisodeLog, StepLog};
use avastra::mdp::{Observation, RewardSettings};
use avastra::model::REPLAYS_MAX;
use avastra::model::policy::VARIABLES;
use avastra::rng::{Stream, child_seed};
use avastra::run::{Chosen, Finding, Measures, Run, Stepped};
use avastra::sim::World;
use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyArrayLike2};
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::chosen::{Trajectories, chosen, known_row, values_of};
use crate::info::{ended_dict, findings, info};
use crate::space::Space;

create_exception!(
    avastra,
    EpisodeError,
    PyRuntimeError,
    "An episode cannot be stepped so: it has ended or not begun, or there is no such row. Or it ended as it began."
);

/// Episodes of a space on one road against one driving system, one at a time.
///
/// The conditions are those of `avastra run`: `ads` is a name, `ads_config` a profile, `ads_cmd` the command of a driving
/// system of your own, `ambient` a number of vehicles of ambient traffic, `traffic` a name or a profile, `with_rules` and
/// `without_rules` names of rules.
///
/// `observation` is `raw` (the variables of `variables()`, SI units, shape (44,)) or `scaled` (the inputs that `avastra
/// train` gives its network, shape (36,)), each of `float32`. `reward` is `space` (the space's own) or `judged` (20 for a
/// collision that counts, 0 for one that does not, paid at the collision's own step).
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
pub struct Seen {
    pub observation: Vec<f32>,
    pub legal: Vec<bool>,
    pub seed: u64,
    /// `None` after a reset.
    pub step: Option<Step>,
    pub ended: Option<Ended>,
}

/// What became of a step.
pub struct Step {
    pub reward: f64,
    pub time_s: f64,
    pub proc: f64,
    /// What was carried out, or why nothing was.
    pub log: StepLog,
    pub measures: Measures,
    pub collisions: usize,
    /// Counted collisions of the step, where they are judged at once.
    pub counted: Option<usize>,
}

/// An episode that has ended, judged.
pub struct Ended {
    pub log: EpisodeLog,
    pub findings: Vec<Finding>,
    pub measures: Measures,
}

impl Ended {
    fn of(stepped: &mut Stepped) -> Ended {
        let measures = stepped.measures().iter().fold(Measures::default(), |all, step| all.and(step));
        Ended { log: stepped.log(), findings: stepped.findings().to_vec(), measures }
    }
}

#[pymethods]
impl Episodes {
    #[new]
    #[pyo3(signature = (space, road, *, ads="modular", ads_config=None, ads_cmd=None, ambient=0, traffic=None, with_rules=Vec::new(), without_rules=Vec::new(), observation="raw", reward="space"))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        space: &Space,
        road: String,
        ads: &str,
        ads_config: Option<PathBuf>,
        ads_cmd: Option<String>,
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
            "scaled" => Some(Arc::new(Features::new(preset.choice.state, preset.choice.encoding))),
            other => {
                return Err(PyValueError::new_err(format!("no observation `{other}`: `raw` or `scaled`")));
            }
        };
        let reward = match reward {
            "space" => None,
            "judged" => preset.payment.equation(),
            other => return Err(PyValueError::new_err(format!("no reward `{other}`: `space` or `judged`"))),
        };
        let conditions = Conditions {
            roads: vec![road],
            ads: ads.to_owned(),
            ads_config,
            ads_cmd,
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

    /// Begins the episode of a seed: an observation, and which rows are legal, shape (rows,).
    ///
    /// The seed decides everything but the rows. `episode_seed` gives those of a run. Raises `EpisodeError` with the end if
    /// an external driving system fails as the episode begins.
    fn reset<'py>(&self, py: Python<'py>, seed: u64) -> PyResult<(Array<'py, f32>, Array<'py, bool>)> {
        let seen = py.detach(|| self.begin(&mut self.now(), seed));
        if let Some(end) = seen.end() {
            return Err(EpisodeError::new_err(format!(
                "the episode of seed {seed} ended as it began: `{end}`"
            )));
        }
        Ok((PyArray1::from_vec(py, seen.observation), PyArray1::from_vec(py, seen.legal)))
    }

    /// Carries a row out and drives for one observation period (`Space.step_s`): observation, reward, how the episode
    /// ended (`None`: it goes on), and what else is to say.
    ///
    /// An illegal row loses the step: nothing happens in it but driving, and `refused` says which rule forbids it. `None`
    /// passes, and so does any row while none is legal. An episode goes on after a collision. Collisions are judged when
    /// it ends: `info["ended"]`. Raises `EpisodeError` if there is no such row.
    ///
    /// `values` gives some of what the row draws, by name: numbers in SI, words of choices. Each number is moved to the nearest
    /// legal one; what is not given is drawn. `Space.draws` says names and bounds.
    #[pyo3(signature = (row, values=None))]
    #[allow(clippy::type_complexity, reason = "the tuple that Python gets")]
    fn step<'py>(
        &self,
        py: Python<'py>,
        row: Option<i64>,
        values: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array<'py, f32>, f64, Option<&'static str>, Bound<'py, PyDict>)> {
        if row.is_none() && values.is_some_and(|values| !values.is_empty()) {
            return Err(PyValueError::new_err("values without a row: name the row that draws them"));
        }
        let row = self.row(row).map_err(EpisodeError::new_err)?;
        let seen = match (row, values) {
            (Some(row), Some(given)) => {
                let chosen = Chosen { row, values: values_of(self.run.table(), row, given)? };
                py.detach(|| self.advance_with(&mut self.now(), &chosen))
            }
            _ => py.detach(|| self.advance(&mut self.now(), row)),
        };
        let seen = seen.map_err(EpisodeError::new_err)?;
        let info = info(py, self.run.table(), &seen)?;
        info.set_item("action_mask", PyArray1::from_slice(py, &seen.legal))?;
        let (reward, end) = (seen.reward(), seen.end());
        Ok((PyArray1::from_vec(py, seen.observation), reward, end, info))
    }

    /// Plays the whole episode of a seed: one entry of `steps` in each step, and then nothing until it ends. An entry is a row, a row
    /// and a dict of values as `step` takes it, or `None`. It is then the episode under way, so `save` writes it.
    ///
    /// The result has what `info["ended"]` has, and with `trajectory` where everybody was.
    #[pyo3(signature = (seed, steps=Vec::new(), *, trajectory=false))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        steps: Vec<Bound<'py, PyAny>>,
        trajectory: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let steps = steps.iter().map(|step| chosen(self.run.table(), step)).collect::<PyResult<Vec<_>>>()?;
        let mut trajectories = Trajectories::default();
        let play = || {
            let mut now = self.now();
            let stepped = now.insert(Stepped::new(&self.run.setup_of(0, seed)));
            let mut watch = |world: &World| {
                if trajectory {
                    trajectories.note(world);
                }
            };
            stepped.to_the_end(&steps, &mut watch).map_err(|error| error.to_string())?;
            Ok(Ended::of(stepped))
        };
        let ended = py.detach(play).map_err(|reason: String| EpisodeError::new_err(reason))?;
        let told = ended_dict(py, self.run.table(), &ended)?;
        told.set_item("seed", seed)?;
        if trajectory {
            told.set_item("trajectory", trajectories.told(py)?)?;
        }
        Ok(told)
    }

    /// Writes the episode so far as a scenario, as `avastra run` writes it: what was found in it, or else the whole of it. With
    /// `repeat`, the file says how often each finding recurs in up to so many plays under other noise. An existing file is
    /// replaced. The space's file must lie where the space was read from.
    #[pyo3(signature = (path, *, repeat=0))]
    fn save(&self, py: Python<'_>, path: PathBuf, repeat: u32) -> PyResult<()> {
        if repeat > REPLAYS_MAX {
            return Err(PyValueError::new_err(format!(
                "`repeat` is {repeat}: at most {REPLAYS_MAX} replays"
            )));
        }
        let save = || {
            let now = self.now().clone().ok_or_else(|| NOT_BEGUN.to_owned())?;
            avastra::cli::embedded::save(&self.run, now.setup(), &now.log(), &path, repeat)
        };
        py.detach(save).map_err(PyValueError::new_err)
    }

    /// Writes a network that was trained elsewhere as a policy: `avastra run --policy` plays it. In each step, the row of the largest
    /// output is carried out.
    ///
    /// `layers` has weights, shape (outputs, inputs), and biases of each layer, as PyTorch's `Linear` holds them, with ReLU
    /// between them. The first has the scaled observation as inputs, the last one output for each row. `by` says who trained it.
    /// With `masked`, only legal rows are chosen.
    #[pyo3(signature = (path, layers, *, by, seed=0, episodes=0, masked=true))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn save_policy(
        &self,
        py: Python<'_>,
        path: PathBuf,
        layers: Vec<(PyArrayLike2<'_, f32, AllowTypeChange>, PyArrayLike1<'_, f32, AllowTypeChange>)>,
        by: String,
        seed: u64,
        episodes: u64,
        masked: bool,
    ) -> PyResult<()> {
        let layers = layers
            .iter()
            .map(|(weights, biases)| {
                let (weights, biases) = (weights.as_array(), biases.as_array().to_vec());
                Layer { inputs: weights.ncols(), weights: weights.iter().copied().collect(), biases }
            })
            .collect();
        let trained = Trained { layers, is_masked: masked, by, seed, episodes };
        py.detach(|| save_policy(&self.run, &path, &trained)).map_err(PyValueError::new_err)
    }

    /// The collisions of the episode so far, judged. A verdict does not change any more.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let judged = || {
            let mut now = self.now();
            let stepped = now.as_mut().ok_or(NOT_BEGUN)?;
            Ok(stepped.findings().to_vec())
        };
        let found = py.detach(judged).map_err(|reason: &str| EpisodeError::new_err(reason))?;
        findings(py, &found)
    }

    /// This moment, to return to as often as wanted: the world, and what the driving system has in mind.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        let kept = py.detach(|| self.now().clone()).ok_or_else(|| EpisodeError::new_err(NOT_BEGUN))?;
        Ok(Snapshot { kept: Mutex::new(kept), run: Arc::clone(&self.run) })
    }

    /// Returns to a moment, of this object or of a sibling: its observation, and which rows are legal. An episode that had
    /// ended then has ended again: `step` raises `EpisodeError`.
    fn restore<'py>(
        &self,
        py: Python<'py>,
        snapshot: &Snapshot,
    ) -> PyResult<(Array<'py, f32>, Array<'py, bool>)> {
        if !Arc::ptr_eq(&self.run, &snapshot.run) {
            return Err(EpisodeError::new_err("the snapshot is of episodes under other conditions"));
        }
        let seen = py.detach(|| {
            let mut kept = snapshot.kept.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let seen = self.view.of(&mut kept);
            *self.now() = Some(kept);
            seen
        });
        Ok((PyArray1::from_vec(py, seen.observation), PyArray1::from_vec(py, seen.legal)))
    }

    /// Ends the episode under way and, where a driving system of your own is under test, its processes that no episode
    /// uses; siblings share them. `reset` starts it again.
    fn close(&self, py: Python<'_>) {
        py.detach(|| {
            *self.now() = None;
            if let Some(program) = self.run.arena().program() {
                // How it ends is of no interest any more.
                let _ = program.close();
                // What begins again may be another program by then.
                program.forget();
            }
        });
    }

    fn __repr__(&self) -> String {
        let settings = self.run.settings();
        let road = settings.conditions.roads.join(", ");
        format!("<avastra.Episodes on {road} against {}>", self.run.arena().ads_name())
    }
}

pub type Array<'py, T> = Bound<'py, PyArray1<T>>;

const NOT_BEGUN: &str = "no episode has begun: reset first";

impl Episodes {
    /// A row as Python gives it, if there is such a row.
    pub fn row(&self, row: Option<i64>) -> Result<Option<usize>, String> {
        row.map(|row| known_row(self.run.table(), row)).transpose()
    }

    /// The episode under way. Where a thread panicked in it, it is half stepped, so there is none any more.
    pub fn now(&self) -> MutexGuard<'_, Option<Stepped>> {
        self.now.lock().unwrap_or_else(|poisoned| {
            self.now.clear_poison();
            let mut now = poisoned.into_inner();
            *now = None;
            now
        })
    }

    /// Begins an episode in the place of the one under way.
    pub fn begin(&self, now: &mut Option<Stepped>, seed: u64) -> Seen {
        self.view.of(now.insert(Stepped::new(&self.run.setup_of(0, seed))))
    }

    /// Steps the episode under way, with values of the caller.
    fn advance_with(&self, now: &mut Option<Stepped>, chosen: &Chosen) -> Result<Seen, String> {
        let stepped = now.as_mut().ok_or(NOT_BEGUN)?;
        stepped.step_with(chosen).map_err(|error| error.to_string())?;
        let step = self.view.step(stepped);
        Ok(Seen { step: Some(step), ..self.view.of(stepped) })
    }

    /// The table of its space.
    pub fn table(&self) -> &ActionTable {
        self.run.table()
    }

    /// Steps the episode under way.
    pub fn advance(&self, now: &mut Option<Stepped>, row: Option<usize>) -> Result<Seen, String> {
        let stepped = now.as_mut().ok_or(NOT_BEGUN)?;
        stepped.step(row).map_err(|error| error.to_string())?;
        let step = self.view.step(stepped);
        Ok(Seen { step: Some(step), ..self.view.of(stepped) })
    }
}

/// Whether [`Episodes::advance`] takes that row now.
pub fn can_advance(now: &Option<Stepped>, row: Option<usize>) -> Result<(), String> {
    now.as_ref().ok_or(NOT_BEGUN)?.can_step(row).map_err(|error| error.to_string())
}

impl Seen {
    /// 0 after a reset.
    pub fn reward(&self) -> f64 {
        self.step.as_ref().map_or(0.0, |step| step.reward)
    }

    /// How the episode ended; `None` while it goes on.
    pub fn end(&self) -> Option<&'static str> {
        self.ended.as_ref().map(|ended| ended.log.end.name())
    }
}

impl View {
    /// A moment, without what became of the step before.
    fn of(&self, stepped: &mut Stepped) -> Seen {
        let ended = stepped.end().map(|_| Ended::of(stepped));
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
            ended,
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
        let (time_s, proc, reward) = (step.time_s, step.proc, judged.unwrap_or(step.reward));
        let (log, measures) = (step.clone(), stepped.measures()[last]);
        Step { reward, time_s, proc, log, measures, collisions, counted }
    }
}

/// The seed of the nth episode of a run of a seed, as `avastra run --seed` derives it.
#[pyfunction]
pub fn episode_seed(seed: u64, number: u64) -> u64 {
    child_seed(seed, Stream::Episode, number)
}
