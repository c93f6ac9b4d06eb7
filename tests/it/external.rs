//! Driving systems outside the program: every misbehaviour is a finding, the run goes on, and nothing is left behind.
//!
//! They are driven by `avastra ads toy`, so the tests need nothing but the program itself.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixListener;
use std::path::Path;

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

use crate::cases::root;
use crate::command::{avastra, outcome};

const SPACE: &str = "scenarios/avastra45.ava";

/// A profile with a toy, written into a folder. `late_s` is its mark in the list of processes.
fn profile(folder: &Path, toy: &[&str], late_s: &str, more: &str) -> String {
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

fn last_line(stdout: &str) -> Value {
    serde_json::from_str(stdout.lines().last().expect("it prints a result")).expect("the result is JSON")
}

/// A run of some episodes on one road: its status, its result and what it wrote on standard error.
fn run(config: &str, out: &Path, more: &[&str]) -> (i32, Value, String) {
    let out = out.display().to_string();
    let begin = ["run", SPACE, "--road", "corner", "--ads-config", config, "--out", &out, "--format", "json"];
    let (status, stdout, stderr) = outcome(&mut avastra(&[&begin[..], more].concat()));
    (status, last_line(&stdout), stderr)
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
        let settings = ["--episodes", "3", "--jobs", "1", "--fail-on-collision"];
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
        let scenario = folder.join(format!("run/failures/{name}.ava"));
        if how != "crash-at-reset" {
            let (status, stdout, stderr) =
                outcome(&mut avastra(&["replay", &scenario.display().to_string()]));
            assert_eq!(status, 0, "{how}: {stdout}{stderr}");
        }
    }
}

#[test]
fn a_training_and_a_study_say_that_the_driving_system_failed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let out = scratch.path().join("train").display().to_string();
    let train = [
        "train",
        SPACE,
        "--agent",
        "av-fuzzer",
        "--road",
        "corner",
        "--episodes",
        "2",
        "--ads-config",
        &config,
        "--out",
        &out,
    ];
    let (status, stdout, stderr) = outcome(&mut avastra(&train));
    assert_eq!(status, 0, "{stdout}{stderr}");
    assert!(stderr.contains("warning: the driving system failed in 17 of 17 episodes"), "{stdout}{stderr}");
    assert!(stdout.contains("2 × ads_crash (exited)") && stdout.contains("15 × ads_crash\n"), "{stdout}");

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
        ("tcp:127.0.0.1:1", "not_started"),
        ("unix:/no/such/socket", "not_started"),
        ("'unclosed", "not closed"),
    ] {
        let all = ["run", SPACE, "--ads-cmd", command, "--episodes", "1"];
        let (status, _, stderr) = outcome(&mut avastra(&all));
        assert_eq!(status, 1, "{command}");
        assert!(stderr.contains(word), "{command}: {stderr}");
    }
}

/// Episodes of a run: number, end and trace.
fn episodes(directory: &Path) -> Vec<(i64, String, String)> {
    let database = rusqlite::Connection::open(directory.join("run.db")).expect("it is a database");
    let mut rows = database.prepare("SELECT episode, ended, trace FROM episode ORDER BY episode").unwrap();
    let rows = rows.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
    rows.collect::<Result<_, _>>().unwrap()
}

/// The emitted files of a run with their texts.
fn emitted(directory: &Path) -> BTreeMap<String, String> {
    let files = std::fs::read_dir(directory.join("critical")).unwrap().flatten();
    files
        .map(|file| {
            let name = file.file_name().to_string_lossy().into_owned();
            (name, std::fs::read_to_string(file.path()).unwrap())
        })
        .collect()
}

