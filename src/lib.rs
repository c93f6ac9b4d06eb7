//! avastra: a language for what may happen around a self-driving car, and a search for the actions that
//! make the car crash.
//!
//! The modules stand in reading order, and each may use only those above it; `tests/it/layers.rs`
//! keeps it so. `ARCHITECTURE.md` has the picture.

pub mod units;
pub mod rng;
pub mod statistics;
pub mod geometry;
pub mod road;
pub mod syntax;
pub mod model;
pub mod prove;
pub mod check;
pub mod action;
pub mod sim;
pub mod ads;
pub mod mdp;
pub mod agent;
pub mod episode;
pub mod oracle;
pub mod run;
pub mod estimate;
pub mod train;
pub mod trial;
pub mod study;
pub mod emit;
pub mod export;
pub mod report;
pub mod cli;
