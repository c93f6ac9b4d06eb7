//! Road 3 as authored in `scenarios/roads/crossroad.xodr`, held against its survey.

use crate::geometry::{Path, Vec2};
use crate::road::{LaneIndex, RoadMap, Route, Side};

use super::survey::{Leg, lanes_join, lights, ways};

const CROSSROAD: &str = include_str!("../../../scenarios/roads/crossroad.xodr");

/// The lane of the Tartu map that leads to the goal, from abreast of the start, in the local frame of the survey.
const SURVEY: [(f64, f64); 28] = [
    (2.5, 2.16),
    (31.37, -31.15),
    (47.12, -49.86),
    (54.75, -58.83),
    (60.21, -65.31),
    (65.92, -71.8),
    (71.53, -78.78),
    (89.5, -100.05),
    (91.29, -102.16),
    (93.15, -104.19),
    (99.25, -110.85),
    (117.21, -129.64),
    (127.16, -140.2),
    (128.57, -141.82),
    (130.34, -143.64),
    (135.98, -149.88),
    (145.08, -160.03),
    (150.26, -165.55),
    (157.17, -168.96),
    (164.84, -170.13),
    (172.83, -170.14),
    (179.44, -166.28),
    (185.23, -160.85),
    (195.28, -151.77),
    (207.89, -140.14),
    (213.8, -133.94),
    (216.4, -130.83),
    (218.83, -127.6),
];

