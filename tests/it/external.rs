//! Driving systems outside the program: every misbehaviour is a finding, the run goes on, and nothing is left behind.
//!
//! They are driven by `avastra ads toy`, so the tests need nothing but the program itself.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::path::Path;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

use crate::cases::{copy_space, root, texts};
use crate::command::{avastra, done, done_in, fails, last_line, outcome};

const SPACE: &str = "scenarios/avastra45.ava";

/// A profile with a toy, written into a folder. `late_s` is its mark in the list of processes.
pub fn profile(folder: &Path, toy: &[&str], late_s: &str, more: &str) -> String {
    let mut words = vec![cargo_bin("avastra").display().to_string()];
    words.extend(["ads", "toy", "--late", late_s].into_iter().chain(toy.iter().copied()).map(str::to_owned));
    let text = format!("ads:\n  command: {}\n{more}", serde_json::to_string(&words).unwrap());
    let path = folder.join("profile.yaml");
    std::fs::write(&path, text).expect("a profile is written");
    path.display().to_string()
}

/// Processes whose command line holds a word.
fn running(word: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc").expect("this is Linux").flatten() {
        let line = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        let line = String::from_utf8_lossy(&line).replace('\0', " ");
        if line.contains(word) && line.contains("ads toy") {
            found.push(line);
        }
    }
    found
}

/// A run of some episodes on one road: its status, its result and what it wrote on standard error.
fn run(config: &str, out: &Path, more: &[&str]) -> (i32, Value, String) {
    let out = out.display().to_string();
    let begin = ["run", SPACE, "--road", "corner", "--ads", config, "--out", &out, "--format", "json"];
    let (status, stdout, stderr) = outcome(&mut avastra(&[&begin[..], more].concat()));
    (status, last_line(&stdout), stderr)
}

/// The words of a training of some episodes on one road.
fn training<'a>(episodes: &'a str, config: &'a str, out: &'a str) -> Vec<&'a str> {
    let how = ["--road", "corner", "--episodes", episodes, "--ads", config, "--out", out];
    [&["train", SPACE, "--agent", "bandit"][..], &how].concat()
}

#[test]
fn every_misbehaviour_is_a_finding_and_leaves_nothing_behind() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let quick = "  timeouts: { step: 0.5, close: 2 }\n";
    // A flood takes as long as it takes to read 64 MiB.
    let patient = "  timeouts: { step: 60 }\n";
    let cases = [
        ("crash-in-episode", "ads_crash", "exited", 3, quick),
        ("crash-at-reset", "ads_crash", "exited", 1, quick),
        ("hang", "ads_timeout", "no_answer", 3, quick),
        ("garbage", "ads_protocol", "not_json", 3, quick),
        ("nan", "ads_protocol", "not_finite", 3, quick),
        ("late", "ads_timeout", "no_answer", 3, quick),
        ("twice", "ads_protocol", "twice", 3, quick),
        ("early", "ads_protocol", "unasked", 3, quick),
        ("wrong-seq", "ads_protocol", "wrong_seq", 3, quick),
        ("huge-line", "ads_protocol", "too_long", 3, quick),
        ("close-stdout", "ads_crash", "closed", 3, quick),
        ("flood-stderr", "ads_flood", "stderr", 3, patient),
        ("error", "ads_error", "reported", 3, quick),
    ];
    for (index, (how, kind, problem, times, more)) in cases.into_iter().enumerate() {
        let mark = format!("1.{}{index:03}", std::process::id());
        let folder = scratch.path().join(how);
        std::fs::create_dir(&folder).unwrap();
        let config = profile(&folder, &["--misbehave", how], &mark, more);
        let settings = ["--episodes", "3", "--jobs", "1", "--fail-on", "collision"];
        let (status, result, stderr) = run(&config, &folder.join("run"), &settings);
        let counted = result["totals"]["counted"].as_i64().expect("a number");
        assert_eq!(status, if counted > 0 { 4 } else { 5 }, "{how}: {stderr}\n{result}");
        assert_eq!(result["totals"]["episodes"], 3, "{how}: no episode is lost: {result}");
        assert_eq!(result["totals"]["failed"], times, "{how}: {result}");
        let found = &result["failures"][0];
        assert_eq!((&found["kind"], &found["problem"]), (&kind.into(), &problem.into()), "{how}: {result}");
        assert_eq!(result["failures"].as_array().map(Vec::len), Some(1), "{how}: {result}");
        assert_eq!(running(&mark), Vec::<String>::new(), "{how} left a process");
        let name = found["scenario"].as_str().expect("a name");
        let told =
            std::fs::read_to_string(folder.join(format!("run/failures/{name}.txt"))).expect("it is told");
        assert!(told.contains(kind) && told.contains(problem), "{how}: {told}");
        // The finding replays, from the recorded answers and without the program.
        let scenario = folder.join(format!("run/failures/{name}.ava")).display().to_string();
        done(&["replay", &scenario]);
        if how == "crash-at-reset" {
            // A failure before the first step leaves a scenario, too, which passes once the crash is mended.
            let well = profile(&folder, &[], "1", "");
            let (status, stdout, stderr) = outcome(&mut avastra(&["test", &scenario, "--ads", &well]));
            assert!(status == 0 && stdout.contains("1 passed"), "{stdout}{stderr}");
        }
    }
}

