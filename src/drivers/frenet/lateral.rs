//! Where beside the route the vehicle may drive: the lane that it is in, offsets within it, and the lane that
//! the route changes to.
//!
//! The frame is a guide along the lane that the vehicle is in. While a lane change of the route is due, its
//! target is one more goal to sample. The vehicle is in the target lane once its middle has crossed the line,
//! and the frame changes with it. Until then another goal may win, and the change is broken off.

use std::sync::Arc;

use crate::kit::{Aside, Guide, RouteChanges, SpeedRules};
use avastra_road::{RouteLaneChange, Side};
use avastra_world::sim::{Scene, VehicleParameters};

use super::polynomial::Quintic;
use super::proposal::{HALF_WAY_M, MODEL, lateral_cost};
use super::traffic::Other;

/// Offsets that are sampled to each side, m (PDM-Closed); less where the lane ends.
const OFFSET_M: f64 = 1.0;
/// Times in which a goal is reached, s. Ours; Werling samples a range that is not given.
const TIMES_S: [f64; 2] = [2.0, 4.0];
/// Least length of a shift, m. Ours: what steering can follow at walking pace.
const LENGTH_M_MIN: f64 = 12.0;
/// Room left to the edge of the lane, m. Ours.
const EDGE_M: f64 = 0.1;
/// A strip between two lanes that is wider than this ends the lane, m.
const STRIP_M_MAX: f64 = 0.5;
/// Braking that a lane change may ask of a vehicle behind, m/s². MOBIL's safety criterion (Kesting, Treiber,
/// Helbing 2007: at most 4); half of that is ours.
const SAFE_MPS2: f64 = 2.0;
/// While a change is due, staying in the lane counts as this deviation, m. Ours.
const WRONG_LANE_M: f64 = 2.0;

/// Goals nearer to each other than this are one, m. Ours.
const SAME_GOAL_M: f64 = 0.2;

/// A goal of the sampling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    Middle,
    Left,
    Right,
    Change,
}

/// A lateral curve beside the guide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lateral {
    goal: Goal,
    /// Offset at its end, m to the left.
    goal_m: f64,
    curve: Quintic,
    begin_m: f64,
    /// How far its end lies from where the vehicle should be, m.
    deviation_m: f64,
}

impl Lateral {
    fn new(goal: Goal, goal_m: f64, deviation_m: f64, from: (f64, Aside), length_m: f64) -> Lateral {
        let (begin_m, from) = from;
        Lateral { goal, goal_m, curve: Quintic::shift(from, goal_m, length_m), begin_m, deviation_m }
    }

    /// Back to the middle of the lane, from a place beside it.
    pub fn from(station_m: f64, offset_m: f64) -> Lateral {
        let from = (station_m, Aside { offset_m, ..Aside::default() });
        Lateral::new(Goal::Middle, 0.0, 0.0, from, LENGTH_M_MIN)
    }

    pub fn aside(&self, station_m: f64) -> Aside {
        self.curve.at(station_m - self.begin_m)
    }

    pub fn changes_lane(&self) -> bool {
        self.goal == Goal::Change
    }

    /// Werling's cost at a speed.
    pub fn cost(&self, speed_mps: f64) -> f64 {
        let speed_mps = speed_mps.max(1.0);
        lateral_cost(self.curve.squared_jerk(speed_mps), self.curve.length_m / speed_mps, self.deviation_m)
    }
}

/// The lanes of the route, as far as they have been reached.
#[derive(Debug, Clone)]
pub struct Lanes {
    scene: Arc<Scene>,
    /// Those that have begun are behind the vehicle.
    changes: RouteChanges,
}

impl Lanes {
    pub fn new(scene: &Arc<Scene>) -> Lanes {
        Lanes { scene: Arc::clone(scene), changes: RouteChanges::new(scene, SpeedRules::on(scene)) }
    }

    /// Along the lane that the vehicle is in.
    pub fn guide(&self) -> &Arc<Guide> {
        self.changes.guide()
    }

    /// The speed limit at a station, or the cruising speed if it is lower, m/s.
    pub fn limit_mps(&self, station_m: f64) -> f64 {
        let lane = self.scene.route.lane_at(station_m).lane;
        self.scene.map.lane(lane).speed_limit_mps.min(SpeedRules::on(&self.scene).cruise_mps)
    }

    /// The lane changes of the route.
    pub fn changes(&self) -> &RouteChanges {
        &self.changes
    }

    /// Whether a curve still comes over from another lane at a station.
    pub fn is_arriving(&self, lateral: &Lateral, station_m: f64) -> bool {
        lateral.aside(station_m).offset_m.abs() > OFFSET_M
    }

