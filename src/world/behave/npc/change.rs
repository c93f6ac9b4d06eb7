//! Lane changes of other drivers: what they plan, when they begin one, and how they move over.
//!
//! A change is a smooth step from the way in one lane to that in another; its length depends on the speed
//! and the distance. All drivers obey markings, and none changes lanes inside a junction. How much room they
//! want, and how fast they move over, is the traffic profile's.

use std::sync::Arc;

use avastra_base::geometry::{
    OrientedBox, Pose, SMOOTH_STEP_BEND_MAX, SMOOTH_STEP_SLOPE_MAX, Vec2, distance_m, smooth_step, wrap_angle,
};
use avastra_base::kinematics::{GRAVITY_MPS2, braking_m};
use avastra_lang::model::command::AsideBy;
use avastra_lang::model::vocabulary::Side;
use avastra_road as road;
use avastra_road::{Lane, LaneIndex, is_apart};

use crate::action::SpawnRequest;
use crate::behave::npc::figures::SIDE_ROOM_M;
use crate::scene::lanes::{lane_beside, may_use};
use crate::scene::traffic::TrafficProfile;
use crate::scene::way::{Way, body_at};
use crate::state::change::{BrokenOff, CHANGE_FULL_MPS, Change, Towards, When, beside};
use crate::state::driver::Driver;
use crate::state::obstacle::Moved;
use crate::state::time::DT_S;
use crate::view::around::{Around, Other, View};
use crate::view::moment::{driver_facts, with_itself};
use avastra_lang::model::body::BodyParameters;

/// The sphere of LGSVL's check: its radius in half widths of the vehicle, and at most, m. Its centre is half a width
/// beside the corner of the front.
const SPHERE_PART: f64 = 0.75;
const SPHERE_M_MAX: f64 = 1.2;
/// After an aborted change at the limit of the grip, the change and the move back together may need this many times
/// the grip. Ours.
const GRIP_MORE: f64 = 1.1;
/// The move back takes at most about this many times as long as it would by itself.
const LED_BACK_MAX: f64 = 8.0;
/// Parts of the move back at which it and the aborted change are looked at together.
const BENDS: u32 = 50;
/// Headway to another vehicle that changes into the same lane, s. Ours.
const MERGE_S: f64 = 1.0;
/// Neighbouring lanes whose centres are farther apart than this have parted, m.
const CHANGE_M_MAX: f64 = 8.0;

impl BrokenOff {
    /// How long the move back lasts that undoes a change of `over_m` to the side, s. It is `least_s`, or longer if both
    /// moves together need it to keep within the grip times [`GRIP_MORE`].
    fn led_back_s(self, over_m: f64, least_s: f64, grip_mps2: f64) -> f64 {
        let most_mps2 = |back_s: f64| {
            let at = |nth: u32| {
                let part = f64::from(nth) / f64::from(BENDS);
                let left = smooth_step(self.progress + part * back_s / self.duration_s).bend;
                let back = smooth_step(part).bend;
                over_m * (back / (back_s * back_s) - left / (self.duration_s * self.duration_s)).abs()
            };
            (0..=BENDS).map(at).fold(0.0, f64::max)
        };
        let mut back_s = least_s;
        while most_mps2(back_s) > GRIP_MORE * grip_mps2 && back_s < LED_BACK_MAX * least_s {
            back_s *= 1.1;
        }
        back_s
    }
}

/// The origin of a lateral move: an order, or the driver's own wish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Whose {
    /// The driver's own: it leaves others room.
    Own,
    /// It was told to, and perhaps how. Then it begins as soon as no road user is beside it.
    Told(Option<AsideBy>),
}

impl Driver {
    /// Begins the next lane change of the plan if it is due, or one for its own gain. There must be a lane, and it must
    /// be free.
    pub fn begin_change(&mut self, view: &View) {
        let View { this, size, around } = *view;
        let Some(next) = self.plan.last() else {
            let Some(side) = self.wants_side(view) else { return };
            if let Some(begun) = self.change_to(side, self.aside_m(), Whose::Own, view) {
                self.set_out(begun, self.aside_m(), Whose::Own, view);
            }
            return;
        };
        let due = match next.when {
            When::Tick(tick) => around.tick >= tick,
            When::AheadOfEgo(gap_m) => {
                let ahead_m = around.ego_outline.pose.to_local(this.outline.pose.position).x;
                ahead_m - size.length_m / 2.0 - around.ego_outline.half_length_m >= gap_m
            }
        };
        if !due || self.is_moving_aside() || !self.may_change(view) {
            return;
        }
        let ends_m = self.aside_m();
        let change = |driver: &mut Driver, side| driver.change_to(side, ends_m, Whose::Own, view);
        let begun = match next.towards.clone() {
            Towards::Way(way) => {
                let to_m = way.path.project(this.outline.pose.position).station_m;
                Some((way, to_m, None))
            }
            Towards::To(side) => change(self, side),
            Towards::Either => change(self, Side::Left).or_else(|| change(self, Side::Right)),
            Towards::Back => match self.last_change {
                Some(Side::Left) => change(self, Side::Right),
                Some(Side::Right) => change(self, Side::Left),
                None => None,
            },
        };
        let Some(begun) = begun else { return };
        self.set_out(begun, self.aside_m(), Whose::Own, view);
        self.plan.pop();
    }

