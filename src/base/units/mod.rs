//! Exact quantities at the language's edge: rationals, dimensions, unit words, and numbers as text.
//!
//! The checker computes with [`Rational`]s in SI units, so that 50 km/h is 125/9 m/s and not nearly
//! that. The world computes in f64: [`Rational::to_f64`] is where the two meet.

mod dimension;
mod number;
mod rational;
mod unit;

pub use dimension::Dimension;
pub use number::{
    decimal, quantity, quantity_if_short, quantity_in, quantity_short, unit_as_written, unit_of_all,
};
pub use rational::Rational;
pub use unit::{UNITS, Unit, unit};