/// A driving system that answers as it should until its third step, and then reports an error.
const REPORTING: &str = r#"#!/bin/sh
answer() { printf '%s\n' "$1"; }
while read -r line; do
  case $line in
    '{"type":"init"'*) answer '{"type":"ready","protocol":"avastra-ads/1","name":"mine","version":"1","answer":"acceleration","deterministic":true}' ;;
    '{"type":"map"'* | '{"type":"reset"'*) answer '{"type":"ready"}' ;;
    '{"type":"step","seq":3,'*) answer '{"type":"error","message":MESSAGE}' ;;
    '{"type":"step"'*) seq=${line#*'"seq":'}; answer "{\"type\":\"acceleration\",\"seq\":${seq%%,*},\"accel\":0.5}" ;;
    '{"type":"close"'*) exit 0 ;;
  esac
done
"#;

/// A message may hold what would be a declaration, the end of a comment, a line of the output or a command to continuous
/// integration.
#[test]
fn what_a_program_reports_is_neither_code_nor_a_line() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let forged = "require injected: ego.speed <= 1 m/s";
    let messages = [
        format!("x\n{forged}\n///"),
        format!("x\r\n{forged}\r\n*/ {forged}"),
        format!("x\u{2028}{forged}\u{85}{forged}\u{202e}\r{forged}"),
        "x\nuse \"injected.ava\"\n///".to_owned(),
        "::error title=forged::x\n::error::forged\n ##vso[task.forged]\n##[error]forged".to_owned(),
        "Traceback (most recent call last):\n  File \"drive.py\", line 3, in <module>\n\u{1b}[2JKeyError: 'x'\n".to_owned(),
    ];
    for (number, message) in messages.iter().enumerate() {
        let folder = scratch.path().join(number.to_string());
        std::fs::create_dir(&folder).expect("it is writable");
        let program = folder.join("drive.sh");
        let message = serde_json::to_string(message).expect("it is a text").replace('\'', r"\u0027");
        std::fs::write(&program, REPORTING.replace("MESSAGE", &message)).expect("it is writable");
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).expect("it is ours");
        let (program, out) = (program.display().to_string(), folder.join("run").display().to_string());
        let words = ["run", SPACE, "--road", "corner", "--ads", &program, "--out", &out, "--episodes", "1"];
        let (_, stdout, stderr) = outcome(&mut avastra(&words));
        let said = format!("{stdout}{stderr}");
        assert!(stdout.contains("ads_error (reported)"), "{said}");
        let is_forged = |line: &&str| {
            let begins = ["require", "use", "::", "KeyError", "File"];
            begins.iter().any(|word| line.trim_start().starts_with(word)) || line.contains("##")
        };
        assert_eq!(said.lines().find(is_forged), None, "{said}");
        assert!(!said.contains(|c: char| c != '\n' && c.is_control() || c == '\u{2028}'), "{said:?}");
        let scenario = folder.join("run/failures/corner_0000.ava");
        let text = std::fs::read_to_string(&scenario).expect("it is written");
        let code = |line: &&str| !line.trim_start().starts_with("//");
        assert!(!text.lines().filter(code).any(|line| line.contains("injected")), "{text}");
        let scenario = scenario.display().to_string();
        done(&["check", &scenario]);
        done(&["fmt", "--check", &scenario]);
        done(&["replay", &scenario]);
    }
}

/// A program that drives once, and fails whenever its finding is played again.
#[test]
fn a_finding_that_cannot_be_played_again_does_not_pass() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (mark, program) = (scratch.path().join("has_driven"), scratch.path().join("drive.sh"));
    let ready = r#"answer '{"type":"ready"}' ;;"#;
    let once = format!(
        r#"if [ -e {0} ]; then answer '{{"type":"error","message":"again"}}'; else touch {0}; {ready}"#,
        mark.display()
    );
    let once = once.replace(" ;;", "; fi ;;");
    let text = REPORTING.replace("\"seq\":3,", "\"seq\":-1,").replace(
        &format!("'{{\"type\":\"map\"'* | '{{\"type\":\"reset\"'*) {ready}"),
        &format!("'{{\"type\":\"map\"'*) {ready}\n    '{{\"type\":\"reset\"'*) {once}"),
    );
    std::fs::write(&program, text).expect("it is writable");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).expect("it is ours");
    let program = program.display().to_string();
    let settings = ["--episodes", "1", "--jobs", "1", "--repeat", "20", "--fail-on", "recurring"];
    let (status, result, stderr) = run(&program, &scratch.path().join("run"), &settings);
    let totals = &result["totals"];
    assert!(totals["findings"].as_i64() > Some(0) && totals["replayed"] == 0, "{result}{stderr}");
    assert_eq!((status, &totals["failed"]), (5, &0.into()), "{result}{stderr}");
    assert!(result["failed_replays"].as_i64() > Some(0), "{result}");
}

