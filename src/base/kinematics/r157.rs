//! Figures of UN R157 (automated lane keeping): its careful driver, and the cut-in that a system must avoid.
//!
//! The models built on them are `ads::reference`'s. The figures of the regulation's fuzzy model stand there, too.

use super::GRAVITY_MPS2;

/// Hardest braking of the careful driver, m/s² (Annex 4, Appendix 3: 0.774 g).
pub const CAREFUL_BRAKING_MPS2: f64 = 0.774 * GRAVITY_MPS2;

/// How fast its braking builds up, m/s³ (Annex 4, Appendix 3: 0.774 g within 0.6 s).
pub const CAREFUL_JERK_MPS3: f64 = 12.65;

/// Time in which it perceives a risk, s (Annex 4, Appendix 3).
pub const CAREFUL_PERCEPTION_S: f64 = 0.4;

/// Time from the perception until it brakes, s (Annex 4, Appendix 3).
pub const CAREFUL_REACTION_S: f64 = 0.75;

/// Time from a risk until it brakes, s.
pub const CAREFUL_DELAY_S: f64 = CAREFUL_PERCEPTION_S + CAREFUL_REACTION_S;

/// Deceleration by the released accelerator meanwhile, m/s² (esmini and JRC-FSM; the regulation's table has none).
pub const CAREFUL_RELEASE_MPS2: f64 = 0.4;

/// A vehicle within this distance of its course merely wanders, m (Annex 4, Appendix 3).
pub const WANDER_M: f64 = 0.375;

/// Braking with which a system must avoid a cut-in, m/s² (5.2.5.2).
pub const CUT_IN_BRAKING_MPS2: f64 = 6.0;

/// Time until that braking begins, s (5.2.5.2).
pub const CUT_IN_RESPONSE_S: f64 = 0.35;
