//! Road 1 as authored in `scenarios/roads/residential.xodr`, held against its survey.

use crate::geometry::Vec2;
use crate::road::{RoadMap, Route, Turn};

use super::survey::{Leg, lanes_join, lights, route_agrees, ways};

const RESIDENTIAL: &str = include_str!("../../../scenarios/roads/residential.xodr");

/// The ego lane of the San Francisco map from start to goal, in the local frame of the survey.
const SURVEY: [(f64, f64); 18] = [
    (0.03, -0.03),
    (6.72, 6.97),
    (16.17, 16.88),
    (25.61, 26.79),
    (35.06, 36.69),
    (42.95, 44.79),
    (48.92, 52.06),
    (49.6, 55.03),
    (47.91, 59.23),
    (43.25, 65.02),
    (35.53, 77.55),
    (32.27, 83.99),
    (27.8, 96.27),
    (22.91, 122.27),
    (20.69, 130.7),
    (18.15, 132.66),
    (14.46, 132.57),
    (-68.2, 117.59),
];

/// The surveyed carriageways at J_10, J_26 and J_28.
const LEGS: [Leg; 12] = [
    Leg {
        name: "J_10-SW-in",
        start: (-90.536, -91.882, 0.8085),
        pieces: &[(74.656, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.89, -5.98)],
    },
    Leg {
        name: "J_10-SW-out",
        start: (-38.942, -37.76, -2.33297),
        pieces: &[(74.844, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.95, -5.99)],
    },
    Leg {
        name: "J_10-SE-out",
        start: (3.618, -31.637, -0.75722),
        pieces: &[(152.97, -0.000133)],
        lanes: &[(-2.0, -2.0), (-5.97, -5.9), (-10.08, -9.96), (-13.92, -13.83)],
    },
    Leg {
        name: "J_10-NE-in",
        start: (33.678, 38.139, -2.33347),
        pieces: &[(54.833, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.99, -5.99)],
    },
    Leg {
        name: "J_10-NE-out",
        start: (-4.179, -1.551, 0.80901),
        pieces: &[(54.756, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.91, -5.89)],
    },
    Leg {
        name: "J_10-NW-in",
        start: (-156.527, 4.519, 0.21352),
        pieces: &[(58.455, -0.000499), (43.326, -0.009298), (16.577, -0.028288), (8.765, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.94, -6.0), (-9.95, -9.86), (-13.99, -13.77)],
    },
    Leg {
        name: "J_26-SE-in",
        start: (180.281, -76.662, 2.39891),
        pieces: &[(118.178, 0.0), (41.886, -0.001082)],
        lanes: &[(-2.0, -2.0), (-6.03, -6.05), (-9.98, -9.89), (-13.75, -13.92)],
    },
    Leg {
        name: "J_26-NE-in",
        start: (117.704, 126.056, -2.33269),
        pieces: &[(69.105, 0.0)],
        lanes: &[(-2.0, -2.0), (-6.02, -6.03)],
    },
    Leg {
        name: "J_26-NE-out",
        start: (69.995, 76.022, 0.80797),
        pieces: &[(69.118, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.89, -5.92)],
    },
    Leg {
        name: "J_26-NW-out",
        start: (30.387, 74.615, 2.07018),
        pieces: &[(29.471, -0.010906), (18.97, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.92, -5.79), (-9.94, -9.83), (-13.94, -13.89)],
    },
    Leg {
        name: "J_28-W-out",
        start: (9.634, 125.773, -2.96031),
        pieces: &[(179.014, 0.0)],
        lanes: &[(-2.0, -2.0), (-5.83, -6.17), (-9.89, -10.12), (-13.89, -14.01)],
    },
    Leg {
        name: "J_28-N-out",
        start: (12.654, 142.745, 1.7713),
        pieces: &[(79.765, -0.00056)],
        lanes: &[(-2.0, -2.0), (-5.81, -5.89), (-10.0, -9.97), (-13.54, -13.73)],
    },
];

fn residential() -> RoadMap {
    RoadMap::from_opendrive("residential", RESIDENTIAL).unwrap()
}

fn residential_route(map: &RoadMap) -> Route {
    let start = map.nearest(Vec2::new(0.0, 0.0), 0.809, 1.0).unwrap();
    let goal = map.nearest(Vec2::new(-68.2, 117.6), -2.962, 1.0).unwrap();
    Route::find(map, start, goal).unwrap()
}

