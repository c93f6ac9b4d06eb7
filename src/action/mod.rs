//! The action table: what an agent may choose, what its choice would do now, and which rule forbids it.
//!
//! Rules are enforced here and nowhere else: drawing (`offers`) and judging given values (`check`)
//! evaluate the same compiled rules. Which rows are dead on which road was found by `model`.

mod audit;
mod draw;
mod effect;
mod file;
mod rules;
mod table;

pub use audit::Audit;
pub use audit::Enforcement;
pub use audit::RuleAudit;
pub use audit::audit;
pub use effect::Effect;
pub use effect::SpawnFacts;
pub use effect::SpawnRequest;
pub use effect::Surroundings;
pub use file::AxisRecord;
pub use file::DrawRecord;
pub use file::RoadRecord;
pub use file::RowRecord;
pub use file::RuleRecord;
pub use file::TableFile;
pub use rules::ActiveRules;
pub use rules::UnknownRule;
pub use table::ActionTable;
pub use table::Draw;
pub use table::Offer;
pub use table::Refusal;
pub use table::Situation;

#[cfg(test)]
mod tests;
