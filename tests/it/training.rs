//! Training: a killed one resumes to the same bytes, its policies keep their claims, and damaged policies are
//! refused.

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use serde_json::Value;

use avastra::rng::{Stream, below, stream};

use crate::cases::{entries, root};
use crate::command::{avastra, change, done, fails, last_line, outcome};
use crate::policies::{load, moved, sealed};
use crate::report::index_of;
use crate::world::{FLICKER, SMALL};

/// A training of a few episodes with a network of a few neurons, into a directory.
fn training(out: &Path) -> Vec<String> {
    let config = out.with_extension("yaml");
    std::fs::write(&config, SMALL).expect("it is writable");
    let (config, out) = (config.display().to_string(), out.display().to_string());
    let words = ["train", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "30", "--seed", "5"];
    words
        .map(str::to_owned)
        .into_iter()
        .chain(["--config".to_owned(), config, "--out".to_owned(), out])
        .collect()
}

fn policy_of(out: &Path) -> String {
    std::fs::read_to_string(out.join("policy/corner_ddqn_5.ava")).expect("a policy is written at the end")
}

/// The policy of a whole training.
fn trained(out: &Path) -> String {
    let arguments = training(out);
    done(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    policy_of(out)
}

/// Kills a training after each of the waiting times, resumes it every time, and lets it end.
fn killed(arguments: &[String], out: &Path, waits_ms: impl IntoIterator<Item = u64>) {
    let binary = avastra(&[]).get_program().to_owned();
    let resume = ["train".to_owned(), "--resume".to_owned(), out.display().to_string()];
    for wait_ms in waits_ms {
        let begins = !out.join("run.yaml").is_file();
        if begins {
            // A training that is killed before it writes its settings leaves nothing to resume.
            let _ = std::fs::remove_dir_all(out);
        }
        let mut child = std::process::Command::new(&binary)
            .current_dir(root())
            .args(if begins { arguments } else { &resume[..] })
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        std::thread::sleep(Duration::from_millis(wait_ms));
        child.kill().expect("it is ours to kill");
        child.wait().expect("it ends");
    }
    done(&resume.each_ref().map(String::as_str));
}

#[test]
fn a_killed_training_resumes_to_the_same_bytes() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let whole = trained(&scratch.path().join("whole"));
    let out = scratch.path().join("killed");
    killed(&training(&out), &out, [150, 450, 900, 1300]);
    assert_eq!(policy_of(&out), whole);
    let database =
        |name: &str| std::fs::read(scratch.path().join(name).join("run.db")).expect("it is readable");
    assert!(database("killed") == database("whole"), "the databases differ");
}

