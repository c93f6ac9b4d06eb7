//! From text to meaning: reads a file with all that it uses and gives a sound [`Space`](crate::model::Space),
//! [`Scenario`](crate::model::Scenario) or [`Policy`](crate::model::Policy), or diagnostics.
//!
//! [`load`] is the entry. It reads and parses the files, decides which declarations stand (`overriding`), and
//! hands them to the checker. The checker (`checker`, with a file for each kind of declaration) goes on after a
//! mistake, so that one run shows every mistake. A sound space then goes through `prove`.
//! `explain` has a page for each diagnostic code.
//!
//! ```
//! use std::path::Path;
//!
//! use avastra_lang::check::load;
//!
//! let text = "language 1\nenum Time = Noon | Night\nstate time: Time = Nihgt\n";
//! let loaded = load(Path::new("mine.ava"), &|_| Ok(text.to_owned()))?;
//! assert!(loaded.space.is_none());
//! assert!(loaded.diagnostics.iter().any(|mistake| mistake.message.contains("Nihgt")));
//! # Ok::<(), avastra_lang::check::ReadError>(())
//! ```

mod action;
mod body;
mod checker;
mod declaration;
mod difference;
mod expect;
pub mod explain;
mod expression;
mod files;
mod load;
mod manoeuvre;
mod meaning;
mod missing_use;
mod mistakes;
mod names;
mod operator;
mod order;
mod overriding;
pub mod policy;
mod references;
mod road;
mod road_user;
mod requirement;
mod rule;
mod scenario;
mod scenario_claim;
mod scenario_condition;
mod scenario_names;
mod scenario_rules;
mod scenario_value;
mod settings;
mod spawn;
pub mod state_argument;
mod style;
mod trajectory;
mod unused;

pub use checker::{Claim, Runs};
pub use difference::{Change, Difference, differences};
pub use files::{LoadedFile, ReadError, ReadFile, normal};
pub use load::{
    KnownSpaces, Loaded, MapCache, WrittenPath, files_used, load, load_among, load_with, read_files,
    written_paths,
};
pub use missing_use::suggest_uses;
pub use references::{Declaration, Occurrence, References, Symbol};

#[cfg(test)]
mod tests;
