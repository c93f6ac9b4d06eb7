//! Estimates: they depend on their settings alone, and bad requests are refused. That the methods have no bias is tested
//! beside them, on twins whose probability is known.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cases::{entries, expect_snapshot};
use crate::command::{avastra, change, done, fails, last_line, outcome};
use crate::report::index_of;

const SPACE: &str = "scenarios/avastra45.ava";

/// Episodes of one road with a system that crashes often enough to count.
fn arguments<'a>(method: &'a str, episodes: &'a str, parts: &'a str, out: &'a str) -> Vec<&'a str> {
    let ads = ["--ads", "reactive", "--traffic", "released", "--event", "collision", "--road", "corner"];
    let how =
        ["--method", method, "--episodes", episodes, "--parts", parts, "--out", out, "--format", "json"];
    [&["estimate", SPACE][..], &ads, &how].concat()
}

fn kept(directory: &Path) -> Vec<u8> {
    std::fs::read(directory.join("results.json")).expect("every estimate writes it")
}

/// Leaves the directory of an estimate as a kill after its first part does, in the middle of the next.
fn cut(directory: &Path) {
    let database = rusqlite::Connection::open(directory.join("estimate.db")).expect("it is a database");
    let later = "DELETE FROM scenario WHERE part > 0; DELETE FROM event WHERE part > 0;
                 DELETE FROM seal WHERE unit > 0; DELETE FROM part WHERE part > 0;";
    database.execute_batch(later).expect("it can be cut");
    let left: u32 =
        database.query_row("SELECT count(*) FROM part", [], |row| row.get(0)).expect("it has parts");
    assert_eq!(left, 1);
    std::fs::remove_file(directory.join("results.json")).expect("every estimate writes it");
}

#[test]
fn an_estimate_depends_on_its_settings_alone() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for (method, episodes, parts) in [("count", "20", "4"), ("probe", "10", "3")] {
        let directory = scratch.path().join(method);
        let out = directory.display().to_string();
        let (status, stdout, stderr) =
            outcome(avastra(&arguments(method, episodes, parts, &out)).args(["--jobs", "1"]));
        assert_eq!(status, 0, "{stderr}");
        let together = &last_line(&stdout)["results"]["together"];
        let text = serde_json::to_string_pretty(together).expect("it is JSON");
        expect_snapshot("estimates", method, &text);
        let whole = kept(&directory);
        assert!(
            directory.join("space/avastra45.ava").is_file(),
            "its crashes can be looked at if the space changes"
        );

        // Gone on with, on two threads.
        cut(&directory);
        done(&["estimate", "--jobs", "2", "--resume", &out]);
        assert_eq!(kept(&directory), whole, "{method}");
    }
    // What was tried out beside the episodes replays like any episode: it has their seeds and a script of its own.
    let files = entries(scratch.path().join("probe/critical"));
    assert!(!files.is_empty(), "a trial found something");
    let verified = outcome(avastra(&["replay"]).args(files.iter().take(3)));
    assert_eq!(verified.0, 0, "{verified:?}");
    only_its_database_counts(scratch.path(), &files);
}

