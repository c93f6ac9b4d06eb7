//! Planning: a path and a speed along the route that obey limits and lights and keep clear of road users.
//!
//! Path: the lane, a shift within it past what stands at its edge, the route's lane changes once their
//! gap is safe. Speed: the station-time graph decides about each road user, a speed law drives the decisions, and
//! a last check stands after it. Left out, of Apollo's tasks: the optimisers (a speed law and a quintic shift
//! stand for them), lane borrowing (see `nudge`), pull-over and parking.

mod claim;
mod decisions;
mod kept_clear;
mod lane_change;
mod lights;
mod nudge;
mod planner;
mod rights;
mod sight_bound;
mod speed;
mod st_graph;
mod stages;
mod standing;
mod trajectory;

pub use nudge::LateralPlan;
pub use planner::{Outlook, Planner};

/// Claims and lights that begin farther ahead do not matter yet, m. Apollo's ST graph ends at 100.
const HORIZON_M: f64 = 100.0;
