//! Runs: many episodes, judged, counted and kept.

mod database;
mod run;
mod summary;

pub use database::Database;
pub use database::DatabaseError;
pub use database::Totals;
pub use run::DEFAULT_ADS;
pub use run::EPISODES_MAX;
pub use run::Profile;
pub use run::Run;
pub use run::RunError;
pub use run::RunSettings;
pub use run::driving_system;
pub use run::play;
pub use run::recorded;
pub use run::replay;
pub use run::replay_with;
pub use summary::EpisodeSummary;
pub use summary::Finding;
