//! Traffic rules beside the lights: crosswalks and junctions to be kept clear (Apollo's `Crosswalk` and
//! `KeepClear`). Stop and yield signs are in `stages`.

use crate::kit::Guide;
use crate::status::Reason;
use avastra_base::kinematics::stopping_m;
use avastra_world::sim::{Scene, VehicleParameters};

use super::super::config::PlanningConfig;
use super::super::junctions::Junctions;
use super::super::prediction::Forecast;
use super::HORIZON_M;
use super::claim::Claim;
use super::speed::Constraint;
use super::standing::Standing;
use super::trajectory::Point;

/// A pedestrian so near to a crosswalk is on it, m. Apollo expands it by 2.
const CROSSWALK_MARGIN_M: f64 = 2.0;
/// Slower than this across the way, a pedestrian neither comes nor goes, m/s.
const ACROSS_MPS: f64 = 0.2;
/// Apollo's `stop_timeout`, s: a pedestrian beside the lane who does not go lets the vehicle go first. It belongs to
/// this rule and holds whether `creeps_to_standing_pedestrian` is on or not.
const CROSSWALK_PATIENCE_S: f64 = 4.0;

/// A stop before each crosswalk ahead that a pedestrian is on, or comes onto.
pub fn crosswalks(
    config: &PlanningConfig,
    scene: &Scene,
    guide: &Guide,
    start: &Point,
    forecasts: &[Forecast],
    standing: &Standing,
    constraints: &mut Vec<Constraint>,
) {
    let front_m = VehicleParameters::MKZ.front_m(start.station_m);
    for &(from_m, to_m) in &scene.route.crosswalks_m {
        if from_m < front_m || from_m > start.station_m + HORIZON_M {
            continue;
        }
        let waited_for = forecasts.iter().filter(|forecast| !forecast.body.is_vehicle()).any(|walker| {
            let position = walker.positions[0];
            let beside = guide.project(position, from_m - CROSSWALK_MARGIN_M, to_m + CROSSWALK_MARGIN_M);
            let along = (from_m - CROSSWALK_MARGIN_M..=to_m + CROSSWALK_MARGIN_M).contains(&beside.station_m);
            let off_m = beside.offset_m.abs();
            if !along || off_m > config.crosswalk_strict_m.max(config.crosswalk_loose_m) {
                return false;
            }
            let velocity_mps = walker.velocity_mps;
            let left_mps = beside.forward.x * velocity_mps.y - beside.forward.y * velocity_mps.x;
            let away_mps = left_mps * beside.offset_m.signum();
            if off_m > scene.half_width_m(from_m) && standing.time_s(walker.id) > CROSSWALK_PATIENCE_S {
                return false;
            }
            let comes = away_mps < -ACROSS_MPS;
            comes && off_m <= config.crosswalk_loose_m
                || off_m <= config.crosswalk_strict_m && away_mps <= ACROSS_MPS
        });
        let stop_m = from_m - config.crosswalk_gap_m;
        if waited_for && can_stop(config, config.crosswalk_mps2_max, stop_m - front_m, start, 0.0) {
            constraints.push(Constraint::line(Reason::Crosswalk, stop_m));
        }
    }
}

/// A stop before a junction if something stands so near behind it that the vehicle would have to stop
/// inside.
pub fn keep_clear(
    config: &PlanningConfig,
    junctions: &Junctions,
    start: &Point,
    claims: &[Claim],
    constraints: &mut Vec<Constraint>,
) {
    let vehicle = VehicleParameters::MKZ;
    let front_m = vehicle.front_m(start.station_m);
    for (enter_m, exit_m) in junctions.between(front_m, front_m + HORIZON_M) {
        let blocked = claims.iter().any(|claim| {
            let stands = claim.is_now() && claim.speed_mps < config.static_mps && claim.on_wheels;
            let stop_m = claim.spans[0].from_m - config.stop_gap_m;
            stands && stop_m > enter_m && stop_m - vehicle.length_m < exit_m
        });
        let stop_m = enter_m - config.stop_line_gap_m;
        if blocked && can_stop(config, config.deceleration_mps2_max, stop_m - front_m, start, 0.0) {
            constraints.push(Constraint::line(Reason::KeepClear, stop_m));
        }
    }
}

