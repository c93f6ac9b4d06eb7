//! Orders to drivers relative to another road user. A driver keeps a gap, ahead or behind, to the ego vehicle or to a
//! road user, or it reaches a place a set time before the ego vehicle. Both orders set the speed, from tick to tick,
//! as OpenSCENARIO's continuous `LongitudinalDistanceAction` and its `SynchronizeAction` do. Lights, bends and others
//! may still make a vehicle slower.

use avastra_base::kinematics::{STANDING_MPS, braking_m, needed_mps2};

use crate::behave::npc::figures::COMFORT_MPS2;
use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::pursuit::{Aim, Gap, Pursuit};
use crate::state::time::DT_S;
use crate::view::around::{Around, Other, View};
use avastra_lang::model::body::BodyParameters;

/// How fast an error of the gap is made up for, 1/s² and 1/s: critically damped. Ours.
const GAP_PER_S2: f64 = 0.25;
const CLOSING_PER_S: f64 = 1.0;
/// How fast a vehicle takes on the speed that brings it to its place in time, s. Ours.
const TAKES_S: f64 = 0.5;
/// A gap within this of the wanted one, m, or this part of it, is kept.
const KEPT_M: f64 = 0.5;
const KEPT_PART: f64 = 0.05;
/// Room that a vehicle behind the ego vehicle leaves when it has to brake hard, m.
const ROOM_M: f64 = 1.0;

/// Where another one is beside the driver, along the ego vehicle's route.
struct Beside {
    /// From bumper to bumper, m; negative if they are side by side.
    gap_m: f64,
    is_ahead: bool,
    /// How fast the other one is along the route, m/s.
    other_mps: f64,
}

impl Driver {
    /// Whether its front is past a station of the ego vehicle's route.
    pub fn is_past(&self, view: &View, station_m: f64) -> bool {
        ways_to(view, station_m).0 <= 0.0
    }

    /// The one to whom it keeps a gap, and its acceleration, m/s²: it does not follow that one by itself.
    pub fn kept<'a>(&self, around: &'a Around) -> Option<(Other<'a>, f64)> {
        let Some(Pursuit { aim: Aim::Gap(_, to), .. }) = self.pursuit.as_deref() else { return None };
        match to {
            None => Some((around.ego(), around.ego.acceleration_mps2)),
            Some(id) => {
                let other = around.obstacles().find(|other| other.id == *id)?;
                Some((other.into(), other.acceleration_mps2))
            }
        }
    }

    /// The acceleration that brings it where it was told to be beside the ego vehicle, m/s²; `None` if it was told nothing.
    pub fn pursue_mps2(&mut self, view: &View, bend_mps: f64) -> Option<f64> {
        let mut pursuit = **self.pursuit.as_ref()?;
        let around = view.around;
        let speed_mps_max =
            pursuit.speed_mps_max.unwrap_or_else(|| self.way.limit_mps(&around.scene.map, self.station_m));
        let mps2_max = (speed_mps_max.min(bend_mps) - self.speed_mps) / DT_S;
        let wanted_mps2 = match pursuit.aim {
            Aim::Gap(gap, to) => {
                let Some(Beside { gap_m, is_ahead, other_mps }) = beside(view, to) else {
                    // That one has left the world: it keeps the speed that it has.
                    self.cruise_mps = self.speed_mps;
                    self.pursuit = None;
                    return None;
                };
                let behind_mps = if is_ahead { other_mps } else { self.speed_mps };
                let wanted_m = match gap {
                    Gap::Way(way_m) => way_m,
                    Gap::Time(gap_s) => behind_mps * gap_s,
                };
                pursuit.is_met |= (gap_m - wanted_m).abs() < KEPT_M.max(KEPT_PART * wanted_m);
                let lacks_m = if is_ahead { wanted_m - gap_m } else { gap_m - wanted_m };
                // A wanted gap that grows with its own speed damps by itself.
                let damps_per_s = match gap {
                    Gap::Time(gap_s) if !is_ahead => GAP_PER_S2 * gap_s,
                    Gap::Way(_) | Gap::Time(_) => 0.0,
                };
                let closing_per_s = (CLOSING_PER_S - damps_per_s).max(0.0);
                GAP_PER_S2 * lacks_m + closing_per_s * (other_mps - self.speed_mps)
            }
            Aim::Place { early_s, station_m } => {
                let ways = match station_m {
                    Some(station_m) => Some(ways_to(view, station_m)),
                    None => {
                        let crossing = self.next_crossing(view.size.length_m, around, pursuit.crosses_in);
                        pursuit.crosses_in = pursuit.crosses_in.or(crossing.map(|(lane, _)| lane));
                        crossing.map(|(_, ways)| ways)
                    }
                };
                let Some((own_m, ego_m)) = ways.filter(|(own_m, _)| *own_m > 0.0) else {
                    // Behind the place it keeps the speed that it has.
                    if pursuit.crosses_in.is_some() || station_m.is_some() {
                        self.cruise_mps = self.speed_mps;
                        self.late_s = pursuit.late_s;
                        self.pursuit = None;
                    }
                    return None;
                };
                // Before a place to which the ego vehicle does not come, because it stands, this one waits, too.
                let left_s = ego_m / around.ego.speed_mps - early_s;
                // The ego vehicle has moved in this tick already.
                let left_s = left_s + DT_S;
                let is_kept = pursuit.ego_keeps.look(around.ego.speed_mps, STANDING_MPS);
                pursuit.late_s = is_kept.then(|| own_m / self.speed_mps.max(STANDING_MPS) - left_s);
                let needed_mps = if left_s > DT_S { own_m / left_s } else { f64::INFINITY };
                (needed_mps.min(speed_mps_max) - self.speed_mps) / TAKES_S
            }
        };
        if let Some(kept) = &mut self.pursuit {
            **kept = pursuit;
        }
        Some(wanted_mps2.min(mps2_max))
    }

    /// How hard it must brake not to run into the road user to which it keeps a gap, m/s², if that one goes on braking
    /// as it does. `None` if gentle braking will do, or if it ignores that road user.
    pub fn braking_for_kept_mps2(&self, size: &BodyParameters, around: &Around) -> Option<f64> {
        let (kept, kept_mps2) = self.kept(around)?;
        let is_minded = |other: Other| core::ptr::eq(other.outline, kept.outline);
        self.minded(around).any(is_minded).then_some(())?;
        let (gap_m, other_mps) = self.gap_to(size, kept)?;
        let room_m = (gap_m - ROOM_M).max(0.1);
        let closing_mps = (self.speed_mps - other_mps).max(0.0);
        let braking_mps2 = -kept_mps2;
        let until_it_stands_mps2 = match braking_mps2 > COMFORT_MPS2 {
            true => needed_mps2(self.speed_mps, room_m + braking_m(other_mps.max(0.0), braking_mps2)),
            false => 0.0,
        };
        let needed_mps2 = needed_mps2(closing_mps, room_m).max(until_it_stands_mps2);
        (needed_mps2 > COMFORT_MPS2).then_some(needed_mps2)
    }
}

