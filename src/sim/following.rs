//! The gap of the Intelligent Driver Model (Treiber, Hennecke and Helbing 2000).
//!
//! Other drivers, the speed law of the modular driving system and the reference driver differ in their
//! parameters and in what they do beyond comfort, each with its reason in its file; the wanted gap is
//! the model's in all three.

use crate::geometry::larger;

/// How a driver follows a leader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Following {
    /// Gap at standstill, m.
    pub gap_m_min: f64,
    pub time_gap_s: f64,
    /// The model's own acceleration, m/s².
    pub acceleration_mps2: f64,
    /// Comfortable braking, magnitude, m/s².
    pub comfortable_mps2: f64,
}

impl Following {
    /// Wanted gap behind a leader, m: `s*` of the model, at least the gap at standstill.
    pub fn wanted_gap_m(&self, speed_mps: f64, leader_mps: f64) -> f64 {
        let gentle_mps2 = (self.acceleration_mps2 * self.comfortable_mps2).sqrt();
        let approach_m = speed_mps * (speed_mps - leader_mps) / (2.0 * gentle_mps2);
        self.gap_m_min + larger(speed_mps * self.time_gap_s + approach_m, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_has_three_parts() {
        let following =
            Following { gap_m_min: 2.0, time_gap_s: 1.5, acceleration_mps2: 1.0, comfortable_mps2: 4.0 };
        assert_eq!(following.wanted_gap_m(10.0, 10.0), 17.0);
        assert_eq!(following.wanted_gap_m(10.0, 6.0), 27.0);
        assert_eq!(following.wanted_gap_m(10.0, 30.0), 2.0);
    }
}
