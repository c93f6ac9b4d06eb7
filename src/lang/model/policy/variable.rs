//! The variables that the rules of a policy may name: the paper's 19, then those beyond.
//!
//! Order and values are those of an observation; a category has a word for each of its values. The names
//! are ours, in the spelling of the language; the paper's stand beside them.

use avastra_base::units;
use avastra_base::units::{Dimension, Rational, Unit};

/// One variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    pub name: &'static str,
    /// The variable's name in an observation: the paper's spelling, if the paper has the variable.
    pub observed_as: &'static str,
    pub kind: VariableKind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VariableKind {
    /// A number in this unit (empty: a plain number), between two bounds that it cannot pass.
    Quantity { unit: &'static str, low: Option<f64>, high: Option<f64> },
    /// One of these words, each with its value in an observation.
    Words { words: &'static [(&'static str, f32)], ordered: bool },
}

impl Variable {
    /// Dimension of the variable's numbers.
    pub fn dimension(&self) -> Dimension {
        self.unit().map_or(Dimension::RATIO, |unit| unit.dimension)
    }

    /// The value of one of its units in SI.
    pub fn factor(&self) -> Rational {
        self.unit().map_or(Rational::ONE, Unit::factor)
    }

    fn unit(&self) -> Option<&'static Unit> {
        let VariableKind::Quantity { unit, .. } = self.kind else { return None };
        units::unit(unit)
    }

    /// The word for a value of an observation; `None` for a quantity.
    pub fn word(&self, value: f32) -> Option<&'static str> {
        let VariableKind::Words { words, .. } = self.kind else { return None };
        words.iter().find(|(_, of)| *of == value).map(|(word, _)| *word)
    }
}

/// The variable of that name, by its index in an observation.
pub fn variable_index(name: &str) -> Option<usize> {
    VARIABLES.iter().position(|variable| variable.name == name)
}

/// Radians that an angle cannot pass: π as an observation holds it.
const HALF_TURN: f64 = core::f32::consts::PI as f64;

const LEVELS: VariableKind = VariableKind::Words {
    words: &[("None", 0.0), ("Light", 0.2), ("Moderate", 0.5), ("High", 1.0)],
    ordered: true,
};

const fn any(name: &'static str, observed_as: &'static str, unit: &'static str) -> Variable {
    Variable { name, observed_as, kind: VariableKind::Quantity { unit, low: None, high: None } }
}

const fn from_zero(name: &'static str, observed_as: &'static str, unit: &'static str) -> Variable {
    Variable { name, observed_as, kind: VariableKind::Quantity { unit, low: Some(0.0), high: None } }
}

const fn between(
    (name, observed_as): (&'static str, &'static str),
    unit: &'static str,
    low: f64,
    high: f64,
) -> Variable {
    Variable { name, observed_as, kind: VariableKind::Quantity { unit, low: Some(low), high: Some(high) } }
}

const fn words(
    name: &'static str,
    observed_as: &'static str,
    words: &'static [(&'static str, f32)],
) -> Variable {
    Variable { name, observed_as, kind: VariableKind::Words { words, ordered: false } }
}

