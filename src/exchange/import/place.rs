//! Where things are: places of a file on its map.

use core::f64::consts::PI;
use std::collections::BTreeMap;
use std::rc::Rc;

use avastra_base::geometry::{Path, Pose, Vec2, unit_vector, wrap_angle};
use avastra_road::{LaneIndex, LanePlace, RoadMap, Side};

use super::ground::Ground;
use super::position::{Beside, Heading, Position, PositionKind};
use super::source::{Mark, Source};
use super::story::Story;

/// An entity that looks along a lane within this angle drives along it, rad: a player's drivers keep their lanes.
const ALONG_RAD: f64 = 0.3;

/// An entity that stands within this angle to a lane stands along it, rad.
const STANDS_RAD: f64 = 0.02;

/// A way that is laid along lanes is followed this far, m.
const WAY_M_MAX: f64 = 12_000.0;

/// The goal lies this far before the end of the lanes, m.
const BEFORE_END_M: f64 = 1.0;

/// How far a way that is drawn along lanes goes on, with them after a trajectory or against them, m.
const ON_M_MAX: f64 = 2_000.0;
/// In such steps it is looked at, m.
const ON_STEP_M: f64 = 2.0;
/// So near to the lanes it is drawn, m.
const ON_NEAR_M: f64 = 0.02;
/// Points between two that are kept: it bounds the search.
const STRIDE_MAX: usize = 200;

/// A place in the plane belongs to a lane that is this near, m.
const REACH_M: f64 = 2.0;

/// Places that are relative to each other are followed this deep.
const DEPTH_MAX: usize = 32;

/// A place: a pose, and a lane if there is one.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    pub pose: Pose,
    /// With the offset to the left in the lane's own direction.
    pub lane: Option<LanePlace>,
    /// By how much its heading is turned from that of its lane, rad.
    pub turned_rad: f64,
}

/// The map with the entities on it, as far as they have a place.
pub struct Places<'a> {
    pub map: Rc<Ground>,
    story: &'a Story,
    known: BTreeMap<String, Placed>,
    depth: usize,
}

