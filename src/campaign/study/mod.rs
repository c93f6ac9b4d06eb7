//! Studies: agents compared over roads and independent repetitions, with statistics.
//!
//! A [`StudyFile`] says in short what to compare. [`StudySettings`] say the same in full. [`Study`] cuts them into jobs: one
//! training and its evaluation, or one repetition of an agent that has nothing to learn. Jobs know nothing of each other.
//! So the result depends neither on how many run at a time nor on interruptions. [`play_jobs`] plays them on threads. Each
//! road of a job becomes a [`CellRecord`] in [`StudyDatabase`]. [`StudyResults`] are computed from the cells alone: a number
//! for each cell and measure (`measures`), then [`statistics`] over them. [`Played`] is kept beside the study's file: these
//! numbers as text, from which the statistics follow again. [`Agreement`] compares them with published figures.
//!
//! [`statistics`]: avastra_base::statistics
//!
//! ```
//! use avastra_campaign::study::StudyFile;
//!
//! let file = StudyFile::from_yaml("space: mine.ava\nagents: [{ name: random, repeats: 3 }]\n")?;
//! assert_eq!((file.evaluation.episodes, file.evaluation.seeds), (15, 5));
//! assert!(StudyFile::from_yaml("space: mine.ava\nagents: [{ name: random, repats: 3 }]\n").is_err());
//! # Ok::<(), String>(())
//! ```

mod agreement;
mod database;
mod failed;
mod file;
mod found;
mod job;
mod measures;
mod played;
mod ready;
mod record;
mod results;
mod reuse;
mod settings;

pub use agreement::{Agreement, ComparedFigure, ComparedPair, P_MAX, Verdict};
pub(crate) use database::LAYOUT;
pub use database::StudyDatabase;
pub use failed::FailedCell;
pub use file::{PublishedTable, StudyFile};
pub use job::{Event, Job, play_jobs};
pub use played::{Departures, Played};
pub use ready::Study;
pub use record::{CellRecord, Spent};
pub use results::{
    AgentResults, BaselineComparison, MeasuredAgent, MeasuredRoad, Rate, RoadResults, StudyResults,
    measured_roads,
};
pub use settings::{AgentSettings, QUICK_EPISODES, QUICK_REPEATS, StudyError, StudySettings};
