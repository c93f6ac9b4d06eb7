//! Tracks out of detections, when a track is published, and how late it is used.
//!
//! As Apollo's fusion: a Kalman filter of constant velocity for each object, the two axes alike; no
//! turn rate is estimated, headings are smoothed. A track is published in its fourth frame in a row.
//! Detections come with the identity of what they show, so association cannot err.

use std::collections::VecDeque;

use crate::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use crate::model::vocabulary::Body;
use crate::sim::FRAME_S;

use super::config::TrackingConfig;
use super::perception::Detection;

/// Standard deviation of a velocity that is not measured yet, m/s.
const UNKNOWN_VELOCITY_MPS: f64 = 10.0;
/// Part of a new heading that the track takes over in a frame.
const HEADING_GAIN: f64 = 0.4;
/// How long a perfect tracker remembers what it saw, s.
const PERFECT_RESERVE_S: f64 = 5.0;

#[derive(Debug, Clone)]
pub struct Tracking {
    config: TrackingConfig,
    frames_to_publish: u32,
    latency_frames: usize,
    tracks: Vec<Track>,
    /// Published tracks of the last frames, newest last.
    published: VecDeque<Vec<Track>>,
}

/// An object that was detected at least once and not lost since.
#[derive(Debug, Clone, Copy)]
pub struct Track {
    pub id: u32,
    pub body: Body,
    /// Centre of the whole object. For the centre of a part that is taken for the whole, see [`Track::centre`].
    position: Vec2,
    pub velocity_mps: Vec2,
    pub heading_rad: f64,
    /// From `position` to the centre of what was last seen, along the heading, m.
    shift_m: f64,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    covariance: Covariance,
    frames_in_row: u32,
    published: bool,
    unseen_s: f64,
}

/// Covariance of position and velocity, alike along both axes.
#[derive(Debug, Clone, Copy)]
struct Covariance {
    position: f64,
    mixed: f64,
    velocity: f64,
}

impl Tracking {
    /// `late` is weakness (a): a track must last before it is published.
    pub fn new(config: &TrackingConfig, late: bool, latency_frames: u32) -> Tracking {
        let frames_to_publish = if late && !config.perfect { config.frames_to_publish } else { 1 };
        Tracking {
            config: *config,
            frames_to_publish,
            latency_frames: latency_frames as usize,
            tracks: Vec::new(),
            published: VecDeque::new(),
        }
    }

    /// One frame of detections.
    pub fn update(&mut self, detections: &[Detection]) {
        for track in &mut self.tracks {
            track.unseen_s += FRAME_S;
            track.advance(&self.config);
        }
        for detection in detections {
            let known = self.tracks.iter_mut().find(|track| track.id == detection.id);
            match known {
                Some(track) => track.correct(detection),
                None => self.tracks.push(Track::begin(detection)),
            }
            if self.config.perfect {
                let track = self.tracks.iter_mut().find(|track| track.id == detection.id);
                track.expect("it was begun above").know(detection);
            }
        }
        let frames_to_publish = self.frames_to_publish;
        let reserve_s = if self.config.perfect { PERFECT_RESERVE_S } else { self.config.reserve_s };
        self.tracks.retain_mut(|track| {
            if track.unseen_s > 0.0 {
                track.frames_in_row = 0;
            } else if track.frames_in_row >= frames_to_publish {
                track.published = true;
            }
            // A track not yet published has nothing to reserve.
            if track.published { track.unseen_s <= reserve_s + 1e-9 } else { track.unseen_s <= 0.0 }
        });
        // The oldest list is overwritten: after the first frames nothing is allocated.
        let mut newest = if self.published.len() > self.latency_frames {
            self.published.pop_front().expect("it is longer than nothing")
        } else {
            Vec::new()
        };
        newest.clear();
        newest.extend(self.tracks.iter().filter(|track| track.published));
        for track in &mut newest {
            track.velocity_mps *= self.config.velocity_factor;
        }
        self.published.push_back(newest);
    }

    /// The tracks that are used now: those of `latency_frames` ago.
    pub fn published(&self) -> &[Track] {
        match self.published.len() > self.latency_frames {
            true => &self.published[0],
            false => &[],
        }
    }

    /// Age of the tracks that are used now, s.
    pub fn age_s(&self) -> f64 {
        self.latency_frames as f64 * FRAME_S
    }
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

