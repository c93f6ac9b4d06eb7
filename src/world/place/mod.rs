//! Where a spawn puts its road user, and whether there is room.
//!
//! `distance_m` is the gap between the outlines along the ego vehicle's route, but for `Follow`, for which it is a
//! station of the trajectory. Each verb decides what lies at that distance. The waiting times are those of the
//! published package; its offsets are not, because they ignore the lanes. A pedestrian who walks begins at a kerb, at
//! most 10 m from the asked place (`on_foot`). Traffic drives on the right.

pub mod ambient;
pub mod arrival;
mod crossing;
mod asked;
mod driving;
mod newcomer;
mod on_foot;

use std::sync::Arc;

use crate::action::{Begins, SpawnFacts, SpawnRequest};
use avastra_base::kinematics::braking_m;
use avastra_lang::model::Laid;
use avastra_lang::model::body;
use avastra_lang::model::vocabulary::Verb;
use avastra_road::Route;

use crate::place::asked::{Asked, Newcomers, finish};
use crate::scene::lanes::may_use;
use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::guided::Guided;
use crate::state::obstacle::Obstacle;
use crate::state::road_user::{Motion, Mover};
use crate::view::around::Around;
use crate::view::moment::npc_facts;
use crate::view::safety::{behind_leader_m, from_behind_m, noticing_m, oncoming_m};
use crate::view::sense::visible_fraction;
use avastra_lang::model::body::BodyParameters;

pub use arrival::Arrivals;

use crossing::cross_road;
use driving::{drive_ahead, drive_behind, drive_opposite, overtake};
use on_foot::on_foot;

/// The road user that a request would make appear, with a new id, and its cover. `arrivals` are those of this moment.
///
/// # Errors
/// Why it cannot, in words that complete "cannot spawn: …".
pub fn place(
    around: &Around,
    arrivals: &Arrivals,
    request: &SpawnRequest,
    id: u32,
) -> Result<Newcomers, String> {
    check(request)?;
    let size = request.own.map_or_else(|| body::parameters(request.body), |own| own.shape);
    let asked = Asked { around, arrivals, request, size, id };
    let mut driver = match request.verb {
        Verb::DriveAhead => drive_ahead(&asked)?,
        Verb::DriveBehind => drive_behind(&asked)?,
        Verb::Overtake => overtake(&asked)?,
        Verb::DriveOpposite => drive_opposite(&asked)?,
        Verb::CrossRoad => cross_road(&asked)?,
        Verb::Walk | Verb::Stand | Verb::WalkAhead | Verb::WalkOpposite => return on_foot(&asked),
        Verb::Follow => return on_trajectory(&asked),
    };
    let (lane, _) = driver.way.lane_at(driver.station_m);
    if !may_use(around.scene, lane, request.body, request.ignores()) {
        return Err("that lane is for buses".into());
    }
    driver.begin_at(request.offset_m());
    driver.heed(&request.told);
    check_way(around, &driver, &size)?;
    let moved = driver.moved(&size);
    Ok(Newcomers { asked: finish(&asked, Motion::Drive(driver), moved)?, cover: None })
}

/// A road user on a trajectory, at its station, or where the trajectory begins beside the route.
fn on_trajectory(asked: &Asked) -> Result<Newcomers, String> {
    let Asked { around, request, size, .. } = asked;
    let scene = around.scene;
    let on = request.trajectory.ok_or("it follows no trajectory")?;
    let laid = scene.trajectories.get(on.index).and_then(Option::as_ref);
    let way = match laid.ok_or("its trajectory lies on another map")? {
        Laid::OnMap(way) => Arc::clone(way),
        Laid::BesideRoute(way) => {
            let begins_m = match on.begins.ok_or("it begins nowhere")? {
                Begins::BeforeFront(way_m) => VehicleParameters::MKZ.front_m(around.ego_station_m) + way_m,
                Begins::BehindRear(way_m) => VehicleParameters::MKZ.rear_m(around.ego_station_m) - way_m,
            };
            if !begins_m.is_finite() {
                return Err("nobody of that name is there".into());
            }
            let Route { path, .. } = &scene.route;
            if begins_m > path.length_m() {
                return Err("the route ends before that distance".into());
            }
            let height_m = |station_m| scene.route.height_at(&scene.map, station_m);
            Arc::new(way.laid(path, begins_m, height_m).ok_or("the route leaves nothing of its trajectory")?)
        }
    };
    if request.distance_m > way.path.length_m() {
        return Err("the trajectory ends before that station".into());
    }
    let to_middle_m = Guided::to_middle_m(request.body.is_vehicle(), size);
    let guided = Guided::new(way, request.distance_m, request.offset_m(), request.speed_mps, to_middle_m);
    let begins = guided.begins();
    Ok(Newcomers { asked: finish(asked, Motion::Guide(guided), begins)?, cover: None })
}