/// The long form: twenty kills at random moments, of a learner and of every search. About four minutes:
/// `cargo test --test it -- --ignored twenty_kills`.
#[test]
#[ignore = "takes minutes"]
fn twenty_kills_change_nothing() {
    for agent in ["ddqn", "constant", "bandit"] {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let begun = |name: &str| {
            let out = scratch.path().join(name);
            let mut arguments = training(&out);
            arguments.extend(["--agent".to_owned(), agent.to_owned()]);
            let episodes = arguments.iter().position(|word| word == "30").expect("it has so many");
            arguments[episodes] = "300".to_owned();
            if agent != "ddqn" {
                let config = arguments.iter().position(|word| word == "--config").expect("it has one");
                arguments.drain(config..config + 2);
            }
            (arguments, out)
        };
        let (arguments, whole) = begun("whole");
        done(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        let (arguments, out) = begun("killed");
        let mut rng = stream(2026, Stream::Reset, 0);
        let moments: Vec<u64> = (0..20).map(|_| 100 + u64::from(below(&mut rng, 1400))).collect();
        killed(&arguments, &out, moments);
        assert_eq!(kept(&out), kept(&whole), "{agent}");
    }
}

/// The files that a training leaves: its policy or its search, every scenario, and its database.
fn kept(out: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for folder in ["policy", "critical"] {
        for entry in std::fs::read_dir(out.join(folder)).into_iter().flatten() {
            let path = entry.expect("it is readable").path();
            files.push((path.display().to_string(), std::fs::read(&path).expect("it is readable")));
        }
    }
    for (name, _) in &mut files {
        *name = name.rsplit('/').next().expect("it has a name").to_owned();
    }
    files.sort();
    files.push(("run.db".to_owned(), std::fs::read(out.join("run.db")).expect("it is readable")));
    files
}

#[test]
fn scenarios_of_a_training_that_are_gone_or_edited_are_noticed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("training");
    let at = out.display().to_string();
    let train = ["train", "scenarios/avastra45.ava", "--road", "corner", "--agent", "constant"];
    let how = ["--seed", "5", "--episodes", "12", "--ads", FLICKER, "--out", &at];
    done(&[&train[..], &how].concat());
    let files = entries(out.join("critical"));
    let [gone, edited, ..] = files.as_slice() else { panic!("the training finds two crashes: {files:?}") };
    let read = |path: &Path| std::fs::read_to_string(path).expect("it is readable");
    let written = read(gone);
    std::fs::remove_file(gone).expect("it is there");
    std::fs::write(edited, format!("// mine\n{}", read(edited))).expect("it is writable");
    let stdout = done(&["train", "--resume", &at]);
    assert!(stdout.contains("was missing, is written again"), "{stdout}");
    assert!(stdout.contains("edited since the training wrote it"), "{stdout}");
    assert_eq!(read(gone), written);

    // Each episode depends on those before, so a changed one cannot be played again alone. A page leaves it out.
    let rows = "UPDATE learning SET return = 9 WHERE episode = 3; UPDATE result SET text = '{}'";
    change(&out.join("run.db"), rows);
    let advice = "its rows of episode 3 were changed since they were written, and later ones learned from it: begin a new training";
    fails(&["train", "--resume", &at], advice);
    let page = scratch.path().join("page.html");
    let (status, _, stderr) =
        outcome(&mut avastra(&["report", &at, "--most", "1", "--out", &page.display().to_string()]));
    let is_told = stderr.contains("the rows of episode 3 were changed")
        && stderr.contains("its results were changed since they were written");
    assert!(status == 0 && is_told, "{stderr}");
    let index = index_of(&read(&page));
    // Of 12 in the training and 15 that judged what it learned.
    assert_eq!(index["overview"]["totals"]["episodes"], 26);
    assert!(index["overview"]["evaluation"].is_null());
}

/// How much of a training by time is over decides how it explores. So it must be the same to the bit after a kill, in the training
/// and in its evaluation.
#[test]
fn a_training_by_time_goes_on_to_the_same_bytes() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = scratch.path().join("small.yaml");
    std::fs::write(&config, format!("{SMALL}exploration_share: 0.9\n")).expect("it is writable");
    let train = |out: &Path| {
        let words =
            ["train", "scenarios/avastra45.ava", "--road", "corner", "--hours", "0.6", "--evaluate", "4"];
        let (config, out) = (config.display().to_string(), out.display().to_string());
        done(&[&words[..], &["--seed", "5", "--config", &config, "--out", &out]].concat());
    };
    let (whole, cut) = (scratch.path().join("whole"), scratch.path().join("cut"));
    train(&whole);
    let bytes = |out: &Path| std::fs::read(out.join("run.db")).expect("it is readable");
    let database = rusqlite::Connection::open(whole.join("run.db")).expect("a database");
    let learned: i64 =
        database.query_row("SELECT count(*) FROM learning", [], |row| row.get(0)).expect("a number");
    assert!(learned > 26, "a checkpoint is kept after 25 episodes: {learned}");
    train(&cut);
    let file = cut.join("run.db");
    let tables =
        ["step", "collision", "breach", "margin", "scenario", "offer", "held", "failure", "learning"];
    // A kill in the evaluation leaves a part of it, and no results.
    let delete = |from: i64| -> String {
        let of_table = |table: &str| format!("DELETE FROM {table} WHERE episode >= {from};");
        tables.into_iter().chain(["episode"]).map(of_table).collect::<String>()
            + &format!("DELETE FROM seal WHERE unit >= {from}; DELETE FROM result;")
    };
    change(&file, &delete(learned + 2));
    done(&["train", "--resume", &cut.display().to_string()]);
    assert!(bytes(&whole) == bytes(&cut), "a kill in the evaluation");
    // The kills of `killed` end it at any moment.
    let killed_out = scratch.path().join("killed");
    let words = [
        "train",
        "scenarios/avastra45.ava",
        "--road",
        "corner",
        "--hours",
        "0.6",
        "--evaluate",
        "4",
        "--seed",
        "5",
    ];
    let config = config.display().to_string();
    let more = ["--config".to_owned(), config, "--out".to_owned(), killed_out.display().to_string()];
    let arguments: Vec<String> = words.into_iter().map(str::to_owned).chain(more).collect();
    killed(&arguments, &killed_out, [300, 600, 900]);
    assert!(bytes(&whole) == bytes(&killed_out), "kills in the training");
}

