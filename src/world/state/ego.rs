//! The ego vehicle as a moment has it: Apollo's Lincoln MKZ as LGSVL runs it.

use avastra_base::geometry::{Frame, OrientedBox, Pose, Vec2};

use crate::state::sensed::EgoMotion;
use crate::state::trace::traced;

/// Dimensions and limits (Apollo `vehicle_param.pb.txt` of the LGSVL calibration).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleParameters {
    pub length_m: f64,
    pub width_m: f64,
    /// With what stands on its roof. The world does not need it, other programs do.
    pub height_m: f64,
    pub wheelbase_m: f64,
    pub rear_axle_to_front_m: f64,
    pub rear_axle_to_back_m: f64,
    /// Largest angle of the road wheels, rad.
    pub steer_rad_max: f64,
    /// Fastest change of that angle, rad/s.
    pub steer_rate_radps_max: f64,
    pub acceleration_mps2_max: f64,
    /// Magnitude.
    pub deceleration_mps2_max: f64,
    /// Time constant of throttle and brake, s. Ours.
    pub pedal_lag_s: f64,
    /// Time constant of the steering, s. Ours.
    pub steer_lag_s: f64,
    /// Four wheels at 530 kg each (Apollo `control_conf`), t.
    pub mass_t: f64,
}

impl VehicleParameters {
    pub const MKZ: VehicleParameters = VehicleParameters {
        length_m: 4.70,
        width_m: 2.06,
        height_m: 2.05,
        wheelbase_m: 2.837007,
        rear_axle_to_front_m: 3.705,
        rear_axle_to_back_m: 0.995,
        steer_rad_max: 0.5127,
        steer_rate_radps_max: 0.436,
        acceleration_mps2_max: 2.0,
        deceleration_mps2_max: 6.0,
        pedal_lag_s: 0.15,
        steer_lag_s: 0.1,
        mass_t: 2.12,
    };

    /// Station of the front bumper if the rear axle is at `station_m`, m.
    pub fn front_m(&self, station_m: f64) -> f64 {
        station_m + self.rear_axle_to_front_m
    }

    /// Station of the rear bumper if the rear axle is at `station_m`, m.
    pub fn rear_m(&self, station_m: f64) -> f64 {
        station_m - self.rear_axle_to_back_m
    }

    /// From the rear axle to the centre of the outline, m.
    pub fn rear_axle_to_centre_m(&self) -> f64 {
        (self.rear_axle_to_front_m - self.rear_axle_to_back_m) / 2.0
    }
}

/// The moving state of the ego vehicle, actuators included.
#[derive(Debug, Clone)]
pub struct Ego {
    pub motion: EgoMotion,
    /// The output of the pedals, throttle and brake, after their lag, %.
    pub throttle_pct: f64,
    pub brake_pct: f64,
    /// These two follow from the pose, and are kept because they are asked for so often.
    pub outline: OrientedBox,
    pub frame: Frame,
}

impl Ego {
    /// Rolling straight on at `speed_mps`, with no pedal pressed.
    pub fn new(rear_axle: Pose, speed_mps: f64) -> Ego {
        let motion = EgoMotion::straight(rear_axle, speed_mps);
        let outline = outline_at(&rear_axle, rear_axle.forward());
        Ego { motion, throttle_pct: 0.0, brake_pct: 0.0, outline, frame: Frame::of(&outline) }
    }

    pub fn velocity_mps(&self) -> Vec2 {
        self.frame.forward() * self.motion.speed_mps
    }

    /// Sets the motion, whatever moves the vehicle.
    pub fn place(&mut self, motion: EgoMotion) {
        self.motion = motion;
        let forward = motion.rear_axle.forward();
        self.outline = outline_at(&motion.rear_axle, forward);
        self.frame = Frame::along(&self.outline, forward);
    }
}

/// The outline of the ego vehicle whose rear axle is at a pose, of which `forward` is the unit vector.
fn outline_at(rear_axle: &Pose, forward: Vec2) -> OrientedBox {
    let car = &VehicleParameters::MKZ;
    let position = rear_axle.position + forward * car.rear_axle_to_centre_m();
    OrientedBox::new(Pose { position, ..*rear_axle }, car.length_m, car.width_m)
}

traced! {
    // Outline and frame follow from the pose.
    Ego { motion, throttle_pct, brake_pct } but { outline, frame };
    EgoMotion { rear_axle, speed_mps, acceleration_mps2, yaw_rate_radps, steer_rad, touched };
}
