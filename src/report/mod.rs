//! Results for people: pictures of maps and of moments of an episode.

mod canvas;
mod picture;
mod road;
mod study;
mod trials;

pub use picture::{Snapshot, picture};
pub use road::draw;
pub use study::study;
pub use trials::trials;
