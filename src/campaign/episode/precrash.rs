//! The kind of a collision, in the terms of crash research: the pre-crash types of NHTSA. Source: Najm, Smith and Yanagisawa
//! 2007, "Pre-Crash Scenario Typology for Crash Avoidance Research", DOT HS 810 767.
//!
//! The typology has 37 types, in an order in which the first that fits applies. It is about what both parties did before it
//! became critical; here that is the last 5 s. How places, angles and speeds tell the types apart is ours. An evasive action goes
//! before the types of lane changes, which it would be otherwise. Type 34 is incidents without a collision: here that is a load that
//! falls onto the road. A vehicle that had crashed before is a separate kind.

use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::{Body, BodyClass};

use super::shape::{ASIDE_M, Shape, TURN_RAD};

/// Two who head less apart than this drive in the same direction, rad (45°); more than 180° less this: in opposite ones.
const ALIKE_RAD: f64 = core::f64::consts::FRAC_PI_4;
/// A lead vehicle whose speed changes by less than this over the time that is looked at has a constant one, m/s.
const CONSTANT_MPS: f64 = 1.0;
/// A vehicle that looks so far away from where it goes, forwards or backwards, skids, rad (15°).
const SKIDS_RAD: f64 = core::f64::consts::PI / 12.0;
/// A vehicle that leaves the lanes or skids is faster than this, m/s; slower, it parks.
const PARKING_MPS: f64 = 3.0;
/// A vehicle whose middle is so far beside all lanes has left the road, m.
const BESIDE_ROAD_M: f64 = 0.3;
/// A vehicle backs, or a thing moves, at more than this, m/s.
const MOVES_MPS: f64 = 0.5;
/// A vehicle that moves aside by less evades nothing, m: a third of a lane. Ours.
const EVADES_M: f64 = 1.2;
/// A road user is in the way of a vehicle if its middle is no farther aside, m: half of both widths. Ours.
const IN_THE_WAY_M: f64 = 1.5;
/// Two that came nearer by less, sideways, just were there, m. Ours.
const COMES_M: f64 = 0.5;
/// A vehicle that was slower sideways, and has not changed lanes, drifts, m/s. Unintended departures are tested up to 0.6 m/s, lane
/// changes are driven at 1 m/s and more. Ours.
const CHANGES_MPS: f64 = 1.0;
/// An obstacle that would be reached later than this is passed and not evaded, s: a driver's reaction and braking. Ours.
const LATE_S: f64 = 2.5;
/// A lead vehicle that has stood at so many steps has stopped, and is not stopping: two seconds. Ours.
const STOOD_STEPS: usize = 5;
/// One that overtakes is at most so far behind the other, or has it so far behind, m. Ours.
const BEHIND_M: f64 = 30.0;
const PASSED_M: f64 = 12.0;
/// One that is overtaken is no farther aside, m. Ours.
const LANE_M: f64 = 4.0;

/// A pre-crash type, with its number in the typology.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PreCrash {
    VehicleFailure = 1,
    ControlLossWithManoeuvre = 2,
    ControlLossWithoutManoeuvre = 3,
    RunningRedLight = 4,
    RunningStopSign = 5,
    RoadDepartureWithManoeuvre = 6,
    RoadDepartureWithoutManoeuvre = 7,
    RoadDepartureBacking = 8,
    AnimalWithManoeuvre = 9,
    AnimalWithoutManoeuvre = 10,
    PedestrianWithManoeuvre = 11,
    PedestrianWithoutManoeuvre = 12,
    CyclistWithManoeuvre = 13,
    CyclistWithoutManoeuvre = 14,
    Backing = 15,
    TurningSameDirection = 16,
    Parking = 17,
    ChangingLanesSameDirection = 18,
    DriftingSameDirection = 19,
    ManoeuvreOppositeDirection = 20,
    NoManoeuvreOppositeDirection = 21,
    FollowingVehicleManoeuvre = 22,
    LeadAccelerating = 23,
    LeadSlower = 24,
    LeadDecelerating = 25,
    LeadStopped = 26,
    LeftTurnAcrossPathSignalized = 27,
    RightTurnSignalized = 28,
    LeftTurnAcrossPath = 29,
    StraightCrossingPaths = 30,
    TurningNonSignalized = 31,
    EvasionWithManoeuvre = 32,
    EvasionWithoutManoeuvre = 33,
    FallingLoad = 34,
    ObjectWithManoeuvre = 35,
    ObjectWithoutManoeuvre = 36,
    Other = 37,
    /// With a vehicle that had crashed into another road user before. No type of NHTSA's.
    Wreck,
}

impl PreCrash {
    /// Its number among the 37.
    pub fn number(self) -> Option<u32> {
        (self != PreCrash::Wreck).then_some(self as u32)
    }

