//! Does a road user do what its verb says? Criteria over what is seen of it.
//!
//! Inside junctions lanes lie over each other, so directions are judged on streets alone.
//!
//! All geometry is taken from the map and the outlines, none from the drivers' plans. A vehicle that
//! does its verb stays throughout on lanes that run its way; beyond that:
//!
//! | verb | realised if |
//! |---|---|
//! | drive ahead | it appears ahead at the asked gap, in the asked lane, heading along it, and moves; if it is asked to stand, it does not move at all |
//! | drive behind | it appears behind the ego vehicle and moves, as drive ahead |
//! | overtake | it appears behind the ego vehicle and gets wholly in front of it |
//! | drive opposite | it appears in a lane that runs against the route, and passes the ego vehicle head-on |
//! | cross road | it appears on a lane that is not of the route and comes onto the route's path before the ego vehicle has passed there; if it is asked to stand, it does not move at all |
//! | walk | it appears beside the route on the asked side and walks over the route's path |
//! | walk ahead, walk opposite | it appears beside the route where it was asked to, and walks along it that way |
//! | stand | it stands on the route's path, or beside it where it was asked to |
//!
//! It crashes into no road user but the ego vehicle. A road user that is told to be at a place `early` is there within 0.5 s
//! of that moment, if the ego vehicle keeps its speed until then.
//!
//! An ordered road user reaches the speed, the lane and the place that it was told, or does all phases of its manoeuvre.
//!
//! A vehicle with a manoeuvre does all of its phases; these say where it drives. Without a manoeuvre,
//! a vehicle that is to keep its lane does not change it; a vehicle that is to change it does so once.
//! An overtaker in the ego vehicle's own lane changes it once to get past, and comes back. It must come back if it is to
//! change, and may when it is well ahead otherwise. Changes inside junctions, where lanes lie over each other, are not
//! counted.

use avastra_base::geometry::wrap_angle;
use avastra_lang::model::vocabulary::{LaneChoice, Side, Then, Verb};
use avastra_road::{LaneIndex, RoadMap};
use avastra_world::action::SpawnRequest;
use avastra_world::sim::{PhaseCount, Scene, VehicleParameters};

use crate::trial::sighting::{Ending, Frame, Sighting};

/// A vehicle has this long to do what its verb says: four observation periods, s.
const HORIZON_S: f64 = 24.0;
/// It has this long for all phases of a manoeuvre, s. Ours.
const MANOEUVRE_S: f64 = 60.0;
/// A vehicle whose centre is farther than this outside its lane has left the road, m: half of what a bus needs in a
/// tight turn.
const BESIDE_ROAD_M: f64 = 0.5;
/// A vehicle that has driven this far counts as moving, m.
const MOVES_M: f64 = 5.0;
/// The gap at which a road user appears may differ from the asked one by this, m, plus this part of it: stations on
/// parallel lanes of a bend differ.
const GAP_M: f64 = 1.0;
const GAP_PART: f64 = 0.1;
/// Lanes beside the route have their centre at least this far from its path, m.
const BESIDE_M: f64 = 1.5;
/// A vehicle at more than this angle to the route comes the other way, rad.
const OPPOSES_RAD: f64 = 3.0 * core::f64::consts::FRAC_PI_4;
/// An oncoming vehicle that passes farther aside than this does not meet the ego vehicle, m.
const MEETS_M: f64 = 12.0;

/// A road user that misses the moment of an `early` by more than this fails the trial, s. Ours.
const LATE_S: f64 = 0.5;

/// How long a vehicle is watched, s.
pub(super) fn horizon_s(has_manoeuvre: bool) -> f64 {
    if has_manoeuvre { MANOEUVRE_S } else { HORIZON_S }
}

/// Whether it did what an order says: its phases, or all that it was told.
pub(super) fn obeys(has_phases: bool, seen: &Sighting) -> Result<(), String> {
    match has_phases {
        true => does_phases(seen),
        false if seen.has_done => Ok(()),
        false => Err(ended(seen, "it had done what it was told")),
    }
}

