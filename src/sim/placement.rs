//! Where a spawn puts its road user, and whether there is room.
//!
//! `distance_m` is always the gap between the outlines along the ego vehicle's route. What lies at
//! that distance is each verb's business; the offsets at the roadside and the waiting times are those
//! of the published package (its absolute offsets are not: they ignore the lanes). Traffic drives on
//! the right.

use crate::action::SpawnFacts;
use crate::action::SpawnRequest;
use crate::geometry::OrientedBox;
use crate::geometry::Pose;
use crate::geometry::Vec2;
use crate::geometry::distance_m;
use crate::geometry::wrap_angle;
use crate::model::vocabulary::LaneChoice;
use crate::model::vocabulary::Side;
use crate::model::vocabulary::Then;
use crate::model::vocabulary::Verb;
use crate::rng;
use crate::road::Conflict;
use crate::road::LaneIndex;
use crate::road::RouteLane;
use crate::road::Turn;

use super::body;
use super::body::BodyParameters;
use super::ego::VehicleParameters;
use super::mover::Around;
use super::mover::Motion;
use super::mover::Moved;
use super::mover::Mover;
use super::npc::Cruise;
use super::npc::Driver;
use super::npc::Manoeuvre;
use super::npc::Towards;
use super::npc::When;
use super::npc::can_change;
use super::npc::choices;
use super::npc::lane_beside;
use super::pedestrian::Walker;
use super::safety;
use super::sense::RANGE_M;
use super::sense::SignalColour;
use super::sense::visible_fraction;
use super::way::Way;
use super::world::DT_S;
use super::world::Obstacle;

/// Where pedestrians begin and end, beside the middle of the ego vehicle's lane, m.
const KERB_M: f64 = 5.0;
/// Fastest and farthest that a request may ask for, m/s and m: beyond any road of a scenario, and
/// small enough for every sum that is made of them.
const SPEED_MPS_MAX: f64 = 70.0;
const DISTANCE_M_MAX: f64 = 1000.0;
/// Nobody appears nearer to anybody else, m.
const ROOM_M: f64 = 0.5;
/// A median wider than this divides a road: nobody comes towards the ego vehicle across it, m.
const MEDIAN_M_MAX: f64 = 3.0;
/// Before somebody ahead changes lanes, s.
const CHANGE_AFTER_S: f64 = 1.0;
/// How far in front of the ego vehicle an overtaker cuts in, m.
const CUT_IN_M: f64 = 5.0;
/// How far beyond the asked distance a crossing may lie, m.
const CROSSING_M: f64 = 60.0;
/// How the ego vehicle is expected to gain speed on its way to a rendezvous, m/s²: ours, the comfort of most
/// planners.
const EGO_GAINS_MPS2: f64 = 1.5;
/// How it is expected to take bends, m/s²: ours, the same.
const EGO_LATERAL_MPS2: f64 = 2.0;
/// A stop line so far behind a vehicle that appears counts as passed at that moment, m.
const BEYOND_LINE_M: f64 = 30.0;
/// Step in which a drive towards a rendezvous is timed, m.
const TIMING_M: f64 = 1.0;

/// A road user ready to appear.
pub(super) struct Placed {
    pub obstacle: Obstacle,
    pub mover: Mover,
}

/// Where a request would put its road user, and what it would be, under a new id.
///
/// # Errors
/// Why it cannot, in words that complete "cannot spawn: …".
pub(super) fn place(around: &Around, request: &SpawnRequest, id: u32) -> Result<Placed, String> {
    check(request)?;
    let size = body::parameters(request.body);
    let driver = match request.verb {
        Verb::DriveAhead => drive_ahead(around, request, &size, id)?,
        Verb::Overtake => overtake(around, request, &size, id)?,
        Verb::DriveOpposite => drive_opposite(around, request, &size, id)?,
        Verb::CrossRoad => cross_road(around, request, &size, id)?,
        Verb::Walk | Verb::Stand => return on_foot(around, request, size, id),
    };
    check_way(around, &driver, &size)?;
    let moved = driver.moved();
    finish(around, request, Mover::new(size, Motion::Drive(driver)), id, moved)
}