#[test]
fn what_cannot_be_reached_any_more_is_given_up() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let mark = scratch.path().join("started");
    let once = format!("if [ -e {0} ]; then exit 9; fi; touch {0}", mark.display());
    let planner = script(scratch.path(), &once, "--misbehave crash-in-episode");
    let out = scratch.path().join("run").display().to_string();
    let begin = ["run", SPACE, "--road", "corner", "--ads", &planner, "--out", &out];
    let more = ["--episodes", "8", "--jobs", "1", "--format", "json"];
    let (status, stdout, stderr) = outcome(&mut avastra(&[&begin[..], &more].concat()));
    let result = last_line(&stdout);
    // One crash on the way and three failed starts: the other episodes are left for `--resume`.
    assert_eq!((status, &result["totals"]["episodes"]), (5, &4.into()), "{stderr}{result}");
    assert!(result["error"].as_str().is_some_and(|error| error.contains("--resume")), "{result}");
    let failures = result["failures"].as_array().expect("a list");
    let told: Vec<_> = failures.iter().map(|found| (&found["times"], found["detail"].as_str())).collect();
    assert_eq!(told.len(), 2, "a crash on the way is no crash at the start: {result}");
    assert_eq!(told[0].0, 3, "{result}");
    assert!(told[0].1.is_some_and(|detail| detail.starts_with("at init")), "{result}");
    script(scratch.path(), "", "");
    let (status, stdout, stderr) =
        outcome(&mut avastra(&["run", "--resume", &out, "--jobs", "1", "--format", "json"]));
    let result = last_line(&stdout);
    assert_eq!((status, &result["totals"]["episodes"]), (0, &8.into()), "{stderr}{result}");
    assert_eq!(result["totals"]["failed"], 4, "{result}");
}

#[test]
fn a_false_claim_to_be_deterministic_is_noticed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--misbehave", "forgetful"], "1", "");
    let out = scratch.path().join("run");
    let (status, result, stderr) = run(&config, &out, &["--episodes", "1"]);
    assert_eq!((status, &result["reproducible"]), (0, &false.into()), "{stderr}{result}");
    // `test` asks the first scenario again, too; a well-behaved program passes.
    let dies = tempfile::tempdir().expect("a scratch directory");
    let dies_config = profile(dies.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let failed = dies.path().join("run");
    run(&dies_config, &failed, &["--episodes", "1"]);
    let failed = failed.display().to_string();
    let well = tempfile::tempdir().expect("a scratch directory");
    let well = profile(well.path(), &[], "1", "");
    // One that answers otherwise in every third play is noticed, too.
    let fickle = tempfile::tempdir().expect("a scratch directory");
    let fickle = profile(fickle.path(), &["--misbehave", "fickle"], "1", "");
    for (program, is_said) in [(&config, true), (&fickle, true), (&well, false)] {
        let (status, stdout, stderr) = outcome(&mut avastra(&["test", &failed, "--ads", program]));
        assert_eq!(status, 0, "{stdout}{stderr}");
        assert_eq!(stderr.contains("says that it is deterministic and is not"), is_said, "{stderr}");
    }
}

#[test]
fn a_training_and_a_study_say_that_the_driving_system_failed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let out = scratch.path().join("train").display().to_string();
    let (status, stdout, stderr) = outcome(&mut avastra(&training("2", &config, &out)));
    assert_eq!(status, 5, "nothing was learned of it: {stdout}{stderr}");
    assert!(stderr.contains("warning: the driving system failed in 17 of 17 episodes"), "{stdout}{stderr}");
    assert!(
        stdout.contains("2 × ads_crash (exited)") && stdout.contains("learned: 15 × ads_crash"),
        "{stdout}"
    );
    let found = std::fs::read_dir(scratch.path().join("train/failures")).expect("they are written").count();
    assert_eq!(found, 51, "17 scenarios, their answers, and what happened");

    let space = root().join(SPACE).display().to_string();
    let study = serde_json::json!({
        "space": space, "roads": ["corner"], "ads_config": config, "evaluation": { "episodes": 2, "seeds": 1 },
        "agents": [{ "name": "random", "repeats": 2 }],
    });
    let file = scratch.path().join("study.yaml");
    std::fs::write(&file, study.to_string()).unwrap();
    let out = scratch.path().join("study");
    let arguments =
        ["study", &file.display().to_string(), "--out", &out.display().to_string(), "--format", "json"];
    let (status, stdout, stderr) = outcome(&mut avastra(&arguments));
    let result = last_line(&stdout);
    assert_eq!((status, result.get("results")), (5, None), "{stderr}{result}");
    let cells = result["failures"].as_array().expect("the cells");
    assert_eq!(cells.len(), 2, "{result}");
    for cell in cells {
        assert_eq!(cell["evaluated"], serde_json::json!({ "ads_crash": 2 }), "{result}");
    }
    assert!(!out.join("results.json").exists(), "it would be read as if all had been driven");
}

#[test]
fn what_cannot_be_started_is_an_error_with_its_reason() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--misbehave", "crash-at-start"], "1", "");
    let out = scratch.path().join("run");
    let (status, result, _) = run(&config, &out, &["--episodes", "2"]);
    let error = result["error"].as_str().expect("an error");
    assert_eq!(status, 1);
    assert!(error.contains("ads_crash (exited) at init") && error.contains("exit status 1"), "{error}");
    assert!(error.contains("as it was asked to"), "its standard error is shown: {error}");
    for (command, word) in [
        ("/no/such/program", "not_started"),
        ("tcp:127.0.0.1:1", "not_reached"),
        ("unix:/no/such/socket", "not_reached"),
        ("./planner 'unclosed", "not closed"),
    ] {
        let all = ["run", SPACE, "--ads", command, "--episodes", "1"];
        fails(&all, word);
    }
}

/// Episodes of a run: number, end and trace.
fn episodes(directory: &Path) -> Vec<(i64, String, String)> {
    let database = rusqlite::Connection::open(directory.join("run.db")).expect("it is a database");
    let mut rows = database.prepare("SELECT episode, ended, trace FROM episode ORDER BY episode").unwrap();
    let rows = rows.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
    rows.collect::<Result<_, _>>().unwrap()
}

