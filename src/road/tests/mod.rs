//! Tests of the whole module on made-up maps and on shipped ones. `tests/it/surveys.rs` tests the surveyed
//! facts of the shipped maps.

mod abreast;
mod changes;
mod footway;
mod heights;
mod places;
mod poses;
mod reading;
mod scaling;
