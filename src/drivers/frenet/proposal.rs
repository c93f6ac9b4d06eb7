//! Proposals and their scores.
//!
//! A proposal is a lateral curve, driven at one of five parts of the limit (PDM-Closed: Dauner, Hallgarten,
//! Geiger, Chitta 2023). Its speed follows a quartic to that part (Werling: velocity keeping). Behind a
//! road user or a stop line, the interaction term of the intelligent driver model is taken off its acceleration,
//! so a proposal is rolled out against the forecasts of others. Werling's quintics for following and stopping are
//! left out: PDM-Closed takes a red light as something that stands there, and so does this.
//!
//! The score is that of nuPlan's closed loop as PDM-Closed uses it: no collision at fault, times the weighted
//! mean of progress, time to collision and comfort. Its other factors, drivable area and driving direction,
//! hold by construction: `lateral` samples no offset outside the lanes of the own direction. Werling's costs
//! decide between proposals that score nearly the same.

use crate::kit::{BESIDE_M, FOLLOWED_MPS, Guide, HARDEST_MPS2, Point, Stop, speed_mps2};
use crate::status::Reason;
use avastra_base::kinematics::{Following, STANDING_MPS, braking_m};
use avastra_world::sim::VehicleParameters;

use super::lateral::Lateral;
use super::polynomial::Quartic;
use super::traffic::Other;

/// Length of a proposal: 4 s in steps of 0.1 s (PDM-Closed).
pub const STEPS: usize = 40;
pub const STEP_S: f64 = 0.1;

/// The speeds of proposals, as parts of the limit (PDM-Closed).
pub const SPEED_PARTS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];
/// PDM-Closed's driver model.
pub const MODEL: Following =
    Following { gap_m_min: 1.0, time_gap_s: 1.5, acceleration_mps2: 1.5, comfortable_mps2: 3.0 };

/// Room kept free on each side, m: Apollo's `static_obstacle_nudge_l_buffer`. PDM-Closed keeps none.
pub const SIDE_M: f64 = 0.3;

/// Weights of nuPlan's metrics in PDM-Closed.
const WEIGHT_PROGRESS: f64 = 5.0;
const WEIGHT_COLLISION_TIME: f64 = 5.0;
const WEIGHT_COMFORT: f64 = 2.0;
/// Less progress than this of the best proposal is no progress to compare, m (PDM-Closed).
const PROGRESS_M_MIN: f64 = 0.1;
/// Times ahead at which a collision at constant speed would be too near: nuPlan's 0.95 s, in steps.
const COLLISION_STEPS: [usize; 3] = [3, 6, 9];
/// Steps between two looks at the time to collision: 0.5 s.
const COLLISION_STRIDE: usize = 5;
/// nuPlan's bounds of comfort: accelerations (m/s²) and jerk (m/s³).
const COMFORT_MPS2: (f64, f64) = (-4.05, 2.40);
const COMFORT_LATERAL_MPS2: f64 = 4.89;
const COMFORT_MPS3: f64 = 4.13;

/// Werling's weights of jerk, time and deviation; the figures are ours.
const COST_JERK: f64 = 0.05;
const COST_TIME: f64 = 0.3;
const COST_DEVIATION: f64 = 1.0;
/// Points of the score per unit of Werling's cost. Ours: less than any metric.
const SCORE_PER_COST: f64 = 0.02;

/// The situation in which proposals are rolled out.
#[derive(Debug)]
pub struct Outlook<'a> {
    pub guide: &'a Guide,
    pub others: &'a [Other],
    pub stops: &'a [Stop],
    pub start: Point,
    /// The speed of the fastest proposal, m/s.
    pub limit_mps: f64,
}

/// A lateral curve and a speed along it.
#[derive(Debug, Clone)]
pub struct Proposal {
    pub lateral: Lateral,
    pub points: [Point; STEPS + 1],
    /// The reason that limits its speed most in its first second.
    pub reason: Reason,
    /// The first step with a collision at fault, and the id of the road user.
    pub collision: Option<(usize, u32)>,
    collision_time_kept: bool,
    comfortable: bool,
    cost: f64,
}

