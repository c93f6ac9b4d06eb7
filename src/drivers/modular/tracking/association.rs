//! Which detection belongs to which track: greedy nearest neighbours within a gate.
//!
//! Detections carry no identity. Pairs are taken in the order of their Mahalanobis distance, so two objects
//! that pass near each other may swap their tracks, and an object that was lost may take over the track of
//! another. Apollo solves an assignment problem (Hungarian) over a distance with the same gate; greedy choice
//! differs from it only where several objects are within reach of several tracks.

use super::super::config::TrackingConfig;
use super::super::perception::Detection;
use super::track::Track;

/// Chi squared of two degrees of freedom at 99 %.
const GATE: f64 = 9.21;

/// Finds pairs; its buffers are kept.
#[derive(Debug, Clone, Default)]
pub struct Association {
    /// Distance, track and detection of each possible pair.
    pairs: Vec<(f64, usize, usize)>,
    /// For each detection the index of its track.
    found: Vec<Option<usize>>,
    taken: Vec<bool>,
}

impl Association {
    /// For each detection the index of the track that it belongs to, or `None` if it begins a new one.
    pub fn find(
        &mut self,
        config: &TrackingConfig,
        tracks: &[Track],
        detections: &[Detection],
    ) -> &[Option<usize>] {
        self.found.clear();
        if config.perfect {
            let of = |detection: &Detection| tracks.iter().position(|track| track.truth == detection.truth);
            self.found.extend(detections.iter().map(of));
            return &self.found;
        }
        self.pairs.clear();
        for (index, detection) in detections.iter().enumerate() {
            for (number, track) in tracks.iter().enumerate() {
                let off = detection.pose.position - track.position;
                // Cheaper than the gate, and true of most pairs.
                if off.x.abs() > config.gate_m || off.y.abs() > config.gate_m {
                    continue;
                }
                let distance = track.mahalanobis2(detection);
                let alike = track.body.is_vehicle() == detection.body.is_vehicle();
                if alike && distance <= GATE && off.norm() <= config.gate_m {
                    self.pairs.push((distance, number, index));
                }
            }
        }
        self.pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        self.found.resize(detections.len(), None);
        self.taken.clear();
        self.taken.resize(tracks.len(), false);
        for &(_, number, index) in &self.pairs {
            if !self.taken[number] && self.found[index].is_none() {
                self.taken[number] = true;
                self.found[index] = Some(number);
            }
        }
        &self.found
    }
}
