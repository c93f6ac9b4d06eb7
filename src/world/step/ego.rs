//! How the ego vehicle moves, Apollo's Lincoln MKZ as LGSVL runs it (`state::ego`).
//!
//! A kinematic bicycle on the rear axle behind first-order actuators and inside the friction circle.
//! The pedal table is Apollo's published calibration for LGSVL. No reverse gear, no load transfer, no tyre slip
//! angles: what the tyres cannot give is cut off instead.

use avastra_base::geometry::{Pose, unit_vector, wrap_angle};
use avastra_base::kinematics::GRAVITY_MPS2;
use avastra_lang::model::SPEED_MPS_MAX;

use crate::state::ego::{Ego, VehicleParameters};
use crate::state::sensed::EgoMotion;

/// Pedals and wheel, as a driving system commands them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Control {
    /// 0 to 100.
    pub throttle_pct: f64,
    /// 0 to 100.
    pub brake_pct: f64,
    /// Wanted angle of the road wheels, rad, positive to the left.
    pub steer_rad: f64,
}

impl Control {
    /// The pedals that give an acceleration (see [`pedals_for`]), and an angle of the road wheels, rad.
    pub fn towards(acceleration_mps2: f64, steer_rad: f64) -> Control {
        let (throttle_pct, brake_pct) = pedals_for(acceleration_mps2);
        Control { throttle_pct, brake_pct, steer_rad }
    }
}

/// Throttle (%) and the acceleration it gives (m/s²). The values are rounded from the calibration table at 6 to 10 m/s,
/// from its dead zone to 80 %; above that the table gives less again.
const THROTTLE: [(f64, f64); 5] = [(15.7, 0.0), (20.0, 0.5), (40.0, 2.1), (60.0, 3.65), (80.0, 4.95)];

/// Brake (%) and the deceleration it gives (m/s²), rounded likewise.
const BRAKE: [(f64, f64); 6] =
    [(14.5, 0.0), (20.0, 0.9), (40.0, 3.1), (60.0, 5.8), (80.0, 7.8), (100.0, 8.5)];

/// Acceleration (m/s², negative brakes) that pedals give on a dry road, by Apollo's calibration table.
///
/// The published rows end at 10 m/s. They scarcely change with the speed for the brake. For the throttle they rise in
/// steps: 60 % gives 1.0 m/s² below 2.4 m/s, 2.0 to 2.2 below 6.2 m/s, 3.5 and more above. One row for every speed is
/// ours.
pub fn pedal_acceleration_mps2(throttle_pct: f64, brake_pct: f64) -> f64 {
    read(&THROTTLE, throttle_pct) - read(&BRAKE, brake_pct)
}

/// The pedals `(throttle %, brake %)` that give an acceleration: the inverse of the table.
///
/// As in Apollo, the pedal in use never rests inside its dead zone. Beyond the ends of the table it is
/// the pedal of the last row.
pub fn pedals_for(acceleration_mps2: f64) -> (f64, f64) {
    let invert = |table: &[(f64, f64)], wanted: f64| {
        let after = table.partition_point(|row| row.1 <= wanted).clamp(1, table.len() - 1);
        let ((x0, y0), (x1, y1)) = (table[after - 1], table[after]);
        (x0 + (x1 - x0) * (wanted - y0) / (y1 - y0)).clamp(table[0].0, table[table.len() - 1].0)
    };
    if acceleration_mps2 >= 0.0 {
        (invert(&THROTTLE, acceleration_mps2), 0.0)
    } else {
        (0.0, invert(&BRAKE, -acceleration_mps2))
    }
}

/// Piecewise linear, held beyond the ends.
fn read(table: &[(f64, f64)], pedal_pct: f64) -> f64 {
    let after = table.partition_point(|row| row.0 <= pedal_pct).clamp(1, table.len() - 1);
    let ((x0, y0), (x1, y1)) = (table[after - 1], table[after]);
    let fraction = ((pedal_pct - x0) / (x1 - x0)).clamp(0.0, 1.0);
    y0 + (y1 - y0) * fraction
}

impl Ego {
    /// One tick of `dt_s` under a command; commands out of range are cut off, NaN counts as 0.
    pub fn step(&mut self, control: &Control, friction: f64, dt_s: f64) {
        let car = &VehicleParameters::MKZ;
        let command = |value: f64, low: f64, high: f64| {
            if value.is_nan() { 0.0 } else { value.clamp(low, high) }
        };
        let lagged = dt_s / car.pedal_lag_s;
        self.throttle_pct += (command(control.throttle_pct, 0.0, 100.0) - self.throttle_pct) * lagged;
        self.brake_pct += (command(control.brake_pct, 0.0, 100.0) - self.brake_pct) * lagged;
        let wanted_rad = command(control.steer_rad, -car.steer_rad_max, car.steer_rad_max);
        let turn_rad = (wanted_rad - self.motion.steer_rad) * (dt_s / car.steer_lag_s);
        let turn_rad_max = car.steer_rate_radps_max * dt_s;
        let steer_rad = self.motion.steer_rad + turn_rad.clamp(-turn_rad_max, turn_rad_max);

        let speed_mps = self.motion.speed_mps;
        let wanted_mps2 = pedal_acceleration_mps2(self.throttle_pct, self.brake_pct)
            .clamp(-car.deceleration_mps2_max, car.acceleration_mps2_max);
        let wheel_curvature_per_m = libm::tan(steer_rad) / car.wheelbase_m;
        let (forward_mps2, curvature_per_m) =
            within_friction(wanted_mps2, wheel_curvature_per_m, speed_mps, friction);

        let faster_mps = (speed_mps + forward_mps2 * dt_s).min(SPEED_MPS_MAX);
        // A car that stops within the tick stays where it stopped.
        let (next_mps, way_m) = if faster_mps > 0.0 {
            (faster_mps, (speed_mps + faster_mps) / 2.0 * dt_s)
        } else if forward_mps2 < 0.0 {
            (0.0, speed_mps * speed_mps / (-2.0 * forward_mps2))
        } else {
            (0.0, 0.0)
        };
        let turned_rad = curvature_per_m * way_m;
        let start = self.motion.rear_axle;
        self.motion = EgoMotion {
            rear_axle: Pose {
                position: start.position + unit_vector(start.heading_rad + turned_rad / 2.0) * way_m,
                heading_rad: wrap_angle(start.heading_rad + turned_rad),
            },
            speed_mps: next_mps,
            acceleration_mps2: (next_mps - speed_mps) / dt_s,
            yaw_rate_radps: turned_rad / dt_s,
            steer_rad,
            touched: self.motion.touched,
        };
        self.place(self.motion);
    }
}

