//! Two vehicles beside or behind each other: which of them leaves its place, or turns off across the other's.

use avastra_base::geometry::{OrientedBox, Vec2, unit_vector};
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::Priority;
use avastra_road::RoadMap;

use crate::behave::right_of_way::room::{ABRUPT_MPS2, REACTION_S, allowed_mps, can_stop};
use crate::behave::right_of_way::turning::{BEFORE_M, Moving, Pair, TURNS_RAD};
use crate::behave::right_of_way::vehicle::{Course, Vehicle};
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::{Obstacle, SIDEWAYS_MPS};
use crate::state::ruling::{Mover, Rule, Ruling};
use crate::view::around::Around;

/// Way behind another vehicle that may not be cut off, s at its speed (UN R79, 5.6.4.7).
const HEADWAY_S: f64 = 1.0;
/// Vehicles with more room than this between them are not in each other's lane in any way that matters, m. A vehicle
/// that is 16 m/s faster brakes at 3 m/s² after 0.4 s within 49 m.
const LANE_M: f64 = 50.0;
/// Farther to the side than this a vehicle is in no lane that matters, m.
const ASIDE_M: f64 = 6.0;
/// A body that reaches over the border of its lane by more than this leaves it, m. Ours: drivers keep lanes no better.
pub const OVER_M: f64 = 0.1;
/// A vehicle leaves its lane if it moves sideways faster than this, m/s, and would cross the line within [`SOON_S`]. One that keeps its
/// lane stays below. Ours.
const CROSSING_MPS: f64 = 0.5;
/// How far ahead that crossing is looked for, s. Ours.
const SOON_S: f64 = 1.0;

/// Where the ego vehicle and another are along the other's way and across it.
#[derive(Debug, Clone, Copy)]
pub struct Beside {
    /// As in [`Side`].
    pub aside_m: f64,
    apart_m: f64,
    ego_is_ahead: bool,
    /// Speeds along the way, m/s: of the ego vehicle and of the other.
    along_mps: [f64; 2],
    /// Speeds across the way, each towards the other, m/s.
    towards_mps: [f64; 2],
}

/// How the ego vehicle and another lie beside the other's way, and what they do.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// Gap between the flanks across the way, m; negative if one is before the other.
    pub aside_m: f64,
    /// Gap between the ends along the way, m; negative if they are side by side.
    pub apart_m: f64,
    pub ego_is_ahead: bool,
    /// Cosine of the angle between the headings: negative if the two come towards each other.
    pub along: f64,
    /// Speeds along the way, m/s.
    pub ego_mps: f64,
    /// That of the ego vehicle, if it kept to the limit.
    pub allowed_mps: f64,
    pub other_mps: f64,
    /// The manoeuvre of each that the other need not expect.
    pub ego_does: Option<Rule>,
    pub other_does: Option<Rule>,
    /// Whether the other is an emergency vehicle under way.
    pub has_siren: bool,
}

impl Beside {
    /// `None` if the ego vehicle is nowhere near the other's way.
    pub fn of(vehicle: &Vehicle, around: &Around) -> Option<Beside> {
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
        Some(Beside {
            aside_m: across_m.abs() - ego_width_m - other_width_m,
            apart_m,
            ego_is_ahead: ego.station_m > other.station_m,
            along_mps: [ego.forward.dot(&around.ego_velocity_mps), other.forward.dot(&this.velocity_mps)],
            towards_mps: [
                towards * ego.forward.perp(&around.ego_velocity_mps),
                -towards * other.forward.perp(&this.velocity_mps),
            ],
        })
    }

    /// With what the two do. That takes longer to find than where they are. `touch`: whether they touch.
    pub fn side(&self, vehicle: &Vehicle, touch: bool, around: &Around) -> Side {
        let Beside { aside_m, apart_m, ego_is_ahead, along_mps: [ego_mps, other_mps], towards_mps } = *self;
        let (this, map) = (vehicle.this, &around.scene.map);
        let [ego_towards_mps, other_towards_mps] = towards_mps;
        let ego_does = Conduct {
            outline: around.ego_outline,
            forward: around.ego_forward,
            velocity_mps: around.ego_velocity_mps,
            towards_mps: ego_towards_mps,
            is_changing_lanes: false,
            own: Own::of_ego(around),
            by_nearest: false,
            touch,
        }
        .rule(map);
        let other_does = Conduct {
            outline: &this.outline,
            forward: this.forward,
            velocity_mps: this.velocity_mps,
            towards_mps: other_towards_mps,
            is_changing_lanes: vehicle.is_changing_lanes,
            own: Own::of_other(vehicle, map),
            // Where the ego vehicle leaves its lane, that decides.
            by_nearest: ego_does.is_none(),
            touch,
        }
        .rule(map);
        let [ego_does, other_does] = turns_off(vehicle, around).unwrap_or([ego_does, other_does]);
        Side {
            aside_m,
            apart_m,
            ego_is_ahead,
            along: around.ego_forward.dot(&this.forward),
            ego_mps,
            allowed_mps: allowed_mps(ego_mps, around),
            other_mps,
            ego_does,
            other_does,
            has_siren: vehicle.has_siren,
        }
    }
}

