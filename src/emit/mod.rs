//! Results as source: an episode log becomes a scenario in the language it came from, and what an agent
//! learned a policy.
//!
//! Builds syntax trees and leaves the spelling to `syntax::format`; prints no concrete syntax itself.

mod policy;
mod safetensors;
mod scenario;
mod tree;

pub use policy::policy_text;
pub use safetensors::safetensors;
pub use scenario::{Provenance, action_text, scenario, unclaimed};