/// From its front to a station of the ego vehicle's route, and from the ego vehicle's front to there, m: along that route.
fn ways_to(view: &View, station_m: f64) -> (f64, f64) {
    let View { this, around, .. } = *view;
    let (here_m, _, along) = around.beside_route(this.outline.pose.position);
    let (half_length_m, _) = this.outline.half_extent_m(this.forward, along);
    let way_m = station_m - here_m;
    let own_m = if along.dot(&this.forward) < 0.0 { -way_m } else { way_m };
    (own_m - half_length_m, station_m - VehicleParameters::MKZ.front_m(around.ego_station_m))
}

/// Where the road user of that id, or the ego vehicle, is; `None` if that one is not there any more.
fn beside(view: &View, to: Option<u32>) -> Option<Beside> {
    let View { this, around, .. } = *view;
    // The middle, half the length, the speed, and the unit vector along the route.
    let along_route = |one: &Obstacle| {
        let (middle_m, _, along) = around.beside_route(one.outline.pose.position);
        let half_length_m = one.outline.half_extent_m(one.forward, along).0;
        (middle_m, half_length_m, along.dot(&one.velocity_mps), along)
    };
    let (here_m, half_length_m, own_mps, along) = along_route(this);
    // Two that come towards the ego vehicle count the other way.
    let sign = if to.is_some() && along.dot(&this.forward) < 0.0 { -1.0 } else { 1.0 };
    let (mut here_m, own_mps) = (sign * here_m, sign * own_mps);
    let (front_m, rear_m, other_mps) = match to {
        None => {
            let ego = VehicleParameters::MKZ;
            // The ego vehicle has moved in this tick already.
            here_m += own_mps * DT_S;
            let at_m = around.ego_station_m;
            (ego.front_m(at_m), ego.rear_m(at_m), around.ego.speed_mps)
        }
        Some(id) => {
            let other = around.obstacles().find(|other| other.id == id)?;
            // So has one that comes before it in the world's order.
            if around.users[0].iter().any(|user| user.obstacle.id == id) {
                here_m += own_mps * DT_S;
            }
            let (middle_m, half_m, other_mps, _) = along_route(other);
            (sign * middle_m + half_m, sign * middle_m - half_m, sign * other_mps)
        }
    };
    let is_ahead = here_m > (front_m + rear_m) / 2.0;
    let gap_m = if is_ahead { here_m - half_length_m - front_m } else { rear_m - here_m - half_length_m };
    Some(Beside { gap_m, is_ahead, other_mps })
}
