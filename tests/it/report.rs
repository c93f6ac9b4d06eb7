//! The page that `avastra report` writes: it holds everything, asks for nothing, and says what the world did.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use avastra::action::ActionTable;
use avastra::ads::Selected;
use avastra::geometry::wrap_angle;
use avastra::model::Scenario;
use avastra::report::{Page, Recording, Scene, record};
use avastra::run::{Stage, recorded};
use base64::Engine;
use serde_json::Value;

use crate::cases::{files_below, root};
use crate::command::{avastra, done, last_line, outcome};
use crate::world::loaded;

/// A pedestrian walks in front of a driving system that yields to nobody. Its seed, and so what is driven, is fixed.
const SOURCE: &str = r#"language 1
use "avastra45.ava"

/// A pedestrian, and an SUV that comes the other way; <b>&amp; marks</b> stay text.
scenario walk {
  origin {
    seed: 9236459692659895448
    ads: "modular"
    profile: "{planning: {never_yields: true}}"
  }
  road: corner
  start { time: Morning, sky: None, signal_phase: 92.328125 s, traffic_seed: 9236459692659895448 }
  steps {
    0: pedestrian(from: Left) with { mode: Far, speed: 0.921875 m/s, distance: 40 m }
    1: drive_opposite(mode: Near, then: Keep) with {
      vehicle: SUV
      colour: Skyblue
      speed: 10.734375 m/s
      distance: 17.3671875 m
    }
    2: clear_sky()
  }
}
"#;

/// The scenario, with its table and driving system.
fn walk() -> (ActionTable, Scenario, Selected) {
    let loaded = loaded("scenarios/walk.ava", SOURCE);
    let scenario = loaded.scenario.expect("it has a scenario");
    let ads = recorded(&scenario).expect("its driving system exists");
    (ActionTable::new(loaded.space.expect("its space is sound")), scenario, ads)
}

fn page_of(recording: Recording) -> String {
    let scene =
        Scene { file: "walk.ava".to_owned(), recording, compared: None, shrunk_from: None, changed: None };
    let title = "runs/<walk> & {{script}}".to_owned();
    Page { title, overview: Value::Null, remarks: Vec::new(), scenes: vec![scene], compared_with: None }
        .html()
}

/// What a page says of itself and of its scenarios in short.
pub fn index_of(html: &str) -> Value {
    let index = html.split("id=\"index\">").nth(1).and_then(|rest| rest.split("</script>").next());
    serde_json::from_str(index.expect("a page has an index")).expect("the index is JSON")
}

/// Header and columns of an element, read independently of the code that wrote them.
fn unpacked(html: &str, id: &str) -> (Value, Vec<Vec<f64>>) {
    let begin = format!("<script type=\"text/plain\" id=\"{id}\">");
    let text = html.split(&begin).nth(1).and_then(|rest| rest.split("</script>").next()).expect(id);
    let deflated = base64::engine::general_purpose::STANDARD.decode(text).expect("it is base64");
    let bytes = miniz_oxide::inflate::decompress_to_vec_zlib(&deflated).expect("it is a zlib stream");
    let (length, rest) = bytes.split_at(4);
    let (header, mut rest) = rest.split_at(u32::from_le_bytes(length.try_into().unwrap()) as usize);
    let whole: Value = serde_json::from_slice(header).expect("the header is JSON");
    let mut next = || {
        let (mut value, mut shift) = (0u64, 0);
        loop {
            let (byte, after) = rest.split_first().expect("all values are there");
            rest = after;
            value |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                return (value >> 1) as i64 ^ -((value & 1) as i64);
            }
        }
    };
    let mut column = |layout: &Value| {
        let (step, count) = (layout[0].as_f64().unwrap(), layout[2].as_u64().unwrap());
        let mut values: Vec<i64> = (0..count).map(|_| next()).collect();
        for _ in 0..layout[1].as_u64().unwrap() {
            let mut sum = 0;
            values.iter_mut().for_each(|value| {
                sum += *value;
                *value = sum;
            });
        }
        values.iter().map(|value| *value as f64 * step).collect()
    };
    let columns = whole["columns"].as_array().unwrap().iter().map(&mut column).collect();
    assert!(rest.is_empty(), "nothing is left over");
    (whole["header"].clone(), columns)
}

