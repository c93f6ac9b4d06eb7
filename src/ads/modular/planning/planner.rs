//! One planning cycle: chooses the path, collects the constraints and plans a speed under them.
//!
//! The most restrictive acceleration is taken, and the same law is rolled forward for 8 s, which
//! gives the trajectory.

use std::sync::Arc;

use crate::ads::guide::Guide;
use crate::ads::status::{Manoeuvre, Reason};
use crate::geometry::{Pose, Span};
use crate::sim::{Scene, SignalColour, VehicleParameters};

use super::super::config::{ModularConfig, PlanningConfig, Weaknesses};
use super::super::junctions::Junctions;
use super::super::prediction::Forecast;
use super::corridor::Claim;
use super::lane_change::LaneChanges;
use super::lights::Lights;
use super::nudge::LateralPlan;
use super::speed::{Constraint, Point, Trajectory};
use super::standing::Standing;
use super::{kept_clear, speed};

/// Claims and lights that begin farther ahead do not matter yet, m. Apollo's ST graph ends at 100.
pub(super) const HORIZON_M: f64 = 100.0;
/// A road user that moves along the route with more than this part of its speed is a leader; otherwise it
/// crosses. Cosine of 60°.
const ALONG_COSINE: f64 = 0.5;
/// Traffic beside that is slower by more than this falls back by itself, m/s.
const FALLS_BACK_MPS: f64 = 2.0;

#[derive(Debug, Clone)]
pub struct Planner {
    config: PlanningConfig,
    weaknesses: Weaknesses,
    scene: Arc<Scene>,
    guide: Arc<Guide>,
    junctions: Arc<Junctions>,
    lateral: LateralPlan,
    changes: LaneChanges,
    lights: Lights,
    standing: Standing,
    manoeuvre: Manoeuvre,
    trajectory: Trajectory,
    claims: Vec<Claim>,
    constraints: Vec<Constraint>,
}

/// What a cycle plans from.
#[derive(Debug)]
pub struct Outlook<'a> {
    /// Where the vehicle believes it is.
    pub localized: &'a Pose,
    pub station_m: f64,
    pub speed_mps: f64,
    /// Age of the last plan, s.
    pub since_s: f64,
    pub forecasts: &'a [Forecast],
    /// What is known of the light of each stop line of the route.
    pub lights: &'a [Option<SignalColour>],
}

impl Planner {
    pub fn new(config: &ModularConfig, scene: &Arc<Scene>, junctions: &Arc<Junctions>) -> Planner {
        let weaknesses = config.weaknesses;
        let config = without_absent(&config.planning, &weaknesses);
        let changes = LaneChanges::new(scene);
        Planner {
            guide: Arc::new(changes.guide(&config)),
            lights: Lights::new(&config, scene),
            config,
            weaknesses,
            scene: Arc::clone(scene),
            junctions: Arc::clone(junctions),
            lateral: LateralPlan::default(),
            changes,
            standing: Standing::default(),
            manoeuvre: Manoeuvre::LaneFollow,
            trajectory: Trajectory::default(),
            claims: Vec::new(),
            constraints: Vec::new(),
        }
    }

    /// The guide along the lanes that are driven now; replaced when a lane change begins.
    pub fn guide(&self) -> &Arc<Guide> {
        &self.guide
    }

    /// Where beside the guide the path lies.
    pub fn lateral(&self) -> &LateralPlan {
        &self.lateral
    }

    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    pub fn manoeuvre(&self) -> Manoeuvre {
        self.manoeuvre
    }

