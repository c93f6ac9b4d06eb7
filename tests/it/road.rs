//! `avastra road`: maps in words, as JSON and as pictures.

use serde_json::Value;

use crate::command::{avastra, outcome};

const CORNER: &str = "scenarios/roads/corner.xodr";

/// Exit status, stdout and stderr of `avastra road`, in the repository.
fn road(arguments: &[&str]) -> (i32, String, String) {
    outcome(&mut avastra(&[&["road"], arguments].concat()))
}

#[test]
fn a_map_is_told_in_words() {
    let (status, stdout, stderr) = road(&[CORNER, "--from", "1/-2@105.88", "--to", "5/-3@75"]);
    assert_eq!((status, stderr.as_str()), (0, ""));
    for part in [
        "map `Complex Corner Intersection`: 24 roads with 39 driving lanes",
        "lane 1/-1: 151.4 m long, 4.0 m wide, 40 km/h, leads to 601/-1, 603/-1, 604/-1, left 1/1 (oncoming)",
        "junction `J_6`: 2 signal groups; 1/-1 to 2/-1",
        "lane change by 3.9 m to the left",
    ] {
        assert!(stdout.contains(part), "`{part}` is not in\n{stdout}");
    }
    let (status, stdout, _) = road(&["scenarios/roads.ava"]);
    assert_eq!(status, 0);
    assert!(stdout.contains("\nroute: "), "a space's road has its route: {stdout}");
}

#[test]
fn a_map_in_json_holds_every_lane_with_its_poses() {
    let (status, stdout, _) = road(&[CORNER, "--format", "json"]);
    assert_eq!(status, 0);
    let map: Value = serde_json::from_str(stdout.lines().last().expect("one line")).expect("it is JSON");
    assert_eq!((map["schema"].as_u64(), map["command"].as_str()), (Some(2), Some("road")));
    let lanes = map["lanes"].as_array().expect("lanes");
    assert_eq!(lanes.len(), 39);
    for lane in lanes {
        let length_m = lane["length_m"].as_f64().expect("a length");
        let poses = lane["poses"].as_array().expect("poses");
        assert_eq!(poses.len(), length_m.floor() as usize + 2);
        assert_eq!(poses[poses.len() - 1][0].as_f64(), Some(length_m));
    }
    assert_eq!(map["junctions"][0]["connections"].as_array().map(Vec::len), Some(11));
}

#[test]
fn what_cannot_be_shown_is_said() {
    for (arguments, part) in [
        (
            &["tests/cases/diagnostics/broken.xodr"][..],
            "cannot read `tests/cases/diagnostics/broken.xodr`: line",
        ),
        (&[CORNER, "--road", "x"], "`--road` names a road of a space"),
        (&[CORNER, "--from", "1/-1", "--to", "5/-3@75"], "`1/-1` is no place"),
        (&[CORNER, "--from", "1/-9@2", "--to", "5/-3@75"], "has no driving lane -9"),
        (&[CORNER, "--from", "5/-3@75", "--to", "1/-1@2"], "there is no way"),
        (&["scenarios/roads.ava", "--road", "nowhere"], "no such road"),
    ] {
        let (status, _, stderr) = road(arguments);
        assert_eq!(status, 1, "{arguments:?}: {stderr}");
        assert!(stderr.contains(part), "{arguments:?}: {stderr}");
    }
}
