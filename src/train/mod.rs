//! Training, and what was learned: episodes one after another, from each of which the agent learns.
//!
//! [`Training`] is the loop, [`Checkpoint`] what is kept of it, [`evaluate`] the figures of a finished policy.
//! [`distill`] turns a network into readable lines; [`insight`] tells why a policy chooses as it does.

mod distill;
mod evaluation;
mod importance;
mod insight;
mod record;
mod training;
mod visits;

pub use distill::{distill, judge_rules, rounded};
pub use evaluation::{Evaluation, evaluate};
pub use importance::Importance;
pub use insight::{Insight, RowUse, State, insight};
pub use record::Checkpoint;
pub(crate) use training::with_period;
pub use training::{TrainSettings, TrainedEpisode, Training};
pub use visits::training_arena;
