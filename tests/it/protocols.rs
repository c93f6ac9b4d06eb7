//! `run --agent every-row`: each row of a space once, with its tables and its page.

use std::path::Path;

use crate::cases::root;
use crate::command::{avastra, done, outcome};

/// A file of variations of another tool, which is a space of twelve rows on six roads.
const SPEEDS: &str = "tests/cases/imports/crossing_speeds.xosc";

fn space(folder: &Path) -> String {
    let folder = folder.display().to_string();
    done(&["import", "--out", &folder, SPEEDS]);
    format!("{folder}/crossing_speeds.ava")
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("it was written")
}

#[test]
fn each_row_is_played_once_whoever_plays_it() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = space(scratch.path());
    let run = |name: &str, more: &[&str]| {
        let out = scratch.path().join(name);
        let told = out.display().to_string();
        let wanted = ["run", &space, "--agent", "every-row", "--repeat", "0", "--out", &told];
        (done(&[&wanted, more].concat()), out)
    };
    let (said, one) = run("one", &["--jobs", "1"]);
    assert!(said.contains("protocol: "), "{said}");
    let (_, two) = run("two", &["--jobs", "2"]);
    let table = read(&one, "protocol.csv");
    assert_eq!(table, read(&two, "protocol.csv"));
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 13, "{table}");
    assert!(
        lines[0].starts_with("episode,road,action,ego_kmh,walker_kmh,met_m,ending,before_kmh"),
        "{table}"
    );
    // The row's speed is that of its road.
    for line in &lines[1..] {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells[1], format!("at_{}_{}", cells[3], cells[5]), "{line}");
        let before_kmh: f64 = cells[7].parse().expect("a speed");
        let ego_kmh: f64 = cells[3].parse().expect("a speed");
        assert!((before_kmh - ego_kmh).abs() < 2.0, "{line}");
    }
    let cases = read(&one, "protocol.xml");
    let cases = roxmltree::Document::parse(&cases).expect("it is well-formed");
    assert_eq!(cases.descendants().filter(|node| node.has_tag_name("testcase")).count(), 12);
    // In pieces it comes to the same.
    let pieces = ["1/2", "2/2"].map(|shard| {
        let (_, out) = run(&shard.replace('/', "of"), &["--shard", shard]);
        out.display().to_string()
    });
    let whole = scratch.path().join("whole");
    let told = whole.display().to_string();
    done(&["merge", &pieces[0], &pieces[1], "--out", &told]);
    assert_eq!(table, read(&whole, "protocol.csv"));
    let (_, twice) = run("twice", &["--episodes", "2"]);
    assert_eq!(read(&twice, "protocol.csv").lines().count(), 25);
}

/// A protocol of a driving system that fails ends in good order, with a page.
#[test]
fn a_protocol_outlives_its_driving_system() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = space(scratch.path());
    // All of these fail in each episode.
    for how in ["nan", "crash-in-episode", "error", "close-stdout"] {
        let out = scratch.path().join(how).display().to_string();
        let toy =
            format!("'{}' ads toy --misbehave {how}", assert_cmd::cargo::cargo_bin("avastra").display());
        let run = ["run", &space, "--agent", "every-row", "--repeat", "0", "--ads", &toy, "--out", &out];
        let (status, stdout, stderr) = outcome(&mut avastra(&run));
        assert_eq!(status, 5, "{how}: {stderr}");
        assert!(stdout.contains("driving system failed"), "{how}: {stdout}");
        done(&["report", &out]);
        let page = read(Path::new(&out), "report.html");
        let told = page.split(r#""text":""#).nth(1).and_then(|rest| rest.split('"').next());
        assert!(told.is_some_and(|told| told.contains("driving system failed")), "{how}: {told:?}");
    }
}

