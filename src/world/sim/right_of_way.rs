//! Right of way: which of the ego vehicle and a road user has priority over the other.
//!
//! The rules are those of the Vienna Convention on Road Traffic (1968); Estonia has signed it, and California's
//! code says the same in other words. For two vehicles:
//!
//! | where | rule | article |
//! |---|---|---|
//! | lanes of a junction | an emergency vehicle under way | 34.1 |
//! | lanes of a junction | a red light or a late yellow one, a stop sign passed without standing | 23 |
//! | lanes of a junction | signs, then turning left before oncoming traffic, then the right | 18, 16 |
//! | elsewhere | a vehicle that backs up, turns round, or comes from beside the road gives way | 14, 12 |
//! | elsewhere | a vehicle that leaves its lane gives way to one that keeps its own | 14, 11 |
//! | one lane | a vehicle behind another keeps its distance | 13.5 |
//!
//! What a vehicle does decides, and not the word that told it so: a lane change, an offset, and a trajectory that lead
//! the same way are judged alike. [`Ruling`] says which rule it was, when, and whose motion decided.
//!
//! To give way means not to make the other change its speed or direction *abruptly* (article 1), so what counts
//! is the moment when the first of the two comes into the other's way. A vehicle that then leaves the other
//! room to brake gently has given way, and has from now on priority over it: a vehicle that is in a junction may clear
//! it (18.6), and one that follows keeps its distance (13.5); that both make a priority is ours. What is abrupt,
//! UN R79 says for lane changes: more than 3 m/s² after 0.4 s, to stay the way of a second behind. So a vehicle that
//! cuts in and stops before the one behind it has its distance back has not given way. A vehicle that waits in a
//! junction beside the other's way and then sets out comes anew. Whoever passed a red light has not given way by being early.
//!
//! The ego vehicle has no priority over a vehicle that it has seen standing while it could brake gently for it, wherever
//! that vehicle stands (13.1). If it stood in the ego vehicle's way, moving by a step changes nothing.
//!
//! A vehicle that has crashed is an obstacle: whoever drives must be able to stop for what can be foreseen (13.1).
//! It has priority, unless it came to lie in the ego vehicle's way too late to brake gently for it; then neither has.
//!
//! A pedestrian on a crosswalk has priority (21), unless the light for the ego vehicle is green. Elsewhere a
//! pedestrian may not step onto the road without regard to distance and speed of what comes (20.6), and a
//! driver must not endanger pedestrians and be able to stop for what can be foreseen (21.1, 13.1). So the ego
//! vehicle has priority only over one that steps onto the carriageway too late for its brakes, and otherwise
//! neither has. It loses that priority once it sees the pedestrian and could still stop, and it
//! has none at walking pace, from which a driver can stop for any pedestrian.
//!
//! If two vehicles come towards each other outside junctions, the one beyond the middle of the road has to give way
//! (articles 10.3 and 12). Any part of its body counts, such as the rear of a bus that swings over the line. If both are
//! beyond it, neither has priority.
//!
//! The state is kept for each road user ([`Rights`]), looked at ten times a second, and read at a contact.

use core::f64::consts::FRAC_PI_6;

use avastra_base::geometry::{OrientedBox, Path, Vec2, unit_vector};
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, STANDING_MPS, WALKING_MPS, stopping_m};
use avastra_lang::model::vocabulary::{Body, Priority};
use avastra_road::{LaneIndex, RoadMap, Route, RouteLane};

use super::around::Around;
use super::ego::VehicleParameters;
use super::junction::{Area, ConflictAreas, Order, order};
use super::npc::Driver;
use super::road_user::{Motion, Obstacle};
use super::sense::SignalColour;
use super::trace::Trace;
use super::world::DT_S;

mod passed;
mod ruling;

pub(super) use passed::Passed;
pub use ruling::{Mover, Rule, Ruling};

#[cfg(test)]
mod tests;