#[test]
fn threads_and_processes_change_nothing_and_crashes_replay_with_and_without_the_program() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--answer", "trajectory", "--blind"], "1", "");
    let settings = ["--episodes", "2", "--seed", "4"];
    let [one, two] = ["1", "2"].map(|jobs| {
        let out = scratch.path().join(jobs);
        let (status, result, stderr) = run(&config, &out, &[&settings[..], &["--jobs", jobs]].concat());
        assert_eq!((status, &result["totals"]["failed"]), (0, &0.into()), "{stderr}");
        out
    });
    assert_eq!(episodes(&one), episodes(&two));
    let emitted = texts(one.join("critical"));
    assert_eq!(emitted, texts(two.join("critical")));
    let scenarios: Vec<String> = emitted.into_keys().filter(|name| name.ends_with(".ava")).collect();
    assert!(!scenarios.is_empty(), "who drives on whatever is in the way collides");
    let path = one.join("critical").join(&scenarios[0]).display().to_string();
    for more in [&[][..], &["--ads", &config]] {
        let stdout = done(&[&["replay", &path][..], more].concat());
        assert!(stdout.contains("confirmed"), "{more:?}: {stdout}");
    }
    // Who dies on the way has not been cured of the crash.
    let dies = tempfile::tempdir().expect("a scratch directory");
    let dies = profile(dies.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let (status, stdout, stderr) = outcome(&mut avastra(&["test", &path, "--ads", &dies]));
    assert!(status == 4 && stdout.contains("ads failed"), "{status}: {stdout}{stderr}");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &path, "--ads", &dies]));
    assert!(status == 5 && stdout.contains("it failed at step"), "{status}: {stdout}{stderr}");
    // It is made small with the program; what only the program can show is not tried without it.
    let small = scratch.path().join("small.ava").display().to_string();
    let told = last_line(&done(&["shrink", &path, "--ads", &config, "--out", &small, "--format", "json"]));
    let told = &told["scenarios"][0];
    // Each try leaves the known answers somewhere in the middle, and shows a process what came before.
    assert!(told["actions"].as_u64() < told["actions_before"].as_u64(), "{told}");
    let claims_minimal = std::fs::read_to_string(&small).unwrap().contains("expect minimal");
    for (more, is_tried) in [(&[][..], false), (&["--ads", &config], true)] {
        let stdout = done(&[&["replay", &small][..], more].concat());
        assert_eq!(stdout.contains("not tried"), claims_minimal && !is_tried, "{more:?}: {stdout}");
    }
    // Changed answers are noticed, and missing ones are asked for.
    let answers = Path::new(&path).with_extension("answers.jsonl");
    let text = std::fs::read_to_string(&answers).unwrap();
    std::fs::write(&answers, text.replacen("\"v\":", "\"v\":1", 1)).unwrap();
    fails(&["replay", &path], "changed");
    std::fs::remove_file(&answers).unwrap();
    fails(&["replay", &path], "--ads");
}

/// A scenario ends with its crash, and its answers are those of the whole episode: a review plays only their beginning.
#[test]
fn a_review_keeps_recorded_answers_that_hold() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    copy_space(&scratch.path().join("space"));
    let config = profile(scratch.path(), &["--answer", "trajectory", "--blind"], "1", "");
    let (space, out) = (path("space/avastra45.ava"), path("run"));
    let settings = ["--road", "corner", "--episodes", "2", "--seed", "1", "--ads", &config, "--out", &out];
    done(&[&["run", &space], &settings[..]].concat());
    let critical = scratch.path().join("run/critical");
    let before = texts(&critical);
    let scenario = before.keys().find(|name| name.ends_with(".ava")).expect("it crashes").clone();
    let file = critical.join(&scenario).display().to_string();
    let review = |more: &[&str], wanted: &str| {
        for how in ["--review", "--accept"] {
            let (status, stdout, stderr) = outcome(&mut avastra(&[&["test", how, &out], more].concat()));
            let is_played = stdout.contains(wanted)
                && stdout.contains("1 still fail, 0 fixed, 0 passed, 0 changed, 0 not");
            assert!(status == 4 && is_played, "{how} {more:?}: {status}: {stdout}{stderr}");
        }
    };
    let same = format!("{scenario}: same\n");
    for more in [&[][..], &["--ads", &config]] {
        review(more, &same);
        assert_eq!(texts(&critical), before, "{more:?}: nothing changed, so nothing is written");
    }
    // The scenario does not meet this change of its space, so only the digest of the space is another.
    let text = std::fs::read_to_string(&space).expect("it is readable");
    let changed = text.replacen("let weight_mode = 1.0", "let weight_mode = 1.0\nodds Side { Left => 3 }", 1);
    assert_ne!(text, changed);
    std::fs::write(&space, changed).expect("it is writable");
    review(&[], &same);
    let after = texts(&critical);
    let lines =
        before.values().flat_map(|text| text.lines()).zip(after.values().flat_map(|text| text.lines()));
    let differ: Vec<_> = lines.filter(|(then, now)| then != now).collect();
    assert!(differ.len() == 1 && differ[0].1.starts_with("use "), "{differ:?}");
    done(&["replay", &file]);
    // With another driving system the answers are others, and become those of the scenario.
    let other = tempfile::tempdir().expect("a scratch directory");
    let other = profile(other.path(), &["--answer", "acceleration", "--blind"], "1", "");
    review(&["--ads", &other], "");
    assert_ne!(texts(&critical), after);
    done(&["replay", &file]);
}