    /// Its name, by the typology.
    pub fn name(self) -> &'static str {
        match self {
            PreCrash::VehicleFailure => "vehicle failure",
            PreCrash::ControlLossWithManoeuvre => "control loss after a manoeuvre",
            PreCrash::ControlLossWithoutManoeuvre => "control loss without a manoeuvre",
            PreCrash::RunningRedLight => "running a red light",
            PreCrash::RunningStopSign => "running a stop sign",
            PreCrash::RoadDepartureWithManoeuvre => "road edge departure after a manoeuvre",
            PreCrash::RoadDepartureWithoutManoeuvre => "road edge departure without a manoeuvre",
            PreCrash::RoadDepartureBacking => "road edge departure while backing up",
            PreCrash::AnimalWithManoeuvre => "animal, the vehicle making a manoeuvre",
            PreCrash::AnimalWithoutManoeuvre => "animal, the vehicle making no manoeuvre",
            PreCrash::PedestrianWithManoeuvre => "pedestrian, the vehicle making a manoeuvre",
            PreCrash::PedestrianWithoutManoeuvre => "pedestrian, the vehicle making no manoeuvre",
            PreCrash::CyclistWithManoeuvre => "cyclist, the vehicle making a manoeuvre",
            PreCrash::CyclistWithoutManoeuvre => "cyclist, the vehicle making no manoeuvre",
            PreCrash::Backing => "backing up into another vehicle",
            PreCrash::TurningSameDirection => "turning, same direction",
            PreCrash::Parking => "parking, same direction",
            PreCrash::ChangingLanesSameDirection => "changing lanes, same direction",
            PreCrash::DriftingSameDirection => "drifting, same direction",
            PreCrash::ManoeuvreOppositeDirection => "making a manoeuvre, opposite direction",
            PreCrash::NoManoeuvreOppositeDirection => "making no manoeuvre, opposite direction",
            PreCrash::FollowingVehicleManoeuvre => "following vehicle making a manoeuvre",
            PreCrash::LeadAccelerating => "lead vehicle accelerating",
            PreCrash::LeadSlower => "lead vehicle moving at lower constant speed",
            PreCrash::LeadDecelerating => "lead vehicle decelerating",
            PreCrash::LeadStopped => "lead vehicle stopped",
            PreCrash::LeftTurnAcrossPathSignalized => "left turn across path, signalized junction",
            PreCrash::RightTurnSignalized => "turning right, signalized junction",
            PreCrash::LeftTurnAcrossPath => "left turn across path, non-signalized junction",
            PreCrash::StraightCrossingPaths => "straight crossing paths, non-signalized junction",
            PreCrash::TurningNonSignalized => "turning, non-signalized junction",
            PreCrash::EvasionWithManoeuvre => "evasive action after a manoeuvre",
            PreCrash::EvasionWithoutManoeuvre => "evasive action without a manoeuvre",
            PreCrash::FallingLoad => "non-collision incident: a falling load",
            PreCrash::ObjectWithManoeuvre => "object, the vehicle making a manoeuvre",
            PreCrash::ObjectWithoutManoeuvre => "object, the vehicle making no manoeuvre",
            PreCrash::Other => "other",
            PreCrash::Wreck => "wreck of another crash",
        }
    }
}

/// Place and motion of a road user.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub pose: Pose,
    pub velocity_mps: Vec2,
}

impl Place {
    fn speed_mps(&self) -> f64 {
        self.velocity_mps.norm()
    }

    /// Along its own heading; below 0 it goes back, m/s.
    fn ahead_mps(&self) -> f64 {
        unit_vector(self.pose.heading_rad).dot(&self.velocity_mps)
    }
}

/// The place of a road user at a look, and the road there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub place: Place,
    /// How far the middle was beside all lanes, m; below 0 on one.
    pub off_road_m: f64,
    pub in_junction: bool,
    /// Where the lane leads there, as far as possible the way that the vehicle looks; without a lane, where it looks itself.
    pub lane_rad: f64,
    /// Whether that lane runs against it.
    pub is_against: bool,
}

impl Step {
    /// To the left across the lane.
    fn left(&self) -> Vec2 {
        unit_vector(self.lane_rad + core::f64::consts::FRAC_PI_2)
    }
}

/// A manoeuvre of a road user other than driving on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Manoeuvre {
    /// At a junction; a bend turns a vehicle, too, and is none.
    LeftTurn,
    RightTurn,
    LaneChange,
}

/// The trail of a road user in the last seconds, and what it was about to do.
#[derive(Debug, Clone)]
pub(super) struct Way {
    /// One or more, the last one at the contact.
    pub steps: Vec<Step>,
    /// The manoeuvre that its route or its way requires where it is, as far as that is known.
    pub intends: Option<Manoeuvre>,
    /// Whether what it intends is known: of a vehicle that one of our drivers leads along lanes.
    pub is_known: bool,
}

impl Way {
    fn now(&self) -> &Step {
        &self.steps[self.steps.len() - 1]
    }

    fn from(&self) -> Place {
        self.steps[0].place
    }

    fn to(&self) -> Place {
        self.now().place
    }

    pub fn shape(&self) -> Shape {
        self.shape_until(self.steps.len() - 1)
    }

    fn shape_until(&self, step: usize) -> Shape {
        let (from, to) = (self.from(), self.steps[step].place);
        Shape::between((from.pose, from.speed_mps()), (to.pose, to.speed_mps()))
    }

