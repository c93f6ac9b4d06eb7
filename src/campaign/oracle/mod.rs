//! Judgement: what kind of collision it was, whether it could be avoided, and whether a scenario's
//! claims hold.

mod avoidable;
mod case;
mod cause;
mod evidence;
mod counted;
mod hazard;
mod kept;
mod lawful;
mod measured;
mod moment;
mod recurrence;
mod severity;
mod shrink;
mod swaps;
#[cfg(test)]
mod tests;
mod verify;

pub use avoidable::{
    AvoidabilitySettings, DrivenPlace, Judgement, ReferenceDrive, judge, judge_one, judge_with_drives,
};
pub use case::{Fate, Found, Regression, regression};
pub use cause::{NoModules, diagnose, fate};
pub use counted::{counted, counted_at_need, counts, facts, unmet};
pub use evidence::{
    Chance, Comparison, Diagnosis, Evidence, ModuleFinding, PairFinding, Verdict, WeaknessFinding,
};
pub use kept::{Breached, breached};
pub use measured::Measure;
pub use moment::{Branched, NoReturn, is_likely, no_return, recurrence_from};
pub use recurrence::{MIXED, REPLAYS, Recurrence, Replayed, can_replay, can_tell, mixed_text};
pub use severity::{Harm, Severity, severity};
pub use shrink::{Shrunk, Worth, shrink, spare_steps};
pub use swaps::{Change, HangsOn, Response, Swap, Swaps, swaps};
pub use verify::{ClaimResult, NoTries, Replays, verify};
