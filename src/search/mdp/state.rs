//! The 19 state variables: 7 of the surroundings (paper, Table 1), 12 of the driving system (Table 2).
//!
//! Raw values in SI units; the learner scales them for its network. Perceived and true objects are
//! matched by identity; a missed object or a ghost adds no difference, and [`perception_counts`]
//! counts it.
//!
//! Without an obstacle, `speedNearestObs` is 0 (the published package: 100, faster than any vehicle);
//! `distToNearestObs` already tells that there is none. `trafficLight` is 0 both for yellow and for no
//! light ahead. Both choices are ours.

use ndarray::Array1;

use avastra_base::geometry::{Vec2, wrap_angle};
use avastra_drivers::{PerceivedObject, Status};
use avastra_lang::model::MomentFacts;
use avastra_lang::model::vocabulary::{Light, RoadKind, TimeOfDay};
use avastra_world::sim::{Obstacle, World};

/// Number of state variables; they are the first of [`VARIABLES`](avastra_lang::model::policy::VARIABLES).
pub const STATE_LEN: usize = 19;

/// One state: shape `(STATE_LEN,)`.
pub type StateVector = Array1<f32>;

/// A localisation error below this has no direction, m.
const DEVIATION_M_MIN: f64 = 1e-3;

/// Reads the state vector from the world and the driving system.
pub fn observe(world: &World, moment: &MomentFacts, status: &Status) -> StateVector {
    let surroundings = surroundings(world, moment);
    let driving_system = driving_system(world, status);
    surroundings.into_iter().chain(driving_system).map(|value| value as f32).collect()
}

fn surroundings(world: &World, moment: &MomentFacts) -> [f64; 7] {
    let [rain, fog, wetness] = world.sky().map(|level| level.intensity());
    [
        // One number for three phenomena, as the published package packs them.
        100.0 * rain + 10.0 * fog + wetness,
        f64::from(observed(world.time_of_day()).hour()),
        match moment.ego_light {
            Light::Red => -1.0,
            // Neither says whether the way is free or closed, so both stand between red and green.
            Light::Yellow | Light::None => 0.0,
            Light::Green => 1.0,
        },
        moment.road_users,
        moment.nearest_gap_m,
        // Ours: the package's 100 would read as an obstacle faster than any other.
        moment.nearest_speed_mps,
        match moment.ego_road {
            RoadKind::OneWay => 0.0,
            RoadKind::TwoWay => 1.0,
            RoadKind::NearJunction => 2.0,
            RoadKind::InJunction => 3.0,
        },
    ]
}

fn driving_system(world: &World, status: &Status) -> [f64; 12] {
    let ego = world.ego();
    let localized = status.localized.unwrap_or(ego.rear_axle);
    let deviation = localized.position - ego.rear_axle.position;
    let differences = perception_differences(world.obstacles_on_level(), &status.perceived);
    let steer_rad_max = avastra_world::sim::VehicleParameters::MKZ.steer_rad_max;
    [
        deviation.norm(),
        deviation_angle_rad(deviation),
        differences.position_m,
        differences.direction_rad,
        differences.size_m,
        differences.velocity_mps,
        status.control.throttle_pct,
        status.steer_rate_radps,
        100.0 * status.control.steer_rad / steer_rad_max,
        ego.acceleration_mps2,
        status.control.brake_pct,
        ego.speed_mps,
    ]
}

/// The paper's state knows morning, noon and night. In twilight headlights are on, as at night.
fn observed(time: TimeOfDay) -> TimeOfDay {
    if time.is_twilight() { TimeOfDay::Night } else { time }
}

/// `angleDeviation`, Eq. 2, by `atan2` (the printed `arctan` loses the quadrant and divides by 0);
/// 0 where the error is too small to have a direction.
fn deviation_angle_rad(deviation: Vec2) -> f64 {
    if deviation.norm() < DEVIATION_M_MIN {
        return 0.0;
    }
    libm::atan2(deviation.y, deviation.x)
}

/// Objects that the differences of Eqs. 3–6 cannot show, because they have no counterpart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerceptionCounts {
    /// Obstacles that are there and are not perceived.
    pub missed: u32,
    /// Objects that are perceived and are not there.
    pub ghosts: u32,
}

/// Counts missed objects and ghosts. Obstacles beyond the sensors' reach are not missed.
pub fn perception_counts(world: &World, status: &Status) -> PerceptionCounts {
    counts(world.obstacles_on_level(), &status.perceived, world.scene().range_m)
}

