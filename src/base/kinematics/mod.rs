//! The few laws and figures of motion that several modules need, each with its source.
//!
//! They stand here once, because the world, the proofs, the reference drivers and the verdicts would contradict one another
//! with different figures for gravity, standing or careful braking. `r157` has the regulation's figures, `following` the
//! intelligent driver model. This module knows no roads and no vehicles.

mod following;
mod r157;

pub use following::Following;
pub use r157::{
    CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S, CAREFUL_JERK_MPS3, CAREFUL_PERCEPTION_S, CAREFUL_REACTION_S,
    CAREFUL_RELEASE_MPS2, CUT_IN_BRAKING_MPS2, CUT_IN_RESPONSE_S, WANDER_M,
};

/// Standard gravity (3rd CGPM, 1901), m/s².
pub const GRAVITY_MPS2: f64 = 9.80665;

/// A road user slower than this stands, m/s. Ours: slower than any car creeps, and faster than rounding.
///
/// A road user that stands runs into nothing, and has no direction of motion.
pub const STANDING_MPS: f64 = 0.1;

/// A driver that is faster than a speed by no more than this keeps to it, m/s: as `keeps_the_limit` of the law has it.
pub const SPEEDING_MPS: f64 = 1.0;

/// A person's walking pace, m/s (5 km/h, Euro NCAP's walking adult).
pub const WALKING_MPS: f64 = 5.0 / 3.6;

/// Way in which even braking (m/s², a magnitude) takes a speed (m/s) to rest, m: v²/2a.
#[inline]
pub fn braking_m(speed_mps: f64, braking_mps2: f64) -> f64 {
    speed_mps * speed_mps / (2.0 * braking_mps2)
}

/// Even braking that takes a speed (m/s) to rest within a room (m, above 0), m/s²: v²/2d, a magnitude.
#[inline]
pub fn needed_mps2(speed_mps: f64, room_m: f64) -> f64 {
    speed_mps * speed_mps / (2.0 * room_m)
}

/// Distance to rest, m: from a speed (m/s), with even braking (m/s², a magnitude) after a reaction time (s).
#[inline]
pub fn stopping_m(speed_mps: f64, reaction_s: f64, braking_mps2: f64) -> f64 {
    speed_mps * reaction_s + braking_m(speed_mps, braking_mps2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_careful_driver_stops_from_50_kmph_within_29_metres() {
        let found_m = stopping_m(50.0 / 3.6, CAREFUL_DELAY_S, CAREFUL_BRAKING_MPS2);
        assert!((found_m - (15.97 + 12.71)).abs() < 0.01, "{found_m}");
        assert_eq!(stopping_m(0.0, CAREFUL_DELAY_S, CAREFUL_BRAKING_MPS2), 0.0);
        assert_eq!(needed_mps2(8.0, braking_m(8.0, 4.0)), 4.0);
    }
}