    /// How far it has gone aside across its lanes between two steps, m to the left.
    fn aside_m(&self, from: usize, to: usize) -> f64 {
        let across_m = |pair: &[Step]| {
            let way = pair[1].place.pose.position - pair[0].place.pose.position;
            way.dot(&(pair[0].left() + pair[1].left())) / 2.0
        };
        self.steps[from..=to].windows(2).map(across_m).sum()
    }

    fn manoeuvre(&self) -> Option<Manoeuvre> {
        // One that goes aside slowly drifts, however far.
        let drifts = |seen: &Manoeuvre| *seen == Manoeuvre::LaneChange && !self.goes_aside();
        let seen = self.manoeuvre_until(self.steps.len() - 1).filter(|seen| !drifts(seen));
        self.intends.or(seen)
    }

    /// Whether it does on purpose what it does.
    fn means_to(&self) -> bool {
        let turns = matches!(self.manoeuvre(), Some(Manoeuvre::LeftTurn | Manoeuvre::RightTurn));
        turns || self.intends.is_some() || !self.is_known && self.manoeuvre().is_some()
    }

    /// Whether it went aside as fast as in a lane change.
    fn goes_aside(&self) -> bool {
        let goes = |step: &Step| step.place.velocity_mps.dot(&step.left()).abs() > CHANGES_MPS;
        self.steps.iter().any(goes)
    }

    /// Its heading as it came to the junction that it is in; if it has been in it all the time, at the beginning.
    fn approach_rad(&self) -> f64 {
        let before = self.steps.iter().rev().find(|step| !step.in_junction);
        before.unwrap_or(&self.steps[0]).place.pose.heading_rad
    }

    /// Its heading before the last junction that it was in; at the beginning, if it was in none.
    fn came_rad(&self) -> f64 {
        let inside = self.steps.iter().rposition(|step| step.in_junction);
        let before =
            inside.and_then(|inside| self.steps[..inside].iter().rev().find(|step| !step.in_junction));
        before.unwrap_or(&self.steps[0]).place.pose.heading_rad
    }

    /// Whether it has stood for the last seconds.
    fn has_stood(&self) -> bool {
        let last = self.steps.len().saturating_sub(STOOD_STEPS);
        self.steps[last..].iter().all(|step| step.place.speed_mps() < STANDING_MPS)
    }

    /// Whether it has stood all the time.
    fn stands(&self) -> bool {
        self.steps.iter().all(|step| step.place.speed_mps() < STANDING_MPS)
    }

    fn manoeuvre_until(&self, step: usize) -> Option<Manoeuvre> {
        let turns = self.steps[..=step].iter().any(|step| step.in_junction);
        match self.shape_until(step) {
            Shape::LeftTurn if turns => Some(Manoeuvre::LeftTurn),
            Shape::RightTurn if turns => Some(Manoeuvre::RightTurn),
            _ => (self.aside_m(0, step).abs() > ASIDE_M).then_some(Manoeuvre::LaneChange),
        }
    }

    fn manoeuvres_before(&self, step: usize) -> bool {
        (0..step).any(|until| self.manoeuvre_until(until).is_some())
    }

    /// Whether it goes aside on purpose, or has done so.
    fn changes_lanes(&self) -> bool {
        match self.manoeuvre() {
            Some(manoeuvre) => manoeuvre == Manoeuvre::LaneChange,
            None => self.goes_aside(),
        }
    }

    /// The step at which it skids.
    fn skids(&self) -> Option<usize> {
        self.steps.iter().position(|Step { place, .. }| {
            let course_rad = libm::atan2(place.velocity_mps.y, place.velocity_mps.x);
            let askew_rad = wrap_angle(course_rad - place.pose.heading_rad).abs();
            let is_skewed = askew_rad.min(core::f64::consts::PI - askew_rad) > SKIDS_RAD;
            place.speed_mps() > PARKING_MPS && is_skewed
        })
    }

    /// The step at which it has left the road.
    fn leaves_road(&self) -> Option<usize> {
        let was_on_it = |step: usize| self.steps[..step].iter().any(|step| step.off_road_m <= 0.0);
        (0..self.steps.len()).find(|&step| {
            let Step { off_road_m, in_junction, .. } = self.steps[step];
            off_road_m > BESIDE_ROAD_M && !in_junction && was_on_it(step)
        })
    }

    fn backs(&self) -> bool {
        self.to().ahead_mps() < -MOVES_MPS
    }

    /// Whether it leaves a place beside the lanes, or has come to one.
    fn parks(&self) -> bool {
        let is_beside = |step: &Step| step.off_road_m >= 0.0 && !step.in_junction;
        let is_slow = |step: &Step| step.place.speed_mps() < PARKING_MPS;
        let moves = self.to().speed_mps() >= STANDING_MPS;
        moves && self.steps.iter().any(|step| is_beside(step) && is_slow(step))
    }

