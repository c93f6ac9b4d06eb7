//! Traffic lights: where to stop, and when it is too late to.
//!
//! Lights are read without error at any distance of interest, in any weather: the map says where
//! they hang. A light that would need harder braking than `red_light_mps2_max` is passed, and stays
//! passed until it is green again (Apollo's traffic-light rule).

use std::sync::Arc;

use crate::ads::status::Reason;
use crate::sim::Scene;
use crate::sim::SignalColour;
use crate::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::planner::HORIZON_M;
use super::speed::Constraint;

/// A bumper this far over the line has passed it, m.
const PASSED_M: f64 = 0.5;

#[derive(Debug, Clone)]
pub struct Lights {
    config: PlanningConfig,
    scene: Arc<Scene>,
    /// One per stop line of the route.
    choices: Vec<Choice>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Choice {
    Open,
    Stop,
    Pass,
}

impl Lights {
    pub fn new(config: &PlanningConfig, scene: &Arc<Scene>) -> Lights {
        let choices = vec![Choice::Open; scene.route.stop_lines.len()];
        Lights { config: *config, scene: Arc::clone(scene), choices }
    }

    /// Adds a stop for each light ahead that demands one.
    pub fn constrain(
        &mut self,
        station_m: f64,
        speed_mps: f64,
        signals: &[SignalColour],
        constraints: &mut Vec<Constraint>,
    ) {
        for (line, choice) in self.scene.route.stop_lines.iter().zip(&mut self.choices) {
            let distance_m = line.station_m - VehicleParameters::MKZ.front_m(station_m);
            if !(-PASSED_M..HORIZON_M).contains(&distance_m) {
                continue;
            }
            if signals[line.signal] == SignalColour::Green {
                *choice = Choice::Open;
                continue;
            }
            if *choice == Choice::Open {
                *choice =
                    if can_stop(&self.config, distance_m, speed_mps) { Choice::Stop } else { Choice::Pass };
            }
            if *choice == Choice::Stop {
                let stop_m = line.station_m - self.config.stop_line_gap_m;
                constraints.push(Constraint::line(Reason::RedLight, stop_m));
            }
        }
    }
}

fn can_stop(config: &PlanningConfig, distance_m: f64, speed_mps: f64) -> bool {
    let decel_mps2 = config.red_light_mps2_max;
    // Until the braking has built up, the vehicle goes on as if for half that time.
    let build_up_s = decel_mps2 / config.jerk_mps3_down / 2.0;
    speed_mps * build_up_s + speed_mps * speed_mps / (2.0 * decel_mps2) <= distance_m.max(0.2)
}