#[test]
fn the_residential_route_follows_the_survey() {
    let map = residential();
    assert_eq!(map.warnings, [""; 0]);
    let route = residential_route(&map);
    assert!((route.goal_m - 247.3).abs() < 0.5, "{}", route.goal_m);
    route_agrees(&route, &SURVEY);
    let least_m =
        1.0 / route.path.points().iter().map(|point| point.curvature_per_m.abs()).fold(0.0, f64::max);
    assert!(least_m > 5.8, "radius {least_m} m");
}

#[test]
fn the_residential_streets_follow_the_survey() {
    let map = residential();
    for leg in &LEGS {
        let length_m: f64 = leg.pieces.iter().map(|(length_m, _)| length_m).sum();
        leg.agrees(&map, 0.0, length_m);
    }
    lanes_join(&map);
}

#[test]
fn the_residential_junctions_join_the_surveyed_lanes() {
    let map = residential();
    let expected = [
        "1/-1 > 3/-1",
        "1/-2 > 2/-4",
        "1/-2 > 3/-2",
        "3/1 > 1/1",
        "3/1 > 2/-1",
        "3/1 > 2/-2",
        "3/1 > 2/-3",
        "3/2 > 1/2",
        "4/-1 > 2/-1",
        "4/-1 > 3/-1",
        "4/-1 > 3/-2",
        "4/-2 > 2/-2",
        "4/-3 > 2/-3",
        "4/-4 > 1/2",
        "4/-4 > 2/-4",
    ];
    assert_eq!(ways(&map, "J_10"), expected);
    let expected = [
        "3/-1 > 6/-1",
        "3/-1 > 7/-1",
        "3/-1 > 7/-2",
        "3/-1 > 7/-3",
        "3/-2 > 6/-2",
        "5/-1 > 3/1",
        "5/-1 > 7/-1",
        "5/-2 > 7/-2",
        "5/-3 > 7/-3",
        "5/-4 > 6/-2",
        "5/-4 > 7/-4",
        "6/1 > 3/1",
        "6/2 > 3/2",
        "6/2 > 7/-4",
    ];
    assert_eq!(ways(&map, "J_26"), expected);
    let expected = ["7/-1 > 8/-1", "7/-2 > 8/-2", "7/-2 > 9/-2", "7/-3 > 9/-3", "7/-4 > 9/-4"];
    assert_eq!(ways(&map, "J_28"), expected);
    let count = |turn| map.lanes.iter().filter(|lane| lane.turn == turn).count();
    let (left, right) = (5 + 4 + 2, 2 + 2);
    assert_eq!((count(Turn::Left), count(Turn::Right), count(Turn::UTurn)), (left, right, 0));
    assert_eq!(map.lanes.len(), 3 * 4 + 6 * 4 + 15 + 14 + 5);
}

#[test]
fn signals_crosswalks_and_limits_of_the_residential_road_are_the_surveyed_ones() {
    let map = residential();
    let route = residential_route(&map);
    let stops: Vec<_> =
        route.stop_lines.iter().map(|line| (line.station_m, map.signals[line.signal].id.as_str())).collect();
    assert_eq!(stops.len(), 2, "{stops:?}");
    for (found, expected) in stops.iter().zip([(50.6, "sig_J26_SW"), (146.5, "sig_J28_S")]) {
        assert!((found.0 - expected.0).abs() < 1.0 && found.1 == expected.1, "{found:?}");
    }
    assert_eq!(lights(&map, "J_10"), [2, 1]);
    assert_eq!(lights(&map, "J_26"), [2, 1]);
    assert_eq!(lights(&map, "J_28"), [1]);
    assert_eq!(map.crosswalks.len(), 8);
    let surveyed = [(51.7, 61.2), (91.3, 101.2)];
    assert_eq!(route.crosswalks_m.len(), surveyed.len(), "{:?}", route.crosswalks_m);
    for (found, expected) in route.crosswalks_m.iter().zip(surveyed) {
        assert!((found.0 - expected.0).abs() < 1.0 && (found.1 - expected.1).abs() < 1.0, "{found:?}");
    }
    assert!(map.lanes.iter().all(|lane| lane.speed_limit_mps == 11.176));
}
