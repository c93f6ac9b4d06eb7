//! What `avastra import` makes of OpenSCENARIO files: the scenario that it writes, or all that it refuses with its lines.

use std::cell::RefCell;
use std::collections::BTreeMap;

use avastra::import::{Files, Imported, Refusal, Request, VARIATIONS_USUAL, openscenario};
use avastra::rng;
use avastra::rng::Stream;

use crate::cases::{cases, expect_snapshot, root, stem, try_each};
use crate::command::{avastra, done, outcome};
use crate::exports::crash;

const AREA: &str = "tests/cases/imports";

/// Files of variations, and how many rows they make: of the last one, a parameter is drawn in each.
const ROWS: [(&str, usize); 3] = [("crossing_speeds", 12), ("crossing_drawn", 12), ("profile_values", 726)];

/// A scenario by hand, in which the weather changes.
const WET: &str = "tests/cases/exports/wet_corner.ava";

#[test]
fn every_file_becomes_a_space_or_is_refused_with_its_lines() {
    try_each("imports", |name, _| {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let folder = scratch.path().display().to_string();
        let file = format!("{AREA}/{name}.xosc");
        let import = ["import", "--variations", "2000", "--out", &folder, &file];
        let (status, stdout, stderr) = outcome(&mut avastra(&import));
        let written = scratch.path().join(format!("{name}.ava"));
        let is_imported = name != "refused";
        assert_eq!(status, if is_imported { 0 } else { 2 }, "{name}: {stdout}{stderr}");
        assert_eq!(written.exists(), is_imported, "{name}");
        if !is_imported {
            expect_snapshot("imports", name, &stdout);
            return;
        }
        let text = std::fs::read_to_string(&written).expect("it was written");
        expect_snapshot("imports", name, &text);
        let file = written.display().to_string();
        done(&["check", &file]);
        assert_eq!(outcome(&mut avastra(&["fmt", "--check", &file])).0, 0, "{name} is formatted");
        assert_eq!(outcome(&mut avastra(&import)).0, 0, "{name} again: it finds what was written before");
        // A space of many rows has no scenario.
        if let Some((_, rows)) = ROWS.iter().find(|(many, _)| *many == name) {
            let table = done(&["table", &file]);
            let last = table.lines().last().and_then(|line| line.split_whitespace().next());
            assert_eq!(last, Some((rows - 1).to_string().as_str()), "{name}");
            return;
        }
        let scenario = scratch.path().join(format!("{name}_scenario.ava"));
        let text = std::fs::read_to_string(&scenario).expect("it was written");
        assert!(text.contains("0: begin()"), "{name}: {text}");
        done(&["export", "--to", "csv", &scenario.display().to_string()]);
        let table = std::fs::read_to_string(scratch.path().join(format!("exported/{name}_scenario.csv")));
        let first: Vec<f64> = table
            .expect("it was written")
            .lines()
            .nth(1)
            .map(|row| row.split(',').filter_map(|cell| cell.parse().ok()).collect())
            .expect("it has a row");
        // Without `body`, which is no number, the speed's parts are the sixth and the seventh.
        let ego_kmh = libm::hypot(first[5], first[6]) * 3.6;
        let wanted_kmh = match name {
            "cut_in" | "profile" | "kept" | "changing" | "beside" => 36.0,
            "braking" => 50.0,
            _ => 30.0,
        };
        assert!((ego_kmh - wanted_kmh).abs() < 0.1, "{name}: the ego vehicle begins at {ego_kmh} km/h");
    });
}

/// Exports of every kind carry the scenario, and its claims if it has some.
#[test]
fn an_export_of_ours_comes_back_and_replays() {
    let crash = crash().display().to_string();
    for (file, claims) in
        [(crash.as_str(), &["expect collision with npc#", "expect trace =="][..]), (WET, &[])]
    {
        let stem = stem(file.as_ref());
        for more in [&[][..], &["--natural"], &["--profile", "carla"]] {
            let scratch = tempfile::tempdir().expect("a scratch directory");
            let folder = scratch.path().display().to_string();
            let export = ["export", "--to", "openscenario", "--out", &folder, file];
            done(&[&export[..], more].concat());
            let exported = scratch.path().join(format!("{stem}.xosc")).display().to_string();
            let stdout = done(&["import", &exported]);
            assert!(stdout.contains("an export of avastra"), "what is not kept is said: {stdout}");
            let imported = scratch.path().join(format!("imported/{stem}.ava"));
            let text = std::fs::read_to_string(&imported).expect("it was written");
            assert!(claims.iter().all(|claim| text.contains(claim)), "{text}");
            done(&["replay", &imported.display().to_string()]);
        }
    }
}

/// The scenario in an exported file is not trusted: it cannot use another file than its map.
#[test]
fn an_export_that_was_tampered_with_uses_no_other_file() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().display().to_string();
    done(&["export", "--to", "openscenario", "--out", &folder, WET]);
    let file = scratch.path().join("wet_corner.xosc");
    let text = std::fs::read_to_string(&file).expect("it was written");
    std::fs::write(scratch.path().join("other.ava"), "language 1\n").expect("it can be written");
    let begin = "name=\"scenario_text\" value=\"";
    let text = text.replace(begin, &format!("{begin}use &quot;../other.ava&quot; "));
    std::fs::write(&file, text).expect("it can be written");
    let (status, stdout, _) = outcome(&mut avastra(&["import", &file.display().to_string()]));
    assert!(status == 2 && stdout.contains("does not compile"), "{status} {stdout}");
    assert!(!scratch.path().join("imported").join("wet_corner.ava").exists());
}

#[test]
fn a_parameter_may_have_another_value() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().display().to_string();
    let file = format!("{AREA}/cut_in.xosc");
    let import = |set: &str| outcome(&mut avastra(&["import", "--out", &folder, "--set", set, &file]));
    let (status, stdout, stderr) = import("ego_kmh=28.8");
    assert_eq!(status, 0, "{stdout}{stderr}");
    let text = std::fs::read_to_string(scratch.path().join("cut_in.ava")).expect("it was written");
    assert!(text.contains("ego_speed: 8 m/s") && text.contains("speed: 5 m/s"), "{text}");
    let (status, stdout, _) = import("ego_mph=18");
    assert!(status == 2 && stdout.contains("it declares no parameter `ego_mph`"), "{stdout}");
    assert_eq!(import("ego_kmh").0, 1);
}

