//! Found scenarios as a suite that lives: the space may be documented, moved and changed, and the suite says what it
//! means for it.

use std::path::PathBuf;

use crate::cases::{copy_space, entries, files, files_below, name, root};
use crate::command::{avastra, done, fails, outcome};
use crate::world::FLICKER;

/// A copy of the shipped space, and a run in it that found crashes.
struct Found {
    scratch: tempfile::TempDir,
    /// Number of scenarios in `run/critical`.
    scenarios: usize,
}

impl Found {
    fn new(flags: &[&str]) -> Found {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        copy_space(&scratch.path().join("space"));
        let mut found = Found { scratch, scenarios: 0 };
        let (file, run) = (found.path("space/avastra45.ava"), found.path("run"));
        let settings =
            ["--road", "corner", "--episodes", "12", "--seed", "5", "--ads", FLICKER, "--out", &run];
        done(&[&["run", &file], &settings[..], flags].concat());
        found.scenarios = found.files("run/critical").len();
        assert!(found.scenarios >= 2, "a suite needs scenarios");
        found
    }

    fn path(&self, name: &str) -> String {
        self.scratch.path().join(name).display().to_string()
    }

    fn files(&self, folder: &str) -> Vec<PathBuf> {
        let mut files = entries(self.scratch.path().join(folder));
        files.retain(|path| path.is_file());
        files
    }

    fn edit(&self, name: &str, from: &str, to: &str) {
        let path = self.scratch.path().join(name);
        let text = std::fs::read_to_string(&path).expect("it is readable");
        assert!(text.contains(from), "{name} has no `{from}`");
        std::fs::write(&path, text.replacen(from, to, 1)).expect("it is writable");
    }

    fn test(&self, arguments: &[&str]) -> (i32, serde_json::Value, String) {
        let (status, stdout, stderr) =
            outcome(&mut avastra(&[&["test", "--format", "json"], arguments].concat()));
        let line = stdout.lines().next().unwrap_or_else(|| panic!("{stderr}"));
        (status, serde_json::from_str(line).expect("it is JSON"), stderr)
    }
}

/// Failures of driving systems that others wrote, from their recorded answers alone. `sh python/adapters/run.sh NAME …` finds
/// others, should the engine or the protocol change.
#[test]
fn the_failures_of_strangers_replay() {
    let files = files(root().join("scenarios/strangers"), "ava");
    assert!(files.len() >= 8, "{files:?}");
    for file in files {
        let path = file.display().to_string();
        let told = done(&["replay", &path]);
        assert!(told.contains("holds, 6 claims confirmed"), "{told}");
        let text = std::fs::read_to_string(&file).expect("it is shipped");
        assert!(text.contains("ads: \"external\"") && text.contains("expect avoidable by"), "{path}");
        assert!(!text.contains("\\\"/"), "{path} names a place on a machine");
    }
    // Of the reports, too, which are played with their packages alone (python/adapters/reports/make.sh).
    let reports = files_below(root().join("python/adapters/reports"), "ava");
    assert!(!reports.is_empty());
    for file in reports {
        let path = file.display().to_string();
        done(&["check", &path]);
        let text = std::fs::read_to_string(&file).expect("it is shipped");
        assert!(!text.contains("\\\"/"), "{path} names a place on a machine");
    }
}

