//! Training: episodes one after another, from each of which the agent learns.

mod evaluation;
mod record;
mod training;

pub use evaluation::Evaluation;
pub use evaluation::evaluate;
pub use evaluation::evaluate_agent;
pub use record::Checkpoint;
pub use training::TrainSettings;
pub use training::TrainedEpisode;
pub use training::Training;
pub(super) use training::with_period;