impl Outlook<'_> {
    /// The quartics to the five speeds, each over the sampled time that costs least.
    pub fn profiles(&self) -> [Quartic; SPEED_PARTS.len()] {
        let Point { speed_mps, acceleration_mps2, .. } = self.start;
        let from_mps2 = acceleration_mps2.clamp(-MODEL.comfortable_mps2, MODEL.acceleration_mps2);
        SPEED_PARTS.map(|part| {
            let gain_mps = part * self.limit_mps - speed_mps;
            let bound_mps2 = if gain_mps > 0.0 { MODEL.acceleration_mps2 } else { MODEL.comfortable_mps2 };
            // A quartic from and to no acceleration has one and a half times its mean as its peak.
            // A longer one would hardly begin within a proposal; the model's accelerations bound what is driven.
            let quickest_s = (1.5 * gain_mps.abs() / bound_mps2).clamp(1.0, STEPS as f64 * STEP_S);
            let sampled = [1.0, 1.5, 2.0].map(|factor| {
                Quartic::to_speed(speed_mps, from_mps2, part * self.limit_mps, factor * quickest_s)
            });
            let cost = |profile: &Quartic| COST_JERK * profile.squared_jerk() + COST_TIME * profile.time_s;
            sampled.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("three were sampled")
        })
    }

    /// Drives a lateral curve at a speed profile.
    pub fn roll(&self, lateral: Lateral, part: f64, profile: &Quartic) -> Proposal {
        let mut points = [self.start; STEPS + 1];
        let mut reason = (f64::INFINITY, Reason::Cruise);
        for step in 0..=STEPS {
            let Point { station_m, speed_mps, .. } = points[step];
            let allowed_mps = part * self.guide.allowed_mps(station_m, speed_mps);
            let free_mps2 = profile
                .acceleration_mps2(step as f64 * STEP_S)
                .min(MODEL.acceleration_mps2)
                .min(speed_mps2(speed_mps, allowed_mps));
            let (held_mps2, held_by) = self.interaction(&lateral, step, station_m, speed_mps);
            let acceleration_mps2 = (free_mps2 - held_mps2).max(-HARDEST_MPS2);
            let holds = held_mps2 > HELD_MPS2 && acceleration_mps2 < reason.0;
            if step as f64 * STEP_S <= 1.0 && holds {
                reason = (acceleration_mps2, held_by);
            }
            points[step].acceleration_mps2 = acceleration_mps2;
            if step < STEPS {
                points[step + 1] = next(&points[step]);
            }
        }
        self.judged(Proposal {
            cost: lateral.cost(self.start.speed_mps)
                + COST_JERK * profile.squared_jerk()
                + COST_TIME * profile.time_s,
            lateral,
            points,
            reason: reason.1,
            collision: None,
            collision_time_kept: true,
            comfortable: true,
        })
    }

    /// Brakes as hard as possible along a lateral curve.
    pub fn emergency(&self, lateral: Lateral, reason: Reason) -> Proposal {
        let mut points = [Point { acceleration_mps2: -HARDEST_MPS2, ..self.start }; STEPS + 1];
        for step in 0..STEPS {
            points[step + 1] = next(&points[step]);
        }
        self.judged(Proposal {
            lateral,
            points,
            reason,
            collision: None,
            collision_time_kept: false,
            comfortable: false,
            cost: 0.0,
        })
    }

    /// The interaction term of the driver model at a step, m/s², and what causes it.
    fn interaction(&self, lateral: &Lateral, step: usize, station_m: f64, speed_mps: f64) -> (f64, Reason) {
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let offset_m = lateral.aside(station_m).offset_m;
        let mut most = (0.0, Reason::Cruise);
        let mut hold = |gap_m: f64, ahead_mps: f64, reason: Reason| {
            let held_mps2 = MODEL.interaction_mps2(speed_mps, ahead_mps, gap_m);
            if held_mps2 > most.0 {
                most = (held_mps2, reason);
            }
        };
        for stop in self.stops {
            if stop.reason != Reason::LaneChange || !lateral.changes_lane() {
                hold(stop.station_m - front_m, 0.0, stop.reason);
            }
        }
        for other in self.others {
            let Some(span) = other.taken(step, offset_m, HALF_WAY_M) else { continue };
            let Some(place) = other.places[step].as_ref().filter(|_| span.middle_m() > front_m - BESIDE_M)
            else {
                continue;
            };
            let reason = match (place.goes_along(), place.along_mps >= FOLLOWED_MPS) {
                (true, true) => Reason::Follow(other.id),
                (false, _) if place.speed_mps >= FOLLOWED_MPS => Reason::Yield(other.id),
                _ => Reason::Stop(other.id),
            };
            hold(span.from_m - front_m, place.along_mps.max(0.0), reason);
        }
        most
    }

    /// Completes a rollout by what nuPlan's metrics make of it.
    fn judged(&self, mut proposal: Proposal) -> Proposal {
        let ahead_of = |step: usize, station_m: f64, offset_m: f64| {
            self.others
                .iter()
                .find(move |other| self.hits(other, step, station_m, offset_m, &proposal.lateral))
        };
        for step in 1..=STEPS {
            let point = proposal.points[step];
            // A contact with a vehicle that stands is the fault of the other (nuPlan: below 0.005 m/s).
            if point.speed_mps < STANDING_MPS {
                break;
            }
            let offset_m = proposal.lateral.aside(point.station_m).offset_m;
            if let Some(other) = ahead_of(step, point.station_m, offset_m) {
                proposal.collision = Some((step, other.id));
                break;
            }
            if step.is_multiple_of(COLLISION_STRIDE) && proposal.collision_time_kept {
                proposal.collision_time_kept = COLLISION_STEPS.iter().all(|later| {
                    let station_m = point.station_m + point.speed_mps * *later as f64 * STEP_S;
                    ahead_of(step + later, station_m, offset_m).is_none()
                });
            }
        }
        proposal.comfortable = proposal.comfortable && self.comfortable(&proposal);
        proposal
    }

    /// Whether the ego vehicle would touch a road user at a step, and be at fault.
    ///
    /// A vehicle in its lane is not at fault for what follows it or drives beside it (nuPlan). nuPlan excuses
    /// contacts with crossing road users at its side, too; here they count, so that pedestrians are waited for.
    /// A road user that is as near already when the proposal begins is left out: no proposal can avoid it.
    fn hits(&self, other: &Other, step: usize, station_m: f64, offset_m: f64, lateral: &Lateral) -> bool {
        let car = VehicleParameters::MKZ;
        let touches = |step: usize, station_m: f64, offset_m: f64| {
            other
                .taken(step, offset_m, HALF_WAY_M)
                .filter(|span| span.from_m < car.front_m(station_m) && span.to_m > car.rear_m(station_m))
        };
        let Some(span) = touches(step, station_m, offset_m) else { return false };
        let middle_m = station_m + car.rear_axle_to_centre_m();
        let follows = other.places[step].is_some_and(|place| place.goes_along());
        if follows && span.middle_m() < middle_m && !lateral.changes_lane() {
            return false;
        }
        let Point { station_m, .. } = self.start;
        touches(0, station_m, lateral.aside(station_m).offset_m).is_none()
    }

    fn comfortable(&self, proposal: &Proposal) -> bool {
        let (least_mps2, most_mps2) = COMFORT_MPS2;
        proposal.points.windows(2).all(|pair| {
            let Point { station_m, speed_mps, acceleration_mps2 } = pair[1];
            let jerk_mps3 = (acceleration_mps2 - pair[0].acceleration_mps2) / STEP_S;
            let bend_per_m =
                self.guide.curvature_at(station_m) + proposal.lateral.aside(station_m).curvature_per_m;
            (least_mps2..=most_mps2).contains(&acceleration_mps2)
                && jerk_mps3.abs() <= COMFORT_MPS3
                && speed_mps * speed_mps * bend_per_m.abs() <= COMFORT_LATERAL_MPS2
        })
    }
}

