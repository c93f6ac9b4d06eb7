//! Exact fractions of 128-bit integers.
//!
//! Every operation that can leave the range gives `None` instead. The numbers of a scenario are a few digits
//! long, so `None` means an absurd file, and the caller says so.

use core::cmp::Ordering;
use core::fmt;

/// A fraction in lowest terms; the denominator is positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rational {
    numerator: i128,
    denominator: i128,
}

impl Rational {
    pub const ZERO: Rational = Rational::integer(0);
    pub const ONE: Rational = Rational::integer(1);

    pub const fn integer(value: i64) -> Rational {
        Rational { numerator: value as i128, denominator: 1 }
    }

    /// `numerator / denominator`; `None` if the denominator is 0 or a part does not fit.
    pub fn new(numerator: i128, denominator: i128) -> Option<Rational> {
        if denominator == 1 {
            return Some(Rational { numerator, denominator });
        }
        let divisor = i128::try_from(gcd(numerator.unsigned_abs(), denominator.unsigned_abs())).ok()?;
        if denominator == 0 {
            return None;
        }
        let (numerator, denominator) = (numerator / divisor, denominator / divisor);
        if denominator > 0 {
            Some(Rational { numerator, denominator })
        } else {
            Some(Rational { numerator: numerator.checked_neg()?, denominator: denominator.checked_neg()? })
        }
    }

    /// Reads `12`, `-0.5` or `20.625`: digits with at most one point.
    pub fn from_decimal(text: &str) -> Option<Rational> {
        let unsigned = text.strip_prefix('-').unwrap_or(text);
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        // Zeros at the end of a fraction change nothing, but would use up range.
        let fraction = fraction.trim_end_matches('0');
        let digits = [whole, fraction].concat();
        if whole.is_empty() || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
            return None;
        }
        let numerator: i128 = digits.parse().ok()?;
        let denominator = 10_i128.checked_pow(u32::try_from(fraction.len()).ok()?)?;
        Rational::new(if text.starts_with('-') { -numerator } else { numerator }, denominator)
    }

    /// Reads a number as files write it: `12`, `0.50` or `1e-9`.
    pub fn from_literal(text: &str) -> Option<Rational> {
        let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let exponent: i32 = exponent.parse().ok()?;
        let power = 10_i128.checked_pow(exponent.unsigned_abs())?;
        let factor = if exponent >= 0 { Rational::new(power, 1)? } else { Rational::new(1, power)? };
        Rational::from_decimal(mantissa)?.checked_mul(factor)
    }

    /// The exact value of a finite f64, if it fits.
    pub fn from_f64(value: f64) -> Option<Rational> {
        if !value.is_finite() {
            return None;
        }
        let bits = value.to_bits();
        let exponent_bits = ((bits >> 52) & 0x7ff) as i32;
        let fraction = (bits & ((1 << 52) - 1)) as i128;
        let (mut mantissa, mut exponent) = match exponent_bits {
            0 => (fraction, -1074),
            _ => (fraction | (1 << 52), exponent_bits - 1075),
        };
        if mantissa == 0 {
            return Some(Rational::ZERO);
        }
        let spare = mantissa.trailing_zeros() as i32;
        mantissa >>= spare;
        exponent += spare;
        let power = 1_i128.checked_shl(exponent.unsigned_abs()).filter(|power| *power > 0)?;
        let signed = if value < 0.0 { -mantissa } else { mantissa };
        // Lowest terms: the mantissa is odd, and the denominator is a power of two.
        Some(match exponent >= 0 {
            true => Rational { numerator: signed.checked_mul(power)?, denominator: 1 },
            false => Rational { numerator: signed, denominator: power },
        })
    }

    /// The simplest fraction whose nearest f64 is this one, among the convergents of its continued fraction. This is the
    /// number of the source text that it was read from, if its denominator has up to six digits or so.
    ///
    /// A proof that took the f64 for exact would tell 30 km/h (25/3 m/s) from the limit of 30 km/h in a rule.
    pub fn from_rounded(value: f64) -> Option<Rational> {
        Rational::simplest(value, |found| found == value)
    }

    /// As [`Rational::from_rounded`] for a number that was computed and may have been rounded on the way: the simplest
    /// fraction within 1e-12 of it, if its denominator has at most six digits.
    pub fn from_computed(value: f64) -> Option<Rational> {
        let near = Rational::simplest(value, |found| (found - value).abs() <= 1e-12 * value.abs());
        near.filter(|near| near.denominator < 1_000_000).or_else(|| Rational::from_rounded(value))
    }

    /// The first convergent of a number's continued fraction that will do, else the number itself.
    fn simplest(value: f64, will_do: impl Fn(f64) -> bool) -> Option<Rational> {
        let exact = Rational::from_f64(value)?;
        let (mut rest, mut divisor) = (exact.numerator.abs(), exact.denominator);
        // The last two convergents; their parts grow up to those of the exact fraction.
        let (mut before, mut now) = ((0, 1), (1, 0));
        while divisor != 0 {
            let whole = rest / divisor;
            (before, now) = (now, (whole * now.0 + before.0, whole * now.1 + before.1));
            (rest, divisor) = (divisor, rest % divisor);
            let found = Rational { numerator: exact.numerator.signum() * now.0, denominator: now.1 };
            if will_do(found.to_f64()) {
                return Some(found);
            }
        }
        Some(exact)
    }

    /// The nearest f64, ties to even: what reading the same number as text would give.
    pub fn to_f64(self) -> f64 {
        const EXACT: u128 = 1 << 53;
        let (top, bottom) = (self.numerator.unsigned_abs(), self.denominator.unsigned_abs());
        let magnitude = if top <= EXACT && bottom <= EXACT {
            // Both are exact, so the division rounds once. They also fit 64 bits, which machines convert themselves.
            top as u64 as f64 / bottom as u64 as f64
        } else {
            divide_rounding_once(top, bottom)
        };
        if self.numerator < 0 { -magnitude } else { magnitude }
    }

    pub fn checked_add(self, other: Rational) -> Option<Rational> {
        if self.denominator == other.denominator {
            return Rational::new(self.numerator.checked_add(other.numerator)?, self.denominator);
        }
        let left = self.numerator.checked_mul(other.denominator)?;
        let right = other.numerator.checked_mul(self.denominator)?;
        Rational::new(left.checked_add(right)?, self.denominator.checked_mul(other.denominator)?)
    }

    pub fn checked_sub(self, other: Rational) -> Option<Rational> {
        self.checked_add(other.checked_neg()?)
    }

    pub fn checked_mul(self, other: Rational) -> Option<Rational> {
        if self.is_integer() && other.is_integer() {
            return Rational::new(self.numerator.checked_mul(other.numerator)?, 1);
        }
        // Crosswise reduction keeps products small, and nothing is left to reduce.
        let left = Rational::new(self.numerator, other.denominator)?;
        let right = Rational::new(other.numerator, self.denominator)?;
        let numerator = left.numerator.checked_mul(right.numerator)?;
        let denominator = left.denominator.checked_mul(right.denominator)?;
        Some(Rational { numerator, denominator })
    }

    /// `None` also for a division by 0.
    pub fn checked_div(self, other: Rational) -> Option<Rational> {
        self.checked_mul(Rational::new(other.denominator, other.numerator)?)
    }

    pub fn checked_neg(self) -> Option<Rational> {
        Some(Rational { numerator: self.numerator.checked_neg()?, denominator: self.denominator })
    }

    pub fn is_integer(self) -> bool {
        self.denominator == 1
    }

    /// The value, if it is whole and fits.
    pub fn to_i64(self) -> Option<i64> {
        i64::try_from(self.numerator).ok().filter(|_| self.is_integer())
    }

    pub fn signum(self) -> i32 {
        self.numerator.signum() as i32
    }

    /// The greatest whole number that is not above it.
    pub fn floor(self) -> Rational {
        Rational { numerator: self.numerator.div_euclid(self.denominator), denominator: 1 }
    }
}

