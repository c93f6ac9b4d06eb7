//! What the ego vehicle believes to be around it: detections, tracks, and when a track is published.
//!
//! A frame (10 Hz) detects an object with a chance that falls with distance: by LiDAR and camera
//! together, and far away by day by the camera alone; fog, rain and darkness shorten their ranges. A
//! Kalman filter per object (constant velocity) makes tracks of noisy positions; a track is published
//! at its fourth detection in a row.
//! Left out: ghosts, confusion of identities, and radar, which in Apollo begins no track.

use nalgebra::Matrix2;
use nalgebra::Matrix2x1;

use crate::geometry::Pose;
use crate::geometry::Vec2;
use crate::geometry::unit_vector;
use crate::geometry::wrap_angle;
use crate::model::vocabulary::Body;
use crate::rng;
use crate::rng::Rng;
use crate::rng::Stream;
use crate::sim::Conditions;
use crate::sim::DT_S;
use crate::sim::FRAME_TICKS;
use crate::sim::Sensed;
use crate::sim::SensedObject;

use super::config::PerceptionConfig;

/// Time between frames, s.
pub const FRAME_S: f64 = FRAME_TICKS as f64 * DT_S;
/// Standard deviation of a velocity nobody has measured yet, m/s.
const UNKNOWN_VELOCITY_MPS: f64 = 10.0;
/// Part of a new heading that the track takes over in a frame.
const HEADING_GAIN: f64 = 0.4;

#[derive(Debug, Clone)]
pub struct Perception {
    config: PerceptionConfig,
    rng: Rng,
    frame: u64,
    tracks: Vec<Track>,
}

/// An object that was detected at least once and not lost since.
#[derive(Debug, Clone)]
pub struct Track {
    pub id: u32,
    pub body: Body,
    /// Centre of the whole object; of a part that is taken for the whole, see [`Track::centre`].
    position: Vec2,
    pub velocity_mps: Vec2,
    pub heading_rad: f64,
    /// From `position` to the centre of what was last seen, along the heading, m.
    shift_m: f64,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// Covariance of position and velocity, the same along both axes.
    covariance: Matrix2<f64>,
    size_factor: f64,
    frames_in_row: u32,
    published: bool,
    unseen_s: f64,
}

/// How far each sensor reaches in the present conditions, m.
#[derive(Debug, Clone, Copy)]
struct Ranges {
    lidar_vehicle_m: f64,
    lidar_pedestrian_m: f64,
    camera_vehicle_m: f64,
    camera_pedestrian_m: f64,
}

/// One object in one frame, in the map.
struct Detection {
    body: Body,
    pose: Pose,
    shift_m: f64,
    length_m: f64,
    width_m: f64,
    height_m: f64,
    sigma_m: f64,
}

impl Perception {
    pub fn new(config: &PerceptionConfig, seed: u64) -> Perception {
        let rng = rng::stream(seed, Stream::Perception, 0);
        Perception { config: *config, rng, frame: 0, tracks: Vec::new() }
    }

    /// Tracks fit for use, by age.
    pub fn published(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter().filter(|track| track.published)
    }

    /// One frame. `localized` is where the vehicle believes its rear axle is: objects are measured
    /// from the vehicle and placed on the map from there.
    pub fn look(&mut self, sensed: &Sensed, localized: &Pose) {
        self.frame += 1;
        for track in &mut self.tracks {
            track.unseen_s += FRAME_S;
            track.advance(acceleration_sigma_mps2(&self.config, track.body));
        }
        let ranges = Ranges::in_conditions(&self.config, &sensed.conditions);
        for object in &sensed.objects {
            let known = self.tracks.iter().position(|track| track.id == object.id);
            // Every object costs the same draws, whether it is seen or not.
            let luck = rng::unit(&mut self.rng);
            let noise: [f64; 3] = core::array::from_fn(|_| rng::normal(&mut self.rng));
            let detection_chance =
                detection_chance(&self.config, &ranges, object, &sensed.conditions, known.is_some());
            if luck >= detection_chance {
                continue;
            }
            let detection = self.measure(object, sensed, localized, &noise);
            match known {
                Some(index) => self.tracks[index].correct(&detection),
                None => {
                    let size_factor =
                        1.0 + self.config.size_sigma * rng::normal(&mut self.rng).clamp(-3.0, 3.0);
                    self.tracks.push(Track::begin(object.id, &detection, size_factor));
                }
            }
        }
        let config = &self.config;
        self.tracks.retain_mut(|track| {
            if track.unseen_s > 0.0 {
                track.frames_in_row = 0;
            } else if track.frames_in_row >= config.frames_to_publish {
                track.published = true;
            }
            // A track not yet published has nothing to reserve.
            if track.published { track.unseen_s <= config.reserve_s + 1e-9 } else { track.unseen_s <= 0.0 }
        });
    }

