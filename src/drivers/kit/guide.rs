//! The route as a driving system reads it off its HD map: evenly sampled, with the speed that limits
//! and curves allow at each place.
//!
//! Even samples make look-ups and projections cheap enough to be done for every predicted position
//! of every object, which the exact projections of `geometry::Path` are not. A projection here is onto the
//! tangent of a sample:
//!
//! - [`Guide::project`]: of the nearest sample between two stations;
//! - [`Guide::locate`]: near where a vehicle lately was;
//! - [`Guide::trace`]: for a moving point, position after position.
//!
//! There are no signals and no obstacles here.

use avastra_base::geometry::{Beside, Pose, Vec2, smaller, unit_vector, wrap_angle};
use avastra_world::sim::{RANGE_M, Scene, SensedObject};

use super::speed::PREVIEW_S;

/// Distance between samples, m. On the tightest bend a car can drive (5 m) the chord is 6 mm off.
const SPACING_M: f64 = 0.5;
/// A search first checks every 16th sample (8 m), and goes on from the nearest of them.
const STRIDE: usize = 16;

/// How far before and behind its last place a vehicle is looked for, m: more than it drives or errs
/// within a tick, less than to another branch of the route.
const NEAR_M: f64 = 5.0;

/// Error that the position of a vehicle may have, m: places of the route that are nearer by less are equally near.
const POSITION_ERROR_M: f64 = 2.0;

/// Most steps along tangents until a place has settled; in a bend each step leaves a fraction of the error.
const SLIDES_MAX: usize = 8;

/// Samples whose headings and places differ by less from those on a line belong to one straight piece, rad and m.
const STRAIGHT_RAD: f64 = 1e-5;
const STRAIGHT_M: f64 = 1e-3;

/// Step of the differences that give the slope of a guide beside the path, m.
const H_M: f64 = 0.25;

/// The limits of speed on a free road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRules {
    /// Speed on a free road, m/s.
    pub cruise_mps: f64,
    /// Lateral acceleration in curves, m/s².
    pub lateral_acceleration_mps2_max: f64,
    /// Deceleration for a curve or a lower limit ahead, magnitude, m/s².
    pub slowdown_mps2: f64,
}

impl SpeedRules {
    /// How our drivers drive in towns: all in the same way, so that they can be compared. The speed is that of Apollo's
    /// upstream `planning.conf`, `default_cruise_speed` (25 mph), the curves are its speed bounds'
    /// `max_centric_acceleration_limit`; the slowing down is ours.
    pub const TOWN: SpeedRules =
        SpeedRules { cruise_mps: 11.18, lateral_acceleration_mps2_max: 2.0, slowdown_mps2: 1.5 };

    /// As in towns, but at the speed that the road asks for, if it does.
    pub fn on(scene: &Scene) -> SpeedRules {
        SpeedRules { cruise_mps: scene.set_mps.unwrap_or(SpeedRules::TOWN.cruise_mps), ..SpeedRules::TOWN }
    }

    /// For a guide that is only steered along: nothing bounds the speed but the limits of the road.
    pub const NONE: SpeedRules = SpeedRules {
        cruise_mps: f64::INFINITY,
        lateral_acceleration_mps2_max: f64::INFINITY,
        slowdown_mps2: f64::INFINITY,
    };
}

/// The route, or a path beside it, in even samples.
#[derive(Debug, Clone)]
pub struct Guide {
    samples: Vec<Sample>,
    /// The greatest distance between two neighbours, m: outside a bend of the route it is more than [`SPACING_M`].
    spacing_m_max: f64,
    /// How far from the ego vehicle road users are looked for along it, m.
    range_m: f64,
    is_motorway: bool,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    position: Vec2,
    forward: Vec2,
    heading_rad: f64,
    curvature_per_m: f64,
    speed_mps_max: f64,
    /// The first and the last sample of the straight piece that it belongs to; both itself in a bend.
    straight: [u32; 2],
}

