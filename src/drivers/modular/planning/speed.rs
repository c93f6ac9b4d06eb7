//! The speed law: the acceleration that each constraint allows, and what follows from it.
//!
//! A braking parabola for places to stop at, the intelligent driver model (Treiber) for leaders with
//! a kinematic bound beneath it, a look-ahead on the speed that limits and curves allow. All of it
//! goes through Apollo's jerk limits, the emergency too: that is its documented weakness `bounded_jerk`.

use crate::kit::{Guide, PREVIEW_S, speed_mps2};
use crate::status::Reason;
use avastra_base::geometry::{larger, smaller};
use avastra_base::kinematics::{Following, needed_mps2};
use avastra_world::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::claim::Claim;
use super::trajectory::{POINT_S, Point, Trajectory};

/// A standing vehicle this near to its place to stop stays there, m.
const STOPPED_SHORT_M: f64 = 0.3;
/// Gap that even an emergency braking tries to leave, m.
const EMERGENCY_GAP_M: f64 = 1.0;
/// Gap to a leader that the kinematic bound preserves, m.
const LEADER_GAP_M: f64 = 2.5;

/// Something that bounds the acceleration.
#[derive(Debug, Clone, Copy)]
pub struct Constraint {
    reason: Reason,
    kind: Kind,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    /// The front bumper stops at `stop_m`; `touch_m` is where it would hit, if there is anything to
    /// hit. Void after `until_s`.
    Fence { stop_m: f64, touch_m: Option<f64>, until_s: f64 },
    /// The front bumper comes to a place at no more than a creeping speed, and goes on with it.
    Creep { stop_m: f64, speed_mps: f64 },
    /// Between two places of the front bumper the speed is limited.
    Limit { from_m: f64, to_m: f64, speed_mps: f64 },
    /// Index in the claims.
    Leader(usize),
}

/// The acceleration that a constraint allows at a moment.
#[derive(Debug, Clone, Copy)]
struct Bound {
    acceleration_mps2: f64,
    emergency: bool,
}

impl Bound {
    fn gentle(acceleration_mps2: f64) -> Bound {
        Bound { acceleration_mps2, emergency: false }
    }

    /// The planned acceleration, or the needed braking (magnitude) where that is an emergency.
    fn of(config: &PlanningConfig, planned_mps2: f64, needed_mps2: f64) -> Bound {
        if needed_mps2 > config.deceleration_mps2_max {
            Bound { acceleration_mps2: smaller(planned_mps2, -needed_mps2), emergency: true }
        } else {
            Bound::gentle(planned_mps2)
        }
    }
}

impl Constraint {
    /// A line to stop at, with nothing behind it to hit.
    pub fn line(reason: Reason, stop_m: f64) -> Constraint {
        Constraint { reason, kind: Kind::Fence { stop_m, touch_m: None, until_s: f64::INFINITY } }
    }

    /// A red light at a line. The stop has been decided: braking may be as hard as staying before the line needs.
    pub fn red_light(config: &PlanningConfig, line_m: f64) -> Constraint {
        let (stop_m, touch_m) = (line_m - config.stop_line_gap_m, Some(line_m + EMERGENCY_GAP_M));
        Constraint { reason: Reason::RedLight, kind: Kind::Fence { stop_m, touch_m, until_s: f64::INFINITY } }
    }

    /// A road user that stands with its near end at `from_m`.
    pub fn stop(config: &PlanningConfig, id: u32, from_m: f64) -> Constraint {
        let kind =
            Kind::Fence { stop_m: from_m - config.stop_gap_m, touch_m: Some(from_m), until_s: f64::INFINITY };
        Constraint { reason: Reason::Stop(id), kind }
    }

    /// A road user that crosses at `from_m` and is gone after `until_s`.
    pub fn give_way(config: &PlanningConfig, id: u32, from_m: f64, until_s: f64) -> Constraint {
        let kind = Kind::Fence { stop_m: from_m - config.yield_gap_m, touch_m: Some(from_m), until_s };
        Constraint { reason: Reason::Yield(id), kind }
    }

