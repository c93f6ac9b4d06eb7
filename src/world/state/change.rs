//! The lateral moves of a driver: a lane change that is planned or under way, and an offset from the middle of its
//! lane.

use std::sync::Arc;

use avastra_base::geometry::{Pose, Vec2, smooth_step, unit_vector};
use avastra_lang::model::command::AsideBy;
use avastra_lang::model::vocabulary::{LaneChoice, Side};

use crate::scene::way::Way;
use crate::state::trace::{Trace, Traced, traced};

/// Below this speed a lane change slows down with the vehicle, which cannot slide sideways, m/s.
pub const CHANGE_FULL_MPS: f64 = 5.0;

/// A lane change that waits for its occasion.
#[derive(Debug, Clone)]
pub struct PlannedChange {
    pub when: When,
    pub towards: Towards,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// From this tick on.
    Tick(u64),
    /// When its rear is this far in front of the ego vehicle's front, m.
    AheadOfEgo(f64),
}

#[derive(Debug, Clone)]
pub enum Towards {
    To(Side),
    /// Left if that lane is there and free, else right.
    Either,
    /// Opposite to the change before.
    Back,
    Way(Arc<Way>),
}

/// A lane change under way.
#[derive(Debug, Clone)]
pub struct Change {
    pub to: Arc<Way>,
    pub to_station_m: f64,
    /// In `[0, 1)`.
    pub progress: f64,
    pub duration_s: f64,
    /// Where it ends, m to the left of the middle of the lane that it leads into.
    pub ends_m: f64,
    /// The change that it breaks off, and which it leads back from.
    pub broken_off: Option<BrokenOff>,
}

impl Change {
    /// The part of the change that is done on each metre of the way, at a speed.
    pub fn progress_per_m(&self, speed_mps: f64) -> f64 {
        per_m(speed_mps, self.duration_s)
    }

    /// The part of the way to the side that lies behind it when it has driven on. Two smooth steps against each other begin
    /// and end without a slope or a bend, wherever the second one begins.
    pub fn done_after(&self, way_m: f64, speed_mps: f64) -> f64 {
        let part = smooth_step(self.progress + self.progress_per_m(speed_mps) * way_m).value;
        self.broken_off.map_or(part, |first| {
            part + 1.0 - smooth_step(first.progress + per_m(speed_mps, first.duration_s) * way_m).value
        })
    }

    /// How far to the side it gets on each metre, if all of it is `over_m`.
    pub fn slope(&self, over_m: f64, speed_mps: f64) -> f64 {
        let slope = over_m * smooth_step(self.progress).slope * self.progress_per_m(speed_mps);
        self.broken_off.map_or(slope, |first| {
            slope - over_m * smooth_step(first.progress).slope * per_m(speed_mps, first.duration_s)
        })
    }

    pub fn advance(&mut self, way_m: f64, speed_mps: f64) {
        self.progress += self.progress_per_m(speed_mps) * way_m;
        self.broken_off
            .iter_mut()
            .for_each(|first| first.progress += per_m(speed_mps, first.duration_s) * way_m);
    }

    pub fn is_over(&self) -> bool {
        self.progress >= 1.0 && self.broken_off.is_none_or(|first| first.progress >= 1.0)
    }
}

/// The rest of an aborted change. The change swings to its end, while the move back undoes it.
#[derive(Debug, Clone, Copy)]
pub struct BrokenOff {
    /// From where it was broken off; above 1 it is over.
    pub progress: f64,
    pub duration_s: f64,
}

/// The part of a move to the side of this duration that is done on each metre of the way, at a speed.
pub fn per_m(speed_mps: f64, duration_s: f64) -> f64 {
    1.0 / (speed_mps.max(CHANGE_FULL_MPS) * duration_s)
}

/// Where a driver was told to be, and where it is.
#[derive(Debug, Clone, Default)]
pub struct Aside {
    /// The lane that it has still to change to.
    pub lane: Option<LaneChoice>,
    /// Whether it was told that lane during a change, which it breaks off if it leaves that lane by it.
    pub was_told_midway: bool,
    /// m to the left of the middle of its lane.
    pub wanted_m: f64,
    pub now_m: f64,
    /// The ordered speed or duration of the move; without it the driver moves as in a lane change by itself.
    pub told: Option<AsideBy>,
    pub shift: Option<Shift>,
}

/// A move to another place beside the middle of the lane.
#[derive(Debug, Clone, Copy)]
pub struct Shift {
    pub from_m: f64,
    pub to_m: f64,
    /// In `[0, 1)`.
    pub progress: f64,
    pub duration_s: f64,
}

impl Aside {
    pub fn after_m(&self, way_m: f64, speed_mps: f64) -> f64 {
        match &self.shift {
            None => self.now_m,
            Some(Shift { from_m, to_m, progress, duration_s }) => {
                let progress = progress + per_m(speed_mps, *duration_s) * way_m.max(0.0);
                from_m + (to_m - from_m) * smooth_step(progress).value
            }
        }
    }
}

/// A pose so far to the left of another one, m; the same to the bit at 0 m.
#[inline]
pub fn beside(pose: Pose, left_m: f64) -> Pose {
    if left_m == 0.0 {
        return pose;
    }
    Pose { position: pose.position + left_of(pose.heading_rad) * left_m, ..pose }
}

pub fn left_of(heading_rad: f64) -> Vec2 {
    let forward = unit_vector(heading_rad);
    Vec2::new(-forward.y, forward.x)
}

traced! {
    // The way that it leads to follows from the lane that it leaves and the side.
    Change { to_station_m, progress, duration_s, ends_m, broken_off } but { to };
    BrokenOff { progress, duration_s };
    Aside { was_told_midway, lane, wanted_m, now_m, told, shift };
    Shift { from_m, to_m, progress, duration_s };
}

impl Traced for AsideBy {
    fn trace(&self, trace: &mut Trace) {
        match self {
            AsideBy::Speed(mps) => (0_u64, *mps).trace(trace),
            AsideBy::Time(takes_s) => (1_u64, *takes_s).trace(trace),
        }
    }
}
