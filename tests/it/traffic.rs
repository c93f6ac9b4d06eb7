//! Traffic profiles at the command line: recorded, emitted, replayed, and refused with a reason.

use std::path::Path;

use avastra::run::RunSettings;
use avastra::sim::TrafficProfile;

use crate::cases::entries;
use crate::command::{avastra, done, fails, outcome};
use crate::world::FLICKER;

const SPACE: &str = "scenarios/avastra45.ava";

fn run(directory: &Path, more: &[&str]) -> (i32, String, String) {
    let directory = directory.display().to_string();
    let arguments = ["run", SPACE, "--road", "corner", "--seed", "11", "--quiet", "--out", &directory];
    outcome(&mut avastra(&[&arguments, more].concat()))
}

fn settings(directory: &Path) -> (String, RunSettings) {
    let text = std::fs::read_to_string(directory.join("run.yaml")).expect("it was written");
    let settings = serde_yaml::from_str(&text).expect("it reads back");
    (text, settings)
}

#[test]
fn a_run_under_released_traffic_is_recorded_and_its_scenarios_replay() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let directory = scratch.path().join("released");
    let (status, _, stderr) =
        run(&directory, &["--episodes", "20", "--traffic", "released", "--ads", FLICKER]);
    assert_eq!(status, 0, "{stderr}");
    let released = TrafficProfile::shipped("released").expect("it is sound");
    let record = settings(&directory).1.conditions.traffic.expect("it is not the default");
    assert_eq!((record.settings, record.digest), (released, released.digest()));

    let files = entries(directory.join("critical"));
    let file = files.first().expect("such traffic causes a collision");
    let text = std::fs::read_to_string(file).expect("it was written");
    assert!(text.contains("traffic: ") && text.contains(&released.digest()), "{text}");
    // Every claim, the digest of the trace among them.
    let path = file.display().to_string();
    done(&["replay", &path]);

    // Under other traffic the digest does not fit the settings.
    let careful = TrafficProfile::default();
    let other = file.with_file_name("other.ava");
    std::fs::write(&other, text.replace(&released.digest(), &careful.digest())).expect("it is writable");
    fails(&["shrink", &other.display().to_string()], "traffic profile");
}

#[test]
fn the_default_by_name_is_the_default() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (plain, named) = (scratch.path().join("a"), scratch.path().join("b"));
    for (directory, more) in [(&plain, &[][..]), (&named, &["--traffic", "careful"][..])] {
        let (status, _, stderr) = run(directory, &[&["--episodes", "1"], more].concat());
        assert_eq!(status, 0, "{stderr}");
    }
    assert_eq!(settings(&plain).0, settings(&named).0);
    assert_eq!(settings(&plain).1.conditions.traffic, None);
    assert!(!settings(&plain).0.contains("traffic: "));
}

#[test]
fn unknown_names_and_bad_files_are_refused() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let refused = |wanted: &str| {
        let (status, _, stderr) = run(&scratch.path().join("run"), &["--traffic", wanted]);
        assert_eq!(status, 1, "{stderr}");
        stderr
    };
    let told = refused("wild");
    assert!(
        told.contains("no traffic profile `wild`: there are `careful`, `rightful` and `released`"),
        "{told}"
    );
    refused("no/such.yaml");
    let file = scratch.path().join("mine.yaml");
    for (text, message) in [
        ("politeness: 3\n", "`politeness` is 3; write a value from 0 to 1"),
        ("polite: true\n", "polite"),
        ("", "the profile is empty"),
    ] {
        std::fs::write(&file, text).expect("it is writable");
        let told = refused(&file.display().to_string());
        assert!(told.contains(message), "{told}");
    }
}

/// Up to 100 may be asked for; a run says how many there are at the start.
#[test]
fn a_run_says_how_many_ambient_vehicles_there_are() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let told = |vehicles: &str| {
        let more = ["--ambient", vehicles, "--agent", "none", "--episodes", "1", "--ads", "idm"];
        let arguments = ["run", SPACE, "--road", "corner", "--seed", "11", "--out"];
        let directory = scratch.path().join(vehicles).display().to_string();
        let (status, stdout, stderr) =
            outcome(&mut avastra(&[&arguments[..], &[&directory], &more].concat()));
        assert_eq!(status, 0, "{stdout}{stderr}");
        stdout + &stderr
    };
    let many = told("100");
    let line =
        many.lines().find(|line| line.starts_with("of 100 vehicles of ambient traffic")).expect("it is told");
    let (_, found) = line.split_once("at the start of its first episode there are ").expect("it counts them");
    let found: u32 = found.split(' ').next().and_then(|text| text.parse().ok()).expect("a number");
    assert!((10..100).contains(&found), "{line}");
    assert!(!told("0").contains("ambient traffic"), "none are asked for");
    let more = ["--ambient", "101"];
    let (status, _, stderr) = run(&scratch.path().join("more"), &more);
    assert!(status == 1 && stderr.contains("101 is not in 0..=100"), "{status}: {stderr}");
}
