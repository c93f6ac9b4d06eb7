//! An agent's observation: the paper's 19 state variables, and those that other agents need beside them.
//!
//! DeepCollision's state is the ego vehicle's pose, the weather and the clock. The rest is ours: where
//! the nearest obstacle is and how it moves, and where on its way the ego vehicle is; the paper's
//! distance and speed say neither. The last variables are about when: how long the light stays, how far the next
//! conflict is, and what an action made appear last. Raw values in SI units, as in [`StateVector`].

use ndarray::Array1;

use avastra_drivers::Status;
use avastra_lang::model::MomentFacts;
use avastra_lang::model::policy::VARIABLES;
use avastra_world::sim::{DT_S, Obstacle, World};

use super::state::{STATE_LEN, StateVector, observe};

/// Number of the variables beyond the paper's; they are the last of [`VARIABLES`].
pub const BEYOND_LEN: usize = VARIABLES.len() - STATE_LEN;

/// A junction farther away is as good as none, m; also stands for the distance if there is no obstacle.
const LOOK_AHEAD_M: f64 = 100.0;

/// A change of the light that is farther away counts as this far, s; also stands for no light, and for the age of a road
/// user that is older, or that there is none.
const LOOK_AHEAD_S: f64 = 60.0;

/// An agent's observation of one moment.
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
        let moment = world.moment_facts();
        Observation {
            state: observe(world, &moment, status),
            beyond: beyond(world, &moment).into_iter().map(|value| value as f32).collect(),
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

    /// A variable by the paper's spelling, which must be that of one.
    pub fn named(&self, name: &str) -> f32 {
        self.get(variable(name).expect("it is a variable"))
    }
}

/// Index of a variable by the paper's spelling, as [`Observation::get`] takes it.
pub fn variable(name: &str) -> Option<usize> {
    VARIABLES.iter().position(|known| known.observed_as == name)
}

fn beyond(world: &World, moment: &MomentFacts) -> [f64; BEYOND_LEN] {
    let ego = world.ego().rear_axle;
    let [rain, fog, wetness] = world.sky().map(|level| level.intensity());
    let outline = world.ego_outline().pose;
    let mut by_distance: Vec<&Obstacle> = world.obstacles_on_level().collect();
    by_distance.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    let (nearest, second) = (by_distance.first(), by_distance.get(1));
    let commanded = world.obstacles_on_level().filter(|obstacle| !obstacle.is_ambient());
    let newest = commanded.max_by_key(|obstacle| obstacle.id);
    let place = |obstacle: Option<&Obstacle>| {
        let place = obstacle.map(|obstacle| outline.to_local(obstacle.outline.pose.position));
        place.map_or([LOOK_AHEAD_M, 0.0], |place| [place.x, place.y])
    };
    let [second_ahead_m, second_left_m] = place(second.copied());
    let [newest_ahead_m, newest_left_m] = place(newest);
    let newest_age_s =
        newest.map_or(LOOK_AHEAD_S, |obstacle| (world.ticks() - obstacle.spawned_tick) as f64 * DT_S);
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
        moment.ego_route_left_m,
        moment.ego_junction_ahead_m.min(LOOK_AHEAD_M),
        moment.ego_offset_m,
        moment.elapsed_s,
        world.light_changes_in_s(LOOK_AHEAD_S).unwrap_or(LOOK_AHEAD_S),
        world.conflict_ahead_m().unwrap_or(LOOK_AHEAD_M).min(LOOK_AHEAD_M),
        second_ahead_m,
        second_left_m,
        newest.map_or(0.0, |obstacle| 1.0 + f64::from(obstacle.verb.as_policies_know() as u8)),
        newest_ahead_m,
        newest_left_m,
        newest_age_s.min(LOOK_AHEAD_S),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_found_by_name_and_index() {
        let mut observation = Observation::zeros();
        observation.state[18] = 7.0;
        observation.beyond[3] = 0.5;
        assert_eq!(["speed", "rain", "egoX"].map(|name| observation.named(name)), [7.0, 0.5, 0.0]);
        assert_eq!(variable("speeed"), None);
    }
}
