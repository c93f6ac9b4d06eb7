//! Road 4 as authored in `scenarios/roads/boulevard.xodr`, held against its survey.

use crate::geometry::Vec2;
use crate::road::{RoadMap, Route, Turn};

use super::survey::{Leg, lanes_join, lights, route_agrees, ways};

const BOULEVARD: &str = include_str!("../../../scenarios/roads/boulevard.xodr");

/// The ego lane of the Tartu map from start to goal, in the local frame of the survey.
const SURVEY: [(f64, f64); 31] = [
    (-0.02, 0.04),
    (-13.34, -6.2),
    (-27.91, -14.14),
    (-42.41, -22.22),
    (-45.88, -23.98),
    (-49.3, -25.82),
    (-57.21, -29.93),
    (-64.85, -34.51),
    (-72.32, -39.32),
    (-77.94, -45.44),
    (-78.47, -50.75),
    (-76.83, -55.97),
    (-71.8, -64.03),
    (-40.46, -111.73),
    (-21.33, -140.89),
    (-19.44, -143.77),
    (-7.5, -161.93),
    (-4.16, -166.32),
    (-0.52, -170.45),
    (3.87, -173.74),
    (9.26, -175.84),
    (14.95, -176.86),
    (15.95, -176.87),
    (16.94, -176.81),
    (23.71, -176.17),
    (31.53, -174.92),
    (39.3, -173.33),
    (43.0, -172.56),
    (50.6, -170.94),
    (55.17, -170.07),
    (56.9, -169.79),
];

