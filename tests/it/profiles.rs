//! Profiles of the driving system go from their file into a run, from there into a scenario, and into its
//! replay.

use std::path::Path;

use avastra::ads::ModularConfig;
use avastra::run::RunSettings;

use crate::cases::{entries, root};
use crate::command::{avastra, done, fails, outcome};
use crate::world::SMALL;

const FAULT: &str = "scenarios/ads/faults/planning_never_yields.yaml";

/// A shipped profile.
pub fn profile(name: &str) -> ModularConfig {
    let path = root().join(name);
    let text = std::fs::read_to_string(&path).expect("it is shipped");
    ModularConfig::from_yaml(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A run of a few episodes into a directory.
fn run(directory: &Path, more: &[&str]) -> (i32, String, String) {
    let out = directory.display().to_string();
    let mut arguments =
        vec!["run", "scenarios/avastra45.ava", "--road", "corner", "--seed", "5", "--quiet", "--out", &out];
    arguments.extend(more);
    outcome(&mut avastra(&arguments))
}

#[test]
fn shipped_profiles_are_accepted_and_recorded() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for name in ["cautious", "degraded", "default"] {
        let file = format!("scenarios/ads/{name}.yaml");
        let directory = scratch.path().join(name);
        let (status, _, stderr) = run(&directory, &["--episodes", "1", "--ads", &file]);
        assert_eq!(status, 0, "{stderr}");
        let text = std::fs::read_to_string(directory.join("run.yaml")).expect("it was written");
        let settings: RunSettings = serde_yaml::from_str(&text).expect("it reads back");
        let recorded = settings.conditions.profile.expect("modular has settings");
        assert_eq!((recorded.settings, recorded.digest), (profile(&file), profile(&file).digest()));
    }
    assert_eq!(profile("scenarios/ads/default.yaml"), ModularConfig::default());
}

#[test]
fn a_scenario_keeps_the_profile_that_it_was_found_with() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let directory = scratch.path().join("run");
    let (status, _, stderr) = run(&directory, &["--episodes", "30", "--ads", FAULT]);
    assert_eq!(status, 0, "{stderr}");
    let files = entries(directory.join("critical"));
    let file = files.first().expect("a system that never yields hits an obstacle");
    let text = std::fs::read_to_string(file).expect("it was written");
    assert!(text.contains("never_yields: true"), "{text}");

    let path = file.display().to_string();
    done(&["replay", &path]);
    // The file holds the recorded profile, so claims are checked.
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &path, "--ads", FAULT]));
    assert!(status == 0 && !stdout.contains("against"), "{stdout}");
    // Another profile is not the recorded one, so the replay only tells what happens.
    let cautious = "scenarios/ads/cautious.yaml";
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &path, "--ads", cautious]));
    assert!(status == 0 && stdout.contains("against modular with scenarios/ads/cautious.yaml"), "{stdout}");

    let svg = scratch.path().join("strip.svg").display().to_string();
    let drawn = ["render", &path, "--strip", "--ads", cautious, "--out", &svg];
    done(&drawn);
    let svg = std::fs::read_to_string(&svg).expect("it was drawn");
    assert!(svg.contains(&format!("driven by {cautious}: ")), "a picture says whose drive it is");

    // A digest that does not fit the settings is refused where a new file would be made of it, with a remedy.
    let other = file.with_file_name("other.ava");
    let digest = profile(FAULT).digest();
    assert!(text.contains(&digest));
    std::fs::write(&other, text.replace(&digest, &ModularConfig::default().digest()))
        .expect("it is writable");
    fails(&["shrink", &other.display().to_string()], "--ads FILE");
}

#[test]
fn a_profile_with_a_mistake_is_refused_by_name_line_and_remedy() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = scratch.path().join("mine.yaml");
    let name = file.display().to_string();
    let cases = [
        (
            "planning:\n  cruise_mp: 8\n",
            "line 2: `planning.cruise_mp` is no setting; did you mean `cruise_mps`?",
        ),
        (
            "planning:\n\n  cruise_mps: 80\n",
            "line 3: `planning.cruise_mps` is 80; write a value from 1 to 40",
        ),
        ("tracking: [1]\n", "line 1: `tracking` is a list; write a section"),
        ("planning:\n  cruise_mps: 8\n  cruise_mps: 9\n", "line 3: `cruise_mps` stands twice"),
        ("planning: [1,\n", "line 1: `[` is never closed"),
        ("planning:\n\tcruise_mps: 8\n", "line 2: indent with blanks, not with tabs"),
        ("", "the profile is empty; write what differs"),
        ("null\n", "the profile is empty; write what differs"),
    ];
    for (text, message) in cases {
        std::fs::write(&file, text).expect("it is writable");
        let directory = scratch.path().join("never");
        let (status, _, stderr) = run(&directory, &["--ads", &name]);
        assert_eq!(status, 1, "{stderr}");
        assert!(stderr.contains(message) && stderr.contains("mine.yaml"), "{stderr}");
        assert!(!directory.exists());
    }
}

#[test]
fn a_policy_is_verified_against_the_profile_that_it_was_trained_against() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = scratch.path().join("small.yaml");
    std::fs::write(&config, SMALL).expect("it is writable");
    let (config, out) = (config.display().to_string(), scratch.path().join("run").display().to_string());
    let place = ["train", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "12", "--seed", "5"];
    let how = ["--config", &config, "--out", &out, "--ads", FAULT];
    done(&[&place[..], &how].concat());
    let file = scratch.path().join("run/policy/corner_ddqn_5.ava");
    let text = std::fs::read_to_string(&file).expect("it was written");
    assert!(text.contains("never_yields: true") && text.contains(&profile(FAULT).digest()), "{text}");
    done(&["replay", &file.display().to_string()]);
}
