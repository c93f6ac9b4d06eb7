//! A road user other than the ego vehicle: what others may see of it ([`Obstacle`]), and its hidden side ([`Mover`]).

use avastra_base::geometry::{OrientedBox, Pose, Sweep, Vec2};
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::vocabulary::TrafficRule;

use crate::state::driver::Driver;
use crate::state::guided::Guided;
use crate::state::manoeuvre::{PhaseCount, Running};
use crate::state::obstacle::Obstacle;
use crate::state::pedestrian::Walker;
use crate::state::rights::Rights;
use crate::state::stroller::Stroller;
use crate::state::trace::{Trace, Traced, traced};

/// One road user of the world.
#[derive(Debug, Clone)]
pub struct RoadUser {
    pub obstacle: Obstacle,
    pub mover: Mover,
}

/// The hidden side of a road user.
#[derive(Debug, Clone)]
pub struct Mover {
    pub size: BodyParameters,
    pub motion: Motion,
    /// Whether it and the ego vehicle have touched, whichever ran into the other.
    pub touched: bool,
    /// The obstacle that it touched last: it slides to rest.
    pub crashed_with: Option<u32>,
    /// Ticks that it has been a wreck at rest.
    pub rest_ticks: u32,
    /// Part of it that the ego vehicle's sensors saw when they last looked.
    pub visible_fraction: f64,
    /// The road users near it, and the distance to the next one.
    pub room: Room,
    /// Which of the two has priority: it or the ego vehicle.
    pub rights: Rights,
    /// The name that its action gave it, by index in the space.
    pub bearer: Option<usize>,
    /// The manoeuvre that it does, until it ends or an order replaces it.
    pub course: Option<Box<Running>>,
    /// How many phases of its last manoeuvre have begun, and ended, and how many there are. Nothing depends on them.
    pub phases: PhaseCount,
}

impl Mover {
    pub fn new(size: BodyParameters, motion: Motion) -> Mover {
        Mover {
            size,
            motion,
            touched: false,
            crashed_with: None,
            rest_ticks: 0,
            visible_fraction: 1.0,
            room: Room::default(),
            rights: Rights::default(),
            bearer: None,
            course: None,
            phases: PhaseCount::default(),
        }
    }

    /// Height of the road on its way, m; `None` for what has no way.
    pub fn elevation_m(&self) -> Option<f64> {
        match &self.motion {
            Motion::Drive(driver) => Some(driver.way.height_at(driver.station_m)),
            Motion::Stroll(stroller) => Some(stroller.height_m()),
            Motion::Guide(guided) => Some(guided.height_m()),
            Motion::Walk(_) | Motion::Stand => None,
        }
    }

    /// Whether it does nothing any more but come to rest.
    pub fn is_wreck(&self) -> bool {
        self.touched || self.crashed_with.is_some()
    }

    /// By how much it missed the moment of its last `early`, s; below 0 if it was too soon. `None` before that.
    pub fn late_s(&self) -> Option<f64> {
        match &self.motion {
            Motion::Drive(driver) => driver.late_s,
            Motion::Guide(guided) => guided.late_s.filter(|_| guided.has_met()),
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => None,
        }
    }

    /// Whether it is an emergency vehicle under way.
    pub fn has_siren(&self) -> bool {
        matches!(&self.motion, Motion::Drive(driver) if driver.has_siren)
    }

    /// Whether it drives a lane change; `None` of what no driver leads along lanes.
    pub fn changes_lanes(&self) -> Option<bool> {
        match &self.motion {
            Motion::Drive(driver) => Some(driver.is_changing_lanes()),
            Motion::Guide(_) | Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => None,
        }
    }

    /// Whether it drives, and ignores a rule of the road.
    pub fn ignores(&self, rule: TrafficRule) -> bool {
        matches!(&self.motion, Motion::Drive(driver) if driver.ignores.contains(rule))
    }

    /// Whether it drives without lights.
    pub fn is_unlit(&self) -> bool {
        self.ignores(TrafficRule::Headlights)
    }

    /// Whether it has crashed into another obstacle, or another into it.
    pub fn has_crashed(&self) -> bool {
        self.crashed_with.is_some()
    }

