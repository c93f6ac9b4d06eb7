//! Training: episodes one after another, from each of which the agent learns.

mod evaluation;
mod record;
mod training;

pub use evaluation::{Evaluation, evaluate, evaluate_agent};
pub use record::Checkpoint;
pub(super) use training::with_period;
pub use training::{TrainSettings, TrainedEpisode, Training};
