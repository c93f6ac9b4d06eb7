//! Numbers as text: the shortest decimal that reads back to the same f64, in SI or in a unit that people read.

use super::dimension::Dimension;
use super::rational::Rational;
use super::unit::{UNITS, Unit};

/// A number of at most this many characters is short.
const SHORT: usize = 9;

/// The shortest decimal without an exponent that reads back to the same f64; a whole number keeps
/// one decimal place if `point`, as in `1.0`.
pub fn decimal(value: f64, point: bool) -> String {
    // Minus zero equals zero, and a file should not tell them apart.
    let text = if value == 0.0 { "0".to_owned() } else { value.to_string() };
    if point && value.is_finite() && !text.contains('.') { format!("{text}.0") } else { text }
}

/// A quantity in its SI unit: `20.625 m`, `0.5`.
pub fn quantity(value: f64, dimension: Dimension) -> String {
    with_unit(decimal(value, false), &dimension.si_unit())
}

/// A quantity as people read it: in SI where it is short there, else in the first unit in which it is short. If it is
/// short in none, it stays in SI.
pub fn quantity_short(value: f64, dimension: Dimension) -> String {
    quantity_in(value, dimension, unit_of_all(&[value], dimension))
}

/// The unit in which people read such quantities, if it is not SI's. Where one is long in SI, this is the first unit in
/// which each is short and reads back to the same f64 (`50 km/h` in place of `13.88888888888889 m/s`).
pub fn unit_of_all(values: &[f64], dimension: Dimension) -> Option<&'static Unit> {
    if values.iter().all(|&value| is_short(&decimal(value, false))) {
        return None;
    }
    let fits = |unit: &&Unit| {
        unit.dimension == dimension && values.iter().all(|&value| number_of(value, unit).is_some())
    };
    UNITS.iter().find(fits)
}

/// A quantity in a unit in which it is short; in SI where it is not.
pub fn quantity_in(value: f64, dimension: Dimension, unit: Option<&Unit>) -> String {
    unit.and_then(|unit| quantity_if_short(value, unit)).unwrap_or_else(|| quantity(value, dimension))
}

/// A quantity in a unit, if it is short in that and reads back to the same f64.
pub fn quantity_if_short(value: f64, unit: &Unit) -> Option<String> {
    Some(with_unit(number_of(value, unit)?, unit.word))
}

/// The unit in which an author has probably written a number that has more than three decimals in SI. In this unit it has
/// the fewest decimals, and no more than in SI. `None` for SI's.
pub fn unit_as_written(value: f64, dimension: Dimension) -> Option<&'static Unit> {
    let decimals = |number: &str| number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let in_si = decimals(&decimal(value, false));
    let others = UNITS.iter().filter(|unit| unit.dimension == dimension && unit.factor() != Rational::ONE);
    let written = others.filter_map(|unit| Some((decimals(&number_of(value, unit)?), unit)));
    let (fewest, unit) = written.min_by_key(|(decimals, _)| *decimals)?;
    (in_si > 3 && fewest <= in_si).then_some(unit)
}

/// The number that a value is in a unit, if it is short and reads back to the same f64.
fn number_of(value: f64, unit: &Unit) -> Option<String> {
    // To a millionth, because the division rounds.
    let number = decimal((value / unit.factor().to_f64() * 1e6).round() / 1e6, false);
    let exact = Rational::from_decimal(&number)?.checked_mul(unit.factor())?;
    (is_short(&number) && exact.to_f64() == value).then_some(number)
}

fn is_short(number: &str) -> bool {
    number.trim_start_matches('-').len() <= SHORT
}

fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
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
    fn long_numbers_are_shown_in_a_unit_in_which_all_are_short() {
        let shown = |word: &str, numbers: &[&str]| {
            let unit = crate::units::unit(word).unwrap();
            let value =
                |number: &&str| Rational::from_decimal(number).unwrap().checked_mul(unit.factor()).unwrap();
            let values: Vec<f64> = numbers.iter().map(|number| value(number).to_f64()).collect();
            let shared = unit_of_all(&values, unit.dimension);
            let texts = values.iter().map(|&value| quantity_in(value, unit.dimension, shared));
            texts.collect::<Vec<_>>().join(", ")
        };
        assert_eq!(shown("km/h", &["20", "36", "-12.5"]), "20 km/h, 36 km/h, -12.5 km/h");
        assert_eq!(shown("mph", &["33.33"]), "33.33 mph");
        assert_eq!(shown("deg", &["0", "90"]), "0 deg, 90 deg");
        assert_eq!(shown("km/h", &["36", "-18"]), "10 m/s, -5 m/s", "short in SI");
        assert_eq!(quantity_short(50.0 / 9.0, Dimension::SPEED), "20 km/h");
        assert_eq!(quantity_short(8.0, Dimension::SPEED), "8 m/s");
        assert!(unit_of_all(&[1.0 / 3.0, 2.0], Dimension::LENGTH).is_none());
        assert!(unit_of_all(&[], Dimension::LENGTH).is_none());
        let written = |number: &str, word: &str| {
            let (number, unit) = (Rational::from_decimal(number).unwrap(), crate::units::unit(word).unwrap());
            let value = number.checked_mul(unit.factor()).unwrap().to_f64();
            unit_as_written(value, unit.dimension).map(|unit| unit.word)
        };
        assert_eq!(written("8.5", "mph"), Some("mph"));
        assert_eq!(written("12.345678", "km/h"), Some("km/h"));
        assert_eq!(written("25", "mph"), None, "11.176 m/s has three decimals: it may be written in SI");
        assert_eq!(written("1500", "m"), None);
        assert_eq!(written("3.4293", "m/s"), None, "it has more decimals in other units");
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
