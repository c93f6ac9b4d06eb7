//! Tests of the whole module: the authored map against its survey, and reading made-up files.

mod boulevard;
mod corner;
mod reading;
mod residential;
mod survey;
