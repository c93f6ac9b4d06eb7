//! Results for people: pictures of moments of an episode.

mod picture;

pub use picture::PANEL_PX;
pub use picture::Snapshot;
pub use picture::VIEW_RADIUS_M;
pub use picture::picture;
