//! Files, names and disks that fail: each is an error that says what to do, found before anything is lost.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use crate::cases::{entries, root};
use crate::command::{avastra, change, done, fails, outcome};
use crate::report::index_of;
use crate::world::FLICKER;

/// A command that takes longer hangs, also on a busy machine.
const TIME_MAX: Duration = Duration::from_secs(30);

const SPACE: &str = "scenarios/avastra45.ava";

/// A directory for a test, and paths in it as text.
struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Scratch {
        Scratch(tempfile::tempdir().expect("a scratch directory"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }
}

/// A short run into a directory.
fn run_into(out: &str) -> (i32, String, String) {
    let settings = ["--ads", "idm", "--road", "corner", "--episodes", "3", "--out", out];
    outcome(&mut avastra(&[&["run", SPACE], &settings[..]].concat()))
}

/// What is said on standard error when a run is gone on with.
fn resumed(directory: &str) -> String {
    let (status, _, stderr) = outcome(&mut avastra(&["run", "--resume", directory]));
    assert_eq!(status, 0, "{stderr}");
    stderr
}

/// Replaces a part of a file.
fn edit(path: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(path).expect("it is readable");
    assert!(text.contains(from), "`{from}` is in {text}");
    std::fs::write(path, text.replacen(from, to, 1)).expect("it is writable");
}

#[test]
fn names_that_are_no_text_are_refused_before_anything_is_played() {
    let scratch = Scratch::new();
    let odd = scratch.0.path().join(OsStr::from_bytes(b"odd\xff.ava"));
    std::fs::copy(root().join("scenarios/roads.ava"), &odd).expect("it is writable");
    for command in ["check", "compile", "run", "replay", "shrink", "diagnose", "test", "train", "road"] {
        let (status, stdout, stderr) = outcome(avastra(&[command, "--format", "json"]).arg(&odd));
        assert_eq!(status, 1, "{command}: {stderr}");
        assert!(stdout.contains("is not UTF-8: rename the file"), "{command}: {stdout}");
        assert!(stdout.lines().all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()));
    }
    // One that is found in a folder is named; nothing of the folder is played.
    fails(&["test", &scratch.0.path().display().to_string()], "the path is not UTF-8");
    let inside = scratch.0.path().join(OsStr::from_bytes(b"run\xfe"));
    std::fs::create_dir(&inside).expect("it is writable");
    let space = root().join(SPACE);
    let mut command = avastra(&["run", &space.display().to_string(), "--out", "here", "--episodes", "1"]);
    let (status, _, stderr) =
        outcome(command.args(["--ads", "idm", "--road", "corner"]).current_dir(&inside));
    assert_eq!(status, 0, "the folder that one works in may have any name: {stderr}");
}

#[test]
fn output_that_is_lost_is_an_error() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    let commands: [&[&str]; 6] = [
        &["check", SPACE],
        &["table", SPACE],
        &["explain", "AV0101", "--format", "json"],
        &["completions", "bash"],
        &["--help"],
        &["run", SPACE, "--ads", "idm", "--road", "corner", "--episodes", "1", "--out", &out],
    ];
    for arguments in commands {
        let command = |stdout: Stdio| {
            let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_avastra"));
            command.args(arguments).current_dir(root()).stdout(stdout).stderr(Stdio::piped());
            command.output().expect("it starts")
        };
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let lost = command(Stdio::from(full));
        let stderr = String::from_utf8_lossy(&lost.stderr);
        assert_eq!(lost.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(arguments == ["--help"] || stderr.contains("cannot write `standard output`"), "{stderr}");
        if !arguments.contains(&"run") {
            let (reader, writer) = std::io::pipe().expect("a pipe");
            drop(reader);
            assert_eq!(command(Stdio::from(writer)).status.code(), Some(0), "{arguments:?}: a closed pipe");
        }
    }
    assert!(scratch.path("run/run.db").is_file(), "what was played is kept");
}