    /// Whether it was on the other side of the road beside or behind a slower vehicle that drives the same way. `others`: where they
    /// were at each step.
    fn overtakes_on_other_side(&self, others: &[Vec<Place>]) -> bool {
        self.steps.iter().zip(others).filter(|(step, _)| step.is_against).any(|(step, others)| {
            let own = step.place;
            others.iter().any(|other| {
                let there = own.pose.to_local(other.pose.position);
                let turned_rad = wrap_angle(other.pose.heading_rad - own.pose.heading_rad).abs();
                (-PASSED_M..BEHIND_M).contains(&there.x)
                    && there.y.abs() < LANE_M
                    && turned_rad < ALIKE_RAD
                    && (PARKING_MPS..own.speed_mps()).contains(&other.speed_mps())
            })
        })
    }

    /// The step from which it moves aside before a road user in its way, too late to pass; a turning vehicle does not.
    /// `others`: their places at each step.
    fn evades(&self, others: &[Vec<Place>]) -> Option<usize> {
        (0..self.steps.len()).find(|&step| {
            let own = self.steps[step].place;
            let turned_rad = wrap_angle(self.to().pose.heading_rad - own.pose.heading_rad).abs();
            if turned_rad > TURN_RAD {
                return false;
            }
            let aside_m = self.aside_m(step, self.steps.len() - 1).abs();
            let is_in_the_way = |other: &Place| {
                let there = own.pose.to_local(other.pose.position);
                let closing_mps = own.speed_mps() - own.pose.forward().dot(&other.velocity_mps);
                there.x > 0.0 && there.y.abs() < IN_THE_WAY_M && there.x < LATE_S * closing_mps
            };
            aside_m > EVADES_M && others[step].iter().any(is_in_the_way)
        })
    }
}

/// The course of events that led to a collision.
#[derive(Debug, Clone)]
pub(super) struct Before {
    pub body: Body,
    pub ego: Way,
    /// With as many steps as that of the ego vehicle.
    pub other: Way,
    /// Where all others were at each step.
    pub third: Vec<Vec<Place>>,
    /// Whether the other has no brakes.
    pub has_failed: bool,
    /// Whether the ego vehicle, or the other one, passed a red light without a siren.
    pub ran_red: bool,
    /// Whether the ego vehicle, or the other one, passed a stop sign without having stood.
    pub ran_stop: bool,
    /// Whether the ego vehicle was in a junction, and whether it has lights.
    pub in_junction: bool,
    pub is_signalized: bool,
    /// Whether the ego vehicle was hit at its front or rear, and not at a side.
    pub is_lengthwise: bool,
    /// Whether the other had crashed before.
    pub is_wreck: bool,
}

impl Before {
    /// The first type that fits.
    pub fn kind(&self) -> PreCrash {
        if self.is_wreck {
            return PreCrash::Wreck;
        }
        if self.has_failed {
            return PreCrash::VehicleFailure;
        }
        if let Some(kind) = self.loses_control() {
            return kind;
        }
        // A vehicle that runs into one ahead that came the same way does not do so because of a light or a sign.
        if !self.is_rear_end() {
            if self.ran_red {
                return PreCrash::RunningRedLight;
            }
            if self.ran_stop {
                return PreCrash::RunningStopSign;
            }
        }
        let backs = || (self.ego.backs() || self.other.backs()).then_some(PreCrash::Backing);
        let first = self.leaves_road().or_else(|| self.by_body()).or_else(backs).or_else(|| self.evades());
        first.unwrap_or_else(|| self.by_direction())
    }

    /// The type of a contact with what is no motor vehicle.
    fn by_body(&self) -> Option<PreCrash> {
        let either = |manoeuvring, not| if self.ego.manoeuvre().is_some() { manoeuvring } else { not };
        let moved = || self.other.steps.iter().any(|step| step.place.speed_mps() > MOVES_MPS);
        Some(match self.body {
            Body::Animal => either(PreCrash::AnimalWithManoeuvre, PreCrash::AnimalWithoutManoeuvre),
            Body::Pedestrian => {
                either(PreCrash::PedestrianWithManoeuvre, PreCrash::PedestrianWithoutManoeuvre)
            }
            Body::Bicycle => either(PreCrash::CyclistWithManoeuvre, PreCrash::CyclistWithoutManoeuvre),
            Body::Object if moved() => PreCrash::FallingLoad,
            Body::Object => either(PreCrash::ObjectWithManoeuvre, PreCrash::ObjectWithoutManoeuvre),
            _ => return None,
        })
    }