/// The nearest integer to a number above -1024: `f64::round` is a call where the processor need not have it.
fn rounded(number: f64) -> isize {
    (number + 1024.5) as i32 as isize - 1024
}

/// Notes where the guide is straight.
fn note_straights(samples: &mut [Sample]) {
    let mut first = 0;
    while first < samples.len() {
        let Sample { position, forward, .. } = samples[first];
        let is_on_line = |(nth, sample): &(usize, &Sample)| {
            let expected = position + forward * (*nth as f64 * SPACING_M);
            (sample.forward - forward).norm_squared() < STRAIGHT_RAD * STRAIGHT_RAD
                && (sample.position - expected).norm_squared() < STRAIGHT_M * STRAIGHT_M
        };
        let on_line = samples[first..].iter().enumerate().take_while(is_on_line).count();
        let last = first + on_line.max(1) - 1;
        samples[first..=last].iter_mut().for_each(|sample| sample.straight = [first as u32, last as u32]);
        first = last + 1;
    }
}

impl Guide {
    /// Along the route's path: lane changes as early as they are comfortable.
    pub fn new(scene: &Scene, rules: &SpeedRules) -> Guide {
        Guide::beside(scene, rules, |_| 0.0)
    }

    /// As [`Guide::new`], but each lane change has its own station (m) at which it begins; it does not begin
    /// at all while that is infinite. Stations remain those of the route's path.
    pub fn with_changes(scene: &Scene, rules: &SpeedRules, begins_m: &[f64]) -> Guide {
        debug_assert_eq!(begins_m.len(), scene.route.changes.len());
        let changes = || scene.route.changes.iter().zip(begins_m);
        Guide::beside(scene, rules, |station_m| {
            changes().map(|(change, begin_m)| change.postponed_offset_m(station_m, *begin_m)).sum()
        })
    }

    /// A guide `offset_m` beside the route's path: a smooth function of the station, m to the left.
    fn beside(scene: &Scene, rules: &SpeedRules, offset_m: impl Fn(f64) -> f64) -> Guide {
        let route = &scene.route;
        let count = (route.path.length_m() / SPACING_M).ceil() as usize + 1;
        let mut lane = 0;
        let mut samples: Vec<Sample> = (0..count)
            .map(|index| {
                let station_m = index as f64 * SPACING_M;
                while lane + 1 < route.lanes.len() && route.lanes[lane].to_m <= station_m {
                    lane += 1;
                }
                let limit_mps =
                    route.lanes.get(lane).map_or(f64::INFINITY, |on| scene.map.lane(on.lane).speed_limit_mps);
                let on_path = route.path.pose_at(station_m);
                let aside_m = [-H_M, 0.0, H_M].map(|ahead_m| offset_m(station_m + ahead_m));
                let slope = (aside_m[2] - aside_m[0]) / (2.0 * H_M);
                let bend_per_m = (aside_m[2] - 2.0 * aside_m[1] + aside_m[0]) / (H_M * H_M);
                let mut pose = on_path.offset(0.0, aside_m[1]);
                pose.heading_rad = wrap_angle(pose.heading_rad + libm::atan2(slope, 1.0));
                let curvature_per_m = route.path.curvature_at(station_m) + bend_per_m;
                let curve_mps =
                    (rules.lateral_acceleration_mps2_max / curvature_per_m.abs().max(1e-6)).sqrt();
                Sample {
                    position: pose.position,
                    forward: unit_vector(pose.heading_rad),
                    heading_rad: pose.heading_rad,
                    curvature_per_m,
                    speed_mps_max: limit_mps.min(rules.cruise_mps).min(curve_mps),
                    straight: [0, 0],
                }
            })
            .collect();
        // `scene::way` has a pass like this over its own vertices; see there why they are two.
        for index in (0..count - 1).rev() {
            let next_mps = samples[index + 1].speed_mps_max;
            let reachable_mps = (next_mps * next_mps + 2.0 * rules.slowdown_mps2 * SPACING_M).sqrt();
            samples[index].speed_mps_max = samples[index].speed_mps_max.min(reachable_mps);
        }
        Guide::of_samples(samples, scene.range_m, scene.is_motorway)
    }

