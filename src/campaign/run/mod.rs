//! A run: many episodes of one space over seeds and roads, judged, counted and kept.
//!
//! [`Run`] is made from [`RunSettings`] and knows how to set up, play and judge its nth episode. [`play`] does so for
//! many, on threads. Its episodes share an [`Arena`]: space, roads, driving system, rules in force. Each gives an
//! [`EpisodeSummary`]: its collisions with their verdicts. [`Database`] keeps the summaries in `run.db` and reads them back
//! as totals and as groups of similar failures. [`Stage`] plays one emitted scenario again. [`Stepped`] is an episode that
//! another program steps through.

mod arena;
mod columns;
mod coverage;
mod database;
mod findings;
mod gauges;
mod groups;
mod left;
mod offered;
mod play;
mod profile;
mod protocol;
mod sealed;
mod settings;
mod settled;
mod shard;
mod stage;
mod stepped;
mod summary;
mod threads;
pub mod triage;

pub use arena::{Arena, choose, road_named};
pub(crate) use arena::{Offers, legal};
pub use columns::{Column, Values, columns};
pub use coverage::{CoverageCell, LearningPoint};
pub use database::{Database, FailureCount, RefusalCount, RequirementCount, Totals};
pub(crate) use database::{LAYOUT, add_all};
pub use findings::{FoundIn, Near, scenario_name};
pub use gauges::Gauges;
pub(crate) use groups::PEDESTRIAN;
pub use groups::{Group, cause_text, kind};
pub(crate) use left::kind_name;
pub use left::{Left, NextHour, SeenKind};
pub use offered::in_words as refusal_in_words;
pub use offered::{Offered, RowCount};
pub use play::{Run, play};
pub use profile::{
    Asked, DEFAULT_ADS, Profile, TrafficRecord, driving_system, found_with, recorded, recorded_traffic,
    started, trained_against, trained_in,
};
pub use protocol::{Ending, HeatMap, ProtocolTest, Tally, heat_maps, main_maps, parameters};
pub use sealed::differences as settings_differences;
pub use sealed::{DatabaseError, Layout};
pub(crate) use sealed::{insert_row, of_columns, query_all, settings_digest};
pub use settings::{Budget, Conditions, EPISODES_MAX, PolicyReference, RunError, RunSettings, VERSION, flat};
pub(crate) use settings::{agent_named, check_episodes};
pub use settled::{Numbered, Units, WrittenScenario};
pub use shard::{SHARDS_MAX, Shard};
pub use stage::Stage;
pub use stepped::{Chosen, Measures, StepError, Stepped};
pub use summary::{EpisodeSummary, Finding};
pub use threads::on_threads;
