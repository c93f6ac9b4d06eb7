//! Where the ego vehicle believes to be: the truth, a little late and a little beside.
//!
//! RTK and LiDAR map matching leave an error that is correlated over seconds (multipath, a map a few
//! centimetres off): an Ornstein–Uhlenbeck process per axis. Its white part is small, and a Kalman
//! filter removes only that, so none is modelled and none is run: the process is the error that
//! remains after fusion.

use crate::geometry::Pose;
use crate::geometry::Vec2;
use crate::geometry::unit_vector;
use crate::geometry::wrap_angle;
use crate::rng;
use crate::rng::Rng;
use crate::rng::Stream;
use crate::sim::DT_S;
use crate::sim::Sensed;

use super::config::LocalizationConfig;

/// Rain at which the full factor holds, mm/h, and water on the road, mm.
const RAIN_HIGH_MMPH: f64 = 50.0;
const WATER_HIGH_MM: f64 = 1.5;

#[derive(Debug, Clone)]
pub struct Localization {
    config: LocalizationConfig,
    rng: Rng,
    /// Errors in units of their standard deviation: x, y, heading.
    errors: [f64; 3],
    /// Part of an error that survives a tick, and the size of the draw that replaces the rest.
    keep: f64,
    renew: f64,
}

impl Localization {
    pub fn new(config: &LocalizationConfig, seed: u64) -> Localization {
        let mut rng = rng::stream(seed, Stream::Localization, 0);
        let errors = core::array::from_fn(|_| rng::normal(&mut rng));
        let keep = libm::exp(-DT_S / config.correlation_s);
        Localization { config: *config, rng, errors, keep, renew: (1.0 - keep * keep).sqrt() }
    }

    /// Pose of the rear axle as believed now.
    pub fn locate(&mut self, sensed: &Sensed) -> Pose {
        for error in &mut self.errors {
            *error = *error * self.keep + self.renew * rng::normal(&mut self.rng);
        }
        let conditions = &sensed.conditions;
        let weather =
            (conditions.rain_mmph / RAIN_HIGH_MMPH).max(conditions.water_mm / WATER_HIGH_MM).clamp(0.0, 1.0);
        let factor = 1.0 + (self.config.rain_factor - 1.0) * weather;
        let truth = &sensed.ego.rear_axle;
        let late_m = sensed.ego.speed_mps * self.config.latency_s;
        let late_rad = sensed.ego.yaw_rate_radps * self.config.latency_s;
        let beside = Vec2::new(self.errors[0], self.errors[1]) * (self.config.position_sigma_m * factor);
        Pose {
            position: truth.position - unit_vector(truth.heading_rad) * late_m + beside,
            heading_rad: wrap_angle(
                truth.heading_rad - late_rad + self.errors[2] * self.config.heading_sigma_rad * factor,
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ads::testing::CLEAR_DAY;
    use crate::sim::Conditions;
    use crate::sim::EgoMotion;

    /// Root mean square of the error across the way at rest, m.
    fn spread_m(conditions: Conditions) -> f64 {
        let ego = EgoMotion {
            rear_axle: Pose::new(3.0, 4.0, 0.0),
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            steer_rad: 0.0,
        };
        let sensed = Sensed { time_s: 0.0, ego, objects: vec![], signals: vec![], conditions };
        let mut localization = Localization::new(&LocalizationConfig::default(), 1);
        let count = 200_000;
        let sum: f64 = (0..count)
            .map(|_| {
                let error_m = localization.locate(&sensed).position.y - 4.0;
                error_m * error_m
            })
            .sum();
        (sum / f64::from(count)).sqrt()
    }

    #[test]
    fn the_error_has_the_configured_size_and_grows_in_rain() {
        let clear_m = spread_m(CLEAR_DAY);
        assert!((clear_m - 0.04).abs() < 0.005, "{clear_m}");
        let rain_m = spread_m(Conditions { rain_mmph: 50.0, ..CLEAR_DAY });
        assert!((rain_m / clear_m - 3.0).abs() < 1e-9, "{rain_m}");
    }
}
