//! What `avastra export` writes: its shape, that it depends on the scenario alone, and what is refused. Whether other
//! tools understand it is the question of `tests/interop/export.sh`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra::geometry::{Pose, Vec2, wrap_angle};
use roxmltree::{Document, Node};

use crate::cases::{expect_snapshot, files, root, stem, texts};
use crate::command::{avastra, done, outcome};

const SCENARIO: &str = "tests/cases/exports/wet_corner.ava";

/// Exports a scenario; status and both outputs.
fn export(format: &str, file: &str, out: &Path, more: &[&str]) -> (i32, String, String) {
    let out = out.display().to_string();
    outcome(&mut avastra(&[&["export", "--to", format, "--out", &out, file], more].concat()))
}

#[track_caller]
fn exported(format: &str, file: &str, out: &Path, more: &[&str]) {
    let (status, _, stderr) = export(format, file, out, more);
    assert_eq!(status, 0, "{format}: {stderr}");
}

#[track_caller]
fn refused(format: &str, file: &str, out: &Path, more: &[&str], reason: &str) {
    let (status, _, stderr) = export(format, file, out, more);
    assert!(status == 1 && stderr.contains(reason), "{format}: {stderr}");
}

/// A file without its figures, and without lines that say the same again: what does not change when driving does.
fn shape(text: &str) -> String {
    let mut shape: Vec<String> = Vec::new();
    for line in text.lines() {
        let mut line: String =
            line.chars().map(|letter| if letter.is_ascii_digit() { '#' } else { letter }).collect();
        for figures in ["##", "#.#", "-#"] {
            while line.contains(figures) {
                line = line.replace(figures, "#");
            }
        }
        if !shape.contains(&line) {
            shape.push(line);
        }
    }
    shape.join("\n")
}

#[test]
fn every_format_has_its_shape() {
    for (format, more, name, kept) in [
        ("openscenario", &[][..], "wet_corner.xosc", "openscenario"),
        ("openscenario", &["--natural"], "wet_corner.xosc", "natural"),
        ("openscenario", &["--profile", "carla"], "wet_corner.xosc", "carla"),
        ("commonroad", &[], "wet_corner.xml", "commonroad"),
        ("csv", &[], "wet_corner.csv", "csv"),
    ] {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        exported(format, SCENARIO, scratch.path(), more);
        let written = texts(scratch.path());
        let text = &written[name];
        if format != "csv" {
            roxmltree::Document::parse(text).expect("it is well-formed");
        }
        let shape = match format {
            "csv" => text.lines().next().expect("a table has a head").to_owned(),
            _ => shape(text),
        };
        expect_snapshot("exports", kept, &shape);
        if format == "openscenario" {
            let map =
                std::fs::read_to_string(root().join("scenarios/roads/corner.xodr")).expect("it is shipped");
            assert_eq!(written["corner.xodr"], map, "the map lies beside it");
        }
        let again = tempfile::tempdir().expect("a scratch directory");
        export(format, SCENARIO, again.path(), more);
        assert_eq!(written, texts(again.path()), "{kept} depends on the scenario alone");
    }
}

#[test]
fn a_recording_is_complete_and_at_its_times() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    export("openscenario", SCENARIO, scratch.path(), &[]);
    export("csv", SCENARIO, scratch.path(), &[]);
    let written = texts(scratch.path());
    let rows: Vec<Vec<&str>> =
        written["wet_corner.csv"].lines().skip(1).map(|line| line.split(',').collect()).collect();
    // Two steps of 6 s at 50 Hz, and the moment before the first tick.
    assert_eq!(rows.iter().filter(|row| row[1] == "0").count(), 601);
    let document = roxmltree::Document::parse(&written["wet_corner.xosc"]).expect("it is well-formed");
    for trajectory in document.descendants().filter(|node| node.has_tag_name("Trajectory")) {
        let times: Vec<f64> =
            trajectory.descendants().filter_map(|node| node.attribute("time")?.parse().ok()).collect();
        assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
        assert_eq!(times.last(), Some(&12.0), "the way lasts to the end");
    }
    let of_ego = |more: &[&str]| {
        let out = scratch.path().join("other");
        exported("openscenario", SCENARIO, &out, more);
        texts(&out)["wet_corner.xosc"].clone()
    };
    assert!(of_ego(&[]).contains("ego_follows"));
    assert!(!of_ego(&["--ego", "none"]).contains("ego_follows"));
    assert!(of_ego(&["--ego", "controller"]).contains("<Controller name=\"ads\">"));
}