impl PartialOrd for Rational {
    fn partial_cmp(&self, other: &Rational) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Rational {
    /// Exact, by products where they fit, else by comparing whole parts and then the remainders' reciprocals.
    fn cmp(&self, other: &Rational) -> Ordering {
        if self.denominator == other.denominator {
            return self.numerator.cmp(&other.numerator);
        }
        let products =
            (self.numerator.checked_mul(other.denominator), other.numerator.checked_mul(self.denominator));
        if let (Some(left), Some(right)) = products {
            return left.cmp(&right);
        }
        let (mut left, mut right) = (*self, *other);
        let mut reversed = false;
        loop {
            let wholes = left
                .numerator
                .div_euclid(left.denominator)
                .cmp(&right.numerator.div_euclid(right.denominator));
            let rest_left = left.numerator.rem_euclid(left.denominator);
            let rest_right = right.numerator.rem_euclid(right.denominator);
            let order = if wholes != Ordering::Equal {
                wholes
            } else if rest_left == 0 || rest_right == 0 {
                rest_left.min(1).cmp(&rest_right.min(1))
            } else {
                left = Rational { numerator: left.denominator, denominator: rest_left };
                right = Rational { numerator: right.denominator, denominator: rest_right };
                reversed = !reversed;
                continue;
            };
            return if reversed { order.reverse() } else { order };
        }
    }
}

impl fmt::Display for Rational {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(f, "{}", self.numerator),
            _ => write!(f, "{}/{}", self.numerator, self.denominator),
        }
    }
}

fn gcd(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        // Numbers of 64 bits, which most are, machines divide themselves.
        (a, b) = match (u64::try_from(a), u64::try_from(b)) {
            (Ok(short_a), Ok(short_b)) => (b, u128::from(short_a % short_b)),
            _ => (b, a % b),
        };
    }
    a
}