    /// Stays before `stop_m` whatever may happen there until `until_s`; braking may be as hard as that needs.
    pub fn last_line(reason: Reason, stop_m: f64, until_s: f64) -> Constraint {
        Constraint { reason, kind: Kind::Fence { stop_m, touch_m: Some(stop_m), until_s } }
    }

    /// As [`Constraint::stop`], but creeps on.
    pub fn creep(config: &PlanningConfig, id: u32, from_m: f64) -> Constraint {
        let (stop_m, speed_mps) = (from_m - config.stop_gap_m, config.creep_to_pedestrian_mps);
        Constraint { reason: Reason::Stop(id), kind: Kind::Creep { stop_m, speed_mps } }
    }

    /// No faster than `speed_mps` between two places.
    pub fn limit(reason: Reason, from_m: f64, to_m: f64, speed_mps: f64) -> Constraint {
        Constraint { reason, kind: Kind::Limit { from_m, to_m, speed_mps } }
    }

    /// The road user `id` of claim `index`, which drives ahead, or will.
    pub fn follow(id: u32, index: usize) -> Constraint {
        Constraint { reason: Reason::Follow(id), kind: Kind::Leader(index) }
    }

    fn bound(&self, config: &PlanningConfig, claims: &[Claim], time_s: f64, point: &Point) -> Option<Bound> {
        let speed_mps = point.speed_mps;
        let front_m = VehicleParameters::MKZ.front_m(point.station_m);
        match &self.kind {
            Kind::Fence { until_s, .. } if time_s > *until_s => None,
            Kind::Fence { stop_m, touch_m, .. } => {
                let hardest_mps2 = touch_m
                    .map_or(0.0, |touch_m| braking_mps2(speed_mps, touch_m - EMERGENCY_GAP_M - front_m));
                Some(Bound::of(config, fence_mps2(config, speed_mps, stop_m - front_m), hardest_mps2))
            }
            Kind::Creep { stop_m, speed_mps: creep_mps } => {
                let creeping_mps2 = speed_mps2(speed_mps, *creep_mps);
                Some(Bound::gentle(larger(fence_mps2(config, speed_mps, stop_m - front_m), creeping_mps2)))
            }
            Kind::Limit { from_m, to_m, speed_mps: limit_mps } => {
                if front_m > *to_m || front_m < *from_m - speed_mps * PREVIEW_S {
                    return None;
                }
                Some(Bound::gentle(larger(speed_mps2(speed_mps, *limit_mps), -config.comfortable_mps2)))
            }
            Kind::Leader(index) => leader_bound(config, &claims[*index], time_s, front_m, speed_mps),
        }
    }

    /// Whether it holds the vehicle back from the way of a crossing road user.
    pub fn is_yielding(&self) -> bool {
        matches!(self.reason, Reason::Yield(_))
    }

    /// The last place for the front bumper that this allows for good, m.
    pub fn stop_m(&self) -> f64 {
        match &self.kind {
            Kind::Fence { stop_m, until_s, .. } if until_s.is_infinite() => *stop_m,
            _ => f64::INFINITY,
        }
    }
}

/// The bound that a leader sets. Behind a leader that has yet to come onto the way, the vehicle falls back at
/// the comfortable rate at most: there is time until it is there.
fn leader_bound(
    config: &PlanningConfig,
    claim: &Claim,
    time_s: f64,
    front_m: f64,
    speed_mps: f64,
) -> Option<Bound> {
    if time_s > claim.exit_s() {
        return None;
    }
    let (near_m, along_mps) = claim.near_end(time_s);
    let gap_m = near_m - front_m;
    let planned_mps2 = leader_mps2(config, speed_mps, along_mps, gap_m);
    if time_s < claim.entry_s() {
        return Some(Bound::gentle(larger(planned_mps2, -config.comfortable_mps2)));
    }
    let hardest_mps2 = braking_mps2(larger(speed_mps - along_mps, 0.0), gap_m - EMERGENCY_GAP_M);
    Some(Bound::of(config, planned_mps2, hardest_mps2))
}

