//! Rows with values of the caller, and what is said of an episode that was played with them.

use std::sync::Arc;

use avastra::action::ActionTable;
use avastra::episode::{EpisodeLog, Outcome, StepLog};
use avastra::model::{Domain, Space, Type, Value};
use avastra::run::{Chosen, Measures};
use avastra::sim::{FRAME_TICKS, World};
use numpy::{PyArray1, PyArrayMethods as _};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};

/// A step as Python gives it: `None`, a row, a row and a dict of values, or a dict as a result has it.
pub fn chosen(table: &ActionTable, step: &Bound<'_, PyAny>) -> PyResult<Option<Chosen>> {
    if step.is_none() {
        return Ok(None);
    }
    let (row, given) = if let Ok(pair) = step.cast::<PyTuple>() {
        if pair.len() != 2 {
            return Err(PyValueError::new_err(format!(
                "a step is a row, or a row and a dict of values, not {step}"
            )));
        }
        (pair.get_item(0)?, Some(pair.get_item(1)?))
    } else if let Ok(pair) = step.cast::<PyList>().map(|list| list.to_tuple()) {
        return chosen(table, pair.as_any());
    } else if let Ok(carried) = step.cast::<PyDict>() {
        let missing = || PyValueError::new_err("a step has `row` and `values`");
        (carried.get_item("row")?.ok_or_else(missing)?, carried.get_item("values")?)
    } else {
        (step.clone(), None)
    };
    // That a step had no row is told so.
    if step.is_instance_of::<PyDict>() && row.extract::<i64>().is_ok_and(|row| row == -1) {
        return Ok(None);
    }
    let row = whole(table, &row)?;
    let values = given.filter(|given| !given.is_none());
    let values = values.map_or(Ok(Vec::new()), |given| values_of(table, row, given.cast::<PyDict>()?));
    Ok(Some(Chosen { row, values: values? }))
}

/// A row, if there is one of that number.
pub fn known_row(table: &ActionTable, row: i64) -> Result<usize, String> {
    let last = table.rows().len() - 1;
    let known = usize::try_from(row).ok().filter(|row| *row <= last);
    known.ok_or_else(|| format!("no row {row}: the table has rows 0 to {last}"))
}

/// The number of a row.
fn whole(table: &ActionTable, row: &Bound<'_, PyAny>) -> PyResult<usize> {
    if row.is_instance_of::<PyBool>() {
        return Err(PyTypeError::new_err(format!("a row is a whole number, not {row}")));
    }
    let number: i64 =
        row.extract().map_err(|_| PyTypeError::new_err(format!("a row is a whole number, not {row}")))?;
    known_row(table, number).map_err(PyValueError::new_err)
}

/// Values by the names of parameters: a number in SI, a truth value, or the word of a choice.
pub fn values_of(
    table: &ActionTable,
    row: usize,
    given: &Bound<'_, PyDict>,
) -> PyResult<Vec<(Arc<str>, Value)>> {
    let space = table.space();
    let action = &space.actions[table.rows()[row].action];
    let mut values = Vec::new();
    for (name, value) in given {
        let name: String = name.extract()?;
        let Some(parameter) = action.drawn().find(|parameter| *parameter.name == *name) else {
            let names: Vec<&str> = action.drawn().map(|parameter| &*parameter.name).collect();
            let all = if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
            return Err(PyValueError::new_err(format!("`{}` draws no `{name}`, but {all}", action.name)));
        };
        let wrong = |wanted: &str| PyTypeError::new_err(format!("`{name}` is {wanted}, not {value}"));
        // A choice is given as `Space.draws` lists it, too.
        let listed = value.extract::<String>().ok().and_then(|word| match &parameter.domain {
            Domain::Values(values) => values.iter().find(|one| space.show_in_si(**one, parameter.ty) == word),
            Domain::Range(..) => None,
        });
        if let Some(listed) = listed {
            values.push((Arc::clone(&parameter.name), *listed));
            continue;
        }
        let value = match parameter.ty {
            Type::Bool => Value::Bool(value.cast::<PyBool>().map_err(|_| wrong("True or False"))?.is_true()),
            Type::Enum(of) => {
                let word: String = value.extract().map_err(|_| wrong("a word"))?;
                let variants = &space.enums[of.0].variants;
                let variant = variants.iter().position(|variant| *variant == word);
                Value::Variant(of, variant.ok_or_else(|| wrong(&format!("one of {}", variants.join(", "))))?)
            }
            Type::Int | Type::Quantity(_) => {
                if value.is_instance_of::<PyBool>() {
                    return Err(wrong("a number"));
                }
                let number: f64 = value.extract().map_err(|_| wrong("a number"))?;
                if !number.is_finite() {
                    return Err(PyValueError::new_err(format!("`{name}` is {number}: give a finite number")));
                }
                Value::Number(number)
            }
        };
        if let Domain::Values(listed) = &parameter.domain
            && !listed.contains(&value)
        {
            let all: Vec<String> = listed.iter().map(|one| space.show_in_si(*one, parameter.ty)).collect();
            return Err(PyValueError::new_err(format!("`{name}` is one of {}", all.join(", "))));
        }
        values.push((Arc::clone(&parameter.name), value));
    }
    Ok(values)
}

