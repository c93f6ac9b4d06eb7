//! People on foot. A pedestrian who crosses the road goes from kerb to kerb, timed to meet the ego vehicle. It may step
//! out from behind a parked vehicle that appears at the same time.

use core::f64::consts::FRAC_PI_2;

use avastra_base::geometry::{OrientedBox, Pose, Vec2, distance_m, wrap_angle};
use avastra_lang::model::body;
use avastra_lang::model::vocabulary::{Body, Side, Verb};
use avastra_road::{FootWay, Kerb};

use crate::place::asked::{Asked, Newcomers, ROOM_M, ahead_m, finish};
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::{Moved, Obstacle, choices};
use crate::state::pedestrian::{Meeting, Walk, Walker};
use crate::state::road_user::{Motion, Mover, RoadUser};
use crate::state::stroller::Stroller;
use crate::view::around::Around;
use crate::view::sense::visible_fraction;

/// A crosswalk within this distance of the asked place is used, m. Ours.
const CROSSWALK_M: f64 = 5.0;
/// A place with a kerb is looked for along the route up to this far from the asked one, m. Ours.
const MOVED_M_MAX: u32 = 10;
/// How far beside the outermost lane vehicles park, m: less than the 12 inches that most American codes allow.
const PARKED_M: f64 = 0.2;
/// How far before a way over the road a vehicle is parked that hides its beginning, m. Ours.
const BEFORE_M: f64 = 1.0;
/// How far within the outer side of that vehicle people stand, m: their own width. Ours.
const HIDDEN_M: f64 = 0.5;
/// A pedestrian needs a strip without parked vehicles; this is half its width, m.
const HALF_STRIP_M: f64 = 0.5;

/// A way on foot that begins on the asked side.
struct Crossing {
    /// Station of the route where it crosses, m.
    station_m: f64,
    from: Kerb,
    to: Kerb,
}

/// A pedestrian who crosses the whole road, who walks along it, or who stands on it.
pub fn on_foot(asked: &Asked) -> Result<Newcomers, String> {
    let Asked { around, request, .. } = *asked;
    // A thing may lie or stand there: a lost load, a wall.
    if around.scene.is_motorway && request.body != Body::Object {
        return Err("nobody goes on foot on a motorway".into());
    }
    let asked_m = ahead_m(asked)?;
    if request.verb == Verb::Stand {
        let lane = around.scene.route.path.pose_at(asked_m).offset(0.0, request.offset_m());
        // A pedestrian or an animal looks across the road; a thing lies along it.
        let turn_rad = match request.side {
            _ if request.body == Body::Object => 0.0,
            Side::Left => -FRAC_PI_2,
            Side::Right => FRAC_PI_2,
        };
        let pose = Pose { heading_rad: wrap_angle(lane.heading_rad + turn_rad), ..lane };
        return Ok(Newcomers { asked: finish(asked, Motion::Stand, at(pose))?, cover: None });
    }
    if request.verb.walks_along() {
        let is_oncoming = request.verb == Verb::WalkOpposite;
        let stroller = Stroller::new(asked_m, request.offset_m(), is_oncoming, request.speed_mps, around);
        let begins = stroller.begins(around);
        return Ok(Newcomers { asked: finish(asked, Motion::Stroll(stroller), begins)?, cover: None });
    }
    let mut refusal = None;
    for station_m in stations(around, asked_m) {
        let found = crossing(around, request.side, station_m).and_then(|mut way| {
            let cover = request.cover.map(|body| park(asked, body, &mut way)).transpose()?;
            let pedestrian = walk(asked, &way)?;
            if let Some(cover) = &cover {
                check_cover(around, &pedestrian, cover)?;
            }
            Ok(Newcomers { asked: pedestrian, cover })
        });
        match found {
            Ok(newcomers) => return Ok(newcomers),
            // The reason of the first place is what an author wants to know.
            Err(why) => refusal = refusal.or(Some(why)),
        }
    }
    Err(refusal.unwrap_or_else(|| "the route ends before that distance".into()))
}

/// Stations of the route at which to try, the best first. First comes the middle of a crosswalk at the asked place,
/// then the asked place. Then come those farther on, because a rule may ask for a gap, and those nearer.
fn stations(around: &Around, asked_m: f64) -> impl Iterator<Item = f64> {
    let route = &around.scene.route;
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let beyond_m = |(from_m, to_m): &(f64, f64)| (asked_m.clamp(*from_m, *to_m) - asked_m).abs();
    let near = route.crosswalks_m.iter().filter(|span| beyond_m(span) <= CROSSWALK_M);
    let crosswalk =
        near.min_by(|a, b| beyond_m(a).total_cmp(&beyond_m(b))).map(|(a_m, b_m)| (a_m + b_m) / 2.0);
    // Whole metres of the route, so that all draws of a row look at the same places, which the scene keeps.
    let farther = (1..=MOVED_M_MAX).map(move |moved_m| asked_m.floor() + f64::from(moved_m));
    let nearer = (1..=MOVED_M_MAX).map(move |moved_m| asked_m.ceil() - f64::from(moved_m));
    let ends_m = front_m..=route.path.length_m();
    crosswalk
        .into_iter()
        .chain([asked_m])
        .chain(farther)
        .chain(nearer)
        .filter(move |station_m| ends_m.contains(station_m))
}