#[test]
fn a_page_says_what_the_world_did() {
    let (table, scenario, ads) = walk();
    let html = page_of(record(&table, &scenario, &ads, SOURCE).expect("it plays"));
    let (header, columns) = unpacked(&html, "s0");
    let column = |number: &Value| &columns[number.as_u64().unwrap() as usize];
    let near = |found: f64, truth: f64, half_step: f64| (found - truth).abs() <= half_step + 1e-9;
    let (mut ticks, mut others) = (0, 0);
    let stage = Stage::new(&table, &scenario).expect("it is of this engine");
    let log = stage.play(&ads, &mut |world, _, _| {
        let tick = world.ticks() as usize;
        ticks += 1;
        let ego = &header["ego"];
        let pose = world.ego_outline().pose;
        assert!(near(column(&ego["places"][0])[tick], pose.position.x, 0.005), "x at tick {tick}");
        assert!(near(column(&ego["places"][1])[tick], pose.position.y, 0.005), "y at tick {tick}");
        assert!(near(wrap_angle(column(&ego["places"][2])[tick] - pose.heading_rad), 0.0, 0.0005));
        assert!(near(column(&ego["speed_mps"])[tick], world.ego().speed_mps, 0.005));
        for obstacle in world.obstacles() {
            let users = header["obstacles"].as_array().unwrap();
            let user = users.iter().find(|user| user["id"] == obstacle.id).expect("everybody is there");
            let at = tick - user["from_tick"].as_u64().unwrap() as usize;
            let position = obstacle.outline.pose.position;
            assert!(near(column(&user["places"][0])[at], position.x, 0.005), "{} at {tick}", obstacle.id);
            assert!(near(column(&user["places"][1])[at], position.y, 0.005), "{} at {tick}", obstacle.id);
            others += 1;
        }
    });
    assert_eq!(column(&header["ego"]["speed_mps"]).len(), ticks);
    assert!(others > 0, "somebody else was there");
    let collisions = header["collisions"].as_array().unwrap();
    assert_eq!(collisions.len(), log.collisions.len());
    for (told, was) in collisions.iter().zip(&log.collisions) {
        assert_eq!(told["at_s"], was.contact.time_s);
        assert_eq!(told["ways"].as_array().unwrap().len(), 4, "four reference drivers");
    }
    let held = log.held.iter().map(|held| serde_json::json!([held.from_s, held.text(), held.restraint()]));
    assert_eq!(header["held"], held.collect::<Value>());
    assert_eq!(header["source"], SOURCE);
    let (ground, lines) = unpacked(&html, "g0");
    let lane = |index: &Value| lines[index.as_u64().unwrap() as usize].len();
    assert!(ground["lanes"].as_array().unwrap().iter().all(|shape| lane(&shape["left"][0]) >= 2));
}

#[test]
fn a_page_says_when_phases_begin() {
    const TOLD: &str = "language 1
use \"roads.ava\"
manoeuvre stop(wait: Duration) { after wait { speed: 0 m/s, rate: 4 m/s^2 } after 1 s { speed: 5 m/s } }
action leader() {
  spawn Sedan as leader ahead 40 m { does: DriveAhead, lane: Current, speed: 8 m/s, then: stop(2 s) }
}
action again() { order leader { then: stop(0 s) } }
scenario told {
  road: boulevard
  start { }
  steps { 0: leader() 2: again() }
}
";
    let loaded = loaded("scenarios/told.ava", TOLD);
    let scenario = loaded.scenario.expect("it has a scenario");
    let table = ActionTable::new(loaded.space.expect("its space is sound"));
    let ads = recorded(&scenario).expect("its driving system exists");
    let html = page_of(record(&table, &scenario, &ads, TOLD).expect("it plays"));
    let (header, _) = unpacked(&html, "s0");
    let phases = header["obstacles"][0]["phases"].as_array().expect("it has phases");
    let told: Vec<(f64, &str)> =
        phases.iter().map(|one| (one[0].as_f64().unwrap(), one[1].as_str().unwrap())).collect();
    // 2 s after it appeared; once it stands it waits for one more; then the order, in the third step.
    let [(first_s, first), (second_s, second), (again_s, again), ..] = told[..] else { panic!("{told:?}") };
    assert_eq!([first, second, again], ["stop, phase 1", "stop, phase 2", "stop, phase 1"]);
    assert!((first_s - 2.0).abs() < 0.05 && second_s >= first_s + 1.0, "{told:?}");
    assert!((again_s - 12.0).abs() < 0.05, "{told:?}");
}

