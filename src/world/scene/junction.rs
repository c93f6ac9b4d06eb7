//! Conflict areas: the parts of a junction's lanes on which two vehicles would be in each other's way, and which of
//! the two lanes goes first.
//!
//! Made once for a map from its lanes alone. Where the way of another vehicle passes through the area,
//! and when, is for the drivers to judge (see `manners`). Lanes that leave the same lane are no
//! conflict: a vehicle on one of them follows the vehicle ahead. Where lights differ, they decide before any
//! of this (see `behave::right_of_way`).

use avastra_base::geometry::wrap_angle;
use avastra_road::{Lane, LaneIndex, RoadMap, Route, RouteLane, Turn};

/// Centre lines nearer than this are in conflict, m: two of the widest bodies (2.44 m) and 0.36 m of
/// air.
const CORRIDOR_M: f64 = 2.8;

/// Step in which lanes are compared, m.
const STEP_M: f64 = 0.5;

/// More than rounding makes of a distance on a map, m.
const ROUNDING_M: f64 = 1e-6;

/// From this angle on two approaches come towards each other, rad.
const OPPOSING_RAD_MIN: f64 = 135.0 * core::f64::consts::PI / 180.0;

/// Up to this angle they come from the same side, rad.
const ALONGSIDE_RAD_MAX: f64 = 30.0 * core::f64::consts::PI / 180.0;

/// Two lanes from the same side whose turns differ by less than this, rad (15°), are told apart by their names. Ours.
const ALIKE_RAD: f64 = core::f64::consts::PI / 12.0;

/// One lane's part of a conflict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Area {
    /// Its stretch of the own lane, or of a way along it, m.
    pub from_m: f64,
    pub to_m: f64,
    pub other: LaneIndex,
    /// Its stretch of the other lane, m.
    pub other_from_m: f64,
    pub other_to_m: f64,
    /// Whether traffic of the own lane goes before that of the other.
    pub goes_first: bool,
}

/// The conflict areas of every lane of a map.
#[derive(Debug, Clone)]
pub(crate) struct ConflictAreas {
    /// By lane index.
    by_lane: Vec<Vec<Area>>,
}

impl ConflictAreas {
    pub fn new(map: &RoadMap) -> ConflictAreas {
        let mut by_lane = vec![Vec::new(); map.lanes.len()];
        for junction in &map.junctions {
            for (index, &a) in junction.lanes.iter().enumerate() {
                for &b in &junction.lanes[index + 1..] {
                    let Some((on_a, on_b)) = conflict(map, a, b) else { continue };
                    let a_first = goes_first(map, a, b);
                    let area = |from_to: (f64, f64), other, other_from_to: (f64, f64), goes_first| Area {
                        from_m: from_to.0,
                        to_m: from_to.1,
                        other,
                        other_from_m: other_from_to.0,
                        other_to_m: other_from_to.1,
                        goes_first,
                    };
                    by_lane[a.0].push(area(on_a, b, on_b, a_first));
                    by_lane[b.0].push(area(on_b, a, on_a, !a_first));
                }
            }
        }
        ConflictAreas { by_lane }
    }

    pub fn of(&self, lane: LaneIndex) -> &[Area] {
        &self.by_lane[lane.0]
    }
}

/// The stretches on which two lanes of a junction are in each other's way: on the first, on the second.
fn conflict(map: &RoadMap, a: LaneIndex, b: LaneIndex) -> Option<((f64, f64), (f64, f64))> {
    let (lane_a, lane_b) = (map.lane(a), map.lane(b));
    if lane_a.predecessors.iter().any(|from| lane_b.predecessors.contains(from)) {
        return None;
    }
    if !lane_a.centre.bounds().grown(CORRIDOR_M).meets(&lane_b.centre.bounds()) {
        return None;
    }
    let on_a = stretch_near(lane_a, lane_b)?;
    let on_b = stretch_near(lane_b, lane_a)?;
    Some((on_a, on_b))
}

