//! Lane changes: where markings and widths permit them, and how a path goes from lane to lane.
//!
//! The lateral motion is a smooth step over the station: no lateral speed, acceleration or jump of curvature at
//! its ends (as in Apollo's and most planners' lane changes). Traffic plays no part here.

use avastra_base::geometry::{Pose, SMOOTH_STEP_BEND_MAX, Vec2, smooth_step, wrap_angle};

use super::crossing::append;
use super::map::{Lane, LaneIndex, RoadMap, Side};
use super::opendrive::{Across, MarkRule, RoadElement, SectionElement};

/// A lane narrower than this cannot be driven in yet, m: bays open from nothing.
const WIDTH_M_MIN: f64 = 2.0;

/// A strip between two lanes that is wider than this is a median, m. No lane change crosses a median.
pub const STRIP_M_MAX: f64 = 0.5;

/// Distance between the stations at which widths are checked, m.
const STEP_M: f64 = 1.0;

/// Largest lateral acceleration of a lane change at the speed limit, m/s². It is comfortable: at 50 km/h a
/// change by 3.3 m takes 50 m.
const LATERAL_MPS2: f64 = 1.5;

/// Least length of a lane change, m: what a car needs at walking pace to shift by a lane.
pub const LENGTH_M_MIN: f64 = 15.0;

/// Parallel lanes are not followed farther than this, m.
const STRETCH_M_MAX: f64 = 2000.0;

/// The end of a lane and the end of a permitted part count as equal within this, m.
const TOUCH_M: f64 = 0.01;
/// A stretch that begins at most this far ahead counts as begun, m.
const AT_ONCE_M: f64 = 0.1;

/// Length of a comfortable lane change at a speed over a width, m.
///
/// A smooth step of width `w` over the length `L` at the speed `v` accelerates laterally by at most
/// `10/√3 w v²/L²`.
pub fn comfortable_length_m(speed_mps: f64, width_m: f64) -> f64 {
    (speed_mps * (SMOOTH_STEP_BEND_MAX * width_m / LATERAL_MPS2).sqrt()).max(LENGTH_M_MIN)
}

/// For two neighbouring lanes of a section: the stations of the reference line between which a vehicle may
/// change from the left lane to the right one, and those for the way back, m. No change crosses a median or a
/// marking that forbids it, and both lanes must be wide enough.
pub fn permitted(
    road: &RoadElement,
    section: &SectionElement,
    left: i32,
    right: i32,
) -> [Vec<(f64, f64)>; 2] {
    // The line between two lanes belongs to the lane that is nearer to the reference line.
    let inner = if left.abs() < right.abs() { left } else { right };
    let marks = section.lane(inner).map_or(&[][..], |lane| &lane.marks);
    let sides = [road.across(section, left), road.across(section, right)];
    let steps = ((section.end_m - section.begin_m) / STEP_M).ceil().clamp(1.0, 1e6) as usize;
    let step_m = (section.end_m - section.begin_m) / steps as f64;
    // Lanes of one width are as wide at their ends as everywhere between.
    let stride = if sides.iter().all(Across::is_constant) { steps } else { 1 };
    let cuts_m = (0..=steps).step_by(stride).map(|i| section.begin_m + step_m * i as f64);
    let mut cuts_m: Vec<f64> = cuts_m.collect();
    cuts_m.extend(marks.iter().map(|mark| section.begin_m + mark.begin_m));
    cuts_m.retain(|at_m| (section.begin_m..=section.end_m).contains(at_m));
    cuts_m.sort_by(f64::total_cmp);
    let is_wide: Vec<bool> = cuts_m.iter().map(|at_m| wide(&sides, section, *at_m)).collect();
    let mut both = [Vec::new(), Vec::new()];
    for (index, pair) in cuts_m.windows(2).enumerate() {
        let (from_m, to_m) = (pair[0], pair[1]);
        if to_m - from_m < 1e-9 || !is_wide[index] || !is_wide[index + 1] {
            continue;
        }
        let middle_m = (from_m + to_m) / 2.0 - section.begin_m;
        // Marks stand by rising beginning.
        let begun = marks.partition_point(|mark| mark.begin_m <= middle_m);
        let rule = marks[..begun].last().map_or(MarkRule::Both, |mark| mark.rule);
        // Lane ids fall from left to right.
        let allowed = [
            matches!(rule, MarkRule::Both | MarkRule::Decrease),
            matches!(rule, MarkRule::Both | MarkRule::Increase),
        ];
        for (parts, _) in both.iter_mut().zip(allowed).filter(|(_, allowed)| *allowed) {
            append(parts, from_m, to_m);
        }
    }
    both
}

