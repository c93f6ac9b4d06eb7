//! What `avastra import` makes of OpenSCENARIO files: the scenario that it writes, or all that it refuses with its lines.

use std::collections::BTreeMap;

use avastra::import::{Files, openscenario};
use avastra::rng;
use avastra::rng::Stream;

use crate::cases::{expect_snapshot, root};
use crate::command::{avastra, outcome};

const AREA: &str = "tests/cases/imports";

#[test]
fn every_file_becomes_a_scenario_or_is_refused_with_its_lines() {
    for name in ["cut_in", "walker", "refused", "braking"] {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let folder = scratch.path().display().to_string();
        let file = format!("{AREA}/{name}.xosc");
        let (status, stdout, stderr) = outcome(&mut avastra(&["import", "--out", &folder, &file]));
        let written = scratch.path().join(format!("{name}.ava"));
        let is_imported = matches!(name, "cut_in" | "walker");
        assert_eq!(status, if is_imported { 0 } else { 2 }, "{name}: {stdout}{stderr}");
        assert_eq!(written.exists(), is_imported, "{name}");
        if !is_imported {
            expect_snapshot("imports", name, &stdout);
            continue;
        }
        let text = std::fs::read_to_string(&written).expect("it was written");
        expect_snapshot("imports", name, &text);
        let file = written.display().to_string();
        let (status, stdout, stderr) = outcome(&mut avastra(&["check", &file]));
        assert_eq!(status, 0, "{name}: {stdout}{stderr}");
        assert_eq!(outcome(&mut avastra(&["fmt", "--check", &file])).0, 0, "{name} is formatted");
        let (status, stdout, stderr) = outcome(&mut avastra(&["export", "--to", "csv", &file]));
        assert_eq!(status, 0, "{name}: {stdout}{stderr}");
        let table = std::fs::read_to_string(scratch.path().join(format!("exported/{name}.csv")));
        let first: Vec<f64> = table
            .expect("it was written")
            .lines()
            .nth(1)
            .map(|row| row.split(',').filter_map(|cell| cell.parse().ok()).collect())
            .expect("it has a row");
        // Without `body`, which is no number, the speed's parts are the sixth and the seventh.
        let ego_kmh = libm::hypot(first[5], first[6]) * 3.6;
        let wanted_kmh = if name == "cut_in" { 36.0 } else { 30.0 };
        assert!((ego_kmh - wanted_kmh).abs() < 0.1, "{name}: the ego vehicle begins at {ego_kmh} km/h");
        // A second import finds what the first wrote.
        let (status, ..) =
            outcome(&mut avastra(&["import", "--out", &folder, &format!("{AREA}/{name}.xosc")]));
        assert_eq!(status, 0, "{name} again");
    }
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

/// The map and the catalogue of the cases, from memory.
struct Kept {
    map: String,
    catalogue: String,
}

impl Files for Kept {
    fn map(&self, _: &str) -> Result<String, String> {
        Ok(self.map.clone())
    }

    fn catalogues(&self, _: &str) -> Result<Vec<String>, String> {
        Ok(vec![self.catalogue.clone()])
    }
}

#[test]
fn no_torn_or_altered_file_makes_it_panic() {
    let read = |path: &str| std::fs::read_to_string(root().join(path)).expect("it is there");
    let files = Kept {
        map: read("scenarios/roads/corner.xodr"),
        catalogue: read("tests/cases/imports/catalogue/vehicles.xosc"),
    };
    let mut rng = rng::stream(18, Stream::Reset, 0);
    let (mut imported, mut refused) = (0, 0);
    for name in ["cut_in", "walker", "refused", "braking"] {
        // The corner's map is small: its lane 1/-1 stands for the boulevard's 3/-2.
        let text = read(&format!("{AREA}/{name}.xosc"))
            .replace("roadId=\"3\" laneId=\"-2\"", "roadId=\"1\" laneId=\"-1\"");
        let mut try_one = |text: &str| match openscenario(text, name, None, &BTreeMap::new(), &files) {
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
