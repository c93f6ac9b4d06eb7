//! Courses: the chains of lanes that a vehicle may follow, and how probable each of them is.
//!
//! A chain forks once, at the next place where a lane has several successors; after that it goes as straight
//! as it can. Inside a junction, where lanes lie over each other, the siblings of the vehicle's lane are
//! possible, too. Probabilities are a product of a prior (most traffic goes straight on) and of three bell
//! curves: heading and place beside each sibling, and the braking that the bend of a successor would take.
//! The figures are ours.

use avastra_base::geometry::{PathPoint, Vec2, larger, wrap_angle};
use avastra_road::{LaneIndex, LanePlace, RoadMap, Turn};

use super::super::config::PredictionConfig;
use super::profile::LATERAL_MPS2;
use super::{FRAME_REACH_M, STEP_S, STEPS};

/// Lanes of a course; it goes on straight where the last of them ends.
const LANES_MAX: usize = 8;
/// Courses that are weighed against each other.
const COURSES_MAX: usize = 6;
/// Forks that are reached later do not matter yet, s.
const FORK_S: f64 = 6.0;
/// Less probable courses are not followed.
const PROBABILITY_MIN: f64 = 0.05;
/// Deviations of the bell curves: heading, rad; place, m; braking, m/s².
const HEADING_SIGMA_RAD: f64 = 0.15;
const OFFSET_SIGMA_M: f64 = 0.5;
const BRAKING_SIGMA_MPS2: f64 = 2.0;
/// Braking for a bend is worked out over at least this distance, m.
const BRAKING_M_MIN: f64 = 5.0;
/// A sibling of the lane is possible if the vehicle is at most this far beyond its edge, m.
const SIBLING_REACH_M: f64 = 0.5;
/// The place beside a lane of a junction is steered out within this time, s.
const RETURN_S: f64 = 3.0;

/// A chain of lanes from the vehicle on.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    lanes: [LaneIndex; LANES_MAX],
    count: usize,
    /// Where the vehicle is on the first lane, m along it and to the left of it.
    pub station_m: f64,
    pub offset_m: f64,
    pub probability: f64,
}

/// Finds the courses of a vehicle, the most probable first; their probabilities sum to 1.
pub fn find(
    map: &RoadMap,
    config: &PredictionConfig,
    place: LanePlace,
    position: Vec2,
    heading_rad: f64,
    speed_mps: f64,
    courses: &mut Vec<Course>,
) {
    courses.clear();
    let reach_m = speed_mps * STEP_S * STEPS as f64;
    let lane = map.lane(place.lane);
    let fork = lane
        .junction
        .and_then(|_| lane.predecessors.iter().find(|before| map.lane(**before).successors.len() > 1));
    match fork {
        Some(&before) => {
            let others = map.lane(before).successors.iter().copied().filter(|lane| *lane != place.lane);
            for sibling in core::iter::once(place.lane).chain(others).take(COURSES_MAX) {
                let found = map.lane(sibling).centre.project_near(position, place.station_m, FRAME_REACH_M);
                let off_m = found.distance_m - map.lane(sibling).width_at(found.station_m) / 2.0;
                let lane_rad = map.lane(sibling).centre.heading_at(found.station_m);
                let turned_rad = wrap_angle(heading_rad - lane_rad);
                let possible = off_m <= SIBLING_REACH_M && turned_rad.abs() <= config.off_lane_rad;
                if !possible && sibling != place.lane {
                    continue;
                }
                let weight = prior(map.lane(sibling).turn)
                    * bell(turned_rad / HEADING_SIGMA_RAD)
                    * bell(found.offset_m / OFFSET_SIGMA_M)
                    * bell(bend_braking_mps2(map, sibling, speed_mps, 0.0) / BRAKING_SIGMA_MPS2);
                let mut course = Course::new(sibling, found.station_m, found.offset_m, weight);
                course.extend(map, reach_m);
                courses.push(course);
            }
        }
        None => {
            let mut stem = Course::new(place.lane, place.station_m, place.offset_m, 1.0);
            let ahead_m = stem.extend_to_fork(map, speed_mps * FORK_S);
            let tip = stem.lanes[stem.count - 1];
            let branches = &map.lane(tip).successors;
            if ahead_m > speed_mps * FORK_S || branches.len() < 2 || stem.count == LANES_MAX {
                stem.extend(map, reach_m);
                courses.push(stem);
            } else {
                for &branch in branches.iter().take(COURSES_MAX) {
                    let braking_mps2 = bend_braking_mps2(map, branch, speed_mps, ahead_m);
                    let probability = prior(map.lane(branch).turn) * bell(braking_mps2 / BRAKING_SIGMA_MPS2);
                    let mut course = Course { probability, ..stem };
                    course.push(branch);
                    course.extend(map, reach_m);
                    courses.push(course);
                }
            }
        }
    }
    settle(courses);
}

