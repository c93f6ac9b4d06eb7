//! The unit words of the language and their exact factors to SI.
//!
//! Authors cannot add units: with a closed list, a misspelt unit is an error.

use super::dimension::Dimension;
use super::rational::Rational;

/// A unit word.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    pub word: &'static str,
    pub dimension: Dimension,
    numerator: i64,
    denominator: i64,
}

impl Unit {
    /// The unit in SI units: 5/18 for `km/h`.
    pub fn factor(&self) -> Rational {
        Rational::new(i128::from(self.numerator), i128::from(self.denominator))
            .expect("the table below has no zero denominators")
    }
}

/// The unit with that spelling.
pub fn unit(word: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.word == word)
}

/// Every unit word, in the order in which authors see them.
pub const UNITS: &[Unit] = &[
    Unit::exact("m", Dimension::LENGTH, 1, 1),
    Unit::exact("km", Dimension::LENGTH, 1000, 1),
    Unit::exact("s", Dimension::DURATION, 1, 1),
    Unit::exact("ms", Dimension::DURATION, 1, 1000),
    Unit::exact("min", Dimension::DURATION, 60, 1),
    Unit::exact("h", Dimension::DURATION, 3600, 1),
    Unit::exact("m/s", Dimension::SPEED, 1, 1),
    Unit::exact("km/h", Dimension::SPEED, 5, 18),
    // The international mile is 1609.344 m by definition.
    Unit::exact("mph", Dimension::SPEED, 1_609_344, 3_600_000),
    Unit::exact("m/s^2", Dimension::ACCEL, 1, 1),
    Unit::exact("m/s^3", Dimension::JERK, 1, 1),
    // π has no fraction. This convergent errs by 2e-18, less than the spacing of f64 near π/180,
    // so that `deg` becomes the same f64 as with the true value.
    Unit::exact("deg", Dimension::ANGLE, 1_068_966_896, 340_262_731 * 180),
    Unit::exact("rad", Dimension::ANGLE, 1, 1),
    Unit::exact("kg", Dimension::MASS, 1, 1),
    Unit::exact("%", Dimension::RATIO, 1, 100),
];

impl Unit {
    const fn exact(word: &'static str, dimension: Dimension, numerator: i64, denominator: i64) -> Unit {
        Unit { word, dimension, numerator, denominator }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_exact() {
        assert_eq!(unit("km/h").unwrap().factor().to_string(), "5/18");
        assert_eq!(unit("mph").unwrap().factor().to_f64(), 0.44704);
        assert_eq!(unit("%").unwrap().factor().to_f64(), 0.01);
        assert_eq!(unit("furlong"), None);
    }

    #[test]
    fn a_degree_is_the_f64_of_a_degree() {
        let half_turn = unit("deg").unwrap().factor().checked_mul(Rational::integer(180)).unwrap();
        assert_eq!(half_turn.to_f64(), core::f64::consts::PI);
    }
}
