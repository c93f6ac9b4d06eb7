//! How much room a vehicle needs in order to stop, and how much there is.

use avastra_base::kinematics::{SPEEDING_MPS, stopping_m};

use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::view::around::Around;

/// Harder braking than this, after [`REACTION_S`], is abrupt, m/s². UN R79, 5.6.4.7: a lane change that makes an
/// approaching vehicle brake harder is critical.
pub const ABRUPT_MPS2: f64 = 3.0;
/// Time until the other vehicle begins to brake, s (UN R79, 5.6.4.7).
pub const REACTION_S: f64 = 0.4;
/// A conflict area farther away than this from either vehicle is not looked at yet, m.
pub const APPROACH_M: f64 = 80.0;

/// The speed from which the ego vehicle's way to stop is reckoned, m/s: its own, or what is allowed. Others need not
/// leave more time to a speeding vehicle.
pub fn allowed_mps(own_mps: f64, around: &Around) -> f64 {
    let lane = around.scene.route.lane_at(around.ego_station_m).lane;
    let limit_mps = around.scene.map.lane(lane).speed_limit_mps;
    if own_mps > limit_mps + SPEEDING_MPS { limit_mps } else { own_mps }
}

/// Whether a vehicle that begins to brake after [`REACTION_S`] is at rest within a distance.
pub fn can_stop(speed_mps: f64, room_m: f64, braking_mps2: f64) -> bool {
    stopping_m(speed_mps, REACTION_S, braking_mps2) <= room_m
}

/// Distance from the ego vehicle's front to an obstacle across the strip that it drives on, m; `None` if the obstacle
/// lies beside or behind.
pub fn room_before_m(this: &Obstacle, around: &Around) -> Option<f64> {
    let path = &around.scene.route.path;
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let mut beside = path.project_from(this.outline.pose.position, front_m)?;
    beside.offset_m -= path.project_from(around.ego_outline.pose.position, around.ego_station_m)?.offset_m;
    let (length_m, width_m) = (2.0 * this.outline.half_length_m, 2.0 * this.outline.half_width_m);
    let taken = beside.taken(this.forward, length_m, width_m, around.ego_outline.half_width_m)?;
    (taken.to_m > front_m).then_some(taken.from_m - front_m)
}
