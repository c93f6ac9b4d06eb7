//! A road user on a trajectory: its station there, and its orders.

use std::sync::Arc;

use avastra_base::geometry::Path;
use avastra_lang::model::Trajectory;
use avastra_lang::model::body::BodyParameters;

use crate::state::pursuit::EgoKeeps;
use crate::state::trace::traced;

#[derive(Debug, Clone)]
pub struct Guided {
    pub way: Arc<Trajectory>,
    /// Where its rear axle (on foot its middle) is along the way, and to the left of it, m.
    pub station_m: f64,
    pub left_m: f64,
    /// From that point to the middle of its outline, m.
    pub to_middle_m: f64,
    pub speed_mps: f64,
    pub wants_mps: f64,
    /// Infinite: at once.
    pub rate_mps2: f64,
    pub shift: Option<Shift>,
    pub meeting: Option<Meeting>,
    /// By how much it misses the moment of its last `early`, s; below 0 if it is too soon.
    pub late_s: Option<f64>,
}

impl Guided {
    pub fn new(
        way: Arc<Trajectory>,
        station_m: f64,
        left_m: f64,
        speed_mps: f64,
        to_middle_m: f64,
    ) -> Guided {
        Guided {
            way,
            station_m,
            left_m,
            to_middle_m,
            speed_mps,
            wants_mps: speed_mps,
            rate_mps2: f64::INFINITY,
            shift: None,
            meeting: None,
            late_s: None,
        }
    }

    /// The distance from the point of a body that follows the way to the middle of the outline, m.
    pub fn to_middle_m(is_vehicle: bool, size: &BodyParameters) -> f64 {
        if is_vehicle { size.rear_axle_m } else { 0.0 }
    }

    /// Whether it turns at corners of its way without sweeping round them: on foot.
    pub fn turns_on_the_spot(&self) -> bool {
        self.to_middle_m == 0.0
    }

    pub fn is_aside(&self) -> bool {
        self.shift.is_none()
    }

    pub fn has_met(&self) -> bool {
        self.meeting.is_none()
    }

    /// Whether its way is at its end, or backwards at its beginning.
    pub fn is_over(&self) -> bool {
        let end_m = if self.speed_mps.min(self.wants_mps) < 0.0 { 0.0 } else { self.way.path.length_m() };
        self.station_m == end_m
    }

    /// Height of the road where it is, m.
    pub fn height_m(&self) -> f64 {
        self.way.height_at(self.station_m)
    }

    /// The path that it follows, and the station of its middle on it, m.
    pub fn way(&self) -> (&Path, f64) {
        (&self.way.path, self.station_m + self.to_middle_m)
    }

    pub fn station_m(&self) -> f64 {
        self.station_m
    }
}

/// A move to the side, by the smooth step of least jerk.
#[derive(Debug, Clone, Copy)]
pub struct Shift {
    pub from_m: f64,
    pub to_m: f64,
    pub takes_s: f64,
    pub since_s: f64,
}

/// To be at a place when the ego vehicle is at one of its route, or so much earlier.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    /// Where the front of the ego vehicle is then, m along its route.
    pub ego_m: f64,
    pub early_s: f64,
    pub reach_m: f64,
    /// The speed that it has then; without it whatever brings it there.
    pub mps: Option<f64>,
    /// For how long a way before the place it has it already, m.
    pub steady_m: f64,
    pub stage: Stage,
    pub ego_keeps: EgoKeeps,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// It gains speed and loses it again, or the other way round, so that time and way come out right.
    Adapting,
    /// A steady change of speed brings it to the place in time.
    OnLine,
    /// It has the speed with which it arrives.
    Steady,
}

traced!(enum Stage);

traced! {
    Guided {
        station_m, left_m, speed_mps, wants_mps, rate_mps2, shift, meeting
    } but {
        // No tick changes these.
        way, to_middle_m,
        // No tick reads it.
        late_s
    };
    Shift { from_m, to_m, takes_s, since_s };
    // `ego_keeps` moves nothing: only `late_s` depends on it.
    Meeting { ego_m, early_s, reach_m, mps, steady_m, stage } but { ego_keeps };
}