/// Harder braking than this, after [`REACTION_S`], is abrupt, m/s² (UN R79, 5.6.4.7: a lane change that makes
/// an approaching vehicle brake harder is critical).
const ABRUPT_MPS2: f64 = 3.0;
/// Time until the other vehicle begins to brake, s (UN R79, 5.6.4.7).
const REACTION_S: f64 = 0.4;
/// Way behind another vehicle that may not be cut off, s at its speed (UN R79, 5.6.4.7).
const HEADWAY_S: f64 = 1.0;
/// Vehicles that leave a conflict area this long before the other comes are not in its way, s. Ours.
const CLEAR_S: f64 = 0.5;
/// A conflict area farther away than this from either vehicle is not looked at yet, m.
const APPROACH_M: f64 = 80.0;
/// No conflict area is longer, m: lanes of large junctions that join at a small angle.
const AREA_M: f64 = 60.0;
/// What was found holds for so long after the two have left each other's way, s. Ours: outlines that touch behind
/// a junction do so because of what happened in it.
const HOLDS_S: f64 = 2.0;
/// A vehicle that moves faster than this to its side comes into another lane, m/s. Ours: less than any lane
/// change, more than any wandering.
pub(super) const SIDEWAYS_MPS: f64 = 0.15;
/// Vehicles with more room than this between them are not in each other's lane in any way that matters, m: one
/// that is 16 m/s faster brakes at 3 m/s² after 0.4 s within 49 m.
const LANE_M: f64 = 50.0;
/// Farther to the side than this a vehicle is in no lane that matters, m.
const ASIDE_M: f64 = 6.0;
/// A pedestrian within this distance of the strip that the ego vehicle drives on is in its way, m. Ours.
const BESIDE_M: f64 = 0.5;
/// Farther to the side of that strip a pedestrian is on another road, m: six lanes.
const CARRIAGEWAY_M: f64 = 21.0;
/// A pedestrian this near to a crosswalk is on it or about to step on it, m. Ours.
const KERB_M: f64 = 1.0;
/// A vehicle that stood in the ego vehicle's way and has moved by less stands there still, m. Ours.
const STEP_M: f64 = 2.0;
/// A vehicle that stood no farther before a junction stood there to give way, m. Ours.
const SETS_OUT_M: f64 = 10.0;
/// A path goes along a lane if it is no farther from its middle, m, and no more askew, as a cosine (30°). Ours.
const ON_LANE_M: f64 = 1.5;
const ALONG_COS: f64 = 0.866;
/// A vehicle that is more askew in its lane turns round or crosses it, rad (30°). Ours.
const TURNS_RAD: f64 = FRAC_PI_6;
/// A body that reaches over the border of its lane by more than this leaves it, m. Ours: drivers keep lanes no better.
const OVER_M: f64 = 0.1;
/// A light this far before a crosswalk holds for it, m. Ours.
const LIGHT_M: f64 = 12.0;

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
    by_lanes(map, (ego, is_red(ego)), (other, is_red(other)))
}

