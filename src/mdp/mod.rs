//! The Markov decision process of the paper: its 19 state variables, the collision probability and the
//! reward.
//!
//! Beside the paper's equations stand the usual measures of criticality. A space may say by itself what a
//! collision probability is worth (`reward { … }`): `model` evaluates that.

mod closeness;
mod collision_probability;
mod criticality;
mod observation;
mod released_probability;
mod reward;
mod state;

pub use closeness::Closeness;
pub use collision_probability::ProcKind;
pub use collision_probability::ProcSettings;
pub use collision_probability::collision_probability;
pub use collision_probability::combined;
pub use collision_probability::lateral_safety_distance_m;
pub use collision_probability::longitudinal_safety_distance_m;
pub use collision_probability::opposing_safety_distance_m;
pub use collision_probability::probability;
pub use criticality::Criticality;
pub use criticality::Encroachment;
pub use criticality::deceleration_to_avoid_mps2;
pub use criticality::time_to_collision_s;
pub use observation::BEYOND_LEN;
pub use observation::BEYOND_NAMES;
pub use observation::Observation;
pub use observation::variable;
pub use released_probability::released_probability;
pub use reward::RewardSettings;
pub use reward::StepOutcome;
pub use reward::reward;
pub use state::PerceptionCounts;
pub use state::STATE_LEN;
pub use state::STATE_NAMES;
pub use state::StateVector;
pub use state::observe;
pub use state::perception_counts;
