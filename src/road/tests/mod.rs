//! Tests of the whole module on made-up maps and on shipped ones. What was surveyed of the shipped maps is
//! tested by `tests/it/surveys.rs`.

mod abreast;
mod changes;
mod footway;
mod heights;
mod places;
mod poses;
mod reading;
mod scaling;
