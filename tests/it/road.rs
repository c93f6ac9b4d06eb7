//! `avastra road`: maps in words, as JSON and as pictures.

use crate::command::{avastra, done, last_line, outcome};

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
    let map = last_line(&stdout);
    assert_eq!((map["schema"].as_u64(), map["command"].as_str()), (Some(4), Some("road")));
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

/// A lane offset of slope 0.3 over 10 m, then 290 m straight, and the same shift as a smooth cubic: the corners of a
/// taper must not cost collisions on the straight.
/// `cargo test --test it -- --ignored --nocapture a_taper_costs_no_collisions`
#[test]
#[ignore = "plays 360 episodes"]
fn a_taper_costs_no_collisions() {
    let shifts = [
        ("taper", r#"<laneOffset s="40" a="0" b="0.3" c="0" d="0"/>"#),
        ("cubic", r#"<laneOffset s="40" a="0" b="0" c="0.09" d="-0.006"/>"#),
    ];
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let collisions = shifts.map(|(name, shift)| {
        let lanes = [2, 1, -1, -2, -3].map(|id| {
            format!(r#"<lane id="{id}" type="driving"><width a="3.5"/><roadMark sOffset="0" type="broken"/></lane>"#)
        });
        let map = format!(
            r#"<OpenDRIVE><road id="1" length="340" junction="-1"><type s="0" type="town"><speed max="50" unit="km/h"/></type>
            <planView><geometry s="0" x="0" y="0" hdg="0" length="340"><line/></geometry></planView>
            <lanes><laneOffset s="0" a="0"/>{shift}<laneOffset s="50" a="3"/><laneSection s="0">
            <left>{}{}</left><right>{}{}{}</right></laneSection></lanes></road></OpenDRIVE>"#,
            lanes[0], lanes[1], lanes[2], lanes[3], lanes[4]
        );
        std::fs::write(scratch.path().join(format!("{name}.xodr")), map).expect("it is writable");
        let shipped = crate::cases::root().join("scenarios/avastra45.ava");
        let space = format!(
            "language 1\nuse \"{}\"\nroad {name} {{ map: \"{name}.xodr\", start: lane 1/-2 at 5 m, goal: lane 1/-2 at 330 m }}\noverride episode {{ roads: [{name}], stop: arrived or stalled >= 4 }}\n",
            shipped.display()
        );
        let file = scratch.path().join(format!("{name}.ava"));
        std::fs::write(&file, space).expect("it is writable");
        let out = scratch.path().join(name);
        let (file, out) = (file.display().to_string(), out.display().to_string());
        let stdout = done(&[
            "run", &file, "--episodes", "180", "--seed", "1", "--out", &out, "--format", "json",
        ]);
        let result = last_line(&stdout);
        println!("{name}: {}", result["totals"]);
        result["totals"]["collisions"].as_u64().expect("a number")
    });
    assert!(collisions[0] <= collisions[1], "taper and cubic: {collisions:?}");
}
