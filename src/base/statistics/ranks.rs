//! Two samples compared by ranks alone, without any assumption about their distributions.

use crate::statistics::{Interval, Z, bisect};

/// Samples up to this size are compared exactly. Ours: for larger ones the normal approximation is as good.
const EXACT_MAX: usize = 30;

/// Outcome of a two-sided Mann–Whitney U test (1947).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct RankTest {
    /// Number of pairs in which the first sample's value is the larger; a tie counts as half a pair.
    pub u: f64,
    /// The p-value, in `[0, 1]`.
    pub p: f64,
    /// Whether `p` comes from the exact distribution, that of all ways to part the same values into two such
    /// samples. Otherwise it comes from the normal one, with the variance corrected for ties and a continuity
    /// correction of one half.
    pub exact: bool,
}

/// Tests whether values of one sample tend to be larger than those of another; `None` if one is empty.
pub fn mann_whitney(first: &[f64], second: &[f64]) -> Option<RankTest> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let u = pairs_won(first, second);
    let all: Vec<f64> = first.iter().chain(second).copied().collect();
    let exact = first.len().max(second.len()) <= EXACT_MAX;
    let tail = if exact {
        let ranks = doubled_ranks(&all);
        let own: usize = ranks[..first.len()].iter().sum();
        smaller_tail(&rank_sums(&ranks, first.len()), own)
    } else {
        let larger = u.max((first.len() * second.len()) as f64 - u);
        normal_tail(first.len(), second.len(), larger, &tie_sizes(&all))
    };
    Some(RankTest { u, p: (2.0 * tail).min(1.0), exact })
}

/// Outcome of a two-sided Wilcoxon signed-rank test (1945), exact.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PairedTest {
    /// Pairs, and those of them in which the first value is the larger or the smaller one.
    pub pairs: usize,
    pub larger: usize,
    pub smaller: usize,
    /// The p-value, in `[0, 1]`: 1 if no pair differs.
    pub p: f64,
}

/// Tests whether the first of two paired values tends to be the larger one. `None` without pairs, for samples of
/// different size, and for more than 30 pairs, which no study has.
///
/// Equal pairs keep their ranks and take no sign (Pratt 1959).
pub fn signed_ranks(first: &[f64], second: &[f64]) -> Option<PairedTest> {
    if first.is_empty() || first.len() != second.len() || first.len() > EXACT_MAX {
        return None;
    }
    let differences: Vec<f64> = first.iter().zip(second).map(|(one, other)| one - other).collect();
    let ranks = doubled_ranks(&differences.iter().map(|difference| difference.abs()).collect::<Vec<_>>());
    let signed = || ranks.iter().zip(&differences).filter(|(_, difference)| **difference != 0.0);
    let own: usize = signed().filter(|(_, difference)| **difference > 0.0).map(|(rank, _)| rank).sum();
    // ways[s]: in how many choices of signs the positive ranks add up to s.
    let mut ways = vec![1.0];
    for (&rank, _) in signed() {
        let mut longer = vec![0.0; ways.len() + rank];
        for (sum, count) in ways.iter().enumerate() {
            longer[sum] += count;
            longer[sum + rank] += count;
        }
        ways = longer;
    }
    let count =
        |is_meant: fn(&f64) -> bool| differences.iter().filter(|difference| is_meant(difference)).count();
    Some(PairedTest {
        pairs: first.len(),
        larger: count(|difference| *difference > 0.0),
        smaller: count(|difference| *difference < 0.0),
        p: (2.0 * smaller_tail(&ways, own)).min(1.0),
    })
}

/// The exact two-sided sign test (McNemar's test in its exact form): the probability that the differing pairs split by
/// chance at least as unequally as here.
pub fn sign_test(first: u64, second: u64) -> f64 {
    let all = (first + second) as f64;
    let of_all = libm::lgamma(all + 1.0) - all * core::f64::consts::LN_2;
    let chance = |count: u64| {
        let count = count as f64;
        libm::exp(of_all - libm::lgamma(count + 1.0) - libm::lgamma(all - count + 1.0))
    };
    (2.0 * (0..=first.min(second)).map(chance).sum::<f64>()).min(1.0)
}

fn pairs_won(first: &[f64], second: &[f64]) -> f64 {
    let won = |one: &f64, other: &f64| match one.total_cmp(other) {
        core::cmp::Ordering::Greater => 1.0,
        core::cmp::Ordering::Equal => 0.5,
        core::cmp::Ordering::Less => 0.0,
    };
    first.iter().map(|one| second.iter().map(|other| won(one, other)).sum::<f64>()).sum()
}

/// Twice the rank of each value, from 2; equal values share the middle of their ranks.
fn doubled_ranks(values: &[f64]) -> Vec<usize> {
    let rank = |value: &f64| {
        let less = values.iter().filter(|other| other.total_cmp(value).is_lt()).count();
        let equal = values.iter().filter(|other| other.total_cmp(value).is_eq()).count();
        2 * less + equal + 1
    };
    values.iter().map(rank).collect()
}

/// Sizes of the groups of equal values, for each value that occurs more than once.
fn tie_sizes(values: &[f64]) -> Vec<usize> {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all.chunk_by(|one, other| one == other).map(<[f64]>::len).filter(|&size| size > 1).collect()
}

