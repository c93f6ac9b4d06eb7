//! The view of a road user while it decides how to move.

use avastra_base::geometry::{OrientedBox, Vec2};
use avastra_base::kinematics::GRAVITY_MPS2;
use avastra_road::is_apart;

use crate::scene::Scene;
use crate::scene::traffic::TrafficProfile;
use crate::state::driver::Driver;
use crate::state::environment::Grip;
use crate::state::obstacle::Obstacle;
use crate::state::passed::Passed;
use crate::state::pedestrian::Walker;
use crate::state::road_user::{Motion, RoadUser};
use crate::state::sensed::{EgoMotion, SignalColour};
use crate::state::signals::SignalClock;
use crate::state::time::DT_S;
use crate::state::world::World;
use avastra_lang::model::body::BodyParameters;

/// A way within this distance of the route meets it or passes over it, m. It is three lanes, so that a vehicle beside
/// the ego vehicle is on its level even if it passes over the route later.
const LEVEL_ASIDE_M: f64 = 10.0;
/// How far a way is followed until it comes near the route, in steps, m. That is as far as it matters to the ego
/// vehicle, and less than any ramp needs to come around to a road that it passed over.
const LEVEL_STEP_M: f64 = 5.0;
const LEVEL_STEPS: u32 = 25;
/// Stretch of the route before and behind the ego vehicle on which others meet it, m.
const LEVEL_REACH_M: f64 = 200.0;

/// A road user is searched for along the route within [`WINDING`] times its straight distance plus [`BESIDE_M`]. In
/// bends the route is longer than the straight way.
const WINDING: f64 = 2.0;
const BESIDE_M: f64 = 50.0;

/// The world around one road user during one tick, or around a newcomer that is not in it yet.
#[derive(Clone, Copy)]
pub struct Around<'a> {
    pub scene: &'a Scene,
    pub ego: &'a EgoMotion,
    pub ego_outline: &'a OrientedBox,
    /// Unit vector along the ego vehicle's heading.
    pub ego_forward: Vec2,
    pub ego_velocity_mps: Vec2,
    /// Height of the road under the ego vehicle, m.
    pub ego_elevation_m: f64,
    pub ego_station_m: f64,
    pub ego_offset_m: f64,
    /// The lines that the ego vehicle passed last.
    pub ego_passed: Passed,
    /// All other road users: those before it in the world's order, and those after it.
    pub users: [&'a [RoadUser]; 2],
    pub signals: &'a SignalClock,
    /// The colour of each signal now.
    pub colours: &'a [SignalColour],
    pub tick: u64,
    /// Friction under the ego vehicle.
    pub friction: f64,
    pub grip: &'a Grip,
    pub visibility_m: f64,
    pub traffic: &'a TrafficProfile,
    /// Seed of the choices of road users.
    pub seed: u64,
    /// As `Start::reactions`.
    pub reactions: u64,
    /// Tick from which they hold.
    pub reactions_from: u64,
}

/// The facts that a driver needs about another road user, or the ego vehicle, so as not to run into it.
#[derive(Clone, Copy)]
pub struct Other<'a> {
    pub outline: &'a OrientedBox,
    /// Unit vector along its heading.
    pub forward: Vec2,
    pub velocity_mps: Vec2,
    /// Height of the road under it, m.
    pub elevation_m: f64,
}

impl<'a> From<&'a Obstacle> for Other<'a> {
    fn from(obstacle: &'a Obstacle) -> Other<'a> {
        let Obstacle { outline, forward, velocity_mps, elevation_m, .. } = obstacle;
        Other { outline, forward: *forward, velocity_mps: *velocity_mps, elevation_m: *elevation_m }
    }
}

/// The basis of a road user's decisions: itself as others see it, its body, and the world around it.
pub struct View<'a> {
    pub this: &'a Obstacle,
    pub size: &'a BodyParameters,
    pub around: &'a Around<'a>,
}