    /// The type of a contact of two motor vehicles, by where they came from and turned.
    fn by_direction(&self) -> PreCrash {
        let (ego, other) = (self.ego.manoeuvre(), self.other.manoeuvre());
        let turns = |to: Manoeuvre| self.in_junction && [ego, other].contains(&Some(to));
        let (turns_left, turns_right) = (turns(Manoeuvre::LeftTurn), turns(Manoeuvre::RightTurn));
        let apart_rad = self.apart_rad();
        if apart_rad < ALIKE_RAD {
            return self.same_direction(turns_left || turns_right);
        }
        let is_opposite = apart_rad > core::f64::consts::PI - ALIKE_RAD;
        match (is_opposite, self.is_signalized) {
            // Whichever way it looks, as after a crash or a turn that got stuck.
            _ if !self.in_junction && self.other.stands() => PreCrash::LeadStopped,
            (false, true) if self.other.stands() => PreCrash::LeadStopped,
            (true, true) if turns_left => PreCrash::LeftTurnAcrossPathSignalized,
            (true, false) if turns_left => PreCrash::LeftTurnAcrossPath,
            // One that comes over without meaning to change lanes drifts.
            (true, _) if ego.is_some() || self.other.means_to() || self.overtakes_on_other_side() => {
                PreCrash::ManoeuvreOppositeDirection
            }
            (true, _) => PreCrash::NoManoeuvreOppositeDirection,
            (false, true) if turns_right => PreCrash::RightTurnSignalized,
            (false, false) if turns_left || turns_right => PreCrash::TurningNonSignalized,
            (false, false) => PreCrash::StraightCrossingPaths,
            (false, true) => PreCrash::Other,
        }
    }

    /// Whether one runs into the rear of the other, and both came the same way.
    fn is_rear_end(&self) -> bool {
        let came_apart_rad = wrap_angle(self.other.came_rad() - self.ego.came_rad()).abs();
        self.is_lengthwise && self.apart_rad().max(came_apart_rad) < ALIKE_RAD
    }

    /// How far apart the two head. Before a junction each looks where it comes from; along a bend those who are apart look elsewhere
    /// than where they meet.
    fn apart_rad(&self) -> f64 {
        let heading_rad = |way: &Way| match self.in_junction {
            true => way.approach_rad(),
            false => way.to().pose.heading_rad,
        };
        wrap_angle(heading_rad(&self.other) - heading_rad(&self.ego)).abs()
    }

    /// The ways of the vehicles that keep to roads: of the ego vehicle, and of the other if it is a motor vehicle.
    fn motor_vehicles(&self) -> impl Iterator<Item = &Way> {
        let is_one = BodyClass::MotorVehicle.holds(self.body);
        core::iter::once(&self.ego).chain(is_one.then_some(&self.other))
    }

    fn loses_control(&self) -> Option<PreCrash> {
        let (way, step) = self.motor_vehicles().find_map(|way| Some((way, way.skids()?)))?;
        Some(match way.manoeuvres_before(step) {
            true => PreCrash::ControlLossWithManoeuvre,
            false => PreCrash::ControlLossWithoutManoeuvre,
        })
    }

    fn leaves_road(&self) -> Option<PreCrash> {
        self.motor_vehicles().find_map(|way| {
            let step = way.leaves_road()?;
            let place = way.steps[step].place;
            match () {
                () if place.ahead_mps() < -MOVES_MPS => Some(PreCrash::RoadDepartureBacking),
                () if place.speed_mps() < PARKING_MPS => None,
                () if way.manoeuvres_before(step) => Some(PreCrash::RoadDepartureWithManoeuvre),
                () => Some(PreCrash::RoadDepartureWithoutManoeuvre),
            }
        })
    }

    /// Whether one of them overtakes on the other's side of the road.
    fn overtakes_on_other_side(&self) -> bool {
        [&self.ego, &self.other].iter().any(|way| way.overtakes_on_other_side(&self.third))
    }

    fn evades(&self) -> Option<PreCrash> {
        let evading = |way: &'_ Way| way.evades(&self.third).map(|step| way.manoeuvres_before(step + 1));
        Some(match self.motor_vehicles().find_map(evading)? {
            true => PreCrash::EvasionWithManoeuvre,
            false => PreCrash::EvasionWithoutManoeuvre,
        })
    }

    /// Whether one of them was beside the way of the other.
    fn came_over(&self) -> bool {
        let whole_m = |way: &Way| way.aside_m(0, way.steps.len() - 1);
        let now_m: f64 =
            (self.other.to().pose.position - self.ego.to().pose.position).dot(&self.ego.now().left());
        let came_m = whole_m(&self.other) - whole_m(&self.ego);
        came_m.abs() > COMES_M && (now_m - came_m).abs() > IN_THE_WAY_M
    }

