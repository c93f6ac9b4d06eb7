//! Shards: whatever their order, and whatever was killed between, they merge to the bytes of the unsharded directory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::cases::{copy_space, entries, root};
use crate::command::{avastra, background, change, done, fails, outcome};
use crate::world::FLICKER;

const SPACE: &str = "scenarios/avastra45.ava";

/// Every file of a directory with its bytes.
fn files(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(folder) = open.pop() {
        for path in entries(&folder) {
            if path.is_dir() {
                open.push(path);
            } else {
                let bytes = std::fs::read(&path).expect("it is readable");
                found.insert(path.strip_prefix(directory).expect("it is below").to_owned(), bytes);
            }
        }
    }
    found
}

/// Two directories have the same files with the same bytes; but for the times that machines took.
#[track_caller]
fn equal(one: &Path, other: &Path) {
    let (mut one, mut other) = (files(one), files(other));
    for directory in [&mut one, &mut other] {
        directory.remove(Path::new("timing.jsonl"));
    }
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    let differ: Vec<_> = one.iter().filter(|(name, bytes)| other[*name] != **bytes).collect();
    assert!(differ.is_empty(), "{:?}", differ.iter().map(|(name, _)| name).collect::<Vec<_>>());
}

fn text(path: &Path) -> &str {
    path.to_str().expect("it is text")
}

/// Plays a command whole, on two threads, and in shards of another order and depth, which are merged.
fn merged(command: &[&str], kind: &str, order: &[u32]) -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name);
    done(&[command, &["--jobs", "1", "--out", text(&at("whole"))]].concat());
    done(&[command, &["--jobs", "2", "--out", text(&at("threads"))]].concat());
    equal(&at("whole"), &at("threads"));

    let count = order.len();
    let (lost, played) = order.split_last().expect("there are shards");
    let shard = |number: u32| {
        let out = at(&format!("shards/{number}"));
        done(&[command, &["--shard", &format!("{number}/{count}"), "--out", text(&out)]].concat());
        out
    };
    let mut directories: Vec<PathBuf> = played.iter().map(|number| shard(*number)).collect();
    let merge = |directories: &[PathBuf], how: &[&str]| {
        let named: Vec<&str> = directories.iter().map(|directory| text(directory)).collect();
        outcome(&mut avastra(&[&["merge"], &named[..], how].concat()))
    };
    let (status, stdout, stderr) = merge(&directories, &["--missing"]);
    assert_eq!((status, stdout.trim()), (0, lost.to_string().as_str()), "{stderr}");
    let (status, _, stderr) = merge(&directories, &["--out", text(&at("merged"))]);
    assert!(status == 1 && stderr.contains(&format!("shard {lost} of {count} is missing")), "{stderr}");
    assert!(!at("merged").exists() && !at("merged.partial").exists());

    directories.push(shard(*lost));
    assert_eq!(merge(&directories, &["--missing"]).1, "");
    let (status, _, stderr) = merge(&directories, &["--out", text(&at("merged"))]);
    assert_eq!(status, 0, "{stderr}");
    equal(&at("whole"), &at("merged"));
    // Again, in another order, with one of them twice, and with the whole beside them.
    directories.reverse();
    directories.extend([directories[0].clone(), at("merged")]);
    for out in ["merged", "again"] {
        let (status, stdout, stderr) = merge(&directories, &["--out", text(&at(out))]);
        let is_told = stdout.contains(&format!(": {count} shards brought together"));
        assert!(status == 0 && is_told, "{stdout}{stderr}");
        equal(&at("whole"), &at(out));
    }
    // A merge that was killed after it had named the directory is ended by the next one.
    change(&at("merged").join(format!("{kind}.db")), "VACUUM");
    let results = at("merged/results.json");
    if results.is_file() {
        std::fs::remove_file(results).expect("it is there");
    }
    std::fs::write(at("merged/merge.partial"), "").expect("it is writable");
    std::fs::write(at("merged/report.html"), "a page").expect("it is writable");
    directories.pop();
    let (status, _, stderr) = merge(&directories, &["--out", text(&at("merged"))]);
    assert_eq!(status, 0, "{stderr}");
    std::fs::remove_file(at("merged/report.html")).expect("it is left alone");
    equal(&at("whole"), &at("merged"));
    // What is merged is a directory like any other.
    done(&[kind, "--resume", text(&at("again"))]);
    equal(&at("whole"), &at("again"));
    scratch
}