/// Sorts courses by weight, drops what is improbable, and makes probabilities of the weights.
fn settle(courses: &mut Vec<Course>) {
    courses.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let sum = |courses: &[Course]| courses.iter().map(|course| course.probability).sum::<f64>();
    let least = PROBABILITY_MIN * sum(courses);
    let first = courses[0];
    courses.retain(|course| course.probability >= least);
    if courses.is_empty() || sum(courses) <= f64::MIN_POSITIVE {
        // All of them are next to impossible: the vehicle does something else, and the first will do.
        courses.clear();
        courses.push(Course { probability: 1.0, ..first });
    }
    let sum = sum(courses);
    courses.iter_mut().for_each(|course| course.probability /= sum);
}

/// How much more often lanes of one kind are taken than those of another. Ours: three fifths of the
/// traffic at a crossing goes straight on.
fn prior(turn: Turn) -> f64 {
    match turn {
        Turn::Straight => 3.0,
        Turn::Left | Turn::Right => 1.0,
        Turn::UTurn => 0.05,
    }
}

/// The bell curve, 1 in the middle, of a value in units of its deviation.
fn bell(value: f64) -> f64 {
    libm::exp(-value * value / 2.0)
}

/// Braking that the sharpest bend of a lane takes of a vehicle that is `ahead_m` before it, m/s².
fn bend_braking_mps2(map: &RoadMap, lane: LaneIndex, speed_mps: f64, ahead_m: f64) -> f64 {
    let allowed_mps2 = LATERAL_MPS2 / map.lane(lane).centre.sharpest_per_m().max(1e-6);
    ((speed_mps * speed_mps - allowed_mps2) / (2.0 * ahead_m.max(BRAKING_M_MIN))).max(0.0)
}

/// The successor at whose end the heading has changed least; of several that are equal, the first.
pub fn straightest_successor(map: &RoadMap, lane: LaneIndex) -> Option<LaneIndex> {
    let end_rad = |lane: LaneIndex| {
        let points = map.lane(lane).centre.points();
        points[points.len() - 1].heading_rad
    };
    let turn_rad = |successor: &LaneIndex| wrap_angle(end_rad(*successor) - end_rad(lane)).abs();
    let successors = map.lane(lane).successors.iter().copied();
    successors.min_by(|a, b| turn_rad(a).total_cmp(&turn_rad(b)))
}

impl Course {
    fn new(lane: LaneIndex, station_m: f64, offset_m: f64, probability: f64) -> Course {
        Course { lanes: [lane; LANES_MAX], count: 1, station_m, offset_m, probability }
    }

    fn lanes(&self) -> &[LaneIndex] {
        &self.lanes[..self.count]
    }

    fn push(&mut self, lane: LaneIndex) {
        self.lanes[self.count] = lane;
        self.count += 1;
    }

    /// The greatest curvature of its lanes, 1/m.
    pub fn sharpest_per_m(&self, map: &RoadMap) -> f64 {
        self.lanes().iter().map(|lane| map.lane(*lane).centre.sharpest_per_m()).fold(0.0, larger)
    }

    /// From the vehicle to the end of the last lane, m.
    fn ends_m(&self, map: &RoadMap) -> f64 {
        let length_m: f64 = self.lanes().iter().map(|lane| map.lane(*lane).centre.length_m()).sum();
        length_m - self.station_m
    }

    /// Goes on as straight as possible until the course is so long, or cannot be longer.
    fn extend(&mut self, map: &RoadMap, reach_m: f64) {
        let mut ends_m = self.ends_m(map);
        while ends_m < reach_m && self.count < LANES_MAX {
            let Some(next) = straightest_successor(map, self.lanes[self.count - 1]) else { break };
            ends_m += map.lane(next).centre.length_m();
            self.push(next);
        }
    }

    /// Goes on while there is one way only; returns how far ahead it ends, m.
    fn extend_to_fork(&mut self, map: &RoadMap, reach_m: f64) -> f64 {
        let mut ends_m = self.ends_m(map);
        while ends_m < reach_m && self.count < LANES_MAX {
            let [next] = map.lane(self.lanes[self.count - 1]).successors[..] else { break };
            ends_m += map.lane(next).centre.length_m();
            self.push(next);
        }
        ends_m
    }