/// Whether a request is one that anybody could carry out. Scripts come from outside, so nothing is
/// taken for granted; NaN is in no range.
fn check(request: &SpawnRequest) -> Result<(), String> {
    if !(0.0..=SPEED_MPS_MAX).contains(&request.speed_mps) {
        return Err(format!("the speed is not between 0 and {SPEED_MPS_MAX} m/s"));
    }
    if !(0.0..=DISTANCE_M_MAX).contains(&request.distance_m) {
        return Err(format!("the distance is not between 0 and {DISTANCE_M_MAX} m"));
    }
    match request.verb {
        Verb::Walk | Verb::Stand if request.body.is_vehicle() => Err("only a pedestrian walks".into()),
        Verb::Walk | Verb::Stand => Ok(()),
        Verb::DriveAhead | Verb::Overtake | Verb::DriveOpposite | Verb::CrossRoad => {
            if request.body.is_vehicle() { Ok(()) } else { Err("a pedestrian does not drive".into()) }
        }
    }
}

/// The distances that rules ask for.
///
/// The gap at the spawn is between the outlines. The gap that a careful driver needs (see `safety`) is
/// to slow down to one ahead, or to rest for one who crosses, walks or stands: their stopping zone.
/// For one from behind it is what the newcomer needs to slow down to the ego vehicle. One that comes
/// the other way stays in its own lanes and needs none, unless its way crosses the route at a junction.
///
/// Nobody but those from behind appears in plain view nearer than the way that the ego vehicle drives
/// while a careful driver perceives and reacts, even if they would be no danger: who is in sight, and
/// not hidden by others, fog or distance, did not come from nowhere.
pub(super) fn facts(around: &Around, request: &SpawnRequest, placed: &Placed) -> SpawnFacts {
    let along_mps = around.ego_outline.pose.forward().dot(&placed.obstacle.velocity_mps);
    let (ego_mps, friction) = (around.ego.speed_mps, around.friction);
    let braking_gap_m = match request.verb {
        Verb::DriveAhead => safety::behind_leader_m(ego_mps, along_mps, friction),
        Verb::Overtake => {
            let braking_mps2 = around.braking_mps2(&placed.mover.size, along_mps.max(0.0));
            safety::from_behind_m(along_mps, ego_mps, braking_mps2)
        }
        Verb::DriveOpposite if meets_route(around, &placed.mover) => {
            safety::oncoming_m(ego_mps, -along_mps, friction)
        }
        Verb::DriveOpposite => 0.0,
        Verb::CrossRoad | Verb::Walk | Verb::Stand => safety::behind_leader_m(ego_mps, 0.0, friction),
    };
    let spawn_gap_m = placed.obstacle.distance_m;
    let is_behind = request.verb == Verb::Overtake;
    let sight_m = RANGE_M.min(around.visibility_m);
    let in_view = || {
        let eye = around.ego_outline.pose.position;
        spawn_gap_m < sight_m && visible_fraction(eye, &placed.obstacle, around.obstacles) > 0.0
    };
    let noticing_m = safety::noticing_m(ego_mps);
    let is_sudden = !is_behind && noticing_m > braking_gap_m && in_view();
    let safety_gap_m = if is_sudden { noticing_m } else { braking_gap_m };
    SpawnFacts { spawn_gap_m, safety_gap_m }
}

/// Whether the way of a driver crosses or joins what the ego vehicle has before it.
fn meets_route(around: &Around, mover: &Mover) -> bool {
    let Motion::Drive(driver) = &mover.motion else { return false };
    let mut ahead =
        around.scene.route.conflicts.iter().filter(|conflict| conflict.station_m > around.ego_station_m);
    ahead.any(|conflict| driver.way().lane_begin_m(conflict.lane).is_some())
}

fn finish(
    around: &Around,
    request: &SpawnRequest,
    mover: Mover,
    id: u32,
    moved: Moved,
) -> Result<Placed, String> {
    let outline = OrientedBox::new(moved.pose, mover.size.length_m, mover.size.width_m);
    if around.others(id).any(|(other, _)| distance_m(&outline, other) < ROOM_M) {
        return Err("another road user is there".into());
    }
    let obstacle = Obstacle {
        id,
        body: request.body,
        colour: request.colour,
        verb: request.verb,
        outline,
        distance_m: distance_m(around.ego_outline, &outline),
        height_m: mover.size.height_m,
        forward: moved.forward,
        lane_heading_rad: moved.lane_heading_rad,
        velocity_mps: moved.velocity_mps,
        spawned_tick: around.tick,
    };
    Ok(Placed { obstacle, mover })
}

