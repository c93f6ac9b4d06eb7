//! The lines that a vehicle passed last.

use avastra_base::geometry::OrientedBox;
use avastra_road::{LaneIndex, RoadMap, SignKind};

use crate::state::trace::traced;

/// The state of a light as a vehicle passed it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    Free,
    /// Yellow for so long that the vehicle could have stopped.
    LateYellow,
    Red,
}

/// The light at the stop line that a vehicle passed last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedLight {
    pub signal: usize,
    pub shown: Shown,
}

/// The stop sign that a vehicle passed last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassedSign {
    pub lane: LaneIndex,
    /// Since when it stood before the line, ticks; `None` if it did not stand.
    pub stood: Option<u64>,
}

/// A stop of a vehicle, from its first tick to its last; it may have inched up in between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    pub from: u64,
    pub to: u64,
    /// How far it has gone since each of the two, m.
    pub gone_m: [f64; 2],
}

/// The lines that a vehicle passed last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Passed {
    pub light: Option<PassedLight>,
    pub sign: Option<PassedSign>,
    pub stand: Option<Stand>,
}

impl Passed {
    /// Whether the light was red, and the body is still in the junction behind it.
    pub fn is_running_red(&self, map: &RoadMap, outline: &OrientedBox) -> bool {
        self.light.is_some_and(|light| light.shown == Shown::Red && light.is_at(map, outline))
    }

    /// As [`Passed::is_running_red`], for a late yellow light, too, and for a stop sign that was passed without standing.
    pub fn is_running_signal(&self, map: &RoadMap, outline: &OrientedBox) -> bool {
        let light = self.light.filter(|light| light.shown != Shown::Free);
        light.is_some_and(|light| light.is_at(map, outline)) || self.is_running_stop(map, outline)
    }

    /// Whether the vehicle passed a stop sign without having stood, and is still in the junction behind it.
    pub fn is_running_stop(&self, map: &RoadMap, outline: &OrientedBox) -> bool {
        let Some(PassedSign { lane, stood: None }) = self.sign else { return false };
        let here = map.nearest(outline.pose.position, outline.pose.heading_rad, 0.0);
        let is_before = |here: LaneIndex| here == lane || map.approach(here).any(|before| before == lane);
        here.is_some_and(|here| is_before(here.lane))
    }

    /// The stop sign before a lane in a junction.
    pub fn stop_before(&self, lane: LaneIndex, map: &RoadMap) -> Stop {
        let has_stop =
            |lane: LaneIndex| map.lane(lane).sign_lines.iter().any(|line| line.kind == SignKind::Stop);
        if !map.approach(lane).any(has_stop) {
            return Stop::None;
        }
        let passed = self.sign.filter(|sign| map.approach(lane).any(|approach| approach == sign.lane));
        passed.map_or(Stop::Ahead, |sign| sign.stood.map_or(Stop::Ran, Stop::Stood))
    }
}

impl PassedLight {
    /// Whether a body is still in the junction behind it.
    fn is_at(&self, map: &RoadMap, outline: &OrientedBox) -> bool {
        let here = map.nearest(outline.pose.position, outline.pose.heading_rad, 0.0);
        let junction = map.signals[self.signal].junction;
        junction.is_some() && here.is_some_and(|here| map.lane(here.lane).junction == junction)
    }
}

/// How a vehicle stands to the stop sign of its approach.
pub enum Stop {
    None,
    /// It has not passed it yet.
    Ahead,
    Ran,
    /// It stood before it, since this tick.
    Stood(u64),
}

traced!(enum Shown);

traced! {
    // The facts about signs follow from what was traced before.
    Passed { light } but { sign, stand };
    PassedLight { signal, shown };
}