/// The page of a scenario in which a requirement is breached.
fn breached_page() -> String {
    const TOLD: &str = "language 1
use \"roads.ava\"
require slow when ego.speed >= 2 m/s: ego.speed <= 9 m/s within 1 s
require near: ego.route_left <= 1000 m
action nothing() { spawn Sedan ahead 80 m { does: DriveAhead, lane: Current, speed: 12 m/s } }
scenario told {
  road: boulevard
  start { }
  steps { 0: nothing() 2: wait() }
  expect slow.recurrence == 7 / 7
  expect slow.recurrence == 4 / 4 at 1.0 s
}
";
    page_told("scenarios/told.ava", TOLD)
}

/// The page of a scenario of this text, which stands at a path.
fn page_told(path: &str, text: &str) -> String {
    let loaded = loaded(path, text);
    let scenario = loaded.scenario.expect("it has a scenario");
    let table = ActionTable::new(loaded.space.expect("its space is sound"));
    let ads = recorded(&scenario).expect("its driving system exists");
    page_of(record(&table, &scenario, &ads, text).expect("it plays"))
}

/// The page of a scenario in which two others crash into each other.
fn wrecked_page() -> String {
    let path = "tests/cases/written/twreck.ava";
    page_told(path, &std::fs::read_to_string(root().join(path)).expect("it is a case"))
}

#[test]
fn a_page_tells_of_crashes_among_others() {
    let (header, _) = unpacked(&wrecked_page(), "s0");
    let crash = &header["summary"]["crashes"][0];
    assert_eq!((&crash["obstacle"], &crash["other"]), (&2.into(), &1.into()), "{crash}");
    assert!(header["collisions"].as_array().is_some_and(Vec::is_empty), "the ego vehicle touches nobody");
}

#[test]
fn a_page_draws_the_margins_of_what_was_breached() {
    let html = breached_page();
    let (header, columns) = unpacked(&html, "s0");
    let column = |number: &Value| &columns[number.as_u64().unwrap() as usize];
    let speeds = column(&header["ego"]["speed_mps"]);
    let [drawn] = &header["margins"].as_array().expect("a list")[..] else { panic!("{}", header["margins"]) };
    assert_eq!((drawn["requirement"].as_str(), drawn["unit"].as_str()), (Some("slow"), Some("m/s")));
    let mut is_drawn = vec![false; speeds.len()];
    let mut failed = 0;
    for part in drawn["parts"].as_array().expect("a list") {
        let from = part[0].as_u64().unwrap() as usize;
        for (tick, margin) in (from..).zip(column(&part[1])) {
            is_drawn[tick] = true;
            failed += usize::from(*margin < 0.0);
            assert!((margin - (9.0 - speeds[tick])).abs() <= 0.011, "{margin} at tick {tick}");
        }
    }
    for (tick, speed_mps) in speeds.iter().enumerate().skip(1) {
        assert!(is_drawn[tick] == (*speed_mps >= 2.0) || (speed_mps - 2.0).abs() < 0.01, "tick {tick}");
    }
    let breaches = header["summary"]["breaches"].as_array().expect("a list");
    let breached_s: f64 =
        breaches.iter().map(|one| one["until_s"].as_f64().unwrap() - one["at_s"].as_f64().unwrap()).sum();
    // Each breach begins a second after its condition fails.
    assert!(
        (failed as f64 * 0.02 - breached_s - breaches.len() as f64 * 1.02).abs()
            < 0.05 * breaches.len() as f64
    );
    assert!(failed > 50 && !breaches.is_empty());
}

