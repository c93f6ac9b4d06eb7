//! Shared by the tests: the shipped space ready to play, a world with room, a small learner.

use std::path::Path;
use std::sync::Arc;

use avastra::action::{ActionTable, SpawnFacts, SpawnRequest, Surroundings};
use avastra::ads::ModularConfig;
use avastra::check::{Loaded, ReadError};
use avastra::episode::{EpisodeLog, Script};
use avastra::model::{MomentFacts, Space};
use avastra::run::{Conditions, Profile, Run, RunSettings};

use crate::cases::root;

/// Settings of a learner with a few neurons, whose rules are distilled from a few episodes.
pub const SMALL: &str = "learning_starts: 30\nupdates_per_step: 1\nhidden_units: [8]\nbatch_len: 8\n\
                         rules_leaves: 6\nrules_rounds: 2\nrules_episodes: 3\n";

/// A profile with a planted fault: random search finds crashes of it soon, and few or none of the default's.
pub const FLICKER: &str = "scenarios/ads/faults/perception_flicker.yaml";

/// A world in which every spawn has room, and its gap is the distance asked for.
pub struct Wide {
    pub safety_gap_m: f64,
}

impl Surroundings for Wide {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        Ok(SpawnFacts {
            spawn_gap_m: request.distance_m,
            safety_gap_m: self.safety_gap_m,
            ..SpawnFacts::default()
        })
    }

    fn moment(&self) -> MomentFacts {
        MomentFacts { ego_speed_mps: 10.0, ..MomentFacts::default() }
    }
}

/// Reads a file as the command line does.
pub fn read(path: &Path) -> Result<String, ReadError> {
    std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()))
}

/// Loads a text as if it were a file of the repository.
pub fn loaded(name: &str, text: &str) -> Loaded {
    let path = root().join(name);
    let read = |asked: &Path| if asked == path { Ok(text.to_owned()) } else { read(asked) };
    avastra::check::load(&path, &read).expect("its text is known")
}

/// A shipped space, which must be without mistakes.
pub fn space(name: &str) -> Arc<Space> {
    space_at(&format!("scenarios/{name}"))
}

/// A space by its path in the repository.
pub fn space_at(name: &str) -> Arc<Space> {
    let loaded = avastra::check::load(&root().join(name), &read).expect("it is there");
    // A hill is driven as if it were level, which is what some tests are about.
    let is_sound = loaded.diagnostics.iter().all(|found| found.code == "AV0114");
    assert!(is_sound, "{name}: {:?}", loaded.diagnostics);
    loaded.space.expect("a space without mistakes is a space")
}

/// Asserts that an episode, played again from its own log, is the same bit for bit.
pub fn assert_replays(run: &Run, number: usize, log: &EpisodeLog) {
    let script = Script::of_log(log);
    let mut again = run.play(number, &mut |moment| script.choose(moment), &mut |_, _, _| {});
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

/// A run in the shipped space against a driving system whose detections flicker, so that there are crashes.
pub fn run_with_flicker(episodes: u32, seed: u64) -> Run {
    let usual = run(episodes, seed, &[]);
    let text = std::fs::read_to_string(root().join(FLICKER)).expect("it is shipped");
    let config = ModularConfig::from_yaml(&text).expect("it is sound");
    under(&usual, |conditions| conditions.profile = Some(Profile::new(&config)))
}

/// A run under other conditions.
pub fn under(usual: &Run, change: impl FnOnce(&mut Conditions)) -> Run {
    let mut settings = usual.settings().clone();
    change(&mut settings.conditions);
    Run::new(usual.table().clone(), settings).expect("the conditions name what exists")
}

/// A run of masked random search in any space, against the modular driving system.
pub fn run_of(space: Arc<Space>, episodes: u32, seed: u64, without: &[&str]) -> Run {
    run_against("modular", space, episodes, seed, without)
}

/// A run of masked random search in any space, against any driving system.
pub fn run_against(ads: &str, space: Arc<Space>, episodes: u32, seed: u64, without: &[&str]) -> Run {
    let conditions = Conditions {
        ads: ads.to_owned(),
        without: without.iter().map(|rule| (*rule).to_owned()).collect(),
        ..Conditions::of(&space)
    };
    let settings = RunSettings::new(conditions, "random", episodes, seed);
    Run::new(ActionTable::new(space), settings).expect("the settings name what exists")
}
