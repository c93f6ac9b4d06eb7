//! What the compiler says, as Python objects.

use avastra::cli::embedded::{Said, Unusable};
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

create_exception!(
    avastra,
    SpaceError,
    PyValueError,
    "A space cannot be used. `diagnostics` has what the compiler says, one dict each; empty if the file cannot be read."
);

/// The exception for a space that cannot be used.
pub fn error(py: Python<'_>, reason: Unusable) -> PyErr {
    let (text, said) = match reason {
        Unusable::File(reason) => (reason, Vec::new()),
        Unusable::Mistakes(said) => {
            let texts: Vec<&str> = said.iter().map(|one| one.text.trim_end()).collect();
            (texts.join("\n\n"), said)
        }
    };
    let error = SpaceError::new_err(text);
    match list(py, &said).and_then(|list| error.value(py).setattr("diagnostics", list)) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// Diagnostics as dicts: `code`, `severity`, `message`, `help`, `file`, `line`, `column` (from 1; `None` without a place)
/// and `text`, as `avastra check` prints it.
pub fn list<'py>(py: Python<'py>, said: &[Said]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for Said { record, text } in said {
        let labels = &record.labels;
        let place = labels.iter().find(|label| label.primary).or(labels.first()).map(|label| &label.place);
        let one = PyDict::new(py);
        one.set_item("code", record.code)?;
        one.set_item("severity", format!("{:?}", record.severity).to_lowercase())?;
        one.set_item("message", &record.message)?;
        one.set_item("help", &record.help)?;
        one.set_item("file", place.map(|place| &place.file))?;
        one.set_item("line", place.map(|place| place.line))?;
        one.set_item("column", place.map(|place| place.column))?;
        one.set_item("text", text)?;
        list.append(one)?;
    }
    Ok(list)
}