#[test]
fn a_page_holds_everything_and_repeats_itself() {
    let (table, scenario, ads) = walk();
    let page = || page_of(record(&table, &scenario, &ads, SOURCE).expect("it plays"));
    let html = page();
    assert_eq!(html, page(), "the same scenario gives the same bytes");
    for wish in ["http://", "https://", " src=", "<link", "@import", "url(", "fetch(", "import(", "Worker("] {
        // A namespace is a name, and no address to go to.
        let text = html.replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains(wish), "{wish}");
    }
    assert!(html.contains("default-src 'none'"), "the browser is told to ask for nothing");
    assert!(html.contains("<title>runs/&lt;walk&gt; &amp; {{script}} · avastra</title>"));
    assert!(!html.contains("\nimport ") && !html.contains("\nexport "), "modules are joined");
    assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
    let index = index_of(&html);
    assert_eq!(index["scenarios"][0]["summary"]["name"], "walk");
    assert!(html.len() < 165_000, "{} bytes for one short scenario", html.len());
}

/// The fields of each interface of `data.d.ts`: whether each may be missing, and its type.
fn shapes() -> BTreeMap<String, BTreeMap<String, (bool, String)>> {
    let text = std::fs::read_to_string(root().join("src/exchange/report/page/data.d.ts"));
    let text = text.expect("it is there");
    let mut shapes: BTreeMap<String, BTreeMap<String, (bool, String)>> = BTreeMap::new();
    let mut current = None;
    for line in text.lines() {
        if let Some(header) = line.strip_prefix("export interface ") {
            let mut words = header.trim_end_matches(" {").split(" extends ");
            let name = words.next().expect("an interface has a name").to_owned();
            let inherited = words.next().map(|base| shapes[base].clone()).unwrap_or_default();
            shapes.insert(name.clone(), inherited);
            current = Some(name);
        } else if line == "}" {
            current = None;
        } else if let (Some(name), Some((field, ty))) = (&current, line.trim().split_once(": ")) {
            let may_lack = field.ends_with('?');
            let fields = shapes.get_mut(name).expect("it was begun");
            let ty = ty.trim_end_matches(';').to_owned();
            fields.insert(field.trim_end_matches('?').to_owned(), (may_lack, ty));
        }
    }
    shapes
}

