//! Trials: does a road user do what its verb says, on every road where its row is legal?

mod fairness;
mod judge;
mod survey;
mod witness;

pub use survey::{Cell, Count, Outcome, Sample, TrialSettings, Trials};
