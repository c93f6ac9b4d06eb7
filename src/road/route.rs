//! Routes: the way of the ego vehicle through the lane graph.

use std::collections::BTreeSet;

use avastra_base::geometry::{Path, smooth_step, wrap_angle};

use super::crossing::{crossings, merge, spans_inside};
use super::heights::is_apart;
use super::join::Joined;
use super::lane_change::LENGTH_M_MIN;
use super::map::{LaneIndex, LanePlace, Obstacle, RoadError, RoadMap, SignLine, StopLine};
use super::search::{Move, cheapest_way};

/// A way from a start to a goal along lane centres and from lane to lane.
#[derive(Debug, Clone)]
pub struct Route {
    /// Lanes in order.
    pub lanes: Vec<RouteLane>,
    /// Lane changes in order; they do not overlap.
    pub changes: Vec<RouteLaneChange>,
    /// Centre line from the start (station 0) to the goal and on, up to 60 m if the lanes go on.
    pub path: Path,
    /// Station of the goal, m.
    pub goal_m: f64,
    /// The stop lines, with their stations on the route.
    pub stop_lines: Vec<StopLine>,
    /// Where a stop or yield sign holds for the route and no light does, by rising station on the route.
    pub sign_lines: Vec<SignLine>,
    /// Where the path crosses zebra crossings: from, to, m.
    pub crosswalks_m: Vec<(f64, f64)>,
    /// Where other lanes cross or join the path inside junctions, by rising station.
    pub conflicts: Vec<Conflict>,
}

/// A lane of a route: station `m` of the route is beside station `m - from_m` of the lane (within a
/// decimetre during lane changes).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RouteLane {
    pub lane: LaneIndex,
    /// Station of the route at which the lane begins, m. Before `enter_m` if the route begins in the
    /// lane, or comes into it by a lane change.
    pub from_m: f64,
    /// Station at which the route comes into the lane, m; with a lane change, the middle of the change.
    pub enter_m: f64,
    /// Station at which the route leaves it, m.
    pub to_m: f64,
}

/// A lane change of a route. The path performs it as early as it is comfortable.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RouteLaneChange {
    /// Here the path leaves the centre of the source lane, m.
    pub begin_m: f64,
    /// Here it is on the centre of the target lane, m.
    pub end_m: f64,
    /// The change must be over by this station, m: there its stretch ends, the next change must begin, or the
    /// goal lies.
    pub latest_m: f64,
    /// Distance between the two centres at the end, m, positive to the left.
    pub lateral_m: f64,
    /// Station and distance between the two centres there (m, positive to the left), from `begin_m` to the end
    /// of the stretch on which the change is permitted.
    #[serde(skip)]
    pub(super) shifts_m: Vec<(f64, f64)>,
}

/// A crossing of the route with another lane inside a junction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// Station on the route, m.
    pub station_m: f64,
    /// The other lane, inside the junction.
    pub lane: LaneIndex,
    /// Station on the other lane, m.
    pub lane_station_m: f64,
    /// Heading of the other lane there minus that of the route, in `(-π, π]`: positive comes from
    /// the right.
    pub angle_rad: f64,
}

/// Length of the path beyond the goal, if the lanes go on, m.
const PAST_GOAL_M: f64 = 60.0;

/// Steps that find where a lane change began: to less than a micrometre.
const HALVINGS: usize = 32;

/// A stop line counts as on the route up to this distance outside the part of its lane that the route uses, m.
const PART_M: f64 = 0.2;

/// A road with gentler slopes counts as level, as a part of the way. Ours: 2 % change a braking way at 6 m/s² by 3 %.
pub const LEVEL_SLOPE_MAX: f64 = 0.02;

/// A slope is the change of height between two stations of a lane that are at most this far apart, m.
const SLOPE_M: f64 = 10.0;