/// The part of a wanted acceleration and curvature that the tyres give.
///
/// Their force has at most the size μ·g. A demand beyond that keeps its direction and loses size. So hard braking in a
/// bend costs some of the bend and some of the braking.
fn within_friction(forward_mps2: f64, curvature_per_m: f64, speed_mps: f64, friction: f64) -> (f64, f64) {
    let lateral_mps2 = speed_mps * speed_mps * curvature_per_m;
    let demand_mps2 = (forward_mps2 * forward_mps2 + lateral_mps2 * lateral_mps2).sqrt();
    let grip_mps2 = friction * GRAVITY_MPS2;
    let part = if demand_mps2 > grip_mps2 { grip_mps2 / demand_mps2 } else { 1.0 };
    (forward_mps2 * part, curvature_per_m * part)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sim::DT_S;
    use crate::state::environment::Grip;

    /// The calibration of stopping distances: 30, 50 and 70 km/h on a dry, a wet (0.2 mm) and a flooded (2 mm) road.
    /// The reference is ∫ v / min(6, μ(v) g) dv and a lag of at most a quarter of a second.
    #[test]
    fn stopping_distance_follows_speed_and_water() {
        let expected_m = |speed_mps: f64, water_mm: f64| {
            let slices = 1000;
            let dv_mps = speed_mps / f64::from(slices);
            let slice_m = |slice| {
                let v_mps = (f64::from(slice) + 0.5) * dv_mps;
                v_mps * dv_mps / (Grip::under(water_mm).friction(v_mps) * GRAVITY_MPS2).min(6.0)
            };
            (0..slices).map(slice_m).sum::<f64>()
        };
        let mut last_m = 0.0;
        for (speed_kmph, table_m) in
            [(30.0, [5.8, 5.8, 7.1]), (50.0, [16.1, 16.1, 19.7]), (70.0, [31.5, 31.5, 45.2])]
        {
            let speed_mps = speed_kmph / 3.6;
            for (water_mm, table_m) in [0.0, 0.2, 2.0].into_iter().zip(table_m) {
                let braking_m = expected_m(speed_mps, water_mm);
                assert!((braking_m - table_m).abs() < 0.1, "{speed_kmph} km/h, {water_mm} mm: {braking_m}");
                let mut ego = Ego::new(Pose::new(0.0, 0.0, 0.0), speed_mps);
                let control = Control { brake_pct: 100.0, ..Control::default() };
                while ego.motion.speed_mps > 0.0 {
                    ego.step(&control, Grip::under(water_mm).friction(ego.motion.speed_mps), DT_S);
                }
                let found_m = ego.motion.rear_axle.position.x;
                assert!(
                    (0.0..0.25 * speed_mps).contains(&(found_m - braking_m)),
                    "{speed_kmph} km/h, {water_mm} mm: {found_m}"
                );
                assert!(found_m >= last_m - 1e-9 || water_mm == 0.0);
                last_m = found_m;
            }
        }
    }

    #[test]
    fn full_lock_turns_on_the_wheelbase_circle() {
        let mut ego = Ego::new(Pose::new(0.0, 0.0, 0.0), 2.0);
        let control = Control { steer_rad: 1.0, ..Control::default() };
        for _ in 0..200 {
            ego.step(&control, 0.85, DT_S);
        }
        let radius_m = ego.motion.speed_mps / ego.motion.yaw_rate_radps;
        assert!((radius_m - 2.837007 / libm::tan(0.5127)).abs() < 0.01, "{radius_m}");
    }

    #[test]
    fn the_tyres_limit_the_bend() {
        let mut ego = Ego::new(Pose::new(0.0, 0.0, 0.0), 15.0);
        let control = Control { steer_rad: 0.4, ..Control::default() };
        for _ in 0..200 {
            ego.step(&control, 0.5, DT_S);
            let lateral_mps2 = ego.motion.speed_mps * ego.motion.yaw_rate_radps;
            assert!(lateral_mps2 <= 0.5 * GRAVITY_MPS2 + 1e-9);
        }
    }

    proptest! {
        #[test]
        fn pedals_invert_the_table(wanted_mps2 in -8.5..4.95_f64) {
            let (throttle_pct, brake_pct) = pedals_for(wanted_mps2);
            prop_assert!(throttle_pct == 0.0 || brake_pct == 0.0);
            let given_mps2 = pedal_acceleration_mps2(throttle_pct, brake_pct);
            prop_assert!((given_mps2 - wanted_mps2).abs() < 1e-9, "{given_mps2} for {wanted_mps2}");
        }
    }
}