    /// A published track of a known state.
    #[cfg(test)]
    pub fn for_tests(id: u32, body: Body, pose: Pose, velocity_mps: Vec2) -> Track {
        let (length_m, width_m, height_m, sigma_m) = (4.7, 1.9, 1.5, 0.1);
        let detection = Detection {
            id,
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
        Track { velocity_mps, published: true, ..Track::begin(&detection) }
    }

    fn begin(detection: &Detection) -> Track {
        let Pose { position, heading_rad } = detection.pose;
        Track {
            id: detection.id,
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
            frames_in_row: 1,
            published: false,
            unseen_s: 0.0,
        }
    }

    /// One frame on, at constant velocity.
    fn advance(&mut self, config: &TrackingConfig) {
        let sigma_mps2 = if self.body.is_vehicle() {
            config.vehicle_acceleration_sigma_mps2
        } else {
            config.pedestrian_acceleration_sigma_mps2
        };
        // An acceleration that is constant over the frame, of that deviation.
        let (by_position, by_velocity) = (FRAME_S * FRAME_S / 2.0 * sigma_mps2, FRAME_S * sigma_mps2);
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

    fn correct(&mut self, detection: &Detection) {
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
        self.body = detection.body;
        self.shift_m = detection.shift_m;
        self.length_m = detection.length_m;
        self.width_m = detection.width_m;
        self.height_m = detection.height_m;
        self.frames_in_row += 1;
        self.unseen_s = 0.0;
    }

    /// Takes over what only an idealised tracker is told, and the position as detected.
    fn know(&mut self, detection: &Detection) {
        self.position = detection.pose.position;
        self.velocity_mps = detection.true_velocity_mps;
        self.heading_rad = detection.true_heading_rad;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn car(x_m: f64) -> Detection {
        Detection {
            id: 7,
            body: Body::SUV,
            pose: Pose::new(x_m, 2.0, 0.0),
            shift_m: 0.0,
            length_m: 4.7,
            width_m: 1.9,
            height_m: 1.7,
            sigma_m: 0.1,
            true_velocity_mps: Vec2::new(8.0, 0.0),
            true_heading_rad: 0.0,
        }
    }

    /// Frame (from 1) in which something is first published.
    fn first_published(tracking: &mut Tracking) -> u32 {
        let published = |frame: &u32| {
            tracking.update(&[car(0.8 * f64::from(*frame))]);
            !tracking.published().is_empty()
        };
        (1..60).find(published).expect("in the end it is published")
    }

    #[test]
    fn weakness_a_and_latency_each_delay_the_first_sight() {
        let config = TrackingConfig::default();
        let first = |late, latency_frames| first_published(&mut Tracking::new(&config, late, latency_frames));
        assert_eq!([first(true, 0), first(false, 0), first(true, 1), first(false, 5)], [4, 1, 5, 6]);
        let slow = TrackingConfig { frames_to_publish: 15, ..config };
        assert_eq!(first_published(&mut Tracking::new(&slow, true, 0)), 15);
        let perfect = TrackingConfig { perfect: true, ..slow };
        assert_eq!(first_published(&mut Tracking::new(&perfect, true, 0)), 1);
    }

    #[test]
    fn a_track_learns_the_velocity_and_outlives_three_misses() {
        for (config, misses) in [
            (TrackingConfig::default(), 3),
            (TrackingConfig { reserve_s: 1.0, ..TrackingConfig::default() }, 10),
            (TrackingConfig { perfect: true, ..TrackingConfig::default() }, 50),
        ] {
            let mut tracking = Tracking::new(&config, true, 0);
            for frame in 0..20 {
                tracking.update(&[car(30.0 + 0.8 * f64::from(frame))]);
            }
            let velocity_mps = tracking.published()[0].velocity_mps;
            let error_mps = (velocity_mps - Vec2::new(8.0, 0.0)).norm();
            assert!(if config.perfect { error_mps == 0.0 } else { error_mps < 0.2 }, "{velocity_mps}");
            for miss in 1..=misses + 1 {
                tracking.update(&[]);
                assert_eq!(tracking.published().len(), usize::from(miss <= misses), "miss {miss}");
            }
        }
    }

    #[test]
    fn a_planted_fault_scales_the_velocity() {
        let config = TrackingConfig { velocity_factor: 0.0, ..TrackingConfig::default() };
        let mut tracking = Tracking::new(&config, true, 0);
        (0..20).for_each(|frame| tracking.update(&[car(0.8 * f64::from(frame))]));
        assert_eq!(tracking.published()[0].velocity_mps, Vec2::zeros());
    }
}