fn counts<'a>(
    real: impl Iterator<Item = &'a Obstacle> + Clone,
    perceived: &[PerceivedObject],
    range_m: f64,
) -> PerceptionCounts {
    let known = |id: u32| perceived.iter().any(|object| object.id == Some(id));
    let missed =
        real.clone().filter(|obstacle| obstacle.distance_m <= range_m && !known(obstacle.id)).count();
    let ghosts =
        perceived.iter().filter(|object| !real.clone().any(|truth| Some(truth.id) == object.id)).count();
    PerceptionCounts { missed: missed as u32, ghosts: ghosts as u32 }
}

/// The largest difference of each kind between what is perceived and what is (Eqs. 3–6).
#[derive(Debug, Default, PartialEq)]
struct Differences {
    position_m: f64,
    direction_rad: f64,
    size_m: f64,
    velocity_mps: f64,
}

fn perception_differences<'a>(
    real: impl Iterator<Item = &'a Obstacle> + Clone,
    perceived: &[PerceivedObject],
) -> Differences {
    let mut most = Differences::default();
    for object in perceived {
        let Some(truth) = real.clone().find(|truth| Some(truth.id) == object.id) else { continue };
        let outline = &truth.outline;
        let turned_rad = wrap_angle(object.pose.heading_rad - outline.pose.heading_rad).abs();
        let size = nalgebra::Vector3::new(
            object.height_m - truth.height_m,
            object.width_m - 2.0 * outline.half_width_m,
            object.length_m - 2.0 * outline.half_length_m,
        );
        most.position_m = most.position_m.max((object.pose.position - outline.pose.position).norm());
        most.direction_rad = most.direction_rad.max(turned_rad);
        most.size_m = most.size_m.max(size.norm());
        most.velocity_mps = most.velocity_mps.max((object.velocity_mps - truth.velocity_mps).norm());
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::{OrientedBox, Pose};
    use avastra_lang::model::vocabulary::ShownLights;
    use avastra_lang::model::vocabulary::{Body, Colour, Verb};

    #[test]
    fn a_direction_needs_a_deviation() {
        assert_eq!(deviation_angle_rad(Vec2::new(1e-4, 1e-4)), 0.0);
        assert!((deviation_angle_rad(Vec2::new(-1.0, 0.0)) - core::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn differences_are_maxima_over_matched_objects() {
        let truth = Obstacle {
            id: 1,
            body: Body::Sedan,
            colour: Colour::Red,
            verb: Verb::DriveAhead,
            outline: OrientedBox::new(Pose::new(10.0, 0.0, 3.1), 4.8, 1.85),
            height_m: 1.45,
            forward: Vec2::new(-1.0, 0.0),
            lane_heading_rad: core::f64::consts::PI,
            velocity_mps: Vec2::new(-8.0, 0.0),
            elevation_m: 0.0,
            is_apart: false,
            distance_m: 5.0,
            acceleration_mps2: 0.0,
            spawned_tick: 0,
            lights: ShownLights::Off,
        };
        let object = |id: Option<u32>, x_m, heading_rad| PerceivedObject {
            id,
            track: id.unwrap_or(0),
            body: Body::Sedan,
            pose: Pose::new(x_m, 0.0, heading_rad),
            velocity_mps: Vec2::new(-8.0, 3.0),
            length_m: 4.8,
            width_m: 1.85,
            height_m: 1.05,
            predicted: Vec::new(),
        };
        // The second object is a ghost: it is far away, but there is no true object to differ from.
        let found =
            perception_differences([truth].iter(), &[object(Some(1), 10.5, -3.1), object(None, 90.0, 0.0)]);
        assert!((found.position_m - 0.5).abs() < 1e-12);
        assert!((found.direction_rad - (core::f64::consts::TAU - 6.2)).abs() < 1e-12);
        assert!((found.size_m - 0.4).abs() < 1e-12);
        assert!((found.velocity_mps - 3.0).abs() < 1e-12);
        assert_eq!(perception_differences([truth].iter(), &[]), Differences::default());
        let far = Obstacle { distance_m: 200.0, id: 2, ..truth };
        let seen = |objects: &[PerceivedObject]| {
            let counts = counts([truth, far].iter(), objects, 120.0);
            (counts.missed, counts.ghosts)
        };
        assert_eq!(seen(&[]), (1, 0));
        assert_eq!(seen(&[object(Some(1), 10.5, 0.0), object(None, 90.0, 0.0)]), (0, 1));
    }
}
