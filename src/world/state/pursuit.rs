//! A driver's order relative to another road user, and its progress.

use avastra_lang::model::command::Command;
use avastra_road::LaneIndex;

use crate::state::trace::{Trace, Traced, traced};

#[derive(Debug, Clone, Copy)]
pub struct Pursuit {
    pub aim: Aim,
    /// The fastest that it drives for this, m/s; without it the limit of its lane.
    pub speed_mps_max: Option<f64>,
    /// The lane in which its way crosses that of the ego vehicle, once that is known; until then it drives on as it does.
    pub crosses_in: Option<LaneIndex>,
    /// Whether the gap was as wanted once.
    pub is_met: bool,
    /// By how much it misses its moment if both go on as they do, s; `None` if the ego vehicle has not kept its speed.
    pub late_s: Option<f64>,
    pub ego_keeps: EgoKeeps,
}

#[derive(Debug, Clone, Copy)]
pub enum Aim {
    /// To the road user of that id, or to the ego vehicle.
    Gap(Gap, Option<u32>),
    /// Its front is there this much before the ego vehicle's front, s. The place is this station of the ego vehicle's
    /// route, or the point where its way crosses that route.
    Place { early_s: f64, station_m: Option<f64> },
}

#[derive(Debug, Clone, Copy)]
pub enum Gap {
    /// m.
    Way(f64),
    /// s, of the one behind.
    Time(f64),
}

impl Pursuit {
    pub fn told(command: &Command, to: Option<u32>) -> Option<Pursuit> {
        let gap = command.keep_m().map(Gap::Way).or(command.keep_s().map(Gap::Time));
        let gap = gap.map(|gap| Aim::Gap(gap, to));
        let place = command.early_s().map(|early_s| Aim::Place { early_s, station_m: command.at_m() });
        Some(Pursuit {
            aim: gap.or(place)?,
            speed_mps_max: command.speed_mps(),
            crosses_in: None,
            is_met: false,
            late_s: None,
            ego_keeps: EgoKeeps::default(),
        })
    }
}

/// Whether the ego vehicle has kept the speed that it had at the first look, within a tenth and half a metre per second.
#[derive(Debug, Clone, Copy, Default)]
pub struct EgoKeeps {
    pub first_mps: Option<f64>,
    pub is_lost: bool,
}

impl EgoKeeps {
    /// Whether it has, up to now. One that is slower than `standing_mps` has not.
    pub fn look(&mut self, now_mps: f64, standing_mps: f64) -> bool {
        let first_mps = *self.first_mps.get_or_insert(now_mps);
        self.is_lost |= now_mps < standing_mps || (now_mps - first_mps).abs() > 0.1 * first_mps + 0.5;
        !self.is_lost
    }
}

traced! {
    // By how much it is late moves nothing.
    Pursuit { aim, speed_mps_max, crosses_in, is_met } but { late_s, ego_keeps };
}

impl Traced for Aim {
    fn trace(&self, trace: &mut Trace) {
        match *self {
            Aim::Gap(Gap::Way(gap_m), to) => (0_u64, (gap_m, to)).trace(trace),
            Aim::Gap(Gap::Time(gap_s), to) => (1_u64, (gap_s, to)).trace(trace),
            Aim::Place { early_s, station_m } => (2_u64, (early_s, station_m)).trace(trace),
        }
    }
}
