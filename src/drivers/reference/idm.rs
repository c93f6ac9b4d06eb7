//! The intelligent driver model (Treiber, Hennecke, Helbing 2000) on the route, with true knowledge.
//!
//! It sees everything within 120 m, hidden or not, looking around ten times a second. Around the model stand
//! rules of our own. It stops at red and yellow lights where it can, and at stop signs. It brakes for road users
//! and objects on its way. It gives way to a road user that would cross its way at nearly the same time, unless
//! the ego vehicle has priority and the road user is not seen to take it (`giving_way`). Predictions are straight
//! lines at constant speed.
//!
//! It begins a lane change of the route once no vehicle in the target lane would have to brake hard for
//! the ego vehicle, nor the ego vehicle for it. This is the safety criterion of MOBIL (Kesting, Treiber, Helbing 2007).
//! Until then it stays in its lane and stops where a short change is just possible.

use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::{
    BESIDE_M, Guide, HALF_WAY_M, HARDEST_MPS2, Helm, LIGHT_MPS2, RouteChanges, Signs, SpeedRules, Steering,
    held_mps2, in_lane, speed_mps2,
};
use crate::status::{PerceivedObject, Reason, Status};
use avastra_base::geometry::{Beside, Pose, Vec2, unit_vector};
use avastra_base::kinematics::{Following, WANDER_M, needed_mps2};
use avastra_road::RouteLaneChange;
use avastra_world::sim::{Control, DT_S, Scene, Sensed, SensedObject, SignalColour, VehicleParameters};

use super::giving_way::goes_before;

/// The model's parameters, for towns. Ours.
const MODEL: Following =
    Following { gap_m_min: 3.0, time_gap_s: 1.5, acceleration_mps2: 2.0, comfortable_mps2: 3.0 };
/// Crossings are looked for this far ahead, in steps, s.
const LOOK_AHEAD_S: f64 = 6.0;
const LOOK_STEP_S: f64 = 0.25;
/// Least difference of the times at which two road users pass one place, s.
const CONFLICT_S: f64 = 1.0;
/// Gap from the front bumper to a stop line, and to the way of a crossing road user, m.
const LINE_GAP_M: f64 = 1.0;
const CROSSING_GAP_M: f64 = 3.0;
/// Greatest ratio of a guide's length to the difference of its stations: it is longer outside a bend, and
/// where it changes lanes.
const GUIDE_STRETCH_MAX: f64 = 1.5;

/// Braking that a lane change may ask of any vehicle, magnitude, m/s².
const SAFE_MPS2: f64 = 2.0;

#[derive(Debug, Clone)]
pub struct Idm {
    scene: Arc<Scene>,
    changes: RouteChanges,
    /// A glance aside, newer than what it is shown, left no gap: no lane change begins.
    is_beset: bool,
    steering: Arc<Steering>,
    helm: Helm,
    /// The road users and lines that it keeps away from, looked for every fifth tick.
    ahead: Vec<Ahead>,
    signs: Signs,
    status: Status,
}

/// Something to keep away from, as the model sees it.
#[derive(Debug, Clone)]
struct Ahead {
    /// Station of its near end when it was looked at, m.
    near_m: f64,
    /// Time since then, s.
    age_s: f64,
    speed_mps: f64,
    reason: Reason,
}

/// Number of moments at which crossings are looked for.
const LOOKS: usize = (LOOK_AHEAD_S / LOOK_STEP_S) as usize;

/// The stretch on which the ego vehicle may be about a moment.
#[derive(Debug, Clone, Copy)]
struct Reach {
    /// From now, s.
    time_s: f64,
    from_m: f64,
    to_m: f64,
}

impl Reach {
    /// The stretches of all moments, for a speed, the one that is wanted, and a place of the front bumper.
    fn of_moments(speed_mps: f64, cruise_mps: f64, front_m: f64) -> [Reach; LOOKS] {
        let rear_m = front_m - VehicleParameters::MKZ.length_m;
        core::array::from_fn(|index| {
            let time_s = (index + 1) as f64 * LOOK_STEP_S;
            // A slow ego vehicle may speed up meanwhile.
            let reach_s = time_s + CONFLICT_S;
            let way_m = (speed_mps * reach_s + reach_s * reach_s).min(cruise_mps * reach_s);
            let from_m = rear_m + speed_mps * (time_s - CONFLICT_S).max(0.0);
            Reach { time_s, from_m, to_m: front_m + way_m }
        })
    }
}

