//! The few laws and figures of motion that several modules need, each with its source.
//!
//! They stand here once, because the world, the proofs, the reference drivers and the verdicts would contradict one another
//! with different figures for gravity, standing or careful braking. This module knows no roads and no vehicles.

/// Standard gravity (3rd CGPM, 1901), m/s².
pub const GRAVITY_MPS2: f64 = 9.80665;

/// A road user slower than this stands, m/s. Ours: slower than any car creeps, and faster than rounding.
///
/// A road user that stands runs into nothing, and has no direction of motion.
pub const STANDING_MPS: f64 = 0.1;

/// A person's walking pace, m/s (5 km/h, Euro NCAP's walking adult).
pub const WALKING_MPS: f64 = 5.0 / 3.6;

/// Hardest braking of the careful driver, m/s² (UN R157, Annex 4, Appendix 3: 0.774 g).
pub const CAREFUL_BRAKING_MPS2: f64 = 0.774 * GRAVITY_MPS2;

/// Time in which the careful driver perceives a risk, s (UN R157, Annex 4, Appendix 3).
pub const CAREFUL_PERCEPTION_S: f64 = 0.4;

/// Time from the perception until it brakes, s (UN R157, Annex 4, Appendix 3).
pub const CAREFUL_REACTION_S: f64 = 0.75;

/// Distance to rest, m: from a speed (m/s), with even braking (m/s², a magnitude) after a reaction time (s).
pub fn stopping_m(speed_mps: f64, reaction_s: f64, braking_mps2: f64) -> f64 {
    speed_mps * reaction_s + speed_mps * speed_mps / (2.0 * braking_mps2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_careful_driver_stops_from_50_kmph_within_29_metres() {
        let delay_s = CAREFUL_PERCEPTION_S + CAREFUL_REACTION_S;
        let found_m = stopping_m(50.0 / 3.6, delay_s, CAREFUL_BRAKING_MPS2);
        assert!((found_m - (15.97 + 12.71)).abs() < 0.01, "{found_m}");
        assert_eq!(stopping_m(0.0, delay_s, CAREFUL_BRAKING_MPS2), 0.0);
    }
}
