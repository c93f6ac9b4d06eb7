//! Tracks out of detections, when a track is published, and how late it is used.
//!
//! As Apollo's fusion: detections are associated with tracks by distance within a gate, each track is a Kalman
//! filter, and a track is published once it has had more than three detections, in a row or not. Detections
//! carry no identity, so tracks can swap. Of two tracks in one place the younger is taken for a duplicate, so
//! objects that touch can merge. A large vehicle that is detected in parts splits.
//!
//! A track that is not seen any more is dropped soon. One that stands near by is held, because nothing that
//! stands is gone by not being detected: the vehicle does not drive onto a place that was taken a moment ago
//! before it has seen the place empty.

mod association;
mod track;

use std::collections::VecDeque;

use avastra_base::geometry::Vec2;
use avastra_world::sim::FRAME_S;

use self::association::Association;
use super::config::{LOAD_FRAMES_MAX, TrackingConfig};
use super::perception::Detection;

pub use track::Track;

/// How long a perfect tracker remembers what it saw, s.
const PERFECT_RESERVE_S: f64 = 5.0;

#[derive(Debug, Clone)]
pub struct Tracking {
    config: TrackingConfig,
    frames_to_publish: u32,
    latency_frames: usize,
    /// How many frames later still the tracks are used now.
    load_frames: usize,
    /// Number of tracks begun so far.
    begun: u32,
    tracks: Vec<Track>,
    association: Association,
    /// Published tracks of the last frames, newest last.
    published: VecDeque<Vec<Track>>,
}

impl Tracking {
    /// `late` is the weakness `late_unstable_tracks`: a track must last before it is published.
    pub fn new(config: &TrackingConfig, late: bool, latency_frames: u32) -> Tracking {
        let frames_to_publish = if late && !config.perfect { config.frames_to_publish } else { 1 };
        Tracking {
            config: *config,
            frames_to_publish,
            latency_frames: latency_frames as usize,
            load_frames: 0,
            begun: 0,
            tracks: Vec::new(),
            association: Association::default(),
            published: VecDeque::new(),
        }
    }

    /// Sets how many frames later than usual tracks are used from now on: perception is late under load.
    pub fn delay(&mut self, load_frames: usize) {
        self.load_frames = load_frames.min(LOAD_FRAMES_MAX);
    }

    /// Forgets all tracks if the last frame was `since_s` ago and that is longer than a moving one is reserved.
    pub fn resume(&mut self, since_s: f64) {
        if since_s > FRAME_S + self.config.reserve_s {
            self.tracks.clear();
            self.published.clear();
        }
    }

