//! Road users that follow a trajectory exactly, whatever comes, as the targets of proving grounds do: robots on a planned way.
//!
//! They take on a speed as told, and move to the side of their way. They arrive at a place of their way when the ego
//! vehicle arrives at a place of its route, as in OpenSCENARIO's `SynchronizeAction`. They give way to no other road
//! user, and only a contact or the end of the way stops them.

use avastra_base::geometry::{Pose, smooth_step, unit_vector, wrap_angle};
use avastra_lang::model::command::{AsideBy, Command};

use crate::state::ego::VehicleParameters;
use crate::state::guided::{Guided, Meeting, Shift, Stage};
use crate::state::obstacle::{Moved, Obstacle};
use crate::state::pursuit::EgoKeeps;
use crate::state::time::DT_S;
use crate::view::around::Around;
use avastra_lang::model::body::BodyParameters;

/// How fast one moves to the side that is told no `aside`, m/s. Ours.
pub const ASIDE_MPS: f64 = 1.0;

/// An ego vehicle slower than this does not arrive, m/s: a road user that is to meet it stands, too.
const STANDING_MPS: f64 = 0.01;

/// A speed so near to that of a steady change leads to the place in time, m/s.
const ON_LINE_MPS: f64 = 0.1;

impl Meeting {
    fn told(command: &Command) -> Option<Meeting> {
        Some(Meeting {
            ego_m: command.at_m()?,
            early_s: command.early_s()?,
            reach_m: command.reach_m()?,
            mps: command.speed_mps(),
            steady_m: command.steady_m().unwrap_or(0.0),
            stage: Stage::Adapting,
            ego_keeps: EgoKeeps::default(),
        })
    }

    /// The least error of its arrival if the ego vehicle keeps its speed, s. It is above 0 if the road user is late
    /// even at full speed, and below 0 if it is early even if it brakes. `gains_mps2` and `loses_mps2` are the limits
    /// of the road user's body. `None` once the ego vehicle has not kept its speed.
    fn late_s(
        &mut self,
        station_m: f64,
        speed_mps: f64,
        [gains_mps2, loses_mps2]: [f64; 2],
        around: &Around,
    ) -> Option<f64> {
        let ego_mps = around.ego.speed_mps;
        if !self.ego_keeps.look(ego_mps, STANDING_MPS) {
            return None;
        }
        let ego_m = self.ego_m - VehicleParameters::MKZ.front_m(around.ego_station_m);
        let left_s = ego_m / ego_mps - self.early_s + DT_S;
        let own_m = (self.reach_m - station_m).max(0.0);
        let (way_m, steady_s, end_mps) = match self.mps {
            Some(mps) if mps > 0.0 => ((own_m - self.steady_m).max(0.0), own_m.min(self.steady_m) / mps, mps),
            _ => (own_m, 0.0, f64::INFINITY),
        };
        let squared = |mps: f64| mps * mps;
        let (gain_twice_mps2, loss_twice_mps2) = (2.0 * gains_mps2, 2.0 * loses_mps2);
        let reached_mps = (squared(speed_mps) + gain_twice_mps2 * way_m).sqrt();
        let soonest_s = if reached_mps <= end_mps {
            (reached_mps - speed_mps) / gains_mps2
        } else {
            // It gains speed up to some point, and then loses it again; one that is too fast only loses it.
            let top_m = way_m + squared(speed_mps) / gain_twice_mps2 + squared(end_mps) / loss_twice_mps2;
            let top_mps = (top_m / (1.0 / gain_twice_mps2 + 1.0 / loss_twice_mps2)).sqrt().max(speed_mps);
            let lost_mps =
                top_mps - (squared(top_mps) - loss_twice_mps2 * way_m).max(squared(end_mps)).sqrt();
            (top_mps - speed_mps) / gains_mps2 + lost_mps / loses_mps2
        };
        // One that can stop before the place may be there as late as it wants to.
        let slowed_mps_squared = squared(speed_mps) - loss_twice_mps2 * way_m;
        let latest_s = if slowed_mps_squared < 0.0 {
            f64::INFINITY
        } else {
            (speed_mps - slowed_mps_squared.sqrt()) / loses_mps2
        };
        let (too_late_s, too_soon_s) = (soonest_s + steady_s - left_s, latest_s + steady_s - left_s);
        Some(if too_late_s > 0.0 { too_late_s } else { too_soon_s.min(0.0) })
    }

