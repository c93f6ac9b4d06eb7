//! A failure that a run found is explained, shrunk and tested again, and false claims about it are refuted.

use crate::cases::entries;
use crate::command::{avastra, done, fails, outcome};
use crate::world::FLICKER;

#[test]
fn found_scenarios_are_explained_shrunk_and_tested_again() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let out = path("run");
    let settings =
        ["--road", "corner", "--episodes", "20", "--seed", "5", "--ads", FLICKER, "--causes", "--out", &out];
    let stdout = done(&[&["run", "scenarios/avastra45.ava"], &settings[..]].concat());
    assert!(stdout.contains("distinct failure"), "{stdout}");
    let files = entries(scratch.path().join("run/critical"));
    // The last one is the cheapest to shrink.
    let with_cause = files.iter().rev().find_map(|file| {
        let text = std::fs::read_to_string(file).expect("it is readable");
        let line = text.lines().find(|line| line.contains("expect cause == "))?.to_owned();
        Some((file.display().to_string(), text, line))
    });
    let (file, text, claim) = with_cause.expect("a crash of twenty episodes has a cause");
    let stdout = done(&["replay", &file]);
    assert!(stdout.contains("delta-v"), "{stdout}");

    // The actuators of this system have no error, so control is never the cause.
    let lie = path("run/critical/lie.ava");
    let (before, after) = claim.split_once("== ").expect("it is an equation");
    let (_, with) = after.split_once(" with").expect("it names the obstacle");
    std::fs::write(&lie, text.replace(&claim, &format!("{before}== control with{with}"))).expect("writable");
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &lie]));
    assert!(status == 3 && stdout.contains("claimed cause [control]"), "{stdout}");
    std::fs::remove_file(&lie).expect("it is there");

    let json = |arguments: &[&str]| -> (i32, serde_json::Value) {
        let (status, stdout, stderr) =
            outcome(&mut avastra(&[arguments, &["--format", "json", "--quiet"]].concat()));
        let line = stdout.lines().next().unwrap_or_else(|| panic!("{stderr}"));
        (status, serde_json::from_str(line).expect("it is JSON"))
    };
    let (status, found) = json(&["diagnose", &file]);
    let only = &found["scenarios"][0];
    let cause = only["diagnosis"]["cause"][0].as_str().expect("it has a cause");
    assert!(status == 0 && claim.contains(cause), "{found}");
    assert!(["ego", "other", "none"].iter().any(|who| only["priority"] == *who), "{found}");
    let measured = only["diagnosis"]["measured"].as_array().expect("a list");
    assert!(measured.len() == 4 && measured.iter().all(|one| one["bound"].as_f64() > Some(0.0)), "{found}");

    // For several files there is a line each, and a count of each cause.
    let names: Vec<String> = files.iter().take(2).map(|file| file.display().to_string()).collect();
    let both: Vec<&str> = names.iter().map(String::as_str).collect();
    let (status, found) = json(&[&["diagnose"], &both[..]].concat());
    let sum: u64 =
        found["causes"].as_array().expect("a list").iter().filter_map(|c| c["count"].as_u64()).sum();
    assert_eq!((status, sum, &found["failed"]), (0, 2, &serde_json::json!([])), "{found}");
    // From outside, one thing after the other is changed.
    let (status, found) = json(&["diagnose", "--outside", &file]);
    let swaps = &found["scenarios"][0]["swaps"];
    let changed = swaps["swaps"].as_array().expect("a list");
    assert!(status == 0 && changed.len() >= 8 && found["scenarios"][0]["diagnosis"].is_null(), "{found}");
    assert!(changed.iter().all(|swap| !swap["fate"].is_null()), "{found}");

    let small = path("small.ava");
    let (status, found) = json(&["shrink", &file, "--out", &small]);
    let shrunk = &found["scenarios"][0];
    assert!(status == 0 && shrunk["refuted"] == 0, "{shrunk}");
    assert!(shrunk["actions"].as_u64() <= shrunk["actions_before"].as_u64(), "{shrunk}");
    assert_eq!(outcome(&mut avastra(&["replay", &small])).0, 0);
    let minimal = std::fs::read_to_string(&small).expect("it was written");
    let claim = minimal.lines().find(|line| line.contains("expect minimal")).expect("it says so");
    // The found scenario has actions that the crash does not need, so its claim to be minimal is refuted.
    assert!(shrunk["actions"].as_u64() < shrunk["actions_before"].as_u64(), "{shrunk}");
    let claim = format!("{}\n  expect trace", claim.split(" with").next().expect("a first part"));
    std::fs::write(&lie, text.replace("  expect trace", &claim)).expect("it is writable");
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &lie]));
    assert!(status == 3 && stdout.contains("claimed minimal") && stdout.contains("without step"), "{stdout}");
    std::fs::remove_file(&lie).expect("it is there");
    // A scenario that is minimal stays as it is, and several files are shrunk in one go.
    let copy = path("copy.ava");
    std::fs::copy(&small, &copy).expect("it is writable");
    let (status, several) = json(&["shrink", &small, &copy]);
    assert_eq!((status, several["kept"].as_u64(), &several["failed"]), (0, Some(2), &serde_json::json!([])));
    for again in several["scenarios"].as_array().expect("a list") {
        assert_eq!((&again["steps"], &again["actions"]), (&shrunk["steps"], &shrunk["actions"]));
    }
    assert_eq!(several["median_steps"].as_f64(), shrunk["steps"].as_f64(), "{several}");
    assert!(["small", "copy"].iter().all(|stem| scratch.path().join(format!("shrunk/{stem}.ava")).is_file()));

    let junit = path("junit.xml");
    let (status, tested) = json(&["test", &out, "--junit", &junit]);
    assert_eq!((status, tested["still_fails"].as_u64()), (4, Some(files.len() as u64)), "{tested}");
    let xml = std::fs::read_to_string(&junit).expect("it was written");
    let document = roxmltree::Document::parse(&xml).expect("it is well-formed");
    assert_eq!(document.descendants().filter(|node| node.has_tag_name("failure")).count(), files.len());

    let cases: [(&[&str], &str); 4] = [
        (&["shrink", &small, &small, "--out", &small], "is for one file"),
        (&["test", "scenarios/ads"], "no scenario in"),
        (&["test", &out, "--ads", "apolo"], "no driving system `apolo`"),
        (&["run", "scenarios/avastra45.ava", "--ads", "idm", "--causes"], "`idm` is not made of modules"),
    ];
    for (arguments, message) in cases {
        fails(arguments, message);
    }
}