#[test]
fn a_page_has_heat_maps_by_parameters() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = space(scratch.path());
    let out = scratch.path().join("run").display().to_string();
    done(&["run", &space, "--agent", "every-row", "--repeat", "0", "--out", &out]);
    let page = |more: &[&str]| {
        let said = done(&[&["report", &out], more].concat());
        (said, read(Path::new(&out), "report.html"))
    };
    let (_, own) = page(&[]);
    let has = |page: &str, wanted: &[&str]| wanted.iter().all(|wanted| page.contains(wanted));
    assert!(has(&own, &[r#""across":"walker_kmh""#, r#""down":"ego_kmh""#]), "its main parameters");
    let (_, asked) = page(&["--by", "walker_kmh,ego_kmh", "--by", "road"]);
    assert!(has(&asked, &[r#""rows":["5","8"]"#, r#""columns":["25","30","35"]"#, r#""down":"road""#]));
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--by", "colour"]));
    assert!(status == 1 && stderr.contains("name one or two of `road`, `ego_kmh`"), "{status} {stderr}");
    let (status, _, stderr) = outcome(&mut avastra(&["report", "scenarios/found", "--by", "road"]));
    assert!(status == 1 && stderr.contains("name the folder of a run"), "{status} {stderr}");
    // Any run has them if they are asked for.
    let other = scratch.path().join("random").display().to_string();
    done(&[
        "run",
        "scenarios/avastra45.ava",
        "--road",
        "corner",
        "--episodes",
        "3",
        "--repeat",
        "0",
        "--out",
        &other,
    ]);
    done(&["report", &other, "--by", "speed,vehicle"]);
    assert!(has(&read(Path::new(&other), "report.html"), &[r#""down":"speed""#]));
}

#[test]
fn what_plays_each_row_is_neither_trained_nor_estimated() {
    let cases = [
        (&["train"][..], "has nothing to learn"),
        (&["estimate", "--method", "count"], "plays each row of a table once"),
    ];
    for (more, told) in cases {
        let asked = [more, &["scenarios/avastra45.ava", "--agent", "every-row"]].concat();
        let (status, _, stderr) = outcome(&mut avastra(&asked));
        assert!(status == 1 && stderr.contains(told), "{more:?}: {status} {stderr}");
    }
}

/// Rows that are about somebody whom others make appear: some of them for sure, one only if a value says so, one at no time.
const AFTER_OTHERS: &str = "language 1
use \"REPOSITORY/scenarios/open_roads.ava\"
enum Lane = Current
episode { roads: [country] limit: 3 steps }
action queue(each n: Int in 1 .. 3) {
  spawn Sedan as [first, second, third] ahead 200 m apart 10 m { does: DriveAhead, lane: Current, speed: 20 m/s, count: n }
}
action slows() { order third { speed: 5 m/s } }
action never() { order second { lane: Left } }
action wall() { spawn Sedan as wall ahead 5 m { does: DriveAhead, lane: Current, speed: 0 m/s } }
action goes() { order wall { speed: 9 m/s } }
";

#[test]
fn a_row_stands_under_its_own_name_whatever_comes_before_it() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = scratch.path().join("after.ava");
    std::fs::write(&space, AFTER_OTHERS.replace("REPOSITORY", &root().display().to_string()))
        .expect("written");
    let (space, out) = (space.display().to_string(), scratch.path().join("run"));
    let told = out.display().to_string();
    let arguments =
        ["run", &space, "--agent", "every-row", "--repeat", "0", "--ads", "blind", "--out", &told];
    done(&arguments);
    let table = read(&out, "protocol.csv");
    let of = |action: &str| {
        let found = table.lines().filter(|line| line.split(',').nth(2) == Some(action));
        found.collect::<Vec<_>>().join("\n")
    };
    assert_eq!(of("queue").lines().count(), 3, "{table}");
    assert!(of("slows").contains(",hit,"), "behind the queue of three: {table}");
    assert!(of("never").contains("cannot order `second`"), "{table}");
    assert!(of("wall").contains("hit"), "{table}");
    assert!(of("goes").contains("the ego vehicle touched somebody before it came"), "{table}");
}
