//! Episodes: the loop in which somebody acts, the world moves, and a log is kept.
//!
//! Does not know which agent or which driving system it runs.

mod log;
mod run;
mod script;
mod setup;

pub use log::Collision;
pub use log::End;
pub use log::EpisodeLog;
pub use log::Outcome;
pub use log::StepLog;
pub use run::Choice;
pub use run::Moment;
pub use run::Snapshot;
pub use run::Watch;
pub use run::go_on;
pub use run::run;
pub use run::run_to_last;
pub use script::Script;
pub use script::ScriptedAction;
pub use setup::Setup;
pub use setup::scene;
pub use setup::start;
