//! Where the rules of the road make a driver stop: lights, stop signs and crosswalks of the route.
//!
//! For driving systems that take such a place as something that stands there. Right of way between vehicles
//! is no business of this file.

use crate::status::Reason;
use avastra_base::kinematics::STANDING_MPS;
use avastra_road::SignKind;
use avastra_world::sim::{Scene, Sensed, SensedObject, SignalColour};

use super::guide::Guide;
use super::speed::HARDEST_MPS2;

/// A place that the front of the vehicle must not pass now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Station on the route, m.
    pub station_m: f64,
    pub reason: Reason,
}

/// A yellow light that needs harder braking is passed, m/s²: usual limits lie at 3 to 4.
pub const LIGHT_MPS2: f64 = 4.0;
/// A vehicle that has passed a line by no more than this still waits at it, m.
const OVER_M: f64 = 1.0;
/// A pedestrian this near to a crosswalk, along the road, is on it, m (Apollo expands it by as much).
const CROSSWALK_MARGIN_M: f64 = 2.0;
/// A pedestrian on the way to a crosswalk counts up to this distance beside the route, m (Apollo: 6 to 8).
const CROSSWALK_SIDE_M: f64 = 6.0;
/// A pedestrian that stands on a crosswalk counts up to this distance beside the route, m. Ours: the lane.
const ON_THE_WAY_M: f64 = 1.75;
/// Slower than this across the way, a pedestrian does not come, m/s.
const ACROSS_MPS: f64 = 0.2;

/// A vehicle this near to the line of a stop sign has stopped at it, m. Ours: drivers keep up to 2 m.
const AT_SIGN_M: f64 = 3.0;

/// The signs of the route that are behind a driver, or have been obeyed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Signs {
    done: usize,
}

impl Signs {
    /// The next stop sign; the vehicle stops at it once. A yield sign asks for no stop: whether to give way is
    /// the driver's own business.
    pub fn next_stop(&mut self, scene: &Scene, front_m: f64, speed_mps: f64) -> Option<Stop> {
        let line = scene.route.sign_lines.get(self.done)?;
        let distance_m = line.station_m - front_m;
        let has_stopped = distance_m < AT_SIGN_M && speed_mps < STANDING_MPS;
        if line.kind == SignKind::Yield || has_stopped || distance_m < -OVER_M {
            self.done += 1;
            return None;
        }
        (distance_m < scene.range_m).then_some(Stop { station_m: line.station_m, reason: Reason::StopSign })
    }
}

/// The lights ahead that the vehicle stops for.
pub fn lights<'a>(scene: &'a Scene, sensed: &'a Sensed, front_m: f64) -> impl Iterator<Item = Stop> + 'a {
    let range_m = scene.range_m.min(sensed.conditions.visibility_m);
    scene.route.stop_lines.iter().filter_map(move |line| {
        let stoppable_mps2 = match sensed.signals[line.signal] {
            SignalColour::Green => return None,
            SignalColour::Yellow => LIGHT_MPS2,
            SignalColour::Red => HARDEST_MPS2,
        };
        let is_read = line.station_m - front_m < range_m;
        (is_read && can_stop(line.station_m - front_m, sensed.ego.speed_mps, stoppable_mps2))
            .then_some(Stop { station_m: line.station_m, reason: Reason::RedLight })
    })
}

