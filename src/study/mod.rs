//! Runs and trainings: many episodes, judged, counted and kept.

mod arena;
mod comparison;
mod database;
mod groups;
mod measures;
mod policy;
mod profile;
mod run;
mod shape;
pub mod statistics;
mod summary;
mod train;
mod trial;

pub use arena::{Arena, DEFAULT_ADS, driving_system};
pub use comparison::{
    AgentFile, AgentResults, AgentSettings, CellRecord, Comparison, EvaluationPlan, Event, Job, MEASURES,
    Pooled, Rate, RoadResults, Spent, Study, StudyDatabase, StudyError, StudyFile, StudyResults,
    StudySettings, TrainingPlan, play_jobs,
};
pub use database::{Database, DatabaseError, RefusalCount, Totals};
pub use groups::Group;
pub use measures::Measures;
pub use policy::{Importance, Insight, RowUse, State, distill, insight, judge_rules, rounded};
pub use profile::{Profile, recorded, trained_against};
pub use run::{EPISODES_MAX, PolicyReference, Run, RunError, RunSettings, Stage, play};
pub use shape::Shape;
pub use summary::{EpisodeSummary, Finding};
pub use train::{Checkpoint, Evaluation, TrainSettings, TrainedEpisode, Training, evaluate, evaluate_agent};
pub use trial::{Cell, Count, Outcome as TrialOutcome, Sample, TrialSettings, Trials};
