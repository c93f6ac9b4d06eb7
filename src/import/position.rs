//! Places as a file says them.

use roxmltree::Node;

use super::source::{Source, children, element};

#[derive(Debug, Clone)]
pub enum Position {
    Lane { road: String, lane: i32, s_m: f64, offset_m: f64, turned: bool },
    RelativeLane { entity: String, lanes: i32, ahead_m: f64, offset_m: f64 },
    World { x_m: f64, y_m: f64, heading_rad: f64 },
}

pub fn position(source: &mut Source, parent: Node) -> Option<Position> {
    let Some(place) = children(parent).next() else { return source.refuse(parent, "it is empty") };
    match place.tag_name().name() {
        "LanePosition" => {
            let (road, lane) = (source.text(place, "roadId")?, source.integer(place, "laneId")?);
            let (s_m, offset_m) = (source.number(place, "s")?, source.number_or(place, "offset", 0.0)?);
            Some(Position::Lane { road, lane, s_m, offset_m, turned: turned(source, place)? })
        }
        "RelativeLanePosition" => {
            let (entity, lanes) = (source.text(place, "entityRef")?, source.integer(place, "dLane")?);
            let along = if place.has_attribute("ds") { "ds" } else { "dsLane" };
            let ahead_m = source.number(place, along)?;
            if turned(source, place)? {
                return source.refuse(place, "nobody drives against its lane");
            }
            let offset_m = source.number_or(place, "offset", 0.0)?;
            Some(Position::RelativeLane { entity, lanes, ahead_m, offset_m })
        }
        "WorldPosition" => {
            let (x_m, y_m) = (source.number(place, "x")?, source.number(place, "y")?);
            Some(Position::World { x_m, y_m, heading_rad: source.number_or(place, "h", 0.0)? })
        }
        _ => source.refuse(place, "read are LanePosition, RelativeLanePosition and WorldPosition"),
    }
}

/// Whether an orientation points backwards along the road.
fn turned(source: &mut Source, place: Node) -> Option<bool> {
    let Some(orientation) = element(place, "Orientation") else { return Some(false) };
    let heading_rad = source.number_or(orientation, "h", 0.0)?;
    Some(orientation.attribute("type") != Some("absolute") && libm::cos(heading_rad) < 0.0)
}
