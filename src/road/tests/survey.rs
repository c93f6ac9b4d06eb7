//! What the tests of the authored roads share: the comparison of a map with its survey.

use crate::geometry::{Path, Pose, Vec2, wrap_angle};

use crate::road::{RoadMap, Route};

/// The agreement that is asked for, m.
const AGREEMENT_M: f64 = 0.3;

/// A surveyed carriageway: where its reference line begins (x, y in m, heading in rad), its pieces (length in m,
/// curvature in 1/m), and for each of its lanes the offsets of the centre at both ends (m, positive to the left).
pub struct Leg {
    pub name: &'static str,
    pub start: (f64, f64, f64),
    pub pieces: &'static [(f64, f64)],
    pub lanes: &'static [(f64, f64)],
}

impl Leg {
    /// Pose on the reference line.
    fn at(&self, station_m: f64) -> Pose {
        let mut pose = Pose::new(self.start.0, self.start.1, self.start.2);
        let mut left_m = station_m;
        for (length_m, curvature_per_m) in self.pieces {
            let step_m = left_m.min(*length_m);
            let turn_rad = step_m * curvature_per_m;
            // The chord of an arc lies half its angle off the tangent.
            let half_rad = turn_rad / 2.0;
            let chord_m =
                if half_rad.abs() < 1e-9 { step_m } else { step_m * libm::sin(half_rad) / half_rad };
            let along = Pose { heading_rad: pose.heading_rad + half_rad, ..pose };
            pose = Pose { heading_rad: pose.heading_rad + turn_rad, ..along.offset(chord_m, 0.0) };
            left_m -= step_m;
        }
        pose
    }

    /// Asserts that lane centres of the map run within the agreement along all surveyed lanes, from a station of
    /// the leg to another, in the surveyed direction.
    pub fn agrees(&self, map: &RoadMap, from_m: f64, to_m: f64) {
        let length_m: f64 = self.pieces.iter().map(|(length_m, _)| length_m).sum();
        for (index, (begin_m, end_m)) in self.lanes.iter().enumerate() {
            for i in 0..=20 {
                let station_m = from_m + (to_m - from_m) * f64::from(i) / 20.0;
                let offset_m = begin_m + (end_m - begin_m) * station_m / length_m;
                let surveyed = self.at(station_m).offset(0.0, offset_m);
                let who = format!("{}, lane {index} at {station_m:.1} m", self.name);
                let near = map.lanes.iter().map(|lane| {
                    let found = lane.centre.project(surveyed.position);
                    let heading_rad = lane.centre.pose_at(found.station_m).heading_rad;
                    (found.distance_m, wrap_angle(heading_rad - surveyed.heading_rad).abs())
                });
                let fits = near.filter(|(_, turn_rad)| *turn_rad < 0.35).map(|(distance_m, _)| distance_m);
                let distance_m = fits.fold(f64::INFINITY, f64::min);
                assert!(distance_m < AGREEMENT_M, "{who}: {distance_m} m off");
            }
        }
    }
}

/// Asserts that a route and a surveyed line stay within the agreement of each other, up to the goal.
pub fn route_agrees(route: &Route, surveyed: &[(f64, f64)]) {
    for (x, y) in surveyed {
        let distance_m = route.path.project(Vec2::new(*x, *y)).distance_m;
        assert!(distance_m < AGREEMENT_M, "{distance_m} m at {x}, {y}");
    }
    let line = Path::new(surveyed.iter().map(|(x, y)| (Vec2::new(*x, *y), 0.0, 0.0))).unwrap();
    let mut station_m = 0.0;
    while station_m < route.goal_m {
        let distance_m = line.project(route.path.pose_at(station_m).position).distance_m;
        assert!(distance_m < AGREEMENT_M, "{distance_m} m at station {station_m}");
        station_m += 0.5;
    }
}

/// Asserts that each lane begins where those before it end, in position and heading.
pub fn lanes_join(map: &RoadMap) {
    for lane in &map.lanes {
        let end = lane.centre.pose_at(lane.centre.length_m());
        for next in &lane.successors {
            let begin = map.lane(*next).centre.pose_at(0.0);
            let names = (&lane.key, &map.lane(*next).key);
            assert!((begin.position - end.position).norm() < 0.05, "{names:?}: {end:?} {begin:?}");
            let turn_rad = wrap_angle(begin.heading_rad - end.heading_rad).abs();
            assert!(turn_rad < 1.0_f64.to_radians(), "{names:?}: {turn_rad}");
        }
    }
}

/// All ways through a junction, as "road/lane > road/lane", sorted.
pub fn ways(map: &RoadMap, junction: &str) -> Vec<String> {
    let junction = map.junctions.iter().find(|found| found.name == junction).unwrap();
    let name = |index| {
        let key = &map.lane(index).key;
        format!("{}/{}", key.road, key.lane)
    };
    let way = |lane: &_| {
        let lane = map.lane(*lane);
        assert_eq!((lane.predecessors.len(), lane.successors.len()), (1, 1), "{:?}", lane.key);
        format!("{} > {}", name(lane.predecessors[0]), name(lane.successors[0]))
    };
    let mut ways: Vec<_> = junction.lanes.iter().map(way).collect();
    ways.sort();
    ways
}

/// Number of lights in each group of a junction's cycle.
pub fn lights(map: &RoadMap, junction: &str) -> Vec<usize> {
    let index = map.junctions.iter().position(|found| found.name == junction).unwrap();
    let of_group = |group| {
        let in_group = |signal: &&_| -> bool {
            let signal: &crate::road::Signal = signal;
            (signal.junction, signal.group) == (Some(index), group)
        };
        map.signals.iter().filter(in_group).count()
    };
    (0..map.junctions[index].groups).map(of_group).collect()
}
