//! Ticks and orders for a road user, whatever moves it: a driver, two legs, a trajectory or nothing.

use std::sync::Arc;

use avastra_base::geometry::{Pose, Vec2};
use avastra_base::kinematics::GRAVITY_MPS2;
use avastra_lang::model::command::{Command, Moves};

use crate::behave::manoeuvre::Progress;
use crate::state::obstacle::{Moved, Obstacle};
use crate::state::road_user::{Motion, Mover};
use crate::state::time::DT_S;
use crate::state::world::World;
use crate::view::around::{Around, View};

/// How long a wreck stays where it came to rest, s; longer while the ego vehicle sees it.
const WRECK_S: f64 = 2.0;

impl Motion {
    /// The progress with its order; `None` for a road user that only stands.
    pub fn progress(&self, around: &Around) -> Option<Progress> {
        let on_foot = |speed_mps, is_aside, is_over| Progress {
            speed_mps,
            is_aside,
            has_turned: true,
            has_met: true,
            moves: Moves::Walks,
            is_over,
        };
        match self {
            Motion::Drive(driver) => {
                let (is_aside, has_turned) = (driver.is_aside_as_told(), driver.has_turned());
                let (speed_mps, has_met) = (driver.speed_mps, driver.has_met());
                Some(Progress {
                    speed_mps,
                    is_aside,
                    has_turned,
                    has_met,
                    moves: Moves::Drives,
                    is_over: false,
                })
            }
            Motion::Walk(walker) => {
                let (speed_mps, is_over) = (walker.pace_mps(), walker.is_over());
                Some(on_foot(speed_mps, true, is_over))
            }
            Motion::Stroll(stroller) => {
                let (speed_mps, is_aside) = (stroller.pace_mps(), stroller.is_aside());
                let is_over = stroller.is_over(around);
                Some(on_foot(speed_mps, is_aside, is_over))
            }
            Motion::Guide(guided) => Some(Progress {
                speed_mps: guided.speed_mps,
                is_aside: guided.is_aside(),
                has_turned: true,
                has_met: guided.has_met(),
                moves: Moves::Follows,
                is_over: guided.is_over(),
            }),
            Motion::Stand => None,
        }
    }

    /// From now on it does what it is told, as soon as it can. `to` is the id of the road user to whom the command says to keep
    /// a gap, if it names one.
    pub fn order(&mut self, command: &Command, to: Option<u32>, tick: u64) {
        match self {
            Motion::Drive(driver) => driver.order(command, to),
            Motion::Walk(walker) => {
                command.speed_mps().iter().for_each(|speed_mps| walker.order(*speed_mps, tick));
            }
            Motion::Stroll(stroller) => stroller.order(command),
            Motion::Guide(guided) => guided.order(command),
            Motion::Stand => {}
        }
    }
}

impl Mover {
    /// One tick of the obstacle `this`; `None` if it leaves the world.
    pub fn step(&mut self, this: &Obstacle, around: &Around) -> Option<Moved> {
        let in_sight = around.is_in_sight(this, self.visible_fraction);
        if self.is_wreck() && this.velocity_mps == Vec2::zeros() {
            self.rest_ticks = self.rest_ticks.saturating_add(1);
            if f64::from(self.rest_ticks) * DT_S >= WRECK_S && !in_sight {
                return None;
            }
        }
        let rest = Moved::at_rest(this);
        match &mut self.motion {
            _ if self.crashed_with.is_some() => Some(slide(this, around)),
            Motion::Drive(driver) => {
                let (way, before_m) = (Arc::as_ptr(&driver.way), driver.station_m);
                let moved = driver.step(&View { this, size: &self.size, around }, self.touched, in_sight);
                if way == Arc::as_ptr(&driver.way) {
                    let front_m = this.outline.half_length_m;
                    let (from_m, to_m) = (before_m + front_m, driver.station_m + front_m);
                    let stops = driver.way.stop_signs_m.iter();
                    let stops = stops.map(|at_m| (*at_m, driver.way.lane_at(*at_m).0));
                    let lights = &driver.way.stop_lines;
                    self.rights.passed.pass(lights, stops, (from_m, to_m), driver.speed_mps, around);
                }
                moved
            }
            Motion::Walk(_) | Motion::Stroll(_) if self.touched => Some(rest),
            // A road user whose manoeuvre is not over does not leave.
            Motion::Walk(walker) => walker.step(this, in_sight || self.course.is_some(), around),
            Motion::Stroll(stroller) => stroller.step(this, in_sight || self.course.is_some(), around),
            Motion::Guide(guided) => {
                let moved = guided.step(this, &self.size, self.touched, around);
                self.rights.passed.pass_freely(this, &moved, around);
                Some(moved)
            }
            Motion::Stand => Some(rest),
        }
    }
}

/// A tick with wheels locked: straight on, without turning, slowed by the friction of the road.
fn slide(this: &Obstacle, around: &Around) -> Moved {
    let speed_mps = this.velocity_mps.norm();
    let rest = Moved::at_rest(this);
    if speed_mps == 0.0 {
        return rest;
    }
    let lost_mps = around.grip.friction(speed_mps) * GRAVITY_MPS2 * DT_S;
    let velocity_mps = this.velocity_mps * (1.0 - lost_mps / speed_mps).max(0.0);
    let position = rest.pose.position + (this.velocity_mps + velocity_mps) / 2.0 * DT_S;
    Moved { pose: Pose { position, ..rest.pose }, velocity_mps, ..rest }
}

impl World {
    /// Whether the road user with an id has carried out a command. It has the speed, is in the lane and at the offset,
    /// and is past the junction of its turn.
    pub fn has_done(&self, id: u32, command: &Command) -> bool {
        let user = self.user(id);
        let progress = user.and_then(|user| user.mover.motion.progress(&self.alone()));
        progress.is_some_and(|progress| progress.meets(command))
    }
}
