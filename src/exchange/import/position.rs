//! Places as a file says them.

use roxmltree::Node;

use super::source::{Source, children, element};

#[derive(Debug, Clone)]
pub enum Position {
    Lane { road: String, lane: i32, s_m: f64, offset_m: f64, heading: Heading },
    RelativeLane { entity: String, lanes: i32, ahead_m: f64, offset_m: f64, heading: Heading },
    World { x_m: f64, y_m: f64, heading_rad: f64 },
}

/// Where an entity looks, rad.
#[derive(Debug, Clone, Copy)]
pub enum Heading {
    /// To the left of the direction of its road.
    Relative(f64),
    /// In the plane.
    Absolute(f64),
}

pub fn position(source: &mut Source, parent: Node) -> Option<Position> {
    let Some(place) = children(parent).next() else { return source.refuse(parent, "it is empty") };
    match place.tag_name().name() {
        "LanePosition" => {
            let (road, lane) = (source.text(place, "roadId")?, source.integer(place, "laneId")?);
            let (s_m, offset_m) = (source.number(place, "s")?, source.number_or(place, "offset", 0.0)?);
            Some(Position::Lane { road, lane, s_m, offset_m, heading: heading(source, place)? })
        }
        "RelativeLanePosition" => {
            let (entity, lanes) = (source.text(place, "entityRef")?, source.integer(place, "dLane")?);
            let along = if place.has_attribute("ds") { "ds" } else { "dsLane" };
            let ahead_m = source.number(place, along)?;
            let offset_m = source.number_or(place, "offset", 0.0)?;
            let heading = heading(source, place)?;
            Some(Position::RelativeLane { entity, lanes, ahead_m, offset_m, heading })
        }
        "WorldPosition" => {
            let (x_m, y_m) = (source.number(place, "x")?, source.number(place, "y")?);
            Some(Position::World { x_m, y_m, heading_rad: source.number_or(place, "h", 0.0)? })
        }
        _ => source.refuse(place, "read are LanePosition, RelativeLanePosition and WorldPosition"),
    }
}

fn heading(source: &mut Source, place: Node) -> Option<Heading> {
    let Some(orientation) = element(place, "Orientation") else { return Some(Heading::Relative(0.0)) };
    let heading_rad = source.number_or(orientation, "h", 0.0)?;
    let is_relative = match source.word(orientation, "type", &["relative", "absolute"])? {
        // What it is without the word has changed with 1.3.
        "" => source.minor >= 3,
        word => word == "relative",
    };
    Some(if is_relative { Heading::Relative(heading_rad) } else { Heading::Absolute(heading_rad) })
}
