//! Drivers that appear ahead, from behind or as oncoming traffic.

use std::sync::Arc;

use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_lang::model::vocabulary::{LaneChoice, Side, Then};
use avastra_road::LaneIndex;

use crate::behave::npc::change::can_change;
use crate::place::asked::{Asked, ahead_m, commanded};
use crate::scene::lanes::{chosen_lane, lane_along, lane_before, lane_beside, opposing_lane};
use crate::scene::way::{Way, in_words};
use crate::state::change::{PlannedChange, Towards, When};
use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::choices;
use crate::state::time::ticks;
use crate::view::around::Around;

/// Time after which a vehicle ahead changes lanes, s.
const CHANGE_AFTER_S: f64 = 1.0;
/// How far in front of the ego vehicle an overtaker cuts in, m.
const CUT_IN_M: f64 = 5.0;
/// How far in front of the ego vehicle an overtaker that only wants to pass comes back to its lane, m: two seconds in town.
/// Ours.
const RETURN_M: f64 = 20.0;
/// The lane of a row is followed for this part of the row's length, and so much more, m. A lane outside a bend is
/// longer than the route. Ours.
const ROW_PART: f64 = 1.2;
const ROW_M: f64 = 30.0;

pub fn drive_ahead(asked: &Asked) -> Result<Driver, String> {
    let Asked { around, request, id, .. } = *asked;
    let station_m = ahead_m(asked)?;
    if request.lane == LaneChoice::Current && request.distance_m < 0.0 {
        return Err("in the ego vehicle's own lane nobody begins beside it".into());
    }
    let lane =
        lane_of_row(asked, station_m, true, |station_m| chosen_lane(around.scene, station_m, request.lane))?;
    let mut rng = choices(around.seed, id, 0);
    let beside_ego = around.scene.route.path.pose_at(station_m).position;
    let station_m = around.scene.map.lane(lane).centre.project(beside_ego).station_m;
    let (way, turns_in) = way_of(asked, &[lane], &mut rng)?;
    let plan = change_soon(asked, &way, station_m, lane, &mut rng)?;
    Ok(commanded(asked, way, turns_in, station_m, plan))
}

/// The lane of one that is at this station of the route: `choose` finds it for one alone. Others of a row are in the
/// lane of the first one, or in a lane that this leads to. Against the direction of the route, they are in a lane that
/// leads to this. Where the route changes its lane or the road gains one, `choose` alone would put a row into two.
///
/// # Errors
/// That there is no such lane, in words.
fn lane_of_row(
    asked: &Asked,
    station_m: f64,
    forward: bool,
    choose: impl Fn(f64) -> Result<LaneIndex, String>,
) -> Result<LaneIndex, String> {
    let Asked { around, request, .. } = *asked;
    let Some(first_m) = request.first_m else { return choose(station_m) };
    let row_m = request.distance_m - first_m;
    let first = choose(station_m - row_m)?;
    let map = &around.scene.map;
    let far_m = ROW_PART * row_m.abs() + ROW_M;
    // The lanes that lead on from the first one's, each with how far that is at the most.
    let mut reached = vec![(first, 0.0)];
    let mut at = 0;
    while at < reached.len() {
        let (lane, begin_m) = reached[at];
        let lane = map.lane(lane);
        let end_m = if at == 0 { 0.0 } else { begin_m + lane.centre.length_m() };
        at += 1;
        let next = if forward == (row_m >= 0.0) { &lane.successors } else { &lane.predecessors };
        for lane in next.iter().filter(|_| end_m <= far_m) {
            if !reached.iter().any(|(known, _)| known == lane) {
                reached.push((*lane, end_m));
            }
        }
    }
    let leads_to = |wanted: &LaneIndex| reached.iter().any(|(lane, _)| lane == wanted);
    if let Some(lane) = choose(station_m).ok().filter(leads_to) {
        return Ok(lane);
    }
    let beside = around.scene.route.path.pose_at(station_m).position;
    let away_m = |lane: &LaneIndex| {
        let centre = &map.lane(*lane).centre;
        let place = centre.project(beside);
        let is_on_it = place.station_m > 0.0 && place.station_m < centre.length_m();
        is_on_it.then_some(place.offset_m.abs())
    };
    let nearest = reached.iter().filter_map(|(lane, _)| Some((*lane, away_m(lane)?)));
    let nearest = nearest.min_by(|(_, a_m), (_, b_m)| a_m.total_cmp(b_m));
    nearest.map(|(lane, _)| lane).ok_or("the lane of its row ends before that place".into())
}

