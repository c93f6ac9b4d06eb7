//! The steering law of Stanley: Hoffmann, Tomlin, Montemerlo and Thrun 2007, equation 9.
//!
//! The wheels point along the path at the front axle, and further towards it the farther it is away. Left out
//! are the terms for slip and for the yaw of soft tyres, which the ego vehicle's model does not have.

use crate::kit::Guide;
use avastra_base::geometry::wrap_angle;
use avastra_world::sim::{EgoMotion, VehicleParameters};

/// Gain of the distance to the path, 1/s. Ours; the paper tunes it to the car.
const GAIN_PER_S: f64 = 1.0;
/// Softens that gain at low speed, m/s. Paper: a tuned constant; 1 is ours.
const SOFT_MPS: f64 = 1.0;
/// The bend is read this far ahead, s, in place of the paper's damping by the measured steering: both make up
/// for the lag of the steering. Ours.
const PREVIEW_S: f64 = 0.2;
/// Below this speed the wheel is not moved, m/s.
const LOCK_MPS: f64 = 0.1;

/// Wanted angle of the road wheels, rad, of a vehicle whose rear axle is near a station.
pub fn steer_rad(guide: &Guide, station_m: f64, ego: &EgoMotion) -> f64 {
    let car = VehicleParameters::MKZ;
    if ego.speed_mps < LOCK_MPS {
        return ego.steer_rad;
    }
    let front_axle = ego.rear_axle.offset(car.wheelbase_m, 0.0);
    let beside = guide.locate(front_axle.position, Some(station_m + car.wheelbase_m));
    let along_rad = wrap_angle(guide.pose_at(beside.station_m).heading_rad - ego.rear_axle.heading_rad);
    let ahead_m = beside.station_m + PREVIEW_S * ego.speed_mps;
    let soon_rad = car.wheelbase_m * (guide.curvature_at(ahead_m) - guide.curvature_at(beside.station_m));
    let towards_rad = libm::atan2(-GAIN_PER_S * beside.offset_m, SOFT_MPS + ego.speed_mps);
    (along_rad + soon_rad + towards_rad).clamp(-car.steer_rad_max, car.steer_rad_max)
}