/// The surveyed carriageways whose lanes neither begin nor end on the way.
const LEGS: [Leg; 11] = [
    Leg {
        name: "J_2-SW-in",
        start: (55.738, -117.122, 0.97071),
        pieces: &[(17.037, -0.016659)],
        lanes: &[(-1.75, -1.75), (-4.7, -4.76), (-7.67, -7.54)],
    },
    Leg {
        name: "J_2-SW-out",
        start: (66.452, -100.733, -2.57062),
        pieces: &[(15.313, 0.006349), (21.327, 0.0)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "J_2-SE-out",
        start: (94.445, -103.012, -0.81443),
        pieces: &[(49.501, 0.0)],
        lanes: &[(-1.75, -1.75), (-4.83, -4.99), (-7.81, -8.06), (-10.89, -11.23)],
    },
    Leg {
        name: "J_2-NE-out",
        start: (100.192, -75.76, 0.64039),
        pieces: &[(15.847, 0.0)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "J_2-NW-out",
        start: (76.432, -78.23, 2.30572),
        pieces: &[(153.792, -0.000139)],
        lanes: &[(-1.75, -1.75), (-5.55, -5.09)],
    },
    Leg {
        name: "J_1-SE-out",
        start: (131.641, -142.463, -0.83863),
        pieces: &[(22.046, 0.0)],
        lanes: &[(-1.75, -1.75), (-4.98, -4.83), (-8.11, -7.97), (-11.37, -11.68)],
    },
    Leg {
        name: "J_1-SE-in",
        start: (148.023, -157.387, 2.30496),
        pieces: &[(9.781, 0.0)],
        lanes: &[(-1.75, -1.75), (-5.42, -5.34)],
    },
    Leg {
        name: "J_0-SW-out",
        start: (143.478, -186.339, -2.40864),
        pieces: &[(86.248, 0.0)],
        lanes: &[(-1.75, -1.75), (-6.2, -6.21)],
    },
    Leg {
        name: "J_0-SE-in",
        start: (192.58, -209.207, 2.29829),
        pieces: &[(18.905, 0.0)],
        lanes: &[(-1.75, -1.75), (-4.85, -4.79), (-7.91, -7.87)],
    },
    Leg {
        name: "J_0-SE-out",
        start: (176.906, -196.265, -0.82956),
        pieces: &[(88.908, 0.0)],
        lanes: &[(-1.75, -1.75), (-5.16, -4.85)],
    },
    Leg {
        name: "J_0-NE-out",
        start: (178.244, -165.006, 0.7382),
        pieces: &[(33.034, 0.0), (70.03, 0.009458), (107.508, 0.000467)],
        lanes: &[(-1.75, -1.75), (-5.51, -5.5)],
    },
];

/// Stretches of the carriageways (index in `LEGS`, from, to, m) that are compared: those outside junctions.
const STRETCHES: [(usize, f64, f64); 11] = [
    (0, 0.0, 17.0),
    (1, 0.0, 36.6),
    (2, 0.0, 49.5),
    (3, 0.0, 15.8),
    (4, 4.0, 120.0),
    (5, 12.3, 22.0),
    (6, 0.3, 9.7),
    (7, 0.0, 86.0),
    (8, 0.0, 18.9),
    (9, 0.0, 88.9),
    (10, 2.0, 210.0),
];

fn crossroad() -> RoadMap {
    RoadMap::from_opendrive("crossroad", CROSSROAD).unwrap()
}

fn crossroad_route(map: &RoadMap) -> Route {
    let start = map.nearest(Vec2::new(0.0, 0.0), -0.856, 1.0).unwrap();
    let goal = map.nearest(Vec2::new(218.9, -127.6), 0.925, 1.0).unwrap();
    Route::find(map, start, goal).unwrap()
}

#[test]
fn the_crossroad_route_changes_once_to_the_left_and_then_follows_the_survey() {
    let map = crossroad();
    assert_eq!(map.warnings, [""; 0]);
    let route = crossroad_route(&map);
    assert!((route.goal_m - 310.0).abs() < 1.5, "{}", route.goal_m);
    assert_eq!(route.changes.len(), 1);
    let change = &route.changes[0];
    assert!((change.lateral_m - 3.3).abs() < 0.3, "{} m", change.lateral_m);
    // The survey allows it before J_2, between J_2 and J_1, and nowhere later.
    assert!(change.latest_m < 176.0, "{} m", change.latest_m);
    let surveyed = Path::new(SURVEY.iter().map(|(x, y)| (Vec2::new(*x, *y), 0.0, 0.0))).unwrap();
    let mut station_m = change.end_m;
    while station_m < route.goal_m {
        let distance_m = surveyed.project(route.path.pose_at(station_m).position).distance_m;
        assert!(distance_m < 0.3, "{distance_m} m at station {station_m}");
        station_m += 0.5;
    }
    let begin = surveyed.project(route.path.pose_at(0.0).position);
    assert!((begin.distance_m - 3.3).abs() < 0.3, "{begin:?}");
    let least_m =
        1.0 / route.path.points().iter().map(|point| point.curvature_per_m.abs()).fold(0.0, f64::max);
    assert!(least_m > 6.0, "radius {least_m} m");
}

#[test]
fn the_crossroad_streets_follow_the_survey() {
    let map = crossroad();
    for (leg, from_m, to_m) in STRETCHES {
        LEGS[leg].agrees(&map, from_m, to_m);
    }
    lanes_join(&map);
}

#[test]
fn the_crossroad_junctions_join_the_surveyed_lanes() {
    let map = crossroad();
    let expected = [
        "1/-1 > 2/-1",
        "1/-2 > 2/-2",
        "1/-3 > 2/-3",
        "1/-3 > 7/-1",
        "2/2 > 7/-1",
        "2/3 > 1/2",
        "2/4 > 1/3",
        "2/4 > 9/-1",
        "6/-1 > 1/2",
        "6/-2 > 2/-3",
        "6/-3 > 2/-4",
        "8/-1 > 2/-1",
        "8/-1 > 2/-2",
        "8/-2 > 1/3",
        "8/-2 > 2/-3",
        "8/-2 > 2/-4",
        "8/-2 > 7/-1",
    ];
    assert_eq!(ways(&map, "J_2"), expected);
    let expected =
        ["2/-1 > 3/-1", "2/-2 > 3/-2", "2/-3 > 3/-3", "2/-4 > 3/-4", "3/2 > 2/2", "3/3 > 2/3", "5/-1 > 2/3"];
    assert_eq!(ways(&map, "J_1"), expected);
    // The last of each arm is its slip, which the survey has outside the junction.
    let expected = [
        "10/-1 > 3/2",
        "10/-2 > 4/-1",
        "10/-3 > 4/-2",
        "10/-4 > 13/-1",
        "10/-5 > 13/-2",
        "12/-1 > 11/-1",
        "12/-2 > 11/-2",
        "12/-2 > 3/2",
        "12/-3 > 3/3",
        "12/-4 > 4/-3",
        "3/-1 > 4/-1",
        "3/-2 > 13/-1",
        "3/-3 > 13/-2",
        "3/-4 > 11/-2",
        "4/2 > 13/-1",
        "4/3 > 13/-2",
        "4/4 > 11/-1",
        "4/5 > 11/-2",
        "4/6 > 5/-1",
    ];
    assert_eq!(ways(&map, "J_0"), expected);
}

#[test]
fn signals_crossing_and_limits_of_the_crossroad() {
    let map = crossroad();
    let route = crossroad_route(&map);
    let stops: Vec<_> =
        route.stop_lines.iter().map(|line| (line.station_m, map.signals[line.signal].id.as_str())).collect();
    let surveyed = [(97.0, "sig_J2_NW"), (188.7, "sig_J1_NW"), (215.9, "sig_J0_NW")];
    assert_eq!(stops.len(), surveyed.len(), "{stops:?}");
    for (found, expected) in stops.iter().zip(surveyed) {
        assert!((found.0 - expected.0).abs() < 1.5 && found.1 == expected.1, "{found:?}");
    }
    assert_eq!(lights(&map, "J_2"), [2, 2]);
    assert_eq!(lights(&map, "J_1"), [3, 1]);
    assert_eq!(lights(&map, "J_0"), [2, 2]);
    // Between the stop line of J_1 and the one of J_0.
    assert!(matches!(route.crosswalks_m[..], [(from_m, to_m)] if from_m > 189.0 && to_m < 207.0));
    assert!(map.lanes.iter().all(|lane| (lane.speed_limit_mps - 50.0 / 3.6).abs() < 1e-9));
}

#[test]
fn the_room_for_a_lane_change_is_the_length_of_its_stretch() {
    let map = crossroad();
    let mut with_room = 0;
    for lane in (0..map.lanes.len()).map(LaneIndex) {
        for side in [Side::Left, Side::Right] {
            for station_m in (0..map.lane(lane).centre.length_m() as u32).step_by(3).map(f64::from) {
                let stretches = map.changes_from_m(lane, side, station_m);
                let here = stretches.into_iter().find(|(from_m, _)| from_m - station_m < 0.1);
                let room_m = map.change_room_m(lane, side, station_m);
                assert_eq!(room_m, here.map_or(0.0, |(_, length_m)| length_m), "{lane:?} {station_m}");
                with_room += usize::from(room_m > 0.0);
            }
        }
    }
    assert!(with_room > 500, "{with_room}");
}