impl Side {
    /// Whether the two come towards each other. One that backs up does not, which way ever it looks.
    fn is_oncoming(&self) -> bool {
        self.along < -0.5 && ![self.ego_does, self.other_does].contains(&Some(Rule::Backing))
    }

    /// Whether the vehicle behind keeps its distance to the one ahead if it brakes gently, or not at all.
    pub fn is_gentle(&self) -> bool {
        let (behind_mps, ahead_mps) = match self.ego_is_ahead {
            true => (self.other_mps, self.ego_mps),
            false => (self.allowed_mps, self.other_mps),
        };
        let ahead_mps = ahead_mps.max(0.0);
        let room_m = self.apart_m - ahead_mps * HEADWAY_S;
        self.along > 0.0
            && self.apart_m > 0.0
            && can_stop((behind_mps - ahead_mps).max(0.0), room_m, ABRUPT_MPS2)
    }

    /// Whether the vehicle behind stops before the one ahead if it brakes gently.
    fn can_stop_before(&self) -> bool {
        self.apart_m > 0.0 && can_stop(self.behind_mps(), self.apart_m, ABRUPT_MPS2)
    }

    /// Time until the vehicle behind is at rest if it brakes gently, s.
    pub fn rests_in_s(&self) -> f64 {
        REACTION_S + self.behind_mps() / ABRUPT_MPS2
    }

    fn behind_mps(&self) -> f64 {
        if self.ego_is_ahead { self.other_mps.max(0.0) } else { self.allowed_mps.max(0.0) }
    }

    /// Whether the one of the two that has given way, and may clear the junction, backs up instead.
    pub fn backs(&self, mover: Mover) -> bool {
        let does = if mover == Mover::Ego { self.ego_does } else { self.other_does };
        does == Some(Rule::Backing)
    }

    /// Which vehicle comes into the lane of the other: it has to give way.
    pub fn comes(&self, time_s: f64) -> Option<Ruling> {
        let (priority, rule, mover) = match (self.ego_does, self.other_does) {
            (Some(_), Some(_)) => (Priority::None, Rule::BothLeaveLanes, Mover::Both),
            (Some(rule), None) => (Priority::Other, rule, Mover::Ego),
            (None, Some(rule)) => (Priority::Ego, rule, Mover::Other),
            (None, None) => return None,
        };
        if self.has_siren && rule.is_beside_into_junction() {
            return Some(Ruling { priority: Priority::Other, rule: Rule::Siren, mover, time_s });
        }
        Some(Ruling { priority, rule, mover, time_s })
    }

    /// The priority when one vehicle comes into the other's lane. `None` if it left enough room or came in behind, so
    /// that the rule for following decides.
    pub fn at_coming(&self, beyond_middle: impl FnOnce() -> Option<Ruling>, time_s: f64) -> Option<Ruling> {
        if self.is_oncoming() {
            return beyond_middle();
        }
        let ruling = self.comes(time_s)?;
        let comes_behind = match ruling.mover {
            Mover::Ego => !self.ego_is_ahead,
            Mover::Other => self.ego_is_ahead,
            Mover::Both => false,
        };
        let has_given_way = match ruling.mover {
            Mover::Ego => Priority::Ego,
            Mover::Other | Mover::Both => Priority::Other,
        };
        match ruling.rule {
            // Whichever came first: a turning vehicle and a vehicle that passes it do not drive on behind each other.
            Rule::Overtaking | Rule::Siren => Some(ruling),
            // A vehicle that turns off before the other does not drive on ahead of it: it clears the junction.
            Rule::TurningOff if self.can_stop_before() => {
                Some(Ruling { priority: has_given_way, rule: Rule::Clearing, ..ruling })
            }
            Rule::TurningOff => Some(ruling),
            _ if self.is_gentle() || (self.along > 0.0 && self.apart_m > 0.0 && comes_behind) => None,
            _ => Some(ruling),
        }
    }

