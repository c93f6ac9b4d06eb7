//! Episodes, what is judged of them, and the campaigns that are made of many.
//!
//! [`episode`] plays one. [`oracle`] judges its collisions. [`run`], [`train`], [`study`], [`estimate`] and [`trial`] play
//! many and keep them in a database. [`emit`] writes what they find as files of the language. [`files`] alone creates,
//! replaces and removes files.
//!
//! ```
//! use std::path::Path;
//!
//! use avastra_campaign::episode::{self, Choice, Moment, Script};
//! use avastra_campaign::run::Arena;
//! use avastra_drivers::{Selected, by_name};
//! use avastra_lang::check::{ReadError, load};
//! use avastra_world::action::ActionTable;
//!
//! let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
//! let space = load(Path::new("../../scenarios/avastra45.ava"), &read)?.space.expect("it has no mistakes");
//! let ads = Selected::new(by_name("modular").expect("it is in the registry"));
//! let arena = Arena::new(ActionTable::new(space), &["corner".to_owned()], ads, &[], &[])?;
//!
//! // The episode of seed 1: at each step the last legal row is carried out.
//! let mut last_legal = |moment: &Moment| {
//!     let mut offers = arena.table().offers(moment.situation).into_iter().rev();
//!     offers.find_map(Result::ok).map_or(Choice::Pass, Choice::Act)
//! };
//! let log = episode::run(&arena.setup(0, 1), &mut last_legal);
//!
//! // Its choices alone, as a script, play it again to the bit.
//! let script = Script::of_log(&log);
//! let mut as_written = |moment: &Moment| script.choose(moment);
//! let again = episode::run(&arena.setup(0, 1), &mut as_written);
//! assert_eq!(again.trace(), log.trace());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod episode;
pub mod oracle;
pub mod files;
pub mod run;
pub mod estimate;
pub mod train;
pub mod trial;
pub mod study;
pub mod emit;

/// The databases of directories, each with the version of its layout.
pub fn layouts() -> [(&'static str, i64); 3] {
    let [run, study, estimate] = [run::LAYOUT.version, study::LAYOUT.version, estimate::LAYOUT.version];
    [("run.db", run), ("study.db", study), ("estimate.db", estimate)]
}