    fn of_samples(mut samples: Vec<Sample>, range_m: f64, is_motorway: bool) -> Guide {
        note_straights(&mut samples);
        let spacings_m = samples.windows(2).map(|pair| (pair[1].position - pair[0].position).norm());
        Guide { spacing_m_max: spacings_m.fold(0.0, f64::max), samples, range_m, is_motorway }
    }

    /// Through poses, one after another, of which two may be at the same place; and the station of each, m. There is
    /// no speed limit on it.
    pub fn through(poses: &[Pose]) -> (Guide, Vec<f64>) {
        let mut stations_m = vec![0.0];
        for pair in poses.windows(2) {
            let way_m = (pair[1].position - pair[0].position).norm();
            stations_m.push(stations_m[stations_m.len() - 1] + way_m);
        }
        let last = poses.len() - 1;
        let count = ((stations_m[last] / SPACING_M).ceil() as usize + 1).max(2);
        let at = |station_m: f64| -> Pose {
            let after = stations_m.partition_point(|known_m| *known_m <= station_m);
            if after > last {
                return poses[last].offset(station_m - stations_m[last], 0.0);
            }
            let (a, b) = (&poses[after - 1], &poses[after]);
            let fraction = (station_m - stations_m[after - 1]) / (stations_m[after] - stations_m[after - 1]);
            let turn_rad = wrap_angle(b.heading_rad - a.heading_rad) * fraction;
            Pose {
                position: a.position + (b.position - a.position) * fraction,
                heading_rad: wrap_angle(a.heading_rad + turn_rad),
            }
        };
        let sample = |index: usize| {
            let station_m = index as f64 * SPACING_M;
            let (pose, before, after) =
                (at(station_m), at((station_m - SPACING_M).max(0.0)), at(station_m + SPACING_M));
            let way_m = station_m.min(SPACING_M) + SPACING_M;
            Sample {
                position: pose.position,
                forward: unit_vector(pose.heading_rad),
                heading_rad: pose.heading_rad,
                curvature_per_m: wrap_angle(after.heading_rad - before.heading_rad) / way_m,
                speed_mps_max: f64::INFINITY,
                straight: [0, 0],
            }
        };
        let samples = (0..count).map(sample).collect();
        (Guide::of_samples(samples, RANGE_M, false), stations_m)
    }

    /// How far vehicles are sensed where it leads, m.
    pub fn range_m(&self) -> f64 {
        self.range_m
    }

    /// Predicts where a road user is some time after it was seen beside the guide: straight on; on a motorway along the road,
    /// because at those speeds a bend moves it metres to the side within seconds.
    pub fn expected(&self, object: &SensedObject, beside: &Beside, time_s: f64) -> Vec2 {
        if !self.is_motorway {
            return object.pose.position + object.velocity_mps * time_s;
        }
        let along_m = beside.forward.dot(&object.velocity_mps) * time_s;
        let left_m = beside.forward.perp(&object.velocity_mps) * time_s;
        self.pose_at(beside.station_m + along_m).offset(0.0, beside.offset_m + left_m).position
    }

    /// The pose at a station; beyond the ends the route goes on straight.
    pub fn pose_at(&self, station_m: f64) -> Pose {
        let (a, b, fraction) = self.segment(station_m);
        let turn_rad = wrap_angle(b.heading_rad - a.heading_rad) * fraction.clamp(0.0, 1.0);
        Pose {
            position: a.position + (b.position - a.position) * fraction,
            heading_rad: wrap_angle(a.heading_rad + turn_rad),
        }
    }

    /// The position of [`Guide::pose_at`], without the work for its heading.
    pub fn position_at(&self, station_m: f64) -> Vec2 {
        let (a, b, fraction) = self.segment(station_m);
        a.position + (b.position - a.position) * fraction
    }