#[test]
fn a_suite_outlives_changes_of_its_space() {
    let found = Found::new(&[]);
    let (run, all) = (found.path("run"), found.scenarios as u64);
    let space = "space/avastra45.ava";

    found.edit(space, "/// Package 0.\n", "// looked at\n/// Package 0: no weather at all.\n");
    found.edit(space, "let speed_max = 20 m/s\n", "");
    found.edit(space, "/// A vehicle ahead, in", "let speed_max   =  20 m/s\n/// A vehicle ahead, in");
    found.edit(space, "expect count(actions) == 45\n", "");
    let (status, tested, stderr) = found.test(&[&run]);
    assert_eq!((status, tested["still_fails"].as_u64()), (4, Some(all)), "{stderr}");

    // A change of meaning that none of the scenarios meets: each must be accepted by name.
    found.edit(space, "let weight_mode = 1.0", "let weight_mode = 1.0\nodds Side { Left => 3 }");
    let (status, tested, stderr) = found.test(&[&run]);
    assert_eq!((status, tested["errors"].as_u64()), (2, Some(all)));
    let diagnostics: Vec<&str> = stderr.lines().filter(|line| line.contains("AV0110")).collect();
    assert_eq!(diagnostics.len(), 1, "one for the whole suite: {stderr}");
    let others = format!("the same holds for {} other scenario", all - 1);
    assert!(
        diagnostics[0].contains("changed or new: odds `Side`") && diagnostics[0].contains(&others),
        "{stderr}"
    );
    let before: Vec<String> = found.texts();
    let (status, tested, stderr) = found.test(&["--accept", &run]);
    assert_eq!(
        (status, tested["accepted"].as_u64(), tested["still_fails"].as_u64()),
        (4, Some(all), Some(all)),
        "{stderr}"
    );
    for (then, now) in before.iter().zip(found.texts()) {
        let differ = then.lines().zip(now.lines()).filter(|(then, now)| then != now).collect::<Vec<_>>();
        assert!(differ.len() == 1 && differ[0].0.starts_with("use "), "{differ:?}");
    }
    assert_eq!(found.test(&[&run]).0, 4);

    // Where the crash is another one now, nothing is accepted.
    found.edit(space, "fn lead(v: Speed) -> Length = v * 0.5 s", "fn lead(v: Speed) -> Length = v * 0.7 s");
    found.edit(space, "  Far => 40 m", "  Far => 41 m");
    let before = found.texts();
    let (status, tested, stderr) = found.test(&["--accept", &run]);
    assert!(stderr.contains("the space has changed since the scenario was written"), "{stderr}");
    let kept = tested["errors"].as_u64().expect("a number");
    assert!(status == 2 && kept > 0 && tested["accepted"].as_u64() == Some(all - kept), "{tested}");
    let unchanged = before.iter().zip(found.texts()).filter(|(then, now)| *then == now).count();
    assert_eq!(unchanged as u64, kept);
}

/// Of several crashes that a file claims each is asked by itself: a driver that avoids the first may make the second.
#[test]
fn a_scenario_of_two_crashes_is_mended_when_both_are_gone() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let space = root().join("tests/cases/spaces/two_crashes.ava").display().to_string();
    done(&["run", &space, "--ads", "blind", "--episodes", "1", "--repeat", "0", "--out", &path("run")]);
    let slow = "{perception: {detection_chance_max: 0, plenty_m: 0, ghosts_per_s: 0}, \
                planning: {cruise_mps: 9, sight_bounds_speed: false}}";
    std::fs::write(path("slow.yaml"), slow).expect("it is writable");
    let (status, stdout, stderr) =
        outcome(&mut avastra(&["test", &path("run"), "--ads", &path("slow.yaml")]));
    assert!(
        status == 4 && stdout.contains("the same obstacle is hit at 22.00 s"),
        "{status}: {stdout}{stderr}"
    );
    let (status, stdout, stderr) = outcome(&mut avastra(&["test", &path("run"), "--ads", "idm"]));
    assert!(status == 0 && stdout.contains("1 passed"), "{status}: {stdout}{stderr}");
}

/// What a suite takes over keeps the rights of its file, and a link in a run's folder is not written through.
#[test]
fn accepted_scenarios_keep_their_rights() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    let found = Found::new(&[]);
    let files = found.files("run/critical");
    let rights = |path: &PathBuf| std::fs::metadata(path).expect("it is there").mode() & 0o777;
    std::fs::set_permissions(&files[0], PermissionsExt::from_mode(0o600)).expect("it is ours");
    let mine = found.scratch.path().join("mine.ava");
    std::fs::copy(&files[1], &mine).expect("there is room");
    std::fs::remove_file(&files[1]).expect("it is ours");
    symlink(&mine, &files[1]).expect("a link can be made");
    let before = std::fs::read(&mine).expect("it is readable");
    found.edit(
        "space/avastra45.ava",
        "let weight_mode = 1.0",
        "let weight_mode = 1.0\nodds Side { Left => 3 }",
    );
    let (_, tested, stderr) = found.test(&["--accept", &found.path("run")]);
    assert_eq!(tested["accepted"].as_u64(), Some(found.scenarios as u64 - 1), "{stderr}{tested}");
    assert_eq!(rights(&files[0]), 0o600);
    assert!(files[1].is_symlink() && std::fs::read(&mine).expect("it is readable") == before);
}