/// As [`right_of_way`], for two lanes and whether each is entered at a red light.
fn by_lanes(
    map: &RoadMap,
    (ego, ego_red): (LaneIndex, bool),
    (other, other_red): (LaneIndex, bool),
) -> Priority {
    by_lights(ego_red, other_red).unwrap_or_else(|| by_order(map, ego, other)).0
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

/// A conflict area on the ego vehicle's route.
#[derive(Debug, Clone, Copy)]
pub(super) struct RouteArea {
    /// The lane of the route.
    pub lane: LaneIndex,
    /// Its stations are those of the route.
    pub area: Area,
}

/// The conflict areas of a route, by rising station.
pub(super) fn route_areas(areas: &ConflictAreas, route: &Route) -> Vec<RouteArea> {
    let of_lane = |part: &RouteLane| {
        let (lane, from_m) = (part.lane, part.from_m);
        areas.of(lane).iter().map(move |area| {
            let area = Area { from_m: from_m + area.from_m, to_m: from_m + area.to_m, ..*area };
            RouteArea { lane, area }
        })
    };
    let mut all: Vec<RouteArea> = route.lanes.iter().flat_map(of_lane).collect();
    all.sort_by(|a, b| a.area.from_m.total_cmp(&b.area.from_m).then(a.area.other.cmp(&b.area.other)));
    all
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
                let has_time = can_stop(around.ego.speed_mps, room_m, ABRUPT_MPS2);
                (if has_time { Priority::Other } else { Priority::None }, around.time_s())
            });
        }
    }

    /// Whether the road user drives into a junction across the route of the ego vehicle, which goes first there.
    pub fn is_intruding(
        &self,
        this: &Obstacle,
        motion: &Motion,
        ego_passed: &Passed,
        around: &Around,
    ) -> bool {
        let vehicle = Vehicle::of(this, motion);
        vehicle.is_some_and(|vehicle| Crossing::intrudes(&vehicle, [ego_passed, &self.passed], around))
    }

    /// Who goes first, as long as what was found about the two holds.
    pub fn now(&self, tick: u64) -> Priority {
        let wreck = self.wreck.map(|(priority, _)| priority);
        wreck.or(self.held(tick).map(|ruling| ruling.priority)).unwrap_or(Priority::None)
    }

    /// What was found about the two, as long as it holds.
    fn held(&self, tick: u64) -> Option<Ruling> {
        let holds = |meeting: &Meeting| (tick - meeting.tick) as f64 * DT_S <= HOLDS_S;
        self.meeting.filter(holds).map(|meeting| meeting.ruling)
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
        let (ruling, could_stop) = match Vehicle::of(this, motion) {
            Some(vehicle) => {
                let by_lane = || {
                    let beyond = || beyond_middle(this, around, Some(point));
                    Side::of(&vehicle, around)?.at_contact(beyond, around.time_s())
                };
                (found.or_else(by_lane), self.foreseen.is_some())
            }
            None => {
                let by_time = || on_foot(this, &Strip::of(this, around), around);
                (Some(found.unwrap_or_else(by_time)), around.ego.speed_mps <= WALKING_MPS)
            }
        };
        let none = Ruling { time_s: around.time_s(), ..Ruling::default() };
        let ruling = ruling.unwrap_or(none);
        // A driver must be able to stop for anything that can be foreseen (13.1), so then neither has priority.
        if could_stop && ruling.priority == Priority::Ego {
            return Ruling { priority: Priority::None, rule: Rule::Standing, ..ruling };
        }
        ruling
    }

    pub fn trace(&self, trace: &mut Trace) {
        // What was found on the road follows from the pedestrian's position; a rule, its moment and whether a vehicle
        // waits from what was traced before.
        let Rights { passed, shares, meeting, wreck, foreseen, on_road: _ } = self;
        passed.trace(trace);
        trace.flags([
            shares.is_some(),
            *shares == Some(true),
            meeting.is_some(),
            wreck.is_some(),
            foreseen.is_some(),
        ]);
        trace.words(wreck.map(|(priority, _)| priority as u64));
        if let Some(Meeting { place, ruling, tick, waits: _ }) = *meeting {
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
        } else if self.foreseen.is_none()
            && in_sight
            && can_stop(around.ego.speed_mps, this.distance_m, ABRUPT_MPS2)
        {
            self.foreseen = Some(Foreseen { at, blocks: room_before_m(this, around).is_some() });
        }
    }

    fn watch_vehicle(&mut self, vehicle: &Vehicle, ego_passed: &Passed, around: &Around) {
        let this = vehicle.this;
        if let Some(found) = Crossing::of(vehicle, around) {
            let place = Place::Area(found.ego.lane, found.other.lane);
            let judged = || Meeting {
                place,
                ruling: found.ruling([ego_passed, &self.passed], vehicle.has_siren, around),
                tick: around.tick,
                waits: false,
            };
            let known = self.meeting.filter(|meeting| meeting.place == place);
            let mut meeting = known.unwrap_or_else(judged);
            let first_stands = match meeting.ruling.mover {
                Mover::Ego => around.ego.speed_mps < STANDING_MPS,
                Mover::Other | Mover::Both => vehicle.speed_mps < STANDING_MPS,
            };
            if meeting.ruling.rule == Rule::Clearing && first_stands {
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
        let side = Side::of(vehicle, around);
        let shares = side.as_ref().is_some_and(|side| side.aside_m < 0.0);
        let began = shares && self.shares == Some(false);
        self.shares = Some(shares);
        let Some(side) = side.filter(|_| shares) else { return };
        match &mut self.meeting {
            // There was time to brake gently since: from now on it is one vehicle behind another.
            Some(meeting) if meeting.place == Place::Lane && side.is_gentle() => self.meeting = None,
            Some(meeting) if meeting.place == Place::Lane => meeting.tick = around.tick,
            Some(_) | None if began => {
                let ruling = side.at_coming(|| beyond_middle(this, around, None), around.time_s());
                let found = |ruling| Meeting { place: Place::Lane, ruling, tick: around.tick, waits: false };
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
            let ruling = match known {
                // The pedestrian came too late, but now the ego vehicle sees it and can stop, so it is no surprise any more.
                Some(known) if known.priority == Priority::Ego && in_sight && strip.leaves_room(around) => {
                    Ruling { priority: Priority::None, rule: Rule::OnFoot, ..known }
                }
                Some(known) => known,
                None => on_foot(this, &strip, around),
            };
            self.meeting = Some(Meeting { place: Place::Lane, ruling, tick: around.tick, waits: false });
        }
        self.shares = Some(shares);
    }
}

/// Another vehicle, as right of way looks at it: what it does, whichever word told it.
struct Vehicle<'a> {
    this: &'a Obstacle,
    speed_mps: f64,
    is_changing_lanes: bool,
    has_siren: bool,
    way: Course<'a>,
}

/// Where a vehicle goes.
enum Course<'a> {
    Lanes(&'a Driver),
    /// A path that keeps to no lanes, and the station of the vehicle's middle on it, m.
    Path(&'a Path, f64),
    Nowhere,
}

impl<'a> Vehicle<'a> {
    /// `None` of what is no vehicle.
    fn of(this: &'a Obstacle, motion: &'a Motion) -> Option<Vehicle<'a>> {
        if !this.body.is_vehicle() {
            return None;
        }
        let speed_mps = this.velocity_mps.norm();
        let plain =
            Vehicle { this, speed_mps, is_changing_lanes: false, has_siren: false, way: Course::Nowhere };
        Some(match motion {
            Motion::Drive(driver) => Vehicle {
                speed_mps: driver.speed_mps,
                is_changing_lanes: driver.is_changing_lanes(),
                has_siren: driver.has_siren,
                way: Course::Lanes(driver),
                ..plain
            },
            Motion::Guide(guided) if guided.speed_mps >= 0.0 => {
                let (path, middle_m) = guided.way();
                Vehicle { way: Course::Path(path, middle_m), ..plain }
            }
            Motion::Guide(_) | Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => plain,
        })
    }

    /// Whether its front is in a junction, or within so much of one, m.
    fn is_entering(&self, within_m: f64, around: &Around) -> bool {
        let outline = &self.this.outline;
        let reach_m = outline.half_length_m + within_m;
        let front = outline.pose.offset(reach_m, 0.0);
        let map = &around.scene.map;
        let lane = match self.way {
            Course::Lanes(driver) => Some(driver.way.lane_at(driver.station_m + reach_m).0),
            Course::Path(..) | Course::Nowhere => {
                map.nearest(front.position, front.heading_rad, 0.0).map(|place| place.lane)
            }
        };
        lane.is_some_and(|lane| map.lane(lane).junction.is_some())
    }

    /// From the front to the beginning of its stretch of a conflict area, and from the rear to the end of it, m; `None` if
    /// it does not go through it.
    fn through(&self, area: &Area, around: &Around) -> Option<(f64, f64)> {
        let half_m = self.this.outline.half_length_m;
        let (station_m, begin_m) = match self.way {
            Course::Lanes(driver) => {
                let station_m = driver.station_m;
                (station_m, driver.way.lane_ahead_m(area.other, station_m - half_m)?)
            }
            Course::Path(path, station_m) => {
                let lane = &around.scene.map.lane(area.other).centre;
                // It goes through the area as a vehicle on the lane does, or in some other way that is nobody's.
                let along = |on_lane_m: f64| {
                    let pose = lane.pose_at(on_lane_m);
                    let found = path.project(pose.position);
                    let turned = path.pose_at(found.station_m).forward().dot(&pose.forward());
                    (found.distance_m < ON_LANE_M && turned > ALONG_COS)
                        .then_some(found.station_m - on_lane_m)
                };
                let middle_m = (area.other_from_m + area.other_to_m) / 2.0;
                let begin_m = along(middle_m)?;
                along(area.other_from_m)?;
                along(area.other_to_m)?;
                (station_m, begin_m)
            }
            Course::Nowhere => return None,
        };
        let in_m = begin_m + area.other_from_m - station_m - half_m;
        Some((in_m, begin_m + area.other_to_m - station_m + half_m))
    }
}

/// One vehicle on its way through a conflict area.
#[derive(Debug, Clone, Copy)]
struct Passage {
    lane: LaneIndex,
    /// From its front to the beginning of the area, m; negative inside.
    in_m: f64,
    /// From its rear to the end of the area, m; negative beyond.
    out_m: f64,
    speed_mps: f64,
}

impl Passage {
    fn is_inside(&self) -> bool {
        self.in_m <= 0.0 && self.out_m > 0.0
    }

    /// Whether this vehicle, still on its way to the area, can brake gently for the other, which is in it, or
    /// need not brake at all.
    fn has_time_for(&self, other: &Passage) -> bool {
        let clear_s = other.out_m / other.speed_mps.max(0.5) + CLEAR_S;
        let comes_s = self.in_m / self.speed_mps.max(0.5);
        self.in_m > 0.0 && (clear_s < comes_s || can_stop(self.speed_mps, self.in_m, ABRUPT_MPS2))
    }
}

/// The ego vehicle and another in a conflict area, or one of them in it and the other before it.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    ego: Passage,
    other: Passage,
}

