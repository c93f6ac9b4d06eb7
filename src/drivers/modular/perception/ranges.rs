//! How far the sensors reach in the weather and the light of the moment.
//!
//! Fog by Koschmieder's law, rain by Carbonneau's attenuation; LiDAR echoes fade on both ways, what a
//! camera sees fades once. Left out: radar (in Apollo it begins no track), spray, snow, and the low
//! sun, of whose azimuth the world knows nothing.

use avastra_world::sim::{Conditions, SensedObject};

use super::super::config::PerceptionConfig;

/// Rain that the settings call a downpour, mm/h.
pub const RAIN_HIGH_MMPH: f64 = 50.0;

/// Extinction at which 5 % of a contrast is left, times the distance (Koschmieder).
const OPTICAL_DEPTH: f64 = 2.996;

/// How far each sensor reaches, m.
#[derive(Debug, Clone, Copy)]
pub struct Ranges {
    lidar_vehicle_m: f64,
    lidar_pedestrian_m: f64,
    camera_vehicle_m: f64,
    /// Of vehicles without lights.
    camera_unlit_m: f64,
    camera_pedestrian_m: f64,
    camera_may_begin: bool,
}

impl Ranges {
    /// `limited` is the weakness `late_unstable_tracks`: the detector's grid ends before the LiDAR does.
    pub fn in_conditions(config: &PerceptionConfig, limited: bool, conditions: &Conditions) -> Ranges {
        let extinction_per_m = extinction_per_m(conditions);
        let dark = 1.0 - conditions.light.clamp(0.0, 1.0);
        let sight_m = OPTICAL_DEPTH / extinction_per_m;
        let lidar = |clear_m: f64, grid_m: f64| {
            let end_m = if limited { grid_m } else { f64::INFINITY };
            attenuated_m(clear_m, extinction_per_m).min(end_m) * config.range_factor
        };
        let camera = |clear_m: f64, night_factor: f64| {
            (clear_m * (1.0 - (1.0 - night_factor) * dark)).min(sight_m) * config.range_factor
        };
        Ranges {
            lidar_vehicle_m: lidar(config.lidar_vehicle_m, config.grid_m),
            lidar_pedestrian_m: lidar(config.lidar_pedestrian_m, config.small_m),
            camera_vehicle_m: camera(config.camera_vehicle_m, config.night_vehicle_factor),
            camera_unlit_m: camera(config.camera_vehicle_m, config.night_pedestrian_factor),
            camera_pedestrian_m: camera(config.camera_pedestrian_m, config.night_pedestrian_factor),
            camera_may_begin: conditions.light >= config.camera_alone_light,
        }
    }

    /// Chance that LiDAR and camera together detect an object in a frame, of which a part is in sight. `known` says
    /// that they did in the last one.
    pub fn detection_chance(&self, config: &PerceptionConfig, object: &SensedObject, known: bool) -> f64 {
        // Half of a surface gives as many returns as all of it from √2 times as far.
        let distance_m = object.distance_m / object.visible_fraction.sqrt();
        let (lidar_m, camera_m) = match object.body.is_vehicle() {
            true if object.is_unlit => (self.lidar_vehicle_m, self.camera_unlit_m),
            true => (self.lidar_vehicle_m, self.camera_vehicle_m),
            false => (self.lidar_pedestrian_m, self.camera_pedestrian_m),
        };
        let camera_begins = object.distance_m > config.camera_alone_m && self.camera_may_begin;
        let fused_m = lidar_m + config.camera_weight * (camera_m - lidar_m);
        // Beyond one range and a half the chance is below a thousandth: no need to work it out.
        if distance_m > 1.5 * fused_m.max(camera_m) {
            return 0.0;
        }
        let fused = in_range(distance_m, fused_m);
        let camera = if known || camera_begins { in_range(distance_m, camera_m) } else { 0.0 };
        let sparse = (distance_m / config.plenty_m.max(1e-3)).min(1.0);
        let misses = (1.0 - config.detection_chance_max) * sparse * sparse;
        (1.0 - misses) * fused.max(camera)
    }
}

/// Distances at which a pedestrian and a vehicle in plain view are detected in nearly every frame, m.
pub fn surely_seen_m(config: &PerceptionConfig, conditions: &Conditions) -> (f64, f64) {
    let ranges = Ranges::in_conditions(config, true, conditions);
    // Two widths of the fall of the chance before the place where it is one half.
    let surely_m = |lidar_m: f64, camera_m: f64| {
        (0.8 - 2.0 * 0.08) * (lidar_m + config.camera_weight * (camera_m - lidar_m))
    };
    (
        surely_m(ranges.lidar_pedestrian_m, ranges.camera_pedestrian_m),
        surely_m(ranges.lidar_vehicle_m, ranges.camera_vehicle_m),
    )
}