/// A scenario is shown whatever happens to its space: as it was recorded if the run's copy of the space is there, otherwise as
/// it plays now. The banner says which.
#[test]
fn findings_can_always_be_looked_at() {
    let found = Found::new(&[]);
    let (run, space) = (found.path("run"), "space/avastra45.ava");
    let first = found.files("run/critical")[0].display().to_string();
    let strip = found.path("strip.svg");
    let looks: [&[&str]; 3] =
        [&["replay", &first], &["render", &first, "--strip", "-o", &strip], &["report", &run]];
    // A command that judges by the space refuses a scenario whose space has changed, and says what to do.
    let refused = |says: &str| {
        let commands: [&[&str]; 3] = [&["diagnose"], &["shrink"], &["export", "--to", "csv"]];
        for command in commands {
            let (status, stdout, stderr) = outcome(&mut avastra(&[command, &[&first]].concat()));
            let is_told = [says, "--review", "--self-contained"].iter().all(|wanted| stderr.contains(wanted));
            assert!(status == 2 && is_told, "{command:?}: {status} {stdout}{stderr}");
        }
    };
    let told = |wanted: &[i32], says: &str| {
        for look in looks {
            let (status, stdout, stderr) = outcome(&mut avastra(look));
            assert!(wanted.contains(&status) && stderr.contains(says), "{look:?}: {status} {stdout}{stderr}");
        }
    };
    // No scenario meets this change.
    found.edit(space, "let weight_mode = 1.0", "let weight_mode = 1.0\nodds Side { Left => 3 }");
    told(&[0], "changed or new: odds `Side`; shown as it was recorded, in the copy of its space at `");
    refused("write `use \"../space/avastra45.ava\"` with the same digest");
    // The advice holds.
    let text = std::fs::read_to_string(&first).expect("it is readable");
    let line = text.lines().find(|line| line.starts_with("use ")).expect("it uses its space");
    let digest = line.split_once("digest").expect("it has a digest").1;
    let moved = text.replace(line, &format!("use \"../space/avastra45.ava\" digest{digest}"));
    let in_copy = found.path("run/critical/in_the_copy.ava");
    std::fs::write(&in_copy, moved).expect("it is writable");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &in_copy]));
    assert!(status == 0 && !stderr.contains("odds `Side`"), "{stdout}{stderr}");
    std::fs::remove_file(&in_copy).expect("it is there");
    std::fs::rename(found.path("run/space"), found.path("away")).expect("the run keeps a copy");
    told(&[0], "odds `Side`; it still plays as it was recorded, to the bit");
    refused("no copy of them is kept beside the scenario");
    // The road is in all of them, and begins elsewhere now.
    found.edit("space/roads.ava", "start: lane 1/-1 at 105.88 m", "start: lane 1/-1 at 100 m");
    told(&[0, 3], "what is shown is what plays now, not what was recorded");
    let page = std::fs::read_to_string(found.path("run/report.html")).expect("it is written");
    assert!(page.contains("--self-contained"), "the banner stands on the page");
    // Without its space and the copy a scenario has no meaning.
    std::fs::remove_file(found.path(space)).expect("it is there");
    let (status, _, stderr) = outcome(&mut avastra(looks[0]));
    assert!(status == 2 && stderr.contains("cannot read"), "{status} {stderr}");
    std::fs::rename(found.path("away"), found.path("run/space")).expect("it goes back");
    told(&[0], "its space cannot be read any more, or has mistakes; shown as it was recorded");
}

