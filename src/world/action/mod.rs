//! The action table: what an agent may choose, what its choice would do now, and which rule forbids it.
//!
//! An action reaches the world only through this table. Drawing (`offers`) and judging given values
//! (`check`) call the same judgement, `model::rules`. Which rows are dead on which road was found by `prove`.
//!
//! ```
//! use std::path::Path;
//!
//! use avastra_world::action::ActionTable;
//! use avastra_lang::check::load;
//!
//! let text = "language 1\nenum Time = Noon | Night\nstate time: Time = Noon\naction set(each to: Time) { set time = to }\n";
//! let space = load(Path::new("mine.ava"), &|_| Ok(text.to_owned()))?.space.expect("it has no mistakes");
//! let labels: Vec<String> = ActionTable::new(space).rows().iter().map(|row| row.label.clone()).collect();
//! assert_eq!(labels, ["set(to: Noon)", "set(to: Night)"]);
//! # Ok::<(), avastra_lang::check::ReadError>(())
//! ```

mod audit;
mod count;
mod course;
mod draw;
mod effect;
mod file;
mod later;
mod table;

pub use audit::{Audit, Enforcement, RuleAudit, audit};
pub use avastra_lang::model::SpawnFacts;
pub use count::Count;
pub use course::Course;
pub use effect::{
    Begins, Effect, LaneChangeRules, LightRequest, OnTrajectory, OrderRequest, SpawnRequest, Surroundings,
};
pub(crate) use effect::{GAP_TO_ITSELF, GAP_TO_NOBODY};
pub use file::{AxisRecord, DrawRecord, RoadRecord, RowRecord, RuleRecord, TableFile};
pub use later::LaterMoment;
pub use table::{ActionTable, Draw, Offer, Refusal, RowOdds, Situation};

#[cfg(test)]
mod tests;
