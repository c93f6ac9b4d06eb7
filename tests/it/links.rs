//! Hostile directories: whatever links and names they hold, no command touches anything outside them, and no command that only
//! looks, plans or merges starts a program.
//!
//! A home holds files of the user and the folder `clone`, which came from elsewhere and in which commands run. Each attack
//! plants something in the clone, runs one command there, and compares everything beside the clone with what it was.

use std::collections::BTreeMap;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin;
use avastra::estimate::EstimateDatabase;
use avastra::run::{Database, Units};

use crate::cases::{entries, name, root};
use crate::command::{avastra, done, done_in, outcome};
use crate::world::FLICKER;

/// How a command must end.
#[derive(Clone, Copy)]
enum End {
    /// With success: a link is replaced, or does not matter.
    Done,
    /// With an error that has these words.
    Refused(&'static str),
    /// With any status: only what lies outside matters.
    Any,
}
use End::{Any, Done, Refused};

/// Words of the error about a link.
const LINK: &str = "it is a symbolic link";
/// Words of the error about a link on the way to a place that was named to be read.
const WAY: &str = "on the way to it is a symbolic link";
/// Words of the error about a pipe, a device or a folder in the place of a file.
const REGULAR: &str = "it is no regular file";
/// Words of the error about a database in another journal mode.
const WAL: &str = "journal mode WAL";
/// Words of the errors about a name in a database.
const PLAIN: &str = "is no plain name";
const NAME: &str = "is no name of a scenario";

/// Merges the two shards of the fixture's estimate.
const MERGE: &[&str] = &["merge", "e1", "e2", "--out", "m"];

struct Attack {
    /// Links in the clone, each with its target in the home.
    links: &'static [(&'static str, &'static str)],
    /// A further change of the clone before the command.
    change: Option<fn(&Path)>,
    command: &'static [&'static str],
    end: End,
}

const fn linked(
    links: &'static [(&'static str, &'static str)],
    command: &'static [&'static str],
    end: End,
) -> Attack {
    Attack { links, change: None, command, end }
}

const fn changed(
    links: &'static [(&'static str, &'static str)],
    change: fn(&Path),
    command: &'static [&'static str],
    end: End,
) -> Attack {
    Attack { links, change: Some(change), command, end }
}

/// The scenario that the run of the fixture found first.
const FOUND: &str = "run/critical/corner_0000.ava";

/// A link on the way to it.
const CRITICAL: [(&str, &str); 1] = [("run/critical", "folder")];

