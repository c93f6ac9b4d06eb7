//! A purely reactive driving system, as sold driver assistance put together: the Stanley steering law, adaptive
//! cruise control, automatic emergency braking and a lane change assistant, each to its published description.
//!
//! It predicts nothing: it reacts to road users in the corridor of its lane, and to those that enter it within a
//! second. It stops at lights and stop signs, but gives way to no crossing road user and knows no crosswalk.
//! Crossings are where it is expected to crash; that is a finding about such systems and no planted fault.

mod assistance;
mod driver;
mod stanley;

pub use driver::Reactive;
