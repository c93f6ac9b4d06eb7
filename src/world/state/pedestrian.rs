//! A pedestrian or an animal that crosses the road.

use avastra_base::geometry::{Pose, Vec2};

use crate::state::trace::traced;

/// The behaviour of a pedestrian when a vehicle comes near.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    Steady,
    Hesitant,
    Startled,
    Hurried,
}

/// A meeting with the ego vehicle's front at a point of its width.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    /// Station of the route at which the front then is, m.
    pub station_m: f64,
    /// Way from the kerb to that point of a vehicle in the middle of the route, m.
    pub way_m: f64,
    pub comes_from_left: bool,
}

/// A walk over a road.
#[derive(Debug, Clone, Copy)]
pub struct Walk {
    /// To be met at a point, rather than in the middle and for any manner.
    pub meeting: Option<Meeting>,
    /// How long it waits at the kerb, s, rather than for a meeting.
    pub waits_s: Option<f64>,
    /// Where it begins, facing its end.
    pub from: Pose,
    /// From kerb to kerb, m.
    pub way_m: f64,
    /// How far it goes on behind the other kerb, m.
    pub beyond_m: f64,
    pub speed_mps: f64,
    /// Time after which setting out leads to a meeting with the ego vehicle, s. Negative if it is too late.
    pub meets_s: f64,
}

#[derive(Debug, Clone)]
pub struct Walker {
    /// The meeting for which it waits at the kerb.
    pub meeting: Option<Meeting>,
    pub from: Pose,
    /// Unit vector along the way.
    pub along: Vec2,
    /// From the beginning to the other kerb, and to where the walk ends, m.
    pub way_m: f64,
    pub end_m: f64,
    pub speed_mps: f64,
    pub manner: Manner,
    /// How long a startled pedestrian stops, ticks; 0 once it has stopped.
    pub startle_ticks: u32,
    /// Distance from the beginning, m, and offset to the left of the straight line, m.
    pub walked_m: f64,
    pub aside_m: f64,
    /// Whether it walks back to where it began.
    pub returns: bool,
    /// Whether it was told its speed, and stands if that is 0.
    pub is_told: bool,
    /// Whether it looks in the next tick, because it was just told something.
    pub looks_now: bool,
    /// Pace and offset that it wants since its last look.
    pub pace_mps: f64,
    pub wants_aside_m: f64,
    /// Tick of the first step; later while a vehicle holds it back.
    pub begins_tick: u64,
    /// Latest tick of the first step.
    pub begins_tick_max: u64,
    /// Ticks without a way on.
    pub stuck_ticks: u32,
}

impl Walker {
    /// How fast it goes on, m/s; below 0 back to where it began.
    pub fn pace_mps(&self) -> f64 {
        if self.returns { -self.pace_mps } else { self.pace_mps }
    }

    /// Whether its walk is over, this way or back.
    pub fn is_over(&self) -> bool {
        if self.returns { self.walked_m <= 0.0 } else { self.walked_m >= self.end_m }
    }
}

traced!(enum Manner);

traced! {
    Walker {
        meeting, from, way_m, end_m, speed_mps, manner, startle_ticks, walked_m, aside_m, returns, is_told, looks_now, pace_mps,
        wants_aside_m, begins_tick, begins_tick_max, stuck_ticks
    } but {
        // It follows from where it began.
        along
    };
    Meeting { station_m, way_m, comes_from_left };
}
