//! The rows of the shipped catalogue are those of the published protocols.

use std::collections::BTreeSet;

use avastra::action::ActionTable;
use avastra::check::{ReadError, load};

use crate::cases::root;
use crate::command::done;

/// A family with its parameters: lists of speeds (km/h), parts (in percent) and others, in the order of the protocol's tables.
type Family = (&'static str, &'static [(&'static str, &'static str, &'static [i32])]);

const TO_50: &[i32] = &[10, 15, 20, 25, 30, 35, 40, 45, 50];
const TO_60: &[i32] = &[10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60];
const FROM_50: &[i32] = &[50, 55, 60, 65, 70, 75, 80];
const TURN: &[i32] = &[10, 15, 20];
const FRONT: &[i32] = &[30, 45, 60];
const OVERLAPS: &[i32] = &[-50, -75, 100, 75, 50];

/// "AEB Car-to-Car systems", version 4.1.1: table of CCRs, CCRm, CCRb, CCFtap, CCFhos; CCCscp of 2026.
const CARS: &[Family] = &[
    ("ccrs", &[("ego", "km/h", TO_50), ("overlap", "%", OVERLAPS)]),
    ("ccrs_fcw", &[("ego", "km/h", &[55, 60, 65, 70, 75, 80]), ("overlap", "%", OVERLAPS)]),
    ("ccrm", &[("ego", "km/h", &[30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80]), ("overlap", "%", OVERLAPS)]),
    ("ccrb", &[("ego", "km/h", &[50]), ("headway", "m", &[12, 40]), ("rate", "m/s^2", &[2, 6])]),
    ("ccftap", &[("ego", "km/h", TURN), ("target", "km/h", FRONT)]),
    ("ccfhos", &[("ego", "km/h", &[50, 70])]),
    ("cccscp", &[("ego", "km/h", &[20, 30, 40, 50, 60]), ("target", "km/h", &[20, 30, 40, 50, 60])]),
];

/// "AEB/LSS VRU systems", version 4.5.
const VULNERABLE: &[Family] = &[
    ("cpfa", &[("ego", "km/h", TO_60), ("part", "%", &[50])]),
    ("cpna", &[("ego", "km/h", TO_60), ("part", "%", &[25, 75])]),
    ("cpnco", &[("ego", "km/h", TO_60), ("part", "%", &[50])]),
    ("cpla_50", &[("ego", "km/h", &[20, 25, 30, 35, 40, 45, 50, 55, 60])]),
    ("cpla_25", &[("ego", "km/h", FROM_50)]),
    ("cpta_left_near", &[("ego", "km/h", TURN)]),
    ("cpta_left_far", &[("ego", "km/h", TURN)]),
    ("cpta_right_near", &[("ego", "km/h", &[10])]),
    ("cpta_right_far", &[("ego", "km/h", &[10])]),
    ("cbna", &[("ego", "km/h", TO_60)]),
    ("cbnao", &[("ego", "km/h", TO_60)]),
    ("cbfa", &[("ego", "km/h", TO_60)]),
    ("cbla_50", &[("ego", "km/h", &[25, 30, 35, 40, 45, 50, 55, 60])]),
    ("cbla_25", &[("ego", "km/h", FROM_50)]),
    ("cmrs", &[("ego", "km/h", TO_60), ("part", "%", &[25, 50])]),
    ("cmrb", &[("ego", "km/h", &[50]), ("headway", "m", &[12, 40]), ("part", "%", &[25, 50])]),
    ("cmftap", &[("ego", "km/h", TURN), ("target", "km/h", FRONT)]),
];

/// The label of each row of a family.
fn labels((name, parameters): &Family) -> Vec<String> {
    let mut labels = vec![String::new()];
    for (parameter, unit, values) in *parameters {
        let said = |value: &i32| match *unit {
            "%" => format!("{parameter}: {}", f64::from(*value) / 100.0),
            _ => format!("{parameter}: {value} {unit}"),
        };
        labels = labels
            .iter()
            .flat_map(|before| {
                let gap = if before.is_empty() { "" } else { ", " };
                values.iter().map(move |value| format!("{before}{gap}{}", said(value)))
            })
            .collect();
    }
    labels.into_iter().map(|values| format!("{name}({values})")).collect()
}

#[test]
fn the_rows_are_those_of_the_published_tables() {
    for (file, families) in [("euro_ncap_cars", CARS), ("euro_ncap_vulnerable", VULNERABLE)] {
        let path = root().join(format!("scenarios/catalogue/{file}.ava"));
        let read = |path: &std::path::Path| {
            std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()))
        };
        let loaded = load(&path, &read).expect("it can be read");
        let table = ActionTable::new(loaded.space.expect("it has no mistakes"));
        let found: BTreeSet<String> = table.rows().iter().map(|row| row.label.clone()).collect();
        let wanted: BTreeSet<String> = families.iter().flat_map(labels).collect();
        assert_eq!(found, wanted, "{file}");
        // Each on the road of its own speed, and on no other.
        for row in table.rows() {
            let space = table.space();
            let on = |road: usize| matches!(row.roads[road], avastra::model::Reach::Open(_));
            let roads: Vec<&str> = (0..space.roads.len())
                .filter(|road| on(*road))
                .map(|road| space.roads[road].name.as_str())
                .collect();
            let speed =
                row.label.split("ego: ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap_or_default();
            assert!(roads.len() == 1 && roads[0].ends_with(&format!("_{speed}")), "{}: {roads:?}", row.label);
        }
    }
}

/// Of each row that a driver that sees nothing plays: the action, and the pre-crash type.
#[test]
fn each_of_the_37_pre_crash_types_happens_in_the_row_that_has_its_number() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let space = root().join("scenarios/catalogue/pre_crash.ava").display().to_string();
    done(&["run", &space, "--agent", "every-row", "--repeat", "0", "--ads", "blind", "--out", &out]);
    let table = std::fs::read_to_string(format!("{out}/protocol.csv")).expect("it was written");
    let head: Vec<&str> = table.lines().next().expect("it has a head").split(',').collect();
    let column = |name: &str| head.iter().position(|known| *known == name).expect("it is a column");
    let (action, kind) = (column("action"), column("precrash"));
    let mut found = BTreeSet::new();
    for row in table.lines().skip(1) {
        // Names of types may hold a comma, but their numbers come first.
        let cells: Vec<&str> = row.split(',').collect();
        let asked: u32 = cells[action][1..3].parse().expect("its name begins with its number");
        let number = cells[kind].trim_matches('"').split(' ').next().and_then(|number| number.parse().ok());
        assert_eq!(number, Some(asked), "{row}");
        found.insert(asked);
    }
    assert_eq!(found, (1..=37).collect());
}

#[test]
fn a_template_of_the_catalogue_is_played_row_by_row() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().join("mine").display().to_string();
    let said = done(&["new", "--template", "euro_ncap_vulnerable", &folder]);
    assert!(said.contains("--agent every-row"), "{said}");
    let out = scratch.path().join("run").display().to_string();
    let space = format!("{folder}/euro_ncap_vulnerable.ava");
    let said =
        done(&["run", &space, "--agent", "every-row", "--repeat", "0", "--road", "left_10", "--out", &out]);
    // Its rows on that road: two of `cpta`, three of `cmftap`.
    assert!(said.contains("5 episodes on left_10"), "{said}");
    assert_eq!(
        std::fs::read_to_string(format!("{out}/protocol.csv")).expect("it was written").lines().count(),
        6
    );
}
