//! Sums, products and comparisons of numbers, as the language has them.

use crate::model::value::Value;
use crate::model::vocabulary::NumberWord;
use crate::syntax::ast::{Arithmetic, Comparison};

/// Numbers that differ by at most this part of the larger one are equal, and their difference is 0, unless both are whole.
/// This tolerates the digits that an author rounds away and those of binary fractions, but no measurable distance.
const EQUAL_PART: f64 = 1e-9;

/// Below this, an f64 without a fraction was not rounded to be so.
const EXACT: f64 = (1_u64 << 52) as f64;

/// Combines numbers by a word; NaN if one of them has no value.
pub(crate) fn of_numbers(word: NumberWord, numbers: impl Iterator<Item = f64>) -> f64 {
    let chosen = |a: f64, b: f64| match word {
        _ if a.is_nan() => a,
        NumberWord::Min if a <= b => a,
        NumberWord::Max if a >= b => a,
        NumberWord::Min | NumberWord::Max | NumberWord::Abs => b,
    };
    let sized = numbers.map(|number| if word == NumberWord::Abs { number.abs() } else { number });
    sized.reduce(chosen).unwrap_or(f64::NAN)
}

/// The result, or NaN if it has no value: an infinity would satisfy comparisons.
pub(crate) fn arithmetic(op: Arithmetic, left: f64, right: f64) -> f64 {
    let result = match op {
        Arithmetic::Add => sum(left, right),
        Arithmetic::Subtract => sum(left, -right),
        Arithmetic::Multiply => left * right,
        Arithmetic::Divide => left / right,
    };
    if result.is_finite() { result } else { f64::NAN }
}

/// The difference of equal numbers is 0, so that a countdown from 0.3 by 0.1 ends at 0, and not at -3e-17.
fn sum(left: f64, right: f64) -> f64 {
    let cancel = left.is_finite() && are_equal(left, -right);
    if cancel { 0.0 } else { left + right }
}

/// Compares numbers by size, variants by position, and truth values by equality.
pub(crate) fn compare(op: Comparison, left: Value, right: Value) -> bool {
    match (left, right) {
        (Value::Number(left), Value::Number(right)) => compare_numbers(op, left, right),
        (Value::Variant(_, left), Value::Variant(_, right)) => op.holds(left, right),
        (left, right) => op.holds(left.truth(), right.truth()),
    }
}

/// Whether numbers are equal, or differ by [`EQUAL_PART`] of the larger one at most: the language's numbers are exact, and
/// 0.1 + 0.2 is another f64 than 0.3. Whole numbers below [`EXACT`] are exact in both.
fn are_equal(left: f64, right: f64) -> bool {
    let apart = (left - right).abs();
    let largest = left.abs().max(right.abs());
    let are_exact = || left.fract() == 0.0 && right.fract() == 0.0 && largest < EXACT;
    // Without a road user the nearest gap is infinite, which is no number of ten digits.
    left == right || apart.is_finite() && apart <= EQUAL_PART * largest && !are_exact()
}

/// Compares with that tolerance. Exactly one of less, equal and greater holds, unless a number is NaN.
#[inline]
pub(crate) fn compare_numbers(op: Comparison, left: f64, right: f64) -> bool {
    // The tolerance is asked for only where it decides.
    let equal = || are_equal(left, right);
    match op {
        Comparison::Equal => equal(),
        Comparison::NotEqual => !equal(),
        Comparison::Less => left < right && !equal(),
        Comparison::Greater => left > right && !equal(),
        Comparison::LessEqual => left <= right || equal(),
        Comparison::GreaterEqual => left >= right || equal(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_numbers_one_is_less_or_they_are_equal() {
        let all = [
            0.0,
            -0.0,
            0.3,
            0.1 + 0.2,
            0.3000001,
            -0.3,
            1e-12,
            2e-12,
            1e12,
            1e12 + 1.0,
            // On both sides of the bound, and on it.
            0.3 * (1.0 + 0.9 * EQUAL_PART),
            0.3 * (1.0 + 1.1 * EQUAL_PART),
            0.5 * (1.0 - EQUAL_PART),
            0.5,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        for (left, right) in all.into_iter().flat_map(|left| all.map(|right| (left, right))) {
            let holds = |op| compare_numbers(op, left, right);
            let found = [Comparison::Less, Comparison::Equal, Comparison::Greater].map(holds);
            assert_eq!(found.iter().filter(|one| **one).count(), 1, "{left} {right}");
            assert_eq!(holds(Comparison::LessEqual), !found[2], "{left} {right}");
            assert_eq!(holds(Comparison::GreaterEqual), !found[0], "{left} {right}");
            assert_eq!(holds(Comparison::NotEqual), !found[1], "{left} {right}");
        }
        // A missing value is in no order.
        let ordered = [Comparison::Less, Comparison::LessEqual, Comparison::Equal, Comparison::GreaterEqual];
        assert!(ordered.into_iter().all(|op| !compare_numbers(op, f64::NAN, 1.0)));
        assert!(compare_numbers(Comparison::NotEqual, f64::NAN, f64::NAN));
    }

    #[test]
    fn numbers_within_a_billionth_are_equal_unless_both_are_whole() {
        let billionth = |part: f64| (0.3, 0.3 * (1.0 + part * EQUAL_PART));
        let equal = [
            (0.3, 0.1 + 0.2),
            billionth(0.9),
            (0.0, -0.0),
            (1e300, 1e300),
            (1e9 + 0.5, 1e9),
            // Both are whole only because they are so large.
            ((0.1 + 0.2) * 3e16, 0.3 * 3e16),
        ];
        let apart = [billionth(1.1), (1e-12, 2e-12), (0.0, 1e-300), (1e12, 1e12 + 1.0)];
        let all = equal.map(|pair| (pair, true)).into_iter().chain(apart.map(|pair| (pair, false)));
        for ((left, right), expected) in all {
            assert_eq!(are_equal(left, right), expected, "{left} {right}");
            assert_eq!(are_equal(right, left), expected, "{right} {left}");
        }
        assert!(!are_equal(f64::INFINITY, 1.0) && !are_equal(f64::NAN, f64::NAN));
    }

    #[test]
    fn numbers_are_equal_where_their_difference_is_0() {
        let all = [0.0, 0.1, 0.3, 0.1 + 0.2, -0.3, 7.0, 7.000_000_001, 1e12, 1e12 + 1.0, 1e300, 5e-324];
        for (left, right) in all.into_iter().flat_map(|left| all.map(|right| (left, right))) {
            let is_zero = |op, right| arithmetic(op, left, right) == 0.0;
            assert_eq!(is_zero(Arithmetic::Subtract, right), are_equal(left, right), "{left} {right}");
            assert_eq!(is_zero(Arithmetic::Add, -right), are_equal(left, right), "{left} {right}");
        }
        let subtract = |left, right| arithmetic(Arithmetic::Subtract, left, right);
        assert_eq!(subtract(subtract(subtract(0.3, 0.1), 0.1), 0.1), 0.0);
        assert_eq!(subtract(1e12 + 1.0, 1e12), 1.0);
        assert!(subtract(f64::INFINITY, f64::INFINITY).is_nan());
    }
}
