//! Judgement: what kind of collision it was, whether it could be avoided, and whether a scenario's
//! claims hold.

mod avoidable;
mod cause;
mod crash;
mod evidence;
mod counted;
mod hazard;
mod kept;
mod measured;
mod mechanisms;
mod severity;
mod shrink;
#[cfg(test)]
mod tests;
mod variation;
mod verify;

pub use avoidable::{
    AvoidabilitySettings, DrivenPlace, Judgement, ReferenceDrive, judge, judge_one, judge_with_drives,
};
pub use cause::{NoModules, diagnose, fate};
pub use counted::{counted, counted_at_need, counts, facts};
pub use crash::{Fate, Regression, regression};
pub use evidence::{
    Chance, Comparison, Diagnosis, Evidence, ModuleFinding, PairFinding, Verdict, WeaknessFinding,
};
pub use kept::{Breached, breached};
pub use measured::Measure;
pub use mechanisms::{
    MechanismShare, Mechanisms, Share, WithoutMechanism, mechanism_shares, mechanisms, placebo,
};
pub use severity::{Severity, severity};
pub use shrink::{Found, Shrunk, shrink, spare_steps};
pub use variation::{Likelihood, likelihood};
pub use verify::{ClaimResult, NoTries, Replays, verify};
