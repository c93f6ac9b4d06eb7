//! Dimensions: what a quantity measures, as exponents of metre, second, radian and kilogram.

use core::fmt;

/// `m^metres · s^seconds · rad^radians · kg^kilograms`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Dimension {
    pub metres: i8,
    pub seconds: i8,
    pub radians: i8,
    pub kilograms: i8,
}

impl Dimension {
    pub const RATIO: Dimension = Dimension::of(0, 0, 0);
    pub const LENGTH: Dimension = Dimension::of(1, 0, 0);
    pub const DURATION: Dimension = Dimension::of(0, 1, 0);
    /// How often something happens.
    pub const RATE: Dimension = Dimension::of(0, -1, 0);
    pub const SPEED: Dimension = Dimension::of(1, -1, 0);
    pub const ACCEL: Dimension = Dimension::of(1, -2, 0);
    pub const JERK: Dimension = Dimension::of(1, -3, 0);
    pub const ANGLE: Dimension = Dimension::of(0, 0, 1);
    pub const MASS: Dimension = Dimension { kilograms: 1, ..Dimension::RATIO };

    /// The dimensions that have a type name in the language, with it and their SI unit.
    pub const NAMED: &'static [(Dimension, &'static str, &'static str)] = &[
        (Dimension::RATIO, "Ratio", ""),
        (Dimension::LENGTH, "Length", "m"),
        (Dimension::DURATION, "Duration", "s"),
        (Dimension::SPEED, "Speed", "m/s"),
        (Dimension::ACCEL, "Accel", "m/s^2"),
        (Dimension::JERK, "Jerk", "m/s^3"),
        (Dimension::ANGLE, "Angle", "rad"),
        (Dimension::MASS, "Mass", "kg"),
    ];

    const fn of(metres: i8, seconds: i8, radians: i8) -> Dimension {
        Dimension { metres, seconds, radians, kilograms: 0 }
    }

    /// The dimension of a product; `None` beyond exponents of ±127.
    pub fn times(self, other: Dimension) -> Option<Dimension> {
        self.with(other, i8::checked_add)
    }

    /// The dimension of a quotient; `None` beyond exponents of ±127.
    pub fn per(self, other: Dimension) -> Option<Dimension> {
        self.with(other, i8::checked_sub)
    }

    fn with(self, other: Dimension, power: fn(i8, i8) -> Option<i8>) -> Option<Dimension> {
        Some(Dimension {
            metres: power(self.metres, other.metres)?,
            seconds: power(self.seconds, other.seconds)?,
            radians: power(self.radians, other.radians)?,
            kilograms: power(self.kilograms, other.kilograms)?,
        })
    }

    /// SI unit in the spelling of the language: `m/s^2`, empty for a ratio.
    pub fn si_unit(self) -> String {
        if let Some((_, _, unit)) = Dimension::NAMED.iter().find(|(dimension, _, _)| *dimension == self) {
            return (*unit).to_owned();
        }
        let powers = [(self.metres, "m"), (self.seconds, "s"), (self.radians, "rad"), (self.kilograms, "kg")];
        let factor = |(power, base): (i8, &str)| match power {
            1 => base.to_owned(),
            _ => format!("{base}^{power}"),
        };
        powers.into_iter().filter(|(power, _)| *power != 0).map(factor).collect::<Vec<_>>().join("·")
    }
}

impl fmt::Display for Dimension {
    /// The type name where there is one, `m^2·s^-1` otherwise.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Dimension::NAMED.iter().find(|(dimension, _, _)| dimension == self) {
            Some((_, name, _)) => f.write_str(name),
            None => f.write_str(&self.si_unit()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_times_duration_is_length() {
        assert_eq!(Dimension::SPEED.times(Dimension::DURATION), Some(Dimension::LENGTH));
        assert_eq!(Dimension::LENGTH.per(Dimension::DURATION), Some(Dimension::SPEED));
    }

    #[test]
    fn odd_dimensions_have_a_spelling() {
        let area_rate = Dimension::SPEED.times(Dimension::LENGTH).unwrap();
        assert_eq!(area_rate.to_string(), "m^2·s^-1");
        assert_eq!(Dimension::ACCEL.to_string(), "Accel");
    }
}