/// The page of a folder lists the files that cannot be played, with the reason.
#[test]
fn the_page_of_a_folder_lists_what_cannot_be_played() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let text = "language 1\nuse \"none.ava\"\nscenario lost {\n  road: corner\n  steps { 0: wait() }\n}\n";
    std::fs::write(scratch.path().join("lost.ava"), text).expect("it is writable");
    let (status, _, stderr) = outcome(&mut avastra(&["report", &scratch.path().display().to_string()]));
    assert!(status == 2 && stderr.contains("cannot read"), "{status} {stderr}");
    let page = std::fs::read_to_string(scratch.path().join("report.html")).expect("it is written");
    assert!(page.contains("lost.ava cannot be played: 1 mistake in the source: cannot read"), "{page}");
}

/// Scenarios that say what is not so are shown with what differs in meaning, and written anew to the byte.
#[test]
fn a_review_says_what_differs_in_meaning() {
    let found = Found::new(&[]);
    let (run, before) = (found.path("run"), found.texts());
    let names: Vec<String> = found.files("run/critical").iter().map(|file| name(file)).collect();
    let edit = |number: usize, from: &str, to: &str| {
        let file = format!("run/critical/{}", names[number]);
        let path = found.scratch.path().join(&file);
        let text = std::fs::read_to_string(&path).expect("it is readable");
        assert!(text.contains(from), "{file} has no `{from}`");
        std::fs::write(&path, text.replace(from, to)).expect("it is writable");
    };
    let changes = |tested: &serde_json::Value| -> Vec<String> {
        let reviewed = tested["reviewed"].as_array().expect("a list");
        reviewed.iter().map(|one| one["change"].as_str().expect("a text").to_owned()).collect()
    };
    let between = |text: &str, from: &str, to: &str| -> String {
        let (_, rest) = text.split_once(from).expect("it is there");
        rest.split_once(to).expect("it ends").0.to_owned()
    };
    let (status, tested, stderr) = found.test(&["--review", &run]);
    assert!(status == 4 && changes(&tested).iter().all(|change| change == "same"), "{tested}{stderr}");

    // The first was made in an older world, where it crashed earlier; somebody wrote a comment into it.
    let time = between(&before[0], "expect collision with ", " s\n");
    let (first, _) = time.split_once(" at ").expect("it says when");
    edit(0, &format!("{time} s"), &format!("{first} at 1.00 s"));
    edit(0, " is hit at ", " is hit at 1.0 s, not at ");
    edit(0, "engine: \"plane/", "engine: \"plane/0");
    edit(0, "  road: corner", "  // looked at\n  road: corner");
    // The second crashed with somebody else.
    let obstacle = between(&before[1], "expect collision with ", " at ");
    edit(1, &obstacle, "npc#77");
    let wrong = found.texts();
    let (_, tested, _) = found.test(&[&run]);
    assert_eq!(tested["errors"], 1, "the world is another: {tested}");
    let of_second = |tested: &serde_json::Value| tested["scenarios"][1]["outcome"].clone();
    assert_eq!(of_second(&tested), "changed", "{tested}");
    let second = format!("{run}/critical/{}", names[1]);
    assert_eq!(found.test(&[&second]).0, 4, "another obstacle is hit than it claims");
    assert_eq!(found.test(&["--allow-changed", &second]).0, 0);
    let (status, tested, stderr) = found.test(&["--review", &run]);
    assert_eq!(changes(&tested)[..2], ["same finding, other time", "another crash"], "{stderr}");
    assert_eq!(of_second(&tested), "changed", "what it would claim is not what it claims: {tested}");
    let told = tested["reviewed"][0]["differences"].to_string();
    assert!(told.contains("in place of `plane/0") && told.contains("at 1.00 s: at "), "{told}");
    assert!(tested["reviewed"][1]["differences"].to_string().contains(&format!("{obstacle} is hit at")));
    assert_eq!((status, found.texts()), (4, wrong), "to look changes nothing");
    let (status, tested, _) = found.test(&["--accept", &run]);
    assert_eq!((status, tested["accepted"].as_u64()), (4, Some(2)), "{tested}");
    edit(0, "  // looked at\n", "");
    assert_eq!(found.texts(), before);

    // Of an author's file only the claim that does not hold is replaced: what was taken out stays out, comments and the ends
    // of lines stay.
    let collision = format!("  expect collision with {time} s\n");
    edit(0, &collision, "");
    edit(0, "  expect priority", "  // who had to wait\n  expect priority");
    edit(0, "\n", "\r\n");
    let authored = found.texts();
    let priority = between(&before[0], "expect priority == ", " with");
    let other = if priority == "other" { "none" } else { "other" };
    edit(0, &format!("expect priority == {priority} "), &format!("expect priority == {other} "));
    let (_, tested, _) = found.test(&["--accept", &run]);
    assert_eq!(changes(&tested)[0], "same finding, other verdict");
    assert_eq!(found.texts(), authored);
    edit(0, "\r\n", "\n");
    edit(0, "  // who had to wait\n", "");
    edit(0, "  expect counted", &format!("{collision}  expect counted"));
    assert_eq!(found.texts(), before);

    // Another driving system takes the place of the recorded one where it crashes, too; elsewhere nothing is written.
    let (_, tested, stderr) = found.test(&["--accept", "--ads", "reactive", &run]);
    let reviewed = tested["reviewed"].as_array().expect("a list");
    let files = found.files("run/critical");
    for ((then, now), file) in before.iter().zip(found.texts()).zip(&files) {
        let file = file.display().to_string();
        let review = reviewed.iter().find(|one| one["file"] == file.as_str());
        let is_kept = review.is_none_or(|one| one["change"] == "gone");
        assert_eq!((*then == now, now.contains("ads: \"reactive\"")), (is_kept, !is_kept), "{now}{stderr}");
        if !is_kept {
            assert!(!now.contains("profile"), "{now}");
            done(&["replay", &file]);
        }
    }
}

