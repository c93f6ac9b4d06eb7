//! The lane changes of the route: the next one, when it is due, and where to wait for it.
//!
//! Whether the other lane is free is each driver's own idea; `corridor` says who is in it.

use std::sync::Arc;

use avastra_road::RouteLaneChange;
use avastra_world::sim::{FRAME_S, Scene, VehicleParameters};

use super::guide::{Guide, SpeedRules};

/// Time for which a lane must have been clear before a change begins, s: a new track takes almost half of it to be published.
/// Apollo waits as long after a failed attempt.
const CLEAR_S: f64 = 1.0;

/// Which changes of the route have begun, and where; and the guide that follows from it.
#[derive(Debug, Clone)]
pub struct RouteChanges {
    scene: Arc<Scene>,
    rules: SpeedRules,
    /// Where each change begins, m; infinite while it has not.
    begins_m: Vec<f64>,
    guide: Arc<Guide>,
    /// For how long the target lane of the next change has been clear, s.
    clear_s: f64,
}

impl RouteChanges {
    pub fn new(scene: &Arc<Scene>, rules: SpeedRules) -> RouteChanges {
        let begins_m = vec![f64::INFINITY; scene.route.changes.len()];
        let guide = Arc::new(Guide::with_changes(scene, &rules, &begins_m));
        RouteChanges { scene: Arc::clone(scene), rules, begins_m, guide, clear_s: 0.0 }
    }

    /// The guide along the lanes that are to be driven now; replaced when a change begins or is taken back.
    pub fn guide(&self) -> &Arc<Guide> {
        &self.guide
    }

    /// The next change, which has not begun yet.
    pub fn next(&self) -> Option<&RouteLaneChange> {
        Some(&self.scene.route.changes[self.next_index()?])
    }

    /// The next change, if it may be made at a station and none is under way there.
    pub fn due(&self, station_m: f64) -> Option<&RouteLaneChange> {
        self.next().filter(|change| station_m >= change.begin_m && !self.is_under_way(station_m))
    }

    /// Begins the next change if it is due and its lane has been clear for [`CLEAR_S`]. To be called every frame with the
    /// vehicle's place and speed; `is_clear` looks at the lane beside the guide.
    pub fn seek(
        &mut self,
        station_m: f64,
        speed_mps: f64,
        is_clear: impl FnOnce(&Guide, &RouteLaneChange) -> bool,
    ) {
        let Some(change) = self.next() else { return };
        let is_soon = station_m >= change.begin_m - speed_mps * CLEAR_S && !self.is_under_way(station_m);
        if !is_soon || !is_clear(&self.guide, change) {
            self.wait();
            return;
        }
        let begins = self.clear_s >= CLEAR_S;
        self.clear_s += FRAME_S;
        if begins {
            self.begin_if_due(station_m);
        }
    }

    /// Begins the next change at a station, m, if it may be made there.
    pub fn begin_if_due(&mut self, station_m: f64) {
        if self.due(station_m).is_some() {
            self.begin(station_m);
        }
    }

    /// The lane is not clear, or an external driving system says that the change has to wait.
    pub fn wait(&mut self) {
        self.clear_s = 0.0;
    }

    /// Begins the next change at a station, m; minus infinity for one that is over.
    pub fn begin(&mut self, station_m: f64) {
        if let Some(index) = self.next_index() {
            self.set(index, station_m);
        }
    }

    /// Whether a change is under way at a station.
    pub fn is_under_way(&self, station_m: f64) -> bool {
        self.begun().any(|(_, change, begin_m)| begin_m <= station_m && station_m < end_m(change, begin_m))
    }

    /// Where the last change that has begun ends, m.
    pub fn last_end_m(&self) -> Option<f64> {
        self.begun().last().map(|(_, change, begin_m)| end_m(change, begin_m))
    }

    /// The changes that have begun: number, change and where it began, m.
    pub fn begun(&self) -> impl Iterator<Item = (usize, &RouteLaneChange, f64)> {
        let all = self.scene.route.changes.iter().zip(&self.begins_m).enumerate();
        all.map(|(index, (change, begin_m))| (index, change, *begin_m))
            .filter(|(_, _, begin_m)| *begin_m < f64::INFINITY)
    }

    /// Takes back the change of a number, which has begun.
    pub fn take_back(&mut self, index: usize) {
        self.set(index, f64::INFINITY);
    }

    fn set(&mut self, index: usize, begin_m: f64) {
        self.begins_m[index] = begin_m;
        self.clear_s = 0.0;
        self.guide = Arc::new(Guide::with_changes(&self.scene, &self.rules, &self.begins_m));
    }

    /// Where the front of the vehicle must wait for the next change, m: a short one is still possible there.
    pub fn wait_m(&self) -> Option<f64> {
        let change = self.next()?;
        Some(VehicleParameters::MKZ.front_m(change.latest_m - RouteLaneChange::LENGTH_M_MIN))
    }

    fn next_index(&self) -> Option<usize> {
        self.begins_m.iter().position(|begin_m| *begin_m == f64::INFINITY)
    }
}

fn end_m(change: &RouteLaneChange, begin_m: f64) -> f64 {
    begin_m + change.length_from_m(begin_m)
}