#[test]
fn threads_and_processes_change_nothing_and_crashes_replay_with_and_without_the_program() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = profile(scratch.path(), &["--answer", "trajectory", "--blind"], "1", "");
    let settings = ["--episodes", "2", "--seed", "3"];
    let [one, two] = ["1", "2"].map(|jobs| {
        let out = scratch.path().join(jobs);
        let (status, result, stderr) = run(&config, &out, &[&settings[..], &["--jobs", jobs]].concat());
        assert_eq!((status, &result["totals"]["failed"]), (0, &0.into()), "{stderr}");
        out
    });
    assert_eq!(episodes(&one), episodes(&two));
    assert_eq!(emitted(&one), emitted(&two));
    let scenarios: Vec<String> = emitted(&one).into_keys().filter(|name| name.ends_with(".ava")).collect();
    assert!(!scenarios.is_empty(), "who drives on whatever is in the way collides");
    let path = one.join("critical").join(&scenarios[0]).display().to_string();
    for more in [&[][..], &["--ads-config", &config]] {
        let (status, stdout, stderr) = outcome(&mut avastra(&[&["replay", &path][..], more].concat()));
        assert_eq!(status, 0, "{more:?}: {stdout}{stderr}");
        assert!(stdout.contains("confirmed"), "{more:?}: {stdout}");
    }
    // Who dies on the way has not been cured of the crash.
    let dies = tempfile::tempdir().expect("a scratch directory");
    let dies = profile(dies.path(), &["--misbehave", "crash-in-episode"], "1", "");
    let (status, stdout, stderr) = outcome(&mut avastra(&["test", &path, "--ads-config", &dies]));
    assert!(status == 4 && stdout.contains("ads failed"), "{status}: {stdout}{stderr}");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &path, "--ads-config", &dies]));
    assert!(status == 5 && stdout.contains("it failed at step"), "{status}: {stdout}{stderr}");
    // It is made small with the program; what only the program can show is not tried without it.
    let small = scratch.path().join("small.ava").display().to_string();
    let (status, stdout, stderr) =
        outcome(&mut avastra(&["shrink", &path, "--ads-config", &config, "--output", &small]));
    assert_eq!(status, 0, "{stdout}{stderr}");
    let claims_minimal = std::fs::read_to_string(&small).unwrap().contains("expect minimal");
    for (more, is_tried) in [(&[][..], false), (&["--ads-config", &config], true)] {
        let (status, stdout, stderr) = outcome(&mut avastra(&[&["verify", &small][..], more].concat()));
        assert_eq!(status, 0, "{more:?}: {stdout}{stderr}");
        assert_eq!(stdout.contains("not tried"), claims_minimal && !is_tried, "{more:?}: {stdout}");
    }
    // Changed answers are noticed, and missing ones are asked for.
    let answers = Path::new(&path).with_extension("answers.jsonl");
    let text = std::fs::read_to_string(&answers).unwrap();
    std::fs::write(&answers, text.replacen("\"v\":", "\"v\":1", 1)).unwrap();
    let (status, _, stderr) = outcome(&mut avastra(&["replay", &path]));
    assert!(status == 1 && stderr.contains("changed"), "{stderr}");
    std::fs::remove_file(&answers).unwrap();
    let (status, _, stderr) = outcome(&mut avastra(&["replay", &path]));
    assert!(status == 1 && stderr.contains("--ads-cmd"), "{stderr}");
}

#[test]
fn a_check_passes_for_every_kind_of_answer_and_finds_what_remembers() {
    let program = cargo_bin("avastra").display().to_string();
    let check = |toy: &[&str]| {
        let begin = ["ads", "check", "--format", "json", "--road", "corner", "--", &program, "ads", "toy"];
        let (status, stdout, stderr) = outcome(&mut avastra(&[&begin[..], toy].concat()));
        (status, last_line(&stdout), stderr)
    };
    for answer in ["control", "pedals", "trajectory", "acceleration"] {
        let (status, result, stderr) = check(&["--answer", answer]);
        assert_eq!(status, 0, "{answer}: {stderr}\n{result}");
        assert_eq!(result["checks"].as_array().map(Vec::len), Some(5), "{result}");
        assert!(result["speed"]["round_trips_per_s"].as_f64() > Some(100.0), "{result}");
    }
    for (how, stage) in
        [("forgetful", "reset"), ("crash-at-reset", "reset"), ("nan", "episode"), ("crash-at-start", "start")]
    {
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
    let (status, result, stderr) = run(&config, &out, &["--episodes", "1", "--jobs", "1"]);
    assert_eq!((status, &result["totals"]["failed"]), (0, &0.into()), "{stderr}\n{result}");
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
    let all = [
        "run",
        SPACE,
        "--road",
        "corner",
        "--ads-cmd",
        &target,
        "--episodes",
        "2",
        "--jobs",
        "1",
        "--out",
        &out,
    ];
    let (status, stdout, stderr) = outcome(&mut avastra(&all));
    assert_eq!(status, 0, "{stdout}{stderr}");
    assert!(stderr.contains("cruise 1") || stdout.contains("cruise 1"), "{stdout}{stderr}");
    assert!(serving.join().expect("the server is sound"), "it was told to close");
}

#[test]
fn the_schema_of_every_message_is_printed() {
    let (status, stdout, _) = outcome(&mut avastra(&["ads", "schema"]));
    assert_eq!(status, 0);
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
    assert_eq!(schema["$defs"]["control"]["properties"]["throttle"]["maximum"], 1.0);
}
