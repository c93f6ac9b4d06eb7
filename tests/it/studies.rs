//! Studies: their results depend on their file alone, and bad files are refused.

use std::path::Path;
use std::time::Duration;

use avastra::model::digest;
use avastra::run::{Database, Units};
use avastra::sim::ENGINE;
use avastra::study::StudyDatabase;
use serde_json::Value;

use crate::cases::{expect_snapshot, files, root};
use crate::command::{avastra, background, change, done, done_in, fails, last_line, outcome};
use crate::report::index_of;
use crate::world::FLICKER;

/// Plays the smoke study into a directory.
fn smoke(out: &Path, jobs: &str) -> (i32, String, String) {
    let out = out.display().to_string();
    let study = ["study", "scenarios/studies/smoke.yaml", "--format", "plain"];
    outcome(&mut avastra(&[&study[..], &["--out", &out, "--jobs", jobs]].concat()))
}

fn results(directory: &Path) -> Value {
    let text = std::fs::read_to_string(directory.join("results.json")).expect("every study writes it");
    serde_json::from_str(&text).expect("it is JSON")
}

/// The printed tables, without the figures about the machine.
fn tables(stdout: &str) -> String {
    let (_, rest) = stdout.split_once('\n').expect("a line of settings with the directory comes first");
    rest.split("\nall figures: ").next().expect("split has a first part").to_owned()
}

#[test]
fn a_study_depends_on_its_file_alone() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let alone = scratch.path().join("alone");
    let (status, stdout, stderr) = smoke(&alone, "1");
    assert_eq!(status, 0, "{stderr}");
    expect_snapshot("studies", "smoke", &tables(&stdout));
    let whole = results(&alone);
    assert_eq!(
        (&whole["schema"], &whole["cells"], &whole["cells_wanted"]),
        (&1.into(), &12.into(), &12.into())
    );

    // The study is interrupted, resumed with more workers, killed, and resumed again.
    let broken = scratch.path().join("broken");
    if interrupted(&broken, &whole) {
        let mut child = background(&["study", "--jobs", "2", "--resume", &broken.display().to_string()]);
        std::thread::sleep(Duration::from_millis(900));
        child.kill().expect("it is ours to kill");
        child.wait().expect("it ends");
        let resume = ["study", "--jobs", "2", "--resume", &broken.display().to_string()];
        done(&resume);
    }
    assert_eq!(results(&broken), whole);

    cells_are_runs(&whole);
    kept_and_written_again(scratch.path(), &alone);
}

