//! What is said of a finding is no more than is known of it: whose recurrence it is, what `shrink` traded, what `test` can say,
//! which goals were missed, and what the page shows beside a breach.

use std::path::Path;
use std::time::Duration;

use serde_json::Value;

use crate::cases::root;
use crate::command::{avastra, background, done, last_line, outcome};
use crate::external::profile;
use crate::report::index_of;
use crate::world::FLICKER;

const SPACE: &str = "scenarios/avastra45.ava";

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A kind is told by one of its own collisions that recurs, and with that collision's recurrence.
#[test]
fn the_recurrence_of_a_kind_is_that_of_a_collision_of_it() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = text(&scratch.path().join("run"));
    let run = ["run", "scenarios/avastra45_law.ava", "--ads", FLICKER, "--episodes", "30", "--seed", "3"];
    let place = ["--road", "crossroad", "--repeat", "8", "--out", &out, "--format", "json"];
    let found = last_line(&done(&[&run[..], &place].concat()));
    let database = rusqlite::Connection::open(format!("{out}/run.db")).expect("it is a database");
    // One of the two decides whether a finding recurs: 7 of 7.
    let query = "SELECT recurred, replays FROM collision JOIN episode USING (episode)
         WHERE collision.counted AND precrash = ?1 ORDER BY episode.episode = ?2 DESC, number";
    let mut query = database.prepare(query).expect("it is SQL");
    let groups = found["groups"].as_array().expect("a list");
    assert!(groups.len() > 1, "such sensors make crashes of several kinds");
    for group in groups {
        let words = (group["precrash"].as_str().expect("a name"), group["episode"].as_i64());
        let rows = query.query_map(words, |row| Ok((row.get(0)?, row.get(1)?))).expect("it is read");
        let all: Vec<(i64, i64)> = rows.collect::<Result<_, _>>().expect("all were played again");
        let recurring = all.iter().filter(|(recurred, _)| *recurred == 7).count();
        assert_eq!(
            (&group["count"], &group["tried"], &group["recurring"]),
            (&all.len().into(), &all.len().into(), &recurring.into()),
            "{group}"
        );
        let own = &group["recurrence"];
        let is_own = |of: &(i64, i64)| own["recurred"] == of.0 && own["replays"] == of.1;
        assert!(all.iter().any(is_own), "{group}: {all:?}");
        assert_eq!(own["recurred"] == 7, recurring > 0, "a kind recurs if one of it does: {group}");
    }
    // What is listed of a scenario is of one finding, and says of which.
    for of in found["found"].as_array().expect("a list") {
        let (episode, finding) = (of["episode"].as_i64(), of["finding"].as_str().expect("a name"));
        let table = if finding == "collision" { "collision" } else { "breach" };
        let name = if finding == "collision" { "verb <> ?2" } else { "requirement = ?2" };
        let query = format!("SELECT DISTINCT recurred FROM {table} WHERE episode = ?1 AND {name}");
        let mut query = database.prepare(&query).expect("it is SQL");
        let rows = query.query_map((episode, finding), |row| row.get(0)).expect("it is read");
        let all: Vec<Option<i64>> = rows.collect::<Result<_, _>>().expect("they are numbers");
        assert!(all.contains(&of["recurrence"]["recurred"].as_i64()), "{of}: {all:?}");
    }
}

/// An oncoming car that turns left late, at a gap drawn from 1 to 4 s.
const LATE_LEFT: &str = "language 1
road lights {
  map: \"MAP\"
  start: lane 11/-1 at 150 m
  goal: lane 13/1 at 100 m
  limit: 50 km/h
  ego_speed: 36 km/h
  set_speed: 36 km/h
  signal_phase: 0 s
  green: 60 s
  yellow: 4 s
}
manoeuvre turns_late(gap: Duration) {
  once npc.junction_ahead <= 6 m { speed: 0 m/s }
  once ego.light == Yellow and npc.ego_crossing_ahead <= ego.speed * gap {
    speed: 7 m/s, rate: 3 m/s^2, ignores: [Signals, RightOfWay, Ego]
  }
}
action turns_left(any gap: Duration in 1 s .. 4 s) {
  order light { colour: Yellow, at: (gap - 1 s) * 8.7 m/s }
  spawn Sedan as turner ahead 190 m { does: DriveOpposite, speed: 9 m/s, turn: Left, ignores: [Ego], then: turns_late(gap) }
}
episode { step: 60 s limit: 1 steps }
";

