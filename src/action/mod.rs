//! The action table: what an agent may choose, what its choice would do now, and which rule forbids it.
//!
//! An action reaches the world only through this table. Drawing (`offers`) and judging given values
//! (`check`) call the same judgement, `model::rules`. Which rows are dead on which road was found by `prove`.

mod audit;
mod draw;
mod effect;
mod file;
mod table;

pub use crate::model::SpawnFacts;
pub use audit::{Audit, Enforcement, RuleAudit, audit};
pub use effect::{Effect, LaneChangeRules, SpawnRequest, Surroundings};
pub use file::{AxisRecord, DrawRecord, RoadRecord, RowRecord, RuleRecord, TableFile};
pub use table::{ActionTable, Draw, Offer, Refusal, Situation};

#[cfg(test)]
mod tests;