impl Ahead {
    /// Something that stands, as seen now.
    fn standing(near_m: f64, reason: Reason) -> Ahead {
        Ahead { near_m, age_s: 0.0, speed_mps: 0.0, reason }
    }

    /// A line to stop at, as something that stands a little behind it.
    fn at_line(line_m: f64, reason: Reason) -> Ahead {
        Ahead::standing(line_m - LINE_GAP_M + MODEL.gap_m_min, reason)
    }

    fn gap_m(&self, front_m: f64) -> f64 {
        self.near_m + self.speed_mps * self.age_s - front_m
    }
}

impl Idm {
    pub fn new(scene: &Arc<Scene>) -> Idm {
        Idm {
            scene: Arc::clone(scene),
            changes: RouteChanges::new(scene, SpeedRules::on(scene)),
            is_beset: false,
            steering: Steering::usual(),
            helm: Helm::default(),
            ahead: Vec::new(),
            signs: Signs::default(),
            status: Status::default(),
        }
    }

    fn acceleration_mps2(&self, sensed: &Sensed, station_m: f64) -> (f64, Reason) {
        let speed_mps = sensed.ego.speed_mps;
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let allowed_mps = self.guide().allowed_mps(station_m, speed_mps);
        let mut wanted = (model_mps2(speed_mps, allowed_mps, None), Reason::Cruise);
        for ahead in &self.ahead {
            let gap = Some((ahead.gap_m(front_m), ahead.speed_mps));
            let acceleration_mps2 = model_mps2(speed_mps, allowed_mps, gap);
            if acceleration_mps2 < wanted.0 {
                wanted = (acceleration_mps2, ahead.reason);
            }
        }
        (wanted.0.max(-HARDEST_MPS2), wanted.1)
    }

    /// Looks around, every fifth tick.
    fn look(&mut self, sensed: &Sensed, station_m: f64) {
        for ahead in &mut self.ahead {
            ahead.age_s += DT_S;
        }
        if !self.helm.looks() {
            return;
        }
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        self.seek_gap(sensed, station_m);
        let mut ahead = core::mem::take(&mut self.ahead);
        ahead.clear();
        ahead.extend(self.lights(sensed, front_m));
        let sign = self.signs.next_stop(&self.scene, front_m, sensed.ego.speed_mps);
        ahead.extend(sign.map(|stop| Ahead::at_line(stop.station_m, stop.reason)));
        let objects = || sensed.objects.iter().filter(|object| object.distance_m < self.scene.range_m);
        let reaches =
            Reach::of_moments(sensed.ego.speed_mps, SpeedRules::on(&self.scene).cruise_mps, front_m);
        ahead.extend(objects().filter_map(|object| self.ahead(sensed, object, front_m, &reaches)));
        // Where it must wait for a gap.
        let wait_m = self.changes.wait_m();
        ahead.extend(wait_m.map(|wait_m| Ahead::standing(wait_m + MODEL.gap_m_min, Reason::LaneChange)));
        self.ahead = ahead;
        // It drives by the truth.
        self.status.perceive(objects().map(PerceivedObject::as_it_is));
    }

    /// Begins the next lane change if it is time and there is a gap.
    fn seek_gap(&mut self, sensed: &Sensed, station_m: f64) {
        let Some(change) = self.changes.next() else { return };
        let is_over = self.changes.last_end_m().is_none_or(|end_m| station_m >= end_m);
        let has_gap =
            || has_gap(self.guide(), &sensed.objects, sensed.ego.speed_mps, station_m, change.lateral_m);
        if is_over && station_m >= change.begin_m && !self.is_beset && has_gap() {
            self.changes.begin(station_m);
        }
    }

    /// Lights that it stops for.
    fn lights<'a>(&'a self, sensed: &'a Sensed, front_m: f64) -> impl Iterator<Item = Ahead> + 'a {
        let speed_mps = sensed.ego.speed_mps;
        self.scene.route.stop_lines.iter().filter_map(move |line| {
            let distance_m = line.station_m - front_m;
            let stops = sensed.signals[line.signal] != SignalColour::Green
                && (-LINE_GAP_M..self.scene.range_m).contains(&distance_m)
                && needed_mps2(speed_mps, distance_m.max(0.1)) <= LIGHT_MPS2;
            stops.then_some(Ahead::at_line(line.station_m, Reason::RedLight))
        })
    }

