//! From an answer to pedals and wheel: controls as they are, a trajectory by `modular`'s controllers, an acceleration
//! with steering along the route.
//!
//! A driving system that answers accelerations does not steer, so avastra makes the route's lane changes for it. A change
//! begins once there has been room for 1 s by the rule of `idm` (`has_gap`). Other road users do not see it coming: nothing in
//! the world shows what the ego vehicle is about to do.

use std::sync::Arc;

use crate::kit::{Guide, Helm, Pedals, PedalsConfig, Point, RouteChanges, SpeedRules, Steering};
use crate::reference::has_gap;
use avastra_base::geometry::{Pose, Vec2, wrap_angle};
use avastra_base::kinematics::needed_mps2;
use avastra_world::sim::{Control, EgoMotion, Scene, Sensed, VehicleParameters};

use super::message::{
    AccelerationMessage, Answer, ControlMessage, EXTREME_MPS2, LaneChangeWord, TrajectoryMessage,
};

/// Braking after the last point of a trajectory, magnitude, m/s².
const AFTER_MPS2: f64 = 3.0;
/// The brake while no answer comes, %: Apollo's, where the planner is late.
const LOST_BRAKE_PCT: f64 = 50.0;
/// Where it must wait for room, it begins to brake when this much is needed, m/s². Ours: comfortable.
const WAITS_MPS2: f64 = 2.0;

