//! Pedestrians who cross the road: they wait at the kerb, walk straight over to the other, and go out of sight.
//!
//! A pedestrian sets out when it would meet the ego vehicle in the middle of that vehicle's way. It waits at least 1 s
//! (published package) and at most 10 s. A pedestrian that is to be met at a point of the ego vehicle's front waits
//! until then, at most 60 s. Until it sets out it goes by the ego vehicle's speed of each moment. Then it walks
//! steadily, as the targets of Euro NCAP's tests do. Behind the other kerb it walks on as far as there is room, and
//! leaves the world when the ego vehicle cannot see it. A pedestrian with an ordered speed, by an order or by a phase
//! of its manoeuvre, sets out or turns round at once. From then on it walks steadily.
//!
//! The published package's pedestrian walks on, whatever comes. Here that is the most frequent of four manners,
//! drawn once from the pedestrian's own stream:
//!
//! | share | manner | what it does |
//! |---|---|---|
//! | 55 % | steady | walks on at its pace, whatever comes |
//! | 15 % | hesitant | stays at the kerb while a vehicle would be there within 3 s, at most 3 s longer |
//! | 15 % | startled | stops once, for 1 to 2 s, when a vehicle would reach it within 1.5 s |
//! | 15 % | hurried | runs, at most 8 km/h (Euro NCAP's running adult), while a vehicle would be there within 3 s |
//!
//! The shares and times are ours; no source counts them. No pedestrian walks into the side of a vehicle. Pedestrians
//! wait before it, pass each other on the right, and turn round after 10 s without a way on. A pedestrian who is hit
//! stops (see `road_user`).

use avastra_base::geometry::{OrientedBox, Pose, Vec2, distance_m, wrap_angle};
use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_road::is_apart;

use crate::state::ego::VehicleParameters;
use crate::state::obstacle::{Moved, Obstacle};
use crate::state::pedestrian::{Manner, Meeting, Walk, Walker};
use crate::state::time::{DT_S, FRAME_TICKS, ticks};
use crate::view::around::{Around, Other};

/// Least time at the kerb before setting out, s (published package).
const WAIT_S: f64 = 1.0;
/// Longest time at the kerb for the sake of a meeting, s. Ours.
const WAIT_S_MAX: f64 = 10.0;
/// Before setting out and in a hurry, pedestrians look at the ground in front of them up to this far, m: a lane.
const LOOK_M: f64 = 3.5;
/// Longest time at the kerb for the sake of a meeting at a point of the ego vehicle, s. Ours.
const MEETING_S_MAX: f64 = 60.0;
/// Running adult of Euro NCAP (8 km/h), m/s.
const RUN_MPS_MAX: f64 = 8.0 / 3.6;
/// Factor of the walking pace in a hurry. Ours.
const HURRY: f64 = 1.6;
/// A vehicle that would be there sooner is close, for pedestrians at the kerb or in a hurry, s.
const CLOSE_S: f64 = 3.0;
/// A vehicle that would be there sooner startles, s: perception and reaction of a driver take 1.15 s.
const STARTLE_S: f64 = 1.5;
/// Width that pedestrians add to each side of a vehicle's way, m.
const MARGIN_M: f64 = 1.0;
/// How far before their feet pedestrians look for obstacles, m.
const STEP_M: f64 = 0.6;
/// Room that they leave to such an obstacle, m.
const ROOM_M: f64 = 0.25;
/// A pedestrian ahead within this distance is passed, m.
const MEET_M: f64 = 3.0;
/// How far to the right it is passed, m, and the speed of stepping aside, m/s.
const ASIDE_M: f64 = 0.9;
const ASIDE_MPS: f64 = 0.7;
/// A pedestrian who cannot go on for so long turns round, s.
const GIVE_UP_S: f64 = 10.0;

