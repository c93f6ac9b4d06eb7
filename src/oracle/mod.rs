//! Judgement: what kind of collision it was, whether it could be avoided, and whether a scenario's
//! claims hold.

mod avoidable;
mod cause;
mod crash;
mod facts;
mod hazard;
mod mechanisms;
mod severity;
mod shrink;
#[cfg(test)]
mod tests;
mod variation;
mod verify;

pub use avoidable::AvoidabilityError;
pub use avoidable::AvoidabilitySettings;
pub use avoidable::Judgement;
pub use avoidable::judge;
pub use avoidable::judge_one;
pub use cause::Diagnosis;
pub use cause::ModuleFinding;
pub use cause::NoModules;
pub use cause::WeaknessFinding;
pub use cause::diagnose;
pub use cause::fate;
pub use crash::Fate;
pub use crash::Regression;
pub use crash::regression;
pub use facts::counted;
pub use facts::facts;
pub use mechanisms::MechanismShare;
pub use mechanisms::Share;
pub use mechanisms::WithoutMechanism;
pub use mechanisms::mechanism_shares;
pub use mechanisms::mechanisms;
pub use severity::Severity;
pub use severity::severity;
pub use shrink::Shrunk;
pub use shrink::shrink;
pub use shrink::spare_steps;
pub use variation::Likelihood;
pub use variation::likelihood;
pub use variation::wilson;
pub use verify::ClaimResult;
pub use verify::Replays;
pub use verify::verify;
