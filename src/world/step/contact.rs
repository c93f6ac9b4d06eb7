//! Contacts of the ego vehicle with obstacles, and what they do to it.
//!
//! Outlines are swept from tick to tick, so nothing passes through anything. The impact is plastic and acts across the
//! gap that closed, as among obstacles (`incident`). The bodies change their velocities as `oracle::severity` says, as
//! far as a car can. No body is pushed backwards or sideways or turned, and a person that was hit stays in place.

use avastra_base::geometry::{FirstContact, Sweep, Vec2, first_contact};

use crate::state::contact::Contact;
use crate::state::ruling::Ruling;
use crate::state::time::DT_S;

/// A vehicle that turns faster turns at a corner of its trajectory, rad/s. Ours: one that skids turns at 2 to 3 rad/s.
const SPIN_RADPS_MAX: f64 = 5.0;

/// One party of a possible contact during one tick.
#[derive(Debug, Clone, Copy)]
pub struct Party {
    pub sweep: Sweep,
    pub velocity_mps: Vec2,
}

impl Party {
    /// Velocity of its point that touches, m per tick. To turn at a corner at once is no motion.
    fn rate_m(&self, first: &FirstContact) -> Vec2 {
        match self.sweep.turn_rad().abs() <= SPIN_RADPS_MAX * DT_S {
            true => self.sweep.rate_m(first.fraction, first.point),
            false => self.velocity_mps * DT_S,
        }
    }
}

/// The contact that begins within the tick after `tick`, if there is one. Also the unit vector from the ego vehicle to
/// the obstacle across the gap that closed; a zero vector if they touched already.
pub fn meet(
    ego: &Party,
    ego_speed_mps: f64,
    obstacle: &Party,
    id: u32,
    tick: u64,
) -> Option<(Contact, Vec2)> {
    let first = first_contact(&ego.sweep, &obstacle.sweep)?;
    let ego_pose = ego.sweep.at(first.fraction).pose;
    // The velocities of the points that meet, not of the centres: a corner that swings out closes a gap, too.
    let closing_mps = (ego.rate_m(&first) - obstacle.rate_m(&first)).dot(&first.normal) / DT_S;
    let contact = Contact {
        time_s: (tick as f64 + first.fraction) * DT_S,
        obstacle: id,
        point: first.point,
        on_ego: ego_pose.to_local(first.point),
        ego_speed_mps,
        obstacle_velocity_mps: obstacle.velocity_mps,
        obstacle_velocity_on_ego_mps: Vec2::new(
            ego_pose.forward().dot(&obstacle.velocity_mps),
            ego_pose.left().dot(&obstacle.velocity_mps),
        ),
        closing_speed_mps: closing_mps.max(0.0),
        ruling: Ruling::default(),
    };
    Some((contact, first.normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::{OrientedBox, Pose};

    #[test]
    fn a_body_that_turns_at_a_corner_of_its_way_hits_as_fast_as_it_drives() {
        let pose = |x_m: f64, y_m: f64, heading_rad: f64| Pose { position: Vec2::new(x_m, y_m), heading_rad };
        let at_rest = |pose: Pose| Sweep { start: OrientedBox::new(pose, 4.7, 2.0), end: pose };
        let ego = Party { sweep: at_rest(pose(0.0, 0.0, 0.0)), velocity_mps: Vec2::zeros() };
        // A bus 0.5 m beside it that swings its rear over, and drives along at 4 m/s.
        let closing_mps = |turned_rad: f64| {
            let begin = pose(-4.0, 2.5, 0.0);
            let sweep =
                Sweep { start: OrientedBox::new(begin, 12.0, 2.0), end: pose(-3.92, 2.5, -turned_rad) };
            let bus = Party { sweep, velocity_mps: Vec2::new(4.0, 0.0) };
            meet(&ego, 0.0, &bus, 1, 0).expect("they touch").0.closing_speed_mps
        };
        assert!(closing_mps(1.0) < 4.1, "{}", closing_mps(1.0));
        assert!((5.0..40.0).contains(&closing_mps(0.1)), "a real swing counts: {}", closing_mps(0.1));
    }
}