    /// The speed for the next tick; `None` once it is there, or the ego vehicle is.
    fn speed_mps(&mut self, station_m: f64, speed_mps: f64, around: &Around) -> Option<f64> {
        let own_m = self.reach_m - station_m;
        let ego_m = self.ego_m - VehicleParameters::MKZ.front_m(around.ego_station_m);
        if own_m <= 0.0 || ego_m <= 0.0 {
            return None;
        }
        if let (Stage::Steady, Some(mps)) = (self.stage, self.mps) {
            return Some(mps);
        }
        let ego_mps = around.ego.speed_mps;
        if ego_mps < STANDING_MPS {
            self.stage = Stage::Adapting;
            return Some(0.0);
        }
        // The ego vehicle has moved in this tick already.
        let left_s = ego_m / ego_mps - self.early_s + DT_S;
        let Some(mps) = self.mps else { return Some(own_m / left_s.max(DT_S)) };
        let steady_s = if self.steady_m > 0.0 { self.steady_m / mps } else { 0.0 };
        let (way_m, time_s) = (own_m - self.steady_m, left_s - steady_s);
        if way_m <= 0.0 || time_s <= DT_S {
            self.stage = Stage::Steady;
            return Some(mps);
        }
        let on_line_mps = 2.0 * way_m / time_s - mps;
        if self.stage == Stage::Adapting && (speed_mps - on_line_mps).abs() < ON_LINE_MPS {
            self.stage = Stage::OnLine;
        }
        Some(match self.stage {
            Stage::OnLine => on_line_mps.max(0.0),
            Stage::Adapting | Stage::Steady => {
                (speed_mps + adapting_mps2(speed_mps, mps, way_m, time_s) * DT_S).max(0.0)
            }
        })
    }
}

/// The acceleration now, m/s², of a body that goes over from `from_mps` to `to_mps` on this way in this time: first
/// this one, then an equal one against it. If the way is too short for that, it brakes to a stop, from which it sets
/// out again later.
fn adapting_mps2(from_mps: f64, to_mps: f64, way_m: f64, time_s: f64) -> f64 {
    let lacks_m = 2.0 * way_m - (from_mps + to_mps) * time_s;
    let more_m = (to_mps - from_mps) * time_s;
    let mps2 = (lacks_m + lacks_m.signum() * libm::hypot(lacks_m, more_m)) / (time_s * time_s);
    let turns_s = time_s / 2.0 + (to_mps - from_mps) / (2.0 * mps2);
    if from_mps + mps2 * turns_s < 0.0 {
        return -(from_mps * from_mps + to_mps * to_mps) / (2.0 * way_m);
    }
    mps2
}

impl Guided {
    /// Where it begins.
    pub fn begins(&self) -> Moved {
        self.moved(0.0, 0.0)
    }

    pub fn order(&mut self, command: &Command) {
        let told = Meeting::told(command);
        if told.is_some() {
            self.late_s = None;
        }
        self.meeting = told.or(self.meeting.filter(|_| command.speed_mps().is_none()));
        if let Some(speed_mps) = command.speed_mps().filter(|_| command.early_s().is_none()) {
            self.wants_mps = speed_mps;
            self.rate_mps2 = command.rate_mps2().unwrap_or(f64::INFINITY);
        }
        if let Some(to_m) = command.offset_m() {
            let by_m = (to_m - self.left_m).abs();
            let takes_s = command.aside().unwrap_or(AsideBy::Speed(ASIDE_MPS)).takes_s(by_m);
            let shift = Shift { from_m: self.left_m, to_m, takes_s, since_s: 0.0 };
            self.shift = (by_m > 0.0).then_some(shift);
        }
    }

