//! How much room a newcomer leaves to a careful and competent driver.
//!
//! The driver of UN R157 (Annex 4, Appendix 3) perceives the risk for 0.4 s and reacts after 0.75 s more. It brakes
//! with a jerk of 12.65 m/s³ up to 0.774 g, or what the road gives. With Δv the speed to be lost against the other, the
//! gap closes by
//!
//! Δv (0.4 + 0.75) + way while the brake builds up + (Δv left)² / 2a.
//!
//! The deceleration of 0.4 m/s² by the released accelerator is left out. esmini's and the JRC's versions of the driver
//! have it before the brake; the regulation's table has none. The regulation knows only leaders; [`oncoming_m`] and
//! [`from_behind_m`] are ours.

use avastra_base::kinematics::{
    CAREFUL_BRAKING_MPS2 as BRAKING_MPS2, CAREFUL_DELAY_S as DELAY_S, CAREFUL_JERK_MPS3 as JERK_MPS3,
    CAREFUL_REACTION_S as REACTION_S, GRAVITY_MPS2, braking_m, stopping_m,
};

/// Gap that closes until a careful driver is no faster than a road user ahead, m; 0 if the gap opens.
///
/// `ahead_mps` is the speed of the road user ahead along the heading of the driver. Crossing and oncoming
/// road users count as 0: the driver brakes to rest.
pub fn behind_leader_m(own_mps: f64, ahead_mps: f64, friction: f64) -> f64 {
    let closing_mps = (own_mps - ahead_mps.max(0.0)).max(0.0);
    let braking_mps2 = BRAKING_MPS2.min(friction * GRAVITY_MPS2);
    let build_up_s = braking_mps2 / JERK_MPS3;
    let lost_mps = JERK_MPS3 * build_up_s * build_up_s / 2.0;
    let reaction_m = closing_mps * DELAY_S;
    if closing_mps <= lost_mps {
        // Slowed down before the brake is at its full force.
        let braked_s = (2.0 * closing_mps / JERK_MPS3).sqrt();
        return reaction_m + closing_mps * braked_s * (2.0 / 3.0);
    }
    let build_up_m = closing_mps * build_up_s - JERK_MPS3 * build_up_s * build_up_s * build_up_s / 6.0;
    let left_mps = closing_mps - lost_mps;
    reaction_m + build_up_m + braking_m(left_mps, braking_mps2)
}

/// Gap that closes until a careful driver is at rest, while an oncoming vehicle keeps its speed
/// `towards_mps`, m.
pub fn oncoming_m(own_mps: f64, towards_mps: f64, friction: f64) -> f64 {
    let braking_mps2 = BRAKING_MPS2.min(friction * GRAVITY_MPS2);
    let build_up_s = braking_mps2 / JERK_MPS3;
    let lost_mps = JERK_MPS3 * build_up_s * build_up_s / 2.0;
    let braking_s = if own_mps > lost_mps {
        build_up_s + (own_mps - lost_mps) / braking_mps2
    } else {
        (2.0 * own_mps.max(0.0) / JERK_MPS3).sqrt()
    };
    let stopping_s = DELAY_S + braking_s;
    behind_leader_m(own_mps, 0.0, friction) + towards_mps.max(0.0) * stopping_s
}

/// Way that a driver goes while perceiving and reacting to what appears, m.
pub fn noticing_m(own_mps: f64) -> f64 {
    own_mps.max(0.0) * DELAY_S
}

/// Gap that a vehicle from behind needs to slow down to the ego vehicle, m; 0 if it is no faster. Its
/// driver chose to come near, so no time goes into perceiving.
pub fn from_behind_m(behind_mps: f64, ego_mps: f64, braking_mps2: f64) -> f64 {
    let closing_mps = (behind_mps - ego_mps).max(0.0);
    stopping_m(closing_mps, REACTION_S, braking_mps2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_the_published_distances() {
        for (speed_kmph, distance_m) in
            [(10.0, 4.4), (20.0, 10.0), (30.0, 16.5), (40.0, 24.1), (50.0, 32.7), (60.0, 42.4)]
        {
            let found_m = behind_leader_m(speed_kmph / 3.6, 0.0, 0.85);
            assert!((found_m - distance_m).abs() < 0.06, "{speed_kmph} km/h: {found_m}");
        }
    }

    #[test]
    fn a_gap_that_opens_needs_no_room() {
        assert_eq!(behind_leader_m(10.0, 12.0, 0.85), 0.0);
        assert_eq!(from_behind_m(10.0, 12.0, 8.0), 0.0);
        assert!(behind_leader_m(15.0, 0.0, 0.52) > behind_leader_m(15.0, 0.0, 0.85));
        assert!((from_behind_m(20.0, 10.0, 8.0) - 13.75).abs() < 1e-9);
    }

    #[test]
    fn an_oncoming_one_needs_room_for_both() {
        // At rest the driver still perceives and reacts, and the other comes on meanwhile.
        assert!((oncoming_m(0.0, 10.0, 0.85) - 11.5).abs() < 1e-9);
        // 32.7 m of the ego vehicle's way, and 1.15 + 0.6 + 1.53 s of the other's.
        assert!((oncoming_m(50.0 / 3.6, 10.0, 0.85) - (32.7 + 32.8)).abs() < 0.2);
    }
}
