//! Episodes: the loop in which somebody acts, the world moves, and a log is kept.
//!
//! Does not know which agent or which driving system it runs.

mod log;
mod run;
mod script;
mod setup;

pub use log::{Collision, End, EpisodeLog, Outcome, StepLog};
pub use run::{Choice, Moment, Snapshot, Watch, go_on, run, run_to_last};
pub use script::{Script, ScriptedAction};
pub use setup::{Setup, scene, start};
