//! The time, of which only what is told and what stands beside results knows.

use std::time::Instant;

/// The time now.
#[allow(
    clippy::disallowed_methods,
    reason = "this is cli, and the time is only told or stands beside results"
)]
pub fn now() -> Instant {
    Instant::now()
}
