//! Facts of a moment that follow from the ego vehicle's place on its route alone: the limit of its lane, the way to the
//! next junction and to the goal, the light before it, the kind of road.
//!
//! `sim` asks for it at a moment. `prove` asks for the whole route, in stretches on each of which all of it is known.

use core::ops::RangeInclusive;

use crate::model::JUNCTION_AHEAD_M_MAX;
use crate::model::vocabulary::{RoadKind, Turn};
use avastra_road::{LaneIndex, RoadMap, Route, RouteLane};

/// How far ahead a traffic light is searched for, m.
pub const LIGHT_AHEAD_M: f64 = 100.0;
/// The ego vehicle is at a junction that is nearer than this, m, as in the published package.
pub const NEAR_JUNCTION_M: f64 = 20.0;

/// A longer route has so many stretches that nothing is said of them.
const STRETCHES_MAX: usize = 512;

/// The facts of a place on a route.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnRoute {
    /// Limit of the lane, m/s.
    pub limit_mps: f64,
    /// Along the route to the next junction, m: 0 in one, [`JUNCTION_AHEAD_M_MAX`] if there is none nearer.
    pub junction_ahead_m: f64,
    /// Along the route to the end of that junction, m; [`JUNCTION_AHEAD_M_MAX`] if there is none nearer.
    pub junction_end_m: f64,
    /// Along the route to the goal, m.
    pub route_left_m: f64,
    /// The next traffic light within reach, by index in `RoadMap::signals`.
    pub signal: Option<usize>,
    pub road: RoadKind,
    /// Where the route goes at that junction.
    pub turn: Turn,
}

/// A part of a route on which the ego vehicle meets one limit, one kind of road, and a light or none.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    pub limit_mps: f64,
    pub junction_ahead_m: RangeInclusive<f64>,
    pub route_left_m: RangeInclusive<f64>,
    pub has_light: bool,
    pub road: RoadKind,
    pub turn: Turn,
}

impl OnRoute {
    pub fn at(map: &RoadMap, route: &Route, station_m: f64) -> OnRoute {
        let first = route.lanes.partition_point(|lane| lane.enter_m <= station_m).max(1) - 1;
        let ahead = route.lanes[first..].iter().map(|RouteLane { lane, enter_m, .. }| (*lane, *enter_m));
        let reach = station_m..=station_m + LIGHT_AHEAD_M;
        let line = route.stop_lines.iter().find(|line| reach.contains(&line.station_m));
        let (junction_ahead_m, turn) = junction_ahead(map, ahead.clone(), station_m);
        let inside = ahead.skip_while(|(lane, _)| map.lane(*lane).junction.is_none());
        let mut behind = inside.skip_while(|(lane, _)| map.lane(*lane).junction.is_some());
        let end_m = behind.next().map_or(JUNCTION_AHEAD_M_MAX, |(_, enter_m)| enter_m - station_m);
        OnRoute {
            limit_mps: map.lane(route.lanes[first].lane).speed_limit_mps,
            junction_ahead_m,
            junction_end_m: end_m.min(JUNCTION_AHEAD_M_MAX),
            turn,
            route_left_m: route.goal_m - station_m,
            signal: line.map(|line| line.signal),
            road: road_kind(map, &route.lanes[first..], station_m),
        }
    }
}

/// Distance from a station to the first lane inside a junction, m, and where it leads there. `ahead` has the lanes from the
/// station on, each with the station at which it begins. Through a junction of several lanes in a row the first one tells.
pub fn junction_ahead(
    map: &RoadMap,
    mut ahead: impl Iterator<Item = (LaneIndex, f64)>,
    station_m: f64,
) -> (f64, Turn) {
    let junction = ahead.find(|(lane, _)| map.lane(*lane).junction.is_some());
    let near = junction.filter(|(_, from_m)| from_m - station_m < JUNCTION_AHEAD_M_MAX);
    let Some((lane, from_m)) = near else { return (JUNCTION_AHEAD_M_MAX, Turn::None) };
    let turn = match map.lane(lane).turn {
        avastra_road::Turn::Left => Turn::Left,
        avastra_road::Turn::Straight => Turn::Straight,
        avastra_road::Turn::Right => Turn::Right,
        avastra_road::Turn::UTurn => Turn::Back,
    };
    ((from_m - station_m).max(0.0), turn)
}