impl Crossing {
    /// Where the two are in each other's way soonest.
    fn of(vehicle: &Vehicle, around: &Around) -> Option<Crossing> {
        let car = VehicleParameters::MKZ;
        let (front_m, rear_m) = (car.front_m(around.ego_station_m), car.rear_m(around.ego_station_m));
        // By rising begin: those that begin too far behind or ahead are left out at once.
        let areas = &around.scene.route_areas;
        let first = areas.partition_point(|found| found.area.from_m < rear_m - AREA_M);
        let last = areas.partition_point(|found| found.area.from_m < front_m + APPROACH_M);
        let mut best: Option<Crossing> = None;
        for RouteArea { lane, area } in areas[first..last].iter().filter(|found| found.area.to_m > rear_m) {
            let Some((in_m, out_m)) = vehicle.through(area, around) else { continue };
            let ego = Passage {
                lane: *lane,
                in_m: area.from_m - front_m,
                out_m: area.to_m - rear_m,
                speed_mps: around.ego.speed_mps,
            };
            let other = Passage { lane: area.other, in_m, out_m, speed_mps: vehicle.speed_mps };
            let found = Crossing { ego, other };
            if (ego.is_inside() || other.is_inside())
                && ego.out_m > 0.0
                && other.out_m > 0.0
                && other.in_m < APPROACH_M
                && best.is_none_or(|best| found.away_m() < best.away_m())
            {
                best = Some(found);
            }
        }
        best
    }