    /// 1/m, positive to the left.
    pub fn curvature_at(&self, station_m: f64) -> f64 {
        let (a, b, fraction) = self.segment(station_m);
        a.curvature_per_m + (b.curvature_per_m - a.curvature_per_m) * fraction.clamp(0.0, 1.0)
    }

    /// Speed that limits and curves, here and ahead, allow, m/s.
    pub fn speed_mps_max(&self, station_m: f64) -> f64 {
        let (a, b, fraction) = self.segment(station_m);
        a.speed_mps_max + (b.speed_mps_max - a.speed_mps_max) * fraction.clamp(0.0, 1.0)
    }

    /// The lower of the speeds that are allowed at a station and soon after it, m/s, for a vehicle at a speed.
    pub fn allowed_mps(&self, station_m: f64, speed_mps: f64) -> f64 {
        smaller(self.speed_mps_max(station_m), self.speed_mps_max(station_m + speed_mps * PREVIEW_S))
    }

    /// The place of a vehicle that was lately at station `near_m`; with `None` the whole route is searched.
    pub fn locate(&self, point: Vec2, near_m: Option<f64>) -> Beside {
        let Some(near_m) = near_m else { return self.beside_sample(point, self.first_near(point)) };
        let within = self.stretch(near_m - NEAR_M, near_m + NEAR_M);
        let found = self.slide(point, self.index(near_m), within);
        self.beside_sample(point, found.unwrap_or_else(|| self.nearest(point, within)).index)
    }

    /// The nearest place of the route between two stations.
    pub fn project(&self, point: Vec2, from_m: f64, to_m: f64) -> Beside {
        let within = self.stretch(from_m, to_m);
        self.beside_sample(point, self.nearest(point, within).index)
    }

