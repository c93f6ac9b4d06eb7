//! When the ego vehicle is expected where along its route, if nothing is in its way.

use std::cell::RefCell;

use crate::state::ego::VehicleParameters;
use crate::view::around::Around;

/// Step in which a drive towards a rendezvous is timed, m.
pub const TIMING_M: f64 = 1.0;
/// How the ego vehicle is expected to gain speed on its way to a rendezvous, m/s²: ours, the comfort of most
/// planners.
const EGO_GAINS_MPS2: f64 = 1.5;
/// Lateral acceleration with which it is expected to take bends, m/s²: ours, as above.
const EGO_LATERAL_MPS2: f64 = 2.0;

/// The drive that is expected from one moment on, kept step by step as far as it was needed. Drawing needs dozens of
/// arrivals of a moment, and all begin with the same drive. Valid for one moment only.
#[derive(Debug, Default)]
pub struct Arrivals(RefCell<Vec<Expected>>);

/// Where the ego vehicle's front is on its route, how fast and when, s from now.
#[derive(Debug, Clone, Copy)]
struct Expected {
    station_m: f64,
    speed_mps: f64,
    after_s: f64,
}

impl Arrivals {
    /// Time until the ego vehicle's front is `distance_m` farther on, s.
    pub fn after_s(&self, around: &Around, distance_m: f64) -> f64 {
        let mut known = self.0.borrow_mut();
        if known.is_empty() {
            let station_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
            known.push(Expected { station_m, speed_mps: around.ego.speed_mps, after_s: 0.0 });
        }
        let end_m = known[0].station_m + distance_m;
        let mut steps = 0;
        while end_m - known[steps].station_m >= TIMING_M {
            if steps + 1 == known.len() {
                let next = known[steps].on(around, TIMING_M);
                known.push(next);
            }
            steps += 1;
        }
        let mut expected = known[steps];
        while expected.station_m < end_m {
            expected = expected.on(around, end_m - expected.station_m);
        }
        expected.after_s
    }
}

impl Expected {
    fn on(self, around: &Around, step_m: f64) -> Expected {
        let Expected { station_m, speed_mps, after_s } = self;
        let (map, route) = (&around.scene.map, &around.scene.route);
        let gained_mps = (speed_mps * speed_mps + 2.0 * EGO_GAINS_MPS2 * step_m).sqrt();
        let limit_mps = map.lane(route.lane_at(station_m).lane).speed_limit_mps;
        let curvature_per_m = route.path.curvature_at(station_m).abs().max(1e-4);
        let next_mps = gained_mps.min(limit_mps).min((EGO_LATERAL_MPS2 / curvature_per_m).sqrt());
        Expected {
            station_m: station_m + step_m,
            speed_mps: next_mps,
            after_s: after_s + 2.0 * step_m / (speed_mps + next_mps),
        }
    }
}