#[test]
fn what_a_kill_left_before_the_beginning_can_be_begun() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    std::fs::create_dir_all(scratch.path("run/critical/space")).expect("it is writable");
    std::fs::write(scratch.path("run/run.yaml.partial"), "avastra: 0").expect("it is writable");
    fails(&["run", "--resume", &out], "it has no run.yaml; begin one in a new directory with `--out");
    assert_eq!(run_into(&out).0, 0);
    let (status, _, stderr) = run_into(&out);
    assert!(status == 1 && stderr.contains("is not empty"), "{stderr}");
    // The database may be missing as long as nothing was found.
    std::fs::remove_file(scratch.path("run/run.db")).expect("it is there");
    let settings = scratch.path("run/run.yaml");
    let whole = std::fs::read(&settings).expect("it is readable");
    std::fs::write(&settings, "seed: [").expect("it is writable");
    let (status, stdout, stderr) = outcome(&mut avastra(&["run", "--resume", &out]));
    assert!(status == 1 && !stdout.contains("begins anew"), "nothing can begin: {stdout}{stderr}");
    std::fs::write(&settings, whole).expect("it is writable");
    // Git drops an empty folder.
    std::fs::remove_dir_all(scratch.path("run/critical")).expect("it is there");
    resumed(&out);
    assert!(scratch.path("run/critical").is_dir());
    std::fs::write(scratch.path("run/critical/corner_0000.ava"), "language 1\n").expect("it is writable");
    std::fs::remove_file(scratch.path("run/run.db")).expect("it is there");
    fails(&["run", "--resume", &out], "is missing, and `critical` has scenarios");
}

#[test]
fn a_directory_whose_conditions_stand_at_the_top_was_begun_by_an_earlier_build() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    assert_eq!(run_into(&out).0, 0);
    let settings = scratch.path("run/run.yaml");
    let text = std::fs::read_to_string(&settings).expect("it is written");
    let mut is_inside = false;
    let flat = text.lines().filter_map(|line| {
        is_inside = line == "conditions:" || is_inside && line.starts_with(' ');
        (line != "conditions:")
            .then(|| line.strip_prefix("  ").filter(|_| is_inside).unwrap_or(line).to_owned() + "\n")
    });
    let flat: String = flat.collect();
    assert!(flat.contains("\nengine: ") || flat.starts_with("avastra: "), "{flat}");
    std::fs::write(&settings, flat).expect("it is writable");
    fails(&["run", "--resume", &out], "was begun by an earlier build of avastra");
}