/// `shrink` halved the impact and the recurrence of such a crash for a rounder gap.
#[test]
fn a_rounder_number_is_not_worth_a_weaker_crash() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (space, out) = (text(&scratch.path().join("s.ava")), text(&scratch.path().join("run")));
    let map = text(&root().join("scenarios/roads/pre_crash.xodr"));
    std::fs::write(&space, LATE_LEFT.replace("MAP", &map)).expect("it is writable");
    done(&["run", &space, "--episodes", "12", "--out", &out]);
    let files = std::fs::read_dir(format!("{out}/critical")).expect("it crashes");
    let files: Vec<String> = files.map(|file| text(&file.expect("it is readable").path())).collect();
    let files: Vec<&str> = files.iter().filter(|file| file.ends_with(".ava")).map(String::as_str).collect();
    let shrunk = last_line(&done(&[&["shrink", "--format", "json"], &files[..]].concat()));
    let all = shrunk["scenarios"].as_array().expect("a list");
    assert!(all.len() >= 2, "{shrunk}");
    for one in all {
        let [before, after] = ["worth_before", "worth"].map(|name| &one[name]);
        for kept in ["kind", "harm", "priority"] {
            assert_eq!(before[kept], after[kept], "{one}");
        }
        // Nothing can be left out here, so all that changed are numbers.
        assert_eq!((&one["steps_before"], &one["actions_before"]), (&one["steps"], &one["actions"]), "{one}");
        let [impact, recurred] = [["impact_mps", ""], ["recurrence", "recurred"]].map(|[name, part]| {
            [before, after].map(|of| if part.is_empty() { &of[name] } else { &of[name][part] }.as_f64())
        });
        assert!(impact[0] <= impact[1] && recurred[0] <= recurred[1], "{one}");
        assert!(recurred[0].is_some(), "{one}");
    }
}

/// A crash that a toy was found with, and the command with which `test` plays it.
fn crash(scratch: &Path) -> String {
    let config = profile(scratch, &["--answer", "trajectory", "--blind"], "1", "");
    let out = text(&scratch.join("run"));
    let settings = ["--road", "corner", "--episodes", "2", "--seed", "1", "--ads", &config, "--out", &out];
    done(&[&["run", SPACE], &settings[..]].concat());
    let files = std::fs::read_dir(format!("{out}/critical")).expect("it crashes");
    let mut files = files.map(|file| text(&file.expect("it is readable").path()));
    files.find(|file| file.ends_with(".ava")).expect("it crashes")
}

