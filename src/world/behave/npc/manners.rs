//! For which other vehicles a driver waits at a junction.
//!
//! Before a conflict area (see `junction`) a driver waits for
//!
//! - a vehicle that is in it;
//! - a vehicle that can no longer stop before it, or has begun to cross it after a wait;
//! - a vehicle that goes first by the lanes' own order, unless one of the two is through before the other
//!   comes;
//! - room behind it, if the vehicle ahead stands: no vehicle stops in an area.
//!
//! No driver waits for a vehicle that waits itself, stands at a red light or has yet to stop at a sign. A driver that
//! sets out after a wait crosses all areas of the junction and counts as if inside them. So four drivers that wait for
//! each other do not all set out at once: they look one after another, and the first to look goes. After [`PATIENCE_S`]
//! of waiting a driver goes before any vehicle that stands, whatever the order of the lanes. After `GIVE_UP_S` it
//! leaves the world as soon as the ego vehicle does not see it. A standstill in sight may last; an episode ends when
//! the ego vehicle makes no progress.
//!
//! **Commanded vehicles and the ego vehicle.** A vehicle that an action made appear keeps these manners towards all
//! other vehicles. It never yields to the ego vehicle at a junction: its verb means to cross or to turn before it. It
//! follows, brakes for and does not push an ego vehicle that is ahead of it. Ambient vehicles yield to the ego vehicle
//! as to all others. Whenever the ego vehicle moves and no red light holds it, they expect that it will not stop.
//! Under a traffic profile whose vehicles take their right, they expect that the ego vehicle stops where they go
//! first, and that it has not passed a red light.

use core::cell::LazyCell;

use crate::behave::npc::figures::{COMFORT_MPS2, GAP_M_MIN, LOOK_AHEAD_M};
use crate::scene::junction::Area;
use crate::scene::way::LaneSet;
use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::sensed::SignalColour;
use crate::state::time::DT_S;
use crate::view::around::{Around, View};
use avastra_base::kinematics::{STANDING_MPS, braking_m};
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::vocabulary::TrafficRule;

/// Time at rest after which a driver no longer waits for vehicles that stand, s. Ours.
const PATIENCE_S: f64 = 8.0;
/// Time between one vehicle in an area and the next, s. Accepted gaps in towns are longer, but there the vehicle that
/// accepts them does not move yet.
const GAP_S: f64 = 1.5;
/// A vehicle that would have to brake harder than this does not stop any more, m/s² (as at a yellow light).
const COMMITTED_MPS2: f64 = 3.0;
/// Room between the front and the area that is waited for, m.
const HOLD_ROOM_M: f64 = 0.5;
/// Vehicles farther from an area than this do not matter yet, m.
const APPROACH_M: f64 = 80.0;
/// A junction is no longer than this, m.
const JUNCTION_M: f64 = 45.0;
/// An ego vehicle that moves faster than this is taken for one that will not stop, m/s.
const EGO_MOVES_MPS: f64 = 1.0;

/// One vehicle on its way through a conflict area.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Passage {
    /// From its front to the beginning of the area, m; negative inside.
    in_m: f64,
    /// From its rear to the end of the area, m; negative beyond.
    out_m: f64,
    speed_mps: f64,
    cruise_mps: f64,
    acceleration_mps2: f64,
    /// It will go through, whatever the order says.
    committed: bool,
    /// It stops before the area.
    holds: bool,
}

impl Passage {
    fn in_s(&self) -> f64 {
        self.time_s(self.in_m)
    }

    fn out_s(&self) -> f64 {
        self.time_s(self.out_m)
    }

    /// Time for a way at the vehicle's own acceleration up to its cruising speed, s.
    fn time_s(&self, way_m: f64) -> f64 {
        let way_m = way_m.max(0.0);
        let (speed_mps, acceleration_mps2) = (self.speed_mps, self.acceleration_mps2);
        let cruise_mps = self.cruise_mps.max(speed_mps).max(1.0);
        let gained_m = (cruise_mps * cruise_mps - speed_mps * speed_mps) / (2.0 * acceleration_mps2);
        if way_m <= gained_m {
            return ((speed_mps * speed_mps + 2.0 * acceleration_mps2 * way_m).sqrt() - speed_mps)
                / acceleration_mps2;
        }
        (cruise_mps - speed_mps) / acceleration_mps2 + (way_m - gained_m) / cruise_mps
    }
}

/// Whether `own`, not yet in the area, has to wait for `other`.
fn waits(own: &Passage, other: &Passage, goes_first: bool, impatient: bool) -> bool {
    if other.out_m <= 0.0 || other.in_m > APPROACH_M {
        return false;
    }
    if other.in_m <= 0.0 {
        // A vehicle inside that moves may have left by then.
        return other.speed_mps < 1.0 || other.out_s() + GAP_S / 2.0 > own.in_s();
    }
    if other.holds && !other.committed {
        return false;
    }
    if own.out_s() + GAP_S < other.in_s() || other.out_s() + GAP_S < own.in_s() {
        return false;
    }
    match (own.committed, other.committed) {
        (true, false) => false,
        (false, true) => true,
        _ if impatient && other.speed_mps < STANDING_MPS => false,
        _ => !goes_first,
    }
}

