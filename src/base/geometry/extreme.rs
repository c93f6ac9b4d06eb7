//! The larger and the smaller of two numbers.

/// The larger of two numbers, the second if one is NaN. `f64::max` takes four times as long because it handles NaN,
/// and this runs a thousand times a tick.
#[inline]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, the second if one is NaN; see [`larger`].
#[inline]
pub fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
