//! One track: a Kalman filter of constant velocity, the same for both axes.
//!
//! No turn rate is estimated; headings are smoothed.

use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::FRAME_S;

use super::super::config::TrackingConfig;
use super::super::perception::Detection;

/// Standard deviation of a velocity that is not measured yet, m/s.
const UNKNOWN_VELOCITY_MPS: f64 = 10.0;
/// Part of a new heading that the track takes over in a frame.
const HEADING_GAIN: f64 = 0.4;

/// An object that was detected at least once and not lost since.
#[derive(Debug, Clone, Copy)]
pub struct Track {
    /// Number of the track; a lost object comes back under another one.
    pub id: u32,
    /// Id of the object that its last detection shows: an annotation for judges and for perfect modules.
    /// Nothing is driven by it.
    pub truth: u32,
    pub body: Body,
    /// Centre of the whole object. For the centre of a part that is taken for the whole, see [`Track::centre`].
    pub(super) position: Vec2,
    pub velocity_mps: Vec2,
    pub heading_rad: f64,
    /// From `position` to the centre of what was last seen, along the heading, m.
    shift_m: f64,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    covariance: Covariance,
    /// Number of its detections so far, and of the frames since the first.
    pub(super) frames: u32,
    pub(super) age_frames: u32,
    pub(super) published: bool,
    pub(super) unseen_s: f64,
}

/// Covariance of position and velocity, the same along both axes.
#[derive(Debug, Clone, Copy)]
struct Covariance {
    position: f64,
    mixed: f64,
    velocity: f64,
}

impl Track {
    /// Centre of what was last seen.
    pub fn centre(&self) -> Vec2 {
        if self.shift_m == 0.0 {
            return self.position;
        }
        self.position + unit_vector(self.heading_rad) * self.shift_m
    }

    /// Unit vector along the heading.
    pub fn forward(&self) -> Vec2 {
        unit_vector(self.heading_rad)
    }

    /// Squared distance of a detection in units of its expected deviation.
    pub(super) fn mahalanobis2(&self, detection: &Detection) -> f64 {
        let expected_m2 = self.covariance.position + detection.sigma_m * detection.sigma_m;
        (detection.pose.position - self.position).norm_squared() / expected_m2
    }

    /// Whether a point lies inside the outline, grown by `room_m` on each side.
    pub(super) fn holds(&self, point: Vec2, room_m: f64) -> bool {
        let (forward, delta) = (self.forward(), point - self.centre());
        let across_m = forward.x * delta.y - forward.y * delta.x;
        forward.dot(&delta).abs() <= self.length_m / 2.0 + room_m
            && across_m.abs() <= self.width_m / 2.0 + room_m
    }

    /// A quick test whether another track is too far away. If true, [`Track::holds`] of its centre is certainly false;
    /// if false, ask [`Track::holds`].
    pub(super) fn is_far_from(&self, other: &Track, room_m: f64) -> bool {
        let off = other.position - self.position;
        let reach_m = self.length_m + self.width_m + 2.0 * room_m + self.shift_m.abs() + other.shift_m.abs();
        off.x.abs() > reach_m || off.y.abs() > reach_m
    }

    /// A published track of a known state.
    #[cfg(test)]
    pub fn for_tests(id: u32, body: Body, pose: Pose, velocity_mps: Vec2) -> Track {
        let (length_m, width_m, height_m, sigma_m) = (4.7, 1.9, 1.5, 0.1);
        let detection = Detection {
            truth: id,
            body,
            pose,
            shift_m: 0.0,
            length_m,
            width_m,
            height_m,
            sigma_m,
            true_velocity_mps: velocity_mps,
            true_heading_rad: pose.heading_rad,
        };
        Track { velocity_mps, published: true, ..Track::begin(id, &detection) }
    }

    pub(super) fn begin(id: u32, detection: &Detection) -> Track {
        let Pose { position, heading_rad } = detection.pose;
        Track {
            id,
            truth: detection.truth,
            body: detection.body,
            position,
            velocity_mps: Vec2::zeros(),
            heading_rad,
            shift_m: detection.shift_m,
            length_m: detection.length_m,
            width_m: detection.width_m,
            height_m: detection.height_m,
            covariance: Covariance {
                position: detection.sigma_m * detection.sigma_m,
                mixed: 0.0,
                velocity: UNKNOWN_VELOCITY_MPS * UNKNOWN_VELOCITY_MPS,
            },
            frames: 1,
            age_frames: 1,
            published: false,
            unseen_s: 0.0,
        }
    }

    /// One frame on, at constant velocity.
    pub(super) fn advance(&mut self, config: &TrackingConfig) {
        let sigma_mps2 = if self.body.is_vehicle() {
            config.vehicle_acceleration_sigma_mps2
        } else {
            config.pedestrian_acceleration_sigma_mps2
        };
        // An acceleration that is constant over the frame, of that deviation.
        let (by_position, by_velocity) = (FRAME_S * FRAME_S / 2.0 * sigma_mps2, FRAME_S * sigma_mps2);
        self.age_frames += 1;
        self.unseen_s += FRAME_S;
        self.position += self.velocity_mps * FRAME_S;
        let before = self.covariance;
        self.covariance = Covariance {
            position: before.position
                + FRAME_S * (2.0 * before.mixed + FRAME_S * before.velocity)
                + by_position * by_position,
            mixed: before.mixed + FRAME_S * before.velocity + by_position * by_velocity,
            velocity: before.velocity + by_velocity * by_velocity,
        };
    }

    /// Takes back what [`Track::advance`] did to the place: what stands stays where it was seen last, though less
    /// and less surely.
    pub(super) fn stay(&mut self) {
        self.position -= self.velocity_mps * FRAME_S;
        self.velocity_mps = Vec2::zeros();
    }

    pub(super) fn correct(&mut self, detection: &Detection) {
        let before = self.covariance;
        let total = before.position + detection.sigma_m * detection.sigma_m;
        let (position_gain, velocity_gain) = (before.position / total, before.mixed / total);
        let innovation = detection.pose.position - self.position;
        self.position += innovation * position_gain;
        self.velocity_mps += innovation * velocity_gain;
        self.covariance = Covariance {
            position: before.position * (1.0 - position_gain),
            mixed: before.mixed * (1.0 - position_gain),
            velocity: before.velocity - velocity_gain * before.mixed,
        };
        let turn_rad = wrap_angle(detection.pose.heading_rad - self.heading_rad);
        self.heading_rad = wrap_angle(self.heading_rad + HEADING_GAIN * turn_rad);
        self.truth = detection.truth;
        self.body = detection.body;
        self.shift_m = detection.shift_m;
        self.length_m = detection.length_m;
        self.width_m = detection.width_m;
        self.height_m = detection.height_m;
        self.frames += 1;
        self.unseen_s = 0.0;
    }

    /// Takes over what only an idealised tracker is told, and the position as detected.
    pub(super) fn know(&mut self, detection: &Detection) {
        self.position = detection.pose.position;
        self.velocity_mps = detection.true_velocity_mps;
        self.heading_rad = detection.true_heading_rad;
    }
}
