//! Judgement: what kind of collision it was, whether it could be avoided, and whether a scenario's
//! claims hold.

mod avoidable;
mod facts;
mod hazard;
#[cfg(test)]
mod tests;
mod verify;

pub use avoidable::AvoidabilitySettings;
pub use avoidable::Judgement;
pub use avoidable::judge;
pub use avoidable::judge_one;
pub use facts::counted;
pub use facts::facts;
pub use verify::ClaimResult;
pub use verify::verify;