fn does_phases(seen: &Sighting) -> Result<(), String> {
    let PhaseCount { begun, ended: over, all: phases } = seen.phases;
    match () {
        () if over == phases || begun == phases && seen.ending == Ending::TouchedEgo => Ok(()),
        () if begun > over => Err(ended(seen, &format!("phase {begun} of {phases} had ended"))),
        () => Err(ended(seen, &format!("phase {} of {phases} had begun", begun + 1))),
    }
}

/// Whether it kept clear of all but the ego vehicle, and was in time where it was to be `early`.
pub(super) fn keeps_clear_and_time(seen: &Sighting) -> Result<(), String> {
    if seen.ending == Ending::TouchedOther {
        let after_s = seen.frames[seen.frames.len() - 1].after_s;
        return Err(format!("it and another road user crash into each other after {after_s:.1} s"));
    }
    match seen.late_s {
        Some(late_s) if late_s.abs() > LATE_S => {
            let how = if late_s > 0.0 { "late" } else { "soon" };
            Err(format!("it is {:.1} s too {how} where it is to be `early`", late_s.abs()))
        }
        Some(_) | None => Ok(()),
    }
}

/// Whether it appeared where it was asked to; what it does from then on is told otherwise.
pub(super) fn appears(scene: &Scene, request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    match request.verb {
        Verb::DriveAhead => appears_ahead(scene, request, &seen.frames[0]),
        Verb::DriveBehind
        | Verb::Overtake
        | Verb::DriveOpposite
        | Verb::CrossRoad
        | Verb::Walk
        | Verb::Stand
        | Verb::WalkAhead
        | Verb::WalkOpposite
        // The world places it where its trajectory says.
        | Verb::Follow => Ok(()),
    }
}

/// Whether it did what its verb says, or the phases of its manoeuvre, if it has one; if not, what was wrong, in words.
pub(super) fn verdict(
    scene: &Scene,
    request: &SpawnRequest,
    has_phases: bool,
    seen: &Sighting,
) -> Result<(), String> {
    let first = &seen.frames[0];
    if has_phases {
        appears(scene, request, seen)?;
        return does_phases(seen);
    }
    // A road user with a lateral offset in its lane may be beside the road, or on the other side of it.
    let told_aside = request.offset_m() != 0.0;
    let drives = || match told_aside {
        true => Ok(()),
        false => seen.frames.iter().try_for_each(|frame| stays_on_road(scene, frame)),
    };
    let asked = usize::from(request.then == Then::Change);
    match request.verb {
        Verb::Walk => walks(request, seen),
        Verb::Stand => stands(request, seen),
        Verb::WalkAhead | Verb::WalkOpposite => walks_along(request, seen),
        Verb::Follow => follows(request, seen),
        Verb::DriveAhead => {
            drives()?;
            appears_ahead(scene, request, first)?;
            if request.told.turn().is_some() {
                return has_turned(scene, seen);
            }
            moves(request, seen)?;
            changes(&scene.map, request, seen, [asked, asked], 0)
        }
        Verb::DriveBehind => {
            drives()?;
            if ahead_m(first) > 0.0 {
                return Err("it does not appear behind the ego vehicle".to_owned());
            }
            if request.told.turn().is_some() {
                return has_turned(scene, seen);
            }
            moves(request, seen)?;
            changes(&scene.map, request, seen, [asked, asked], 0)
        }
        Verb::Overtake => {
            drives()?;
            if ahead_m(first) > 0.0 {
                return Err("it does not appear behind the ego vehicle".to_owned());
            }
            if request.told.turn().is_some() {
                return has_turned(scene, seen);
            }
            let Some(passed) = seen.frames.iter().position(|frame| ahead_m(frame) > 0.0) else {
                return Err(ended(seen, "it had passed"));
            };
            let out = usize::from(request.lane == LaneChoice::Current);
            let after = if asked > 0 { passed } else { 0 };
            changes(&scene.map, request, seen, [out + asked, out + out.max(asked)], after)
        }
        Verb::DriveOpposite => {
            drives()?;
            if turned_rad(first) < OPPOSES_RAD {
                return Err("it does not appear against the direction of the route".to_owned());
            }
            if request.told.turn().is_some() {
                return has_turned(scene, seen);
            }
            meets(seen)?;
            changes(&scene.map, request, seen, [asked, asked], 0)
        }
        Verb::CrossRoad => {
            drives()?;
            if let Some((lane, _)) = first.lane
                && scene.route.lanes.iter().any(|part| part.lane == lane)
            {
                return Err("it appears on the route itself".to_owned());
            }
            if request.speed_mps == 0.0 {
                return moves(request, seen);
            }
            let crossing = crosses(request, seen)?;
            let until = Sighting { frames: seen.frames[..=crossing].to_vec(), ..*seen };
            changes(&scene.map, request, &until, [asked, asked], 0)
        }
    }
}

