//! The modular driving system: localisation → perception → prediction → planning → control.
//!
//! Modelled on Apollo 7.0's published structure and constants. Each part has the limits its original
//! is known for; no failure is scripted. Nothing here is a claim about Apollo itself.

mod config;
mod control;
mod localization;
mod perception;
mod planning;
mod prediction;
mod stack;
#[cfg(test)]
mod tests;

pub use config::ConfigError;
pub use config::ModularConfig;
pub use stack::Modular;
