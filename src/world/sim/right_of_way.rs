//! Right of way: which of the ego vehicle and a road user has priority over the other.
//!
//! The rules are those of the Vienna Convention on Road Traffic (1968); Estonia has signed it, and California's
//! code says the same in other words. For two vehicles:
//!
//! | where | rule | article |
//! |---|---|---|
//! | lanes of a junction | an emergency vehicle under way | 34.1 |
//! | lanes of a junction | a red light, then signs, then turning left before oncoming traffic, then the right | 23, 18, 16 |
//! | one lane | a vehicle that comes into it gives way to one that is in it | 14 |
//! | one lane | a vehicle behind another keeps its distance | 13.5 |
//!
//! To give way means not to make the other change its speed or direction *abruptly* (article 1), so what counts
//! is the moment when the first of the two comes into the other's way. A vehicle that then leaves the other
//! room to brake gently has given way, and has from now on priority over it: a vehicle that is in a junction may clear
//! it (18.6), and one that follows keeps its distance (13.5); that both make a priority is ours. What is abrupt,
//! UN R79 says for lane changes: more than 3 m/s² after 0.4 s, to stay the way of a second behind. So a vehicle that
//! cuts in and stops before the one behind it has its distance back has not given way.
//!
//! The ego vehicle has no priority over a vehicle that it has seen standing while it could brake gently for it, wherever
//! that vehicle stands (13.1).
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

use avastra_base::geometry::{OrientedBox, Vec2};
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, STANDING_MPS, WALKING_MPS, stopping_m};
use avastra_lang::model::vocabulary::Priority;
use avastra_road::{LaneIndex, RoadMap, Route, RouteLane, StopLine};

use super::around::Around;
use super::ego::VehicleParameters;
use super::junction::{Area, ConflictAreas, goes_first};
use super::npc::Driver;
use super::road_user::{Motion, Obstacle};
use super::sense::SignalColour;
use super::trace::Trace;
use super::way::Way;
use super::world::DT_S;

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
    match (ego_red, other_red) {
        (true, true) => Priority::None,
        (true, false) => Priority::Other,
        (false, true) => Priority::Ego,
        (false, false) if goes_first(map, ego, other) => Priority::Ego,
        (false, false) => Priority::Other,
    }
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

/// The light at the stop line that a vehicle passed last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PassedLight {
    signal: usize,
    was_red: bool,
}

impl PassedLight {
    /// The last of some stop lines that lies between two stations of a front, with its light at that moment.
    pub fn between(
        lines: &[StopLine],
        from_m: f64,
        to_m: f64,
        colour: impl Fn(usize) -> SignalColour,
    ) -> Option<PassedLight> {
        let line = lines.iter().rfind(|line| (from_m..to_m).contains(&line.station_m))?;
        Some(PassedLight { signal: line.signal, was_red: colour(line.signal) == SignalColour::Red })
    }

    /// Whether the light was red, and the body is still in the junction behind it.
    pub fn is_being_run(&self, map: &RoadMap, outline: &OrientedBox) -> bool {
        let here = || map.nearest(outline.pose.position, outline.pose.heading_rad, 0.0);
        let junction = map.signals[self.signal].junction;
        self.was_red
            && junction.is_some()
            && here().is_some_and(|here| map.lane(here.lane).junction == junction)
    }

    pub fn trace(passed: Option<&PassedLight>, trace: &mut Trace) {
        trace.word(passed.map_or(0, |passed| 2 + 2 * passed.signal as u64 + u64::from(passed.was_red)));
    }
}

/// What is remembered of a road user and the ego vehicle, as far as priority depends on it.
#[derive(Debug, Clone, Default)]
pub(super) struct Rights {
    /// The light that the road user passed last.
    pub passed: Option<PassedLight>,
    /// Whether it and the ego vehicle are in one lane, or it is a pedestrian in the ego vehicle's way; `None` before
    /// the first look.
    shares: Option<bool>,
    meeting: Option<Meeting>,
    /// Who has priority if it is a wreck in the ego vehicle's way; `None` if it is not.
    wreck: Option<Priority>,
    /// Whether it has stood since a moment at which the ego vehicle saw it and could brake gently for it.
    is_foreseen: bool,
    /// Where a pedestrian was last looked for on the carriageway, and whether it was there: most stand and wait.
    on_road: Option<(Vec2, bool)>,
}

