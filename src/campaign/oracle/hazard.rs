//! The onset of a hazard: when a collision began to take shape.
//! A moment belongs to the hazard if the obstacle was on the ego vehicle's way or heading for it, or if one of the two
//! visibly did something that the other need not expect: it was beyond the middle of the road or beside its lane, came
//! out of its lane sideways, was in a junction that it had entered at a red light, or was on foot on the carriageway.
//! Take the last uninterrupted series of such moments before the contact: the onset is its first moment at which the
//! obstacle could be seen. So the judgement begins with the first violation or visible intention of either.
//!
//! The way is the one that the ego vehicle took, as wide as the vehicle and the 0.375 m by which careful drivers
//! wander (UN R157, Annex 4, Appendix 3); heading for it means to meet it at constant velocity before the
//! contact. Both compare places alone, not times: a driver may see that two ways cross before it is
//! clear which vehicle will be there first.

use avastra_base::geometry::{OrientedBox, Pose, distance_m};
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S, GRAVITY_MPS2, WANDER_M, stopping_m};
use avastra_drivers::in_sight;
use avastra_lang::model::vocabulary::Priority;
use avastra_world::sim::{Contact, DT_S, FRAME_TICKS, Obstacle, World};

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
        let conflicts = !conflict_over
            && (0..=left.div_ceil(STRIDE)).any(|step| {
                let mut then = other.outline;
                then.pose.position += other.velocity_mps * (step * STRIDE) as f64 * DT_S;
                way.iter().any(|ego| near(ego, &then))
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

/// Index of the last moment at which a careful driver could still stop before the place of a collision in which the ego
/// vehicle had to give way; if the obstacle came into sight later, index of that moment. The ego vehicle's violation begins
/// there, though it may not be in the junction yet. `None` if it did not have to give way, or the obstacle was not in sight.
pub fn last_chance(recording: &[World], contact: &Contact, met: OrientedBox) -> Option<usize> {
    if contact.priority != Priority::Other {
        return None;
    }
    let mut sensed = recording.last()?.sensed();
    let (mut way_m, mut next) = (0.0, met.pose.position);
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
    if world.is_astray() || world.ego_runs_red() || map.is_beyond_middle(&world.ego_outline()) {
        return true;
    }
    let (outline, Pose { position, heading_rad }) = (&obstacle.outline, obstacle.outline.pose);
    if obstacle.body.is_vehicle() {
        obstacle.moves_aside() || world.runs_red(obstacle.id) || map.is_beyond_middle(outline)
    } else {
        map.nearest(position, heading_rad, 0.0).is_some()
    }
}

/// Whether two outlines are no farther apart than drivers wander.
fn near(ego: &OrientedBox, other: &OrientedBox) -> bool {
    let reach_m = ego.radius_m() + other.radius_m() + WANDER_M;
    let apart = ego.pose.position - other.pose.position;
    apart.norm_squared() <= reach_m * reach_m && distance_m(ego, other) <= WANDER_M
}
