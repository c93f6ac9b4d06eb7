//! Road 2 as authored in `scenarios/roads/corner.xodr`, held against its survey.

use crate::geometry::{Path, Vec2, wrap_angle};

use crate::road::{LaneIndex, RoadError, RoadMap, Route, Turn};

const CORNER: &str = include_str!("../../../scenarios/roads/corner.xodr");

/// The ego lane of the San Francisco map from start to goal, in the local frame of the survey.
const SURVEY: [(f64, f64); 25] = [
    (-0.01, -0.01),
    (-32.86, 31.52),
    (-41.28, 39.28),
    (-45.86, 44.5),
    (-47.37, 47.44),
    (-47.58, 50.85),
    (-45.92, 53.79),
    (-43.63, 56.67),
    (-37.4, 63.2),
    (-22.5, 78.82),
    (-7.59, 94.45),
    (7.31, 110.08),
    (22.22, 125.71),
    (30.01, 133.46),
    (43.78, 147.97),
    (46.45, 154.13),
    (44.54, 159.56),
    (38.56, 162.7),
    (30.76, 161.96),
    (13.67, 159.22),
    (-3.35, 156.48),
    (-20.37, 153.74),
    (-37.39, 151.01),
    (-54.41, 148.27),
    (-71.41, 145.54),
];

pub fn corner() -> RoadMap {
    RoadMap::from_opendrive("corner", CORNER).unwrap()
}

fn corner_route(map: &RoadMap) -> Route {
    let start = map.nearest(Vec2::new(0.0, 0.0), 2.377, 1.0).unwrap();
    let goal = map.nearest(Vec2::new(-71.4, 145.5), -2.983, 1.0).unwrap();
    Route::find(map, start, goal).unwrap()
}

#[test]
fn the_corner_route_follows_the_survey() {
    let map = corner();
    assert_eq!(map.warnings, [""; 0]);
    let route = corner_route(&map);
    assert!((route.goal_m - 334.2).abs() < 1.5, "{}", route.goal_m);
    let surveyed = Path::new(SURVEY.iter().map(|(x, y)| (Vec2::new(*x, *y), 0.0, 0.0))).unwrap();
    for (x, y) in SURVEY {
        let distance_m = route.path.project(Vec2::new(x, y)).distance_m;
        assert!(distance_m < 0.3, "{distance_m} m at {x}, {y}");
    }
    let mut station_m = 0.0;
    while station_m < route.goal_m {
        let distance_m = surveyed.project(route.path.pose_at(station_m).position).distance_m;
        assert!(distance_m < 0.3, "{distance_m} m at station {station_m}");
        station_m += 0.5;
    }
    assert!((route.path.length_m() - route.goal_m - 51.5).abs() < 1.0, "{}", route.path.length_m());
}

#[test]
fn lanes_of_the_corner_join() {
    let map = corner();
    for lane in &map.lanes {
        let end = lane.centre.pose_at(lane.centre.length_m());
        for next in &lane.successors {
            let begin = map.lane(*next).centre.pose_at(0.0);
            let names = (&lane.key, &map.lane(*next).key);
            assert!((begin.position - end.position).norm() < 0.05, "{names:?}: {end:?} {begin:?}");
            assert!(
                wrap_angle(begin.heading_rad - end.heading_rad).abs() < 1.0_f64.to_radians(),
                "{names:?}"
            );
        }
        let at_rim = lane.junction.is_none() && lane.key.section == 0;
        assert!(!lane.predecessors.is_empty() || at_rim, "{:?} comes from nowhere", lane.key);
        assert!(!lane.successors.is_empty() || at_rim, "{:?} leads nowhere", lane.key);
    }
}

