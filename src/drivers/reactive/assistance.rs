//! Adaptive cruise control, emergency braking and lane change assistance.
//!
//! | function | specification | what is taken from it |
//! |---|---|---|
//! | cruise control | ISO 15622:2018, full speed range | time gap, limits of braking, jerk and acceleration by speed |
//! | its law | Rajamani, Vehicle Dynamics and Control, constant time gap | acceleration from gap and speeds |
//! | emergency braking | UN R152 | speed range for cars and for pedestrians, braking of 5 m/s² or more |
//! | lane change | ISO 17387:2008, type III | zone beside and behind, time to collision of vehicles from behind |
//!
//! The standards state what a system must reach at least; this one reaches that and no more. Left out: warnings
//! and the override by a driver. Unlike many sold systems it reacts to vehicles, too, that it never saw move.

use crate::kit::{BESIDE_M, FOLLOWED_MPS, Guide, HALF_WAY_M, HARDEST_MPS2, in_lane, speed_mps2};
use crate::status::Reason;
use avastra_base::geometry::{Beside, extent_m, unit_vector};
use avastra_base::kinematics::needed_mps2;
use avastra_world::sim::{DT_S, EgoMotion, SensedObject, VehicleParameters};

/// Time gap, s: ISO 15622 asks for one setting of 1.5 to 2.2.
const TIME_GAP_S: f64 = 1.5;
/// Gap at standstill, m. Ours; sold systems keep 2 to 5.
const GAP_M_MIN: f64 = 2.0;
/// How fast an error of the gap is made up for, 1/s. Ours; the law is stable for every positive value.
const GAP_GAIN_PER_S: f64 = 0.4;
/// Speeds between which ISO 15622 changes its limits, m/s; braking (m/s²) and its jerk (m/s³) at both.
const LIMIT_MPS: (f64, f64) = (5.0, 20.0);
const BRAKING_MPS2: (f64, f64) = (5.0, 3.5);
const JERK_MPS3: (f64, f64) = (5.0, 2.5);

/// Gain from the error of the speed to the acceleration, 1/s, and its bound, m/s². Ours; ISO 15622 allows more.
const CRUISE_GAIN_PER_S: f64 = 0.5;
const ACCELERATION_MPS2: f64 = 2.0;
/// Gap to a stop line, m, and the braking from which on one is braked for, m/s². Ours; the standards of cruise
/// control know no lights.
const LINE_GAP_M: f64 = 1.0;
const LINE_MPS2: f64 = 2.0;

/// Speeds from which emergency braking acts, m/s: UN R152 (5.2.1.3, 5.2.2.3), 10 km/h for cars and 20 km/h for pedestrians.
const EMERGENCY_VEHICLE_MPS: f64 = 10.0 / 3.6;
const EMERGENCY_PEDESTRIAN_MPS: f64 = 20.0 / 3.6;
/// And up to which, m/s: UN R152, 60 km/h.
const EMERGENCY_MPS_MAX: f64 = 60.0 / 3.6;
/// It brakes as hard as the vehicle can (UN R152 asks for 5 m/s²), and begins this long before the last moment at which
/// that suffices, s: the brakes build up for 0.15 s, and a look is up to 0.1 s old. Ours.
const BUILD_UP_S: f64 = 0.3;

/// A road user that enters the corridor within this time counts as in it, s. Ours.
const ENTER_S: f64 = 1.0;
/// Slower sideways than this, nothing enters, m/s. Ours: drivers wander at up to 0.3.
const SIDEWAYS_MPS: f64 = 0.4;
/// Half the field of view of the front camera: 50°, a usual figure of data sheets, as cosine.
const FIELD_COSINE: f64 = 0.642_787_609_686_539_4;
/// The camera looks through the windscreen, this far behind the front bumper, m. Ours.
const CAMERA_M: f64 = 1.8;

/// Zone behind the rear bumper in which no vehicle may be in the lane to change to, m (ISO 17387).
const ZONE_M: f64 = 3.0;
/// Times to collision that a vehicle coming from behind in that lane must leave, s, by its closing speed, m/s
/// (ISO 17387: types A, B and C).
const CLOSING_S: [(f64, f64); 3] = [(10.0, 2.5), (15.0, 3.0), (f64::INFINITY, 3.5)];
/// Least time gap to a vehicle ahead in that lane, s (ISO 15622).
const TIME_GAP_S_MIN: f64 = 0.8;

/// Something to keep away from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    id: u32,
    /// From the front bumper, m.
    pub gap_m: f64,
    /// Its speed along the way, m/s; negative towards the vehicle.
    pub along_mps: f64,
    /// Time until it is in the corridor, s.
    pub enters_s: f64,
    pub on_foot: bool,
    pub reason: Reason,
}

