//! What may be set of the modular driving system: unit, range and where it comes from.
//!
//! Constants that belong to a method rather than to the system modelled (step sizes, filter gains,
//! look-aheads) stand with their use in the parts.
//! `scenarios/ads/default.yaml` is the default written out. "Apollo" is Apollo 7.0; "ours" marks
//! what its published configuration leaves open.

use serde::Deserialize;
use serde::Serialize;

use crate::ads::guide::SpeedRules;
use crate::ads::steering::SteeringConfig;

/// Settings of [`Modular`](super::Modular). Keys that a file leaves out keep their default.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModularConfig {
    pub localization: LocalizationConfig,
    pub perception: PerceptionConfig,
    pub prediction: PredictionConfig,
    pub planning: PlanningConfig,
    pub control: ControlConfig,
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    #[error("{0}")]
    Yaml(#[from] serde_yaml::Error),
    #[error("`{key}` is {value}, but must be between {low} and {high}")]
    Range { key: String, value: f64, low: f64, high: f64 },
}

/// Pose error of RTK and LiDAR map matching.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocalizationConfig {
    /// Standard deviation of the slowly moving position error per axis, m, in `[0, 5]`. RTK fixed: 0.02 to 0.05.
    pub position_sigma_m: f64,
    /// Standard deviation of the heading error, rad, in `[0, 0.1]`. Published: 0.2° to 0.5°.
    pub heading_sigma_rad: f64,
    /// Correlation time of both, s, in `[0.1, 100]`. Multipath and map matching: about 5.
    pub correlation_s: f64,
    /// Age of a pose when it is used, s, in `[0, 0.1]`. LGSVL with Apollo: 0.01 to 0.02.
    pub latency_s: f64,
    /// Factor of both deviations in a downpour (50 mm/h) or on a flooded road, in `[1, 10]`. LiDAR map matching: 1.5 to 3.
    pub rain_factor: f64,
}

impl Default for LocalizationConfig {
    fn default() -> LocalizationConfig {
        LocalizationConfig {
            position_sigma_m: 0.04,
            heading_sigma_rad: 0.0035,
            correlation_s: 5.0,
            latency_s: 0.015,
            rain_factor: 3.0,
        }
    }
}

/// Detection and tracking of objects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Range of the LiDAR in clear air, m, in `[0, 300]`: vehicles. PointPillars' grid ends at 74.88.
    pub lidar_vehicle_m: f64,
    /// The same for pedestrians. nuScenes scores them to 40 m.
    pub lidar_pedestrian_m: f64,
    /// Range of the cameras by day in clear air, m, in `[0, 300]`: vehicles. Ours.
    pub camera_vehicle_m: f64,
    /// The same for pedestrians. Ours.
    pub camera_pedestrian_m: f64,
    /// Factor of the camera's range in full darkness, in `[0, 1]`: vehicles, which carry lamps.
    pub night_vehicle_factor: f64,
    /// The same for pedestrians. Low beam, dark clothing: 25 to 40 m of 80.
    pub night_pedestrian_factor: f64,
    /// Part of the camera in the fused range, in `[0, 1]`; the LiDAR has the rest. nuScenes, BEVFusion:
    /// losing the camera costs about a fifth of what losing the LiDAR costs.
    pub camera_weight: f64,
    /// Cameras alone begin a track only beyond this distance, m, in `[0, 300]`. Apollo: 50.
    pub camera_alone_m: f64,
    /// Cameras alone begin no track in less light than this, in `[0, 1]`. Apollo: none at night.
    pub camera_alone_light: f64,
    /// Chance of detection in a frame far inside the range, in `[0, 1]`. Logistic form; 0.98 ours.
    pub detection_chance_max: f64,
    /// An object of which less is in sight is not detected, in `[0, 1]`. Published occlusion levels: 0.2.
    pub visible_fraction_min: f64,
    /// Frames in a row before a track is published, in `[1, 20]`. Apollo `pub_track_time_thresh` 3: the fourth.
    pub frames_to_publish: u32,
    /// A track unseen for longer is dropped, s, in `[0, 5]`. Apollo's tracker reserves 0.3.
    pub reserve_s: f64,
    /// Frames between the look and its use, in `[0, 1]`. Published latency 60 to 120 ms: 1.
    pub latency_frames: u32,
    /// Position noise at no distance, m, in `[0.001, 5]`. nuScenes, LiDAR detectors.
    pub position_sigma_m: f64,
    /// Position noise per metre of distance, in `[0, 0.1]`. The same.
    pub position_sigma_per_m: f64,
    /// Heading noise of a frame, rad, in `[0, 1]`. LiDAR: 3°.
    pub heading_sigma_rad: f64,
    /// Relative error of the size of an object, kept for its life, in `[0, 0.2]`. nuScenes: 0.05.
    pub size_sigma: f64,
    /// Acceleration that the tracker expects of vehicles, standard deviation, m/s², in `[0.1, 20]`. Ours.
    pub vehicle_acceleration_sigma_mps2: f64,
    /// The same for pedestrians.
    pub pedestrian_acceleration_sigma_mps2: f64,
    /// Every second frame sees of a large vehicle only the part next to the ego vehicle and takes it
    /// for a car. Apollo issues 14212 and AIasd/ADFuzz 5: unstable class and size across frames.
    pub large_vehicle_flicker: bool,
    /// A vehicle longer than this flickers, m, in `[0, 30]`. Ours.
    pub large_vehicle_m: f64,
    /// Length of the part then seen, m, in `[1, 30]`. Ours.
    pub flicker_length_m: f64,
}