impl<'a> Places<'a> {
    pub fn new(map: Rc<Ground>, story: &'a Story) -> Places<'a> {
        Places { map, story, known: BTreeMap::new(), depth: 0 }
    }

    /// Where an entity begins.
    pub fn of(&mut self, source: &mut Source, mark: &Mark, name: &str) -> Option<Placed> {
        if let Some(placed) = self.known.get(name) {
            return Some(*placed);
        }
        let Some(entity) = self.story.entity(name) else {
            if source.is_torn(name) {
                return None;
            }
            return source.refuse(mark, format!("no entity is called `{name}`"));
        };
        source.refuse_if(self.depth >= DEPTH_MAX, mark, "places are relative to each other in a circle")?;
        self.depth += 1;
        let found = match (&entity.position, &entity.way) {
            (Some(position), _) => self.placed(source, position),
            (None, Some(way)) => {
                let drawn = way.shape.drawn(source, self, None);
                drawn.map(|drawn| self.in_plane(drawn.path.pose_at(way.from_m)))
            }
            (None, None) if source.is_torn(name) => None,
            (None, None) => source.refuse(&entity.mark, "the file does not say where it begins"),
        };
        self.depth -= 1;
        let found = found?;
        self.known.insert(name.to_owned(), found);
        Some(found)
    }

    /// Lets an entity be somewhere else from now on; where it was.
    pub fn stand(&mut self, name: &str, placed: Placed) -> Option<Placed> {
        self.known.insert(name.to_owned(), placed)
    }

    /// A position of the file.
    pub fn placed(&mut self, source: &mut Source, position: &Position) -> Option<Placed> {
        let Position { mark, kind, heading, .. } = position;
        let placed = match kind {
            PositionKind::Lane { road, lane, s_m, offset_m } => match self.map.place(road, *lane, *s_m) {
                Ok(place) => self.on_lane(LanePlace { offset_m: self.left_m(place, *offset_m), ..place }),
                Err(error) => {
                    let Some((strip, is_along)) = self.map.strip_pose(road, *lane, *s_m) else {
                        return source.refuse(mark, error.to_string());
                    };
                    self.in_plane(strip.offset(0.0, if is_along { *offset_m } else { -offset_m }))
                }
            },
            PositionKind::RelativeLane { entity, lanes, ahead_m, offset_m } => {
                let of = self.on_a_lane(source, mark, entity)?;
                let there = self.beside(source, mark, of, *lanes, *ahead_m)?;
                self.on_lane(LanePlace { offset_m: self.left_m(there, *offset_m), ..there })
            }
            PositionKind::Road { road, s_m, t_m } => {
                let reference = self.reference(source, mark, road, *s_m)?;
                self.in_plane(reference.offset(0.0, *t_m))
            }
            PositionKind::RelativeRoad { entity, ds_m, dt_m } => {
                let of = self.on_a_lane(source, mark, entity)?;
                let there = self.beside(source, mark, of, 0, *ds_m)?;
                let offset_m = of.offset_m + self.left_m(there, *dt_m);
                self.in_plane(self.on_lane(LanePlace { offset_m, ..there }).pose)
            }
            PositionKind::World { x_m, y_m } => {
                let (Heading::Absolute(rad) | Heading::Relative(rad)) = *heading;
                return Some(self.in_plane(Pose::new(*x_m, *y_m, rad)));
            }
            PositionKind::RelativeWorld { entity, dx_m, dy_m } => {
                let of = self.of(source, mark, entity)?.pose;
                self.in_plane(Pose { position: of.position + Vec2::new(*dx_m, *dy_m), ..of })
            }
            PositionKind::RelativeObject { entity, dx_m, dy_m } => {
                let of = self.of(source, mark, entity)?;
                self.in_plane(of.pose.offset(*dx_m, *dy_m))
            }
            PositionKind::OnRoute { route, along_m, beside } => {
                self.on_route(source, mark, route, *along_m, *beside)?
            }
            PositionKind::OnTrajectory { trajectory, s_m, t_m } => {
                let drawn = trajectory.drawn(source, self, None)?;
                self.in_plane(drawn.path.pose_at(*s_m).offset(0.0, *t_m))
            }
            PositionKind::Entity(name) => self.of(source, mark, name)?,
        };
        Some(self.turned(placed, *heading))
    }

    /// The middle of a lane or beside it, in its direction.
    pub fn on_lane(&self, place: LanePlace) -> Placed {
        let pose = self.map.lane(place.lane).centre.pose_at(place.station_m).offset(0.0, place.offset_m);
        Placed { pose, lane: Some(place), turned_rad: 0.0 }
    }

    /// A pose with the lane that it is in or near to.
    pub fn in_plane(&self, pose: Pose) -> Placed {
        let found = self.map.nearest(pose.position, pose.heading_rad, REACH_M);
        let lane = found.map(|place| {
            let centre = &self.map.lane(place.lane).centre;
            LanePlace { offset_m: centre.project(pose.position).offset_m, ..place }
        });
        let turned_rad = lane.map_or(0.0, |place| {
            wrap_angle(pose.heading_rad - self.map.lane(place.lane).centre.heading_at(place.station_m))
        });
        Placed { pose, lane, turned_rad }
    }

    /// A way to the left in a road's direction as one to the left in that of a lane.
    fn left_m(&self, place: LanePlace, left_m: f64) -> f64 {
        if self.map.lane(place.lane).is_along() { left_m } else { -left_m }
    }

    fn turned(&self, placed: Placed, heading: Heading) -> Placed {
        let lane_rad = placed.pose.heading_rad - placed.turned_rad;
        let heading_rad = match heading {
            Heading::Relative(rad) => placed.pose.heading_rad + rad,
            Heading::Absolute(rad) => rad,
        };
        let turned_rad = if placed.lane.is_some() { wrap_angle(heading_rad - lane_rad) } else { 0.0 };
        Placed { pose: Pose { heading_rad: wrap_angle(heading_rad), ..placed.pose }, turned_rad, ..placed }
    }

    /// The way back along the lanes from a place, at the same distance from their middles. Where lanes come together it takes the
    /// first one of the map.
    pub fn against(&self, from: LanePlace) -> Vec<Vec2> {
        let (mut lane, mut station_m, mut points) = (from.lane, from.station_m, Vec::new());
        while points.len() as f64 * ON_STEP_M < ON_M_MAX {
            points.push(self.map.lane(lane).centre.pose_at(station_m).offset(0.0, from.offset_m).position);
            station_m -= ON_STEP_M;
            while station_m < 0.0 {
                let Some(before) = self.map.lane(lane).predecessors.first() else { return thinned(&points) };
                lane = *before;
                station_m += self.map.lane(lane).centre.length_m();
            }
        }
        thinned(&points)
    }

    /// The way on along the lanes from a place, at the same distance from their middles.
    pub fn onwards(&self, from: LanePlace) -> Vec<Vec2> {
        let begin = LanePlace { offset_m: 0.0, ..from };
        let (goals, _) = straight_on(&self.map, begin);
        let ways: Vec<LanePlace> = core::iter::once(begin).chain(goals).collect();
        let Ok(way) = self.map.way(&ways) else { return Vec::new() };
        drawn(0.0, way.length_m().min(ON_M_MAX), |at_m| way.pose_at(at_m).offset(0.0, from.offset_m).position)
    }

    fn on_a_lane(&mut self, source: &mut Source, mark: &Mark, entity: &str) -> Option<LanePlace> {
        let placed = self.of(source, mark, entity)?;
        placed
            .lane
            .or_else(|| source.refuse(mark, format!("`{entity}`, of which it is asked, is in no lane")))
    }

    /// So far ahead along a lane (behind below 0), and so many lanes to the left of it.
    fn beside(
        &self,
        source: &mut Source,
        mark: &Mark,
        of: LanePlace,
        lanes: i32,
        ahead_m: f64,
    ) -> Option<LanePlace> {
        let Some(there) = self.along(of, ahead_m) else {
            return source.refuse(mark, format!("the lane ends before it has gone on for {ahead_m:.1} m"));
        };
        // Ids rise to the left of the road, whichever way its lanes lead.
        let is_along = self.map.lane(there.lane).is_along();
        let side = if (lanes > 0) == is_along { Side::Left } else { Side::Right };
        let (mut lane, mut side) = (there.lane, side);
        for _ in 0..lanes.abs() {
            let Some(next) = self.map.lane(lane).neighbour(side) else {
                return source.refuse(mark, "no such lane is beside that one");
            };
            if !next.same_direction {
                side = if side == Side::Left { Side::Right } else { Side::Left };
            }
            lane = next.lane;
        }
        let here = self.map.lane(there.lane).centre.position_at(there.station_m);
        let station_m = if lane == there.lane {
            there.station_m
        } else {
            self.map.lane(lane).centre.project(here).station_m
        };
        Some(LanePlace { lane, station_m, offset_m: 0.0 })
    }

    /// So far ahead along lanes that follow each other straightest; `None` beyond their end.
    fn along(&self, of: LanePlace, ahead_m: f64) -> Option<LanePlace> {
        let (mut lane, mut station_m) = (of.lane, of.station_m + ahead_m);
        for _ in 0..1000 {
            let length_m = self.map.lane(lane).centre.length_m();
            if station_m < 0.0 {
                lane = *self.map.lane(lane).predecessors.first()?;
                station_m += self.map.lane(lane).centre.length_m();
            } else if station_m > length_m {
                lane = straightest(&self.map, lane, &[])?;
                station_m -= length_m;
            } else {
                return Some(LanePlace { lane, station_m, offset_m: 0.0 });
            }
        }
        None
    }

    /// A road's reference line at a station, in the road's direction: the inner edge of its first lane to either side.
    fn reference(&self, source: &mut Source, mark: &Mark, road: &str, s_m: f64) -> Option<Pose> {
        let found = [-1, 1].into_iter().find_map(|id| Some((id, self.map.place(road, id, s_m).ok()?)));
        let Some((id, place)) = found else {
            let reason = format!("road `{road}` has no driving lane beside its reference line at {s_m} m");
            return source.refuse(mark, reason);
        };
        let lane = self.map.lane(place.lane);
        let centre = lane.centre.pose_at(place.station_m);
        let along = match lane.is_along() {
            true => centre,
            false => Pose { heading_rad: wrap_angle(centre.heading_rad + PI), ..centre },
        };
        let half_m = lane.width_at(place.station_m) / 2.0;
        Some(along.offset(0.0, if id < 0 { half_m } else { -half_m }))
    }

    /// The way through the places of a route, along lanes.
    pub fn route(&mut self, source: &mut Source, mark: &Mark, places: &[Position]) -> Option<Vec<LanePlace>> {
        let mut found = Vec::new();
        for position in places {
            let placed = self.placed(source, position)?;
            let Some(lane) = placed.lane else { return source.refuse(mark, "it leads beside the lanes") };
            found.push(LanePlace { offset_m: 0.0, ..lane });
        }
        Some(found)
    }

    /// The way along lanes from place to place.
    pub fn laid(&self, source: &mut Source, mark: &Mark, places: &[LanePlace]) -> Option<Rc<Path>> {
        match self.map.way(places) {
            Ok(way) => Some(way),
            Err(error) => source.refuse(mark, format!("no way leads there: {error}")),
        }
    }

    fn on_route(
        &mut self,
        source: &mut Source,
        mark: &Mark,
        places: &[Position],
        along_m: f64,
        beside: Beside,
    ) -> Option<Placed> {
        let places = self.route(source, mark, places)?;
        let mut left_m = along_m;
        for pair in places.windows(2) {
            let route = match self.map.route(pair[0], pair[1]) {
                Ok(route) => route,
                Err(error) => return source.refuse(mark, format!("no way leads along the route: {error}")),
            };
            if left_m > route.goal_m {
                left_m -= route.goal_m;
                continue;
            }
            let part = route.lane_at(left_m);
            let station_m = (left_m - part.from_m).max(0.0);
            let here = LanePlace { lane: part.lane, station_m, offset_m: 0.0 };
            return match beside {
                Beside::Lane(id, offset_m) => {
                    let place = self.lane_of_road(here, id);
                    let Some(place) = place else {
                        return source.refuse(mark, "the road has no such lane there");
                    };
                    // To the left of the route, not of the road.
                    Some(self.on_lane(LanePlace { offset_m, ..place }))
                }
                Beside::Road(t_m) => {
                    let key = &self.map.lane(here.lane).key;
                    let s_m = self.map.lane(here.lane).road_station_m(here.station_m);
                    let reference = self.reference(source, mark, &key.road.clone(), s_m)?;
                    // To the left of the road, and along the route.
                    let there = reference.offset(0.0, t_m);
                    let turn_rad = if self.map.lane(here.lane).is_along() { 0.0 } else { PI };
                    let heading_rad = wrap_angle(there.heading_rad + turn_rad);
                    Some(self.in_plane(Pose { heading_rad, ..there }))
                }
            };
        }
        source.refuse(mark, format!("the route ends before {along_m:.1} m"))
    }

    /// The lane of an id beside a place.
    fn lane_of_road(&self, here: LanePlace, id: i32) -> Option<LanePlace> {
        let lane = self.map.lane(here.lane);
        if lane.key.lane == id {
            return Some(here);
        }
        let there = self.map.place(&lane.key.road, id, lane.road_station_m(here.station_m)).ok();
        // Roads in junctions have the lanes of one direction only, with numbers of their own.
        there.or_else(|| lane.junction.map(|_| here))
    }
}

impl Placed {
    /// Whether an entity that drives from there drives along its lane.
    pub fn is_along(&self) -> bool {
        self.lane.is_some() && self.turned_rad.abs() < ALONG_RAD
    }

