//! A coarse view of a moment: a search does not tell moments with the same number apart. All bounds are ours.

use crate::mdp::Observation;

/// A kind of situation, to record what its choices led to: how fast, how far from a junction, where the
/// nearest obstacle is, what weather.
pub fn situation(observation: &Observation) -> u32 {
    let value = |name| f64::from(observation.named(name));
    let speed = below(value("speed"), &[1.0, 5.0, 9.0]);
    let junction = below(value("junctionAhead"), &[1.0, 40.0]);
    ((speed * 3 + junction) * 4 + nearest(observation)) * 3 + weather(observation)
}

/// Number of kinds of [`situation`].
pub const SITUATIONS: usize = 4 * 3 * 4 * 3;

/// The number of bounds that a value is not below.
fn below(value: f64, bounds: &[f64]) -> u32 {
    bounds.iter().filter(|&&bound| value >= bound).count() as u32
}

/// Where the nearest obstacle is: 0 beyond 30 m, 1 in front, 2 beside, 3 behind.
fn nearest(observation: &Observation) -> u32 {
    let value = |name| f64::from(observation.named(name));
    let (ahead_m, left_m) = (value("nearestAhead"), value("nearestLeft"));
    if ahead_m * ahead_m + left_m * left_m > 30.0 * 30.0 {
        0
    } else if left_m.abs() > 2.0 {
        2
    } else if ahead_m > 0.0 {
        1
    } else {
        3
    }
}

/// 0 dry, 1 wet, 2 fog.
fn weather(observation: &Observation) -> u32 {
    let is_some = |name| observation.named(name) > 0.3;
    if is_some("fog") { 2 } else { u32::from(is_some("wetness") || is_some("rain")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{STATE_LEN, variable};

    #[test]
    fn situations_are_numbered_without_gaps_and_differ_where_it_matters() {
        let look = |values: &[(&str, f32)]| {
            let mut observation = Observation::zeros();
            for (name, value) in values {
                match variable(name).unwrap() {
                    at if at < STATE_LEN => observation.state[at] = *value,
                    at => observation.beyond[at - STATE_LEN] = *value,
                }
            }
            observation
        };
        let most = look(&[("speed", 50.0), ("junctionAhead", 100.0), ("nearestAhead", -5.0), ("fog", 1.0)]);
        assert_eq!(situation(&most) as usize, SITUATIONS - 1);
        let far = look(&[("nearestAhead", 100.0)]);
        let kinds = [&[][..], &[("speed", 6.0)], &[("wetness", 1.0)], &[("junctionAhead", 20.0)]];
        for kind in &kinds[1..] {
            assert_ne!(situation(&look(kind)), situation(&look(&[])));
        }
        assert_eq!(situation(&far), 0);
    }
}
