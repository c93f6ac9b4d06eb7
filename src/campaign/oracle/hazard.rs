//! The onset of a hazard: when a collision began to take shape.
//!
//! A moment belongs to the hazard if the obstacle was on the ego vehicle's way or heading for it, or if one of the two visibly did
//! something that the other need not expect:
//! - it was beyond the middle of the road or beside its lane, or came out of its lane sideways;
//! - it was in a junction that it was not allowed to enter: at red, late at yellow, past a stop sign without having stood;
//! - it drove into a junction across the route of the ego vehicle, which goes first there;
//! - it stood or crept in the ego vehicle's way;
//! - a pedestrian, an animal or a moving thing was on the carriageway, or a person waited at a crosswalk.
//!
//! A thing that stands beside the way is no hazard.
//!
//! Take the last uninterrupted series of such moments before the contact. The onset is its first moment at which the obstacle
//! could be seen. So the judgement begins with the first violation or visible intention of either.
//!
//! The way is the one that the ego vehicle took, as wide as the vehicle and the 0.375 m by which careful drivers
//! wander (UN R157, Annex 4, Appendix 3). An obstacle heads for it if at constant velocity it would meet it before
//! the contact. Both compare places alone, not times. A driver may see that two ways cross before it is
//! clear which vehicle will be there first.

use avastra_base::geometry::{OrientedBox, Pose, distance_m};
use avastra_base::kinematics::{
    CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S, GRAVITY_MPS2, STANDING_MPS, WALKING_MPS, WANDER_M, stopping_m,
};
use avastra_drivers::in_sight;
use avastra_lang::model::vocabulary::{Body, Priority};
use avastra_road::{RouteLane, SIGNS_BEFORE_M};
use avastra_world::sim::{Contact, DT_S, FRAME_TICKS, Obstacle, Rule, VehicleParameters, World};

use super::lawful::waits_at_crosswalk;

/// Places of a prediction and of the ego vehicle's way are compared at this many ticks, 0.2 s.
const STRIDE: usize = 2 * FRAME_TICKS as usize;

/// Two beginnings of a hazard, as indices in a recording of the worlds up to the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Onset {
    /// The first violation, visible intention or conflict of ways.
    pub first: usize,
    /// The first conflict of ways. UN R157's models, which know no rules of the road, begin here.
    pub conflict: usize,
}

/// Finds the onset in a recording of the worlds up to the contact with `obstacle`; `None` if the obstacle was never in
/// sight. `met` is the ego vehicle's outline at the contact.
pub fn onset(recording: &[World], obstacle: u32, met: OrientedBox) -> Option<Onset> {
    let mut way: Vec<OrientedBox> = vec![met];
    let mut sensed = recording.last()?.sensed();
    // Backwards in time: whether a moment of the hazard was found, and the earliest at which it was seen.
    let mut began = false;
    let mut first = None;
    // The same for conflicts of ways alone, and whether their uninterrupted time is over.
    let mut conflict_began = false;
    let mut conflict_over = false;
    let mut conflict = None;
    for (index, world) in recording.iter().enumerate().rev() {
        let left = recording.len() - index;
        if left.is_multiple_of(STRIDE) {
            way.push(world.ego_outline());
        }
        if !left.is_multiple_of(FRAME_TICKS as usize) && began {
            continue;
        }
        let Some(other) = world.obstacle(obstacle) else { break };
        let stands = other.velocity_mps.norm() < STANDING_MPS && other.body != Body::Pedestrian;
        let conflicts = !conflict_over
            && (0..=left.div_ceil(STRIDE)).any(|step| {
                let mut then = other.outline;
                then.pose.position += other.velocity_mps * (step * STRIDE) as f64 * DT_S;
                // An obstacle that stands beside the way wanders no more.
                way.iter().any(|ego| near(ego, &then, if stands { 0.0 } else { WANDER_M }))
            });
        if !conflicts && !is_out_of_order(world, other) {
            if began {
                break;
            }
            continue;
        }
        conflict_over |= conflict_began && !conflicts;
        conflict_began |= conflicts;
        began = true;
        world.sense(&mut sensed);
        let seen = sensed.objects.iter().find(|object| object.id == obstacle);
        if seen.is_some_and(|object| in_sight(object, &sensed.conditions)) {
            first = Some(index);
            conflict = if conflicts { first } else { conflict };
        }
    }
    let first = first?;
    // If no conflict of ways was seen, UN R157's models begin at the last moment.
    Some(Onset { first, conflict: conflict.unwrap_or(recording.len() - 1) })
}