/// Files of `tests/cases/imported`, each of which says in its comments what is right: who is where at a time (x, y and heading of
/// the body's middle), what a note tells, or why the file is refused.
#[test]
fn every_file_comes_out_as_it_says() {
    try_each("imported", |name, path| {
        let text = std::fs::read_to_string(path).expect("it is there");
        let comments = text.lines().filter_map(|line| line.strip_prefix("<!-- ")?.strip_suffix(" -->"));
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let folder = scratch.path().display().to_string();
        let file = path.display().to_string();
        let (status, stdout, stderr) = outcome(&mut avastra(&["import", "--out", &folder, &file]));
        let is_refused = comments.clone().any(|comment| comment.starts_with("refused: "));
        assert_eq!(status, if is_refused { 2 } else { 0 }, "{stdout}{stderr}");
        let rows = if is_refused { Vec::new() } else { rows(&folder, name) };
        for comment in comments {
            if let Some(words) = comment.strip_prefix("refused: ").or_else(|| comment.strip_prefix("note: "))
            {
                assert!(stdout.contains(words), "{words}: {stdout}");
            } else if let Some((who, (time_s, wanted))) = place_said(comment) {
                let at = rows.iter().find(|(body, at_s, _)| *body == who && (at_s - time_s).abs() < 1e-6);
                let (_, _, found) = at.unwrap_or_else(|| panic!("{name}: no {who} at {time_s} s"));
                // Phases begin at ticks, and a move to the side ends within a few centimetres.
                let is_there = found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 0.05);
                assert!(is_there, "{comment}: {found:?}");
            }
        }
    });
}

/// `T at 3 s: 161.4 -1.75 0`.
fn place_said(comment: &str) -> Option<(&str, (f64, [f64; 3]))> {
    let (head, numbers) = comment.split_once(" s: ")?;
    let (who, time_s) = head.split_once(" at ")?;
    let numbers: Vec<f64> = numbers.split(' ').filter_map(|number| number.parse().ok()).collect();
    Some((who, (time_s.parse().ok()?, numbers.try_into().ok()?)))
}

/// Who is where, and when, in the scenario of an imported file.
fn rows(folder: &str, name: &str) -> Vec<(String, f64, [f64; 3])> {
    done(&["export", "--to", "csv", "--out", folder, &format!("{folder}/{name}_scenario.ava")]);
    let table = std::fs::read_to_string(format!("{folder}/{name}_scenario.csv")).expect("it was written");
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |at: usize| cells[at].parse::<f64>().expect("it is a number");
        (cells[2].to_owned(), number(0), [number(3), number(4), number(5)])
    };
    table.lines().skip(1).map(row).collect()
}

/// Texts of other encodings say the same.
#[test]
fn files_of_other_encodings_are_read_or_refused_by_name() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = scratch.path().join("case.xosc").display().to_string();
    let folder = scratch.path().join("imported").display().to_string();
    std::fs::copy(root().join("tests/cases/imported/straight.xodr"), scratch.path().join("straight.xodr"))
        .expect("it can be copied");
    let text = read("tests/cases/imported/dollar_in_declared_names.xosc").replace("own", "gr\u{fc}n");
    let declared = |encoding: &str| text.replace("UTF-8", encoding);
    let wide = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
        core::iter::once(0xFEFF).chain(declared("UTF-16").encode_utf16()).flat_map(unit).collect()
    };
    let latin = |encoding| declared(encoding).chars().map(|one| one as u8).collect::<Vec<u8>>();
    for (bytes, words) in [
        (text.clone().into_bytes(), "case_scenario.ava"),
        (wide(u16::to_le_bytes), "case_scenario.ava"),
        (wide(u16::to_be_bytes), "case_scenario.ava"),
        (latin("ISO-8859-1"), "case_scenario.ava"),
        (latin("windows-1252"), "case_scenario.ava"),
        (latin("KOI8-R"), "its encoding `koi8-r` is not read"),
        (latin("UTF-8"), "not text: its encoding `utf-8` is not read, or it is another one"),
    ] {
        std::fs::write(&file, bytes).expect("it can be written");
        let (_, stdout, stderr) = outcome(&mut avastra(&["import", "--out", &folder, &file]));
        assert!(format!("{stdout}{stderr}").contains(words), "{words}: {stdout}{stderr}");
    }
}

/// The map and the catalogue of the cases, from memory.
struct Kept {
    map: String,
    catalogue: String,
    scenario: String,
}

/// The text of a file of the repository.
fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).expect("it is there")
}

impl Kept {
    /// With one of our roads as the map; a file of variations varies `crossing`.
    fn with(road: &str) -> Kept {
        Kept {
            map: read(&format!("scenarios/roads/{road}.xodr")),
            catalogue: read(&format!("{AREA}/catalogue/vehicles.xosc")),
            scenario: read(&format!("{AREA}/crossing.xosc")),
        }
    }
}

impl Files for Kept {
    fn scenario(&self, _: &str) -> Result<String, String> {
        Ok(self.scenario.clone())
    }

    fn map(&self, _: &str) -> Result<String, String> {
        Ok(self.map.clone())
    }

    fn catalogues(&self, _: &str) -> Result<Vec<(String, String)>, String> {
        Ok(vec![("file".to_owned(), self.catalogue.clone())])
    }
}