/// Whether a value is of a declared type, as far as it is a plain one, a list, or null.
fn is_of(value: &Value, ty: &str) -> bool {
    ty.split(" | ").any(|ty| match ty {
        "number" | "Column" => value.is_number(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "string[]" => value.as_array().is_some_and(|all| all.iter().all(Value::is_string)),
        _ if ty.ends_with("[]") || ty.starts_with('[') || ty.starts_with("Changes<") || ty == "Places" => {
            value.is_array()
        }
        "1" => value == 1,
        "any" => true,
        _ => value.is_object(),
    })
}

/// What the page's modules are checked against is what is written.
#[test]
fn the_data_of_a_page_has_the_shapes_that_its_modules_read() {
    let shapes = shapes();
    let mut seen = BTreeSet::new();
    let mut holds = |shape: &str, value: &Value| {
        let fields = value.as_object().unwrap_or_else(|| panic!("{shape}: {value}"));
        for (name, value) in fields {
            let Some((_, ty)) = shapes[shape].get(name) else {
                panic!("{shape}.{name} is written and not declared")
            };
            assert!(is_of(value, ty), "{shape}.{name} is declared as `{ty}`, and written {value}");
        }
        for (name, (may_lack, _)) in &shapes[shape] {
            assert!(*may_lack || fields.contains_key(name), "{shape}.{name} is declared and not written");
        }
        seen.insert(shape.to_owned());
    };
    let each = |value: &Value| value.as_array().expect("a list").clone();
    let (table, scenario, ads) = walk();
    let walked = page_of(record(&table, &scenario, &ads, SOURCE).expect("it plays"));
    for html in &[walked, breached_page(), wrecked_page()] {
        let index = index_of(html);
        holds("Index", &index);
        holds("Quantisation", &index["quantisation"]);
        each(&index["scenarios"]).iter().for_each(|entry| holds("Entry", entry));
        let (header, _) = unpacked(html, "s0");
        holds("Header", &header);
        holds("Summary", &header["summary"]);
        each(&header["summary"]["collisions"]).iter().for_each(|one| holds("Finding", one));
        for breach in each(&header["summary"]["breaches"]) {
            holds("Breach", &breach);
            breach
                .get("recurrence")
                .filter(|one| !one.is_null())
                .iter()
                .for_each(|one| holds("Recurrence", one));
            each(&breach["moments"]).iter().for_each(|one| holds("Branched", one));
        }
        each(&header["summary"]["crashes"]).iter().for_each(|one| holds("Crash", one));
        for collision in each(&header["collisions"]) {
            holds("Collision", &collision);
            each(&collision["ways"]).iter().for_each(|way| holds("Way", way));
        }
        let lists =
            [("steps", "Step"), ("obstacles", "Obstacle"), ("tracks", "Track"), ("margins", "Margin")];
        for (list, shape) in lists {
            each(&header[list]).iter().for_each(|one| holds(shape, one));
        }
        holds("Ego", &header["ego"]);
        holds("Plans", &header["plans"]);
    }
    let unseen: Vec<&String> = shapes.keys().filter(|shape| !seen.contains(*shape)).collect();
    assert!(unseen.is_empty(), "{unseen:?}");
}

/// `sh scenarios/found/make.sh` draws it again, should the engine or the driving system change.
#[test]
fn the_picture_of_the_readme_is_of_its_scenario() {
    let found = "scenarios/found/residential_0046";
    done(&["replay", &format!("{found}.ava")]);
    let drawn = done(&["render", &format!("{found}.ava"), "--strip", "--out", "-"]);
    let kept = std::fs::read_to_string(root().join(format!("{found}.svg"))).expect("it is shipped");
    assert_eq!(drawn.trim_end(), kept.trim_end());
    let document = roxmltree::Document::parse(&kept).expect("it is well-formed XML");
    let panels = document.descendants().filter(|node| node.has_tag_name("svg")).count() - 1;
    assert_eq!(panels, 5);
    let readme = std::fs::read_to_string(root().join("README.md")).expect("it is shipped");
    assert!(readme.contains(&format!("({found}.svg)")));
}

/// `sh docs/pictures/make.sh` draws them again, should the engine or how it draws change: look at each then.
#[test]
fn the_pictures_of_the_book_are_of_their_scenarios() {
    let script = std::fs::read_to_string(root().join("docs/pictures/make.sh")).expect("it is shipped");
    let listed = script.lines().skip_while(|line| !line.ends_with("<<END")).skip(1);
    let drawn: BTreeMap<&str, Vec<&str>> = listed
        .take_while(|line| *line != "END")
        .filter_map(|line| line.split_once(' '))
        .map(|(name, rest)| (name, rest.split(' ').collect()))
        .collect();
    let kept = files_below(root().join("docs/pictures"), "svg");
    let kept: Vec<_> = kept.iter().filter_map(|path| path.file_stem()?.to_str()).collect();
    assert_eq!(kept, drawn.keys().copied().collect::<Vec<_>>());
    let read = |path: &Path| std::fs::read_to_string(path).expect("it is a text");
    let pages: String = files_below(root().join("docs"), "md").iter().map(|page| read(page)).collect();
    for (name, rest) in drawn {
        let moments = rest[0];
        let scenario = rest.get(1).map_or(format!("docs/pictures/{name}.ava"), |path| (*path).to_owned());
        // Some claim who had priority.
        done(&["replay", &scenario]);
        let svg = done(&["render", &scenario, "--at", moments, "--out", "-"]);
        let kept = read(&root().join(format!("docs/pictures/{name}.svg")));
        assert!(svg.trim_end() == kept.trim_end(), "{name}.svg is not as drawn: sh docs/pictures/make.sh");
        let document = roxmltree::Document::parse(&kept).expect("it is well-formed XML");
        let panels = document.descendants().filter(|node| node.has_tag_name("svg")).count() - 1;
        assert_eq!(panels, moments.split(',').count(), "{name}.svg");
        assert!(kept.len() <= 60_000, "{name}.svg has {} bytes", kept.len());
        assert!(pages.contains(&format!("(../pictures/{name}.svg)")), "{name}.svg is on no page");
    }
}

#[test]
fn a_shrunk_scenario_and_the_found_one_name_each_other() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let critical = scratch.path().join("critical");
    std::fs::create_dir(&critical).expect("it can be made");
    let space = root().join("scenarios/avastra45.ava");
    let source = SOURCE.replace("avastra45.ava", &space.display().to_string());
    let file = critical.join("walk.ava");
    std::fs::write(&file, source).expect("it can be written");
    let at = |path: &Path| path.display().to_string();
    done(&["shrink", &at(&file)]);
    done(&["report", &at(scratch.path())]);
    let html = std::fs::read_to_string(scratch.path().join("report.html")).expect("it was written");
    let index = index_of(&html);
    let scenarios = index["scenarios"].as_array().unwrap();
    let (shrunk, found): (Vec<_>, Vec<_>) =
        scenarios.iter().partition(|scenario| scenario["shrunk_from"].is_string());
    assert_eq!((shrunk.len(), found.len()), (1, 1));
    // The page links two where this is so.
    assert_eq!(shrunk[0]["shrunk_from"], found[0]["summary"]["name"]);
    assert_ne!(shrunk[0]["summary"]["name"], found[0]["summary"]["name"]);
}