    /// Whether another vehicle drives into a junction across the route of the ego vehicle, which goes first there.
    pub(super) fn intrudes(vehicle: &Vehicle, passed: [&Passed; 2], around: &Around) -> bool {
        // One that has stood before the junction and sets out shows its intention before it is in it.
        let within_m = if passed[1].has_just_stood(around) { SETS_OUT_M } else { 0.0 };
        if vehicle.speed_mps < STANDING_MPS || vehicle.has_siren || !vehicle.is_entering(within_m, around) {
            return false;
        }
        let rear_m = VehicleParameters::MKZ.rear_m(around.ego_station_m);
        let first = around.scene.route_areas.partition_point(|found| found.area.from_m < rear_m - AREA_M);
        let ahead = around.scene.route_areas[first..].iter();
        let ahead = ahead.take_while(|found| found.area.from_m < rear_m + APPROACH_M);
        ahead.filter(|found| found.area.to_m > rear_m).any(|RouteArea { lane, area }| {
            let lanes = [*lane, area.other];
            let red = |nth: usize| passed[nth].ran_light(lanes[nth], around);
            let map = &around.scene.map;
            let rule = || {
                by_lights(red(0), red(1))
                    .or_else(|| passed::by_stops(lanes, passed, map))
                    .unwrap_or_else(|| by_order(map, *lane, area.other))
            };
            vehicle.through(area, around).is_some_and(|(_, out_m)| out_m > 0.0) && rule().0 == Priority::Ego
        })
    }

    /// How far the later of the two still is from the area, m.
    fn away_m(&self) -> f64 {
        self.ego.in_m.max(self.other.in_m)
    }

    /// Whether the one of the two that is in the area stands across the other's strip.
    fn is_blocked(&self, first: Mover, vehicle: &Vehicle, around: &Around) -> bool {
        match first {
            Mover::Ego => Side::of(vehicle, around).is_some_and(|side| side.aside_m < 0.0),
            Mover::Other | Mover::Both => room_before_m(vehicle.this, around).is_some(),
        }
    }

    /// `passed`: the lines that the ego vehicle and the other passed.
    fn ruling(&self, passed: [&Passed; 2], has_siren: bool, around: &Around) -> Ruling {
        let map = &around.scene.map;
        let lanes = [self.ego.lane, self.other.lane];
        let red = |nth: usize| passed[nth].ran_light(lanes[nth], around);
        let (ego_red, other_red) = (red(0), red(1));
        let (by_rule, rule) = match has_siren {
            true => (Priority::Other, Rule::Siren),
            false => by_lights(ego_red, other_red)
                .or_else(|| passed::by_stops(lanes, passed, map))
                .unwrap_or_else(|| by_order(map, self.ego.lane, self.other.lane)),
        };
        let (ego_first, is_open) = match (self.ego.is_inside(), self.other.is_inside()) {
            (true, true) => (false, false),
            (ego_first, _) => (ego_first, true),
        };
        let ruling = |priority, rule, mover| Ruling { priority, rule, mover, time_s: around.time_s() };
        // The first has left the second, which goes before it, room to brake gently: it has given way. An ego vehicle that
        // passed its light or its sign has not, however early it came; of another one that did, both are to blame.
        let is_violation = matches!(rule, Rule::Light | Rule::BothLights | Rule::StopSign);
        match by_rule {
            Priority::Other
                if is_open && ego_first && !is_violation && self.other.has_time_for(&self.ego) =>
            {
                ruling(Priority::Ego, Rule::Clearing, Mover::Ego)
            }
            Priority::Ego if is_open && !ego_first && self.ego.has_time_for(&self.other) => {
                let priority = if is_violation { Priority::None } else { Priority::Other };
                ruling(priority, Rule::Clearing, Mover::Other)
            }
            _ if !is_open => ruling(by_rule, rule, Mover::Both),
            _ => ruling(by_rule, rule, if ego_first { Mover::Ego } else { Mover::Other }),
        }
    }
}

