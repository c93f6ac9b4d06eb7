//! From an answer to pedals and wheel: controls as they are, a trajectory by `modular`'s controllers, an acceleration
//! with steering along the route.

use std::sync::Arc;

use crate::kit::{Guide, Helm, Pedals, PedalsConfig, Point, SpeedRules, Steering};
use avastra_base::geometry::{Pose, Vec2, wrap_angle};
use avastra_world::sim::{Control, EgoMotion, Scene};

use super::message::{Answer, ControlMessage, EXTREME_MPS2, TrajectoryMessage};

/// Braking after the last point of a trajectory, magnitude, m/s².
const AFTER_MPS2: f64 = 3.0;
/// The brake while no answer comes, %: Apollo's, where the planner is late.
const LOST_BRAKE_PCT: f64 = 50.0;

/// Obeys answers.
#[derive(Debug, Clone)]
pub struct Follower {
    route: Arc<Guide>,
    steering: Arc<Steering>,
    pedals: Pedals,
    /// Its station is on the route.
    pub helm: Helm,
    course: Option<Course>,
}

/// A trajectory, ready to be followed.
#[derive(Debug, Clone)]
struct Course {
    guide: Guide,
    /// When, s, and what.
    points: Vec<(f64, Point)>,
    helm: Helm,
}

impl Follower {
    pub fn new(scene: &Scene) -> Follower {
        Follower {
            route: Arc::new(Guide::new(scene, &SpeedRules::NONE)),
            steering: Steering::usual(),
            pedals: Pedals::new(&PedalsConfig::default()),
            helm: Helm::default(),
            course: None,
        }
    }

    /// Place on the route and offset from it, m, of a vehicle at a pose; to be called every tick.
    pub fn locate(&mut self, pose: &Pose) -> (f64, f64) {
        let beside = self.helm.locate(&self.route, pose.position);
        (beside.station_m, beside.offset_m)
    }

    /// Takes a new answer.
    pub fn begin(&mut self, answer: &Answer) {
        self.course = match answer {
            Answer::Trajectory(trajectory) => Some(Course::new(trajectory)),
            _ => None,
        };
    }

    /// Pedals and wheel for this tick; `pose` is where the driving system was told to be.
    pub fn obey(&mut self, answer: &Answer, time_s: f64, pose: &Pose, motion: &EgoMotion) -> Control {
        match answer {
            Answer::Control(control) => controls(control),
            Answer::Acceleration(wanted) => {
                Control::towards(wanted.accel, self.along_route_rad(pose, motion))
            }
            Answer::Trajectory(_) => {
                let course = self.course.as_mut().expect("a trajectory was begun");
                let near_m = course.helm.locate(&course.guide, pose.position).station_m;
                let steer_rad = self.steering.steer_rad(&course.guide, pose, near_m, motion);
                let plan = [time_s, time_s + self.pedals.preview_s()].map(|at_s| course.at(at_s));
                let wanted_mps2 = self.pedals.acceleration_mps2(plan, near_m, motion.speed_mps);
                Control::towards(wanted_mps2, steer_rad)
            }
            Answer::Ready(_) | Answer::Error(_) => unreachable!("no step is answered by these"),
        }
    }

    /// Pedals and wheel while no answer comes: it brakes along the route.
    pub fn lost(&self, pose: &Pose, motion: &EgoMotion) -> Control {
        let steer_rad = self.along_route_rad(pose, motion);
        Control { throttle_pct: 0.0, brake_pct: LOST_BRAKE_PCT, steer_rad }
    }

    fn along_route_rad(&self, pose: &Pose, motion: &EgoMotion) -> f64 {
        self.steering.steer_rad(&self.route, pose, self.helm.station_m(), motion)
    }
}

fn controls(control: &ControlMessage) -> Control {
    match control.accel {
        Some(accel_mps2) => Control::towards(accel_mps2, control.steer),
        None => Control {
            throttle_pct: 100.0 * control.throttle.unwrap_or(0.0),
            brake_pct: 100.0 * control.brake.unwrap_or(0.0),
            steer_rad: control.steer,
        },
    }
}

impl Course {
    fn new(trajectory: &TrajectoryMessage) -> Course {
        let given = &trajectory.points;
        let poses: Vec<Pose> = given
            .iter()
            .map(|point| Pose {
                position: Vec2::new(point.x, point.y),
                heading_rad: wrap_angle(point.heading),
            })
            .collect();
        let (guide, stations_m) = Guide::through(&poses);
        let acceleration_mps2 = |index: usize| {
            given[index].a.map(|a| a.clamp(-EXTREME_MPS2, EXTREME_MPS2)).unwrap_or_else(|| {
                let from = index.min(given.len() - 2);
                let duration_s = (given[from + 1].t_us - given[from].t_us) as f64 * 1e-6;
                (given[from + 1].v - given[from].v) / duration_s
            })
        };
        let points = (0..given.len()).map(|index| {
            let (station_m, speed_mps) = (stations_m[index], given[index].v);
            let acceleration_mps2 = acceleration_mps2(index);
            (given[index].t_us as f64 * 1e-6, Point { station_m, speed_mps, acceleration_mps2 })
        });
        Course { guide, points: points.collect(), helm: Helm::default() }
    }

    /// The point at a time; after the last it brakes to rest, and stands. What stands is held by the brake (see
    /// `Pedals::acceleration_mps2`).
    fn at(&self, time_s: f64) -> Point {
        let (last_s, last) = self.points[self.points.len() - 1];
        let beyond_s = time_s - last_s;
        if beyond_s >= 0.0 {
            let stop_s = (last.speed_mps / AFTER_MPS2).min(beyond_s);
            let way_m = last.speed_mps * stop_s - AFTER_MPS2 * stop_s * stop_s / 2.0;
            let speed_mps = last.speed_mps - AFTER_MPS2 * stop_s;
            let acceleration_mps2 = if speed_mps > 0.0 { -AFTER_MPS2 } else { 0.0 };
            return Point { station_m: last.station_m + way_m, speed_mps, acceleration_mps2 };
        }
        let after = self.points.partition_point(|(at_s, _)| *at_s <= time_s).clamp(1, self.points.len() - 1);
        let ((from_s, from), (to_s, to)) = (self.points[after - 1], self.points[after]);
        from.mixed(&to, ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::external::message::TrajectoryPoint;
    use avastra_world::sim::pedals_for;

    #[test]
    fn a_trajectory_that_ends_at_rest_is_held_there() {
        let point = |t_us: u64, x: f64, v: f64| TrajectoryPoint { t_us, x, y: 0.0, heading: 0.0, v, a: None };
        for points in [
            vec![point(0, 0.0, 0.0), point(1_000_000, 0.0, 0.0)],
            vec![point(0, 0.0, 2.0), point(1_000_000, 1.0, 0.0)],
            vec![point(0, 0.0, 2.0), point(1_000_000, 2.0, 2.0)],
        ] {
            let course = Course::new(&TrajectoryMessage { seq: 0, points, internal: None });
            let mut pedals = Pedals::new(&PedalsConfig::default());
            let plan = [5.0, 5.0 + pedals.preview_s()].map(|at_s| course.at(at_s));
            // It has stopped half a metre short: there is no creeping on.
            let wanted_mps2 = pedals.acceleration_mps2(plan, plan[0].station_m - 0.5, 0.0);
            assert!(pedals_for(wanted_mps2).1 > 0.0, "the brake is on: {wanted_mps2}");
        }
    }
}