    /// The priority in a contact of two vehicles that did not come abruptly into one lane.
    pub fn at_contact(&self, beyond_middle: impl FnOnce() -> Option<Ruling>, time_s: f64) -> Option<Ruling> {
        let ruling = |priority, rule, mover| Ruling { priority, rule, mover, time_s };
        if self.is_oncoming() {
            // Where the middle of the road does not decide, as in a junction, the one that leaves its lane gives way.
            let by_lane = || match (self.ego_does, self.other_does) {
                (_, Some(rule)) => ruling(Priority::Ego, rule, Mover::Other),
                (Some(rule), None) => ruling(Priority::Other, rule, Mover::Ego),
                (None, None) => ruling(Priority::None, Rule::None, Mover::Both),
            };
            return Some(beyond_middle().unwrap_or_else(by_lane));
        }
        let is_turning = |rule: Rule| rule.is_beside_into_junction() || rule == Rule::Siren;
        let turning = self.comes(time_s).filter(|ruling| is_turning(ruling.rule));
        if turning.is_some() {
            return turning;
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

/// The manoeuvres of the ego vehicle and of the other, if the ego vehicle is at a junction and one turns off across the
/// other's way.
pub fn turns_off(vehicle: &Vehicle, around: &Around) -> Option<[Option<Rule>; 2]> {
    let (route, map) = (&around.scene.route, &around.scene.map);
    let (car, station_m) = (VehicleParameters::MKZ, around.ego_station_m);
    let inside =
        [car.front_m(station_m), station_m, car.rear_m(station_m), car.front_m(station_m) + BEFORE_M]
            .map(|station_m| route.lane_at(station_m))
            .into_iter()
            .find(|part| map.lane(part.lane).junction.is_some())?;
    let way = vehicle.way.path()?;
    let [ego, other] =
        [(around.ego_outline, around.ego_velocity_mps), (&vehicle.this.outline, vehicle.this.velocity_mps)]
            .map(|(outline, velocity_mps)| Moving { pose: outline.pose, velocity_mps });
    Pair { map, route, inside, ego, ego_station_m: station_m, other, way }.does()
}

/// The conduct of one vehicle.
struct Conduct<'a> {
    outline: &'a OrientedBox,
    forward: Vec2,
    velocity_mps: Vec2,
    /// Speed across the way towards the other vehicle.
    towards_mps: f64,
    /// Whether it drives a lane change, as far as that is known.
    is_changing_lanes: bool,
    /// How it lies in the lane of its way, where lanes lie over each other; `None` if it keeps to none.
    own: Option<Own>,
    /// Whether the nearest lane counts in a junction for what keeps to none. Several may lie there.
    by_nearest: bool,
    /// Whether it touches the other. One whose side is still within its lane then was touched there.
    touch: bool,
}

/// How a vehicle lies in the lane of its way.
struct Own {
    /// Along the lane.
    along: Vec2,
    /// From the middle of the lane to that of the vehicle, m to the left.
    offset_m: f64,
    width_m: f64,
}

impl Own {
    fn of_ego(around: &Around) -> Option<Own> {
        let (route, station_m) = (&around.scene.route, around.ego_station_m);
        // By the rear axle, which moves where it looks: in a turn the middle looks elsewhere.
        let found = route.path.project_from(around.ego.rear_axle.position, station_m)?;
        let part = route.lane_at(found.station_m);
        let width_m = around.scene.map.lane(part.lane).width_at(found.station_m - part.from_m);
        Some(Own { along: found.forward, offset_m: found.offset_m, width_m })
    }

    fn of_other(vehicle: &Vehicle, map: &RoadMap) -> Option<Own> {
        let Course::Lanes(driver) = vehicle.way else { return None };
        let found = driver.way.path.project_from(vehicle.this.outline.pose.position, driver.station_m)?;
        let (lane, on_lane_m) = driver.way.lane_at(found.station_m);
        Some(Own {
            along: found.forward,
            offset_m: found.offset_m,
            width_m: map.lane(lane).width_at(on_lane_m),
        })
    }
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
        let along = unit_vector(lane.centre.heading_at(place.station_m));
        let nearest = Own { along, offset_m: place.offset_m, width_m: lane.width_at(place.station_m) };
        if lane.junction.is_some() {
            // A long body reaches over its lane in a turn, and keeps it.
            let drifts =
                |own: &Own| own.along.perp(&self.velocity_mps).abs() > SIDEWAYS_MPS && self.leaves(own);
            let own = self.own.as_ref().or(self.by_nearest.then_some(&nearest));
            let leaves = self.is_changing_lanes || own.is_some_and(drifts);
            return leaves.then_some(Rule::LeavingLane);
        }
        if along.dot(&self.forward).abs() < libm::cos(TURNS_RAD) {
            return Some(Rule::TurningRound);
        }
        self.leaves(&nearest).then_some(Rule::LeavingLane)
    }

    /// Whether it leaves a lane: by its motion, not by the word that sent it there. It is over the line, or soon will be.
    fn leaves(&self, own: &Own) -> bool {
        let half_m = self.outline.half_extent_m(self.forward, own.along).1;
        let over_m = own.offset_m.abs() + half_m - own.width_m / 2.0;
        let aside_mps = own.along.perp(&self.velocity_mps).abs();
        let soon_m = if aside_mps > CROSSING_MPS { aside_mps * SOON_S } else { 0.0 };
        let is_inside = self.touch && over_m < -OVER_M;
        self.towards_mps > SIDEWAYS_MPS && over_m + soon_m > OVER_M && !is_inside
    }
}

/// Which of the two has priority because the other is beyond the middle of the road. Any corner beyond it counts;
/// otherwise the point `at` where they touch. Neither has if both are beyond it; `None` if neither of them is.
pub fn beyond_middle(this: &Obstacle, around: &Around, at: Option<Vec2>) -> Option<Ruling> {
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