/// The page of what `report` is told, in a scratch directory; its status, what it says on stderr, and the index.
fn reported(scratch: &Path, arguments: &[&str]) -> (i32, String, Value) {
    let page = scratch.join("page.html").display().to_string();
    let (status, _, stderr) =
        outcome(&mut avastra(&[&["report"], arguments, &["--out", &page, "--jobs", "1"]].concat()));
    let html = std::fs::read_to_string(&page).unwrap_or_default();
    (status, stderr, if html.is_empty() { Value::Null } else { index_of(&html) })
}

/// A scenario of a folder of its own, with more lines before its end.
fn written(folder: &Path, name: &str, claims: &str) -> String {
    std::fs::create_dir_all(folder).expect("it can be made");
    let space = root().join("scenarios/avastra45.ava");
    let source = SOURCE.replace("avastra45.ava", &space.display().to_string());
    let end = source.rfind('}').expect("a scenario ends");
    let file = folder.join(name);
    std::fs::write(&file, format!("{}{claims}}}\n", &source[..end])).expect("it can be written");
    file.display().to_string()
}

#[test]
fn a_refuted_scenario_is_said_so_of_and_fails_the_command() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let wrong = written(scratch.path(), "wrong.ava", "  expect collision at 3 s\n");
    let right = written(scratch.path(), "right.ava", "  expect collision with npc#1\n");
    // Named twice, it is there once.
    let (status, stderr, index) = reported(scratch.path(), &[&wrong, &right, &right]);
    assert_eq!(status, 3, "{stderr}");
    assert!(stderr.contains("wrong.ava does not play as it claims"), "{stderr}");
    assert!(!stderr.contains("right.ava does"), "{stderr}");
    let scenarios = index["scenarios"].as_array().expect("they are listed");
    assert_eq!(scenarios.len(), 2);
    for scenario in scenarios {
        let is_wrong = scenario["file"].as_str().is_some_and(|file| file.ends_with("wrong.ava"));
        assert_eq!(scenario["summary"]["refuted"].as_array().map(Vec::len), Some(usize::from(is_wrong)));
    }
}

#[test]
fn a_run_without_its_database_is_said_so_of() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    written(&scratch.path().join("critical"), "walk.ava", "");
    std::fs::write(scratch.path().join("run.yaml"), "seed: 1\n").expect("it can be written");
    let (status, stderr, index) = reported(scratch.path(), &[&scratch.path().display().to_string()]);
    assert!(status == 0 && stderr.contains("run.db` is missing: only scenarios are shown"), "{stderr}");
    assert_eq!(index["scenarios"].as_array().map(Vec::len), Some(1));
    // An empty one is no better, and stays empty.
    let (database, settings) = (scratch.path().join("run.db"), scratch.path().join("run.yaml"));
    std::fs::write(&database, "").expect("it can be written");
    let (status, stderr, _) = reported(scratch.path(), &[&scratch.path().display().to_string()]);
    assert!(status == 0 && stderr.contains("run.db` is empty: only scenarios are shown"), "{stderr}");
    assert_eq!(std::fs::metadata(&database).expect("it is there").len(), 0);
    // Nor is a database without the settings that it was begun with.
    std::fs::remove_file(&settings).expect("it is there");
    let (status, stderr, _) = reported(scratch.path(), &[&scratch.path().display().to_string()]);
    assert!(status == 0 && stderr.contains("run.yaml` is missing: only scenarios are shown"), "{stderr}");
    std::fs::create_dir(&settings).expect("it can be made");
    let (status, stderr, _) = reported(scratch.path(), &[&scratch.path().display().to_string()]);
    assert!(status == 0 && stderr.contains("run.yaml` is no file: only scenarios are shown"), "{stderr}");
}

