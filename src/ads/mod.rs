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
mod status;
mod steering;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use driver::Ads;
pub use modular::ConfigError;
pub use modular::Foresight;
pub use modular::Modular;
pub use modular::ModularConfig;
pub use modular::Module;
pub use modular::Weaknesses;
pub use reference::CarefulHuman;
pub use reference::Evasion;
pub use reference::FuzzySafety;
pub use reference::Idm;
pub use reference::MinimalPerformance;
pub use reference::Reference;
pub use reference::Rss;
pub use reference::in_sight;
pub use registry::Entry;
pub use registry::REGISTRY;
pub use registry::by_name;
pub use selected::NoSettings;
pub use selected::Selected;
pub use status::GHOST_ID_MIN;
pub use status::Manoeuvre;
pub use status::PerceivedObject;
pub use status::PlannedPoint;
pub use status::Reason;
pub use status::Status;