/// A cell does not depend on the study that it is played in, so a study with cells of another one has the same bytes.
#[test]
fn what_another_study_has_played_is_taken_over() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let space = root().join("scenarios/avastra45.ava");
    let file = |name: &str, seed: u32, agents: &str| {
        let path = scratch.path().join(format!("{name}.yaml"));
        let plan = "roads: [corner]\nevaluation: { episodes: 2, seeds: 1, horizon_s: 30 }";
        let text = format!("space: {}\nfirst_seed: {seed}\n{plan}\nagents: [{agents}]\n", space.display());
        std::fs::write(&path, text).expect("it is writable");
        path.display().to_string()
    };
    let play = |file: &str, name: &str, options: &[&str]| {
        let out = scratch.path().join(name);
        let words = ["study", file, "--jobs", "1", "--out", &out.display().to_string()];
        (outcome(&mut avastra(&[&words, options].concat())), out)
    };
    let tiny = |label: &str| {
        format!(
            "{{ name: ddqn, label: {label}, trainings: 1, episodes: 2, train_roads: [corner, crossroad], \
             config: {{ hidden_units: [8], batch_len: 8, learning_starts: 20 }} }}"
        )
    };
    let agents = format!("{{ name: random, repeats: 2 }}, {{ name: none, repeats: 1 }}, {}", tiny("learner"));
    let (_, first) = play(&file("first", 3, &agents), "first", &[]);
    let reuse = ["--reuse", &first.display().to_string()];
    let agents = format!(
        "{{ name: random, label: dice, repeats: 3 }}, {}, {{ name: space-filling, repeats: 1 }}",
        tiny("tiny")
    );
    let second = file("second", 3, &agents);
    let ((status, ..), alone) = play(&second, "alone", &[]);
    let ((again, stdout, stderr), with) = play(&second, "with", &reuse);
    assert_eq!((status, again), (0, 0), "{stderr}");
    assert!(stdout.contains("3 cells taken over"), "{stdout}");
    for name in ["study.db", "results.json"] {
        let bytes = |of: &Path| std::fs::read(of.join(name)).expect("every study writes it");
        assert!(bytes(&alone) == bytes(&with), "{name} differs");
    }
    // The page follows from the cells. A changed cell is left out of it, is not taken over, and is played again.
    let sound = std::fs::read(alone.join("study.db")).expect("it is readable");
    let whole = results(&alone);
    std::fs::write(alone.join("results.json"), "{}").expect("it is writable");
    let (at, page) = (alone.display().to_string(), scratch.path().join("page.html"));
    let overview = || {
        let report = ["report", &at, "--out", &page.display().to_string()];
        let (status, _, stderr) = outcome(&mut avastra(&report));
        assert_eq!(status, 0, "{stderr}");
        let html = std::fs::read_to_string(&page).expect("it is written");
        (index_of(&html)["overview"]["study"].clone(), stderr)
    };
    assert_eq!(overview().0, whole);
    let longer = "UPDATE evaluated SET distance_m = 1e9 WHERE cell = 1 AND episode = 0";
    change(&alone.join("study.db"), longer);
    let (damaged, stderr) = overview();
    assert!(stderr.contains("the rows of cell 1 were changed"), "{stderr}");
    let is_missing = format!("cells is missing: `avastra study --resume {at}` plays it");
    assert!(stderr.contains(&is_missing), "{stderr}");
    assert_eq!(damaged["cells"].as_u64().map(|cells| cells + 1), whole["cells"].as_u64());
    let ((status, _, stderr), _) = play(&second, "refused", &["--reuse", &at]);
    assert!(status == 1 && stderr.contains("go on with `avastra study --resume"), "{stderr}");
    let (status, _, stderr) = outcome(&mut avastra(&["study", "--resume", &at]));
    assert!(status == 0 && stderr.contains("is removed, and played again"), "{stderr}");
    assert!(std::fs::read(alone.join("study.db")).expect("it is readable") == sound);
    assert_eq!(results(&alone), whole);

    // What is there already is not taken over again.
    let resume = ["study", "--resume", &with.display().to_string()];
    let (status, stdout, stderr) = outcome(&mut avastra(&[&resume[..], &reuse].concat()));
    assert!(status == 0 && stdout.contains("0 cells taken over"), "{stdout}{stderr}");

    for (name, seed, agents, reason) in [
        ("seeded", 4, "{ name: random }", "it plays otherwise: its `first_seed` is another"),
        (
            "stranger",
            3,
            "{ name: random-raw }",
            "it has played no agent with the same settings on the same road",
        ),
    ] {
        let ((status, _, stderr), out) = play(&file(name, seed, agents), name, &reuse);
        assert!(status == 1 && stderr.contains(reason), "{status}: {stderr}");
        assert!(!out.exists(), "{name} has begun a directory");
    }
}

/// Every agent is compared with every baseline, but two baselines with each other only once: each test of a family
/// makes the correction of the others stricter.
#[test]
fn two_baselines_are_compared_once() {
    let text = "space: ../avastra45.ava\nagents: [{ name: none }, { name: random }, { name: space-filling }]\n\
                baselines: [none, random]\n";
    let cell = |agent: &str, number: u32| avastra::study::CellRecord {
        agent: agent.to_owned(),
        road: "corner".to_owned(),
        number,
        training_seed: None,
        trained: Vec::new(),
        episodes: Vec::new(),
        kinds: [].into(),
        spent: None,
    };
    let cells = ["none", "random", "space-filling"].map(|agent| [cell(agent, 0), cell(agent, 1)]).concat();
    let found = avastra::study::StudyResults::new(loaded(text).settings(), &cells);
    let road = found.roads.iter().find(|road| road.road == "corner").expect("it was played");
    let counted = road.comparisons.iter().filter(|one| one.measure == "counted");
    let pairs: Vec<_> = counted.map(|one| (one.agent.as_str(), one.baseline.as_str())).collect();
    assert_eq!(pairs, [("random", "none"), ("space-filling", "none"), ("space-filling", "random")]);
    // Nothing was counted, which bounds the mean by what Poisson's events would have.
    let none = &road.agents[0].measures["counted"];
    let high = none.interval.and_then(|interval| interval.high).expect("two repetitions bound it");
    assert!(none.mean == 0.0 && (high - 3.689 / 2.0).abs() < 1e-3, "{high}");
}

