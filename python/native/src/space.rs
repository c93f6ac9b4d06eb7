//! A compiled space, and the variables of an observation.

use std::path::PathBuf;

use avastra::action::ActionTable;
use avastra::action::DrawRecord;
use avastra::cli::embedded::{Said, compile, compile_text};
use avastra::model::policy::{VARIABLES, VariableKind};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::chosen::known_row;
use crate::diagnostics;

/// A space that was compiled: the rows of its action table, and its roads.
#[pyclass(frozen, module = "avastra")]
pub struct Space {
    pub table: ActionTable,
    path: PathBuf,
    said: Vec<Said>,
}

#[pymethods]
impl Space {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Space> {
        let compiled = py.detach(|| compile(&path)).map_err(|reason| diagnostics::error(py, reason))?;
        Ok(Space { table: compiled.table, path, said: compiled.diagnostics })
    }

    /// The space in a text, as if it were the file at `path`, from where `use` finds other files. Nothing is written there.
    #[staticmethod]
    #[pyo3(signature = (text, path=PathBuf::from("space.ava")))]
    fn from_text(py: Python<'_>, text: String, path: PathBuf) -> PyResult<Space> {
        let compiled =
            py.detach(|| compile_text(&path, &text)).map_err(|reason| diagnostics::error(py, reason))?;
        Ok(Space { table: compiled.table, path, said: compiled.diagnostics })
    }

    /// The draws of a row on a road: the values of choices, and the bounds of numbers, in SI.
    #[pyo3(signature = (row, road=None))]
    fn draws(&self, row: i64, road: Option<&str>) -> PyResult<Vec<Draw>> {
        let row = &self.table.rows()[known_row(&self.table, row).map_err(PyIndexError::new_err)?];
        let roads = self.roads();
        let road = match road {
            None => 0,
            Some(name) => roads.iter().position(|road| *road == name).ok_or_else(|| {
                PyValueError::new_err(format!("no road `{name}`: it has {}", roads.join(", ")))
            })?,
        };
        let draws = self.table.draws(row, road).into_iter();
        Ok(draws
            .map(|DrawRecord { name, unit, low, high, values }| Draw { name, unit, low, high, values })
            .collect())
    }

    /// The path that it was compiled from.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Labels of the rows, by their numbers.
    #[getter]
    fn rows(&self) -> Vec<&str> {
        self.table.rows().iter().map(|row| row.label.as_str()).collect()
    }

    /// Names of the roads.
    #[getter]
    fn roads(&self) -> Vec<&str> {
        self.table.space().roads.iter().map(|road| road.name.as_str()).collect()
    }

    /// Names of the space's own states.
    #[getter]
    fn states(&self) -> Vec<&str> {
        self.table.space().states.iter().map(|state| state.name.as_str()).collect()
    }

    /// Observation period: how long a step drives, s.
    #[getter]
    fn step_s(&self) -> f64 {
        self.table.space().episode.step_s
    }

    /// Most steps of an episode.
    #[getter]
    fn step_limit(&self) -> u32 {
        self.table.space().episode.step_limit
    }

    /// What the space means: equal for two files that mean the same.
    #[getter]
    fn digest(&self) -> String {
        self.table.space().meaning.seal()
    }

    /// Warnings and remarks.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        diagnostics::list(py, &self.said)
    }

    // Gymnasium copies the arguments of an environment deeply; a space never changes.
    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __repr__(&self) -> String {
        let (rows, roads) = (self.table.rows().len(), self.roads().join(", "));
        format!("<avastra.Space {}: {rows} rows on {roads}>", self.path.display())
    }
}

/// A value that a row draws.
#[pyclass(frozen, get_all, module = "avastra")]
pub struct Draw {
    name: String,
    unit: String,
    low: Option<f64>,
    high: Option<f64>,
    values: Vec<String>,
}

#[pymethods]
impl Draw {
    fn __repr__(&self) -> String {
        let Draw { name, unit, low, high, values } = self;
        match (low, high) {
            (Some(low), Some(high)) => format!("<avastra.Draw {name}: {low} to {high} {unit}>"),
            _ if values.is_empty() => format!("<avastra.Draw {name}: any {unit}>"),
            _ => format!("<avastra.Draw {name}: {}>", values.join(", ")),
        }
    }
}

/// A variable of an observation.
#[pyclass(frozen, get_all, module = "avastra")]
pub struct Variable {
    name: &'static str,
    column: &'static str,
    unit: &'static str,
    low: Option<f64>,
    high: Option<f64>,
    words: Vec<(&'static str, f32)>,
}

#[pymethods]
impl Variable {
    fn __repr__(&self) -> String {
        format!("<avastra.Variable {} [{}]>", self.name, if self.unit.is_empty() { "1" } else { self.unit })
    }
}

/// The variables of a raw observation, in its order.
#[pyfunction]
pub fn variables() -> Vec<Variable> {
    let described = VARIABLES.iter().map(|variable| {
        let (unit, low, high, words) = match variable.kind {
            VariableKind::Quantity { unit, low, high } => (unit, low, high, Vec::new()),
            VariableKind::Words { words, .. } => {
                let values = words.iter().map(|(_, value)| f64::from(*value));
                let (low, high) = (values.clone().fold(f64::MAX, f64::min), values.fold(f64::MIN, f64::max));
                ("", Some(low), Some(high), words.to_vec())
            }
        };
        Variable { name: variable.name, column: variable.observed_as, unit, low, high, words }
    });
    described.collect()
}
