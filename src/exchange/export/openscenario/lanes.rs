//! On which lanes a recorded way lies: what a log of poses says of lanes, routes and lane changes.
//!
//! The way over the lanes that lies nearest to the poses is taken (Viterbi's algorithm). Lanes of a junction lie over
//! each other, and only where they part is it seen which one is driven.

use avastra_base::geometry::{Pose, wrap_angle};
use avastra_road::{Lane, LaneIndex, LanePlace, RoadMap};

/// Ticks between two places that are looked for: 0.1 s.
pub const STRIDE: usize = 5;

/// A pose lies in a lane whose centre is at most this far away, m, and no more across, rad.
const REACH_M: f64 = 2.6;
const ACROSS_RAD: f64 = 0.9;
/// A turn of so much, rad, counts like a metre beside the centre.
const TURN_RAD_PER_M: f64 = 0.2;
/// The cost of a lane change, in square metres: a tenth of a second in the neighbouring lane costs some twelve.
const CHANGE_COST: f64 = 10.0;
/// Between two places lie at most this many ends of lanes.
const LEAPS_MAX: usize = 4;
/// A lane change is seen between these parts of the way over. A sinusoidal one is there after these parts of its time.
const SEEN: [f64; 2] = [0.1, 0.9];
const SEEN_AFTER: [f64; 2] = [0.204_833, 0.795_167];

/// Where a way lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Every [`STRIDE`] samples, from the first.
    pub places: Vec<LanePlace>,
    pub changes: Vec<LaneChange>,
}

/// From one lane to another of the same direction, sinusoidal in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneChange {
    /// The sample at which it begins, and how many it takes.
    pub begin: usize,
    pub length: usize,
    /// Lanes to the left, as the driver sees it.
    pub lanes_left: i32,
}

/// How one comes from a lane to another between two places.
#[derive(Clone, Copy, PartialEq)]
enum Step {
    On,
    Aside,
}

/// The way of a point over the lanes; `None` if it lies beside them.
pub fn driven(map: &RoadMap, poses: &[Pose]) -> Option<Driven> {
    let seen: Vec<&Pose> = poses.iter().step_by(STRIDE).collect();
    let places = places(map, &seen)?;
    let mut changes = Vec::new();
    for (index, pair) in places.windows(2).enumerate() {
        if step(map, pair[0].lane, pair[1].lane)? == Step::Aside {
            changes.push(lane_change(map, &places, &seen, index)?);
        }
    }
    Some(Driven { places, changes })
}

