//! Places as a file says them.

use roxmltree::Node;

use super::catalogue;
use super::shape::{Shape, shape_of};
use super::source::{Mark, Source, children, element, elements};

#[derive(Debug, Clone)]
pub struct Position {
    pub mark: Mark,
    pub kind: PositionKind,
    pub heading: Heading,
    /// Whether the file says the heading, and not only the place.
    pub states_heading: bool,
}

#[derive(Debug, Clone)]
pub enum PositionKind {
    /// On a lane: the station along the road, and to the left of the lane's middle in the road's direction, m.
    Lane {
        road: String,
        lane: i32,
        s_m: f64,
        offset_m: f64,
    },
    /// On the lane of an entity or so many lanes to the left of it.
    RelativeLane {
        entity: String,
        lanes: i32,
        ahead_m: f64,
        offset_m: f64,
    },
    /// Beside a road's reference line.
    Road {
        road: String,
        s_m: f64,
        t_m: f64,
    },
    RelativeRoad {
        entity: String,
        ds_m: f64,
        dt_m: f64,
    },
    World {
        x_m: f64,
        y_m: f64,
    },
    RelativeWorld {
        entity: String,
        dx_m: f64,
        dy_m: f64,
    },
    /// In front of an entity and to its left.
    RelativeObject {
        entity: String,
        dx_m: f64,
        dy_m: f64,
    },
    OnRoute {
        route: Vec<Position>,
        along_m: f64,
        beside: Beside,
    },
    OnTrajectory {
        trajectory: Box<Shape>,
        s_m: f64,
        t_m: f64,
    },
    /// Where an entity is.
    Entity(String),
}

/// Where beside a route.
#[derive(Debug, Clone, Copy)]
pub enum Beside {
    /// To the left of the road's reference line, m.
    Road(f64),
    /// In a lane, to the left of its middle, m.
    Lane(i32, f64),
}

/// Where an entity looks, rad.
#[derive(Debug, Clone, Copy)]
pub enum Heading {
    /// To the left of the direction that its place has.
    Relative(f64),
    /// In the plane.
    Absolute(f64),
}

/// The position within an element.
pub fn position(source: &mut Source, parent: Node) -> Option<Position> {
    source.nested(parent, |source| place_in(source, parent))
}

fn place_in(source: &mut Source, parent: Node) -> Option<Position> {
    let Some(place) = children(parent).next() else { return source.refuse(parent, "it is empty") };
    let mark = source.mark(place);
    let mut heading = heading(source, place)?;
    let kind = match place.tag_name().name() {
        "LanePosition" => PositionKind::Lane {
            road: source.text(place, "roadId")?,
            lane: source.integer(place, "laneId")?,
            s_m: source.number(place, "s")?,
            offset_m: source.left_or_0(place, "offset")?,
        },
        "RelativeLanePosition" => {
            let along = if place.has_attribute("ds") { "ds" } else { "dsLane" };
            PositionKind::RelativeLane {
                entity: source.text(place, "entityRef")?,
                lanes: source.integer(place, "dLane")?,
                ahead_m: source.number(place, along)?,
                offset_m: source.left_or_0(place, "offset")?,
            }
        }
        "RoadPosition" => PositionKind::Road {
            road: source.text(place, "roadId")?,
            s_m: source.number(place, "s")?,
            t_m: source.left(place, "t")?,
        },
        "RelativeRoadPosition" => PositionKind::RelativeRoad {
            entity: source.text(place, "entityRef")?,
            ds_m: source.number(place, "ds")?,
            dt_m: source.left(place, "dt")?,
        },
        "WorldPosition" => {
            heading = Heading::Absolute(source.left_or_0(place, "h")?);
            PositionKind::World { x_m: source.number(place, "x")?, y_m: source.left(place, "y")? }
        }
        "RelativeWorldPosition" => PositionKind::RelativeWorld {
            entity: source.text(place, "entityRef")?,
            dx_m: source.number(place, "dx")?,
            dy_m: source.left(place, "dy")?,
        },
        "RelativeObjectPosition" => PositionKind::RelativeObject {
            entity: source.text(place, "entityRef")?,
            dx_m: source.number(place, "dx")?,
            dy_m: source.left(place, "dy")?,
        },
        "RoutePosition" => on_route(source, place)?,
        "TrajectoryPosition" => {
            let reference = source.required(place, "TrajectoryRef")?;
            PositionKind::OnTrajectory {
                trajectory: Box::new(shape_of(source, reference)?),
                s_m: source.number(place, "s")?,
                t_m: source.left_or_0(place, "t")?,
            }
        }
        _ => return source.refuse(place, "such a position is not read"),
    };
    let orientation = element(place, "Orientation").unwrap_or(place);
    Some(Position { mark, kind, heading, states_heading: orientation.has_attribute("h") })
}

