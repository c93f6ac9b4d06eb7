//! Two samples compared by ranks alone, without any assumption about their distributions.

use crate::statistics::{Interval, bisect};

/// Samples up to this size are compared exactly, if no value occurs twice. Ours: for larger ones the normal
/// approximation is as good.
const EXACT_MAX: usize = 50;
/// Normal quantile of a two-sided 95 %.
const Z: f64 = 1.959963984540054;

/// Outcome of a two-sided Mann–Whitney U test (1947).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct RankTest {
    /// Number of pairs in which the first sample's value is the larger; a tie counts as half a pair.
    pub u: f64,
    /// The p-value, in `[0, 1]`.
    pub p: f64,
    /// Whether `p` comes from the exact distribution; otherwise it comes from the normal one, with the variance
    /// corrected for ties and a continuity correction of one half.
    pub exact: bool,
}

/// Tests whether values of one sample tend to be larger than those of another; `None` if one is empty.
pub fn mann_whitney(first: &[f64], second: &[f64]) -> Option<RankTest> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let u = pairs_won(first, second);
    let ties = tie_sizes(first, second);
    let larger = u.max((first.len() * second.len()) as f64 - u);
    let exact = ties.is_empty() && first.len().max(second.len()) <= EXACT_MAX;
    let tail = if exact {
        exact_tail(first.len(), second.len(), larger as usize)
    } else {
        normal_tail(first.len(), second.len(), larger, &ties)
    };
    Some(RankTest { u, p: (2.0 * tail).min(1.0), exact })
}

fn pairs_won(first: &[f64], second: &[f64]) -> f64 {
    let won = |one: &f64, other: &f64| match one.total_cmp(other) {
        core::cmp::Ordering::Greater => 1.0,
        core::cmp::Ordering::Equal => 0.5,
        core::cmp::Ordering::Less => 0.0,
    };
    first.iter().map(|one| second.iter().map(|other| won(one, other)).sum::<f64>()).sum()
}

/// Sizes of the groups of equal values, for each value that occurs more than once.
fn tie_sizes(first: &[f64], second: &[f64]) -> Vec<usize> {
    let mut all: Vec<f64> = first.iter().chain(second).copied().collect();
    all.sort_by(f64::total_cmp);
    all.chunk_by(|one, other| one == other).map(<[f64]>::len).filter(|&size| size > 1).collect()
}

/// Probability that U is at least `u` if both samples come from one distribution, without ties.
fn exact_tail(first: usize, second: usize, u: usize) -> f64 {
    // orders[m][v]: in how many orders of m values of the first sample and the values of the second so far
    // U is v. The largest value is either of the first sample, and beats all of the second, or of the second.
    let most = first * second;
    let mut orders = vec![vec![0.0; most + 1]; first + 1];
    for row in &mut orders {
        row[0] = 1.0;
    }
    for others in 1..=second {
        for own in 1..=first {
            for value in (0..=most).rev() {
                let largest_is_own = if value >= others { orders[own - 1][value - others] } else { 0.0 };
                orders[own][value] += largest_is_own;
            }
        }
    }
    let all: f64 = orders[first].iter().sum();
    orders[first][u..].iter().sum::<f64>() / all
}

/// The p-value from the normal distribution; `ties` are the sizes of the groups of equal values.
fn normal_tail(first: usize, second: usize, u: f64, ties: &[usize]) -> f64 {
    let pairs = (first * second) as f64;
    let all = (first + second) as f64;
    let tied: f64 = ties.iter().map(|&size| (size * size * size - size) as f64).sum();
    let variance = pairs / 12.0 * (all + 1.0 - tied / (all * (all - 1.0)));
    if variance <= 0.0 {
        return 0.5;
    }
    let z = (u - pairs / 2.0 - 0.5) / variance.sqrt();
    0.5 * libm::erfc(z / core::f64::consts::SQRT_2)
}

