//! The modular driving system: localisation → perception → tracking → prediction → planning → control,
//! and emergency braking beside it.
//!
//! Modelled on Apollo 7.0's published structure and constants. Each part has the limits its original
//! is known for; the documented weaknesses are switches, and no failure is scripted.
//! Nothing here is a claim about Apollo itself.

mod config;
mod control;
mod emergency;
mod foresight;
mod junctions;
mod localization;
mod perception;
mod planning;
mod prediction;
mod stack;
#[cfg(test)]
mod tests;
mod tracking;
mod watchdog;

pub use config::{ConfigError, ModularConfig, Module, Weaknesses};
pub use foresight::Foresight;
pub use stack::Modular;
