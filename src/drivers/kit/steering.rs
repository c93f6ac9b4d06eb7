//! Steering: a linear-quadratic regulator over a table of speeds, with feed-forward.
//!
//! Apollo 7.0's `LatController`: dynamic bicycle model, state `[e_y, e_y', e_ψ, e_ψ']` at the centre
//! of mass, bilinear discretisation, Riccati iteration, weights scheduled over speed. Apollo solves
//! it anew each cycle; here it is solved once for each whole m/s and interpolated between.

use std::sync::{Arc, LazyLock};

use nalgebra::{Matrix4, Vector4};

use avastra_base::geometry::{Pose, wrap_angle};
use avastra_world::section;
use avastra_world::sim::{DT_S, EgoMotion, VehicleParameters};

use super::guide::Guide;

/// Number of speeds in the table: 1 to 30 m/s.
const SPEEDS: usize = 30;
const ITERATIONS_MAX: usize = 600;
const CONVERGED: f64 = 1e-4;

section! {
    /// Settings of the lateral controller.
    pub struct SteeringConfig {
        /// Weight of the lateral error, in `[0.001, 100]`. Apollo `matrix_q`: 0.05.
        weight_offset: f64 = 0.05, 0.001..=100.0;
        /// Weight of the heading error, in `[0.001, 100]`. Apollo `matrix_q`: 1.0.
        weight_heading: f64 = 1.0, 0.001..=100.0;
        /// Weight of the steering angle, in `[0.01, 100]`. Apollo `matrix_r`: 1.0.
        weight_steer: f64 = 1.0, 0.01..=100.0;
        /// Cornering stiffness of an axle, N/rad, in `[1000, 10000000]`. Apollo `cf`, `cr`: 155494.663.
        cornering_stiffness_nprad: f64 = 155_494.663, 1000.0..=10_000_000.0;
        /// Mass of the vehicle, kg, in `[100, 100000]`. Apollo: four wheels of 530.
        mass_kg: f64 = 1000.0 * VehicleParameters::MKZ.mass_t, 100.0..=100_000.0;
        /// Lateral acceleration that bounds the steering angle, m/s², in `[0.5, 20]`. Apollo `max_lateral_acceleration`: 5.0.
        lateral_acceleration_mps2_max: f64 = 5.0, 0.5..=20.0;
        /// The curvature is read this far ahead to make up for the lag of the steering, s, in `[0, 1]`. Ours.
        preview_s: f64 = 0.3, 0.0..=1.0;
        /// Below this speed the wheel is not moved, m/s, in `[0.01, 2]`. Apollo `lock_steer_speed`: 0.081.
        lock_speed_mps: f64 = 0.081, 0.01..=2.0;
    }
}

/// How a path lies beside the guide at a station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Aside {
    /// m to the left.
    pub offset_m: f64,
    /// Change of the offset per metre of station.
    pub slope: f64,
    /// Change of the slope per metre, 1/m.
    pub curvature_per_m: f64,
}

/// Apollo's gain schedules: speed (m/s) and ratio of the weight.
const OFFSET_SCHEDULE: [(f64, f64); 5] = [(4.0, 1.0), (8.0, 0.6), (12.0, 0.2), (20.0, 0.1), (25.0, 0.05)];
const HEADING_SCHEDULE: [(f64, f64); 5] = [(4.0, 1.0), (8.0, 0.6), (12.0, 0.4), (20.0, 0.2), (25.0, 0.1)];

/// Steers along a [`Guide`].
#[derive(Debug, Clone)]
pub struct Steering {
    config: SteeringConfig,
    /// Feedback gains at 1, 2, … m/s.
    gains: Vec<Vector4<f64>>,
}

impl Steering {
    /// The controller with the default settings, which is solved once and shared: a solution takes as long as a few
    /// hundred ticks of driving.
    pub fn usual() -> Arc<Steering> {
        static USUAL: LazyLock<Arc<Steering>> =
            LazyLock::new(|| Arc::new(Steering::new(&SteeringConfig::default())));
        Arc::clone(&USUAL)
    }

    /// A controller with these settings.
    pub fn shared(config: &SteeringConfig) -> Arc<Steering> {
        if *config == SteeringConfig::default() { Steering::usual() } else { Arc::new(Steering::new(config)) }
    }

    fn new(config: &SteeringConfig) -> Steering {
        let gains = (1..=SPEEDS).map(|speed| solve(config, speed as f64)).collect();
        Steering { config: *config, gains }
    }

    /// Wanted angle of the road wheels, rad, for a vehicle that believes its rear axle to be at
    /// `rear_axle`, near `station_m` of the guide.
    pub fn steer_rad(&self, guide: &Guide, rear_axle: &Pose, station_m: f64, motion: &EgoMotion) -> f64 {
        self.steer_aside_rad(guide, &|_| Aside::default(), rear_axle, station_m, motion)
    }