    /// Whether it stands and will not go by itself: a wreck, a driver that has given up waiting, or one that was asked to
    /// stand.
    pub fn is_stuck(&self, this: &Obstacle) -> bool {
        match &self.motion {
            _ if self.is_wreck() => this.velocity_mps == Vec2::zeros(),
            // One that stands within a manoeuvre may go on by itself.
            Motion::Drive(driver) => driver.has_given_up() || self.course.is_none() && driver.is_parked(),
            Motion::Guide(guided) => self.course.is_none() && guided.speed_mps == 0.0,
            Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => false,
        }
    }

    /// The area that it sweeps within a tick.
    pub fn sweep(&self, mut start: OrientedBox, end: Pose) -> Sweep {
        let on_foot = match &self.motion {
            Motion::Walk(_) | Motion::Stroll(_) => true,
            Motion::Guide(guided) => guided.turns_on_the_spot(),
            Motion::Drive(_) | Motion::Stand => false,
        };
        if on_foot {
            // A person turns round on the spot, so the corners of its box must not sweep half a circle within a tick.
            start.pose.heading_rad = end.heading_rad;
        }
        Sweep { start, end }
    }

    /// It touched the ego vehicle: from now on it goes at most `speed_mps`, until its brakes stop it.
    pub fn touch(&mut self, speed_mps: f64) {
        self.touched = true;
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = speed_mps;
        }
    }

    /// It and another obstacle touched: from now on it slides to rest. Returns the obstacle that it had
    /// touched last.
    pub fn crash(&mut self, other: u32) -> Option<u32> {
        if let Motion::Drive(driver) = &mut self.motion {
            driver.speed_mps = 0.0;
        }
        self.crashed_with.replace(other)
    }
}

/// The road users near this one when it last looked. Until the ways driven since exceed `gap_m`, it can touch no other.
#[derive(Debug, Clone, Copy, Default)]
pub struct Room {
    /// One bit for each of the first [`Room::LISTED`] road users, by index: who was near.
    pub near: u64,
    /// Least gap between circles around it and around one that was not near, m.
    pub gap_m: f64,
    /// [`Travel::done_m`] at that moment.
    pub since_m: f64,
    /// How many road users there were, and the ids of the next newcomers, by an action and in ambient traffic. While
    /// all three are the same, no road user has come or gone.
    pub among: (usize, u32, u32),
}

impl Room {
    /// How many road users have a bit.
    pub const LISTED: usize = u64::BITS as usize;
}

/// How far any road user can have come at most.
#[derive(Debug, Clone, Copy, Default)]
pub struct Travel {
    /// Over all ticks before this one: the sum of the longest way of each, m.
    pub done_m: f64,
    /// The longest way in this tick so far, m.
    pub now_m: f64,
}

#[derive(Debug, Clone)]
pub enum Motion {
    Drive(Driver),
    Walk(Walker),
    Stroll(Stroller),
    Guide(Guided),
    Stand,
}

traced! {
    RoadUser { obstacle, mover };
    Obstacle {
        id, body, colour, verb, outline => outline.pose, velocity_mps, spawned_tick, lights
    } but {
        // These follow from the body, the outline, the way and the ego vehicle, now and in the ticks before.
        forward, height_m, lane_heading_rad, acceleration_mps2, elevation_m, is_apart, distance_m
    };
    Mover {
        motion, touched, crashed_with, rest_ticks, visible_fraction, rights,
        // Not which name: names are numbered as the space declares them, and what is declared beside changes no episode.
        bearer => bearer.is_some(), course
    } but {
        // No tick changes it.
        size,
        // It saves work, and changes nothing.
        room,
        // No tick reads it.
        phases
    };
}

impl Traced for Motion {
    fn trace(&self, trace: &mut Trace) {
        match self {
            Motion::Drive(driver) => driver.trace(trace),
            Motion::Walk(walker) => walker.trace(trace),
            Motion::Stroll(stroller) => stroller.trace(trace),
            Motion::Guide(guided) => guided.trace(trace),
            Motion::Stand => {}
        }
    }
}