/// A crash that comes in spite of a step that has no place is no crash of the scenario.
#[test]
fn a_review_tells_that_a_step_is_illegal_though_it_crashes() {
    let found = Found::new(&[]);
    let file = &found.files("run/critical")[2];
    let text = std::fs::read_to_string(file).expect("it is readable");
    let (steps, rest) = text.split_once("\n  }\n  expect").expect("it has steps and claims");
    // Where the last step begins, no lane is on the right.
    let (before, last) = steps.rsplit_once("\n    ").expect("it has a step");
    let (number, _) = last.split_once(": ").expect("a step has a number");
    let overtake = "overtake(lane: Right, mode: Near, then: Change) with { vehicle: Jeep, colour: Pink, speed: 10 m/s, distance: 17 m }";
    let edited = format!("{before}\n    {number}: {overtake}\n  }}\n  expect{rest}");
    std::fs::write(file, &edited).expect("it is writable");
    let file = file.display().to_string();
    let (_, tested, stderr) = found.test(&[&file]);
    assert_eq!(tested["still_fails"], 1, "{tested}{stderr}");
    let (status, tested, stderr) = found.test(&["--accept", &file]);
    assert_eq!(
        (status, &tested["changed"], &tested["accepted"]),
        (0, &1.into(), &0.into()),
        "{tested}{stderr}"
    );
    assert_eq!(tested["reviewed"][0]["change"], "gone");
    let scenario = &tested["scenarios"][0];
    let reason = scenario["reason"].as_str().expect("a reason");
    assert!(scenario["outcome"] == "gone" && reason.contains("is not legal any more"), "{tested}");
    let told = done(&["replay", &file, "--ads", "idm"]);
    assert!(told.contains(&format!("\n  step {number} is refused: ")), "{told}");
    assert_eq!(std::fs::read_to_string(&file).expect("it is readable"), edited, "it is kept");
}

