//! Reference drivers: what to compare a driving system with, and to judge its collisions by.

mod cc;
mod driver;
mod encounter;
mod evasion;
mod fsm;
mod idm;
mod model;
mod r157;
mod reflex;
mod rss;
#[cfg(test)]
mod tests;

pub use cc::CarefulHuman;
pub use driver::{Reference, in_sight};
pub use evasion::Evasion;
pub use fsm::FuzzySafety;
pub use idm::Idm;
pub use r157::MinimalPerformance;
pub use rss::Rss;