/// Rolls the law forward from `start` into `trajectory`.
pub fn roll(
    config: &PlanningConfig,
    guide: &Guide,
    start: Point,
    constraints: &[Constraint],
    claims: &[Claim],
    trajectory: &mut Trajectory,
) {
    let mut point = start;
    for (index, slot) in trajectory.points.iter_mut().enumerate() {
        let time_s = index as f64 * POINT_S;
        *slot = point;
        let allowed_mps = guide.allowed_mps(point.station_m, point.speed_mps);
        let mut wanted_mps2 = smaller(speed_mps2(point.speed_mps, allowed_mps), config.acceleration_mps2_max);
        let mut floor_mps2 = -config.deceleration_mps2_max;
        let mut reason = Reason::Cruise;
        for constraint in constraints {
            let Some(bound) = constraint.bound(config, claims, time_s, &point) else { continue };
            if bound.emergency {
                floor_mps2 = -config.emergency_mps2;
            }
            if bound.acceleration_mps2 < wanted_mps2 {
                wanted_mps2 = bound.acceleration_mps2;
                reason = constraint.reason;
            }
        }
        if index == 0 {
            trajectory.reason = reason;
        }
        let wanted_mps2 = wanted_mps2.clamp(floor_mps2, config.acceleration_mps2_max);
        let change_mps2 = (wanted_mps2 - point.acceleration_mps2)
            .clamp(-config.jerk_mps3_down * POINT_S, config.jerk_mps3_up * POINT_S);
        point = point.after(point.acceleration_mps2 + change_mps2);
    }
}

/// Acceleration that stops the vehicle in `room_m`: coming nearer, it is the braking parabola of
/// the comfortable deceleration; where that has been missed, whatever still stops in time.
fn fence_mps2(config: &PlanningConfig, speed_mps: f64, room_m: f64) -> f64 {
    let comfortable_mps2 = config.comfortable_mps2;
    // Beyond its place the vehicle must not roll on, however slowly.
    if room_m <= 0.0 && speed_mps > 0.0 {
        return -larger(comfortable_mps2, braking_mps2(speed_mps, room_m));
    }
    // Until the braking has built up, the vehicle goes on as if for half that time.
    let build_up_m = speed_mps * comfortable_mps2 / config.jerk_mps3_down / 2.0;
    let needed_mps2 = braking_mps2(speed_mps, room_m - build_up_m);
    if needed_mps2 >= comfortable_mps2 {
        return -needed_mps2;
    }
    let parabola_mps = (2.0 * comfortable_mps2 * larger(room_m - STOPPED_SHORT_M, 0.0)).sqrt();
    speed_mps2(speed_mps, parabola_mps)
}

/// Acceleration behind a leader: the intelligent driver model's interaction term, not below the
/// comfortable deceleration while there is a gap, because it brakes hard for any short one; and, where
/// closing in demands more, the braking that brings both to one speed in time.
fn leader_mps2(config: &PlanningConfig, speed_mps: f64, leader_mps: f64, gap_m: f64) -> f64 {
    let (acceleration_mps2, comfortable_mps2) = (config.acceleration_mps2_max, config.comfortable_mps2);
    let following = Following {
        gap_m_min: config.follow_gap_m,
        time_gap_s: config.follow_time_s,
        acceleration_mps2,
        comfortable_mps2,
    };
    let ratio = following.crowding(speed_mps, leader_mps, gap_m);
    let floor_mps2 =
        if gap_m > config.follow_gap_m { comfortable_mps2 } else { config.deceleration_mps2_max };
    let model_mps2 = larger(acceleration_mps2 * (1.0 - ratio * ratio), -floor_mps2);
    let needed_mps2 = braking_mps2(larger(speed_mps - leader_mps, 0.0), gap_m - LEADER_GAP_M);
    if needed_mps2 > comfortable_mps2 / 2.0 { smaller(model_mps2, -needed_mps2) } else { model_mps2 }
}