impl Default for PerceptionConfig {
    fn default() -> PerceptionConfig {
        PerceptionConfig {
            lidar_vehicle_m: 74.88,
            lidar_pedestrian_m: 40.0,
            camera_vehicle_m: 120.0,
            camera_pedestrian_m: 60.0,
            night_vehicle_factor: 0.7,
            night_pedestrian_factor: 0.4,
            camera_weight: 0.2,
            camera_alone_m: 50.0,
            camera_alone_light: 0.5,
            detection_chance_max: 0.98,
            visible_fraction_min: 0.2,
            frames_to_publish: 4,
            reserve_s: 0.3,
            latency_frames: 1,
            position_sigma_m: 0.10,
            position_sigma_per_m: 0.002,
            heading_sigma_rad: 0.052,
            size_sigma: 0.05,
            vehicle_acceleration_sigma_mps2: 3.0,
            pedestrian_acceleration_sigma_mps2: 2.0,
            large_vehicle_flicker: true,
            large_vehicle_m: 7.0,
            flicker_length_m: 4.5,
        }
    }
}

/// Where objects will be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PredictionConfig {
    /// Slower vehicles are taken to stand, m/s, in `[0, 5]`. Apollo `still_obstacle_speed_threshold`: 0.99.
    pub still_vehicle_mps: f64,
    /// The same for pedestrians. Apollo: 0.2.
    pub still_pedestrian_mps: f64,
    /// Lateral speed that counts as leaving the lane, m/s, in `[0, 5]`. Ours.
    pub lateral_speed_mps: f64,
    /// For how long it must last before it is believed, s, in `[0, 5]`. Apollo `max_tracking_time`: 0.5.
    pub lateral_persistence_s: f64,
    /// A vehicle turned further from every lane is taken to go straight on, rad, in `[0, 3.2]`. Ours.
    pub off_lane_rad: f64,
    /// Farther objects are taken to keep their velocity, m, in `[0, 300]`. Apollo's scan box: 80.
    pub reach_m: f64,
}

impl Default for PredictionConfig {
    fn default() -> PredictionConfig {
        PredictionConfig {
            still_vehicle_mps: 0.99,
            still_pedestrian_mps: 0.2,
            lateral_speed_mps: 0.4,
            lateral_persistence_s: 0.5,
            off_lane_rad: 0.6,
            reach_m: 80.0,
        }
    }
}