#[test]
fn a_run_that_was_edited_is_not_gone_on_with() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    assert_eq!(run_into(&out).0, 0);
    let settings = scratch.path("run/run.yaml");
    let whole = std::fs::read_to_string(&settings).expect("it is written");
    for (from, to, what) in [
        ("episodes: 3", "episodes: 4", "`episodes` was 3"),
        ("seed: 1", "seed: 2", "`seed` was 1"),
        ("ambient: 0", "ambient: 5", "`conditions.ambient` was 0"),
        ("space_digest: ", "space_digest: a", "edited since it was begun: `conditions.space_digest` was"),
        ("space: ", "space: other/", "edited since it was begun: `conditions.space` was"),
    ] {
        edit(&settings, from, to);
        fails(&["run", "--resume", &out], what);
        std::fs::write(&settings, &whole).expect("it is writable");
    }
    resumed(&out);
    fails(&["train", "--resume", &out], "was begun by `avastra run`: go on with `avastra run --resume");
    fails(&["study", "--resume", &out], "was begun by `avastra run`");

    // An episode whose rows were changed is named, counts for nothing, and is played again; one too many is only removed.
    let bytes = std::fs::read(scratch.path("run/run.db")).expect("it is readable");
    let rows = "UPDATE step SET proc = 0.5 WHERE episode = 1 AND step = 0;
                UPDATE episode SET distance_m = 1e9 WHERE episode = 1;
                PRAGMA foreign_keys = OFF;
                INSERT INTO held VALUES (9, 0, 1.0, 'nothing')";
    change(&scratch.path("run/run.db"), rows);
    let changed = "the rows of episode 1, episode 9 were changed since they were written";
    let page = scratch.path("page.html");
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--out", &page.display().to_string()]));
    assert!(status == 0 && stderr.contains(&format!("{changed}: they count for nothing")), "{stderr}");
    let html = std::fs::read_to_string(&page).expect("it is written");
    let overview = &index_of(&html)["overview"];
    assert_eq!(overview["totals"]["episodes"], 2, "{overview}");
    assert!(overview["totals"]["driven_m"].as_f64().is_some_and(|driven_m| driven_m < 1e6), "{overview}");
    let (status, _, stderr) = outcome(&mut avastra(&["merge", &out, "--missing"]));
    assert!(status == 0 && stderr.contains("its rows of episode 1 were changed"), "{stderr}");
    assert!(stderr.contains(&format!("`avastra run --resume {out}` plays them again")), "{stderr}");
    let stderr = resumed(&out);
    assert!(
        stderr.contains(&format!("{changed}: each such episode is removed, and played again if")),
        "{stderr}"
    );
    assert!(std::fs::read(scratch.path("run/run.db")).expect("it is readable") == bytes);
    let stderr = resumed(&out);
    assert!(!stderr.contains("changed"), "{stderr}");
    // An episode of which nothing is left, its seal included, is missing.
    let tables = ["step", "offer", "held", "collision", "scenario", "episode"];
    let gone = tables.map(|table| format!("DELETE FROM {table} WHERE episode = 1;")).concat();
    change(&scratch.path("run/run.db"), &format!("{gone} DELETE FROM seal WHERE unit = 1"));
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--out", &page.display().to_string()]));
    let is_missing = format!("1 of 3 episodes is missing: `avastra run --resume {out}` plays it");
    assert!(status == 0 && stderr.contains(&is_missing), "{stderr}");
    resumed(&out);
    // A reason stands once for all episodes that name it. They are played again, and it gets its words back.
    let reason =
        "UPDATE reason SET text = 'because' WHERE reason = (SELECT min(reason) FROM offer WHERE reason > 0)";
    change(&scratch.path("run/run.db"), reason);
    let stderr = resumed(&out);
    assert!(stderr.contains("were changed since they were written: each such episode"), "{stderr}");
    assert!(std::fs::read(scratch.path("run/run.db")).expect("it is readable") == bytes);
    // Settings that were edited in both places are not those that the rows came from.
    edit(&settings, "seed: 1", "seed: 2");
    let reseeded = "UPDATE begun SET settings = replace(settings, 'seed: 1', 'seed: 2')";
    change(&scratch.path("run/run.db"), reseeded);
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--out", &page.display().to_string()]));
    let changed = "the rows of episode 0, episode 1, episode 2 were changed";
    assert!(status == 0 && stderr.contains(changed), "{stderr}");
    std::fs::write(&settings, &whole).expect("it is writable");
    let torn: Vec<u8> =
        bytes.iter().enumerate().map(|(at, byte)| if at % 991 == 990 { !byte } else { *byte }).collect();
    std::fs::write(scratch.path("run/run.db"), torn).expect("it is writable");
    fails(&["run", "--resume", &out], "begin a new one");
}

/// Advice goes by what the directory holds, not by what somebody put into its database.
#[test]
fn rows_of_a_training_do_not_make_a_run_one() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    assert_eq!(run_into(&out).0, 0);
    let rows = "INSERT INTO result VALUES (1, 'x', '{}'); INSERT INTO checkpoint VALUES (1, 5, 'x', x'00')";
    change(&scratch.path("run/run.db"), rows);
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--out", &scratch.text("page.html")]));
    let is_told = stderr.contains("has results, which only a training has: they count for nothing");
    assert!(status == 0 && is_told && !stderr.contains("avastra train"), "{stderr}");
}

