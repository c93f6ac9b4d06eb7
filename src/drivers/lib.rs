//! Driving systems: what drives the ego vehicle. They see `Sensed` and the HD map, never the `World`.
//!
//! `modular` is the system under test; `frenet` and `reactive` are two more of other kinds, `external` is any program
//! outside, `reference` holds drivers to judge by. `kit` is what they share: read it before writing another, which is then
//! one line in [`REGISTRY`].
//!
//! ```
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use avastra_drivers::by_name;
//! use avastra_lang::check::{ReadError, load};
//! use avastra_lang::model::RulesInForce;
//! use avastra_world::sim::{Scene, Start, World};
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
//! let space = load(Path::new("../../scenarios/avastra45.ava"), &read)?.space.expect("it has no mistakes");
//! let road = space.roads.iter().find(|road| road.name == "corner").expect("it is declared");
//! let memory = space.memory_at_start(road, &RulesInForce::by_default(&space), 1)?;
//! let scene = Arc::new(Scene::of(road));
//! let mut world = World::new(scene.clone(), &Start::drawn(&space, road, &memory, 1));
//!
//! // Each tick the driver is told what is sensed, and answers with pedals and wheel.
//! let mut driver = (by_name("idm").expect("it is in the registry").build)(&scene, 1);
//! let mut sensed = world.sensed();
//! while !world.arrived() && world.time_s() < 240.0 {
//!     world.sense(&mut sensed);
//!     assert!(world.tick(&driver.drive(&sensed)).is_empty(), "nobody is there to be hit");
//! }
//! assert!(world.arrived());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod altered;
mod blind;
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
mod status;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use altered::Alteration;
pub use driver::Ads;
pub use frenet::Frenet;
pub use modular::{ConfigError, Foresight, Modular, ModularConfig, Module, Weaknesses};
pub use reactive::Reactive;
pub use reference::{CarefulHuman, Evasion, FuzzySafety, Idm, MinimalPerformance, Reference, Rss, in_sight};
pub use registry::{Entry, REGISTRY, by_name, seeing};
pub use selected::{EXTERNAL, NoSettings, Selected};
pub use status::{GHOST_ID_MIN, Manoeuvre, PerceivedObject, Reason, Restraint, Status};
