//! Driving systems outside this program: any program that speaks avastra-ads/1 (docs/reference/protocol.md) over pipes or a socket.
//!
//! `message` has the messages and `question` fills those that are asked; `link` moves lines, `session` speaks with one
//! process, `program` keeps the processes and the known answers, and `driver` is one episode. An error of a driving
//! system is a `finding`, never a collision and never an error of the run.

mod driver;
mod finding;
mod follow;
mod link;
pub mod message;
mod sequences;
mod program;
mod question;
mod record;
mod schema;
mod session;
mod settings;
mod thinking;
mod words;

pub use driver::External;
pub use finding::{Failure, FailureKind, Problem};
pub use link::end_all;
pub use message::{AnswerKind, Observation, PROTOCOL, schemas};
pub use program::Program;
pub use record::{
    Attached, Conversation, EVIDENCE, Key, Outcome, RecordError, Told, Transcript, digest_of, from_text,
    to_text,
};
pub use sequences::odd_orders;
pub use session::Identity;
pub use settings::{ExternalError, ExternalSettings, OnTimeout, Target, Timeouts};
pub use thinking::Thinking;