/// A training that is over keeps what was tested at its end: to go on with it changes nothing, and neither does a kill between two
/// of its replays. What its policy claims holds in the traffic that it was trained in.
#[test]
fn a_training_that_is_over_stays_as_it_is() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("training");
    let fault = "scenarios/ads/faults/planning_never_yields.yaml";
    let words = ["train", "scenarios/avastra45.ava", "--road", "corner", "--hours", "0.4", "--evaluate", "6"];
    let config = scratch.path().join("small.yaml");
    std::fs::write(&config, SMALL).expect("it is writable");
    let (config, at) = (config.display().to_string(), out.display().to_string());
    let how = ["--ads", fault, "--traffic", "released", "--seed", "5", "--config", &config, "--out", &at];
    done(&[&words[..], &how].concat());
    let all = || -> Vec<(std::path::PathBuf, Vec<u8>)> {
        let files = entries(out.join("critical")).into_iter().chain([out.join("run.db")]);
        files
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), std::fs::read(path).expect("it is readable")))
            .collect()
    };
    let whole = all();
    let tested = whole
        .iter()
        .filter(|(_, bytes)| String::from_utf8_lossy(bytes).contains("expect recurrence"))
        .count();
    assert!(tested >= 2, "{tested} of {} were tested", whole.len());
    done(&["train", "--resume", &at]);
    assert!(all() == whole, "gone on with when it was over");
    // As a kill leaves it before the last results: a file is gone, and the database has its text.
    change(&out.join("run.db"), "DELETE FROM result");
    let (file, _) = &whole[0];
    std::fs::remove_file(file).expect("it is there");
    done(&["train", "--resume", &at]);
    assert!(all() == whole, "gone on with after a kill");
    done(&["replay", &out.join("policy/corner_ddqn_5.ava").display().to_string()]);
}

/// A training by time keeps what its evaluation found, and names the kinds that recur.
#[test]
fn a_training_by_time_keeps_all_that_it_finds() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let train = |out: &str, more: &[&str]| {
        let out = scratch.path().join(out).display().to_string();
        let words =
            ["train", "scenarios/avastra45_law.ava", "--ads", "reactive", "--agent", "bandit", "--road"];
        let how = ["residential", "--seed", "5", "--format", "json", "--out", &out];
        let result = last_line(&done(&[&words[..], &how, more].concat()));
        let database =
            rusqlite::Connection::open(scratch.path().join(out).join("run.db")).expect("a database");
        (result, database)
    };
    let count = |database: &rusqlite::Connection, what: &str| -> i64 {
        database.query_row(&format!("SELECT count(*) FROM {what}"), [], |row| row.get(0)).expect("a number")
    };
    let (found, database) = train("timed", &["--hours", "0.4", "--evaluate", "4"]);
    let simulated_h = found["simulated_h"].as_f64().expect("a number");
    assert!((0.4..0.45).contains(&simulated_h), "{found}");
    let learned = count(&database, "learning");
    assert_eq!(count(&database, "episode"), learned + 4, "those of the evaluation are kept");
    assert_eq!(found["totals"]["episodes"], learned, "{found}");
    // Each episode with a finding has a scenario, not only the first with a breach of a requirement.
    let critical = "episode WHERE counted > 0 OR episode IN (SELECT episode FROM breach)";
    assert!(count(&database, critical) > 1, "{found}");
    assert_eq!(count(&database, "scenario"), count(&database, critical));
    let kinds = found["left"]["kinds"].as_array().expect("a list");
    assert!(!kinds.is_empty() && found["left"]["next_hour"].is_null(), "{}", found["left"]);

    let (found, database) = train("unjudged", &["--episodes", "3", "--evaluate", "0"]);
    assert_eq!((count(&database, "episode"), &found["evaluation"]["episodes"]), (3, &Value::from(0)));
    let out = scratch.path().join("wrong").display().to_string();
    fails(&["train", "scenarios/avastra45.ava", "--hours", "0", "--out", &out], "the budget is 0 h");
}