#[test]
fn a_comparison_says_what_becomes_of_each_crash() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = written(scratch.path(), "walk.ava", "");
    let change = |other: &str| {
        let (status, stderr, index) = reported(scratch.path(), &[&file, "--ads", other]);
        assert_eq!(status, 0, "{stderr}");
        index["scenarios"][0]["change"]["kind"].as_str().expect("it is compared").to_owned()
    };
    let itself = root().join("scenarios/ads/faults/planning_never_yields.yaml");
    assert_eq!(change(&itself.display().to_string()), "same");
    assert_eq!(change("cc"), "gone");
}

#[test]
fn scenarios_of_one_name_are_told_apart_by_their_folders() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let [first, second] =
        ["a", "b"].map(|folder| written(&scratch.path().join(folder).join("critical"), "walk.ava", ""));
    let (status, stderr, index) = reported(scratch.path(), &[&first, &second]);
    assert_eq!(status, 0, "{stderr}");
    let mut names: Vec<&str> = index["scenarios"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|scenario| scenario["file"].as_str())
        .collect();
    names.sort_unstable();
    assert_eq!(names, ["a/critical/walk.ava", "b/critical/walk.ava"]);
}

#[test]
fn a_folder_among_others_and_a_space_are_refused_with_a_hint() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let file = written(scratch.path(), "walk.ava", "");
    let folder = scratch.path().display().to_string();
    let (status, stderr, _) = reported(scratch.path(), &[&folder, &file]);
    assert_eq!((status, stderr.contains("name it alone")), (1, true), "{stderr}");
    let (status, stderr, _) = reported(scratch.path(), &["scenarios/avastra45.ava"]);
    assert_eq!((status, stderr.contains("it is a space, and `avastra run")), (1, true), "{stderr}");
}

#[test]
fn trainings_and_estimates_have_pages_with_their_results() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let short = ["--road", "corner", "--seed", "5"];
    let (train, estimate) = (at("train"), at("estimate"));
    let space = "scenarios/avastra45.ava";
    let training =
        ["train", space, "--agent", "constant", "--episodes", "6", "--out", &train, "--format", "json"];
    let stdout = done(&[&training[..], &short].concat());
    let printed = last_line(&stdout);
    // The page is made of what the database holds, whatever the file for others says.
    std::fs::write(scratch.path().join("train/results.json"), "{}").expect("it is writable");
    let (status, stderr, index) = reported(scratch.path(), &[&train]);
    assert_eq!(status, 0, "{stderr}");
    let overview = &index["overview"];
    assert_eq!(overview["kind"], "training");
    // The page is about the training and its evaluation.
    let hours = |of: &Value| of["simulated_h"].as_f64().expect("a number");
    let both_h = hours(&printed) + hours(&printed["evaluation"]);
    assert!((hours(overview) - both_h).abs() < 1e-9, "{both_h}");
    assert_eq!(overview["evaluation"], printed["evaluation"]);
    assert_eq!(overview["conditions"][1], serde_json::json!(["Driving system", "modular"]));

    let estimating = ["estimate", space, "--parts", "2", "--episodes", "2", "--out", &estimate];
    done(&[&estimating[..], &short].concat());
    let (status, stderr, index) = reported(scratch.path(), &[&estimate]);
    assert_eq!(status, 0, "{stderr}");
    assert_eq!(index["overview"]["kind"], "estimate");
    assert_eq!(index["overview"]["estimate"]["roads"][0]["road"], "corner");
}