impl Route {
    /// The steepest slope of the route, up or down, as a part of the way.
    pub fn steepest(&self, map: &RoadMap) -> f64 {
        let slopes = self.lanes.iter().flat_map(|part| {
            let lane = map.lane(part.lane);
            let (from_m, to_m) =
                (part.enter_m.max(0.0) - part.from_m, part.to_m.min(self.goal_m) - part.from_m);
            let steps = ((to_m - from_m) / SLOPE_M).ceil().max(0.0);
            let step_m = (to_m - from_m) / steps;
            (0..steps as u32).map(move |nth| {
                let at_m = from_m + step_m * f64::from(nth);
                // On less than a metre a small step of height, as where two records meet, counts as no slope.
                (lane.height_at(at_m + step_m) - lane.height_at(at_m)).abs() / step_m.max(1.0)
            })
        });
        slopes.fold(0.0, f64::max)
    }

    /// The solid things of the map that stand in its lanes between the start and the goal.
    pub fn obstacles<'a>(&'a self, map: &'a RoadMap) -> impl Iterator<Item = &'a Obstacle> {
        map.obstacles.iter().filter(|obstacle| {
            self.lanes.iter().any(|part| {
                let at_m = part.from_m + obstacle.place.station_m;
                part.lane == obstacle.place.lane
                    && at_m >= part.enter_m.max(0.0)
                    && at_m <= part.to_m.min(self.goal_m)
            })
        })
    }

    /// The cheapest way along successors and, with lane changes, along neighbours.
    ///
    /// A lane change costs as much as a detour of 100 m and is made only outside junctions, where markings
    /// permit it on a stretch that is long enough: at least half of the comfortable length.
    ///
    /// # Errors
    /// If the goal cannot be reached.
    pub fn find(map: &RoadMap, start: LanePlace, goal: LanePlace) -> Result<Route, RoadError> {
        let way = cheapest_way(map, start, goal).ok_or_else(|| no_way(map, start, goal))?;
        let mut joined = Joined::new(map, start);
        for step in &way {
            joined.add(step);
        }
        let goal_index = joined.lanes.len() - 1;
        let mut past_m = map.lane(goal.lane).centre.length_m() - goal.station_m;
        let mut last = goal.lane;
        while past_m < PAST_GOAL_M {
            let Some(next) = straightest_successor(map, last) else { break };
            past_m += map.lane(next).centre.length_m();
            joined.add(&Move::Follow(next));
            last = next;
        }

        let whole = joined.path().ok_or_else(|| RoadError::Route {
            message: "the start lies at the end of the road; move it back".to_owned(),
        })?;
        let (lanes, mut changes) = (joined.lanes, joined.changes);
        let goal_m = lanes[goal_index].from_m + goal.station_m;
        let path = whole.part(0.0, goal_m + PAST_GOAL_M).ok_or_else(|| RoadError::Route {
            message: "the road goes on for less than 1 µm from the start; move it back".to_owned(),
        })?;
        let mut latest_m = goal_m;
        for change in changes.iter_mut().rev() {
            change.latest_m = change.latest_m.min(latest_m);
            latest_m = change.latest_m - (change.end_m - change.begin_m);
        }
        // The route uses only a part of a lane that it enters or leaves midway, and it has two ends.
        let station_on = |lane: &RouteLane, lane_station_m: f64| {
            let station_m = lane.from_m + lane_station_m;
            let used = lane.enter_m - PART_M..=lane.to_m + PART_M;
            let is_on = used.contains(&station_m) && (0.0..=path.length_m()).contains(&station_m);
            is_on.then_some(station_m)
        };
        let (mut stop_lines, mut sign_lines) = (Vec::new(), Vec::new());
        for part in &lanes {
            let lane = map.lane(part.lane);
            let stop =
                |line: &StopLine| Some(StopLine { station_m: station_on(part, line.station_m)?, ..*line });
            let sign =
                |line: &SignLine| Some(SignLine { station_m: station_on(part, line.station_m)?, ..*line });
            stop_lines.extend(lane.stop_lines.iter().filter_map(stop));
            sign_lines.extend(lane.sign_lines.iter().filter_map(sign));
        }
        let conflicts = conflicts(map, &lanes, &path);
        let crosswalks_m = Vec::new();
        let mut route =
            Route { lanes, changes, path, goal_m, stop_lines, sign_lines, crosswalks_m, conflicts };
        for crosswalk in &map.crosswalks {
            let spans_m = spans_inside(&route.path, &crosswalk.outline);
            let meets = |span_m: &(f64, f64)| !is_apart(crosswalk.height_m, route.height_at(map, span_m.0));
            let spans_m: Vec<_> = spans_m.into_iter().filter(meets).collect();
            route.crosswalks_m.extend(spans_m);
        }
        route.crosswalks_m.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Ok(route)
    }

