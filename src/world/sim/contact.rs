//! Contacts of the ego vehicle with obstacles, and what they do to it.
//!
//! Outlines are swept from tick to tick, so nothing passes through anything. The impact is plastic and acts across
//! the gap that closed, as among obstacles (`incident`), so the bodies change their velocities as `oracle::severity` says,
//! as far as a car can: no body is pushed backwards or sideways or turned, and a person that was hit stays in place.

use avastra_base::geometry::{Sweep, Vec2, first_contact};

use super::right_of_way::Ruling;
use crate::state::time::DT_S;

/// The ego vehicle touched an obstacle that it did not touch in the tick before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Since the episode began, s.
    pub time_s: f64,
    /// Id of the obstacle.
    pub obstacle: u32,
    /// Where they met, in the world, m.
    pub point: Vec2,
    /// The point in the frame of the ego outline's centre: x ahead, y left, m.
    pub on_ego: Vec2,
    /// Before the contact, m/s.
    pub ego_speed_mps: f64,
    /// Before the contact, in the world, m/s.
    pub obstacle_velocity_mps: Vec2,
    /// `obstacle_velocity_mps` in the frame of the ego outline: x ahead, y left, m/s.
    pub obstacle_velocity_on_ego_mps: Vec2,
    /// Speed at which the gap between the outlines closed where they met, m/s, not negative.
    pub closing_speed_mps: f64,
    /// Which of the two had priority, as of the moment when the first of them came into the other's way, and why.
    pub ruling: Ruling,
}

/// One party of a possible contact during one tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Party {
    pub sweep: Sweep,
    pub velocity_mps: Vec2,
}

/// The contact that begins within the tick after `tick`, if there is one, and the unit vector from the ego vehicle to
/// the obstacle across the gap that closed; a zero vector if they touched already.
pub(super) fn meet(
    ego: &Party,
    ego_speed_mps: f64,
    obstacle: &Party,
    id: u32,
    tick: u64,
) -> Option<(Contact, Vec2)> {
    let first = first_contact(&ego.sweep, &obstacle.sweep)?;
    let ego_pose = ego.sweep.at(first.fraction).pose;
    // The velocities of the points that meet, not of the centres: a corner that swings out closes a gap, too.
    let rate_m = |party: &Party| party.sweep.rate_m(first.fraction, first.point);
    let closing_mps = (rate_m(ego) - rate_m(obstacle)).dot(&first.normal) / DT_S;
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
