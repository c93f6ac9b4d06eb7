//! Right of way: which of the ego vehicle and a road user has priority over the other.
//!
//! The rules are those of the Vienna Convention on Road Traffic (1968); Estonia has signed it, and California's
//! code says the same in other words. For two vehicles:
//!
//! | where | rule | article |
//! |---|---|---|
//! | lanes of a junction | an emergency vehicle under way | 34.1 |
//! | lanes of a junction | a red light or a late yellow one, a stop sign passed without standing | signs 23, 10 |
//! | lanes of a junction | signs, then turning left before oncoming traffic, then the right | 18, 16 |
//! | elsewhere | a vehicle that backs up, turns round, or comes from beside the road gives way | 14, 18 |
//! | elsewhere | a vehicle that leaves its lane gives way to one that keeps its own | 14, 11 |
//! | side by side into a junction | a vehicle that turns off gives way to one that goes straight on beside it | 16 |
//! | side by side into a junction | a vehicle does not overtake another where that turns across the road | 11 |
//! | one lane | a vehicle behind another keeps its distance | 13.5 |
//!
//! A vehicle is judged by its motion, whichever word told it so: a lane change, an offset, and a trajectory that lead
//! the same way are judged alike. [`Ruling`] names the rule, its moment, and whose motion decided.
//!
//! To give way means not to make the other change its speed or direction *abruptly* (article 1), so what counts
//! is the moment when the first of the two comes into the other's way. A vehicle that then leaves the other
//! room to brake gently has given way, and has from now on priority over it: a vehicle that is in a junction may clear
//! it (18.6), and one that follows keeps its distance (13.5); that both make a priority is ours. What is abrupt,
//! UN R79 says for lane changes: more than 3 m/s² after 0.4 s, to stay the way of a second behind. So a vehicle that
//! cuts in and stops before the one behind it has its distance back, or could have stopped, has not given way. A vehicle that waits in a
//! junction beside the other's way and then sets out comes anew. A vehicle that passed
//! red, late yellow or its stop sign has not given way, however early it came. If that was the other vehicle, and the ego vehicle
//! had time to brake, neither has priority.
//!
//! A vehicle that stands has priority if the ego vehicle has seen it so while it could brake gently for it, or if it came with room,
//! wherever it stands and looks (13.1). If it then moves by a step, neither has. An ego vehicle that stands has stopped already.
//!
//! A vehicle that has crashed is an obstacle: whoever drives must be able to stop for what can be foreseen (13.1).
//! It has priority, unless it came to lie in the ego vehicle's way too late to brake gently for it; then neither has.
//!
//! A pedestrian on a crosswalk has priority (21), unless the light for the ego vehicle is green. Elsewhere a
//! pedestrian may not step onto the road without regard to distance and speed of what comes (20.6), and a
//! driver must not endanger pedestrians and be able to stop for what can be foreseen (21.1, 13.1). So the ego
//! vehicle has priority only over one that steps onto the carriageway too late for its brakes, and otherwise
//! neither has. It loses that priority once it sees the pedestrian and could still stop, and it
//! has none at walking pace, from which a driver can stop for any pedestrian. A pedestrian who stays beside the road has priority
//! over an ego vehicle that leaves the road there.
//!
//! If two vehicles come towards each other outside junctions, the one beyond the middle of the road has to give way
//! (articles 10.3 and 12). Any part of its body counts, such as the rear of a bus that swings over the line. If both are
//! beyond it, neither has priority.
//!
//! The state is kept for each road user ([`Rights`]), looked at ten times a second, and read at a contact.

use avastra_base::geometry::Vec2;
use avastra_base::kinematics::{SPEEDING_MPS, STANDING_MPS, WALKING_MPS, stopping_m};
use avastra_lang::model::vocabulary::{Body, Priority};
use avastra_road::{LaneIndex, RoadMap};

use super::around::Around;
use super::ego::VehicleParameters;
use super::road_user::{Motion, Obstacle};
use crate::scene::junction::{Order, order};
use crate::state::sensed::SignalColour;
use crate::state::time::DT_S;
use crate::state::trace::Trace;

mod crossing;
mod on_foot;
mod passed;
mod ruling;
mod side;
mod turning;

use crossing::{Crossing, Vehicle, cuts_across};
use on_foot::{Strip, on_foot, whatever_the_room};
use side::{Side, beyond_middle};

pub(super) use on_foot::light_before;
pub(super) use passed::Passed;
pub use ruling::{Mover, Rule, Ruling};
pub(super) use turning::SIDEWAYS_MPS;

#[cfg(test)]
mod tests;