/// From the first to the last station of `lane` at which it is within the corridor of `other`, on one level, m.
fn stretch_near(lane: &Lane, other: &Lane) -> Option<(f64, f64)> {
    let path = &lane.centre;
    let steps = (path.length_m() / STEP_M).ceil().max(1.0);
    let step_m = path.length_m() / steps;
    let station_m = |step: u32| path.length_m() * f64::from(step) / steps;
    let last = steps as u32;
    // The first such step from one end on, by their numbers from there.
    let first_of = |step_of: &dyn Fn(u32) -> u32| {
        let mut nth = 0;
        while nth <= last {
            let station_m = station_m(step_of(nth));
            let beside = other.centre.project(path.position_at(station_m));
            if beside.distance_m < CORRIDOR_M && !lane.is_apart_at(station_m, other, beside.station_m) {
                return Some(station_m);
            }
            // A metre of way brings a lane nearer by a metre at most: until then nothing is within the corridor.
            let free_m = beside.distance_m - CORRIDOR_M - ROUNDING_M;
            nth += ((free_m / step_m) as u32).max(1);
        }
        None
    };
    Some((first_of(&|nth| nth)?, first_of(&|nth| last - nth)?))
}

/// Whether `a` goes before `b`; see [`order`].
pub(crate) fn goes_first(map: &RoadMap, a: LaneIndex, b: LaneIndex) -> bool {
    order(map, a, b).0
}

/// The criterion that decides which of two lanes goes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Signs,
    Turning,
    FromTheRight,
    SameSide,
}

/// Whether `a` goes before `b`, and what decides it.
///
/// Signs decide first: a priority road before a lane without signs, and that before a stop or yield sign. Where they
/// say the same, a vehicle that turns left (right, where traffic keeps left) or round yields to oncoming traffic.
/// Otherwise the vehicle from the right goes first (Vienna Convention, article 18; so in Estonia and California).
///
/// If both come from the same side, the one that turns less goes first. A circle or a bend that both come round is no
/// turn ([`turns_rad`]). If they turn alike (within [`ALIKE_RAD`]), a vehicle that turns across the road yields;
/// otherwise the lane that the file names first goes first.
pub(crate) fn order(map: &RoadMap, a: LaneIndex, b: LaneIndex) -> (bool, Order) {
    let (signs_a, signs_b) = (map.lane(a).precedence, map.lane(b).precedence);
    if signs_a != signs_b {
        return (signs_a < signs_b, Order::Signs);
    }
    let approach_rad = |lane: LaneIndex| map.lane(lane).centre.points()[0].heading_rad;
    let angle_rad = wrap_angle(approach_rad(b) - approach_rad(a));
    let rank = |index: LaneIndex| {
        let lane = map.lane(index);
        let across = if lane.keeps_left { Turn::Right } else { Turn::Left };
        match lane.turn {
            Turn::Straight => 0,
            turn if turn == across => 2,
            Turn::Left | Turn::Right => 1,
            Turn::UTurn => 3,
        }
    };
    let goes_before = (rank(a), a) < (rank(b), b);
    let turns_less_by_rad = turns_rad(map, b).abs() - turns_rad(map, a).abs();
    if angle_rad.abs() > OPPOSING_RAD_MIN {
        return (goes_before, Order::Turning);
    }
    if angle_rad.abs() < ALONGSIDE_RAD_MAX {
        let alike = turns_less_by_rad.abs() < ALIKE_RAD;
        return (if alike { goes_before } else { turns_less_by_rad > 0.0 }, Order::SameSide);
    }
    // A heading turned to the left of the own one comes from the right.
    (angle_rad < 0.0, Order::FromTheRight)
}

/// How far a lane turns beyond what its approach turned over the same length, rad to the left. A vehicle that goes on round a circle
/// does not turn, and one that leaves it does. `turning.rs` asks the same of ways.
fn turns_rad(map: &RoadMap, index: LaneIndex) -> f64 {
    let lane = &map.lane(index).centre;
    let length_m = lane.length_m();
    let before = map.lane(index).predecessors.first().map(|before| &map.lane(*before).centre);
    let before_rad =
        before.map_or(0.0, |before| before.turned_rad(before.length_m() - length_m, before.length_m()));
    lane.turned_rad(0.0, length_m) - before_rad
}