/// Vargha and Delaney's Â12: how probable it is that a value of the first sample is the larger, ties half;
/// with Newcombe's interval (2006, method 5), which is honest where the samples do not overlap at all. None
/// if one is empty.
pub fn superiority(first: &[f64], second: &[f64]) -> Option<(f64, Interval)> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let pairs = (first.len() * second.len()) as f64;
    let found = pairs_won(first, second) / pairs;
    let typical = (first.len() + second.len()) as f64 / 2.0 - 1.0;
    let deviation = |truth: f64| {
        let spread = 1.0 + typical * (1.0 - truth) / (2.0 - truth) + typical * truth / (1.0 + truth);
        (truth * (1.0 - truth) * spread / pairs).sqrt()
    };
    // The interval holds each true value that chance alone could turn into the observed one.
    let low = bisect(0.0, found, |truth| found - truth <= Z * deviation(truth));
    let high = bisect(found, 1.0, |truth| truth - found > Z * deviation(truth));
    Some((found, Interval { low, high: Some(high) }))
}

/// Holm's correction (1979): the p-values of a family, each corrected for the family's size.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&one, &other| p[one].total_cmp(&p[other]));
    let mut corrected = vec![0.0; p.len()];
    let mut largest = 0.0_f64;
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((p.len() - rank) as f64 * p[index]).min(1.0);
        corrected[index] = largest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    /// U and p are of `scipy.stats.mannwhitneyu(first, second, method="exact")`, and of `method="asymptotic"` for
    /// samples with ties. The interval's ends solve `(t - found)**2 == 1.959964**2 * V(t)` by
    /// `scipy.optimize.brentq`.
    #[test]
    fn samples_are_compared() {
        // Two samples, U, p, and Â12 with its interval.
        type Case<'a> = (&'a [f64], &'a [f64], f64, f64, [f64; 3]);
        let cases: [Case; 5] = [
            (
                &[19.0, 22.0, 16.0, 29.0, 24.0],
                &[20.0, 11.0, 17.0, 12.0],
                17.0,
                0.1111111111111111,
                [0.85, 0.4520529750118502, 0.9718176011391693],
            ),
            (
                &[1.2, 3.4, 2.2, 5.1, 4.4, 6.0, 7.7, 8.1, 9.3, 2.9],
                &[0.5, 1.1, 0.7, 1.3, 2.0, 2.1, 3.3, 0.2, 0.9, 1.7],
                93.0,
                0.0004871289701011063,
                [0.93, 0.6947272366738839, 0.9854735931471805],
            ),
            (
                &[3.0, 4.0, 4.0, 5.0, 6.0, 2.0, 4.0],
                &[2.0, 2.0, 3.0, 1.0, 4.0, 2.0],
                35.5,
                0.03936843546521668,
                [0.8452380952380952, 0.5188501708410935, 0.9609550176163195],
            ),
            (&[0.0; 3], &[0.0; 3], 4.5, 1.0, [0.5, 0.15277353611043454, 0.8472264638895655]),
            (&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], 0.0, 0.1, [0.0, 0.0, 0.49898123929846994]),
        ];
        for (first, second, u, p, [found, low, high]) in cases {
            let test = mann_whitney(first, second).unwrap();
            assert_eq!(test.u, u);
            assert!((test.p - p).abs() < 1e-9, "{first:?}: {test:?}");
            let (superior, interval) = superiority(first, second).unwrap();
            let ends = (interval.low - low).abs().max((interval.high.unwrap() - high).abs());
            assert!((superior - found).abs() < 1e-12 && ends < 1e-9, "{first:?}: {interval:?}");
        }
        assert_eq!(mann_whitney(&[], &[1.0]), None);
        assert_eq!(superiority(&[1.0], &[]), None);
    }

    /// By hand: the least times 4, the next times 3, then times 2, and none less than the one before.
    #[test]
    fn a_family_is_corrected() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02]);
        assert_eq!(holm(&[0.5, 0.9]), [1.0, 1.0]);
    }
}
