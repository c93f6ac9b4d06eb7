//! The orders of a road user that appears at the start: where it begins, and an event for each phase of its manoeuvre.
//!
//! A road user that drives along the lanes is placed in one and given a route. A road user that follows another way is
//! given that way. A phase begins when the one before it is over. If it waits for something, it begins when that holds
//! while the one before it runs or after that.

use core::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use avastra_base::geometry::{Path, PathPoint, Pose, wrap_angle};
use avastra_campaign::episode::Actor;
use avastra_lang::model::command::{AsideBy, Command};
use avastra_lang::model::expr::Expr;
use avastra_lang::model::vocabulary::{Field, Verb};
use avastra_lang::model::{Laid, NpcFacts, Road, Trajectory};
use avastra_road::{Lane, LaneIndex, LanePlace, RoadMap};
use avastra_world::action::{Course, LaterMoment, SpawnRequest};
use avastra_world::sim::ASIDE_MPS;

use super::super::xml::Element;
use super::actions::{
    action, by_entity, condition_after, event_is, event_of_groups, from_time, lane_position,
    lane_position_aside, position, private, route, speed, teleport, walk_from,
};
use super::entity::ahead_of_centre_m;
use super::style::Version;
use super::when;

/// A way that keeps this near to the middle of lanes, m, and no more across them, rad, leads along them.
const LANE_M: f64 = 0.1;
const LANE_RAD: f64 = 0.1;
/// A way is compared with lanes in such steps, m.
const STEP_M: f64 = 0.5;
/// The corner of a way has two vertices that are nearer than this, m.
const BEND_M: f64 = 1e-3;

/// The road users at the start.
pub struct Cast<'a> {
    pub road: &'a Road,
    /// Station of the ego vehicle's front on its route, m.
    pub ego_front_m: f64,
    pub newcomers: Vec<Newcomer<'a>>,
    pub duration_s: f64,
}

/// A road user that appears at the start.
pub struct Newcomer<'a> {
    pub name: String,
    pub actor: &'a Actor,
    pub request: &'a SpawnRequest,
    pub course: Option<&'a Arc<Course>>,
    pub facts: NpcFacts,
}

impl Newcomer<'_> {
    /// The station of its trajectory at which it begins, m; 0 if it follows none.
    pub fn begins_m(&self) -> f64 {
        self.request.trajectory.map_or(0.0, |_| self.request.distance_m)
    }
}

