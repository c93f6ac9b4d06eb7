//! Perception: which objects are detected in a frame and as what, and what colour the lights show.

mod detection;
mod free_space;
mod ghosts;
mod lights;
mod look;
mod ranges;

pub use detection::Detection;
pub use free_space::sees_empty;
pub use lights::LightReader;
pub use look::Perception;
pub use ranges::surely_seen_m;
