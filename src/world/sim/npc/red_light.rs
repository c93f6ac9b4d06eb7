//! Red and yellow lights: whether a driver has to stop at the next stop line.

use crate::sim::around::Around;
use crate::sim::body::BodyParameters;
use crate::sim::sense::SignalColour;

use super::driver::{COMFORT_MPS2, Driver, LOOK_AHEAD_M};

/// A driver passes a yellow light that would need harder braking than this, m/s².
const YELLOW_BRAKING_MPS2: f64 = 3.0;

impl Driver {
    /// Gap from the front to the stop line at which it has to stop now, m.
    ///
    /// A driver that can no longer stop before a line passes it: it does not stop behind it either.
    pub(super) fn stop_gap_m(
        &self,
        size: &BodyParameters,
        around: &Around,
        braking_mps2: f64,
    ) -> Option<f64> {
        let front_m = self.station_m + size.length_m / 2.0;
        let line = self.way.stop_lines.iter().find(|line| line.station_m > front_m)?;
        let gap_m = line.station_m - front_m;
        let energy_m2ps2 = self.speed_mps * self.speed_mps / 2.0;
        if gap_m > LOOK_AHEAD_M + energy_m2ps2 / COMFORT_MPS2 {
            return None;
        }
        let stops = match around.signals.colour(&around.scene.map, line.signal, around.tick) {
            SignalColour::Green => false,
            SignalColour::Yellow => gap_m * YELLOW_BRAKING_MPS2 > energy_m2ps2,
            SignalColour::Red => gap_m * braking_mps2 > energy_m2ps2,
        };
        stops.then_some(gap_m)
    }
}
