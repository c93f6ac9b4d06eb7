//! Pedestrians, animals and things: which come onto the carriageway or into the ego vehicle's way.

use avastra_base::geometry::{Pose, Vec2, wrap_angle};
use avastra_base::kinematics::CAREFUL_BRAKING_MPS2;
use avastra_lang::model::vocabulary::{Body, Priority};
use avastra_road::{RouteLane, StopLine};

use crate::behave::right_of_way::room::{allowed_mps, can_stop};
use crate::behave::right_of_way::side::OVER_M;
use crate::behave::right_of_way::turning::TURNS_RAD;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::ruling::{Mover, Rule, Ruling};
use crate::state::sensed::SignalColour;
use crate::view::around::Around;

/// A pedestrian this near to a crosswalk is on it or about to step on it, m. Ours.
const KERB_M: f64 = 1.0;
/// A light this far before a crosswalk holds for it, and that of a junction this far before it, m. Ours.
const LIGHT_M: f64 = 12.0;

/// A body that moves faster across the road steps onto it, m/s. Ours.
const STEPS_MPS: f64 = 0.5;

/// Where a pedestrian is, seen along the ego vehicle's route.
#[derive(Debug, Clone, Copy)]
pub struct Strip {
    station_m: f64,
    /// From the ego vehicle's front to the pedestrian, m; negative beside and behind.
    pub ahead_m: f64,
    /// From the strip that the ego vehicle drives on, m; negative in it.
    pub aside_m: f64,
}

impl Strip {
    pub fn of(this: &Obstacle, around: &Around) -> Strip {
        let route = &around.scene.route;
        let position = this.outline.pose.position;
        // In bends the route is up to twice as long as the straight line. A branch of the route that comes back later is not meant.
        let away_m = (position - around.ego.rear_axle.position).norm();
        let reach_m = 2.0 * away_m + around.ego_offset_m.abs();
        let found = route.path.project_near(position, around.ego_station_m, reach_m);
        let ego = route.path.project_near(around.ego_outline.pose.position, around.ego_station_m, 10.0);
        let half_m = this.outline.half_length_m;
        Strip {
            station_m: found.station_m,
            ahead_m: found.station_m - half_m - VehicleParameters::MKZ.front_m(around.ego_station_m),
            aside_m: (found.offset_m - ego.offset_m).abs() - half_m - around.ego_outline.half_width_m,
        }
    }

    /// Whether the ego vehicle can stop before the pedestrian.
    pub fn leaves_room(&self, around: &Around) -> bool {
        can_stop(allowed_mps(around.ego.speed_mps, around), self.ahead_m, CAREFUL_BRAKING_MPS2)
    }
}

/// The priority between the ego vehicle and a pedestrian, an animal or a thing that comes onto the carriageway or into
/// its way now.
pub fn on_foot(this: &Obstacle, strip: &Strip, around: &Around) -> Ruling {
    let ruling = |priority, rule, mover| Ruling { priority, rule, mover, time_s: around.time_s() };
    match whatever_the_room(this, strip, around) {
        Some(Rule::LeavingLane) => ruling(Priority::Other, Rule::LeavingLane, Mover::Ego),
        Some(rule) => ruling(Priority::Other, rule, Mover::Other),
        None if strip.leaves_room(around) => ruling(Priority::None, Rule::OnFoot, Mover::Other),
        None => ruling(Priority::Ego, Rule::SteppingOut, Mover::Other),
    }
}

/// The rule by which the ego vehicle gives way, however little room it has. It does so to a person on a crosswalk, and
/// to a body that stays beside the road where the ego vehicle leaves it.
pub fn whatever_the_room(this: &Obstacle, strip: &Strip, around: &Around) -> Option<Rule> {
    let mut crosswalks = around.scene.route.crosswalks_m.iter().filter(|_| this.body != Body::Object);
    let at = |(from_m, to_m): &&(f64, f64)| (from_m - KERB_M..to_m + KERB_M).contains(&strip.station_m);
    let is_free = |from_m: f64| light_before(from_m, around) == Some(SignalColour::Green);
    if crosswalks.find(at).is_some_and(|(from_m, _)| !is_free(*from_m)) {
        return Some(Rule::Crosswalk);
    }
    ego_leaves_road_to(this, strip, around).then_some(Rule::LeavingLane)
}

/// Whether the ego vehicle has left the road on the side of a body that stays beside it.
fn ego_leaves_road_to(this: &Obstacle, strip: &Strip, around: &Around) -> bool {
    let map = &around.scene.map;
    let is_off = |at: Vec2, pose: &Pose, by_m: f64| map.nearest(at, pose.heading_rad, by_m).is_none();
    let (pose, ego) = (&this.outline.pose, around.ego_outline);
    let along = around.scene.route.path.pose_at(strip.station_m).forward();
    if along.perp(&this.velocity_mps).abs() > STEPS_MPS || !is_off(pose.position, pose, 0.0) {
        return false;
    }
    let side = ego.pose.to_local(pose.position).y.signum();
    let is_there = |corner: &&Vec2| ego.pose.to_local(**corner).y * side > 0.0;
    ego.corners().iter().filter(is_there).any(|corner| is_off(*corner, &ego.pose, OVER_M))
}

/// The colour of the light that holds for a crosswalk of the route, which begins at a station; green if one of several
/// is. A driver that goes straight on through a junction has the same light for the crosswalk behind it: people there
/// wait.
pub fn light_before(crosswalk_m: f64, around: &Around) -> Option<SignalColour> {
    let (map, route) = (&around.scene.map, &around.scene.route);
    let before = || route.stop_lines.iter().filter(|line| line.station_m < crosswalk_m);
    let colour = |line: &StopLine| around.colours[line.signal];
    let near = before().filter(|line| line.station_m >= crosswalk_m - LIGHT_M).map(colour);
    near.max_by_key(|colour| *colour == SignalColour::Green).or_else(|| {
        let line = before().next_back()?;
        let heading_rad = |station_m: f64| route.path.pose_at(station_m).heading_rad;
        let turned_rad = wrap_angle(heading_rad(crosswalk_m) - heading_rad(line.station_m)).abs();
        let junction = map.signals[line.signal].junction?;
        let is_inside =
            |part: &&RouteLane| part.enter_m < crosswalk_m && map.lane(part.lane).junction == Some(junction);
        let is_behind = crosswalk_m - route.lanes.iter().rfind(is_inside)?.to_m < LIGHT_M;
        (turned_rad < TURNS_RAD && is_behind).then(|| colour(line))
    })
}
