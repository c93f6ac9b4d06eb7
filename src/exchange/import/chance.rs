//! Values that a file of variations lets chance choose: drawn here, for as many test runs as the file asks for.

use std::collections::BTreeMap;

use avastra_base::rng::{self, Rng, Stream, stream};
use roxmltree::Node;

use super::source::{Source, children, element, elements};
use super::variation::{Values, plain};

/// Draws that may fall outside of a range before it counts as holding nothing of its distribution.
const TRIES_MAX: usize = 1_000;

/// The largest expected value of a Poisson distribution, whose draws take as many steps as they are large.
const POISSON_MAX: f64 = 500.0;

/// How one parameter's values are spread.
enum Spread {
    /// Each with its weight.
    Listed(Vec<(String, f64)>),
    Uniform([f64; 2]),
    Normal {
        mean: f64,
        deviation: f64,
        within: Option<[f64; 2]>,
    },
    Poisson {
        mean: f64,
        within: Option<[f64; 2]>,
    },
    /// Uniform within each bin, which has its weight.
    Histogram(Vec<([f64; 2], f64)>),
}

/// The values of each test run of a `Stochastic` element, of which `runs_max` may be asked for; `None` if something is refused. `claim`
/// is asked about each parameter.
pub fn runs(
    source: &mut Source,
    stochastic: Node,
    runs_max: usize,
    mut claim: impl FnMut(&mut Source, Node, &str) -> Option<()>,
) -> Option<Vec<Values>> {
    let asked = source.number(stochastic, "numberOfTestRuns")?;
    let reason = "`numberOfTestRuns` is a whole number above 0";
    source.refuse_if(asked < 1.0 || asked.fract() != 0.0, stochastic, reason)?;
    let reason = format!("it asks for {asked} test runs: {}", super::variation::too_many(runs_max));
    source.refuse_if(asked > runs_max as f64, stochastic, reason)?;
    let seed = source.number_or(stochastic, "randomSeed", 0.0)?;
    let mut runs = vec![BTreeMap::new(); asked as usize];
    for (nth, one) in children(stochastic).enumerate() {
        let name = source.named(one, "parameterName")?;
        claim(source, one, &name)?;
        let spread = Spread::read(source, one)?;
        // One stream for each parameter: another one beside it changes nothing.
        let mut rng = stream(seed.to_bits(), Stream::Import, nth as u64);
        for values in &mut runs {
            let Some(value) = spread.draw(&mut rng) else {
                return source.refuse(one, "its range holds next to nothing of its distribution");
            };
            values.insert(name.clone(), value);
        }
    }
    source.note(format!(
        "the values of {asked} test runs are drawn here, and another tool draws others from the same distributions"
    ));
    Some(runs)
}

impl Spread {
    fn read(source: &mut Source, one: Node) -> Option<Spread> {
        let Some(inner) = children(one).next() else { return source.refuse(one, "it is empty") };
        match inner.tag_name().name() {
            "ProbabilityDistributionSet" => {
                let listed: Option<Vec<_>> = elements(inner, "Element")
                    .map(|one| Some((source.text(one, "value")?, source.amount(one, "weight")?)))
                    .collect();
                let listed = listed?;
                weighted(source, inner, listed.iter().map(|(_, weight)| *weight))?;
                Some(Spread::Listed(listed))
            }
            "UniformDistribution" => {
                let range = source.required(inner, "Range")?;
                Some(Spread::Uniform(bounds(source, range)?))
            }
            "NormalDistribution" => {
                let mean = source.number(inner, "expectedValue")?;
                let deviation = source.amount(inner, "variance")?.sqrt();
                Some(Spread::Normal { mean, deviation, within: within(source, inner)? })
            }
            "PoissonDistribution" => {
                let mean = source.amount(inner, "expectedValue")?;
                let reason = format!("an `expectedValue` of {POISSON_MAX} is read at most");
                source.refuse_if(mean > POISSON_MAX, inner, reason)?;
                Some(Spread::Poisson { mean, within: within(source, inner)? })
            }
            "Histogram" => {
                let mut bins = Vec::new();
                for bin in elements(inner, "Bin") {
                    let range = source.required(bin, "Range")?;
                    bins.push((bounds(source, range)?, source.amount(bin, "weight")?));
                }
                weighted(source, inner, bins.iter().map(|(_, weight)| *weight))?;
                Some(Spread::Histogram(bins))
            }
            _ => source.refuse(inner, "such a distribution is not read"),
        }
    }

