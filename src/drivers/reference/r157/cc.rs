//! The competent and careful human driver: performance model 1 of UN R157, after JAMA.
//!
//! UN R157, Annex 4, Appendix 3 (Annex 3 from Supplement 1 on). A vehicle that leaves the middle of its lane
//! by more than drivers wander (0.375 m) is evaluated for 0.4 s. 0.75 s later the foot is on the brake, which
//! reaches 0.774 g within 0.6 s (jerk 12.65 m/s³). Meanwhile the released accelerator gives 0.4 m/s² (esmini
//! and JRC-FSM; the regulation's table has none). A vehicle is critical at a time to collision of at most 2 s, and a
//! vehicle ahead that brakes hard, or that a cut-out has uncovered, at a time headway below 2 s.
//!
//! The model knows vehicles of the ego vehicle's direction only. Beyond it, a road user that will be on
//! the way when the ego vehicle comes there is critical at 2 s, too, from whatever side it comes. Left out
//! is the automatic emergency brake (0.85 g within 0.6 s) that the table adds once the two overlap in full.

use avastra_base::kinematics::{
    CAREFUL_BRAKING_MPS2, CAREFUL_JERK_MPS3, CAREFUL_PERCEPTION_S, CAREFUL_REACTION_S, CAREFUL_RELEASE_MPS2,
    WANDER_M, braking_m, needed_mps2,
};

use crate::reference::driver::{COMFORTABLE_MPS2, Model};
use crate::reference::encounter::Encounter;
use crate::reference::reflex::Braking;

/// Critical time to collision and critical time headway, s.
const CRITICAL_S: f64 = 2.0;
/// A deceleration of the vehicle ahead beyond this is seen as hard braking, m/s² (esmini).
const LEADER_MPS2: f64 = 5.0;

/// The driver: notices a cut-in when it has left its course by more than drivers wander, and has been evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CarefulHuman {
    /// Whether it also brakes as soon as the gap would take more than comfortable braking. Above 43 km/h of closing speed
    /// that is before the regulation's 2 s, which are then too late. Ours, for motorways.
    pub looks_far: bool,
}

impl Model for CarefulHuman {
    fn braking(&self) -> Braking {
        Braking {
            evaluation_s: CAREFUL_PERCEPTION_S,
            reaction_s: CAREFUL_REACTION_S,
            release_mps2: CAREFUL_RELEASE_MPS2,
            jerk_mps3: CAREFUL_JERK_MPS3,
            deceleration_mps2_max: CAREFUL_BRAKING_MPS2,
        }
    }

    fn demand_mps2(&self, encounter: &Encounter) -> f64 {
        let in_the_way = encounter.side_gap_m <= 0.0 && !encounter.is_beside();
        let is_near = encounter.time_to_collision_s() <= CRITICAL_S
            || self.looks_far && takes_mps2(encounter) > COMFORTABLE_MPS2;
        let closing_in = in_the_way && is_near;
        let braking_ahead = in_the_way
            && encounter.other_mps2 <= -LEADER_MPS2
            && encounter.headway_s() < CRITICAL_S
            && encounter.closing_mps() > 0.0;
        let is_noticed = encounter.crosses || encounter.aside_m > WANDER_M;
        let horizon_s =
            if self.looks_far { CRITICAL_S.max(takes_s(encounter.closing_mps())) } else { CRITICAL_S };
        let will_meet = is_noticed && encounter.meeting_s.is_some_and(|time_s| time_s <= horizon_s);
        if closing_in || braking_ahead || will_meet { CAREFUL_BRAKING_MPS2 } else { 0.0 }
    }
}

/// The steady braking that avoids a vehicle ahead, if that one goes on as it does: it brakes to a stop, or keeps its speed,
/// m/s².
fn takes_mps2(encounter: &Encounter) -> f64 {
    let gap_m = encounter.gap_m.max(0.1);
    let closing = needed_mps2(encounter.closing_mps().max(0.0), gap_m);
    if encounter.other_mps2 >= 0.0 {
        return closing;
    }
    let stops_after_m = braking_m(encounter.other_mps.max(0.0), -encounter.other_mps2);
    closing.max(needed_mps2(encounter.own_mps, gap_m + stops_after_m))
}

/// How long before a meeting the driver must notice it, to lose the closing speed until then, s.
fn takes_s(closing_mps: f64) -> f64 {
    let builds_up_s = CAREFUL_BRAKING_MPS2 / CAREFUL_JERK_MPS3 / 2.0;
    let braking_s = closing_mps.max(0.0) / (2.0 * CAREFUL_BRAKING_MPS2);
    CAREFUL_PERCEPTION_S + CAREFUL_REACTION_S + builds_up_s + braking_s
}
