//! Runs: many episodes, judged, counted and kept.

mod database;
mod run;
mod summary;

pub use database::Database;
pub use database::DatabaseError;
pub use database::Totals;
pub use run::DEFAULT_ADS;
pub use run::EPISODES_MAX;
pub use run::Run;
pub use run::RunError;
pub use run::RunSettings;
pub use run::judge_replay;
pub use run::play;
pub use run::replay;
pub use summary::EpisodeSummary;
pub use summary::Finding;
