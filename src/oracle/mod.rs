//! Judgement: what kind of collision it was, and whether a scenario's claims hold.

mod facts;
mod verify;

pub use facts::counted;
pub use facts::facts;
pub use verify::ClaimResult;
pub use verify::verify;
