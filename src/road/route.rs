//! Routes: the way of the ego vehicle through the lane graph.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::collections::BinaryHeap;

use crate::geometry::Path;
use crate::geometry::Vec2;
use crate::geometry::wrap_angle;

use super::conflict::conflicts;
use super::conflict::spans_inside;
use super::map::LaneIndex;
use super::map::LanePlace;
use super::map::RoadError;
use super::map::RoadMap;

/// A way from a start to a goal along lane centres.
#[derive(Debug, Clone)]
pub struct Route {
    /// Lanes in order, each with the route station at which it begins (the first may be negative:
    /// the lane begins behind the start) and the station at which it ends.
    pub lanes: Vec<RouteLane>,
    /// Centre line from the start (station 0) to the goal and on, up to 60 m if the lanes go on.
    pub path: Path,
    /// Station of the goal, m.
    pub goal_m: f64,
    pub stop_lines: Vec<RouteStopLine>,
    /// Where the path crosses zebra crossings: from, to, m.
    pub crosswalks_m: Vec<(f64, f64)>,
    /// Where other lanes cross or join the path inside junctions, by rising station.
    pub conflicts: Vec<Conflict>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RouteLane {
    pub lane: LaneIndex,
    pub from_m: f64,
    pub to_m: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RouteStopLine {
    pub station_m: f64,
    pub signal: usize,
}

/// A crossing of the route with another lane inside a junction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// On the route, m.
    pub station_m: f64,
    /// The other lane, inside the junction.
    pub lane: LaneIndex,
    /// On the other lane, m.
    pub lane_station_m: f64,
    /// Heading of the other lane there minus that of the route, in `(-π, π]`: positive comes from
    /// the right.
    pub angle_rad: f64,
}

/// So far the path goes on past the goal, m.
const PAST_GOAL_M: f64 = 60.0;

/// Lanes are joined over this length, m: a millimetre between the end of one and the beginning of the
/// next would otherwise become a segment across the road.
const JOINT_M: f64 = 0.1;

impl Route {
    /// The shortest way along successors.
    ///
    /// # Errors
    /// If the goal cannot be reached without a lane change.
    pub fn find(map: &RoadMap, start: LanePlace, goal: LanePlace) -> Result<Route, RoadError> {
        let mut way = shortest_way(map, start, goal).ok_or_else(|| no_way(map, start, goal))?;
        let goal_index = way.len() - 1;
        let mut past_m = map.lane(goal.lane).centre.length_m() - goal.station_m;
        while past_m < PAST_GOAL_M {
            let Some(next) = straightest_successor(map, way[way.len() - 1]) else { break };
            past_m += map.lane(next).centre.length_m();
            way.push(next);
        }

        let (lanes, whole) = join(map, &way, start.station_m).ok_or_else(|| RoadError::Route {
            message: "the start lies at the end of the road; move it back".to_owned(),
        })?;
        let goal_m = lanes[goal_index].from_m + goal.station_m;
        let path = whole.part(0.0, goal_m + PAST_GOAL_M).ok_or_else(|| RoadError::Route {
            message: "the road goes on for less than 1 µm from the start; move it back".to_owned(),
        })?;
        let stop_lines = lanes.iter().flat_map(|lane| {
            let of_lane = map.lane(lane.lane).stop_lines.iter();
            of_lane.map(|line| RouteStopLine { station_m: lane.from_m + line.station_m, signal: line.signal })
        });
        let mut crosswalks_m: Vec<_> =
            map.crosswalks.iter().flat_map(|crosswalk| spans_inside(&path, &crosswalk.outline)).collect();
        crosswalks_m.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Ok(Route {
            stop_lines: stop_lines.filter(|line| (0.0..=path.length_m()).contains(&line.station_m)).collect(),
            crosswalks_m,
            conflicts: conflicts(map, &lanes, &path),
            lanes,
            path,
            goal_m,
        })
    }