    /// Height of the road at a station, m.
    pub fn height_at(&self, map: &RoadMap, station_m: f64) -> f64 {
        let part = self.lane_at(station_m);
        map.lane(part.lane).height_at(station_m - part.from_m)
    }

    /// The lane with the lowest limit, the first of several; `None` if all allow the same.
    pub fn slowest(&self, map: &RoadMap) -> Option<RouteLane> {
        let limit_mps = |lane: &RouteLane| map.lane(lane.lane).speed_limit_mps;
        let slowest = self.lanes.iter().min_by(|a, b| limit_mps(a).total_cmp(&limit_mps(b)))?;
        self.lanes.iter().any(|lane| limit_mps(lane) > limit_mps(slowest)).then_some(*slowest)
    }

    /// The widest gap of the map that the route leaps over: how wide it is, m, and between which lanes.
    pub fn leap(&self, map: &RoadMap) -> Option<(f64, LaneIndex, LaneIndex)> {
        let pairs = self.lanes.windows(2).map(|pair| (pair[0].lane, pair[1].lane));
        let linked = pairs.filter(|(lane, next)| map.lane(*lane).successors.contains(next));
        let leaps =
            linked.filter_map(|(lane, next)| Some((map.lane(lane).leap_m(map.lane(next))?, lane, next)));
        leaps.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The lane of the route at a station, clamped to its ends.
    pub fn lane_at(&self, station_m: f64) -> RouteLane {
        let after = self.lanes.partition_point(|lane| lane.enter_m <= station_m);
        self.lanes[after.max(1) - 1]
    }
}

impl RouteLaneChange {
    /// Offset of the source lane's centre from the path (within 5 cm), m, positive to the left. It is 0 up to
    /// the begin of the change; behind the stretch on which the change is permitted, the last value holds.
    pub fn source_offset_m(&self, station_m: f64) -> f64 {
        let part = smooth_step((station_m - self.begin_m) / (self.end_m - self.begin_m)).value;
        -self.shift_m(station_m) * part
    }

    /// Length of the change if it begins at another station, m: the planned length or, if less is left, the
    /// distance to `latest_m`, but at least [`RouteLaneChange::LENGTH_M_MIN`].
    pub fn length_from_m(&self, begin_m: f64) -> f64 {
        (self.end_m - self.begin_m).min(self.latest_m - begin_m).max(RouteLaneChange::LENGTH_M_MIN)
    }

    /// Offset from the path of a vehicle that begins the change at another station, m, positive to the left.
    /// With an infinite station the vehicle stays in the source lane.
    pub fn postponed_offset_m(&self, station_m: f64, begin_m: f64) -> f64 {
        let part = smooth_step((station_m - begin_m) / self.length_from_m(begin_m)).value;
        self.source_offset_m(station_m) + self.shift_m(station_m) * part
    }

