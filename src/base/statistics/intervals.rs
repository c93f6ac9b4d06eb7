//! Intervals of means, of ratios of means, and of numbers of events.

use crate::rng;
use crate::rng::Rng;

use crate::statistics::{Z, bisect};

/// An interval that covers the true value in 95 of 100 samples.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Interval {
    pub low: f64,
    /// `None` if it has no upper bound.
    pub high: Option<f64>,
}

/// A mean with its precision.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Estimate {
    pub mean: f64,
    /// `None` for fewer than two values, and for values that are all equal: they say nothing about the spread.
    #[serde(flatten)]
    pub interval: Option<Interval>,
    /// The sample.
    pub values: Vec<f64>,
}

/// Mean of a sample with Student's interval; `None` if the sample is empty.
///
/// Student's interval and not the bootstrap's, which is too short with only ten values.
pub fn mean(values: &[f64]) -> Option<Estimate> {
    if values.is_empty() {
        return None;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let is_constant = values.iter().all(|value| *value == values[0]);
    let interval = (!is_constant).then(|| {
        let half = student_quantile(values.len() - 1) * variance_of_mean(values).sqrt();
        Interval { low: mean - half, high: Some(mean + half) }
    });
    Some(Estimate { mean, interval, values: values.to_vec() })
}

/// The variance of a mean, estimated from its sample; NaN for fewer than two values.
pub fn variance_of_mean(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    squares / (count - 1.0) / count
}

/// The bound below which the magnitude of a Student variable stays with probability 0.95.
fn student_quantile(degrees: usize) -> f64 {
    bisect(0.0, 1000.0, |quantile| student_within(quantile, degrees) >= 0.95)
}

/// Probability that a Student variable's magnitude is at most `bound`. Abramowitz and Stegun 26.7.3 and 26.7.4.
fn student_within(bound: f64, degrees: usize) -> f64 {
    let angle_rad = libm::atan(bound / (degrees as f64).sqrt());
    let (sine, cosine) = (libm::sin(angle_rad), libm::cos(angle_rad));
    let is_odd = degrees % 2 == 1;
    // Each term is the one before it times cos² and a fraction: 2/3, 4/5 … or 1/2, 3/4 ….
    let mut term = if is_odd { cosine } else { 1.0 };
    let first = if is_odd { 2 } else { 1 };
    let mut sum = if degrees == 1 { 0.0 } else { term };
    for numerator in (first..degrees.saturating_sub(2)).step_by(2) {
        term *= cosine * cosine * numerator as f64 / (numerator + 1) as f64;
        sum += term;
    }
    if is_odd { core::f64::consts::FRAC_2_PI * (angle_rad + sine * sum) } else { sine * sum }
}

/// A share by its count, 0 without trials, and its 95 % interval.
pub fn proportion(count: u32, trials: u32) -> (f64, [f64; 2]) {
    let share = if trials == 0 { 0.0 } else { f64::from(count) / f64::from(trials) };
    (share, wilson(count, trials).into())
}

/// 95 % interval of a share by its count, after Wilson 1927; from 0 to 1 without trials.
pub fn wilson(count: u32, trials: u32) -> (f64, f64) {
    if trials == 0 {
        return (0.0, 1.0);
    }
    let (n, p) = (f64::from(trials), f64::from(count) / f64::from(trials));
    let centre = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    let whole = 1.0 + Z * Z / n;
    // At the ends rounding must not lose the exact 0 and 1.
    let low = if count == 0 { 0.0 } else { (centre - half) / whole };
    let high = if count == trials { 1.0 } else { (centre + half) / whole };
    (low, high)
}

/// Half a success and half a failure, seen before the first trial (Krichevsky and Trofimov 1981).
const PRIOR: f64 = 0.5;

/// 95 % interval of a share by its count, for a test that looks after each trial and stops when it has seen enough; from 0 to 1
/// without trials.
///
/// The share lies in all of these intervals at once in 95 of 100 tests, however many trials they take (a confidence sequence,
/// Robbins 1970). So the moment at which a test stops cannot make it wrong.
pub fn sequential(count: u32, trials: u32) -> [f64; 2] {
    let is_out = |share: f64| sequential_excludes(count, trials, share);
    let observed = if trials == 0 { 0.5 } else { f64::from(count) / f64::from(trials) };
    let low = if count == 0 { 0.0 } else { bisect(0.0, observed, |share| !is_out(share)) };
    let high = if count == trials { 1.0 } else { bisect(observed, 1.0, is_out) };
    [low, high]
}

/// Whether a share lies outside of the interval of [`sequential`]. The trials are then 20 times less likely under it than under
/// the mixture of all shares after Krichevsky and Trofimov (Ville's inequality).
pub fn sequential_excludes(count: u32, trials: u32, share: f64) -> bool {
    let (successes, failures) = (f64::from(count), f64::from(trials - count));
    let beta = |a: f64, b: f64| libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    let mixed = beta(successes + PRIOR, failures + PRIOR) - beta(PRIOR, PRIOR);
    let power = |exponent: f64, base: f64| if exponent == 0.0 { 0.0 } else { exponent * libm::log(base) };
    mixed - power(successes, share) - power(failures, 1.0 - share) >= libm::log(20.0)
}

/// The exact interval of a probability, of which `count` was observed in `trials` (Clopper and Pearson 1934); from 0 to 1
/// without trials.
pub fn binomial(count: u64, trials: u64) -> Interval {
    binomial_missing(count, trials, 0.05)
}

/// As [`binomial`], for an interval that misses the probability in at most this share of samples.
pub fn binomial_missing(count: u64, trials: u64, missing: f64) -> Interval {
    let tail = missing / 2.0;
    let low = match count {
        0 => 0.0,
        _ => bisect(0.0, 1.0, |share| 1.0 - binomial_at_most(count - 1, trials, share) >= tail),
    };
    let high = match count {
        _ if count >= trials => 1.0,
        _ => bisect(0.0, 1.0, |share| binomial_at_most(count, trials, share) <= tail),
    };
    Interval { low, high: Some(high) }
}

/// The interval of a mean of values of at least 0, most of which are 0 and the others of different weight (Fay and Feuer
/// 1997). Its ends are gamma quantiles with the mean and its variance, for the upper end as if the heaviest value had come
/// once more. `heaviest` is the share of the mean that this value has. The interval misses the mean in at most the given
/// share of samples as far as no value is heavier.
pub fn weighted(mean: f64, variance: f64, heaviest: f64, missing: f64) -> Interval {
    let tail = missing / 2.0;
    let low = if mean > 0.0 && variance > 0.0 {
        gamma_quantile(tail, mean * mean / variance, variance / mean)
    } else {
        0.0
    };
    let (mean, variance) = (mean + heaviest, variance.max(0.0) + heaviest * heaviest);
    Interval { low, high: Some(gamma_quantile(1.0 - tail, mean * mean / variance, variance / mean)) }
}

/// The value below which a gamma variable stays with this probability.
fn gamma_quantile(probability: f64, shape: f64, scale: f64) -> f64 {
    // Far beyond any quantile that is asked for.
    let far = shape + 40.0 * shape.sqrt() + 200.0;
    scale * bisect(0.0, far, |value| gamma_at_most(value, shape) >= probability)
}

/// Probability that a gamma variable of scale 1 is at most `value`: Abramowitz and Stegun 6.5.29 below the mean, the continued
/// fraction 6.5.31 by Lentz's method above it.
fn gamma_at_most(value: f64, shape: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let scale = libm::exp(shape * libm::log(value) - value - libm::lgamma(shape));
    // Each loop ends when its terms are too small to count; a large shape needs some multiple of its root.
    const TERMS_MAX: u32 = 1_000_000;
    if value < shape + 1.0 {
        let (mut term, mut sum) = (1.0 / shape, 1.0 / shape);
        for number in 1..TERMS_MAX {
            term *= value / (shape + f64::from(number));
            sum += term;
            if term < sum * 1e-17 {
                break;
            }
        }
        return (scale * sum).min(1.0);
    }
    const TINY: f64 = 1e-300;
    let mut under = value + 1.0 - shape;
    let mut over = 1.0 / TINY;
    let mut inverse = 1.0 / under;
    let mut fraction = inverse;
    for number in 1..TERMS_MAX {
        let number = f64::from(number);
        let numerator = -number * (number - shape);
        under += 2.0;
        inverse = numerator * inverse + under;
        inverse = 1.0 / if inverse.abs() < TINY { TINY } else { inverse };
        over = under + numerator / over;
        over = if over.abs() < TINY { TINY } else { over };
        let factor = over * inverse;
        fraction *= factor;
        if (factor - 1.0).abs() < 1e-16 {
            break;
        }
    }
    (1.0 - scale * fraction).max(0.0)
}

/// Probability that at most `count` of `trials` come true, each with probability `share` in `(0, 1)`.
fn binomial_at_most(count: u64, trials: u64, share: f64) -> f64 {
    if share <= 0.0 {
        return 1.0;
    }
    if share >= 1.0 {
        return f64::from(u8::from(count >= trials));
    }
    let (log_share, log_rest) = (libm::log(share), libm::log1p(-share));
    let of_trials = libm::lgamma(trials as f64 + 1.0);
    let chance = |hits: u64| {
        let (hits, misses) = (hits as f64, (trials - hits) as f64);
        let ways = of_trials - libm::lgamma(hits + 1.0) - libm::lgamma(misses + 1.0);
        libm::exp(ways + hits * log_share + misses * log_rest)
    };
    (0..=count).map(chance).sum::<f64>().min(1.0)
}

/// The difference of two shares in pairs, the second's less the first's, with its interval (Newcombe 1998, method 10).
/// `counts` are the pairs in which both came true, the first alone, the second alone.
pub fn paired_difference([both, first_only, second_only]: [u64; 3], pairs: u64) -> (f64, Interval) {
    let neither = pairs.saturating_sub(both + first_only + second_only);
    let [a, b, c, d] = [both, second_only, first_only, neither].map(|count| count as f64);
    let n = pairs as f64;
    let (first, second) = ((a + c) / n, (a + b) / n);
    let interval =
        |count: u64| wilson(count.min(u64::from(u32::MAX)) as u32, pairs.min(u64::from(u32::MAX)) as u32);
    let (first_low, first_high) = interval(both + first_only);
    let (second_low, second_high) = interval(both + second_only);
    // The correlation of the pairs, corrected for continuity where it is positive.
    let product = a * d - b * c;
    let corrected = if product > 0.0 { (product - n / 2.0).max(0.0) } else { product };
    let scale = ((a + b) * (c + d) * (a + c) * (b + d)).sqrt();
    let correlation = if scale > 0.0 { corrected / scale } else { 0.0 };
    let reach =
        |one: f64, other: f64| (one * one - 2.0 * correlation * one * other + other * other).max(0.0).sqrt();
    let difference = second - first;
    let low = difference - reach(second - second_low, first_high - first);
    let high = difference + reach(second_high - second, first - first_low);
    (difference, Interval { low, high: Some(high) })
}

/// The exact interval of the mean of a Poisson variable, of which `count` was observed (Garwood 1936).
pub fn poisson(count: u64) -> Interval {
    let low = match count.checked_sub(1) {
        None => 0.0,
        Some(fewer) => bisect(0.0, poisson_far(count), |mean| 1.0 - poisson_at_most(fewer, mean) >= 0.025),
    };
    Interval { low, high: Some(poisson_above(count, 0.025)) }
}

/// The mean of which a Poisson variable is at most `count` with this probability.
fn poisson_above(count: u64, probability: f64) -> f64 {
    bisect(0.0, poisson_far(count), |mean| poisson_at_most(count, mean) <= probability)
}

/// Ten standard deviations and some more: beyond any mean that fits a count.
fn poisson_far(count: u64) -> f64 {
    count as f64 + 10.0 * (count as f64).sqrt() + 20.0
}

/// The interval of the expected number of events, of kinds that were not seen yet, in as long a time again. `once` kinds were
/// seen once so far, and `twice` were seen twice. It held in at least 90 % of simulated campaigns.
///
/// The best guess is `once` (Good 1953). Its error has the variance `once + 2 * twice` (Robbins 1968). With few kinds it is skewed. So the upper end is
/// that of a Poisson mean, with its distance from the guess widened by the ratio of the two standard deviations.
pub fn unseen(once: u64, twice: u64) -> Interval {
    const Z_OF_90: f64 = 1.644_853_626_951_472;
    let guess = once as f64;
    let variance = guess + 2.0 * twice as f64 + 1.0;
    let low = (guess - Z_OF_90 * variance.sqrt()).max(0.0);
    let high = guess + (poisson_above(once, 0.05) - guess) * (variance / (guess + 1.0)).sqrt();
    Interval { low, high: Some(high) }
}

/// Probability that a Poisson variable is at most `count`.
fn poisson_at_most(count: u64, mean: f64) -> f64 {
    if mean <= 0.0 {
        return 1.0;
    }
    let logarithm = libm::log(mean);
    let chance = |events: u64| {
        let events = events as f64;
        libm::exp(events * logarithm - mean - libm::lgamma(events + 1.0))
    };
    (0..=count).map(chance).sum::<f64>().min(1.0)
}

/// Resamples of a bootstrap. Ours.
const RESAMPLES: usize = 10_000;

/// Ratio of two samples' means with its percentile bootstrap interval; `None` if one is empty or the second's mean
/// is 0. Resamples whose denominator is 0 count as larger than every bound.
///
/// With about ten values the bootstrap interval is too narrow (see [`mean`]): read it as effect size, and use the
/// rank test for significance.
pub fn ratio_of_means(numerator: &[f64], denominator: &[f64], rng: &mut Rng) -> Option<(f64, Interval)> {
    let ratio = |above: f64, below: f64| if below == 0.0 { f64::INFINITY } else { above / below };
    let (above, below) = (mean(numerator)?.mean, mean(denominator)?.mean);
    if below == 0.0 {
        return None;
    }
    let mut ratios: Vec<f64> = (0..RESAMPLES)
        .map(|_| ratio(resampled_mean(numerator, rng), resampled_mean(denominator, rng)))
        .collect();
    ratios.sort_by(f64::total_cmp);
    let tail = RESAMPLES / 40;
    let (low, high) = (ratios[tail], ratios[RESAMPLES - 1 - tail]);
    // If even the lower bound is infinite, nothing at all is known.
    let low = if low.is_finite() { low } else { 0.0 };
    Some((above / below, Interval { low, high: high.is_finite().then_some(high) }))
}

fn resampled_mean(values: &[f64], rng: &mut Rng) -> f64 {
    let count = values.len() as u32;
    (0..count).map(|_| values[rng::below(rng, count) as usize]).sum::<f64>() / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, stream};

    fn assert_near(found: Interval, ends: [f64; 2], within: f64) {
        let is_near = |found: f64, end: f64| (found - end).abs() < within;
        let [low, high] = ends;
        assert!(is_near(found.low, low) && is_near(found.high.unwrap(), high), "{found:?} is not {ends:?}");
    }

    /// `scipy.stats.t.ppf(0.975, n)`.
    #[test]
    fn quantiles_are_students() {
        let known = [
            (1, 12.706204736174694),
            (2, 4.302652729749462),
            (3, 3.1824463052837078),
            (4, 2.7764451051977934),
            (9, 2.262157162798205),
            (29, 2.045229642132703),
            (100, 1.9839715185235518),
        ];
        for (degrees, expected) in known {
            let found = student_quantile(degrees);
            assert!((found - expected).abs() < 1e-9, "{degrees}: {found}");
        }
    }

    /// `scipy.stats.t.interval(0.95, 4, numpy.mean(x), scipy.stats.sem(x))` of 3, 5, 4, 8, 6.
    #[test]
    fn a_mean_has_its_interval() {
        let found = mean(&[3.0, 5.0, 4.0, 8.0, 6.0]).unwrap();
        assert_eq!(found.mean, 5.2);
        assert_near(found.interval.unwrap(), [2.81161161190002, 7.588388388099981], 1e-9);
        assert_eq!(mean(&[4.0]).unwrap().interval, None);
        assert_eq!(mean(&[0.0, 0.0, 0.0]).unwrap().interval, None);
        assert_eq!(mean(&[]), None);
    }

    /// Every way of a test of 400 trials, by its exact probability.
    #[test]
    fn a_sequential_interval_misses_the_share_at_most_in_one_of_twenty_tests() {
        for share in [0.05, 0.1, 0.2, 0.5, 0.9] {
            // The probability of each count, of the tests that have not missed so far.
            let (mut by_count, mut missed) = (vec![1.0], 0.0);
            for trials in 1..=400_u32 {
                let before = by_count;
                by_count = vec![0.0; trials as usize + 1];
                for (count, probability) in before.into_iter().enumerate() {
                    by_count[count] += probability * (1.0 - share);
                    by_count[count + 1] += probability * share;
                }
                for (count, probability) in by_count.iter_mut().enumerate().filter(|(_, of)| **of > 1e-12) {
                    let [low, high] = sequential(count as u32, trials);
                    if share < low || share > high {
                        missed += core::mem::take(probability);
                    }
                }
            }
            assert!(missed > 0.005 && missed < 0.05, "{share}: {missed}");
        }
    }

    #[test]
    fn a_sequential_interval_closes_in_on_the_share() {
        assert_eq!(sequential(0, 0), [0.0, 1.0]);
        let rounded = |count, trials| sequential(count, trials).map(|end| (1000.0 * end).round() / 1000.0);
        assert_eq!([rounded(0, 7), rounded(7, 7)], [[0.0, 0.479], [0.521, 1.0]]);
        assert_eq!([rounded(7, 20), rounded(350, 1000)], [[0.097, 0.686], [0.296, 0.406]]);
    }

    /// Bisection over tails summed with exact binomial coefficients.
    #[test]
    fn intervals_of_probabilities_are_clopper_and_pearsons() {
        let known = [
            (0, 20, 0.0, 0.16843347098308534),
            (3, 20, 0.032070937185463715, 0.37892682654531396),
            (20, 20, 0.8315665290169147, 1.0),
            (5, 400, 0.0040708358445997374, 0.028928343785286807),
            (1, 2, 0.01257911709342505, 0.987420882906575),
        ];
        for (count, trials, low, high) in known {
            assert_near(binomial(count, trials), [low, high], 1e-9);
        }
        assert_eq!(binomial(0, 0), Interval { low: 0.0, high: Some(1.0) });
    }

    /// Equal weights give Garwood's interval; the others are roots of mpmath's `gammainc`.
    #[test]
    fn intervals_of_weighted_counts_are_fay_and_feuers() {
        for count in [0_u32, 1, 5, 40] {
            let found = weighted(f64::from(count) / 100.0, f64::from(count) / 1e4, 0.01, 0.05);
            let exact = poisson(u64::from(count));
            assert!((100.0 * found.low - exact.low).abs() < 1e-6, "{found:?} {exact:?}");
            assert!((100.0 * found.high.unwrap() - exact.high.unwrap()).abs() < 1e-6, "{found:?} {exact:?}");
        }
        // Two events of weight 1 and ten of weight 0.1 among 1,000.
        let found = weighted(3.0 / 1e3, 2.1 / 1e6, 1.0 / 1e3, 0.05);
        assert_near(found, [0.000865837810245, 0.00811776904705], 1e-9);
        // A narrower miss makes a wider interval.
        assert!(weighted(3.0 / 1e3, 2.1 / 1e6, 1.0 / 1e3, 0.01).low < found.low);
    }

    /// Newcombe 1998 b, table II, method 10: of 36, 12, 2, 0 and of 20, 12, 2, 16 pairs.
    #[test]
    fn differences_of_pairs_are_newcombes() {
        for (counts, pairs, low, high) in [
            ([36, 2, 12], 50, 0.0569, 0.3404),
            ([20, 2, 12], 50, 0.0562, 0.3292),
            ([0, 0, 0], 50, -0.0713, 0.0713),
        ] {
            let (found, interval) = paired_difference(counts, pairs);
            assert!((found - (counts[2] as f64 - counts[1] as f64) / pairs as f64).abs() < 1e-12);
            assert_near(interval, [low, high], 5e-5);
        }
    }

    /// `chi2.ppf(0.025, 2 * n) / 2` and `chi2.ppf(0.975, 2 * n + 2) / 2` of `scipy.stats`.
    #[test]
    fn intervals_of_counts_are_garwoods() {
        let known = [
            (0, 0.0, 3.6888794541139363),
            (1, 0.025317807984289876, 5.571643390938898),
            (5, 1.6234863901184207, 11.66833207932267),
            (40, 28.576586441788965, 54.468646963984064),
            (1000, 938.9730184076952, 1063.952136016302),
        ];
        for (count, low, high) in known {
            let found = poisson(count);
            assert!((found.low - low).abs() < 1e-6 * (1.0 + low), "{count}: {found:?}");
            assert!((found.high.unwrap() - high).abs() < 1e-6 * high, "{count}: {found:?}");
        }
    }

    /// Campaigns of 1 to 25 hours over kinds with rates that fall steeply, or that are equal.
    #[test]
    fn what_is_unseen_lies_in_its_interval() {
        let mut rng = stream(7, Stream::Bootstrap, 0);
        let steep: Vec<f64> = (1..=20).map(|rank| 5.0 / f64::from(rank * rank)).collect();
        for (rates, hours) in [(&steep, 1.0), (&steep, 5.0), (&steep, 25.0), (&vec![0.2; 12], 5.0)] {
            let mut covered = 0;
            for _ in 0..1000 {
                let (mut once, mut twice, mut left) = (0, 0, 0.0);
                for rate in rates {
                    match poisson_draw(rate * hours, &mut rng) {
                        0 => left += rate * hours,
                        1 => once += 1,
                        2 => twice += 1,
                        _ => {}
                    }
                }
                let found = unseen(once, twice);
                covered += u32::from((found.low..=found.high.unwrap()).contains(&left));
            }
            assert!(covered >= 900, "{hours} h: {covered}");
        }
        assert_near(unseen(0, 0), [0.0, 2.995_732_273_553_991], 1e-9);
        // 4.743865 is Garwood's end for one, √3 the ratio of the deviations.
        assert_near(unseen(1, 2), [0.0, 1.0 + 3.743_864_518 * 3.0_f64.sqrt()], 1e-6);
    }

    /// The number of unit steps of an exponential clock that fit into `mean`.
    fn poisson_draw(mean: f64, rng: &mut Rng) -> u64 {
        let (mut passed, mut count) = (0.0, 0);
        loop {
            passed -= libm::log(1.0 - rng::unit(rng));
            if passed > mean {
                return count;
            }
            count += 1;
        }
    }

    #[test]
    fn ratios_of_means() {
        let mut rng = stream(1, Stream::Bootstrap, 0);
        let (ratio, interval) =
            ratio_of_means(&[4.0, 6.0, 5.0, 5.0], &[2.0, 3.0, 2.0, 3.0], &mut rng).unwrap();
        assert_eq!(ratio, 2.0);
        assert!(interval.low > 1.5 && interval.high.unwrap() < 2.6, "{interval:?}");
        assert_eq!(ratio_of_means(&[4.0], &[0.0], &mut rng), None);
        // One in eight resamples of three values, one of which is not 0, has nothing in it: no upper bound.
        let (_, interval) = ratio_of_means(&[4.0], &[0.0, 0.0, 3.0], &mut rng).unwrap();
        assert_eq!((interval.low, interval.high), (4.0 / 3.0, None));
    }

    #[test]
    fn intervals_are_wilsons() {
        // Newcombe 1998, table I, method 3: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
        for (count, trials, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let (found_low, found_high) = wilson(count, trials);
            assert_near(Interval { low: found_low, high: Some(found_high) }, [low, high], 5e-5);
        }
        assert_eq!(wilson(20, 20), (1.0 - wilson(0, 20).1, 1.0));
        assert_eq!(wilson(0, 0), (0.0, 1.0));
    }
}
