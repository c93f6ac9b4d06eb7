//! What `shrink` makes of crashes and breaches: what is left, what it was worth before and after, and in how many plays. Each
//! part of the search has something to do: needless actions, steps, traffic, effects, weather, delays, and numbers.

use serde_json::Value;

use crate::cases::{expect_snapshot, files, root};
use crate::command::{done, fails, last_line};

#[test]
fn each_part_of_a_scenario_is_made_smaller_or_plainer() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let space = root().join("tests/cases/spaces/shrinkable.ava").display().to_string();
    let run = ["run", &space, "--ads", "blind", "--episodes", "12", "--seed", "3", "--ambient", "3"];
    done(&[&run[..], &["--repeat", "8", "--out", &out]].concat());

    let found = files(format!("{out}/critical"), "ava");
    let delayed = found.iter().filter(|path| delay_last_step(path)).count();
    assert!(found.len() >= 20 && delayed >= 2, "{delayed} of {}", found.len());
    expect_snapshot("shrinks", "all", &shrunk(&found));
}

/// Eight actions of which none is needless, and ambient vehicles that the breach needs while the weather becomes plainer.
#[test]
fn what_a_breach_needs_is_kept() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("tests/cases/spaces/shrinkable_breaches.ava").display().to_string();
    let found = |name: &str, settings: &[&str]| {
        let out = scratch.path().join(name).display().to_string();
        let run = ["run", &space, "--ads", "blind", "--seed", "3", "--repeat", "8", "--out", &out];
        done(&[&run[..], settings].concat());
        files(format!("{out}/critical"), "ava")
    };
    let mut all = found("words", &["--with", "few_words", "--episodes", "2"]);
    // What does not come back is not exchanged for something else.
    let other = all[0].with_file_name("other.ava");
    let text = std::fs::read_to_string(&all[0]).expect("it was written");
    std::fs::write(&other, text.replace("expect few_words.", "expect keeps_away.")).expect("it is writable");
    fails(
        &["shrink", &other.display().to_string()],
        "has none of the collisions and breaches that it claims",
    );
    assert!(!scratch.path().join("shrunk").exists(), "nothing is left behind");
    all.extend(found("ambient", &["--ambient", "12", "--episodes", "15"]));
    let told = shrunk(&all);
    assert!(told.contains("8 of 8 actions") && told.contains("ambient: 11"), "{told}");
    expect_snapshot("shrinks", "breaches", &told);
}

/// Of a run's directory, the worst finding of each kind that recurs is made small: one scenario for a kind.
#[test]
fn of_a_run_the_worst_of_each_kind_is_shrunk() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let fault = "scenarios/ads/faults/planning_never_yields.yaml";
    let run = ["run", "scenarios/avastra45.ava", "--road", "residential", "--ads", fault, "--episodes", "25"];
    let found = last_line(&done(&[&run[..], &["--seed", "7", "--format", "json", "--out", &out]].concat()));
    let kinds = found["left"]["kinds"].as_array().expect("a list");
    let mut worst: Vec<&str> = kinds.iter().filter_map(|kind| kind["worst"].as_str()).collect();
    worst.sort_unstable();
    let critical = found["critical"].as_array().expect("a list").len();
    assert!(worst.len() >= 2 && worst.len() < critical, "{worst:?} of {critical}");
    let shrunk = last_line(&done(&["shrink", &out, "--format", "json"]));
    let shrunk = shrunk["scenarios"].as_array().expect("a list").iter();
    let mut names: Vec<&str> = shrunk.filter_map(|one| one["scenario"].as_str()).collect();
    names.sort_unstable();
    let expected: Vec<String> = worst.iter().map(|name| format!("{name}_shrunk")).collect();
    assert_eq!(names, expected);
}

/// What becomes of these scenarios.
fn shrunk(found: &[std::path::PathBuf]) -> String {
    let found: Vec<String> = found.iter().map(|path| path.display().to_string()).collect();
    let found: Vec<&str> = found.iter().map(String::as_str).collect();
    let shrunk = last_line(&done(&[&["shrink", "--format", "json"], &found[..]].concat()));
    shrunk["scenarios"].as_array().expect("a list").iter().map(in_full).collect()
}

/// Lets the step of a short scenario begin later, if its text has one step.
fn delay_last_step(path: &std::path::Path) -> bool {
    let text = std::fs::read_to_string(path).expect("it was written");
    let lines: Vec<&str> = text.lines().collect();
    let steps =
        lines.iter().filter(|line| line.trim_start().starts_with(|c: char| c.is_ascii_digit())).count();
    let Some(at) = lines.iter().position(|line| line.starts_with("    0: ")).filter(|_| steps == 1) else {
        return false;
    };
    let end = (at..lines.len()).find(|line| lines[*line].ends_with('}')).expect("its values end");
    let delayed = format!("{} once ego.speed > 1 m/s", lines[end]);
    let changed = [&lines[..end], &[delayed.as_str()], &lines[end + 1..]].concat().join("\n");
    std::fs::write(path, changed + "\n").expect("it can be written");
    true
}

/// What became of a scenario: sizes, plays, worth, and the file without digests.
fn in_full(one: &Value) -> String {
    let text = std::fs::read_to_string(one["output"].as_str().expect("a path")).expect("it was written");
    let scenario = text.lines().skip_while(|line| !line.starts_with("  road: "));
    let scenario = scenario.filter(|line| !line.contains("sha256:"));
    format!(
        "{}: {} of {} actions, {} of {} steps, {} plays\n  before {}\n  after  {}\n  gone   {}\n{}\n",
        one["scenario"],
        one["actions"],
        one["actions_before"],
        one["steps"],
        one["steps_before"],
        one["plays"],
        one["worth_before"],
        one["worth"],
        one["gone"],
        scenario.collect::<Vec<_>>().join("\n")
    )
}
