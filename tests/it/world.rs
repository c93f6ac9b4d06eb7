//! The shipped space, ready to play.

use std::path::Path;
use std::sync::Arc;

use avastra::action::ActionTable;
use avastra::check::ReadError;
use avastra::episode::{EpisodeLog, Script};
use avastra::model::Space;
use avastra::run::{Run, RunSettings};

use crate::cases::root;

/// Reads a file as the command line does.
pub fn read(path: &Path) -> Result<String, ReadError> {
    std::fs::read_to_string(path).map_err(|error| ReadError(error.to_string()))
}

/// A shipped space, which must be without mistakes.
pub fn space(name: &str) -> Arc<Space> {
    space_at(&format!("scenarios/{name}"))
}

/// A space by its path in the repository.
pub fn space_at(name: &str) -> Arc<Space> {
    let loaded = avastra::check::load(&root().join(name), &read).expect("it is there");
    assert!(loaded.diagnostics.is_empty(), "{name}: {:?}", loaded.diagnostics);
    loaded.space.expect("a space without mistakes is a space")
}

/// An episode again from its own log: the same, bit for bit.
pub fn assert_replays(run: &Run, number: usize, log: &EpisodeLog) {
    let script = Script::of_log(log);
    let mut again = run.play(number, &mut |moment| script.choose(run.table(), moment), &mut |_, _, _| {});
    // A script does not know that a choice was refused, only that nothing happened.
    for (step, was) in again.steps.iter_mut().zip(&log.steps) {
        step.outcome = was.outcome.clone();
    }
    assert_eq!(&again, log, "episode {number}");
}

/// A run of masked random search against the modular driving system.
pub fn run(episodes: u32, seed: u64, without: &[&str]) -> Run {
    run_of(space("avastra45.ava"), episodes, seed, without)
}

/// The same over any space.
pub fn run_of(space: Arc<Space>, episodes: u32, seed: u64, without: &[&str]) -> Run {
    run_against("modular", space, episodes, seed, without)
}

/// The same against any driving system.
pub fn run_against(ads: &str, space: Arc<Space>, episodes: u32, seed: u64, without: &[&str]) -> Run {
    let settings = RunSettings {
        ads: ads.to_owned(),
        without: without.iter().map(|rule| (*rule).to_owned()).collect(),
        ..RunSettings::new(&space, "random", episodes, seed)
    };
    Run::new(ActionTable::new(space), settings).expect("the settings name what exists")
}
