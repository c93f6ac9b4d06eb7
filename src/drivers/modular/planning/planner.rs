//! One planning cycle: chooses the path, collects what holds the vehicle back, decides about each road user,
//! drives the decisions, and checks what comes out.
//!
//! 1. *Path*: lane, lane change, or a shift past what stands.
//! 2. *Rules*: lights, crosswalks, junctions kept clear, the stages of turns and signs, what can be seen.
//! 3. *Decisions*: STOP for what stands on the way, FOLLOW for what drives along it; YIELD or OVERTAKE for all
//!    else, by the station-time graph (`decisions`).
//! 4. *Speed*: the law in `speed` is rolled forward for 8 s under all of them. An OVERTAKE holds only if the
//!    rolled trajectory passes in time.
//! 5. *Last check*: whatever was decided, the trajectory must touch nothing.

use std::sync::Arc;

use crate::kit::Guide;
use crate::status::{Manoeuvre, Reason};
use avastra_base::geometry::Pose;
use avastra_world::sim::{Conditions, Scene, SignalColour, VehicleParameters};

use super::super::config::{ModularConfig, PlanningConfig, Weaknesses};
use super::super::junctions::Junctions;
use super::super::prediction::Forecast;
use super::claim::{Claim, Role, Stance};
use super::decisions::Decisions;
use super::lane_change::LaneChanges;
use super::lights::Lights;
use super::nudge::LateralPlan;
use super::rights::RouteRights;
use super::sight_bound::SightBound;
use super::speed::Constraint;
use super::st_graph::Situation;
use super::stages::Stages;
use super::standing::Standing;
use super::trajectory::{Point, Trajectory};
use super::{HORIZON_M, kept_clear, speed};

/// Traffic beside that is slower by more than this falls back by itself, m/s.
const FALLS_BACK_MPS: f64 = 2.0;
/// Rounds in which a plan is mended: each keeps clear of one more road user.
const ROUNDS: usize = 3;
/// The last check counts what comes so near in time as a contact, s: predictions are half a second apart.
const CHECK_S: f64 = 0.25;
/// Room that the last check leaves, m.
const CHECK_ROOM_M: f64 = 1.0;

#[derive(Debug, Clone)]
pub struct Planner {
    config: PlanningConfig,
    weaknesses: Weaknesses,
    scene: Arc<Scene>,
    junctions: Arc<Junctions>,
    /// Where beside the guide the path lies.
    pub lateral: LateralPlan,
    changes: LaneChanges,
    lights: Lights,
    standing: Standing,
    rights: RouteRights,
    stages: Stages,
    sight: SightBound,
    pub manoeuvre: Manoeuvre,
    pub trajectory: Trajectory,
    claims: Vec<Claim>,
    constraints: Vec<Constraint>,
    decisions: Decisions,
}

/// The inputs of a planning cycle.
#[derive(Debug)]
pub struct Outlook<'a> {
    /// Where the vehicle believes it is.
    pub localized: &'a Pose,
    pub station_m: f64,
    pub speed_mps: f64,
    /// Age of the last plan, s.
    pub since_s: f64,
    pub forecasts: &'a [Forecast],
    /// The known colour of the light at each stop line of the route.
    pub lights: &'a [Option<SignalColour>],
    /// Weather and light, which the vehicle measures itself.
    pub conditions: &'a Conditions,
}

impl Planner {
    pub fn new(config: &ModularConfig, scene: &Arc<Scene>, junctions: &Arc<Junctions>) -> Planner {
        let weaknesses = config.weaknesses;
        let config = without_absent(&config.planning, &weaknesses);
        let rights = RouteRights::of(&config, scene);
        Planner {
            changes: LaneChanges::new(&config, scene),
            lights: Lights::new(&config, scene),
            config,
            weaknesses,
            scene: Arc::clone(scene),
            junctions: Arc::clone(junctions),
            lateral: LateralPlan::default(),
            standing: Standing::default(),
            stages: Stages::new(&config, scene, junctions, &rights),
            sight: SightBound::new(scene, &rights),
            rights,
            manoeuvre: Manoeuvre::LaneFollow,
            trajectory: Trajectory::default(),
            claims: Vec::new(),
            constraints: Vec::new(),
            decisions: Decisions::default(),
        }
    }

