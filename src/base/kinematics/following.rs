//! The Intelligent Driver Model (Treiber, Hennecke and Helbing 2000): the gap that it wants, and what a smaller one costs.
//!
//! Other drivers, predictions and driving systems differ in their parameters and in what they do beyond comfort, each
//! with its reason in its file. The terms here are the model's in all of them.

use crate::geometry::larger;

/// How a driver follows a leader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Following {
    /// Gap at standstill, m.
    pub gap_m_min: f64,
    /// Time gap, s.
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

    /// The wanted gap as a multiple of the real one, `s*/s`; a gap below 0.1 m counts as that.
    pub fn crowding(&self, speed_mps: f64, leader_mps: f64, gap_m: f64) -> f64 {
        self.wanted_gap_m(speed_mps, leader_mps) / larger(gap_m, 0.1)
    }

    /// The deceleration that a leader adds, m/s²: the model's interaction term `a (s*/s)²`.
    pub fn interaction_mps2(&self, speed_mps: f64, leader_mps: f64, gap_m: f64) -> f64 {
        let crowding = self.crowding(speed_mps, leader_mps, gap_m);
        self.acceleration_mps2 * crowding * crowding
    }

    /// Acceleration towards a wished speed (m/s, above 0) on a free road, m/s²: `a (1 - (v/v0)⁴)`.
    pub fn free_mps2(&self, speed_mps: f64, wish_mps: f64) -> f64 {
        let ratio = speed_mps / wish_mps;
        self.acceleration_mps2 * (1.0 - ratio * ratio * ratio * ratio)
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
        assert_eq!(following.interaction_mps2(10.0, 10.0, 8.5), 4.0);
        assert_eq!((following.free_mps2(10.0, 10.0), following.free_mps2(5.0, 10.0)), (0.0, 0.9375));
    }
}