#[test]
fn a_finding_keeps_what_the_program_was_told_and_said() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let program = cargo_bin("avastra").display().to_string();
    let script = format!("echo 'up \u{1b}[2J' >&2\nexec '{program}' ads toy --answer trajectory --blind\n");
    std::fs::write(path("planner.sh"), script).expect("a script is written");
    let command = format!("sh {}", path("planner.sh"));
    let run =
        ["run", SPACE, "--road", "corner", "--episodes", "2", "--seed", "1", "--jobs", "1", "--repeat", "0"];
    done(&[&run[..], &["--ads", &command, "--out", &path("run")]].concat());
    let files = texts(scratch.path().join("run/critical"));
    let (name, text) = files.iter().find(|(name, _)| name.ends_with(".ava")).expect("it crashes");
    // The one process wrote when it came up, and nothing in the second episode.
    let said = files.get("corner_0000.stderr.txt").expect("it wrote something");
    assert_eq!(said, "reset: up \u{fffd}[2J\n");
    assert_eq!(files.keys().filter(|name| name.ends_with(".stderr.txt")).count(), 1);

    let file = path(&format!("run/critical/{name}"));
    let record = |more: &[&str]| {
        outcome(&mut avastra(&[&["replay", &file, "--record", &path("told.jsonl")], more].concat()));
        let told = std::fs::read_to_string(path("told.jsonl")).expect("it is written");
        told.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect::<Vec<Value>>()
    };
    let told = record(&[]);
    assert_eq!(
        (&told[0]["format"], &told[1]["question"]["type"]),
        (&"avastra-evidence/1".into(), &"reset".into())
    );
    let answers = files.get(&name.replace(".ava", ".answers.jsonl")).expect("they lie beside it");
    assert!(
        told.len() > 100 && told.len() <= answers.lines().count(),
        "the episode went on after the scenario"
    );
    for (number, line) in told[2..].iter().enumerate() {
        let question = &line["question"];
        assert_eq!((&question["type"], &question["seq"]), (&"step".into(), &number.into()));
        assert_eq!(line["outcome"]["answer"]["seq"], question["seq"]);
        let npcs = line["npcs"].as_object().map_or(0, serde_json::Map::len);
        assert_eq!(
            npcs,
            question["objects"].as_array().expect("a list").len(),
            "each object is known: {line}"
        );
        assert!(line["took_ms"].is_null(), "nobody was asked");
    }
    // The road user that is hit was told of.
    let hit = text
        .split("expect collision with npc#")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .expect("a number");
    assert!(told.last().expect("a line")["npcs"].to_string().contains(&format!(":{hit}")), "{text}");
    let asked = record(&["--ads", &command]);
    assert!(
        asked[2]["took_ms"].as_f64() > Some(0.0) && asked[1]["stderr"] == "up \u{fffd}[2J\n",
        "{}",
        asked[1]
    );
    // Nothing else is replaced by it, whatever it is named.
    let answers = file.replace(".ava", ".answers.jsonl");
    let missing = path("missing/told.jsonl");
    for (target, why) in
        [(&file, "must end in"), (&answers, "holds something else"), (&missing, "does not exist")]
    {
        let (status, _, said) = outcome(&mut avastra(&["replay", &file, "--record", target]));
        assert!(status == 1 && said.contains(why), "{target}: {said}");
    }
    assert!(done(&["replay", &file]).contains(" holds, ") && !Path::new(&missing).exists());
    // A driving system of avastra is told nothing by messages.
    let (status, _, said) =
        outcome(&mut avastra(&["replay", &file, "--ads", "idm", "--record", &path("none.jsonl")]));
    assert!(
        status == 1
            && said.contains("is told nothing by messages")
            && !Path::new(&path("none.jsonl")).exists()
    );
}

#[test]
fn a_check_passes_for_every_kind_of_answer_and_finds_what_remembers() {
    let program = cargo_bin("avastra").display().to_string();
    let check = |toy: &[&str]| {
        let command = format!("'{program}' ads toy {}", toy.join(" "));
        let all = ["ads", "check", "--format", "json", "--road", "corner", "--ads", &command];
        let (status, stdout, stderr) = outcome(&mut avastra(&all));
        (status, last_line(&stdout), stderr)
    };
    for answer in ["control", "pedals", "trajectory", "acceleration"] {
        let (status, result, stderr) = check(&["--answer", answer]);
        assert_eq!(status, 0, "{answer}: {stderr}\n{result}");
        assert_eq!(result["checks"].as_array().map(Vec::len), Some(6), "{result}");
        assert!(result["speed"]["round_trips_per_s"].as_f64() > Some(100.0), "{result}");
    }
    // It passes red lights. The check sees that in drives alone, where nothing excuses it.
    let toy = format!("'{program}' ads toy --answer trajectory");
    let drives = ["ads", "check", "--format", "json", "--drive=1", "--road", "corner", "--ads", &toy];
    let (status, stdout, _) = outcome(&mut avastra(&drives));
    let result = last_line(&stdout);
    let stages: Vec<&Value> = result["checks"].as_array().expect("a list")[6..].iter().collect();
    assert_eq!((status, &stages[0]["stage"], &stages[0]["passed"]), (5, &"alone".into(), &false.into()));
    assert_eq!((&stages[1]["stage"], &stages[1]["passed"]), (&"traffic".into(), &true.into()));
    let alone = &result["drives"][0];
    assert_eq!(
        (&alone["drives"], &alone["arrived"], &alone["collisions"]),
        (&1.into(), &1.into(), &0.into())
    );
    assert_eq!(alone["breaches"]["stops_at_red"]["times"], 1, "{alone}");
    assert!(alone["astray_m"]["median"].as_f64() < Some(0.5) && alone["off_mps"].is_null(), "{alone}");
    for (how, stage) in [
        ("forgetful", "reset"),
        ("crash-at-reset", "reset"),
        ("crash-before-reset", "orders"),
        ("nan", "episode"),
        ("crash-at-start", "start"),
    ] {
        let (status, result, _) = check(&["--misbehave", how]);
        let last = result["checks"].as_array().and_then(|checks| checks.last()).expect("a check");
        assert_eq!(
            (status, &last["stage"], &last["passed"]),
            (5, &stage.into(), &false.into()),
            "{how}: {result}"
        );
    }
}