/// A table calls a body of the author's own by its name, and says beside it which of the engine's it is like.
#[test]
fn an_own_body_keeps_its_name() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let roads = root().join("scenarios/roads.ava").display().to_string();
    let text = format!(
        "language 1\nuse \"{roads}\"\nbody Cart {{ like: Sedan, length: 3 m }}\n\
         action cart() {{ spawn Cart ahead 40 m {{ lane: Current, speed: 5 m/s, does: DriveAhead }} }}\n\
         scenario cart_ahead {{\n  road: corner\n  steps {{ 0: cart() }}\n}}\n"
    );
    let file = scratch.path().join("cart.ava");
    std::fs::write(&file, text).expect("it is writable");
    exported("csv", &file.display().to_string(), &scratch.path().join("out"), &[]);
    let table = texts(scratch.path().join("out"))["cart.csv"].clone();
    let bodies: BTreeSet<(&str, &str)> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').collect::<Vec<_>>())
        .map(|row| (row[2], row[12]))
        .collect();
    assert_eq!(bodies, BTreeSet::from([("Cart", "Sedan"), ("ego", "ego")]));
}

/// Others of a natural version drive by actions: each where and as fast as the recording has it at first, and nothing is
/// triggered by what is not there.
#[test]
fn a_natural_version_has_actions_in_place_of_trajectories() {
    let file = crash();
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for (format, more) in [("openscenario", &["--natural"][..]), ("csv", &[])] {
        exported(format, &file.display().to_string(), scratch.path(), more);
    }
    let written = texts(scratch.path());
    let stem = stem(&file);
    let users = table(&written[&format!("{stem}.csv")]);
    let document = Document::parse(&written[&format!("{stem}.xosc")]).expect("it is well-formed");
    let properties: Vec<&str> =
        all(document.root(), "Property").filter_map(|node| node.attribute("name")).collect();
    assert!(properties.contains(&"natural") && properties.contains(&"trace"), "{properties:?}");
    for follow in all(document.root(), "FollowTrajectoryAction") {
        let of_ego = all(follow, "Trajectory").any(|way| way.attribute("name") == Some("ego_way"));
        assert_ne!(of_ego, all(follow, "None").next().is_some(), "the ego vehicle alone has times");
    }
    let names: Vec<&str> =
        all(document.root(), "Event").filter_map(|event| event.attribute("name")).collect();
    for (id, poses) in users.iter().filter(|(id, _)| **id > 0) {
        let name = format!("npc_{id}");
        let first = poses.values().next().expect("it is seen").position;
        let moves = poses.values().any(|pose| (pose.position - first).norm() > 1.0);
        let begun = all(document.root(), "Private").filter(|node| node.attribute("entityRef") == Some(&name));
        let done = all(document.root(), "ManeuverGroup")
            .filter(|node| node.attribute("name") == Some(&format!("{name}_group")));
        let mut speeds = begun.chain(done).flat_map(|node| all(node, "AbsoluteTargetSpeed"));
        assert_eq!(moves, speeds.any(|speed| attribute(speed, "value") > 0.0), "{name}");
    }
    for state in all(document.root(), "StoryboardElementStateCondition") {
        let event = state.attribute("storyboardElementRef").expect("it has one");
        assert!(names.contains(&event), "{event} is none of {names:?}");
    }
    let mut sorted = names.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), names.len(), "names are unique");
}

/// A thing is no vehicle, and CARLA's player makes of it what it is called.
#[test]
fn a_thing_is_written_as_one() {
    for (profile, called) in [(&[][..], "npc_1"), (&["--profile", "carla"][..], "static.prop.box01")] {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let (status, _, stderr) =
            export("openscenario", "tests/cases/exports/thing.ava", scratch.path(), profile);
        assert_eq!(status, 0, "{stderr}");
        let written = texts(scratch.path());
        let (_, text) = written.iter().find(|(name, _)| name.ends_with(".xosc")).expect("it is written");
        let document = Document::parse(text).expect("it is well-formed");
        let thing = all(document.root(), "MiscObject").next().expect("it is there");
        let known: Vec<_> = thing.attributes().map(|one| (one.name(), one.value())).collect();
        assert_eq!(known, [("name", called), ("miscObjectCategory", "obstacle"), ("mass", "50")]);
    }
}