    /// Follows a moving point as far as it is within reach of the guide between two stations, most often without a search.
    pub fn trace(&self, point: Vec2, from_m: f64, to_m: f64, reach_m: f64) -> Tracer<'_> {
        let within = self.stretch(from_m, to_m);
        let reach_m = reach_m + SPACING_M;
        let nearest = self.nearest_within(point, within, reach_m);
        let is_straight = within.last <= self.samples[within.first].straight[1] as usize;
        Tracer { guide: self, within, reach_m, is_straight, point, nearest }
    }

    fn beside_sample(&self, point: Vec2, index: usize) -> Beside {
        let Sample { position, forward, .. } = self.samples[index];
        let delta = point - position;
        Beside {
            station_m: index as f64 * SPACING_M + forward.dot(&delta),
            offset_m: forward.x * delta.y - forward.y * delta.x,
            forward,
        }
    }

    fn squared_m2(&self, point: Vec2, index: usize) -> f64 {
        (point - self.samples[index].position).norm_squared()
    }

    /// The nearest sample of the whole route. Where the route passes a place twice, the first passage is meant,
    /// within the error of a position.
    fn first_near(&self, point: Vec2) -> usize {
        let whole = Stretch { first: 0, last: self.samples.len() - 1 };
        let nearest = self.nearest(point, whole);
        let reach_m = nearest.distance_m2.sqrt() + POSITION_ERROR_M;
        let is_near = |index: &usize| self.squared_m2(point, *index) <= reach_m * reach_m;
        let first = (0..nearest.index).find(is_near).unwrap_or(nearest.index);
        self.descend(point, first, whole).index
    }

    /// The sample of a stretch that is nearest to a point.
    fn nearest(&self, point: Vec2, within: Stretch) -> Nearest {
        self.nearest_within(point, within, f64::INFINITY).expect("everything is within reach")
    }

    /// As [`Guide::nearest`], if it is within reach, m.
    ///
    /// # Errors
    /// A distance beyond that reach, which the nearest sample has at least, m.
    fn nearest_within(&self, point: Vec2, within: Stretch, reach_m: f64) -> Result<Nearest, f64> {
        let Stretch { first, last } = within;
        let mut best = Nearest { index: last, distance_m2: self.squared_m2(point, last) };
        // Not `step_by`: it costs as much as the distances.
        let (samples, mut index) = (&self.samples[..last], first);
        while let Some(sample) = samples.get(index) {
            let distance_m2 = (point - sample.position).norm_squared();
            if distance_m2 < best.distance_m2 {
                best = Nearest { index, distance_m2 };
            }
            index += STRIDE;
        }
        // No sample is farther than half a stride from one that was looked at.
        let least_m = best.distance_m2.sqrt() - (STRIDE / 2) as f64 * self.spacing_m_max;
        if least_m > reach_m {
            return Err(least_m);
        }
        // Far aside, a tangent may lead to another piece, which is farther away.
        let slid = self.slide(point, best.index, within).filter(|slid| slid.distance_m2 <= best.distance_m2);
        let best = slid.unwrap_or_else(|| self.descend(point, best.index, within));
        let distance_m = best.distance_m2.sqrt();
        if distance_m <= reach_m { Ok(best) } else { Err(distance_m) }
    }

    /// The nearest sample, found by stepping along tangents from a sample nearby: much quicker than a
    /// search, but `None` where the steps do not settle.
    fn slide(&self, point: Vec2, from: usize, within: Stretch) -> Option<Nearest> {
        let mut index = from;
        for _ in 0..SLIDES_MAX {
            let Sample { position, forward, straight, .. } = self.samples[index];
            let ahead_m = forward.dot(&(point - position));
            // On a straight piece the nearest sample needs no search.
            let nearest = index.saturating_add_signed(rounded(ahead_m / SPACING_M));
            let is_inside = straight[0] as usize <= nearest && nearest <= straight[1] as usize;
            let is_on_it = straight[0] < straight[1] && is_inside;
            if is_on_it && within.first <= nearest && nearest <= within.last {
                return Some(Nearest { index: nearest, distance_m2: self.squared_m2(point, nearest) });
            }
            let ahead = (ahead_m / SPACING_M) as i32 as isize;
            let next = index.saturating_add_signed(ahead).clamp(within.first, within.last);
            if next == index {
                return Some(self.descend(point, index, within));
            }
            index = next;
        }
        None
    }

    /// Walks from a sample to one whose neighbours are both farther from a point; of several equally near,
    /// to the first.
    fn descend(&self, point: Vec2, from: usize, within: Stretch) -> Nearest {
        let mut best = Nearest { index: from, distance_m2: self.squared_m2(point, from) };
        while best.index < within.last {
            let distance_m2 = self.squared_m2(point, best.index + 1);
            if distance_m2 >= best.distance_m2 {
                break;
            }
            best = Nearest { index: best.index + 1, distance_m2 };
        }
        while best.index > within.first {
            let distance_m2 = self.squared_m2(point, best.index - 1);
            if distance_m2 > best.distance_m2 {
                break;
            }
            best = Nearest { index: best.index - 1, distance_m2 };
        }
        best
    }

    fn stretch(&self, from_m: f64, to_m: f64) -> Stretch {
        let first = self.index(from_m);
        Stretch { first, last: self.index(to_m).max(first) }
    }

    fn index(&self, station_m: f64) -> usize {
        // The conversion makes 0 of what is negative.
        ((station_m / SPACING_M) as u32 as usize).min(self.samples.len() - 1)
    }

    /// The samples around a station and the fraction of the way between them, which leaves `[0, 1]` beyond the ends.
    fn segment(&self, station_m: f64) -> (&Sample, &Sample, f64) {
        let index = self.index(station_m).min(self.samples.len() - 2);
        (&self.samples[index], &self.samples[index + 1], station_m / SPACING_M - index as f64)
    }
}

/// Samples from the first to the last.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    first: usize,
    last: usize,
}

/// The sample that is nearest to a point.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    index: usize,
    distance_m2: f64,
}

/// Projects a moving point onto a stretch of a guide, position after position.
#[derive(Debug)]
pub struct Tracer<'a> {
    guide: &'a Guide,
    within: Stretch,
    reach_m: f64,
    /// Whether the stretch is straight: what is out of reach of one piece of it is out of reach of all.
    is_straight: bool,
    /// The last position that was looked for, and its nearest sample; or the least distance of any, if it is out of reach.
    point: Vec2,
    nearest: Result<Nearest, f64>,
}

