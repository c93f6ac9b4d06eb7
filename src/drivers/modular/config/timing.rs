//! Settings of time: how late modules are, and what watches that.

use avastra_world::section;
use avastra_world::sim::FRAME_S;

section! {
    /// Latency under load, modules that hang, and the watchdog that notices.
    pub struct LatencyConfig {
        /// Objects within reach of the sensors that perception handles within its usual latency, in `[0, 1000]`. Ours: a busy street.
        budget_objects: u32 = 12, 0.0..=1000.0;
        /// What each object more adds to the latency, s, in `[0, 1]`; whole frames are used. Ours: ten objects add a frame.
        per_object_s: f64 = 0.01, 0.0..=1.0;
        /// Localisation stops for so long at a time, s, in `[0, 60]`. A fault to plant: never by default.
        localization_hang_s: f64 = 0.0, 0.0..=60.0;
        /// Perception stops for so long at a time, s, in `[0, 60]`. A fault to plant: never by default.
        perception_hang_s: f64 = 0.0, 0.0..=60.0;
        /// Planning stops for so long at a time, s, in `[0, 60]`. A fault to plant: never by default.
        planning_hang_s: f64 = 0.0, 0.0..=60.0;
        /// From the beginning of one such time to that of the next, s, in `[0.1, 1000]`. Ours.
        hang_every_s: f64 = 10.0, 0.1..=1000.0;
        /// Whether late modules are noticed, and braked for until they are back: the degraded mode. Off is a fault to plant.
        watchdog: bool = true;
        /// A pose may be so old, s, in `[0, 60]`. Apollo's control, `max_localization_miss_num`: 20 cycles of 0.01.
        localization_s_max: f64 = 0.2, 0.0..=60.0;
        /// The last look may be so old, s, in `[0, 60]`. Ours: five frames.
        perception_s_max: f64 = 0.5, 0.0..=60.0;
        /// A trajectory may be so old, s, in `[0, 60]`. Apollo's control, `max_planning_miss_num`: 20 cycles of 0.1.
        trajectory_s_max: f64 = 2.0, 0.0..=60.0;
        /// Brake of the degraded mode, %, in `[0, 100]`. Apollo `soft_estop_brake`: 50.
        brake_pct: f64 = 50.0, 0.0..=100.0;
    }
}

/// Under the heaviest load perception is later by no more frames than this.
pub const LOAD_FRAMES_MAX: usize = 5;

impl LatencyConfig {
    /// By how many frames perception is late with this number of objects within reach.
    pub fn load_frames(&self, objects: usize) -> usize {
        let excess = objects.saturating_sub(self.budget_objects as usize) as f64;
        ((excess * self.per_object_s / FRAME_S + 0.5) as usize).min(LOAD_FRAMES_MAX)
    }
}