    /// The guide along the lanes that are driven now; replaced when a lane change begins.
    pub fn guide(&self) -> &Guide {
        self.changes.route.guide()
    }

    pub fn plan(&mut self, outlook: &Outlook) {
        let &Outlook { station_m, speed_mps, since_s, .. } = outlook;
        // Going on from the planned and not from the measured acceleration keeps the jerk bounded.
        let acceleration_mps2 = self.trajectory.at(since_s).acceleration_mps2;
        self.choose_path(outlook);
        let beside = self.guide().locate(outlook.localized.position, Some(station_m));
        let off_m = beside.offset_m - self.lateral.aside(station_m).offset_m;
        let start = Point { station_m, speed_mps, acceleration_mps2 };
        if off_m.abs() > self.config.lost_offset_m {
            self.trajectory = Trajectory::braking(start, self.config.fallback_mps2, Reason::Fallback);
            return;
        }
        self.collect(outlook, &start);
        self.decide(start);
        self.drive(start);
        self.check(start);
        self.decisions.remember(&self.claims);
    }

    /// Lane, lane change or a shift within the lane.
    fn choose_path(&mut self, outlook: &Outlook) {
        let &Outlook { station_m, speed_mps, forecasts, .. } = outlook;
        self.standing.update(forecasts);
        if let Some((off_m, slope)) = self.changes.break_off(&self.config, station_m, speed_mps, forecasts) {
            self.lateral.return_from(station_m, speed_mps, off_m, slope);
        } else if !self.lateral.is_returning() {
            self.changes.seek(&self.config, station_m, speed_mps, forecasts);
        }
        self.manoeuvre = if self.changes.route.is_under_way(station_m) {
            Manoeuvre::LaneChange
        } else {
            let (config, scene, guide) = (&self.config, &self.scene, self.changes.route.guide());
            self.lateral.update(config, scene, guide, station_m, speed_mps, forecasts);
            match (self.lateral.passing(), self.changes.route.due(station_m)) {
                (Some((id, _)), _) => Manoeuvre::Nudge(id),
                (None, Some(_)) => Manoeuvre::AwaitGap,
                (None, None) => Manoeuvre::LaneFollow,
            }
        };
    }

    /// Collects the constraints of rules, and what road users claim of the way.
    fn collect(&mut self, outlook: &Outlook, start: &Point) {
        let &Outlook { station_m, forecasts, .. } = outlook;
        let constraints = &mut self.constraints;
        constraints.clear();
        self.lights.constrain(start, outlook.lights, constraints);
        self.changes.constrain(constraints);
        let (config, scene, guide) = (&self.config, &self.scene, self.changes.route.guide());
        kept_clear::crosswalks(config, scene, guide, start, forecasts, &self.standing, constraints);
        let ahead = station_m..station_m + HORIZON_M;
        let mut claims = core::mem::take(&mut self.claims);
        claims.clear();
        // The path leads past what is being passed.
        let others = forecasts.iter().filter(|forecast| !self.lateral.passes(forecast.id) || forecast.moving);
        claims.extend(others.filter_map(|forecast| {
            let claim = Claim::of(forecast, guide, &self.lateral, &ahead, config.lateral_buffer_m)?;
            self.matters(&claim, start).then_some(claim)
        }));
        claims.iter_mut().for_each(|claim| claim.owes_way = self.rights.owes_way(claim));
        self.claims = claims;
        if self.weaknesses.closest_static_only {
            self.keep_closest_static(station_m);
        }
        let (config, guide, constraints) = (&self.config, self.changes.route.guide(), &mut self.constraints);
        kept_clear::keep_clear(config, &self.junctions, start, &self.claims, constraints);
        self.stages.constrain(config, &self.weaknesses, start, &self.claims, constraints);
        self.sight.constrain(config, guide, start, outlook.conditions, forecasts, constraints);
    }

    /// Whether the plan reacts to a claim at all.
    fn matters(&self, claim: &Claim, start: &Point) -> bool {
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        let entry = claim.spans[claim.first];
        match claim.role(self.config.static_mps) {
            Role::Stands => entry.middle_m() >= front_m - 1.0,
            Role::Leads => entry.middle_m() >= front_m - 1.0 || lets_in(claim, start),
            Role::Merges | Role::Crosses if self.config.never_yields => false,
            // Apollo's speed bounds leave out what begins at the front bumper or behind it, but not at once.
            Role::Merges | Role::Crosses => {
                !self.weaknesses.blind_to_side_and_rear || claim.is_now() || entry.from_m > front_m
            }
        }
    }

