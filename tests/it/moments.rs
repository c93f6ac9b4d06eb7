//! The moment of no return: against many more branches, and against the recorded drive before each branch.

use std::path::Path;

use avastra::action::ActionTable;
use avastra::episode::{EpisodeLog, Moment, Script, Setup, run, run_watched};
use avastra::geometry::Vec2;
use avastra::oracle::{Found, REPLAYS, no_return};
use avastra::rng::{Stream, child_seed};
use avastra::run::Stage;
use avastra::sim::{DT_S, Start, World};

use crate::cases::{root, texts};
use crate::command::{avastra, done, outcome};
use crate::world::{FLICKER, read};

/// A branch, written down once more: other noise and other reactions from a moment on.
fn branched(setup: &Setup, from_s: f64, number: u32) -> Setup {
    let ads = setup.ads.clone();
    let reactions = child_seed(setup.seed, Stream::Noise, u64::from(number)) | 1;
    Setup {
        ads: ads.clone().until(from_s, ads.with_other_noise(number)),
        start: Start { reactions, reactions_from_s: from_s, ..setup.start },
        ..setup.clone()
    }
}

/// Where everybody is after each tick, the ego vehicle first.
fn places(setup: &Setup, script: &Script) -> Vec<Vec<Vec2>> {
    let mut places = Vec::new();
    let mut watch = |world: &World, _: &dyn avastra::ads::Ads, _: &[avastra::sim::Contact]| {
        let others = world.obstacles().map(|obstacle| obstacle.outline.pose.position);
        places.push([world.ego().rear_axle.position].into_iter().chain(others).collect());
    };
    run_watched(setup, &mut |moment: &Moment| script.choose(moment), &mut watch);
    places
}

/// Does something with each crash that a run of a driver with flickering sensors finds, until that says it has enough.
fn each_crash(seed: &str, episodes: &str, mut look: impl FnMut(&str, &Setup, &EpisodeLog, usize) -> bool) {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let run = ["run", "scenarios/avastra45.ava", "--ads", FLICKER, "--repeat", "0", "--episodes", episodes];
    done(&[&run[..], &["--seed", seed, "--out", &out]].concat());
    for name in texts(Path::new(&out).join("critical")).keys() {
        let loaded =
            avastra::check::load(&Path::new(&out).join("critical").join(name), &read).expect("it is there");
        let table = ActionTable::new(loaded.space.clone().expect("a space without mistakes"));
        let scenario = loaded.scenario.expect("it has a scenario");
        let stage = Stage::new(&table, &scenario).expect("it plays");
        let ads = avastra::run::recorded(&scenario).expect("it is known");
        let (log, _, first) = stage.first_counted(&ads);
        let first = first.expect("a counted collision");
        if look(name, &stage.setup(&ads), &log, first) {
            return;
        }
    }
}

/// The script of a log up to a collision, and one step more.
fn script(log: &EpisodeLog, index: usize) -> Script {
    let mut script = Script::of_log(log);
    script.steps.truncate(log.collisions[index].step + 1);
    script.steps.push(None);
    script
}

/// Share of the branches that hit the same road user. The steps up to the crash are the same, so it has the same number.
fn share(setup: &Setup, log: &EpisodeLog, index: usize, from_s: f64, branches: u32) -> f64 {
    let (script, hit) = (script(log, index), log.collisions[index].contact.obstacle);
    let has_hit = |number: &u32| {
        let setup = branched(setup, from_s, *number);
        let again = run(&setup, &mut |moment: &Moment| script.choose(moment));
        again.collisions.iter().any(|other| other.contact.obstacle == hit)
    };
    (1..=branches).filter(has_hit).count() as f64 / f64::from(branches)
}

#[test]
fn a_branch_is_the_recorded_drive_until_it_begins() {
    let mut seen = 0;
    each_crash("3", "10", |name, setup, log, index| {
        let contact_s = log.collisions[index].contact.time_s;
        let script = script(log, index);
        let from_s = contact_s - 3.0;
        let (recorded, again) = (places(setup, &script), places(&branched(setup, from_s, 1), &script));
        let before = (from_s / DT_S) as usize - 1;
        assert_eq!(recorded[..before], again[..before], "{name}");
        assert!(recorded[before..] != again[before..], "{name}: it goes another way from there on");
        // The same question has the same answer.
        let found = no_return(setup, log, Found::Collision(index), 8);
        assert_eq!(found, no_return(setup, log, Found::Collision(index), 8));
        assert!(found.moments.is_sorted_by(|one, other| one.time_s < other.time_s), "{found:?}");
        seen += 1;
        seen == 2
    });
    assert_eq!(seen, 2, "such sensors make crashes");
}