/// A copy of a space is used and taken over only if it means what was played in it.
#[test]
fn an_edited_copy_of_a_space_is_named_and_not_taken_over() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name);
    let command = ["run", SPACE, "--road", "corner", "--episodes", "2", "--seed", "5", "--ads", "cc"];
    for number in ["1", "2"] {
        done(&[&command[..], &["--shard", &format!("{number}/2"), "--out", text(&at(number))]].concat());
    }
    let (one, two) = (at("1"), at("2"));
    let read = |directory: &str| {
        std::fs::read_to_string(at(directory).join("space/avastra45.ava")).expect("it is readable")
    };
    let whole = read("1");
    // A comment changes no meaning.
    std::fs::write(one.join("space/avastra45.ava"), format!("{whole}\n// looked at\n")).expect("writable");
    let says = |arguments: &[&str], wanted: &str, is_said: bool| {
        let (_, stdout, stderr) = outcome(&mut avastra(arguments));
        assert_eq!(format!("{stdout}{stderr}").contains(wanted), is_said, "{arguments:?}: {stdout}{stderr}");
    };
    let looks: [&[&str]; 3] =
        [&["report", text(&one)], &["test", text(&one)], &["run", "--resume", text(&one)]];
    looks.iter().for_each(|look| says(look, "since it was written", false));

    let edited = whole.replacen("let weight_mode = 1.0", "let weight_mode = 2.0", 1);
    assert_ne!(edited, whole);
    std::fs::write(one.join("space/avastra45.ava"), &edited).expect("it is writable");
    looks.iter().for_each(|look| says(look, "1/space` was edited since it was written", true));
    assert_eq!(read("1"), edited, "it is left as it is");
    let merge = |out: &Path| outcome(&mut avastra(&["merge", text(&one), text(&two), "--out", text(out)]));
    let (status, _, stderr) = merge(&at("merged"));
    assert!(status == 0 && stderr.contains("1/space` was edited since it was written"), "{stderr}");
    assert_eq!(read("merged"), whole);

    for shard in [&one, &two] {
        std::fs::remove_dir_all(shard.join("space")).expect("it is there");
    }
    looks[..2]
        .iter()
        .for_each(|look| says(look, "1/space`, the copy of the space of this run, is gone", true));
    let (status, _, stderr) = merge(&at("again"));
    assert!(status == 0 && stderr.contains("is gone"), "{stderr}");
    assert_eq!(read("again"), whole, "it is made of the space");
    says(looks[2], "was missing, is written again", true);
    assert_eq!(read("1"), whole);
}

