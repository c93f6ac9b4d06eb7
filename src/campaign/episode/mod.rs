//! Episodes: the loop of choosing an action, driving for one observation period and writing the log.
//!
//! [`run`] plays an episode from a [`Setup`] with any choices: of an agent, or of a [`Script`]. A [`Play`] is one under way.
//!
//! Does not know which agent or which driving system it runs.

mod chronicle;
mod facts;
mod log;
mod margins;
mod monitor;
mod precrash;
mod recorder;
mod run;
mod script;
mod setup;
mod shape;
mod trails;

pub use facts::{at_fault, collision_facts, run_into_from_behind, side, struck};
pub use log::{Collision, End, EpisodeLog, Held, Outcome, StepLog};
pub use margins::MarginSeries;
pub use monitor::{Breach, Margin};
pub use precrash::PreCrash;
pub use recorder::{Actor, Lights, Phase, Recorder, Sample, Sky, Touch};
pub use run::{Choice, Moment, Play, Watch, run, run_from, run_watched, run_with_margins};
pub use script::{Script, ScriptedAction};
pub use setup::Setup;
pub use shape::Shape;