/// Harder braking than this, after [`REACTION_S`], is abrupt, m/s² (UN R79, 5.6.4.7: a lane change that makes
/// an approaching vehicle brake harder is critical).
const ABRUPT_MPS2: f64 = 3.0;
/// Time until the other vehicle begins to brake, s (UN R79, 5.6.4.7).
const REACTION_S: f64 = 0.4;
/// A conflict area farther away than this from either vehicle is not looked at yet, m.
const APPROACH_M: f64 = 80.0;
/// What was found holds for so long after the two have left each other's way, s. Ours: outlines that touch behind
/// a junction do so because of what happened in it.
const HOLDS_S: f64 = 2.0;
/// A pedestrian within this distance of the strip that the ego vehicle drives on is in its way, m. Ours.
const BESIDE_M: f64 = 0.5;
/// Farther to the side of that strip a pedestrian is on another road, m: six lanes.
const CARRIAGEWAY_M: f64 = 21.0;
/// A vehicle that stood in the ego vehicle's way and has moved by less stands there still, m. Ours.
const STEP_M: f64 = 2.0;
/// One that stood beside it and has moved by more stands elsewhere, m. Ours.
const MOVED_M: f64 = 0.1;

/// Who has priority where two lanes of a junction are in each other's way, with the lights as they are now.
///
/// `ego` and `other` are the lanes inside the junction on which the two vehicles are or will be. A red light
/// decides first; where both or neither have one, signs do, and then the lanes' own order (see `junction`).
/// `None` if both have a red light.
pub fn right_of_way(
    map: &RoadMap,
    colour: impl Fn(usize) -> SignalColour,
    ego: LaneIndex,
    other: LaneIndex,
) -> Priority {
    let is_red =
        |lane: LaneIndex| map.stop_line_of(lane).is_some_and(|line| colour(line.signal) == SignalColour::Red);
    by_lights(is_red(ego), is_red(other)).unwrap_or_else(|| by_order(map, ego, other)).0
}

/// Who goes first by their lights; `None` if both may go.
fn by_lights(ego_red: bool, other_red: bool) -> Option<(Priority, Rule)> {
    match (ego_red, other_red) {
        (true, true) => Some((Priority::None, Rule::BothLights)),
        (true, false) => Some((Priority::Other, Rule::Light)),
        (false, true) => Some((Priority::Ego, Rule::Light)),
        (false, false) => None,
    }
}

/// Who goes first by signs and by the order of lanes.
fn by_order(map: &RoadMap, ego: LaneIndex, other: LaneIndex) -> (Priority, Rule) {
    let (ego_first, order) = order(map, ego, other);
    let rule = match order {
        Order::Signs => Rule::Sign,
        Order::Turning => Rule::Turning,
        Order::FromTheRight => Rule::FromTheRight,
        Order::SameSide => Rule::SameSide,
    };
    (if ego_first { Priority::Ego } else { Priority::Other }, rule)
}

/// What is remembered of a road user and the ego vehicle, as far as priority depends on it.
#[derive(Debug, Clone, Default)]
pub(super) struct Rights {
    /// The lines that the road user passed last.
    pub passed: Passed,
    /// Whether it and the ego vehicle are in one lane, or it is a pedestrian in the ego vehicle's way; `None` before
    /// the first look.
    shares: Option<bool>,
    meeting: Option<Meeting>,
    /// Who has priority if it is a wreck in the ego vehicle's way, and since when, s; `None` if it is not.
    wreck: Option<(Priority, f64)>,
    /// Whether it came into the ego vehicle's way, or the ego vehicle into its, and left room.
    left_room: bool,
    /// Where it has stood since a moment at which the ego vehicle saw it and could brake gently for it.
    foreseen: Option<Foreseen>,
    /// Where a pedestrian was last looked for on the carriageway, and whether it was there: most stand and wait.
    on_road: Option<(Vec2, bool)>,
}

/// The road user or the ego vehicle came into the other's way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Meeting {
    place: Place,
    ruling: Ruling,
    /// Last tick in which they were in each other's way.
    tick: u64,
    /// Whether the first of the two, which may clear the junction, waits beside the other's way.
    waits: bool,
    /// When the one behind could have come to rest by braking gently, s since the episode began; never in a junction.
    rests_s: f64,
}

impl Meeting {
    fn new(place: Place, ruling: Ruling, tick: u64) -> Meeting {
        Meeting { place, ruling, tick, waits: false, rests_s: f64::INFINITY }
    }

    /// Whether the two were in each other's way a short time ago.
    fn holds(&self, tick: u64) -> bool {
        (tick - self.tick) as f64 * DT_S <= HOLDS_S
    }

    /// Whether the first of the two left the other room, and may clear the junction.
    fn is_clearing(&self) -> bool {
        self.ruling.rule == Rule::Clearing
    }

    /// Whether what was found in a lane holds no longer: the one behind has its distance back, or had the time to stop.
    fn is_over(&self, side: &Side, time_s: f64) -> bool {
        match self.ruling.rule {
            Rule::Clearing => side.backs(self.ruling.mover),
            // Of one that turns across another's way; they do not follow each other.
            Rule::Overtaking | Rule::Siren => false,
            _ => side.is_gentle() || side.along > 0.0 && time_s > self.rests_s,
        }
    }
}