#[test]
fn a_suite_says_by_what_it_was_played() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = crash(scratch.path());
    let test = |more: &[&str]| {
        let (status, stdout, stderr) =
            outcome(&mut avastra(&[&["test", &file, "--format", "json"], more].concat()));
        let line = stdout.lines().next().unwrap_or_else(|| panic!("{stderr}"));
        // What is said in words stands on standard error, and is no part of JSON.
        let (_, _, said) = outcome(&mut avastra(&[&["test", &file], more].concat()));
        (status, serde_json::from_str::<Value>(line).expect("it is JSON"), said)
    };
    // Without the program: its recorded answers say nothing of it as it is now.
    let (status, told, stderr) = test(&[]);
    assert_eq!((status, &told["recorded"], &told["still_fails"]), (4, &1.into(), &1.into()), "{told}");
    assert!(
        stderr.contains("1 of 1 scenario: played from recorded answers, and no program was asked"),
        "{stderr}"
    );
    let reason = told["scenarios"][0]["reason"].as_str().expect("in words");
    assert!(reason.contains("by its recorded answers, no program was asked"), "{told}");
    // The same program, mended and deterministic.
    let well = tempfile::tempdir().expect("a scratch directory");
    let well = profile(well.path(), &["--answer", "trajectory"], "1", "");
    let (_, told, stderr) = test(&["--ads", &well]);
    assert_eq!(
        (&told["fixed"], &told["passed"], &told["recorded"]),
        (&0.into(), &1.into(), &0.into()),
        "{stderr}"
    );
    // One clean play is no proof. Fifty-three under other noise are: the rate lies below a tenth.
    let said = |more: &[&str]| done(&[&["test", &file, "--ads", &well], more].concat());
    assert!(said(&[]).contains("53 clean replays more under other noise"));
    let (status, told, _) = test(&["--ads", &well, "--repeat", "60"]);
    assert_eq!(
        (status, &told["fixed"], &told["scenarios"][0]["again"]["replays"]),
        (0, &1.into(), &53.into())
    );
    assert!(said(&["--repeat", "20"]).contains("33 clean replays more"));
    let (_, told, _) = test(&["--ads", &well, "--repeat", "20", "--below", "0.3"]);
    assert_eq!((&told["fixed"], &told["scenarios"][0]["again"]["replays"]), (&1.into(), &14.into()));
    // One that need not repeat itself is not taken at its first word.
    let loose = tempfile::tempdir().expect("a scratch directory");
    let loose = profile(loose.path(), &["--answer", "trajectory", "--not-deterministic"], "1", "");
    let (status, told, _) = test(&["--ads", &loose]);
    let one = &told["scenarios"][0];
    assert_eq!(
        (status, &told["fixed"], &told["passed"], &one["again"]["replays"]),
        (0, &0.into(), &1.into(), &20.into())
    );
    assert!(
        one["reason"].as_str().is_some_and(|why| why
            .contains("fails in 0 of 20 (0.00 to 0.22) under other noise; the program is not deterministic")),
        "{one}"
    );
    let blind = tempfile::tempdir().expect("a scratch directory");
    let toy = ["--answer", "trajectory", "--not-deterministic", "--blind"];
    let (status, told, _) = test(&["--ads", &profile(blind.path(), &toy, "1", "")]);
    assert_eq!((status, &told["still_fails"], &told["scenarios"][0]["again"]), (4, &1.into(), &Value::Null));
    // Another driving system mends nothing.
    let (_, told, stderr) = test(&["--ads", "modular"]);
    let one = &told["scenarios"][0];
    assert!(one["outcome"] != "fixed" && one["found_with"] == "toy", "{told}");
    assert!(stderr.contains("1 of 1 scenario: found with another driving system (`toy`)"), "{stderr}");
}

#[test]
fn a_stall_of_the_machine_is_no_failure_of_the_driving_system() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let quick = "  timeouts: { step: 0.3 }\n";
    let config = profile(scratch.path(), &["--misbehave", "late-once"], "0.6", quick);
    let out = text(&scratch.path().join("run"));
    let run = ["run", SPACE, "--road", "corner", "--ads", &config, "--episodes", "2", "--jobs", "1"];
    let told = last_line(&done(&[&run[..], &["--format", "json", "--out", &out]].concat()));
    assert_eq!(told["totals"]["failed"], 0, "{told}");
    let thinking = &told["thinking"];
    assert!(thinking["late"].as_u64() >= Some(2), "one in each episode: {thinking}");
    assert!(
        thinking["most_s"].as_f64() >= Some(0.6) && thinking["median_s"].as_f64() < Some(0.3),
        "{thinking}"
    );
    let told = done(&["run", "--resume", &out]);
    assert!(!told.contains("thought"), "nothing was asked: {told}");
}

#[test]
fn an_estimate_says_which_goals_it_missed_and_what_its_rates_are() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = text(&scratch.path().join("estimate"));
    let place = ["--road", "corner", "--episodes", "4", "--parts", "4", "--out", &out];
    let goals = ["--hours", "50", "--precision", "0.1"];
    let (status, stdout, stderr) =
        outcome(&mut avastra(&[&["estimate", SPACE], &place[..], &goals].concat()));
    assert_eq!(status, 0, "{stderr}");
    let is_told =
        ["the estimate missed its goals: a precision of 0.1 was wanted", "50 h were wanted", "--parts"];
    assert!(is_told.iter().all(|text| stderr.contains(text)), "{stderr}");
    assert!(stdout.contains("no rates on the road"), "{stdout}");
    let page = text(&scratch.path().join("page.html"));
    done(&["report", &out, "--out", &page]);
    let overview = index_of(&std::fs::read_to_string(&page).expect("it was written"))["overview"].clone();
    assert_eq!(overview["estimate"]["missed_goals"].as_array().map(Vec::len), Some(2), "{overview}");
    assert!(overview["frame"].as_str().is_some_and(|text| text.contains("no rates on the road")));
}