    /// `None` if no draw falls within the range.
    fn draw(&self, rng: &mut Rng) -> Option<String> {
        let number = match self {
            Spread::Listed(listed) => {
                let nth = chosen(rng, listed.iter().map(|(_, weight)| *weight));
                return Some(listed[nth].0.clone());
            }
            Spread::Uniform([low, high]) => rng::between(rng, *low, *high),
            Spread::Normal { mean, deviation, within } => {
                inside(*within, || mean + deviation * rng::normal(rng))?
            }
            Spread::Poisson { mean, within } => inside(*within, || poisson(rng, *mean))?,
            Spread::Histogram(bins) => {
                let nth = chosen(rng, bins.iter().map(|(_, weight)| *weight));
                let [low, high] = bins[nth].0;
                rng::between(rng, low, high)
            }
        };
        Some(plain((number * 1e6).round() / 1e6))
    }
}

/// The two ends of a `Range`.
pub fn bounds(source: &mut Source, range: Node) -> Option<[f64; 2]> {
    let (low, high) = (source.number(range, "lowerLimit")?, source.number(range, "upperLimit")?);
    source.refuse_if(high < low, range, "a range goes up")?;
    Some([low, high])
}

/// The range within which a distribution is cut, if there is one; the outer `None` if it is refused.
fn within(source: &mut Source, distribution: Node) -> Option<Option<[f64; 2]>> {
    match element(distribution, "Range") {
        Some(range) => bounds(source, range).map(Some),
        None => Some(None),
    }
}

/// Refuses weights of which nothing can be chosen.
fn weighted(source: &mut Source, at: Node, weights: impl Iterator<Item = f64>) -> Option<()> {
    source.refuse_if(weights.sum::<f64>() <= 0.0, at, "nothing in it has a weight above 0")
}

/// The place of one of several by their weights, whose sum is above 0.
fn chosen(rng: &mut Rng, weights: impl Iterator<Item = f64> + Clone) -> usize {
    let mut left = rng::unit(rng) * weights.clone().sum::<f64>();
    let mut last = 0;
    for (nth, weight) in weights.enumerate().filter(|(_, weight)| *weight > 0.0) {
        last = nth;
        if left < weight {
            break;
        }
        left -= weight;
    }
    last
}

/// The first draw within the range.
fn inside(within: Option<[f64; 2]>, mut draw: impl FnMut() -> f64) -> Option<f64> {
    let is_inside = |value: &f64| within.is_none_or(|[low, high]| (low..=high).contains(value));
    (0..TRIES_MAX).map(|_| draw()).find(is_inside)
}

/// A draw from a Poisson distribution, by how many uniform draws multiply to less than `exp(-mean)` (Knuth, The Art of Computer
/// Programming 2, 3.4.1).
fn poisson(rng: &mut Rng, mean: f64) -> f64 {
    let (limit, mut product, mut count) = (libm::exp(-mean), rng::unit(rng), 0.0);
    while product > limit {
        product *= rng::unit(rng);
        count += 1.0;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of 20,000 draws.
    fn moments(spread: &Spread) -> [f64; 2] {
        let mut rng = stream(3, Stream::Import, 0);
        let drawn: Vec<f64> = (0..20_000)
            .map(|_| spread.draw(&mut rng).expect("a draw").parse::<f64>().expect("a number"))
            .collect();
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let squares = drawn.iter().map(|value| (value - mean) * (value - mean));
        [mean, squares.sum::<f64>() / drawn.len() as f64]
    }

    #[test]
    fn draws_have_the_moments_of_their_distributions() {
        let listed = vec![("1".to_owned(), 1.0), ("5".to_owned(), 3.0), ("9".to_owned(), 0.0)];
        let bins = vec![([0.0, 2.0], 1.0), ([4.0, 4.0], 1.0)];
        for (spread, mean, variance) in [
            (Spread::Listed(listed), 4.0, 3.0),
            (Spread::Uniform([2.0, 8.0]), 5.0, 3.0),
            (Spread::Normal { mean: -3.0, deviation: 2.0, within: None }, -3.0, 4.0),
            // The half of a normal distribution above its middle: mean √(2/π), variance 1 - 2/π.
            (Spread::Normal { mean: 0.0, deviation: 1.0, within: Some([0.0, 90.0]) }, 0.7979, 0.3634),
            (Spread::Poisson { mean: 6.5, within: None }, 6.5, 6.5),
            // Half 1 ± 1/√3, half 4: mean (1 + 4) / 2, variance (1/3) / 2 + 1.5².
            (Spread::Histogram(bins), 2.5, 2.4167),
        ] {
            let found = moments(&spread);
            assert!((found[0] - mean).abs() < 0.06, "{found:?}, not {mean}");
            assert!((found[1] - variance).abs() < 0.05 * variance, "{found:?}, not {variance}");
        }
    }

    #[test]
    fn a_range_without_mass_has_no_draw() {
        let mut rng = stream(3, Stream::Import, 0);
        let spread = Spread::Normal { mean: 0.0, deviation: 1.0, within: Some([9.0, 10.0]) };
        assert_eq!(spread.draw(&mut rng), None);
    }
}
