//! avastra: a language for what may happen around a self-driving car, and a search for the actions that
//! make the car crash.
//!
//! The modules stand in reading order, and each may use only those above it; `tests/it/layers.rs`
//! keeps it so. `ARCHITECTURE.md` has the picture.
//!
//! From a text to an episode:
//!
//! ```
//! use std::path::Path;
//!
//! use avastra::action::ActionTable;
//! use avastra::check::{ReadError, load};
//! use avastra::run::{Run, RunSettings};
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError(error.to_string()));
//! let loaded = load(Path::new("scenarios/avastra45.ava"), &read)?;
//! let space = loaded.space.expect("it has no mistakes");
//!
//! // One episode of random search at the corner, with seed 1, against the default driving system.
//! let settings = RunSettings { roads: vec!["corner".to_owned()], ..RunSettings::new(&space, "random", 1, 1) };
//! let run = Run::new(ActionTable::new(space), settings)?;
//! let (summary, log) = run.judged(0);
//! assert_eq!(log.road, "corner");
//! assert_eq!(summary.collisions.len(), log.collisions.len());
//! assert_eq!(run.judged(0).1, log, "it is the same whenever it is played");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod units;
pub mod rng;
pub mod statistics;
pub mod geometry;
pub mod kinematics;
pub mod road;
pub mod syntax;
pub mod model;
pub mod prove;
pub mod check;
pub mod action;
pub mod sim;
pub mod ads;
pub mod mdp;
pub mod agent;
pub mod episode;
pub mod oracle;
pub mod files;
pub mod run;
pub mod estimate;
pub mod train;
pub mod trial;
pub mod study;
pub mod emit;
pub mod export;
pub mod import;
pub mod report;
pub mod editor;
pub mod cli;
