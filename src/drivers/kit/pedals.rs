//! The pedals: from a planned place, speed and acceleration to the acceleration of a tick.
//!
//! Apollo's cascade: the station error becomes a wanted speed, the speed error an acceleration, to which the plan's
//! own acceleration is added, read a little ahead.

use avastra_world::section;
use avastra_world::sim::DT_S;

use super::point::Point;
use super::speed::HOLD_MPS2;

section! {
    /// Speed: Apollo's cascade of two controllers.
    pub struct PedalsConfig {
        /// Speed wanted per metre of station error, 1/s, in `[0, 5]`. Apollo station PID `kp`: 0.2.
        station_kp: f64 = 0.2, 0.0..=5.0;
        /// Bound of the station error, m, in `[0, 10]`. Apollo `station_error_limit`: 2.0.
        station_error_m_max: f64 = 2.0, 0.0..=10.0;
        /// Bound of the speed error, m/s, in `[0, 10]`. Apollo `speed_controller_input_limit`: 2.0.
        speed_error_mps_max: f64 = 2.0, 0.0..=10.0;
        /// Up to this speed the low gains hold, m/s, in `[0, 20]`. Apollo `switch_speed`: 2.
        switch_mps: f64 = 2.0, 0.0..=20.0;
        /// Acceleration per speed error at low speed, 1/s, in `[0, 5]`. Apollo `low_speed_pid_conf`, `kp`: 0.5.
        speed_kp_low: f64 = 0.5, 0.0..=5.0;
        /// Acceleration per speed error above `switch_mps`, 1/s, in `[0, 5]`. Apollo `high_speed_pid_conf`, `kp`: 1.0.
        speed_kp_high: f64 = 1.0, 0.0..=5.0;
        /// Acceleration per speed error and second, 1/s², in `[0, 5]`. Apollo `ki`: 0.3.
        speed_ki: f64 = 0.3, 0.0..=5.0;
        /// Bound of the integral part, m/s², in `[0, 5]`. Apollo `integrator_saturation_level`: 0.3.
        integral_mps2_max: f64 = 0.3, 0.0..=5.0;
        /// The plan's acceleration is read this far ahead, s, in `[0, 1]`. Apollo `preview_window`: 20 cycles of 10 ms.
        preview_s: f64 = 0.2, 0.0..=1.0;
        /// Braking held at rest, magnitude, m/s², in `[0, 6]`. Apollo `standstill_acceleration`: -3.0.
        standstill_mps2: f64 = HOLD_MPS2, 0.0..=6.0;
        /// Planned speeds below this mean a full stop, m/s, in `[0, 2]`. Apollo `max_abs_speed_when_stopped`: 0.2.
        stopped_mps: f64 = 0.2, 0.0..=2.0;
    }
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

    /// The acceleration for this tick, m/s², of a vehicle at a station; to be called every tick with the points of the
    /// plan for now and for [`Pedals::preview_s`] later.
    pub fn acceleration_mps2(&mut self, plan: [Point; 2], station_m: f64, speed_mps: f64) -> f64 {
        let config = &self.config;
        let [target, Point { acceleration_mps2: planned_mps2, .. }] = plan;
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
