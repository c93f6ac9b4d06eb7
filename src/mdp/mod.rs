//! The Markov decision process of the paper: its 19 state variables, the collision probability and the
//! reward.
//!
//! `criticality` has the usual measures of danger beside them. A space may define a reward of its own
//! (`reward { … }`), which `model` evaluates.

mod closeness;
mod collision_probability;
mod criticality;
mod observation;
mod released_probability;
mod reward;
mod state;

pub use closeness::Closeness;
pub use collision_probability::{
    ProcKind, ProcSettings, collision_probability, combined, lateral_safety_distance_m,
    longitudinal_safety_distance_m, opposing_safety_distance_m, probability,
};
pub use criticality::{Criticality, Encroachment, deceleration_to_avoid_mps2, time_to_collision_s};
pub use observation::{BEYOND_LEN, Observation, variable};
pub use released_probability::released_probability;
pub use reward::{RewardSettings, StepOutcome, reward};
pub use state::{PerceptionCounts, STATE_LEN, StateVector, observe, perception_counts};