    /// Station at which a vehicle began the change, m: its path leads through a place `from_source_m` left of the source
    /// lane's centre at a station. A vehicle that is farther aside than the earliest change would have it began there.
    pub fn begun_m(&self, station_m: f64, from_source_m: f64) -> f64 {
        let (mut early_m, mut late_m) = (self.begin_m, station_m.max(self.begin_m));
        let shift_m = self.shift_m(station_m);
        // The later it began, the nearer it still is to the source lane.
        for _ in 0..HALVINGS {
            let middle_m = (early_m + late_m) / 2.0;
            let part = smooth_step((station_m - middle_m) / self.length_from_m(middle_m)).value;
            if part * shift_m.abs() > from_source_m * self.lateral_m.signum() {
                early_m = middle_m;
            } else {
                late_m = middle_m;
            }
        }
        early_m
    }

    /// Least length of a lane change, m.
    pub const LENGTH_M_MIN: f64 = LENGTH_M_MIN;

    /// Distance between the two centres at a station, m, positive to the left.
    fn shift_m(&self, station_m: f64) -> f64 {
        let after = self.shifts_m.partition_point(|(at_m, _)| *at_m <= station_m);
        let after = after.clamp(1, self.shifts_m.len() - 1);
        let ((from_m, from), (to_m, to)) = (self.shifts_m[after - 1], self.shifts_m[after]);
        from + (to - from) * ((station_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0)
    }
}

/// The error for a goal that cannot be reached. It says whether there would be a way with a lane change.
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
        format!(
            "from {from}, {to} can be reached only with a lane change for which there is no room: markings, a \
             junction or the end of a lane forbid it; start earlier or in another lane"
        )
    } else {
        let for_buses = map.lanes.iter().any(|lane| lane.for_buses);
        let but = if for_buses { "; bus lanes are left out" } else { "" };
        format!("there is no way from {from} to {to}{but}")
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

/// All conflicts of a route, by rising station.
fn conflicts(map: &RoadMap, lanes: &[RouteLane], path: &Path) -> Vec<Conflict> {
    let mut all = Vec::new();
    for (i, here) in lanes.iter().enumerate() {
        let Some(junction) = map.lane(here.lane).junction else { continue };
        let Some(inside) = path.part(here.from_m, here.to_m) else { continue };
        let begin_m = here.from_m.max(0.0);
        let next = lanes.get(i + 1).map(|next| next.lane);
        for other in map.junctions[junction].lanes.iter().copied() {
            let on_route = lanes.iter().any(|lane| lane.lane == other);
            if on_route || diverges(map, here.lane, other) {
                continue;
            }
            let joins = next.is_some_and(|next| map.lane(other).successors.contains(&next));
            let found = if joins {
                merge(&inside, &map.lane(other).centre).into_iter().collect()
            } else {
                crossings(&inside, &map.lane(other).centre)
            };
            let passes_over = |(station_m, lane_station_m): &(f64, f64)| {
                let on_lane_m = station_m + begin_m - here.from_m;
                map.lane(here.lane).is_apart_at(on_lane_m, map.lane(other), *lane_station_m)
            };
            let meet = found.into_iter().filter(|stations_m| !passes_over(stations_m));
            all.extend(meet.map(|(station_m, lane_station_m)| Conflict {
                station_m: station_m + begin_m,
                lane: other,
                lane_station_m,
                angle_rad: wrap_angle(
                    map.lane(other).centre.pose_at(lane_station_m).heading_rad
                        - inside.pose_at(station_m).heading_rad,
                ),
            }));
        }
    }
    all.sort_by(|a, b| a.station_m.total_cmp(&b.station_m).then(a.lane.cmp(&b.lane)));
    all
}

/// Whether two lanes begin at the end of the same lane. A vehicle on the other one then comes from behind the
/// ego vehicle or drives ahead of it, and is no crossing traffic.
fn diverges(map: &RoadMap, here: LaneIndex, other: LaneIndex) -> bool {
    map.lane(other).predecessors.iter().any(|from| map.lane(here).predecessors.contains(from))
}