/// Every vehicle drives in lanes that run its way: not beside the road, not on a median.
fn stays_on_road(scene: &Scene, frame: &Frame) -> Result<(), String> {
    let Some((lane, beyond_m)) = frame.lane else {
        return Err(format!("it drives beside the road after {:.1} s", frame.after_s));
    };
    if beyond_m > BESIDE_ROAD_M {
        return Err(format!("it drives {beyond_m:.1} m beside its lane after {:.1} s", frame.after_s));
    }
    let lane = scene.map.lane(lane);
    // A turning vehicle may leave the surface of its lane in a junction and be over another lane alone.
    if lane.junction.is_some() {
        return Ok(());
    }
    let centre = &lane.centre;
    let station_m = centre.project(frame.outline.pose.position).station_m;
    let turn_rad = wrap_angle(frame.outline.pose.heading_rad - centre.pose_at(station_m).heading_rad).abs();
    if turn_rad > core::f64::consts::FRAC_PI_2 {
        return Err(format!("it drives against its lane after {:.1} s", frame.after_s));
    }
    Ok(())
}

fn appears_ahead(scene: &Scene, request: &SpawnRequest, first: &Frame) -> Result<(), String> {
    let front_m = VehicleParameters::MKZ.front_m(first.ego_station_m);
    let gap_m = first.route_station_m - first.outline.half_length_m - front_m;
    if (gap_m - request.distance_m).abs() > GAP_M + GAP_PART * request.distance_m.abs() {
        return Err(format!("it appears {gap_m:.1} m ahead instead of {:.1} m", request.distance_m));
    }
    if turned_rad(first) > core::f64::consts::FRAC_PI_2 {
        return Err("it appears against the direction of the route".to_owned());
    }
    // Where the route changes its lane, others of a row stay in the lane of the first one.
    if request.first_m.is_some() {
        return Ok(());
    }
    let own = scene.map.lane(scene.route.lane_at(first.route_station_m).lane);
    let aside_m = own.centre.project(first.outline.pose.position).offset_m;
    let aside_m = aside_m - request.offset_m();
    let is_there = match request.lane {
        LaneChoice::Left => aside_m > BESIDE_M,
        LaneChoice::Current => aside_m.abs() < BESIDE_M,
        LaneChoice::Right => aside_m < -BESIDE_M,
    };
    if is_there { Ok(()) } else { Err(format!("it appears {aside_m:.1} m beside the route's lane")) }
}

/// Whether it drives, or stands if it was asked to.
fn moves(request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    let (first, last) = (&seen.frames[0], &seen.frames[seen.frames.len() - 1]);
    let way_m = (last.outline.pose.position - first.outline.pose.position).norm();
    if request.speed_mps == 0.0 && way_m > 0.0 && seen.ending != Ending::TouchedEgo {
        return Err("it does not stand".to_owned());
    }
    // A vehicle that crawls need only do half of the way that its speed allows.
    if way_m < MOVES_M.min(request.speed_mps * HORIZON_S / 2.0) {
        return Err(ended(seen, "it had moved"));
    }
    Ok(())
}

