//! Notes of a road user and the ego vehicle, made ten times a second, and read at a contact.

use crate::behave::right_of_way::crossing::{Crossing, cuts_across};
use crate::behave::right_of_way::on_foot::{Strip, on_foot, whatever_the_room};
use crate::behave::right_of_way::room::{ABRUPT_MPS2, APPROACH_M, allowed_mps, can_stop, room_before_m};
use crate::behave::right_of_way::side::{Beside, Side, beyond_middle};
use crate::behave::right_of_way::vehicle::Vehicle;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::passed::Passed;
use crate::state::rights::{Foreseen, Meeting, Place, Rights};
use crate::state::road_user::Motion;
use crate::state::ruling::{Mover, Rule, Ruling};
use crate::view::around::Around;
use avastra_base::geometry::Vec2;
use avastra_base::kinematics::{STANDING_MPS, WALKING_MPS};
use avastra_lang::model::vocabulary::{Body, Priority};

/// A pedestrian within this distance of the strip that the ego vehicle drives on is in its way, m. Ours.
const BESIDE_M: f64 = 0.5;
/// Farther to the side of that strip a pedestrian is on another road, m: six lanes.
const CARRIAGEWAY_M: f64 = 21.0;
/// A vehicle that stood in the ego vehicle's way and has moved by less stands there still, m. Ours.
const STEP_M: f64 = 2.0;
/// One that stood beside it and has moved by more stands elsewhere, m. Ours.
const MOVED_M: f64 = 0.1;

impl Meeting {
    /// Whether what was found in a lane holds no longer: the one behind has its distance back, or had the time to stop.
    pub fn is_over(&self, side: &Side, time_s: f64) -> bool {
        match self.ruling.rule {
            Rule::Clearing => side.backs(self.ruling.mover),
            // One vehicle turns across the other's way; they do not follow each other.
            Rule::Overtaking | Rule::Siren => false,
            _ => side.is_gentle() || side.along > 0.0 && time_s > self.rests_s,
        }
    }
}

impl Rights {
    /// Notes if one of the two came into the other's way; called ten times a second. `in_sight` says whether the ego
    /// vehicle sees the road user.
    pub fn watch(
        &mut self,
        this: &Obstacle,
        motion: &Motion,
        ego_passed: &Passed,
        in_sight: bool,
        around: &Around,
    ) {
        if this.distance_m > APPROACH_M {
            return;
        }
        let Some(vehicle) = Vehicle::of(this, motion) else {
            return self.watch_on_foot(this, in_sight, around);
        };
        self.foresee(this, in_sight, around);
        self.watch_vehicle(&vehicle, ego_passed, around);
    }

    /// Looks whether the road user, which has crashed, lies in the ego vehicle's way; ten times a second.
    pub fn watch_wreck(&mut self, this: &Obstacle, around: &Around) {
        if self.wreck.is_none() && this.distance_m <= APPROACH_M {
            self.wreck = room_before_m(this, around).map(|room_m| {
                let has_time = can_stop(allowed_mps(around.ego.speed_mps, around), room_m, ABRUPT_MPS2);
                (if has_time { Priority::Other } else { Priority::None }, around.time_s())
            });
        }
    }

    /// Whether the road user drives into a junction across the route of the ego vehicle, which goes first there.
    pub fn cuts_across_ego(
        &self,
        this: &Obstacle,
        motion: &Motion,
        ego_passed: &Passed,
        around: &Around,
    ) -> bool {
        let vehicle = Vehicle::of(this, motion);
        vehicle.is_some_and(|vehicle| cuts_across(&vehicle, [ego_passed, &self.passed], around))
    }

