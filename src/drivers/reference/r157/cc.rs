//! The competent and careful human driver: performance model 1 of UN R157, after JAMA.
//!
//! UN R157, Annex 4, Appendix 3 (Annex 3 from Supplement 1 on). A vehicle that leaves the middle of its
//! lane by more than drivers wander (0.375 m) is evaluated for 0.4 s; 0.75 s later the foot is on the
//! brake, which reaches 0.774 g within 0.6 s (jerk 12.65 m/s³); meanwhile the released accelerator
//! gives 0.4 m/s² (esmini and JRC-FSM; the regulation's table has none). It is critical at a time to
//! collision of at most 2 s, and a vehicle ahead that brakes hard, or that a cut-out has uncovered, at a
//! time headway below 2 s.
//!
//! The model knows vehicles of the ego vehicle's direction only. Beyond it, a road user that will be on
//! the way when the ego vehicle comes there is critical at 2 s, too, from whatever side it comes. Left out
//! is the automatic emergency brake (0.85 g within 0.6 s) that the table adds once the two overlap in full.

use avastra_base::kinematics::{
    CAREFUL_BRAKING_MPS2, CAREFUL_JERK_MPS3, CAREFUL_PERCEPTION_S, CAREFUL_REACTION_S, CAREFUL_RELEASE_MPS2,
    WANDER_M,
};

use crate::reference::driver::Model;
use crate::reference::encounter::Encounter;
use crate::reference::reflex::Braking;

/// Critical time to collision and critical time headway, s.
const CRITICAL_S: f64 = 2.0;
/// A deceleration of the vehicle ahead beyond this is seen as hard braking, m/s² (esmini).
const LEADER_MPS2: f64 = 5.0;

/// The driver: notices a cut-in when it has left its course by more than drivers wander, and has been evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CarefulHuman;

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
        let closing_in = in_the_way && encounter.time_to_collision_s() <= CRITICAL_S;
        let braking_ahead = in_the_way
            && encounter.other_mps2 <= -LEADER_MPS2
            && encounter.headway_s() < CRITICAL_S
            && encounter.closing_mps() > 0.0;
        let is_noticed = encounter.crosses || encounter.aside_m > WANDER_M;
        let will_meet = is_noticed && encounter.meeting_s.is_some_and(|time_s| time_s <= CRITICAL_S);
        if closing_in || braking_ahead || will_meet { CAREFUL_BRAKING_MPS2 } else { 0.0 }
    }
}
