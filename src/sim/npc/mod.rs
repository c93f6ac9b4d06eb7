//! Other drivers: how they follow, change lanes and let others go first.

mod change;
mod driver;
mod foresight;
mod manners;

pub(super) use change::{Manoeuvre, Towards, When, can_change, lane_beside};
pub(super) use driver::{Cruise, Driver, choices};
