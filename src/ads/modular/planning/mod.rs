//! Planning: a path and a speed along the route that obey limits and lights and keep clear of road users.
//!
//! Path: the lane, a shift within it past what stands at its edge, the route's lane changes once their
//! gap is safe. Speed: stop fences, following, giving way. Left out, of Apollo's tasks: lane borrowing
//! (below 5 m/s only), the optimisers (a speed law and a quintic shift stand for them), stop signs
//! (maps have none here), pull-over and parking.

mod corridor;
mod kept_clear;
mod lane_change;
mod lights;
mod nudge;
mod planner;
mod speed;
mod standing;

pub use nudge::LateralPlan;
pub use planner::{Outlook, Planner};
pub use speed::Trajectory;