#[test]
fn printed_commands_can_be_pasted() {
    let scratch = Scratch::new();
    let out = scratch.text("a b'c");
    assert_eq!(run_into(&out).0, 0);
    let quoted = format!("'{}'", out.replace('\'', r"'\''"));
    let (status, _, stderr) = run_into(&out);
    assert!(
        status == 1 && stderr.contains(&format!("go on with `avastra run --resume {quoted}`")),
        "{stderr}"
    );
    fails(&["train", "--resume", &out], &format!("go on with `avastra run --resume {quoted}`"));
}

#[test]
fn one_process_at_a_time_works_in_a_directory() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    assert_eq!(run_into(&out).0, 0);
    let other = std::fs::File::open(scratch.path("run")).expect("it is there");
    other.lock().expect("no process holds it");
    fails(&["run", "--resume", &out], "another avastra is at work");
    other.unlock().expect("it was locked");
    resumed(&out);
}

#[test]
fn every_file_is_verified() {
    let scratch = Scratch::new();
    let good = root().join("policies/corner.ava");
    let text = std::fs::read_to_string(&good).expect("it is shipped");
    // Its own digest is made right again, as somebody who means harm would.
    let sealed = |text: &str, name: &str| {
        let path = scratch.path(name);
        let text = text.replace("../scenarios/avastra45.ava", &root().join(SPACE).display().to_string());
        std::fs::write(&path, &text).expect("it is writable");
        let (_, _, stderr) = outcome(&mut avastra(&["check", &path.display().to_string()]));
        if let Some((_, found)) = stderr.split_once("the file has ") {
            let found = found.split_whitespace().next().expect("a digest");
            let before = "\n    digest: \"";
            let at = text.find(before).expect("it is sealed") + before.len();
            let was = &text[at..at + found.len()];
            std::fs::write(&path, text.replace(was, found)).expect("it is writable");
        }
        path.display().to_string()
    };
    let engine = text.lines().find(|line| line.contains("engine: ")).expect("it has one");
    let foreign = sealed(&text.replace(engine, "    engine: \"plane/0\""), "foreign.ava");
    let liar = sealed(&text.replacen("episodes: 15", "episodes: 4000000000", 1), "liar.ava");
    let (status, stdout, stderr) = outcome(&mut avastra(&["replay", &liar, &foreign, &foreign]));
    assert_eq!(status, 1, "{stdout}{stderr}");
    assert!(stderr.contains("claims more episodes than can be played again"), "{stderr}");
    assert_eq!(stdout.matches("was trained in world `plane/0`").count(), 2, "each file is judged: {stdout}");
}

#[test]
fn only_regular_files_of_a_sensible_size_are_read() {
    let scratch = Scratch::new();
    let fifo = scratch.text("pipe.ava");
    let made = std::process::Command::new("mkfifo").arg(&fifo).status().expect("it starts");
    assert!(made.success());
    let file = |name: &str, text: &str| {
        std::fs::write(scratch.path(name), text).expect("it is writable");
        scratch.text(name)
    };
    // A missing name makes `check` look at the neighbours, of which one is a pipe and one is huge.
    std::os::unix::fs::symlink("/etc/passwd", scratch.path("link.ava")).expect("links can be made");
    let hint = file("hint.ava", "language 1\nlet there = 3 m\n");
    let huge = file("huge.ava", &format!("language 1\nlet a = {}1\n", "1 + ".repeat(2_600_000)));
    let cases = [
        (file("unknown.ava", "language 1\nlet far = there + 1 m\n"), 2, "`there` is declared in `hint.ava`"),
        (file("device.ava", "language 1\nuse \"/dev/zero\"\n"), 2, "it is no regular file"),
        (file("waits.ava", "language 1\nuse \"pipe.ava\"\n"), 2, "it is no regular file"),
        (
            file(
                "map.ava",
                "language 1\nroad r { map: \"/dev/zero\" start: lane 1/-1 at 0 m goal: lane 1/-1 at 1 m }\n",
            ),
            2,
            "it is no regular file",
        ),
        (
            file("climbs.ava", "language 1\nuse \"../../../../../../etc/passwd\"\n"),
            2,
            "neither a source (`.ava`)",
        ),
        (file("follows.ava", "language 1\nuse \"link.ava\"\n"), 2, "neither a source (`.ava`)"),
        (huge, 1, "it is larger than 4 MiB"),
        (fifo.clone(), 1, "it is no regular file"),
        ("/dev/zero".to_owned(), 1, "it is no regular file"),
        (hint, 0, ""),
    ];
    for (path, wanted, message) in cases {
        let (status, _, stderr) = outcome(avastra(&["check", &path]).timeout(TIME_MAX));
        assert!(status == wanted && stderr.contains(message), "{path}: {stderr}");
        assert!(!stderr.contains("root:"), "the file at the end of the path is not shown: {stderr}");
    }
}

