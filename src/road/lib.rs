//! Roads: an OpenDRIVE map as a graph of driving lanes, and routes through it.
//!
//! No vehicles here, and no time: signals have a place, not a colour.
//!
//! ```
//! use avastra_road::RoadMap;
//!
//! let text = std::fs::read_to_string("../../scenarios/roads/corner.xodr")?;
//! let map = RoadMap::from_opendrive("corner", &text)?;
//! let place = map.place("1", -1, 105.88)?;
//! assert!(map.lane(place.lane).width_at(place.station_m) > 3.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod abreast;
mod centre_line;
mod crossing;
mod footway;
mod graph;
mod heights;
mod index;
mod join;
mod lane_change;
mod map;
mod opendrive;
mod phases;
mod proposal;
mod route;
mod search;
mod signals;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
mod tests;

pub use abreast::{Connection, Opposing};
pub use footway::{FootWay, Kerb};
pub use graph::LIMIT_MPS_DEFAULT;
pub use heights::{Heights, is_apart};
pub use lane_change::STRIP_M_MAX;
pub use map::{
    Crosswalk, Junction, Lane, LaneIndex, LaneKey, LanePlace, LeftOut, Neighbour, Obstacle, Precedence,
    RoadError, RoadMap, SIGNS_BEFORE_M, Side, Sign, SignKind, SignLine, Signal, Solid, StopLine, Strip,
    StripKind, Turn,
};
pub use opendrive::{Lines, well_formed, xml_text};
pub use proposal::{Proposal, propose};
pub use route::{Conflict, LEVEL_SLOPE_MAX, Route, RouteLane, RouteLaneChange};