    fn measure(
        &self,
        object: &SensedObject,
        sensed: &Sensed,
        localized: &Pose,
        noise: &[f64; 3],
    ) -> Detection {
        let flickers = self.config.large_vehicle_flicker
            && object.length_m > self.config.large_vehicle_m
            && (self.frame + u64::from(object.id)).is_multiple_of(2);
        let (body, length_m, shift_m) = if flickers {
            // Only the near part is fitted: its centre lies towards the near end. Trackers measure
            // motion at an anchor that does not move with the size, so only size and class jump.
            let length_m = self.config.flicker_length_m.min(object.length_m);
            let forward = unit_vector(object.pose.heading_rad);
            let ahead_m = (sensed.ego.rear_axle.position - object.pose.position).dot(&forward);
            let room_m = (object.length_m - length_m) / 2.0;
            (Body::SUV, length_m, ahead_m.clamp(-room_m, room_m))
        } else {
            (object.body, object.length_m, 0.0)
        };
        let sigma_m = self.config.position_sigma_m + self.config.position_sigma_per_m * object.distance_m;
        let noise_m = Vec2::new(noise[0], noise[1]) * sigma_m;
        let from_ego = sensed.ego.rear_axle.to_local(object.pose.position) + noise_m;
        let turned_rad = object.pose.heading_rad - sensed.ego.rear_axle.heading_rad;
        Detection {
            body,
            pose: Pose {
                position: localized.to_world(from_ego),
                heading_rad: wrap_angle(
                    localized.heading_rad + turned_rad + noise[2] * self.config.heading_sigma_rad,
                ),
            },
            shift_m,
            length_m,
            width_m: object.width_m,
            height_m: object.height_m,
            sigma_m,
        }
    }
}

impl Track {
    /// Centre of what was last seen.
    pub fn centre(&self) -> Vec2 {
        self.position + unit_vector(self.heading_rad) * self.shift_m
    }

    /// A published track of a known state.
    #[cfg(test)]
    pub fn for_tests(id: u32, body: Body, pose: Pose, velocity_mps: Vec2) -> Track {
        let (length_m, width_m, height_m, sigma_m) = (4.7, 1.9, 1.5, 0.1);
        let detection = Detection { body, pose, shift_m: 0.0, length_m, width_m, height_m, sigma_m };
        Track { velocity_mps, published: true, ..Track::begin(id, &detection, 1.0) }
    }

    fn begin(id: u32, detection: &Detection, size_factor: f64) -> Track {
        let variance = detection.sigma_m * detection.sigma_m;
        Track {
            id,
            body: detection.body,
            position: detection.pose.position,
            velocity_mps: Vec2::zeros(),
            heading_rad: detection.pose.heading_rad,
            shift_m: detection.shift_m,
            length_m: detection.length_m * size_factor,
            width_m: detection.width_m * size_factor,
            height_m: detection.height_m * size_factor,
            covariance: Matrix2::new(variance, 0.0, 0.0, UNKNOWN_VELOCITY_MPS * UNKNOWN_VELOCITY_MPS),
            size_factor,
            frames_in_row: 1,
            published: false,
            unseen_s: 0.0,
        }
    }

