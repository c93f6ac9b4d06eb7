//! Runs and trainings: many episodes, judged, counted and kept.

mod arena;
mod database;
mod measures;
mod profile;
mod run;
mod summary;
mod train;

pub use arena::Arena;
pub use arena::DEFAULT_ADS;
pub use arena::driving_system;
pub use database::Database;
pub use database::DatabaseError;
pub use database::RefusalCount;
pub use database::Totals;
pub use measures::Measures;
pub use profile::Profile;
pub use profile::recorded;
pub use run::EPISODES_MAX;
pub use run::PolicyReference;
pub use run::Run;
pub use run::RunError;
pub use run::RunSettings;
pub use run::Stage;
pub use run::judge_replay;
pub use run::play;
pub use run::replay;
pub use run::replay_with;
pub use summary::EpisodeSummary;
pub use summary::Finding;
pub use train::Checkpoint;
pub use train::Evaluation;
pub use train::TrainSettings;
pub use train::TrainedEpisode;
pub use train::Training;
pub use train::evaluate;