/// What a study found is kept beside its file, and from that alone its text is written again to the same bytes.
fn kept_and_written_again(scratch: &Path, played: &Path) {
    let scenarios = scratch.join("scenarios");
    std::fs::create_dir_all(scenarios.join("studies")).expect("it is writable");
    for shared in ["avastra45.ava", "roads.ava", "lanes.ava", "roads", "ads"] {
        let link = scenarios.join(shared);
        std::os::unix::fs::symlink(root().join("scenarios").join(shared), link).expect("links can be made");
    }
    // By now the study asks for more than was played, and there are figures to compare with.
    let published = "published:\n  - source: a paper\n    measure: counted\n    \
                     figures: { random: { corner: 3.2 }, tiny: { corner: 0.1 } }\n\
                     remarks: It is too small to say anything.\n";
    let study = std::fs::read_to_string(root().join("scenarios/studies/smoke.yaml")).expect("it is shipped");
    let study = study.replace("trainings: 2\n    episodes: 6\n", "trainings: 4\n    episodes: 600\n");
    let file = scenarios.join("studies/smoke.yaml");
    std::fs::write(&file, format!("{study}{published}")).expect("it is writable");
    std::fs::copy(root().join("scenarios/studies/random.yaml"), scenarios.join("studies/random.yaml"))
        .expect("it is shipped");

    let out = scratch.join("RESULTS.md").display().to_string();
    let write = |more: &[&str]| {
        done_in(scratch, &[&["study", "results", "scenarios/studies", "--out", &out], more].concat());
        std::fs::read_to_string(&out).expect("it was written")
    };
    let first = write(&["--add", &played.display().to_string(), "--commit", "0123abc"]);
    assert_eq!(write(&[]), first);
    let (_, chapters) = first.split_once("\n## ").expect("a chapter for each study");
    // How long it took depends on the machine.
    let (before, rest) = chapters.split_once(" h simulated in ").expect("it was played");
    let (_, after) = rest.split_once(" of one worker").expect("it took some time");
    expect_snapshot("studies", "results", &format!("## {before} h simulated in … of one worker{after}"));

    // What is kept is not replaced by less; a file that has more than was played is no such file.
    let kept = scenarios.join("studies/smoke.jsonl");
    let text = std::fs::read_to_string(&kept).expect("it was kept");
    let (lines, _) = text.rsplit_once("{\"seal\"").expect("its seal is the last line");
    let sealed = |lines: &str| format!("{lines}{{\"seal\":\"{}\"}}\n", digest(lines.as_bytes()));
    assert_eq!(sealed(lines), text);
    let refused = |text: &str, reason: &str| {
        std::fs::write(&kept, text).expect("it is writable");
        let mut command = avastra(&["study", "results", "scenarios/studies", "--out", &out, "--add"]);
        let (status, _, stderr) = outcome(command.arg(played).current_dir(scratch));
        assert!(status == 1 && stderr.contains(reason), "{stderr}");
        assert_eq!(std::fs::read_to_string(&kept).expect("it is readable"), text, "it is left as it was");
    };
    let last = lines.lines().last().expect("it has cells");
    let more = last.replacen("\"number\":0", "\"number\":9", 1);
    assert_ne!(more, last, "the last cell is the first of its agent");
    let of_others = format!("{lines}{more}\n").replacen("\"first_seed\":5", "\"first_seed\":6", 1);
    refused(&sealed(&of_others), "of other settings");
    refused(&sealed(&format!("{lines}{last}\n")), "this cell is there already");
    // Figures that were changed are refused, too.
    let edited = lines.replacen("\"values\":[", "\"values\":[1", 1);
    assert_ne!(edited, lines);
    refused(&text.replacen(lines, &edited, 1), "it was changed since it was written");
    refused(lines, "its last line is not the seal of those before");
    // A cell that was played before must have come out the same.
    refused(&sealed(&edited), "differs from the one that is kept");
    // A part of the same study is completed.
    let without_last = lines.strip_suffix(&format!("{last}\n")).expect("it is the last line");
    std::fs::write(&kept, sealed(without_last)).expect("it is writable");
    assert_eq!(write(&["--add", &played.display().to_string(), "--commit", "0123abc"]), first);
    assert_eq!(std::fs::read_to_string(&kept).expect("it is readable"), text);

    // Another world is told. No other one has the episodes of this one.
    for (world, is_told) in [("plane/7", true), (ENGINE, false)] {
        let other = lines.replace(&format!("\"{ENGINE}\""), &format!("\"{world}\""));
        std::fs::write(&kept, sealed(&other)).expect("it is writable");
        let written = write(&[]);
        assert!(written.contains(&format!("world `{world}`")), "{written}");
        assert_eq!(written.contains(&format!("the world is `{ENGINE}` by now")), is_told, "{world}");
    }
    std::fs::write(&kept, text).expect("it is writable");

    std::fs::write(&file, format!("{study}{}", published.replace("tiny", "tinny"))).expect("it is writable");
    let refused =
        outcome(avastra(&["study", "results", "scenarios/studies", "--out", &out]).current_dir(scratch));
    assert!(refused.0 == 1 && refused.2.contains("names the agent `tinny`"), "{}", refused.2);
}