/// A newcomer must be able to brake for those before it. The ego vehicle is not among them: how near
/// to it a newcomer may appear is for the rules of the space to say.
fn check_way(around: &Around, driver: &Driver, size: &BodyParameters) -> Result<(), String> {
    let braking_mps2 = around.braking_mps2(size, driver.speed_mps);
    let blocked = around.obstacles.iter().any(|other| {
        driver.gap_to(size, &other.outline, other.velocity_mps).is_some_and(|(gap_m, speed_mps)| {
            let closing_mps = (driver.speed_mps - speed_mps).max(0.0);
            gap_m < 1.0 + closing_mps * closing_mps / (2.0 * braking_mps2) + 0.1 * closing_mps
        })
    });
    if blocked { Err("another road user is too near in its lane".into()) } else { Ok(()) }
}

/// Station on the route of a centre that lies `distance_m` before the ego vehicle's front.
fn ahead_m(around: &Around, request: &SpawnRequest, size: &BodyParameters) -> Result<f64, String> {
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let station_m = front_m + request.distance_m + size.length_m / 2.0;
    if station_m > around.scene.route.path.length_m() {
        return Err("the route ends before that distance".into());
    }
    Ok(station_m)
}

fn on_foot(around: &Around, request: &SpawnRequest, size: BodyParameters, id: u32) -> Result<Placed, String> {
    let station_m = ahead_m(around, request, &size)?;
    let lane = around.scene.route.path.pose_at(station_m);
    let (left_m, turn_rad) = match request.side {
        Side::Left => (KERB_M, -core::f64::consts::FRAC_PI_2),
        Side::Right => (-KERB_M, core::f64::consts::FRAC_PI_2),
    };
    let facing = |at: Pose| Pose { heading_rad: wrap_angle(at.heading_rad + turn_rad), ..at };
    let (pose, motion) = if request.verb == Verb::Stand {
        (facing(lane), Motion::Stand)
    } else {
        let from = facing(lane.offset(0.0, left_m));
        (
            from,
            Motion::Walk(Walker::new(
                from,
                2.0 * KERB_M,
                request.speed_mps,
                around.tick,
                &mut choices(around.seed, id, 0),
            )),
        )
    };
    let moved = Moved {
        pose,
        forward: pose.forward(),
        lane_heading_rad: pose.heading_rad,
        velocity_mps: Vec2::zeros(),
    };
    finish(around, request, Mover::new(size, motion), id, moved)
}

fn drive_ahead(
    around: &Around,
    request: &SpawnRequest,
    size: &BodyParameters,
    id: u32,
) -> Result<Driver, String> {
    let station_m = ahead_m(around, request, size)?;
    let lane = chosen_lane(around, station_m, request.lane)?;
    let mut rng = choices(around.seed, id, 0);
    let beside_ego = around.scene.route.path.pose_at(station_m).position;
    let station_m = around.scene.map.lane(lane).centre.project(beside_ego).station_m;
    let way = Way::along(around.scene, &[lane], &mut rng).ok_or("that lane leads nowhere")?;
    let mut plan = Vec::new();
    if request.then == Then::Change {
        let sides: &[Side] = match request.lane {
            LaneChoice::Left => &[Side::Right],
            LaneChoice::Right => &[Side::Left],
            LaneChoice::Current => &[Side::Left, Side::Right],
        };
        let begin_m = station_m + request.speed_mps * CHANGE_AFTER_S;
        let possible = |side: &Side| can_change(around, &way, begin_m, *side, request.speed_mps);
        let sides: Vec<Side> = sides.iter().copied().filter(possible).collect();
        if sides.is_empty() {
            return Err("no room to change lanes before the junction".into());
        }
        let towards = Towards::To(sides[rng::below(&mut rng, sides.len() as u32) as usize]);
        let when = When::Tick(around.tick + (CHANGE_AFTER_S / DT_S + 0.5) as u64);
        plan.push(Manoeuvre { when, towards });
    }
    Ok(Driver::new(around.scene, way, station_m, Cruise::Commanded(request.speed_mps), plan, 1))
}

