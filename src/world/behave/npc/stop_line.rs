//! Stop lines: where a driver has to stop for a red or yellow light, or at a stop sign. At a sign it comes to rest
//! before the line, then goes by right of way (`manners`). Yield signs need no line: they decide who goes first where
//! lanes cross (`junction`).

use crate::behave::npc::figures::{COMFORT_MPS2, GAP_M_MIN, LOOK_AHEAD_M};
use crate::state::driver::Driver;
use crate::state::sensed::SignalColour;
use crate::view::around::Around;
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::body::BodyParameters;

/// A driver passes a yellow light that would need harder braking than this, m/s².
const YELLOW_BRAKING_MPS2: f64 = 3.0;
/// A driver at rest with its front within this distance of the line of a sign has stopped at it, m. It is the gap at
/// rest, and half a car's length for the last metres of an approach.
const AT_LINE_M: f64 = GAP_M_MIN + 2.0;

impl Driver {
    /// Gap from the front to the stop line of a light at which it has to stop now, m.
    pub fn stop_gap_m(&self, size: &BodyParameters, around: &Around, braking_mps2: f64) -> Option<f64> {
        if self.passes_signals() {
            return None;
        }
        let front_m = self.station_m + size.length_m / 2.0;
        let line = self.way.stop_lines.iter().find(|line| line.station_m > front_m)?;
        let colour = || around.colours[line.signal];
        self.stops_within_m(line.station_m - front_m, || match colour() {
            SignalColour::Green => None,
            SignalColour::Yellow => Some(YELLOW_BRAKING_MPS2),
            SignalColour::Red => Some(braking_mps2),
        })
    }

    /// Gap from the front to the stop sign's line at which it still has to stop, m.
    pub fn sign_gap_m(&self, size: &BodyParameters, braking_mps2: f64) -> Option<f64> {
        if self.way.stop_signs_m.is_empty() || self.passes_signals() {
            return None;
        }
        let front_m = self.station_m + size.length_m / 2.0;
        let from_m = front_m.max(self.stopped_to_m);
        let line_m = *self.way.stop_signs_m.iter().find(|line_m| **line_m > from_m)?;
        self.stops_within_m(line_m - front_m, || Some(braking_mps2))
    }

    /// The gap to a line, if the driver looks as far ahead and can stop before the line. A driver that can no longer
    /// stop passes the line: it does not stop behind it either. `braking_mps2` is asked for a line that matters alone, and is
    /// `None` if it may be passed.
    fn stops_within_m(&self, gap_m: f64, braking_mps2: impl FnOnce() -> Option<f64>) -> Option<f64> {
        let energy_m2ps2 = self.speed_mps * self.speed_mps / 2.0;
        let matters = gap_m <= LOOK_AHEAD_M + energy_m2ps2 / COMFORT_MPS2;
        (matters && gap_m * braking_mps2()? > energy_m2ps2).then_some(gap_m)
    }

    /// Notes that it stands at the line of a stop sign.
    pub fn note_stop(&mut self, size: &BodyParameters) {
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
