//! What a trained policy does and why: rules distilled from it, and how it comes to its choices.

mod distill;
mod importance;
mod insight;
mod visits;

pub use distill::distill;
pub use distill::judge_rules;
pub use distill::rounded;
pub use importance::Importance;
pub use insight::Insight;
pub use insight::RowUse;
pub use insight::State;
pub use insight::insight;
