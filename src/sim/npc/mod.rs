//! Other drivers: how they follow, change lanes and let others go first.

mod change;
mod driver;
mod foresight;
mod manners;

pub(super) use change::Manoeuvre;
pub(super) use change::Towards;
pub(super) use change::When;
pub(super) use change::can_change;
pub(super) use change::lane_beside;
pub(super) use driver::Cruise;
pub(super) use driver::Driver;
pub(super) use driver::choices;