impl Manner {
    fn draw(rng: &mut Rng) -> Manner {
        match rng::below(rng, 100) {
            0..55 => Manner::Steady,
            55..70 => Manner::Hesitant,
            70..85 => Manner::Startled,
            _ => Manner::Hurried,
        }
    }
}

impl Meeting {
    /// How long the pedestrian can still wait, s, if the ego vehicle keeps its speed and its place beside the route. It
    /// is negative if it is too late, and infinite before a vehicle that stands.
    pub fn left_s(self, speed_mps: f64, around: &Around) -> f64 {
        let aside_m = if self.comes_from_left { -around.ego_offset_m } else { around.ego_offset_m };
        let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
        let comes_s = match around.ego.speed_mps {
            0.0 => f64::INFINITY,
            ego_mps => (self.station_m - front_m) / ego_mps,
        };
        comes_s - (self.way_m + aside_m) / speed_mps
    }
}

impl Walker {
    /// A pedestrian that will walk; the manner is drawn.
    pub fn new(walk: Walk, spawn_tick: u64, rng: &mut Rng) -> Walker {
        let Walk { meeting, waits_s, from, way_m, beyond_m, speed_mps, meets_s } = walk;
        let is_told = meeting.is_some() || waits_s.is_some();
        let for_meeting_s = if meeting.is_some() { MEETING_S_MAX } else { meets_s.clamp(WAIT_S, WAIT_S_MAX) };
        let begins_tick = spawn_tick + ticks(waits_s.unwrap_or(for_meeting_s));
        let drawn = Manner::draw(rng);
        let manner = if is_told { Manner::Steady } else { drawn };
        Walker {
            meeting,
            from,
            along: from.forward(),
            way_m,
            end_m: way_m + beyond_m,
            speed_mps,
            manner,
            startle_ticks: ticks(rng::between(rng, 1.0, 2.0)) as u32,
            walked_m: 0.0,
            aside_m: 0.0,
            returns: false,
            is_told: false,
            looks_now: false,
            pace_mps: speed_mps,
            wants_aside_m: 0.0,
            begins_tick,
            begins_tick_max: begins_tick + ticks(CLOSE_S),
            stuck_ticks: 0,
        }
    }

    /// The strip of ground that it still has to walk over, as wide as the pedestrian.
    pub fn strip(&self, this: &OrientedBox) -> OrientedBox {
        let (from_m, to_m) = if self.returns { (0.0, self.walked_m) } else { (self.walked_m, self.end_m) };
        let middle = self.from.offset((from_m + to_m) / 2.0, 0.0);
        OrientedBox::new(middle, to_m - from_m, 2.0 * this.half_width_m)
    }

    /// From now on it walks at this speed, m/s, steadily; below 0 it turns round and goes back to where it began.
    pub fn order(&mut self, speed_mps: f64, tick: u64) {
        self.is_told = true;
        self.speed_mps = speed_mps.abs();
        self.pace_mps = self.speed_mps;
        (self.looks_now, self.stuck_ticks) = (true, 0);
        if speed_mps != 0.0 && self.returns != (speed_mps < 0.0) {
            self.returns = !self.returns;
            self.wants_aside_m = 0.0;
        }
        (self.meeting, self.manner, self.begins_tick) = (None, Manner::Steady, tick);
    }