/// For each sum, the number of ways to choose `chosen` of the ranks, without order, that add up to it.
fn rank_sums(ranks: &[usize], chosen: usize) -> Vec<f64> {
    let most: usize = ranks.iter().sum();
    // ways[c][s]: in how many ways c of the ranks so far add up to s.
    let mut ways = vec![vec![0.0; most + 1]; chosen + 1];
    ways[0][0] = 1.0;
    for &rank in ranks {
        for count in (1..=chosen).rev() {
            for sum in rank..=most {
                let with_it = ways[count - 1][sum - rank];
                ways[count][sum] += with_it;
            }
        }
    }
    ways.swap_remove(chosen)
}

/// The share of the ways that give at most, or at least, what was found: the smaller of both.
fn smaller_tail(ways: &[f64], found: usize) -> f64 {
    let below: f64 = ways[..=found].iter().sum();
    let above: f64 = ways[found..].iter().sum();
    below.min(above) / ways.iter().sum::<f64>()
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

/// Vargha and Delaney's Â12: the probability that a value of the first sample is the larger, ties half. With
/// Newcombe's interval (2006, method 5), which is honest where the samples do not overlap at all. None if one
/// is empty.
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
    use crate::rng::{Stream, below, stream};

    /// U and p are of `scipy.stats.mannwhitneyu(first, second, method="exact")`; with ties, p is counted by hand over
    /// all ways to part the values. The interval's ends solve `(t - found)**2 == 1.959964**2 * V(t)` by
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
                0.05128205128205128,
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

    /// All ways to part the values, and all choices of signs, one by one.
    #[test]
    fn exact_tests_equal_their_naive_twins() {
        let ways =
            |count: usize| (0..1_u32 << count).map(move |bits| (0..count).map(move |at| bits >> at & 1 == 1));
        let tails = |sums: &[usize], own: usize| {
            let share = |is_meant: &dyn Fn(&&usize) -> bool| {
                sums.iter().filter(is_meant).count() as f64 / sums.len() as f64
            };
            (2.0 * share(&|sum| **sum <= own).min(share(&|sum| **sum >= own))).min(1.0)
        };
        let chosen = |ranks: &[usize], signs: &[bool]| -> usize {
            ranks.iter().zip(signs).filter(|(_, sign)| **sign).map(|(rank, _)| rank).sum()
        };
        let mut rng = stream(5, Stream::Bootstrap, 0);
        for _ in 0..200 {
            // Few different values, so that many are equal.
            let mut sample =
                |size: u32| -> Vec<f64> { (0..size).map(|_| f64::from(below(&mut rng, 5))).collect() };
            let (first, second) = (sample(4), sample(5));
            let all = [first.clone(), second.clone()].concat();
            let ranks = doubled_ranks(&all);
            let parts: Vec<Vec<bool>> = ways(9).map(|part| part.collect()).collect();
            let parts = parts.iter().filter(|part| part.iter().filter(|own| **own).count() == 4);
            let sums: Vec<usize> = parts.map(|part| chosen(&ranks, part)).collect();
            let own = ranks[..4].iter().sum();
            assert!((mann_whitney(&first, &second).unwrap().p - tails(&sums, own)).abs() < 1e-12);

            let (first, second) = (sample(6), sample(6));
            let differences: Vec<f64> = first.iter().zip(&second).map(|(one, other)| one - other).collect();
            let ranks = doubled_ranks(&differences.iter().map(|value| value.abs()).collect::<Vec<_>>());
            let signs: Vec<bool> = differences.iter().map(|difference| *difference > 0.0).collect();
            let open: Vec<usize> = (0..6).filter(|&at| differences[at] != 0.0).map(|at| ranks[at]).collect();
            let sums: Vec<usize> =
                ways(open.len()).map(|part| chosen(&open, &part.collect::<Vec<_>>())).collect();
            let test = signed_ranks(&first, &second).unwrap();
            assert!(
                (test.p - tails(&sums, chosen(&ranks, &signs))).abs() < 1e-12,
                "{differences:?}: {test:?}"
            );
        }
        // A review found that the normal approximation gave 0.128 and 0.346, where no such values exist.
        assert_eq!(mann_whitney(&[1.0; 3], &[0.0; 2]).unwrap().p, 0.2);
        assert_eq!(mann_whitney(&[1.0], &[0.0; 3]).unwrap().p, 0.5);
        assert_eq!(signed_ranks(&[1.0, 2.0], &[1.0, 2.0]).unwrap().p, 1.0);
        assert_eq!(signed_ranks(&[1.0], &[]), None);
        // One side of ten pairs: 1 + 10 of 1,024 ways.
        assert!(
            (sign_test(1, 9) - 22.0 / 1024.0).abs() < 1e-12
                && sign_test(0, 0) == 1.0
                && sign_test(3, 3) == 1.0
        );
    }

    /// By hand: the least times 4, the next times 3, then times 2, and none less than the one before.
    #[test]
    fn a_family_is_corrected() {
        assert_eq!(holm(&[0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02]);
        assert_eq!(holm(&[0.5, 0.9]), [1.0, 1.0]);
    }
}
