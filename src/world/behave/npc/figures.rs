//! Figures of the driver model that several of its parts share.

use avastra_base::kinematics::Following;

/// IDM: comfortable deceleration, m/s². Ours.
pub const COMFORT_MPS2: f64 = 2.0;
/// IDM: gap at standstill, m: that of its authors.
pub const GAP_M_MIN: f64 = 2.0;
/// How far drivers look ahead beyond the way on which they could stop gently, m.
pub const LOOK_AHEAD_M: f64 = 25.0;
/// Room that drivers want free beside the outline, m.
pub const SIDE_ROOM_M: f64 = 0.2;

/// The driver model of a vehicle of this acceleration, m/s², that keeps this time gap, s.
pub fn following(acceleration_mps2: f64, time_gap_s: f64) -> Following {
    Following { gap_m_min: GAP_M_MIN, time_gap_s, acceleration_mps2, comfortable_mps2: COMFORT_MPS2 }
}
