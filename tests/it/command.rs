//! The command line: what it prints and writes, and how it fails.

use std::path::Path;
use std::process::{Child, Stdio};

use assert_cmd::Command;
use serde_json::Value;

use crate::cases::{each_case, files, root, texts, try_each};
use crate::world::FLICKER;

/// `avastra` with arguments, in the repository.
pub fn avastra(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("avastra").expect("the binary is built with the tests");
    command.current_dir(root()).args(arguments);
    command
}

/// `avastra` in the background, to be interrupted or killed.
pub fn background(arguments: &[&str]) -> Child {
    std::process::Command::new(avastra(&[]).get_program())
        .current_dir(root())
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// Exit status, stdout and stderr.
pub fn outcome(command: &mut Command) -> (i32, String, String) {
    let output = command.output().expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("it prints UTF-8");
    let status = output.status.code().expect("no signal ends it");
    (status, text(output.stdout), text(output.stderr))
}

/// What a command prints that ends well.
#[track_caller]
pub fn done(arguments: &[&str]) -> String {
    done_in(&root(), arguments)
}

/// What a command prints that ends well in a folder.
#[track_caller]
pub fn done_in(folder: &Path, arguments: &[&str]) -> String {
    let (status, stdout, stderr) = outcome(avastra(arguments).current_dir(folder));
    assert_eq!(status, 0, "{arguments:?}: {stdout}{stderr}");
    stdout
}

/// A command ends with status 1, and says why.
#[track_caller]
pub fn fails(arguments: &[&str], reason: &str) {
    let (status, stdout, stderr) = outcome(&mut avastra(arguments));
    assert!(status == 1 && stderr.contains(reason), "{arguments:?}: {status}: {stdout}{stderr}");
}

/// The last line that a command prints: its result.
pub fn last_line(stdout: &str) -> Value {
    serde_json::from_str(stdout.lines().last().expect("it prints a result")).expect("the result is JSON")
}

/// Changes a database behind the back of the program.
pub fn change(database: &Path, statements: &str) {
    let database = rusqlite::Connection::open(database).expect("it is a database");
    database.execute_batch(statements).expect("it can be changed");
}

#[test]
fn a_misspelt_command_is_told_the_nearest() {
    for (word, meant) in [("rn", "run"), ("chek", "check"), ("tran", "train")] {
        fails(&[word], &format!("exists: '{meant}'"));
    }
}

#[test]
fn a_command_or_an_option_that_was_is_told_its_new_name() {
    for (words, now) in [
        (&["verify", "a.ava"][..], "`verify` is now `replay`"),
        (&["explain-policy", "a.ava"], "`explain-policy` is now `policy explain`"),
        (&["run", "a.ava", "--replays", "5"], "`--replays` is now `--repeat N`"),
        (&["run", "a.ava", "--ads-config", "car.yaml"], "`--ads-config` is now `--ads FILE`"),
    ] {
        fails(words, now);
    }
}

/// The footways of a map are drawn beside its lanes.
#[test]
fn a_picture_shows_sidewalks() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("scenarios/examples/own_road.ava").display().to_string();
    let scenario = format!(
        "language 1\nuse \"{space}\"\nscenario street {{\n  road: high_street\n  \
         start {{ time: Noon, sky: None }}\n  steps {{ 0: wait() }}\n}}\n"
    );
    let file = scratch.path().join("street.ava");
    std::fs::write(&file, scenario).expect("it is writable");
    let svg = done(&["render", &file.display().to_string(), "--at", "1", "--out", "-"]);
    assert_eq!(svg.matches("fill=\"#dcd7cf\"").count(), 2, "one on each side");
}

#[test]
fn every_broken_file_has_its_diagnostics() {
    each_case("diagnostics", |path| {
        let path = path.strip_prefix(root()).expect("it is a case");
        let (status, stdout, stderr) =
            outcome(&mut avastra(&["check", "--format", "plain", &path.display().to_string()]));
        // Warnings and remarks leave a file sound.
        let (wanted, said) = match stderr.contains("error[") {
            true => (2, String::new()),
            false => (0, format!("{}: no mistakes\n", path.display())),
        };
        assert_eq!((status, stdout), (wanted, said), "{}\n{stderr}", path.display());
        stderr
    });
}