fn wide([left, right]: &[Across; 2], section: &SectionElement, s_m: f64) -> bool {
    // At its end the polynomials of the next section hold; just before it still those of this one.
    let s_m = s_m.min(section.end_m - 1e-7);
    let (left_centre, left_width) = left.at(s_m);
    let (right_centre, right_width) = right.at(s_m);
    let strip_m = left_centre.value - right_centre.value - (left_width.value + right_width.value) / 2.0;
    left_width.value >= WIDTH_M_MIN && right_width.value >= WIDTH_M_MIN && strip_m <= STRIP_M_MAX
}

/// Two chains of lanes side by side; a vehicle may change from one to the other everywhere.
#[derive(Debug, Clone)]
pub struct Stretch {
    pub side: Side,
    /// The pairs in driving direction.
    pub pairs: Vec<Pair>,
}

/// A lane, its neighbour, and the stations of the lane between which a vehicle may change.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    pub source: LaneIndex,
    pub target: LaneIndex,
    pub from_m: f64,
    pub to_m: f64,
}

impl Pair {
    /// The next pair of lanes, if both lanes go on side by side without a break.
    fn next(&self, map: &RoadMap, side: Side) -> Option<Pair> {
        let (source, target) = (map.lane(self.source), map.lane(self.target));
        if self.to_m < source.centre.length_m() - TOUCH_M {
            return None;
        }
        source.successors.iter().find_map(|source| {
            let beside = map.lane(*source).neighbour(side)?.lane;
            let (from_m, to_m) = *map.lane(*source).changes_m(side).first()?;
            let goes_on = target.successors.contains(&beside) && from_m < TOUCH_M;
            goes_on.then_some(Pair { source: *source, target: beside, from_m: 0.0, to_m })
        })
    }
}

/// A place on a [`Stretch`]: which pair, and the station of its source lane, m.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub pair: usize,
    pub station_m: f64,
}

impl Stretch {
    /// All stretches that a vehicle on a lane, at a station or later, can use to change to a side.
    pub fn from(map: &RoadMap, source: LaneIndex, side: Side, station_m: f64) -> Vec<Stretch> {
        let lane = map.lane(source);
        let Some(target) = lane.neighbour(side).map(|neighbour| neighbour.lane) else { return Vec::new() };
        let later = lane.changes_m(side).iter().filter(|(_, to_m)| *to_m > station_m);
        let begun = later.map(|(from_m, to_m)| {
            let first = Pair { source, target, from_m: from_m.max(station_m), to_m: *to_m };
            Stretch { side, pairs: vec![first] }.extended(map)
        });
        begun.collect()
    }

    /// Appends the lanes ahead as long as they stay side by side.
    fn extended(mut self, map: &RoadMap) -> Stretch {
        while self.length_m() < STRETCH_M_MAX {
            match self.pairs[self.pairs.len() - 1].next(map, self.side) {
                Some(next) if self.pairs.iter().all(|pair| pair.source != next.source) => {
                    self.pairs.push(next);
                }
                _ => break,
            }
        }
        self
    }

    pub fn length_m(&self) -> f64 {
        self.pairs.iter().map(|pair| pair.to_m - pair.from_m).sum()
    }

    /// The place at a distance from the beginning along the source lanes, clamped to the end.
    pub fn place(&self, distance_m: f64) -> Place {
        let mut rest_m = distance_m;
        for (index, pair) in self.pairs.iter().enumerate() {
            let length_m = pair.to_m - pair.from_m;
            if rest_m < length_m || index + 1 == self.pairs.len() {
                return Place { pair: index, station_m: pair.from_m + rest_m.min(length_m) };
            }
            rest_m -= length_m;
        }
        unreachable!("a stretch has a first pair")
    }

