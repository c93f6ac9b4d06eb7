//! A run: many episodes of one space over seeds and roads, judged, counted and kept.
//!
//! [`Run`] and [`play`] are the loop over episodes, on any number of threads. [`Arena`] is what its episodes
//! share: space, roads, driving system, rules in force. [`Database`] keeps them in `run.db`, and
//! [`EpisodeSummary`] says what one of them amounts to.

mod arena;
mod database;
mod groups;
mod play;
mod profile;
mod shape;
mod summary;
mod gauges;

pub use arena::Arena;
pub(crate) use arena::{carry_out, choose, legal, offers};
pub(crate) use database::add_all;
pub use database::{Database, DatabaseError, RefusalCount, Totals};
pub use gauges::Gauges;
pub use groups::Group;
pub(crate) use groups::kind;
pub(crate) use play::check_episodes;
pub use play::{EPISODES_MAX, PolicyReference, Run, RunError, RunSettings, Stage, play};
pub(crate) use profile::under_test;
pub use profile::{DEFAULT_ADS, Profile, driving_system, recorded, trained_against};
pub use shape::Shape;
pub use summary::{EpisodeSummary, Finding};
