//! Pedestrians who walk along the road, beside the middle of the ego vehicle's lane or in it, in its direction or towards it.
//!
//! They walk steadily, whatever comes, as the targets of Euro NCAP's longitudinal tests do, and stop before what is in their
//! way. An order or a phase tells them a speed, below 0 for the way back, and a place beside the middle of the lane. They go
//! as far as the route does, and leave the world when the ego vehicle does not see them.

use avastra_base::geometry::{Pose, Vec2, unit_vector};
use avastra_lang::model::command::{AsideBy, Command};

use crate::behave::pedestrian::is_blocked;
use crate::state::obstacle::{Moved, Obstacle};
use crate::state::stroller::Stroller;
use crate::state::time::{DT_S, FRAME_TICKS};
use crate::view::around::Around;

/// Lateral speed of a pedestrian or an animal whose order has no `aside`, m/s: an adult's walking pace. Ours.
const ASIDE_MPS: f64 = 1.2;

impl Stroller {
    pub fn new(station_m: f64, left_m: f64, is_oncoming: bool, speed_mps: f64, around: &Around) -> Stroller {
        let height_m = around.scene.route.height_at(&around.scene.map, station_m);
        let (wants_left_m, aside_mps) = (left_m, ASIDE_MPS);
        let (is_blocked, looks_now) = (false, true);
        Stroller {
            station_m,
            left_m,
            height_m,
            is_oncoming,
            speed_mps,
            wants_left_m,
            aside_mps,
            is_blocked,
            looks_now,
        }
    }

    /// Where it begins.
    pub fn begins(&self, around: &Around) -> Moved {
        let way = around.scene.route.path.pose_at(self.station_m);
        let turn_rad = if self.is_oncoming { core::f64::consts::PI } else { 0.0 };
        let pose = Pose { heading_rad: way.heading_rad + turn_rad, ..way.offset(0.0, self.left_m) };
        let forward = pose.forward();
        Moved { pose, forward, lane_heading_rad: pose.heading_rad, velocity_mps: forward * self.speed_mps }
    }

    pub fn order(&mut self, command: &Command) {
        self.speed_mps = command.speed_mps().unwrap_or(self.speed_mps);
        if let Some(left_m) = command.offset_m() {
            self.aside_mps = match command.aside() {
                None => ASIDE_MPS,
                Some(AsideBy::Speed(mps)) => mps,
                Some(AsideBy::Time(takes_s)) => (left_m - self.left_m).abs() / takes_s,
            };
            self.wants_left_m = left_m;
        }
        self.looks_now = true;
    }

    /// Whether it is where the route ends, or begins, and would go on.
    pub fn is_over(&self, around: &Around) -> bool {
        let step_m = self.step_m();
        step_m < 0.0 && self.station_m <= 0.0
            || step_m > 0.0 && self.station_m >= around.scene.route.path.length_m()
    }

    /// Its way along the route in a tick, m.
    fn step_m(&self) -> f64 {
        let way_m = self.speed_mps * DT_S;
        if self.is_oncoming { -way_m } else { way_m }
    }

    /// Where it is at the end of a tick; `None` once it has left, which the ego vehicle does not see (`in_sight`).
    pub fn step(&mut self, this: &Obstacle, in_sight: bool, around: &Around) -> Option<Moved> {
        if self.is_over(around) && self.is_aside() {
            return in_sight.then_some(Moved::at_rest(this));
        }
        let (station_m, left_m) = self.next(this, around);
        let is_due = around.is_due(this.id, FRAME_TICKS);
        if core::mem::take(&mut self.looks_now) || is_due {
            let to = place(station_m, left_m, around) - this.outline.pose.position;
            let heading_rad =
                if to == Vec2::zeros() { this.outline.pose.heading_rad } else { libm::atan2(to.y, to.x) };
            self.is_blocked =
                to != Vec2::zeros() && is_blocked(Pose { heading_rad, ..this.outline.pose }, this, around);
        }
        if self.is_blocked {
            return Some(Moved::at_rest(this));
        }
        (self.station_m, self.left_m) = (station_m, left_m);
        self.height_m = around.scene.route.height_at(&around.scene.map, station_m);
        let position = place(station_m, left_m, around);
        let way = position - this.outline.pose.position;
        if way == Vec2::zeros() {
            return Some(Moved::at_rest(this));
        }
        let heading_rad = libm::atan2(way.y, way.x);
        let (pose, forward) = (Pose { position, heading_rad }, unit_vector(heading_rad));
        Some(Moved { pose, forward, lane_heading_rad: heading_rad, velocity_mps: way / DT_S })
    }

    /// Where it would be at the end of a tick: the station, and how far to the left, m. In bends its own way beside the route
    /// is as long as its speed says.
    fn next(&self, this: &Obstacle, around: &Around) -> (f64, f64) {
        let step_m = self.step_m();
        let guess_m =
            (place(self.station_m + step_m, self.left_m, around) - this.outline.pose.position).norm();
        let longer = if guess_m > 0.0 { step_m.abs() / guess_m } else { 1.0 };
        let station_m = (self.station_m + step_m * longer).clamp(0.0, around.scene.route.path.length_m());
        let aside_m = self.aside_mps * DT_S;
        (station_m, self.left_m + (self.wants_left_m - self.left_m).clamp(-aside_m, aside_m))
    }
}

fn place(station_m: f64, left_m: f64, around: &Around) -> Vec2 {
    let (point, along) = around.scene.route.path.along(station_m);
    point + Vec2::new(-along.y, along.x) * left_m
}
