//! Driving systems: what drives the ego vehicle. They see `Sensed` and the HD map, never the `World`.
//!
//! `modular` is the system under test, `reference` holds drivers to compare it with; `guide` and
//! `steering` serve both.

mod driver;
mod guide;
mod handover;
mod modular;
mod reference;
mod registry;
mod selected;
mod settings;
mod status;
mod steering;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use driver::Ads;
pub use modular::{ConfigError, Foresight, Modular, ModularConfig, Module, Weaknesses};
pub use reference::{CarefulHuman, Evasion, FuzzySafety, Idm, MinimalPerformance, Reference, Rss, in_sight};
pub use registry::{Entry, REGISTRY, by_name};
pub use selected::{NoSettings, Selected};
pub use status::{GHOST_ID_MIN, Manoeuvre, PerceivedObject, PlannedPoint, Reason, Status};