    /// Whether the rules on its lane changes let one begin now.
    pub fn may_change(&self, view: &View) -> bool {
        let View { this, around, .. } = *view;
        self.lane_changes.iter().all(|rules| {
            rules.allow(with_itself(around.moment_facts(), this, self), driver_facts(around, this, self))
        })
    }

    /// Begins a change to a way, at the own station there.
    pub fn set_out(
        &mut self,
        (to, to_station_m, side): (Arc<Way>, f64, Option<Side>),
        ends_m: f64,
        whose: Whose,
        view: &View,
    ) {
        let over = to.path.pose_at(to_station_m).position - self.middle(view.this);
        let aside_m = self.over_m(over, ends_m);
        let duration_s = duration_s(aside_m, self.speed_mps, whose, view.around);
        self.change = Some(Change { to, to_station_m, progress: 0.0, duration_s, ends_m, broken_off: None });
        self.last_change = side;
    }

    /// Turns back from a lane change under way to the lane that it leaves. One that leads back is not broken off again.
    pub fn break_off(&mut self, told: Option<AsideBy>, around: &Around) {
        let Some(change) = self.change.take_if(|change| change.broken_off.is_none()) else { return };
        let Change { to, to_station_m, progress, duration_s: took_s, ends_m, .. } = change;
        let (left, left_m, aside_m) = (Arc::clone(&self.way), self.station_m, self.aside_m());
        let over = to.path.position_at(to_station_m) - left.path.position_at(left_m);
        let back_s = duration_s(over.norm(), self.speed_mps, Whose::Told(told), around);
        let broken_off = BrokenOff { progress, duration_s: took_s };
        // Quicker than what is left of the first change it would lead beyond the middle of the lane.
        let least_s = back_s.max(took_s * (1.0 - progress));
        let grip_mps2 = around.grip.friction(self.speed_mps) * GRAVITY_MPS2;
        let duration_s = broken_off.led_back_s(over.norm(), least_s, grip_mps2);
        self.comes_into(to, to_station_m, ends_m);
        self.last_change = self.last_change.map(|side| match side {
            Side::Left => Side::Right,
            Side::Right => Side::Left,
        });
        self.change = Some(Change {
            to: left,
            to_station_m: left_m,
            progress: 0.0,
            duration_s,
            ends_m: aside_m,
            broken_off: Some(broken_off),
        });
    }

    /// The way in the neighbouring lane, if there is one and room in it, and the own station there.
    pub fn change_to(
        &mut self,
        side: Side,
        ends_m: f64,
        whose: Whose,
        view: &View,
    ) -> Option<(Arc<Way>, f64, Option<Side>)> {
        let View { this, size, around } = *view;
        let map = &around.scene.map;
        let (here, here_m) = self.way.lane_at(self.station_m);
        let target = lane_beside(around.scene, here, side)?;
        if !may_use(around.scene, target, this.body, self.ignores) {
            return None;
        }
        let centre = &map.lane(target).centre;
        let there = centre.project(self.middle(this));
        let aside_m = match ends_m == self.aside_m() {
            true => there.distance_m,
            false => self.over_m(centre.position_at(there.station_m) - self.middle(this), ends_m),
        };
        // `change_room_m` ends at markings that forbid a change, and at junctions, where lanes part.
        let room_m = map.change_room_m(here, on_road(side), here_m);
        if there.distance_m > CHANGE_M_MAX
            || room_m < length_m(self.speed_mps, aside_m, whose, around)
            || !self.may_enter(side, (map.lane(target), there.station_m, ends_m), whose, view)
            || whose == Whose::Own && around.scene.is_motorway && self.is_wanted(target, view)
        {
            return None;
        }
        let mut rng = self.draw(this.id, around);
        let turning = self.turn_to_lay(size);
        let (way, lane) = Way::turning(&around.scene.roads, &[target], turning, &mut rng)?;
        turning.iter().for_each(|to| self.mean_to_turn(*to, lane));
        Some((way, there.station_m, Some(side)))
    }

