//! Training, and what was learned: episodes one after another, from each of which the agent learns.
//!
//! [`Training`] is the loop, made from [`TrainSettings`]; `record` keeps its episodes and checkpoints in `run.db`.
//! Three parts look at a finished policy, in the [`training_arena`] where it was trained. [`evaluate`] gives its figures,
//! [`distill`] turns its network into readable rules, and [`insight`] says why it chooses as it does.

mod distill;
mod evaluation;
mod importance;
mod insight;
mod record;
mod training;
mod visits;

pub use distill::{distill, judge_rules, rounded};
pub use evaluation::{Evaluation, evaluate};
pub use insight::{Insight, insight};
pub(crate) use training::with_period;
pub use training::{TrainSettings, TrainedEpisode, Training};
pub use visits::training_arena;