    /// The role of a road user for the ego vehicle: a leader, an obstacle in the way, or a crossing road user.
    fn ahead(
        &self,
        sensed: &Sensed,
        object: &SensedObject,
        front_m: f64,
        reaches: &[Reach; LOOKS],
    ) -> Option<Ahead> {
        let rear_m = front_m - VehicleParameters::MKZ.length_m;
        let forward = unit_vector(object.pose.heading_rad);
        let taken = |beside: &Beside| beside.taken(forward, object.length_m, object.width_m, HALF_WAY_M);
        let reach_m = HALF_WAY_M + (object.length_m + object.width_m) / 2.0;
        let behind_m = if self.scene.is_motorway { self.scene.range_m } else { 10.0 };
        let (position, from_m) = (object.pose.position, rear_m - behind_m);
        let to_m = front_m + self.scene.range_m;
        let mut tracer = self.guide().trace(position, from_m, to_m, reach_m);
        if let Some((beside, span)) = tracer.first().and_then(|beside| Some((beside, taken(&beside)?))) {
            // On a motorway a vehicle behind keeps its distance, also on the way into the lane. Once its middle is behind the
            // front, the ego vehicle is past it.
            let follows = self.scene.is_motorway && beside.station_m < rear_m;
            return (!follows && span.middle_m() > front_m - BESIDE_M).then(|| Ahead {
                near_m: span.from_m,
                age_s: 0.0,
                speed_mps: object.velocity_mps.dot(&beside.forward).max(0.0),
                reason: Reason::Follow(object.id),
            });
        }
        if object.velocity_mps == Vec2::zeros() {
            return None;
        }
        // On a motorway the road takes it along, elsewhere it is expected straight on.
        let seen = match self.scene.is_motorway {
            true => Some(self.guide().project(position, from_m, to_m)),
            false if !tracer.may_reach(LOOK_AHEAD_S * object.velocity_mps.norm()) => return None,
            false => None,
        };
        if seen.is_some_and(|beside| beside.station_m < rear_m) {
            return None;
        }
        let expected = |time_s: f64| match &seen {
            Some(beside) => self.guide().expected(object, beside, time_s),
            None => position + object.velocity_mps * time_s,
        };
        let front = self.guide().position_at(front_m);
        for &Reach { time_s, from_m: ego_from_m, to_m: ego_to_m } in reaches {
            let position = expected(time_s);
            let within_m = GUIDE_STRETCH_MAX * (ego_to_m - front_m) + reach_m;
            if (position - front).norm_squared() > within_m * within_m {
                continue;
            }
            let Some(beside) = tracer.next(position) else { continue };
            let Some(span) = taken(&beside) else { continue };
            let (near_m, far_m) = (span.from_m, span.to_m);
            if near_m <= ego_to_m && far_m >= ego_from_m && near_m >= front_m {
                if goes_before(&self.scene, sensed, object, front_m) {
                    return None;
                }
                let speed_mps = object.velocity_mps.dot(&beside.forward).max(0.0);
                let near_m = near_m - speed_mps * time_s - CROSSING_GAP_M + MODEL.gap_m_min;
                return Some(Ahead { near_m, age_s: 0.0, speed_mps, reason: Reason::Yield(object.id) });
            }
        }
        None
    }

    /// Drives the route, but with the acceleration (m/s²) and reason that `decide` makes of the model's.
    pub(super) fn drive_with(
        &mut self,
        sensed: &Sensed,
        decide: impl FnOnce(f64, Reason) -> (f64, Reason),
    ) -> Control {
        let pose = &sensed.ego.rear_axle;
        if self.helm.is_first() {
            self.find_place(pose);
        }
        let station_m = self.helm.locate(self.changes.guide(), pose.position).station_m;
        self.look(sensed, station_m);
        let (model_mps2, model_reason) = self.acceleration_mps2(sensed, station_m);
        let (wanted_mps2, reason) = decide(model_mps2, model_reason);
        let acceleration_mps2 = held_mps2(sensed.ego.speed_mps, wanted_mps2, 0.0);
        let steer_rad = self.steering.steer_rad(self.guide(), pose, station_m, &sensed.ego);
        self.status.localized = Some(*pose);
        self.status.reason = reason;
        self.helm.command(Control::towards(acceleration_mps2, steer_rad), &sensed.ego, &mut self.status)
    }

    /// Looks aside at what is seen at this moment: unless that leaves a gap, no lane change begins in the next look.
    pub(super) fn glance(&mut self, seen: &[SensedObject], ego_mps: f64, station_m: f64) {
        let next = self.changes.next();
        let is_open =
            |change: &RouteLaneChange| has_gap(self.guide(), seen, ego_mps, station_m, change.lateral_m);
        self.is_beset = next.is_some_and(|change| !is_open(change));
    }