/// Speed along the route.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlanningConfig {
    /// Speed on a free road, m/s, in `[1, 40]`. Apollo's upstream `planning.conf`, `default_cruise_speed`: 11.18 (25 mph); the flag's own default is 5.0.
    pub cruise_mps: f64,
    /// In curves, m/s², in `[0.5, 6]`. Apollo's DP `max_centric_acceleration_limit`: 2.0.
    pub lateral_acceleration_mps2_max: f64,
    /// Slowing down for curves and limits ahead, magnitude, m/s², in `[0.5, 6]`. Ours.
    pub slowdown_mps2: f64,
    /// m/s², in `[0.5, 4]`. Apollo's DP `max_acceleration`: 2.0.
    pub acceleration_mps2_max: f64,
    /// Magnitude, m/s², in `[1, 8]`. Apollo's DP `max_deceleration`: 4.0.
    pub deceleration_mps2_max: f64,
    /// When that does not suffice, magnitude, m/s², in `[1, 10]`. Apollo's vehicle limit: 6.0.
    pub emergency_mps2: f64,
    /// Of a planned stop, magnitude, m/s², in `[0.5, 4]`. Ours.
    pub comfortable_mps2: f64,
    /// Rate at which a plan may lower its acceleration, magnitude, m/s³, in `[0.5, 50]`. Apollo: 4.
    pub jerk_mps3_down: f64,
    /// Rate at which it may raise it, m/s³, in `[0.5, 50]`. Apollo: 2.
    pub jerk_mps3_up: f64,
    /// Room kept free on each side, m, in `[0, 2]`. Apollo `obstacle_lat_buffer`: 0.4.
    pub lateral_buffer_m: f64,
    /// Gap to what stands in the way, m, in `[0.5, 20]`. Apollo `min_stop_distance_obstacle`: 6.0.
    pub stop_gap_m: f64,
    /// Gap to a leader at rest, m, in `[0.5, 20]`. Apollo `follow_min_distance` 3.0 to the stop gap 6.0.
    pub follow_gap_m: f64,
    /// Time gap to a leader, s, in `[0.5, 5]`. Apollo `follow_min_time_sec`: 2.0.
    pub follow_time_s: f64,
    /// Gap to the way of something that crosses, m, in `[0.5, 20]`. Apollo `yield_distance`: 5.0.
    pub yield_gap_m: f64,
    /// Two road users at one place closer in time than this are in conflict, s, in `[0, 5]`. Ours.
    pub conflict_buffer_s: f64,
    /// A vehicle that is on the way of the ego vehicle for less, crossing it, is not given way to, s, in `[0, 8]`; 0 gives way to all. Apollo issue 14870: yields only briefly; the figure is ours.
    pub brief_overlap_s: f64,
    /// Gap from the front bumper to the stop line, m, in `[0, 5]`. Apollo `stop_distance`: 1.0.
    pub stop_line_gap_m: f64,
    /// A red light that would need harder braking is passed, m/s², in `[1, 8]`. Apollo `max_stop_deceleration`: 4.0.
    pub red_light_mps2_max: f64,
    /// Slower objects are static, m/s, in `[0, 3]`. Apollo `static_obstacle_speed_threshold`: 0.5.
    pub static_mps: f64,
    /// Constant braking when there is no plan, magnitude, m/s², in `[1, 8]`. Apollo `slowdown_profile_deceleration`: 4.0.
    pub fallback_mps2: f64,
    /// Farther beside the route there is no plan, m, in `[1, 20]`. Ours.
    pub lost_offset_m: f64,
}

impl PlanningConfig {
    pub(super) fn speed_rules(&self) -> SpeedRules {
        SpeedRules {
            cruise_mps: self.cruise_mps,
            lateral_acceleration_mps2_max: self.lateral_acceleration_mps2_max,
            slowdown_mps2: self.slowdown_mps2,
        }
    }
}

impl Default for PlanningConfig {
    fn default() -> PlanningConfig {
        PlanningConfig {
            cruise_mps: 11.18,
            lateral_acceleration_mps2_max: 2.0,
            slowdown_mps2: 1.5,
            acceleration_mps2_max: 2.0,
            deceleration_mps2_max: 4.0,
            emergency_mps2: 6.0,
            comfortable_mps2: 2.0,
            jerk_mps3_down: 4.0,
            jerk_mps3_up: 2.0,
            lateral_buffer_m: 0.4,
            stop_gap_m: 6.0,
            follow_gap_m: 5.0,
            follow_time_s: 2.0,
            yield_gap_m: 5.0,
            conflict_buffer_s: 1.0,
            brief_overlap_s: 2.0,
            stop_line_gap_m: 1.0,
            red_light_mps2_max: 4.0,
            static_mps: 0.5,
            fallback_mps2: 4.0,
            lost_offset_m: 3.0,
        }
    }
}

/// Tracking of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ControlConfig {
    pub steering: SteeringConfig,
    /// Speed wanted per metre of station error, 1/s, in `[0, 5]`. Apollo station PID `kp`: 0.2.
    pub station_kp: f64,
    /// Bound of the station error, m, in `[0, 10]`. Apollo: 2.
    pub station_error_m_max: f64,
    /// Bound of the speed error, m/s, in `[0, 10]`. Apollo: 2.
    pub speed_error_mps_max: f64,
    /// Up to this speed the low gains hold, m/s, in `[0, 20]`. Apollo `switch_speed`: 2.
    pub switch_mps: f64,
    /// Acceleration per speed error at low speed, 1/s, in `[0, 5]`. Apollo: 0.5.
    pub speed_kp_low: f64,
    /// The same above. Apollo: 1.0.
    pub speed_kp_high: f64,
    /// Acceleration per speed error and second, 1/s², in `[0, 5]`. Apollo: 0.3.
    pub speed_ki: f64,
    /// Bound of the integral part, m/s², in `[0, 5]`. Apollo's saturation: 0.3.
    pub integral_mps2_max: f64,
    /// The plan's acceleration is read this far ahead, s, in `[0, 1]`. Apollo: 20 cycles of 10 ms.
    pub preview_s: f64,
    /// Held at rest, magnitude, m/s², in `[0, 6]`. Apollo `standstill_acceleration`: 3.0.
    pub standstill_mps2: f64,
    /// Planned speeds below this mean a full stop, m/s, in `[0, 2]`. Apollo `max_abs_speed_when_stopped`: 0.2.
    pub stopped_mps: f64,
}