/// The road user or the ego vehicle came into the other's way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Meeting {
    place: Place,
    priority: Priority,
    /// Last tick in which they were in each other's way.
    tick: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    /// In a junction: the lanes of the ego vehicle and of the road user.
    Area(LaneIndex, LaneIndex),
    /// In a lane, or on foot on the carriageway.
    Lane,
}

impl Rights {
    /// Notes the light of a stop line that the road user's front passes in this tick.
    pub fn pass(&mut self, way: &Way, from_m: f64, to_m: f64, around: &Around) {
        let colour = |signal| around.signals.colour(&around.scene.map, signal, around.tick);
        self.passed = PassedLight::between(&way.stop_lines, from_m, to_m, colour).or(self.passed);
    }

    /// Notes if one of the two came into the other's way; called ten times a second. `in_sight` says whether the ego
    /// vehicle sees the road user.
    pub fn watch(
        &mut self,
        this: &Obstacle,
        motion: &Motion,
        ego_passed: Option<PassedLight>,
        in_sight: bool,
        around: &Around,
    ) {
        if this.distance_m > APPROACH_M {
            return;
        }
        match motion {
            Motion::Drive(driver) => {
                let stands = this.velocity_mps.norm() < STANDING_MPS;
                let has_time = || in_sight && can_stop(around.ego.speed_mps, this.distance_m, ABRUPT_MPS2);
                self.is_foreseen = stands && (self.is_foreseen || has_time());
                self.watch_driver(this, driver, ego_passed, around);
            }
            // What follows a trajectory keeps no rules of the road, so a vehicle has no right by them; nor has a thing.
            Motion::Guide(_) | Motion::Stand if this.body.is_vehicle() => {}
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Guide(_) | Motion::Stand => {
                self.watch_pedestrian(this, in_sight, around)
            }
        }
    }

    /// Looks whether the road user, which has crashed, lies in the ego vehicle's way; ten times a second.
    pub fn watch_wreck(&mut self, this: &Obstacle, around: &Around) {
        if self.wreck.is_none() && this.distance_m <= APPROACH_M {
            self.wreck = room_before_m(this, around).map(|room_m| {
                let has_time = can_stop(around.ego.speed_mps, room_m, ABRUPT_MPS2);
                if has_time { Priority::Other } else { Priority::None }
            });
        }
    }

    /// Who goes first, as long as what was found about the two holds.
    pub fn now(&self, tick: u64) -> Priority {
        let holds = |meeting: &Meeting| (tick - meeting.tick) as f64 * DT_S <= HOLDS_S;
        self.wreck.or(self.meeting.filter(holds).map(|meeting| meeting.priority)).unwrap_or(Priority::None)
    }

    /// Who had priority, now that the road user, which has crashed, and the ego vehicle touch.
    pub fn at_contact_with_wreck(&self, this: &Obstacle) -> Priority {
        // The ego vehicle came to where it stood, or it slid to where the ego vehicle drove.
        let stands = this.velocity_mps == Vec2::zeros();
        self.wreck.unwrap_or(if stands { Priority::Other } else { Priority::None })
    }

    /// Which of the two had priority, when they touch at `point`.
    pub fn at_contact(&self, this: &Obstacle, motion: &Motion, point: Vec2, around: &Around) -> Priority {
        let holds = |meeting: &&Meeting| (around.tick - meeting.tick) as f64 * DT_S <= HOLDS_S;
        let found = self.meeting.as_ref().filter(holds).map(|meeting| meeting.priority);
        let (priority, could_stop) = match motion {
            Motion::Drive(driver) => {
                let by_lane = || {
                    let side = Side::of(this, driver, around)?;
                    let beyond = || beyond_middle(this, around, Some(point));
                    Some(side.at_contact(driver.is_changing_lanes(), beyond))
                };
                (found.or_else(by_lane).unwrap_or(Priority::None), self.is_foreseen)
            }
            Motion::Guide(_) | Motion::Stand if this.body.is_vehicle() => (Priority::None, false),
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Guide(_) | Motion::Stand => {
                let by_time = || on_foot(&Strip::of(this, around), around);
                (found.unwrap_or_else(by_time), around.ego.speed_mps <= WALKING_MPS)
            }
        };
        // A driver must be able to stop for anything that can be foreseen (13.1), so then neither has priority.
        if could_stop && priority == Priority::Ego { Priority::None } else { priority }
    }