impl Around<'_> {
    /// Since the episode began, s.
    pub fn time_s(&self) -> f64 {
        self.tick as f64 * DT_S
    }

    /// Whether a road user does in this tick what it does every so many ticks.
    pub fn is_due(&self, id: u32, every_ticks: u64) -> bool {
        let own = match self.reactions {
            0 => u64::from(id),
            _ if self.tick < self.reactions_from => u64::from(id),
            // Fibonacci hashing (Knuth, TAOCP 6.4): neighbouring numbers are spread over the upper bits.
            seed => (seed ^ u64::from(id)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32,
        };
        (self.tick + own).is_multiple_of(every_ticks)
    }

    /// All other road users but the ego vehicle, as seen.
    pub fn obstacles(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.users().map(|user| &user.obstacle)
    }

    /// As [`Around::obstacles`], without those of roads that pass over or under that of the ego vehicle.
    pub fn obstacles_on_level(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles().filter(|obstacle| !obstacle.is_apart)
    }

    /// Whether the road of a user passes over or under that of the ego vehicle. The place where its way first
    /// comes near the route decides; if it comes near nowhere, the place beside it.
    pub fn is_apart_from_ego(&self, user: &RoadUser) -> bool {
        let (map, route) = (&self.scene.map, &self.scene.route);
        if !map.has_levels {
            return false;
        }
        let beside = |point: Vec2| route.path.project_near(point, self.ego_station_m, LEVEL_REACH_M);
        let is_apart_at = |station_m, height_m| is_apart(route.height_at(map, station_m), height_m);
        if let Motion::Drive(driver) = &user.mover.motion {
            let ahead = (0..LEVEL_STEPS).map(|step| driver.station_m + f64::from(step) * LEVEL_STEP_M);
            for station_m in ahead {
                let found = beside(driver.way.path.position_at(station_m));
                if found.distance_m < LEVEL_ASIDE_M {
                    return is_apart_at(found.station_m, driver.way.height_at(station_m));
                }
            }
        }
        is_apart_at(beside(user.obstacle.outline.pose.position).station_m, user.obstacle.elevation_m)
    }

    /// Where a place lies beside the ego vehicle's route: the station, how far to the left, m, and the unit vector along the
    /// route there. Before its start and beyond its end the route goes on straight.
    pub fn beside_route(&self, position: Vec2) -> (f64, f64, Vec2) {
        let path = &self.scene.route.path;
        let away_m = (position - self.ego_outline.pose.position).norm();
        let near_m = path.project_near(position, self.ego_station_m, BESIDE_M + WINDING * away_m).station_m;
        let (point, along) = path.along(near_m);
        let aside = position - point;
        (near_m + along.dot(&aside), along.perp(&aside), along)
    }

    /// Whether the ego vehicle is in a junction that it entered at red.
    pub fn ego_runs_red(&self) -> bool {
        self.ego_passed.is_running_red(&self.scene.map, self.ego_outline)
    }

    /// The ego vehicle and every obstacle.
    pub fn others(&self) -> impl Iterator<Item = Other<'_>> {
        core::iter::once(self.ego()).chain(self.obstacles().map(Other::from))
    }

    /// All vehicles, the ego vehicle first.
    pub fn vehicles(&self) -> impl Iterator<Item = Other<'_>> {
        let vehicles = self.obstacles().filter(|obstacle| obstacle.body.is_vehicle());
        core::iter::once(self.ego()).chain(vehicles.map(Other::from))
    }

    /// Every other driver with its obstacle and its body; wrecks are left out.
    pub fn drivers(&self) -> impl Iterator<Item = (&Obstacle, &BodyParameters, &Driver)> {
        self.users().filter_map(|user| match &user.mover.motion {
            Motion::Drive(driver) if !user.mover.is_wreck() => {
                Some((&user.obstacle, &user.mover.size, driver))
            }
            Motion::Drive(_) | Motion::Walk(_) | Motion::Stroll(_) | Motion::Guide(_) | Motion::Stand => None,
        })
    }

    /// Every pedestrian who walks, with its obstacle.
    pub fn walkers(&self) -> impl Iterator<Item = (&Obstacle, &Walker)> {
        self.users().filter_map(|user| match &user.mover.motion {
            Motion::Walk(walker) => Some((&user.obstacle, walker)),
            Motion::Drive(_) | Motion::Stroll(_) | Motion::Guide(_) | Motion::Stand => None,
        })
    }

    /// Whether the ego vehicle's sensors would see an obstacle of which nothing hides `visible_fraction`.
    pub fn is_in_sight(&self, obstacle: &Obstacle, visible_fraction: f64) -> bool {
        visible_fraction > 0.0 && obstacle.distance_m < self.scene.range_m.min(self.visibility_m)
    }

    /// The hardest braking of a body at a speed on this road, m/s².
    pub fn braking_mps2(&self, size: &BodyParameters, speed_mps: f64) -> f64 {
        size.deceleration_mps2_max.min(self.grip.friction(speed_mps) * GRAVITY_MPS2)
    }

    pub fn ego(&self) -> Other<'_> {
        Other {
            outline: self.ego_outline,
            forward: self.ego_forward,
            velocity_mps: self.ego_velocity_mps,
            elevation_m: self.ego_elevation_m,
        }
    }

    fn users(&self) -> impl Iterator<Item = &RoadUser> + Clone {
        let [before, after] = self.users;
        before.iter().chain(after)
    }
}

impl World {
    /// The world around no road user in particular.
    pub(crate) fn alone(&self) -> Around<'_> {
        self.around([&self.users, &[]])
    }

    pub(crate) fn around<'a>(&'a self, users: [&'a [RoadUser]; 2]) -> Around<'a> {
        Around {
            scene: &self.scene,
            ego: &self.ego.motion,
            ego_outline: &self.ego.outline,
            ego_forward: self.ego.frame.forward(),
            ego_velocity_mps: self.ego.velocity_mps(),
            ego_elevation_m: self.ego_elevation_m,
            ego_station_m: self.ego_station_m,
            ego_offset_m: self.ego_offset_m,
            ego_passed: self.ego_passed,
            users,
            signals: &self.signals,
            colours: &self.colours.now,
            tick: self.ticks,
            friction: self.conditions.friction,
            grip: self.environment.grip(),
            visibility_m: self.conditions.visibility_m,
            traffic: &self.traffic,
            seed: self.seed,
            reactions: self.reactions,
            reactions_from: self.reactions_from,
        }
    }
}