/// The minor version, the orientation of the ego vehicle at the beginning, and what becomes of it.
const HEADINGS: [(&str, &str, &str); 9] = [
    ("revMinor=\"2\"", r#"h="0" type="relative""#, "scenario case"),
    ("revMinor=\"2\"", r#"h="3.14" type="relative""#, "does not look along"),
    ("revMinor=\"2\"", r#"h="1.5" type="relative""#, "does not look along"),
    ("revMinor=\"2\"", r#"h="0.5" type="relative""#, "begins along its lane"),
    ("revMinor=\"2\"", r#"h="-0.99" type="absolute""#, "scenario case"),
    ("revMinor=\"2\"", r#"h="2.15" type="absolute""#, "does not look along"),
    ("revMinor=\"2\"", r#"h="-0.99""#, "scenario case"),
    ("revMinor=\"2\"", r#"h="0.5""#, "does not look along"),
    ("revMinor=\"3\"", r#"h="0.5""#, "begins along its lane"),
];

/// A file as it is imported without options.
fn import(text: &str, name: &str, files: &dyn Files) -> Result<Imported, Vec<Refusal>> {
    let request = Request { name, ego: None, parameters: &BTreeMap::new(), variations_max: VARIATIONS_USUAL };
    openscenario(text, &request, files)
}

/// Values that are drawn come again with the same seed, stay what they are beside other parameters, and have bounds.
#[test]
fn values_are_drawn_for_as_many_test_runs_as_the_file_asks_for() {
    let files = Kept::with("corner");
    let drawn = read(&format!("{AREA}/crossing_drawn.xosc"));
    let said = |text: &str| match import(text, "case", &files) {
        Ok(imported) => imported.space.unwrap_or_default(),
        Err(refusals) => refusals.into_iter().map(|refusal| refusal.reason + "\n").collect(),
    };
    let with = |old: &str, new: &str| {
        assert!(drawn.contains(old), "{old}");
        said(&drawn.replace(old, new))
    };
    assert_eq!(said(&drawn), said(&drawn));
    assert_ne!(said(&drawn), with("\"7\"", "\"8\""));
    for (old, new, wanted) in [
        ("numberOfTestRuns=\"12\"", "numberOfTestRuns=\"0\"", "a whole number above 0"),
        ("\"12\"", "\"501\"", "500 are read, up to 60000 with `--variations`"),
        ("upperLimit=\"8\"", "upperLimit=\"1\"", "a range goes up"),
        ("lowerLimit=\"4\"", "lowerLimit=\"7.999\"", "next to nothing"),
        ("NormalDistribution", "LogNormalDistribution", "such a distribution is not read"),
        ("\"walker_kmh\"", "\"parked\"", "lists values of `parked` again"),
        ("\"walker_kmh\"", "\"nobody\"", "declares no parameter `nobody`"),
        ("weight=\"3\"", "weight=\"-3\"", "less than 0"),
        ("Range lowerLimit=\"4\"", "Range lowerLimit=\"4..\"", "no number"),
    ] {
        let said = with(old, new);
        assert!(said.contains(wanted), "{new}: {said}, and not `{wanted}`");
    }
}

#[test]
fn a_variation_that_is_listed_twice_counts_once() {
    let files = Kept::with("corner");
    let text = read(&format!("{AREA}/crossing_speeds.xosc"))
        .replace(r#"<Element value="8"/>"#, r#"<Element value="5"/>"#);
    let space = import(&text, "case", &files).expect("it is read").space;
    let space = space.unwrap_or_default();
    assert!(
        space.contains("variations with the values of another one, which make one row with it: 8"),
        "{space}"
    );
}

/// An event that makes the one ahead drive 3 m/s, when a condition holds.
fn going(condition: &str) -> String {
    format!(
        r#"</Event>
          <Event name="go" priority="overwrite">
            <Action name="go_action"><PrivateAction><LongitudinalAction><SpeedAction>
              <SpeedActionDynamics dynamicsShape="step" value="0" dynamicsDimension="time"/>
              <SpeedActionTarget><AbsoluteTargetSpeed value="3"/></SpeedActionTarget>
            </SpeedAction></LongitudinalAction></PrivateAction></Action>
            <StartTrigger><ConditionGroup><Condition name="then" delay="0" conditionEdge="none">
              <ByValueCondition>{condition}</ByValueCondition>
            </Condition></ConditionGroup></StartTrigger>
          </Event>"#
    )
}

/// Each entry of a profile has its time, whatever its vehicle can do in it.
#[test]
fn profiles_of_speeds_keep_their_times() {
    let files = Kept::with("boulevard");
    let profile = read(&format!("{AREA}/profile.xosc"));
    let dip = r#"speed="$dip_mps" time="$dip_s""#;
    let action = r#"<SpeedProfileAction followingMode="position">"#;
    let end = r#"<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="dip" state="completeState"/>"#;
    let later = r#"<SimulationTimeCondition value="5" rule="greaterThan"/>"#;
    for (old, new, wanted) in [
        (dip, r#"speed="$dip_mps" time="1""#, "{ speed: 2 m/s, rate: 6 m/s^2 }\n  { speed: 2 m/s }"),
        (dip, r#"speed="$dip_mps" time="0.1""#, "{ speed: 2 m/s, rate: 15 m/s^2 }\n  { speed: 2 m/s }"),
        (dip, r#"speed="$dip_mps" time="0""#, "{ speed: 2 m/s }\n  { speed: 2 m/s }\n  after 1 s"),
        // The least rate is 0.1 m/s²: 0.5 m/s take 5 s of the 20 s.
        (dip, r#"speed="7.5" time="20""#, "{ speed: 7.5 m/s, rate: 0.1 m/s^2 }\n  after 15 s {"),
        (dip, r#"speed="0" time="4""#, "{ speed: 0 m/s, rate: 2 m/s^2 }\n  { speed: 2 m/s, rate: 2 m/s^2 }"),
        (dip, r#"speed="-1" time="4""#, "no road user drives backwards"),
        (dip, r#"speed="$dip_mps""#, "without a `time`"),
        (dip, r#"speed="$dip_mps" time="-1""#, "less than 0"),
        // What follows waits for the end of the last entry, or is refused.
        ("</Event>", &going(end), "rate: 1.5 m/s^2 }\n  { speed: 3 m/s }"),
        ("</Event>", &going(later), "only what waits for their end is read"),
        (action, r#"<SpeedProfileAction entityRef="Ego">"#, "relative to an entity"),
        (
            action,
            &format!(r#"{action}<DynamicConstraints maxSpeed="7"/>"#),
            "8 m/s is above the `maxSpeed` 7",
        ),
        (
            action,
            &format!(r#"{action}<DynamicConstraints maxAcceleration="1"/>"#),
            "`maxSpeed` alone is read",
        ),
    ] {
        assert!(profile.contains(old), "{old}");
        let text = profile.replace(old, new);
        let said: String = match import(&text, "case", &files) {
            Ok(imported) => imported.space.unwrap_or_default(),
            Err(refusals) => refusals.into_iter().map(|refusal| refusal.reason + "\n").collect(),
        };
        assert!(said.contains(wanted), "{new}: {said}, and not `{wanted}`");
    }
}

/// A van is as fast as 1.2 times the ego vehicle once it has gained speed at 2 m/s², and another one comes to 12 m behind it.
#[test]
fn speeds_and_distances_that_are_kept_follow_at_every_tick() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().display().to_string();
    done(&["import", "--out", &folder, &format!("{AREA}/kept.xosc")]);
    done(&["export", "--to", "csv", &scratch.path().join("kept_scenario.ava").display().to_string()]);
    let table = std::fs::read_to_string(scratch.path().join("exported/kept_scenario.csv"));
    // By road user and moment: place and speed.
    let mut seen: BTreeMap<(String, i64), ([f64; 2], f64)> = BTreeMap::new();
    for row in table.expect("it was written").lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |at: usize| cells[at].parse::<f64>().expect("it is a number");
        let tick = (number(0) / 0.02).round() as i64;
        let speed_mps = libm::hypot(number(6), number(7));
        seen.insert((cells[2].to_owned(), tick), ([number(3), number(4)], speed_mps));
    }
    let of = |who: &str, tick: i64| seen[&(who.to_owned(), tick)];
    let away_m = |tick: i64| {
        let ([a, b], [c, d]) = (of("Van", tick).0, of("Follower", tick).0);
        libm::hypot(a - c, b - d)
    };
    for tick in [50, 100, 150] {
        let wanted_mps = f64::min(2.0 * 0.02 * tick as f64, 12.0);
        assert!((of("Van", tick).1 - wanted_mps).abs() < 0.05, "{tick}: {:?}", of("Van", tick));
    }
    for tick in [400, 500, 590] {
        let (van_mps, ego_mps) = (of("Van", tick).1, of("ego", tick - 1).1);
        assert!((van_mps - 1.2 * ego_mps).abs() < 0.02, "{tick}: {van_mps} m/s and {ego_mps} m/s");
    }
    // Both are 5.2 m long; the spring closes in without passing by.
    let gaps_m = [300, 450, 590].map(|tick| away_m(tick) - 5.2);
    assert!(gaps_m.iter().all(|gap_m| *gap_m > 11.5), "{gaps_m:?}");
    assert!((gaps_m[2] - 12.0).abs() < 0.5, "{gaps_m:?}");
}

/// What becomes of `cut_in` and `walker` where one thing in them is another: a line of the scenario, or a refusal.
#[test]
fn conditions_and_words_are_read_or_refused() {
    let files = Kept::with("boulevard");
    let wrong = RefCell::new(Vec::new());
    let expect = |found: &str, wanted: &str, case: &str| {
        if !found.contains(wanted) {
            // Of a whole space the lines that the cases are about.
            let said = |line: &&str| {
                found.lines().count() < 4
                    || line.contains("//! -")
                    || line.contains("once")
                    || line.contains("state")
            };
            let found: Vec<&str> = found.lines().filter(said).collect();
            wrong.borrow_mut().push(format!("{case}: {found:?}, and not `{wanted}`"));
        }
    };
    let import = |text: &str| match import(text, "case", &files) {
        Ok(imported) => imported.space.unwrap_or_default() + &imported.scenario.unwrap_or_default(),
        Err(refusals) => refusals.into_iter().map(|refusal| refusal.reason + "\n").collect(),
    };
    let cut_in = read(&format!("{AREA}/cut_in.xosc"));
    let begin = cut_in.find("<TimeHeadwayCondition").expect("it has a condition");
    let end = begin + cut_in[begin..].find("/>").expect("it ends") + 2;
    // The van is 17.1 m ahead between the bumpers, 22 m between the reference points; the ego vehicle drives 10 m/s.
    let conditions = [
        (
            r#"<TimeHeadwayCondition entityRef="Van" value="1.5" freespace="false" rule="lessThan"/>"#,
            "npc.rear - ego.front + 4.905 m < ego.speed * 1.5 s",
        ),
        (
            r#"<TimeHeadwayCondition entityRef="Van" value="3" freespace="true" rule="lessThan"/>"#,
            "npc.rear - ego.front < ego.speed * 3 s",
        ),
        (
            r#"<RelativeDistanceCondition entityRef="Van" relativeDistanceType="longitudinal" value="15" freespace="$free" rule="lessThan"/>"#,
            "npc.rear - ego.front < 15 m",
        ),
        (
            r#"<RelativeDistanceCondition entityRef="Van" relativeDistanceType="longitudinal" value="15" freespace="true" rule="greaterThan"/>"#,
            "once npc.rear - ego.front > 15 m or ego.rear - npc.front > 15 m",
        ),
        (
            r#"<RelativeDistanceCondition entityRef="Van" relativeDistanceType="longitudinal" value="30" freespace="false" rule="greaterOrEqual"/>"#,
            "once npc.rear - ego.front + 4.905 m >= 30 m or ego.rear - npc.front + 4.995 m >= 30 m",
        ),
        (
            r#"<TimeToCollisionCondition value="4" freespace="true" rule="lessThan"><TimeToCollisionConditionTarget><EntityRef entityRef="Van"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>"#,
            "npc.rear - ego.front < (ego.speed - npc.speed) * 4 s",
        ),
        (
            r#"<TimeToCollisionCondition value="6" freespace="true" rule="lessThan"><TimeToCollisionConditionTarget><EntityRef entityRef="Van"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>"#,
            "npc.rear - ego.front < (ego.speed - npc.speed) * 6 s",
        ),
        (
            r#"<ReachPositionCondition tolerance="2"><Position><LanePosition roadId="3" laneId="-2" s="11"/></Position></ReachPositionCondition>"#,
            "once ego.front >= 2.705 m",
        ),
        (
            r#"<ReachPositionCondition tolerance="2"><Position><LanePosition roadId="3" laneId="-2" s="60"/></Position></ReachPositionCondition>"#,
            "once ego.front >= 51.705 m",
        ),
    ];
    for (condition, wanted) in conditions {
        let declared = r#"<ParameterDeclaration name="free" parameterType="boolean" value="true"/></ParameterDeclarations>"#;
        let text = format!("{}{condition}{}", &cut_in[..begin], &cut_in[end..]);
        let text = text.replacen("</ParameterDeclarations>", declared, 1);
        expect(&import(&text.replace("rising", "none")), wanted, condition);
    }
    let behind = cut_in.replace("${$gap + 10}", "-8").replace("value=\"-3\"", "value=\"3\"");
    let found = import(
        &behind.replace(&cut_in[begin..end], &conditions[5].0.replace("value=\"4\"", "value=\"0.5\"")),
    );
    expect(&found, "ego.rear - npc.front < (npc.speed - ego.speed) * 0.5 s", "from behind");

    for (old, new, wanted) in [
        ("value=\"1.5\"", "value=\"-1\"", "less than 0"),
        ("freespace=\"true\"", "freespace=\"perhaps\"", "neither `true` nor `false`"),
        (
            "conditionEdge=\"rising\"",
            "conditionEdge=\"falling\"",
            "once not (npc.rear - ego.front < ego.speed * 1.5 s",
        ),
        ("conditionEdge=\"rising\"", "conditionEdge=\"upward\"", "it may be none, rising"),
        ("<EntityRef entityRef=\"Ego\"/>", "", "it names no entity"),
        ("selectTriggeringEntities=\"false\"", "selectTriggeringEntities=\"true\"", "a condition selects"),
        ("priority=\"overwrite\"", "priority=\"urgent\"", "it may be override"),
        ("priority=\"overwrite\"", "priority=\"overwrite\" maximumExecutionCount=\"0\"", "never happens"),
        ("<LaneChangeAction>", "<LaneChangeAction targetLaneOffset=\"1.2\">", "offset: -2.32 m"),
        ("relativeDistanceType=\"longitudinal\"", "relativeDistanceType=\"lateral\"", "lateral distances"),
        ("</Act>", "<StopTrigger><ConditionGroup/></StopTrigger></Act>", "it has no `Condition`"),
        (
            "delay=\"0\" conditionEdge=\"rising\"",
            "delay=\"-4\" conditionEdge=\"rising\"",
            "`delay` is less than 0",
        ),
        ("dynamicsShape=\"sinusoidal\"", "dynamicsShape=\"sudden\"", "it may be linear"),
        ("width=\"1.8\"", "width=\"-1.8\"", "bodies have 0.3 to 3 m"),
        ("length=\"4.6\"", "length=\"4600\"", "bodies have 0.3 to 20 m"),
        ("Center x=\"1.4\"", "Center x=\"1e300\"", "which no scenario has"),
        ("name=\"Van\"", "name=\"Ego\"", "another entity is called `Ego`, too"),
        ("value=\"3\" dynamicsDimension", "value=\"-3\" dynamicsDimension", "less than 0"),
        ("value=\"3\" dynamicsDimension", "dynamicsDimension", "it has no `value`"),
        (
            "value=\"3\" dynamicsDimension=\"time\"",
            "value=\"fast\" dynamicsDimension=\"rate\"",
            "is no number",
        ),
        (
            "value=\"3\" dynamicsDimension=\"time\"",
            "value=\"0\" dynamicsDimension=\"rate\"",
            "stays where it is",
        ),
        (
            "dynamicsShape=\"sinusoidal\" value=\"3\" dynamicsDimension=\"time\"",
            "dynamicsShape=\"step\" value=\"0\" dynamicsDimension=\"rate\"",
            "no road user moves sideways faster than 10 m/s",
        ),
        (
            "value=\"3\" dynamicsDimension",
            "value=\"1e6\" dynamicsDimension",
            "nothing lasts longer than 600 s",
        ),
        (
            "SimulationTimeCondition value=\"0\"",
            "SimulationTimeCondition value=\"20\"",
            "its act begins later, and whether it holds by then is not known",
        ),
        ("dynamicsDimension=\"time\"", "dynamicsDimension=\"days\"", "it may be time, distance, rate"),
        ("triggeringEntitiesRule=\"any\"", "triggeringEntitiesRule=\"most\"", "it may be any, all"),
        ("coordinateSystem=\"road\"", "coordinateSystem=\"street\"", "it may be entity, lane"),
        ("parameterType=\"double\"", "parameterType=\"float\"", "it may be integer, int"),
        ("parameterType=\"double\" value=\"12\"", "parameterType=\"int\" value=\"12.5\"", "is no `int`"),
        (
            "parameterType=\"double\" value=\"12\"",
            "parameterType=\"boolean\" value=\"12\"",
            "is no `boolean`",
        ),
        ("revMinor=\"2\"", "revMinor=\"7\"", "1.0 to 1.3 is read"),
        (
            "dynamicsDimension=\"time\"",
            "dynamicsDimension=\"time\" followingMode=\"near\"",
            "it may be follow",
        ),
        ("<VehicleCatalog>", "<VehicleCatalogg/><VehicleCatalog>", "no such element"),
        ("<Directory path=", "<Directory depth=\"2\" path=", "it has no attribute `depth`"),
        (
            "entryName=\"van\"/>",
            "entryName=\"van\"><ParameterAssignments><ParameterAssignment parameterRef=\"colour\" value=\"3\"/></ParameterAssignments></CatalogReference>",
            "`van` of `vehicles`: it declares no parameter `colour`",
        ),
        ("<Maneuver name=", "<Manoeuvre/><Maneuver name=", "`ManeuverGroup` has no such element"),
        ("<Init>", "<Init speed=\"3\">", "it has no attribute `speed`"),
        ("<SpeedActionTarget>", "<SpeedActionTarget><Target/>", "`SpeedActionTarget` has no such element"),
        (
            "</SpeedAction></LongitudinalAction>",
            "</SpeedAction><SpeedAction/></LongitudinalAction>",
            "holds one element",
        ),
        ("<AbsoluteTargetSpeed value=\"${$ego_kmh / 3.6}\"/>", "", "it has no"),
        ("<Private entityRef=\"Van\">", "<Private entityRef=\"Wan\">", "no entity is called `Wan`"),
        ("<StopTrigger>", "<StopTrigger><ConditionGroup/>", "scenario case"),
        ("</StartTrigger>", "<ConditionGroup/></StartTrigger>", "it has no `Condition`"),
        ("value=\"36\"", "value=\"3600\"", "1000.0 m/s: nothing is faster than 70 m/s"),
        ("value=\"36\"", "value=\"-36\"", "no vehicle drives backwards"),
        ("ds=\"${$gap + 10}\"", "ds=\"1200\"", "the lane ends before"),
        (
            "<Vehicle name=\"car\" vehicleCategory=\"car\">",
            "<Vehicle name=\"car\" vehicleCategory=\"car\"><Trailer/>",
            "trailers",
        ),
        (
            "<Vehicle name=\"car\" vehicleCategory=\"car\">",
            "<Vehicle name=\"car\" vehicleCategory=\"car\"><Trailer><TrailerRef entityRef=\"wagon\"/></Trailer>",
            "trailers",
        ),
        ("<Vehicle name=\"car\"", "<MiscObject/><Vehicle name=\"car\"", "one an object"),
    ] {
        assert!(cut_in.contains(old), "{old}");
        let found = import(&cut_in.replace(old, new));
        expect(&found, wanted, new);
    }
    // The road has a heading of -0.99 rad, and the lane its direction.
    let headed = |minor: &str, orientation: &str| {
        let place = format!("s=\"10\"><Orientation {orientation}/></LanePosition>");
        import(&cut_in.replace("revMinor=\"2\"", minor).replace("s=\"10\"/>", &place))
    };
    for (minor, orientation, wanted) in HEADINGS {
        let found = headed(minor, orientation);
        expect(&found, wanted, orientation);
    }
    // Values out of all groups of constraints are refused; one group is enough.
    let constrained = |groups: &str| {
        let declared = "value=\"12\"/>";
        import(&cut_in.replace(declared, &format!("value=\"12\">{groups}</ParameterDeclaration>")))
    };
    let low = r#"<ConstraintGroup><ValueConstraint rule="lessThan" value="9"/></ConstraintGroup>"#;
    let high = r#"<ConstraintGroup><ValueConstraint rule="greaterOrEqual" value="12"/><ValueConstraint rule="notEqualTo" value="13"/></ConstraintGroup>"#;
    let odd = r#"<ConstraintGroup><ValueConstraint rule="nearly" value="12"/></ConstraintGroup>"#;
    expect(
        &constrained(low),
        "its constraints exclude the value `12`",
        "its constraints exclude the value `12`",
    );
    expect(&constrained(&format!("{low}{high}")), "scenario case", "scenario case");
    expect(&constrained(odd), "`rule` is `nearly`", "`rule` is `nearly`");
    // Values are compared as what they are declared to be.
    let typed = |kind: &str, value: &str, bound: &str| {
        let group = format!(
            r#"<ConstraintGroup><ValueConstraint rule="equalTo" value="{bound}"/></ConstraintGroup>"#
        );
        let declared = format!(
            r#"<ParameterDeclaration name="more" parameterType="{kind}" value="{value}">{group}</ParameterDeclaration></ParameterDeclarations>"#
        );
        import(&cut_in.replacen("</ParameterDeclarations>", &declared, 1))
    };
    expect(
        &typed("string", "007", "7"),
        "its constraints exclude the value `007`",
        "its constraints exclude the value `007`",
    );
    expect(&typed("integer", "007", "7"), "scenario case", "scenario case");
    expect(&typed("boolean", "true", "1"), "scenario case", "scenario case");
    expect(
        &typed("boolean", "true", "0"),
        "its constraints exclude the value `true`",
        "its constraints exclude the value `true`",
    );
    expect(&typed("double", "1", "far"), "its value `far` is no `double`", "its value `far` is no `double`");

    // The distance of a vehicle at the beginning; 1.0 has no word for its side.
    let distance = |minor: &str, side: &str| {
        let action = format!(
            r#"<Private entityRef="Van"><PrivateAction><LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="17" freespace="true" continuous="false" {side}/></LongitudinalAction></PrivateAction>"#
        );
        import(&cut_in.replace("revMinor=\"2\"", minor).replace("<Private entityRef=\"Van\">", &action))
    };
    expect(&distance("revMinor=\"0\"", ""), "scenario case", "scenario case");
    expect(&distance("revMinor=\"2\"", ""), "without `displacement`", "without `displacement`");
    expect(
        &distance("revMinor=\"2\"", "displacement=\"leadingReferencedEntity\""),
        "scenario case",
        "scenario case",
    );
    let behind = distance("revMinor=\"2\"", "displacement=\"trailingReferencedEntity\"");
    expect(&behind, "is read ahead of the ego vehicle alone", "behind");

    // A mistake is told once, whatever follows from it.
    for (old, new) in [
        ("value=\"12\"", ""),
        ("value=\"12\"", "value=\"far\""),
        ("vehicleCategory=\"car\"", "vehicleCategory=\"sledge\""),
        ("entryName=\"van\"", "entryName=\"sledge\""),
        ("ds=\"${$gap + 10}\"", "ds=\"far\""),
        ("<LanePosition roadId=\"3\"", "<LanePosition roadId=\"none\""),
    ] {
        assert!(cut_in.contains(old), "{old}");
        let found = import(&cut_in.replace(old, new));
        expect(&found.lines().count().to_string(), "1", new);
    }
    for (weather, wanted) in [
        (
            r#"<Weather><Precipitation precipitationType="rain" precipitationIntensity="6"/></Weather>"#,
            "Rain: Moderate, Fog: None, Wetness: None",
        ),
        (
            r#"<Weather><Precipitation precipitationType="rain" intensity="0.1"/><Fog visualRange="300"/></Weather>"#,
            "Rain: Light, Fog: Light, Wetness: None",
        ),
        (
            r#"<Weather><Fog visualRange="40"/></Weather><RoadCondition frictionScaleFactor="0.7"/>"#,
            "Rain: None, Fog: High, Wetness: Moderate",
        ),
        (
            r#"<RoadCondition frictionScaleFactor="1.0" wetness="lowFlooded"/>"#,
            "Rain: None, Fog: None, Wetness: High",
        ),
        (
            r#"<Weather><Precipitation precipitationType="snow" intensity="1"/></Weather>"#,
            "Fog: High, Wetness: None",
        ),
        (r#"<RoadCondition frictionScaleFactor="0.2"/>"#, "is ice"),
    ] {
        let sky = format!(
            r#"<Actions><GlobalAction><EnvironmentAction><Environment name="sky"><TimeOfDay animation="false" dateTime="2026-01-01T21:00:00"/>{weather}</Environment></EnvironmentAction></GlobalAction>"#
        );
        let found = import(&cut_in.replacen("<Actions>", &sky, 1));
        expect(&found, wanted, weather);
        if !wanted.contains("ice") {
            expect(&found, "time: Time = Night", weather);
        }
    }
    let walker = read(&format!("{AREA}/walker.xosc"));
    let aside = r#"</Vertex><Vertex time="3"><Position><WorldPosition x="0" y="0"/></Position></Vertex>"#;
    let found = import(&walker.replacen("</Vertex>", aside, 1));
    expect(&found, "scenario case", "a corner in a walker's way");
    for (old, new, wanted) in [
        ("offset=\"0\"/>", "offset=\"2\"/>", "after 2 s"),
        ("scale=\"1\"", "scale=\"0\"", "`scale` is 0"),
        ("closed=\"false\"", "closed=\"true\"", "`closed` leads back"),
        ("Relative=\"relative\"", "Relative=\"daily\"", "it may be absolute, relative"),
        ("followingMode=\"position\"", "followingMode=\"near\"", "it may be follow, position"),
        ("time=\"5\"", "time=\"0.01\"", "600.0 m/s: nothing is faster than 70 m/s"),
    ] {
        assert!(walker.contains(old), "{old}");
        let found = import(&walker.replace(old, new));
        expect(&found, wanted, new);
        let is_refused = wanted != "after 2 s";
        expect(
            if found.lines().count() > 1 { "imported" } else { "refused" },
            if is_refused { "refused" } else { "imported" },
            new,
        );
    }
    // What waits for the end of a way begins there.
    let event = |speed: &str| {
        format!(
            r#"</Event><Event name="then" priority="overwrite"><Action name="a"><PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step" value="0" dynamicsDimension="time"/><SpeedActionTarget>{speed}</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction></Action><StartTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none"><ByValueCondition><StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="cross" state="completeState"/></ByValueCondition></Condition></ConditionGroup></StartTrigger></Event>"#
        )
    };
    let slower = event(r#"<AbsoluteTargetSpeed value="0.5"/>"#);
    let found = import(&walker.replacen("</Event>", &slower, 1));
    expect(&found, "\n  once npc.station >= 5.95 m {}\n  { speed: 0.5 m/s }\n", "after a way");
    // The rate by which another's speed is reached in a time is none for following it.
    let timed = event(
        r#"<RelativeTargetSpeed entityRef="Ego" value="1" speedTargetValueType="delta" continuous="true"/>"#,
    );
    let timed = timed.replace(r#"Shape="step" value="0""#, r#"Shape="linear" value="4""#);
    let found = import(&walker.replacen("</Event>", &timed, 1));
    expect(
        &found,
        " / 4 s\n    }\n  }\n  { continuous: true, speed: ego.speed + 1 m/s }\n",
        "a speed in a time",
    );
    let wrong = wrong.take();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// An event of the van that stands ahead in `cut_in`.
fn event(name: &str, priority: &str, action: &str, condition: &str) -> String {
    format!(
        r#"<Event name="{name}" priority="{priority}"><Action name="{name}_action"><PrivateAction>{action}</PrivateAction></Action><StartTrigger><ConditionGroup><Condition name="{name}_condition" delay="0" conditionEdge="none">{condition}</Condition></ConditionGroup></StartTrigger></Event>"#
    )
}

fn of_value(condition: &str) -> String {
    format!("<ByValueCondition>{condition}</ByValueCondition>")
}

fn of_ego(condition: &str) -> String {
    format!(
        r#"<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef entityRef="Ego"/></TriggeringEntities><EntityCondition>{condition}</EntityCondition></ByEntityCondition>"#
    )
}

/// What somebody else could understand otherwise than the language says it is refused, or becomes what says the same.
#[test]
fn what_would_come_at_another_time_or_place_is_refused() {
    let files = Kept::with("boulevard");
    let cut_in = read(&format!("{AREA}/cut_in.xosc"));
    let begin = cut_in.find("<Event").expect("it has an event");
    let end = cut_in.find("</Maneuver>").expect("it has a manoeuvre");
    let speed = |mps: f64, dimension: &str, value: f64| {
        format!(
            r#"<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="linear" value="{value}" dynamicsDimension="{dimension}"/><SpeedActionTarget><AbsoluteTargetSpeed value="{mps}"/></SpeedActionTarget></SpeedAction></LongitudinalAction>"#
        )
    };
    let aside = r#"<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal" value="6" dynamicsDimension="time"/><LaneChangeTarget><RelativeTargetLane entityRef="Ego" value="0"/></LaneChangeTarget></LaneChangeAction></LateralAction>"#;
    let at = |seconds: f64| {
        of_value(&format!(r#"<SimulationTimeCondition value="{seconds}" rule="greaterThan"/>"#))
    };
    let ended = |event: &str| {
        of_value(&format!(
            r#"<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="{event}" state="completeState"/>"#
        ))
    };
    let near = |kind: &str, metres: f64| {
        of_ego(&format!(
            r#"<RelativeDistanceCondition entityRef="Van" relativeDistanceType="{kind}" value="{metres}" freespace="false" rule="lessThan"/>"#
        ))
    };
    let place = |lane: i32, s: f64| {
        of_ego(&format!(
            r#"<ReachPositionCondition tolerance="2"><Position><LanePosition roadId="3" laneId="{lane}" s="{s}"/></Position></ReachPositionCondition>"#
        ))
    };
    let headway = |rule: &str| {
        of_ego(&format!(
            r#"<TimeHeadwayCondition entityRef="Van" value="3" freespace="false" coordinateSystem="road" relativeDistanceType="longitudinal" rule="{rule}"/>"#
        ))
    };
    let slow = speed(4.0, "rate", 2.0);
    let first = event("first", "parallel", &slow, &at(2.0));
    let then = |condition: &str| event("then", "parallel", &speed(8.0, "rate", 2.0), condition);
    let mut many = String::new();
    for at_s in 0..101 {
        many += &event(&format!("e{at_s}"), "parallel", &slow, &at(f64::from(at_s)));
    }
    let cases: Vec<(&str, String, &str)> = vec![
        ("skip", first.clone() + &event("then", "skip", aside, &at(4.0)), "what is skipped"),
        ("skip alone", event("first", "skip", &slow, &at(2.0)), "scenario case"),
        (
            "a speed that is cut short by a move aside",
            first.clone() + &event("then", "overwrite", aside, &at(2.5)),
            "speed: npc.speed",
        ),
        (
            "a move aside that is cut short by a speed",
            event("first", "parallel", aside, &at(2.0)) + &event("then", "overwrite", &slow, &at(4.0)),
            "it may end another event of its manoeuvre, which goes on here",
        ),
        (
            "a move aside that is over by then",
            event("first", "parallel", aside, &at(2.0)) + &event("then", "overwrite", &slow, &at(9.0)),
            "scenario case",
        ),
        ("the end of a speed", first.clone() + &then(&ended("first")), "scenario case"),
        (
            "the end of a speed that was there before",
            first.clone()
                + &event("second", "parallel", &speed(7.0, "rate", 2.0), &at(5.0))
                + &event("third", "parallel", aside, &at(6.0))
                + &event("last", "parallel", &slow, &ended("second")),
            "when this has ended cannot be told by a speed",
        ),
        (
            "the end of a speed that may be cut short",
            first.clone() + &then(&at(2.5)) + &event("last", "parallel", aside, &ended("first")),
            "another event may cut this short",
        ),
        (
            "a circle",
            event("first", "parallel", &slow, &ended("then")) + &then(&ended("first")),
            "by way of others, for itself",
        ),
        ("times out of order", first.clone() + &then(&at(1.0)), "once elapsed >= 1 s { speed: 8 m/s"),
("an earlier one that stands later", event("first", "parallel", &slow, &near("longitudinal", 10.0)) + &then(&at(1.0)), "what one does is read in the order in which it comes"),
        ("a distance along the road", then(&near("longitudinal", 12.0)), "scenario case"),
        (
            "a distance as the crow flies, far off",
            then(&near("cartesianDistance", 21.0)),
            "scenario case",
        ),
        (
            "a distance as the crow flies, close by",
            then(&near("cartesianDistance", 5.0)),
            "they begin 3.5 m beside each other",
        ),
        (
            "what comes by itself after what may never come",
            event("first", "parallel", &slow, &of_ego(r#"<SpeedCondition value="30" rule="greaterThan"/>"#))
                + &then(&at(9.0)),
            "whether it comes after `first` is not known",
        ),
        (
            "what comes later if everybody goes on as they begin",
            event("first", "parallel", &slow, &near("longitudinal", 10.0)) + &then(&at(9.0)),
            "what `Van` does is taken to come in the order of the file",
        ),
        (
            "two distances, of which the second is farther on",
            event("first", "parallel", &slow, &near("longitudinal", 15.0)) + &then(&near("longitudinal", 10.0)),
            "scenario case",
        ),
        (
            "a speed that begins while another one may go on",
            event("first", "parallel", &speed(4.0, "time", 6.0), &at(2.0))
                + &event("then", "parallel", &speed(8.0, "time", 2.0), &at(3.0)),
            "rate: match npc.speed <= 8 m/s",
        ),
        (
            "a move to the side that begins while another one may go on",
            event("first", "parallel", aside, &at(2.0)) + &event("then", "parallel", aside, &at(3.0)),
            "another move to the side may be under way",
        ),
        (
            "what is overwritten as it begins",
            first.clone() + &event("then", "overwrite", aside, &at(2.0)),
            "at the moment at which that begins",
        ),
        (
            "a transition beside another condition",
            first.clone()
                + &then(&ended("first")).replace("completeState", "endTransition").replace(
                    "</ConditionGroup>",
                    &format!(
                        "<Condition name=\"later\" delay=\"0\" conditionEdge=\"none\">{}</Condition></ConditionGroup>",
                        at(6.0)
                    ),
                ),
            "beside other conditions",
        ),
        (
            "what runs, beside another condition",
            first.clone()
                + &then(&ended("first")).replace("completeState", "runningState").replace(
                    "</ConditionGroup>",
                    &format!(
                        "<Condition name=\"later\" delay=\"0\" conditionEdge=\"none\">{}</Condition></ConditionGroup>",
                        at(6.0)
                    ),
                ),
            "it ceases to hold when `first` has ended",
        ),
        (
            "the end of one of two actions",
            first.replace("</Action>", &format!("</Action><Action name=\"more\"><PrivateAction>{aside}</PrivateAction></Action>"))
                + &then(&ended("first_action").replace("Type=\"event\"", "Type=\"action\"")),
            "its event does several things",
        ),
        (
            "a place beside somebody who drives",
            then(&place(-2, 40.0).replace(
                r#"<LanePosition roadId="3" laneId="-2" s="40"/>"#,
                r#"<RelativeLanePosition entityRef="Van" dLane="0" ds="10"/>"#,
            )),
            "which may be elsewhere by then",
        ),
        ("a headway of one who is behind", then(&headway("greaterThan")), "and ego.speed > 0 m/s"),
        ("a place on the way", then(&place(-2, 40.0)), "scenario case"),
        ("a place beside the way", then(&place(-1, 40.0)), "m beside its way: only what is on it is read"),
        ("more than a manoeuvre holds", many, "more than 100 events of one entity"),
        (
            "two conditions, of which one has an edge",
            then(&near("longitudinal", 12.0)).replace(
                "</ConditionGroup>",
                r#"<Condition name="edge" delay="0" conditionEdge="rising"><ByValueCondition><SimulationTimeCondition value="3" rule="greaterThan"/></ByValueCondition></Condition></ConditionGroup>"#,
            ),
            "beside other conditions",
        ),
        (
            "the end of what two do",
            first.clone() + &then(&ended("first")),
            "several do `first`",
        ),
    ];
    let mut wrong = Vec::new();
    for (case, events, wanted) in cases {
        let mut text = format!("{}{events}{}", &cut_in[..begin], &cut_in[end..]);
        if case == "the end of what two do" {
            let two = r#"<EntityRef entityRef="Van"/><EntityRef entityRef="Second"/></Actors>"#;
            text = text.replace(r#"<EntityRef entityRef="Van"/></Actors>"#, two);
            let object = text.find("<ScenarioObject name=\"Van\"").expect("there is a van");
            let after = object
                + text[object..].find("</ScenarioObject>").expect("it ends")
                + "</ScenarioObject>".len();
            let second = text[object..after].replace("\"Van\"", "\"Second\"");
            text.insert_str(after, &second);
            let private = text.find("<Private entityRef=\"Van\"").expect("it begins");
            let after = private + text[private..].find("</Private>").expect("it ends") + "</Private>".len();
            let second =
                text[private..after].replace("\"Van\"", "\"Second\"").replace("$gap + 10", "$gap + 40");
            text.insert_str(after, &second);
        }
        let found = match import(&text, "case", &files) {
            Ok(imported) => imported.space.unwrap_or_default() + &imported.scenario.unwrap_or_default(),
            Err(refusals) => refusals.into_iter().map(|refusal| refusal.reason + "\n").collect(),
        };
        if !found.contains(wanted) {
            wrong.push(format!("{case}: {found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_torn_or_altered_file_makes_it_panic() {
    let files = Kept::with("corner");
    let mut rng = rng::stream(18, Stream::Reset, 0);
    let (mut imported, mut refused) = (0, 0);
    for (name, _) in cases("imports") {
        // The corner's map is small: its lane 1/-1 stands for the boulevard's 3/-2.
        let text = read(&format!("{AREA}/{name}.xosc"))
            .replace("roadId=\"3\" laneId=\"-2\"", "roadId=\"1\" laneId=\"-1\"");
        let mut try_one = |text: &str| match import(text, &name, &files) {
            Ok(_) => imported += 1,
            Err(refusals) => {
                assert!(!refusals.is_empty(), "a refusal has a reason");
                refused += 1;
            }
        };
        for end in (0..text.len()).step_by(61) {
            try_one(&text[..end]);
        }
        let words = ["", "-1", "1e300", "NaN", "\"", "<", "${", "${$", "$ego_kmh", "é", "999999999999"];
        for _ in 0..150 {
            let mut bytes = text.clone().into_bytes();
            let begin = rng::below(&mut rng, bytes.len() as u32) as usize;
            let end = (begin + rng::below(&mut rng, 12) as usize).min(bytes.len());
            let word = words[rng::below(&mut rng, words.len() as u32) as usize];
            bytes.splice(begin..end, word.bytes());
            try_one(&String::from_utf8_lossy(&bytes));
        }
    }
    assert!(imported > 0 && refused > 300, "{imported} imported, {refused} refused");
}
