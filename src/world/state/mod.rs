//! Plain data of a moment: time, what is sensed, the colours of lights, and the digest over it.

pub(crate) mod sensed;
pub(crate) mod signals;
pub(crate) mod time;
pub(crate) mod trace;
