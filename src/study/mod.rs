//! Studies: agents compared over roads and independent repetitions, with statistics.
//!
//! A [`StudyFile`] says in short what to compare; [`StudySettings`] are the same in full, and [`Study`] cuts them into
//! jobs: one training and its evaluation, or one repetition of an agent that has nothing to learn. Jobs know nothing
//! of each other, so the result depends neither on how many run at a time nor on interruptions. [`play_jobs`] plays
//! them on threads, each road of a job becomes a [`CellRecord`] in [`StudyDatabase`], and [`StudyResults`] are
//! computed from the cells alone: a number for each cell and measure (`measures`), then [`statistics`] over them.
//!
//! [`statistics`]: crate::statistics

mod database;
mod failed;
mod file;
mod job;
mod measures;
mod ready;
mod record;
mod results;
mod settings;

pub use database::StudyDatabase;
pub use failed::FailedCell;
pub use file::StudyFile;
pub use job::{Event, play_jobs};
pub use ready::Study;
pub use record::{CellRecord, Spent};
pub use results::{AgentResults, BaselineComparison, Rate, RoadResults, StudyResults};
pub use settings::{StudyError, StudySettings};