/// The surveyed carriageways; lanes that begin or end on the way are left out.
const LEGS: [Leg; 12] = [
    Leg {
        name: "J_6-SE-out",
        start: (-115.587, 25.353, -1.18696),
        pieces: &[(61.694, 0.000998)],
        lanes: &[(-1.75, -1.75), (-5.1, -5.18)],
    },
    Leg {
        name: "J_6-SE-in",
        start: (-71.235, -25.525, 2.15715),
        pieces: &[(53.812, 0.0)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "J_6-NW-in",
        start: (-154.861, 122.446, -1.18764),
        pieces: &[(91.046, 0.0)],
        lanes: &[(-1.75, -1.75), (-4.9, -5.04)],
    },
    Leg {
        name: "J_6-NW-out",
        start: (-111.984, 36.483, 2.1605),
        pieces: &[(53.376, -0.003943), (42.884, 0.0)],
        lanes: &[(-1.75, -1.75), (-4.98, -5.13)],
    },
    Leg {
        name: "J_7-SE-out",
        start: (-75.342, -55.04, -0.99179),
        pieces: &[(146.642, 0.0)],
        lanes: &[(-1.75, -1.75), (-5.27, -5.28)],
    },
    Leg {
        name: "J_7-SE-in",
        start: (13.321, -162.528, 1.81562),
        pieces: &[(34.032, 0.010096), (102.842, 0.0)],
        lanes: &[(-1.75, -1.75), (-5.09, -4.97)],
    },
    Leg {
        name: "J_7-slip (NB right turn into start street)",
        start: (0.423, -119.508, 2.28629),
        pieces: &[(14.806, -0.00876), (72.796, 0.0), (8.441, -0.078019)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "start street opposite",
        start: (-50.762, -42.878, 1.67691),
        pieces: &[(18.775, -0.054301), (22.718, -0.009502), (53.034, 0.0)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "X_1-NB",
        start: (19.417, -237.053, 1.44365),
        pieces: &[(87.369, 0.005533), (23.105, 0.010053), (101.695, 0.0)],
        lanes: &[(-1.75, -1.75), (-5.66, -4.97)],
    },
    Leg {
        name: "X_1-SB-south",
        start: (-6.048, -160.943, -0.96054),
        pieces: &[(23.853, -0.003434), (58.352, -0.010498)],
        lanes: &[(-1.75, -1.75), (-5.35, -5.27)],
    },
    Leg {
        name: "X_1-exit (ego turn lane)",
        start: (-6.102, -160.868, -1.01857),
        pieces: &[(10.4, 0.027314), (22.699, 0.040568), (33.936, 0.0), (28.387, -0.005532)],
        lanes: &[(-1.75, -1.75)],
    },
    Leg {
        name: "X_1-slip (NB right exit to side street)",
        start: (23.26, -237.216, 1.47039),
        pieces: &[(28.09, -0.003039), (21.225, -0.025698), (53.738, -0.012784)],
        lanes: &[(-1.75, -1.75)],
    },
];

/// Stretches of the carriageways (index in `LEGS`, from, to, m) that are compared. Left out are the mouths of
/// the junctions, where ways of the map begin a little earlier or later than the survey's.
const STRETCHES: [(usize, f64, f64); 12] = [
    (0, 0.0, 61.7),
    (1, 0.0, 49.0),
    (2, 0.0, 91.0),
    (3, 0.0, 96.2),
    (4, 3.0, 126.0),
    (5, 20.0, 134.0),
    (6, 5.0, 86.0),
    (7, 19.0, 94.5),
    (8, 0.0, 50.0),
    (9, 10.0, 82.0),
    (10, 10.0, 80.0),
    (11, 0.0, 78.0),
];

fn boulevard() -> RoadMap {
    RoadMap::from_opendrive("boulevard", BOULEVARD).unwrap()
}

fn boulevard_route(map: &RoadMap) -> Route {
    let start = map.nearest(Vec2::new(0.0, 0.0), -2.704, 1.0).unwrap();
    let goal = map.nearest(Vec2::new(56.9, -169.8), 0.162, 1.0).unwrap();
    Route::find(map, start, goal).unwrap()
}

#[test]
fn the_boulevard_route_follows_the_survey() {
    let map = boulevard();
    assert_eq!(map.warnings, [""; 0]);
    let route = boulevard_route(&map);
    assert!((route.goal_m - 298.6).abs() < 0.5, "{}", route.goal_m);
    route_agrees(&route, &SURVEY);
    let least_m =
        1.0 / route.path.points().iter().map(|point| point.curvature_per_m.abs()).fold(0.0, f64::max);
    assert!(least_m > 6.0, "radius {least_m} m");
}

#[test]
fn the_boulevard_streets_follow_the_survey() {
    let map = boulevard();
    for (leg, from_m, to_m) in STRETCHES {
        LEGS[leg].agrees(&map, from_m, to_m);
    }
    lanes_join(&map);
}

#[test]
fn a_median_of_20_m_lies_beside_the_route() {
    let map = boulevard();
    let route = boulevard_route(&map);
    for station_m in [110.0, 150.0, 190.0, 220.0] {
        let lane = map.lane(route.lane_at(station_m).lane);
        let oncoming = lane.left.unwrap();
        assert!(!oncoming.same_direction);
        assert!((18.0..21.0).contains(&oncoming.gap_m), "{} m at {station_m}", oncoming.gap_m);
        assert!(lane.right.is_some_and(|beside| beside.same_direction && beside.gap_m == 0.0));
    }
}

#[test]
fn the_boulevard_junctions_join_the_surveyed_lanes() {
    let map = boulevard();
    let expected = [
        "1/-1 > 3/-1",
        "1/-2 > 3/-2",
        "1/-2 > 5/-2",
        "3/2 > 3/-1",
        "3/2 > 5/-1",
        "3/3 > 5/-2",
        "3/4 > 2/-1",
        "4/-1 > 3/-1",
        "4/-2 > 3/-2",
    ];
    assert_eq!(ways(&map, "J_7"), expected);
    let expected = ["5/-1 > 7/-1", "5/-2 > 7/-2", "5/-2 > 8/-1", "6/-1 > 4/-1", "6/-2 > 4/-2", "8/1 > 7/-2"];
    assert_eq!(ways(&map, "J_6"), expected);
    let expected = ["11/-1 > 3/2", "11/-2 > 3/3", "3/-1 > 12/-1", "3/-1 > 3/2", "3/-1 > 9/-1", "3/-2 > 9/-2"];
    assert_eq!(ways(&map, "X_1"), expected);
    assert_eq!(ways(&map, "X_2"), ["12/-1 > 13/-1", "14/-1 > 13/-1"]);
    assert_eq!(ways(&map, "X_3"), ["10/-1 > 11/-1", "10/-2 > 11/-2", "10/-2 > 14/-1"]);
    assert_eq!(map.lanes.iter().filter(|lane| lane.turn == Turn::UTurn).count(), 2);
}

#[test]
fn the_route_out_of_the_boulevard_crosses_both_lanes_of_the_other_carriageway() {
    let map = boulevard();
    let route = boulevard_route(&map);
    for (station_m, angle_deg, from) in [(259.8, 97.7, "11/-1"), (263.2, 97.8, "11/-2")] {
        let near = |station: f64| (station - station_m).abs() < 1.0;
        let crossing = route.conflicts.iter().find(|conflict| near(conflict.station_m)).unwrap();
        let before = &map.lane(map.lane(crossing.lane).predecessors[0]).key;
        assert_eq!(format!("{}/{}", before.road, before.lane), from);
        assert!((crossing.angle_rad.to_degrees() - angle_deg).abs() < 5.0, "{crossing:?}");
    }
}

#[test]
fn signals_and_limits_of_the_boulevard_are_the_surveyed_ones() {
    let map = boulevard();
    let route = boulevard_route(&map);
    let stops: Vec<_> =
        route.stop_lines.iter().map(|line| (line.station_m, map.signals[line.signal].id.as_str())).collect();
    assert!(matches!(stops[..], [(station_m, "sig_J7_NE")] if (station_m - 55.2).abs() < 1.0), "{stops:?}");
    assert_eq!(lights(&map, "J_7"), [2, 1]);
    assert_eq!(lights(&map, "J_6"), [2, 1]);
    assert!(map.crosswalks.is_empty());
    assert!(map.lanes.iter().all(|lane| (lane.speed_limit_mps - 50.0 / 3.6).abs() < 1e-9));
}
