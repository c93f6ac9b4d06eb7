//! A pedestrian or an animal that walks along the road.

use crate::state::trace::traced;

#[derive(Debug, Clone)]
pub struct Stroller {
    /// Where it is along the ego vehicle's route, and to the left of it, m.
    pub station_m: f64,
    pub left_m: f64,
    /// Height of the road there, m.
    pub height_m: f64,
    /// Whether it comes towards the ego vehicle. One that is told to go back turns round.
    pub is_oncoming: bool,
    /// As told; below 0 it goes back.
    pub speed_mps: f64,
    pub wants_left_m: f64,
    pub aside_mps: f64,
    /// Whether something is in its way, since its last look.
    pub is_blocked: bool,
    /// Whether it looks in the next tick, because it was just told something.
    pub looks_now: bool,
}

impl Stroller {
    /// How fast it goes on, m/s; below 0 back.
    pub fn pace_mps(&self) -> f64 {
        if self.is_blocked { 0.0 } else { self.speed_mps }
    }

    /// Height of the road where it is, m.
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    pub fn is_aside(&self) -> bool {
        self.left_m == self.wants_left_m
    }
}

traced! {
    // The height follows from the station.
    Stroller {
        station_m, left_m, speed_mps, wants_left_m, aside_mps, is_oncoming, is_blocked, looks_now
    } but { height_m };
}