/// A driving system that no longer crashes drives another way, on which a step may have no place.
#[test]
fn a_review_tells_what_is_gone() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let run = scratch.path().join("run").display().to_string();
    let fault = "scenarios/ads/faults/planning_never_yields.yaml";
    let place = ["--road", "residential", "--episodes", "9", "--seed", "5", "--ads", fault];
    let space = "scenarios/avastra45.ava";
    done(&[&["run", space, "--out", &run][..], &place].concat());
    let review = ["test", "--format", "json", "--accept", "--ads", "idm", &run];
    let (status, stdout, stderr) = outcome(&mut avastra(&review));
    let tested: serde_json::Value = serde_json::from_str(stdout.trim_end()).expect("it is JSON");
    assert_eq!(
        (status, &tested["errors"], &tested["accepted"]),
        (0, &0.into(), &0.into()),
        "{tested}{stderr}"
    );
    let is_gone = |one: &serde_json::Value| one["outcome"] == "gone";
    let scenarios = tested["scenarios"].as_array().expect("a list");
    assert!(!scenarios.is_empty() && scenarios.iter().all(is_gone), "{tested}");
    assert_eq!(tested["changed"], scenarios.len(), "{tested}");
    assert_eq!(tested["reviewed"][0]["change"], "gone");
    let differences = tested["reviewed"][0]["differences"].to_string();
    assert!(differences.contains("is not legal any more, because cannot spawn"), "{tested}");
}

impl Found {
    fn texts(&self) -> Vec<String> {
        let read = |path: &PathBuf| std::fs::read_to_string(path).expect("it is readable");
        self.files("run/critical").iter().map(read).collect()
    }
}

/// The space's own verdict says which crashes count, even those in which the obstacle ran into the ego vehicle. The output does
/// not depend on the number of threads.
#[test]
fn a_suite_is_judged_by_the_verdict_of_its_space() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let (space, run, profile) = (path("struck.ava"), path("run"), "scenarios/ads/degraded.yaml");
    let used = root().join("scenarios/avastra45.ava");
    let text =
        format!("language 1\nuse \"{}\"\noverride verdict counted: collision and struck\n", used.display());
    std::fs::write(&space, text).expect("it is writable");
    let settings = ["--road", "crossroad", "--episodes", "40", "--seed", "5", "--traffic", "released"];
    let begin = ["run", &space, "--ads", profile, "--out", &run];
    done(&[&begin[..], &settings[..]].concat());
    let test = |more: &[&str]| {
        let (status, stdout, stderr) = outcome(&mut avastra(&[&["test", &run][..], more].concat()));
        assert_eq!(status, 4, "{stdout}{stderr}");
        stdout
    };
    let told = test(&["--jobs", "1"]);
    let all = told.lines().filter(|line| line.starts_with("still fails")).count();
    assert!(
        all > 0 && told.contains(&format!(": {all} still fail, 0 fixed, 0 passed, 0 changed, 0 not played")),
        "{told}"
    );
    assert_eq!(test(&["--jobs", "3"]), told);
    // The same profile by its file: now each is played a second time.
    assert_eq!(test(&["--ads", profile]), told);
}

#[test]
fn a_self_contained_run_is_a_folder_that_moves() {
    let found = Found::new(&["--self-contained"]);
    let moved = found.scratch.path().join("elsewhere/suite");
    std::fs::create_dir_all(moved.parent().expect("it has one")).expect("it is writable");
    std::fs::rename(found.scratch.path().join("run/critical"), &moved).expect("it moves");
    std::fs::remove_dir_all(found.scratch.path().join("space")).expect("it is there");
    let moved = moved.display().to_string();
    let (status, tested, stderr) = found.test(&[&moved]);
    assert_eq!((status, tested["still_fails"].as_u64()), (4, Some(found.scenarios as u64)), "{stderr}");
}

