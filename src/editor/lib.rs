//! Answers an editor's questions about a document, with pure functions and plain types.
//!
//! A [`Workspace`] holds the open texts and gives an [`Analysis`] of each. An analysis has the tree of `syntax::parse`,
//! which recovers from mistakes, and the checker's facts about every name (`check::References`). Most questions are a
//! function of an analysis and a byte; questions that reach into other files take the workspace. No name is resolved
//! here. Places are lines and UTF-16 columns, as all editors count.
//!
//! Nothing here reads a file, knows a protocol, or has a clock. The caller reads files for this crate ([`Files`]), and
//! `cli/lsp` translates questions and answers to the Language Server Protocol.
//!
//! ```
//! use std::path::{Path, PathBuf};
//!
//! use avastra_lang::check::ReadError;
//! use avastra_editor::{Files, Workspace, hover};
//!
//! /// An editor whose one document uses no other file.
//! struct Alone;
//!
//! impl Files for Alone {
//!     fn read(&self, _: &Path) -> Result<String, ReadError> {
//!         Err(ReadError::missing("no such file"))
//!     }
//!     fn below(&self, _: &Path) -> Vec<PathBuf> {
//!         Vec::new()
//!     }
//!     fn nearby(&self, _: &Path) -> Vec<(String, String)> {
//!         Vec::new()
//!     }
//!     fn entries(&self, _: &Path) -> Vec<(String, bool)> {
//!         Vec::new()
//!     }
//! }
//!
//! let path = Path::new("far.ava");
//! let text = "language 1\nlet far = 50 m\nlet twice = far * 2\n";
//! let mut workspace = Workspace::new(Alone);
//! workspace.open(path.to_owned(), text.to_owned());
//! let analysis = workspace.analysis(path).expect("it is open");
//! let found = hover::hover(analysis, text.rfind("far").expect("it stands there")).expect("it is a name");
//! assert!(found.text.contains("let far = 50 m"));
//! ```

pub mod complete;
mod context;
pub mod diagnostics;
pub mod formatting;
pub mod highlight;
pub mod hints;
pub mod hover;
pub mod navigate;
pub mod outline;
mod position;
pub mod rename;
pub mod signature;
pub mod structure;
#[cfg(test)]
mod tests;
mod tokens;
pub mod words;
mod workspace;

pub use position::{Place, Point, Range};
pub use workspace::{Analysis, Files, Workspace};
