//! Bounds on the numbers that reach the world, whichever file they come from: a space, a scenario, a draw.
//!
//! `prove::spawn_bounds` proves them for every row, and `action` checks every draw again.

use core::ops::RangeInclusive;

use crate::model::numbers::compare;
use crate::model::value::Value;
use crate::model::vocabulary::Verb;
use crate::syntax::ast::Comparison;

/// The tick of physics, ms: an observation period is a whole number of ticks.
pub const TICK_MS: u32 = 20;

/// Nothing on the road is faster, m/s.
pub const SPEED_MPS_MAX: f64 = 70.0;

/// How often a manoeuvre may go through its phases.
pub const REPEAT: RangeInclusive<f64> = 1.0..=1000.0;

/// Speeds at which anything may be spawned, m/s.
pub const SPAWN_SPEED_MPS: RangeInclusive<f64> = 0.0..=SPEED_MPS_MAX;

/// More than tyres give the ego vehicle, forwards or backwards, m/s².
pub const EGO_ACCELERATION_MPS2_MAX: f64 = 10.0;

/// Distances from the ego vehicle at which anything may be spawned, m.
pub const SPAWN_DISTANCE_M: RangeInclusive<f64> = 0.0..=1000.0;

/// A vehicle with `DriveAhead` in another lane may begin beside the ego vehicle: this far before its front at least, m.
const BESIDE_M: f64 = -30.0;

/// How far away a road user with this verb may begin, m.
pub fn spawn_distance_m(verb: Verb) -> RangeInclusive<f64> {
    let least_m = if verb == Verb::DriveAhead { BESIDE_M } else { *SPAWN_DISTANCE_M.start() };
    least_m..=*SPAWN_DISTANCE_M.end()
}

/// Places beside the middle of a lane, m to the left: two lanes and more, on either side.
pub const OFFSET_M: RangeInclusive<f64> = -10.0..=10.0;

/// How far before the line of a light the ego vehicle may be as that changes, m.
pub const LIGHT_AT_M: RangeInclusive<f64> = 0.0..=1000.0;

/// Offsets at which the cycle of the signals may begin, s.
pub const SIGNAL_PHASE_S: RangeInclusive<f64> = 0.0..=3600.0;

/// Speed of the ego vehicle at which an episode begins unless its scenario says otherwise, m/s.
pub const START_MPS: f64 = 3.0;

/// Most ambient vehicles around the ego vehicle.
pub const AMBIENT_MAX: u32 = 100;

/// Most road users at a time that actions made appear (published package).
pub const COMMANDED_MAX: u32 = 10;

/// Most of a lane's limit at which ambient vehicles drive, whatever their profile.
pub const LIMIT_PART_MAX: f64 = 1.5;

/// The bound itself for a figure that equals it to the rules, but lies beyond it: 70 m/s * (0.1 + 0.2) / 0.3 is
/// 70.00000000000001 m/s. Any other figure is left as it is.
pub fn rounded_into(figure: f64, bounds: RangeInclusive<f64>) -> f64 {
    let equals = |bound: f64| compare(Comparison::Equal, Value::Number(figure), Value::Number(bound));
    match bounds.contains(&figure) {
        true => figure,
        false => [*bounds.start(), *bounds.end()].into_iter().find(|&bound| equals(bound)).unwrap_or(figure),
    }
}

/// Why the world must not be asked for a spawn at that speed and distance, whatever the rules say; `None` if it may. NaN is
/// out of bounds, too.
pub fn spawn_out_of_bounds(verb: Verb, speed_mps: f64, distance_m: f64) -> Option<String> {
    let figures =
        [("speed", speed_mps, "m/s", SPAWN_SPEED_MPS), ("distance", distance_m, "m", spawn_distance_m(verb))];
    out_of_bounds("spawn", figures)
}

pub(super) fn out_of_bounds(
    whose: &str,
    figures: impl IntoIterator<Item = (&'static str, f64, &'static str, RangeInclusive<f64>)>,
) -> Option<String> {
    let is_out = |(_, value, _, range): &(_, f64, _, RangeInclusive<f64>)| !range.contains(value);
    let (what, value, unit, range) = figures.into_iter().find(is_out)?;
    let (low, high) = range.into_inner();
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Some(format!("the {whose}'s {what} is {value}{unit}, possible is {low} .. {high}{unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_spawn_lies_out_of_bounds() {
        let out = |speed_mps, distance_m| spawn_out_of_bounds(Verb::Overtake, speed_mps, distance_m);
        for (speed_mps, distance_m) in [(0.0, 0.0), (70.0, 1000.0)] {
            assert_eq!(out(speed_mps, distance_m), None);
        }
        let rounded = |speed_mps| rounded_into(speed_mps, SPAWN_SPEED_MPS);
        assert_eq!([70.0 * (0.1 + 0.2) / 0.3, 70.0, 69.9, 70.1].map(rounded), [70.0, 70.0, 69.9, 70.1]);
        for speed_mps in [-0.1, 70.1, f64::NAN] {
            assert!(out(speed_mps, 10.0).is_some_and(|reason| reason.contains("speed")));
        }
        for distance_m in [-0.1, 1000.1, f64::NAN] {
            assert!(out(5.0, distance_m).is_some_and(|reason| reason.contains("distance")));
        }
    }
}