/// A vehicle that the ego vehicle saw standing.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Foreseen {
    at: Vec2,
    /// Whether it stood across the strip that the ego vehicle drives on.
    blocks: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// In a junction: the lanes of the ego vehicle and of the road user.
    Area(LaneIndex, LaneIndex),
    /// In a lane, or on foot on the carriageway.
    Lane,
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

    /// Who goes first, as long as what was found about the two holds.
    pub fn now(&self, tick: u64) -> Priority {
        let wreck = self.wreck.map(|(priority, _)| priority);
        wreck.or(self.held(tick).map(|ruling| ruling.priority)).unwrap_or(Priority::None)
    }

    /// What was found about the two, as long as it holds.
    fn held(&self, tick: u64) -> Option<Ruling> {
        self.meeting.filter(|meeting| meeting.holds(tick)).map(|meeting| meeting.ruling)
    }

    /// Who had priority, now that the road user, which has crashed, and the ego vehicle touch.
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
                    Side::of(&vehicle, true, around)?.at_contact(beyond, around.time_s())
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

    pub fn trace(&self, trace: &mut Trace) {
        // What was found on the road follows from the pedestrian's position; a rule, its moments and whether a
        // vehicle waits from what was traced before.
        let Rights { passed, shares, meeting, wreck, foreseen, left_room, on_road: _ } = self;
        passed.trace(trace);
        trace.flags([
            shares.is_some(),
            *shares == Some(true),
            meeting.is_some(),
            wreck.is_some(),
            foreseen.is_some(),
            *left_room,
        ]);
        trace.words(wreck.map(|(priority, _)| priority as u64));
        if let Some(Meeting { place, ruling, tick, waits: _, rests_s: _ }) = *meeting {
            let (ego, other) = match place {
                Place::Area(ego, other) => (ego.0 as u64, other.0 as u64),
                Place::Lane => (u64::MAX, u64::MAX),
            };
            trace.words([ego, other, ruling.priority as u64, tick]);
        }
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
        // What moves slowly, such as a door that opens, may stand in the way now and did not before.
        let has_moved = |seen: &Foreseen| !seen.blocks && (at - seen.at).norm() > MOVED_M;
        if self.foreseen.is_some_and(|seen| has_moved(&seen)) {
            self.foreseen = None;
        }
        let has_time = || can_stop(allowed_mps(around.ego.speed_mps, around), this.distance_m, ABRUPT_MPS2);
        if self.foreseen.is_none() && in_sight && has_time() {
            self.foreseen = Some(Foreseen { at, blocks: room_before_m(this, around).is_some() });
        }
    }

    fn watch_vehicle(&mut self, vehicle: &Vehicle, ego_passed: &Passed, around: &Around) {
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
        let side = Side::of(vehicle, false, around);
        let shares = side.as_ref().is_some_and(|side| side.aside_m < 0.0);
        let began = shares && self.shares == Some(false);
        self.shares = Some(shares);
        let Some(side) = side.filter(|_| shares) else { return };
        let time_s = around.time_s();
        // Two that come into each other's way anew are judged anew.
        self.meeting = self.meeting.filter(|meeting| meeting.holds(around.tick));
        match &mut self.meeting {
            // There was time to brake gently since: from now on it is one vehicle behind another.
            Some(meeting) if meeting.place == Place::Lane && meeting.is_over(&side, time_s) => {
                self.meeting = None
            }
            Some(meeting) if meeting.place == Place::Lane => meeting.tick = around.tick,
            Some(_) | None if began => {
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
            // What was found holds until such a rule begins, or until the ego vehicle is back on the road.
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

/// The speed from which the ego vehicle's way to stop is reckoned, m/s: its own, or what is allowed. Others need not leave more time
/// to who speeds.
fn allowed_mps(own_mps: f64, around: &Around) -> f64 {
    let lane = around.scene.route.lane_at(around.ego_station_m).lane;
    let limit_mps = around.scene.map.lane(lane).speed_limit_mps;
    if own_mps > limit_mps + SPEEDING_MPS { limit_mps } else { own_mps }
}

/// Whether a vehicle that begins to brake after [`REACTION_S`] is at rest within a distance.
fn can_stop(speed_mps: f64, room_m: f64, braking_mps2: f64) -> bool {
    stopping_m(speed_mps, REACTION_S, braking_mps2) <= room_m
}

/// Way of the ego vehicle's front to an obstacle that lies across the strip that it drives on, m; `None` if the
/// obstacle lies beside or behind.
pub(super) fn room_before_m(this: &Obstacle, around: &Around) -> Option<f64> {
    let path = &around.scene.route.path;
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let mut beside = path.project_from(this.outline.pose.position, front_m)?;
    beside.offset_m -= path.project_from(around.ego_outline.pose.position, around.ego_station_m)?.offset_m;
    let (length_m, width_m) = (2.0 * this.outline.half_length_m, 2.0 * this.outline.half_width_m);
    let taken = beside.taken(this.forward, length_m, width_m, around.ego_outline.half_width_m)?;
    (taken.to_m > front_m).then_some(taken.from_m - front_m)
}