#[test]
fn eight_shards_of_a_run_make_the_run() {
    let command = ["run", SPACE, "--road", "corner", "--episodes", "21", "--seed", "5", "--ads", FLICKER];
    let scratch = merged(&command, "run", &[3, 8, 1, 6, 2, 5, 7, 4]);
    let scenarios = entries(scratch.path().join("merged/critical"));
    assert!(!scenarios.is_empty(), "without a scenario this says little");
    scenarios.iter().for_each(|file| drop(done(&["replay", text(file)])));

    // Copied to another depth, they are what they were; a torn one is to be played again.
    for (name, bytes) in files(&scratch.path().join("shards")) {
        let copy = scratch.path().join("far/away").join(name);
        std::fs::create_dir_all(copy.parent().expect("it has one")).expect("it is writable");
        std::fs::write(copy, bytes).expect("it is writable");
    }
    let copies: Vec<PathBuf> =
        (1..=8).map(|number| scratch.path().join(format!("far/away/{number}"))).collect();
    let copies: Vec<&str> = copies.iter().map(|copy| text(copy)).collect();
    let moved = scratch.path().join("moved");
    done(&[&["merge"], &copies[..], &["--out", text(&moved)]].concat());
    equal(&scratch.path().join("whole"), &moved);
    let database = scratch.path().join("far/away/4/run.db");
    let bytes = std::fs::read(&database).expect("it is readable");
    std::fs::write(&database, &bytes[..bytes.len() / 2]).expect("it is writable");
    let (status, stdout, stderr) = outcome(&mut avastra(&[&["merge"], &copies[..], &["--missing"]].concat()));
    assert_eq!((status, stdout.trim()), (0, "4"), "{stderr}");
    assert!(stderr.contains("4/run.db"), "{stderr}");
    // One that another version wrote is not torn.
    change(&scratch.path().join("far/away/5/run.db"), "PRAGMA user_version = 9999");
    let (status, stdout, stderr) = outcome(&mut avastra(&[&["merge"], &copies[..], &["--missing"]].concat()));
    assert!(status == 1 && stdout.is_empty() && stderr.contains("it has layout 9999"), "{stdout}{stderr}");

    let merge = |second: &Path| {
        let first = scratch.path().join("shards/1");
        let out = scratch.path().join("refused");
        let (status, _, stderr) =
            outcome(&mut avastra(&["merge", text(&first), text(second), "--out", text(&out)]));
        assert_eq!(status, 1, "{stderr}");
        assert!(!out.exists(), "nothing is left behind");
        stderr
    };
    // Another seed, another version, another world, another cut, another kind.
    let other = scratch.path().join("other");
    done(&[&command[..7], &["6", "--shard", "2/8", "--ads", FLICKER, "--out", text(&other)]].concat());
    let told = merge(&other);
    assert!(told.contains("is no shard of the run in") && told.contains("`seed` was 5"), "{told}");
    let edited = scratch.path().join("shards/2/run.yaml");
    let settings = std::fs::read_to_string(&edited).expect("it is readable");
    let version = env!("CARGO_PKG_VERSION");
    for (was, is, reason) in [
        (format!("avastra: \"{version}\""), "avastra: 0.0.1".to_owned(), "begun by avastra 0.0.1"),
        ("engine: plane".to_owned(), "engine: sphere".to_owned(), "in world `sphere/"),
    ] {
        assert!(settings.contains(&was), "{settings}");
        std::fs::write(&edited, settings.replace(&was, &is)).expect("it is writable");
        let told = merge(&scratch.path().join("shards/2"));
        assert!(told.contains(reason), "{told}");
    }
    std::fs::write(&edited, &settings).expect("it is writable");
    std::fs::write(scratch.path().join("shards/2/shard.yaml"), "shard: 2\nof: 9\n").expect("it is writable");
    let told = merge(&scratch.path().join("shards/2"));
    assert!(told.contains("is shard 2/9") && told.contains("is shard 1/8"), "{told}");
    // Rows that were changed behind its back.
    let longer = "UPDATE episode SET distance_m = distance_m + 1";
    change(&scratch.path().join("shards/3/run.db"), longer);
    let told = merge(&scratch.path().join("shards/3"));
    assert!(told.contains("were changed since they were written"), "{told}");
}

#[test]
fn a_shard_is_gone_on_with() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name);
    let command = ["run", SPACE, "--road", "corner", "--episodes", "40", "--agent", "none"];
    done(&[&command[..], &["--out", text(&at("whole"))]].concat());
    let [one, two] = ["shards/1", "shards/2"].map(at);
    done(&[&command[..], &["--shard", "1/2", "--out", text(&one)]].concat());
    let arguments = [&command[..], &["--shard", "2/2", "--jobs", "1", "--out", text(&two)]].concat();
    let mut child = background(&arguments);
    for _ in 0..1200 {
        if two.join("run.db").is_file() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    child.kill().expect("it is ours to kill");
    child.wait().expect("it ends");
    let resumed = ["run", "--resume", text(&two), "--format", "json"];
    let stdout = done(&resumed);
    assert!(stdout.contains("\"episodes\":20"), "the other half is not played: {stdout}");
    done(&["merge", text(&one), text(&two), "--out", text(&at("merged"))]);
    equal(&at("whole"), &at("merged"));
    // A directory that holds something else stays.
    fails(&["merge", text(&one), text(&two), "--out", text(&at("shards"))], "is not empty");
}

#[test]
fn eight_shards_of_a_study_make_the_study() {
    merged(&["study", "scenarios/studies/smoke.yaml"], "study", &[5, 2, 8, 1, 4, 7, 3, 6]);
}

#[test]
fn shards_of_an_estimate_make_the_estimate() {
    let ads = ["--ads", "reactive", "--traffic", "released", "--road", "corner"];
    for (how, event) in [
        (["--method", "count", "--episodes", "5", "--parts", "8"], "counted"),
        (["--method", "probe", "--episodes", "5", "--parts", "6"], "collision"),
    ] {
        let command = [&["estimate", SPACE, "--event", event][..], &ads, &how].concat();
        merged(&command, "estimate", &[2, 3, 1]);
    }
}

