//! Traffic lights: where to stop, and when it is too late to.
//!
//! A light that would need harder braking than `red_light_mps2_max` is passed, and stays passed until
//! it is green again (Apollo's traffic-light rule, weakness (g)). One whose colour is not known is
//! taken for red, as in Apollo.

use std::sync::Arc;

use crate::ads::status::Reason;
use crate::sim::Scene;
use crate::sim::SignalColour;
use crate::sim::VehicleParameters;

use super::super::config::PlanningConfig;
use super::planner::HORIZON_M;
use super::rules::can_stop;
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

    /// Adds a stop for each light ahead that demands one. `lights` holds what is known of the light of
    /// each stop line.
    pub fn constrain(
        &mut self,
        station_m: f64,
        speed_mps: f64,
        lights: &[Option<SignalColour>],
        constraints: &mut Vec<Constraint>,
    ) {
        let lines = self.scene.route.stop_lines.iter().zip(lights);
        for ((line, light), choice) in lines.zip(&mut self.choices) {
            let distance_m = line.station_m - VehicleParameters::MKZ.front_m(station_m);
            if !(-PASSED_M..HORIZON_M).contains(&distance_m) {
                continue;
            }
            if *light == Some(SignalColour::Green) {
                *choice = Choice::Open;
                continue;
            }
            if *choice == Choice::Open {
                let stops = can_stop(&self.config, self.config.red_light_mps2_max, distance_m, speed_mps);
                *choice = if stops { Choice::Stop } else { Choice::Pass };
            }
            if *choice == Choice::Stop {
                let stop_m = line.station_m - self.config.stop_line_gap_m;
                constraints.push(Constraint::line(Reason::RedLight, stop_m));
            }
        }
    }
}
