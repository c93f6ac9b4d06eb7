//! One planning cycle: collects the constraints and plans under them.
//!
//! The most restrictive acceleration is taken, and the same law is rolled forward for 8 s, which
//! gives the trajectory.

use std::sync::Arc;

use crate::ads::guide::Guide;
use crate::ads::status::Reason;
use crate::geometry::Pose;
use crate::sim::Scene;
use crate::sim::SignalColour;
use crate::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::super::prediction::Forecast;
use super::corridor::Claim;
use super::lights::Lights;
use super::speed;
use super::speed::Constraint;
use super::speed::Point;
use super::speed::Trajectory;

/// Claims and lights that begin farther ahead do not matter yet, m. Apollo's ST graph ends at 100.
pub(super) const HORIZON_M: f64 = 100.0;
/// Faster than this along the route, a road user is a leader rather than one who crosses: cosine of 60°.
const ALONG_COSINE: f64 = 0.5;

#[derive(Debug, Clone)]
pub struct Planner {
    config: PlanningConfig,
    guide: Arc<Guide>,
    lights: Lights,
    trajectory: Trajectory,
    claims: Vec<Claim>,
    constraints: Vec<Constraint>,
}

impl Planner {
    pub fn new(config: &PlanningConfig, scene: &Arc<Scene>, guide: &Arc<Guide>) -> Planner {
        Planner {
            config: *config,
            guide: Arc::clone(guide),
            lights: Lights::new(config, scene),
            trajectory: Trajectory::default(),
            claims: Vec::new(),
            constraints: Vec::new(),
        }
    }

    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Plans from the place where the vehicle believes to be. `since_s` is the age of the last plan.
    pub fn plan(
        &mut self,
        localized: &Pose,
        station_m: f64,
        speed_mps: f64,
        since_s: f64,
        forecasts: &[Forecast],
        signals: &[SignalColour],
    ) {
        // Going on from the planned and not from the measured acceleration keeps the jerk bounded.
        let acceleration_mps2 = self.trajectory.at(since_s).acceleration_mps2;
        let beside = self.guide.locate(localized.position, Some(station_m));
        if beside.offset_m.abs() > self.config.lost_offset_m {
            self.trajectory = Trajectory::braking(station_m, speed_mps, self.config.fallback_mps2);
            return;
        }
        let start = Point { station_m, speed_mps, acceleration_mps2 };
        self.constraints.clear();
        self.lights.constrain(station_m, speed_mps, signals, &mut self.constraints);
        self.claims.clear();
        for forecast in forecasts {
            let ahead = station_m..station_m + HORIZON_M;
            self.claims.extend(Claim::of(forecast, &self.guide, &ahead, self.config.lateral_buffer_m));
        }
        // What is in the way already decides when the crossings ahead are reached, so it comes first.
        for (index, claim) in self.claims.iter().enumerate().filter(|(_, claim)| claim.is_now()) {
            self.constraints.extend(in_the_way(&self.config, claim, index, station_m));
        }
        self.roll(start);
        let known = self.constraints.len();
        for (index, claim) in self.claims.iter().enumerate() {
            self.constraints.extend(in_conflict(&self.config, claim, index, &start, &self.trajectory));
        }
        if self.constraints.len() > known {
            self.roll(start);
        }
    }

    fn roll(&mut self, start: Point) {
        let trajectory = &mut self.trajectory;
        speed::roll(&self.config, &self.guide, start, &self.constraints, &self.claims, trajectory);
    }

    /// Why the present plan does what it does.
    pub fn reason(&self) -> Reason {
        self.trajectory.reason
    }
}

/// STOP or FOLLOW: for road users that are on the way now and stand or go along it.
fn in_the_way(config: &PlanningConfig, claim: &Claim, index: usize, station_m: f64) -> Option<Constraint> {
    let span = claim.spans[0];
    // Beside or behind the ego vehicle: no reaction to rear and side traffic (Apollo issue 14633).
    if span.middle_m() < VehicleParameters::MKZ.front_m(station_m) - 1.0 {
        return None;
    }
    if claim.speed_mps < config.static_mps || !claim.moving {
        return Some(Constraint::stop(config, claim.id, span.from_m));
    }
    (claim.cosine > ALONG_COSINE).then(|| Constraint::follow(claim.id, index))
}

/// FOLLOW or YIELD or, as `None`, OVERTAKE: for road users that move onto or across the way.
///
/// There is a conflict if both would be at one place less than `conflict_buffer_s` apart. One who
/// crosses on wheels and will be off the way again within `brief_overlap_s` of coming onto it is no
/// reason to wait: the decision flips from YIELD to OVERTAKE, a documented weakness of the system
/// modelled (Apollo issue 14870), kept on purpose. The ego vehicle goes first only if it would be past
/// by that buffer, or can no longer stop and would still be past; one who enters beside or behind it
/// along the way has to see to it himself.
fn in_conflict(
    config: &PlanningConfig,
    claim: &Claim,
    index: usize,
    start: &Point,
    trajectory: &Trajectory,
) -> Option<Constraint> {
    let along = claim.cosine > ALONG_COSINE;
    if !claim.moving || (claim.is_now() && along) {
        return None;
    }
    let step = claim.first_conflict(trajectory, config.conflict_buffer_s)?;
    let entry = claim.spans[claim.first];
    let past = |time_s: f64| entry.to_m < VehicleParameters::MKZ.rear_m(trajectory.at(time_s).station_m);
    if along {
        let ego_then_m = trajectory.at(claim.entry_s()).station_m;
        let beside = entry.middle_m() < VehicleParameters::MKZ.front_m(ego_then_m) - 1.0;
        return (!beside).then(|| Constraint::follow(claim.id, index));
    }
    if claim.on_wheels && claim.exit_s() - claim.entry_s() < config.brief_overlap_s {
        return None;
    }
    let meeting = claim.spans[step];
    let room_m = meeting.from_m - VehicleParameters::MKZ.front_m(start.station_m);
    let too_late = start.speed_mps * start.speed_mps > 2.0 * config.emergency_mps2 * room_m.max(0.0);
    if past(claim.entry_s() - config.conflict_buffer_s) || (too_late && past(claim.entry_s())) {
        return None;
    }
    // One who crosses behind the front bumper: the best is to be gone.
    if claim.cosine > -ALONG_COSINE && room_m < 0.0 {
        return None;
    }
    Some(Constraint::give_way(config, claim.id, meeting.from_m, claim.exit_s() + config.conflict_buffer_s))
}
