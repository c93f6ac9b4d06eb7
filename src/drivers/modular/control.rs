//! Control: pedals and wheel that follow the plan, every tick.
//!
//! The plan goes through Apollo's cascade (`kit::Pedals`), whose acceleration the calibration table turns into
//! pedals. Left out: Apollo's low-pass filters of the steering angle (10 Hz, above what the actuator follows) and
//! its calibration by speed (see `world::step::ego`).

use std::sync::Arc;

use crate::kit::{Pedals, Steering};
use avastra_base::geometry::Pose;
use avastra_world::sim::{Control, DT_S, EgoMotion};

use super::config::ControlConfig;
use super::planning::Planner;

#[derive(Debug, Clone)]
pub struct Controller {
    config: ControlConfig,
    steering: Arc<Steering>,
    pedals: Pedals,
    /// The last commanded angle, for a planted lag, rad.
    steer_rad: f64,
}

impl Controller {
    pub fn new(config: &ControlConfig) -> Controller {
        let steering = Steering::shared(&config.steering);
        Controller { config: *config, steering, pedals: Pedals::new(&config.pedals), steer_rad: 0.0 }
    }

    /// The command `since_s` after the trajectory was planned, believed to be at `localized`.
    pub fn follow(
        &mut self,
        planner: &Planner,
        since_s: f64,
        localized: &Pose,
        station_m: f64,
        motion: &EgoMotion,
    ) -> Control {
        let actuators = &self.config.actuators;
        let (brake_mps2_max, throttle_mps2_max) = (actuators.brake_mps2_max, actuators.throttle_mps2_max);
        let lag_s = actuators.steer_lag_s;
        let plan = [since_s, since_s + self.pedals.preview_s()].map(|time_s| planner.trajectory.at(time_s));
        let acceleration_mps2 = self
            .pedals
            .acceleration_mps2(plan, station_m, motion.speed_mps)
            .clamp(-brake_mps2_max, throttle_mps2_max);
        let aside = |at_m: f64| planner.lateral.aside(at_m);
        let wanted_rad = self.steering.steer_aside_rad(planner.guide(), &aside, localized, station_m, motion);
        self.steer_rad += (wanted_rad - self.steer_rad) * (DT_S / (lag_s + DT_S));
        Control::towards(acceleration_mps2, self.steer_rad)
    }
}
