//! Tables of run databases as NumPy arrays.

use std::path::PathBuf;

use avastra::oracle::Recurrence;
use avastra::run::{Values, columns};
use numpy::{PyArray1, ToPyArray as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A table of a run's database, by the names of its columns. Numbers are copied once, out of the file.
#[pyfunction]
pub fn read_table(py: Python<'_>, file: PathBuf, table: String) -> PyResult<Bound<'_, PyDict>> {
    let found = py.detach(|| columns(&file, &table));
    let found =
        found.map_err(|error| PyValueError::new_err(format!("cannot read `{}`: {error}", file.display())))?;
    let arrays = PyDict::new(py);
    for column in found {
        let array = match column.values {
            Values::Real(values) => PyArray1::from_vec(py, values).into_any(),
            Values::Integer(values) => PyArray1::from_vec(py, values).into_any(),
            // A seed has 64 bits without a sign, more than SQLite's integers.
            Values::Text(texts) if column.name == "seed" => {
                let seeds = texts.iter().map(|text| text.as_deref().unwrap_or("").parse::<u64>());
                let seeds: Result<Vec<u64>, _> = seeds.collect();
                seeds.map_err(|_| PyValueError::new_err("a seed is no number"))?.to_pyarray(py).into_any()
            }
            Values::Text(texts) => {
                let objects = texts.into_iter().map(|text| Ok(text.into_pyobject(py)?.unbind()));
                PyArray1::from_vec(py, objects.collect::<PyResult<Vec<Py<PyAny>>>>()?).into_any()
            }
        };
        arrays.set_item(column.name, array)?;
    }
    Ok(arrays)
}

/// Whether a finding recurs that happened again in so many of so many replays, as every command and page says it.
#[pyfunction]
pub fn recurs(recurred: u32, replays: u32) -> PyResult<bool> {
    if recurred > replays {
        return Err(PyValueError::new_err(format!("{recurred} of {replays} replays")));
    }
    Ok(Recurrence { recurred, replays }.recurs())
}