    /// Where it is at the end of a tick. One that has `touched` the ego vehicle stays where it is.
    pub fn step(&mut self, this: &Obstacle, size: &BodyParameters, touched: bool, around: &Around) -> Moved {
        if touched {
            self.speed_mps = 0.0;
            return Moved::at_rest(this);
        }
        let before_mps = self.speed_mps;
        let mut is_at_once = false;
        if let Some(meeting) = &mut self.meeting {
            // To arrive in time may take more than its body can do.
            let (gains_mps2, loses_mps2) =
                (size.acceleration_mps2_max, around.braking_mps2(size, self.speed_mps));
            // In its last part it goes on whatever the ego vehicle does.
            if meeting.stage != Stage::Steady {
                let late_s = meeting.late_s(self.station_m, self.speed_mps, [gains_mps2, loses_mps2], around);
                self.late_s = late_s.or(self.late_s);
            }
            match meeting.speed_mps(self.station_m, self.speed_mps, around) {
                Some(speed_mps) => {
                    let (least_mps, most_mps) =
                        (before_mps - loses_mps2 * DT_S, before_mps + gains_mps2 * DT_S);
                    self.speed_mps = speed_mps.clamp(least_mps, most_mps);
                }
                None => {
                    self.wants_mps = meeting.mps.unwrap_or(self.speed_mps);
                    self.rate_mps2 = match self.wants_mps - self.speed_mps {
                        lacks_mps if lacks_mps > 0.0 => gains_mps2,
                        lacks_mps if lacks_mps < 0.0 => loses_mps2,
                        _ => f64::INFINITY,
                    };
                    self.meeting = None;
                }
            }
        }
        if self.meeting.is_none() && self.speed_mps != self.wants_mps {
            let most_mps = self.rate_mps2 * DT_S;
            self.speed_mps += (self.wants_mps - self.speed_mps).clamp(-most_mps, most_mps);
            is_at_once = self.rate_mps2.is_infinite();
        }
        let mean_mps = if is_at_once { self.speed_mps } else { (before_mps + self.speed_mps) / 2.0 };
        let before_m = self.station_m;
        self.station_m = (self.station_m + mean_mps * DT_S).clamp(0.0, self.way.path.length_m());
        if self.is_over() {
            self.speed_mps = 0.0;
        }
        let left_m = self.left_m;
        // A vehicle that stands moves no farther to the side.
        let may_shift = self.station_m != before_m || self.turns_on_the_spot();
        if let Some(shift) = self.shift.as_mut().filter(|_| may_shift) {
            shift.since_s += DT_S;
            let part = shift.since_s / shift.takes_s;
            self.left_m = shift.from_m + (shift.to_m - shift.from_m) * smooth_step(part).value;
            if part >= 1.0 {
                self.left_m = shift.to_m;
                self.shift = None;
            }
        }
        self.moved(self.station_m - before_m, self.left_m - left_m)
    }

    /// Where it is, after a tick in which it has gone so far along its way and to the left, m.
    fn moved(&self, along_m: f64, left_m: f64) -> Moved {
        let way = self.way.path.pose_at(self.station_m);
        // A vehicle looks where it goes, or where it comes from.
        let back = if along_m < 0.0 { -1.0 } else { 1.0 };
        let askew_rad = match left_m == 0.0 {
            true => 0.0,
            false => libm::atan2(back * left_m, (back * along_m).max(f64::MIN_POSITIVE)),
        };
        let course_rad = wrap_angle(way.heading_rad + askew_rad);
        // In a skid it does not look where it goes.
        let heading_rad = wrap_angle(course_rad + self.way.turned_rad(self.station_m));
        let forward = unit_vector(heading_rad);
        let position = way.offset(0.0, self.left_m).position + forward * self.to_middle_m;
        Moved {
            pose: Pose { position, heading_rad },
            forward,
            lane_heading_rad: way.heading_rad,
            velocity_mps: unit_vector(course_rad) * self.speed_mps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn way_and_time_come_out_right_and_so_does_the_speed() {
        for (from_mps, to_mps, way_m, time_s) in
            [(0.0, 8.0, 50.0, 10.0), (0.0, 8.0, 70.0, 10.0), (10.0, 5.0, 90.0, 10.0), (4.0, 4.0, 30.0, 8.0)]
        {
            let (mut at_m, mut mps) = (0.0_f64, from_mps);
            let mut is_on_line = false;
            let ticks = (time_s / DT_S).round() as u32;
            for tick in 0..ticks - 1 {
                let (left_m, left_s) = (way_m - at_m, time_s - f64::from(tick) * DT_S);
                let on_line_mps: f64 = 2.0 * left_m / left_s - to_mps;
                is_on_line |= (mps - on_line_mps).abs() < ON_LINE_MPS;
                let next_mps = match is_on_line {
                    true => on_line_mps.max(0.0),
                    false => (mps + adapting_mps2(mps, to_mps, left_m, left_s) * DT_S).max(0.0),
                };
                at_m += (mps + next_mps) / 2.0 * DT_S;
                mps = next_mps;
            }
            assert!((way_m - at_m - to_mps * DT_S).abs() < 0.1, "{way_m}: at {at_m}");
            assert!((mps - to_mps).abs() < 0.3, "{to_mps}: {mps}");
        }
    }
}