/// Whether who follows a trajectory stands or goes on, as it was asked to. How far, the trajectory says.
fn follows(request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    let (first, last) = (&seen.frames[0], &seen.frames[seen.frames.len() - 1]);
    let has_moved = last.outline.pose.position != first.outline.pose.position;
    match (request.speed_mps > 0.0, has_moved) {
        (true, false) => Err(ended(seen, "it had moved")),
        (false, true) if seen.ending != Ending::TouchedEgo => Err("it does not stand".to_owned()),
        _ => Ok(()),
    }
}

/// By how much its rear is in front of the ego vehicle's front, m; negative while it is not.
fn ahead_m(frame: &Frame) -> f64 {
    let there = frame.ego.pose.to_local(frame.outline.pose.position);
    there.x - frame.outline.half_length_m - frame.ego.half_length_m
}

/// The angle between its heading and the route's beside it, rad, not negative.
fn turned_rad(frame: &Frame) -> f64 {
    wrap_angle(frame.outline.pose.heading_rad - frame.route_heading_rad).abs()
}

fn meets(seen: &Sighting) -> Result<(), String> {
    if seen.ending == Ending::TouchedEgo {
        return Ok(());
    }
    let there = |frame: &Frame| frame.ego.pose.to_local(frame.outline.pose.position);
    let passes = |pair: &&[Frame]| there(&pair[0]).x >= 0.0 && there(&pair[1]).x < 0.0;
    let Some(pair) = seen.frames.windows(2).find(passes) else {
        return Err(ended(seen, "it had met the ego vehicle"));
    };
    let aside_m = there(&pair[1]).y.abs();
    if aside_m > MEETS_M { Err(format!("it passes {aside_m:.1} m aside")) } else { Ok(()) }
}

/// Whether the junction at which it was asked to turn is behind it, or it met the ego vehicle there.
fn has_turned(scene: &Scene, seen: &Sighting) -> Result<(), String> {
    let last = seen.frames[seen.frames.len() - 1].lane;
    let is_there = last.is_some_and(|(lane, _)| scene.map.lane(lane).junction.is_some());
    let is_done = seen.has_done || seen.ending == Ending::TouchedEgo && is_there;
    if is_done { Ok(()) } else { Err(ended(seen, "it had turned")) }
}

/// The frame in which it is on the route's path.
fn crosses(request: &SpawnRequest, seen: &Sighting) -> Result<usize, String> {
    let on_path = |frame: &Frame| {
        let turn_rad = turned_rad(frame);
        let reach_m = frame.outline.half_length_m * libm::sin(turn_rad).abs()
            + frame.outline.half_width_m * libm::cos(turn_rad).abs();
        frame.route_offset_m.abs() <= reach_m + frame.ego.half_width_m
    };
    let Some(index) = seen.frames.iter().position(on_path) else {
        // An ego vehicle in a turn may be beside the path itself; a contact with it counts as a meeting all the
        // same.
        if seen.ending == Ending::TouchedEgo {
            return Ok(seen.frames.len() - 1);
        }
        return Err(ended(seen, "it had come onto the route"));
    };
    let frame = &seen.frames[index];
    // Unless it is to come after the ego vehicle.
    let comes_after = request.told.early_s().is_some_and(|early_s| early_s < 0.0);
    if !comes_after && frame.route_station_m < VehicleParameters::MKZ.rear_m(frame.ego_station_m) {
        return Err("it came when the ego vehicle had passed".to_owned());
    }
    Ok(index)
}