/// How a road user moves.
enum Way<'a> {
    /// It stays where it is.
    Stands,
    /// Along lanes: where it begins, and where it comes into each that is left, and its end.
    Lanes(&'a Trajectory, LanePlace, Vec<LanePlace>),
    Free(&'a Trajectory),
}

impl<'a> Cast<'a> {
    /// The start of a road user, and its events.
    ///
    /// # Errors
    /// The order that no other player can be given, in words.
    pub fn story(&self, nth: usize) -> Result<(Element, Vec<Element>), String> {
        let newcomer = &self.newcomers[nth];
        let way = self.way(newcomer)?;
        Ok((self.begins(newcomer, &way), self.events(nth, &way)?))
    }

    /// Whether a road user looks along the ego vehicle's route at the start.
    pub fn looks_ahead(&self, actor: &Actor) -> bool {
        let pose = actor.samples[0].pose;
        let path = &self.road.route.path;
        let along_rad = path.heading_at(path.project(pose.position).station_m);
        wrap_angle(pose.heading_rad - along_rad).abs() < FRAC_PI_2
    }

    fn way(&self, newcomer: &Newcomer<'a>) -> Result<Way<'a>, String> {
        let Newcomer { request, course, .. } = newcomer;
        let does = |what: &str| Err(format!("somebody {what}"));
        let stands = request.speed_mps == 0.0 && course.is_none();
        match request.verb {
            _ if request.cover.is_some() => does("steps out from behind another one"),
            Verb::Stand => Ok(Way::Stands),
            Verb::DriveAhead | Verb::DriveBehind | Verb::DriveOpposite if stands => Ok(Way::Stands),
            Verb::Follow => {
                let known = request.trajectory.and_then(|on| self.road.trajectories[on.index].as_ref());
                let trajectory = match known {
                    Some(Laid::OnMap(trajectory)) => trajectory.as_ref(),
                    Some(Laid::BesideRoute(_)) => {
                        return does("follows a way beside the ego vehicle's route");
                    }
                    None => return does("follows a way of another map"),
                };
                if !trajectory.turns.is_empty() {
                    return does("is turned away from where it goes");
                }
                let lanes = lanes_along(&self.road.map, &trajectory.path, request.distance_m);
                match lanes {
                    Some((begin, places)) => Ok(Way::Lanes(trajectory, begin, places)),
                    // Beside a bend the stations are not those of the way that is driven.
                    None if request.offset_m() != 0.0 && is_bent(&trajectory.path) => {
                        does("goes beside a way that bends")
                    }
                    None => Ok(Way::Free(trajectory)),
                }
            }
            _ => does("drives or walks by avastra's own models"),
        }
    }

    fn begins(&self, newcomer: &Newcomer<'a>, way: &Way<'a>) -> Element {
        let Newcomer { name, actor, request, .. } = newcomer;
        let private = Element::new("Private").with("entityRef", name);
        let pose = actor.samples[0].pose.offset(ahead_of_centre_m(actor), 0.0);
        match way {
            Way::Stands => private.holding(teleport(position(&pose))).holding(speed(0.0)),
            Way::Lanes(_, begin, places) => {
                let map = &self.road.map;
                let at = LanePlace { offset_m: request.offset_m(), ..*begin };
                let begins =
                    private.holding(teleport(lane_position_aside(map, at))).holding(speed(request.speed_mps));
                let forks = |place: &LanePlace| map.lane(place.lane).successors.len() > 1;
                match places.iter().any(forks) {
                    true => begins.holding(route(
                        &format!("{name}_route"),
                        places.iter().map(|place| lane_position(map, *place)),
                    )),
                    false => begins,
                }
            }
            Way::Free(trajectory) => {
                let vertex = |at_m: f64| trajectory.path.pose_at(at_m).offset(0.0, request.offset_m());
                let points = trajectory.path.points();
                // Two beside a bend are one in the file.
                let next_m = |nth: usize| points.get(nth + 1).map_or(f64::INFINITY, |next| next.station_m);
                let is_own = |(nth, point): &(usize, &PathPoint)| next_m(*nth) - point.station_m > BEND_M;
                let own = points.iter().enumerate().filter(is_own);
                let way: Vec<Pose> = own.map(|(_, point)| vertex(point.station_m)).collect();
                private
                    .holding(teleport(position(&pose)))
                    .holding(speed(request.speed_mps))
                    .holding(walk_from(name, &way, request.distance_m))
            }
        }
    }

    /// An event for each phase.
    fn events(&self, nth: usize, way: &Way<'a>) -> Result<Vec<Element>, String> {
        let newcomer = &self.newcomers[nth];
        let mut events: Vec<Element> = Vec::new();
        let mut offset_m = newcomer.request.offset_m();
        let mut most_mps = newcomer.request.speed_mps;
        let phases =
            newcomer.course.iter().flat_map(|course| (0..course.phases()).map(move |at| (course, at)));
        for (course, at) in phases {
            if course.is_ruled() {
                return Err("rules say when a phase may begin".to_owned());
            }
            // A road user that must arrive somewhere in time may be fast on the way.
            let is_timed = course.phase(at).command.says(Field::Early);
            let speed_mps =
                course.phase(at).command.expr(Field::Speed).and_then(|speed| course.constant(speed));
            let told_mps = speed_mps.map_or(0.0, |value| value.number());
            most_mps = most_mps.max(if is_timed { f64::INFINITY } else { told_mps });
            let name = event_name(newcomer, at);
            let actions = self.actions(newcomer, way, course, at, &mut offset_m)?;
            let actions = actions.into_iter().enumerate();
            let actions =
                actions.map(|(nth, what)| action(&format!("{name}_action_{}", nth + 1), what)).collect();
            let groups = self.groups(nth, course, at, &name)?;
            events.push(event_of_groups(&name, actions, groups));
        }
        events.extend(self.arrives(newcomer, way, most_mps));
        Ok(events)
    }

    /// Stands at the end of its way, where other players would drive on; nothing if it cannot come so far.
    fn arrives(&self, newcomer: &Newcomer, way: &Way<'a>, most_mps: f64) -> Option<Element> {
        let (Way::Lanes(trajectory, ..) | Way::Free(trajectory)) = way else { return None };
        let left_m = trajectory.path.length_m() - newcomer.request.distance_m;
        if most_mps * self.duration_s < left_m {
            return None;
        }
        let name = format!("{}_arrives", newcomer.name);
        let way = Element::new("TraveledDistanceCondition").measured("value", left_m);
        let when = condition_after(&format!("{name}_when"), 0.0, by_entity(&newcomer.name, way));
        let stands = action(&format!("{name}_action"), changes_speed(0.0, None));
        Some(event_of_groups(&name, vec![stands], vec![vec![when]]))
    }

    /// When a phase begins: one of these groups of conditions holds.
    fn groups(
        &self,
        nth: usize,
        course: &Course,
        at: usize,
        name: &str,
    ) -> Result<Vec<Vec<Element>>, String> {
        let (newcomer, phase) = (&self.newcomers[nth], course.phase(at));
        let time_s = |written: &Option<Expr>| match written {
            None => Ok(None),
            Some(expr) => match course.constant(expr) {
                Some(value) => Ok(Some(value.number().max(0.0))),
                None => Err("a phase waits for a time that depends on the moment".to_owned()),
            },
        };
        let after_s = time_s(&phase.after)?.unwrap_or(0.0);
        if time_s(&phase.held)?.is_some_and(|held_s| held_s > 0.0) {
            return Err("a phase waits until something has held for a while".to_owned());
        }
        if time_s(&phase.within)?.is_some_and(|within_s| within_s < self.duration_s) {
            return Err("a phase waits only for a while".to_owned());
        }
        if phase.only_if.is_some() || phase.then.is_some() {
            return Err("a phase comes only sometimes, or goes over to another manoeuvre".to_owned());
        }
        let named = |nth: usize| format!("{name}_when_{nth}");
        let before = at.checked_sub(1).map(|before| event_name(newcomer, before));
        let Some(once) = &phase.once else {
            let when = match before {
                None => from_time(Version::V1_2, &named(1), after_s),
                Some(before) => condition_after(&named(1), after_s, event_is(&before, "completeState")),
            };
            return Ok(vec![vec![when]]);
        };
        let groups = when::groups(self, nth, course, at, once)?;
        if after_s > 0.0 && groups.iter().any(|group| group.len() > 1) {
            return Err("a phase waits for a time after several conditions".to_owned());
        }
        let mut nth = 0;
        let mut numbered = |what: Element| {
            nth += 1;
            condition_after(&named(nth), after_s, what)
        };
        let groups: Vec<Vec<Element>> =
            groups.into_iter().map(|group| group.into_iter().map(&mut numbered).collect()).collect();
        let Some(before) = before else { return Ok(groups) };
        if after_s > 0.0 {
            return Err("a phase waits for a time after another one and a condition".to_owned());
        }
        let states = ["runningState", "completeState"];
        let mut all = Vec::new();
        for (state, group) in
            states.into_iter().flat_map(|state| groups.iter().map(move |group| (state, group)))
        {
            let mut group = group.clone();
            group.push(condition_after(
                &format!("{name}_after_{}", all.len() + 1),
                0.0,
                event_is(&before, state),
            ));
            all.push(group);
        }
        Ok(all)
    }

    /// The actions of a phase.
    fn actions(
        &self,
        newcomer: &Newcomer,
        way: &Way<'a>,
        course: &Course,
        at: usize,
        offset_m: &mut f64,
    ) -> Result<Vec<Element>, String> {
        let written = &course.phase(at).command;
        if written.parts().any(|expr| course.constant(expr).is_none()) {
            return Err("a phase tells what depends on the moment".to_owned());
        }
        let Some(command) = course.command(at, &LaterMoment::default()) else {
            return Err("a phase tells what has no value".to_owned());
        };
        let mut actions = Vec::new();
        match (command.early_s(), command.speed_mps()) {
            (Some(_), _) => actions.push(self.meets(newcomer, way, &command)?),
            (None, Some(mps)) if mps < 0.0 => return Err("somebody goes backwards".to_owned()),
            (None, Some(mps)) => actions.push(changes_speed(mps, command.rate_mps2())),
            (None, None) => {}
        }
        if let Some(to_m) = command.offset_m() {
            let Way::Lanes(_, begin, _) = way else {
                return Err("somebody moves to the side of a way of its own".to_owned());
            };
            let is_cut_short = |before: usize| {
                course.phase(before).command.says(Field::Offset)
                    && (before + 1..=at).any(|later| course.phase(later).once.is_some())
            };
            if (0..at).any(is_cut_short) {
                return Err("somebody may be told another place aside on its way to one".to_owned());
            }
            let by_m = (to_m - *offset_m).abs();
            *offset_m = to_m;
            let lane = self.road.map.lane(begin.lane);
            actions.push(moves_aside(lane, to_m, by_m, command.aside().unwrap_or(AsideBy::Speed(ASIDE_MPS))));
        }
        match actions.is_empty() {
            true => Err("a phase tells nothing that other newcomers know".to_owned()),
            false => Ok(actions),
        }
    }

    /// To be somewhere when the ego vehicle is at a place of its route.
    fn meets(&self, newcomer: &Newcomer, way: &Way<'a>, command: &Command) -> Result<Element, String> {
        let (Some(at_m), Some(reach_m), Some(0.0)) = (command.at_m(), command.reach_m(), command.early_s())
        else {
            return Err("somebody arrives earlier or later than the ego vehicle, or where their ways cross"
                .to_owned());
        };
        // The file says where its rear axle is, the language where its front is.
        let route = &self.road.route;
        let ego_m = (at_m - self.ego_front_m).max(0.0);
        let there = route.lane_at(ego_m);
        let ego_at = LanePlace { lane: there.lane, station_m: ego_m - there.from_m, offset_m: 0.0 };
        let own_at = match way {
            Way::Lanes(trajectory, begin, places) => {
                let point = trajectory.path.position_at(reach_m);
                let near = |place: &LanePlace| self.road.map.lane(place.lane).centre.project(point);
                let found = places.iter().min_by(|a, b| near(a).distance_m.total_cmp(&near(b).distance_m));
                let place = found.unwrap_or(begin);
                lane_position(&self.road.map, LanePlace { station_m: near(place).station_m, ..*place })
            }
            Way::Free(trajectory) => {
                position(&trajectory.path.pose_at(reach_m).offset(0.0, newcomer.request.offset_m()))
            }
            Way::Stands => return Err("somebody arrives who stands".to_owned()),
        };
        let speed = command.speed_mps().map(|mps| {
            let steady = command
                .steady_m()
                .filter(|steady_m| *steady_m > 0.0)
                .map(|steady_m| Element::new("TargetDistanceSteadyState").measured("distance", steady_m));
            let speed = Element::new("AbsoluteSpeed").measured("value", mps).holding_all(steady);
            Element::new("FinalSpeed").holding(speed)
        });
        let meets = Element::new("SynchronizeAction")
            .with("masterEntityRef", "ego")
            .holding(renamed("TargetPositionMaster", lane_position(&self.road.map, ego_at)))
            .holding(renamed("TargetPosition", own_at))
            .holding_all(speed);
        Ok(private(meets))
    }
}

/// Whether a way is no straight line.
fn is_bent(path: &Path) -> bool {
    let begin = path.pose_at(0.0);
    path.points().iter().any(|point| begin.to_local(point.position).y.abs() > BEND_M)
}

/// The name of a phase's event.
fn event_name(newcomer: &Newcomer, at: usize) -> String {
    format!("{}_phase_{}", newcomer.name, at + 1)
}

/// A position under another name, as synchronised arrivals have it.
fn renamed(name: &'static str, position: Element) -> Element {
    Element::new(name).holding_all(position.children().iter().cloned())
}

fn changes_speed(mps: f64, rate_mps2: Option<f64>) -> Element {
    let dynamics = Element::new("SpeedActionDynamics");
    let dynamics = match rate_mps2 {
        None => {
            dynamics.with("dynamicsShape", "step").with("dynamicsDimension", "time").measured("value", 0.0)
        }
        Some(rate_mps2) => dynamics
            .with("dynamicsShape", "linear")
            .with("dynamicsDimension", "rate")
            .measured("value", rate_mps2),
    };
    let target =
        Element::new("SpeedActionTarget").holding(Element::new("AbsoluteTargetSpeed").measured("value", mps));
    let speed = Element::new("SpeedAction").holding(dynamics).holding(target);
    private(Element::new("LongitudinalAction").holding(speed))
}

/// A sinusoidal move that takes as long as one by the smooth step of that greatest speed.
fn moves_aside(lane: &Lane, to_m: f64, by_m: f64, aside: AsideBy) -> Element {
    let time_s = aside.takes_s(by_m);
    // By a cosine: `a = d π² / (2 T²)`.
    let most_mps2 = if time_s > 0.0 { by_m * PI * PI / (2.0 * time_s * time_s) } else { 1.0 };
    let to_m = if lane.is_along() { to_m } else { -to_m };
    let dynamics = Element::new("LaneOffsetActionDynamics")
        .with("dynamicsShape", "sinusoidal")
        .measured("maxLateralAcc", most_mps2);
    let target = Element::new("LaneOffsetTarget")
        .holding(Element::new("AbsoluteTargetLaneOffset").measured("value", to_m));
    let moves = Element::new("LaneOffsetAction").with("continuous", false).holding(dynamics).holding(target);
    private(Element::new("LateralAction").holding(moves))
}

/// The lanes along which a way leads, if it leads along lanes: the place of a station, a place in each lane from that one
/// on, and the end. The places but for the first are the same wherever on the way it begins.
fn lanes_along(map: &RoadMap, path: &Path, from_m: f64) -> Option<(LanePlace, Vec<LanePlace>)> {
    let end_m = path.length_m();
    let in_lane = |lane: LaneIndex, at_m: f64| {
        let station_m = map.lane(lane).centre.project(path.position_at(at_m)).station_m;
        LanePlace { lane, station_m, offset_m: 0.0 }
    };
    let (mut begin, mut places, mut at_m) = (None, Vec::new(), 0.0);
    while at_m < end_m {
        let lanes = map.lanes.iter().enumerate();
        let kept = lanes.map(|(index, lane)| (LaneIndex(index), kept_m(lane, path, at_m)));
        let (lane, until_m) = kept.max_by(|a, b| a.1.total_cmp(&b.1))?;
        if until_m <= at_m {
            return None;
        }
        let is_first = begin.is_none() && from_m < until_m;
        if is_first {
            begin = Some(in_lane(lane, from_m));
        }
        if begin.is_some() {
            places.push(in_lane(lane, if is_first { at_m } else { (at_m + until_m) / 2.0 }));
        }
        if until_m >= end_m {
            places.push(in_lane(lane, end_m));
        }
        at_m = until_m;
    }
    Some((begin?, places))
}

/// Up to which station a way keeps to the middle of a lane; where it begins if it does not lie there.
fn kept_m(lane: &Lane, path: &Path, from_m: f64) -> f64 {
    let begin = path.position_at(from_m);
    if lane.centre.bounds().distance_m2_min(begin) > LANE_M * LANE_M {
        return from_m;
    }
    let lies_in = |at_m: f64| {
        let pose = path.pose_at(at_m);
        let beside = lane.centre.project(pose.position);
        let turned_rad = wrap_angle(lane.centre.heading_at(beside.station_m) - pose.heading_rad);
        beside.distance_m <= LANE_M && turned_rad.abs() <= LANE_RAD
    };
    let steps = ((path.length_m() - from_m) / STEP_M).ceil() as usize;
    let stations = (0..=steps).map(|step| (from_m + step as f64 * STEP_M).min(path.length_m()));
    stations
        .take_while(|at_m| lies_in(*at_m))
        .last()
        .map_or(from_m, |last_m| if last_m >= path.length_m() { last_m } else { last_m + STEP_M })
}