    pub fn trace(&self, trace: &mut Trace) {
        // What was found on the road follows from the pedestrian's position.
        let Rights { passed, shares, meeting, wreck, is_foreseen, on_road: _ } = self;
        PassedLight::trace(passed.as_ref(), trace);
        trace.flags([
            shares.is_some(),
            *shares == Some(true),
            meeting.is_some(),
            wreck.is_some(),
            *is_foreseen,
        ]);
        trace.words(wreck.map(|priority| priority as u64));
        if let Some(Meeting { place, priority, tick }) = *meeting {
            let (ego, other) = match place {
                Place::Area(ego, other) => (ego.0 as u64, other.0 as u64),
                Place::Lane => (u64::MAX, u64::MAX),
            };
            trace.words([ego, other, priority as u64, tick]);
        }
    }

    fn watch_driver(
        &mut self,
        this: &Obstacle,
        driver: &Driver,
        ego_passed: Option<PassedLight>,
        around: &Around,
    ) {
        if let Some(found) = Crossing::of(this, driver, around) {
            let place = Place::Area(found.ego.lane, found.other.lane);
            let judged = || found.priority(ego_passed, self.passed, driver.has_siren, around);
            let known = self.meeting.filter(|meeting| meeting.place == place);
            let priority = known.map_or_else(judged, |meeting| meeting.priority);
            self.meeting = Some(Meeting { place, priority, tick: around.tick });
            // In a junction the headings say nothing about lanes: what follows is looked at anew.
            self.shares = None;
            return;
        }
        let side = Side::of(this, driver, around);
        let shares = side.as_ref().is_some_and(|side| side.aside_m < 0.0);
        let began = shares && self.shares == Some(false);
        self.shares = Some(shares);
        let Some(side) = side.filter(|_| shares) else { return };
        match &mut self.meeting {
            // There was time to brake gently since: from now on it is one vehicle behind another.
            Some(meeting) if meeting.place == Place::Lane && side.is_gentle() => self.meeting = None,
            Some(meeting) if meeting.place == Place::Lane => meeting.tick = around.tick,
            Some(_) | None if began => {
                let beyond = || beyond_middle(this, around, None);
                let priority = side.at_coming(driver.is_changing_lanes(), beyond);
                let found = |priority| Meeting { place: Place::Lane, priority, tick: around.tick };
                self.meeting = priority.map(found).or(self.meeting);
            }
            Some(_) | None => {}
        }
    }

