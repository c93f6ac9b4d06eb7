//! What a trained policy does and why: rules distilled from it, and how it comes to its choices.

mod distill;
mod importance;
mod insight;
mod visits;

pub use distill::{distill, judge_rules, rounded};
pub use importance::Importance;
pub use insight::{Insight, RowUse, State, insight};
