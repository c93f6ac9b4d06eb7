//! What a road user may look at while it decides how to move.

use crate::geometry::{OrientedBox, Vec2};

use super::body::BodyParameters;
use super::environment::{GRAVITY_MPS2, Grip};
use super::npc::Driver;
use super::pedestrian::Walker;
use super::road_user::{Motion, Obstacle, RoadUser};
use super::scene::Scene;
use super::sense::{EgoMotion, RANGE_M};
use super::signals::SignalClock;
use super::traffic::TrafficProfile;

/// The world around one road user during one tick, or around a newcomer that is not in it yet.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub scene: &'a Scene,
    pub ego: &'a EgoMotion,
    pub ego_outline: &'a OrientedBox,
    /// Unit vector along the ego vehicle's heading.
    pub ego_forward: Vec2,
    pub ego_velocity_mps: Vec2,
    pub ego_station_m: f64,
    pub ego_offset_m: f64,
    /// All other road users: those before it in the world's order, and those after it.
    pub users: [&'a [RoadUser]; 2],
    pub signals: &'a SignalClock,
    pub tick: u64,
    /// Friction under the ego vehicle.
    pub friction: f64,
    pub grip: &'a Grip,
    pub visibility_m: f64,
    pub traffic: &'a TrafficProfile,
    /// Seed of the choices of road users.
    pub seed: u64,
}

impl Around<'_> {
    /// All other road users but the ego vehicle, as seen.
    pub fn obstacles(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.users().map(|user| &user.obstacle)
    }

    /// Outlines and velocities of the ego vehicle and of every obstacle.
    pub fn others(&self) -> impl Iterator<Item = (&OrientedBox, Vec2)> {
        core::iter::once((self.ego_outline, self.ego_velocity_mps))
            .chain(self.obstacles().map(|obstacle| (&obstacle.outline, obstacle.velocity_mps)))
    }

    /// As [`Around::others`], with the unit vector of each heading: outline, heading, velocity.
    pub fn others_along(&self) -> impl Iterator<Item = (&OrientedBox, Vec2, Vec2)> {
        core::iter::once((self.ego_outline, self.ego_forward, self.ego_velocity_mps)).chain(
            self.obstacles().map(|obstacle| (&obstacle.outline, obstacle.forward, obstacle.velocity_mps)),
        )
    }

    /// Outlines and velocities of all vehicles, the ego vehicle first.
    pub fn vehicles(&self) -> impl Iterator<Item = (&OrientedBox, Vec2)> {
        let vehicles = self.obstacles().filter(|obstacle| obstacle.body.is_vehicle());
        core::iter::once((self.ego_outline, self.ego_velocity_mps))
            .chain(vehicles.map(|obstacle| (&obstacle.outline, obstacle.velocity_mps)))
    }

    /// Every other driver with its obstacle and its body; wrecks are left out.
    pub fn drivers(&self) -> impl Iterator<Item = (&Obstacle, &BodyParameters, &Driver)> {
        self.users().filter_map(|user| match &user.mover.motion {
            Motion::Drive(driver) if !user.mover.is_wreck() => {
                Some((&user.obstacle, &user.mover.size, driver))
            }
            Motion::Drive(_) | Motion::Walk(_) | Motion::Stand => None,
        })
    }

    /// Every pedestrian who walks, with its obstacle.
    pub fn walkers(&self) -> impl Iterator<Item = (&Obstacle, &Walker)> {
        self.users().filter_map(|user| match &user.mover.motion {
            Motion::Walk(walker) => Some((&user.obstacle, walker)),
            Motion::Drive(_) | Motion::Stand => None,
        })
    }

    /// Whether the ego vehicle's sensors would see an obstacle of which nothing hides `visible_fraction`.
    pub fn is_in_sight(&self, obstacle: &Obstacle, visible_fraction: f64) -> bool {
        visible_fraction > 0.0 && obstacle.distance_m < RANGE_M.min(self.visibility_m)
    }

    /// The hardest braking of a body at a speed on this road, m/s².
    pub fn braking_mps2(&self, size: &BodyParameters, speed_mps: f64) -> f64 {
        size.deceleration_mps2_max.min(self.grip.friction(speed_mps) * GRAVITY_MPS2)
    }

    fn users(&self) -> impl Iterator<Item = &RoadUser> + Clone {
        let [before, after] = self.users;
        before.iter().chain(after)
    }
}