    /// Passes on to the target lane if the vehicle has crossed the line: returns the curve beside the new guide.
    pub fn cross(&mut self, lateral: Lateral, station_m: f64, offset_m: f64) -> Lateral {
        let Some(lateral_m) = self.changes.next().map(|change| change.lateral_m) else { return lateral };
        if !lateral.changes_lane() || offset_m / lateral_m < 0.5 {
            return lateral;
        }
        let before = self.guide().pose_at(station_m).position;
        self.changes.begin(f64::NEG_INFINITY);
        let left_m = -self.guide().project(before, station_m - 5.0, station_m + 5.0).offset_m;
        let curve = lateral.curve.beside(left_m);
        Lateral { goal: Goal::Middle, goal_m: 0.0, curve, deviation_m: 0.0, ..lateral }
    }

    /// Samples lateral curves from the present one on: its own continuation, and curves to all other goals.
    pub fn sample(
        &self,
        now: &Lateral,
        station_m: f64,
        speed_mps: f64,
        others: &[Other],
        into: &mut Vec<Lateral>,
    ) {
        into.clear();
        let from = (station_m, now.aside(station_m));
        let mut add = |goal: Goal, goal_m: f64, deviation_m: f64, lengths_m: [f64; 2]| {
            if now.goal == goal && (now.goal_m - goal_m).abs() < SAME_GOAL_M {
                into.push(Lateral { deviation_m, ..*now });
            } else {
                into.extend(
                    lengths_m.map(|length_m| Lateral::new(goal, goal_m, deviation_m, from, length_m)),
                );
            }
        };
        let lengths_m = TIMES_S.map(|time_s| (speed_mps * time_s).max(LENGTH_M_MIN));
        if let Some(change) = self.changes.due(station_m) {
            add(Goal::Middle, 0.0, WRONG_LANE_M, lengths_m);
            let length_m = change.length_from_m(station_m);
            let fits = station_m <= change.latest_m - RouteLaneChange::LENGTH_M_MIN + LATE_M;
            if (now.changes_lane() || fits) && is_clear(others, change.lateral_m, station_m, speed_mps) {
                add(
                    Goal::Change,
                    change.lateral_m,
                    0.0,
                    [length_m, RouteLaneChange::LENGTH_M_MIN.max(length_m / 2.0)],
                );
            }
            return;
        }
        add(Goal::Middle, 0.0, 0.0, lengths_m);
        for (goal, side, sign) in [(Goal::Left, Side::Left, 1.0), (Goal::Right, Side::Right, -1.0)] {
            let offset_m = self.room_m(station_m, side).min(OFFSET_M);
            if offset_m >= SAME_GOAL_M {
                add(goal, sign * offset_m, offset_m, lengths_m);
            }
        }
    }

    /// How far to a side the vehicle may go without leaving the lanes of its direction, m.
    fn room_m(&self, station_m: f64, side: Side) -> f64 {
        let on = self.scene.route.lane_at(station_m);
        let lane = self.scene.map.lane(on.lane);
        let beside =
            lane.neighbour(side).filter(|beside| beside.same_direction && beside.gap_m <= STRIP_M_MAX);
        if lane.junction.is_none() && beside.is_some() {
            return OFFSET_M;
        }
        (lane.width_at(station_m - on.from_m) / 2.0 - VehicleParameters::MKZ.width_m / 2.0 - EDGE_M).max(0.0)
    }
}

/// A vehicle that waits for a change may stand this far beyond its place, m.
const LATE_M: f64 = 1.0;

/// Whether the target lane has room beside the vehicle, and no vehicle behind would have to brake hard.
fn is_clear(others: &[Other], lateral_m: f64, station_m: f64, speed_mps: f64) -> bool {
    let (rear_m, front_m) =
        (VehicleParameters::MKZ.rear_m(station_m), VehicleParameters::MKZ.front_m(station_m));
    others.iter().all(|other| {
        let Some(span) = other.taken(0, lateral_m, HALF_WAY_M) else { return true };
        let behind_mps = other.places[0].map_or(0.0, |place| place.along_mps.max(0.0));
        if span.from_m > front_m {
            return span.from_m - front_m
                > MODEL.gap_m_min + (speed_mps - behind_mps).max(0.0) * MODEL.time_gap_s;
        }
        let ratio = MODEL.crowding(behind_mps, speed_mps, rear_m - span.to_m);
        span.to_m < rear_m && MODEL.acceleration_mps2 * (ratio * ratio - 1.0).max(0.0) < SAFE_MPS2
    })
}
