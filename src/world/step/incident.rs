//! Contacts among obstacles: where a motion ends at another obstacle, and what the impact does to both.
//!
//! Obstacles move one after another, each among the others as they stand at that moment. So no two can come to overlap,
//! whatever the size of a step. The impact is plastic. Across the gap that closed, both go on at the common speed that
//! their momentum gives; along it each keeps its own. Then both slide straight on with locked wheels until friction
//! stops them (`road_user`). Turning by the impact, bounce and damage are left out. Contacts with the ego vehicle are
//! in `contact`.

use avastra_base::geometry::{FirstContact, Frame, Pose, Sweep, Vec2, first_contact, wrap_angle};

use avastra_road::is_apart;

use crate::state::contact::Incident;
use crate::state::road_user::{RoadUser, Room};
use crate::state::time::DT_S;

/// Obstacles whose gap after a tick is at least this are not checked for contact, m: far more than
/// rounding.
pub const CLOSE_M: f64 = 1e-3;

/// A motion that ends at another obstacle.
#[derive(Debug, PartialEq)]
pub struct Bump {
    /// Index of that obstacle.
    pub other: usize,
    /// Where the motion ends.
    pub pose: Pose,
    /// Unit vector towards the other across the gap that closed; zero if they touched already.
    pub normal: Vec2,
    pub incident: Incident,
}

/// The first obstacle in the way when the obstacle at `index` moves to `end`, in the tick after `tick`. It looks at the road users
/// whose bit is set in `near`, and at all that have none.
pub fn bump(users: &[RoadUser], index: usize, near: u64, end: &Pose, tick: u64) -> Option<Bump> {
    let this = &users[index].obstacle;
    let outline = &this.outline;
    let way = end.position - outline.pose.position;
    if way == Vec2::zeros() && end.heading_rad == outline.pose.heading_rad {
        return None;
    }
    let sweep = Sweep { start: *outline, end: *end };
    // No corner moves farther than `most_m`.
    let radius_m = outline.half_length_m + outline.half_width_m;
    let turn_rad = wrap_angle(end.heading_rad - outline.pose.heading_rad);
    let most_m = way.norm() + turn_rad.abs() * radius_m;
    let reach_m = radius_m + most_m;
    let mut first: Option<(usize, FirstContact)> = None;
    let mut rest = near;
    let listed = core::iter::from_fn(|| {
        let other = rest.trailing_zeros() as usize;
        rest &= rest.wrapping_sub(1);
        (other < users.len().min(Room::LISTED)).then_some(other)
    });
    for other in listed.chain(Room::LISTED..users.len()) {
        let RoadUser { obstacle, .. } = &users[other];
        let near_m = reach_m + obstacle.outline.half_length_m + obstacle.outline.half_width_m;
        let away = obstacle.outline.pose.position - outline.pose.position;
        let is_far = away.x.abs() > near_m || away.y.abs() > near_m;
        if other == index || is_far || is_apart(this.elevation_m, obstacle.elevation_m) {
            continue;
        }
        let (own, its) =
            (Frame::along(outline, this.forward), Frame::along(&obstacle.outline, obstacle.forward));
        if own.is_apart(&its, most_m + CLOSE_M) {
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
    Some(Bump { other, pose: sweep.at(contact.fraction).pose, normal: contact.normal, incident })
}

/// Velocities of two masses after a plastic impact across the unit vector `normal`, m/s; unchanged if the gap
/// does not close.
pub fn impact(normal: Vec2, first: (f64, Vec2), second: (f64, Vec2)) -> (Vec2, Vec2) {
    let closing_mps = (first.1 - second.1).dot(&normal).max(0.0);
    exchange(normal, closing_mps, first, second)
}

/// As [`impact`], with the speed at which the gap closes. If bodies turn, that is the speed of the points that meet.
pub fn exchange(normal: Vec2, closing_mps: f64, first: (f64, Vec2), second: (f64, Vec2)) -> (Vec2, Vec2) {
    let ((first_t, first_mps), (second_t, second_mps)) = (first, second);
    let lost_mps = closing_mps * second_t / (first_t + second_t);
    (first_mps - normal * lost_mps, second_mps + normal * (closing_mps - lost_mps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn momentum_is_kept_and_the_gap_no_longer_closes() {
        let normal = Vec2::new(0.6, 0.8);
        for (first, second) in [
            ((1.55, Vec2::new(12.0, 1.0)), (11.0, Vec2::new(-3.0, 4.0))),
            ((6.0, Vec2::new(3.0, 9.0)), (0.075, Vec2::zeros())),
        ] {
            let (a, b) = impact(normal, first, second);
            let before = first.1 * first.0 + second.1 * second.0;
            assert!((a * first.0 + b * second.0 - before).norm() < 1e-12);
            assert!((a - b).dot(&normal).abs() < 1e-12);
            // Along the gap nothing changes.
            assert!((a - first.1).perp(&normal).abs() < 1e-12 && (b - second.1).perp(&normal).abs() < 1e-12);
        }
        let (behind, ahead) = ((2.0, Vec2::zeros()), (2.0, normal));
        assert_eq!(impact(normal, behind, ahead), (behind.1, ahead.1), "the gap opens");
    }
}