    /// Where it is at the end of a tick; `None` once it has left, which the ego vehicle does not see (`in_sight`).
    pub fn step(&mut self, this: &Obstacle, in_sight: bool, around: &Around) -> Option<Moved> {
        if self.is_over() {
            return in_sight.then_some(Moved::at_rest(this));
        }
        let is_due = around.is_due(this.id, FRAME_TICKS);
        if core::mem::take(&mut self.looks_now) || is_due {
            self.look(this, around);
        }
        // The step of this tick is the first if waiting for another one would be too long.
        if self.meeting.is_some_and(|meeting| meeting.left_s(self.speed_mps, around) < DT_S) {
            (self.meeting, self.begins_tick) = (None, around.tick);
        }
        if around.tick < self.begins_tick {
            return Some(Moved::at_rest(this));
        }
        // One that was ordered to go waits for whatever is in the way, and does not turn round by itself.
        if self.is_told && self.pace_mps == 0.0 {
            return Some(Moved::at_rest(this));
        }
        if self.pace_mps == 0.0 {
            self.stuck_ticks += 1;
            if f64::from(self.stuck_ticks) * DT_S < GIVE_UP_S {
                return Some(Moved::at_rest(this));
            }
            self.stuck_ticks = 0;
            if self.walked_m >= self.way_m {
                // It is over the road, so this place is as good as any.
                self.end_m = self.walked_m;
            } else if self.walked_m > 0.0 {
                self.returns = !self.returns;
                self.wants_aside_m = 0.0;
            }
            return Some(Moved { velocity_mps: Vec2::zeros(), ..self.moved(this) });
        }
        self.stuck_ticks = 0;
        let step_m = self.pace_mps * DT_S;
        self.walked_m = if self.returns {
            (self.walked_m - step_m).max(0.0)
        } else {
            (self.walked_m + step_m).min(self.end_m)
        };
        let aside_m = (self.wants_aside_m - self.aside_m).clamp(-ASIDE_MPS * DT_S, ASIDE_MPS * DT_S);
        self.aside_m += aside_m;
        Some(self.moved(this))
    }

    /// Where it is now, with the velocity since it was at `this`.
    fn moved(&self, this: &Obstacle) -> Moved {
        let turn_rad = if self.returns { core::f64::consts::PI } else { 0.0 };
        let left = Vec2::new(-self.along.y, self.along.x);
        let position = self.from.position + self.along * self.walked_m + left * self.aside_m;
        let pose = Pose { position, heading_rad: wrap_angle(self.from.heading_rad + turn_rad) };
        let forward = if pose.heading_rad == self.from.heading_rad { self.along } else { pose.forward() };
        let velocity_mps = (position - this.outline.pose.position) / DT_S;
        Moved { pose, forward, lane_heading_rad: pose.heading_rad, velocity_mps }
    }

    /// Looks, ten times a second, for vehicles that come and for what is in the way, and sets the pace.
    fn look(&mut self, this: &Obstacle, around: &Around) {
        let waits = around.tick < self.begins_tick && self.walked_m == 0.0;
        // Whether a vehicle would soon be where it stands, or on the next lane's width of its way.
        let comes_close = || {
            [0.0, LOOK_M / 2.0, LOOK_M].into_iter().any(|ahead_m| {
                let there = OrientedBox { pose: this.outline.pose.offset(ahead_m, 0.0), ..this.outline };
                soonest_s(&there, this.elevation_m, around) < CLOSE_S
            })
        };
        if waits {
            let held_to = (around.tick + FRAME_TICKS + 1).min(self.begins_tick_max);
            if self.manner == Manner::Hesitant && held_to > self.begins_tick && comes_close() {
                self.begins_tick = held_to;
            }
            return;
        }
        // On the right, seen in its walking direction.
        let right_m = if self.returns { ASIDE_M } else { -ASIDE_M };
        self.wants_aside_m = if self.meets_pedestrian(around) { right_m } else { 0.0 };
        let startled = self.manner == Manner::Startled && self.startle_ticks > 0;
        // One that was told to turn round has not done so yet.
        let pose = if self.is_told { self.moved(this).pose } else { this.outline.pose };
        if is_blocked(pose, this, around) {
            self.pace_mps = 0.0;
        } else if startled
            && (self.pace_mps == 0.0 || soonest_s(&this.outline, this.elevation_m, around) < STARTLE_S)
        {
            self.startle_ticks = self.startle_ticks.saturating_sub(FRAME_TICKS as u32);
            self.pace_mps = 0.0;
        } else if self.manner == Manner::Hurried && comes_close() {
            self.pace_mps = (self.speed_mps * HURRY).min(RUN_MPS_MAX).max(self.speed_mps);
        } else {
            self.pace_mps = self.speed_mps;
        }
    }

