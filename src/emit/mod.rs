//! Results as source: an episode log becomes a scenario in the language it came from.
//!
//! Builds syntax trees and leaves the spelling to `syntax::format`; prints no concrete syntax itself.

mod scenario;
mod tree;

pub use scenario::Provenance;
pub use scenario::action_text;
pub use scenario::scenario;
