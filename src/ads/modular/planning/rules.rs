//! Traffic rules beside the lights: crosswalks and junctions to be kept clear (Apollo's `Crosswalk` and
//! `KeepClear`). Stop signs are left out because no map says where they stand.

use crate::ads::guide::Guide;
use crate::ads::status::Reason;
use crate::sim::Scene;
use crate::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::super::junctions::Junctions;
use super::super::prediction::Forecast;
use super::corridor::Claim;
use super::planner::HORIZON_M;
use super::speed::Constraint;
use super::speed::Point;
use super::standing::Standing;

/// A pedestrian this little beside a crosswalk is on it, m. Apollo expands it by 2.
const CROSSWALK_MARGIN_M: f64 = 2.0;
/// Slower than this across the way, a pedestrian neither comes nor goes, m/s.
const ACROSS_MPS: f64 = 0.2;

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
            if !walker.moving {
                // Apollo's `stop_timeout`: whoever does not go lets the vehicle go first.
                return off_m <= config.crosswalk_strict_m
                    && standing.time_s(walker.id) <= CROSSWALK_PATIENCE_S;
            }
            let comes = away_mps < -ACROSS_MPS;
            comes && off_m <= config.crosswalk_loose_m
                || off_m <= config.crosswalk_strict_m && away_mps <= ACROSS_MPS
        });
        let stop_m = from_m - config.crosswalk_gap_m;
        if waited_for && can_stop(config, config.crosswalk_mps2_max, stop_m - front_m, start.speed_mps) {
            constraints.push(Constraint::line(Reason::Crosswalk, stop_m));
        }
    }
}

/// Apollo's `stop_timeout`, s: it is the rule's own and holds whether weakness (f) is on or not.
const CROSSWALK_PATIENCE_S: f64 = 4.0;

/// A stop before a junction behind which something stands so near that the vehicle would have to stop
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
        if blocked && can_stop(config, config.deceleration_mps2_max, stop_m - front_m, start.speed_mps) {
            constraints.push(Constraint::line(Reason::KeepClear, stop_m));
        }
    }
}

/// Whether a braking that builds up at the plan's rate ends within a distance.
pub fn can_stop(config: &PlanningConfig, decel_mps2: f64, distance_m: f64, speed_mps: f64) -> bool {
    if decel_mps2.is_infinite() {
        return true;
    }
    // Until the braking has built up, the vehicle goes on as if for half that time.
    let build_up_s = decel_mps2 / config.jerk_mps3_down / 2.0;
    speed_mps * build_up_s + speed_mps * speed_mps / (2.0 * decel_mps2) <= distance_m.max(0.2)
}
