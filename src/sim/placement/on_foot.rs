//! People on foot: who crosses the road goes from kerb to kerb, timed to meet the ego vehicle.

use core::f64::consts::FRAC_PI_2;

use crate::action::SpawnRequest;
use crate::geometry::{OrientedBox, Pose, Vec2, distance_m, wrap_angle};
use crate::model::vocabulary::{Side, Verb};
use crate::road::{FootWay, Kerb};

use crate::sim::around::Around;
use crate::sim::body::BodyParameters;
use crate::sim::ego::VehicleParameters;
use crate::sim::npc::choices;
use crate::sim::pedestrian::{Walk, Walker};
use crate::sim::road_user::{Motion, Moved, Mover, RoadUser};

use super::crossing::arrival_s;
use super::{ahead_m, finish};

/// A crosswalk within this distance of the asked place is used, m. Ours.
const CROSSWALK_M: f64 = 5.0;
/// A place with a kerb is looked for along the route up to 10 m from the asked one: step, m, and number of steps. Ours.
const MOVED_STEP_M: f64 = 1.0;
const MOVED_STEPS: u32 = 10;
/// Half the width of the strip that must be free of parked vehicles for somebody to walk, m.
const HALF_STRIP_M: f64 = 0.5;

/// A way on foot that begins on the asked side.
struct Crossing {
    /// Station of the route where it crosses, m.
    station_m: f64,
    from: Kerb,
    to: Kerb,
}

/// A pedestrian who crosses the whole road, or who stands on the route.
pub(super) fn on_foot(
    around: &Around,
    request: &SpawnRequest,
    size: BodyParameters,
    id: u32,
) -> Result<RoadUser, String> {
    let asked_m = ahead_m(around, request, &size)?;
    if request.verb == Verb::Stand {
        let lane = around.scene.route.path.pose_at(asked_m);
        let turn_rad = if request.side == Side::Left { -FRAC_PI_2 } else { FRAC_PI_2 };
        let pose = Pose { heading_rad: wrap_angle(lane.heading_rad + turn_rad), ..lane };
        return finish(around, request, Mover::new(size, Motion::Stand), id, at(pose));
    }
    let mut refusal = None;
    for station_m in stations(around, asked_m) {
        match crossing(around, request.side, station_m).and_then(|way| walk(around, request, size, id, &way))
        {
            Ok(newcomer) => return Ok(newcomer),
            // The reason of the asked place is what an author wants to know.
            Err(why) => refusal = refusal.or(Some(why)),
        }
    }
    Err(refusal.unwrap_or_else(|| "the route ends before that distance".into()))
}

/// Stations of the route at which to try, the best first: the middle of a crosswalk at the asked place, the asked
/// place, then those behind it, because a rule may ask for a gap, and those before it.
fn stations(around: &Around, asked_m: f64) -> impl Iterator<Item = f64> {
    let route = &around.scene.route;
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let beyond_m = |(from_m, to_m): &(f64, f64)| (asked_m.clamp(*from_m, *to_m) - asked_m).abs();
    let near = route.crosswalks_m.iter().filter(|span| beyond_m(span) <= CROSSWALK_M);
    let crosswalk =
        near.min_by(|a, b| beyond_m(a).total_cmp(&beyond_m(b))).map(|(a_m, b_m)| (a_m + b_m) / 2.0);
    let nearby = [MOVED_STEP_M, -MOVED_STEP_M]
        .into_iter()
        .flat_map(move |step_m| (1..=MOVED_STEPS).map(move |step| asked_m + step_m * f64::from(step)));
    let ends_m = front_m..=route.path.length_m();
    crosswalk.into_iter().chain([asked_m]).chain(nearby).filter(move |station_m| ends_m.contains(station_m))
}

/// The way over the road at a station of the route, along the crosswalk if one is there.
fn crossing(around: &Around, side: Side, station_m: f64) -> Result<Crossing, String> {
    let map = &around.scene.map;
    let here = around.scene.route.path.pose_at(station_m);
    let mut left = here.left();
    if let Some(along) = map.crosswalk_at(here.position) {
        let along = if along.dot(&left) < 0.0 { -along } else { along };
        // An outline that is longer along the road than across says nothing of the way over it.
        if along.dot(&left) > core::f64::consts::FRAC_1_SQRT_2 {
            left = along;
        }
    }
    let FootWay { left, right } = map.foot_way(here.position, left)?;
    let (from, to) = if side == Side::Left { (left, right) } else { (right, left) };
    Ok(Crossing { station_m, from, to })
}

/// A pedestrian at the beginning of a way, if there is room.
fn walk(
    around: &Around,
    request: &SpawnRequest,
    size: BodyParameters,
    id: u32,
    way: &Crossing,
) -> Result<RoadUser, String> {
    let straight = way.to.place - way.from.place;
    let from = Pose { position: way.from.place, heading_rad: libm::atan2(straight.y, straight.x) };
    let way_m = way.from.way_m + way.to.way_m;
    if meets_parked(around, &from, way_m + way.to.beyond_m) {
        return Err("a parked vehicle stands in the way".into());
    }
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let walk = Walk {
        from,
        way_m,
        beyond_m: way.to.beyond_m,
        speed_mps: request.speed_mps,
        // As in Euro NCAP's tests with an impact at half the width: it is in the middle of the ego vehicle's way when
        // that vehicle's front arrives.
        meets_s: arrival_s(around, way.station_m - front_m) - way.from.way_m / request.speed_mps,
    };
    let walker = Walker::new(walk, around.tick, &mut choices(around.seed, id, 0));
    finish(around, request, Mover::new(size, Motion::Walk(walker)), id, at(from))
}

/// Whether a parked vehicle is on the way from a pose straight ahead.
fn meets_parked(around: &Around, from: &Pose, way_m: f64) -> bool {
    let strip = OrientedBox::new(from.offset(way_m / 2.0, 0.0), way_m, 2.0 * HALF_STRIP_M);
    let parked = around.obstacles().filter(|other| other.verb == Verb::Stand && other.body.is_vehicle());
    parked.into_iter().any(|other| distance_m(&strip, &other.outline) <= 0.0)
}

/// Standing at a pose.
fn at(pose: Pose) -> Moved {
    Moved { pose, forward: pose.forward(), lane_heading_rad: pose.heading_rad, velocity_mps: Vec2::zeros() }
}
