//! Control: pedals and wheel that follow the plan, every tick.
//!
//! Apollo's cascade: the station error becomes a wanted speed, the speed error an acceleration, to
//! which the plan's own acceleration is added, read a little ahead; the calibration table turns it
//! into pedals. Steering is `ads::steering`. Left out: Apollo's low-pass filters of the steering
//! angle (10 Hz, above what the actuator follows) and its calibration by speed (see `sim::ego`).

use std::sync::Arc;

use crate::ads::steering::Steering;
use crate::geometry::Pose;
use crate::sim::{Control, DT_S, EgoMotion, pedals_for};

use super::config::{ControlConfig, PedalsConfig};
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
        let trajectory = planner.trajectory();
        let now = trajectory.at(since_s);
        let target = Target {
            station_m: now.station_m,
            speed_mps: now.speed_mps,
            soon_mps2: trajectory.at(since_s + self.pedals.preview_s()).acceleration_mps2,
        };
        let acceleration_mps2 = self
            .pedals
            .acceleration_mps2(&target, station_m, motion.speed_mps)
            .clamp(-brake_mps2_max, throttle_mps2_max);
        let (throttle_pct, brake_pct) = pedals_for(acceleration_mps2);
        let aside = |at_m: f64| planner.lateral().aside(at_m);
        let wanted_rad = self.steering.steer_aside_rad(planner.guide(), &aside, localized, station_m, motion);
        self.steer_rad += (wanted_rad - self.steer_rad) * (DT_S / (lag_s + DT_S));
        Control { throttle_pct, brake_pct, steer_rad: self.steer_rad }
    }
}

/// What a plan wants now, and of the acceleration a little later.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    pub station_m: f64,
    pub speed_mps: f64,
    /// [`Pedals::preview_s`] from now.
    pub soon_mps2: f64,
}

/// The cascade of station and speed.
#[derive(Debug, Clone)]
pub struct Pedals {
    config: PedalsConfig,
    integral_mps2: f64,
}

impl Pedals {
    pub fn new(config: &PedalsConfig) -> Pedals {
        Pedals { config: *config, integral_mps2: 0.0 }
    }

    /// The plan's acceleration is read this far ahead, s.
    pub fn preview_s(&self) -> f64 {
        self.config.preview_s
    }

    /// The acceleration for this tick, m/s², of a vehicle at a station; to be called every tick.
    pub fn acceleration_mps2(&mut self, target: &Target, station_m: f64, speed_mps: f64) -> f64 {
        let config = &self.config;
        let planned_mps2 = target.soon_mps2;
        if target.speed_mps <= config.stopped_mps && planned_mps2.abs() <= 0.01 {
            // Apollo's full stop is the lesser of -3 m/s² and the command. With its bounds the command is
            // never below -2.3 where nothing is planned, so that is the same; the integral begins anew.
            // Its other occasion, a path that ends within 0.3 m, does not exist: plans here are stretches
            // of time, and one that ends in a stop ends in points at rest.
            self.integral_mps2 = 0.0;
            return -config.standstill_mps2;
        }
        let station_error_m =
            (target.station_m - station_m).clamp(-config.station_error_m_max, config.station_error_m_max);
        let speed_error_mps = (target.speed_mps - speed_mps + config.station_kp * station_error_m)
            .clamp(-config.speed_error_mps_max, config.speed_error_mps_max);
        self.integral_mps2 = (self.integral_mps2 + config.speed_ki * speed_error_mps * DT_S)
            .clamp(-config.integral_mps2_max, config.integral_mps2_max);
        let gain = if speed_mps <= config.switch_mps { config.speed_kp_low } else { config.speed_kp_high };
        planned_mps2 + gain * speed_error_mps + self.integral_mps2
    }
}
