//! Where things are: places of the file on the map, and beside the way of the ego vehicle.

use core::f64::consts::PI;

use avastra_base::geometry::{Vec2, wrap_angle};
use avastra_road::{LaneIndex, LanePlace, RoadMap, Route, Side};

use super::position::{Heading, Position};
use super::source::{Mark, Source};
use super::story::Story;

/// The ego vehicle's way is followed this far, m.
const WAY_M_MAX: f64 = 12_000.0;

/// A way that is shorter shows nothing, m.
const WAY_M_MIN: f64 = 20.0;

/// The goal lies this far before the end of the lanes, m.
const BEFORE_END_M: f64 = 1.0;

/// A place in the plane belongs to a lane that is this near, m.
const REACH_M: f64 = 1.0;

/// A vehicle stands no more across its lane, rad. It begins along it, which is noted beyond the smaller angle.
const ACROSS_RAD: f64 = 1.0;
const ASKEW_RAD: f64 = 0.1;

/// Lanes to a side that are counted, and lanes behind that are followed back.
const SIDE_MAX: i32 = 6;
const BACK_MAX: usize = 20;

/// The map and the way of the ego vehicle on it.
pub struct Ground {
    pub map: RoadMap,
    pub route: Route,
    pub start: LanePlace,
    pub goal: LanePlace,
}

/// A place beside the way.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    /// Along the way; negative behind the start, m.
    pub station_m: f64,
    /// How many lanes to the left of the way's.
    pub lanes_left: i32,
    /// Whether its lane has the direction of the way.
    pub is_along: bool,
    /// To the left of the middle of its lane, m.
    pub offset_m: f64,
}

impl Ground {
    pub fn of(source: &mut Source, story: &Story, map: RoadMap) -> Option<Ground> {
        let Some((mark, position)) = &story.ego.position else {
            if source.is_torn(&story.ego.name) {
                return None;
            }
            return source.refuse(&story.ego.mark, "the file does not say where the ego vehicle begins");
        };
        let start = lane_place(source, &map, mark, position)?;
        faces_along(source, &map, mark, position, start)?;
        let goal = match &story.ego.goal {
            Some((mark, position)) => lane_place(source, &map, mark, position)?,
            None => {
                let (goal, way_m) = straight_on(&map, start);
                source.refuse_if(way_m < WAY_M_MIN, mark, format!("the road ends {way_m:.0} m after it"))?;
                goal
            }
        };
        if start.offset_m.abs() > 1e-6 {
            source.note("the ego vehicle begins in the middle of its lane");
        }
        match Route::find(&map, start, goal) {
            Ok(route) => Some(Ground { map, route, start, goal }),
            Err(error) => source.refuse(mark, format!("the way of the ego vehicle: {error}")),
        }
    }

    /// Where a vehicle is, if its lane runs beside the way.
    pub fn vehicle(&self, source: &mut Source, mark: &Mark, position: &Position) -> Option<Beside> {
        let place = lane_place(source, &self.map, mark, position)?;
        faces_along(source, &self.map, mark, position, place)?;
        self.beside(source, mark, position)
    }

    /// A place on a lane that runs beside the way, whatever looks where.
    pub fn beside(&self, source: &mut Source, mark: &Mark, position: &Position) -> Option<Beside> {
        let place = lane_place(source, &self.map, mark, position)?;
        let point = self.map.lane(place.lane).centre.pose_at(place.station_m).position;
        let station_m = self.station_of(point);
        let reason = "it lies beyond the end of the ego vehicle's way";
        source.refuse_if(station_m >= self.route.path.length_m(), mark, reason)?;
        let here = self.route.lane_at(station_m.max(0.0)).lane;
        let is_it =
            |lane: LaneIndex| lane == place.lane || station_m < 0.0 && self.leads_to(place.lane, lane);
        let offset_m = place.offset_m;
        if is_it(here) {
            return Some(Beside { station_m, lanes_left: 0, is_along: true, offset_m });
        }
        for (step, side) in [(1, Side::Left), (-1, Side::Right)] {
            let mut lane = here;
            for lanes in 1..=SIDE_MAX {
                let Some(next) = self.map.lane(lane).neighbour(side) else { break };
                if is_it(next.lane) {
                    let lanes_left = lanes * step;
                    return Some(Beside { station_m, lanes_left, is_along: next.same_direction, offset_m });
                }
                if !next.same_direction {
                    break;
                }
                lane = next.lane;
            }
        }
        source.refuse(
            mark,
            "its lane is not beside the ego vehicle's way: neither along it, nor the nearest oncoming one",
        )
    }

    /// Whether something at a station of the way that looks so begins along the way.
    pub fn faces_on(&self, source: &mut Source, mark: &Mark, station_m: f64, heading: Heading) -> Option<()> {
        let way_rad = self.route.path.heading_at(station_m.max(0.0));
        let across_rad = match heading {
            Heading::Relative(rad) => rad,
            Heading::Absolute(rad) => rad - way_rad,
        };
        is_along(source, mark, wrap_angle(across_rad).abs())
    }