/// Refuses what no road user could do. Requests of scripts come from outside, so nothing is taken for
/// granted; NaN is in no range.
fn check(request: &SpawnRequest) -> Result<(), String> {
    if let Some(reason) = request.out_of_bounds() {
        return Err(reason);
    }
    if request.cover.is_some_and(|cover| !cover.is_vehicle() || request.verb != Verb::Walk) {
        return Err("only a pedestrian who walks comes from behind a vehicle".into());
    }
    match request.verb.is_on_foot() {
        _ if request.body.can(request.verb) => Ok(()),
        true => Err("only pedestrians and animals walk".into()),
        false => Err("pedestrians, animals and objects do not drive".into()),
    }
}

/// The distances that rules ask for.
///
/// The gap at the spawn is between the outlines. The safety gap is the room that a careful driver needs (see
/// `view::safety`) to slow down to a newcomer ahead, or to stop for one that crosses, walks or stands. For a newcomer
/// from behind it is the room that the newcomer needs to slow down to the ego vehicle. An oncoming vehicle stays in
/// its own lanes and needs none, unless its way crosses the route at a junction or it appears at an offset from the
/// middle of its lane, towards the ego vehicle.
///
/// A newcomer is in plain view if it does not come from behind, and is not hidden by others, fog or distance. Its
/// safety gap is then at least the way that the ego vehicle drives while a careful driver perceives and reacts, even
/// if it would be no danger: it must not seem to come from nowhere.
///
/// A parked vehicle that appears with a pedestrian is nearer than the pedestrian, and the gap is measured to the
/// vehicle. So both appear where a careful driver could still stop.
pub fn facts(around: &Around, request: &SpawnRequest, newcomers: &Newcomers) -> SpawnFacts {
    let newcomer = &newcomers.asked;
    let along_mps = around.ego_outline.pose.forward().dot(&newcomer.obstacle.velocity_mps);
    let (ego_mps, friction) = (around.ego.speed_mps, around.friction);
    let braking_gap_m = match request.verb {
        Verb::DriveAhead | Verb::WalkAhead => behind_leader_m(ego_mps, along_mps, friction),
        Verb::Overtake | Verb::DriveBehind => {
            let braking_mps2 = around.braking_mps2(&newcomer.mover.size, along_mps.max(0.0));
            from_behind_m(along_mps, ego_mps, braking_mps2)
        }
        Verb::DriveOpposite if request.offset_m() > 0.0 || meets_route(around, &newcomer.mover) => {
            oncoming_m(ego_mps, -along_mps, friction)
        }
        // It is where its trajectory says, whatever the ego vehicle does.
        Verb::DriveOpposite | Verb::Follow => 0.0,
        Verb::WalkOpposite => oncoming_m(ego_mps, -along_mps, friction),
        Verb::CrossRoad | Verb::Walk | Verb::Stand => behind_leader_m(ego_mps, 0.0, friction),
    };
    let cover_m = newcomers.cover.as_ref().map_or(f64::INFINITY, |cover| cover.obstacle.distance_m);
    let spawn_gap_m = newcomer.obstacle.distance_m.min(cover_m);
    let is_behind = request.verb.begins_behind();
    let sight_m = around.scene.range_m.min(around.visibility_m);
    let in_view = || {
        let eye = around.ego_outline.pose.position;
        spawn_gap_m < sight_m && visible_fraction(eye, &newcomer.obstacle, around.obstacles_on_level()) > 0.0
    };
    let noticing_m = noticing_m(ego_mps);
    let is_sudden = !is_behind && noticing_m > braking_gap_m && in_view();
    let safety_gap_m = if is_sudden { noticing_m } else { braking_gap_m };
    let npc = npc_facts(around, &newcomer.obstacle, &newcomer.mover.motion);
    SpawnFacts { spawn_gap_m, safety_gap_m, npc }
}

/// Whether the way of a driver crosses or joins the rest of the ego vehicle's route.
fn meets_route(around: &Around, mover: &Mover) -> bool {
    let Motion::Drive(driver) = &mover.motion else { return false };
    let mut ahead =
        around.scene.route.conflicts.iter().filter(|conflict| conflict.station_m > around.ego_station_m);
    ahead.any(|conflict| driver.way.lane_begin_m(conflict.lane).is_some())
}

/// Refuses a newcomer that could not brake for a road user ahead of it. The ego vehicle does not count:
/// the rules of the space say how near to it a newcomer may appear.
fn check_way(around: &Around, driver: &Driver, size: &BodyParameters) -> Result<(), String> {
    let braking_mps2 = around.braking_mps2(size, driver.speed_mps);
    let blocks = |other: &Obstacle| {
        let (gap_m, speed_mps) = driver.gap_to(size, other.into())?;
        let closing_mps = (driver.speed_mps - speed_mps).max(0.0);
        let needed_m = 1.0 + braking_m(closing_mps, braking_mps2) + 0.1 * closing_mps;
        (gap_m < needed_m).then_some((other.id, gap_m, needed_m))
    };
    match around.obstacles().find_map(blocks) {
        None => Ok(()),
        Some((id, gap_m, needed_m)) => Err(format!(
            "npc#{id} is too near ahead in its lane: {gap_m:.1} m, and {needed_m:.1} m are needed to brake behind it"
        )),
    }
}
