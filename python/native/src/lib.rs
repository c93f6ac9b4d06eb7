//! The engine of avastra as the Python module `avastra._native`; `python/avastra/_native.pyi` describes it.
//!
//! Spaces are read by `avastra::cli::embedded`, episodes are stepped by `avastra::run::Stepped`. What is decided here is how
//! a learner sees them: observations raw or scaled, rewards of the space or judged. Python's lock is released while an
//! episode drives.

mod chosen;
mod diagnostics;
mod episodes;
mod info;
mod space;
mod step_all;
mod tables;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command `avastra` with a command line, whose first word is the program's name; its exit status.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| avastra::cli::main_of(words))
}

/// The engine of avastra.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("ENGINE", avastra::sim::ENGINE)?;
    module.add("SpaceError", module.py().get_type::<diagnostics::SpaceError>())?;
    module.add("EpisodeError", module.py().get_type::<episodes::EpisodeError>())?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_class::<space::Space>()?;
    module.add_class::<space::Draw>()?;
    module.add_class::<space::Variable>()?;
    module.add_class::<episodes::Episodes>()?;
    module.add_class::<episodes::Snapshot>()?;
    module.add_function(wrap_pyfunction!(space::variables, module)?)?;
    module.add_function(wrap_pyfunction!(step_all::step_all, module)?)?;
    module.add_function(wrap_pyfunction!(episodes::episode_seed, module)?)?;
    module.add_function(wrap_pyfunction!(tables::recurs, module)?)?;
    module.add_function(wrap_pyfunction!(tables::read_table, module)?)
}
