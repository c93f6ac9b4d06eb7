//! From an observation to the numbers that go into a network.
//!
//! Scales are fixed numbers, not running means, so that a policy means the same on every road. They bring
//! the usual range of a variable to about one; rare values may exceed it.

use crate::mdp::{Observation, STATE_LEN, variable};
use avastra_lang::model::policy::{VARIABLES, VariableKind};

/// How many of the paper's variables are of the surroundings; they come first.
const EXTERNAL_LEN: usize = 7;

/// DeepCollision's state, in its order.
const DEEP_COLLISION: [&str; 12] = [
    "egoX",
    "egoY",
    "egoZ",
    "rain",
    "fog",
    "wetness",
    "timeOfDay",
    "trafficLight",
    "egoRoll",
    "egoHeading",
    "egoPitch",
    "speed",
];

/// Sets of state variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateSet {
    /// The paper's 19.
    Full,
    /// The 12 of the driving system (paper, Table 2).
    Internal,
    /// The 7 of the surroundings (paper, Table 1).
    External,
    /// DeepCollision's 12: pose, weather, clock, signal, speed.
    DeepCollision,
    /// The paper's 19 and where the nearest obstacle and the road ahead are: ours.
    Extended,
    /// These, and what tells when: how long the light stays, how far the next conflict is, where the second obstacle
    /// is, and what an action made appear last. Ours.
    Timed,
}

/// How a variable goes into the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// The variable as it is, as in all published code.
    Raw,
    /// Divided by a fixed scale; categories one-hot.
    Scaled,
}

/// How one variable is encoded when it is scaled.
enum Scale {
    /// Divided by this.
    By(f32),
    /// One input for each of these words: 1 for the one that the variable has, 0 for the others.
    OneHot(&'static [(&'static str, f32)]),
    /// The three phenomena that the paper packs into one number.
    Weather,
}

/// A list of variables and how they are encoded.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// The variables that go in, by index.
    pub(super) variables: Vec<usize>,
    encoding: Encoding,
    len: usize,
}

impl Features {
    pub fn new(set: StateSet, encoding: Encoding) -> Features {
        let named = |name: &str| variable(name).expect("the name is a variable's");
        let variables = match set {
            StateSet::Full => (0..STATE_LEN).collect(),
            StateSet::External => (0..EXTERNAL_LEN).collect(),
            StateSet::Internal => (EXTERNAL_LEN..STATE_LEN).collect(),
            StateSet::DeepCollision => DEEP_COLLISION.map(named).to_vec(),
            // Where the nearest obstacle and the road ahead are: the last of the variables.
            StateSet::Extended => (0..STATE_LEN).chain(named("nearestAhead")..=named("time")).collect(),
            StateSet::Timed => (0..STATE_LEN).chain(named("nearestAhead")..VARIABLES.len()).collect(),
        };
        let mut features = Features { variables, encoding, len: 0 };
        features.len = features.encode(&Observation::zeros()).len();
        features
    }

    /// Number of network inputs.
    #[allow(clippy::len_without_is_empty, reason = "every set of variables has some")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Network inputs, shape `(len,)`.
    pub fn encode(&self, observation: &Observation) -> Vec<f32> {
        let mut inputs = Vec::with_capacity(self.len);
        for &index in &self.variables {
            let value = observation.get(index);
            match (self.encoding, scale(index)) {
                (Encoding::Raw, _) => inputs.push(value),
                (Encoding::Scaled, Scale::By(unit)) => inputs.push(value / unit),
                (Encoding::Scaled, Scale::OneHot(words)) => {
                    inputs.extend(words.iter().map(|&(_, one)| f32::from(u8::from(value == one))));
                }
                (Encoding::Scaled, Scale::Weather) => {
                    inputs.extend(["rain", "fog", "wetness"].map(|name| observation.named(name)));
                }
            }
        }
        inputs
    }
}

/// Scale of a variable, by its index.
fn scale(index: usize) -> Scale {
    let variable = &VARIABLES[index];
    if let VariableKind::Words { words, ordered: false } = variable.kind {
        return Scale::OneHot(words);
    }
    match variable.observed_as {
        "weather" => Scale::Weather,
        "numObs" | "speed" | "speedNearestObs" | "nearestSpeedAhead" | "nearestSpeedLeft" => Scale::By(10.0),
        "distToNearestObs" | "nearestAhead" | "secondAhead" | "newestAhead" => Scale::By(50.0),
        "nearestLeft" | "secondLeft" | "newestLeft" | "newestAge" | "lightChangesIn" => Scale::By(10.0),
        "velocityDiff" | "accRate" => Scale::By(5.0),
        "throttle" | "steerTarget" | "brakePercentage" | "junctionAhead" | "conflictAhead" | "time" => {
            Scale::By(100.0)
        }
        "routeLeft" | "egoX" | "egoY" => Scale::By(300.0),
        "angleDeviation" | "directionDiff" | "egoHeading" => Scale::By(core::f32::consts::PI),
        _ => Scale::By(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_have_the_papers_sizes() {
        let len = |set| Features::new(set, Encoding::Raw).len();
        let sets = [StateSet::Full, StateSet::Internal, StateSet::External, StateSet::DeepCollision];
        assert_eq!(sets.map(len), [19, 12, 7, 12]);
        assert_eq!(Features::new(StateSet::Extended, Encoding::Scaled).len(), 36);
        assert_eq!(Features::new(StateSet::Timed, Encoding::Scaled).len(), 36 + 7 + 7);
    }

    #[test]
    fn categories_become_one_hot() {
        let mut observation = Observation::zeros();
        observation.state[1] = 14.0;
        observation.beyond[3] = 0.5;
        let inputs = Features::new(StateSet::External, Encoding::Scaled).encode(&observation);
        assert_eq!(inputs[..9], [0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    }
}