impl Driver {
    /// Whether it stops neither at lights nor at signs.
    pub fn passes_signals(&self) -> bool {
        self.has_siren || self.ignores.contains(TrafficRule::Signals)
    }

    /// Station of the own way at which to wait now, m, if there is something to wait for.
    pub fn find_hold_m(&self, view: &View) -> Option<f64> {
        if self.has_siren || self.ignores.contains(TrafficRule::RightOfWay) {
            return None;
        }
        let length_m = view.size.length_m;
        let front_m = self.station_m + length_m / 2.0;
        let reach_m = LOOK_AHEAD_M + braking_m(self.speed_mps, COMFORT_MPS2);
        let areas = &self.way.areas;
        let open = areas.partition_point(|area| area.from_m <= front_m);
        let near = |area: &&Area| area.from_m <= front_m + reach_m;
        let near_areas = || areas[open..].iter().take_while(near);
        let lanes = near_areas().fold(LaneSet::default(), |lanes, area| lanes.with(area.other));
        let may_mind = !self.ignores.contains(TrafficRule::Others);
        // Most often no vehicle comes near on any of their lanes.
        let minds_others = may_mind
            && view.around.drivers().any(|(obstacle, _, driver)| {
                driver.way.lane_set.may_meet(lanes) && is_near(obstacle, view.this)
            });
        let waits_for = |minds_others| near_areas().position(|area| self.must_wait(area, minds_others, view));
        let waited_for = waits_for(minds_others);
        debug_assert_eq!(waited_for, waits_for(may_mind), "a vehicle at the junction is missed");
        let waited_for = waited_for?;
        // It must not wait in an earlier area either, unless its front is in that already.
        let mut hold_m = areas[open + waited_for].from_m;
        for area in areas[open..open + waited_for].iter().rev() {
            if area.to_m > hold_m - HOLD_ROOM_M - GAP_M_MIN - length_m {
                hold_m = hold_m.min(area.from_m);
            }
        }
        Some(hold_m - HOLD_ROOM_M)
    }

    /// End of the last area at the junction ahead, m.
    pub fn junction_end_m(&self, size: &BodyParameters) -> f64 {
        let front_m = self.station_m + size.length_m / 2.0;
        let ahead = self.way.areas.iter().filter(|area| area.from_m < front_m + JUNCTION_M);
        ahead.fold(f64::NEG_INFINITY, |end_m, area| end_m.max(area.to_m))
    }

    fn must_wait(&self, area: &Area, minds_others: bool, &View { this, size, around }: &View) -> bool {
        if self.would_stop_in(area, size) {
            return true;
        }
        // Worked out only if needed: most areas are on no other vehicle's way.
        let own = LazyCell::new(|| self.passage(area.from_m, area.to_m, size, around));
        let impatient = f64::from(self.waited_ticks) * DT_S >= PATIENCE_S;
        let for_others = minds_others
            && around.drivers().any(|(obstacle, body, driver)| {
                // Most others take no lane that meets this area.
                if !driver.way.may_take(area.other) || !is_near(obstacle, this) {
                    return false;
                }
                let other = driver.passage_through(area, body, around);
                let goes_first = area.goes_first && !driver.has_siren;
                other.is_some_and(|other| waits(&own, &other, goes_first, impatient))
            });
        let for_ego = || {
            let other = ego_passage(area, around);
            // A vehicle that takes its right waits for an ego vehicle without right of way only where the ego vehicle
            // is in its way already.
            let is_wronged = || around.traffic.takes_right && (area.goes_first || around.ego_runs_red());
            let other = other.filter(|other| other.in_m <= 0.0 || !is_wronged());
            other.is_some_and(|other| waits(&own, &other, area.goes_first, impatient))
        };
        for_others || (self.yields_to_ego && for_ego())
    }

    /// Whether the vehicle ahead stands so near behind an area that this one would have to stop in it.
    fn would_stop_in(&self, area: &Area, size: &BodyParameters) -> bool {
        let front_m = self.station_m + size.length_m / 2.0;
        self.leader.as_ref().is_some_and(|leader| {
            let stop_m = front_m + leader.gap_m - GAP_M_MIN;
            let in_area = (area.from_m..area.to_m + size.length_m + HOLD_ROOM_M).contains(&stop_m);
            in_area && !leader.crosswise && leader.speed_mps.abs() < 1.0
        })
    }