/// The places that a route leads through.
pub fn route(source: &mut Source, parent: Node) -> Option<Vec<Position>> {
    if let Some(route) = element(parent, "Route") {
        return source.scoped(route, |source| waypoints(source, route));
    }
    let reference = source.required(parent, "CatalogReference")?;
    catalogue::entry(source, reference, &[catalogue::ROUTE], |source, route| {
        source.scoped(route, |source| waypoints(source, route))
    })
}

fn waypoints(source: &mut Source, route: Node) -> Option<Vec<Position>> {
    const STRATEGIES: [&str; 4] = ["fastest", "leastIntersections", "random", "shortest"];
    if source.switch(route, "closed", false)? {
        return source.refuse(route, "a route leads one way: `closed` leads back");
    }
    let mut places = Vec::new();
    for waypoint in elements(route, "Waypoint") {
        source.word(waypoint, "routeStrategy", &STRATEGIES)?;
        let place = source.required(waypoint, "Position")?;
        places.push(position(source, place)?);
    }
    source.refuse_if(places.is_empty(), route, "it has no waypoint with a position")?;
    Some(places)
}

fn on_route(source: &mut Source, place: Node) -> Option<PositionKind> {
    let reference = source.required(place, "RouteRef")?;
    let route = route(source, reference)?;
    let inner = source.required(place, "InRoutePosition")?;
    let Some(inner) = children(inner).next() else { return source.refuse(inner, "it is empty") };
    match inner.tag_name().name() {
        "FromCurrentEntity" => Some(PositionKind::Entity(source.text(inner, "entityRef")?)),
        "FromRoadCoordinates" | "PositionInRoadCoordinates" => {
            let along_m = source.number(inner, "pathS")?;
            let beside = Beside::Road(source.left_or_0(inner, "t")?);
            Some(PositionKind::OnRoute { route, along_m, beside })
        }
        "FromLaneCoordinates" | "PositionInLaneCoordinates" => {
            let along_m = source.number(inner, "pathS")?;
            let lane = source.integer(inner, "laneId")?;
            let beside = Beside::Lane(lane, source.left_or_0(inner, "laneOffset")?);
            Some(PositionKind::OnRoute { route, along_m, beside })
        }
        _ => source.refuse(inner, "such a place on a route is not read"),
    }
}

impl Position {
    /// The entity beside which it is.
    pub fn relative_to(&self) -> Option<&str> {
        match &self.kind {
            PositionKind::RelativeLane { entity, .. }
            | PositionKind::RelativeRoad { entity, .. }
            | PositionKind::RelativeWorld { entity, .. }
            | PositionKind::RelativeObject { entity, .. }
            | PositionKind::Entity(entity) => Some(entity),
            PositionKind::Lane { .. }
            | PositionKind::Road { .. }
            | PositionKind::World { .. }
            | PositionKind::OnRoute { .. }
            | PositionKind::OnTrajectory { .. } => None,
        }
    }

    /// Whether it is the place and the heading that the entity has already.
    pub fn is_own_place(&self, name: &str) -> bool {
        let PositionKind::RelativeObject { entity, dx_m, dy_m } = &self.kind else { return false };
        entity == name
            && *dx_m == 0.0
            && *dy_m == 0.0
            && matches!(self.heading, Heading::Relative(rad) if rad == 0.0)
    }
}

fn heading(source: &mut Source, place: Node) -> Option<Heading> {
    let Some(orientation) = element(place, "Orientation") else { return Some(Heading::Relative(0.0)) };
    let heading_rad = source.left_or_0(orientation, "h")?;
    for tilt in ["p", "r"] {
        if source.number_or(orientation, tilt, 0.0)? != 0.0 {
            source.note("pitch and roll are not taken over");
        }
    }
    let is_relative = match source.word(orientation, "type", &["relative", "absolute"])? {
        // The default without the word has changed with 1.3.
        "" => source.minor >= 3,
        word => word == "relative",
    };
    Some(if is_relative { Heading::Relative(heading_rad) } else { Heading::Absolute(heading_rad) })
}
