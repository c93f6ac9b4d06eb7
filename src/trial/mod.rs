//! Trials: does a road user do what its verb says, on every road where its row is legal?

mod fairness;
mod judge;
mod sighting;
mod survey;

pub use survey::{Cell, Count, Outcome, Sample, TrialSettings, Trials};