#[test]
fn signals_and_crosswalks_of_the_corner_stand_where_surveyed() {
    let map = corner();
    let route = corner_route(&map);
    let stops: Vec<_> =
        route.stop_lines.iter().map(|line| (line.station_m, &map.signals[line.signal])).collect();
    assert_eq!(stops.len(), 2);
    for ((station_m, signal), (expected_m, junction)) in stops.iter().zip([(45.5, "J_6"), (173.2, "J_8")]) {
        assert!((station_m - expected_m).abs() < 1.0, "{station_m}");
        assert_eq!(map.junctions[signal.junction.unwrap()].name, junction);
        assert_eq!(signal.group, 0);
    }
    for (junction, lights) in [("J_6", [1, 2]), ("J_8", [2, 3])] {
        let index = map.junctions.iter().position(|found| found.name == junction).unwrap();
        assert_eq!(map.junctions[index].groups, 2);
        for (group, expected) in lights.into_iter().enumerate() {
            let of_group = map.signals.iter().filter(|s| (s.junction, s.group) == (Some(index), group));
            assert_eq!(of_group.count(), expected, "{junction}, group {group}");
        }
    }
    assert_eq!(map.crosswalks.len(), 6);
    let surveyed = [(46.0, 56.1), (77.8, 86.0), (174.0, 183.6), (231.4, 249.0)];
    assert_eq!(route.crosswalks_m.len(), surveyed.len(), "{:?}", route.crosswalks_m);
    for (found, expected) in route.crosswalks_m.iter().zip(surveyed) {
        assert!((found.0 - expected.0).abs() < 1.0 && (found.1 - expected.1).abs() < 1.0, "{found:?}");
    }
}

#[test]
fn oncoming_lanes_lie_beside_the_route_on_both_streets() {
    let map = corner();
    let route = corner_route(&map);
    for station_m in [20.0, 120.0] {
        let left = map.lane(route.lane_at(station_m).lane).left.unwrap();
        assert!(!left.same_direction);
        assert_eq!(left.gap_m, 0.0);
        let right = map.lane(route.lane_at(station_m).lane).right.unwrap();
        assert!(right.same_direction);
    }
}

#[test]
fn conflicts_of_the_corner_are_the_surveyed_ones() {
    let map = corner();
    let route = corner_route(&map);
    let found: Vec<_> = route
        .conflicts
        .iter()
        .map(|conflict| {
            let lane = map.lane(conflict.lane);
            let from = map.lane(lane.predecessors[0]).key.clone();
            let to = map.lane(lane.successors[0]).key.clone();
            let names = format!("{}/{} > {}/{}", from.road, from.lane, to.road, to.lane);
            (conflict.station_m, conflict.angle_rad.to_degrees(), names)
        })
        .collect();
    // Stations and angles of the survey (which counts angles without sign).
    let crossing = [(67.1, 70.9, "3/-2 > 2/-2"), (212.9, 117.0, "4/1 > 2/1"), (217.4, 74.0, "4/2 > 2/2")];
    for (station_m, angle_deg, names) in crossing {
        let near = found.iter().find(|(_, _, found)| found == names);
        let (at_m, angle, _) = near.unwrap_or_else(|| panic!("{names} is not among {found:?}"));
        assert!((at_m - station_m).abs() < 3.0, "{names} at {at_m}");
        assert!((angle.abs() - angle_deg).abs() < 25.0, "{names} at {angle}");
    }
    assert!(found.iter().any(|(_, _, names)| names == "3/-1 > 2/-1"), "{found:?}");
    assert_eq!(found.len(), 4, "{found:?}");
}

#[test]
fn turns_and_limits_of_the_corner() {
    let map = corner();
    let count = |turn| map.lanes.iter().filter(|lane| lane.turn == turn).count();
    let (streets, left, right) = (4 * 4 + 4, 4 + 3, 3 + 1);
    assert_eq!((count(Turn::Left), count(Turn::Right), count(Turn::UTurn)), (left, right, 0));
    assert_eq!(count(Turn::Straight), streets + 4 + 4);
    assert!(map.lanes.iter().all(|lane| lane.speed_limit_mps == 11.176));
}

#[test]
fn every_lane_is_found_again_from_its_own_centre() {
    let map = corner();
    for (index, lane) in map.lanes.iter().enumerate() {
        for fraction in [0.05, 0.5, 0.95] {
            let station_m = lane.centre.length_m() * fraction;
            let pose = lane.centre.pose_at(station_m);
            let found = map.nearest(pose.position, pose.heading_rad, 0.5).unwrap();
            // Lanes lie over each other inside junctions; outside, there is but one.
            if lane.junction.is_none() {
                assert_eq!(found.lane, LaneIndex(index));
                assert!((found.station_m - station_m).abs() < 1e-6);
            }
            assert!(found.offset_m.abs() < 0.6, "{:?}: {found:?}", lane.key);
        }
    }
    assert_eq!(map.nearest(Vec2::new(500.0, 500.0), 0.0, 3.0), None);
}

