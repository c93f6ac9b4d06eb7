//! The cycle: look, forecast, sample, choose; and every tick, follow what was chosen.

use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::{HOLD_MPS2, Helm, Point, Sight, Signs, Steering, Stop, crosswalks, lights};
use crate::status::{Manoeuvre, PerceivedObject, Reason, Status};
use avastra_world::sim::{Control, FRAME_S, Scene, Sensed, VehicleParameters};

use super::lateral::{Lanes, Lateral};
use super::proposal::{MODEL, Outlook, Proposal, SPEED_PARTS, STEP_S, STEPS};
use super::traffic::Other;

/// A collision sooner than this is braked for as hard as possible, s (PDM-Closed). There only below 5 m/s and
/// with 4.05 m/s²; at every speed and with all brakes is ours.
const EMERGENCY_S: f64 = 2.0;
/// The plan is read this far ahead to make up for the lag of the pedals, s. Ours.
const PREVIEW_S: f64 = 0.16;
/// Gain from the error of the speed to the acceleration, 1/s. Ours.
const SPEED_GAIN: f64 = 1.0;
/// A vehicle farther beside its plan, or of another speed, begins anew from where it is, m and m/s. Ours.
const LOST_M: f64 = 0.5;
const LOST_MPS: f64 = 1.0;
/// So slow a vehicle rests, m/s, if its plan leads no farther than this, m: the driver model creeps. Ours.
const REST_MPS: f64 = 0.3;
const CREEP_M: f64 = 1.0;

/// The driving system.
#[derive(Debug, Clone)]
pub struct Frenet {
    scene: Arc<Scene>,
    lanes: Lanes,
    steering: Arc<Steering>,
    sight: Sight,
    signs: Signs,
    /// The plan of the last look, which is driven; `None` before the first.
    plan: Option<Proposal>,
    helm: Helm,
    others: Vec<Other>,
    stops: Vec<Stop>,
    sampled: Vec<Lateral>,
    proposals: Vec<Proposal>,
    status: Status,
}

impl Frenet {
    pub fn new(scene: &Arc<Scene>) -> Frenet {
        Frenet {
            scene: Arc::clone(scene),
            lanes: Lanes::new(scene),
            steering: Steering::usual(),
            // A LiDAR sees by night as by day.
            sight: Sight::new(scene, 1.0),
            signs: Signs::default(),
            plan: None,
            helm: Helm::default(),
            others: Vec::new(),
            stops: Vec::new(),
            sampled: Vec::new(),
            proposals: Vec::new(),
            status: Status::default(),
        }
    }

    /// One cycle.
    fn cycle(&mut self, sensed: &Sensed, station_m: f64, offset_m: f64) {
        self.sight.look(sensed);
        let start = self.start(sensed, station_m);
        let now = self.course(station_m, offset_m);
        let now = self.lanes.cross(now, station_m, offset_m);
        let guide = Arc::clone(self.lanes.guide());
        self.others.clear();
        let known = self.sight.known().iter();
        self.others
            .extend(known.filter_map(|object| Other::seen(&self.scene.map, &guide, object, station_m)));
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        self.stops.clear();
        self.stops.extend(lights(&self.scene, sensed, front_m));
        self.stops.extend(self.signs.next_stop(&self.scene, front_m, start.speed_mps));
        self.stops.extend(crosswalks(&self.scene, &guide, self.sight.known(), front_m, start.speed_mps));
        // The model stops a gap before such a place, so it is put a gap beyond the place to wait at.
        let wait = self.lanes.changes().wait_m().map(|wait_m| wait_m + MODEL.gap_m_min);
        self.stops.extend(wait.map(|station_m| Stop { station_m, reason: Reason::LaneChange }));

        self.lanes.sample(&now, station_m, start.speed_mps, &self.others, &mut self.sampled);
        let limit_mps = self.lanes.limit_mps(station_m);
        let outlook = Outlook { guide: &guide, others: &self.others, stops: &self.stops, start, limit_mps };
        self.proposals.clear();
        for (part, profile) in SPEED_PARTS.iter().zip(outlook.profiles()) {
            self.proposals.extend(self.sampled.iter().map(|lateral| outlook.roll(*lateral, *part, &profile)));
        }
        let plan = chosen(&outlook, &self.proposals, now);
        self.report(sensed, &plan, station_m);
        self.plan = Some(plan);
    }

