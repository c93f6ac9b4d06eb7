//! What `avastra export` writes: its shape, that it depends on the scenario alone, and what is refused. Whether other
//! tools understand it is the question of `tests/interop/export.sh`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::cases::{expect_snapshot, root};
use crate::command::{avastra, outcome};

const SCENARIO: &str = "tests/cases/exports/wet_corner.ava";

/// Exports a scenario; status and both outputs.
fn export(format: &str, file: &str, out: &Path, more: &[&str]) -> (i32, String, String) {
    let out = out.display().to_string();
    outcome(&mut avastra(&[&["export", "--to", format, "--out", &out, file], more].concat()))
}

/// The files of a folder and their texts.
fn texts(folder: &Path) -> BTreeMap<String, String> {
    let entries = std::fs::read_dir(folder).expect("it was written").flatten();
    entries
        .map(|entry| {
            let text = std::fs::read_to_string(entry.path()).expect("it is text");
            (entry.file_name().to_string_lossy().into_owned(), text)
        })
        .collect()
}

/// A file without its figures, and without lines that say the same again: what does not change when driving does.
fn shape(text: &str) -> String {
    let mut shape: Vec<String> = Vec::new();
    for line in text.lines() {
        let mut line: String =
            line.chars().map(|letter| if letter.is_ascii_digit() { '#' } else { letter }).collect();
        for figures in ["##", "#.#", "-#"] {
            while line.contains(figures) {
                line = line.replace(figures, "#");
            }
        }
        if !shape.contains(&line) {
            shape.push(line);
        }
    }
    shape.join("\n")
}

#[test]
fn every_format_has_its_shape() {
    for (format, name) in
        [("openscenario", "wet_corner.xosc"), ("commonroad", "wet_corner.xml"), ("csv", "wet_corner.csv")]
    {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let (status, _, stderr) = export(format, SCENARIO, scratch.path(), &[]);
        assert_eq!(status, 0, "{format}: {stderr}");
        let written = texts(scratch.path());
        let text = &written[name];
        if format != "csv" {
            roxmltree::Document::parse(text).expect("it is well-formed");
        }
        let shape = match format {
            "csv" => text.lines().next().expect("a table has a head").to_owned(),
            _ => shape(text),
        };
        expect_snapshot("exports", format, &shape);
        if format == "openscenario" {
            let map =
                std::fs::read_to_string(root().join("scenarios/roads/corner.xodr")).expect("it is shipped");
            assert_eq!(written["corner.xodr"], map, "the map lies beside it");
        }
        let again = tempfile::tempdir().expect("a scratch directory");
        export(format, SCENARIO, again.path(), &[]);
        assert_eq!(written, texts(again.path()), "{format} depends on the scenario alone");
    }
}

#[test]
fn a_recording_is_complete_and_at_its_times() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    export("openscenario", SCENARIO, scratch.path(), &[]);
    export("csv", SCENARIO, scratch.path(), &[]);
    let written = texts(scratch.path());
    let rows: Vec<Vec<&str>> =
        written["wet_corner.csv"].lines().skip(1).map(|line| line.split(',').collect()).collect();
    // Two steps of 6 s at 50 Hz, and the moment before the first tick.
    assert_eq!(rows.iter().filter(|row| row[1] == "0").count(), 601);
    let document = roxmltree::Document::parse(&written["wet_corner.xosc"]).expect("it is well-formed");
    for trajectory in document.descendants().filter(|node| node.has_tag_name("Trajectory")) {
        let times: Vec<f64> =
            trajectory.descendants().filter_map(|node| node.attribute("time")?.parse().ok()).collect();
        assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
        assert_eq!(times.last(), Some(&12.0), "the way lasts to the end");
    }
    let of_ego = |more: &[&str]| {
        let out = scratch.path().join("other");
        let (status, _, stderr) = export("openscenario", SCENARIO, &out, more);
        assert_eq!(status, 0, "{stderr}");
        texts(&out)["wet_corner.xosc"].clone()
    };
    assert!(of_ego(&[]).contains("ego_follows"));
    assert!(!of_ego(&["--ego", "none"]).contains("ego_follows"));
    assert!(of_ego(&["--ego", "controller"]).contains("<Controller name=\"ads\">"));
    assert!(of_ego(&["--osc-version", "1.3"]).contains("revMinor=\"3\""));
}

#[test]
fn what_is_no_scenario_or_does_not_replay_is_refused() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (status, _, stderr) = export("csv", "scenarios/avastra45.ava", scratch.path(), &[]);
    assert_eq!((status, stderr.contains("has no scenario")), (1, true), "{stderr}");
    let (status, _, stderr) = export("csv", "scenarios/nowhere.ava", scratch.path(), &[]);
    assert_eq!((status, stderr.contains("cannot read")), (1, true), "{stderr}");
    for (format, option) in [("csv", "--ego"), ("commonroad", "--ego")] {
        let (status, _, stderr) = export(format, SCENARIO, scratch.path(), &[option, "controller"]);
        assert_eq!((status, stderr.contains("--ego")), (1, true), "{stderr}");
    }
    let (status, _, stderr) = export("csv", SCENARIO, scratch.path(), &["--osc-version", "1.3"]);
    assert_eq!((status, stderr.contains("--osc-version")), (1, true), "{stderr}");

    let text = std::fs::read_to_string(root().join(SCENARIO)).expect("it is a case");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let text = text.replace("../../../scenarios/avastra45.ava", &space);
    let lie = scratch.path().join("lie.ava");
    std::fs::write(&lie, text.replace("end == script", "end == arrived")).expect("it is writable");
    let out = scratch.path().join("out");
    let (status, stdout, stderr) = export("csv", &lie.display().to_string(), &out, &[]);
    assert_eq!(status, 3, "{stderr}");
    assert!(stdout.contains("it does not replay: claimed end arrived, found script"), "{stdout}");
    assert!(!out.exists(), "nothing is written");
    let old = text.replace("seed: 7,", "seed: 7, engine: \"plane/1\",");
    std::fs::write(&lie, old).expect("it is writable");
    let (status, _, stderr) = export("csv", &lie.display().to_string(), &out, &[]);
    assert_eq!((status, stderr.contains("plane/1")), (1, true), "{stderr}");
}

#[test]
fn nothing_of_others_is_overwritten() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    std::fs::write(scratch.path().join("corner.xodr"), "another map").expect("it is writable");
    let (status, _, stderr) = export("openscenario", SCENARIO, scratch.path(), &[]);
    assert_eq!((status, stderr.contains("another map is already at")), (1, true), "{stderr}");
    assert!(!scratch.path().join("wet_corner.xosc").exists());
    // A folder that is a file.
    let (status, _, stderr) = export("csv", SCENARIO, &scratch.path().join("corner.xodr"), &[]);
    assert_eq!((status, stderr.contains("cannot")), (1, true), "{stderr}");
    let twin = scratch.path().join("wet_corner.ava");
    std::fs::copy(root().join(SCENARIO), &twin).expect("it is writable");
    let (status, _, stderr) = export("csv", SCENARIO, scratch.path(), &[&twin.display().to_string()]);
    assert_eq!((status, stderr.contains("would both be written to")), (1, true), "{stderr}");
}
