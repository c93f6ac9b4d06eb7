//! Findings for other tools ([`export`]), scenarios of other tools ([`import`]), and pages and pictures ([`report`]).
//! It touches no files: texts and recordings in, texts out.
//!
//! ```
//! use std::path::Path;
//!
//! use avastra_drivers::{Selected, by_name};
//! use avastra_exchange::export::{csv, record};
//! use avastra_lang::check::{ReadError, load};
//! use avastra_world::action::ActionTable;
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
//! let loaded = load(Path::new("../../tests/cases/exports/wet_corner.ava"), &read)?;
//! let scenario = loaded.scenario.expect("it has no mistakes");
//! let table = ActionTable::new(loaded.space.expect("so has its space"));
//!
//! // The scenario is played again, and must come out as it claims; what was seen becomes a table.
//! let ads = Selected::new(by_name("modular").expect("it is in the registry"));
//! let recording = record(&table, &scenario, &ads)?;
//! assert_eq!(recording.actors().count(), 2, "the ego vehicle and a hatchback");
//! assert!(csv(&recording).starts_with("time_s,id,body,x_m,y_m"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod export;
pub mod import;
pub mod report;