#[test]
fn a_missed_step_is_held_on_demand() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let more = "  on_timeout: hold\n  timeouts: { step: 0.02 }\n";
    let config = profile(scratch.path(), &["--misbehave", "late"], "0.05", more);
    let out = scratch.path().join("run");
    let out = out.display().to_string();
    let all = ["run", SPACE, "--road", "corner", "--ads", &config, "--out", &out, "--episodes", "1"];
    let (status, stdout, stderr) = outcome(&mut avastra(&all));
    assert!(status == 0 && !stdout.contains("failed"), "{stdout}{stderr}");
    assert!(stderr.contains("were not answered in time"), "{stderr}");
}

#[test]
fn a_socket_is_as_good_as_a_pipe() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let socket = scratch.path().join("ads");
    let listener = UnixListener::bind(&socket).expect("it listens");
    let serving = std::thread::spawn(move || {
        let (stream, _) = listener.accept().expect("avastra connects");
        let mut out = stream.try_clone().expect("a stream has two ends");
        for line in BufReader::new(stream).lines() {
            let message: Value = serde_json::from_str(&line.expect("text")).expect("JSON");
            let answer = match message["type"].as_str() {
                Some("init") => serde_json::json!({
                    "type": "ready", "protocol": "avastra-ads/1", "name": "cruise", "version": "1",
                    "answer": "acceleration", "deterministic": true,
                }),
                Some("map" | "reset") => serde_json::json!({ "type": "ready" }),
                Some("step") => {
                    let accel = 8.0 - message["ego"]["speed"].as_f64().expect("a number");
                    serde_json::json!({ "type": "acceleration", "seq": message["seq"], "accel": accel })
                }
                Some("event") => continue,
                Some("close") => return true,
                other => panic!("{other:?}"),
            };
            writeln!(out, "{answer}").expect("avastra reads");
        }
        false
    });
    let target = format!("unix:{}", socket.display());
    let out = scratch.path().join("run").display().to_string();
    let all =
        ["run", SPACE, "--road", "corner", "--ads", &target, "--episodes", "2", "--jobs", "1", "--out", &out];
    let (status, stdout, stderr) = outcome(&mut avastra(&all));
    assert_eq!(status, 0, "{stdout}{stderr}");
    assert!(stderr.contains("cruise 1") || stdout.contains("cruise 1"), "{stdout}{stderr}");
    assert!(serving.join().expect("the server is sound"), "it was told to close");
}

#[test]
fn the_schema_of_every_message_is_printed() {
    let stdout = done(&["ads", "schema"]);
    let schema: Value = serde_json::from_str(&stdout).expect("it is JSON");
    let defined: Vec<&String> = schema["$defs"].as_object().expect("messages").keys().collect();
    let words = [
        "acceleration",
        "close",
        "control",
        "error",
        "event",
        "init",
        "map",
        "ready",
        "reset",
        "step",
        "trajectory",
    ];
    assert_eq!(defined, words);
    let of = |message: &str| schema["$defs"][message]["properties"].clone();
    assert_eq!(of("control")["throttle"]["maximum"], 1.0);
    assert_eq!(of("trajectory")["points"]["minItems"], 2);
    assert_eq!(of("ready")["name"]["maxLength"], 100);
    assert_eq!(of("control")["internal"]["properties"]["reason"]["maxLength"], 200);
    assert_eq!(of("acceleration")["seq"]["maximum"], (1_u64 << 53) - 1);
}

