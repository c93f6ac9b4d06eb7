//! The acceleration towards an allowed speed, at rest, and at the limit of the brakes.

use avastra_base::kinematics::STANDING_MPS;
use avastra_world::sim::VehicleParameters;

/// Time in which a speed error is to vanish, s. Ours: a falling limit is followed as closely as it falls.
const ERROR_S: f64 = 0.6;
/// The allowed speed is read this far ahead, s. Ours: as far as an error takes to vanish.
pub const PREVIEW_S: f64 = ERROR_S;
/// Braking that holds the vehicle at rest, magnitude, m/s². Apollo `standstill_acceleration`: -3.0.
pub const HOLD_MPS2: f64 = 3.0;
/// Hardest braking, magnitude, m/s²: the vehicle's limit.
pub const HARDEST_MPS2: f64 = VehicleParameters::MKZ.deceleration_mps2_max;

/// The acceleration that makes a speed the wanted one in time, m/s², without bound.
#[inline]
pub fn speed_mps2(speed_mps: f64, wanted_mps: f64) -> f64 {
    (wanted_mps - speed_mps) / ERROR_S
}

/// The wanted acceleration (m/s²), or the brake that holds a standing vehicle for which no more than `start_mps2` is
/// wanted.
pub fn held_mps2(speed_mps: f64, wanted_mps2: f64, start_mps2: f64) -> f64 {
    if speed_mps < STANDING_MPS && wanted_mps2 <= start_mps2 { -HOLD_MPS2 } else { wanted_mps2 }
}
