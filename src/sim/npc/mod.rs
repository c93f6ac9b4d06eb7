//! Other drivers: how they follow, change lanes and let others go first.

mod driver;
mod foresight;
mod manners;

pub(super) use driver::Cruise;
pub(super) use driver::Driver;
pub(super) use driver::Manoeuvre;
pub(super) use driver::Towards;
pub(super) use driver::When;
pub(super) use driver::can_change;
pub(super) use driver::choices;
pub(super) use driver::lane_beside;
