//! What an agent sees: the paper's 19 state variables, and what other agents need beside them.
//!
//! DeepCollision's state is the ego vehicle's pose, the weather and the clock. The rest is ours: where
//! the nearest obstacle is and how it moves, and where on its way the ego vehicle is; the paper's
//! distance and speed say neither. Raw values in SI units, as in [`StateVector`].

use ndarray::Array1;

use crate::ads::Status;
use crate::model::policy::VARIABLES;
use crate::sim::World;

use super::state::{STATE_LEN, StateVector, observe};

/// Number of the variables beyond the paper's; they are the last of [`VARIABLES`].
pub const BEYOND_LEN: usize = VARIABLES.len() - STATE_LEN;

/// How far ahead a junction is searched for, m; also stands for the distance if there is no obstacle.
const LOOK_AHEAD_M: f64 = 100.0;
/// Step of the search for a junction, m.
const LOOK_STEP_M: f64 = 5.0;

/// What an agent sees at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// The paper's variables, shape `(STATE_LEN,)`.
    pub state: StateVector,
    /// The variables beyond the paper's, shape `(BEYOND_LEN,)`.
    pub beyond: Array1<f32>,
}

impl Observation {
    /// Reads all variables from the world and the driving system.
    pub fn new(world: &World, status: &Status) -> Observation {
        Observation {
            state: observe(world, status),
            beyond: beyond(world).into_iter().map(|value| value as f32).collect(),
        }
    }

    /// All variables 0, to try an agent without a world.
    pub fn zeros() -> Observation {
        Observation { state: StateVector::zeros(STATE_LEN), beyond: Array1::zeros(BEYOND_LEN) }
    }

    /// A variable by its index: the paper's first, then those beyond.
    pub fn get(&self, variable: usize) -> f32 {
        if variable < STATE_LEN { self.state[variable] } else { self.beyond[variable - STATE_LEN] }
    }
}

/// Index of a variable by the paper's spelling, as [`Observation::get`] takes it.
pub fn variable(name: &str) -> Option<usize> {
    VARIABLES.iter().position(|known| known.observed_as == name)
}

fn beyond(world: &World) -> [f64; BEYOND_LEN] {
    let ego = world.ego().rear_axle;
    let [rain, fog, wetness] = world.sky().map(|level| level.intensity());
    let outline = world.ego_outline().pose;
    let nearest = world.obstacles().min_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    let [ahead_m, left_m, ahead_mps, left_mps] = nearest.map_or([LOOK_AHEAD_M, 0.0, 0.0, 0.0], |obstacle| {
        let place = outline.to_local(obstacle.outline.pose.position);
        let velocity = obstacle.velocity_mps;
        [place.x, place.y, outline.forward().dot(&velocity), outline.left().dot(&velocity)]
    });
    [
        ego.position.x,
        ego.position.y,
        // The world is a plane.
        0.0,
        rain,
        fog,
        wetness,
        0.0,
        ego.heading_rad,
        0.0,
        ahead_m,
        left_m,
        ahead_mps,
        left_mps,
        world.scene().route.goal_m - world.ego_station_m(),
        junction_ahead_m(world),
        world.ego_offset_m(),
        world.time_s(),
    ]
}

/// Distance along the route to the next junction, m, to within a few metres: 0 inside one.
fn junction_ahead_m(world: &World) -> f64 {
    let scene = world.scene();
    let steps = (LOOK_AHEAD_M / LOOK_STEP_M) as u32;
    let distances = (0..steps).map(|step| f64::from(step) * LOOK_STEP_M);
    let is_junction = |ahead_m: &f64| {
        let lane = scene.route.lane_at(world.ego_station_m() + ahead_m).lane;
        scene.map.lane(lane).junction.is_some()
    };
    distances.into_iter().find(is_junction).unwrap_or(LOOK_AHEAD_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_found_by_name_and_index() {
        let mut observation = Observation::zeros();
        observation.state[18] = 7.0;
        observation.beyond[3] = 0.5;
        let value = |name: &str| observation.get(variable(name).expect("it is a variable"));
        assert_eq!((value("speed"), value("rain"), value("egoX")), (7.0, 0.5, 0.0));
        assert_eq!(variable("speeed"), None);
    }
}
