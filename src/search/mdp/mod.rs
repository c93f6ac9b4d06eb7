//! The Markov decision process of the paper: its 19 state variables, the collision probability and the
//! reward.
//!
//! `criticality` has the usual measures of danger beside them. A space may define its own `reward { … }`,
//! which `model` evaluates.

mod collision_probability;
mod criticality;
mod observation;
mod released_probability;
mod reward;
mod state;

pub use collision_probability::{Danger, ProcKind};
pub use criticality::{Criticality, LeastEncroachment};
pub use observation::{Observation, variable};
pub use reward::{RewardSettings, StepOutcome, reward};
pub use state::{PerceptionCounts, STATE_LEN, StateVector, perception_counts};