/// In commands, `SPACE` and the like stand for files of the repository, `FOUND` for [`FOUND`], and `QUICK` for options of a short
/// run; the number of episodes follows.
const ATTACKS: &[Attack] = &[
    // Links with the names that temporary files once had.
    linked(&[("x.ava.partial", "mine.txt")], &["fmt", "x.ava"], Done),
    linked(&[("run/report.html.partial", "mine.txt")], &["report", "run"], Done),
    linked(&[("r.svg.partial", "mine.txt")], &["render", "FOUND", "--at", "1", "-o", "r.svg"], Done),
    linked(&[("m.svg.partial", "mine.txt")], &["road", "SPACE", "--road", "corner", "--svg", "m.svg"], Done),
    linked(
        &[("w.safetensors.partial", "mine.txt")],
        &["policy", "weights", "POLICY", "-o", "w.safetensors"],
        Done,
    ),
    linked(&[("s.ava.partial", "mine.txt")], &["shrink", "FOUND", "-o", "s.ava"], Done),
    linked(&[("j.xml.partial", "mine.txt")], &["test", "run", "--junit", "j.xml"], Any),
    linked(
        &[("out/corner_0000.ava.partial", "mine.txt")],
        &["export", "--to", "ava", "FOUND", "--out", "out"],
        Done,
    ),
    linked(
        &[("run/run.db.partial", "mine.txt"), ("run/run.db.partial-journal", "mine.txt")],
        &["run", "--resume", "run"],
        Done,
    ),
    linked(
        &[("begun/run.yaml.partial", "mine.txt")],
        &["run", "SPACE", "QUICK", "1", "--out", "begun"],
        Done,
    ),
    // Destinations that are links.
    linked(&[("run/report.html", "mine.txt")], &["report", "run"], Done),
    linked(&[("run/report.html", "folder")], &["report", "run"], Done),
    linked(&[("corner_0000.svg", "mine.txt")], &["render", "FOUND", "--at", "1"], Done),
    linked(&[("corner_0000.html", "mine.txt")], &["report", "FOUND"], Done),
    linked(
        &[
            ("build/last", "mine.txt"),
            ("build/avastra45.table.yaml", "mine.txt"),
            ("build/last.partial", "mine.txt"),
        ],
        &["compile", "SPACE"],
        Done,
    ),
    linked(&[("out/corner_0000.ava", "nowhere")], &["export", "--to", "ava", "FOUND", "--out", "out"], Done),
    linked(
        &[("run/critical/exported/corner_0000.csv", "mine.txt")],
        &["export", "--to", "csv", "FOUND"],
        Done,
    ),
    linked(
        &[("run/critical/exported/corner.xodr", "nowhere")],
        &["export", "--to", "openscenario", "FOUND"],
        Refused("in the place of the map"),
    ),
    linked(&[("osc/cut_in.ava", "nowhere")], &["import", "XOSC", "--out", "osc"], Refused("there already")),
    linked(
        &[("osc/boulevard.xodr", "nowhere")],
        &["import", "XOSC", "--out", "osc"],
        Refused("in the place of the map"),
    ),
    linked(&[("fresh/space.ava", "nowhere")], &["new", "fresh"], Refused("exists")),
    linked(
        &[("e1/results.json", "mine.txt"), ("e1/results.json.partial", "mine.txt")],
        &["estimate", "--resume", "e1"],
        Done,
    ),
    linked(
        &[("searched/results.json", "mine.txt"), ("searched/results.json.partial", "mine.txt")],
        &["train", "--resume", "searched"],
        Done,
    ),
    linked(&[(FOUND, "nowhere")], &["run", "--resume", "run"], Done),
    linked(&[("begun/shard.yaml", "mine.txt")], &["run", "SPACE", "QUICK", "1", "--out", "begun"], Done),
    linked(
        &[("begun/shard.yaml", "mine.txt")],
        &["run", "SPACE", "QUICK", "2", "--shard", "1/2", "--out", "begun"],
        Done,
    ),
    // Databases that are links: to a database of the user, and to a place where one would be made.
    changed(&[("run/run.db", "mine.db")], own_database, &["report", "run"], Refused(LINK)),
    changed(&[("run/run.db", "mine.db")], own_database, &["run", "--resume", "run"], Refused(LINK)),
    linked(&[("run/run.db", "nowhere")], &["run", "--resume", "run"], Any),
    linked(&[("run/run.db-journal", "mine.txt")], &["run", "--resume", "run"], Any),
    linked(&[("run/run.db-journal", "nowhere")], &["run", "--resume", "run"], Any),
    linked(&[("e1/estimate.db", "nowhere")], &["estimate", "--resume", "e1"], Refused(LINK)),
    // A database in the journal mode WAL, in which SQLite writes into `run.db-shm` even to read.
    // SQLite would take such names for URIs, and make the database elsewhere.
    linked(&[("sub", "folder")], &["run", "SPACE", "QUICK", "1", "--out", "file:sub"], Done),
    linked(&[("mode", "folder")], &["run", "SPACE", "QUICK", "1", "--out", "file:mode?mode=memory"], Done),
    changed(
        &[("sub", "folder")],
        |clone| copy(&clone.join("run"), &clone.join("file:sub")),
        &["run", "--resume", "file:sub"],
        Done,
    ),
    // What lies beside a database.
    changed(&[], |clone| pipe(&clone.join("run/run.db-journal")), &["report", "run"], Refused(REGULAR)),
    changed(
        &[],
        |clone| pipe(&clone.join("run/run.db-journal")),
        &["run", "--resume", "run"],
        Refused(REGULAR),
    ),
    changed(&[], |clone| pipe(&clone.join("e1/estimate.db-journal")), MERGE, Refused(REGULAR)),
    changed(
        &[],
        |clone| named_again(clone, "run/run.db-journal"),
        &["run", "--resume", "run"],
        Refused("hard link"),
    ),
    changed(&[], with_wal, &["run", "--resume", "run"], Refused(WAL)),
    changed(&[], with_wal, &["report", "run"], Refused(WAL)),
    // Devices and pipes in the place of files.
    linked(
        &[("out/corner_0000.ava", "/dev/zero")],
        &["export", "--to", "ava", "FOUND", "--out", "out"],
        Refused("with another content"),
    ),
    changed(&[], |clone| pipe(&clone.join("m/estimate.yaml")), MERGE, Refused("is not empty")),
    changed(
        &[],
        |clone| pipe(&clone.join("reused")),
        &["study", "theirs.yaml", "--dry-run", "--reuse", "reused"],
        Refused("reused"),
    ),
    changed(&[], in_wal, &["report", "run"], Refused(WAL)),
    changed(&[], in_wal, &["run", "--resume", "run"], Refused(WAL)),
    changed(&[], in_wal, &["merge", "run", "--out", "m"], Refused(WAL)),
    // Folders that are links.
    linked(&[("runs", "folder")], &["run", "SPACE", "QUICK", "1"], Refused(LINK)),
    linked(
        &[("begun/critical", "folder")],
        &["run", "SPACE", "QUICK", "1", "--out", "begun"],
        Refused("not empty"),
    ),
    linked(
        &[("begun/critical/space", "folder")],
        &["run", "SPACE", "QUICK", "1", "--self-contained", "--out", "begun"],
        Refused(LINK),
    ),
    linked(&[("run/critical", "folder")], &["run", "--resume", "run"], Refused(LINK)),
    linked(&[("run/failures", "folder")], &["run", "--resume", "run"], Refused(LINK)),
    linked(&[("searched/policy", "folder")], &["train", "--resume", "searched"], Refused(LINK)),
    linked(&[("run/critical", "folder")], &["test", "--accept", "run"], Refused(LINK)),
    linked(&[("run/shrunk", "folder")], &["shrink", "FOUND"], Refused(LINK)),
    linked(&[("run/critical/exported", "folder")], &["export", "--to", "csv", "FOUND"], Refused(LINK)),
    linked(&[("out/space", "folder")], &["export", "--to", "ava", "FOUND", "--out", "out"], Refused(LINK)),
    linked(&[("build", "folder")], &["compile", "SPACE"], Refused(LINK)),
    linked(&[("fresh/roads", "folder")], &["new", "fresh"], Refused(LINK)),
    linked(&[("ed/docs", "folder")], &["editor-files", "ed"], Refused(LINK)),
    changed(&[("theirs/imported", "folder")], own_import, &["import", "theirs/cut_in.xosc"], Refused(LINK)),
    // Folders that are links, on the way to what is named.
    changed(&CRITICAL, critical_elsewhere, &["export", "--to", "csv", "FOUND"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["export", "--to", "openscenario", "FOUND"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["export", "--to", "csv", "FOUND", "--out", "out"], Done),
    changed(&CRITICAL, critical_elsewhere, &["test", "--accept", "run/critical"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["test", "--accept", "FOUND"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["report", "run/critical"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["report", "run/critical", "--out", "page.html"], Any),
    changed(&CRITICAL, critical_elsewhere, &["fmt", "run/critical/x.ava"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["fmt", "./run/critical/../critical/x.ava"], Any),
    changed(&CRITICAL, critical_elsewhere, &["check", "--fix", "run/critical/typo.ava"], Refused(WAY)),
    changed(&CRITICAL, critical_elsewhere, &["shrink", "FOUND"], Done),
    linked(&CRITICAL, &["policy", "weights", "run/critical/p.ava"], Refused(WAY)),
    linked(&CRITICAL, &["policy", "distil", "run/critical/p.ava"], Refused(WAY)),
    linked(&CRITICAL, &["import", "run/critical/cut_in.xosc"], Refused(WAY)),
    // Scenarios that were edited, so that `--accept` writes them.
    changed(
        &[("run/critical/corner_0000.ava.partial", "mine.txt")],
        edited,
        &["test", "--accept", "run"],
        Any,
    ),
    changed(&[(FOUND, "mine.ava")], edited_elsewhere, &["test", "--accept", "run"], Any),
    // Merges: links in shards and in the way, and names that databases give.
    linked(&[("m.partial", "folder")], MERGE, Refused(LINK)),
    linked(&[("m.partial/merge.partial", "mine.txt")], MERGE, Refused(LINK)),
    linked(&[("e2/critical", "folder")], MERGE, Refused(LINK)),
    linked(&[("run/critical/space", "folder")], &["merge", "run", "--out", "m"], Any),
    // The text comes from the sealed database.
    changed(&[(FOUND, "mine.ava")], moved_away, &["merge", "run", "--out", "m"], Done),
    changed(&[], |clone| name_in_estimate(&clone.join("e2"), "../../../mine.txt"), MERGE, Refused(PLAIN)),
    changed(
        &[],
        |clone| name_in_estimate(&clone.join("e2"), &beside(clone, "mine.txt")),
        MERGE,
        Refused(PLAIN),
    ),
    changed(
        &[("e2/critical/a", "folder")],
        |clone| name_in_estimate(&clone.join("e2"), "a/keep.txt"),
        MERGE,
        Refused(PLAIN),
    ),
    changed(
        &[],
        |clone| name_in_estimate(&clone.join("e1"), &beside(clone, "mine.txt")),
        &["estimate", "--resume", "e1"],
        Refused(PLAIN),
    ),
    changed(&[], |clone| name_in_estimate(&clone.join("e2"), ".bashrc"), MERGE, Refused(NAME)),
    changed(&[], |clone| name_in_estimate(&clone.join("e2"), "-rf.ava"), MERGE, Refused(NAME)),
    changed(
        &[],
        |clone| name_in_estimate(&clone.join("e1"), "x.sh"),
        &["estimate", "--resume", "e1"],
        Refused(NAME),
    ),
    changed(
        &[],
        |clone| name_in_estimate(&clone.join("e1"), "estimate.yaml"),
        &["estimate", "--resume", "e1"],
        Refused(NAME),
    ),
    changed(&[], road_in_run, &["merge", "run", "--out", "m"], Refused(PLAIN)),
    changed(&[], road_in_run, &["run", "--resume", "run"], Refused("plain name")),
    // Programs that files name: the fixture's leaves a file beside the clone when it is started.
    linked(&[], &["study", "theirs.yaml", "--dry-run"], Done),
    linked(&[], &["run", "SPACE", "--ads", "profile.yaml", "--dry-run"], Done),
    linked(&[], &["estimate", "SPACE", "--ads", "profile.yaml", "--dry-run"], Done),
    linked(&[], &["merge", "p1", "p2", "--out", "m"], Done),
    linked(&[], &["merge", "p1", "p2", "--missing"], Done),
    linked(&[], &["report", "p1"], Done),
    changed(
        &[],
        |clone| std::fs::remove_file(clone.join("driver.sh")).expect("it is there"),
        &["merge", "p1", "p2", "--out", "m"],
        Done,
    ),
];

#[test]
fn nothing_outside_is_touched_or_started() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let fixture = scratch.path().join("fixture");
    make_home(&fixture);
    let fixture = &fixture;
    let numbered: Vec<(usize, &Attack)> = ATTACKS.iter().enumerate().collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(4);
    std::thread::scope(|scope| {
        for own in numbered.chunks(numbered.len().div_ceil(threads)) {
            scope.spawn(move || own.iter().for_each(|(number, attack)| attacked(fixture, *number, attack)));
        }
    });
}

/// Carries one attack out, in a home of its own.
fn attacked(fixture: &Path, number: usize, attack: &Attack) {
    let home = fixture.with_file_name(number.to_string());
    copy(fixture, &home);
    let clone = home.join("clone");
    if let Some(change) = attack.change {
        change(&clone);
    }
    for (link, target) in attack.links {
        let link = clone.join(link);
        std::fs::create_dir_all(link.parent().expect("it lies in the clone")).expect("it is writable");
        if link.is_dir() {
            std::fs::remove_dir_all(&link).expect("it is writable");
        }
        let _ = std::fs::remove_file(&link);
        symlink(home.join(target), &link).expect("links can be made");
    }
    let before = outside(&home);
    let mut arguments: Vec<String> = Vec::new();
    for word in attack.command {
        match *word {
            "QUICK" => arguments
                .extend(["--keep", "0", "--ads", "cc", "--road", "corner", "--episodes"].map(str::to_owned)),
            "SPACE" => arguments.push(shipped("scenarios/avastra45.ava")),
            "POLICY" => arguments.push(shipped("policies/corner.ava")),
            "XOSC" => arguments.push(shipped("tests/cases/imports/cut_in.xosc")),
            "FOUND" => arguments.push(FOUND.to_owned()),
            word => arguments.push(word.to_owned()),
        }
    }
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (status, stdout, stderr) = outcome(avastra(&words).current_dir(&clone));
    let told = format!("{:?} {}\n{stdout}{stderr}", attack.links, words.join(" "));
    let after = outside(&home);
    let is_touched = |(path, found): &(&PathBuf, &Vec<u8>)| before.get(*path) != Some(*found);
    let touched: Vec<_> = after.iter().filter(is_touched).map(|(path, _)| path).collect();
    let gone: Vec<_> = before.keys().filter(|path| !after.contains_key(*path)).collect();
    assert!(touched.is_empty() && gone.is_empty(), "touched {touched:?}, gone {gone:?}: {told}");
    assert!(!stderr.contains("panicked"), "{told}");
    match attack.end {
        Done => assert_eq!(status, 0, "{told}"),
        Refused(words) => assert!(status != 0 && stderr.contains(words), "{told}"),
        Any => {}
    }
    std::fs::remove_dir_all(home).expect("it is writable");
}

/// A home with files of the user, and a clone with all that the attacks need.
fn make_home(home: &Path) {
    let clone = home.join("clone");
    let write = |name: &str, text: &str| std::fs::write(home.join(name), text).expect("it is writable");
    std::fs::create_dir_all(home.join("folder")).expect("it is writable");
    std::fs::create_dir_all(&clone).expect("it is writable");
    write("mine.txt", "mine\n");
    write("folder/keep.txt", "kept\n");
    write("clone/x.ava", "language 1\nlet   a = 3 m\n");
    // This driving system leaves a file beside the clone when it is started.
    let driver = clone.join("driver.sh");
    let toy = cargo_bin("avastra").display().to_string();
    write("clone/driver.sh", &format!("#!/bin/sh\ntouch ../started\nexec '{toy}' ads toy\n"));
    std::fs::set_permissions(&driver, std::fs::Permissions::from_mode(0o700)).expect("it is ours");
    write("clone/profile.yaml", "ads:\n  command: [./driver.sh]\n");
    let space = shipped("scenarios/avastra45.ava");
    let theirs = "roads: [corner]\nads_config: profile.yaml\nagents: [{ name: random, repeats: 1 }]\n\
                  evaluation: { episodes: 1, seeds: 1 }\nbaselines: [random]\n";
    write("clone/theirs.yaml", &format!("space: {space}\n{theirs}"));
    let flicker = shipped(FLICKER);
    let played = |arguments: &[&str]| drop(done_in(&clone, arguments));
    let corner = ["--road", "corner"];
    let found = ["--self-contained", "--episodes", "8", "--seed", "8", "--ads", &flicker, "--out", "run"];
    played(&[&["run", &space][..], &corner, &found].concat());
    assert!(clone.join(FOUND).is_file(), "the run finds a crash: choose another seed");
    for (shard, parts, external) in [("1/2", "e1", "p1"), ("2/2", "e2", "p2")] {
        let shard = ["--shard", shard];
        let estimate = ["--ads", "cc", "--parts", "2", "--episodes", "1", "--out", parts];
        played(&[&["estimate", &space][..], &corner, &shard, &estimate].concat());
        let run = ["--ads", "profile.yaml", "--episodes", "2", "--out", external];
        played(&[&["run", &space][..], &corner, &shard, &run].concat());
    }
    let train = ["--agent", "bandit", "--ads", "cc", "--episodes", "1", "--out", "searched"];
    played(&[&["train", &space][..], &corner, &train].concat());
    std::fs::remove_file(home.join("started")).expect("the driving system was started");
}

/// A file of the repository.
fn shipped(name: &str) -> String {
    root().join(name).display().to_string()
}

/// A file beside the clone, as a whole path.
fn beside(clone: &Path, name: &str) -> String {
    clone.with_file_name(name).display().to_string()
}

/// Everything in a home outside the clone: files with their bytes, folders and links by their kind.
fn outside(home: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![home.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("it is there").flatten() {
            let (path, kind) = (entry.path(), entry.file_type().expect("it has a kind"));
            if path == home.join("clone") {
                continue;
            }
            let content = if kind.is_dir() {
                open.push(path.clone());
                b"folder".to_vec()
            } else if kind.is_symlink() {
                b"link".to_vec()
            } else {
                std::fs::read(&path).expect("it is readable")
            };
            found.insert(path, content);
        }
    }
    found
}

/// Copies a folder without links, with the rights of its files.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("it is writable");
    for entry in std::fs::read_dir(from).expect("it is there").flatten() {
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).expect("it can be copied");
        }
    }
}

/// Makes a database of the user that SQLite takes for a new one of ours.
fn own_database(clone: &Path) {
    let database = rusqlite::Connection::open(clone.with_file_name("mine.db")).expect("it is new");
    database.execute_batch("CREATE TABLE mine (x); INSERT INTO mine VALUES (1)").expect("it is writable");
}

/// Takes the run's database to the journal mode WAL, and gives a file of the user a further name beside it.
fn in_wal(clone: &Path) {
    let database = rusqlite::Connection::open(clone.join("run/run.db")).expect("it is a database");
    let mode: String =
        database.query_row("PRAGMA journal_mode = WAL", [], |row| row.get(0)).expect("it is writable");
    assert_eq!(mode, "wal");
    drop(database);
    named_again(clone, "run/run.db-shm");
}

/// Makes a pipe that nothing writes to.
fn pipe(path: &Path) {
    std::fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("it is writable");
    let name = std::ffi::CString::new(path.to_str().expect("it is text")).expect("it has no zero");
    // SAFETY: the name is a string with an end.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
}

/// Gives a file of the user a further name in the clone.
fn named_again(clone: &Path, name: &str) {
    std::fs::hard_link(clone.with_file_name("mine.txt"), clone.join(name)).expect("it is free");
}

/// Puts a journal of the mode WAL beside the run's database, which is in another one. SQLite takes it all the same.
fn with_wal(clone: &Path) {
    std::fs::write(clone.join("run/run.db-wal"), "").expect("it is writable");
    named_again(clone, "run/run.db-shm");
}

/// Puts a file to import into a folder of the clone.
fn own_import(clone: &Path) {
    let text = std::fs::read_to_string(shipped("tests/cases/imports/cut_in.xosc")).expect("it is shipped");
    let text = text.replace("../../../scenarios", &shipped("scenarios"));
    let text = text.replace("\"catalogue\"", &format!("\"{}\"", shipped("tests/cases/imports/catalogue")));
    std::fs::create_dir(clone.join("theirs")).expect("it is new");
    std::fs::write(clone.join("theirs/cut_in.xosc"), text).expect("it is writable");
}

/// Copies the scenarios of the run to a folder of the user, and puts files there that `fmt` and `check --fix` would change.
fn critical_elsewhere(clone: &Path) {
    let folder = clone.with_file_name("folder");
    copy(&clone.join("run/critical"), &folder);
    std::fs::copy(clone.join("x.ava"), folder.join("x.ava")).expect("it can be copied");
    std::fs::write(folder.join("typo.ava"), "language 1\nlet a = 3 m;\n").expect("it is writable");
}

/// Refutes a claim of the scenario.
fn edited(clone: &Path) {
    let text = std::fs::read_to_string(clone.join(FOUND)).expect("it is there");
    let other = text.replacen("trace == \"sha256:", "trace == \"sha256:0", 1);
    assert_ne!(text, other);
    std::fs::write(clone.join(FOUND), other).expect("it is writable");
}

/// As [`edited`], and moves the scenario to a file of the user.
fn edited_elsewhere(clone: &Path) {
    edited(clone);
    moved_away(clone);
}

/// Moves the scenario to a file of the user.
fn moved_away(clone: &Path) {
    std::fs::rename(clone.join(FOUND), clone.with_file_name("mine.ava")).expect("it is there");
}

/// Changes a database and seals a unit of it anew: seals need no key.
fn forge<D: Units>(file: &Path, unit: i64, change: &str) {
    let database = rusqlite::Connection::open(file).expect("it is there");
    database.execute_batch(change).expect("the tables are as they were");
    database.execute("DELETE FROM seal WHERE unit = ?", [unit]).expect("it is writable");
    D::LAYOUT.seal(&database, unit).expect("it is writable");
}

/// Adds a part to an estimate that it does not keep, with an event whose scenario has this file name.
fn name_in_estimate(directory: &Path, name: &str) {
    let change = format!(
        "INSERT INTO part SELECT 77, road, 77, probability, episodes, driven_m, duration_s, events, squares, largest,
           simulated_s, levels FROM part LIMIT 1;
         INSERT INTO event VALUES (77, 0, 0, 0, NULL, 1.0);
         INSERT INTO scenario VALUES (77, 0, '{name}', 'language 1');"
    );
    forge::<EstimateDatabase>(&directory.join("estimate.db"), 77, &change);
}

/// Gives the road of an episode with a scenario a name that leads out of the run.
fn road_in_run(clone: &Path) {
    let change = "UPDATE episode SET road = '../../../mine' WHERE episode = 0";
    forge::<Database>(&clone.join("run/run.db"), 0, change);
}

#[test]
fn a_link_that_the_user_names_is_followed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name);
    std::fs::write(at("real.ava"), "language 1\nlet   a = 3 m\n").expect("it is writable");
    symlink("real.ava", at("named.ava")).expect("links can be made");
    done_in(scratch.path(), &["fmt", "named.ava"]);
    assert!(at("named.ava").is_symlink());
    assert_eq!(std::fs::read_to_string(at("real.ava")).expect("it is there"), "language 1\nlet a = 3 m\n");
}