#[test]
fn an_estimate_that_may_stop_looks_when_its_shards_are_merged() {
    let ads = ["--ads", "reactive", "--traffic", "released", "--road", "corner", "--event", "collision"];
    let how = ["--episodes", "10", "--parts", "8", "--hours", "0.3"];
    let command = [&["estimate", SPACE][..], &ads, &how].concat();
    let scratch = merged(&command, "estimate", &[2, 1]);
    let results = std::fs::read_to_string(scratch.path().join("merged/results.json")).expect("it is written");
    let results: serde_json::Value = serde_json::from_str(&results).expect("it is JSON");
    assert!(results["parts"].as_u64() < results["parts_wanted"].as_u64(), "it stopped: {results}");
}

#[test]
fn schedulers_say_which_shard_it_is() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("shard");
    let command =
        ["run", SPACE, "--road", "corner", "--episodes", "3", "--agent", "none", "--out", text(&out)];
    let kubernetes = [("JOB_COMPLETION_INDEX", "1"), ("JOB_COMPLETIONS", "3")];
    let (status, _, stderr) = outcome(avastra(&command).envs(kubernetes));
    assert_eq!(status, 0, "{stderr}");
    assert!(stderr.contains("shard 2/3, because of JOB_COMPLETION_INDEX"), "{stderr}");
    let kept = std::fs::read_to_string(out.join("shard.yaml")).expect("it is kept");
    assert_eq!(kept, "shard: 2\nof: 3\n");
    // What is asked for wins; half a message is none.
    let out = scratch.path().join("asked");
    let asked = [&command[..8], &["--out", text(&out)]].concat();
    let (status, _, stderr) = outcome(avastra(&[&asked[..], &["--shard", "1/1"]].concat()).envs(kubernetes));
    assert!(status == 0 && !stderr.contains("JOB_COMPLETION_INDEX"), "{stderr}");
    assert!(!out.join("shard.yaml").exists());
    let (status, _, stderr) = outcome(avastra(&asked).env("SLURM_ARRAY_TASK_ID", "4"));
    assert!(status == 1 && stderr.contains("say `--shard I/N`"), "{stderr}");
    fails(&[&asked[..], &["--shard", "4/3"]].concat(), "the last is 3");
}

#[test]
fn a_dry_run_says_what_would_be_played() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("out");
    let planned = |command: &[&str]| {
        let json = ["--out", text(&out), "--dry-run", "--format", "json"];
        let said = done(&[command, &json].concat());
        assert!(!out.exists());
        let said: serde_json::Value = serde_json::from_str(&said).expect("it is JSON");
        ["shards_max", "units", "episodes"]
            .map(|field| said["planned"][field].as_u64().expect("it is a count"))
    };
    let run = ["run", SPACE, "--road", "corner", "--episodes", "10"];
    assert_eq!(planned(&run), [10, 10, 10]);
    assert_eq!(planned(&[&run[..], &["--shard", "3/4"]].concat()), [10, 2, 2]);
    let parts = ["--road", "corner", "--parts", "6", "--episodes", "5"];
    let estimate = [&["estimate", SPACE][..], &parts].concat();
    assert_eq!(planned(&estimate), [6, 6, 30]);
    let [most, units, episodes] = planned(&["study", "scenarios/studies/rq4.yaml", "--shard", "40/40"]);
    assert!((most, units) == (40, 1) && episodes > 75, "training and 75 episodes after it: {episodes}");
    let said = done(&[&run[..], &["--shard", "3/4", "--dry-run"]].concat());
    let lines =
        ["would play 10 episodes; shard 3/4 is 2 of 10 pieces", "it can be cut into 10 shards at most"];
    assert!(lines.iter().all(|line| said.contains(line)), "{said}");
    let stops = ["--method", "probe", "--precision", "0.2", "--dry-run"];
    let said = done(&[&estimate[..], &stops].concat());
    assert!(said.contains("would play at most 6 parts of 5 episodes, and a pilot in each shard"), "{said}");
    // What could not begin fails as it would.
    std::fs::create_dir(&out).expect("it is writable");
    std::fs::write(out.join("notes"), "mine").expect("it is writable");
    let used = [&run[..], &["--out", text(&out)]].concat();
    for (wrong, reason) in [(&["study", "none.yaml"][..], "none.yaml"), (&used, "is not empty")] {
        fails(&[wrong, &["--dry-run"]].concat(), reason);
    }
}

#[test]
fn trainings_and_nothing_cannot_be_merged() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (folder, training) = (scratch.path().join("folder"), scratch.path().join("training"));
    std::fs::create_dir(&folder).expect("it is writable");
    let refused = |arguments: &[&str], reason: &str| {
        fails(&[&["merge"], arguments].concat(), reason);
    };
    refused(&[text(&folder), "--missing"], "none of the directories holds");
    std::fs::write(folder.join("notes"), "mine").expect("it is writable");
    refused(&[text(&folder), "--missing"], "holds no run, study or estimate");
    refused(&[text(&folder)], "--out");
    let train = ["train", SPACE, "--road", "corner", "--agent", "constant", "--episodes", "2"];
    done(&[&train[..], &["--out", text(&training)]].concat());
    refused(&[text(&training), "--missing"], "holds a training, which is one piece");
}