fn overtake(
    around: &Around,
    request: &SpawnRequest,
    size: &BodyParameters,
    id: u32,
) -> Result<Driver, String> {
    if request.speed_mps <= around.ego.speed_mps {
        return Err("it would be no faster than the ego vehicle".into());
    }
    let lane = chosen_lane(around, around.ego_station_m, request.lane)?;
    let mut rng = choices(around.seed, id, 0);
    let mut plan = Vec::new();
    let cut_in = |towards| Manoeuvre { when: When::AheadOfEgo(CUT_IN_M), towards };
    match (request.lane, request.then) {
        (LaneChoice::Current, then) => {
            plan.push(Manoeuvre { when: When::Tick(around.tick), towards: Towards::Either });
            if then == Then::Change {
                plan.push(cut_in(Towards::Back));
            }
        }
        (LaneChoice::Left, Then::Change) => plan.push(cut_in(Towards::To(Side::Right))),
        (LaneChoice::Right, Then::Change) => plan.push(cut_in(Towards::To(Side::Left))),
        (LaneChoice::Left | LaneChoice::Right, Then::Keep) => {}
    }
    // Its front bumper is `distance_m` behind the ego vehicle's rear bumper, measured in its own lane.
    let rear = around.ego.rear_axle.offset(-VehicleParameters::MKZ.rear_axle_to_back_m, 0.0);
    let map = &around.scene.map;
    let centre = &map.lane(lane).centre;
    let beside_m = centre.project(rear.position).station_m;
    // A lane that begins farther ahead, like a bay for turning, is continued backwards to the ego vehicle.
    let before_m = centre.pose_at(beside_m).to_local(rear.position).x.min(0.0);
    let mut station_m = beside_m + before_m - request.distance_m - size.length_m / 2.0;
    let mut lanes = vec![lane];
    while station_m < size.length_m / 2.0 {
        let previous = lane_before(around, lanes[0]).ok_or("the road begins too near behind")?;
        station_m += map.lane(previous).centre.length_m();
        lanes.insert(0, previous);
    }
    let way = Way::along(around.scene, &lanes, &mut rng).ok_or("that lane leads nowhere")?;
    let passes = |side| can_change(around, &way, station_m, side, request.speed_mps);
    if request.lane == LaneChoice::Current && !passes(Side::Left) && !passes(Side::Right) {
        return Err("no room to change lanes before the junction".into());
    }
    Ok(Driver::new(around.scene, way, station_m, Cruise::Commanded(request.speed_mps), plan, 1))
}

fn drive_opposite(
    around: &Around,
    request: &SpawnRequest,
    size: &BodyParameters,
    id: u32,
) -> Result<Driver, String> {
    let station_m = ahead_m(around, request, size)?;
    let map = &around.scene.map;
    let inner = lane_along(around, station_m, false, |lane| opposing_lane(around, lane, station_m))?;
    let mut rng = choices(around.seed, id, 0);
    let (lane, plan) = match request.then {
        Then::Keep => (inner, Vec::new()),
        Then::Change => {
            let second = lane_beside(around, inner, Side::Right).ok_or("no second opposing lane")?;
            let when = When::Tick(around.tick);
            (second, vec![Manoeuvre { when, towards: Towards::To(Side::Left) }])
        }
    };
    let beside_route = around.scene.route.path.pose_at(station_m).position;
    let station_m = map.lane(lane).centre.project(beside_route).station_m;
    let way = Way::along(around.scene, &[lane], &mut rng).ok_or("that lane leads nowhere")?;
    if request.then == Then::Change && !can_change(around, &way, station_m, Side::Left, request.speed_mps) {
        return Err("no room to change lanes before the junction".into());
    }
    Ok(Driver::new(around.scene, way, station_m, Cruise::Commanded(request.speed_mps), plan, 1))
}

fn cross_road(
    around: &Around,
    request: &SpawnRequest,
    size: &BodyParameters,
    id: u32,
) -> Result<Driver, String> {
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let side = match request.side {
        Side::Left => "left",
        Side::Right => "right",
    };
    let mut reason = format!("no crossing leg from the {side} within {CROSSING_M} m");
    for conflict in &around.scene.route.conflicts {
        let distance_m = conflict.station_m - front_m;
        let from_right = conflict.angle_rad > 0.0;
        if !(request.distance_m..=request.distance_m + CROSSING_M).contains(&distance_m)
            || from_right != (request.side == Side::Right)
        {
            continue;
        }
        match rendezvous(around, request, size, id, conflict, distance_m) {
            Ok(driver) => return Ok(driver),
            Err(why) => reason = why,
        }
    }
    Err(reason)
}