/// Long division in binary to 54 bits and a sticky one, rounded once. `bottom` is positive.
fn divide_rounding_once(top: u128, bottom: u128) -> f64 {
    if top == 0 {
        return 0.0;
    }
    let (mut quotient, mut rest) = (top / bottom, top % bottom);
    let mut exponent = 0_i32;
    // `rest < bottom <= 2^127`, so doubling it fits.
    while quotient < 1 << 54 {
        rest *= 2;
        quotient = quotient * 2 + u128::from(rest >= bottom);
        if rest >= bottom {
            rest -= bottom;
        }
        exponent -= 1;
    }
    let mut sticky = rest != 0;
    while quotient >= 1 << 55 {
        sticky |= quotient & 1 == 1;
        quotient >>= 1;
        exponent += 1;
    }
    // 55 significant bits: 53 to keep, one to decide, one sticky; `as f64` rounds ties to even.
    let rounded = ((quotient as u64) << 1 | u64::from(sticky)) as f64;
    // Times a power of two: exact, because the exponents of an i128 fraction stay far from f64's ends.
    rounded * f64::from_bits(((1023 + exponent - 1) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn fifty_kilometres_an_hour_is_exact() {
        let speed = Rational::integer(50).checked_mul(Rational::new(1000, 3600).unwrap()).unwrap();
        assert_eq!(speed.to_string(), "125/9");
        assert_eq!(speed.to_f64(), 125.0 / 9.0);
    }

    #[test]
    fn overflow_and_zero_are_none() {
        let huge = Rational::new(i128::MAX, 1).unwrap();
        assert_eq!(huge.checked_add(Rational::ONE), None);
        assert_eq!(huge.checked_mul(Rational::integer(2)), None);
        assert_eq!(Rational::ONE.checked_div(Rational::ZERO), None);
        assert_eq!(Rational::new(i128::MIN, -1), None);
        assert_eq!(Rational::new(0, 0), None);
        assert_eq!(Rational::from_decimal("1".repeat(60).as_str()), None);
        for bad in ["", "-", ".5", "1.2.3", "1e3", "٣"] {
            assert_eq!(Rational::from_decimal(bad), None, "{bad}");
        }
    }

    #[test]
    fn order_survives_huge_parts() {
        let a = Rational::new(i128::MAX, i128::MAX - 1).unwrap();
        let b = Rational::new(i128::MAX - 1, i128::MAX - 2).unwrap();
        assert!(a < b);
        assert!(b > a);
        assert!(Rational::integer(-2) < Rational::new(-3, 2).unwrap());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn decimals_read_as_f64_does(mantissa in -99_999_999_999_999_999_i64..=99_999_999_999_999_999, places in 0_usize..20) {
            let digits = format!("{:0>width$}", mantissa.unsigned_abs(), width = places + 1);
            let (whole, fraction) = digits.split_at(digits.len() - places);
            let text = format!("{}{whole}.{fraction}0", if mantissa < 0 { "-" } else { "" });
            let exact: f64 = text.parse().unwrap();
            prop_assert_eq!(Rational::from_decimal(&text).unwrap().to_f64(), if mantissa == 0 { 0.0 } else { exact });
        }

        #[test]
        fn floats_survive_the_detour(value in -1e12_f64..1e12) {
            if let Some(exact) = Rational::from_f64(value) {
                prop_assert_eq!(exact.to_f64(), value);
            }
        }

        #[test]
        fn the_number_of_a_text_is_found_again(numerator in -99_999_999_i128..99_999_999, denominator in 1_i128..99_999) {
            let written = Rational::new(numerator, denominator).unwrap();
            prop_assert_eq!(Rational::from_rounded(written.to_f64()), Some(written));
        }

        #[test]
        fn what_was_meant_is_found_in_what_was_computed(
            numerator in 1_i128..99_999, denominator in 1_i128..999, off in 0_u64..9,
        ) {
            let meant = Rational::new(numerator, denominator).unwrap();
            let computed = f64::from_bits(meant.to_f64().to_bits() + off - 4);
            prop_assert_eq!(Rational::from_computed(computed), Some(meant));
            prop_assert_eq!(Rational::from_computed(-computed), meant.checked_neg());
        }

        #[test]
        fn whatever_is_found_reads_as_the_same(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO) {
            match (Rational::from_f64(value), Rational::from_rounded(value)) {
                (Some(exact), Some(found)) => {
                    prop_assert_eq!(found.to_f64(), value);
                    prop_assert!(found.denominator <= exact.denominator);
                }
                (exact, found) => prop_assert_eq!(exact, found),
            }
        }

        #[test]
        fn order_agrees_with_subtraction(a in -999_i128..999, b in 1_i128..99, c in -999_i128..999, d in 1_i128..99) {
            let (x, y) = (Rational::new(a, b).unwrap(), Rational::new(c, d).unwrap());
            prop_assert_eq!(x.cmp(&y) as i32, x.checked_sub(y).unwrap().signum());
        }
    }
}
