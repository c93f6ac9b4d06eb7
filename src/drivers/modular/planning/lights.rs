//! Traffic lights: where to stop, and when it is too late to.
//!
//! A light that would need harder braking than `red_light_mps2_max` is passed for as long as it would (Apollo's
//! traffic-light rule, weakness `late_red_passed`). A stop once decided holds until the light is green, also for a
//! vehicle that has come to rest beyond the line, unless it is in the junction already. If the stop needs it, the
//! vehicle brakes as hard as in an emergency. Once it stands at the line it stays where it is, whatever its
//! position seems to be. A light whose colour is not known is taken for red, as in Apollo.

use std::sync::Arc;

use crate::status::Reason;
use avastra_world::sim::{Scene, SignalColour, VehicleParameters};

use super::super::config::PlanningConfig;
use super::HORIZON_M;
use super::kept_clear::can_stop;
use super::speed::Constraint;
use super::stages::{STOPPED_M, STOPPED_MPS};
use super::trajectory::Point;

/// A bumper this far over the line while the light let it go has passed it, m. Ours.
const PASSED_M: f64 = 0.5;
/// A bumper this far over the line is in the junction, which the vehicle must then clear, m. The `min_pass_s_distance`
/// of Apollo's scenarios at lights.
const INSIDE_M: f64 = 3.0;
/// From the decision until the brakes follow the plan, s: one frame, and their lag. Without it a vehicle that only
/// just can stop comes to rest beyond the line. Ours.
const RESPONSE_S: f64 = 0.25;

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
    /// Stands at the line.
    Stand,
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
        start: &Point,
        lights: &[Option<SignalColour>],
        constraints: &mut Vec<Constraint>,
    ) {
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        let lines = self.scene.route.stop_lines.iter().zip(lights);
        for ((line, light), choice) in lines.zip(&mut self.choices) {
            let distance_m = line.station_m - front_m;
            if !(-INSIDE_M..HORIZON_M).contains(&distance_m) {
                continue;
            }
            if *light == Some(SignalColour::Green) {
                *choice = Choice::Open;
                continue;
            }
            let decided = matches!(choice, Choice::Stop | Choice::Stand);
            if !decided && distance_m >= -PASSED_M {
                let hardest_mps2 = self.config.red_light_mps2_max;
                let stops = can_stop(&self.config, hardest_mps2, distance_m, start, RESPONSE_S);
                *choice = if stops { Choice::Stop } else { Choice::Pass };
            }
            if *choice == Choice::Stop && start.speed_mps < STOPPED_MPS && distance_m < STOPPED_M {
                *choice = Choice::Stand;
            }
            match choice {
                Choice::Stop => constraints.push(Constraint::red_light(&self.config, line.station_m)),
                Choice::Stand => constraints.push(Constraint::line(Reason::RedLight, front_m)),
                Choice::Open | Choice::Pass => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::straight;

    /// The line of the test road, m.
    const LINE_M: f64 = 100.0;

    fn usual() -> Lights {
        Lights::new(&PlanningConfig::default(), &straight())
    }

    /// Where a light makes the vehicle stop with its front this far over the line, m, speed and acceleration; `None` if it
    /// lets it go on.
    fn stop_m(
        lights: &mut Lights,
        over_m: f64,
        (speed_mps, acceleration_mps2): (f64, f64),
        colour: SignalColour,
    ) -> Option<f64> {
        let mut constraints = Vec::new();
        let station_m = LINE_M + over_m - VehicleParameters::MKZ.front_m(0.0);
        let start = Point { station_m, speed_mps, acceleration_mps2 };
        lights.constrain(&start, &[Some(colour)], &mut constraints);
        constraints.first().map(Constraint::stop_m)
    }

    /// Whether a light lets the vehicle go on, from moment to moment.
    fn goes_on(moments: &[(f64, f64, SignalColour)]) -> Vec<bool> {
        let mut lights = usual();
        let goes_on = |&(over_m, speed_mps, colour): &(f64, f64, SignalColour)| {
            stop_m(&mut lights, over_m, (speed_mps, 0.0), colour).is_none()
        };
        moments.iter().map(goes_on).collect()
    }

    #[test]
    fn a_stop_is_kept_beyond_the_line_until_the_light_is_green() {
        use SignalColour::{Green, Red};
        assert_eq!(goes_on(&[(-40.0, 8.0, Red), (1.5, 1.0, Red), (1.6, 0.0, Red)]), [false; 3]);
        assert_eq!(goes_on(&[(-40.0, 8.0, Red), (1.6, 0.0, Red), (1.6, 0.0, Green)]), [false, false, true]);
        assert_eq!(goes_on(&[(-40.0, 8.0, Red), (3.1, 2.0, Red)]), [false, true], "in the junction");
        assert_eq!(goes_on(&[(1.5, 8.0, Green), (1.6, 8.0, Red)]), [true; 2], "was let go");
    }

    #[test]
    fn a_light_is_passed_only_as_long_as_stopping_would_be_hard() {
        use SignalColour::Red;
        assert_eq!(goes_on(&[(-10.0, 11.0, Red), (-5.0, 11.0, Red), (1.0, 11.0, Red)]), [true; 3]);
        assert_eq!(goes_on(&[(-10.0, 11.0, Red), (-4.0, 2.0, Red)]), [true, false], "slowed down by others");
        // A vehicle that brakes already can stop for a light nearer by.
        let stops = |acceleration_mps2| stop_m(&mut usual(), -9.5, (7.0, acceleration_mps2), Red).is_some();
        assert!(!stops(0.0) && stops(-2.5));
    }

    #[test]
    fn what_stands_at_the_line_stays_there_until_the_light_is_green() {
        let mut lights = usual();
        let mut stop_m = |over_m, speed_mps, colour| stop_m(&mut lights, over_m, (speed_mps, 0.0), colour);
        assert_eq!(stop_m(-3.0, 1.0, SignalColour::Red), Some(LINE_M - 1.0));
        assert_eq!(stop_m(-1.5, 0.0, SignalColour::Red), Some(LINE_M - 1.5));
        assert_eq!(stop_m(-2.4, 0.0, SignalColour::Red), Some(LINE_M - 2.4), "its position drifts");
        assert_eq!(stop_m(-2.4, 0.0, SignalColour::Green), None);
    }
}