/// How the ego vehicle and another lie beside the other's way.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// Gap between the flanks across the way, m; negative if one is before the other.
    aside_m: f64,
    /// Gap between the ends along the way, m; negative if they are side by side.
    apart_m: f64,
    ego_is_ahead: bool,
    /// Cosine of the angle between the headings: negative if the two come towards each other.
    along: f64,
    /// Speeds along the way, m/s.
    ego_mps: f64,
    other_mps: f64,
    /// What each does that the other need not expect.
    ego_does: Option<Rule>,
    other_does: Option<Rule>,
}

impl Side {
    /// `None` if the ego vehicle is nowhere near the other's way.
    fn of(vehicle: &Vehicle, around: &Around) -> Option<Side> {
        let this = vehicle.this;
        let here = this.outline.pose.position;
        let map = &around.scene.map;
        // The way of a vehicle that keeps to lanes; beside a trajectory, the lane that it is on or crosses.
        let (path, station_m) = match vehicle.way {
            Course::Lanes(driver) => (&driver.way.path, driver.station_m),
            Course::Path(..) | Course::Nowhere => {
                let place = map.nearest(here, this.outline.pose.heading_rad, ASIDE_M)?;
                (&map.lane(place.lane).centre, place.station_m)
            }
        };
        let away = around.ego_outline.pose.position - here;
        let way_forward = path.pose_at(station_m).forward();
        let guess_m = station_m + way_forward.dot(&away);
        let ego = path.project_from(around.ego_outline.pose.position, guess_m)?;
        if ego.offset_m.abs() > ASIDE_M {
            return None;
        }
        let other = path.project_from(here, station_m)?;
        let (ego_length_m, ego_width_m) = around.ego_outline.half_extent_m(around.ego_forward, ego.forward);
        let (other_length_m, other_width_m) = this.outline.half_extent_m(this.forward, other.forward);
        let across_m = other.offset_m - ego.offset_m;
        let apart_m = (other.station_m - ego.station_m).abs() - ego_length_m - other_length_m;
        if apart_m > LANE_M {
            return None;
        }
        let towards = if across_m >= 0.0 { 1.0 } else { -1.0 };
        let ego_towards_mps = towards * ego.forward.perp(&around.ego_velocity_mps);
        let other_towards_mps = -towards * other.forward.perp(&this.velocity_mps);
        let ego_does = Conduct {
            outline: around.ego_outline,
            forward: around.ego_forward,
            velocity_mps: around.ego_velocity_mps,
            towards_mps: ego_towards_mps,
            is_changing_lanes: false,
        };
        let other_does = Conduct {
            outline: &this.outline,
            forward: this.forward,
            velocity_mps: this.velocity_mps,
            towards_mps: other_towards_mps,
            is_changing_lanes: vehicle.is_changing_lanes,
        };
        Some(Side {
            aside_m: across_m.abs() - ego_width_m - other_width_m,
            apart_m,
            ego_is_ahead: ego.station_m > other.station_m,
            along: around.ego_forward.dot(&this.forward),
            ego_mps: ego.forward.dot(&around.ego_velocity_mps),
            other_mps: other.forward.dot(&this.velocity_mps),
            ego_does: ego_does.rule(map),
            other_does: other_does.rule(map),
        })
    }

    /// Whether the two come towards each other.
    fn is_oncoming(&self) -> bool {
        self.along < -0.5
    }

    /// Whether the vehicle behind keeps its distance to the one ahead if it brakes gently, or not at all.
    fn is_gentle(&self) -> bool {
        let (behind_mps, ahead_mps) =
            if self.ego_is_ahead { (self.other_mps, self.ego_mps) } else { (self.ego_mps, self.other_mps) };
        let ahead_mps = ahead_mps.max(0.0);
        let room_m = self.apart_m - ahead_mps * HEADWAY_S;
        self.along > 0.0
            && self.apart_m > 0.0
            && can_stop((behind_mps - ahead_mps).max(0.0), room_m, ABRUPT_MPS2)
    }

