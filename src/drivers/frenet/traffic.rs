//! Other road users in the frame of the guide, now and in every tenth of a second to come.
//!
//! A vehicle in a lane keeps to it at its present speed and offset, and goes straight on at a fork. A vehicle
//! that moves across its lane, and every pedestrian, keeps its velocity (PDM-Closed: constant velocity for all).
//! In these forecasts no road user obeys a signal or gives way.

use crate::kit::Guide;
use avastra_base::geometry::{Beside, Pose, Span, Vec2, extent_m, unit_vector, wrap_angle};
use avastra_road::{LanePlace, RoadMap, Turn};
use avastra_world::sim::SensedObject;

use super::proposal::{STEP_S, STEPS};

/// Steps of a forecast: the proposals' 4 s, and what is looked ahead at their end for a time to collision.
pub const FORECAST_STEPS: usize = STEPS + 10;
/// Steps between the places that lanes are asked for: 0.5 s.
const STRIDE: usize = 5;
const STRIDE_S: f64 = STRIDE as f64 * STEP_S;
const STRIDES: usize = FORECAST_STEPS / STRIDE + 1;

/// Road users farther from the guide than this are not on it whatever lane is driven, m.
const SIDE_M: f64 = 7.0;
/// How far behind the ego vehicle is looked, m.
const BEHIND_M: f64 = 60.0;
/// A vehicle turned farther than this from its lane is not following it, rad. Ours.
const OFF_LANE_RAD: f64 = 0.5;
/// A vehicle with a higher lateral speed is not following its lane either, m/s: drivers wander at up to 0.3. Ours.
const SIDEWAYS_MPS: f64 = 0.4;
/// A lane this near to the middle of a vehicle may be its own, m.
const LANE_REACH_M: f64 = 0.5;
/// Outlines turned less than this lie along the guide: sine of 3°.
const ALONG_SINE: f64 = 0.05;

/// A road user that is, or will be, near the guide.
#[derive(Debug, Clone)]
pub struct Other {
    pub id: u32,
    length_m: f64,
    width_m: f64,
    /// Now and after every step; `None` far from the guide.
    pub places: [Option<Place>; FORECAST_STEPS],
    /// Every 0.5 s, for pictures.
    pub predicted: [Vec2; STRIDES],
}

/// Where a road user is beside the guide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub station_m: f64,
    /// m to the left.
    pub offset_m: f64,
    /// Unit vector along the outline, in the frame of the guide.
    forward: Vec2,
    /// Half the extent along and across the guide, m.
    half_along_m: f64,
    half_across_m: f64,
    /// Speed along the guide, and in whatever direction, m/s.
    pub along_mps: f64,
    pub speed_mps: f64,
}

impl Other {
    /// The road user beside the guide, from a look on; `None` if it stays away.
    pub fn seen(map: &RoadMap, guide: &Guide, object: &SensedObject, station_m: f64) -> Option<Other> {
        let poses = forecast(map, object);
        let reach_m = SIDE_M + (object.length_m + object.width_m) / 2.0;
        let (from_m, to_m) = (station_m - BEHIND_M, station_m + guide.range_m());
        let mut tracer = guide.trace(object.pose.position, from_m, to_m, reach_m);
        let mut places = [None; FORECAST_STEPS];
        for (step, place) in places.iter_mut().enumerate() {
            let (pose, next) = (poses[step / STRIDE], poses[step / STRIDE + 1]);
            let gone = next.position - pose.position;
            let part = (step % STRIDE) as f64 / STRIDE as f64;
            let beside = if step == 0 { tracer.first() } else { tracer.next(pose.position + gone * part) };
            *place = beside
                .filter(|beside| beside.offset_m.abs() < reach_m)
                .map(|beside| Place::of(&beside, &pose, gone / STRIDE_S, object));
            if object.velocity_mps == Vec2::zeros() {
                places = [places[0]; FORECAST_STEPS];
                break;
            }
        }
        let predicted = poses.map(|pose| pose.position);
        let SensedObject { id, length_m, width_m, .. } = *object;
        let is_near = places.iter().any(Option::is_some);
        is_near.then_some(Other { id, length_m, width_m, places, predicted })
    }

    /// The part of the guide that it takes at a step, from a strip `half_m` to each side of `offset_m`.
    pub fn taken(&self, step: usize, offset_m: f64, half_m: f64) -> Option<Span> {
        let place = self.places[step].as_ref()?;
        let aside_m = place.offset_m - offset_m;
        if aside_m.abs() >= half_m + place.half_across_m {
            return None;
        }
        if place.forward.y.abs() < ALONG_SINE {
            let (from_m, to_m) = (place.station_m - place.half_along_m, place.station_m + place.half_along_m);
            return Some(Span { from_m, to_m });
        }
        let beside = Beside { station_m: place.station_m, offset_m: aside_m, forward: Vec2::x() };
        beside.taken(place.forward, self.length_m, self.width_m, half_m)
    }
}