    /// Whether the profile's check of the other lane lets it change.
    fn may_enter(&self, side: Side, place: (&Lane, f64, f64), whose: Whose, view: &View) -> bool {
        let View { this, size, around } = *view;
        if whose != Whose::Own || !around.traffic.change_by_sphere {
            return self.is_free(place, size, whose, around);
        }
        let left = Vec2::new(-this.forward.y, this.forward.x);
        let sphere_m = (SPHERE_PART * size.width_m / 2.0).min(SPHERE_M_MAX);
        let aside = if side == Side::Left { left * size.width_m } else { left * -size.width_m };
        let centre = this.outline.pose.position + this.forward * (size.length_m / 2.0) + aside;
        let point = OrientedBox::new(Pose { position: centre, ..this.outline.pose }, 0.0, 0.0);
        self.minded(around).all(|other| {
            distance_m(&point, other.outline) > sphere_m || is_apart(this.elevation_m, other.elevation_m)
        })
    }

    /// Whether another driver changes into a lane where this one would, from its other side. In towns drivers do not ask:
    /// there, speeds are low and three lanes rare.
    fn is_wanted(&self, lane: LaneIndex, view: &View) -> bool {
        let View { this, size, around } = *view;
        around.drivers().any(|(obstacle, body, driver)| {
            let Some(change) = &driver.change else { return false };
            let ahead_m = this.forward.dot(&(obstacle.outline.pose.position - this.outline.pose.position));
            let closing_mps = (driver.speed_mps - self.speed_mps) * -ahead_m.signum();
            let apart_m = ahead_m.abs() - (size.length_m + body.length_m) / 2.0;
            let wanted_m = change_gap_m(closing_mps.max(0.0), around.traffic).max(self.speed_mps * MERGE_S);
            change.to.lane_at(change.to_station_m).0 == lane && apart_m <= wanted_m
        })
    }

    /// Whether no vehicle is or soon would be beside it at an offset in another lane, and none has to brake hard for
    /// it.
    fn is_free(
        &self,
        (lane, station_m, ends_m): (&Lane, f64, f64),
        size: &BodyParameters,
        whose: Whose,
        around: &Around,
    ) -> bool {
        let gap_m = |closing_mps: f64| match whose {
            Whose::Own => change_gap_m(closing_mps, around.traffic),
            Whose::Told(_) => 0.0,
        };
        let path = &lane.centre;
        let here = path.pose_at(station_m);
        let forward = here.forward();
        // On a motorway a driver that closes in on a leader will brake. Vehicles behind therefore close in on it faster
        // than its present speed says.
        let slowed_mps = match &self.leader {
            Some(leader) if around.scene.is_motorway => self.speed_mps.min(leader.speed_mps.max(0.0)),
            _ => self.speed_mps,
        };
        self.minded(around).all(|Other { outline, forward: heading, velocity_mps, elevation_m }| {
            let ahead_m = forward.dot(&(outline.pose.position - here.position));
            let Some(other) = path.project_from(outline.pose.position, station_m + ahead_m) else {
                return true;
            };
            let (half_length_m, half_width_m) = outline.half_extent_m(heading, other.forward);
            let aside_m = (other.offset_m - ends_m).abs() - half_width_m - size.width_m / 2.0;
            let apart_m = (other.station_m - station_m).abs() - half_length_m - size.length_m / 2.0;
            let along_mps = velocity_mps.dot(&forward);
            let closing_mps = match other.station_m < station_m {
                true => along_mps - slowed_mps,
                false => self.speed_mps - along_mps,
            };
            aside_m > SIDE_ROOM_M
                || apart_m > gap_m(closing_mps.max(0.0))
                || is_apart(lane.height_at(other.station_m), elevation_m)
        })
    }