/// A program that is a shell script around a toy: what a user changes while the command stays the same.
fn script(folder: &Path, before: &str, toy: &str) -> String {
    let path = folder.join("planner");
    let text = format!("#!/bin/sh\n{before}\nexec {} ads toy {toy}\n", cargo_bin("avastra").display());
    std::fs::write(&path, text).expect("a script is written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("it can be run");
    path.display().to_string()
}

#[test]
fn what_was_begun_against_one_program_is_not_gone_on_with_against_another() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    script(scratch.path(), "", "--as-version 1");
    let config = scratch.path().join("profile.yaml");
    // A relative command is one of the working directory, here the folder of the profile.
    std::fs::write(&config, "ads:\n  command: ./planner\n  working_directory: .\n").unwrap();
    let config = config.display().to_string();
    let space = root().join(SPACE).display().to_string();
    let out = |name: &str| scratch.path().join(name).display().to_string();
    let study = serde_json::json!({
        "space": space, "roads": ["corner"], "evaluation": { "episodes": 1, "seeds": 1 },
        "agents": [{ "name": "none", "repeats": 1 }],
    });
    let file = out("study.yaml");
    std::fs::write(&file, study.to_string()).unwrap();
    let (runs, train, cell) = (out("run"), out("train"), out("study"));
    let planner = scratch.path().join("planner").display().to_string();
    let begun = [
        vec!["run", SPACE, "--road", "corner", "--episodes", "1", "--ads", &config, "--out", &runs],
        training("1", &config, &train),
        vec!["study", &file, "--ads", &planner, "--out", &cell],
    ];
    for arguments in &begun {
        let (status, stdout, stderr) = outcome(&mut avastra(arguments));
        assert_eq!(status, 0, "{arguments:?}: {stdout}{stderr}");
        assert!(stderr.contains("against toy 1") || stdout.contains("against toy 1"), "{stdout}{stderr}");
    }
    let resumed = [["run", &runs], ["train", &train], ["study", &cell]];
    for [command, directory] in resumed {
        // From another folder, too, the same program is started, and it is said which.
        let stdout = done_in(&scratch.path().join("run"), &[command, "--resume", directory]);
        let (named, of) =
            stdout.split_once("names the driving system, which is started now in `").expect("named");
        assert!(
            named.contains(".yaml` ") && of.lines().next().is_some_and(|line| line.ends_with("/planner"))
        );
    }
    script(scratch.path(), "", "--as-version 2");
    for [command, directory] in resumed {
        let (status, stdout, stderr) = outcome(&mut avastra(&[command, "--resume", directory]));
        assert_eq!(status, 2, "{command}: {stdout}{stderr}");
        assert!(stderr.contains("toy 1") && stderr.contains("toy 2"), "{command}: {stderr}");
    }
}

#[test]
fn a_failure_is_a_regression_test_until_it_is_gone() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let dies = profile(scratch.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let out = scratch.path().join("run");
    let (_, result, stderr) = run(&dies, &out, &["--episodes", "1"]);
    let detail = result["failures"][0]["detail"].as_str().expect("in words");
    assert!(detail.contains("exit status 1"), "how it ended is told: {detail}{stderr}");
    let name = result["failures"][0]["scenario"].as_str().expect("a name");
    let file = out.join(format!("failures/{name}.ava")).display().to_string();
    let stdout = done(&["replay", &file]);
    assert!(stdout.contains("it ends with ads_crash (exited) at step 20"), "{stdout}");
    let well = tempfile::tempdir().expect("a scratch directory");
    let well = profile(well.path(), &[], "1", "");
    let whole = out.display().to_string();
    for (what, more, wanted, word) in [
        (&file, &[][..], 4, "still fails"),
        (&file, &["--ads", &dies], 4, "ads_crash again"),
        (&file, &["--ads", &well], 0, "1 passed"),
        (&file, &["--ads", &well, "--repeat", "60"], 0, "1 fixed"),
        (&file, &["--ads", "idm"], 0, "0 fixed, 1 passed"),
        (&whole, &["--ads", &well], 0, "1 passed"),
    ] {
        let (status, stdout, stderr) = outcome(&mut avastra(&[&["test", what][..], more].concat()));
        assert!(status == wanted && stdout.contains(word), "{more:?}: {status}: {stdout}{stderr}");
    }
    // `replay` asks what it is given, and does not fall back to recorded answers.
    let other = tempfile::tempdir().expect("a scratch directory");
    let other = profile(other.path(), &["--as-version", "2"], "1", "");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &file, "--ads", &other]));
    assert!(status == 0 && stdout.contains("against toy 2: "), "{status}: {stdout}{stderr}");
}

#[test]
fn what_is_not_deterministic_is_said_to_be_so_and_is_no_fault() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let toy = ["--not-deterministic", "--misbehave", "forgetful", "--blind"];
    let config = profile(scratch.path(), &toy, "1", "");
    let out = scratch.path().join("run");
    let (status, result, stderr) = run(&config, &out, &["--episodes", "2", "--seed", "3"]);
    assert_eq!((status, &result["totals"]["failed"]), (0, &0.into()), "{stderr}\n{result}");
    assert_eq!(result["reproducible"], false, "{result}");
    let program = cargo_bin("avastra").display().to_string();
    let command = format!("'{program}' ads toy {}", toy.join(" "));
    let (status, stdout, stderr) =
        outcome(&mut avastra(&["ads", "check", "--road", "corner", "--ads", &command]));
    assert!(status == 0 && stdout.contains("as it says it may"), "{stdout}{stderr}");
}

#[test]
fn a_dead_program_whose_child_holds_its_output_has_crashed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let planner = script(scratch.path(), "sleep 97 &", "--misbehave crash-in-episode");
    let out = scratch.path().join("run").display().to_string();
    let all = ["run", SPACE, "--road", "corner", "--episodes", "1", "--ads", &planner, "--out", &out];
    let (status, stdout, stderr) = outcome(&mut avastra(&all));
    assert_eq!(status, 5, "no episode was driven to its end: {stdout}{stderr}");
    assert!(stdout.contains("ads_crash (exited)") && stdout.contains("exit status 1"), "{stdout}{stderr}");
}