    pub fn plan(&mut self, outlook: &Outlook) {
        let &Outlook { station_m, speed_mps, since_s, .. } = outlook;
        // Going on from the planned and not from the measured acceleration keeps the jerk bounded.
        let acceleration_mps2 = self.trajectory.at(since_s).acceleration_mps2;
        self.choose_path(outlook);
        let beside = self.guide.locate(outlook.localized.position, Some(station_m));
        let off_m = beside.offset_m - self.lateral.aside(station_m).offset_m;
        if off_m.abs() > self.config.lost_offset_m {
            self.trajectory = Trajectory::braking(station_m, speed_mps, self.config.fallback_mps2);
            return;
        }
        let start = Point { station_m, speed_mps, acceleration_mps2 };
        self.collect(outlook, &start);
        self.roll(start);
        let known = self.constraints.len();
        if !self.config.never_yields {
            for (index, claim) in self.claims.iter().enumerate() {
                self.constraints.extend(self.in_conflict(claim, index, &start));
            }
        }
        if self.constraints.len() > known {
            self.roll(start);
        }
        if !self.trajectory.keeps_clear(&self.constraints, &self.claims) {
            // Weakness (i); without it, this braking is as hard as that of the plan before.
            let emergency_mps2 = self.config.fallback_mps2.min(self.config.emergency_mps2);
            let config = PlanningConfig { emergency_mps2, ..self.config };
            let trajectory = &mut self.trajectory;
            speed::roll(&config, &self.guide, start, &self.constraints, &self.claims, trajectory);
        }
    }

    /// Lane, lane change or a shift within the lane.
    fn choose_path(&mut self, outlook: &Outlook) {
        let &Outlook { station_m, speed_mps, forecasts, .. } = outlook;
        self.standing.update(forecasts);
        if self.changes.seek(&self.config, &self.guide, station_m, speed_mps, forecasts) {
            self.guide = Arc::new(self.changes.guide(&self.config));
        }
        self.manoeuvre = if self.changes.under_way(station_m) {
            Manoeuvre::LaneChange
        } else {
            let (config, scene, guide) = (&self.config, &self.scene, &self.guide);
            self.lateral.update(config, scene, guide, station_m, speed_mps, forecasts);
            match (self.lateral.passing(), self.changes.due(station_m)) {
                (Some((id, _)), _) => Manoeuvre::Nudge(id),
                (None, Some(_)) => Manoeuvre::AwaitGap,
                (None, None) => Manoeuvre::LaneFollow,
            }
        };
    }

    /// Collects the constraints of rules and of road users on the way already. They decide when crossings
    /// ahead are reached, so they come before the constraints of crossing road users.
    fn collect(&mut self, outlook: &Outlook, start: &Point) {
        let &Outlook { station_m, speed_mps, forecasts, .. } = outlook;
        let constraints = &mut self.constraints;
        constraints.clear();
        self.lights.constrain(station_m, speed_mps, outlook.lights, constraints);
        self.changes.constrain(constraints);
        let (config, scene, guide) = (&self.config, &self.scene, &self.guide);
        kept_clear::crosswalks(config, scene, guide, start, forecasts, &self.standing, constraints);
        self.claims.clear();
        let passed = self.lateral.passing().map(|(id, _)| id);
        for forecast in forecasts {
            // Weakness (f): a pedestrian who has stood for so long does not count.
            let ignored = self.standing.time_s(forecast.id) > config.standing_pedestrian_s;
            // The path leads past what is being passed.
            if ignored || (passed == Some(forecast.id) && !forecast.moving) {
                continue;
            }
            let ahead = station_m..station_m + HORIZON_M;
            let (lateral, buffer_m) = (&self.lateral, self.config.lateral_buffer_m);
            self.claims.extend(Claim::of(forecast, guide, lateral, &ahead, buffer_m));
        }
        if self.weaknesses.closest_static_only {
            self.keep_closest_static(station_m);
        }
        kept_clear::keep_clear(&self.config, &self.junctions, start, &self.claims, &mut self.constraints);
        for (index, claim) in self.claims.iter().enumerate().filter(|(_, claim)| claim.is_now()) {
            self.constraints.extend(self.in_the_way(claim, index, start));
        }
    }

    /// Weakness (e): keeps only the closest of all standing objects, which may be the one that is just
    /// being passed.
    fn keep_closest_static(&mut self, station_m: f64) {
        let rear_m = VehicleParameters::MKZ.rear_m(station_m);
        let stands = |claim: &Claim| !claim.moving && claim.spans[0].to_m > rear_m;
        let passing = self.lateral.passing().map(|(_, span)| span).filter(|span| span.to_m > rear_m);
        let closest_m = self
            .claims
            .iter()
            .filter(|claim| stands(claim))
            .map(|claim| claim.spans[0].from_m)
            .chain(passing.map(|span| span.from_m))
            .fold(f64::INFINITY, f64::min);
        self.claims.retain(|claim| !stands(claim) || claim.spans[0].from_m <= closest_m);
    }

