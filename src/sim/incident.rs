//! Contacts among obstacles. Both obstacles stop where they touch, and leave later.
//!
//! Obstacles move one after another, each among the others as they stand at that moment. So no two can
//! come to overlap, whatever the size of a step. Contacts with the ego vehicle are in `contact`.

use crate::geometry::{FirstContact, Frame, Pose, Sweep, Vec2, first_contact, wrap_angle};

use super::road_user::RoadUser;
use super::world::DT_S;

/// Obstacles whose gap after a tick is at least this are not checked for contact, m: far more than
/// rounding.
const CLOSE_M: f64 = 1e-3;

/// Two obstacles touched each other. Both stand where it happened, and leave 2 s later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incident {
    /// Since the episode began, s.
    pub time_s: f64,
    /// Id of the obstacle that moved into the other.
    pub obstacle: u32,
    pub other: u32,
    /// Where they met, in the world, m.
    pub point: Vec2,
}

/// A motion that ends at another obstacle.
pub(super) struct Bump {
    /// Index of that obstacle.
    pub other: usize,
    /// Where the motion ends.
    pub pose: Pose,
    pub incident: Incident,
}

/// The first obstacle in the way when the obstacle at `index` moves to `end`, in the tick after `tick`.
pub(super) fn bump(users: &[RoadUser], index: usize, end: &Pose, tick: u64) -> Option<Bump> {
    let this = &users[index].obstacle;
    let outline = &this.outline;
    let way = end.position - outline.pose.position;
    if way == Vec2::zeros() && end.heading_rad == outline.pose.heading_rad {
        return None;
    }
    let sweep = Sweep { start: *outline, end: *end };
    let own = Frame::along(outline, this.forward);
    // No corner moves farther than `most_m`.
    let radius_m = outline.half_length_m + outline.half_width_m;
    let turn_rad = wrap_angle(end.heading_rad - outline.pose.heading_rad);
    let most_m = way.norm() + turn_rad.abs() * radius_m;
    let reach_m = radius_m + most_m;
    let mut first: Option<(usize, FirstContact)> = None;
    for (other, RoadUser { obstacle, .. }) in users.iter().enumerate() {
        let near_m = reach_m + obstacle.outline.half_length_m + obstacle.outline.half_width_m;
        let away = obstacle.outline.pose.position - outline.pose.position;
        if other == index || away.x.abs() > near_m || away.y.abs() > near_m {
            continue;
        }
        if own.is_apart(&Frame::along(&obstacle.outline, obstacle.forward), most_m + CLOSE_M) {
            continue;
        }
        let still = Sweep { start: obstacle.outline, end: obstacle.outline.pose };
        if let Some(contact) = first_contact(&sweep, &still)
            && first.is_none_or(|(_, found)| contact.fraction < found.fraction)
        {
            first = Some((other, contact));
        }
    }
    let (other, contact) = first?;
    let incident = Incident {
        time_s: (tick as f64 + contact.fraction) * DT_S,
        obstacle: this.id,
        other: users[other].obstacle.id,
        point: contact.point,
    };
    Some(Bump { other, pose: sweep.at(contact.fraction).pose, incident })
}
