//! Which lane a request or a command means: the ego vehicle's, one beside it, or an oncoming one.

use avastra_lang::model::field::IgnoredRules;
use avastra_lang::model::vocabulary::{Body, LaneChoice, Side, TrafficRule};
use avastra_road as road;
use avastra_road::{LaneIndex, Neighbour, RouteLane, Turn};

use super::Scene;

/// A median wider than this divides a road: lanes beyond it do not count as oncoming, m.
const MEDIAN_M_MAX: f64 = 3.0;

/// The lane of a choice beside a station of the route.
///
/// # Errors
/// That there is none, in words.
pub(crate) fn chosen_lane(scene: &Scene, station_m: f64, choice: LaneChoice) -> Result<LaneIndex, String> {
    let beside = |side, refusal: &str| {
        lane_along(scene, station_m, true, |lane| lane_beside(scene, lane, side).ok_or(refusal.into()))
    };
    match choice {
        LaneChoice::Current => Ok(lane_at(scene, station_m)),
        LaneChoice::Left => beside(Side::Left, "no lane on the left"),
        LaneChoice::Right => beside(Side::Right, "no lane on the right"),
    }
}

/// The nearest oncoming lane beside a lane of the route, on its road or another, if no wide median lies
/// between.
pub(crate) fn opposing_lane(scene: &Scene, lane: LaneIndex, station_m: f64) -> Result<LaneIndex, String> {
    let map = &scene.map;
    let here = scene.route.path.pose_at(station_m).position;
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
/// Inside junctions lanes have few neighbours. There the result is the lane that joins the lanes found by `pick` for
/// the streets before and after. It joins them in the direction of the route (`forward`) or against it.
pub(crate) fn lane_along(
    scene: &Scene,
    station_m: f64,
    forward: bool,
    pick: impl Fn(LaneIndex) -> Result<LaneIndex, String>,
) -> Result<LaneIndex, String> {
    let map = &scene.map;
    let here = lane_at(scene, station_m);
    let refusal = match pick(here) {
        Ok(found) => return Ok(found),
        Err(refusal) => refusal,
    };
    let route = &scene.route.lanes;
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

/// The predecessor of a lane: the one on the route if there is one, else one that leads straight on, else
/// the first.
pub(crate) fn lane_before(scene: &Scene, lane: LaneIndex) -> Option<LaneIndex> {
    let (map, route) = (&scene.map, &scene.route.lanes);
    let before = &map.lane(lane).predecessors;
    let on_route = before.iter().find(|lane| route.iter().any(|part| part.lane == **lane));
    let straight = || before.iter().find(|lane| map.lane(**lane).turn == Turn::Straight);
    on_route.or_else(straight).or(before.first()).copied()
}

fn lane_at(scene: &Scene, station_m: f64) -> LaneIndex {
    scene.route.lane_at(station_m).lane
}

/// Whether a vehicle drives in a lane by itself: bus lanes are for buses, and for those who ignore that.
pub(crate) fn may_use(scene: &Scene, lane: LaneIndex, body: Body, ignores: IgnoredRules) -> bool {
    let for_buses = scene.map.lane(lane).for_buses;
    !for_buses || body == Body::SchoolBus || ignores.contains(TrafficRule::BusLanes)
}

/// The same-direction lane on a side of a lane, if there is one and no median lies between.
pub(crate) fn lane_beside(scene: &Scene, lane: LaneIndex, side: Side) -> Option<LaneIndex> {
    let lane = scene.map.lane(lane);
    let neighbour = match side {
        Side::Left => lane.left,
        Side::Right => lane.right,
    };
    let reachable = |neighbour: &Neighbour| neighbour.same_direction && neighbour.gap_m <= road::STRIP_M_MAX;
    neighbour.filter(reachable).map(|neighbour| neighbour.lane)
}
