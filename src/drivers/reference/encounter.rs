//! An encounter: one road user as the published models of careful driving see it, in the frame of the
//! ego vehicle's way.
//!
//! The models know a straight road with a gap along and a gap across it. Here both are measured beside a
//! route: the road user's outline is projected onto it, and its motion is taken to go on straight at
//! constant speed. `meeting_s` is ours: it extends the models' time to collision to road users that cross
//! or come towards the ego vehicle.

use crate::kit::Guide;
use avastra_base::geometry::{extent_m, unit_vector};
use avastra_world::sim::{SensedObject, VehicleParameters};

/// Meetings are looked for this far ahead, in steps, s. Longer than any model's threshold.
const HORIZON_S: f64 = 4.0;
const STEP_S: f64 = 0.2;
/// A road user that moves along the way more slowly than this part of its speed crosses it: 60°.
const CROSSING_PART: f64 = 0.5;

/// One road user ahead or beside, and the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encounter {
    /// From the ego vehicle's front to the near end of the road user along the way, m; negative beside.
    pub gap_m: f64,
    /// Gap between the flanks across the way, m; 0 or negative where the outlines overlap.
    pub side_gap_m: f64,
    /// Speed at which the side gap closes, m/s; negative if it opens.
    pub towards_mps: f64,
    pub own_mps: f64,
    /// Own acceleration, m/s².
    pub own_mps2: f64,
    /// Speed of the other along the way, m/s; negative if it comes towards the ego vehicle.
    pub other_mps: f64,
    /// Its acceleration along the way, m/s².
    pub other_mps2: f64,
    /// How far it has moved towards the way without a stop, m.
    pub aside_m: f64,
    /// Sum of both lengths along the way, m.
    pub lengths_m: f64,
    /// Whether the other crosses the way rather than follows it.
    pub crosses: bool,
    /// Time until the outlines touch if both go on as they do, s; `None` if they do not within 4 s.
    pub meeting_s: Option<f64>,
}

impl Encounter {
    /// How a road user seen now stands to an ego vehicle whose front is at `front_m` of the route. `None` if
    /// the ego vehicle is past it. Values that need earlier looks (`other_mps2`, `aside_m`) are left at 0.
    pub(super) fn seen(
        guide: &Guide,
        object: &SensedObject,
        front_m: f64,
        own_mps: f64,
        own_mps2: f64,
    ) -> Option<Encounter> {
        let car = VehicleParameters::MKZ;
        let reach_m = 10.0 + HORIZON_S * (own_mps + object.velocity_mps.norm());
        let (from_m, to_m) = (front_m - car.length_m - 10.0, front_m + guide.range_m() + 10.0);
        let forward = unit_vector(object.pose.heading_rad);
        let size = (object.length_m, object.width_m);
        let beside_m = (object.length_m + object.width_m + car.width_m) / 2.0;
        let beside = guide.project(object.pose.position, from_m, to_m);
        let mut tracer = guide.trace(object.pose.position, from_m, to_m, beside_m);
        let (along_m, across_m) = extent_m(forward, beside.forward, size);
        if beside.station_m + along_m / 2.0 < front_m - car.length_m {
            return None;
        }
        let left_mps = beside.forward.x * object.velocity_mps.y - beside.forward.y * object.velocity_mps.x;
        let other_mps = object.velocity_mps.dot(&beside.forward);
        let meeting_s = if object.distance_m > reach_m {
            None
        } else {
            (0..=(HORIZON_S / STEP_S) as usize).map(|step| step as f64 * STEP_S).find(|&time_s| {
                let position = guide.expected(object, &beside, time_s);
                let Some(then) = tracer.next(position) else { return false };
                let (along_m, across_m) = extent_m(forward, then.forward, size);
                let ego_front_m = front_m + own_mps * time_s;
                then.offset_m.abs() <= (across_m + car.width_m) / 2.0
                    && then.station_m - along_m / 2.0 <= ego_front_m
                    && then.station_m + along_m / 2.0 >= ego_front_m - car.length_m
            })
        };
        Some(Encounter {
            gap_m: beside.station_m - along_m / 2.0 - front_m,
            side_gap_m: beside.offset_m.abs() - (across_m + car.width_m) / 2.0,
            towards_mps: if beside.offset_m >= 0.0 { -left_mps } else { left_mps },
            own_mps,
            own_mps2,
            other_mps,
            other_mps2: 0.0,
            aside_m: 0.0,
            lengths_m: along_m + car.length_m,
            crosses: other_mps.abs() < CROSSING_PART * object.velocity_mps.norm(),
            meeting_s,
        })
    }

    /// Speed at which the gap along the way closes, m/s.
    pub fn closing_mps(&self) -> f64 {
        self.own_mps - self.other_mps
    }

    /// Time to collision along the way, s; infinite if the gap does not close.
    pub fn time_to_collision_s(&self) -> f64 {
        if self.closing_mps() > 0.0 { self.gap_m.max(0.0) / self.closing_mps() } else { f64::INFINITY }
    }

    /// Time headway, s; infinite at rest.
    pub fn headway_s(&self) -> f64 {
        if self.own_mps > 0.0 { self.gap_m.max(0.0) / self.own_mps } else { f64::INFINITY }
    }

    /// Whether the models' gap along the way says nothing, because the other is beside or behind the front.
    pub fn is_beside(&self) -> bool {
        self.gap_m + self.lengths_m / 2.0 < 0.0
    }
}