/// Half the width of the way that the vehicle takes, with the room on each side, m.
pub const HALF_WAY_M: f64 = VehicleParameters::MKZ.width_m / 2.0 + SIDE_M;
/// A smaller interaction is no reason, m/s².
const HELD_MPS2: f64 = 0.3;

impl Proposal {
    pub fn progress_m(&self) -> f64 {
        self.points[STEPS].station_m - self.points[0].station_m
    }

    /// nuPlan's score where the farthest proposal makes `most_m`, less Werling's costs.
    pub fn score(&self, most_m: f64) -> f64 {
        let progress = if most_m > PROGRESS_M_MIN { self.progress_m() / most_m } else { 1.0 };
        let points = WEIGHT_PROGRESS * progress
            + WEIGHT_COLLISION_TIME * f64::from(self.collision_time_kept)
            + WEIGHT_COMFORT * f64::from(self.comfortable);
        points / (WEIGHT_PROGRESS + WEIGHT_COLLISION_TIME + WEIGHT_COMFORT) - SCORE_PER_COST * self.cost
    }
}

/// Werling's cost of a lateral curve that ends `deviation_m` beside where the vehicle should be.
pub fn lateral_cost(squared_jerk: f64, time_s: f64, deviation_m: f64) -> f64 {
    COST_JERK * squared_jerk + COST_TIME * time_s + COST_DEVIATION * deviation_m * deviation_m
}

/// The point one step later at a constant acceleration; a vehicle that stops stays there.
fn next(point: &Point) -> Point {
    let faster_mps = point.speed_mps + point.acceleration_mps2 * STEP_S;
    let (speed_mps, way_m) = if faster_mps > 0.0 {
        (faster_mps, (point.speed_mps + faster_mps) / 2.0 * STEP_S)
    } else {
        (0.0, braking_m(point.speed_mps, point.acceleration_mps2.abs().max(1e-9)))
    };
    Point { station_m: point.station_m + way_m, speed_mps, ..*point }
}
