//! Driving systems: what drives the ego vehicle. They see `Sensed` and the HD map, never the `World`.
//!
//! `modular` is the system under test; `frenet` and `reactive` are two more of other kinds, `external` is any program
//! outside, `reference` holds drivers to judge by. `kit` is what they share: read it before writing another.

mod driver;
pub mod external;
mod frenet;
mod handover;
mod kit;
mod modular;
mod reactive;
mod reference;
mod registry;
mod selected;
mod settings;
mod status;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use driver::Ads;
pub use frenet::Frenet;
pub use modular::{ConfigError, Foresight, Modular, ModularConfig, Module, Weaknesses};
pub use reactive::Reactive;
pub use reference::{
    Careful, CarefulHuman, Evasion, FuzzySafety, Idm, MinimalPerformance, Reference, Rss, careful, in_sight,
};
pub use registry::{Entry, REGISTRY, by_name};
pub use selected::{EXTERNAL, NoSettings, Selected};
pub use status::{GHOST_ID_MIN, Manoeuvre, PerceivedObject, Reason, Status};