/// The lane change of a vehicle that drives in the ego vehicle's direction, if it was asked for one.
fn change_soon(
    asked: &Asked,
    way: &Way,
    station_m: f64,
    lane: LaneIndex,
    rng: &mut Rng,
) -> Result<Vec<PlannedChange>, String> {
    let Asked { around, request, .. } = *asked;
    let mut plan = Vec::new();
    if request.then == Then::Change {
        let sides: &[Side] = match request.lane {
            LaneChoice::Left => &[Side::Right],
            LaneChoice::Right => &[Side::Left],
            LaneChoice::Current => &[Side::Left, Side::Right],
        };
        let begin_m = station_m + request.speed_mps * CHANGE_AFTER_S;
        let possible = |side: &Side| can_change(around, way, begin_m, *side, request);
        let sides: Vec<Side> = sides.iter().copied().filter(possible).collect();
        if sides.is_empty() {
            return Err(no_change(around, lane).into());
        }
        let towards = Towards::To(sides[rng::below(rng, sides.len() as u32) as usize]);
        let when = When::Tick(around.tick + ticks(CHANGE_AFTER_S));
        plan.push(PlannedChange { when, towards });
    }
    Ok(plan)
}

pub fn drive_behind(asked: &Asked) -> Result<Driver, String> {
    let Asked { around, request, id, .. } = *asked;
    let mut rng = choices(around.seed, id, 0);
    let lane = chosen_lane(around.scene, around.ego_station_m, request.lane)?;
    let (lanes, station_m) = from_behind(asked, lane)?;
    let (way, turns_in) = way_of(asked, &lanes, &mut rng)?;
    let plan = change_soon(asked, &way, station_m, lane, &mut rng)?;
    Ok(commanded(asked, way, turns_in, station_m, plan))
}

/// The lanes that lead to this one beside the ego vehicle, itself the last. Also the station on them at which a
/// vehicle's front bumper is `distance_m` behind the ego vehicle's rear bumper, measured in its own lane.
fn from_behind(asked: &Asked, lane: LaneIndex) -> Result<(Vec<LaneIndex>, f64), String> {
    let Asked { around, request, size, .. } = *asked;
    let rear = around.ego.rear_axle.offset(-VehicleParameters::MKZ.rear_axle_to_back_m, 0.0);
    let map = &around.scene.map;
    let centre = &map.lane(lane).centre;
    let beside_m = centre.project(rear.position).station_m;
    // A lane that begins farther ahead, like a bay for turning, is continued backwards to the ego vehicle.
    let before_m = centre.pose_at(beside_m).to_local(rear.position).x.min(0.0);
    let mut station_m = beside_m + before_m - request.distance_m - size.length_m / 2.0;
    let mut lanes = vec![lane];
    while station_m < size.length_m / 2.0 {
        let previous = lane_before(around.scene, lanes[0]).ok_or("the road begins too near behind")?;
        station_m += map.lane(previous).centre.length_m();
        lanes.insert(0, previous);
    }
    Ok((lanes, station_m))
}