impl Place {
    fn of(beside: &Beside, pose: &Pose, velocity_mps: Vec2, object: &SensedObject) -> Place {
        let forward = unit_vector(pose.heading_rad);
        let local = Vec2::new(beside.forward.dot(&forward), beside.forward.perp(&forward));
        let half_m = (object.length_m / 2.0, object.width_m / 2.0);
        let (half_along_m, half_across_m) = extent_m(forward, beside.forward, half_m);
        Place {
            station_m: beside.station_m,
            offset_m: beside.offset_m,
            forward: local,
            half_along_m,
            half_across_m,
            along_mps: beside.forward.dot(&velocity_mps),
            speed_mps: velocity_mps.norm(),
        }
    }

    /// Whether it goes along the guide rather than across it or against it: within 60°.
    pub fn goes_along(&self) -> bool {
        self.forward.x > 0.5
    }
}

/// Poses every [`STRIDE_S`].
fn forecast(map: &RoadMap, object: &SensedObject) -> [Pose; STRIDES] {
    let straight = || {
        core::array::from_fn(|stride| Pose {
            position: object.pose.position + object.velocity_mps * (stride as f64 * STRIDE_S),
            ..object.pose
        })
    };
    if !object.body.is_vehicle() || object.velocity_mps == Vec2::zeros() {
        return straight();
    }
    let Some(place) = map.nearest(object.pose.position, object.pose.heading_rad, LANE_REACH_M) else {
        return straight();
    };
    let lane_rad = map.lane(place.lane).centre.pose_at(place.station_m).heading_rad;
    let sideways_mps = unit_vector(lane_rad).perp(&object.velocity_mps);
    let turned_rad = wrap_angle(object.pose.heading_rad - lane_rad);
    if turned_rad.abs() > OFF_LANE_RAD || sideways_mps.abs() > SIDEWAYS_MPS {
        return straight();
    }
    along_lanes(map, place, object.velocity_mps.norm())
}

fn along_lanes(map: &RoadMap, place: LanePlace, speed_mps: f64) -> [Pose; STRIDES] {
    let (mut lane, mut station_m) = (map.lane(place.lane), place.station_m);
    core::array::from_fn(|stride| {
        station_m += if stride == 0 { 0.0 } else { speed_mps * STRIDE_S };
        while station_m > lane.centre.length_m() {
            let Some(next) =
                lane.successors.iter().map(|next| map.lane(*next)).min_by_key(|next| bend(next.turn))
            else {
                break;
            };
            station_m -= lane.centre.length_m();
            lane = next;
        }
        lane.centre.pose_at(station_m).offset(0.0, place.offset_m)
    })
}

/// The less a lane bends, the likelier it is taken.
fn bend(turn: Turn) -> u8 {
    match turn {
        Turn::Straight => 0,
        Turn::Right => 1,
        Turn::Left => 2,
        Turn::UTurn => 3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::SpeedRules;
    use crate::testing::{object, winding};
    use avastra_lang::model::vocabulary::Body;

    #[test]
    fn a_vehicle_follows_its_lane_and_a_pedestrian_goes_straight_on() {
        let scene = winding();
        let guide = Guide::new(&scene, &SpeedRules::TOWN);
        let at = |station_m: f64| scene.route.path.pose_at(station_m).offset(0.0, 0.5);
        let leader = object(1, Body::Sedan, at(115.0), 6.0);
        let seen = Other::seen(&scene.map, &guide, &leader, 90.0).expect("it is ahead");
        let last = seen.places[40].expect("it stays on the guide");
        assert!((last.station_m - 139.0).abs() < 1.0 && (last.offset_m - 0.5).abs() < 0.1, "{last:?}");
        assert!((last.along_mps - 6.0).abs() < 0.4 && last.goes_along(), "{last:?}");
        assert!(seen.taken(40, 0.0, 1.0).is_some() && seen.taken(40, -3.0, 1.0).is_none());

        let across = Pose::new(100.0, -9.75, core::f64::consts::FRAC_PI_2);
        let walker = object(2, Body::Pedestrian, across, 2.0);
        let seen = Other::seen(&scene.map, &guide, &walker, 90.0).expect("it comes");
        let then = seen.places[40].expect("it is on the guide");
        assert!(then.offset_m.abs() < 0.05 && then.along_mps.abs() < 0.05 && !then.goes_along(), "{then:?}");
        assert!(Other::seen(&scene.map, &guide, &walker, 300.0).is_none(), "far behind");
    }
}