/// Ctrl-C ends a study in good order. Returns false if the study was over before, as on a fast machine.
fn interrupted(directory: &Path, whole: &Value) -> bool {
    let child = background(&[
        "study",
        "scenarios/studies/smoke.yaml",
        "--jobs",
        "1",
        "--out",
        &directory.display().to_string(),
    ]);
    // The study handles Ctrl-C as soon as there is a database.
    for _ in 0..1200 {
        if directory.join("study.db").is_file() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    std::thread::sleep(Duration::from_millis(700));
    // SAFETY: a signal to a child that has not been waited for.
    unsafe { libc::kill(child.id() as i32, libc::SIGINT) };
    let output = child.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        return false;
    }
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("go on with `avastra study --resume"), "{stderr}");
    assert!(results(directory)["cells"].as_u64() < whole["cells"].as_u64());
    true
}

/// The seeds in the result are those with which `run` plays the same episodes.
fn cells_are_runs(whole: &Value) {
    let corner = &whole["roads"][0];
    assert_eq!(corner["road"], "corner");
    let random = &corner["agents"][0];
    let counted: f64 = random["measures"]["collisions"]["values"][1].as_f64().expect("a number");
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let mut found = 0;
    for (number, seed) in random["seeds"][1]["evaluation"].as_array().expect("a list").iter().enumerate() {
        let out = scratch.path().join(number.to_string()).display().to_string();
        let run =
            ["run", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "1", "--format", "json"];
        let run = [&run[..], &["--ads", FLICKER]].concat();
        let seed = seed.as_str().expect("a text");
        let stdout = done(&[&run[..], &["--seed", seed, "--out", &out]].concat());
        let line = last_line(&stdout);
        found += line["totals"]["collisions"].as_u64().expect("a number");
    }
    assert_eq!(counted, found as f64 / 2.0);
}