/// Distance at which something of full contrast is lost, m: the meteorological optical range, and less
/// in rain.
pub fn sight_m(conditions: &Conditions) -> f64 {
    OPTICAL_DEPTH / extinction_per_m(conditions)
}

/// Extinction of light, 1/m.
fn extinction_per_m(conditions: &Conditions) -> f64 {
    let fog_per_m = OPTICAL_DEPTH / conditions.visibility_m.max(1.0);
    // Carbonneau gives dB/km; 4.343 dB are one factor of e.
    let rain_per_m = 1.076 * libm::pow(conditions.rain_mmph.max(0.0), 0.67) / 1000.0 / 4.343;
    fog_per_m + rain_per_m
}

/// Logistic fall with distance: one half at 80 % of the range.
fn in_range(distance_m: f64, range_m: f64) -> f64 {
    let width_m = 0.08 * range_m.max(1e-3);
    1.0 / (1.0 + libm::exp(((distance_m - 0.8 * range_m) / width_m).min(50.0)))
}

/// Range of a LiDAR that reaches `clear_m` in clear air: solves R·exp(extinction·R) = `clear_m`.
///
/// The echo falls with exp(−2·extinction·R)/R², hence the equation. Newton from above converges
/// because the left side is convex.
fn attenuated_m(clear_m: f64, extinction_per_m: f64) -> f64 {
    let mut range_m = clear_m;
    for _ in 0..12 {
        let growth = libm::exp(extinction_per_m * range_m);
        let excess_m = range_m * growth - clear_m;
        range_m -= excess_m / (growth * (1.0 + extinction_per_m * range_m));
    }
    range_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CLEAR_DAY, object};
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;

    #[test]
    fn fog_shortens_the_lidar_as_tabled() {
        for (visibility_m, range_m) in [(1000.0, 91.0), (200.0, 54.0), (50.0, 26.0)] {
            let found = attenuated_m(120.0, 2.996 / visibility_m);
            assert!((found - range_m).abs() < 1.0, "{visibility_m}: {found}");
        }
        // Rain of 50 mm/h: 14.8 dB/km with the lesser figures beside it in the table.
        let rain = Conditions { rain_mmph: 50.0, visibility_m: 1e9, ..CLEAR_DAY };
        assert!((extinction_per_m(&rain) * 4343.0 - 14.8).abs() < 0.1);
    }

    #[test]
    fn weather_dark_class_and_the_grid_each_cost_chances() {
        let config = PerceptionConfig::default();
        let chance = |conditions: &Conditions, limited: bool, body: Body, distance_m: f64| {
            let ranges = Ranges::in_conditions(&config, limited, conditions);
            let seen = object(1, body, Pose::new(distance_m, 0.0, 0.0), 0.0);
            ranges.detection_chance(&config, &SensedObject { distance_m, ..seen }, false)
        };
        let half = |distance_m: f64| {
            let seen = object(1, Body::Pedestrian, Pose::new(distance_m, 0.0, 0.0), 0.0);
            let half = SensedObject { distance_m, visible_fraction: 0.5, ..seen };
            Ranges::in_conditions(&config, true, &CLEAR_DAY).detection_chance(&config, &half, false)
        };
        assert_eq!(half(20.0), chance(&CLEAR_DAY, true, Body::Pedestrian, 20.0 / 0.5_f64.sqrt()));
        let fog = Conditions { visibility_m: 50.0, ..CLEAR_DAY };
        let rain = Conditions { rain_mmph: 50.0, ..CLEAR_DAY };
        let night = Conditions { light: 0.0, ..CLEAR_DAY };
        let clear = chance(&CLEAR_DAY, false, Body::Sedan, 60.0);
        assert!(clear > 0.9);
        for (why, less) in [
            ("fog", chance(&fog, false, Body::Sedan, 60.0)),
            ("night", chance(&night, false, Body::Sedan, 60.0)),
            ("a walker", chance(&CLEAR_DAY, false, Body::Pedestrian, 60.0)),
        ] {
            assert!(less < clear, "{why}: {less} of {clear}");
        }
        // By day the camera makes up for what rain takes from the LiDAR.
        let rainy_night = Conditions { light: 0.0, ..rain };
        assert!(chance(&rainy_night, false, Body::Sedan, 60.0) < chance(&night, false, Body::Sedan, 60.0));
        // Within 50 m no camera begins a track alone, so the grid is what counts.
        let walker = |limited| chance(&CLEAR_DAY, limited, Body::Pedestrian, 42.0);
        assert!(walker(true) < walker(false) / 2.0, "{} of {}", walker(true), walker(false));
    }
}