/// The page has what the terminal has: each requirement with its formula, what was never asked, and breaches in the headline.
#[test]
fn a_page_shows_the_requirements_of_its_run() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = text(&scratch.path().join("run"));
    let run = ["run", "tests/cases/spaces/requirements.ava", "--road", "corner", "--episodes", "2"];
    let told = last_line(&done(&[&run[..], &["--ads", "idm", "--out", &out, "--format", "json"]].concat()));
    let page = text(&scratch.path().join("page.html"));
    done(&["report", &out, "--out", &page]);
    let html = std::fs::read_to_string(&page).expect("it was written");
    let index = index_of(&html);
    let shown = index["overview"]["requirements"].as_array().expect("a list");
    let listed = told["requirements"].as_array().expect("a list");
    assert_eq!(shown.len(), listed.len());
    for (shown, listed) in shown.iter().zip(listed) {
        for (name, value) in listed.as_object().expect("an object") {
            assert_eq!(&shown[name], value, "{name}");
        }
        let formula = shown["formula"].as_str().expect("the space is there");
        assert!(
            formula.contains("require ") && formula.contains(listed["requirement"].as_str().unwrap()),
            "{formula}"
        );
    }
    let breach = index["scenarios"]
        .as_array()
        .and_then(|all| all.iter().find_map(|one| one["summary"]["breaches"].get(0)));
    let formula = breach.expect("idm breaches something")["formula"].as_str().expect("a text");
    assert!(formula.starts_with("require ") || formula.starts_with("optional require "), "{formula}");
}

#[test]
fn a_policy_says_that_it_plays_where_it_has_not_learned() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let run = |more: &[&str]| {
        let out = text(&scratch.path().join(format!("run{}", more.join("").replace('/', ""))));
        let policy = ["run", "--policy", "policies/corner.ava", "--episodes", "1", "--out", &out];
        let (_, stdout, stderr) = outcome(&mut avastra(&[&policy[..], more].concat()));
        stdout + &stderr
    };
    let same = "scenarios/ads/faults/planning_never_yields.yaml";
    assert!(!run(&["--road", "corner", "--ads", same]).contains("was trained"));
    let told = run(&["--road", "crossroad", "--ads", "idm", "--traffic", "released"]);
    for wanted in
        ["was trained on corner, and plays on crossroad", "and plays against idm", "and plays with released"]
    {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
    let told = run(&["--ads", "modular"]);
    assert!(told.contains("and plays against it with its default profile"), "{told}");
    // Without a name, it plays as it was trained.
    let told = run(&[]);
    assert!(told.contains("planning.never_yields: true") && told.contains(" on corner, "), "{told}");
    assert!(!told.contains("was trained"), "{told}");
}

/// A scheduler ends a command by SIGTERM: what was played is summed up, and can be gone on with.
#[test]
fn a_terminated_run_prints_its_summary() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run");
    let child = background(&["run", SPACE, "--episodes", "400", "--jobs", "1", "--out", &text(&out)]);
    for _ in 0..1200 {
        if out.join("run.db").is_file() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    std::thread::sleep(Duration::from_millis(700));
    // SAFETY: a signal to a child that has not been waited for.
    unsafe { libc::kill(child.id() as i32, libc::SIGTERM) };
    let output = child.wait_with_output().expect("it ends");
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(output.status.code(), Some(130), "{stdout}{stderr}");
    assert!(stdout.contains(" of simulated time") && stderr.contains("--resume"), "{stdout}{stderr}");
}

/// What waits for SIGTERM blocks it in its threads, and a driving system must end by it all the same.
#[test]
fn a_driving_system_is_started_with_no_signal_blocked() {
    // Its first line is no message, so it is shown.
    let command = ["run", SPACE, "--road", "corner", "--ads", "grep SigBlk /proc/self/status"];
    let (_, stdout, stderr) = outcome(&mut avastra(&command));
    assert!(stderr.contains("SigBlk: 0000000000000000"), "{stdout}{stderr}");
}
