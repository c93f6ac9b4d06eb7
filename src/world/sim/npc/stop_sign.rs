//! Stop signs: a driver comes to rest before the line, then goes by right of way (`manners`). Yield signs need
//! no line: they decide who goes first where lanes cross (`junction`).

use crate::sim::body::BodyParameters;
use avastra_base::kinematics::STANDING_MPS;

use super::driver::{COMFORT_MPS2, Driver, GAP_M_MIN, LOOK_AHEAD_M};

/// A driver at rest with its front within this distance of the line has stopped at it, m: the gap at rest, and
/// half a car's length for the last metres of an approach.
const AT_LINE_M: f64 = GAP_M_MIN + 2.0;

impl Driver {
    /// Gap from the front to the stop sign's line at which it still has to stop, m.
    ///
    /// A driver that can no longer stop before a line passes it, as at a red light.
    pub(super) fn sign_gap_m(&self, size: &BodyParameters, braking_mps2: f64) -> Option<f64> {
        let front_m = self.station_m + size.length_m / 2.0;
        let from_m = front_m.max(self.stopped_to_m);
        let line_m = *self.way.stop_signs_m.iter().find(|line_m| **line_m > from_m)?;
        let gap_m = line_m - front_m;
        let energy_m2ps2 = self.speed_mps * self.speed_mps / 2.0;
        let matters = gap_m <= LOOK_AHEAD_M + energy_m2ps2 / COMFORT_MPS2;
        (matters && gap_m * braking_mps2 > energy_m2ps2).then_some(gap_m)
    }

    /// Notes that it stands at the line of a stop sign.
    pub(super) fn note_stop(&mut self, size: &BodyParameters) {
        if self.speed_mps >= STANDING_MPS {
            return;
        }
        let front_m = self.station_m + size.length_m / 2.0;
        let at_line = front_m..front_m + AT_LINE_M;
        if let Some(line_m) = self.way.stop_signs_m.iter().find(|line_m| at_line.contains(line_m)) {
            self.stopped_to_m = self.stopped_to_m.max(*line_m);
        }
    }
}
