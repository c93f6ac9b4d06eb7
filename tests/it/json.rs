//! `--format json`: the last line is the command's result, and `explain json` describes it.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::cases::root;
use crate::command::{avastra, done, outcome};
use crate::world::FLICKER;

/// The last line that a command prints, after a look at what every result has.
fn result(arguments: &[&str]) -> Value {
    let all = [arguments, &["--format", "json"]].concat();
    let (status, stdout, stderr) = outcome(&mut avastra(&all));
    let line = stdout.lines().last().unwrap_or_else(|| panic!("{arguments:?} prints nothing: {stderr}"));
    let value: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"));
    let command = described(arguments);
    let command = command.split(" --").next().unwrap_or(&command);
    assert_eq!((&value["command"], &value["schema"]), (&command.into(), &4.into()), "{line}");
    assert_eq!((&value["status"], value["error"].is_null()), (&status.into(), status == 0), "{line}");
    value
}

/// What `explain json` calls a command: its words, and the option that leads to another result.
fn described(arguments: &[&str]) -> String {
    let command = match arguments {
        ["ads" | "policy", verb, ..] | ["study", verb @ "results", ..] => format!("{} {verb}", arguments[0]),
        _ => arguments[0].to_owned(),
    };
    let others = ["table --row", "table --markdown", "estimate --than"];
    let other = others.into_iter().find(|other| {
        other.split_once(' ').is_some_and(|(of, option)| of == command && arguments.contains(&option))
    });
    other.map_or(command, str::to_owned)
}

/// The fields that `explain json` lists for a command: path and kind.
fn documented(command: &str) -> Vec<(String, String)> {
    let schema = result(&["explain", "json"]);
    let shapes = schema["shapes"].as_array().expect("a list");
    let shape = shapes.iter().find(|shape| shape["command"] == command);
    let own = shape.unwrap_or_else(|| panic!("`{command}` is not described"))["fields"].as_array();
    let all = schema["always"].as_array().into_iter().chain(own).flatten();
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    all.map(|field| (text(&field["path"]), text(&field["kind"]))).collect()
}

/// Compares a value with the fields that are described, and notes which of them were there.
fn compare(path: &str, value: &Value, fields: &[(String, String)], met: &mut BTreeSet<String>) {
    if let Some((_, kind)) = fields.iter().find(|(known, _)| known == path) {
        met.insert(path.to_owned());
        let (kind, may_be_null) = (kind.trim_end_matches('?'), kind.ends_with('?'));
        let fits = match value {
            Value::Null => may_be_null,
            Value::Bool(_) => kind == "bool",
            Value::Number(_) => kind == "number",
            Value::String(_) => kind == "text",
            Value::Array(_) => kind == "list",
            Value::Object(_) => kind == "object",
        };
        assert!(fits, "`{path}` is described as {kind}: {value}");
        return;
    }
    match value {
        Value::Object(entries) => {
            for (name, value) in entries {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                compare(&path, value, fields, met);
            }
        }
        Value::Array(entries) => {
            let path = format!("{path}[]");
            let within = |(known, _): &(String, String)| known.starts_with(&path);
            assert!(fields.iter().any(within), "`{path}` is not described");
            // An empty list shows nothing wrong.
            if entries.is_empty() {
                met.extend(fields.iter().filter(|field| within(field)).map(|(known, _)| known.clone()));
            }
            entries.iter().for_each(|value| compare(&path, value, fields, met));
        }
        // A list that does not apply is null.
        Value::Null => {
            let entry = format!("{path}[]");
            let field = fields.iter().find(|(known, _)| *known == entry);
            assert!(field.is_some_and(|(_, kind)| kind.ends_with('?')), "`{path}` is not described");
            met.insert(entry);
        }
        _ => panic!("`{path}` is not described: {value}"),
    }
}

/// What the command prints has the fields that are described, and all of them.
fn is_as_described(arguments: &[&str]) -> Value {
    let fields = documented(&described(arguments));
    let (value, mut met) = (result(arguments), BTreeSet::new());
    compare("", &value, &fields, &mut met);
    let absent: Vec<&String> =
        fields.iter().map(|(path, _)| path).filter(|path| !met.contains(*path)).collect();
    // A row says why it is masked only if it is, and only a dry run has a plan.
    let is_optional = |path: &str| path.ends_with("masked") || path == "planned";
    let absent: Vec<&&String> = absent.iter().filter(|path| !is_optional(path)).collect();
    assert!(absent.is_empty(), "{arguments:?}: described but absent: {absent:?}");
    value
}

#[test]
fn results_are_as_explain_describes_them() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let space = "scenarios/avastra45.ava";
    let quick: [&[&str]; 15] = [
        &["check", "--audit", space],
        &["check", "--dump", "actions", space],
        &["compile", space, "-o", &at("table.yaml")],
        &["table", space],
        &["table", space, "--row", "3"],
        &["fmt", "--check", space],
        &["explain"],
        &["explain", "json"],
        &["diff", space, "scenarios/deepcollision52.ava"],
        &["table", space, "--markdown"],
        &["new", &at("mine")],
        &["study", "results", "--out", &at("RESULTS.md")],
        &["completions", "bash"],
        &["policy", "weights", "policies/corner.ava", "-o", &at("corner.safetensors")],
        &["road", space, "--road", "corner"],
    ];
    quick.iter().for_each(|arguments| drop(is_as_described(arguments)));
}