/// The cheapest places of the poses.
fn places(map: &RoadMap, poses: &[&Pose]) -> Option<Vec<LanePlace>> {
    struct Candidate {
        place: LanePlace,
        cost: f64,
        before: usize,
    }
    let mut columns: Vec<Vec<Candidate>> = Vec::new();
    for pose in poses {
        let mut column = Vec::new();
        for (place, misfit) in near(map, pose) {
            let begun = |before: &Vec<Candidate>| {
                let ways = before.iter().enumerate().filter_map(|(index, candidate)| {
                    let cost = match step(map, candidate.place.lane, place.lane)? {
                        Step::On => 0.0,
                        Step::Aside => CHANGE_COST,
                    };
                    Some((candidate.cost + cost, index))
                });
                ways.min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let Some((cost, before)) = columns.last().map_or(Some((0.0, 0)), begun) else { continue };
            column.push(Candidate { place, cost: cost + misfit, before });
        }
        columns.push(column);
    }
    let last = columns.last()?.iter().enumerate().min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    let mut at = last?.0;
    let mut places = Vec::new();
    for column in columns.iter().rev() {
        places.push(column[at].place);
        at = column[at].before;
    }
    places.reverse();
    Some(places)
}

/// The lanes that a pose may lie in, and how badly it does.
fn near(map: &RoadMap, pose: &Pose) -> Vec<(LanePlace, f64)> {
    let lanes = map.lanes.iter().enumerate();
    let lanes =
        lanes.filter(|(_, lane)| lane.centre.bounds().distance_m2_min(pose.position) <= REACH_M * REACH_M);
    let places = lanes.filter_map(|(index, lane)| {
        let projection = lane.centre.project(pose.position);
        let turn_rad = wrap_angle(lane.centre.heading_at(projection.station_m) - pose.heading_rad);
        if projection.distance_m > REACH_M || turn_rad.abs() > ACROSS_RAD {
            return None;
        }
        let turn_m = turn_rad / TURN_RAD_PER_M;
        let place = LanePlace {
            lane: LaneIndex(index),
            station_m: projection.station_m,
            offset_m: projection.offset_m,
        };
        Some((place, projection.distance_m * projection.distance_m + turn_m * turn_m))
    });
    places.collect()
}

/// How a lane leads to another: itself, after it, or beside one of these.
fn step(map: &RoadMap, from: LaneIndex, to: LaneIndex) -> Option<Step> {
    let mut reached = vec![from];
    let mut beside = false;
    for _ in 0..=LEAPS_MAX {
        if reached.contains(&to) {
            return Some(Step::On);
        }
        let neighbours = |lane: &LaneIndex| sides(map.lane(*lane)).any(|(next, _)| next == to);
        beside |= reached.iter().any(neighbours);
        reached = reached.iter().flat_map(|lane| map.lane(*lane).successors.iter().copied()).collect();
    }
    beside.then_some(Step::Aside)
}

/// The neighbouring lanes of the same direction, with 1 for the left one and -1 for the right one.
fn sides(lane: &Lane) -> impl Iterator<Item = (LaneIndex, i32)> {
    let sides = [(lane.left, 1), (lane.right, -1)].into_iter();
    sides.filter_map(|(next, side)| next.filter(|next| next.same_direction).map(|next| (next.lane, side)))
}

/// The change between a place and the next one, by how far over the poses are before and after it.
fn lane_change(map: &RoadMap, places: &[LanePlace], poses: &[&Pose], index: usize) -> Option<LaneChange> {
    let side = side(map, places[index], places[index + 1], poses[index + 1])?;
    // How much of the way over is done where the change is `ahead` of the pose, or behind it.
    let over = |at: usize| -> Option<f64> {
        let (place, other_side) = (places[at], if at <= index { side } else { -side });
        let (other, _) = sides(map.lane(place.lane)).find(|(_, its)| *its == other_side)?;
        let other_m = map.lane(other).centre.project(poses[at].position).offset_m;
        let part = place.offset_m / (place.offset_m - other_m);
        Some(if at <= index { part } else { 1.0 - part })
    };
    // Where a part is passed, between two places; `None` if it is never seen.
    let passed = |part: f64| -> Option<f64> {
        let is_early = part < 0.5;
        let mut at = if is_early { index } else { index + 1 };
        loop {
            let here = over(at)?;
            let next = if is_early { at.checked_sub(1)? } else { at + 1 };
            if next >= places.len() {
                return None;
            }
            let there = over(next)?;
            let (low, high) = if is_early { (there, here) } else { (here, there) };
            if low <= part && part <= high && high > low {
                return Some(at.min(next) as f64 + (part - low) / (high - low));
            }
            if is_early && here <= part || !is_early && here >= part {
                return Some(at as f64);
            }
            at = next;
        }
    };
    let middle = index as f64 + 0.5;
    let (early, late) = (passed(SEEN[0]), passed(SEEN[1]));
    let half = SEEN_AFTER[1] - 0.5;
    // If only one half of a change is seen, the other half is taken to be like it.
    let length = match (early, late) {
        (Some(early), Some(late)) => (late - early) / (SEEN_AFTER[1] - SEEN_AFTER[0]),
        (Some(early), None) => (middle - early) / half,
        (None, Some(late)) => (late - middle) / half,
        (None, None) => 2.0 * places.len() as f64,
    };
    let begin = match (early, late) {
        (Some(early), _) => early - SEEN_AFTER[0] * length,
        (None, Some(late)) => late - SEEN_AFTER[1] * length,
        (None, None) => 0.0,
    };
    // If a change was under way as the road user appeared, only the rest of it is written.
    let begun = begin.max(0.0);
    let samples = |places: f64| (places * STRIDE as f64).round() as usize;
    let length = samples(length + begin - begun).max(1);
    Some(LaneChange { begin: samples(begun), length, lanes_left: side })
}

/// To which side the next place is: of the first place's lane, or, where that ends, of the lane to which it leads.
fn side(map: &RoadMap, from: LanePlace, to: LanePlace, pose: &Pose) -> Option<i32> {
    let beside = sides(map.lane(from.lane)).find(|(lane, _)| *lane == to.lane);
    let back = sides(map.lane(to.lane)).find(|(lane, _)| step(map, from.lane, *lane) == Some(Step::On));
    let by_offset = || {
        let offset_m = map.lane(from.lane).centre.project(pose.position).offset_m;
        (offset_m != 0.0).then_some(if offset_m > 0.0 { 1 } else { -1 })
    };
    beside.map(|(_, side)| side).or(back.map(|(_, side)| -side)).or_else(by_offset)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;
    use avastra_road::testing::{lanes, street};

    /// A street to the east with two lanes each way, 3 m wide.
    fn two_by_two() -> RoadMap {
        let lanes = lanes(&[
            (2, "driving", 3.0, ""),
            (1, "driving", 3.0, ""),
            (-1, "driving", 3.0, ""),
            (-2, "driving", 3.0, ""),
        ]);
        let street = street("7", [0.0, 0.0, 0.0, 300.0], "-1", "", &lanes, "");
        RoadMap::from_opendrive("street", &format!("<OpenDRIVE>{street}</OpenDRIVE>")).expect("it is a map")
    }

    /// Poses at 10 m/s to the east, at an offset to the left of the reference line (m) for each sample.
    fn at_offsets(offset_m: impl Fn(usize) -> f64) -> Vec<Pose> {
        (0..600).map(|tick| Pose::new(10.0 + 0.2 * tick as f64, offset_m(tick), 0.0)).collect()
    }

    #[test]
    fn a_sinusoidal_lane_change_is_found_again() {
        let map = two_by_two();
        for (from_m, to_m, lanes_left) in [(-4.5, -1.5, 1), (-1.5, -4.5, -1)] {
            let poses = at_offsets(|tick| {
                let part = ((tick as f64 - 200.0) / 150.0).clamp(0.0, 1.0);
                from_m + (to_m - from_m) * (1.0 - libm::cos(PI * part)) / 2.0
            });
            let way = driven(&map, &poses).expect("it lies in lanes");
            assert_eq!(way.places.len(), 120);
            let [change] = way.changes[..] else { panic!("{:?}", way.changes) };
            assert_eq!(change.lanes_left, lanes_left);
            assert!(change.begin.abs_diff(200) <= 2 && change.length.abs_diff(150) <= 4, "{change:?}");
        }
    }

    #[test]
    fn what_keeps_beside_the_centre_changes_no_lane() {
        let map = two_by_two();
        let way = driven(&map, &at_offsets(|_| -2.3)).expect("it lies in a lane");
        assert_eq!(way.changes, []);
        assert!(way.places.iter().all(|place| (place.offset_m + 0.8).abs() < 1e-6), "{:?}", way.places[0]);
    }

    #[test]
    fn a_change_that_is_cut_is_like_the_half_that_is_seen() {
        let map = two_by_two();
        let poses = at_offsets(|tick| -4.5 + 3.0 * (1.0 - libm::cos(PI * (tick as f64 / 800.0))) / 2.0);
        let way = driven(&map, &poses).expect("it lies in lanes");
        let [change] = way.changes[..] else { panic!("{:?}", way.changes) };
        assert!(change.begin <= 30 && change.length.abs_diff(800) <= 80, "{change:?}");
    }

    #[test]
    fn a_way_across_or_beside_the_lanes_is_none() {
        let map = two_by_two();
        assert_eq!(driven(&map, &at_offsets(|_| 20.0)), None);
        let across: Vec<Pose> =
            (0..100).map(|tick| Pose::new(50.0, -8.0 + 0.1 * f64::from(tick), PI / 2.0)).collect();
        assert_eq!(driven(&map, &across), None);
    }
}
