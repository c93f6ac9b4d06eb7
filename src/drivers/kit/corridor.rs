//! The corridor that the vehicle needs, and the road users in it or in the same strip of a lane beside it.

use avastra_base::geometry::{Beside, Span, unit_vector};
use avastra_world::sim::{SensedObject, VehicleParameters};

use super::guide::Guide;

/// Room on each side of the vehicle, m. Ours: a vehicle that enters a lane of 3.5 m by 0.3 m, which UN R157 calls a
/// cut-in, is in the corridor.
const SIDE_M: f64 = 0.4;
/// Half the width of the corridor, m.
pub const HALF_WAY_M: f64 = VehicleParameters::MKZ.width_m / 2.0 + SIDE_M;
/// A road user whose middle is farther behind the front bumper is beside the vehicle or past it, m. Ours.
pub const BESIDE_M: f64 = 1.0;
/// The reason for keeping away from a slower road user ahead is called a stop, not following, m/s. Ours.
pub const FOLLOWED_MPS: f64 = 0.5;

/// The stations that a road user takes of the corridor in the lane `lateral_m` to the left of a guide, and the road
/// user's speed along them, m/s. `front_m` is the station of the vehicle's front.
pub fn in_lane(guide: &Guide, object: &SensedObject, lateral_m: f64, front_m: f64) -> Option<(Span, f64)> {
    let rear_m = front_m - VehicleParameters::MKZ.length_m;
    let at = guide.project(object.pose.position, rear_m - guide.range_m(), front_m + guide.range_m());
    let in_lane = Beside { offset_m: at.offset_m - lateral_m, ..at };
    let forward = unit_vector(object.pose.heading_rad);
    let span = in_lane.taken(forward, object.length_m, object.width_m, HALF_WAY_M)?;
    Some((span, object.velocity_mps.dot(&at.forward)))
}