    /// Whether an entity stands there as its lane leads.
    pub fn stands_along(&self) -> bool {
        self.lane.is_some() && self.turned_rad.abs() < STANDS_RAD
    }

    /// Whether it looks against its lane.
    pub fn is_against(&self) -> bool {
        self.lane.is_some() && self.turned_rad.abs() > PI - ALONG_RAD
    }

    /// A short straight way on from here, m.
    pub fn ahead(&self, way_m: f64) -> [Vec2; 2] {
        let from = self.pose.position;
        [from, from + unit_vector(self.pose.heading_rad) * way_m]
    }
}

/// Points of a way from one station to another, as few as keep near to it.
pub fn drawn(from_m: f64, to_m: f64, point: impl Fn(f64) -> Vec2) -> Vec<Vec2> {
    let steps = ((to_m - from_m) / ON_STEP_M).ceil().max(1.0);
    let at = |nth: u32| point(from_m + (to_m - from_m) * f64::from(nth) / steps);
    thinned(&(0..=steps as u32).map(at).collect::<Vec<_>>())
}

/// As few of the points as keep every other one near to the line between two.
fn thinned(points: &[Vec2]) -> Vec<Vec2> {
    let Some(first) = points.first() else { return Vec::new() };
    let (mut kept, mut from) = (vec![*first], 0);
    while from + 1 < points.len() {
        let fits = |to: usize| {
            let along = points[to] - points[from];
            let off_m = |point: &Vec2| {
                let by = point - points[from];
                (along.x * by.y - along.y * by.x).abs() / along.norm().max(f64::MIN_POSITIVE)
            };
            points[from + 1..to].iter().all(|point| off_m(point) <= ON_NEAR_M)
        };
        let mut to = from + 1;
        while to + 1 < points.len() && to < from + STRIDE_MAX && fits(to + 1) {
            to += 1;
        }
        kept.push(points[to]);
        from = to;
    }
    kept
}

/// The lane that goes on from another with the least turn, without one of those that were passed.
fn straightest(map: &RoadMap, lane: LaneIndex, passed: &[LaneIndex]) -> Option<LaneIndex> {
    let bend_rad = |index: &LaneIndex| {
        let centre = &map.lane(*index).centre;
        wrap_angle(centre.heading_at(centre.length_m()) - centre.heading_at(0.0)).abs()
    };
    let fresh = map.lane(lane).successors.iter().copied().filter(|next| !passed.contains(next));
    fresh.min_by(|a, b| bend_rad(a).total_cmp(&bend_rad(b)))
}

/// The way along the lanes from a place, as far as they go on, without turning where they part. Returns places on the way
/// behind each junction, the last one at its end, and the length of the way, m.
pub fn straight_on(map: &RoadMap, start: LanePlace) -> (Vec<LanePlace>, f64) {
    let (mut lane, mut way_m) = (start.lane, map.lane(start.lane).centre.length_m() - start.station_m);
    let (mut passed, mut places) = (vec![lane], Vec::new());
    while way_m < WAY_M_MAX {
        let Some(next) = straightest(map, lane, &passed) else { break };
        let length_m = map.lane(next).centre.length_m();
        let leaves = map.lane(lane).junction.is_some() && map.lane(next).junction.is_none();
        if leaves && length_m > 2.0 * BEFORE_END_M {
            places.push(LanePlace { lane: next, station_m: BEFORE_END_M, offset_m: 0.0 });
        }
        way_m += length_m;
        passed.push(next);
        lane = next;
    }
    let length_m = map.lane(lane).centre.length_m();
    let station_m = (length_m - BEFORE_END_M).max(length_m / 2.0);
    places.push(LanePlace { lane, station_m, offset_m: 0.0 });
    (places, way_m - (length_m - station_m))
}