fn walks(request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    let side = |offset_m: f64| if request.side == Side::Left { offset_m } else { -offset_m };
    if side(seen.frames[0].route_offset_m) <= seen.frames[0].ego.half_width_m {
        return Err("it does not appear on the asked side of the route".to_owned());
    }
    let last = &seen.frames[seen.frames.len() - 1];
    let hit = seen.ending == Ending::TouchedEgo && last.route_offset_m.abs() < last.ego.half_width_m + 1.0;
    if hit || seen.frames.iter().any(|frame| side(frame.route_offset_m) < 0.0) {
        return Ok(());
    }
    Err(ended(seen, "it had walked over the route"))
}

fn walks_along(request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    let first = &seen.frames[0];
    if (first.route_offset_m - request.offset_m()).abs() > BESIDE_M {
        return Err("it does not appear where it was asked to beside the route".to_owned());
    }
    let last = &seen.frames[seen.frames.len() - 1];
    let forth_m = last.route_station_m - first.route_station_m;
    let way_m = if request.verb == Verb::WalkOpposite { -forth_m } else { forth_m };
    let wanted_m = MOVES_M.min(request.speed_mps * HORIZON_S / 2.0);
    let is_done = way_m >= wanted_m || seen.ending == Ending::TouchedEgo;
    if is_done { Ok(()) } else { Err(ended(seen, "it had walked on")) }
}

fn stands(request: &SpawnRequest, seen: &Sighting) -> Result<(), String> {
    let first = &seen.frames[0];
    let stands = seen.frames.iter().all(|frame| frame.velocity_mps.norm() == 0.0);
    let is_there = (first.route_offset_m - request.offset_m()).abs() < first.ego.half_width_m;
    if stands && is_there { Ok(()) } else { Err("it does not stand where it was asked to".to_owned()) }
}

/// Checks that it changed its lane at least as often as asked, the last time after frame `after`, and at most `at_most` times
/// if it is to keep its lane.
fn changes(
    map: &RoadMap,
    request: &SpawnRequest,
    seen: &Sighting,
    [asked, at_most]: [usize; 2],
    after: usize,
) -> Result<(), String> {
    let found = lane_changes(map, &seen.frames);
    if found.len() < asked {
        let what = if found.is_empty() { "it had changed its lane" } else { "it had changed its lane back" };
        return Err(ended(seen, what));
    }
    if request.then == Then::Keep && found.len() > at_most {
        return Err("it changed its lane".to_owned());
    }
    match found.last() {
        Some(&last) if asked > 0 && last < after => Err("it changed its lane before it was ahead".to_owned()),
        _ => Ok(()),
    }
}

/// Indices of the frames in which it is in another lane of the street than one frame before.
fn lane_changes(map: &RoadMap, frames: &[Frame]) -> Vec<usize> {
    let lane = |index: usize| frames[index].lane.map(|(lane, _)| lane);
    let beside = |a: LaneIndex, b: LaneIndex| {
        let (from, to) = (map.lane(a), map.lane(b));
        let neighbours = |lane: LaneIndex| {
            let lane = map.lane(lane);
            [lane.left, lane.right].into_iter().flatten().any(|neighbour| neighbour.lane == b)
        };
        let streets = from.junction.is_none() && to.junction.is_none();
        streets && (neighbours(a) || from.successors.iter().any(|next| neighbours(*next)))
    };
    (1..frames.len())
        .filter(|&index| match (lane(index - 1), lane(index)) {
            (Some(a), Some(b)) => a != b && !map.lane(a).successors.contains(&b) && beside(a, b),
            _ => false,
        })
        .collect()
}

/// The complaint that `what` had not happened when the sighting ended.
fn ended(seen: &Sighting, what: &str) -> String {
    match seen.ending {
        Ending::TimeOver => {
            let last_s = seen.frames[seen.frames.len() - 1].after_s;
            format!("{last_s:.0} s were over before {what}")
        }
        Ending::Arrived => format!("the ego vehicle was at its goal before {what}"),
        Ending::TouchedEgo => format!("it touched the ego vehicle before {what}"),
        Ending::TouchedOther => format!("it touched another road user before {what}"),
        Ending::Left => format!("it left before {what}"),
    }
}