    /// Whether another pedestrian is ahead on about the same line.
    fn meets_pedestrian(&self, around: &Around) -> bool {
        around.obstacles().filter(|other| !other.body.is_vehicle()).any(|other| {
            let away = other.outline.pose.position - self.from.position;
            let along_m = self.along.dot(&away);
            let ahead_m = if self.returns { self.walked_m - along_m } else { along_m - self.walked_m };
            (-1.0..MEET_M).contains(&ahead_m) && self.along.perp(&away).abs() < 2.0 * ASIDE_M
        })
    }
}

/// Whether the ego vehicle or another road user stands or passes right before the feet of one on foot at a pose.
pub fn is_blocked(pose: Pose, this: &Obstacle, around: &Around) -> bool {
    let next = OrientedBox { pose: pose.offset(STEP_M, 0.0), ..this.outline };
    around.others().any(|Other { outline, elevation_m, .. }| {
        let reach_m = outline.half_length_m + outline.half_width_m + 2.0;
        let away = outline.pose.position - next.pose.position;
        away.norm_squared() < reach_m * reach_m
            && distance_m(&next, outline) < ROOM_M
            && !is_apart(this.elevation_m, elevation_m)
    })
}

/// Time until the first vehicle would reach an outline at a height (m) if all vehicles keep their velocity, s.
fn soonest_s(outline: &OrientedBox, elevation_m: f64, around: &Around) -> f64 {
    let level = around.vehicles().filter(|vehicle| !is_apart(elevation_m, vehicle.elevation_m));
    level.fold(f64::INFINITY, |soonest_s, vehicle| {
        soonest_s.min(arrival_s(outline, vehicle.outline, vehicle.velocity_mps))
    })
}

fn arrival_s(outline: &OrientedBox, vehicle: &OrientedBox, velocity_mps: Vec2) -> f64 {
    let away = outline.pose.position - vehicle.pose.position;
    let speed_mps = velocity_mps.norm();
    if speed_mps < 1.0 || away.norm_squared() > 60.0 * 60.0 {
        return f64::INFINITY;
    }
    let forward = velocity_mps / speed_mps;
    let ahead_m = forward.dot(&away) - vehicle.half_length_m - outline.half_length_m;
    let aside_m = (forward.x * away.y - forward.y * away.x).abs();
    if ahead_m < 0.0 || aside_m > vehicle.half_width_m + outline.half_width_m + MARGIN_M {
        return f64::INFINITY;
    }
    ahead_m / speed_mps
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::Stream;

    #[test]
    fn manners_come_in_their_shares() {
        let mut rng = rng::stream(3, Stream::Traffic, 0);
        let mut found = [0; 4];
        for _ in 0..2000 {
            found[Manner::draw(&mut rng) as usize] += 1;
        }
        for (count, share) in found.iter().zip([0.55, 0.15, 0.15, 0.15]) {
            assert!((f64::from(*count) / 2000.0 - share).abs() < 0.03, "{found:?}");
        }
    }

    #[test]
    fn a_vehicle_that_comes_is_told_from_one_that_passes() {
        let walker = OrientedBox::new(Pose::new(0.0, 0.0, 0.0), 0.5, 0.5);
        let car = |x_m, y_m| OrientedBox::new(Pose::new(x_m, y_m, 0.0), 4.0, 2.0);
        let speed = Vec2::new(10.0, 0.0);
        assert!((arrival_s(&walker, &car(-22.25, 0.0), speed) - 2.0).abs() < 1e-9);
        assert_eq!(arrival_s(&walker, &car(-22.0, 4.0), speed), f64::INFINITY);
        assert_eq!(arrival_s(&walker, &car(22.0, 0.0), speed), f64::INFINITY);
        assert_eq!(arrival_s(&walker, &car(-22.0, 0.0), Vec2::zeros()), f64::INFINITY);
    }
}