    /// Where the new plan begins: at the speed that is driven, with the acceleration that was planned.
    fn start(&self, sensed: &Sensed, station_m: f64) -> Point {
        let speed_mps = sensed.ego.speed_mps;
        let planned = self.plan.as_ref().map(|plan| planned_at(plan, FRAME_S));
        let acceleration_mps2 = match planned {
            Some(planned) if (planned.speed_mps - speed_mps).abs() < LOST_MPS => planned.acceleration_mps2,
            _ => sensed.ego.acceleration_mps2,
        };
        Point { station_m, speed_mps, acceleration_mps2 }
    }

    /// The lateral curve that is driven, or one from where the vehicle is, if it has lost it.
    fn course(&self, station_m: f64, offset_m: f64) -> Lateral {
        let course = self.plan.as_ref().map(|plan| plan.lateral);
        let kept = course.filter(|course| (course.aside(station_m).offset_m - offset_m).abs() < LOST_M);
        kept.unwrap_or_else(|| Lateral::from(station_m, offset_m))
    }

    fn report(&mut self, sensed: &Sensed, plan: &Proposal, station_m: f64) {
        let changing = plan.lateral.changes_lane() || self.lanes.is_arriving(&plan.lateral, station_m);
        self.status.manoeuvre = match (changing, self.lanes.changes().due(station_m).is_some()) {
            (true, _) => Manoeuvre::LaneChange,
            (false, true) => Manoeuvre::AwaitGap,
            (false, false) => Manoeuvre::LaneFollow,
        };
        self.status.reason = plan.reason;
        let guide = self.lanes.guide();
        self.status.planned.clear();
        self.status.planned.extend(plan.points.iter().map(|point| {
            let offset_m = plan.lateral.aside(point.station_m).offset_m;
            guide.pose_at(point.station_m).offset(0.0, offset_m).position
        }));
        self.status.localized = Some(sensed.ego.rear_axle);
        self.status.perceive(self.sight.known().iter().map(PerceivedObject::as_it_is));
        for seen in &mut self.status.perceived {
            let other = self.others.iter().find(|other| Some(other.id) == seen.id);
            seen.predicted.extend(other.into_iter().flat_map(|other| other.predicted));
        }
    }
}

/// The proposal with the best score of those without a collision at fault. If all collide, the one that does
/// so last, or, if that is soon, braking along the present course.
fn chosen(outlook: &Outlook, proposals: &[Proposal], now: Lateral) -> Proposal {
    let free = || proposals.iter().filter(|proposal| proposal.collision.is_none());
    let most_m = free().map(Proposal::progress_m).fold(0.0, f64::max);
    if let Some(best) = free().max_by(|a, b| a.score(most_m).total_cmp(&b.score(most_m))) {
        let fastest = &proposals[proposals.len() - 1];
        let mut best = best.clone();
        // A slower proposal has its reason in what the fastest would collide with.
        if let (Reason::Cruise, Some((_, id))) = (best.reason, fastest.collision) {
            best.reason = Reason::Yield(id);
        }
        return best;
    }
    let latest = proposals.iter().max_by_key(|proposal| proposal.collision).expect("speeds were sampled");
    let (step, id) = latest.collision.expect("all collide");
    if step as f64 * STEP_S > EMERGENCY_S {
        let mut latest = latest.clone();
        latest.reason = Reason::Yield(id);
        return latest;
    }
    outlook.emergency(now, Reason::Emergency(id))
}

/// The place of a plan after a time.
fn planned_at(plan: &Proposal, time_s: f64) -> Point {
    let place = (time_s / STEP_S).clamp(0.0, STEPS as f64);
    let index = (place as usize).min(STEPS - 1);
    plan.points[index].mixed(&plan.points[index + 1], place - index as f64)
}

impl Ads for Frenet {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let ego = &sensed.ego;
        let beside = self.helm.locate(self.lanes.guide(), ego.rear_axle.position);
        let station_m = beside.station_m;
        if self.helm.looks() {
            self.cycle(sensed, station_m, beside.offset_m);
        }
        let plan = self.plan.as_ref().expect("the first tick plans");
        let since_s = self.helm.since_look_s();
        let (here, ahead) = (planned_at(plan, since_s), planned_at(plan, since_s + PREVIEW_S));
        let mut acceleration_mps2 = ahead.acceleration_mps2 + SPEED_GAIN * (here.speed_mps - ego.speed_mps);
        if ego.speed_mps < REST_MPS && plan.progress_m() < CREEP_M {
            acceleration_mps2 = -HOLD_MPS2;
        }
        let aside = |at_m: f64| plan.lateral.aside(at_m);
        let steer_rad =
            self.steering.steer_aside_rad(self.lanes.guide(), &aside, &ego.rear_axle, station_m, ego);
        self.helm.command(Control::towards(acceleration_mps2, steer_rad), ego, &mut self.status)
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
