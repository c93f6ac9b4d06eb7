//! Reference drivers: what to compare a driving system with, and to judge its collisions by.

use std::sync::Arc;

use avastra_world::sim::Scene;

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

pub use driver::{Careful, Reference, in_sight};
pub use evasion::Evasion;
pub use idm::Idm;
pub use r157::{CarefulHuman, FuzzySafety, MinimalPerformance};
pub use rss::Rss;

/// The reference driver of that name, if it follows a published model; its names are those of the registry.
pub fn careful(name: &str, scene: &Arc<Scene>) -> Option<Box<dyn Careful>> {
    match name {
        "cc" => Some(Box::new(Reference::new(scene, CarefulHuman))),
        "fsm" => Some(Box::new(Reference::new(scene, FuzzySafety))),
        "rss" => Some(Box::new(Reference::new(scene, Rss::default()))),
        "r157" => Some(Box::new(Reference::new(scene, MinimalPerformance))),
        _ => None,
    }
}