impl Default for ControlConfig {
    fn default() -> ControlConfig {
        ControlConfig {
            steering: SteeringConfig::default(),
            station_kp: 0.2,
            station_error_m_max: 2.0,
            speed_error_mps_max: 2.0,
            switch_mps: 2.0,
            speed_kp_low: 0.5,
            speed_kp_high: 1.0,
            speed_ki: 0.3,
            integral_mps2_max: 0.3,
            preview_s: 0.2,
            standstill_mps2: 3.0,
            stopped_mps: 0.2,
        }
    }
}

impl ModularConfig {
    /// Reads a configuration; see `scenarios/ads/default.yaml`.
    ///
    /// # Errors
    /// Text that is no YAML, a key that does not exist, a value out of its range.
    pub fn from_yaml(text: &str) -> Result<ModularConfig, ConfigError> {
        let config: ModularConfig = serde_yaml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    fn check(&self) -> Result<(), ConfigError> {
        let values = serde_json::to_value(self).expect("a configuration is plain data");
        for &(pointer, low, high) in RANGES {
            let value = values.pointer(pointer).and_then(serde_json::Value::as_f64);
            // What JSON cannot write, such as NaN, is in no range.
            let value = value.unwrap_or(f64::NAN);
            if !(low..=high).contains(&value) {
                let key = pointer[1..].replace('/', ".");
                return Err(ConfigError::Range { key, value, low, high });
            }
        }
        Ok(())
    }
}

/// The documented ranges, by JSON pointer.
const RANGES: &[(&str, f64, f64)] = &[
    ("/localization/position_sigma_m", 0.0, 5.0),
    ("/localization/heading_sigma_rad", 0.0, 0.1),
    ("/localization/correlation_s", 0.1, 100.0),
    ("/localization/latency_s", 0.0, 0.1),
    ("/localization/rain_factor", 1.0, 10.0),
    ("/perception/lidar_vehicle_m", 0.0, 300.0),
    ("/perception/lidar_pedestrian_m", 0.0, 300.0),
    ("/perception/camera_vehicle_m", 0.0, 300.0),
    ("/perception/camera_pedestrian_m", 0.0, 300.0),
    ("/perception/night_vehicle_factor", 0.0, 1.0),
    ("/perception/night_pedestrian_factor", 0.0, 1.0),
    ("/perception/camera_weight", 0.0, 1.0),
    ("/perception/camera_alone_m", 0.0, 300.0),
    ("/perception/camera_alone_light", 0.0, 1.0),
    ("/perception/detection_chance_max", 0.0, 1.0),
    ("/perception/visible_fraction_min", 0.0, 1.0),
    ("/perception/frames_to_publish", 1.0, 20.0),
    ("/perception/reserve_s", 0.0, 5.0),
    ("/perception/latency_frames", 0.0, 1.0),
    ("/perception/position_sigma_m", 0.001, 5.0),
    ("/perception/position_sigma_per_m", 0.0, 0.1),
    ("/perception/heading_sigma_rad", 0.0, 1.0),
    ("/perception/size_sigma", 0.0, 0.2),
    ("/perception/vehicle_acceleration_sigma_mps2", 0.1, 20.0),
    ("/perception/pedestrian_acceleration_sigma_mps2", 0.1, 20.0),
    ("/perception/large_vehicle_m", 0.0, 30.0),
    ("/perception/flicker_length_m", 1.0, 30.0),
    ("/prediction/still_vehicle_mps", 0.0, 5.0),
    ("/prediction/still_pedestrian_mps", 0.0, 5.0),
    ("/prediction/lateral_speed_mps", 0.0, 5.0),
    ("/prediction/lateral_persistence_s", 0.0, 5.0),
    ("/prediction/off_lane_rad", 0.0, 3.2),
    ("/prediction/reach_m", 0.0, 300.0),
    ("/planning/cruise_mps", 1.0, 40.0),
    ("/planning/lateral_acceleration_mps2_max", 0.5, 6.0),
    ("/planning/slowdown_mps2", 0.5, 6.0),
    ("/planning/acceleration_mps2_max", 0.5, 4.0),
    ("/planning/deceleration_mps2_max", 1.0, 8.0),
    ("/planning/emergency_mps2", 1.0, 10.0),
    ("/planning/comfortable_mps2", 0.5, 4.0),
    ("/planning/jerk_mps3_down", 0.5, 50.0),
    ("/planning/jerk_mps3_up", 0.5, 50.0),
    ("/planning/lateral_buffer_m", 0.0, 2.0),
    ("/planning/stop_gap_m", 0.5, 20.0),
    ("/planning/follow_gap_m", 0.5, 20.0),
    ("/planning/follow_time_s", 0.5, 5.0),
    ("/planning/yield_gap_m", 0.5, 20.0),
    ("/planning/conflict_buffer_s", 0.0, 5.0),
    ("/planning/brief_overlap_s", 0.0, 8.0),
    ("/planning/stop_line_gap_m", 0.0, 5.0),
    ("/planning/red_light_mps2_max", 1.0, 8.0),
    ("/planning/static_mps", 0.0, 3.0),
    ("/planning/fallback_mps2", 1.0, 8.0),
    ("/planning/lost_offset_m", 1.0, 20.0),
    ("/control/station_kp", 0.0, 5.0),
    ("/control/station_error_m_max", 0.0, 10.0),
    ("/control/speed_error_mps_max", 0.0, 10.0),
    ("/control/switch_mps", 0.0, 20.0),
    ("/control/speed_kp_low", 0.0, 5.0),
    ("/control/speed_kp_high", 0.0, 5.0),
    ("/control/speed_ki", 0.0, 5.0),
    ("/control/integral_mps2_max", 0.0, 5.0),
    ("/control/preview_s", 0.0, 1.0),
    ("/control/standstill_mps2", 0.0, 6.0),
    ("/control/stopped_mps", 0.0, 2.0),
    ("/control/steering/weight_offset", 0.001, 100.0),
    ("/control/steering/weight_heading", 0.001, 100.0),
    ("/control/steering/weight_steer", 0.01, 100.0),
    ("/control/steering/cornering_stiffness_nprad", 1000.0, 10000000.0),
    ("/control/steering/mass_kg", 100.0, 100000.0),
    ("/control/steering/lateral_acceleration_mps2_max", 0.5, 20.0),
    ("/control/steering/preview_s", 0.0, 1.0),
    ("/control/steering/lock_speed_mps", 0.01, 2.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_the_default() {
        let text = include_str!("../../../scenarios/ads/default.yaml");
        assert_eq!(ModularConfig::from_yaml(text).unwrap(), ModularConfig::default());
        // Nothing is left out of the file.
        let written: serde_json::Value = serde_yaml::from_str(text).unwrap();
        assert_eq!(written, serde_json::to_value(ModularConfig::default()).unwrap());
    }

    #[test]
    fn every_number_has_a_range() {
        fn numbers(value: &serde_json::Value, at: &str, found: &mut Vec<String>) {
            match value {
                serde_json::Value::Object(map) => {
                    map.iter().for_each(|(key, value)| numbers(value, &format!("{at}/{key}"), found));
                }
                serde_json::Value::Number(_) => found.push(at.into()),
                _ => {}
            }
        }
        let mut found = Vec::new();
        numbers(&serde_json::to_value(ModularConfig::default()).unwrap(), "", &mut found);
        let mut ranges: Vec<&str> = RANGES.iter().map(|range| range.0).collect();
        ranges.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, ranges);
    }

    #[test]
    fn mistakes_are_named() {
        let unknown = ModularConfig::from_yaml("planning:\n  cruise_kmh: 40\n").unwrap_err();
        assert!(unknown.to_string().contains("cruise_kmh"), "{unknown}");
        let range = ModularConfig::from_yaml("planning:\n  cruise_mps: 400\n").unwrap_err();
        assert_eq!(range.to_string(), "`planning.cruise_mps` is 400, but must be between 1 and 40");
        let partly = ModularConfig::from_yaml("planning:\n  cruise_mps: 8\n").unwrap();
        assert_eq!(partly.planning.cruise_mps, 8.0);
        assert_eq!(partly.perception, PerceptionConfig::default());
    }
}
