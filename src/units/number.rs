//! Numbers as text: canonical SI, the shortest decimal that reads back to the same f64.

use super::dimension::Dimension;

/// The shortest decimal without an exponent that reads back to the same f64; a whole number keeps
/// one decimal place if `point`, as in `1.0`.
pub fn decimal(value: f64, point: bool) -> String {
    // Minus zero equals zero, and a file should not tell them apart.
    let text = if value == 0.0 { "0".to_owned() } else { value.to_string() };
    if point && value.is_finite() && !text.contains('.') { format!("{text}.0") } else { text }
}

/// A quantity in its SI unit: `20.625 m`, `0.5`.
pub fn quantity(value: f64, dimension: Dimension) -> String {
    match dimension.si_unit() {
        unit if unit.is_empty() => decimal(value, false),
        unit => format!("{} {unit}", decimal(value, false)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::rational::Rational;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn text_is_short() {
        assert_eq!(quantity(20.625, Dimension::LENGTH), "20.625 m");
        assert_eq!(quantity(-0.0, Dimension::RATIO), "0");
        assert_eq!(decimal(1.0, true), "1.0");
        assert_eq!(decimal(0.1, true), "0.1");
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