#[test]
fn pages_written_at_once_and_to_a_full_disk_leave_nothing_behind() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let run = scratch.path().join("run");
    let out = run.display().to_string();
    let space = shipped("scenarios/avastra45.ava");
    let settings = ["--ads", "cc", "--road", "corner", "--episodes", "1", "--out", &out];
    done(&[&["run", &space][..], &settings].concat());
    let names = || -> Vec<String> { entries(&run).iter().map(|path| name(path)).collect() };
    // A file that may not grow fails as a full disk does.
    let script =
        format!("trap '' XFSZ; ulimit -f 16; exec '{}' report '{out}'", cargo_bin("avastra").display());
    let full = std::process::Command::new("sh").args(["-c", &script]).output().expect("it starts");
    let stderr = String::from_utf8_lossy(&full.stderr);
    assert!(full.status.code() == Some(1) && stderr.contains("cannot write"), "{stderr}");
    assert_eq!(names(), ["critical", "kept", "run.db", "run.yaml", "space"]);
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                done(&["report", &out]);
            });
        }
    });
    assert_eq!(names(), ["critical", "kept", "report.html", "run.db", "run.yaml", "space"]);
    let page = std::fs::read_to_string(run.join("report.html")).expect("it is there");
    assert!(page.trim_end().ends_with("</html>"), "the page is whole");
}

