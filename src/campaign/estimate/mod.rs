//! How often would it crash? The probability of an event in an episode under the odds that a space and an agent state, and
//! the rate in 1,000 km, with intervals.
//!
//! An [`Estimate`] consists of independent parts, each with its own seeds, played on any number of threads. A part counts
//! ([`Method::Count`]: crude Monte Carlo), or it also tries rows that chance did not choose ([`Method::Probe`]: importance
//! sampling, see `probing` and `plan`). Both are unbiased if the number of parts is fixed. Rules that stop early
//! ([`Stopping`]) bias the probability a little, since they look at it or at related figures. The interval stays valid,
//! because the looks share the chance of a miss (Bonferroni). The gain over counting is printed. [`Comparison`] plays two
//! driving systems in the same episodes.

mod compare;
mod database;
mod part;
mod plan;
mod probing;
mod ready;
mod results;
mod settings;

pub use compare::{Comparison, ComparisonResults, Pair, Side, compared};
pub(crate) use database::LAYOUT;
pub use database::{EstimateDatabase, PILOT};
pub use part::{Event, Met, Part, PartRecord, Played, play_parts};
pub use plan::{Pilot, Plan};
pub use probing::pilot;
pub use ready::Estimate;
pub use results::{EstimateResults, FRAME, Found, Mass, Probability, RoadEstimate};
pub use settings::{EstimateError, EstimateSettings, EventKind, Method, Stopping};
