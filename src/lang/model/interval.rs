//! Intervals of exact numbers, with open and closed ends.
//!
//! They over-approximate: an operation that does not fit exact numbers gives a wider interval, never
//! a wrong one. So "empty" is a proof, and "not empty" is not.

use core::cmp::Ordering;
use core::fmt;

use crate::model::value::Type;
use avastra_base::units::{Rational, Unit, decimal, unit_of_all};

/// One end of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Unbounded,
    /// Whether the number itself belongs to the interval.
    At(Rational, bool),
}

impl End {
    /// The end at another number; unbounded if that one does not fit.
    fn map(self, other: impl FnOnce(Rational) -> Option<Rational>) -> End {
        match self {
            End::At(value, closed) => other(value).map_or(End::Unbounded, |value| End::At(value, closed)),
            End::Unbounded => End::Unbounded,
        }
    }
}

/// All numbers between two ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    pub low: End,
    pub high: End,
}

impl Interval {
    pub const ALL: Interval = Interval { low: End::Unbounded, high: End::Unbounded };
    pub const NOT_NEGATIVE: Interval = Interval { low: End::At(Rational::ZERO, true), high: End::Unbounded };

    pub fn point(value: Rational) -> Interval {
        Interval::closed(value, value)
    }

    pub fn closed(low: Rational, high: Rational) -> Interval {
        Interval { low: End::At(low, true), high: End::At(high, true) }
    }

    pub fn is_empty(&self) -> bool {
        // Its high end lies below its low end, or both are one place that does not belong to it.
        self.is_below(self)
    }

    /// The one number of the interval, if it has just one.
    pub fn single(&self) -> Option<Rational> {
        match (self.low, self.high) {
            (End::At(low, true), End::At(high, true)) if low == high => Some(low),
            _ => None,
        }
    }

    pub fn intersect(&self, other: &Interval) -> Interval {
        let tighter = |a: End, b: End, keep: Ordering| match (a, b) {
            (End::Unbounded, end) | (end, End::Unbounded) => end,
            (End::At(x, x_in), End::At(y, y_in)) => match x.cmp(&y) {
                Ordering::Equal => End::At(x, x_in && y_in),
                order if order == keep => a,
                _ => b,
            },
        };
        Interval {
            low: tighter(self.low, other.low, Ordering::Greater),
            high: tighter(self.high, other.high, Ordering::Less),
        }
    }

    /// The smallest interval that holds both.
    pub fn hull(&self, other: &Interval) -> Interval {
        let wider = |a: End, b: End, keep: Ordering| match (a, b) {
            (End::Unbounded, _) | (_, End::Unbounded) => End::Unbounded,
            (End::At(x, x_in), End::At(y, y_in)) => match x.cmp(&y) {
                Ordering::Equal => End::At(x, x_in || y_in),
                order if order == keep => a,
                _ => b,
            },
        };
        Interval {
            low: wider(self.low, other.low, Ordering::Less),
            high: wider(self.high, other.high, Ordering::Greater),
        }
    }

    pub fn add(&self, other: &Interval) -> Interval {
        let sum = |a: End, b: End| match (a, b) {
            (End::At(x, x_in), End::At(y, y_in)) => {
                x.checked_add(y).map_or(End::Unbounded, |sum| End::At(sum, x_in && y_in))
            }
            _ => End::Unbounded,
        };
        Interval { low: sum(self.low, other.low), high: sum(self.high, other.high) }
    }

    /// The lesser of a number of this and one of the other.
    pub fn min(&self, other: &Interval) -> Interval {
        let both = self.hull(other);
        // At most what each can be.
        let at_most = |end: End| Interval { low: End::Unbounded, high: end };
        Interval { low: both.low, high: at_most(self.high).intersect(&at_most(other.high)).high }
    }

    /// The greater of a number of this and one of the other.
    pub fn max(&self, other: &Interval) -> Interval {
        self.neg().min(&other.neg()).neg()
    }

    pub fn neg(&self) -> Interval {
        let [low, high] = [self.high, self.low].map(|end| end.map(Rational::checked_neg));
        Interval { low, high }
    }

    pub fn mul(&self, other: &Interval) -> Interval {
        let ends = |a: &Interval| match (a.low, a.high) {
            (End::At(low, low_in), End::At(high, high_in)) => Some([(low, low_in), (high, high_in)]),
            _ => None,
        };
        let zero = Interval::point(Rational::ZERO);
        if *self == zero || *other == zero {
            return zero;
        }
        // A half line times a point stays exact; any other product with an unbounded side is `ALL`.
        let (Some(left), Some(right)) = (ends(self), ends(other)) else {
            return match (self.single(), other.single()) {
                (_, Some(factor)) => self.scale(factor),
                (Some(factor), _) => other.scale(factor),
                _ => Interval::ALL,
            };
        };
        let mut product: Option<Interval> = None;
        for (x, x_in) in left {
            for (y, y_in) in right {
                let Some(value) = x.checked_mul(y) else { return Interval::ALL };
                // If 0 belongs to one interval, the product 0 is reached, whatever the other end is.
                let zero_of = |end_in: bool, end: Rational| end_in && end == Rational::ZERO;
                let closed = (x_in && y_in) || zero_of(x_in, x) || zero_of(y_in, y);
                let end = End::At(value, closed);
                let corner = Interval { low: end, high: end };
                product = Some(product.map_or(corner, |so_far| so_far.hull(&corner)));
            }
        }
        product.unwrap_or(Interval::ALL)
    }

