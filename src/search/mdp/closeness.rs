//! How close an obstacle came to the ego vehicle, as AV-Fuzzer measures it (Li et al., ISSRE 2020).
//!
//! The constants are those of its published code. D is the distance between centres, ΔD what would be left
//! of it after braking, both at most 130 m. AV-Fuzzer looks four times a second; this file looks every tick.

use avastra_base::geometry::wrap_angle;
use avastra_world::sim::World;

/// An obstacle that is farther away counts as this far away, m.
const FAR_M: f64 = 130.0;
/// Length of a car, m: an obstacle less than this ahead counts as beside the ego vehicle.
const CAR_M: f64 = 4.6;
/// An obstacle farther ahead than this needs no braking, m.
const AHEAD_M_MAX: f64 = 20.0;
/// An obstacle farther to the side than this needs no braking, m.
const ASIDE_M_MAX: f64 = 2.0;
/// The ego vehicle cuts in on a vehicle behind it if their headings differ by more than this, rad.
const CUT_IN_RAD: f64 = core::f64::consts::PI / 180.0;

/// The closest values over some time.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Closeness {
    /// Least distance between the centres of the ego vehicle and an obstacle, m.
    pub distance_m: f64,
    /// Least distance that is left after braking, m; negative if the way to brake is too short.
    pub margin_m: f64,
}

impl Default for Closeness {
    fn default() -> Closeness {
        Closeness { distance_m: FAR_M, margin_m: FAR_M }
    }
}

impl Closeness {
    /// Updates the values from the world of this moment.
    pub fn note(&mut self, world: &World) {
        let ego = world.ego_outline().pose;
        for obstacle in world.obstacles_on_level() {
            let other = obstacle.outline.pose;
            let distance_m = (other.position - ego.position).norm();
            self.distance_m = self.distance_m.min(distance_m);
            let place = ego.to_local(other.position);
            let back = other.to_local(ego.position);
            let is_ahead = (CAR_M..=AHEAD_M_MAX).contains(&place.x) && place.y.abs() <= ASIDE_M_MAX;
            let cuts_in = (CAR_M..=AHEAD_M_MAX).contains(&back.x)
                && back.y.abs() <= ASIDE_M_MAX
                && wrap_angle(ego.heading_rad - other.heading_rad).abs() > CUT_IN_RAD;
            let braking_m = if is_ahead {
                braking_m(world.ego().speed_mps)
            } else if cuts_in {
                braking_m(obstacle.velocity_mps.norm())
            } else {
                continue;
            };
            self.margin_m = self.margin_m.min(distance_m - CAR_M - braking_m);
        }
    }

    /// AV-Fuzzer's fitness: higher is closer, at least 0. AV-Fuzzer also divides by the number of other
    /// vehicles, which is constant over its scenarios.
    pub fn fitness(&self) -> f64 {
        (FAR_M - 0.5 * (self.distance_m + self.margin_m)).max(0.0)
    }
}

/// Braking distance (m) at a speed, as AV-Fuzzer has fitted it to its vehicle.
fn braking_m(speed_mps: f64) -> f64 {
    (0.0467 * speed_mps * speed_mps + 0.4116 * speed_mps - 1.9913 + 0.5).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closer_is_fitter() {
        assert_eq!(Closeness::default().fitness(), 0.0);
        let near = Closeness { distance_m: 10.0, margin_m: -2.0 };
        assert_eq!(near.fitness(), 126.0);
        assert!((braking_m(10.0) - 7.2947).abs() < 1e-9);
        assert_eq!(braking_m(0.0), 0.0);
    }
}
