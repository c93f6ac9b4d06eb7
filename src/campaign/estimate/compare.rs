//! Two driving systems in the same episodes (common random numbers): which one crashes more often?
//!
//! Each pair of episodes has one start and one seed of traffic and sensors. The agent draws the same values as long as both
//! worlds are equal. What both systems do alike says nothing about the difference. So pairs tell two versions of one system
//! apart in far fewer kilometres than two separate counts.

use std::sync::atomic::AtomicBool;

use crate::run::{Run, on_threads};
use avastra_base::statistics::{Interval, binomial, paired_difference, sign_test};

use crate::estimate::settings::EventKind;

/// Two runs of the same episodes, which differ in the driving system alone.
pub struct Comparison {
    pub first: Run,
    pub second: Run,
    pub event: EventKind,
}

/// One driving system in an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    pub happened: bool,
    /// Whether an external driving system failed: then the pair says nothing.
    pub failed: bool,
    pub driven_m: f64,
}

/// An episode of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Number of the pair. The roads take turns, as they would on a drive.
    pub number: usize,
    pub first: Side,
    pub second: Side,
}

/// The result of a comparison.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ComparisonResults {
    /// Raised whenever a field changes its meaning or goes away.
    pub schema: u32,
    pub event: EventKind,
    pub episodes: u64,
    /// Episodes with the event: under both, under the first alone, under the second alone.
    pub both: u64,
    pub first_only: u64,
    pub second_only: u64,
    pub driven_km: [f64; 2],
    /// Probability of the event in an episode under each, with Clopper and Pearson's interval.
    pub probability: [f64; 2],
    pub intervals: [Interval; 2],
    /// Probability under the second less that under the first, with Newcombe's interval for pairs (1998, method 10).
    pub difference: f64,
    pub difference_interval: Interval,
    /// Exact two-sided sign test over the pairs that differ (McNemar).
    pub p: f64,
    /// Kilometres that both drove together up to the pair from which on the sign test, repeated after every pair, stays
    /// below 0.05; `None` if it does not at the end. Looking again and again finds such a moment too early now and
    /// then: it is for comparing methods, not a test.
    pub told_apart_km: Option<f64>,
}

impl Comparison {
    /// Number of pairs.
    pub fn pairs(&self) -> usize {
        self.first.episodes()
    }

    /// The number in its run of the episode of a pair.
    fn episode(&self, pair: usize) -> usize {
        let roads = self.first.settings().conditions.roads.len();
        pair % roads * self.first.settings().episodes as usize + pair / roads
    }
}

/// Plays the pairs of these numbers on `threads` threads, and calls `on` on this thread with each.
///
/// # Errors
/// The first error of `on`.
pub fn compared<E>(
    comparison: &Comparison,
    numbers: &[usize],
    threads: usize,
    stop: &AtomicBool,
    on: &mut dyn FnMut(Pair) -> Result<(), E>,
) -> Result<(), E> {
    let work = |number: &usize, tell: &mut dyn FnMut(Pair) -> bool| {
        let episode = comparison.episode(*number);
        let side = |run: &Run| {
            let setup = run.setup(episode);
            let log = run.played(&setup);
            let happened = comparison.event.first(&setup, &log).is_some();
            Side { happened, failed: log.failure.is_some(), driven_m: log.distance_m }
        };
        tell(Pair { number: *number, first: side(&comparison.first), second: side(&comparison.second) });
    };
    on_threads(numbers, threads, stop, work, on)
}

impl ComparisonResults {
    /// Over pairs in any order; `None` without any.
    pub fn new(event: EventKind, pairs: &[Pair]) -> Option<ComparisonResults> {
        let mut pairs = pairs.to_vec();
        pairs.sort_by_key(|pair| pair.number);
        let count = |is_meant: fn(&Pair) -> bool| pairs.iter().filter(|pair| is_meant(pair)).count() as u64;
        let both = count(|pair| pair.first.happened && pair.second.happened);
        let first_only = count(|pair| pair.first.happened && !pair.second.happened);
        let second_only = count(|pair| !pair.first.happened && pair.second.happened);
        let episodes = pairs.len() as u64;
        if episodes == 0 {
            return None;
        }
        let km = |of: fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / 1000.0;
        let counts = [both + first_only, both + second_only];
        let (difference, difference_interval) = paired_difference([both, first_only, second_only], episodes);
        Some(ComparisonResults {
            schema: 1,
            event,
            episodes,
            both,
            first_only,
            second_only,
            driven_km: [km(|pair| pair.first.driven_m), km(|pair| pair.second.driven_m)],
            probability: counts.map(|count| count as f64 / episodes as f64),
            intervals: counts.map(|count| binomial(count, episodes)),
            difference,
            difference_interval,
            p: sign_test(first_only, second_only),
            told_apart_km: told_apart_km(&pairs),
        })
    }
}

/// See [`ComparisonResults::told_apart_km`].
fn told_apart_km(pairs: &[Pair]) -> Option<f64> {
    let (mut first_only, mut second_only, mut driven_m) = (0, 0, 0.0);
    let mut since = None;
    for pair in pairs {
        driven_m += pair.first.driven_m + pair.second.driven_m;
        match (pair.first.happened, pair.second.happened) {
            (true, false) => first_only += 1,
            (false, true) => second_only += 1,
            // Such a pair changes nothing.
            _ => continue,
        }
        since =
            if sign_test(first_only, second_only) < 0.05 { since.or(Some(driven_m / 1000.0)) } else { None };
    }
    since
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(number: usize, first: bool, second: bool) -> Pair {
        let side = |happened| Side { happened, failed: false, driven_m: 500.0 };
        Pair { number, first: side(first), second: side(second) }
    }

    #[test]
    fn pairs_that_differ_decide() {
        // Nine episodes crash under the second alone, one under both.
        let mut pairs: Vec<Pair> = (0..9).map(|number| pair(10 * number, false, true)).collect();
        pairs.extend((0..90).map(|number| pair(number + number / 9 + 1, false, false)));
        pairs.push(pair(1000, true, true));
        let found = ComparisonResults::new(EventKind::Collision, &pairs).unwrap();
        assert_eq!((found.both, found.first_only, found.second_only, found.episodes), (1, 0, 9, 100));
        assert!((found.difference - 0.09).abs() < 1e-12 && found.difference_interval.low > 0.0, "{found:?}");
        assert!((found.p - 2.0 / 512.0).abs() < 1e-12);
        // The sign test is below 0.05 after six, in the pair with the number 50, the 51st: 51 km for both.
        assert_eq!(found.told_apart_km, Some(51.0));
        assert_eq!(ComparisonResults::new(EventKind::Counted, &[]), None);
    }
}
