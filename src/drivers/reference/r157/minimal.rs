//! The least that UN R157 demands of a lane-keeping system when a vehicle cuts in.
//!
//! UN R157, 5.2.5.2: a cut-in that is 0.3 m into the lane must be avoided if its time to collision is
//! above Δv / (2 · 6 m/s²) + 0.35 s. So the least that complies brakes at 6 m/s², 0.35 s after that
//! bound is reached; one look of 0.1 s is added to the bound, as in the JRC's implementation (JRC-FSM).
//!
//! The text speaks of cut-ins. Beyond it, the bound holds here for a vehicle that is ahead already, and
//! for road users that cross or come towards, as soon as their way leads into the ego vehicle's.

use avastra_base::kinematics::{CUT_IN_BRAKING_MPS2, CUT_IN_RESPONSE_S};
use avastra_world::sim::FRAME_S;

use crate::reference::driver::Model;
use crate::reference::encounter::Encounter;
use crate::reference::reflex::Braking;

/// Side gap of two cars of 1.9 m at which one is 0.3 m into the other's lane of 3.5 m, m: the reading of
/// JRC-FSM.
const INTRUSION_SIDE_GAP_M: f64 = 0.5;

/// The regulation's minimal performance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MinimalPerformance;

/// Time to collision from which a cut-in can be avoided, s.
pub fn avoidable_from_s(closing_mps: f64) -> f64 {
    closing_mps.max(0.0) / (2.0 * CUT_IN_BRAKING_MPS2) + CUT_IN_RESPONSE_S
}

impl Model for MinimalPerformance {
    fn braking(&self) -> Braking {
        Braking {
            evaluation_s: 0.0,
            reaction_s: CUT_IN_RESPONSE_S,
            release_mps2: 0.0,
            jerk_mps3: f64::INFINITY,
            deceleration_mps2_max: CUT_IN_BRAKING_MPS2,
        }
    }

    fn demand_mps2(&self, encounter: &Encounter) -> f64 {
        let bound_s = avoidable_from_s(encounter.closing_mps()) + FRAME_S;
        let intrudes = encounter.side_gap_m <= INTRUSION_SIDE_GAP_M && !encounter.is_beside();
        let cuts_in = intrudes && encounter.time_to_collision_s() <= bound_s;
        let from_aside = encounter.crosses || encounter.other_mps < 0.0;
        let crosses = from_aside && encounter.meeting_s.is_some_and(|time_s| time_s <= bound_s);
        if cuts_in || crosses { CUT_IN_BRAKING_MPS2 } else { 0.0 }
    }
}
