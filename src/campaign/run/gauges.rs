//! The measurements of every tick while an episode is played: danger (criticality, post-encroachment time), and how the
//! ego vehicle kept to limit and lane.

use crate::episode::EpisodeLog;
use avastra_search::mdp::{Criticality, LeastEncroachment};
use avastra_world::sim::{Contact, DT_S, Scene, World};

/// Half the width of a lane marking of 12 cm, m: a wheel on the line has not left the lane. Ours.
const ON_THE_LINE_M: f64 = 0.06;
/// Only a speed above the limit times this counts as speeding: less is the controller's overshoot. Ours.
const SPEEDING_FACTOR: f64 = 1.05;

/// How the ego vehicle kept to the speed limit and to its lane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Manners {
    /// Time more than 5 % above the speed limit of its lane, s.
    pub speeding_s: f64,
    /// Time with a side beyond the edge of its lane, s. Stretches of the route with a lane change do not count.
    pub astray_s: f64,
}

/// All measurements of one episode; call [`Gauges::note`] after every tick.
#[derive(Debug, Clone, Default)]
pub struct Gauges {
    /// Time (s) and values of every tick at which there is any danger.
    moments: Vec<(f64, Criticality)>,
    encroachment: LeastEncroachment,
    hit: Vec<u32>,
    /// Time (s) and speed (m/s) of the ego vehicle at every tick before the first contact.
    speeds: Vec<(f64, f64)>,
    /// Ticks that count as [`Manners::speeding_s`] and [`Manners::astray_s`].
    speeding: u64,
    astray: u64,
}

impl Gauges {
    /// Takes in a tick.
    pub fn note(&mut self, world: &World, contacts: &[Contact]) {
        self.hit.extend(contacts.iter().map(|contact| contact.obstacle));
        // A contact changes the speed within its tick.
        if self.hit.is_empty() {
            self.speeds.push((world.time_s(), world.ego().speed_mps));
        }
        let mut now = Criticality::default();
        now.note(world, &|id| self.hit.contains(&id));
        if now != Criticality::default() {
            self.moments.push((world.time_s(), now));
        }
        self.encroachment.note(world);
        self.note_manners(world);
    }

    fn note_manners(&mut self, world: &World) {
        let Scene { map, route, .. } = world.scene().as_ref();
        let station_m = world.ego_station_m();
        let here = route.lane_at(station_m);
        let lane = map.lane(here.lane);
        self.speeding += u64::from(world.ego().speed_mps > SPEEDING_FACTOR * lane.speed_limit_mps);
        let is_changing =
            route.changes.iter().any(|change| (change.begin_m..change.latest_m).contains(&station_m));
        let half_m = lane.width_at(station_m - here.from_m) / 2.0 + ON_THE_LINE_M;
        let beyond_m = world.ego_offset_m().abs() + world.ego_outline().half_width_m - half_m;
        self.astray += u64::from(!is_changing && beyond_m > 0.0);
    }

    /// How the ego vehicle drove so far.
    pub fn manners(&self) -> Manners {
        Manners { speeding_s: self.speeding as f64 * DT_S, astray_s: self.astray as f64 * DT_S }
    }

    /// The greatest speed of each step of the measured episode's log, m/s; `None` after the first contact.
    pub fn top_speeds_mps(&self, log: &EpisodeLog) -> Vec<Option<f64>> {
        let mut tops = vec![None; log.steps.len()];
        for (time_s, speed_mps) in &self.speeds {
            if let Some(step) = step_at(log, *time_s) {
                tops[step] = Some(speed_mps.max(tops[step].unwrap_or(0.0)));
            }
        }
        tops
    }

    /// The most critical values of each step of the measured episode's log, and the least post-encroachment time,
    /// s.
    pub fn of_steps(&self, log: &EpisodeLog) -> (Vec<Criticality>, Option<f64>) {
        let mut steps = vec![Criticality::default(); log.steps.len()];
        for (time_s, moment) in &self.moments {
            if let Some(step) = step_at(log, *time_s) {
                steps[step] = steps[step].and(moment);
            }
        }
        (steps, self.encroachment.least_s(&|id| self.hit.contains(&id)))
    }
}

/// The step in which a tick lies. The last tick of a period belongs to its own step, even if rounding puts it just after the next
/// step began.
fn step_at(log: &EpisodeLog, time_s: f64) -> Option<usize> {
    log.steps.partition_point(|step| step.time_s + 1e-6 < time_s).checked_sub(1)
}
