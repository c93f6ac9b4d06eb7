//! Crashes for other tools: an emitted scenario, played again, as a file that simulators and planners of others read.
//!
//! [`Recording`] is what a replay looked like, free of any format: what [`Recorder`](avastra_campaign::episode::Recorder) saw, and claims. Each format is a pure function from it to text. `import`
//! reads one thing back: the scenario itself (`standalone`).

mod commonroad;
mod csv;
mod openscenario;
mod recording;
mod standalone;
mod vertices;
mod xml;

pub use commonroad::commonroad;
pub use csv::csv;
pub use openscenario::{
    Ego, Others, SPEED_LIMIT, SpaceFile, SpaceFiles, Style, Version, Written, openscenario, space,
};
pub use recording::{ExportError, Recording, SCENARIO_TEXT, SCENARIO_TEXT_LACKS, record};

/// Everything has the same date: a file depends on its scenario alone.
const DATE: &str = "2026-01-01";