/// Time until the ego vehicle's front is `distance_m` farther on, if nothing is in its way, s.
fn arrival_s(around: &Around, distance_m: f64) -> f64 {
    let (map, route) = (&around.scene.map, &around.scene.route);
    let mut station_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let end_m = station_m + distance_m;
    let (mut speed_mps, mut time_s) = (around.ego.speed_mps, 0.0);
    while station_m < end_m {
        let step_m = TIMING_M.min(end_m - station_m);
        let gained_mps = (speed_mps * speed_mps + 2.0 * EGO_GAINS_MPS2 * step_m).sqrt();
        let limit_mps = map.lane(route.lane_at(station_m).lane).speed_limit_mps;
        let curvature_per_m = route.path.curvature_at(station_m).abs().max(1e-4);
        let next_mps = gained_mps.min(limit_mps).min((EGO_LATERAL_MPS2 / curvature_per_m).sqrt());
        time_s += 2.0 * step_m / (speed_mps + next_mps);
        speed_mps = next_mps;
        station_m += step_m;
    }
    time_s
}

/// A driver who reaches a conflict when the ego vehicle does, if nothing is in its way.
fn rendezvous(
    around: &Around,
    request: &SpawnRequest,
    size: &BodyParameters,
    id: u32,
    conflict: &Conflict,
    distance_m: f64,
) -> Result<Driver, String> {
    let map = &around.scene.map;
    let arrival_s = arrival_s(around, distance_m);
    let needed_m = request.speed_mps * arrival_s + size.length_m;
    let mut lanes = vec![conflict.lane];
    let mut upstream_m = conflict.lane_station_m;
    let on_route = |lane: LaneIndex| around.scene.route.lanes.iter().any(|part| part.lane == lane);
    while upstream_m < needed_m {
        let before = &map.lane(lanes[0]).predecessors;
        let Some(previous) = before.iter().copied().find(|lane| !on_route(*lane)) else { break };
        upstream_m += map.lane(previous).centre.length_m();
        lanes.insert(0, previous);
    }
    let mut rng = choices(around.seed, id, 0);
    let way = Way::along(around.scene, &lanes, &mut rng).ok_or("that lane leads nowhere")?;
    let meeting_m = way.lane_begin_m(conflict.lane).expect("the way was made through this lane")
        + conflict.lane_station_m;
    // Backwards from the meeting at the speed that each bend allows, its front first.
    let mut front_m = meeting_m;
    let mut left_s = arrival_s;
    let mut passed_lines: Vec<(usize, f64)> = Vec::new();
    while left_s > 1e-9 {
        let speed_mps = request.speed_mps.min(way.speed_mps_max(front_m)).max(0.1);
        let step_m = TIMING_M.min(speed_mps * left_s);
        front_m -= step_m;
        left_s -= step_m / speed_mps;
        let lines =
            way.stop_lines.iter().filter(|line| (front_m..front_m + step_m).contains(&line.station_m));
        passed_lines.extend(lines.map(|line| (line.signal, left_s.max(0.0))));
        if front_m < size.length_m {
            return Err("the crossing road is too short".into());
        }
    }
    // Nobody appears just beyond a line at which they would have had to stop.
    let behind =
        way.stop_lines.iter().filter(|line| (front_m - BEYOND_LINE_M..front_m).contains(&line.station_m));
    passed_lines.extend(behind.map(|line| (line.signal, 0.0)));
    let is_green = |(signal, after_s): &(usize, f64)| {
        let tick = around.tick + (after_s / DT_S) as u64;
        around.signals.colour(map, *signal, tick) == SignalColour::Green
    };
    if !passed_lines.iter().all(is_green) {
        return Err("its signal will not be green".into());
    }
    let station_m = front_m - size.length_m / 2.0;
    if request.then == Then::Keep {
        return Ok(Driver::new(
            around.scene,
            way,
            station_m,
            Cruise::Commanded(request.speed_mps),
            Vec::new(),
            1,
        ));
    }
    // It starts beside its way and changes into it on the approach.
    let start = way.path.pose_at(station_m).position;
    let (leg, _) = way.lane_at(station_m);
    if map.lane(leg).junction.is_some() {
        return Err("too near to the junction for a lane change".into());
    }
    let mut reason = "no second lane in the crossing leg";
    let mut found = None;
    for (side, back) in [(Side::Right, Side::Left), (Side::Left, Side::Right)] {
        let Some(beside) = lane_beside(around, leg, side) else { continue };
        let first = Way::along(around.scene, &[beside], &mut rng).ok_or("that lane leads nowhere")?;
        let station_m = map.lane(beside).centre.project(start).station_m;
        if can_change(around, &first, station_m, back, request.speed_mps) {
            found = Some((first, station_m));
            break;
        }
        reason = "no room to change lanes before the junction";
    }
    let (first, station_m) = found.ok_or(reason)?;
    let change = Manoeuvre { when: When::Tick(around.tick), towards: Towards::Way(way) };
    Ok(Driver::new(around.scene, first, station_m, Cruise::Commanded(request.speed_mps), vec![change], 1))
}

