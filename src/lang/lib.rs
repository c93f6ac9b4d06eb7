//! The language: a text becomes a checked space, scenario or policy, or diagnostics that say where and what to do.
//!
//! Four steps: [`syntax`] parses a text and goes on after mistakes. [`check`] loads all files that it uses, resolves names
//! and checks types. [`model`] describes the result. [`prove`] says what holds of it for every draw. This crate reads no
//! files: its caller hands texts over.
//!
//! ```
//! use std::path::Path;
//!
//! use avastra_lang::check::{ReadError, load};
//!
//! let text = "language 1\nlet far = wide + 1 m\n";
//! let read = |_: &Path| Ok::<_, ReadError>(text.to_owned());
//! let loaded = load(Path::new("space.ava"), &read).expect("it is readable");
//! assert_eq!(loaded.diagnostics[0].code, "AV0101", "`wide` is unknown");
//! assert!(loaded.space.is_none());
//! ```

pub mod syntax;
pub mod model;
pub mod prove;
pub mod check;