    fn same_direction(&self, turns: bool) -> PreCrash {
        if self.other.parks() {
            return PreCrash::Parking;
        }
        let (ego_from, other_from) = (self.ego.from().pose, self.other.from().pose);
        let is_ahead = ego_from.to_local(other_from.position).x > 0.0;
        let (lead, follower) = if is_ahead { (&self.other, &self.ego) } else { (&self.ego, &self.other) };
        let came_over = self.came_over();
        let now_rad = wrap_angle(self.other.to().pose.heading_rad - self.ego.to().pose.heading_rad).abs();
        if turns && now_rad > TURN_RAD {
            return PreCrash::TurningSameDirection;
        }
        if self.is_lengthwise && follower.changes_lanes() {
            return PreCrash::FollowingVehicleManoeuvre;
        }
        if came_over && (lead.changes_lanes() || follower.changes_lanes())
            || [lead, follower].iter().any(|way| way.manoeuvre() == Some(Manoeuvre::LaneChange))
        {
            return PreCrash::ChangingLanesSameDirection;
        }
        if came_over || !self.is_lengthwise {
            return if turns { PreCrash::TurningSameDirection } else { PreCrash::DriftingSameDirection };
        }
        let (before_mps, after_mps) = (lead.from().speed_mps(), lead.to().speed_mps());
        match after_mps - before_mps {
            _ if before_mps.max(after_mps) < STANDING_MPS || lead.has_stood() => PreCrash::LeadStopped,
            change_mps if change_mps < -CONSTANT_MPS => PreCrash::LeadDecelerating,
            change_mps if change_mps > CONSTANT_MPS => PreCrash::LeadAccelerating,
            _ if after_mps < STANDING_MPS => PreCrash::LeadStopped,
            _ => PreCrash::LeadSlower,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64, heading_deg: f64, speed_mps: f64) -> Place {
        let pose = Pose::new(x_m, y_m, heading_deg.to_radians());
        Place { pose, velocity_mps: pose.forward() * speed_mps }
    }

    /// On a street.
    fn way(places: &[Place]) -> Way {
        let step = |place: &Place| Step {
            place: *place,
            off_road_m: -1.5,
            in_junction: false,
            lane_rad: 0.0,
            is_against: false,
        };
        Way { steps: places.iter().map(step).collect(), intends: None, is_known: true }
    }

    /// The ego vehicle drives 50 m along +x at 10 m/s; in town, at no junction.
    fn before(other: [Place; 2]) -> Before {
        Before {
            body: Body::Sedan,
            ego: way(&[at(0.0, 0.0, 0.0, 10.0), at(50.0, 0.0, 0.0, 10.0)]),
            other: way(&other),
            third: vec![Vec::new(); 2],
            has_failed: false,
            ran_red: false,
            ran_stop: false,
            in_junction: false,
            is_signalized: false,
            is_lengthwise: true,
            is_wreck: false,
        }
    }

    /// The same at a junction.
    fn at_junction(mut before: Before) -> Before {
        before.in_junction = true;
        before.ego.steps.iter_mut().chain(&mut before.other.steps).for_each(|step| step.in_junction = true);
        before
    }

    /// An overtaking vehicle comes from behind, and does this in between, 30 m and more ahead of where it began.
    fn along(middle: Step) -> Before {
        let mut before = before([at(-10.0, 0.0, 0.0, 15.0), at(54.0, 0.0, 0.0, 12.0)]);
        before.ego.steps.insert(1, Step { place: at(25.0, 0.0, 0.0, 10.0), ..before.ego.steps[0] });
        before.other.steps.insert(1, middle);
        before.third.push(Vec::new());
        before
    }

    #[test]
    fn who_is_ahead_tells_the_types_of_rear_ends() {
        let lead = |from_mps: f64, to_mps: f64| {
            before([at(40.0, 0.0, 0.0, from_mps), at(54.0, 0.0, 0.0, to_mps)]).kind().number()
        };
        assert_eq!(lead(0.0, 0.0), Some(26));
        assert_eq!(lead(8.0, 0.0), Some(25));
        assert_eq!(lead(3.0, 3.5), Some(24));
        assert_eq!(lead(2.0, 6.0), Some(23));
        assert_eq!(lead(0.4, 0.05), Some(26));
        // Whichever way it looks, but where ways cross without lights.
        let stands = |heading_deg: f64| before([at(54.0, 0.0, heading_deg, 0.0); 2]);
        assert_eq!([0.0, 90.0, 150.0, 180.0].map(|deg| stands(deg).kind().number()), [Some(26); 4]);
        let in_junction = |is_signalized: bool| Before { in_junction: true, is_signalized, ..stands(90.0) };
        assert_eq!([true, false].map(|lights| in_junction(lights).kind().number()), [Some(26), Some(30)]);
        // Hit from behind: the ego vehicle is the one ahead.
        let behind = before([at(-30.0, 0.0, 0.0, 16.0), at(46.0, 0.0, 0.0, 14.0)]);
        assert_eq!(behind.kind(), PreCrash::LeadSlower);
        let mut cut_in = before([at(10.0, 3.5, 0.0, 9.0), at(54.0, 0.0, 0.0, 8.0)]);
        cut_in.other.steps[0].place.velocity_mps.y = -1.5;
        assert_eq!(cut_in.kind(), PreCrash::ChangingLanesSameDirection);
        let beside =
            Before { is_lengthwise: false, ..before([at(0.0, 2.5, 0.0, 10.0), at(50.0, 1.9, 0.0, 10.0)]) };
        assert_eq!(beside.kind(), PreCrash::DriftingSameDirection);
        // It comes over in front of the ego vehicle, which hits it with its front: on purpose, or slowly.
        let comes_over = |aside_mps: f64| {
            let mut comes = before([at(40.0, 3.5, 0.0, 8.0), at(54.0, 1.6, 0.0, 8.0)]);
            comes.other.steps[1].place.velocity_mps.y = -aside_mps;
            comes.kind().number()
        };
        assert_eq!((comes_over(1.5), comes_over(0.6)), (Some(18), Some(19)));
        let mut swerve = before([at(40.0, 3.5, 0.0, 2.0), at(54.0, 3.5, 0.0, 2.0)]);
        swerve.ego.steps[1].place = at(50.0, 3.5, 0.0, 10.0);
        swerve.ego.steps[0].place.velocity_mps.y = 1.5;
        assert_eq!(swerve.kind(), PreCrash::FollowingVehicleManoeuvre);
    }

    #[test]
    fn junctions_lights_and_turns_tell_the_types_of_crossing_ways() {
        let crossing = before([at(50.0, -30.0, 90.0, 8.0), at(50.0, 0.0, 90.0, 8.0)]);
        assert_eq!(crossing.kind(), PreCrash::StraightCrossingPaths);
        assert_eq!(Before { is_signalized: true, ..crossing.clone() }.kind(), PreCrash::Other);
        assert_eq!(Before { ran_red: true, ..crossing.clone() }.kind(), PreCrash::RunningRedLight);
        assert_eq!(Before { ran_stop: true, ..crossing.clone() }.kind(), PreCrash::RunningStopSign);
        assert_eq!(Before { is_wreck: true, ran_red: true, ..crossing.clone() }.kind(), PreCrash::Wreck);
        assert_eq!(Before { has_failed: true, ran_red: true, ..crossing }.kind(), PreCrash::VehicleFailure);
        let oncoming = before([at(100.0, 3.0, 180.0, 8.0), at(54.0, 0.5, 180.0, 8.0)]);
        assert_eq!(oncoming.kind(), PreCrash::NoManoeuvreOppositeDirection, "it drifts");
        let mut overtakes = oncoming.clone();
        overtakes.other.intends = Some(Manoeuvre::LaneChange);
        assert_eq!(overtakes.kind(), PreCrash::ManoeuvreOppositeDirection);
        let turned = [at(80.0, 3.5, 180.0, 6.0), at(52.0, 0.0, -90.0, 6.0)];
        let left = at_junction(before(turned));
        assert_eq!(left.kind(), PreCrash::LeftTurnAcrossPath);
        assert_eq!(Before { is_signalized: true, ..left }.kind().number(), Some(27));
        // A bend is no turn, and vehicles that meet there come towards each other.
        let mut bend = before([at(74.0, 73.0, -90.0, 12.0), at(54.0, 24.7, -135.0, 12.0)]);
        bend.ego.steps[1].place = at(50.0, 20.7, 45.0, 10.0);
        for way in [&mut bend.ego, &mut bend.other] {
            way.steps.iter_mut().for_each(|step| step.lane_rad = step.place.pose.heading_rad);
        }
        assert_eq!(bend.kind().number(), Some(21));
        let from_the_side = [at(60.0, -20.0, 90.0, 5.0), at(54.0, -1.0, 20.0, 5.0)];
        let right = at_junction(before(from_the_side));
        assert_eq!(right.kind(), PreCrash::TurningNonSignalized);
        assert_eq!(Before { is_signalized: true, ..right }.kind(), PreCrash::RightTurnSignalized);
    }

    #[test]
    fn a_rear_end_after_a_red_light_is_one_if_both_came_the_same_way() {
        let ahead = Before {
            ran_red: true,
            ran_stop: true,
            ..before([at(40.0, 0.0, 0.0, 0.0), at(54.0, 0.0, 0.0, 0.0)])
        };
        assert_eq!(ahead.kind(), PreCrash::LeadStopped);
        // The other came from the side and turned into the ego vehicle's way.
        let mut turned = ahead.clone();
        turned.other.steps[0].place = at(40.0, -20.0, 90.0, 6.0);
        assert_eq!(turned.kind(), PreCrash::RunningRedLight);
        assert_eq!(Before { ran_red: false, ..turned.clone() }.kind(), PreCrash::RunningStopSign);
        // The same before the looks, as far as its way into the junction is seen.
        let inside = Step { in_junction: true, ..turned.other.steps[0] };
        turned.other.steps.insert(1, inside);
        turned.ego.steps.insert(1, turned.ego.steps[0]);
        turned.third.push(Vec::new());
        assert_eq!(turned.kind(), PreCrash::RunningRedLight);
        assert_eq!(Before { is_lengthwise: false, ..ahead }.kind(), PreCrash::RunningRedLight);
    }

    #[test]
    fn who_overtakes_on_the_other_side_makes_a_manoeuvre() {
        let of = |is_against: bool, other: Option<Place>| {
            let mut oncoming = before([at(100.0, 0.0, 180.0, 8.0), at(54.0, 0.0, 180.0, 8.0)]);
            oncoming.ego.steps.iter_mut().for_each(|step| step.is_against = is_against);
            oncoming.third[1].extend(other);
            oncoming.kind().number()
        };
        let at_end = |ahead_m: f64, speed_mps: f64| Some(at(50.0 + ahead_m, -3.5, 0.0, speed_mps));
        assert_eq!(of(true, at_end(25.0, 6.0)), Some(20));
        assert_eq!(of(true, at_end(-8.0, 6.0)), Some(20));
        assert_eq!(of(false, at_end(25.0, 6.0)), Some(21), "in its own lane");
        for other in [None, at_end(25.0, 0.0), at_end(25.0, 12.0), at_end(35.0, 6.0)] {
            assert_eq!(of(true, other), Some(21), "{other:?}");
        }
    }

    #[test]
    fn people_cyclists_animals_and_things_have_types_of_their_own() {
        let walker = Before {
            body: Body::Pedestrian,
            ..before([at(50.0, -5.0, 90.0, 1.5), at(50.0, 0.0, 90.0, 1.5)])
        };
        let mut turning = at_junction(walker.clone());
        turning.ego.steps[1].place = at(20.0, 20.0, 90.0, 5.0);
        for (body, numbers) in
            [(Body::Pedestrian, (11, 12)), (Body::Bicycle, (13, 14)), (Body::Animal, (9, 10))]
        {
            let of = |before: &Before| Before { body, ..before.clone() }.kind().number();
            assert_eq!((of(&turning), of(&walker)), (Some(numbers.0), Some(numbers.1)), "{body:?}");
        }
        let thing = Before { body: Body::Object, ..before([at(52.0, 0.0, 0.0, 0.0); 2]) };
        assert_eq!(thing.kind().number(), Some(36));
        assert_eq!(Before { ego: turning.ego, ..thing.clone() }.kind().number(), Some(35));
        let falls = way(&[at(30.0, 0.0, 0.0, 12.0), at(52.0, 0.0, 0.0, 0.0)]);
        assert_eq!(Before { other: falls, ..thing }.kind(), PreCrash::FallingLoad);
    }

    #[test]
    fn who_skids_leaves_the_road_backs_parks_or_evades_is_told_by_the_steps_in_between() {
        let street = Step {
            place: at(20.0, 0.0, 0.0, 15.0),
            off_road_m: -1.5,
            in_junction: false,
            lane_rad: 0.0,
            is_against: false,
        };
        assert_eq!(along(street).kind(), PreCrash::LeadSlower);
        let skewed = Pose::new(20.0, 0.0, 0.5);
        let skids = Step { place: Place { pose: skewed, ..street.place }, ..street };
        assert_eq!(along(skids).kind().number(), Some(3));
        let mut after_a_change = along(Step { place: Place { pose: skewed, ..street.place }, ..street });
        after_a_change.other.steps[0].place = at(-10.0, 3.5, 0.0, 15.0);
        after_a_change.other.steps[0].place.velocity_mps.y = -1.5;
        after_a_change.other.steps.insert(1, Step { place: at(10.0, 0.0, 0.0, 15.0), ..street });
        assert_eq!(after_a_change.kind().number(), Some(2));
        let beside = Step { place: at(20.0, -3.0, 0.0, 15.0), off_road_m: 1.0, ..street };
        assert_eq!(along(beside).kind().number(), Some(7));
        assert_ne!(along(Step { in_junction: true, ..beside }).kind().number(), Some(7));
        assert_ne!(along(Step { place: at(20.0, -3.0, 0.0, 2.0), ..beside }).kind().number(), Some(7));
        let mut changed = along(beside);
        changed.other.steps.insert(1, Step { place: at(10.0, -3.5, 0.0, 15.0), ..street });
        changed.other.steps[0].place.velocity_mps.y = -1.5;
        assert_eq!(changed.kind().number(), Some(6));
        assert_eq!(along(Step { place: at(20.0, -3.0, 180.0, -5.0), ..beside }).kind().number(), Some(8));

        // One that moves slowly beside the lanes, without having stood in sight, comes from there, too.
        let mut rolls = before([at(45.0, -3.0, 0.0, 1.5), at(54.0, 0.0, 0.0, 4.0)]);
        rolls.other.steps[0].off_road_m = 0.8;
        assert_eq!(rolls.kind(), PreCrash::Parking);
        let backs = before([at(60.0, 0.0, 0.0, -2.0), at(54.0, 0.0, 0.0, -2.0)]);
        assert_eq!(backs.kind(), PreCrash::Backing);
        let mut parks = before([at(45.0, -3.0, 0.0, 0.0), at(54.0, 0.0, 10.0, 4.0)]);
        parks.other.steps[0].off_road_m = 0.8;
        assert_eq!(parks.kind(), PreCrash::Parking);

        // A vehicle beside the ego vehicle comes over because a road user stands before this vehicle: late, or in good time.
        let comes = |stands_m: f64| {
            let mut before = before([at(10.0, 3.5, 0.0, 10.0), at(52.0, 1.0, 0.0, 9.0)]);
            before.other.steps[0].place.velocity_mps.y = -1.5;
            before.third[0].push(at(stands_m, 3.5, 0.0, 0.0));
            before.kind()
        };
        assert_eq!(comes(30.0).number(), Some(33));
        assert_eq!(comes(60.0), PreCrash::ChangingLanesSameDirection);
    }
}
