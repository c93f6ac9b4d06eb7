//! Searches: agents that look for crashes in the deterministic world instead of learning values.
//!
//! They see what every agent sees. What they have over a learner is that they may ask for a start that
//! they know, draw as they drew before, and so come back to where they have been.

mod av_fuzzer;
mod go_explore;
mod played;
mod population;
mod scripts;
mod situation;
mod worth;

pub use av_fuzzer::{AvFuzzer, AvFuzzerSettings};
pub use go_explore::{GoExplore, GoExploreSettings};
