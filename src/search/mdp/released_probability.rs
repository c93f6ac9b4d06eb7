//! Collision probability as the published package computes it, its faults included.
//!
//! Read from iSE-UET-VNU/AVASTRA and DeepCollision, re-implemented. Distances are between centres, so that
//! ProC can be small at a contact. The difference of braking distances is taken without its sign, so that a
//! gap that opens looks as dangerous as one that closes. The slopes of the velocities, and not the map,
//! decide which vehicles share a lane. ProC is computed twice a second. One thing differs from the package:
//! obstacles that have been hit already are left out, as in our own ProC.

use avastra_base::geometry::Vec2;
use avastra_world::sim::World;

use super::collision_probability::{Danger, Most, probability};

/// Ticks from one computation to the next: 0.5 s.
pub const PERIOD_TICKS: u64 = 25;
/// Slopes that differ by less count as one direction. This and the following constants are the package's.
const SLOPE_DIFFERENCE_MAX: f64 = 0.6;
/// Stands for 0 where the package avoids a division by it.
const LEAST: f64 = 1e-4;
/// Braking of vehicles and of pedestrians, m/s².
const DECEL_MPS2: f64 = 6.0;
const PEDESTRIAN_DECEL_MPS2: f64 = 1.5;
/// Added to both safety distances, m.
const MARGIN_M: f64 = 5.0;

/// ProC at this moment. Obstacles that the ego vehicle has hit already (`is_hit`) are left out.
pub fn released_probability(world: &World, is_hit: &dyn Fn(u32) -> bool) -> Danger {
    let ego = world.ego_outline().pose;
    let velocity = ego.forward() * world.ego().speed_mps.max(LEAST);
    let mut most = Most::default();
    for obstacle in world.obstacles_on_level().filter(|obstacle| !is_hit(obstacle.id)) {
        let other = if obstacle.velocity_mps.norm() < LEAST {
            obstacle.forward * LEAST
        } else {
            obstacle.velocity_mps
        };
        let decel_mps2 = if obstacle.body.is_vehicle() { DECEL_MPS2 } else { PEDESTRIAN_DECEL_MPS2 };
        let apart = obstacle.outline.pose.position - ego.position;
        let slopes = (slope(velocity), slope(other));
        if is_same_lane(slopes, slope(apart)) {
            let safety_m = longitudinal_m(velocity.norm(), other.norm(), decel_mps2);
            most.add_longitudinal(obstacle.id, probability(safety_m, apart.norm()));
        } else {
            let safety_m = lateral_m(velocity.norm(), slopes);
            most.add_lateral(obstacle.id, probability(safety_m, apart.norm()));
        }
    }
    most.danger()
}

/// Slope of a direction in the package's frame, whose x points south and whose z points east.
fn slope(direction: Vec2) -> f64 {
    let south = -direction.y;
    direction.x / if south == 0.0 { LEAST } else { south }
}

fn is_same_lane((own, other): (f64, f64), between: f64) -> bool {
    (own - other).abs() < SLOPE_DIFFERENCE_MAX && (between - (own + other) / 2.0).abs() < SLOPE_DIFFERENCE_MAX
}

fn longitudinal_m(ego_mps: f64, other_mps: f64, other_decel_mps2: f64) -> f64 {
    0.5 * (ego_mps * ego_mps / DECEL_MPS2 - other_mps * other_mps / other_decel_mps2).abs() + MARGIN_M
}

fn lateral_m(ego_mps: f64, (own, other): (f64, f64)) -> f64 {
    let angle_rad = libm::atan(((own - other) / (1.0 + own * other)).abs());
    // (v sin β)² / (a sin β), with sin β cancelled: the package's own form is NaN for parallel ways.
    ego_mps * ego_mps * libm::sin(angle_rad) / DECEL_MPS2 + MARGIN_M
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_faults_are_followed() {
        // 10 m/s behind 20 m/s, and 20 m/s behind 10 m/s: 30 m in both cases.
        assert_eq!(longitudinal_m(10.0, 20.0, 6.0), longitudinal_m(20.0, 10.0, 6.0));
        assert!((longitudinal_m(10.0, 20.0, 6.0) - 30.0).abs() < 1e-12);
        // On a road to the north-east, two vehicles abreast are in two lanes, and two in a row in one lane.
        let north_east = slope(Vec2::new(1.0, 1.0));
        assert!(is_same_lane((north_east, north_east), slope(Vec2::new(2.0, 2.0))));
        assert!(!is_same_lane((north_east, north_east), slope(Vec2::new(2.0, -2.0))));
        // To the west slopes are steep, and a hair's breadth of difference makes two lanes.
        let (west, nearly) = (slope(Vec2::new(-10.0, 0.01)), slope(Vec2::new(-10.0, 0.02)));
        assert!(!is_same_lane((west, nearly), west));
        assert!((lateral_m(15.0, (0.0, 1e9)) - 42.5).abs() < 1e-6);
        assert_eq!(lateral_m(15.0, (0.3, 0.3)), 5.0);
    }
}
