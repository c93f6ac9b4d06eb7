//! Reference drivers: what to compare a driving system with, and to judge its collisions by.

mod driver;
mod encounter;
mod evasion;
mod giving_way;
mod idm;
mod r157;
mod reflex;
mod rss;
#[cfg(test)]
mod tests;

pub use driver::{Reference, in_sight};
pub use evasion::Evasion;
pub use idm::Idm;
pub(crate) use idm::has_gap;
pub use r157::{CarefulHuman, FuzzySafety, MinimalPerformance};
pub use rss::Rss;