    /// Weakness `closest_static_only`: keeps only the closest of all standing objects, which may be the one
    /// that is just being passed.
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

    /// STOP and FOLLOW for what is on the way already, a ranked decision about all else.
    fn decide(&mut self, start: Point) {
        let stop_m = self.constraints.iter().map(Constraint::stop_m).fold(f64::INFINITY, f64::min);
        for index in 0..self.claims.len() {
            let claim = &self.claims[index];
            if !claim.is_contested(&self.config) && claim.binds(&self.config) {
                self.constraints.extend(self.behind(index, &start));
            }
        }
        let situation = Situation {
            config: &self.config,
            guide: self.changes.route.guide(),
            start,
            stop_m,
            hysteresis: !self.weaknesses.decides_anew,
        };
        self.decisions.decide(&situation, &mut self.claims);
    }

    /// Rolls the law forward under the decisions, and yields to what cannot be passed before in time.
    fn drive(&mut self, start: Point) {
        for index in 0..self.claims.len() {
            if self.claims[index].stance == Stance::Yield {
                self.constraints.extend(self.behind(index, &start));
            }
        }
        self.roll(start);
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        for _ in 0..ROUNDS {
            let late = self.claims.iter().position(|claim| {
                let config = &self.config;
                let room_m = claim.near_m() - CHECK_ROOM_M - front_m;
                claim.stance == Stance::Overtake
                    && self.trajectory.meets(claim, config.conflict_buffer_s).is_some()
                    && kept_clear::can_stop(config, config.emergency_mps2, room_m, &start, 0.0)
            });
            let Some(index) = late else { return };
            self.claims[index].stance = Stance::Yield;
            self.constraints.extend(self.behind(index, &start));
            self.roll(start);
        }
    }

    /// The last check of a plan: whatever was decided, it brakes as hard as it must, up to the emergency limit,
    /// if it would touch anything that binds. If that is of no use, it takes the plan that keeps clear for
    /// longest.
    fn check(&mut self, start: Point) {
        let planned = self.constraints.len();
        for _ in 0..ROUNDS {
            let Some((index, time_s, near_m)) = self.first_contact(&start) else { return };
            let claim = &self.claims[index];
            let along = claim.role(self.config.static_mps) == Role::Leads;
            let until_s = if along { time_s + CHECK_S } else { claim.exit_s() + CHECK_S };
            let line = Constraint::last_line(claim.reason(&self.config), near_m - CHECK_ROOM_M, until_s);
            self.constraints.push(line);
            self.roll(start);
        }
        let Some((_, braking_for_s, _)) = self.first_contact(&start) else { return };
        let braking_reason = self.trajectory.reason;
        let all = core::mem::take(&mut self.constraints);
        let others = all[..planned].iter().filter(|constraint| !constraint.is_yielding());
        self.constraints.extend(others);
        self.roll(start);
        let goes_on_for_s = self.first_contact(&start).map_or(f64::INFINITY, |(_, time_s, _)| time_s);
        self.constraints = all;
        if goes_on_for_s > braking_for_s {
            return;
        }
        // As in the original, the fallback knows no bound on the jerk.
        let gentle = self.weaknesses.gentle_fallback;
        let decel_mps2 = if gentle { self.config.fallback_mps2 } else { self.config.emergency_mps2 };
        self.trajectory = Trajectory::braking(start, decel_mps2, braking_reason);
    }

    /// The first contact with what binds: index of the claim, time (s) and station (m). An object that the
    /// vehicle touches or is beside already does not count: no plan can keep clear of it.
    fn first_contact(&self, start: &Point) -> Option<(usize, f64, f64)> {
        let vehicle = VehicleParameters::MKZ;
        let (rear_m, front_m) = (vehicle.rear_m(start.station_m), vehicle.front_m(start.station_m));
        let contacts = self.claims.iter().enumerate().filter_map(|(index, claim)| {
            let beside = claim.is_now() && claim.spans[0].from_m < front_m && claim.spans[0].to_m > rear_m;
            if beside || !claim.binds(&self.config) || self.is_crept_to(claim) {
                return None;
            }
            let (time_s, near_m) = self.trajectory.meets(claim, CHECK_S)?;
            Some((index, time_s, near_m))
        });
        contacts.min_by(|(_, a_s, _), (_, b_s, _)| a_s.total_cmp(b_s))
    }

