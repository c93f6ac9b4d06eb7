//! The onset of a hazard: when a collision began to take shape.
//!
//! The onset is the first moment of the last uninterrupted time before the contact in which the
//! obstacle was on the ego vehicle's way or heading for it, and in which it could be seen. The way is
//! the one that the ego vehicle took, as wide as the vehicle and the 0.375 m by which careful drivers
//! wander (UN R157, Annex 4, Appendix 3); heading is to go on at constant velocity until the time of
//! the contact. Both compare places alone, not times: a driver may see that two ways cross before it is
//! clear which vehicle will be there first.

use crate::ads::in_sight;
use crate::geometry::{OrientedBox, distance_m};
use crate::sim::{DT_S, FRAME_TICKS, World};

/// By how much drivers wander in their lane, m.
const WANDER_M: f64 = 0.375;
/// Places of a prediction and of the ego vehicle's way are compared at this many ticks, 0.2 s.
const STRIDE: usize = 2 * FRAME_TICKS as usize;

/// Index of the onset in a recording of the worlds up to the contact with `obstacle`, `None` if it was
/// never in sight. `met` is the ego vehicle's outline at the contact.
pub fn onset(recording: &[World], obstacle: u32, met: OrientedBox) -> Option<usize> {
    let mut way: Vec<OrientedBox> = vec![met];
    let mut sensed = recording.last()?.sensed();
    // Backwards in time: whether a moment of the hazard was found, and the earliest at which it was seen.
    let mut began = false;
    let mut first = None;
    for (index, world) in recording.iter().enumerate().rev() {
        let left = recording.len() - index;
        if left.is_multiple_of(STRIDE) {
            way.push(world.ego_outline());
        }
        if !left.is_multiple_of(FRAME_TICKS as usize) && began {
            continue;
        }
        let Some(other) = world.obstacle(obstacle) else { break };
        let conflicts = (0..=left.div_ceil(STRIDE)).any(|step| {
            let mut then = other.outline;
            then.pose.position += other.velocity_mps * (step * STRIDE) as f64 * DT_S;
            way.iter().any(|ego| near(ego, &then))
        });
        if !conflicts {
            if began {
                break;
            }
            continue;
        }
        began = true;
        world.sense(&mut sensed);
        let seen = sensed.objects.iter().find(|object| object.id == obstacle);
        if seen.is_some_and(|object| in_sight(object, &sensed.conditions)) {
            first = Some(index);
        }
    }
    first
}

/// Whether two outlines are no farther apart than drivers wander.
fn near(ego: &OrientedBox, other: &OrientedBox) -> bool {
    let reach_m = ego.radius_m() + other.radius_m() + WANDER_M;
    let apart = ego.pose.position - other.pose.position;
    apart.norm_squared() <= reach_m * reach_m && distance_m(ego, other) <= WANDER_M
}