/// The way along these lanes, to where the request asks to go at the first junction after them. Also the lane in which
/// it goes there. One that changes its lane will turn from another one.
///
/// # Errors
/// That the last of the lanes does not lead there, in words.
fn way_of(
    asked: &Asked,
    lanes: &[LaneIndex],
    rng: &mut Rng,
) -> Result<(Arc<Way>, Option<LaneIndex>), String> {
    let Asked { around, request, .. } = *asked;
    let keeps = request.then == Then::Keep;
    let laid = Way::turning(&around.scene.roads, lanes, request.told.turn().filter(|_| keeps), rng);
    let (way, lane) = laid.ok_or("that lane leads nowhere")?;
    match request.told.turn() {
        Some(to) if keeps && lane.is_none() => {
            Err(format!("its lane does not lead {} at the next junction", in_words(to)))
        }
        _ => Ok((way, lane)),
    }
}

/// Why a vehicle in this lane cannot change it.
fn no_change(around: &Around, lane: LaneIndex) -> &'static str {
    match [Side::Left, Side::Right].into_iter().all(|side| lane_beside(around.scene, lane, side).is_none()) {
        true => "no lane beside it to change to",
        false => "no room to change lanes before the junction",
    }
}

pub fn overtake(asked: &Asked) -> Result<Driver, String> {
    let Asked { around, request, id, .. } = *asked;
    if request.speed_mps <= around.ego.speed_mps {
        return Err("it would be no faster than the ego vehicle".into());
    }
    let lane = chosen_lane(around.scene, around.ego_station_m, request.lane)?;
    let mut rng = choices(around.seed, id, 0);
    let mut plan = Vec::new();
    let when_ahead = |gap_m, towards| PlannedChange { when: When::AheadOfEgo(gap_m), towards };
    match (request.lane, request.then) {
        (LaneChoice::Current, then) => {
            plan.push(PlannedChange { when: When::Tick(around.tick), towards: Towards::Either });
            let gap_m = if then == Then::Change { CUT_IN_M } else { RETURN_M };
            plan.push(when_ahead(gap_m, Towards::Back));
        }
        (LaneChoice::Left, Then::Change) => plan.push(when_ahead(CUT_IN_M, Towards::To(Side::Right))),
        (LaneChoice::Right, Then::Change) => plan.push(when_ahead(CUT_IN_M, Towards::To(Side::Left))),
        (LaneChoice::Left | LaneChoice::Right, Then::Keep) => {}
    }
    let (lanes, station_m) = from_behind(asked, lane)?;
    let (way, turns_in) = way_of(asked, &lanes, &mut rng)?;
    let passes = |side| can_change(around, &way, station_m, side, request);
    if request.lane == LaneChoice::Current && !passes(Side::Left) && !passes(Side::Right) {
        return Err(no_change(around, lane).into());
    }
    Ok(commanded(asked, way, turns_in, station_m, plan))
}

pub fn drive_opposite(asked: &Asked) -> Result<Driver, String> {
    let Asked { around, request, id, .. } = *asked;
    let station_m = ahead_m(asked)?;
    let map = &around.scene.map;
    let opposing = |station_m| {
        lane_along(around.scene, station_m, false, |lane| opposing_lane(around.scene, lane, station_m))
    };
    let inner = lane_of_row(asked, station_m, false, opposing)?;
    let mut rng = choices(around.seed, id, 0);
    let (lane, plan) = match request.then {
        Then::Keep => (inner, Vec::new()),
        Then::Change => {
            let second = lane_beside(around.scene, inner, Side::Right).ok_or("no second opposing lane")?;
            let when = When::Tick(around.tick);
            (second, vec![PlannedChange { when, towards: Towards::To(Side::Left) }])
        }
    };
    let beside_route = around.scene.route.path.pose_at(station_m).position;
    let station_m = map.lane(lane).centre.project(beside_route).station_m;
    let (way, turns_in) = way_of(asked, &[lane], &mut rng)?;
    if request.then == Then::Change && !can_change(around, &way, station_m, Side::Left, request) {
        return Err("no room to change lanes before the junction".into());
    }
    Ok(commanded(asked, way, turns_in, station_m, plan))
}