/// ScenarioRunner reads 1.0 alone, makes everyone at the start, and wants no times of polylines; what it cannot be told is
/// said.
#[test]
fn a_file_for_carla_has_what_its_player_reads() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let name = crash().display().to_string();
    let (status, _, stderr) = export("openscenario", &name, scratch.path(), &["--profile", "carla"]);
    assert_eq!(status, 0, "{stderr}");
    for left_out in ["outlines and masses", "the phases of", "is not there from the beginning"] {
        assert!(stderr.contains(left_out), "{left_out}: {stderr}");
    }
    let (_, stdout, _) =
        export("openscenario", &name, scratch.path(), &["--profile", "carla", "--format", "json"]);
    assert!(stdout.contains("left_out") && stdout.contains("beneath its place"), "{stdout}");
    let written = texts(scratch.path());
    let (_, text) = written.iter().find(|(name, _)| name.ends_with(".xosc")).expect("it is written");
    let document = Document::parse(text).expect("it is well-formed");
    for unknown in ["FollowTrajectoryAction", "AddEntityAction", "TrafficSignals", "TrajectoryRef"] {
        assert_eq!(all(document.root(), unknown).count(), 0, "{unknown}");
    }
    let init = all(document.root(), "Init").next().expect("it begins");
    assert_eq!(
        all(init, "Private").count(),
        all(document.root(), "ScenarioObject").count(),
        "everyone is made"
    );
    let vehicles = all(document.root(), "Vehicle").filter_map(|node| node.attribute("name"));
    assert!(vehicles.into_iter().all(|model| model.starts_with("vehicle.")), "{text}");
    let ego = all(document.root(), "Property").find(|node| node.attribute("value") == Some("ego_vehicle"));
    assert!(ego.is_some(), "{text}");
    exported(
        "openscenario",
        &name,
        &scratch.path().join("driven"),
        &["--profile", "carla", "--ego", "controller"],
    );
    let driven = texts(scratch.path().join("driven"));
    assert!(driven.values().any(|text| text.contains("external_control")), "its own program drives");
}

/// What the exporter promises of a player's polyline, and half a millionth that a number loses when it is written, twice.
const STRAY_M: f64 = 0.01 + 2e-6;
const STRAY_RAD: f64 = 0.002 + 2e-6;
/// What numbers lose alone.
const ROUNDED: f64 = 2e-6;

#[test]
fn every_format_has_everyone_where_the_table_has_them() {
    for file in [root().join(SCENARIO), crash()] {
        let scratch = tempfile::tempdir().expect("a scratch directory");
        let name = file.display().to_string();
        for (format, more) in
            [("openscenario", &[][..]), ("commonroad", &["--ego", "trajectory"]), ("csv", &[])]
        {
            exported(format, &name, scratch.path(), more);
        }
        let written = texts(scratch.path());
        let stem = stem(&file);
        let users = table(&written[&format!("{stem}.csv")]);
        assert!(users.len() > 1, "the ego vehicle is not alone");
        let played = Document::parse(&written[&format!("{stem}.xosc")]).expect("it is well-formed");
        let planned = Document::parse(&written[&format!("{stem}.xml")]).expect("it is well-formed");
        for (id, poses) in &users {
            let user = if *id == 0 { "ego".to_owned() } else { format!("npc_{id}") };
            follows(&played, &user, poses);
            steps(&planned, *id, poses);
        }
    }
}

/// The shipped crash.
pub fn crash() -> PathBuf {
    files(root().join("scenarios/found"), "ava").swap_remove(0)
}

/// The rows of a table: poses of each road user by tick.
fn table(text: &str) -> BTreeMap<u32, BTreeMap<u64, Pose>> {
    let mut users: BTreeMap<u32, BTreeMap<u64, Pose>> = BTreeMap::new();
    for row in text.lines().skip(1) {
        let row: Vec<&str> = row.split(',').collect();
        let number = |column: usize| row[column].parse::<f64>().expect("it is a number");
        let pose = Pose::new(number(3), number(4), number(5));
        let user = users.entry(row[1].parse().expect("it is a number")).or_default();
        user.insert((number(0) * 50.0).round() as u64, pose);
    }
    users
}

/// The nodes of a name under a node.
fn all<'a>(under: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    under.descendants().filter(move |node| node.has_tag_name(name))
}

fn attribute(node: Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).and_then(|text| text.parse().ok()).expect("a number")
}

