//! Time to the first failure if some never fail (Kaplan and Meier 1958).

/// How long something was watched, and whether it failed at the end of that time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lifetime {
    pub time_s: f64,
    pub failed: bool,
}

/// Restricted mean time to failure: the area below the Kaplan–Meier curve up to `horizon_s`; `None` without
/// lifetimes.
///
/// A lifetime without a failure is censored at its end, on the assumption that its end has nothing to do with
/// failing. If the longest lifetime is censored before the horizon, the curve goes on level (Gill 1980).
pub fn restricted_mean(lifetimes: &[Lifetime], horizon_s: f64) -> Option<f64> {
    if lifetimes.is_empty() {
        return None;
    }
    let mut lifetimes = lifetimes.to_vec();
    // If one run fails and another is censored at the same moment, the failure comes first.
    lifetimes.sort_by(|one, other| one.time_s.total_cmp(&other.time_s).then(other.failed.cmp(&one.failed)));
    let (mut area, mut surviving, mut since_s) = (0.0, 1.0, 0.0);
    for (index, lifetime) in lifetimes.iter().enumerate() {
        if lifetime.time_s >= horizon_s {
            break;
        }
        if lifetime.failed {
            area += surviving * (lifetime.time_s - since_s);
            let at_risk = (lifetimes.len() - index) as f64;
            surviving *= 1.0 - 1.0 / at_risk;
            since_s = lifetime.time_s;
        }
    }
    Some(area + surviving * (horizon_s - since_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lifetimes(list: &[(f64, bool)]) -> Vec<Lifetime> {
        list.iter().map(|&(time_s, failed)| Lifetime { time_s, failed }).collect()
    }

    #[test]
    fn without_censoring_it_is_the_mean_of_times_cut_off() {
        let all = lifetimes(&[(10.0, true), (20.0, true), (60.0, true), (80.0, true)]);
        assert_eq!(restricted_mean(&all, 100.0), Some(42.5));
        assert_eq!(restricted_mean(&all, 50.0), Some((10.0 + 20.0 + 50.0 + 50.0) / 4.0));
        assert_eq!(restricted_mean(&[], 50.0), None);
    }

    /// By hand: 1 to 6 s, 0.8 from 6 s, 0.8 · 2/3 from 19 s (three at risk), to the horizon of 30 s.
    #[test]
    fn the_censored_count_while_they_are_watched() {
        let all = lifetimes(&[(6.0, true), (9.0, false), (19.0, true), (25.0, false), (40.0, true)]);
        let expected = 6.0 + 0.8 * 13.0 + 0.8 * (2.0 / 3.0) * 11.0;
        assert!((restricted_mean(&all, 30.0).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn without_a_failure_the_mean_is_the_horizon() {
        assert_eq!(restricted_mean(&lifetimes(&[(30.0, false), (35.0, false)]), 60.0), Some(60.0));
    }
}