#[test]
fn a_link_to_nothing_is_not_replaced() {
    let scratch = Scratch::new();
    let link = scratch.path("link.yaml");
    std::os::unix::fs::symlink(scratch.path("nothing"), &link).expect("links can be made");
    fails(&["compile", SPACE, "-o", &link.display().to_string()], "a link to a file that does not exist");
    assert!(link.is_symlink());
}

#[test]
fn scenarios_that_are_gone_or_edited_are_noticed() {
    let scratch = Scratch::new();
    let out = scratch.text("run");
    let settings = ["--ads", FLICKER, "--road", "corner", "--episodes", "12", "--seed", "5", "--out", &out];
    done(&[&["run", SPACE], &settings[..]].concat());
    let files = entries(scratch.path("run/critical"));
    let [gone, edited, ..] = files.as_slice() else { panic!("the run finds two crashes: {files:?}") };
    let written = std::fs::read(gone).expect("it is readable");
    std::fs::remove_file(gone).expect("it is there");
    edit(edited, "language 1", "// mine\nlanguage 1");
    let stdout = done(&["run", "--resume", &out]);
    assert!(stdout.contains("was missing, is written again"), "{stdout}");
    assert!(stdout.contains("edited since the run wrote it"), "{stdout}");
    assert_eq!(std::fs::read(gone).expect("it is back"), written);

    // A scenario of the user's own is told from those that were found.
    std::fs::copy(gone, scratch.path("run/critical/mine.ava")).expect("it is writable");
    let foreign = "critical/mine.ava: not written by this run, as far as `";
    let stderr = resumed(&out);
    assert!(stderr.contains(foreign), "{stderr}");
    let page = scratch.text("page.html");
    for command in [&["report", &out, "--most", "1", "--out", &page][..], &["test", &out]] {
        let (_, _, stderr) = outcome(&mut avastra(command));
        assert!(stderr.contains(foreign), "{command:?}: {stderr}");
    }

    // A database without anything in it is no reason to play all again over what was found.
    std::fs::write(scratch.path("run/run.db"), "").expect("it is writable");
    fails(&["run", "--resume", &out], "is empty, and `critical` has scenarios");
}

#[test]
fn one_file_that_cannot_be_read_costs_no_other() {
    let (status, stdout, stderr) = outcome(&mut avastra(&["check", "nowhere.ava", SPACE, "neither.ava"]));
    assert!(status == 1 && stdout.contains("no mistakes"), "{stdout}{stderr}");
    assert!(stderr.contains("nowhere.ava") && stderr.contains("neither.ava"), "{stderr}");
    // Mistakes of usage are objects, too.
    let (status, stdout, stderr) = outcome(&mut avastra(&["diff", "--format", "json"]));
    let told: serde_json::Value = serde_json::from_str(stdout.trim_end()).expect("it is JSON");
    assert!(
        status == 1 && stderr.is_empty() && told["error"].as_str().is_some_and(|why| why.contains("<OLD>"))
    );
}

#[test]
fn many_mistakes_are_told_in_time() {
    let scratch = Scratch::new();
    let text = format!("language 1\n{}", "let x = 1\n".repeat(90_000));
    std::fs::write(scratch.path("twice.ava"), text).expect("it is writable");
    let (status, _, stderr) = outcome(&mut avastra(&["check", &scratch.text("twice.ava")]));
    assert!(status == 2 && stderr.contains("88999 further mistakes are not listed"), "{}", stderr.len());
}
