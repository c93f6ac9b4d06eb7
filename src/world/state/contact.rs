//! Contacts of the ego vehicle, and of others among each other.

use avastra_base::geometry::Vec2;

use crate::state::ruling::Ruling;

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

/// Two obstacles touched each other. Both slide to rest, and leave when they are out of sight.
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
