//! Where the ego vehicle believes it is: the truth, a little late and a little beside.
//!
//! RTK and LiDAR map matching leave an error that is correlated over seconds (multipath, a map a few
//! centimetres off): an Ornstein–Uhlenbeck process per axis. Its white part is small, and a Kalman
//! filter removes only that, so none is modelled and none is run: the process is the error that
//! remains after fusion. Its size depends on the surroundings, rain and water. Maps say nothing of
//! houses, so the sky counts as open inside junctions and as partly hidden in the streets between.

use avastra_base::geometry::{Pose, Vec2, wrap_angle};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_world::sim::{DT_S, Sensed};

use super::config::LocalizationConfig;

/// Rain, mm/h, or water on the road, mm, from which on the full factor holds.
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
    /// Factor of the position error that holds now; it changes no faster than the error itself.
    spread: Option<f64>,
}

impl Localization {
    pub fn new(config: &LocalizationConfig, seed: u64) -> Localization {
        let mut rng = rng::stream(seed, Stream::Localization, 0);
        let errors = core::array::from_fn(|_| rng::normal(&mut rng));
        let keep = libm::exp(-DT_S / config.correlation_s);
        Localization { config: *config, rng, errors, keep, renew: (1.0 - keep * keep).sqrt(), spread: None }
    }

    /// Pose of the rear axle as believed now. `in_street` says that the sky is not open.
    pub fn locate(&mut self, sensed: &Sensed, in_street: bool) -> Pose {
        for error in &mut self.errors {
            *error = *error * self.keep + self.renew * rng::normal(&mut self.rng);
        }
        let config = &self.config;
        let conditions = &sensed.conditions;
        let weather =
            (conditions.rain_mmph / RAIN_HIGH_MMPH).max(conditions.water_mm / WATER_HIGH_MM).clamp(0.0, 1.0);
        let in_rain = 1.0 + (config.rain_factor - 1.0) * weather;
        let wanted = in_rain * if in_street { config.street_factor } else { 1.0 };
        let before = self.spread.unwrap_or(wanted);
        let spread = before + (wanted - before) * (1.0 - self.keep);
        self.spread = Some(spread);
        let truth = &sensed.ego.rear_axle;
        let late_m = sensed.ego.speed_mps * config.latency_s;
        let late_rad = sensed.ego.yaw_rate_radps * config.latency_s;
        let beside = Vec2::new(self.errors[0], self.errors[1]) * (config.position_sigma_m * spread);
        let forward = truth.forward();
        let left = Vec2::new(-forward.y, forward.x);
        Pose {
            position: truth.position
                + forward * (config.bias_ahead_m - late_m)
                + left * config.bias_left_m
                + beside,
            heading_rad: wrap_angle(
                truth.heading_rad - late_rad + self.errors[2] * config.heading_sigma_rad * in_rain,
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::{ModularConfig, Module};
    use crate::testing;
    use crate::testing::CLEAR_DAY;
    use avastra_world::sim::Conditions;

    fn sensed(speed_mps: f64, conditions: Conditions) -> Sensed {
        let mut sensed = testing::sensed(Pose::new(3.0, 4.0, 0.0), speed_mps, vec![]);
        (sensed.ego.yaw_rate_radps, sensed.conditions) = (0.1, conditions);
        sensed
    }

    /// Root mean square of the error across the way at rest, m.
    fn spread_m(conditions: Conditions, in_street: bool) -> f64 {
        let sensed = sensed(0.0, conditions);
        let mut localization = Localization::new(&LocalizationConfig::default(), 1);
        let count = 200_000;
        let sum: f64 = (0..count)
            .map(|_| {
                let error_m = localization.locate(&sensed, in_street).position.y - 4.0;
                error_m * error_m
            })
            .sum();
        (sum / f64::from(count)).sqrt()
    }

    #[test]
    fn the_error_has_the_configured_size_and_grows_in_rain_and_in_streets() {
        let clear_m = spread_m(CLEAR_DAY, false);
        assert!((clear_m - 0.04).abs() < 0.005, "{clear_m}");
        let rain = Conditions { rain_mmph: 50.0, ..CLEAR_DAY };
        assert!((spread_m(rain, false) / clear_m - 2.25).abs() < 1e-9);
        assert!((spread_m(CLEAR_DAY, true) / clear_m - 1.5).abs() < 1e-9);
    }

    #[test]
    fn a_bias_is_constant_and_idealised_localisation_without_latency_is_the_truth() {
        let mut config = ModularConfig::default();
        config.localization.bias_left_m = 0.8;
        let sensed = sensed(10.0, CLEAR_DAY);
        let error_m = |config: &ModularConfig| {
            let mut localization = Localization::new(&config.localization, 1);
            let poses = (0..1000).map(|_| localization.locate(&sensed, true));
            poses.fold((f64::INFINITY, 0.0_f64), |(least, most), pose| {
                let off_m = (pose.position - sensed.ego.rear_axle.position).norm();
                (least.min(off_m), most.max(off_m))
            })
        };
        assert!(error_m(&config).0 > 0.5, "{:?}", error_m(&config));
        let ideal = config.idealised(Module::Localization);
        // Only its age is left, and that belongs to latency.
        assert!((error_m(&ideal).1 - 0.15).abs() < 1e-9, "{:?}", error_m(&ideal));
        assert!(error_m(&ideal.idealised(Module::Latency)).1 < 1e-9);
    }
}