/// A conflict area on the ego vehicle's route.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RouteArea {
    /// The lane of the route.
    pub lane: LaneIndex,
    /// Its stations are those of the route.
    pub area: Area,
}

/// The conflict areas of a route, by rising station.
pub(crate) fn route_areas(areas: &ConflictAreas, route: &Route) -> Vec<RouteArea> {
    let of_lane = |part: &RouteLane| {
        let (lane, from_m) = (part.lane, part.from_m);
        areas.of(lane).iter().map(move |area| {
            let area = Area { from_m: from_m + area.from_m, to_m: from_m + area.to_m, ..*area };
            RouteArea { lane, area }
        })
    };
    let mut all: Vec<RouteArea> = route.lanes.iter().flat_map(of_lane).collect();
    all.sort_by(|a, b| a.area.from_m.total_cmp(&b.area.from_m).then(a.area.other.cmp(&b.area.other)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;

    #[test]
    fn a_crossing_is_an_area_on_either_lane_and_the_right_goes_first() {
        let map = testing::crossing().map.clone();
        let areas = ConflictAreas::new(&map);
        let inside = |road: &str| map.place(road, -1, 10.0).expect("it is there").lane;
        let (east, north) = (inside("2"), inside("5"));
        let [of_east] = areas.of(east) else { panic!("{areas:?}") };
        let [of_north] = areas.of(north) else { panic!("{areas:?}") };
        // The other lane's centre crosses at x = 300, ten metres into the lane.
        assert!((of_east.from_m - 7.5).abs() < STEP_M && (of_east.to_m - 12.5).abs() < STEP_M, "{of_east:?}");
        assert_eq!((of_east.other, of_north.other), (north, east));
        assert_eq!((of_east.other_from_m, of_east.other_to_m), (of_north.from_m, of_north.to_m));
        assert!(of_north.goes_first && !of_east.goes_first, "the one going north comes from the right");
    }

    /// Stretches skipped as too far away make no difference.
    #[test]
    fn stretches_are_those_of_a_comparison_at_every_step() {
        let naive = |lane: &Lane, other: &Lane| {
            let path = &lane.centre;
            let steps = (path.length_m() / STEP_M).ceil().max(1.0);
            let stations = (0..=steps as u32).map(|step| path.length_m() * f64::from(step) / steps);
            let near: Vec<f64> = stations
                .filter(|station_m| {
                    let beside = other.centre.project(path.pose_at(*station_m).position);
                    beside.distance_m < CORRIDOR_M && !lane.is_apart_at(*station_m, other, beside.station_m)
                })
                .collect();
            Some((*near.first()?, *near.last()?))
        };
        let (mut near, mut far) = (0, 0);
        for scene in [testing::corner(), testing::four_arms(), testing::overpass(3.0), testing::divided()] {
            for (index, lane) in scene.map.lanes.iter().enumerate() {
                for other in scene.map.lanes.iter().skip(index + 1) {
                    let found = stretch_near(lane, other);
                    assert_eq!(found, naive(lane, other), "{:?} by {:?}", lane.key, other.key);
                    *if found.is_some() { &mut near } else { &mut far } += 1;
                }
            }
        }
        assert!(near > 20 && far > 20, "{near}, {far}");
    }

    #[test]
    fn of_two_lanes_one_goes_first() {
        let map = testing::corner().map.clone();
        let areas = ConflictAreas::new(&map);
        let mut pairs = 0;
        for (index, of_lane) in areas.by_lane.iter().enumerate() {
            for area in of_lane {
                let back = areas.of(area.other).iter().find(|back| back.other.0 == index);
                assert_ne!(back.expect("a conflict has two sides").goes_first, area.goes_first);
                pairs += 1;
            }
        }
        assert!(pairs > 10, "{pairs}");
    }
}