    /// Station of the target lane abreast of a place, m.
    pub fn target_station_m(&self, map: &RoadMap, place: Place) -> f64 {
        let pair = &self.pairs[place.pair];
        map.lane(pair.target).station_of(map.lane(pair.source).road_station_m(place.station_m))
    }

    /// Distance from the source to the target centre at a place, m, positive to the left.
    pub fn shift_m(&self, map: &RoadMap, place: Place) -> f64 {
        let (source, target) = self.poses(map, place);
        let distance_m = (target.position - source.position).norm();
        if self.side == Side::Left { distance_m } else { -distance_m }
    }

    /// Position, heading and curvature of a change over `length_m` from the beginning, at a fraction
    /// of it.
    pub fn blend(&self, map: &RoadMap, length_m: f64, fraction: f64) -> (Vec2, f64, f64) {
        let place = self.place(length_m * fraction);
        let (source, target) = self.poses(map, place);
        let step = smooth_step(fraction);
        let part = step.value;
        let shift_m = self.shift_m(map, place);
        let source_per_m = self.lane(map, place).centre.curvature_at(place.station_m);
        let target_lane = map.lane(self.pairs[place.pair].target);
        let target_per_m = target_lane.centre.curvature_at(self.target_station_m(map, place));
        // The shift is a curve over the source lane, whose own stations shrink towards the inside of a
        // bend by `1 - k t`.
        let ahead = 1.0 - source_per_m * shift_m * part;
        let slope = step.slope * shift_m / length_m / ahead;
        let bend_per_m = step.bend * shift_m / (length_m * length_m * ahead * ahead);
        let steepness = 1.0 + slope * slope;
        let heading_rad = source.heading_rad
            + wrap_angle(target.heading_rad - source.heading_rad) * part
            + libm::atan2(slope, 1.0);
        let along_per_m = source_per_m + (target_per_m - source_per_m) * part;
        (
            source.position + (target.position - source.position) * part,
            wrap_angle(heading_rad),
            along_per_m + bend_per_m / (steepness * steepness.sqrt()),
        )
    }

    fn lane<'a>(&self, map: &'a RoadMap, place: Place) -> &'a Lane {
        map.lane(self.pairs[place.pair].source)
    }

    /// Poses of the source and the target centre abreast of each other.
    fn poses(&self, map: &RoadMap, place: Place) -> (Pose, Pose) {
        let target = map.lane(self.pairs[place.pair].target);
        (
            self.lane(map, place).centre.pose_at(place.station_m),
            target.centre.pose_at(self.target_station_m(map, place)),
        )
    }
}

impl RoadMap {
    /// Where a change from a lane to a side is permitted, from a station on: for each stretch its first station
    /// and its length, lanes ahead included, m.
    pub fn changes_from_m(&self, lane: LaneIndex, side: Side, station_m: f64) -> Vec<(f64, f64)> {
        let stretches = Stretch::from(self, lane, side, station_m);
        stretches.iter().map(|stretch| (stretch.pairs[0].from_m, stretch.length_m())).collect()
    }

    /// How far a lane change that begins at a station may last, lanes ahead included, m; 0 where none may
    /// begin. It is the length of the stretch from there, computed without building the stretch, because drivers
    /// ask ten times a second. A loop that does not come back to the first lane is followed up to
    /// [`STRETCH_M_MAX`].
    pub fn change_room_m(&self, source: LaneIndex, side: Side, station_m: f64) -> f64 {
        let lane = self.lane(source);
        let Some(target) = lane.neighbour(side).map(|neighbour| neighbour.lane) else { return 0.0 };
        let here = |(from_m, to_m): &&(f64, f64)| *from_m < station_m + AT_ONCE_M && *to_m > station_m;
        let Some((from_m, to_m)) = lane.changes_m(side).iter().find(here) else { return 0.0 };
        let mut last = Pair { source, target, from_m: from_m.max(station_m), to_m: *to_m };
        let mut room_m = last.to_m - last.from_m;
        while room_m < STRETCH_M_MAX {
            match last.next(self, side) {
                Some(next) if next.source != source => {
                    room_m += next.to_m;
                    last = next;
                }
                _ => break,
            }
        }
        room_m
    }
}
