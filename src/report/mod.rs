//! Results for people: pictures of maps and of moments of an episode.

mod canvas;
mod picture;
mod road;
mod trials;

pub use picture::Snapshot;
pub use picture::picture;
pub use road::draw;
pub use trials::trials;