#[test]
fn a_quick_study_says_that_it_is_none() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("quick").display().to_string();
    let study = ["study", "scenarios/studies/healthy.yaml", "--quick", "--format", "json", "--out", &out];
    let stdout = done(&study);
    let line = stdout.lines().last().expect("a result");
    assert!(line.starts_with("{\"schema\":4,\"command\":\"study\""), "{line}");
    let result: Value = serde_json::from_str(line).expect("JSON");
    let results = &result["results"];
    assert_eq!((&results["quick"], &results["cells"]), (&true.into(), &8.into()));
    let rate = &results["together"][0]["episodes"]["collisions_per_1000_km"];
    assert_eq!(rate["events"], 0, "there is no obstacle to hit: {rate}");
    assert!(rate["high"].as_f64().expect("a bound") > 0.0);
    assert!(result["timing"][0]["wall_s"].as_f64().is_some_and(|wall_s| wall_s > 0.0));
    // Times that are damaged or gone are not known, and are not 0.
    let times = Path::new(&out).join("timing.jsonl");
    std::fs::write(&times, b"\xff no text").expect("it is writable");
    let stdout = done(&["study", "--resume", &out]);
    assert!(stdout.contains(", no times are known"), "{stdout}");
    std::fs::remove_file(&times).expect("it is there");
    let result = last_line(&done(&["study", "--resume", &out, "--format", "json"]));
    assert!(result["timing"][0]["wall_s"].is_null() && result["timing"][0]["cells"].is_u64(), "{result}");
}

#[test]
fn what_no_study_can_be_is_said_so() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = scratch.path().join("study.yaml");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let cases = [
        ("agents: [{ name: random, repats: 3 }]", "line 2: there is no `repats`; did you mean `repeats`?"),
        ("agents: [{ name: random }]\nseed: 3", "line 3: there is no `seed`"),
        ("agents: random", "line 2: `agents`: write a list"),
        ("agents: [random]", "line 2: `agents`: write `key: value` lines"),
        ("roads: [corner]", "`agents: …` is missing"),
        ("agents: [{ name: random }]\nagents: []", "line 3: `agents` stands twice"),
        ("agents: []", "no agent is named"),
        ("agents: [{ name: rnadom }]", "agent `rnadom`: no agent `rnadom`"),
        ("agents: [{ name: random }, { name: random }]", "two agents are called `random`"),
        ("agents: [{ name: random, trainings: 3 }]", "`trainings` is for agents that learn"),
        ("agents: [{ name: ddqn, repeats: 3 }]", "`ddqn` does; say `trainings`"),
        ("agents: [{ name: ddqn, label: mine, preset: papre }]", "agent `mine`: no preset `papre`"),
        ("agents: [{ name: ddqn, config: { discuont: 1 } }]", "did you mean `discount`?"),
        ("agents: [{ name: ddqn, config: nowhere.yaml }]", "cannot read `nowhere.yaml`"),
        ("agents: [{ name: ddqn, config: 3 }]", "settings are the name of a file"),
        ("agents: [{ name: ddqn, config: { actions: [walkers] } }]", "agent `ddqn`: "),
        ("agents: [{ name: random, shuffled_states: true }]", "`shuffled_states` is for agents that learn"),
        ("agents: [{ name: bandit, shuffled_states: true }]", "is for networks, and `bandit` has none"),
        ("agents: [{ name: ddqn, train_roads: [moon] }]", "no road `moon`"),
        ("agents: [{ name: random, without: [gravity] }]", "agent `random`: "),
        ("agents: [{ name: random }]\nroads: [moon]", "no road `moon`"),
        ("agents: [{ name: random }]\nbaselines: [ddqn]", "no agent is called `ddqn`"),
        ("agents: [{ name: random }]\nbaselines: [random, random]", "`baselines` names `random` twice"),
        ("agents: [{ name: random, repeats: 0 }]", "`repeats` is 0"),
        ("agents: [{ name: random }]\nevaluation: { episodes: 0 }", "`evaluation.episodes` is 0"),
        ("agents: [{ name: random }]\nads: apolo", "no driving system `apolo`"),
        ("agents: [{ name: random }]\nads: idm\ncauses: true", "`idm` is not made of modules"),
        ("agents: [{ name: random }]\nambient: 100000", "`ambient` is 100000"),
        ("agents: [{ name: random }]\nads_config: nowhere.yaml", "nowhere.yaml"),
    ];
    for (text, reason) in cases {
        std::fs::write(&file, format!("space: {space}\n{text}\n")).expect("it is writable");
        let out = scratch.path().join("out");
        let arguments = ["study", &file.display().to_string(), "--out", &out.display().to_string()];
        fails(&arguments, reason);
        assert!(!out.exists(), "{text}: nothing is left behind");
    }
    // A mistake of form is reported with its line.
    std::fs::write(&file, format!("space: {space}\nagents:\n  - {{ name: random, repats: 3 }}\n"))
        .expect("writable");
    let (_, _, stderr) = outcome(&mut avastra(&["study", &file.display().to_string()]));
    assert!(stderr.contains("line 3"), "{stderr}");
    fails(&["study", "--resume", "scenarios"], "it has no study.yaml");
}

