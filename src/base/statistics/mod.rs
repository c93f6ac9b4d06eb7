//! Statistics of samples: intervals, rank tests, survival. Pure functions that know no driving.
//!
//! Written here and not taken from a crate because results must be the same bytes on every machine:
//! those at hand use the platform's logarithm and exponential function. All intervals are 95 %, if not said otherwise.
//!
//! ```
//! use avastra_base::statistics::{mann_whitney, superiority};
//!
//! let (ours, theirs) = ([9.0, 11.0, 10.0, 12.0], [4.0, 5.0, 3.0, 6.0]);
//! let (superiority, _) = superiority(&ours, &theirs).expect("neither is empty");
//! assert_eq!(superiority, 1.0);
//! assert!(mann_whitney(&ours, &theirs).expect("neither is empty").p < 0.05);
//! ```

mod intervals;
mod ranks;
mod survival;

pub use intervals::{
    Estimate, Interval, binomial, binomial_missing, mean, paired_difference, poisson, proportion,
    ratio_of_means, sequential, sequential_excludes, unseen, variance_of_mean, weighted, wilson,
};
pub use ranks::{PairedTest, RankTest, holm, mann_whitney, sign_test, signed_ranks, superiority};
pub use survival::{Lifetime, restricted_mean};

/// Normal quantile of a two-sided 95 %.
const Z: f64 = 1.959_963_984_540_054;

/// Where `is_above` turns true, by bisection; it must be false at `low` and true at `high`.
pub fn bisect(mut low: f64, mut high: f64, is_above: impl Fn(f64) -> bool) -> f64 {
    // 200 halvings exhaust an f64, wherever the two begin.
    for _ in 0..200 {
        let middle = low + (high - low) / 2.0;
        if is_above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