    /// As [`Steering::steer_rad`], for a path that lies beside the guide.
    pub fn steer_aside_rad(
        &self,
        guide: &Guide,
        aside: &dyn Fn(f64) -> Aside,
        rear_axle: &Pose,
        station_m: f64,
        motion: &EgoMotion,
    ) -> f64 {
        let vehicle = VehicleParameters::MKZ;
        let speed_mps = motion.speed_mps;
        if speed_mps < self.config.lock_speed_mps {
            return motion.steer_rad;
        }
        let rear_m = vehicle.wheelbase_m / 2.0;
        let front_m = vehicle.wheelbase_m - rear_m;
        let centre = rear_axle.offset(rear_m, 0.0);
        let beside = guide.locate(centre.position, Some(station_m + rear_m));
        let reference = guide.pose_at(beside.station_m);
        let ahead_m = beside.station_m + speed_mps * self.config.preview_s;
        let (here, ahead) = (aside(beside.station_m), aside(ahead_m));
        let curvature_here_per_m = guide.curvature_at(beside.station_m) + here.curvature_per_m;
        let curvature_per_m = guide.curvature_at(ahead_m) + ahead.curvature_per_m;

        let path_rad = reference.heading_rad + libm::atan(here.slope);
        let heading_error_rad = wrap_angle(rear_axle.heading_rad - path_rad);
        // The rear axle rolls without slip at town speeds; the centre of mass swings out beside it.
        let slip_mps = motion.yaw_rate_radps * rear_m;
        let error = Vector4::new(
            beside.offset_m - here.offset_m,
            speed_mps * libm::sin(heading_error_rad) + slip_mps,
            heading_error_rad,
            motion.yaw_rate_radps - speed_mps * curvature_here_per_m,
        );
        let gains = self.gains_at(speed_mps);
        // On an even curve the centre of mass stays on the line only with this heading error.
        let understeer = front_m * self.config.mass_kg * speed_mps * speed_mps
            / (2.0 * self.config.cornering_stiffness_nprad * vehicle.wheelbase_m);
        let steady_heading_rad = -(rear_m - understeer) * curvature_here_per_m;
        let feedback_rad = -(gains[0] * error[0]
            + gains[1] * error[1]
            + gains[2] * (error[2] - steady_heading_rad)
            + gains[3] * error[3]);
        let feed_forward_rad = libm::atan(vehicle.wheelbase_m * curvature_per_m);
        let bound_rad = libm::atan(
            self.config.lateral_acceleration_mps2_max * vehicle.wheelbase_m / (speed_mps * speed_mps),
        )
        .min(vehicle.steer_rad_max);
        (feedback_rad + feed_forward_rad).clamp(-bound_rad, bound_rad)
    }

    fn gains_at(&self, speed_mps: f64) -> Vector4<f64> {
        let place = (speed_mps - 1.0).clamp(0.0, (SPEEDS - 1) as f64);
        let index = (place as usize).min(SPEEDS - 2);
        let fraction = place - index as f64;
        self.gains[index] * (1.0 - fraction) + self.gains[index + 1] * fraction
    }
}

/// Feedback gains at one speed: discrete Riccati equation by iteration.
fn solve(config: &SteeringConfig, speed_mps: f64) -> Vector4<f64> {
    let vehicle = VehicleParameters::MKZ;
    let rear_m = vehicle.wheelbase_m / 2.0;
    let front_m = vehicle.wheelbase_m - rear_m;
    let (stiffness, mass) = (config.cornering_stiffness_nprad, config.mass_kg);
    let inertia = mass / 2.0 * (front_m * front_m + rear_m * rear_m);
    let balance = rear_m * stiffness - front_m * stiffness;
    let spread = front_m * front_m * stiffness + rear_m * rear_m * stiffness;
    #[rustfmt::skip]
    let motion = Matrix4::new(
        0.0, 1.0, 0.0, 0.0,
        0.0, -2.0 * stiffness / (mass * speed_mps), 2.0 * stiffness / mass, balance / (mass * speed_mps),
        0.0, 0.0, 0.0, 1.0,
        0.0, balance / (inertia * speed_mps), -balance / inertia, -spread / (inertia * speed_mps),
    );
    let half = motion * (DT_S / 2.0);
    let identity = Matrix4::identity();
    let inverse = (identity - half).try_inverse().expect("a small step keeps the matrix regular");
    let step = inverse * (identity + half);
    let input = Vector4::new(0.0, stiffness / mass, 0.0, front_m * stiffness / inertia) * DT_S;
    let weights = Matrix4::from_diagonal(&Vector4::new(
        config.weight_offset * scheduled(&OFFSET_SCHEDULE, speed_mps),
        0.0,
        config.weight_heading * scheduled(&HEADING_SCHEDULE, speed_mps),
        0.0,
    ));
    let gains_of = |cost: &Matrix4<f64>| {
        let weighted = cost * input;
        (step.transpose() * weighted) / (config.weight_steer + input.dot(&weighted))
    };
    let mut cost = weights;
    for _ in 0..ITERATIONS_MAX {
        let gains = gains_of(&cost);
        let closed = step - input * gains.transpose();
        let next = weights + step.transpose() * cost * closed;
        let change = (next - cost).amax();
        cost = next;
        if change < CONVERGED {
            break;
        }
    }
    gains_of(&cost)
}

/// Piecewise linear, constant beyond the ends.
fn scheduled(schedule: &[(f64, f64)], speed_mps: f64) -> f64 {
    let after = schedule.partition_point(|(at_mps, _)| *at_mps <= speed_mps);
    if after == 0 {
        return schedule[0].1;
    }
    if after == schedule.len() {
        return schedule[schedule.len() - 1].1;
    }
    let ((from, a), (to, b)) = (schedule[after - 1], schedule[after]);
    a + (b - a) * (speed_mps - from) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feedback_steers_back_at_every_speed() {
        for gains in &Steering::new(&SteeringConfig::default()).gains {
            assert!(gains[0] > 0.0 && gains[2] > 0.0, "{gains:?}");
        }
    }

    #[test]
    fn schedules_are_piecewise_linear() {
        assert_eq!(scheduled(&OFFSET_SCHEDULE, 2.0), 1.0);
        assert!((scheduled(&OFFSET_SCHEDULE, 6.0) - 0.8).abs() < 1e-12);
        assert_eq!(scheduled(&OFFSET_SCHEDULE, 30.0), 0.05);
    }
}
