//! `avastra lsp`: the language in an editor, by the Language Server Protocol 3.17 over stdin and
//! stdout.
//!
//! `serve` is the process: a thread reads, and what is waiting is looked at before anything is done,
//! so that a request can be cancelled and a burst of keystrokes is checked once. `Server` is the rest,
//! without input and output. What an editor asks for has a file each; `names` knows what every name
//! stands for, from trees that may be incomplete.

mod complete;
mod context;
mod declared;
mod diagnostics;
pub mod editor_files;
mod highlight;
mod hints;
mod hover;
mod names;
mod outline;
mod position;
mod rename;
mod serve;
mod server;
mod tokens;
mod transport;
mod uri;
mod walk;
mod words;
mod workspace;

pub use serve::serve;
pub use server::Server;