    /// The lane of the route at a station, clamped to its ends.
    pub fn lane_at(&self, station_m: f64) -> RouteLane {
        let after = self.lanes.partition_point(|lane| lane.from_m <= station_m);
        self.lanes[after.max(1) - 1]
    }
}

/// Lanes from start to goal (Dijkstra); `None` if there is no way.
fn shortest_way(map: &RoadMap, start: LanePlace, goal: LanePlace) -> Option<Vec<LaneIndex>> {
    if start.lane == goal.lane && start.station_m <= goal.station_m {
        return Some(vec![start.lane]);
    }
    // A lane may be its own way back, so the start is no node: only what follows it is.
    let rest_m = map.lane(start.lane).centre.length_m() - start.station_m;
    let mut open = BinaryHeap::new();
    let mut came_from: BTreeMap<LaneIndex, LaneIndex> = BTreeMap::new();
    for next in &map.lane(start.lane).successors {
        open.push(Reverse((millimetres(rest_m), *next, start.lane)));
    }
    while let Some(Reverse((distance, lane, from))) = open.pop() {
        if came_from.contains_key(&lane) {
            continue;
        }
        came_from.insert(lane, from);
        if lane == goal.lane {
            break;
        }
        let distance = distance + millimetres(map.lane(lane).centre.length_m());
        for next in &map.lane(lane).successors {
            open.push(Reverse((distance, *next, lane)));
        }
    }
    let mut way = vec![goal.lane];
    let mut from = *came_from.get(&goal.lane)?;
    while from != start.lane {
        way.push(from);
        from = came_from[&from];
    }
    way.push(start.lane);
    way.reverse();
    Some(way)
}

/// Whole numbers, because a heap needs a total order.
fn millimetres(length_m: f64) -> u64 {
    (length_m.max(0.0) * 1e3) as u64
}

/// Why there is no way, and whether a lane change would make one.
fn no_way(map: &RoadMap, start: LanePlace, goal: LanePlace) -> RoadError {
    let mut reached = BTreeSet::from([start.lane]);
    let mut open = vec![start.lane];
    while let Some(index) = open.pop() {
        let lane = map.lane(index);
        let beside =
            [lane.left, lane.right].into_iter().flatten().filter(|neighbour| neighbour.same_direction);
        for next in beside.map(|neighbour| neighbour.lane).chain(lane.successors.iter().copied()) {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    let name = |place: LanePlace| {
        let key = &map.lane(place.lane).key;
        format!("lane {} of road `{}`", key.lane, key.road)
    };
    let (from, to) = (name(start), name(goal));
    let message = if reached.contains(&goal.lane) {
        format!("from {from}, {to} can be reached only with a lane change; start or end in another lane")
    } else {
        format!("there is no way from {from} to {to}")
    };
    RoadError::Route { message }
}

fn straightest_successor(map: &RoadMap, lane: LaneIndex) -> Option<LaneIndex> {
    let turn_rad = |index: &LaneIndex| {
        let centre = &map.lane(*index).centre;
        let end_rad = centre.pose_at(centre.length_m()).heading_rad;
        wrap_angle(end_rad - centre.pose_at(0.0).heading_rad).abs()
    };
    let successors = &map.lane(lane).successors;
    successors.iter().copied().min_by(|a, b| turn_rad(a).total_cmp(&turn_rad(b)))
}

/// One path through lanes, from a station of the first, and where on it each of them lies.
fn join(map: &RoadMap, way: &[LaneIndex], start_m: f64) -> Option<(Vec<RouteLane>, Path)> {
    let mut points: Vec<(Vec2, f64, f64)> = Vec::new();
    let mut lanes: Vec<RouteLane> = Vec::new();
    let mut length_m = 0.0;
    for index in way {
        let centre = &map.lane(*index).centre;
        let (from_m, begin_m) = if lanes.is_empty() {
            (-start_m, start_m.clamp(0.0, centre.length_m()))
        } else if points.is_empty() {
            // The start was the very end of the lane before.
            (length_m, 0.0)
        } else {
            (length_m, JOINT_M.min(centre.length_m() / 2.0))
        };
        let part = centre.part(begin_m, centre.length_m());
        for point in part.iter().flat_map(Path::points) {
            length_m += points.last().map_or(0.0, |last| (point.position - last.0).norm());
            points.push((point.position, point.heading_rad, point.curvature_per_m));
        }
        lanes.push(RouteLane { lane: *index, from_m, to_m: length_m });
    }
    Path::new(points).map(|path| (lanes, path))
}
