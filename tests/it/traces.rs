//! Ten episodes whose traces are the same on every machine and in every build.
//!
//! `tests/interop/builds.sh` runs this in the debug and in the release profile. After a change of the
//! engine: `INSTA_UPDATE=always cargo test --test it traces`, and raise `sim::ENGINE`.

use crate::cases::expect_snapshot;
use crate::world::{run, under};

#[test]
fn ten_episodes_are_the_same_everywhere() {
    let mut text = String::new();
    for seed in 1..=5 {
        for ads in ["modular", "idm"] {
            let usual = run(1, seed, &[]);
            let run = under(&usual, |conditions| conditions.ads = ads.to_owned());
            // With one episode a road, the number of an episode is that of its road.
            let log = run.episode(seed as usize % run.episodes());
            let steps = log.steps.len();
            let last = log.steps.last().expect("an episode has steps");
            let trace: String = last.trace.iter().map(|byte| format!("{byte:02x}")).collect();
            let collisions = log.collisions.len();
            text += &format!(
                "road={} ads={ads} seed={seed} steps={steps} collisions={collisions} end={:?}\n{trace}\n",
                log.road, log.end
            );
        }
    }
    expect_snapshot("traces", "ten", &text);
}
