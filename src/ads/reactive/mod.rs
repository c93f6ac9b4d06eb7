//! A purely reactive driving system, as sold driver assistance put together: the Stanley steering law, adaptive
//! cruise control, automatic emergency braking and a lane change assistant, each to its published description.
//!
//! It predicts nothing: it reacts to what is in the corridor of its lane, or enters it within a second. It gives
//! way to no one who crosses, and knows no crosswalk. Crossings are where it is expected to crash; that is a
//! finding about such systems and no planted fault.

mod assistance;
mod driver;
mod stanley;
#[cfg(test)]
mod tests;

pub use driver::Reactive;
