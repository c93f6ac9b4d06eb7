//! What moves an obstacle: a driver, two legs, or nothing. And what everybody may look at while
//! deciding how.

use crate::geometry::{OrientedBox, Pose, Vec2};

use super::body::BodyParameters;
use super::environment::{GRAVITY_MPS2, Grip};
use super::npc::Driver;
use super::pedestrian::Walker;
use super::scene::Scene;
use super::sense::EgoMotion;
use super::signals::SignalClock;
use super::world::{DT_S, Obstacle};

/// How long somebody who touched anybody stays where they came to rest, s.
const WRECK_S: f64 = 2.0;

/// The world around a mover during one tick.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub scene: &'a Scene,
    pub ego: &'a EgoMotion,
    pub ego_outline: &'a OrientedBox,
    /// Unit vector along its heading.
    pub ego_forward: Vec2,
    pub ego_velocity_mps: Vec2,
    pub ego_station_m: f64,
    pub obstacles: &'a [Obstacle],
    /// What moves the first of them, and those after the one that moves just now.
    pub movers: [&'a [Mover]; 2],
    pub signals: &'a SignalClock,
    pub tick: u64,
    /// Under the ego vehicle.
    pub friction: f64,
    pub grip: &'a Grip,
    pub visibility_m: f64,
    /// Of the choices of other road users.
    pub seed: u64,
}

impl Around<'_> {
    /// Outlines and velocities of the ego vehicle and of every obstacle but one.
    pub fn others(&self, except: u32) -> impl Iterator<Item = (&OrientedBox, Vec2)> {
        let obstacles = self.obstacles.iter().filter(move |obstacle| obstacle.id != except);
        core::iter::once((self.ego_outline, self.ego_velocity_mps))
            .chain(obstacles.map(|obstacle| (&obstacle.outline, obstacle.velocity_mps)))
    }

    /// The same with the unit vectors of their headings: outline, heading, velocity.
    pub fn others_along(&self, except: u32) -> impl Iterator<Item = (&OrientedBox, Vec2, Vec2)> {
        let obstacles = self.obstacles.iter().filter(move |obstacle| obstacle.id != except);
        core::iter::once((self.ego_outline, self.ego_forward, self.ego_velocity_mps))
            .chain(obstacles.map(|obstacle| (&obstacle.outline, obstacle.forward, obstacle.velocity_mps)))
    }

    /// Outlines and velocities of all vehicles, the ego vehicle first.
    pub fn vehicles(&self) -> impl Iterator<Item = (&OrientedBox, Vec2)> {
        let vehicles = self.obstacles.iter().filter(|obstacle| obstacle.body.is_vehicle());
        core::iter::once((self.ego_outline, self.ego_velocity_mps))
            .chain(vehicles.map(|obstacle| (&obstacle.outline, obstacle.velocity_mps)))
    }

    /// Every driver but one, each with its obstacle and its body, wrecks left out.
    pub fn drivers(&self, except: u32) -> impl Iterator<Item = (&Obstacle, &BodyParameters, &Driver)> {
        let [before, after] = self.movers;
        let rest = self.obstacles.get(before.len() + 1..).unwrap_or_default();
        let all = self.obstacles.iter().zip(before).chain(rest.iter().zip(after));
        all.filter_map(move |(obstacle, mover)| match &mover.motion {
            Motion::Drive(driver) if obstacle.id != except && !mover.is_wreck() => {
                Some((obstacle, &mover.size, driver))
            }
            Motion::Drive(_) | Motion::Walk(_) | Motion::Stand => None,
        })
    }

    /// The hardest braking of a body at a speed on this road, m/s².
    pub fn braking_mps2(&self, size: &BodyParameters, speed_mps: f64) -> f64 {
        size.deceleration_mps2_max.min(self.grip.friction(speed_mps) * GRAVITY_MPS2)
    }
}

/// The hidden side of an obstacle.
#[derive(Debug, Clone)]
pub(super) struct Mover {
    pub size: BodyParameters,
    pub motion: Motion,
    /// Whether the ego vehicle and it have touched, whoever ran into whom.
    pub touched: bool,
    /// Whether it ran into another obstacle or the other into it. It stands where that happened.
    pub crashed: bool,
    /// Ticks at rest since then.
    rest_ticks: u32,
    /// Part of it that the ego vehicle's sensors saw when they last looked.
    pub visible_fraction: f64,
}

#[derive(Debug, Clone)]
pub(super) enum Motion {
    Drive(Driver),
    Walk(Walker),
    Stand,
}

/// Where a mover is after a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moved {
    /// Centre of the outline.
    pub pose: Pose,
    /// Unit vector along its heading.
    pub forward: Vec2,
    /// Heading of the lane that it drives in; its own on foot.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
}

impl Moved {
    /// Standing where it was.
    pub fn at_rest(this: &Obstacle) -> Moved {
        Moved {
            pose: this.outline.pose,
            forward: this.forward,
            lane_heading_rad: this.lane_heading_rad,
            velocity_mps: Vec2::zeros(),
        }
    }
}

impl Mover {
    pub fn new(size: BodyParameters, motion: Motion) -> Mover {
        Mover { size, motion, touched: false, crashed: false, rest_ticks: 0, visible_fraction: 1.0 }
    }

    /// Whether it does nothing any more but come to rest.
    pub fn is_wreck(&self) -> bool {
        self.touched || self.crashed
    }

    /// One tick of the obstacle `this`; `None` if it leaves the world.
    pub fn step(&mut self, this: &Obstacle, around: &Around) -> Option<Moved> {
        if self.is_wreck() && this.velocity_mps == Vec2::zeros() {
            self.rest_ticks += 1;
            if f64::from(self.rest_ticks) * DT_S >= WRECK_S {
                return None;
            }
        }
        let rest = Moved::at_rest(this);
        match &mut self.motion {
            _ if self.crashed => Some(rest),
            Motion::Drive(driver) => driver.step(this, &self.size, self.touched, around),
            Motion::Walk(_) if self.touched => Some(rest),
            Motion::Walk(walker) => walker.step(this, around),
            Motion::Stand => Some(rest),
        }
    }

    /// It touched the ego vehicle, and moves at most at `speed_mps` from now on, until its brakes stop it.
    pub fn touch(&mut self, speed_mps: f64) {
        self.touched = true;
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = speed_mps;
        }
    }

    /// It and another obstacle touched: both stand from now on.
    pub fn crash(&mut self) {
        self.crashed = true;
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = 0.0;
        }
    }

    pub fn trace(&self, sink: &mut dyn FnMut(u64)) {
        sink(u64::from(self.touched));
        sink(u64::from(self.crashed));
        sink(u64::from(self.rest_ticks));
        sink(self.visible_fraction.to_bits());
        match &self.motion {
            Motion::Drive(driver) => driver.trace(sink),
            Motion::Walk(walker) => walker.trace(sink),
            Motion::Stand => {}
        }
    }
}