#[test]
fn a_socket_that_serves_one_connection_is_told_from_a_hang() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let socket = scratch.path().join("ads");
    let listener = UnixListener::bind(&socket).expect("it listens");
    let serving = std::thread::spawn(move || {
        let (stream, _) = listener.accept().expect("avastra connects");
        let mut out = stream.try_clone().expect("a stream has two ends");
        for _ in BufReader::new(stream).lines() {
            let ready = serde_json::json!({
                "type": "ready", "protocol": "avastra-ads/1", "name": "single", "version": "1",
                "answer": "acceleration", "deterministic": true,
            });
            writeln!(out, "{ready}").ok();
        }
    });
    let config = scratch.path().join("profile.yaml");
    let text = format!("ads: {{ command: \"unix:{}\", timeouts: {{ init: 0.5 }} }}", socket.display());
    std::fs::write(&config, text).unwrap();
    let out = scratch.path().join("run");
    let (status, result, stderr) = run(&config.display().to_string(), &out, &["--jobs", "2"]);
    let error = result["error"].as_str().expect("an error");
    assert!(status == 1 && error.contains("`--jobs 1`"), "{status}: {error}{stderr}");
    serving.join().expect("the server is sound");
}

#[test]
fn mistakes_in_a_profile_are_told_where_they_are() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = scratch.path().join("profile.yaml");
    let config = file.display().to_string();
    for (text, word) in [
        ("ads:\n  command: [python3\n", "line"),
        ("ads:\n  command: { a: 1 }\n", "write one string"),
        ("ads: planner\n", "`ads` is a block"),
        ("ads:\n  command: a\n  speed: 1\n", "speed"),
    ] {
        std::fs::write(&file, text).unwrap();
        for arguments in [&["ads", "check", "--ads", &config][..], &["run", SPACE, "--ads", &config]] {
            fails(arguments, word);
        }
    }
    let config = profile(scratch.path(), &[], "1", "");
    let space = root().join(SPACE).display().to_string();
    let study = serde_json::json!({ "space": space, "agents": [{ "name": "none", "ads_config": config }] });
    let file = scratch.path().join("study.yaml");
    std::fs::write(&file, study.to_string()).unwrap();
    fails(&["study", &file.display().to_string()], "`ads_config` of the study");
    let causes = ["run", SPACE, "--causes", "--ads", &config];
    fails(&causes, "`toy 1` is not made of modules");
}

#[test]
fn a_program_gets_the_fields_that_it_wants_and_is_asked_what_its_failure_hangs_on() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let program = cargo_bin("avastra").display().to_string();
    let command = format!(
        "'{program}' ads toy --answer trajectory --blind --wants motion --wants conflicts --wants names --wants later"
    );
    let run =
        ["run", SPACE, "--road", "corner", "--episodes", "2", "--seed", "1", "--jobs", "1", "--repeat", "0"];
    done(&[&run[..], &["--ads", &command, "--out", &path("run")]].concat());
    let files = texts(scratch.path().join("run/critical"));
    let (name, text) = files.iter().find(|(name, _)| name.ends_with(".ava")).expect("it crashes");
    let file = path(&format!("run/critical/{name}"));
    done(&["replay", &file, "--record", &path("told.jsonl")]);
    let told = std::fs::read_to_string(path("told.jsonl")).expect("it is written");
    let told: Vec<Value> = told.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let reset = &told[1]["question"];
    let seed = reset["episode_seed"].as_str().expect("its seed");
    assert!(text.contains(&format!("seed: {seed}")), "{text}");
    let conflicts = reset["route"]["conflicts"].as_array().expect("a list");
    assert!(conflicts.iter().all(|conflict| conflict["lane"].is_string()), "{reset}");
    let mut ages = 0;
    for line in &told[2..] {
        for object in line["question"]["objects"].as_array().expect("a list") {
            let number = |field: &str| object[field].as_f64().unwrap_or_else(|| panic!("{field}: {object}"));
            assert!(number("ax").is_finite() && number("yaw_rate").is_finite() && number("age") >= 0.0);
            ages += u32::from(number("age") > 1.0);
            assert_eq!(line["npcs"][object["id"].to_string()], object["npc"]);
        }
    }
    assert!(ages > 0, "nobody was known for a second");

    let (status, told, _) =
        outcome(&mut avastra(&["diagnose", &file, "--ads", &command, "--format", "json"]));
    let told: Value = serde_json::from_str(told.lines().next().expect("a line")).expect("JSON");
    let swaps = &told["scenarios"][0]["swaps"];
    assert_eq!((status, &swaps["response"]["late_s"]), (0, &Value::Null), "{told}");
    assert!(
        ["ignored_road_user", "ignored_lights"].iter().any(|named| swaps["hangs_on"] == *named),
        "{told}"
    );
    let found = |change: &str| {
        let swaps = swaps["swaps"].as_array().expect("a list");
        swaps
            .iter()
            .find(|swap| swap["change"] == change)
            .unwrap_or_else(|| panic!("{change}: {told}"))
            .clone()
    };
    // It sees nothing, but it is shown where it is: by the truth it drives otherwise.
    assert_eq!(
        (&found("without_all")["differs_s"], &found("without_all")["fate"]),
        (&Value::Null, &"same".into())
    );
    assert!(found("truth")["differs_s"].is_f64(), "{told}");
    // Without the program, nothing can be changed.
    let (status, _, said) = outcome(&mut avastra(&["diagnose", &file]));
    assert!(status == 1 && said.contains("which must drive each change"), "{said}");
}
