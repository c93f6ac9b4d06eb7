//! Scenarios and spaces that were written by hand, and what must come of them: other road users keep to what their bodies can do,
//! rows stand in one lane, roads keep their word, and crashes among others are told wherever an episode is.

use std::path::Path;

use serde_json::Value;

use crate::command::{avastra, done, last_line, outcome};

fn case(name: &str) -> String {
    format!("tests/cases/written/{name}.ava")
}

/// The table of a scenario: a row for each road user at each tick, by the names of its columns.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// What happens in a scenario whose ego vehicle this driving system drives.
    fn of(name: &str) -> Table {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let out = scratch.path().display().to_string();
        done(&["export", "--to", "csv", "--out", &out, &case(name)]);
        let file = std::fs::read_dir(scratch.path()).expect("it is there").next().expect("it was written");
        let text = std::fs::read_to_string(file.expect("it is there").path()).expect("it is a text");
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<String>>());
        Table { columns: lines.next().expect("a header"), rows: lines.collect() }
    }

    fn column(&self, name: &str) -> usize {
        self.columns.iter().position(|column| column == name).expect("there is such a column")
    }

    /// The values of a column of the road user with a name, tick by tick; the ego vehicle has none.
    fn of_user(&self, who: &str, column: &str) -> Vec<&str> {
        let (name, column) = (self.column("name"), self.column(column));
        self.rows.iter().filter(|row| row[name] == who).map(|row| row[column].as_str()).collect()
    }

    fn numbers(&self, who: &str, column: &str) -> Vec<f64> {
        self.of_user(who, column).iter().map(|text| text.parse().expect("a number")).collect()
    }

    /// How fast it is, tick by tick, m/s.
    fn speeds_mps(&self, who: &str) -> Vec<f64> {
        let [x, y] = ["vx_mps", "vy_mps"].map(|column| self.numbers(who, column));
        x.iter().zip(&y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
    }
}

/// The cells of `table --try`.
fn tried(name: &str) -> Vec<Value> {
    let told = last_line(&done(&["table", "--try", "--format", "json", &case(name)]));
    told["cells"].as_array().expect("cells").clone()
}

#[test]
fn who_is_to_be_early_keeps_to_the_limits_of_its_body() {
    let speeds = Table::of("tearly").speeds_mps("cyclist");
    let gained: Vec<f64> = speeds.windows(2).map(|pair| (pair[1] - pair[0]) / 0.02).collect();
    let (most, least) =
        gained.iter().fold((0.0_f64, 0.0_f64), |(most, least), mps2| (most.max(*mps2), least.min(*mps2)));
    // Those of a bicycle; the table rounds.
    assert!(most <= 1.0 + 0.01 && least >= -3.5 - 0.01, "{most} and {least} m/s²");
    assert!(most > 0.5, "it sets out: {most} m/s²");
}

#[test]
fn a_moment_that_is_missed_is_said_so() {
    let cells = tried("early");
    let failures = cells[0]["failures"].to_string();
    assert_eq!(cells[0]["outcome"], "not_realised", "{cells:?}");
    assert!(failures.contains("too late where it is to be `early`"), "{failures}");
}

#[test]
fn a_row_stands_in_one_lane() {
    // The route leaves the lane that ends while the row is beside it: seen from there, the next lane is on the left.
    let table = Table::of("tlanes");
    let left_m: Vec<f64> =
        ["c1", "c2", "c3", "c4"].map(|who| table.numbers(who, "y_m")[0]).into_iter().collect();
    let apart_m = left_m.iter().fold(0.0_f64, |most, y_m| most.max((y_m - left_m[0]).abs()));
    assert!(apart_m < 1.0, "in one lane: {left_m:?}");
}

#[test]
fn a_road_says_when_its_lights_begin_also_in_a_written_scenario() {
    // It stops at the light, which is red for as long.
    let slowest = Table::of("tphase").speeds_mps("").into_iter().fold(f64::INFINITY, f64::min);
    assert!(slowest < 0.1, "{slowest} m/s");
}

#[test]
fn crashes_among_others_are_in_the_table_the_replay_and_the_trial() {
    let table = Table::of("twreck");
    for (who, with) in [("slow", "2"), ("fast", "1")] {
        let met = table.of_user(who, "contact_with");
        let at = met.iter().position(|text| !text.is_empty()).expect("they crash into each other");
        assert_eq!((met[at], table.of_user(who, "contact")[at]), (with, "1"));
    }
    assert!(table.of_user("", "contact").iter().all(|text| *text == "0"), "the ego vehicle touches nobody");
    let said = done(&["replay", &case("twreck")]);
    assert!(said.contains("npc#2 (`fast`) and npc#1 (`slow`) crash into each other at"), "{said}");
    let told = last_line(&done(&["replay", "--format", "json", &case("twreck")]));
    assert_eq!(told["scenarios"][0]["crashes"][0]["obstacle"], 2, "{told}");
    let cells = tried("wreck");
    assert_eq!(cells[0]["outcome"], "not_realised", "{cells:?}");
    assert!(cells[0]["failures"].to_string().contains("crash into each other"), "{cells:?}");
}

#[test]
fn a_test_whose_road_users_crash_into_each_other_is_no_success() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run");
    let told = out.display().to_string();
    let said = done(&["run", &case("wreck"), "--agent", "every-row", "--repeat", "0", "--out", &told]);
    assert!(said.contains("1 others crashed"), "{said}");
    assert!(said.contains("other road users crashed into each other in 1 episode"), "{said}");
    let table = read(&out, "protocol.csv");
    assert!(table.lines().nth(1).is_some_and(|line| line.contains("others crashed")), "{table}");
    let cases = read(&out, "protocol.xml");
    assert!(cases.contains("skipped=\"1\"") && cases.contains("others crashed"), "{cases}");
}

#[test]
fn a_requirement_may_ask_whether_somebody_has_crashed() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let here = crate::cases::root().join("tests/cases/written/wreck.ava").display().to_string();
    let file = scratch.path().join("asks.ava");
    let text = format!(
        "language 1\nuse \"{here}\"\nrequire nobody_crashes on RoadUser: not npc.crashed\n\
         scenario w {{ road: at60 start {{ }} steps {{ 0: a() 1: wait() }} expect nobody_crashes.breached }}\n"
    );
    std::fs::write(&file, text).expect("a scratch directory can be written to");
    let (code, said, errors) = outcome(&mut avastra(&["replay", &file.display().to_string()]));
    assert_eq!(code, 0, "{said}{errors}");
}

#[test]
fn a_step_that_never_happens_can_be_looked_at() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().display().to_string();
    let export =
        |format: &str| outcome(&mut avastra(&["export", "--to", format, "--out", &out, &case("tnever")]));
    let why = "step 0 does not happen: `once ego.speed >= 60 m/s` did not come within the step";
    let (code, said, errors) = export("csv");
    assert!(code == 0 && errors.contains(why), "{code}: {said}{errors}");
    assert!(read(scratch.path(), "tnever.csv").lines().count() > 400, "the whole step is there");
    // Another tool is not told of what does not happen.
    let (code, said, errors) = export("openscenario");
    assert!(code == 3 && said.contains(why), "{code}: {said}{errors}");
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).expect("it was written")
}
