//! Numbers as text: the shortest decimal that reads back to the same f64, in SI wherever that is short.

use super::dimension::Dimension;
use super::rational::Rational;
use super::unit::UNITS;

/// A number of more characters is shown in another unit than SI's, if that makes it shorter.
const SHORT: usize = 9;

/// The shortest decimal without an exponent that reads back to the same f64; a whole number keeps
/// one decimal place if `point`, as in `1.0`.
pub fn decimal(value: f64, point: bool) -> String {
    // Minus zero equals zero, and a file should not tell them apart.
    let text = if value == 0.0 { "0".to_owned() } else { value.to_string() };
    if point && value.is_finite() && !text.contains('.') { format!("{text}.0") } else { text }
}

/// A quantity as people read it: `20.625 m`, `0.5`, and `50 km/h` in place of `13.88888888888889 m/s`. It reads back to the
/// same f64.
pub fn quantity(value: f64, dimension: Dimension) -> String {
    let number = decimal(value, false);
    let (number, unit) = match number.len() {
        ..=SHORT => (number, dimension.si_unit()),
        _ => in_another_unit(value, dimension).unwrap_or((number, dimension.si_unit())),
    };
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// The shortest of the short texts in other units, if there is one.
fn in_another_unit(value: f64, dimension: Dimension) -> Option<(String, String)> {
    let short = |unit: &&super::unit::Unit| {
        let factor = unit.factor();
        let number = decimal((value / factor.to_f64() * 1e6).round() / 1e6, false);
        let exact = Rational::from_decimal(&number)?.checked_mul(factor)?;
        (number.len() <= SHORT && exact.to_f64() == value).then(|| (number, unit.word.to_owned()))
    };
    let units = UNITS.iter().filter(|unit| unit.dimension == dimension);
    units.filter_map(|unit| short(&unit)).min_by_key(|(number, _)| number.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn text_is_short() {
        assert_eq!(quantity(20.625, Dimension::LENGTH), "20.625 m");
        assert_eq!(quantity(-0.0, Dimension::RATIO), "0");
        assert_eq!(decimal(1.0, true), "1.0");
        assert_eq!(decimal(0.1, true), "0.1");
    }

    #[test]
    fn a_long_number_is_shown_in_the_unit_that_it_was_written_in() {
        let read = |number: &str, word: &str| {
            let unit = crate::units::unit(word).unwrap();
            Rational::from_decimal(number).unwrap().checked_mul(unit.factor()).unwrap().to_f64()
        };
        let written = [("20", "km/h"), ("50", "km/h"), ("-12.5", "km/h"), ("33.33", "mph"), ("90", "deg")];
        for (number, word) in written {
            let unit = crate::units::unit(word).unwrap();
            assert_eq!(quantity(read(number, word), unit.dimension), format!("{number} {word}"));
        }
        // Short in SI, or long in all units.
        assert_eq!(quantity(read("36", "km/h"), Dimension::SPEED), "10 m/s");
        assert_eq!(quantity(read("1", "%"), Dimension::RATIO), "0.01");
        assert_eq!(quantity(1.0 / 3.0, Dimension::LENGTH), "0.3333333333333333 m");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn text_reads_back_exactly(value in -1e6_f64..1e6) {
            let text = decimal(value, false);
            prop_assert_eq!(text.parse::<f64>().unwrap(), value);
            if value.abs() > 1e-6 {
                prop_assert_eq!(Rational::from_decimal(&text).unwrap().to_f64(), value);
            }
        }
    }
}