/// A road user of an OpenSCENARIO file is, between the vertices of its polyline, where the table has it at every tick.
fn follows(document: &Document<'_>, user: &str, poses: &BTreeMap<u64, Pose>) {
    let object = all(document.root(), "ScenarioObject").find(|node| node.attribute("name") == Some(user));
    let centre = all(object.expect("everyone is there"), "Center").next().expect("it has an outline");
    let ahead_m = -attribute(centre, "x");
    let way_name = format!("{user}_way");
    let way = all(document.root(), "Trajectory").find(|node| node.attribute("name") == Some(&way_name));
    let vertices: Vec<(f64, Pose)> = all(way.expect("everyone has a way"), "Vertex")
        .map(|vertex| {
            let place = all(vertex, "WorldPosition").next().expect("a vertex is somewhere");
            let pose = Pose::new(attribute(place, "x"), attribute(place, "y"), attribute(place, "h"));
            (attribute(vertex, "time"), pose)
        })
        .collect();
    assert!(vertices.len() < poses.len(), "{user}: its way is thinned");
    for (tick, pose) in poses {
        let time_s = *tick as f64 / 50.0;
        let next = vertices.partition_point(|(at_s, _)| *at_s < time_s - ROUNDED).max(1);
        let [(from_s, from), (to_s, to)] = [vertices[next - 1], vertices[next]];
        let part = (time_s - from_s) / (to_s - from_s);
        let place = from.position * (1.0 - part) + to.position * part;
        let wanted = pose.offset(ahead_m, 0.0);
        let stray_m = (place - wanted.position).norm();
        assert!(stray_m <= STRAY_M, "{user} at {time_s} s: {stray_m} m");
        let heading_rad = from.heading_rad + part * wrap_angle(to.heading_rad - from.heading_rad);
        let stray_rad = wrap_angle(heading_rad - pose.heading_rad).abs();
        assert!(stray_rad <= STRAY_RAD, "{user} at {time_s} s: {stray_rad} rad");
    }
}

/// A road user of a CommonRoad file is at every step where the table has it, and has all steps.
fn steps(document: &Document<'_>, id: u32, poses: &BTreeMap<u64, Pose>) {
    let number = |node: Node<'_, '_>, path: &[&str]| -> f64 {
        let found = path.iter().fold(node, |node, name| {
            node.children().find(|child| child.has_tag_name(*name)).expect("the format has it")
        });
        found.text().and_then(|text| text.parse().ok()).expect("a number")
    };
    let obstacle = all(document.root(), "dynamicObstacle")
        .find(|node| attribute(*node, "id") as u32 % 10_000 == id)
        .expect("everyone is there");
    let states: Vec<Node<'_, '_>> = all(obstacle, "initialState").chain(all(obstacle, "state")).collect();
    let steps: Vec<u64> = states.iter().map(|state| number(*state, &["time", "exact"]) as u64).collect();
    let wanted: Vec<u64> = poses.keys().filter(|tick| *tick % 5 == 0).map(|tick| tick / 5).collect();
    assert_eq!(steps, wanted, "npc_{id}");
    for (state, step) in states.into_iter().zip(steps) {
        let pose = &poses[&(step * 5)];
        let place =
            Vec2::new(number(state, &["position", "point", "x"]), number(state, &["position", "point", "y"]));
        assert!((place - pose.position).norm() <= ROUNDED, "npc_{id} at step {step}");
        let turned_rad = wrap_angle(number(state, &["orientation", "exact"]) - pose.heading_rad).abs();
        assert!(turned_rad <= ROUNDED, "npc_{id} at step {step}");
    }
}

#[test]
fn a_contact_is_in_the_row_at_the_end_of_its_tick() {
    let file = crash();
    let claimed = std::fs::read_to_string(&file).expect("it is shipped");
    let claim = claimed.split("expect collision with npc#").nth(1).expect("it claims a collision");
    let mut words = claim.split_whitespace();
    let id = words.next().expect("a number");
    let claimed_s: f64 = words.nth(1).expect("a time").parse().expect("a time");
    let scratch = tempfile::tempdir().expect("a scratch directory");
    exported("csv", &file.display().to_string(), scratch.path(), &[]);
    let table = texts(scratch.path()).into_values().next().expect("it was written");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    for user in ["0", id] {
        let touches: Vec<f64> = rows
            .iter()
            .filter(|row| row[1] == user && row[11] == "1")
            .map(|row| row[0].parse().expect("a time"))
            .collect();
        // Claims round to a hundredth of a second; a tick takes two.
        let late_s = touches[0] - claimed_s;
        assert!((-0.005..=0.025).contains(&late_s), "{user}: {touches:?}, claimed {claimed_s} s");
    }
}

