//! How fast a vehicle goes along its course.
//!
//! It keeps its speed, and for a while its acceleration, unless its leader, a bend or a red light makes it
//! slower. The leader keeps its own speed. This stands for Apollo's `MOVE_SEQUENCE`, in which a vehicle follows
//! its lane at its own speed.

use avastra_base::geometry::{larger, smaller};
use avastra_base::kinematics::{Following, needed_mps2};
use avastra_road::RoadMap;

use super::course::{Course, Walk};
use super::{STEP_S, STEPS};

/// Lateral acceleration that drivers accept in a bend, m/s²: upper end of comfort.
pub const LATERAL_MPS2: f64 = 3.0;
/// An estimated acceleration fades within this time, s. Ours.
const FADE_S: f64 = 3.0;
/// A bend is seen so far ahead, s, and slowed down for at most so hard, m/s². Ours.
const BEND_S: f64 = 1.0;
const BEND_MPS2: f64 = 3.0;
/// A light is stopped for from this braking on, comfortable, and not stopped for if it takes more than the
/// second one, m/s². AASHTO's design deceleration is 3.4, Apollo's `max_stop_deceleration` 4.0.
const STOP_MPS2: f64 = 2.0;
const STOP_MPS2_MAX: f64 = 4.0;
/// No predicted vehicle brakes harder, m/s². Ours: as hard as a plan of the ego vehicle.
const BRAKING_MPS2_MAX: f64 = 4.0;
/// No leader is followed at a larger gap, m: the model's wanted gap at 20 m/s is 32.
const LEADER_M_MAX: f64 = 60.0;
/// The Intelligent Driver Model. Ours; Treiber's page of it has 2 m, 1.8 s, 1 and 3 m/s².
const FOLLOWING: Following =
    Following { gap_m_min: 2.0, time_gap_s: 1.5, acceleration_mps2: 1.0, comfortable_mps2: 2.0 };

/// The facts that decide about the speed.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    pub speed_mps: f64,
    pub acceleration_mps2: f64,
    pub leader: Option<Leader>,
    /// How far it may go before it stands at a closed light, m.
    pub stop_m: Option<f64>,
}

/// The vehicle ahead: gap between bumpers and its speed.
#[derive(Debug, Clone, Copy)]
pub struct Leader {
    pub gap_m: f64,
    pub speed_mps: f64,
}

/// How far the vehicle has gone at each step, m.
pub fn roll(map: &RoadMap, course: &Course, motion: &Motion, stations_m: &mut [f64; STEPS + 1]) {
    let stop_m =
        motion.stop_m.filter(|room_m| motion.speed_mps * motion.speed_mps <= 2.0 * STOP_MPS2_MAX * room_m);
    let leader = motion.leader.filter(|leader| leader.gap_m < LEADER_M_MAX);
    let (mut gone_m, mut speed_mps) = (0.0, motion.speed_mps);
    let mut ahead = Walk::new();
    let sharpest_mps = bend_mps(course.sharpest_per_m(map));
    for (step, station_m) in stations_m.iter_mut().enumerate() {
        *station_m = gone_m;
        let time_s = step as f64 * STEP_S;
        let mut wanted_mps2 = motion.acceleration_mps2 * larger(1.0 - time_s / FADE_S, 0.0);
        // Until it accelerates of itself, the vehicle is not predicted to. Most courses have no bend that matters.
        if sharpest_mps < speed_mps {
            let (segment, _) = ahead.to(map, course, gone_m + speed_mps * BEND_S);
            let bend_mps = bend_mps(segment.begin.curvature_per_m.abs());
            if bend_mps < speed_mps {
                wanted_mps2 = smaller(wanted_mps2, larger((bend_mps - speed_mps) / BEND_S, -BEND_MPS2));
            }
        }
        if let Some(leader) = leader {
            let gap_m = leader.gap_m + leader.speed_mps * time_s - gone_m;
            let ratio = FOLLOWING.crowding(speed_mps, leader.speed_mps, gap_m);
            wanted_mps2 = smaller(wanted_mps2, FOLLOWING.acceleration_mps2 * (1.0 - ratio * ratio));
        }
        if let Some(stop_m) = stop_m {
            let needed_mps2 = needed_mps2(speed_mps, larger(stop_m - gone_m, 0.1));
            if needed_mps2 > STOP_MPS2 {
                wanted_mps2 = smaller(wanted_mps2, -needed_mps2);
            }
        }
        let next_mps = larger(speed_mps + larger(wanted_mps2, -BRAKING_MPS2_MAX) * STEP_S, 0.0);
        gone_m += (speed_mps + next_mps) / 2.0 * STEP_S;
        speed_mps = next_mps;
    }
}

/// Speed at which drivers take a bend, m/s.
fn bend_mps(curvature_per_m: f64) -> f64 {
    (LATERAL_MPS2 / larger(curvature_per_m, 1e-6)).sqrt()
}