    /// How far ahead another place on this course is, m; negative behind. `None` on other lanes.
    pub fn ahead_m(&self, map: &RoadMap, place: LanePlace) -> Option<f64> {
        let mut begin_m = -self.station_m;
        for lane in self.lanes() {
            if *lane == place.lane {
                return Some(begin_m + place.station_m);
            }
            begin_m += map.lane(*lane).centre.length_m();
        }
        None
    }

    /// The stop lines ahead: how far, m, and the index of their signal; nearest first.
    pub fn stop_lines<'a>(&'a self, map: &'a RoadMap) -> impl Iterator<Item = (f64, usize)> + 'a {
        let mut begin_m = -self.station_m;
        self.lanes().iter().flat_map(move |lane| {
            let from_m = begin_m;
            begin_m += map.lane(*lane).centre.length_m();
            let lines = map.lane(*lane).stop_lines.iter();
            lines
                .map(move |line| (from_m + line.station_m, line.signal))
                .filter(|(ahead_m, _)| *ahead_m > 0.0)
        })
    }

    /// The places of a vehicle that has gone `stations_m` (risen from 0), and that moves sideways at
    /// `lateral_mps` until it is in the middle of its own lane or of the next one.
    pub fn place(
        &self,
        map: &RoadMap,
        stations_m: &[f64; STEPS + 1],
        lateral_mps: f64,
        positions: &mut [Vec2; STEPS + 1],
    ) {
        let first = map.lane(self.lanes[0]);
        let centre_m = if self.offset_m * lateral_mps < 0.0 {
            0.0
        } else {
            first.width_at(self.station_m) * lateral_mps.signum()
        };
        let drift_m_max = (centre_m - self.offset_m).abs();
        // Lanes of a junction are steered along; beside the lanes of a street vehicles may well stay.
        let returns = first.junction.is_some() && lateral_mps == 0.0;
        let mut walk = Walk::new();
        for (step, (position, &station_m)) in positions.iter_mut().zip(stations_m).enumerate() {
            let time_s = step as f64 * STEP_S;
            let (Segment { begin, along, .. }, past_m) = walk.to(map, self, station_m);
            let kept = if returns { (1.0 - time_s / RETURN_S).max(0.0) } else { 1.0 };
            let offset_m = self.offset_m * kept + (lateral_mps * time_s).clamp(-drift_m_max, drift_m_max);
            *position = begin.position + along * past_m + Vec2::new(-along.y, along.x) * offset_m;
        }
    }
}

/// A place that moves on along a course from lane to lane.
#[derive(Debug)]
pub struct Walk<'a> {
    /// Index of the lane among the course's, and where it begins from the vehicle's first lane on, m.
    lane: usize,
    begin_m: f64,
    /// Where it was last.
    segment: Option<Segment<'a>>,
}

/// The piece of a lane's centre between two of its vertices.
#[derive(Debug, Clone, Copy)]
pub struct Segment<'a> {
    pub begin: &'a PathPoint,
    /// Unit vector to the next vertex.
    pub along: Vec2,
    /// Station of the next vertex, m.
    to_m: f64,
}

impl<'a> Walk<'a> {
    pub fn new() -> Walk<'a> {
        Walk { lane: 0, begin_m: 0.0, segment: None }
    }

    /// The segment at the place `ahead_m` ahead of the vehicle, and how far beyond its first vertex that
    /// is, m. Beyond the end of the course it is on the tangent. Places must not go back to an earlier lane.
    pub fn to(&mut self, map: &'a RoadMap, course: &Course, ahead_m: f64) -> (Segment<'a>, f64) {
        let station_m = course.station_m + ahead_m;
        if let Some(segment) = &self.segment
            && (segment.begin.station_m..segment.to_m).contains(&(station_m - self.begin_m))
        {
            return (*segment, station_m - self.begin_m - segment.begin.station_m);
        }
        let mut centre = &map.lane(course.lanes[self.lane]).centre;
        while self.lane + 1 < course.count && station_m - self.begin_m > centre.length_m() {
            self.begin_m += centre.length_m();
            self.lane += 1;
            centre = &map.lane(course.lanes[self.lane]).centre;
        }
        let on_lane_m = station_m - self.begin_m;
        let (begin, end) = centre.segment_at(on_lane_m);
        let along = (end.position - begin.position) / (end.station_m - begin.station_m);
        let segment = Segment { begin, along, to_m: end.station_m };
        self.segment = Some(segment);
        (segment, on_lane_m - begin.station_m)
    }
}