/// Obeys answers.
#[derive(Debug, Clone)]
pub struct Follower {
    route: Arc<Guide>,
    steering: Arc<Steering>,
    pedals: Pedals,
    /// Its station is on the route.
    pub helm: Helm,
    course: Option<Course>,
    changes: RouteChanges,
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
    pub fn new(scene: &Arc<Scene>) -> Follower {
        Follower {
            route: Arc::new(Guide::new(scene, &SpeedRules::NONE)),
            steering: Steering::usual(),
            pedals: Pedals::new(&PedalsConfig::default()),
            helm: Helm::default(),
            course: None,
            changes: RouteChanges::new(scene, SpeedRules::NONE),
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
    pub fn obey(&mut self, answer: &Answer, time_s: f64, pose: &Pose, sensed: &Sensed) -> Control {
        let motion = &sensed.ego;
        match answer {
            Answer::Control(control) => controls(control),
            Answer::Acceleration(wanted) => {
                if self.helm.looks() {
                    self.seek_room(wanted, sensed);
                }
                let station_m = self.helm.station_m();
                let steer_rad = self.steering.steer_rad(self.changes.guide(), pose, station_m, motion);
                Control::towards(self.before_change_mps2(wanted, motion), steer_rad)
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

    /// Pedals and wheel while no answer comes after this one: it brakes along the route, or, where the lane changes are made here, in
    /// its lane.
    pub fn lost(&self, last: Option<&Answer>, pose: &Pose, motion: &EgoMotion) -> Control {
        let guide = match last {
            Some(Answer::Acceleration(_)) => self.changes.guide(),
            _ => &self.route,
        };
        let steer_rad = self.steering.steer_rad(guide, pose, self.helm.station_m(), motion);
        Control { throttle_pct: 0.0, brake_pct: LOST_BRAKE_PCT, steer_rad }
    }

    /// Begins the next lane change of the route: when the driving system says so, or when there is room if it says nothing.
    fn seek_room(&mut self, wanted: &AccelerationMessage, sensed: &Sensed) {
        let (station_m, speed_mps) = (self.helm.station_m(), sensed.ego.speed_mps);
        match wanted.lane_change {
            Some(LaneChangeWord::Wait) => self.changes.wait(),
            Some(LaneChangeWord::Go) => self.changes.begin_if_due(station_m),
            None => self.changes.seek(station_m, speed_mps, |guide, change| {
                has_gap(guide, &sensed.objects, speed_mps, station_m, change.lateral_m)
            }),
        }
    }

    /// The wanted acceleration, m/s², or the braking after which it stands where the next lane change is just possible.
    fn before_change_mps2(&self, wanted: &AccelerationMessage, motion: &EgoMotion) -> f64 {
        let Some(wait_m) = self.changes.wait_m() else { return wanted.accel };
        let ahead_m = wait_m - VehicleParameters::MKZ.front_m(self.helm.station_m());
        let needed_mps2 = needed_mps2(motion.speed_mps, ahead_m.max(0.1));
        let waits = needed_mps2 > WAITS_MPS2 || ahead_m <= 0.1;
        if waits { wanted.accel.min(-needed_mps2.max(WAITS_MPS2)) } else { wanted.accel }
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

    /// The point at a time; after the last it brakes to rest, and stands. The brake holds a standing vehicle
    /// (see `Pedals::acceleration_mps2`).
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
    use avastra_lang::model::vocabulary::Body;
    use avastra_road::RouteLaneChange;
    use avastra_world::sim::pedals_for;

    use crate::driver::Ads;
    use crate::status::Status;
    use crate::testing::{Rig, SOURCE_Y_M, TARGET_Y_M, object, two_lanes};

    /// A driving system that keeps its speed by accelerations, and says this of lane changes.
    #[derive(Clone)]
    struct Keeps {
        follower: Follower,
        says: Option<LaneChangeWord>,
        status: Status,
    }

    impl Keeps {
        /// At 8 m/s on a road of two lanes whose route goes over to the left one at once.
        fn rig(open_m: f64, says: Option<LaneChangeWord>) -> Rig {
            let scene = two_lanes(open_m);
            let keeps = Keeps { follower: Follower::new(&scene), says, status: Status::default() };
            Rig::new(&scene, Box::new(keeps), 8.0)
        }
    }

    impl Ads for Keeps {
        fn drive(&mut self, sensed: &Sensed) -> Control {
            let pose = sensed.ego.rear_axle;
            self.follower.locate(&pose);
            let accel = 8.0 - sensed.ego.speed_mps;
            let answer = AccelerationMessage { seq: 0, accel, lane_change: self.says, internal: None };
            let control = self.follower.obey(&Answer::Acceleration(answer), sensed.time_s, &pose, sensed);
            self.follower.helm.command(control, &sensed.ego, &mut self.status)
        }

        fn status(&self) -> &Status {
            &self.status
        }
    }

    fn is_at(rig: &Rig, y_m: f64) -> bool {
        (rig.place().y - y_m).abs() < 0.3
    }

    #[test]
    fn one_that_overtakes_passes_before_the_lane_is_changed() {
        let mut rig = Keeps::rig(300.0, None);
        rig.sensed.objects = vec![object(1, Body::Sedan, Pose::new(-15.0, TARGET_Y_M, 0.0), 13.0)];
        rig.run(1.0);
        assert!(is_at(&rig, SOURCE_Y_M), "{:?}", rig.place());
        rig.run(20.0);
        assert!(is_at(&rig, TARGET_Y_M) && rig.gap_m_min > 1.0, "{:?}, {} m", rig.place(), rig.gap_m_min);
    }

    #[test]
    fn a_lane_change_waits_for_room_where_it_is_just_possible() {
        let mut rig = Keeps::rig(100.0, None);
        let stands =
            |nth: u32| object(nth + 1, Body::Sedan, Pose::new(f64::from(nth) * 8.0, TARGET_Y_M, 0.0), 0.0);
        rig.sensed.objects = (0..14).map(stands).collect();
        rig.run(30.0);
        let wait_m = rig.scene.route.changes[0].latest_m - RouteLaneChange::LENGTH_M_MIN;
        let place = rig.place();
        assert!(
            is_at(&rig, SOURCE_Y_M) && (wait_m - 6.0..wait_m + 1.0).contains(&place.x),
            "{place:?}, {wait_m}"
        );
        for object in &mut rig.sensed.objects {
            object.velocity_mps = Vec2::new(9.0, 0.0);
        }
        rig.run(40.0);
        assert!(is_at(&rig, TARGET_Y_M) && rig.gap_m_min > 1.0, "{:?}, {} m", rig.place(), rig.gap_m_min);
    }

    #[test]
    fn a_driving_system_may_hold_a_lane_change_and_may_make_it_itself() {
        let mut waits = Keeps::rig(100.0, Some(LaneChangeWord::Wait));
        waits.run(30.0);
        assert!(is_at(&waits, SOURCE_Y_M) && waits.speed_mps() < 0.1, "{:?}", waits.place());
        // The vehicle changes lanes whatever is there: the other one is beside it all the time.
        let mut goes = Keeps::rig(300.0, Some(LaneChangeWord::Go));
        goes.sensed.objects = vec![object(1, Body::Sedan, Pose::new(0.0, TARGET_Y_M, 0.0), 8.0)];
        goes.run(15.0);
        assert!(is_at(&goes, TARGET_Y_M), "{:?}", goes.place());
        // Without other road users, too, the change begins only once the lane has been clear for 1 s.
        let mut free = Keeps::rig(300.0, None);
        free.run(0.9);
        let begins_m = free.place().y;
        free.run(15.0);
        assert!(
            (begins_m - SOURCE_Y_M).abs() < 0.05 && is_at(&free, TARGET_Y_M),
            "{begins_m}, {:?}",
            free.place()
        );
    }

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