#[test]
fn the_results_are_what_the_kept_studies_say() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("RESULTS.md");
    let written = ["study", "results", "scenarios/studies", "--out", &out.display().to_string()];
    done(&written);
    let read = |path: &Path| std::fs::read_to_string(path).expect("it is readable");
    assert!(read(&out) == read(&root().join("RESULTS.md")), "write it again with `avastra study results`");
}

#[test]
fn every_shipped_study_can_begin() {
    for path in files(root().join("scenarios/studies"), "yaml") {
        let text = std::fs::read_to_string(&path).expect("it is readable");
        let study = loaded(&text);
        // No episode is used both for training and for evaluation.
        let settings = study.settings();
        let seeds = |begin: u64, count: u32| -> Vec<u64> {
            let number = |number| avastra::rng::child_seed(begin, avastra::rng::Stream::Episode, number);
            (0..u64::from(count)).map(number).collect()
        };
        let mut all = Vec::new();
        for number in 0..settings.agents.iter().map(|agent| agent.repeats).max().unwrap_or(0) {
            let plans = settings.agents.iter().filter_map(|agent| agent.training.as_ref());
            let longest = plans.map(|plan| plan.episodes).max().unwrap_or(0);
            all.extend(seeds(study.training_seed(number), longest));
            for seed in 0..settings.evaluation.seeds {
                all.extend(seeds(study.evaluation_seed(number, seed), settings.evaluation.episodes));
            }
        }
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count, "{}", path.display());
    }
}

/// A shipped study, ready to play.
fn loaded(text: &str) -> avastra::study::Study {
    let file = avastra::study::StudyFile::from_yaml(text).expect("it is a study");
    let name = file.space.trim_start_matches("../").to_owned();
    let table = avastra::action::ActionTable::new(crate::world::space(&name));
    let read = |name: &str| {
        std::fs::read_to_string(root().join("scenarios/studies").join(name))
            .map_err(|error| error.to_string())
    };
    let settings =
        avastra::study::StudySettings::new(file, &table, (None, None), None, &read).expect("it is sound");
    avastra::study::Study::new(table, settings).expect("all that it names is there")
}

#[test]
fn a_database_of_another_kind_is_refused_by_its_layout() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = scratch.path().join("run.db");
    Database::open(&path, "").expect("it is new");
    let refused = StudyDatabase::open(&path, "").err().expect("it is not a study's").to_string();
    assert_eq!(refused, "it is the database of a run or a training, and one of a study is wanted here");
    // Readers say what they found, and never advise to discard what another version or command wrote.
    change(&path, "PRAGMA user_version = 1006");
    let refused =
        |table: &str| avastra::run::columns(&path, table).expect_err("it is none of a run").to_string();
    assert_eq!(
        refused("episode"),
        "it is the database of a study, and one of a run or a training is wanted here"
    );
    change(&path, "PRAGMA user_version = 14");
    assert!(refused("episode").contains("the version that wrote it still reads it"));
    change(&path, &format!("PRAGMA user_version = {}", Database::LAYOUT.version));
    assert!(refused("offers").starts_with("it has no table `offers`: there are `episode`, `step`, "));
    // A file with tables is not new, though its number says so.
    change(&path, "PRAGMA user_version = 0");
    let refused = Database::open(&path, "").err().expect("it has no number").to_string();
    assert!(refused.starts_with("it has layout 0, and this version of avastra reads "), "{refused}");
}

#[test]
fn reading_an_empty_database_writes_nothing() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let path = scratch.path().join("study.db");
    let refused =
        || StudyDatabase::open_without_damaged(&path, "").err().expect("nothing is in it").to_string();
    refused();
    assert!(!path.exists());
    std::fs::write(&path, "").expect("it is writable");
    assert!(refused().starts_with("it is empty"));
    assert_eq!(std::fs::metadata(&path).expect("it is there").len(), 0);
}