/// Whether a braking that begins in `response_s` and builds up at the plan's rate ends within a distance.
pub fn can_stop(
    config: &PlanningConfig,
    decel_mps2: f64,
    distance_m: f64,
    start: &Point,
    response_s: f64,
) -> bool {
    if decel_mps2.is_infinite() {
        return true;
    }
    // Until the braking has built up, the vehicle goes on as if for half that time; less if it brakes already.
    let speed_mps = start.speed_mps;
    let lacking = (1.0 + start.acceleration_mps2.min(0.0) / decel_mps2).max(0.0);
    let build_up_s = decel_mps2 / config.jerk_mps3_down / 2.0 * lacking * lacking;
    let late_s = response_s * lacking + build_up_s;
    stopping_m(speed_mps, late_s, decel_mps2) <= distance_m.max(0.2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::planning::nudge::LateralPlan;
    use crate::modular::prediction::forecasts_of;
    use crate::modular::tracking::Track;
    use crate::testing::straight;
    use avastra_base::geometry::{Pose, Vec2};
    use avastra_lang::model::vocabulary::Body;

    const START: Point = Point { station_m: 40.0, speed_mps: 8.0, acceleration_mps2: 0.0 };

    fn forecast(scene: &std::sync::Arc<Scene>, body: Body, at: Vec2, velocity_mps: Vec2) -> Forecast {
        let track = Track::for_tests(1, body, Pose { position: at, heading_rad: 0.0 }, velocity_mps);
        forecasts_of(scene, &[track], Vec2::zeros()).remove(0)
    }

    /// Whether a pedestrian at an offset from the path (m), walking to the left, stops the vehicle before a
    /// crosswalk.
    fn stops_for(offset_m: f64, left_mps: f64, stood_s: f64) -> bool {
        let mut route = straight().route.clone();
        route.crosswalks_m.push((80.0, 84.0));
        let scene = std::sync::Arc::new(Scene::new(straight().map.clone(), route));
        let config = PlanningConfig::default();
        let guide = Guide::new(&scene, &config.speed_rules());
        let walker =
            forecast(&scene, Body::Pedestrian, Vec2::new(82.0, offset_m - 1.75), Vec2::new(0.0, left_mps));
        let mut standing = Standing::default();
        (0..=(stood_s * 10.0) as u32).for_each(|_| standing.update(core::slice::from_ref(&walker)));
        let mut constraints = Vec::new();
        crosswalks(&config, &scene, &guide, &START, &[walker], &standing, &mut constraints);
        !constraints.is_empty()
    }

    #[test]
    fn crosswalks_are_left_to_pedestrians_on_them_or_near() {
        assert!(stops_for(-7.0, 1.2, 0.0), "comes from the right");
        assert!(!stops_for(-7.0, -1.2, 0.0), "goes away");
        assert!(!stops_for(-9.0, 1.2, 0.0), "is too far");
        assert!(stops_for(-3.0, 0.0, 2.0), "waits");
        assert!(!stops_for(-3.0, 0.0, 6.0), "has waited for long");
        assert!(stops_for(-1.0, 0.0, 6.0), "stands in the lane");
        assert!(!stops_for(3.0, 1.2, 0.0), "has crossed");
    }

    #[test]
    fn a_junction_is_kept_clear_when_its_exit_is_blocked() {
        let scene = straight();
        let config = PlanningConfig::default();
        let guide = Guide::new(&scene, &config.speed_rules());
        let fences = |x_m: f64, speed_mps: f64| {
            let leader = forecast(&scene, Body::Sedan, Vec2::new(x_m, -1.75), Vec2::new(speed_mps, 0.0));
            let ahead = START.station_m..START.station_m + HORIZON_M;
            let claim = Claim::of(&leader, &guide, &LateralPlan::default(), &ahead, 0.4);
            let junctions = Junctions::for_tests(&[(70.0, 95.0)]);
            let mut constraints = Vec::new();
            keep_clear(&config, &junctions, &START, claim.as_slice(), &mut constraints);
            constraints.len()
        };
        assert_eq!(fences(102.0, 0.0), 1, "stands just behind");
        assert_eq!(fences(102.0, 5.0), 0, "moves off");
        assert_eq!(fences(120.0, 0.0), 0, "leaves room");
    }
}