/// What is known, what is gone and what is new, and then what `--add` has made of it.
#[test]
fn failures_that_have_a_name_are_known_again() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let (run, known) = (at("run"), at("known.yaml"));
    done(&["new", &at("town")]);
    let fault = "scenarios/ads/faults/planning_never_yields.yaml";
    done(&["run", &at("town/space.ava"), "--hours", "0.5", "--seed", "4", "--ads", fault, "--out", &run]);
    // A file that is not there is no empty one.
    let (status, _, stderr) = outcome(&mut avastra(&["triage", &run, "--known", &known]));
    assert!(status == 1 && stderr.contains("--add` begins it"), "{status}: {stderr}");
    let text = "# Ours\n- name: PLAN-118\n  where: { precrash: 11, road: [corner, avenue] }\n\
                - { name: PLAN-7, where: { requirement: goes_on }, seen: { episodes: 3, hours: 10 } }\n";
    std::fs::write(&known, text).expect("it is writable");
    let found = is_as_described(&["triage", &run, "--known", &known]);
    let names = |found: &Value, of: &str| -> Vec<String> {
        let all = found[of].as_array().expect("a list");
        all.iter().map(|one| one["name"].as_str().expect("a name").to_owned()).collect()
    };
    let new = "12 pedestrian, the vehicle making no manoeuvre";
    assert_eq!(
        [names(&found, "known"), names(&found, "gone"), names(&found, "new")],
        [["PLAN-118"], ["PLAN-7"], [new]]
    );
    let failing = ["triage", &run, "--known", &known, "--fail-on-new"];
    assert_eq!(outcome(&mut avastra(&failing)).0, 4);
    assert_eq!(std::fs::read_to_string(&known).expect("it is readable"), text, "only `--add` writes");
    done(&["triage", &run, "--known", &known, "--add"]);
    let added = std::fs::read_to_string(&known).expect("it is readable");
    assert!(added.starts_with(text), "{added}");
    assert_eq!(outcome(&mut avastra(&failing)).0, 0, "{added}");
}

#[test]
fn results_of_drives_are_as_explain_describes_them() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let run = at("run");
    let settings = ["--episodes", "3", "--seed", "1", "--ads", FLICKER];
    let found =
        is_as_described(&[&["run", "scenarios/avastra45.ava", "--out", &run], &settings[..]].concat());
    let critical: Vec<&str> =
        found["critical"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    let [one, .., two] = critical.as_slice() else { panic!("the run finds two crashes: {critical:?}") };
    is_as_described(&["ads", "schema"]);
    is_as_described(&["replay", one]);
    is_as_described(&["replay", one, two, "--ads", "idm"]);
    is_as_described(&["replay", one, two]);
    is_as_described(&["test", &run]);
    is_as_described(&["render", one, "--at", "1", "-o", &at("moment.svg")]);
    is_as_described(&["report", one, "-o", &at("crash.html")]);
    is_as_described(&["export", "--to", "csv", one]);
    is_as_described(&["import", "--out", &at("imported"), "tests/cases/imports/cut_in.xosc"]);
    is_as_described(&["shrink", one]);
    is_as_described(&["diagnose", one]);
}

#[test]
fn estimates_and_merges_are_as_explain_describes_them() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let drive = ["--event", "collision", "--traffic", "released", "--road", "corner", "--episodes", "20"];
    let estimate = ["estimate", "scenarios/avastra45.ava", "--ads", "reactive", "--parts", "2"];
    let [whole, one, two] = ["whole", "1", "2"].map(at);
    is_as_described(&[&estimate[..], &drive, &["--out", &whole]].concat());
    for (shard, out) in [("1/2", &one), ("2/2", &two)] {
        result(&[&estimate[..], &drive, &["--shard", shard, "--out", out]].concat());
    }
    is_as_described(&["merge", &one, &two, "--missing"]);
    is_as_described(&["merge", &one, &two, "--out", &at("merged")]);
    let two = ["estimate", "scenarios/avastra45.ava", "--ads", "reactive", "--than", "idm"];
    is_as_described(&[&two[..], &drive].concat());
}

/// A command that fails says so under its own name, and what it found before is there.
#[test]
fn a_failure_is_a_result_too() {
    let broken = "tests/cases/diagnostics/actions/misspelt_name.ava";
    let mistakes = result(&["check", broken]);
    assert_eq!((&mistakes["status"], &mistakes["files"][0]["file"]), (&2.into(), &broken.into()));
    for (arguments, status) in [
        (&["check", "nowhere.ava"][..], 1),
        (&["test", "scenarios/studies"], 1),
        (&["run", "scenarios/avastra45.ava", "--road"], 1),
        (&["replay", broken], 2),
        (&["diagnose", broken, broken], 1),
    ] {
        let found = result(arguments);
        assert_eq!(found["status"], status, "{arguments:?}");
    }
    let several = result(&["replay", broken, "nowhere.ava"]);
    assert_eq!(several["failed"][0]["file"], broken, "{several}");
    assert_eq!(several["failed"][1]["file"], "nowhere.ava", "{several}");
    assert!(root().join(broken).is_file());
}

#[test]
fn a_dump_is_json_alone() {
    let space = "scenarios/avastra45.ava";
    for stage in ["ast", "actions"] {
        let stdout = done(&["check", "--dump", stage, space]);
        serde_json::from_str::<Value>(&stdout).unwrap_or_else(|error| panic!("{stage}: {error}"));
    }
}