/// A reach beyond all cells makes the search go through all lanes.
#[test]
fn the_grid_finds_what_a_search_through_all_lanes_finds() {
    let map = corner();
    for i in 0..60 {
        for j in 0..60 {
            let point = Vec2::new(f64::from(i) * 6.1 - 200.0, f64::from(j) * 6.7 - 110.0);
            let heading_rad = f64::from(i * j % 7) - 3.0;
            let all = map.nearest(point, heading_rad, 1e6).unwrap();
            let lane = map.lane(all.lane);
            let beyond_m = lane.centre.project(point).distance_m - lane.width_at(all.station_m) / 2.0;
            let expected = (beyond_m <= 5.0).then_some(all);
            assert_eq!(map.nearest(point, heading_rad, 5.0), expected, "at {point:?}");
        }
    }
}

/// Where `scenarios/roads.ava` puts start and goal.
#[test]
fn start_and_goal_are_the_surveyed_places() {
    let map = corner();
    for (road, lane, s_m, (x, y)) in [("1", -1, 105.88, (0.0, 0.0)), ("5", -3, 75.27, (-71.4, 145.5))] {
        let place = map.place(road, lane, s_m).unwrap();
        let position = map.lane(place.lane).centre.pose_at(place.station_m).position;
        assert!((position - Vec2::new(x, y)).norm() < 0.1, "{position:?}");
    }
}

#[test]
fn places_are_named_or_refused() {
    let map = corner();
    let place = map.place("1", 2, 30.0).unwrap();
    let lane = map.lane(place.lane);
    assert!((place.station_m - (lane.centre.length_m() - 30.0)).abs() < 1e-6);
    for (road, lane, s_m, part) in
        [("99", -1, 0.0, "road `99`"), ("1", 3, 0.0, "lane 3"), ("1", -1, 900.0, "not there at 900 m")]
    {
        let Err(RoadError::Route { message }) = map.place(road, lane, s_m) else { panic!() };
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_route_may_begin_where_a_lane_ends() {
    let map = corner();
    let mut start = map.place("1", -1, 151.431).unwrap();
    let goal = map.place("2", -1, 10.0).unwrap();
    start.station_m = map.lane(start.lane).centre.length_m();
    let route = Route::find(&map, start, goal).unwrap();
    let way_m = map.lane(route.lanes[1].lane).centre.length_m();
    assert!((route.goal_m - way_m - 10.0).abs() < 1e-3, "{}", route.goal_m);
    assert!(
        (route.path.pose_at(route.goal_m).position
            - map.lane(goal.lane).centre.pose_at(goal.station_m).position)
            .norm()
            < 1e-3
    );
}

#[test]
fn a_way_may_need_a_lane_change_and_room_for_it() {
    let map = corner();
    let start = map.place("1", -2, 100.0).unwrap();
    let goal = map.place("5", -3, 50.0).unwrap();
    let route = Route::find(&map, start, goal).unwrap();
    assert_eq!(route.changes.len(), 1, "{:?}", route.changes);
    let change = &route.changes[0];
    assert!(change.lateral_m > 3.0 && change.latest_m < change.begin_m + 100.0, "{change:?}");
    for station_m in [change.begin_m, change.latest_m - 0.5] {
        assert_eq!(map.lane(route.lane_at(station_m).lane).junction, None);
    }
    // 16 m before the goal there is no more room.
    let late = map.place("5", -2, 34.0).unwrap();
    let Err(RoadError::Route { message }) = Route::find(&map, late, goal) else { panic!() };
    assert!(message.contains("there is no room"), "{message}");
    let Err(RoadError::Route { message }) = Route::find(&map, goal, start) else { panic!() };
    assert!(message.contains("no way"), "{message}");
}