    /// Where it is after a tick in which it drove `way_m`, with the lane change under way moved on. `before`
    /// is where its centre was.
    pub fn advance_change(&mut self, way_m: f64, before: Vec2, size: &BodyParameters) -> Moved {
        let (from, wheelbase) = body_at(&self.way.path, self.station_m, size);
        // The velocity is measured, because in a bend the centre of a body is slower than its way, and between two
        // lanes it has neither lane's speed.
        let at = |pose: Pose, lane_heading_rad| Moved {
            pose,
            forward: if pose.heading_rad == from.heading_rad { wheelbase.forward } else { pose.forward() },
            lane_heading_rad,
            velocity_mps: (pose.position - before) / DT_S,
        };
        let from_lane_rad = if wheelbase.is_straight { from.heading_rad } else { self.lane_heading_rad() };
        let aside_m = self.aside_m();
        let Some(change) = &mut self.change else {
            return at(self.moved_aside(from, way_m), from_lane_rad);
        };
        // No move to another place in the lane is under way at the same time.
        let from = beside(from, aside_m);
        let guess_m = change.to_station_m + way_m;
        change.to_station_m =
            change.to.path.project_from(from.position, guess_m).map_or(guess_m, |found| found.station_m);
        let to = beside(body_at(&change.to.path, change.to_station_m, size).0, change.ends_m);
        let to_lane_rad = change.to.path.heading_at(change.to_station_m);
        change.advance(way_m, self.speed_mps);
        if change.is_over() {
            let (way, station_m, ends_m) = (Arc::clone(&change.to), change.to_station_m, change.ends_m);
            self.change = None;
            self.comes_into(way, station_m, ends_m);
            return at(to, to_lane_rad);
        }
        let blend = change.done_after(0.0, self.speed_mps);
        let heading_rad = from.heading_rad + wrap_angle(to.heading_rad - from.heading_rad) * blend;
        let turned_rad = libm::atan(change.slope(from.to_local(to.position).y, self.speed_mps));
        let pose = Pose {
            position: from.position + (to.position - from.position) * blend,
            heading_rad: wrap_angle(heading_rad + turned_rad),
        };
        at(pose, if blend < 0.5 { from_lane_rad } else { to_lane_rad })
    }
}

/// Whether the street on which a way is at a station has room for a lane change to a side. In a junction, the next
/// street counts.
pub fn can_change(around: &Around, way: &Way, station_m: f64, side: Side, request: &SpawnRequest) -> bool {
    let map = &around.scene.map;
    let in_junction = |lane: LaneIndex| map.lane(lane).junction.is_some();
    let ahead = way.lanes_from(station_m).skip_while(|(lane, _)| in_junction(*lane));
    ahead.take_while(|(lane, _)| !in_junction(*lane)).any(|(lane, at_m)| {
        let Some(target) = lane_beside(around.scene, lane, side) else { return false };
        if !may_use(around.scene, target, request.body, request.ignores()) {
            return false;
        }
        let here = map.lane(lane).centre.pose_at(at_m).position;
        let aside_m = map.lane(target).centre.project(here).distance_m;
        let length_m = length_m(request.speed_mps, aside_m, Whose::Own, around);
        map.changes_from_m(lane, on_road(side), at_m).iter().any(|(_, room_m)| *room_m >= length_m)
    })
}

fn change_duration_s(aside_m: f64, traffic: &TrafficProfile) -> f64 {
    (SMOOTH_STEP_SLOPE_MAX * aside_m / traffic.change_mps_max).max(traffic.change_s_min)
}

/// Gap that a change needs to another vehicle in the other lane, m, if it closes at a speed. It is the room of the
/// profile, and enough for the rear vehicle to slow down as hard as is safe.
fn change_gap_m(closing_mps: f64, traffic: &TrafficProfile) -> f64 {
    let slowing_m = braking_m(closing_mps, traffic.change_safe_mps2);
    traffic.change_room_m + slowing_m.max(closing_mps * traffic.change_time_s)
}

/// How long a move of `aside_m` to the side takes at a speed of at least [`CHANGE_FULL_MPS`], s. One that was told a speed to
/// the side is no quicker than the grip of the road allows.
pub fn duration_s(aside_m: f64, speed_mps: f64, whose: Whose, around: &Around) -> f64 {
    match whose {
        Whose::Own | Whose::Told(None) => change_duration_s(aside_m, around.traffic),
        Whose::Told(Some(told)) => {
            let grip_mps2 = around.grip.friction(speed_mps) * GRAVITY_MPS2;
            told.takes_s(aside_m).max((SMOOTH_STEP_BEND_MAX * aside_m / grip_mps2).sqrt())
        }
    }
}

/// Way that a lane change of `aside_m` to the side takes at a speed, m.
fn length_m(speed_mps: f64, aside_m: f64, whose: Whose, around: &Around) -> f64 {
    speed_mps.max(CHANGE_FULL_MPS) * duration_s(aside_m, speed_mps, whose, around)
}

fn on_road(side: Side) -> road::Side {
    match side {
        Side::Left => road::Side::Left,
        Side::Right => road::Side::Right,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_leaves_the_vehicle_behind_room_to_slow_down() {
        let traffic = TrafficProfile::default();
        assert_eq!(change_gap_m(0.0, &traffic), 2.0);
        assert_eq!(change_gap_m(6.0, &traffic), 8.0, "a second");
        assert_eq!(change_gap_m(12.0, &traffic), 20.0, "144 / (2 · 4)");
        // One lane of 3.5 m at 1.8 m/s.
        assert!((change_duration_s(3.5, &traffic) * 1.8 - 3.5 * SMOOTH_STEP_SLOPE_MAX).abs() < 1e-12);
    }
}