    /// Who comes into the lane of the other: the one that has to give way.
    fn comes(&self, time_s: f64) -> Option<Ruling> {
        let (priority, rule, mover) = match (self.ego_does, self.other_does) {
            (Some(_), Some(_)) => (Priority::None, Rule::BothLeaveLanes, Mover::Both),
            (Some(rule), None) => (Priority::Other, rule, Mover::Ego),
            (None, Some(rule)) => (Priority::Ego, rule, Mover::Other),
            (None, None) => return None,
        };
        Some(Ruling { priority, rule, mover, time_s })
    }

    /// Who has priority when the two begin to be in one lane; `None` if that is as for any two in a lane.
    fn at_coming(&self, beyond_middle: impl FnOnce() -> Option<Ruling>, time_s: f64) -> Option<Ruling> {
        if self.is_oncoming() {
            return beyond_middle();
        }
        let ruling = self.comes(time_s)?;
        let comes_behind = match ruling.mover {
            Mover::Ego => !self.ego_is_ahead,
            Mover::Other => self.ego_is_ahead,
            Mover::Both => false,
        };
        if self.is_gentle() || (self.along > 0.0 && self.apart_m > 0.0 && comes_behind) {
            return None;
        }
        Some(ruling)
    }

    /// Who has priority in a contact of two that did not come abruptly into one lane.
    fn at_contact(&self, beyond_middle: impl FnOnce() -> Option<Ruling>, time_s: f64) -> Option<Ruling> {
        let ruling = |priority, rule, mover| Ruling { priority, rule, mover, time_s };
        if self.is_oncoming() {
            // Where the middle of the road does not decide, as in a junction, the other has priority unless it leaves its lane.
            let by_lane = || match self.other_does {
                Some(rule) => ruling(Priority::Ego, rule, Mover::Other),
                None => ruling(Priority::Other, self.ego_does.unwrap_or_default(), Mover::Ego),
            };
            return Some(beyond_middle().unwrap_or_else(by_lane));
        }
        // The ends have met, and not the flanks.
        if self.along > 0.5 && self.apart_m >= self.aside_m {
            let backs = |does: Option<Rule>| does == Some(Rule::Backing);
            return Some(match self.ego_is_ahead {
                true if backs(self.ego_does) => ruling(Priority::Other, Rule::Backing, Mover::Ego),
                false if backs(self.other_does) => ruling(Priority::Ego, Rule::Backing, Mover::Other),
                // It keeps its distance, article 13.5.
                true => ruling(Priority::Ego, Rule::Distance, Mover::Other),
                false => ruling(Priority::Other, Rule::Distance, Mover::Ego),
            });
        }
        self.comes(time_s).or_else(|| {
            // Flank at flank, each in its place: the faster one passes the other.
            let faster_mps = self.ego_mps - self.other_mps;
            match () {
                () if self.along <= 0.5 || faster_mps.abs() < STANDING_MPS => None,
                () if faster_mps > 0.0 => Some(ruling(Priority::Other, Rule::Overtaking, Mover::Ego)),
                () => Some(ruling(Priority::Ego, Rule::Overtaking, Mover::Other)),
            }
        })
    }
}

/// What a vehicle does outside junctions.
struct Conduct<'a> {
    outline: &'a OrientedBox,
    forward: Vec2,
    velocity_mps: Vec2,
    /// Speed across the way towards the other vehicle.
    towards_mps: f64,
    /// Whether it drives a lane change, as far as that is known.
    is_changing_lanes: bool,
}

impl Conduct<'_> {
    /// The rule by which it has to give way to a vehicle that keeps its lane; `None` if it keeps its own.
    fn rule(&self, map: &RoadMap) -> Option<Rule> {
        let speed_mps = self.velocity_mps.norm();
        if speed_mps < STANDING_MPS {
            return None;
        }
        if self.forward.dot(&self.velocity_mps) < 0.0 {
            return Some(Rule::Backing);
        }
        let pose = &self.outline.pose;
        let Some(place) = map.nearest(pose.position, pose.heading_rad, 0.0) else {
            return Some(Rule::Entering);
        };
        let lane = map.lane(place.lane);
        if lane.junction.is_some() {
            return self.is_changing_lanes.then_some(Rule::LeavingLane);
        }
        let along = unit_vector(lane.centre.heading_at(place.station_m));
        if along.dot(&self.forward).abs() < libm::cos(TURNS_RAD) {
            return Some(Rule::TurningRound);
        }
        let half_m = self.outline.half_extent_m(self.forward, along).1;
        let over_m = place.offset_m.abs() + half_m - lane.width_at(place.station_m) / 2.0;
        let moves_over = self.towards_mps > SIDEWAYS_MPS && over_m > OVER_M;
        (moves_over || self.is_changing_lanes && self.towards_mps > 0.0).then_some(Rule::LeavingLane)
    }
}