/// The station of the line before which the ego vehicle had to wait, m: of a light, of a sign, or the edge of the junction that it
/// is in at the contact. `None` if it had priority, if no rule for junctions decided, or if it has not passed the line.
pub fn waiting_line_m(world: &World, contact: &Contact) -> Option<f64> {
    let at_junction = matches!(
        contact.ruling.rule,
        Rule::Siren
            | Rule::Light
            | Rule::BothLights
            | Rule::StopSign
            | Rule::FirstToStop
            | Rule::Sign
            | Rule::Turning
            | Rule::TurningOff
            | Rule::FromTheRight
            | Rule::SameSide
    );
    if contact.ruling.priority == Priority::Ego || !at_junction {
        return None;
    }
    let (route, map) = (&world.scene().route, &world.scene().map);
    let front_m = VehicleParameters::MKZ.front_m(world.ego_station_m());
    let is_inside = |part: &&RouteLane| map.lane(part.lane).junction.is_some();
    let mut before = route.lanes.iter().rev().skip_while(|part| part.from_m > front_m).peekable();
    // The bumper may already look out of the junction.
    while before.next_if(|part| !is_inside(part)).is_some() {}
    let entry = before.take_while(is_inside).last()?;
    let lights = route.stop_lines.iter().map(|line| line.station_m);
    let signs = route.sign_lines.iter().map(|line| line.station_m);
    let near = |line_m: &f64| (entry.from_m - SIGNS_BEFORE_M..=entry.from_m + 1.0).contains(line_m);
    let line_m = lights.chain(signs).filter(near).fold(f64::NEG_INFINITY, f64::max);
    let line_m = if line_m.is_finite() { line_m } else { entry.from_m };
    (line_m < front_m).then_some(line_m)
}

/// Index of the last moment at which a careful driver could still stop. It had to stop before the line at which the ego vehicle
/// had to wait ([`waiting_line_m`]). Without such a line, it had to stop before the place of a collision in which it had to give
/// way. If the obstacle came into sight later, index of that moment. The ego vehicle's violation begins there, though it may not be in the junction
/// yet. `None` if it did not have to give way, or the obstacle was not in sight.
pub fn last_chance(recording: &[World], contact: &Contact, met: OrientedBox) -> Option<usize> {
    let last = recording.last()?;
    let line_m = waiting_line_m(last, contact);
    if contact.ruling.priority != Priority::Other && line_m.is_none() {
        return None;
    }
    let mut sensed = last.sensed();
    // To the line it is as much less as the front is beyond it at the contact.
    let front_m = VehicleParameters::MKZ.front_m(last.ego_station_m());
    let beyond_m = line_m.map_or(0.0, |line_m| front_m - line_m);
    let (mut way_m, mut next) = (-beyond_m, met.pose.position);
    let mut found = None;
    for (index, world) in recording.iter().enumerate().rev() {
        let here = world.ego_outline().pose.position;
        way_m += (next - here).norm();
        next = here;
        if !(recording.len() - index).is_multiple_of(FRAME_TICKS as usize) {
            continue;
        }
        world.sense(&mut sensed);
        let seen = sensed.objects.iter().find(|object| object.id == contact.obstacle);
        if !seen.is_some_and(|object| in_sight(object, &sensed.conditions)) {
            break;
        }
        found = Some(index);
        let braking_mps2 = CAREFUL_BRAKING_MPS2.min(world.conditions().friction * GRAVITY_MPS2);
        if stopping_m(world.ego().speed_mps, CAREFUL_DELAY_S, braking_mps2) <= way_m {
            break;
        }
    }
    found
}

/// Whether the ego vehicle or the obstacle visibly does something that the other need not expect.
fn is_out_of_order(world: &World, obstacle: &Obstacle) -> bool {
    let map = &world.scene().map;
    if world.is_astray() || world.ego_runs_signal() || map.is_beyond_middle(&world.ego_outline()) {
        return true;
    }
    let outline = &obstacle.outline;
    let speed_mps = obstacle.velocity_mps.norm();
    let stands = speed_mps < STANDING_MPS;
    if speed_mps < WALKING_MPS && world.is_in_the_way(obstacle) {
        return true;
    }
    if obstacle.body.is_vehicle() {
        return obstacle.moves_aside()
            || world.runs_signal(obstacle.id)
            || world.cuts_across_ego(obstacle.id)
            || map.is_beyond_middle(outline);
    }
    let Pose { position, heading_rad } = outline.pose;
    match obstacle.body == Body::Object && stands {
        true => false,
        false => map.nearest(position, heading_rad, 0.0).is_some() || waits_at_crosswalk(world, obstacle),
    }
}

/// Whether two outlines are no farther apart than so.
fn near(ego: &OrientedBox, other: &OrientedBox, apart_m: f64) -> bool {
    let reach_m = ego.radius_m() + other.radius_m() + apart_m;
    let apart = ego.pose.position - other.pose.position;
    apart.norm_squared() <= reach_m * reach_m && distance_m(ego, other) <= apart_m
}