fn lane_at(around: &Around, station_m: f64) -> LaneIndex {
    around.scene.route.lane_at(station_m).lane
}

fn chosen_lane(around: &Around, station_m: f64, choice: LaneChoice) -> Result<LaneIndex, String> {
    let beside = |side, refusal: &str| {
        lane_along(around, station_m, true, |lane| lane_beside(around, lane, side).ok_or(refusal.into()))
    };
    match choice {
        LaneChoice::Current => Ok(lane_at(around, station_m)),
        LaneChoice::Left => beside(Side::Left, "no lane on the left"),
        LaneChoice::Right => beside(Side::Right, "no lane on the right"),
    }
}

/// The nearest lane that comes the other way beside a lane of the route, of its road or another, if no
/// wide median lies between.
fn opposing_lane(around: &Around, lane: LaneIndex, station_m: f64) -> Result<LaneIndex, String> {
    let map = &around.scene.map;
    let here = around.scene.route.path.pose_at(station_m).position;
    let beside_m = map.lane(lane).centre.project(here).station_m;
    let opposing = map.opposing(lane, beside_m).ok_or("no opposing lane")?;
    if opposing.median_m > MEDIAN_M_MAX {
        let median_m = opposing.median_m;
        return Err(format!("a median of {median_m:.1} m lies before the opposing lane"));
    }
    Ok(opposing.lane)
}

/// The lane that `pick` finds for the lane of the route at a station.
///
/// Inside junctions lanes have few neighbours. There it is the lane that joins what `pick` finds for
/// the streets before and after, in the direction of the route or against it.
fn lane_along(
    around: &Around,
    station_m: f64,
    forward: bool,
    pick: impl Fn(LaneIndex) -> Result<LaneIndex, String>,
) -> Result<LaneIndex, String> {
    let map = &around.scene.map;
    let here = lane_at(around, station_m);
    let refusal = match pick(here) {
        Ok(found) => return Ok(found),
        Err(refusal) => refusal,
    };
    let route = &around.scene.route.lanes;
    let Some(index) = route.iter().position(|part| part.lane == here) else { return Err(refusal) };
    let is_street = |part: &&RouteLane| map.lane(part.lane).junction.is_none();
    let before = route[..index].iter().rfind(is_street);
    let after = route[index + 1..].iter().find(is_street);
    let (Some(before), Some(after), Some(_)) = (before, after, map.lane(here).junction) else {
        return Err(refusal);
    };
    let (from, to) = match (pick(before.lane)?, pick(after.lane)?) {
        (before, after) if forward => (before, after),
        (before, after) => (after, before),
    };
    let through = &map.lane(from).successors;
    through.iter().copied().find(|lane| map.lane(*lane).successors.contains(&to)).ok_or(refusal)
}

/// The lane from which one comes into a lane: that of the route, if it is one, else one straight behind,
/// else the first.
fn lane_before(around: &Around, lane: LaneIndex) -> Option<LaneIndex> {
    let (map, route) = (&around.scene.map, &around.scene.route.lanes);
    let before = &map.lane(lane).predecessors;
    let on_route = before.iter().find(|lane| route.iter().any(|part| part.lane == **lane));
    let straight = || before.iter().find(|lane| map.lane(**lane).turn == Turn::Straight);
    on_route.or_else(straight).or(before.first()).copied()
}