/// Which of the two has priority because the other is beyond the middle of the road: with any corner, or otherwise at the
/// point `at` where they touch. Neither has if both are beyond it; `None` if neither of them is.
fn beyond_middle(this: &Obstacle, around: &Around, at: Option<Vec2>) -> Option<Ruling> {
    let map = &around.scene.map;
    let told = |ego: bool, other: bool| {
        let (priority, rule, mover) = match (ego, other) {
            (true, true) => (Priority::None, Rule::BothBeyondMiddle, Mover::Both),
            (true, false) => (Priority::Other, Rule::Middle, Mover::Ego),
            (false, true) => (Priority::Ego, Rule::Middle, Mover::Other),
            (false, false) => return None,
        };
        Some(Ruling { priority, rule, mover, time_s: around.time_s() })
    };
    let by_corners = || told(map.is_beyond_middle(around.ego_outline), map.is_beyond_middle(&this.outline));
    // The middle of a long body may cut a bend whose line its corners keep.
    let by_point = |point: Vec2| {
        let is_beyond = |outline: &OrientedBox| map.runs_against(point, outline.pose.heading_rad);
        told(is_beyond(around.ego_outline), is_beyond(&this.outline))
    };
    by_corners().or_else(|| at.and_then(by_point))
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

/// Where a pedestrian is, seen along the ego vehicle's route.
#[derive(Debug, Clone, Copy)]
struct Strip {
    station_m: f64,
    /// From the ego vehicle's front to the pedestrian, m; negative beside and behind.
    ahead_m: f64,
    /// From the strip that the ego vehicle drives on, m; negative in it.
    aside_m: f64,
}

impl Strip {
    fn of(this: &Obstacle, around: &Around) -> Strip {
        let route = &around.scene.route;
        let position = this.outline.pose.position;
        let found = route.path.project_near(position, around.ego_station_m, APPROACH_M);
        let ego = route.path.project_near(around.ego_outline.pose.position, around.ego_station_m, 10.0);
        let half_m = this.outline.half_length_m;
        Strip {
            station_m: found.station_m,
            ahead_m: found.station_m - half_m - VehicleParameters::MKZ.front_m(around.ego_station_m),
            aside_m: (found.offset_m - ego.offset_m).abs() - half_m - around.ego_outline.half_width_m,
        }
    }

    /// Whether the ego vehicle can stop before the pedestrian.
    fn leaves_room(&self, around: &Around) -> bool {
        can_stop(around.ego.speed_mps, self.ahead_m, CAREFUL_BRAKING_MPS2)
    }
}

/// Who has priority, the ego vehicle or a pedestrian, an animal or a thing that comes onto the carriageway or into its way
/// now.
fn on_foot(this: &Obstacle, strip: &Strip, around: &Around) -> Ruling {
    let route = &around.scene.route;
    let ruling = |priority, rule| Ruling { priority, rule, mover: Mover::Other, time_s: around.time_s() };
    let mut crosswalks = route.crosswalks_m.iter().filter(|_| this.body != Body::Object);
    let at = |(from_m, to_m): &&(f64, f64)| (from_m - KERB_M..to_m + KERB_M).contains(&strip.station_m);
    if let Some((from_m, _)) = crosswalks.find(at)
        && light_before(*from_m, around) != Some(SignalColour::Green)
    {
        return ruling(Priority::Other, Rule::Crosswalk);
    }
    match strip.leaves_room(around) {
        true => ruling(Priority::None, Rule::OnFoot),
        false => ruling(Priority::Ego, Rule::SteppingOut),
    }
}

/// The colour of the light before a crosswalk of the route, which begins at a station; green if one of several is.
pub(super) fn light_before(crosswalk_m: f64, around: &Around) -> Option<SignalColour> {
    let lines = around.scene.route.stop_lines.iter();
    let lines = lines.filter(|line| (crosswalk_m - LIGHT_M..crosswalk_m).contains(&line.station_m));
    let colours = lines.map(|line| around.signals.colour(&around.scene.map, line.signal, around.tick));
    colours.max_by_key(|colour| *colour == SignalColour::Green)
}

/// Whether a vehicle that begins to brake after [`REACTION_S`] is at rest within a distance.
fn can_stop(speed_mps: f64, room_m: f64, braking_mps2: f64) -> bool {
    stopping_m(speed_mps, REACTION_S, braking_mps2) <= room_m
}