    /// Learns from the vehicle's place which lane changes of the route are begun or over, before its first look. A driver
    /// that goes on where another one was would otherwise take itself to be in the source lane. It would steer back to
    /// that lane, and an object ahead of it would count as beside its way.
    pub(super) fn find_place(&mut self, rear_axle: &Pose) {
        while let Some(change) = self.changes.next() {
            let beside = self.guide().locate(rear_axle.position, None);
            let is_aside = beside.offset_m * change.lateral_m.signum() > WANDER_M;
            if beside.station_m < change.begin_m || !is_aside {
                return;
            }
            let begun_m = change.begun_m(beside.station_m, beside.offset_m);
            self.changes.begin(begun_m);
        }
    }

    /// Gives up a lane change that was begun in thought alone, because the vehicle is still in the source lane.
    fn stay(&mut self, rear_axle: &Pose) {
        let Some((last, ..)) = self.changes.begun().last() else { return };
        let (mut changes, mut helm) = (self.changes.clone(), self.helm);
        changes.take_back(last);
        if helm.locate(changes.guide(), rear_axle.position).offset_m.abs() <= WANDER_M {
            self.changes = changes;
        }
    }

    /// The route that it drives on.
    pub(super) fn guide(&self) -> &Guide {
        self.changes.guide()
    }
}

impl Ads for Idm {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        self.drive_with(sensed, |acceleration_mps2, reason| (acceleration_mps2, reason))
    }

    fn status(&self) -> &Status {
        &self.status
    }

    fn take_over(&mut self, sensed: &Sensed) {
        self.stay(&sensed.ego.rear_axle);
    }
}

/// Whether gentle braking would do for every vehicle in the lane `lateral_m` to the left of a guide, and for the ego vehicle, if
/// the ego vehicle were in that lane now.
pub fn has_gap(
    guide: &Guide,
    objects: &[SensedObject],
    ego_mps: f64,
    station_m: f64,
    lateral_m: f64,
) -> bool {
    let front_m = VehicleParameters::MKZ.front_m(station_m);
    let rear_m = front_m - VehicleParameters::MKZ.length_m;
    objects.iter().all(|object| {
        let Some((span, along_mps)) = in_lane(guide, object, lateral_m, front_m) else { return true };
        let along_mps = along_mps.max(0.0);
        let needed_mps2 = if span.from_m > front_m {
            model_mps2(ego_mps, ego_mps.max(1.0), Some((span.from_m - front_m, along_mps)))
        } else if span.to_m < rear_m {
            model_mps2(along_mps, along_mps.max(1.0), Some((rear_m - span.to_m, ego_mps)))
        } else {
            return false;
        };
        needed_mps2 > -SAFE_MPS2
    })
}

/// The model's acceleration, m/s², with the gap (m) and speed (m/s) of what is ahead.
fn model_mps2(speed_mps: f64, allowed_mps: f64, ahead: Option<(f64, f64)>) -> f64 {
    let free = if speed_mps <= allowed_mps {
        MODEL.free_mps2(speed_mps, allowed_mps)
    } else {
        // The model scarcely brakes for a falling limit; this follows the limit as closely as it falls.
        speed_mps2(speed_mps, allowed_mps)
    };
    let Some((gap_m, ahead_mps)) = ahead else { return free };
    free.min(MODEL.acceleration_mps2) - MODEL.interaction_mps2(speed_mps, ahead_mps, gap_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Rig, TARGET_Y_M, two_lanes};

    #[test]
    fn on_a_free_road_it_changes_as_planned() {
        let mut rig = Rig::driven_by("idm", &two_lanes(200.0), 1, 8.0);
        rig.run(30.0);
        assert!((rig.place().y - TARGET_Y_M).abs() < 0.1, "{:?}", rig.place());
        assert!(rig.offset_m_max < 0.3, "{} m off the path", rig.offset_m_max);
    }

    #[test]
    fn it_goes_on_with_a_change_that_another_driver_has_begun() {
        let mut rig = Rig::driven_by("idm", &two_lanes(300.0), 1, 8.0);
        rig.sensed.ego.rear_axle = Pose::new(40.0, -4.0, 0.0);
        let lowest_m = rig.run_least(8.0, |rig| rig.place().y);
        assert!(lowest_m > -4.05, "back towards the source lane: {lowest_m}");
        assert!((rig.place().y - TARGET_Y_M).abs() < 0.1, "{:?}", rig.place());
    }
}