#[test]
fn nothing_that_a_file_or_a_program_brings_acts_on_the_terminal() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let named = scratch.path().join("\u{1b}[2J\u{9b}1m.ava");
    std::fs::write(&named, "language 1\nlet a = \u{1b}]0;title\u{7} 3 m + 1 s // \u{9b}31m\n")
        .expect("it is writable");
    let named = named.display().to_string();
    let shouting = ["ads", "check", "--ads", r#"sh -c "printf '\033[2Jgone\n' >&2; exit 3""#];
    let commands: [&[&str]; 5] = [
        &["check", &named],
        &["check", &named, "--format", "plain"],
        &["fmt", &named],
        &["run", &named],
        &shouting,
    ];
    for arguments in commands {
        let (_, stdout, stderr) = outcome(&mut avastra(arguments));
        let said = format!("{stdout}{stderr}");
        let acts = |c: char| c.is_control() && c != '\n';
        assert!(!said.is_empty() && !said.contains(acts), "{arguments:?}: {said:?}");
    }
    let (_, stdout, _) = outcome(&mut avastra(&shouting));
    assert!(stdout.contains("\u{fffd}[2Jgone"), "{stdout}");
    // With colours, those of avastra alone.
    let (_, _, stderr) = outcome(&mut avastra(&["check", &named, "--color", "always"]));
    let kept = stderr.split('\u{1b}').skip(1).all(|rest| {
        let codes = rest.strip_prefix('[').and_then(|rest| rest.split_once('m'));
        codes.is_some_and(|(codes, _)| codes.chars().all(|c| c.is_ascii_digit() || c == ';'))
    });
    assert!(kept && stderr.contains(r"\u{1b}[2J"), "{stderr:?}");
}
