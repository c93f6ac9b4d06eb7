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
pub mod statistics;
mod study;

pub use database::StudyDatabase;
pub use file::{AgentFile, EvaluationPlan, StudyFile};
pub use job::{Event, Job, play_jobs};
pub use measures::MEASURES;
pub use record::{CellRecord, Spent};
pub use results::{AgentResults, Comparison, Pooled, Rate, RoadResults, StudyResults};
pub use study::{AgentSettings, Study, StudyError, StudySettings, TrainingPlan};
