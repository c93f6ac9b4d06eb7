//! Planning: a speed along the route that obeys limits, lights and everybody on the way.
//!
//! The path is the route itself: no lane changes, no evasion to the side (Apollo borrows a lane only
//! below 5 m/s).

mod corridor;
mod lights;
mod planner;
mod speed;

pub use planner::Planner;
pub use speed::Trajectory;