/// What was carried out in a step: `row` (-1: none), `values`, and why a row was `refused`.
pub fn carried_out<'py>(
    py: Python<'py>,
    table: &ActionTable,
    step: &StepLog,
) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    let (row, refused) = match &step.outcome {
        Outcome::Done { draw, .. } => (draw.row as i64, None),
        Outcome::Passed => (-1, None),
        Outcome::Refused { rule, reason, .. } => {
            (-1, Some(rule.as_ref().map_or_else(|| reason.clone(), |rule| format!("{rule}: {reason}"))))
        }
    };
    told.set_item("row", row)?;
    told.set_item("refused", refused)?;
    told.set_item("values", drawn(py, table.space(), step)?)?;
    Ok(told)
}

/// The drawn values of a step.
fn drawn<'py>(py: Python<'py>, space: &Space, step: &StepLog) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    if let Outcome::Done { draw, .. } = &step.outcome {
        for (name, value) in &draw.values {
            match *value {
                Value::Bool(truth) => values.set_item(&**name, truth)?,
                Value::Number(number) => values.set_item(&**name, number)?,
                Value::Variant(of, variant) => {
                    values.set_item(&**name, &space.enums[of.0].variants[variant])?
                }
            }
        }
    }
    Ok(values)
}

/// How near it came to others.
pub fn measures<'py>(py: Python<'py>, measures: &Measures) -> PyResult<Bound<'py, PyDict>> {
    let Measures { distance_m, criticality } = measures;
    let told = PyDict::new(py);
    told.set_item("distance_m", distance_m)?;
    told.set_item("ttc_s", criticality.ttc_s)?;
    told.set_item("thw_s", criticality.thw_s)?;
    told.set_item("drac_mps2", criticality.drac_mps2)?;
    told.set_item("required_mps2", criticality.required_mps2)?;
    told.set_item("rss_unsafe_s", criticality.rss_unsafe_s)?;
    Ok(told)
}

/// The smallest margin of each requirement in force, SI; `None` of one that was never asked for, or that has no margin.
pub fn margins<'py>(py: Python<'py>, space: &Space, log: &EpisodeLog) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    for margin in &log.margins {
        told.set_item(&space.requirements[margin.requirement].name, margin.smallest)?;
    }
    Ok(told)
}

/// The breaches of requirements, by rising time.
pub fn breaches<'py>(py: Python<'py>, space: &Space, log: &EpisodeLog) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for breach in &log.breaches {
        let told = PyDict::new(py);
        told.set_item("requirement", &space.requirements[breach.requirement].name)?;
        told.set_item("time_s", breach.time_s)?;
        told.set_item("until_s", breach.until_s)?;
        told.set_item("margin", breach.margin)?;
        told.set_item("npc", breach.obstacle)?;
        list.append(told)?;
    }
    Ok(list)
}

/// Where everybody was, every 0.1 s: rows of time (s), place (m), heading (rad) and speed (m/s).
#[derive(Default)]
pub struct Trajectories {
    ego: Vec<[f64; 5]>,
    others: Vec<(u32, Vec<[f64; 5]>)>,
}

impl Trajectories {
    pub fn note(&mut self, world: &World) {
        if !world.ticks().is_multiple_of(FRAME_TICKS) {
            return;
        }
        let (ego, time_s) = (world.ego(), world.time_s());
        let at = ego.rear_axle;
        self.ego.push([time_s, at.position.x, at.position.y, at.heading_rad, ego.speed_mps]);
        for other in world.obstacles() {
            let at = other.outline.pose;
            let row = [time_s, at.position.x, at.position.y, at.heading_rad, other.velocity_mps.norm()];
            match self.others.iter_mut().find(|(id, _)| *id == other.id) {
                Some((_, rows)) => rows.push(row),
                None => self.others.push((other.id, vec![row])),
            }
        }
    }

    /// `{"ego": array, "npc": {number: array}}`, each of shape (moments, 5).
    pub fn told<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let array = |rows: &[[f64; 5]]| {
            PyArray1::from_vec(py, rows.iter().flatten().copied().collect()).reshape([rows.len(), 5])
        };
        let others = PyDict::new(py);
        for (id, rows) in &self.others {
            others.set_item(id, array(rows)?)?;
        }
        let told = PyDict::new(py);
        told.set_item("ego", array(&self.ego)?)?;
        told.set_item("npc", others)?;
        Ok(told)
    }
}
