//! Perception: which objects are detected in a frame and as what, and what colour the lights show.

mod detection;
mod ghosts;
mod lights;
mod look;
mod ranges;

pub use detection::Detection;
pub use lights::LightReader;
pub use look::Perception;
pub use ranges::surely_seen_m;