    /// The priority now that the road user, which has crashed, and the ego vehicle touch.
    pub fn at_contact_with_wreck(&self, this: &Obstacle, around: &Around) -> Ruling {
        // The ego vehicle came to where it stood, or it slid to where the ego vehicle drove.
        let stands = this.velocity_mps == Vec2::zeros();
        let by_motion = || (if stands { Priority::Other } else { Priority::None }, around.time_s());
        let (priority, time_s) = self.wreck.unwrap_or_else(by_motion);
        let mover = if stands { Mover::Ego } else { Mover::Both };
        Ruling { priority, rule: Rule::Wreck, mover, time_s }
    }

    /// Which of the two had priority, when they touch at `point`.
    pub fn at_contact(&self, this: &Obstacle, motion: &Motion, point: Vec2, around: &Around) -> Ruling {
        let found = self.held(around.tick);
        let (ruling, could_stop, duty) = match Vehicle::of(this, motion) {
            Some(vehicle) => {
                let by_lane = || {
                    let beyond = || beyond_middle(this, around, Some(point));
                    let side = Beside::of(&vehicle, around)?.side(&vehicle, true, around);
                    side.at_contact(beyond, around.time_s())
                };
                (found.or_else(by_lane), self.foreseen.is_some(), Rule::Standing)
            }
            None => {
                let by_time = || on_foot(this, &Strip::of(this, around), around);
                let could_stop = around.ego.speed_mps <= WALKING_MPS;
                (Some(found.unwrap_or_else(by_time)), could_stop, Rule::OnFoot)
            }
        };
        let none = Ruling { time_s: around.time_s(), ..Ruling::default() };
        let ruling = ruling.unwrap_or(none);
        // An ego vehicle that stands has stopped already.
        if around.ego.speed_mps < STANDING_MPS {
            return ruling;
        }
        // Whichever way it stands, who drives comes to it (13.1).
        let stands = this.body.is_vehicle() && this.velocity_mps.norm() < STANDING_MPS;
        let came_with_room = ruling.rule == Rule::None && self.left_room;
        if stands && (could_stop || came_with_room) && ruling.priority != Priority::Other {
            let (rule, time_s) = (Rule::Standing, around.time_s());
            return Ruling { priority: Priority::Other, rule, mover: Mover::Ego, time_s };
        }
        // A driver must be able to stop for anything that can be foreseen (13.1), so then neither has priority.
        if could_stop && ruling.priority == Priority::Ego {
            return Ruling { priority: Priority::None, rule: duty, ..ruling };
        }
        ruling
    }

    /// Notes whether the ego vehicle has seen a vehicle stand while it could brake gently for it. One that stood in the
    /// ego vehicle's way and then moves by a step is as foreseen as before.
    fn foresee(&mut self, this: &Obstacle, in_sight: bool, around: &Around) {
        let at = this.outline.pose.position;
        if this.velocity_mps.norm() >= STANDING_MPS {
            let is_there = |seen: &Foreseen| seen.blocks && (at - seen.at).norm() < STEP_M;
            self.foreseen = self.foreseen.filter(is_there);
            return;
        }
        // A slow body, such as a door that opens, may stand in the way now and did not before.
        let has_moved = |seen: &Foreseen| !seen.blocks && (at - seen.at).norm() > MOVED_M;
        if self.foreseen.is_some_and(|seen| has_moved(&seen)) {
            self.foreseen = None;
        }
        let has_time = || can_stop(allowed_mps(around.ego.speed_mps, around), this.distance_m, ABRUPT_MPS2);
        if self.foreseen.is_none() && in_sight && has_time() {
            self.foreseen = Some(Foreseen { at, blocks: room_before_m(this, around).is_some() });
        }
    }