#[test]
fn packed_scenarios_are_a_folder_that_moves() {
    let found = Found::new(&[]);
    let names: Vec<String> =
        found.files("run/critical").iter().map(|file| file.display().to_string()).collect();
    let files: Vec<&str> = names.iter().map(String::as_str).collect();
    let suite = found.path("suite");
    // Twice: what is there with the same content is no obstacle.
    for _ in 0..2 {
        done(&[&["export", "--to", "ava"], &files[..], &["--out", &suite]].concat());
    }
    std::fs::remove_dir_all(found.scratch.path().join("space")).expect("it is there");
    let far = found.path("far");
    std::fs::rename(&suite, &far).expect("it moves");
    done(&["replay", &format!("{far}/{}", name(names[0].as_ref()))]);

    // What is shrunk stays apart, under a name of its own. Files and folders together are one suite.
    let first = format!("{far}/{}", name(names[0].as_ref()));
    let stdout = done(&["shrink", &first, "--format", "json"]);
    let told: serde_json::Value = serde_json::from_str(stdout.trim_end()).expect("it is JSON");
    let shrunk = &told["scenarios"][0];
    assert!(shrunk["scenario"].as_str().is_some_and(|name| name.ends_with("_shrunk")), "{shrunk}");
    assert!(shrunk["output"].as_str().is_some_and(|path| path.contains("far/shrunk/")), "{shrunk}");
    let copy = found.path("far/copy.ava");
    std::fs::copy(&first, &copy).expect("it is writable");
    let junit = found.path("junit.xml");
    let (_, tested, _) = found.test(&[&first, &copy, &first, &found.path("far/shrunk"), "--junit", &junit]);
    assert_eq!(tested["scenarios"].as_array().map(Vec::len), Some(3), "{tested}");
    let xml = std::fs::read_to_string(&junit).expect("it was written");
    let document = roxmltree::Document::parse(&xml).expect("it is well-formed");
    let cases = document.descendants().filter(|node| node.has_tag_name("testcase"));
    let mut names: Vec<_> = cases.map(|case| (case.attribute("classname"), case.attribute("name"))).collect();
    names.sort_unstable();
    let count = names.len();
    names.dedup();
    assert_eq!((count, names.len()), (3, 3), "{names:?}");
}

#[test]
fn what_is_packed_keeps_away_from_what_is_there() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name);
    for (name, size) in [("one", 1), ("two", 2)] {
        std::fs::create_dir(path(name)).expect("it is writable");
        let text = format!("language 1\nstate n: Int = 0\naction go() {{ set n = {size} }}\n");
        std::fs::write(path(name).join("space.ava"), text).expect("it is writable");
        let text = format!("language 1\nuse \"{}\"\n", path(name).join("space.ava").display());
        std::fs::write(path(name).join(format!("{name}.ava")), text).expect("it is writable");
    }
    let pack = |name: &str| {
        let file = path(name).join(format!("{name}.ava")).display().to_string();
        outcome(&mut avastra(&[
            "export",
            "--to",
            "ava",
            &file,
            "--out",
            &path("packed").display().to_string(),
        ]))
    };
    let (status, _, stderr) = pack("one");
    assert_eq!(status, 0, "{stderr}");
    // The absolute path became one that moves along.
    let text = std::fs::read_to_string(path("packed/one.ava")).expect("it was written");
    assert_eq!(text, "language 1\nuse \"space/space.ava\"\n");
    let (status, _, stderr) = pack("two");
    assert!(status == 1 && stderr.contains("with another content"), "{stderr}");

    // A folder is none of the files to name, but may hold some.
    fails(&["shrink", &path("one").display().to_string()], "one/*.ava`");

    // What fails leaves nothing behind, and a file that is named twice is one.
    let [one, two] = ["one/one.ava", "two/two.ava"].map(|name| path(name).display().to_string());
    let out = path("both/deep").display().to_string();
    let (status, _, stderr) = outcome(&mut avastra(&["export", "--to", "ava", &one, &two, "--out", &out]));
    assert!(status == 1 && !path("both").exists(), "{stderr}");
    let (status, stdout, stderr) =
        outcome(&mut avastra(&["export", "--to", "ava", &one, &one, "--out", &out]));
    assert!(status == 0 && stdout.contains("1 file with all that they use"), "{stdout}{stderr}");
}
