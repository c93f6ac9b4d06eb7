//! How often would it crash: the probability of an event in an episode under the odds that a space and an agent state,
//! and the rate in 1,000 km, with intervals.
//!
//! An [`Estimate`] consists of independent parts, each with seeds of its own, played on any number of threads. A part
//! either counts ([`Method::Count`]: crude Monte Carlo) or splits ([`Method::Split`]: adaptive multilevel
//! splitting, see `splitting`). Both are unbiased for agents that do not look ahead. What splitting gains over counting
//! is measured and printed; where it was tried (probabilities of 0.1 to 0.005) it was a loss. [`Comparison`] plays two
//! driving systems in the same episodes.

mod compare;
mod database;
mod part;
mod ready;
mod results;
mod settings;
mod splitting;

pub use compare::{Comparison, ComparisonResults, Pair, Side, compared};
pub use database::EstimateDatabase;
pub use part::{Part, PartRecord, play_parts};
pub use ready::Estimate;
pub use results::{EstimateResults, Probability, RoadEstimate};
pub use settings::{EstimateError, EstimateSettings, EventKind, Method};