#[test]
fn a_run_says_what_it_refused_and_how_much_traffic_there_was() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let space = ["run", "scenarios/avastra45.ava", "--format", "plain"];
    let settings =
        ["--agent", "random-raw", "--episodes", "2", "--seed", "3", "--ambient", "4", "--out", &out];
    let stdout = done(&[&space[..], &settings[..]].concat());
    assert!(stdout.contains("refused: "), "{stdout}");
    assert!(stdout.contains(" × "), "{stdout}");
    let settings = std::fs::read_to_string(scratch.path().join("run/run.yaml")).expect("it is written");
    assert!(settings.contains("ambient: 4"), "{settings}");
}

#[test]
fn every_diagnostic_is_also_json() {
    try_each("diagnostics", |stem, path| {
        let (_, stdout, stderr) =
            outcome(&mut avastra(&["check", "--format", "json", &path.display().to_string()]));
        for line in stderr.lines().chain(stdout.lines()) {
            let value: Value = serde_json::from_str(line).unwrap_or_else(|error| {
                panic!("{stem}: {error}: {line}");
            });
            assert!(value.is_object(), "{stem}: {line}");
        }
    });
}

#[test]
fn a_misspelt_argument_is_answered_with_what_is_meant() {
    let run = ["run", "scenarios/avastra45.ava"];
    fails(&[&run[..], &["--agent", "randm"]].concat(), "no agent `randm`: did you mean `random`? there are");
    fails(&[&run[..], &["--seed", "abc"]].concat(), "'--seed <SEED>': give a whole number from 0");
}

#[test]
fn a_misspelt_file_is_found_beside() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = scratch.path().join("space.ava");
    std::fs::write(&space, "language 1\nuse \"road.ava\"\n").expect("it is writable");
    let told = || outcome(&mut avastra(&["check", &space.display().to_string()])).2;
    assert!(!told().contains("did you mean"), "{}", told());
    std::fs::write(scratch.path().join("roads.ava"), "language 1\n").expect("it is writable");
    assert!(told().contains("no such file or directory; did you mean `roads.ava`?"), "{}", told());
}

#[test]
fn what_cannot_be_read_is_said_so() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let binary = scratch.path().join("binary.ava");
    std::fs::write(&binary, [0x7f, b'E', b'L', b'F', 0xff, 0xfe, 0x00]).expect("it is writable");
    let cases: [(&Path, &str); 3] = [
        (scratch.path(), "it is a folder: name "),
        (&binary, "not text: byte 4 is not UTF-8"),
        (&scratch.path().join("absent.ava"), "no such file"),
    ];
    for (path, reason) in cases {
        for verb in ["check", "compile", "table", "fmt", "run", "replay"] {
            let (status, _, stderr) = outcome(&mut avastra(&[verb, &path.display().to_string()]));
            assert_eq!(status, 1, "{verb} {}: {stderr}", path.display());
            assert!(stderr.contains(reason), "{verb} {}: {stderr}", path.display());
            assert!(!stderr.contains("panicked"), "{verb}: {stderr}");
        }
    }
}

#[test]
fn what_does_not_exist_is_named_with_what_does() {
    let space = "scenarios/avastra45.ava";
    let cases: [(&[&str], &str); 12] = [
        (&["run", space, "--road", "nowhere"], "`corner`"),
        (&["run", space, "--ads", "modualr"], "did you mean `modular`?"),
        (&["export", "--to", "ava", space], "`--out DIR`"),
        (&["run", space, "--ads", "apolo"], "`modular`, `frenet`, `reactive`, `idm`, `cc`"),
        (&["run", space, "--agent", "rndom"], "`random`"),
        (&["run", space, "--without", "npc_gpa"], "npc_gap"),
        (&["run", "--resume", "scenarios"], "no run.yaml"),
        (&["table", space, "--row", "45"], "rows 0 to 44"),
        (&["table", space, "--row", "0", "--state", "tiem: Night"], "time"),
        (&["table", space, "--row", "0", "--state", "time: Noon, time: Night"], "`time` is given twice"),
        (&["render", space, "--at", "1"], "no scenario"),
        (&["render", space, "--at", "2", "9.5"], "separated by commas, as in `--at 2,9.5`"),
    ];
    for (arguments, hint) in cases {
        fails(arguments, hint);
    }
}