    /// The quotient; all numbers if the divisor may be 0.
    pub fn div(&self, other: &Interval) -> Interval {
        if other.contains(Rational::ZERO) {
            return Interval::ALL;
        }
        let (End::At(low, low_in), End::At(high, high_in)) = (other.low, other.high) else {
            return Interval::ALL;
        };
        match (Rational::ONE.checked_div(high), Rational::ONE.checked_div(low)) {
            (Some(from), Some(to)) => {
                self.mul(&Interval { low: End::At(from, high_in), high: End::At(to, low_in) })
            }
            _ => Interval::ALL,
        }
    }

    fn scale(&self, factor: Rational) -> Interval {
        let end = |end: End| end.map(|value| value.checked_mul(factor));
        match factor.signum() {
            1 => Interval { low: end(self.low), high: end(self.high) },
            _ => Interval { low: end(self.high), high: end(self.low) },
        }
    }

    pub fn contains(&self, value: Rational) -> bool {
        !self.intersect(&Interval::point(value)).is_empty()
    }

    /// Whether a whole number lies in it.
    pub fn has_integer(&self) -> bool {
        let End::At(low, _) = self.low else { return !self.is_empty() };
        let next = low.floor().checked_add(Rational::ONE);
        self.contains(low.floor()) || next.is_none_or(|next| self.contains(next))
    }

    /// The numbers at its ends; none where it is unbounded.
    fn ends(&self) -> impl Iterator<Item = f64> {
        [self.low, self.high].into_iter().filter_map(|end| match end {
            End::At(value, _) => Some(value.to_f64()),
            End::Unbounded => None,
        })
    }

    /// The unit in which people read its ends, if it is not SI's: see [`unit_of_all`].
    pub fn unit(&self, ty: Type) -> Option<&'static Unit> {
        let Type::Quantity(dimension) = ty else { return None };
        unit_of_all(&self.ends().collect::<Vec<_>>(), dimension)
    }

    /// The interval in a unit, in that of SI without one, rounded to three decimals: `20 .. 50 km/h`.
    pub fn shown(&self, ty: Type, unit: Option<&Unit>) -> String {
        self.shown_to(DECIMALS, ty, unit)
    }

    /// As [`Interval::shown`], rounded to so many decimals.
    pub fn shown_to(&self, decimals: u32, ty: Type, unit: Option<&Unit>) -> String {
        let (factor, word) = match (unit, ty) {
            (Some(unit), _) => (unit.factor().to_f64(), unit.word.to_owned()),
            (None, Type::Quantity(dimension)) => (1.0, dimension.si_unit()),
            (None, Type::Int | Type::Bool | Type::Enum(_)) => (1.0, String::new()),
        };
        let number = self.written(|value| rounded(value.to_f64() / factor, decimals));
        format!("{number} {word}").trim_end().to_owned()
    }

    /// The fewest decimals, at least three, that tell the different ends of intervals apart.
    pub fn decimals_of(intervals: &[Interval]) -> u32 {
        let mut ends: Vec<f64> = intervals.iter().flat_map(Interval::ends).collect();
        ends.sort_by(f64::total_cmp);
        let decimals = |decimals: &u32| {
            let shown = |pair: &[f64]| {
                pair[0] == pair[1] || rounded(pair[0], *decimals) != rounded(pair[1], *decimals)
            };
            ends.windows(2).all(shown)
        };
        (DECIMALS..DECIMALS_MAX).find(decimals).unwrap_or(DECIMALS_MAX)
    }

    fn written(&self, number: impl Fn(Rational) -> String) -> String {
        match (self.low, self.high) {
            (End::Unbounded, End::Unbounded) => "any number".to_owned(),
            (End::At(low, closed), End::Unbounded) => {
                format!("{} {}", if closed { ">=" } else { ">" }, number(low))
            }
            (End::Unbounded, End::At(high, closed)) => {
                format!("{} {}", if closed { "<=" } else { "<" }, number(high))
            }
            (End::At(low, true), End::At(high, true)) if low == high => number(low),
            (End::At(low, _), End::At(high, _)) => format!("{} .. {}", number(low), number(high)),
        }
    }

    /// Whether every number of `self` is less than every number of `other`.
    pub fn is_below(&self, other: &Interval) -> bool {
        match (self.high, other.low) {
            (End::At(high, high_in), End::At(low, low_in)) => {
                high < low || high == low && !(high_in && low_in)
            }
            _ => false,
        }
    }

    /// Whether every number of `self` is at most every number of `other`.
    pub fn is_at_most(&self, other: &Interval) -> bool {
        match (self.high, other.low) {
            (End::At(high, _), End::At(low, _)) => high <= low,
            _ => false,
        }
    }
}