    /// A point of the plane, for those who do not keep to lanes: its station along the way and its offset to the left, m.
    pub fn on_foot(&self, source: &mut Source, mark: &Mark, position: &Position) -> Option<(f64, f64)> {
        let point = match position {
            Position::World { x_m, y_m, .. } => Vec2::new(*x_m, *y_m),
            _ => {
                let place = lane_place(source, &self.map, mark, position)?;
                let pose = self.map.lane(place.lane).centre.pose_at(place.station_m);
                let forward = pose.forward();
                pose.position + Vec2::new(-forward.y, forward.x) * place.offset_m
            }
        };
        Some((self.station_of(point), self.route.path.project(point).offset_m))
    }

    fn station_of(&self, point: Vec2) -> f64 {
        let projected = self.route.path.project(point);
        let begin = self.route.path.pose_at(0.0);
        if projected.station_m > 0.0 { projected.station_m } else { begin.to_local(point).x.min(0.0) }
    }

    /// Whether a lane leads to another, straight or not, over at most some lanes.
    fn leads_to(&self, from: LaneIndex, to: LaneIndex) -> bool {
        let mut lane = to;
        for _ in 0..BACK_MAX {
            let before = &self.map.lane(lane).predecessors;
            if before.contains(&from) {
                return true;
            }
            let Some(next) = before.first() else { return false };
            lane = *next;
        }
        false
    }
}

/// The lane that a position names, and the place in it.
fn lane_place(source: &mut Source, map: &RoadMap, mark: &Mark, position: &Position) -> Option<LanePlace> {
    match position {
        Position::Lane { road, lane, s_m, offset_m, .. } => {
            let place = match map.place(road, *lane, *s_m) {
                Ok(place) => place,
                Err(error) => return source.refuse(mark, error.to_string()),
            };
            let lane = map.lane(place.lane);
            // The file's offsets are to the left of the road's reference line.
            Some(LanePlace { offset_m: if lane.is_along() { *offset_m } else { -offset_m }, ..place })
        }
        Position::World { x_m, y_m, heading_rad } => {
            let found = map.nearest(Vec2::new(*x_m, *y_m), *heading_rad, REACH_M);
            found.or_else(|| source.refuse(mark, "no driving lane is there"))
        }
        Position::RelativeLane { .. } => {
            source.refuse(mark, "a place relative to an entity is read of vehicles alone, at the beginning")
        }
    }
}

/// Whether a vehicle at a place looks along its lane.
fn faces_along(
    source: &mut Source,
    map: &RoadMap,
    mark: &Mark,
    position: &Position,
    place: LanePlace,
) -> Option<()> {
    let lane = map.lane(place.lane);
    let lane_rad = lane.centre.heading_at(place.station_m);
    let across_rad = match position {
        Position::World { heading_rad: rad, .. } | Position::Lane { heading: Heading::Absolute(rad), .. } => {
            wrap_angle(rad - lane_rad).abs()
        }
        Position::Lane { heading: Heading::Relative(rad), .. } => {
            let rad = wrap_angle(*rad).abs();
            // Players differ in whether this counts from the road's direction or from that of a lane against it.
            if lane.is_along() { rad } else { rad.min(PI - rad) }
        }
        Position::RelativeLane { .. } => 0.0,
    };
    is_along(source, mark, across_rad)
}

/// Refuses what stands across a lane or against it.
fn is_along(source: &mut Source, mark: &Mark, across_rad: f64) -> Option<()> {
    source.refuse_if(across_rad > PI - ACROSS_RAD, mark, "it faces against its lane")?;
    source.refuse_if(across_rad > ACROSS_RAD, mark, "it does not point along the lane that is there")?;
    if across_rad > ASKEW_RAD {
        source.note("vehicles begin along their lanes");
    }
    Some(())
}

/// As far as the lanes go on from a place, without turning where they part: the place, and how far that is, m.
fn straight_on(map: &RoadMap, start: LanePlace) -> (LanePlace, f64) {
    let (mut lane, mut way_m) = (start.lane, map.lane(start.lane).centre.length_m() - start.station_m);
    let mut passed = vec![lane];
    while way_m < WAY_M_MAX {
        let bend_rad = |index: &LaneIndex| {
            let centre = &map.lane(*index).centre;
            wrap_angle(centre.heading_at(centre.length_m()) - centre.heading_at(0.0)).abs()
        };
        let fresh = map.lane(lane).successors.iter().copied().filter(|next| !passed.contains(next));
        let Some(next) = fresh.min_by(|a, b| bend_rad(a).total_cmp(&bend_rad(b))) else { break };
        way_m += map.lane(next).centre.length_m();
        passed.push(next);
        lane = next;
    }
    let length_m = map.lane(lane).centre.length_m();
    let station_m = (length_m - BEFORE_END_M).max(length_m / 2.0);
    (LanePlace { lane, station_m, offset_m: 0.0 }, way_m - (length_m - station_m))
}