#[test]
fn compile_and_run_write_the_same_files_twice() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let in_scratch = |arguments: &[&str]| done_in(scratch.path(), arguments);
    in_scratch(&["compile", &space]);
    let profile = root().join(FLICKER).display().to_string();
    let settings = ["--seed", "7", "--episodes", "10", "--ads", &profile];
    in_scratch(&[&["run", "--jobs", "1"], &settings[..]].concat());
    in_scratch(&[&["run", "--jobs", "2"], &settings[..]].concat());
    let critical = |run: &str| -> Vec<(String, String)> {
        texts(scratch.path().join("runs").join(run).join("critical")).into_iter().collect()
    };
    let files = critical("0001");
    assert!(!files.is_empty(), "twenty episodes find a crash");
    assert_eq!(files, critical("0002"));

    let first = format!("runs/0001/critical/{}", files[0].0);
    assert!(in_scratch(&["replay", &first]).contains("confirmed"));
    in_scratch(&["render", &first, "--strip", "-o", "strip.svg"]);
    let svg = std::fs::read_to_string(scratch.path().join("strip.svg")).expect("it was drawn");
    roxmltree::Document::parse(&svg).expect("a picture is well-formed XML");

    // A false claim of any kind is refuted.
    let lies = [
        ("expect proc == [", "expect proc == [0.999, ", "collision probability"),
        ("expect avoidable by [", "expect avoidable by [idm, ", "found   avoidable by ["),
        ("expect avoidable by [", "expect beyond_reference by [", "claimed beyond_reference by ["),
    ];
    for (truth, lie, complaint) in lies {
        assert!(files[0].1.contains(truth), "{}", files[0].1);
        let text = files[0].1.replace(truth, lie);
        std::fs::write(scratch.path().join("runs/0001/critical/lie.ava"), text).expect("it is writable");
        let (status, stdout, _) =
            outcome(avastra(&["replay", "runs/0001/critical/lie.ava"]).current_dir(scratch.path()));
        assert_eq!(status, 3, "{stdout}");
        assert!(stdout.contains(complaint), "{stdout}");
    }
}

#[test]
fn what_is_no_plain_file_is_written_to_and_never_replaced() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let kept = scratch.path().join("kept.yaml");
    std::fs::write(&kept, "old").expect("it is writable");
    let to_file = scratch.path().join("to_file.yaml");
    let to_device = scratch.path().join("to_device.yaml");
    std::os::unix::fs::symlink(&kept, &to_file).expect("links can be made");
    std::os::unix::fs::symlink("/dev/null", &to_device).expect("links can be made");
    for link in [to_file, to_device] {
        let out = link.to_str().expect("the path is text");
        done(&["compile", "scenarios/avastra45.ava", "-o", out]);
        assert!(link.is_symlink(), "{out} was replaced");
    }
    assert!(std::fs::read_to_string(&kept).expect("it is readable").len() > 1000, "the link was followed");
}

#[test]
fn an_interrupted_run_goes_on_where_it_was() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let run = |out: &str| {
        let arguments = ["run", &space, "--seed", "3", "--episodes", "12", "--out", out, "--format", "json"];
        done_in(scratch.path(), &arguments)
    };
    let whole = run("whole");
    run("cut");
    // The directory is left as by a run that was killed half-way.
    let cut = "DELETE FROM step WHERE episode >= 5; DELETE FROM collision WHERE episode >= 5; DELETE FROM scenario WHERE episode >= 5;
               DELETE FROM offer WHERE episode >= 5; DELETE FROM held WHERE episode >= 5;
               DELETE FROM episode WHERE episode >= 5;
               DELETE FROM seal WHERE unit >= 5;";
    change(&scratch.path().join("cut/run.db"), cut);
    let resumed = done_in(scratch.path(), &["run", "--resume", "cut", "--format", "json"]);
    // What never happened is told of all episodes, the earlier ones included.
    let never = |text: &str| serde_json::from_str::<Value>(text).expect("a result")["never"].clone();
    assert_eq!(never(&whole), never(&resumed));
    assert_eq!(never(&whole)["rows"], 45, "{whole}");
    let traces = |run: &str| -> Vec<String> {
        let path = scratch.path().join(run).join("run.db");
        let database = rusqlite::Connection::open(path).expect("it is a database");
        let mut query = database.prepare("SELECT trace FROM episode ORDER BY episode").expect("a query");
        let rows = query.query_map([], |row| row.get(0)).expect("it has traces");
        rows.map(|trace| trace.expect("a trace is text")).collect()
    };
    assert_eq!(traces("whole"), traces("cut"));
}

