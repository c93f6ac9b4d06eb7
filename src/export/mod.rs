//! Crashes for other tools: an emitted scenario, played again, as a file that simulators and planners of others read.
//!
//! [`Recording`] is what a replay looked like, free of any format: where every road user was at every tick, sky, lights,
//! contacts and claims. Each format is a pure function from it to text. Nothing here is read back.

mod commonroad;
mod csv;
mod openscenario;
mod recording;
mod vertices;
mod xml;

pub use commonroad::commonroad;
pub use csv::csv;
pub use openscenario::{Ego, Version, openscenario};
pub use recording::{Actor, ExportError, Lights, Recording, Sample, Sky, Touch, record};

/// Everything has the same date: a file depends on its scenario alone.
const DATE: &str = "2026-01-01";