    /// One frame on, at constant velocity.
    fn advance(&mut self, acceleration_sigma_mps2: f64) {
        let transition = Matrix2::new(1.0, FRAME_S, 0.0, 1.0);
        let gain = Matrix2x1::new(FRAME_S * FRAME_S / 2.0, FRAME_S) * acceleration_sigma_mps2;
        self.position += self.velocity_mps * FRAME_S;
        self.covariance = transition * self.covariance * transition.transpose() + gain * gain.transpose();
    }

    fn correct(&mut self, detection: &Detection) {
        let variance = detection.sigma_m * detection.sigma_m;
        let gain = self.covariance.column(0) / (self.covariance[(0, 0)] + variance);
        let innovation = detection.pose.position - self.position;
        self.position += innovation * gain[0];
        self.velocity_mps += innovation * gain[1];
        self.covariance -= gain * self.covariance.row(0);
        let turn_rad = wrap_angle(detection.pose.heading_rad - self.heading_rad);
        self.heading_rad = wrap_angle(self.heading_rad + HEADING_GAIN * turn_rad);
        self.body = detection.body;
        self.shift_m = detection.shift_m;
        self.length_m = detection.length_m * self.size_factor;
        self.width_m = detection.width_m * self.size_factor;
        self.height_m = detection.height_m * self.size_factor;
        self.frames_in_row += 1;
        self.unseen_s = 0.0;
    }
}

impl Ranges {
    fn in_conditions(config: &PerceptionConfig, conditions: &Conditions) -> Ranges {
        // Koschmieder: extinction at 5 % contrast. Carbonneau: dB/km of rain, both as 1/m.
        let fog_per_m = 2.996 / conditions.visibility_m.max(1.0);
        let rain_per_m = 1.076 * libm::pow(conditions.rain_mmph.max(0.0), 0.67) / 1000.0 / 4.343;
        let lidar_per_m = fog_per_m + rain_per_m;
        let dark = 1.0 - conditions.light.clamp(0.0, 1.0);
        // An object of full contrast disappears at the meteorological optical range.
        let sight_m = 2.996 / (fog_per_m + rain_per_m);
        let camera =
            |clear_m: f64, night_factor: f64| (clear_m * (1.0 - (1.0 - night_factor) * dark)).min(sight_m);
        Ranges {
            lidar_vehicle_m: attenuated_m(config.lidar_vehicle_m, lidar_per_m),
            lidar_pedestrian_m: attenuated_m(config.lidar_pedestrian_m, lidar_per_m),
            camera_vehicle_m: camera(config.camera_vehicle_m, config.night_vehicle_factor),
            camera_pedestrian_m: camera(config.camera_pedestrian_m, config.night_pedestrian_factor),
        }
    }
}

fn acceleration_sigma_mps2(config: &PerceptionConfig, body: Body) -> f64 {
    if body.is_vehicle() {
        config.vehicle_acceleration_sigma_mps2
    } else {
        config.pedestrian_acceleration_sigma_mps2
    }
}