/// A run by time stops after whole rounds: threads and interruptions change no byte, and it has as many episodes on each road.
#[test]
fn a_run_by_time_is_the_same_with_any_threads_and_kills() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let run = |out: &str, more: &[&str]| {
        let all = ["run", &space, "--ads", "reactive", "--seed", "3", "--out", out, "--format", "json"];
        last_line(&done_in(scratch.path(), &[&all, more].concat()))
    };
    let whole = run("whole", &["--hours", "0.3", "--jobs", "2"]);
    let (episodes, simulated_h) = (&whole["totals"]["episodes"], whole["left"]["simulated_h"].as_f64());
    assert!(simulated_h.is_some_and(|hours| (0.3..0.7).contains(&hours)), "{}", whole["left"]);
    assert!(episodes.as_u64().is_some_and(|count| count > 16 && count.is_multiple_of(16)), "{episodes}");
    let left = &whole["left"]["next_hour"];
    assert!(
        left["low"].as_f64() <= left["chance"].as_f64() && left["chance"].as_f64() < left["high"].as_f64()
    );

    run("cut", &["--hours", "0.3", "--jobs", "1"]);
    let file = scratch.path().join("cut/run.db");
    let bytes = |run: &str| std::fs::read(scratch.path().join(run).join("run.db")).expect("a database");
    assert_eq!(bytes("whole"), bytes("cut"));
    let tables = ["step", "collision", "breach", "margin", "scenario", "offer", "held", "episode"];
    let cut = tables.map(|table| format!("DELETE FROM {table} WHERE episode >= 21;")).concat();
    change(&file, &(cut + "DELETE FROM seal WHERE unit >= 21;"));
    done_in(scratch.path(), &["run", "--resume", "cut"]);
    assert_eq!(bytes("whole"), bytes("cut"));

    // It stops sooner if nothing new is likely, and at its first look at the soonest.
    let sooner = run("sooner", &["--hours", "3", "--until", "0.99"]);
    let (hours, high) =
        (sooner["left"]["simulated_h"].as_f64(), sooner["left"]["next_hour"]["high"].as_f64());
    assert!(hours < Some(3.0) && high <= Some(0.99), "{}", sooner["left"]);
    // Without replays nothing recurs, so nothing is said of the next hour.
    let untold = run("untold", &["--episodes", "2", "--repeat", "0"]);
    assert!(untold["left"]["next_hour"].is_null(), "{}", untold["left"]);

    for (wrong, why) in [
        (&["--hours", "0"][..], "the budget is 0 h"),
        (&["--hours", "NaN"], "the budget is NaN h"),
        (&["--hours", "1", "--until", "1"], "the budget is 1 h, until 1"),
        (&["--hours", "1", "--until", "0.5", "--repeat", "6"], "`--until` asks what recurs"),
        (&["--hours", "1001"], "hours above 0 up to 1000 are possible"),
        (&["--hours", "1", "--agent", "every-row"], "`--hours` is for other agents"),
        (&["--hours", "1", "--shard", "1/2"], "a run with `--hours` is one piece"),
    ] {
        fails(&[&["run", &space, "--out", "wrong"], wrong].concat(), why);
    }
}

/// A run ends with the rows that never happened, and with what stood in their way.
#[test]
fn a_run_says_what_never_happened() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = scratch.path().join("space.ava");
    let roads = root().join("scenarios/roads.ava").display().to_string();
    let text = format!(
        "language 1\nuse \"{roads}\"\nenum Side = Left | Right\n\
         action walker(each from: Side) {{ spawn Pedestrian ahead 40 m {{ side: from, speed: 1 m/s, does: Walk }} }}\n\
         action racer() {{ spawn Sedan ahead 60 m {{ lane: Current, speed: 8 m/s, does: DriveAhead }} }}\n\
         rule in_haste on racer: ego.speed >= 60 m/s\n"
    );
    std::fs::write(&space, text).expect("it is writable");
    let run = |more: &[&str]| {
        let all = ["run", "space.ava", "--road", "corner", "--episodes", "2", "--format", "plain"];
        done_in(scratch.path(), &[&all, more].concat())
    };
    let short = run(&[]);
    assert!(short.contains("1 of 3 rows never happened, in "), "{short}");
    assert!(short.contains("  1 never legal\n    row 2, racer(): in_haste: "), "{short}");
    assert!(short.lines().all(|line| line.chars().count() <= 80), "{short}");
    let long = run(&["--verbose"]);
    assert!(long.contains("    row 2, racer()\n") && long.contains(" × in_haste: "), "{long}");
    let idle = run(&["--agent", "none"]);
    assert!(idle.contains("3 never asked for\n    rows 0, 1, 2 (the agent chose others)"), "{idle}");
}