impl fmt::Display for Interval {
    /// `10 .. 13.889`, rounded to three decimals; `> 10` and the like where an end is missing.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.written(|value| rounded(value.to_f64(), DECIMALS)))
    }
}

/// Decimals that a message shows where no two numbers need more.
const DECIMALS: u32 = 3;

/// Most decimals that a message shows.
const DECIMALS_MAX: u32 = 12;

fn rounded(value: f64, decimals: u32) -> String {
    let ten = 10_u64.pow(decimals) as f64;
    decimal((value * ten).round() / ten, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::units::Dimension;
    use proptest::prelude::*;

    fn fraction(n: i32, d: i32) -> Rational {
        Rational::new(i128::from(n), i128::from(d)).unwrap()
    }

    #[test]
    fn ends_are_told_apart() {
        let at = |digits: i32| Interval::closed(fraction(digits, 100_000), fraction(digits, 100_000));
        let close = [at(5_555_551), at(5_555_552)];
        let decimals = Interval::decimals_of(&close);
        let shown =
            close.map(|interval| interval.shown_to(decimals, Type::Quantity(Dimension::LENGTH), None));
        assert_eq!(shown, ["55.55551 m", "55.55552 m"]);
        assert_eq!(Interval::decimals_of(&[at(5_555_551), at(5_655_551), at(5_555_551)]), 3);
    }

    #[test]
    fn open_ends_do_not_meet() {
        let below = Interval { low: End::Unbounded, high: End::At(Rational::ONE, false) };
        let from = Interval { low: End::At(Rational::ONE, true), high: End::Unbounded };
        assert!(below.intersect(&from).is_empty() && below.is_below(&from));
        assert!(!from.intersect(&Interval::point(Rational::ONE)).is_empty());
    }

    #[test]
    fn quantities_are_shown_in_a_unit_in_which_both_ends_are_short() {
        let kmh = |number: i32| fraction(number * 5, 18);
        let speed = Type::Quantity(Dimension::SPEED);
        let shown = |interval: Interval, ty: Type| interval.shown(ty, interval.unit(ty));
        assert_eq!(shown(Interval::closed(kmh(20), kmh(50)), speed), "20 .. 50 km/h");
        assert_eq!(shown(Interval::closed(kmh(18), kmh(36)), speed), "5 .. 10 m/s");
        let from = Interval { low: End::At(kmh(50), true), high: End::Unbounded };
        assert_eq!(shown(from, speed), ">= 50 km/h");
        assert_eq!(from.shown(speed, None), ">= 13.889 m/s");
        assert_eq!(shown(Interval::point(fraction(1, 3)), Type::Quantity(Dimension::RATIO)), "0.333");
        assert_eq!(shown(Interval::ALL, Type::Int), "any number");
    }

    #[test]
    fn whole_numbers_lie_between_others_or_not() {
        let between = |low: i32, is_low_in: bool, high: i32| Interval {
            low: End::At(fraction(low, 2), is_low_in),
            high: End::At(fraction(high, 2), false),
        };
        assert!(!between(4, false, 6).has_integer() && between(4, true, 6).has_integer());
        assert!(!between(-5, true, -4).has_integer() && between(-5, true, -3).has_integer());
        assert!(!Interval::point(fraction(5, 2)).has_integer() && Interval::ALL.has_integer());
        let below = Interval { low: End::Unbounded, high: End::At(fraction(1, 2), false) };
        assert!(below.has_integer());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn arithmetic_encloses(a in -50..50_i32, b in 0..50_i32, c in -50..50_i32, d in 0..50_i32, s in 0..8_i32, t in 0..8_i32) {
            let left = Interval::closed(fraction(a, 4), fraction(a + b, 4));
            let right = Interval::closed(fraction(c, 4), fraction(c + d, 4));
            // One point of each interval.
            let x = fraction(a * 8 + b * s, 32);
            let y = fraction(c * 8 + d * t, 32);
            prop_assert!(left.add(&right).contains(x.checked_add(y).unwrap()));
            prop_assert!(left.add(&right.neg()).contains(x.checked_sub(y).unwrap()));
            prop_assert!(left.mul(&right).contains(x.checked_mul(y).unwrap()));
            if let Some(ratio) = x.checked_div(y) {
                prop_assert!(left.div(&right).contains(ratio));
            }
        }
    }
}
