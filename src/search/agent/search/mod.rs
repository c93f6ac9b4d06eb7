//! Searches: agents that look for crashes in the deterministic world instead of learning values.
//!
//! They see what every agent sees. Unlike a learner, they ask for a start that they know and repeat their
//! draws, and so come back to a moment where they have been.

mod av_fuzzer;
mod bandit;
mod constant;
mod genes;
mod map_elites;
mod population;
mod scripts;
mod situation;
mod worth;

pub use av_fuzzer::AvFuzzerSettings;
pub use bandit::BanditSettings;
pub use constant::ConstantSettings;
pub use map_elites::MapElitesSettings;