#[test]
fn shipped_files_are_sound_and_formatted() {
    let files = files(root().join("scenarios"), "ava");
    let files: Vec<&str> = files.iter().map(|path| path.to_str().expect("it is text")).collect();
    done(&[&["check", "--strict"], &files[..]].concat());
    done(&[&["fmt", "--check"], &files[..]].concat());
}

#[test]
fn formatting_is_as_reviewed_and_changes_nothing_twice() {
    each_case("format", |path| {
        let text = std::fs::read_to_string(path).expect("a case is readable");
        let once = outcome(avastra(&["fmt", "-"]).write_stdin(text));
        assert_eq!(once.0, 0, "{}", once.2);
        let twice = outcome(avastra(&["fmt", "-"]).write_stdin(once.1.clone()));
        assert_eq!(once.1, twice.1);
        once.1
    });
}

/// `use "law.ava"` finds the file within the program where none lies, and only by its bare name.
#[test]
fn the_law_can_be_used_from_any_folder() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    done_in(scratch.path(), &["new", "town"]);
    let write = |name: &str, text: &str| {
        std::fs::write(scratch.path().join(name), text).expect("it is writable");
    };
    let check = |name: &str| outcome(avastra(&["check", name]).current_dir(scratch.path()));
    write("town/legal.ava", "language 1\nuse \"space.ava\"\nuse \"law.ava\"\nuse \"comfort.ava\"\n");
    assert_eq!(check("town/legal.ava").0, 0);
    // A folder that can be moved has its own copy.
    done_in(scratch.path(), &["export", "--to", "ava", "town/legal.ava", "--out", "moved"]);
    let copied = std::fs::read_to_string(scratch.path().join("moved/space/law.ava")).expect("it was copied");
    assert!(copied.contains("require stops_at_red"), "{copied}");
    // Another path is a mistake, and so is a link that leads nowhere. An own file goes first.
    write("town/astray.ava", "language 1\nuse \"space.ava\"\nuse \"../law.ava\"\n");
    assert!(check("town/astray.ava").2.contains("AV0106"));
    let link = scratch.path().join("town/law.ava");
    std::os::unix::fs::symlink("nowhere.ava", &link).expect("links can be made");
    assert!(check("town/legal.ava").2.contains("AV0106"));
    std::fs::remove_file(&link).expect("it is there");
    write("town/law.ava", "language 1\nrequire own: ego.speed <= 1 m/s\n");
    let table = done_in(scratch.path(), &["check", "--audit", "town/legal.ava", "--format", "json"]);
    assert!(table.contains("own") && !table.contains("stops_at_red"), "{table}");
}

#[test]
fn a_run_fails_on_what_is_asked_for() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let run = |name: &str, more: &[&str]| {
        let out = scratch.path().join(name).display().to_string();
        let wanted = ["run", "scenarios/avastra45.ava", "--out", &out, "--quiet"];
        let (status, _, stderr) = outcome(&mut avastra(&[&wanted, more].concat()));
        (status, stderr)
    };
    let truck_blind = "scenarios/ads/faults/perception_blind_to_large_vehicles.yaml";
    let some =
        ["--ads", truck_blind, "--road", "corner", "--episodes", "50", "--fail-on", "recurring,stalled"];
    let (status, told) = run("recurring", &some);
    assert!(status == 4 && told.contains(" under other noise"), "{status}: {told}");
    // Some of those stalled after a crash, which does not count as such. Here one got stuck by itself.
    let stuck = ["--ads", FLICKER, "--road", "crossroad", "--episodes", "25", "--repeat", "0"];
    let (status, told) = run("stalled", &[&stuck[..], &["--fail-on", "stalled"]].concat());
    assert!(status == 4 && told.contains("got stuck in 1 episode"), "{status}: {told}");
    // Nothing is begun that cannot be judged so.
    for (more, reason) in [
        (&["--repeat", "0", "--fail-on", "recurring"][..], "needs at least 7 replays"),
        (&["--fail-on", "breach"], "needs a requirement"),
    ] {
        let (status, told) = run("none", more);
        assert!(status == 1 && told.contains(reason), "{status}: {told}");
        assert!(!scratch.path().join("none").exists());
    }
}

#[test]
fn the_version_names_all_that_others_depend_on() {
    let told = done(&["--version"]);
    for part in [
        "language 1",
        "engine plane/",
        "protocol avastra-ads/",
        "JSON schema ",
        "run.db ",
        "study.db ",
        "estimate.db ",
    ] {
        assert!(told.contains(part), "{told}");
    }
}