#[test]
fn a_policy_is_verified_played_and_refused_when_damaged() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run");
    let text = trained(&out);
    let file = out.join("policy/corner_ddqn_5.ava").display().to_string();
    done(&["replay", &file]);
    done(&["run", "--policy", &file, "--episodes", "2", "--out", &out.join("played").display().to_string()]);

    let moved = moved(&text);
    let policy = load(&moved).expect("a policy may move");
    let weights = avastra::model::policy::weights_to_lines(&policy.parameters);
    assert!(weights.iter().all(|line| moved.contains(line)), "the weights come back bit by bit");

    // One byte in so many is flipped, at a lower and a higher bit in turn.
    for (turn, at) in (0..moved.len()).step_by(151).enumerate() {
        let mut bytes = moved.clone().into_bytes();
        bytes[at] ^= 1 << (turn % 7);
        let Ok(flipped) = String::from_utf8(bytes) else { continue };
        assert!(load(&flipped).is_err(), "byte {at} of {}", moved.len());
    }
}

#[test]
fn a_policy_that_does_not_fit_is_refused() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let moved = moved(&trained(&scratch.path().join("run")));
    // The text is changed and sealed again, so that the seal is right and the change must be found.
    let codes = |text: &str| -> Vec<String> {
        let messages = load(text).expect_err("it does not fit").into_iter();
        messages.map(|message| message.split(':').next().unwrap_or_default().to_owned()).collect()
    };
    assert_eq!(load(&sealed(&moved)), load(&moved));
    let cases = [
        ("layers: [36, 8, 45]", "layers: [36, 8, 44]", "AV0701"),
        ("layers: [36, 8, 45]", "layers: [36, 9, 45]", "AV0701"),
        ("layers: [36, 8, 45]", "layers: [36, 8, 45, 45]", "AV0701"),
        ("dueling: true\n    hyper", "dueling: false\n    hyper", "AV0701"),
        ("    weights: [\n      \"", "    weights: [\n      \"*", "AV0703"),
        ("    seed: 5", "    sed: 5", "AV0703"),
        ("    seed: 5", "    seed: 5\n    seed: 5", "AV0703"),
    ];
    for (from, to, code) in cases {
        assert!(moved.contains(from), "{from}");
        let text = moved.replacen(from, to, 1);
        assert_eq!(codes(&sealed(&text)), [code], "{to}");
    }
    assert_eq!(codes(&moved.replacen("seed: 5", "seed: 6", 1)), ["AV0702"], "not sealed");
    let twice = format!("{moved}\n{}", &moved[moved.find("policy corner").expect("its name")..]);
    assert_eq!(codes(&twice.replacen("policy corner", "policy other", 1)), ["AV0704"], "two");
}

#[test]
fn what_cannot_be_trained_is_said_so() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = scratch.path().join("config.yaml");
    std::fs::write(&config, "discuont: 0.9\n").expect("it is writable");
    let config = config.display().to_string();
    let space = "scenarios/avastra45.ava";
    let cases: [(&[&str], &str); 10] = [
        (&["train", space, "--agent", "space-filling"], "nothing to learn"),
        (&["train", space, "--agent", "bandit", "--preset", "paper"], "`bandit` has none"),
        (&["run", space, "--agent", "bandit"], "has to be trained first"),
        (&["train", space, "--agent", "random"], "nothing to learn"),
        (&["train", space, "--agent", "dqn"], "`ddqn`, `deep_collision`, `constant` and `bandit`"),
        (&["train", space, "--preset", "realesed"], "`avastra`, `paper` and `released`"),
        (&["train", space, "--config", &config], "did you mean `discount`?"),
        (&["run", space, "--agent", "ddqn"], "has to be trained first"),
        (&["run", "--policy", space], "neither a scenario nor a policy"),
        (&["train", "--resume", "scenarios"], "no run.yaml"),
    ];
    for (arguments, reason) in cases {
        fails(arguments, reason);
    }
}

#[test]
fn a_training_that_diverges_is_said_so() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let config = scratch.path().join("config.yaml");
    let settings = "learning_starts: 30\nupdates_per_step: 4\nbatch_len: 8\nlearning_rate: 1000000\n";
    std::fs::write(&config, settings).expect("it is writable");
    let (config, out) = (config.display().to_string(), scratch.path().join("out").display().to_string());
    let train = ["train", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "30", "--seed", "5"];
    let reason = "the network diverged in update 2: lower `learning_rate`";
    fails(&[&train[..], &["--config", &config, "--out", &out]].concat(), reason);
    fails(&["train", "--resume", &out], reason);
}
