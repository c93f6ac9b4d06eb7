//! The fuzzy safety model: brakes a little when the gap is a little unsafe.
//!
//! Mattas and others 2020 (Accident Analysis & Prevention 148, 105794) and 2022: a proactive and a
//! critical surrogate, PFS and CFS, each from 0 (safe) to 1 (unsafe), linear between two distances.
//! Performance model 2 of UN R157's 01 series. The surrogates know leaders. Two extensions are ours: a
//! crossing road user counts by its speed along the way, and an oncoming one as standing where both would
//! meet after the time that stopping takes.

use avastra_base::kinematics::{CAREFUL_JERK_MPS3, CAREFUL_REACTION_S, braking_m};

use crate::reference::driver::Model;
use crate::reference::encounter::Encounter;
use crate::reference::reflex::Braking;

/// Own comfortable and hard braking, m/s².
const BRAKING_MPS2_MIN: f64 = 4.0;
const BRAKING_MPS2_MAX: f64 = 6.0;
/// Braking that the leader may show, m/s².
const LEADER_MPS2: f64 = 7.0;
/// Distance at rest, m, and margin that is added to the safe distance, m.
const MARGIN_M: f64 = 2.0;
const SAFE_MARGIN_M: f64 = 2.0;

/// The driver: brakes by the surrogates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FuzzySafety;

/// Proactive fuzzy surrogate in `[0, 1]`: what if the leader brakes hard?
fn proactive(gap_m: f64, rear_mps: f64, leader_mps: f64) -> f64 {
    let common_m = rear_mps * CAREFUL_REACTION_S - braking_m(leader_mps, LEADER_MPS2);
    let safe_m = common_m + braking_m(rear_mps, BRAKING_MPS2_MIN) + SAFE_MARGIN_M;
    let unsafe_m = common_m + braking_m(rear_mps, BRAKING_MPS2_MAX);
    between(gap_m - MARGIN_M, safe_m, unsafe_m)
}

/// Critical fuzzy surrogate in `[0, 1]`: what if nothing changes?
fn critical(gap_m: f64, rear_mps: f64, rear_mps2: f64, leader_mps: f64) -> f64 {
    if rear_mps <= leader_mps {
        return 0.0;
    }
    let rear_mps2 = rear_mps2.max(-BRAKING_MPS2_MIN);
    let closing_mps = rear_mps - leader_mps;
    let after_mps = closing_mps + rear_mps2 * CAREFUL_REACTION_S;
    if after_mps < 0.0 {
        // It is slower than the leader before the reaction is over, because it brakes already.
        let closed_m = braking_m(closing_mps, rear_mps2.abs());
        return if gap_m < closed_m { 1.0 } else { 0.0 };
    }
    let reaction_m = (closing_mps + rear_mps2 * CAREFUL_REACTION_S / 2.0) * CAREFUL_REACTION_S;
    between(
        gap_m,
        reaction_m + braking_m(after_mps, BRAKING_MPS2_MIN),
        reaction_m + braking_m(after_mps, BRAKING_MPS2_MAX),
    )
}

/// 0 at the safe distance and beyond, 1 at the unsafe one and below, linear between.
fn between(gap_m: f64, safe_m: f64, unsafe_m: f64) -> f64 {
    if gap_m >= safe_m {
        0.0
    } else if gap_m <= unsafe_m {
        1.0
    } else {
        (gap_m - safe_m) / (unsafe_m - safe_m)
    }
}

impl Model for FuzzySafety {
    fn braking(&self) -> Braking {
        Braking {
            evaluation_s: 0.0,
            reaction_s: CAREFUL_REACTION_S,
            release_mps2: 0.0,
            jerk_mps3: CAREFUL_JERK_MPS3,
            // 0.774 g as published, with g = 9.81 m/s². No demand is above 6 m/s².
            deceleration_mps2_max: 7.593,
        }
    }

    fn demand_mps2(&self, encounter: &Encounter) -> f64 {
        if encounter.is_beside() || !comes_in_time(encounter) {
            return 0.0;
        }
        let stopping_s = CAREFUL_REACTION_S + encounter.own_mps / BRAKING_MPS2_MIN;
        let gap_m = encounter.gap_m - (-encounter.other_mps).max(0.0) * stopping_s;
        let leader_mps = encounter.other_mps.max(0.0);
        let critical = critical(gap_m, encounter.own_mps, encounter.own_mps2, leader_mps);
        if critical > 0.0 {
            critical * (BRAKING_MPS2_MAX - BRAKING_MPS2_MIN) + BRAKING_MPS2_MIN
        } else {
            proactive(gap_m, encounter.own_mps, leader_mps) * BRAKING_MPS2_MIN
        }
    }
}

/// Whether a road user is on the way, or comes onto it before the ego vehicle has passed: the model's
/// lateral gate, with its tolerance of 0.1 s.
fn comes_in_time(encounter: &Encounter) -> bool {
    if encounter.side_gap_m <= 0.0 {
        return true;
    }
    if encounter.towards_mps <= 0.0 {
        return false;
    }
    let across_s = encounter.side_gap_m / encounter.towards_mps;
    let passing_s = if encounter.closing_mps() > 0.0 {
        (encounter.gap_m + encounter.lengths_m) / encounter.closing_mps()
    } else {
        return false;
    };
    across_s <= passing_s + 0.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surrogates_are_one_zero_and_linear_between() {
        let (rear_mps, leader_mps) = (20.0, 15.0);
        // u τ + u²/2b - u_l²/14, the margins added.
        let safe_m = 2.0 + 15.0 + 50.0 - 225.0 / 14.0 + 2.0;
        let unsafe_m = 2.0 + 15.0 + 400.0 / 12.0 - 225.0 / 14.0;
        assert_eq!(proactive(safe_m, rear_mps, leader_mps), 0.0);
        assert_eq!(proactive(unsafe_m, rear_mps, leader_mps), 1.0);
        let middle = proactive((safe_m + unsafe_m) / 2.0, rear_mps, leader_mps);
        assert!((middle - 0.5).abs() < 1e-12);
        // Δv τ + Δv²/2b.
        assert_eq!(critical(3.75 + 25.0 / 8.0, rear_mps, 0.0, leader_mps), 0.0);
        assert_eq!(critical(3.75 + 25.0 / 12.0, rear_mps, 0.0, leader_mps), 1.0);
        assert_eq!(critical(1.0, 15.0, 0.0, 15.0), 0.0);
        // Braking at 4 already: slower than the leader within the reaction, after 2²/8 m.
        assert_eq!(critical(1.2, 17.0, -6.0, 15.0), 0.0);
        assert_eq!(critical(0.4, 17.0, -6.0, 15.0), 1.0);
    }
}