impl Target {
    /// A road user, if it is in the corridor or enters it.
    pub fn seen(guide: &Guide, object: &SensedObject, ego: &EgoMotion, front_m: f64) -> Option<Target> {
        let car = VehicleParameters::MKZ;
        let eye = ego.rear_axle.offset(car.rear_axle_to_front_m - CAMERA_M, 0.0);
        let towards = object.pose.position - eye.position;
        if eye.forward().dot(&towards) < FIELD_COSINE * towards.norm() - object.length_m / 2.0 {
            return None;
        }
        let size = (object.length_m, object.width_m);
        let beside = guide.project(object.pose.position, front_m - BESIDE_M, front_m + guide.range_m());
        let forward = unit_vector(object.pose.heading_rad);
        let taken = |beside: &Beside| beside.taken(forward, size.0, size.1, HALF_WAY_M);
        let (enters_s, span) = match taken(&beside) {
            Some(span) => (0.0, span),
            None => {
                let sideways_mps = -beside.forward.perp(&object.velocity_mps) * beside.offset_m.signum();
                let (_, across_m) = extent_m(forward, beside.forward, size);
                let enters_s = (beside.offset_m.abs() - across_m / 2.0 - HALF_WAY_M) / sideways_mps;
                if sideways_mps < SIDEWAYS_MPS || enters_s > ENTER_S {
                    return None;
                }
                (enters_s, taken(&Beside { offset_m: 0.0, ..beside })?)
            }
        };
        if span.middle_m() < front_m - BESIDE_M {
            return None;
        }
        let along_mps = object.velocity_mps.dot(&beside.forward);
        let reason = match (enters_s > 0.0, along_mps >= FOLLOWED_MPS) {
            (true, _) => Reason::Yield(object.id),
            (false, true) => Reason::Follow(object.id),
            (false, false) => Reason::Stop(object.id),
        };
        let on_foot = !object.body.is_vehicle();
        Some(Target { id: object.id, gap_m: span.from_m - front_m, along_mps, enters_s, on_foot, reason })
    }

    /// Whether emergency braking must begin now: it is the last moment at which it suffices.
    fn is_urgent(&self, speed_mps: f64) -> bool {
        let from_mps = if self.on_foot { EMERGENCY_PEDESTRIAN_MPS } else { EMERGENCY_VEHICLE_MPS };
        let closing_mps = speed_mps - self.along_mps;
        let collision_s = self.gap_m.max(0.0) / closing_mps;
        (from_mps..=EMERGENCY_MPS_MAX).contains(&speed_mps)
            && closing_mps > 0.0
            && collision_s <= closing_mps / (2.0 * HARDEST_MPS2) + BUILD_UP_S
            && self.enters_s <= collision_s
    }
}

/// The pedals' assistants.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pedals {
    /// The last command of the cruise control, m/s².
    last_mps2: f64,
    /// The road user for which emergency braking is under way.
    emergency: Option<u32>,
}

impl Pedals {
    /// The acceleration for the next tick, m/s², and its reason.
    pub fn step(&mut self, speed_mps: f64, allowed_mps: f64, targets: &[Target]) -> (f64, Reason) {
        let mut wanted = (cruise_mps2(speed_mps, allowed_mps), Reason::Cruise);
        for target in targets {
            let target_mps2 = gap_mps2(speed_mps, target);
            if target_mps2 < wanted.0 {
                wanted = (target_mps2, target.reason);
            }
        }
        let bound_mps2 = by_speed(BRAKING_MPS2, speed_mps);
        wanted.0 =
            wanted.0.max(-bound_mps2).max(self.last_mps2.min(0.0) - by_speed(JERK_MPS3, speed_mps) * DT_S);
        self.last_mps2 = wanted.0;
        // Once begun, it goes on until the gap no longer closes.
        let urgent = targets.iter().find(|target| {
            let closes = speed_mps > target.along_mps.max(0.0);
            target.is_urgent(speed_mps) || self.emergency == Some(target.id) && closes
        });
        self.emergency = urgent.map(|target| target.id);
        self.emergency.map_or(wanted, |id| (-HARDEST_MPS2, Reason::Emergency(id)))
    }
}

/// The acceleration towards an allowed speed, m/s².
fn cruise_mps2(speed_mps: f64, allowed_mps: f64) -> f64 {
    let gain_mps = allowed_mps - speed_mps;
    if gain_mps < 0.0 {
        speed_mps2(speed_mps, allowed_mps)
    } else {
        (CRUISE_GAIN_PER_S * gain_mps).min(ACCELERATION_MPS2)
    }
}

/// The acceleration that keeps the gap, m/s².
fn gap_mps2(speed_mps: f64, target: &Target) -> f64 {
    let error_m = target.gap_m - GAP_M_MIN - TIME_GAP_S * speed_mps;
    (target.along_mps - speed_mps + GAP_GAIN_PER_S * error_m) / TIME_GAP_S
}

/// The braking that stops at a line, m/s²; none while a gentler one will do.
pub fn line_mps2(speed_mps: f64, distance_m: f64) -> Option<f64> {
    let needed_mps2 = needed_mps2(speed_mps, (distance_m - LINE_GAP_M).max(0.05));
    (needed_mps2 >= LINE_MPS2 || distance_m < LINE_GAP_M).then_some(-needed_mps2)
}

/// A limit of ISO 15622 at a speed.
fn by_speed((slow, fast): (f64, f64), speed_mps: f64) -> f64 {
    let part = ((speed_mps - LIMIT_MPS.0) / (LIMIT_MPS.1 - LIMIT_MPS.0)).clamp(0.0, 1.0);
    slow + (fast - slow) * part
}

/// Whether the lane `lateral_m` to the left is free for a change: no vehicle beside, none too fast from behind,
/// and a time gap to the one ahead.
pub fn is_free(guide: &Guide, known: &[SensedObject], lateral_m: f64, front_m: f64, speed_mps: f64) -> bool {
    let rear_m = front_m - VehicleParameters::MKZ.length_m;
    known.iter().all(|object| {
        let Some((span, along_mps)) = in_lane(guide, object, lateral_m, front_m) else { return true };
        if span.from_m > front_m {
            let closing_mps = (speed_mps - along_mps).max(0.0);
            return span.from_m - front_m > GAP_M_MIN + TIME_GAP_S_MIN * speed_mps.max(closing_mps);
        }
        let closing_mps = along_mps - speed_mps;
        let gap_m = rear_m - span.to_m;
        let needed_s =
            CLOSING_S.iter().find(|(up_to_mps, _)| closing_mps <= *up_to_mps).map_or(0.0, |row| row.1);
        gap_m > ZONE_M && gap_m >= closing_mps * needed_s
    })
}
