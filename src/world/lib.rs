//! The action table, and the world in which its rows are carried out. It knows no driving system.
//!
//! - [`action`]: which rows a moment offers, and which rule refuses the others. No action reaches a world in another way.
//! - [`sim`]: the [`World`](sim::World): ego vehicle, other road users, weather, lights, contacts. It moves by ticks of 20 ms
//!   ([`DT_S`](sim::DT_S)), and its `Clone` is a snapshot.
//! - [`places`]: whether a row finds a place on a road at all; nothing is driven for that.
//!
//! ```
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use avastra_lang::check::{ReadError, load};
//! use avastra_lang::model::RulesInForce;
//! use avastra_world::action::{ActionTable, Situation};
//! use avastra_world::sim::{Control, Scene, Start, World};
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
//! let loaded = load(Path::new("../../scenarios/avastra45.ava"), &read)?;
//! let table = ActionTable::new(loaded.space.expect("it has no mistakes"));
//! let (space, road) = (table.space(), &table.space().roads[0]);
//! let rules = RulesInForce::by_default(space);
//! let memory = space.memory_at_start(road, &rules, 1)?;
//! let mut world = World::new(Arc::new(Scene::of(road)), &Start::drawn(space, road, &memory, 1));
//!
//! // A row is offered, what it does is carried out, and time goes on.
//! let before = world.clone();
//! let situation = Situation { memory: &memory, road, rules: &rules, surroundings: &before, seed: 1, step: 0, happened_s: &[] };
//! let row = table.rows().iter().find(|row| row.label == "fog(how: High)").expect("it is declared");
//! let draw = table.offer(&situation, row.index).expect("no rule is about fog");
//! for effect in &draw.effects {
//!     world.apply(effect)?;
//! }
//! world.tick(&Control::towards(1.0, 0.0));
//! assert_ne!(world.sky(), before.sky());
//! assert_eq!((world.ticks(), before.ticks()), (1, 0), "a clone is a snapshot");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod action;
mod scene;
mod state;
mod view;
mod behave;
mod place;
mod step;
pub mod sim;
pub mod places;
