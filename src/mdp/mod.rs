//! The Markov decision process of the paper: its 19 state variables and the collision probability.
//!
//! The paper's equations and nothing else. What a collision probability is worth is written in the
//! space (`reward { … }`) and evaluated by `model`.

mod collision_probability;
mod state;

pub use collision_probability::ProcSettings;
pub use collision_probability::collision_probability;
pub use collision_probability::combined;
pub use collision_probability::lateral_safety_distance_m;
pub use collision_probability::longitudinal_safety_distance_m;
pub use collision_probability::opposing_safety_distance_m;
pub use collision_probability::probability;
pub use state::PerceptionCounts;
pub use state::STATE_LEN;
pub use state::STATE_NAMES;
pub use state::StateVector;
pub use state::observe;
pub use state::perception_counts;