/// A breach that no chance undoes: the ego vehicle drives faster.
const SLOW: &str = r#"language 1
use "ROADS"
require slow when ego.speed >= 2 m/s: ego.speed <= 9 m/s within 1 s
action nothing() { spawn Sedan ahead 80 m { does: DriveAhead, lane: Current, speed: 12 m/s } }
scenario slow_road {
  road: boulevard
  start { }
  steps { 0: nothing() 2: wait() }
  expect slow.breached // always
}
"#;

/// What `diagnose --moment --write` writes of a crash and of a breach is checked to the digit, and written again it is the same.
#[test]
fn a_rise_is_a_claim_of_the_file() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let inside = |name: &str| scratch.path().join(name).display().to_string();
    let (town, out, breach) = (inside("town"), inside("run"), inside("slow_road.ava"));
    let roads = root().join("scenarios/roads.ava").display().to_string();
    std::fs::write(&breach, SLOW.replace("ROADS", &roads)).expect("it is writable");
    done(&["new", &town]);
    let fault = ["--ads", "scenarios/ads/faults/planning_never_yields.yaml", "--repeat", "0"];
    let space = inside("town/space.ava");
    done(&[&["run", &space, "--episodes", "8", "--seed", "3", "--out", &out][..], &fault].concat());
    let crash = inside("run/critical/corner_0007.ava");
    let texts = || [&crash, &breach].map(|file| std::fs::read_to_string(file).expect("it is there"));
    let before = texts();
    done(&["diagnose", "--moment", "--write", &crash, &breach]);
    let written = texts();
    done(&["replay", &crash, &breach]);
    done(&["fmt", "--check", &crash]);
    done(&["diagnose", "--moment", "--write", &crash, &breach]);
    assert_eq!(texts(), written);
    let is_claim = |line: &&str| line.contains("recurrence == ") && line.ends_with(" s");
    for (before, written) in before.iter().zip(&written) {
        let others: Vec<&str> = written.lines().filter(|line| !is_claim(line)).collect();
        assert_eq!(others, before.lines().collect::<Vec<_>>(), "all else stays");
        assert!(written.lines().filter(is_claim).count() >= 2, "{written}");
    }
    assert!(written[1].contains("  expect slow.breached // always\n  expect slow.recurrence == 18 / 18 at "));
    std::fs::write(&breach, written[1].replace("18 / 18", "17 / 18")).expect("it is writable");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &breach]));
    assert!(status == 3 && stdout.contains("slow.recurrence 17 of 18 at "), "{stdout}{stderr}");
}

/// The rise against 400 branches at each tenth of a second around it:
/// `cargo test --release --test it -- --ignored --nocapture the_rise_lies_where_many_branches_put_it`
#[test]
#[ignore = "takes half an hour"]
fn the_rise_lies_where_many_branches_put_it() {
    const MANY: u32 = 400;
    let mut off_s: Vec<f64> = Vec::new();
    for (seed, wanted) in [("1", 20), ("2", 40)] {
        each_crash(seed, "100", |name, setup, log, index| {
            let found = no_return(setup, log, Found::Collision(index), REPLAYS);
            let Some(rises_s) = found.rises_s else { return false };
            let last = ((found.found_s - rises_s) * 10.0).floor().min(10.0) as i32;
            let times: Vec<f64> = (-10..=last).map(|tenth| rises_s + f64::from(tenth) / 10.0).collect();
            // From the last to the first, so that what lies before the answer is not played.
            let last_unlikely =
                times.iter().rposition(|time_s| share(setup, log, index, *time_s, MANY) <= 0.75);
            let truth_s = last_unlikely.map_or(times[0], |last| times[(last + 1).min(times.len() - 1)]);
            println!("{name}: {rises_s:.1} s, by many {truth_s:.1} s");
            off_s.push((rises_s - truth_s).abs());
            off_s.len() == wanted
        });
    }
    let near = off_s.iter().filter(|off_s| **off_s <= 0.3 + 1e-9).count();
    println!("{near} of {} within 0.3 s", off_s.len());
    assert_eq!(near, off_s.len(), "{off_s:?}");
}