/// The crosswalks ahead that a pedestrian is on, or comes onto.
pub fn crosswalks<'a>(
    scene: &'a Scene,
    guide: &'a Guide,
    known: &'a [SensedObject],
    front_m: f64,
    speed_mps: f64,
) -> impl Iterator<Item = Stop> + 'a {
    scene.route.crosswalks_m.iter().filter_map(move |&(from_m, to_m)| {
        let along = from_m - CROSSWALK_MARGIN_M..=to_m + CROSSWALK_MARGIN_M;
        let uses = |walker: &SensedObject| {
            let beside = guide.project(walker.pose.position, *along.start(), *along.end());
            let left_mps = beside.forward.perp(&walker.velocity_mps);
            let comes = left_mps * beside.offset_m.signum() < -ACROSS_MPS;
            let reach_m = if comes { CROSSWALK_SIDE_M } else { ON_THE_WAY_M };
            along.contains(&beside.station_m) && beside.offset_m.abs() <= reach_m
        };
        let ahead = (0.0..scene.range_m).contains(&(from_m - front_m))
            && can_stop(from_m - front_m, speed_mps, HARDEST_MPS2);
        (ahead && known.iter().any(|object| !object.body.is_vehicle() && uses(object)))
            .then_some(Stop { station_m: from_m, reason: Reason::Crosswalk })
    })
}

fn can_stop(distance_m: f64, speed_mps: f64, deceleration_mps2: f64) -> bool {
    distance_m > -OVER_M && speed_mps * speed_mps <= 2.0 * deceleration_mps2 * distance_m.max(0.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::SpeedRules;
    use crate::testing::{CLEAR_DAY, object, sensed, straight};
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;
    use avastra_road::SignLine;
    use avastra_world::sim::Conditions;
    use core::f64::consts::FRAC_PI_2;
    use std::sync::Arc;

    #[test]
    fn lights_hold_until_they_are_too_near_or_too_far() {
        let scene = straight();
        let stops = |colour, gap_m: f64, visibility_m| {
            let conditions = Conditions { visibility_m, ..CLEAR_DAY };
            let before = sensed(Pose::new(0.0, 0.0, 0.0), 10.0, vec![]);
            let sensed = Sensed { signals: vec![colour], conditions, ..before };
            lights(&scene, &sensed, 100.0 - gap_m).count() == 1
        };
        assert!(!stops(SignalColour::Green, 40.0, 1e4));
        assert!(stops(SignalColour::Yellow, 40.0, 1e4) && !stops(SignalColour::Yellow, 11.0, 1e4));
        assert!(stops(SignalColour::Red, 11.0, 1e4) && !stops(SignalColour::Red, 8.0, 1e4));
        assert!(!stops(SignalColour::Red, 60.0, 50.0), "it is in the fog");
    }

    #[test]
    fn a_stop_sign_holds_until_the_vehicle_has_stood_at_it() {
        let mut route = straight().route.clone();
        let line = |station_m, kind| SignLine { station_m, kind };
        route.sign_lines = vec![line(40.0, SignKind::Yield), line(80.0, SignKind::Stop)];
        let scene = Arc::new(Scene::new(straight().map.clone(), route));
        let mut signs = Signs::default();
        let mut holds = |front_m, speed_mps| signs.next_stop(&scene, front_m, speed_mps).is_some();
        assert!(!holds(30.0, 8.0), "a yield sign does not");
        assert!(holds(30.0, 8.0) && holds(60.0, 0.0) && holds(78.5, 0.5));
        assert!(!holds(78.5, 0.0) && !holds(78.6, 0.5));
    }

    #[test]
    fn a_crosswalk_holds_while_a_pedestrian_is_on_it_or_comes() {
        let mut route = straight().route.clone();
        route.crosswalks_m.push((80.0, 84.0));
        let scene = Arc::new(Scene::new(straight().map.clone(), route));
        let guide = Guide::new(&scene, &SpeedRules::TOWN);
        let stops = |offset_m: f64, left_mps: f64| {
            let walker = object(1, Body::Pedestrian, Pose::new(82.0, offset_m - 1.75, FRAC_PI_2), left_mps);
            crosswalks(&scene, &guide, &[walker], 40.0, 8.0).count() == 1
        };
        assert!(stops(-5.0, 1.2) && stops(5.0, -1.2), "comes");
        assert!(!stops(-5.0, 0.0) && !stops(-5.0, -1.2), "waits, goes away");
        assert!(stops(1.0, 0.0), "stands in the lane");
        assert!(!stops(2.5, 1.2), "has crossed");
    }
}