/// The pages, merges and scenarios of an estimate follow from its database, even if its other files are edited or gone.
fn only_its_database_counts(scratch: &Path, files: &[PathBuf]) {
    let directory = scratch.join("probe");
    let text = |path: &Path| std::fs::read_to_string(path).expect("it is readable");
    let [gone, edited, ..] = files else { panic!("two trials found something: {files:?}") };
    let (gone_text, edited_text, results) = (text(gone), text(edited), kept(&directory));
    std::fs::remove_file(gone).expect("it is there");
    std::fs::write(edited, format!("// mine\n{edited_text}")).expect("it is writable");
    std::fs::write(directory.join("results.json"), "{}").expect("it is writable");
    let named = |name: &str| scratch.join(name).display().to_string();
    let [out, page, merged] = ["probe", "page.html", "merged"].map(named);

    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--most", "1", "--out", &page]));
    let is_told =
        stderr.contains("was edited since it was written") && stderr.contains("1 scenario gone from");
    assert!(status == 0 && is_told, "{stderr}");
    let overview = index_of(&text(Path::new(&page)))["overview"].clone();
    assert_eq!(overview["estimate"], serde_json::from_slice::<Value>(&results).expect("it is JSON"));

    let (status, _, stderr) = outcome(&mut avastra(&["merge", &out, "--out", &merged]));
    assert!(status == 0 && stderr.contains("was edited since it was written"), "{stderr}");
    assert_eq!(kept(Path::new(&merged)), results);
    assert!(Path::new(&merged).join("space/avastra45.ava").is_file());
    for (file, written) in [(gone, &gone_text), (edited, &edited_text)] {
        let name = file.file_name().expect("it has a name");
        assert_eq!(text(&scratch.join("merged/critical").join(name)), *written);
    }

    // A part that was changed is played again.
    change(&directory.join("estimate.db"), "UPDATE part SET probability = 0.9 WHERE part = 2");
    let (status, stdout, stderr) = outcome(&mut avastra(&["estimate", "--resume", &out]));
    assert!(status == 0 && stderr.contains("the rows of part 2 were changed"), "{stderr}");
    let is_told = stdout.contains("was missing, is written again")
        && stdout.contains("edited since the estimate wrote it");
    assert!(is_told, "{stdout}");
    assert_eq!(text(gone), gone_text);
    assert_eq!(kept(&directory), results);

    // The whole folder of scenarios comes back.
    std::fs::remove_dir_all(directory.join("critical")).expect("it is there");
    done(&["estimate", "--resume", &out]);
    assert_eq!([text(gone), text(edited)], [gone_text, edited_text]);

    // A part of which nothing is left is missing, whatever the seals say.
    let tables = [("event", "part"), ("scenario", "part"), ("part", "part"), ("seal", "unit")];
    let gone = tables.map(|(table, key)| format!("DELETE FROM {table} WHERE {key} = 2;")).concat();
    change(&directory.join("estimate.db"), &gone);
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--most", "1", "--out", &page]));
    let is_missing = format!("parts is missing: `avastra estimate --resume {out}` plays it");
    assert!(status == 0 && stderr.contains(&is_missing), "{stderr}");

    // Where all parts were changed there is nothing to show, but it is not unfinished.
    change(&directory.join("estimate.db"), "UPDATE part SET probability = 0.9");
    let (status, _, stderr) = outcome(&mut avastra(&["report", &out, "--out", &page]));
    let is_told = stderr.contains("were changed since they were written")
        && stderr.contains("--resume")
        && stderr.contains("plays them again");
    assert!(status == 1 && is_told && !stderr.contains("yet"), "{stderr}");
}

#[test]
fn an_estimate_stops_at_a_look_and_stays_stopped() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("whole").display().to_string();
    let mut asked = arguments("count", "10", "8", &out);
    // Twenty episodes, those of the first look, take longer than this.
    asked.extend(["--hours", "0.3", "--jobs", "2"]);
    let stdout = done(&asked);
    let results = last_line(&stdout)["results"].clone();
    // Three looks, at 2, 4 and 8 parts, share the 5 %.
    assert_eq!(results["missing"].as_f64(), Some(0.05));
    assert!((results["missing_at_look"].as_f64().expect("it is there") - 0.05 / 3.0).abs() < 1e-12);
    assert!(results["parts"].as_u64() < results["parts_wanted"].as_u64(), "{results}");
    // Gone on with, it has nothing left to do.
    let stdout = done(&["estimate", "--resume", &out, "--format", "json"]);
    assert_eq!(last_line(&stdout)["results"], results);
}

#[test]
fn two_driving_systems_are_told_apart_in_the_same_episodes() {
    let compare = |sides: [&str; 2], jobs: &str| {
        let how = ["--traffic", "released", "--event", "collision", "--episodes", "40", "--road", "corner"];
        let arguments = [
            &["estimate", SPACE, "--ads", sides[0], "--than", sides[1]][..],
            &how,
            &["--jobs", jobs, "--format", "json"],
        ]
        .concat();
        let stdout = done(&arguments);
        last_line(&stdout)["results"].clone()
    };
    let same = compare(["reactive", "reactive"], "1");
    assert_eq!((&same["first_only"], &same["second_only"], &same["p"]), (&0.into(), &0.into(), &1.0.into()));
    assert!(same["both"].as_u64() > Some(0), "{same}");
    let apart = compare(["modular", "reactive"], "1");
    assert_eq!(apart, compare(["modular", "reactive"], "2"));
    assert!(apart["difference"].as_f64() > Some(0.0), "{apart}");
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let cases: [(&[&str], &str); 6] = [
        (&["estimate", SPACE, "--parts", "1"], "from 2 to"),
        (&["estimate", SPACE, "--method", "probe", "--ads", "true ."], "--method count"),
        (&["estimate", SPACE, "--method", "probe", "--agent", "space-filling"], "no weight"),
        (&["estimate", SPACE, "--precision", "2"], "a share of the probability"),
        (&["estimate", SPACE, "--agent", "ddqn"], "has to be trained first"),
        (&["estimate", SPACE, "--than", "nobody"], "no driving system `nobody`"),
    ];
    for (arguments, reason) in cases {
        fails(arguments, reason);
    }
}