#[test]
fn what_is_no_scenario_or_does_not_replay_is_refused() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    refused("csv", "scenarios/avastra45.ava", scratch.path(), &[], "has no scenario");
    refused("csv", "scenarios/nowhere.ava", scratch.path(), &[], "cannot read");
    for (format, option) in [("csv", "--ego"), ("commonroad", "--ego")] {
        refused(format, SCENARIO, scratch.path(), &[option, "controller"], "--ego");
    }
    for option in [&["--natural"][..], &["--profile", "carla"]] {
        refused("csv", SCENARIO, scratch.path(), option, option[0]);
    }

    let text = std::fs::read_to_string(root().join(SCENARIO)).expect("it is a case");
    let space = root().join("scenarios/avastra45.ava").display().to_string();
    let text = text.replace("../../../scenarios/avastra45.ava", &space);
    let lie = scratch.path().join("lie.ava");
    std::fs::write(&lie, text.replace("end == script", "end == arrived")).expect("it is writable");
    let out = scratch.path().join("out");
    let (status, stdout, stderr) = export("csv", &lie.display().to_string(), &out, &[]);
    assert_eq!(status, 3, "{stderr}");
    assert!(stdout.contains("it does not replay: claimed end arrived, found script"), "{stdout}");
    assert!(!out.exists(), "nothing is written");
    let old = text.replace("seed: 7,", "seed: 7, engine: \"plane/1\",");
    std::fs::write(&lie, old).expect("it is writable");
    refused("csv", &lie.display().to_string(), &out, &[], "plane/1");
}

#[test]
fn nothing_of_others_is_overwritten() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    std::fs::write(scratch.path().join("corner.xodr"), "another map").expect("it is writable");
    refused("openscenario", SCENARIO, scratch.path(), &[], "another map is already at");
    assert!(!scratch.path().join("wet_corner.xosc").exists());
    // What cannot be read as a map is somebody's all the same.
    let bytes = [0x50, 0x4b, 0xff, 0xfe];
    let taken = scratch.path().join("taken");
    std::fs::create_dir(&taken).expect("it is new");
    std::fs::write(taken.join("corner.xodr"), bytes).expect("it is writable");
    refused("openscenario", SCENARIO, &taken, &[], "is in the place of the map: not text");
    assert_eq!(std::fs::read(taken.join("corner.xodr")).expect("it is there"), bytes);
    assert!(!taken.join("wet_corner.xosc").exists());
    // A folder that is a file.
    refused("csv", SCENARIO, &scratch.path().join("corner.xodr"), &[], "cannot");
    let twin = scratch.path().join("wet_corner.ava");
    std::fs::copy(root().join(SCENARIO), &twin).expect("it is writable");
    refused("csv", SCENARIO, scratch.path(), &[&twin.display().to_string()], "would both be written to");
}

const ROWS: &str = "tests/cases/exports/rows.ava";

#[test]
fn a_space_is_templates_with_lists_of_their_values() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let (status, stdout, stderr) = export("openscenario", ROWS, scratch.path(), &[]);
    assert_eq!(status, 0, "{stderr}");
    let told = [
        "10 of 13 rows on their roads in 5 templates",
        "goes backwards: `backing(",
        "own models: `driver(",
        "waited for later, or with other conditions: `later_gap(",
    ];
    assert!(told.iter().all(|part| stdout.contains(part)), "{stdout}");
    let written = texts(scratch.path());
    let names: Vec<&str> = written.keys().map(String::as_str).collect();
    let both = |name: &str| [format!("{name}.xosc"), format!("{name}_variations.xosc")];
    let wanted = ["rows_lead", "rows_walker_1", "rows_walker_2"].map(both).concat();
    assert!(wanted.iter().all(|name| names.contains(&name.as_str())), "{names:?}");
    assert!(names.contains(&"rows_met.xosc") && names.contains(&"proving_ground.xodr"), "{names:?}");
    let lead = [&written["rows_lead.xosc"], &written["rows_lead_variations.xosc"]];
    expect_snapshot("exports", "rows_lead", &lead.map(String::as_str).join("\n"));
    expect_snapshot("exports", "rows_met", &written["rows_met.xosc"]);
    let headway = written["rows_by_headway.xosc"].lines().find(|line| line.contains("<TimeHeadwayCondition"));
    let headway = headway.expect("it is told the headway");
    assert!(headway.contains("rule=\"lessOrEqual\"") && headway.contains("value=\"2\""), "{headway}");
    // It depends on the space alone.
    let again = tempfile::tempdir().expect("a scratch directory");
    exported("openscenario", ROWS, again.path(), &[]);
    assert_eq!(texts(again.path()), written);
}