/// Deceleration that loses a speed within a distance, m/s².
fn braking_mps2(speed_mps: f64, room_m: f64) -> f64 {
    needed_mps2(speed_mps, larger(room_m, 0.1))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::modular::planning::trajectory::POINTS;
    use crate::testing::straight;

    fn rolled(start: Point, constraints: &[Constraint]) -> Trajectory {
        let config = PlanningConfig::default();
        let guide = Guide::new(&straight(), &config.speed_rules());
        let mut trajectory = Trajectory::default();
        roll(&config, &guide, start, constraints, &[], &mut trajectory);
        trajectory
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn jerk_and_acceleration_stay_in_their_bounds(
            speed_mps in 0.0..15.0_f64, acceleration_mps2 in -4.0..2.0_f64, stop_m in 5.0..80.0_f64,
        ) {
            let start = Point { station_m: 10.0, speed_mps, acceleration_mps2 };
            let fence = Constraint::stop(&PlanningConfig::default(), 1, 10.0 + stop_m);
            let trajectory = rolled(start, &[fence]);
            for pair in trajectory.points.windows(2) {
                prop_assert!(pair[1].speed_mps >= 0.0 && pair[1].station_m >= pair[0].station_m);
                prop_assert!(pair[1].acceleration_mps2 >= -6.0 - 1e-9);
                if pair[1].speed_mps > 0.0 {
                    let jerk_mps3 = (pair[1].acceleration_mps2 - pair[0].acceleration_mps2) / POINT_S;
                    prop_assert!((-4.0 - 1e-6..=2.0 + 1e-6).contains(&jerk_mps3), "{jerk_mps3}");
                }
            }
        }
    }

    #[test]
    fn a_stop_that_can_be_foreseen_is_gentle_and_in_place() {
        let start = Point { station_m: 0.0, speed_mps: 11.0, acceleration_mps2: 0.0 };
        let trajectory = rolled(start, &[Constraint::line(Reason::RedLight, 50.0)]);
        let last = trajectory.points[POINTS - 1];
        assert!(
            last.speed_mps < 0.5 && (48.0..50.2).contains(&VehicleParameters::MKZ.front_m(last.station_m)),
            "{last:?}"
        );
        let hardest_mps2 =
            trajectory.points.iter().fold(0.0_f64, |worst, point| worst.min(point.acceleration_mps2));
        assert!(hardest_mps2 > -3.0, "{hardest_mps2}");
    }

    #[test]
    fn a_vehicle_beyond_its_place_does_not_roll_on() {
        let start = Point { station_m: 0.0, speed_mps: 0.6, acceleration_mps2: 0.0 };
        let line_m = VehicleParameters::MKZ.front_m(-0.5);
        let last = rolled(start, &[Constraint::line(Reason::RedLight, line_m)]).points[POINTS - 1];
        assert!(last.speed_mps < 1e-9 && last.station_m < 0.35, "{last:?}");
    }

    #[test]
    fn the_jerk_limit_costs_a_second_and_a_half_to_full_braking() {
        let start = Point { station_m: 0.0, speed_mps: 14.0, acceleration_mps2: 0.0 };
        let wall = Constraint::stop(&PlanningConfig::default(), 1, VehicleParameters::MKZ.front_m(12.0));
        let trajectory = rolled(start, &[wall]);
        assert!(trajectory.at(1.4).acceleration_mps2 > -5.7);
        assert!((trajectory.at(1.5).acceleration_mps2 + 6.0).abs() < 1e-6);
    }
}
