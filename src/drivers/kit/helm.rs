//! From tick to tick: where the vehicle is, when it is time to look, and what was commanded.

use crate::status::Status;
use avastra_base::geometry::{Beside, Vec2};
use avastra_world::sim::{Control, DT_S, EgoMotion, FRAME_TICKS};

use super::guide::Guide;

/// The state that a driver keeps from tick to tick.
#[derive(Debug, Clone, Copy, Default)]
pub struct Helm {
    ticks: u64,
    /// `None` before the first tick.
    station_m: Option<f64>,
    steer_rad: Option<f64>,
}

impl Helm {
    /// The place beside a guide of what was lately near its last place; to be called once a tick, for the rear axle.
    pub fn locate(&mut self, guide: &Guide, position: Vec2) -> Beside {
        let beside = guide.locate(position, self.station_m);
        self.station_m = Some(beside.station_m);
        beside
    }

    /// The last station, m; 0 before the first tick.
    pub fn station_m(&self) -> f64 {
        self.station_m.unwrap_or(0.0)
    }

    /// Whether it is the first tick of the episode.
    pub fn is_first(&self) -> bool {
        self.ticks == 0
    }

    /// Whether drivers look in this tick: ten times a second.
    pub fn looks(&self) -> bool {
        self.ticks.is_multiple_of(FRAME_TICKS)
    }

    /// Time since the last look, s, in `[0, 0.1)`.
    pub fn since_look_s(&self) -> f64 {
        (self.ticks % FRAME_TICKS) as f64 * DT_S
    }

    /// Ends the tick.
    pub fn tick(&mut self) {
        self.ticks += 1;
    }

    /// Ends the tick with a command, which it notes together with the rate at which the wheel has turned.
    pub fn command(&mut self, control: Control, ego: &EgoMotion, status: &mut Status) -> Control {
        status.control = control;
        status.steer_rate_radps = (ego.steer_rad - self.steer_rad.unwrap_or(ego.steer_rad)) / DT_S;
        self.steer_rad = Some(ego.steer_rad);
        self.tick();
        control
    }
}