/// How the rows of a space end with a driver whose sensors make no errors: its endings with their figures, and how often each comes, by action.
fn ends(space: &Path, out: &Path) -> BTreeMap<String, BTreeMap<String, usize>> {
    let (space, run) = (space.display().to_string(), out.display().to_string());
    let (status, _, stderr) =
        outcome(&mut avastra(&["run", "--agent", "every-row", "--ads", "idm", "--out", &run, &space]));
    assert!(status <= 1, "{space}: {stderr}");
    let table = std::fs::read_to_string(out.join("protocol.csv")).expect("it is written");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|head| *head == name).expect("it has the column");
    let shown = ["ending", "before_kmh", "impact_kmh", "relative_kmh"].map(column);
    let mut found: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for row in &rows[1..] {
        let rounded =
            |text: &str| text.parse::<f64>().map_or(text.to_owned(), |number| format!("{number:.1}"));
        let end = shown.map(|at| rounded(row[at])).join(" ");
        *found.entry(row[column("action")].to_owned()).or_default().entry(end).or_default() += 1;
    }
    found
}

#[test]
fn a_space_comes_back_with_the_same_rows() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let exported_to = scratch.path().join("exported");
    exported("openscenario", ROWS, &exported_to, &[]);
    let wanted = ends(&root().join(ROWS), &scratch.path().join("run"));
    for (file, action, rows) in [
        ("rows_met.xosc", "met", 1),
        ("rows_by_headway.xosc", "by_headway", 1),
        ("rows_walker_1_variations.xosc", "walker", 2),
        ("rows_walker_2_variations.xosc", "walker", 2),
    ] {
        let (from, into) = (exported_to.join(file), scratch.path().join("imported"));
        let arguments = ["import", "--out", &into.display().to_string(), &from.display().to_string()];
        let (status, _, stderr) = outcome(&mut avastra(&arguments));
        assert_eq!(status, 0, "{file}: {stderr}");
        let space = into.join(file).with_extension("ava");
        let back = ends(&space, &scratch.path().join(format!("run_{}", stem(&space))));
        let back: Vec<(&String, &usize)> = back.values().flatten().collect();
        assert_eq!(back.iter().map(|(_, count)| **count).sum::<usize>(), rows, "{file}: {back:?}");
        assert!(
            back.iter().all(|(end, _)| wanted[action].contains_key(*end)),
            "{file}: {back:?} of {wanted:?}"
        );
    }
}

#[test]
fn options_of_recordings_are_refused_for_spaces() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    for option in [&["--natural"][..], &["--profile", "carla"], &["--ego", "none"]] {
        let (status, _, stderr) = export("openscenario", ROWS, scratch.path(), option);
        assert!(status == 1 && stderr.contains("a space has no recording"), "{option:?}: {status} {stderr}");
    }
    let (status, _, stderr) = export("openscenario", "scenarios/roads.ava", scratch.path(), &[]);
    assert!(status != 0 && stderr.contains("no action"), "{status} {stderr}");
    assert!(texts(scratch.path()).is_empty());
}

/// Those who follow a trajectory from the start are written as they are told, and not as they were seen.
#[test]
fn a_natural_version_has_the_manoeuvres_of_those_who_follow() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let folder = scratch.path().display().to_string();
    done(&["import", "--out", &folder, "tests/cases/imports/braking.xosc"]);
    let scenario = scratch.path().join("braking_scenario.ava").display().to_string();
    exported("openscenario", &scenario, scratch.path(), &["--natural"]);
    let text = std::fs::read_to_string(scratch.path().join("braking_scenario.xosc")).expect("it was written");
    let document = Document::parse(&text).expect("it is XML");
    let events = document.descendants().filter(|node| node.has_tag_name("Event"));
    let names: Vec<&str> = events.filter_map(|event| event.attribute("name")).collect();
    assert!(names.iter().any(|name| name.ends_with("_phase_1")), "{names:?}");
    assert!(
        !names.iter().any(|name| name.contains("_speed_")),
        "nothing is fitted to the recording: {names:?}"
    );
}