/// A space and a policy as they lie beside each other.
fn checkout(folder: &Path) {
    copy_space(&folder.join("scenarios"));
    std::fs::create_dir_all(folder.join("policies")).expect("it is writable");
    let name = "policies/corner.ava";
    std::fs::copy(root().join(name), folder.join(name)).expect("it is shipped");
}

/// What cannot be ended is not published; what has moved is found, and nothing else of its name is taken for it.
#[test]
fn a_space_or_a_policy_that_has_changed_is_refused_before_anything_is_there() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name);
    checkout(scratch.path());
    let (space, policy) = (at("scenarios/avastra45.ava"), at("policies/corner.ava"));
    let command = ["run", "--policy", text(&policy), "--road", "corner", "--episodes", "2"];
    let [one, two] = ["shards/1", "shards/2"].map(at);
    for (number, out) in [("1/2", &one), ("2/2", &two)] {
        done(&[&command[..], &["--shard", number, "--out", text(out)]].concat());
    }
    let merge = |folder: &Path, out: &str| {
        let [one, two] = ["shards/1", "shards/2"].map(|shard| folder.join(shard));
        let out = at(out);
        let mut merge = avastra(&["merge", text(&one), text(&two), "--out", text(&out)]);
        outcome(merge.current_dir(folder))
    };
    let whole = std::fs::read_to_string(&space).expect("it is readable");
    let changed = whole.replace("let weight_mode = 1.0", "let weight_mode = 2.0");
    let refused = |file: &Path, text: &str| {
        let before = std::fs::read(file).expect("it is readable");
        std::fs::write(file, text).expect("it is writable");
        let (status, _, stderr) = merge(scratch.path(), "merged");
        assert!(!at("merged").exists() && !at("merged.partial").exists());
        std::fs::write(file, before).expect("it is writable");
        (status, stderr)
    };
    let other = std::fs::read_to_string(root().join("policies/residential.ava")).expect("it is shipped");
    let (status, stderr) = refused(&policy, &other);
    assert!(status == 1 && stderr.contains("its policy is not at `../../policies/corner.ava`"), "{stderr}");
    let (status, stderr) = refused(&space, &changed);
    assert!(status == 1 && stderr.contains("has changed since the run was begun"), "{stderr}");
    let (status, stderr) = refused(&space, &format!("{whole}\nlet broken ="));
    assert!(status == 2 && stderr.contains("error[AV"), "{stderr}");
    assert!(!stderr.contains("\"code\""), "told once, for people: {stderr}");
    assert_eq!(merge(scratch.path(), "merged").0, 0);

    // Moved to where another space and another policy have the same names.
    let away = at("away");
    checkout(&away);
    std::fs::write(away.join("scenarios/avastra45.ava"), changed).expect("it is writable");
    std::fs::write(away.join("policies/corner.ava"), other).expect("it is writable");
    std::fs::rename(at("shards"), away.join("shards")).expect("it moves");
    let (status, _, stderr) = merge(&away, "again");
    assert_eq!(status, 0, "{stderr}");
    equal(&at("merged"), &at("again"));

    // Two merges into one directory are kept apart, and what a killed one left stands in nobody's way.
    let partial = at("third.partial");
    std::fs::create_dir(&partial).expect("it is writable");
    let mark = std::fs::File::create(partial.join("merge.partial")).expect("it is writable");
    std::fs::write(partial.join("run.yaml"), "half").expect("it is writable");
    mark.lock().expect("it is free");
    let (status, _, stderr) = merge(&away, "third");
    assert!(status == 1 && stderr.contains("another merge is at work"), "{stderr}");
    assert_eq!(std::fs::read_to_string(partial.join("run.yaml")).expect("it is left alone"), "half");
    drop(mark);
    assert_eq!(merge(&away, "third").0, 0);
    std::fs::create_dir(at("fourth.partial")).expect("it is writable");
    assert_eq!(merge(&away, "fourth").0, 0);
    for name in ["third", "fourth"] {
        equal(&at("merged"), &at(name));
        assert!(!at(&format!("{name}.partial")).exists());
    }
}