fn detection_chance(
    config: &PerceptionConfig,
    ranges: &Ranges,
    object: &SensedObject,
    conditions: &Conditions,
    known: bool,
) -> f64 {
    if object.visible_fraction < config.visible_fraction_min {
        return 0.0;
    }
    let (lidar_m, camera_m) = if object.body.is_vehicle() {
        (ranges.lidar_vehicle_m, ranges.camera_vehicle_m)
    } else {
        (ranges.lidar_pedestrian_m, ranges.camera_pedestrian_m)
    };
    let camera_may_begin =
        object.distance_m > config.camera_alone_m && conditions.light >= config.camera_alone_light;
    let fused_m = lidar_m + config.camera_weight * (camera_m - lidar_m);
    let fused = in_range(object.distance_m, fused_m);
    let camera = if known || camera_may_begin { in_range(object.distance_m, camera_m) } else { 0.0 };
    config.detection_chance_max * fused.max(camera)
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

    use crate::ads::testing::CLEAR_DAY;
    use crate::ads::testing::object;
    use crate::sim::EgoMotion;

    fn sensed(objects: Vec<SensedObject>) -> Sensed {
        let ego = EgoMotion {
            rear_axle: Pose::new(0.0, 0.0, 0.0),
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            steer_rad: 0.0,
        };
        Sensed { time_s: 0.0, ego, objects, signals: vec![], conditions: CLEAR_DAY }
    }

    /// Frames until the object is published, at most 30.
    fn frames_to_publish(config: &PerceptionConfig, conditions: Conditions, seen: SensedObject) -> usize {
        let mut perception = Perception::new(config, 3);
        let sensed = Sensed { conditions, ..sensed(vec![seen]) };
        (1..=30)
            .find(|_| {
                perception.look(&sensed, &sensed.ego.rear_axle);
                perception.published().next().is_some()
            })
            .unwrap_or(usize::MAX)
    }

    #[test]
    fn the_fourth_frame_publishes_and_hidden_or_distant_things_never() {
        let config = PerceptionConfig { detection_chance_max: 1.0, ..PerceptionConfig::default() };
        let at = |body, distance_m: f64| SensedObject {
            distance_m,
            ..object(1, body, Pose::new(distance_m + 4.0, 0.0, 0.0), 0.0)
        };
        let fog = Conditions { visibility_m: 50.0, ..CLEAR_DAY };
        assert_eq!(frames_to_publish(&config, CLEAR_DAY, at(Body::Sedan, 20.0)), 4);
        assert_eq!(frames_to_publish(&config, CLEAR_DAY, at(Body::Pedestrian, 15.0)), 4);
        assert_eq!(frames_to_publish(&config, CLEAR_DAY, at(Body::Pedestrian, 70.0)), usize::MAX);
        assert_eq!(frames_to_publish(&config, fog, at(Body::Sedan, 60.0)), usize::MAX);
        let hidden = SensedObject { visible_fraction: 0.1, ..at(Body::Sedan, 20.0) };
        assert_eq!(frames_to_publish(&config, CLEAR_DAY, hidden), usize::MAX);
    }

    #[test]
    fn a_track_learns_the_velocity_and_outlives_three_misses() {
        let config = PerceptionConfig { detection_chance_max: 1.0, ..PerceptionConfig::default() };
        let mut perception = Perception::new(&config, 1);
        let mut world = sensed(vec![object(7, Body::SUV, Pose::new(30.0, 2.0, 0.0), 8.0)]);
        for _ in 0..20 {
            perception.look(&world, &world.ego.rear_axle);
            world.objects[0].pose.position.x += 8.0 * FRAME_S;
        }
        let track = perception.published().next().unwrap();
        assert!((track.velocity_mps - Vec2::new(8.0, 0.0)).norm() < 1.0, "{:?}", track.velocity_mps);
        world.objects.clear();
        for frame in 1..=4 {
            perception.look(&world, &world.ego.rear_axle);
            assert_eq!(perception.published().count(), usize::from(frame <= 3), "frame {frame}");
        }
    }

    #[test]
    fn a_bus_flickers_in_size_and_class() {
        let config = PerceptionConfig { detection_chance_max: 1.0, ..PerceptionConfig::default() };
        let mut perception = Perception::new(&config, 1);
        let world = sensed(vec![object(1, Body::SchoolBus, Pose::new(20.0, 0.0, 0.0), 0.0)]);
        let mut seen = Vec::new();
        for _ in 0..6 {
            perception.look(&world, &world.ego.rear_axle);
            seen.extend(perception.published().map(|track| (track.body, track.length_m > 6.0)));
        }
        assert_eq!(seen, [(Body::SchoolBus, true), (Body::SUV, false), (Body::SchoolBus, true)].as_slice());
    }

    #[test]
    fn fog_shortens_the_lidar_as_tabled() {
        for (visibility_m, range_m) in [(1000.0, 91.0), (200.0, 54.0), (50.0, 26.0)] {
            let found = attenuated_m(120.0, 2.996 / visibility_m);
            assert!((found - range_m).abs() < 1.0, "{visibility_m}: {found}");
        }
    }
}
