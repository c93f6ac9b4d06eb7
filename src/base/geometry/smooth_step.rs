//! The smooth step: from 0 to 1 with no slope and no bend at its ends, the quintic of least jerk. Lane
//! changes, shifts past obstacles and merging lanes follow it.

/// Largest slope, half way.
pub const SMOOTH_STEP_SLOPE_MAX: f64 = 1.875;

/// Largest second derivative, `10 / √3`.
pub const SMOOTH_STEP_BEND_MAX: f64 = 5.773_502_691_896_258;

/// How far a shift is, and how it bends, after a part of its length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothStep {
    /// Part of the shift that is done, in `[0, 1]`.
    pub value: f64,
    /// Its derivative by the part of the length.
    pub slope: f64,
    /// Its second derivative.
    pub bend: f64,
}

/// The smooth step after a part of its length; before 0 and beyond 1 it is constant.
pub fn smooth_step(part: f64) -> SmoothStep {
    let u = part.clamp(0.0, 1.0);
    let rest = u * (1.0 - u);
    SmoothStep {
        value: u * u * u * (10.0 - u * (15.0 - 6.0 * u)),
        slope: 30.0 * rest * rest,
        bend: 60.0 * rest * (1.0 - 2.0 * u),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_its_derivatives_and_their_largest_values() {
        let h = 1e-5;
        let (mut steepest, mut most_bent) = (0.0_f64, 0.0_f64);
        for i in 1..1000 {
            let u = f64::from(i) / 1000.0;
            let (before, here, after) = (smooth_step(u - h), smooth_step(u), smooth_step(u + h));
            assert!(((after.value - before.value) / (2.0 * h) - here.slope).abs() < 1e-6);
            assert!(((after.slope - before.slope) / (2.0 * h) - here.bend).abs() < 1e-5);
            (steepest, most_bent) = (steepest.max(here.slope), most_bent.max(here.bend));
        }
        assert!((steepest - SMOOTH_STEP_SLOPE_MAX).abs() < 1e-5, "{steepest}");
        assert!((most_bent - SMOOTH_STEP_BEND_MAX).abs() < 1e-4, "{most_bent}");
        let values = [-1.0, 0.0, 0.5, 1.0, 2.0].map(|part| smooth_step(part).value);
        assert_eq!(values, [0.0, 0.0, 0.5, 1.0, 1.0]);
    }
}
