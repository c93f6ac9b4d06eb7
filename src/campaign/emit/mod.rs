//! Results as source files: an episode log becomes a scenario of its space, and a trained agent becomes a policy.
//!
//! Builds syntax trees; `syntax` prints them.

mod place;
mod policy;
mod safetensors;
mod scenario;
mod tree;

pub use place::{identifier, lane_point, quoted};
pub use policy::policy_text;
pub use safetensors::safetensors;
pub use scenario::{Provenance, action_text, retold, scenario, unclaimed, whole};
pub use tree::is_emitted;