    fn roll(&mut self, start: Point) {
        let (guide, trajectory) = (self.changes.route.guide(), &mut self.trajectory);
        speed::roll(&self.config, guide, start, &self.constraints, &self.claims, trajectory);
    }

    /// The constraint that keeps the vehicle behind a road user, if there is room left before it.
    fn behind(&self, index: usize, start: &Point) -> Option<Constraint> {
        let (config, claim) = (&self.config, &self.claims[index]);
        match claim.role(config.static_mps) {
            Role::Stands if self.is_crept_to(claim) => {
                Some(Constraint::creep(config, claim.id, claim.spans[0].from_m))
            }
            Role::Stands => Some(Constraint::stop(config, claim.id, claim.spans[0].from_m)),
            Role::Leads | Role::Merges => Some(Constraint::follow(claim.id, index)),
            Role::Crosses => {
                let until_s = claim.exit_s() + config.conflict_buffer_s;
                let is_ahead = claim.near_m() > VehicleParameters::MKZ.front_m(start.station_m);
                is_ahead.then(|| Constraint::give_way(config, claim.id, claim.near_m(), until_s))
            }
        }
    }

    /// Weakness `creeps_to_standing_pedestrian`: a pedestrian who has stood for so long is crept towards.
    fn is_crept_to(&self, claim: &Claim) -> bool {
        claim.role(self.config.static_mps) == Role::Stands
            && self.standing.time_s(claim.id) > self.config.standing_pedestrian_s
    }
}

/// Whether a road user beside the vehicle that has come onto its way is let in: unless it is behind or falls
/// back by itself.
fn lets_in(claim: &Claim, start: &Point) -> bool {
    claim.spans[0].to_m > VehicleParameters::MKZ.rear_m(start.station_m)
        && claim.speed_mps > start.speed_mps - FALLS_BACK_MPS
}

impl Claim {
    fn reason(&self, config: &PlanningConfig) -> Reason {
        match self.role(config.static_mps) {
            Role::Stands => Reason::Stop(self.id),
            Role::Leads | Role::Merges => Reason::Follow(self.id),
            Role::Crosses => Reason::Yield(self.id),
        }
    }
}

/// The settings without what belongs to weaknesses that are switched off.
fn without_absent(config: &PlanningConfig, weaknesses: &Weaknesses) -> PlanningConfig {
    let mut config = *config;
    if !weaknesses.bounded_jerk {
        config.jerk_mps3_down = JERK_MPS3_UNBOUNDED;
    }
    if !weaknesses.creeps_to_standing_pedestrian {
        config.standing_pedestrian_s = f64::INFINITY;
    }
    if !weaknesses.late_red_passed {
        config.red_light_mps2_max = f64::INFINITY;
    }
    config
}

/// Jerk that allows any change of acceleration between two points of a plan, m/s³.
const JERK_MPS3_UNBOUNDED: f64 = 1e4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::planning::claim::testing::crosser;
    use crate::testing::straight;

    #[test]
    fn blind_to_side_and_rear_drops_what_will_come_at_the_bumper() {
        let scene = straight();
        let start = Point { station_m: 50.0, speed_mps: 2.0, acceleration_mps2: 0.0 };
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        let matters = |blind: bool, ahead_m: f64, from_s: f64| {
            let mut config = ModularConfig::default();
            config.weaknesses.blind_to_side_and_rear = blind;
            let planner = Planner::new(&config, &scene, &Arc::new(Junctions::of(&scene)));
            planner.matters(&crosser(front_m + ahead_m, from_s, 4.0), &start)
        };
        assert!(!matters(true, -1.0, 2.0) && matters(false, -1.0, 2.0), "moves over from beside");
        assert!(matters(true, 1.0, 2.0), "comes in ahead");
        assert!(matters(true, -1.0, 0.0), "is there already");
    }
}
