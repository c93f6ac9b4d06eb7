//! avastra: a language for what may happen around a self-driving car, and a search for the actions that
//! make the car crash.
//!
//! This crate is the command line. What it is made of stands in the crates that it re-exports, one folder of `src` each;
//! `ARCHITECTURE.md` has the picture.
//!
//! From a text to an episode:
//!
//! ```
//! use std::path::Path;
//!
//! use avastra::action::ActionTable;
//! use avastra::check::{ReadError, load};
//! use avastra::run::{Conditions, Run, RunSettings};
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
//! let loaded = load(Path::new("scenarios/avastra45.ava"), &read)?;
//! let space = loaded.space.expect("it has no mistakes");
//!
//! // One episode of random search at the corner, with seed 1, against the default driving system.
//! let conditions = Conditions { roads: vec!["corner".to_owned()], ..Conditions::of(&space) };
//! let settings = RunSettings::new(conditions, "random", 1, 1);
//! let run = Run::new(ActionTable::new(space), settings)?;
//! let (summary, log) = run.judged(0);
//! assert_eq!(log.road, "corner");
//! assert_eq!(summary.collisions.len(), log.collisions.len());
//! assert_eq!(run.judged(0).1, log, "it is the same whenever it is played");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use avastra_base::{geometry, kinematics, rng, statistics, units};
pub use avastra_campaign::{emit, episode, estimate, files, oracle, run, study, train, trial};
pub use avastra_drivers as ads;
pub use avastra_editor as editor;
pub use avastra_exchange::{export, import, report};
pub use avastra_lang::{check, model, prove, syntax};
pub use avastra_road as road;
pub use avastra_search::{agent, mdp};
pub use avastra_world::{action, places, sim};

pub mod cli;