    fn roll(&mut self, start: Point) {
        let trajectory = &mut self.trajectory;
        speed::roll(&self.config, &self.guide, start, &self.constraints, &self.claims, trajectory);
    }

    /// Why the present plan does what it does.
    pub fn reason(&self) -> Reason {
        self.trajectory.reason
    }

    /// STOP or FOLLOW: for road users that are on the way now and stand or go along it.
    fn in_the_way(&self, claim: &Claim, index: usize, start: &Point) -> Option<Constraint> {
        let config = &self.config;
        let span = claim.spans[0];
        if span.middle_m() < VehicleParameters::MKZ.front_m(start.station_m) - 1.0 {
            return self.lets_in(claim, &span, start).then(|| Constraint::follow(claim.id, index));
        }
        if claim.speed_mps < config.static_mps || !claim.moving {
            return Some(Constraint::stop(config, claim.id, span.from_m));
        }
        (claim.cosine > ALONG_COSINE).then(|| Constraint::follow(claim.id, index))
    }

    /// Whether a road user beside the vehicle that has come or will come onto its way is let in. Under
    /// weakness (h) none is (Apollo issue 14633).
    fn lets_in(&self, claim: &Claim, span: &Span, point: &Point) -> bool {
        !self.weaknesses.blind_to_side_and_rear
            && claim.moving
            && claim.cosine > ALONG_COSINE
            && span.to_m > VehicleParameters::MKZ.rear_m(point.station_m)
            && claim.speed_mps > point.speed_mps - FALLS_BACK_MPS
    }

    /// FOLLOW or YIELD or, as `None`, OVERTAKE: for road users that move onto or across the way.
    ///
    /// There is a conflict if both would be at one place less than `conflict_buffer_s` apart. The
    /// ego vehicle goes first only if it would be past by that buffer, or if it can no longer stop and
    /// would still be past.
    fn in_conflict(&self, claim: &Claim, index: usize, start: &Point) -> Option<Constraint> {
        let (config, trajectory) = (&self.config, &self.trajectory);
        let along = claim.cosine > ALONG_COSINE;
        if !claim.moving || (claim.is_now() && along) {
            return None;
        }
        let step = claim.first_conflict(trajectory, config.conflict_buffer_s)?;
        let entry = claim.spans[claim.first];
        let past = |time_s: f64| entry.to_m < VehicleParameters::MKZ.rear_m(trajectory.at(time_s).station_m);
        if along {
            let then = trajectory.at(claim.entry_s());
            let beside = entry.middle_m() < VehicleParameters::MKZ.front_m(then.station_m) - 1.0;
            let follows = !beside || self.lets_in(claim, &entry, &then);
            return follows.then(|| Constraint::follow(claim.id, index));
        }
        let meeting = claim.spans[step];
        let room_m = meeting.from_m - VehicleParameters::MKZ.front_m(start.station_m);
        let too_late = start.speed_mps * start.speed_mps > 2.0 * config.emergency_mps2 * room_m.max(0.0);
        if past(claim.entry_s() - config.conflict_buffer_s) || (too_late && past(claim.entry_s())) {
            return None;
        }
        // It crosses behind the front bumper: the best is to drive on.
        if claim.cosine > -ALONG_COSINE && room_m < 0.0 {
            return None;
        }
        let until_s = claim.exit_s() + config.conflict_buffer_s;
        Some(Constraint::give_way(config, claim.id, meeting.from_m, until_s))
    }
}

/// The settings without what belongs to weaknesses that are switched off.
fn without_absent(config: &PlanningConfig, weaknesses: &Weaknesses) -> PlanningConfig {
    let mut config = *config;
    if !weaknesses.bounded_jerk {
        config.jerk_mps3_down = JERK_MPS3_UNBOUNDED;
    }
    if !weaknesses.standing_pedestrian_ignored {
        config.standing_pedestrian_s = f64::INFINITY;
    }
    if !weaknesses.late_red_passed {
        config.red_light_mps2_max = f64::INFINITY;
    }
    if !weaknesses.gentle_fallback {
        config.fallback_mps2 = config.emergency_mps2;
    }
    config
}

/// Jerk that allows any change of acceleration between two points of a plan, m/s³.
const JERK_MPS3_UNBOUNDED: f64 = 1e4;
