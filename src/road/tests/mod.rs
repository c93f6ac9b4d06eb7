//! Tests of the whole module: the authored map against its survey, and reading made-up files.

mod abreast;
mod boulevard;
mod changes;
mod corner;
mod crossroad;
mod reading;
mod residential;
mod survey;
