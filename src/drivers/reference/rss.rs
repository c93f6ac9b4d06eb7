//! Responsibility-sensitive safety as a driver: brakes whenever both distances are unsafe.
//!
//! Shalev-Shwartz, Shammah, Shashua 2017 (arXiv 1708.06374), definitions 1, 2 and 6, with the
//! parameters that the R157 studies of the JRC use. The driver keeps its lane, so its own part of the
//! lateral distance is nil. A road user that crosses the way has a small speed along it and an unsafe
//! lateral distance: the published rule covers it as it stands.

use avastra_base::kinematics::{CAREFUL_JERK_MPS3, CAREFUL_REACTION_S, braking_m};

use super::driver::Model;
use super::encounter::Encounter;
use super::reflex::Braking;

/// Parameters of the safe distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rss {
    /// Response time ρ, s.
    pub response_s: f64,
    /// Acceleration during the response, m/s².
    pub acceleration_mps2: f64,
    /// Braking that the vehicle behind is sure to reach, m/s².
    pub braking_mps2_min: f64,
    /// Hardest braking of the vehicle ahead, m/s².
    pub braking_mps2_max: f64,
    /// Lateral acceleration and braking, m/s².
    pub lateral_mps2: f64,
    /// μ: lateral wander, m.
    pub wander_m: f64,
}

impl Default for Rss {
    fn default() -> Rss {
        Rss {
            response_s: CAREFUL_REACTION_S,
            acceleration_mps2: 3.0,
            braking_mps2_min: 6.0,
            braking_mps2_max: 6.0,
            lateral_mps2: 1.0,
            wander_m: 0.3,
        }
    }
}

impl Rss {
    /// Safe gap behind a vehicle of the same direction, m.
    pub fn longitudinal_m(&self, rear_mps: f64, front_mps: f64) -> f64 {
        (self.stopping_m(rear_mps, self.braking_mps2_min) - braking_m(front_mps, self.braking_mps2_max))
            .max(0.0)
    }

    /// Safe gap to a vehicle that comes towards at `towards_mps`, m: both respond and brake.
    pub fn oncoming_m(&self, own_mps: f64, towards_mps: f64) -> f64 {
        self.stopping_m(own_mps, self.braking_mps2_min) + self.stopping_m(towards_mps, self.braking_mps2_min)
    }

    /// Safe gap to the side to a road user that comes nearer at `towards_mps`, m.
    pub fn lateral_m(&self, towards_mps: f64) -> f64 {
        let speed_mps = towards_mps.max(0.0);
        let after_mps = speed_mps + self.response_s * self.lateral_mps2;
        self.wander_m
            + (speed_mps + after_mps) * self.response_s / 2.0
            + braking_m(after_mps, self.lateral_mps2)
    }

    /// Way to rest of a vehicle that accelerates during the response, m.
    fn stopping_m(&self, speed_mps: f64, braking_mps2: f64) -> f64 {
        let after_mps = speed_mps + self.response_s * self.acceleration_mps2;
        speed_mps * self.response_s
            + self.acceleration_mps2 * self.response_s * self.response_s / 2.0
            + braking_m(after_mps, braking_mps2)
    }
}

impl Model for Rss {
    fn braking(&self) -> Braking {
        Braking {
            evaluation_s: 0.0,
            reaction_s: self.response_s,
            release_mps2: 0.0,
            jerk_mps3: CAREFUL_JERK_MPS3,
            deceleration_mps2_max: self.braking_mps2_min,
        }
    }

    fn demand_mps2(&self, encounter: &Encounter) -> f64 {
        let safe_m = if encounter.other_mps >= 0.0 {
            self.longitudinal_m(encounter.own_mps, encounter.other_mps)
        } else {
            self.oncoming_m(encounter.own_mps, -encounter.other_mps)
        };
        let is_unsafe = !encounter.is_beside()
            && encounter.gap_m < safe_m
            && encounter.side_gap_m < self.lateral_m(encounter.towards_mps);
        if is_unsafe { self.braking_mps2_min } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_the_published_ones() {
        // The defaults of Intel's library, whose results these are to the centimetre.
        let intel = Rss {
            response_s: 1.0,
            acceleration_mps2: 3.5,
            braking_mps2_min: 4.0,
            braking_mps2_max: 8.0,
            lateral_mps2: 0.2,
            wander_m: 0.1,
        };
        for (rear_mps, front_mps, expected_m) in
            [(14.0, 12.0, 45.03), (14.0, 0.0, 54.03), (20.0, 20.0, 65.78)]
        {
            let found_m = intel.longitudinal_m(rear_mps, front_mps);
            assert!((found_m - expected_m).abs() < 0.005, "{rear_mps} {front_mps}: {found_m}");
        }
        assert_eq!(intel.longitudinal_m(0.0, 30.0), 0.0);
    }

    #[test]
    fn the_side_gap_grows_with_the_lateral_speed() {
        let rss = Rss::default();
        // μ + ρ²a/2 + (ρa)²/2a.
        assert!((rss.lateral_m(0.0) - (0.3 + 0.28125 + 0.28125)).abs() < 1e-12);
        assert!((rss.lateral_m(1.0) - (0.3 + 1.03125 + 1.53125)).abs() < 1e-12);
        assert_eq!(rss.lateral_m(-1.0), rss.lateral_m(0.0));
    }
}