    /// One frame of detections. `may_be_taken` says of a place whether it is near enough to be held, and was not
    /// seen empty: asked only for tracks that stand and were not detected.
    pub fn update(&mut self, detections: &[Detection], may_be_taken: impl Fn(Vec2) -> bool) {
        for track in &mut self.tracks {
            track.advance(&self.config);
        }
        let found = self.association.find(&self.config, &self.tracks, detections);
        for (detection, index) in detections.iter().zip(found) {
            let track = match index {
                Some(index) => {
                    self.tracks[*index].correct(detection);
                    &mut self.tracks[*index]
                }
                None => {
                    self.begun += 1;
                    self.tracks.push(Track::begin(self.begun, detection));
                    self.tracks.last_mut().expect("it was just added")
                }
            };
            if self.config.perfect {
                track.know(detection);
            }
        }
        let frames_to_publish = self.frames_to_publish;
        let config = &self.config;
        let reserve_s = if config.perfect { PERFECT_RESERVE_S } else { config.reserve_s };
        self.tracks.retain_mut(|track| {
            track.published |= track.frames >= frames_to_publish;
            if track.unseen_s <= reserve_s + 1e-9 {
                return true;
            }
            let held = !config.perfect && stands(track, config) && may_be_taken(track.centre());
            if held {
                track.stay();
            }
            held
        });
        if !self.config.perfect {
            self.drop_duplicates();
        }
        // The oldest list is overwritten: after the first frames nothing is allocated.
        let mut newest = if self.published.len() > self.latency_frames + LOAD_FRAMES_MAX {
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

    /// Drops every track whose centre lies in the outline of one that has been seen more often. One that is held
    /// yields to one that is seen.
    fn drop_duplicates(&mut self) {
        let (room_m, reserve_s) = (self.config.duplicate_m, self.config.reserve_s);
        let rank = |track: &Track| (track.unseen_s <= reserve_s + 1e-9, track.frames);
        let mut index = 0;
        while index < self.tracks.len() {
            let own = &self.tracks[index];
            let is_duplicate = self.tracks.iter().enumerate().any(|(number, other)| {
                // Cheaper than the rest, and true of most pairs.
                if other.is_far_from(own, room_m) {
                    return false;
                }
                let older = (rank(other), own.id) > (rank(own), other.id);
                number != index
                    && older
                    && own.body.is_vehicle() == other.body.is_vehicle()
                    && other.holds(own.centre(), room_m)
            });
            if is_duplicate {
                self.tracks.remove(index);
            } else {
                index += 1;
            }
        }
    }

    /// No track is held farther away than this, m.
    pub fn hold_m(&self) -> f64 {
        self.config.hold_m
    }

    /// The tracks that are used now: those of some frames ago.
    pub fn published(&self) -> &[Track] {
        let newest = self.published.len().checked_sub(1 + self.latency_frames + self.load_frames);
        newest.map_or(&[], |index| &self.published[index])
    }

    /// Age of the tracks that are used now, s.
    pub fn age_s(&self) -> f64 {
        (self.latency_frames + self.load_frames) as f64 * FRAME_S
    }
}

/// Whether a track shows for certain something that stands, so that it may be held though unseen.
fn stands(track: &Track, config: &TrackingConfig) -> bool {
    track.published
        && track.unseen_s <= config.hold_s + 1e-9
        && f64::from(track.frames)
            >= config.hold_seen_min * (f64::from(track.age_frames) - track.unseen_s / FRAME_S)
        && track.velocity_mps.norm() <= config.hold_mps_max
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;

    fn car(x_m: f64) -> Detection {
        Detection {
            truth: 7,
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

    /// An undetected object was not near enough to be held, or its place was seen empty.
    fn gone(_: Vec2) -> bool {
        false
    }

    /// Frame (from 1) in which something is first published.
    fn first_published(tracking: &mut Tracking) -> u32 {
        let published = |frame: &u32| {
            tracking.update(&[car(0.8 * f64::from(*frame))], gone);
            !tracking.published().is_empty()
        };
        (1..60).find(published).expect("in the end it is published")
    }

    #[test]
    fn late_tracks_and_latency_each_delay_the_first_sight() {
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
                tracking.update(&[car(30.0 + 0.8 * f64::from(frame))], gone);
            }
            let velocity_mps = tracking.published()[0].velocity_mps;
            let error_mps = (velocity_mps - Vec2::new(8.0, 0.0)).norm();
            assert!(if config.perfect { error_mps == 0.0 } else { error_mps < 0.2 }, "{velocity_mps}");
            for miss in 1..=misses + 1 {
                tracking.update(&[], gone);
                assert_eq!(tracking.published().len(), usize::from(miss <= misses), "miss {miss}");
            }
        }
    }

    fn walker(truth: u32, x_m: f64, y_m: f64) -> Detection {
        Detection {
            truth,
            body: Body::Pedestrian,
            pose: Pose::new(x_m, y_m, 0.0),
            length_m: 0.5,
            width_m: 0.5,
            ..car(0.0)
        }
    }

    #[test]
    fn detections_count_whether_in_a_row_or_not() {
        let mut tracking = Tracking::new(&TrackingConfig::default(), true, 0);
        for frame in 0..7 {
            let seen = [walker(1, 10.0, 2.0)];
            tracking.update(&seen[..usize::from(frame % 2 == 0)], gone);
            assert_eq!(tracking.published().len(), usize::from(frame == 6), "frame {frame}");
        }
    }

    /// The objects that the two tracks of two pedestrians show before and after they have met halfway. They
    /// walk towards each other, past each other at `aside_m`, and are out of sight while they pass.
    fn met(config: &TrackingConfig, aside_m: f64) -> (Vec<u32>, Vec<u32>) {
        let mut tracking = Tracking::new(config, true, 0);
        let mut before = Vec::new();
        for frame in 0..60 {
            let way_m = 0.13 * f64::from(frame);
            let both = [walker(1, way_m, 0.0), walker(2, 7.67 - way_m, aside_m)];
            // The one turns back where they meet, which the tracks do not expect.
            let turned = frame > 28;
            let both = if turned { [walker(2, way_m, 0.0), walker(1, 7.67 - way_m, aside_m)] } else { both };
            tracking.update(&both, gone);
            if frame == 20 {
                before = tracking.published().iter().map(|track| track.truth).collect();
            }
        }
        (before, tracking.published().iter().map(|track| track.truth).collect())
    }

    #[test]
    fn pedestrians_who_meet_and_turn_swap_their_tracks_unless_it_is_perfect() {
        let (before, after) = met(&TrackingConfig::default(), 0.9);
        assert_eq!((before, after), (vec![1, 2], vec![2, 1]));
        let (before, after) = met(&TrackingConfig { perfect: true, ..TrackingConfig::default() }, 0.9);
        assert_eq!(before, after);
    }

    #[test]
    fn what_is_in_one_place_is_one_track() {
        let published = |config: &TrackingConfig, apart_m: f64| {
            let mut tracking = Tracking::new(config, true, 0);
            for _ in 0..10 {
                tracking.update(&[walker(1, 10.0, 2.0), walker(2, 10.0, 2.0 + apart_m)], gone);
            }
            tracking.published().len()
        };
        let default = TrackingConfig::default();
        assert_eq!([published(&default, 0.2), published(&default, 1.0)], [1, 2]);
        assert_eq!(published(&TrackingConfig { perfect: true, ..default }, 0.2), 2);
    }

    /// For how many frames of 100 a car that was seen at `moves` from frame to frame is known once it is not
    /// detected any more, and the way that its track goes meanwhile, m.
    fn known(moves_m: f64, seen: impl Fn(u32) -> bool, empty_from: u32) -> (u32, f64) {
        let mut tracking = Tracking::new(&TrackingConfig::default(), true, 0);
        let at = |frame: u32| car(10.0 + moves_m * f64::from(frame));
        for frame in 0..30 {
            let detected = [at(frame)];
            tracking.update(&detected[..usize::from(seen(frame))], |_| true);
        }
        let begin = tracking.published()[0].centre();
        let mut last = begin;
        let known = (0..100).filter(|frame| {
            tracking.update(&[], |_| *frame < empty_from);
            last = tracking.published().first().map_or(last, Track::centre);
            !tracking.published().is_empty()
        });
        (known.count() as u32, (last - begin).norm())
    }

    #[test]
    fn what_stands_near_by_is_held_until_its_place_is_seen_empty() {
        let (frames, way_m) = known(0.0, |_| true, 100);
        assert_eq!(frames, 50, "five seconds");
        assert!(way_m < 0.2, "{way_m}");
        assert_eq!(known(0.0, |_| true, 20).0, 20, "its place is seen empty");
        assert_eq!(known(0.0, |_| true, 0).0, 3, "no more than reserved");
        assert_eq!(known(0.5, |_| true, 100).0, 3, "it moves");
        assert_eq!(known(0.0, |frame| frame % 2 == 1, 100).0, 3, "it is seldom seen");
    }

    #[test]
    fn what_was_held_and_drives_on_is_one_track() {
        let mut tracking = Tracking::new(&TrackingConfig::default(), true, 0);
        (0..30).for_each(|_| tracking.update(&[car(10.0)], |_| true));
        (0..10).for_each(|_| tracking.update(&[], |_| true));
        for frame in 0..40 {
            tracking.update(&[car(11.0 + 0.5 * f64::from(frame))], |_| true);
        }
        let [track] = tracking.published() else { panic!("{:?}", tracking.published()) };
        assert!((track.velocity_mps.x - 5.0).abs() < 0.3, "{track:?}");
    }
}