    fn passage(&self, from_m: f64, to_m: f64, size: &BodyParameters, around: &Around) -> Passage {
        let front_m = self.station_m + size.length_m / 2.0;
        let in_m = from_m - front_m;
        let braking_mps2 = around.braking_mps2(size, self.speed_mps);
        let line_gap_m = [self.stop_gap_m(size, around, braking_mps2), self.sign_gap_m(size, braking_mps2)];
        let stops_before = |gap_m: &f64| *gap_m < in_m;
        let holds = self.hold_m.is_some_and(|hold_m| hold_m < from_m)
            || line_gap_m.iter().flatten().any(stops_before);
        let stops_m = braking_m(self.speed_mps, COMMITTED_MPS2);
        Passage {
            in_m,
            out_m: to_m - (self.station_m - size.length_m / 2.0),
            speed_mps: self.speed_mps,
            cruise_mps: self.cruise_mps.min(self.way.speed_mps_max(self.station_m)),
            acceleration_mps2: size.acceleration_mps2_max,
            committed: front_m < self.insists_to_m || stops_m > in_m,
            holds,
        }
    }

    /// This driver's passage through the other lane of an area, if its way leads there.
    fn passage_through(&self, area: &Area, size: &BodyParameters, around: &Around) -> Option<Passage> {
        let begin_m = self.way.lane_ahead_m(area.other, self.station_m - size.length_m / 2.0)?;
        Some(self.passage(begin_m + area.other_from_m, begin_m + area.other_to_m, size, around))
    }
}

/// Whether another vehicle is so near that it may matter at the junction ahead.
fn is_near(other: &Obstacle, this: &Obstacle) -> bool {
    let reach_m = APPROACH_M + JUNCTION_M;
    (other.outline.pose.position - this.outline.pose.position).norm_squared() <= reach_m * reach_m
}

/// The ego vehicle's passage along its route, as ambient vehicles expect it.
fn ego_passage(area: &Area, around: &Around) -> Option<Passage> {
    let car = &VehicleParameters::MKZ;
    let (front_m, rear_m) = (car.front_m(around.ego_station_m), car.rear_m(around.ego_station_m));
    // A lane that it has left already does not count.
    let mut lanes = around.scene.route.lanes.iter();
    let lane = lanes.find(|part| part.lane == area.other && part.to_m > rear_m)?;
    let (from_m, to_m) = (lane.from_m + area.other_from_m, lane.from_m + area.other_to_m);
    let is_red = |signal| around.colours[signal] == SignalColour::Red;
    let mut lines = around.scene.route.stop_lines.iter();
    let holds = lines.any(|line| (front_m - 1.0..from_m).contains(&line.station_m) && is_red(line.signal));
    Some(Passage {
        in_m: from_m - front_m,
        out_m: to_m - rear_m,
        speed_mps: around.ego.speed_mps,
        cruise_mps: around.scene.map.lane(area.other).speed_limit_mps,
        acceleration_mps2: car.acceleration_mps2_max,
        committed: !holds && around.ego.speed_mps > EGO_MOVES_MPS,
        holds,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passage(in_m: f64, speed_mps: f64) -> Passage {
        Passage {
            in_m,
            out_m: in_m + 10.0,
            speed_mps,
            cruise_mps: 10.0,
            acceleration_mps2: 2.0,
            committed: false,
            holds: false,
        }
    }

    #[test]
    fn of_two_vehicles_that_meet_one_waits() {
        let (own, other) = (passage(20.0, 10.0), passage(20.0, 10.0));
        assert!(!waits(&own, &other, true, false));
        assert!(waits(&own, &other, false, false));
    }

    #[test]
    fn a_gap_is_enough_and_a_vehicle_inside_is_not_run_into() {
        let own = passage(5.0, 10.0);
        assert!(!waits(&own, &passage(60.0, 10.0), false, false), "it is through before the other comes");
        assert!(!waits(&own, &passage(-10.0, 10.0), true, false), "it has left");
        assert!(waits(&own, &passage(-1.0, 0.0), true, true), "it stands in the area");
        let late = Passage { holds: true, ..passage(5.0, 0.0) };
        assert!(!waits(&own, &late, false, false), "it waits itself");
    }

    #[test]
    fn patience_ends_and_commitment_counts() {
        let (own, stands) = (passage(2.0, 0.0), passage(2.0, 0.0));
        assert!(waits(&own, &stands, false, false));
        assert!(!waits(&own, &stands, false, true));
        let committed = Passage { committed: true, ..passage(2.0, 8.0) };
        assert!(waits(&own, &committed, true, true));
        assert!(!waits(&committed, &own, false, false));
    }

    #[test]
    fn times_follow_from_the_acceleration() {
        // 25 m to reach 10 m/s at 2 m/s², in 5 s; then 10 m/s.
        assert!((passage(25.0, 0.0).in_s() - 5.0).abs() < 1e-9);
        assert!((passage(45.0, 0.0).in_s() - 7.0).abs() < 1e-9);
        assert!((passage(30.0, 10.0).in_s() - 3.0).abs() < 1e-9);
    }
}