/// Every variable, in the order of an observation.
pub const VARIABLES: &[Variable] = &[
    between(("weather", "weather"), "", 0.0, 111.0),
    // The paper knows three. Twilight, in which headlights are on, is observed as night.
    words("time", "timeOfDay", &[("Morning", 10.0), ("Noon", 14.0), ("Night", 20.0)]),
    // Yellow and no light share one value in the paper.
    words("traffic_light", "trafficLight", &[("Red", -1.0), ("Neither", 0.0), ("Green", 1.0)]),
    from_zero("obstacles", "numObs", ""),
    from_zero("dist_nearest", "distToNearestObs", "m"),
    from_zero("speed_nearest", "speedNearestObs", "m/s"),
    words(
        "road_kind",
        "roadCondition",
        &[("OneWay", 0.0), ("TwoWay", 1.0), ("NearJunction", 2.0), ("InJunction", 3.0)],
    ),
    from_zero("location_error", "distDeviation", "m"),
    between(("location_error_angle", "angleDeviation"), "rad", -HALF_TURN, HALF_TURN),
    from_zero("position_error", "positionDiff", "m"),
    from_zero("heading_error", "directionDiff", "rad"),
    from_zero("size_error", "sizeDiff", "m"),
    from_zero("velocity_error", "velocityDiff", "m/s"),
    between(("throttle", "throttle"), "%", 0.0, 100.0),
    // In rad/s, for which the language has no word.
    any("steer_rate", "steerRate", ""),
    any("steer", "steerTarget", "%"),
    any("acceleration", "accRate", "m/s^2"),
    between(("brake", "brakePercentage"), "%", 0.0, 100.0),
    any("ego_speed", "speed", "m/s"),
    any("ego_x", "egoX", "m"),
    any("ego_y", "egoY", "m"),
    any("ego_z", "egoZ", "m"),
    Variable { name: "rain", observed_as: "rain", kind: LEVELS },
    Variable { name: "fog", observed_as: "fog", kind: LEVELS },
    Variable { name: "wetness", observed_as: "wetness", kind: LEVELS },
    any("ego_roll", "egoRoll", "rad"),
    between(("ego_heading", "egoHeading"), "rad", -HALF_TURN, HALF_TURN),
    any("ego_pitch", "egoPitch", "rad"),
    any("nearest_ahead", "nearestAhead", "m"),
    any("nearest_left", "nearestLeft", "m"),
    any("nearest_speed_ahead", "nearestSpeedAhead", "m/s"),
    any("nearest_speed_left", "nearestSpeedLeft", "m/s"),
    any("route_left", "routeLeft", "m"),
    between(("junction_ahead", "junctionAhead"), "m", 0.0, 100.0),
    any("lane_offset", "laneOffset", "m"),
    from_zero("elapsed", "time", "s"),
    between(("light_changes_in", "lightChangesIn"), "s", 0.0, 60.0),
    between(("conflict_ahead", "conflictAhead"), "m", 0.0, 100.0),
    any("second_ahead", "secondAhead", "m"),
    any("second_left", "secondLeft", "m"),
    words("newest", "newest", NEWEST),
    any("newest_ahead", "newestAhead", "m"),
    any("newest_left", "newestLeft", "m"),
    between(("newest_age", "newestAge"), "s", 0.0, 60.0),
];

/// The behaviour of the road user that an action spawned last.
const NEWEST: &[(&str, f32)] = &[
    ("None", 0.0),
    ("DriveAhead", 1.0),
    ("Overtake", 2.0),
    ("DriveOpposite", 3.0),
    ("CrossRoad", 4.0),
    ("Walk", 5.0),
    ("Stand", 6.0),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::vocabulary::{Level, TimeOfDay, Verb, Word};

    #[test]
    fn words_are_the_engines() {
        let of = |name| VARIABLES[variable_index(name).unwrap()];
        let spelt = |name| match of(name).kind {
            VariableKind::Words { words, .. } => words.iter().map(|(word, _)| *word).collect(),
            VariableKind::Quantity { .. } => Vec::new(),
        };
        let known = |verb: &&Verb| verb.as_policies_know() == **verb;
        let verbs: Vec<&str> = Verb::ALL.iter().filter(known).map(|verb| verb.name()).collect();
        assert_eq!(spelt("newest"), [&["None"], verbs.as_slice()].concat());
        let by_day = TimeOfDay::ALL.iter().filter(|time| !time.is_twilight());
        assert_eq!(spelt("time"), by_day.map(|time| time.name()).collect::<Vec<_>>());
        for level in Level::ALL {
            assert_eq!(of("fog").word(level.intensity() as f32), Some(level.name()));
        }
        let has_unit = |one: &Variable| match one.kind {
            VariableKind::Quantity { unit, .. } => unit.is_empty() || units::unit(unit).is_some(),
            VariableKind::Words { .. } => true,
        };
        assert!(VARIABLES.iter().all(has_unit));
    }
}
