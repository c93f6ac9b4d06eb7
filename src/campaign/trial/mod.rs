//! Trials: does a road user do what its verb says, on every road where its row is legal?
//!
//! [`Trials`] offers every row at moments of undisturbed drives (`survey`) and watches the road users that it makes appear
//! (`sighting`). It judges what they do (`judge`) and whether they appeared fairly (`fairness`). The
//! criteria are written apart from the drivers and rules that they test.

mod fairness;
mod judge;
mod sighting;
mod survey;

pub use survey::{Cell, Outcome, Sample, TrialSettings, Trials};