    fn watch_pedestrian(&mut self, this: &Obstacle, in_sight: bool, around: &Around) {
        let strip = Strip::of(this, around);
        let position = this.outline.pose.position;
        // The step onto the carriageway is what counts: from there on the ego vehicle may expect the rest.
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
            && (strip.aside_m < BESIDE_M || is_on_road());
        if shares {
            let known = self.meeting.filter(|_| self.shares == Some(true)).map(|meeting| meeting.priority);
            let priority = match known {
                // The pedestrian came too late, but now the ego vehicle sees it and can stop, so it is no surprise any more.
                Some(Priority::Ego) if in_sight && strip.leaves_room(around) => Priority::None,
                Some(known) => known,
                None => on_foot(&strip, around),
            };
            self.meeting = Some(Meeting { place: Place::Lane, priority, tick: around.tick });
        }
        self.shares = Some(shares);
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
    fn of(this: &Obstacle, driver: &Driver, around: &Around) -> Option<Crossing> {
        let car = VehicleParameters::MKZ;
        let (front_m, rear_m) = (car.front_m(around.ego_station_m), car.rear_m(around.ego_station_m));
        let half_m = this.outline.half_length_m;
        let (other_front_m, other_rear_m) = (driver.station_m + half_m, driver.station_m - half_m);
        // By rising begin: those that begin too far behind or ahead are left out at once.
        let areas = &around.scene.route_areas;
        let first = areas.partition_point(|found| found.area.from_m < rear_m - AREA_M);
        let last = areas.partition_point(|found| found.area.from_m < front_m + APPROACH_M);
        let mut best: Option<Crossing> = None;
        for RouteArea { lane, area } in areas[first..last].iter().filter(|found| found.area.to_m > rear_m) {
            let Some(begin_m) = driver.way.lane_ahead_m(area.other, other_rear_m) else { continue };
            let ego = Passage {
                lane: *lane,
                in_m: area.from_m - front_m,
                out_m: area.to_m - rear_m,
                speed_mps: around.ego.speed_mps,
            };
            let other = Passage {
                lane: area.other,
                in_m: begin_m + area.other_from_m - other_front_m,
                out_m: begin_m + area.other_to_m - other_rear_m,
                speed_mps: driver.speed_mps,
            };
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

    /// How far the later of the two still is from the area, m.
    fn away_m(&self) -> f64 {
        self.ego.in_m.max(self.other.in_m)
    }

    fn priority(
        &self,
        ego_passed: Option<PassedLight>,
        other_passed: Option<PassedLight>,
        has_siren: bool,
        around: &Around,
    ) -> Priority {
        let map = &around.scene.map;
        let red = |passage: &Passage, passed: Option<PassedLight>| {
            map.stop_line_of(passage.lane).is_some_and(|line| {
                let junction = |signal: usize| map.signals[signal].junction;
                match passed.filter(|passed| junction(passed.signal) == junction(line.signal)) {
                    Some(passed) => passed.was_red,
                    // It has not come to its light yet, or was there before its light was looked at.
                    None => around.signals.colour(map, line.signal, around.tick) == SignalColour::Red,
                }
            })
        };
        let (ego_red, other_red) = (red(&self.ego, ego_passed), red(&self.other, other_passed));
        let by_rule = match has_siren {
            true => Priority::Other,
            false => by_lanes(map, (self.ego.lane, ego_red), (self.other.lane, other_red)),
        };
        let ego_first = match (self.ego.is_inside(), self.other.is_inside()) {
            (true, true) => return by_rule,
            (ego_first, _) => ego_first,
        };
        // The first has left the second, which goes before it, room to brake gently: it has given way. At a red light
        // that excuses the second alone.
        let given_way = |is_red: bool, first: Priority| if is_red { Priority::None } else { first };
        match by_rule {
            Priority::Other if ego_first && self.other.has_time_for(&self.ego) => {
                given_way(ego_red, Priority::Ego)
            }
            Priority::Ego if !ego_first && self.ego.has_time_for(&self.other) => {
                given_way(other_red, Priority::Other)
            }
            _ => by_rule,
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
    /// Speeds across the way towards the other one, m/s.
    ego_towards_mps: f64,
    other_towards_mps: f64,
}

impl Side {
    /// `None` if the ego vehicle is nowhere near the other's way.
    fn of(this: &Obstacle, driver: &Driver, around: &Around) -> Option<Side> {
        let path = &driver.way.path;
        let here = this.outline.pose.position;
        let away = around.ego_outline.pose.position - here;
        let guess_m = driver.station_m + this.forward.dot(&away);
        let ego = path.project_from(around.ego_outline.pose.position, guess_m)?;
        if ego.offset_m.abs() > ASIDE_M {
            return None;
        }
        let other = path.project_from(here, driver.station_m)?;
        let (ego_length_m, ego_width_m) = around.ego_outline.half_extent_m(around.ego_forward, ego.forward);
        let (other_length_m, other_width_m) = this.outline.half_extent_m(this.forward, other.forward);
        let across_m = other.offset_m - ego.offset_m;
        let apart_m = (other.station_m - ego.station_m).abs() - ego_length_m - other_length_m;
        if apart_m > LANE_M {
            return None;
        }
        let towards = if across_m >= 0.0 { 1.0 } else { -1.0 };
        Some(Side {
            aside_m: across_m.abs() - ego_width_m - other_width_m,
            apart_m,
            ego_is_ahead: ego.station_m > other.station_m,
            along: around.ego_forward.dot(&this.forward),
            ego_mps: ego.forward.dot(&around.ego_velocity_mps),
            other_mps: other.forward.dot(&this.velocity_mps),
            ego_towards_mps: towards * ego.forward.perp(&around.ego_velocity_mps),
            other_towards_mps: -towards * other.forward.perp(&this.velocity_mps),
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
    fn comes(&self, other_changes: bool) -> Option<Priority> {
        if other_changes && self.other_towards_mps >= self.ego_towards_mps {
            Some(Priority::Ego)
        } else if self.ego_towards_mps > SIDEWAYS_MPS && self.ego_towards_mps > self.other_towards_mps {
            Some(Priority::Other)
        } else {
            None
        }
    }

    /// Who has priority when the two begin to be in one lane; `None` if that is as for any two in a lane.
    fn at_coming(
        &self,
        other_changes: bool,
        beyond_middle: impl FnOnce() -> Option<Priority>,
    ) -> Option<Priority> {
        if self.is_oncoming() {
            return beyond_middle();
        }
        let priority = self.comes(other_changes)?;
        let comes_behind = (priority == Priority::Ego) == self.ego_is_ahead;
        if self.is_gentle() || (self.along > 0.0 && self.apart_m > 0.0 && comes_behind) {
            return None;
        }
        Some(priority)
    }

    /// Who has priority in a contact of two that did not come abruptly into one lane.
    fn at_contact(&self, other_changes: bool, beyond_middle: impl FnOnce() -> Option<Priority>) -> Priority {
        // Half of the smallest body's width.
        let is_in_line = self.aside_m < -0.5;
        if self.is_oncoming() {
            // Where the middle of the road does not decide, as in a junction, the other has priority unless it changes lanes.
            let by_lane = || if other_changes { Priority::Ego } else { Priority::Other };
            return beyond_middle().unwrap_or_else(by_lane);
        }
        if is_in_line && self.along > 0.5 {
            // It keeps its distance, article 13.5.
            return if self.ego_is_ahead { Priority::Ego } else { Priority::Other };
        }
        self.comes(other_changes).unwrap_or(Priority::None)
    }
}

/// Which of the two has priority because the other is beyond the middle of the road: with any corner, or otherwise at the
/// point `at` where they touch. Neither has if both are beyond it; `None` if neither of them is.
fn beyond_middle(this: &Obstacle, around: &Around, at: Option<Vec2>) -> Option<Priority> {
    let map = &around.scene.map;
    let told = |ego: bool, other: bool| match (ego, other) {
        (true, true) => Some(Priority::None),
        (true, false) => Some(Priority::Other),
        (false, true) => Some(Priority::Ego),
        (false, false) => None,
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
fn room_before_m(this: &Obstacle, around: &Around) -> Option<f64> {
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

/// Who has priority, the ego vehicle or a pedestrian that steps onto the carriageway or into its way now.
fn on_foot(strip: &Strip, around: &Around) -> Priority {
    let route = &around.scene.route;
    let crosswalks = || route.crosswalks_m.iter();
    let at = |(from_m, to_m): &&(f64, f64)| (from_m - KERB_M..to_m + KERB_M).contains(&strip.station_m);
    if let Some((from_m, _)) = crosswalks().find(at) {
        let has_green = route.stop_lines.iter().any(|line| {
            (from_m - LIGHT_M..*from_m).contains(&line.station_m)
                && around.signals.colour(&around.scene.map, line.signal, around.tick) == SignalColour::Green
        });
        if !has_green {
            return Priority::Other;
        }
    }
    if strip.leaves_room(around) { Priority::None } else { Priority::Ego }
}

/// Whether a vehicle that begins to brake after [`REACTION_S`] is at rest within a distance.
fn can_stop(speed_mps: f64, room_m: f64, braking_mps2: f64) -> bool {
    stopping_m(speed_mps, REACTION_S, braking_mps2) <= room_m
}