    pub fn watch_vehicle(&mut self, vehicle: &Vehicle, ego_passed: &Passed, around: &Around) {
        let this = vehicle.this;
        if let Some(found) = Crossing::of(vehicle, around) {
            let place = Place::Area(found.ego.lane, found.other.lane);
            let judged = || {
                let ruling = found.ruling([ego_passed, &self.passed], vehicle.has_siren, around);
                Meeting::new(place, ruling, around.tick)
            };
            let known = self.meeting.filter(|meeting| meeting.place == place);
            let mut meeting = known.unwrap_or_else(judged);
            let first_stands = match meeting.ruling.mover {
                Mover::Ego => around.ego.speed_mps < STANDING_MPS,
                Mover::Other | Mover::Both => vehicle.speed_mps < STANDING_MPS,
            };
            if meeting.is_clearing() && first_stands {
                meeting.waits |= !found.is_blocked(meeting.ruling.mover, vehicle, around);
            } else if meeting.waits {
                // It sets out again: what counts is whether the other has time for it now.
                meeting = judged();
            }
            self.meeting = Some(Meeting { tick: around.tick, ..meeting });
            // In a junction the headings say nothing about lanes: what follows is looked at anew.
            self.shares = None;
            return;
        }
        let beside = Beside::of(vehicle, around).filter(|beside| beside.aside_m < 0.0);
        let shares = beside.is_some();
        let began = shares && self.shares == Some(false);
        self.shares = Some(shares);
        let Some(beside) = beside else { return };
        let side = || beside.side(vehicle, false, around);
        let time_s = around.time_s();
        // Two that come into each other's way anew are judged anew.
        self.meeting = self.meeting.filter(|meeting| meeting.holds(around.tick));
        match &mut self.meeting {
            // There was time to brake gently since: from now on it is one vehicle behind another.
            Some(meeting) if meeting.place == Place::Lane && meeting.is_over(&side(), time_s) => {
                self.meeting = None
            }
            Some(meeting) if meeting.place == Place::Lane => meeting.tick = around.tick,
            Some(_) | None if began => {
                let side = side();
                let ruling = side.at_coming(|| beyond_middle(this, around, None), time_s);
                self.left_room = ruling.is_none() && side.comes(time_s).is_some();
                let rests_s = time_s + side.rests_in_s();
                let found = |ruling| Meeting { rests_s, ..Meeting::new(Place::Lane, ruling, around.tick) };
                self.meeting = ruling.map(found).or(self.meeting);
            }
            Some(_) | None => {}
        }
    }

    fn watch_on_foot(&mut self, this: &Obstacle, in_sight: bool, around: &Around) {
        let strip = Strip::of(this, around);
        let position = this.outline.pose.position;
        // The step of a person or an animal onto the carriageway is what counts: from there on the ego vehicle may expect
        // the rest. A thing does not walk on.
        let walks = this.body != Body::Object;
        let on_road = &mut self.on_road;
        let mut is_on_road = || match *on_road {
            Some((known, found)) if known == position => found,
            _ => {
                let lane = around.scene.map.nearest(position, this.outline.pose.heading_rad, 0.0);
                *on_road = Some((position, lane.is_some()));
                lane.is_some()
            }
        };
        let shares = strip.aside_m < CARRIAGEWAY_M
            && strip.ahead_m > -this.outline.half_length_m - VehicleParameters::MKZ.length_m
            && (strip.aside_m < if walks { BESIDE_M } else { 0.0 } || walks && is_on_road());
        if shares {
            let known = self.meeting.filter(|_| self.shares == Some(true)).map(|meeting| meeting.ruling);
            // The known ruling holds until such a rule begins, or until the ego vehicle is back on the road.
            let now = whatever_the_room(this, &strip, around);
            let is_other = |known: &Ruling| match now {
                Some(rule) => known.rule != rule,
                None => known.rule == Rule::LeavingLane,
            };
            let ruling = match known.filter(|known| !is_other(known)) {
                // The pedestrian came too late, but now the ego vehicle sees it and can stop, so it is no surprise any more.
                Some(known) if known.priority == Priority::Ego && in_sight && strip.leaves_room(around) => {
                    Ruling { priority: Priority::None, rule: Rule::OnFoot, ..known }
                }
                Some(known) => known,
                None => on_foot(this, &strip, around),
            };
            self.meeting = Some(Meeting::new(Place::Lane, ruling, around.tick));
        }
        self.shares = Some(shares);
    }
}
