//! Studies: agents compared over roads and independent repetitions, with statistics.
//!
//! A study is cut into jobs (one training and its evaluation, or one repetition of an agent that has nothing
//! to learn). Jobs know nothing of each other, so the result depends neither on how many are under way at a
//! time nor on how often the study was interrupted.

mod database;
mod file;
mod job;
mod measures;
mod record;
mod results;
mod study;

pub use database::StudyDatabase;
pub use file::AgentFile;
pub use file::EvaluationPlan;
pub use file::StudyFile;
pub use job::Event;
pub use job::Job;
pub use job::play_jobs;
pub use measures::MEASURES;
pub use record::CellRecord;
pub use record::Spent;
pub use results::AgentResults;
pub use results::Comparison;
pub use results::Pooled;
pub use results::Rate;
pub use results::RoadResults;
pub use results::StudyResults;
pub use study::AgentSettings;
pub use study::Study;
pub use study::StudyError;
pub use study::StudySettings;
pub use study::TrainingPlan;