impl Tracer<'_> {
    /// The projection of the first position; `None` if it is out of reach of the stretch and of the line that leads to its start.
    pub fn first(&self) -> Option<Beside> {
        self.here().or_else(|| self.behind())
    }

    /// The projection of the last position; `None` if it is out of reach.
    fn here(&self) -> Option<Beside> {
        let nearest = self.nearest.ok().filter(|nearest| self.is_near(nearest))?;
        Some(self.guide.beside_sample(self.point, nearest.index))
    }

    /// The projection of the last position if it lies behind the stretch, in reach of the line that leads to its start.
    fn behind(&self) -> Option<Beside> {
        let beside = self.guide.beside_sample(self.point, self.within.first);
        let is_behind = beside.station_m < self.within.first as f64 * SPACING_M;
        (is_behind && beside.offset_m.abs() <= self.reach_m).then_some(beside)
    }

    /// Whether the point can come into reach within so much way, m: `false` is certain.
    pub fn may_reach(&self, way_m: f64) -> bool {
        self.least_m().is_none_or(|least_m| least_m - way_m <= self.reach_m)
    }

    /// The least distance that the last position has, if it is out of reach, m.
    fn least_m(&self) -> Option<f64> {
        match &self.nearest {
            Ok(nearest) if self.is_near(nearest) => None,
            Ok(nearest) => Some(nearest.distance_m2.sqrt()),
            Err(least_m) => Some(*least_m),
        }
    }

    fn is_near(&self, nearest: &Nearest) -> bool {
        nearest.distance_m2 <= self.reach_m * self.reach_m
    }

    /// The projection of the next position; `None` if it is out of reach.
    pub fn next(&mut self, point: Vec2) -> Option<Beside> {
        // The point cannot be nearer than the last distance less the way that it has moved.
        if self.least_m().is_some_and(|least_m| least_m - (point - self.point).norm() > self.reach_m) {
            return None;
        }
        let slid = self.nearest.ok().and_then(|from| self.guide.slide(point, from.index, self.within));
        // A point that is out of reach of the stretch near by may be in reach of another bend.
        let counts = |nearest: &Nearest| self.is_straight || self.is_near(nearest);
        let search = || self.guide.nearest_within(point, self.within, self.reach_m);
        self.nearest = slid.filter(counts).map_or_else(search, Ok);
        self.point = point;
        self.here()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{ring, winding};

    #[test]
    fn places_and_projections_agree_with_the_path() {
        let scene = winding();
        let guide = Guide::new(&scene, &SpeedRules::TOWN);
        for index in 0..370 {
            let station_m = f64::from(index) + 0.3;
            let on_path = scene.route.path.pose_at(station_m);
            assert!((guide.pose_at(station_m).position - on_path.position).norm() < 0.01, "{station_m}");
            let beside = guide.project(on_path.offset(0.0, 1.0).position, station_m - 20.0, station_m + 20.0);
            assert!((beside.station_m - station_m).abs() < 0.06, "{beside:?} at {station_m}");
            assert!((beside.offset_m - 1.0).abs() < 0.01, "{beside:?}");
        }
    }

    #[test]
    fn a_drive_begins_where_the_route_begins_even_if_it_comes_there_again() {
        let guide = Guide::new(&ring(), &SpeedRules::TOWN);
        let start = guide.pose_at(0.0);
        for (ahead_m, left_m) in [(0.0, 0.0), (0.3, 0.2), (0.2, -0.4), (1.0, 0.1)] {
            let place = guide.locate(start.offset(ahead_m, left_m).position, None);
            assert!((place.station_m - ahead_m).abs() < 0.1, "{place:?}");
        }
        let place = guide.locate(guide.pose_at(80.0).offset(0.0, 0.3).position, None);
        assert!((place.station_m - 80.0).abs() < 0.1, "{place:?}");
    }

    /// The distance to the nearest sample of a stretch, by looking at each.
    fn nearest_m(guide: &Guide, point: Vec2, from_m: f64, to_m: f64) -> f64 {
        let within = guide.stretch(from_m, to_m);
        let all = (within.first..=within.last).map(|index| guide.squared_m2(point, index));
        all.fold(f64::INFINITY, f64::min).sqrt()
    }

    #[test]
    fn near_the_way_searches_find_what_a_look_at_each_sample_finds() {
        let guide = Guide::new(&winding(), &SpeedRules::TOWN);
        for (from_m, to_m) in [(0.0, 360.0), (100.0, 130.0), (120.0, 150.0), (60.0, 200.0)] {
            for case in 0..3000 {
                let near = guide.pose_at(f64::from(case % 360));
                let point = near.offset(0.0, f64::from(case % 23) - 11.0).position;
                let within = guide.stretch(from_m, to_m);
                let least_m = nearest_m(&guide, point, from_m, to_m);
                if least_m < 12.0 {
                    assert!(guide.nearest(point, within).distance_m2.sqrt() < least_m + 1e-9, "case {case}");
                }
                // A long body that comes from far off, step by step.
                let reach_m = 9.0;
                let step = unit_vector(f64::from(case)) * 1.9;
                let mut tracer = guide.trace(point - step * 12.0, from_m, to_m, reach_m);
                for moment in 1..=24 {
                    let there = point + step * f64::from(moment - 12);
                    let is_in_reach = nearest_m(&guide, there, from_m, to_m) <= reach_m;
                    assert!(tracer.next(there).is_some() || !is_in_reach, "case {case}, moment {moment}");
                }
            }
        }
    }

    #[test]
    fn a_moving_point_is_followed_as_if_searched_anew() {
        let guide = Guide::new(&winding(), &SpeedRules::TOWN);
        let (from_m, to_m, reach_m) = (20.0, 330.0, 5.0);
        let (mut near, mut far) = (0, 0);
        for case in 0..400 {
            // From beside the route in all directions, up to 2.2 m a step.
            let start = guide.pose_at(f64::from(case % 100) * 3.5).offset(0.0, f64::from(case % 13) - 6.0);
            let step = unit_vector(f64::from(case) * 0.7) * (f64::from(case % 11) * 0.22);
            let mut tracer = guide.trace(start.position, from_m, to_m, reach_m);
            let first = guide.project(start.position, from_m, to_m);
            assert!(tracer.here().is_none_or(|here| here == first));
            for moment in 1..=25 {
                let point = start.position + step * f64::from(moment);
                let anew = guide.project(point, from_m, to_m);
                match tracer.next(point) {
                    Some(beside) => {
                        assert_eq!(beside, anew, "case {case}, moment {moment}");
                        near += 1;
                    }
                    None => {
                        let beyond_m = (from_m - anew.station_m).max(anew.station_m - to_m).max(0.0);
                        let away_m = libm::hypot(beyond_m, anew.offset_m);
                        assert!(away_m > reach_m, "case {case}: {anew:?}");
                        far += 1;
                    }
                }
            }
        }
        assert!(near > 2000 && far > 2000, "{near} {far}");
    }

    #[test]
    fn curves_are_foreseen() {
        let guide = Guide::new(&winding(), &SpeedRules::TOWN);
        assert_eq!(guide.speed_mps_max(50.0), SpeedRules::TOWN.cruise_mps);
        // √(2 · 15 + …): the route lies 1.75 m outside the left-hand bend's line of 15 m.
        assert!((guide.speed_mps_max(135.0) - (2.0_f64 * 16.75).sqrt()).abs() < 0.1);
        for index in 0..700 {
            let (here, next) = (f64::from(index) * 0.5, f64::from(index + 1) * 0.5);
            let (before, after) = (guide.speed_mps_max(here), guide.speed_mps_max(next));
            assert!(before * before - after * after <= 2.0 * 1.5 * 0.5 + 1e-9, "at {here}");
        }
    }
}