/// The way over the road at a station of the route.
fn crossing(around: &Around, side: Side, station_m: f64) -> Result<Crossing, String> {
    let FootWay { left, right } = around.scene.foot_way(station_m)?;
    let (from, to) = if side == Side::Left { (left, right) } else { (right, left) };
    Ok(Crossing { station_m, from, to })
}

/// A pedestrian at the beginning of a way, if there is room.
fn walk(asked: &Asked, way: &Crossing) -> Result<RoadUser, String> {
    let Asked { around, arrivals, request, id, .. } = *asked;
    let straight = way.to.place - way.from.place;
    let from = Pose { position: way.from.place, heading_rad: libm::atan2(straight.y, straight.x) };
    let way_m = way.from.way_m + way.to.way_m;
    if meets_parked(around, &from, way_m + way.to.beyond_m) {
        return Err("a parked vehicle stands in the way".into());
    }
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let meeting = request.told.meet().map(|part| Meeting {
        // The near side of its body.
        station_m: way.station_m - asked.size.width_m / 2.0,
        way_m: way.from.way_m + (part - 0.5) * VehicleParameters::MKZ.width_m,
        comes_from_left: request.side == Side::Left,
    });
    if meeting.is_some_and(|meeting| meeting.left_s(request.speed_mps, around) < 0.0) {
        return Err("it would come too late to meet the ego vehicle there".into());
    }
    let walk = Walk {
        meeting,
        waits_s: request.told.waits_s(),
        from,
        way_m,
        beyond_m: way.to.beyond_m,
        speed_mps: request.speed_mps,
        // The impact is at half the width, as in Euro NCAP's tests: the pedestrian is in the middle of the ego
        // vehicle's way when that vehicle's front arrives.
        meets_s: arrivals.after_s(around, way.station_m - front_m) - way.from.way_m / request.speed_mps,
    };
    let walker = Walker::new(walk, around.tick, &mut choices(around.seed, id, 0));
    finish(asked, Motion::Walk(walker), at(from))
}

/// A vehicle that is parked beside the outermost lane, before a way over the road as the ego vehicle comes. The way
/// then begins beside its front or rear, behind its outer half, where it hides whoever stands there.
fn park(asked: &Asked, body: Body, way: &mut Crossing) -> Result<RoadUser, String> {
    let Asked { around, request, id, .. } = *asked;
    let size = request.cover_own.map_or_else(|| body::parameters(body), |own| own.shape);
    let (map, path) = (&around.scene.map, &around.scene.route.path);
    let inner_m = way.from.edge_m + PARKED_M;
    let station_m = way.station_m - BEFORE_M - size.length_m / 2.0;
    if station_m < 0.0 {
        return Err("there is no room to park".into());
    }
    let here = path.pose_at(station_m);
    let outward = if request.side == Side::Left { here.left() } else { -here.left() };
    let position = here.position + outward * (inner_m + size.width_m / 2.0);
    // It stands in the direction of the lane beside it.
    let beside = here.position + outward * (way.from.edge_m - PARKED_M);
    let lane = map.nearest(beside, here.heading_rad, 1.0).ok_or("there is no room to park")?;
    let heading_rad = map.lane(lane.lane).centre.pose_at(lane.station_m).heading_rad;
    let pose = Pose { position, heading_rad };
    let outline = OrientedBox::new(pose, size.length_m, size.width_m);
    if !map.is_free_to_park(&outline) {
        return Err("there is no room to park".into());
    }
    let in_the_way = |(walking, walker): (&Obstacle, &Walker)| {
        distance_m(&walker.strip(&walking.outline), &outline) < HALF_STRIP_M
    };
    if around.walkers().any(in_the_way) {
        return Err("a pedestrian would walk into the parked vehicle".into());
    }
    let way_m = inner_m + size.width_m - HIDDEN_M;
    let outward = (way.from.place - way.to.place).normalize();
    way.from.place += outward * (way_m - way.from.way_m);
    way.from.way_m = way_m;
    if map.lane_room_m(way.from.place) < HIDDEN_M || map.is_solid(way.from.place, HIDDEN_M) {
        return Err("there is no room at the kerb".into());
    }
    let mover = Mover::new(size, Motion::Stand);
    let parked = RoadUser::new(around, id + 1, body, request.colour, Verb::Stand, mover, at(pose));
    if parked.has_room(around, ROOM_M) { Ok(parked) } else { Err("another road user is there".into()) }
}

/// Refuses a place at which a cover stands in the pedestrian's way, as it may in a bend. Also refuses a cover that does
/// not hide the pedestrian; the part above its roof does not count.
fn check_cover(around: &Around, pedestrian: &RoadUser, cover: &RoadUser) -> Result<(), String> {
    if let Motion::Walk(walker) = &pedestrian.mover.motion
        && distance_m(&walker.strip(&pedestrian.obstacle.outline), &cover.obstacle.outline) < HALF_STRIP_M
    {
        return Err("there is no room to park".into());
    }
    let eye = around.ego_outline.pose.position;
    let above = (1.0 - cover.obstacle.height_m / pedestrian.obstacle.height_m).max(0.0);
    let seen = visible_fraction(eye, &pedestrian.obstacle, core::iter::once(&cover.obstacle));
    if seen > above + 1e-9 { Err("the parked vehicle would not hide the pedestrian".into()) } else { Ok(()) }
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