/// `ahead` has the lanes of the route from the station on.
fn road_kind(map: &RoadMap, ahead: &[RouteLane], station_m: f64) -> RoadKind {
    let entered = ahead.iter().take_while(|lane| lane.enter_m <= station_m + NEAR_JUNCTION_M).count();
    let (here, soon) = (map.lane(ahead[0].lane), map.lane(ahead[entered.max(1) - 1].lane));
    if here.junction.is_some() {
        return RoadKind::InJunction;
    }
    if soon.junction.is_some() {
        return RoadKind::NearJunction;
    }
    let mut beside = here.left;
    while let Some(neighbour) = beside {
        if !neighbour.same_direction {
            return RoadKind::TwoWay;
        }
        beside = map.lane(neighbour.lane).left;
    }
    RoadKind::OneWay
}

/// A route in stretches; every station belongs to one of them. None, if there would be too many.
pub(crate) fn stretches(map: &RoadMap, route: &Route) -> Vec<Stretch> {
    let end_m = route.path.length_m();
    let lanes = route.lanes.iter().map(|lane| lane.enter_m);
    let before_lanes =
        lanes.flat_map(|enter_m| [0.0, NEAR_JUNCTION_M, JUNCTION_AHEAD_M_MAX].map(|m| enter_m - m));
    let lines = route.stop_lines.iter().map(|line| line.station_m);
    let before_lines = lines.clone().map(|line_m| line_m - LIGHT_AHEAD_M);
    let mut cuts_m: Vec<f64> =
        before_lanes.chain(before_lines).chain(lines.clone()).chain([0.0, end_m]).collect();
    cuts_m.retain(|cut_m| (0.0..=end_m).contains(cut_m));
    cuts_m.sort_by(f64::total_cmp);
    cuts_m.dedup();
    if cuts_m.len() > STRETCHES_MAX {
        return Vec::new();
    }
    // A light counts up to its line, the lane behind the line from there on: together they are at the line alone.
    let at_lines = lines.filter(|line_m| (0.0..=end_m).contains(line_m)).map(|line_m| (line_m, line_m));
    let between = cuts_m.windows(2).map(|ends| (ends[0], ends[1]));
    between.chain(at_lines).map(|(from_m, to_m)| stretch(map, route, from_m, to_m)).collect()
}

/// The facts between two stations, where nothing changes but the distances.
fn stretch(map: &RoadMap, route: &Route, from_m: f64, to_m: f64) -> Stretch {
    let (middle_m, half_m) = ((from_m + to_m) / 2.0, (to_m - from_m) / 2.0);
    let OnRoute { limit_mps, junction_ahead_m, route_left_m, signal, road, turn, .. } =
        OnRoute::at(map, route, middle_m);
    let around = |value_m: f64, low_m: f64, high_m: f64| {
        (value_m - half_m).clamp(low_m, high_m)..=(value_m + half_m).clamp(low_m, high_m)
    };
    let junction_ahead_m = match junction_ahead_m {
        // Within a junction, and where none is near, it does not change.
        0.0 => 0.0..=0.0,
        JUNCTION_AHEAD_M_MAX => JUNCTION_AHEAD_M_MAX..=JUNCTION_AHEAD_M_MAX,
        ahead_m => around(ahead_m, 0.0, JUNCTION_AHEAD_M_MAX),
    };
    let route_left_m = around(route_left_m, f64::NEG_INFINITY, f64::INFINITY);
    Stretch { limit_mps, junction_ahead_m, route_left_m, has_light: signal.is_some(), road, turn }
}
