//! A driving system that plans by sampling in a Frenet frame: Werling, Ziegler, Kammel and Thrun 2010, with the
//! proposals and scores of PDM-Closed (Dauner, Hallgarten, Geiger and Chitta 2023).
//!
//! Ten times a second it samples lateral curves (`lateral`) and speeds (`proposal`), rolls each pair out for 4 s
//! against forecasts of the others (`traffic`), scores what comes out, and drives the best. If the best would
//! collide soon, it brakes as hard as it can.
//!
//! It lacks what the publications lack: it knows no right of way except at lights, stop signs and crosswalks, it
//! relies on the vehicles that follow it or drive beside it to keep clear of it, and it looks no farther ahead than
//! 4 s. Not taken over from the publications are nuPlan's map formats, the simulated tracker (a plan is taken to be
//! driven as planned) and Werling's following and stopping quintics.

mod driver;
mod lateral;
mod polynomial;
mod proposal;
mod traffic;

pub use driver::Frenet;
