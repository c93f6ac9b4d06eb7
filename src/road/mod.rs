//! Roads: an OpenDRIVE map as a graph of driving lanes, and routes through it.
//!
//! No vehicles here, and no time: signals have a place, not a colour.

mod abreast;
mod centre_line;
mod conflict;
mod graph;
mod index;
mod join;
mod lane_change;
mod map;
mod opendrive;
mod route;
mod search;
mod signals;
#[cfg(test)]
mod tests;

pub use abreast::Connection;
pub use abreast::Opposing;
pub use lane_change::STRIP_M_MAX;
pub use map::Crosswalk;
pub use map::Junction;
pub use map::Lane;
pub use map::LaneIndex;
pub use map::LaneKey;
pub use map::LanePlace;
pub use map::Neighbour;
pub use map::RoadError;
pub use map::RoadMap;
pub use map::Side;
pub use map::Sign;
pub use map::SignKind;
pub use map::Signal;
pub use map::StopLine;
pub use map::Turn;
pub use route::Conflict;
pub use route::Route;
pub use route::RouteLane;
pub use route::RouteLaneChange;
pub use route::RouteStopLine;
