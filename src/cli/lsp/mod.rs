//! `avastra lsp`: the language in an editor, by the Language Server Protocol 3.17 over stdin and
//! stdout.
//!
//! `serve` is the process: a thread reads messages into a queue. All that have arrived are looked at before
//! one is answered, so that a request can be cancelled and a burst of keystrokes is checked once. `Server`
//! is the rest, without input and output, and each kind of request has a file. The server asks the checker
//! (`check::References`) what a name stands for and resolves none itself.

mod complete;
mod context;
mod diagnostics;
pub mod editor_files;
mod highlight;
mod hints;
mod hover;
mod outline;
mod position;
mod rename;
mod serve;
mod server;
mod signature;
mod structure;
mod tokens;
mod transport;
mod uri;
mod words;
mod workspace;

pub use serve::serve;
pub use server::Server;
