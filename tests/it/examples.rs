//! The shipped examples: each is short, works when copied, and draws what it says.

use avastra::action::{ActionTable, Draw, Effect, SpawnRequest};
use avastra::check::state_argument::memory_from;
use avastra::episode::{Choice, EpisodeLog, Moment, Outcome, StepLog};
use avastra::model::vocabulary::{Body, Level, Side, TimeOfDay};
use avastra::syntax::ast::FileId;
use avastra::syntax::{Diagnostic, format};

use crate::cases::{expect_snapshot, files, root, stem};
use crate::command::{avastra, outcome};
use crate::wishes::{draws, row};
use crate::world::{assert_replays, read, run_of, space_at};

/// Lines of an example beyond those that any file begins with.
const LINES_MAX: usize = 24;

pub fn example(name: &str) -> ActionTable {
    ActionTable::new(space_at(&format!("scenarios/examples/{name}.ava")))
}

fn names() -> Vec<String> {
    files(root().join("scenarios/examples"), "ava").iter().map(|path| stem(path)).collect()
}

fn spawns(draw: &Draw) -> impl Iterator<Item = &SpawnRequest> {
    draw.effects.iter().filter_map(|effect| match effect {
        Effect::Spawn(request) => Some(request),
        Effect::Time(_) | Effect::Sky(..) | Effect::Light(_) | Effect::Order(_) => None,
    })
}

#[test]
fn examples_are_short_and_without_mistakes() {
    for name in names() {
        let path = root().join(format!("scenarios/examples/{name}.ava"));
        let text = read(&path).expect("an example is readable");
        assert!(text.starts_with("//! "), "{name}");
        assert_eq!(format(FileId(0), &text).expect("it parses"), text, "{name}");
        let beyond = text.split_once("\nuse ").expect("it uses a space").1.lines().skip(1);
        let lines = beyond.filter(|line| !line.is_empty()).count();
        assert!(lines <= LINES_MAX, "{name} has {lines} lines");
        let loaded = avastra::check::load(&path, &read).expect("an example is readable");
        let messages = |all: &[Diagnostic]| all.iter().map(|found| found.message.clone()).collect::<Vec<_>>();
        assert!(loaded.diagnostics.is_empty(), "{name}: {:?}", messages(&loaded.diagnostics));
    }
}

#[test]
fn examples_work_wherever_they_are_written() {
    for name in names() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let target = folder.path().join("mine");
        let (status, _, stderr) = outcome(avastra(&["new", "--template", &name]).arg(&target));
        assert_eq!(status, 0, "{name}: {stderr}");
        let written = target.join(format!("{name}.ava"));
        let (status, stdout, stderr) = outcome(avastra(&["check", "--strict"]).arg(written));
        assert_eq!(status, 0, "{name}: {stdout}{stderr}");
    }
}

#[test]
fn routes_are_proposed_on_any_map() {
    for map in ["boulevard", "corner", "crossroad", "residential"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let target = folder.path().join("mine");
        let file = format!("scenarios/roads/{map}.xodr");
        let (status, _, stderr) = outcome(avastra(&["new", "--map", &file]).arg(&target));
        assert_eq!(status, 0, "{map}: {stderr}");
        let (status, stdout, stderr) = outcome(avastra(&["check"]).arg(target.join("space.ava")));
        assert_eq!(status, 0, "{map}: {stdout}{stderr}");
        let roads = std::fs::read_to_string(target.join("roads.ava")).expect("it was written");
        assert_eq!(format(FileId(0), &roads).expect("it parses"), roads, "{map}");
        expect_snapshot("proposals", map, &roads);
    }
}

#[test]
fn night_and_fog_are_there_from_the_first_moment() {
    let table = example("night_and_fog");
    let memory = table.space().initial_memory(3);
    assert_eq!(
        table.space().weather(&memory),
        (TimeOfDay::Night, [Level::None, Level::Moderate, Level::None])
    );
    let fog = row(&table, "fog(how: High)");
    for draw in draws(&table, fog, 0, &memory, 5) {
        let (time, [_, fog, _]) = table.space().weather(&draw.memory_after);
        assert_eq!((time, fog), (TimeOfDay::Night, Level::High));
    }
    assert!(!table.rows().iter().any(|row| row.label.starts_with("set_time") || row.label == "clear_sky()"));
}

#[test]
fn nobody_comes_from_the_left_on_the_corner() {
    let table = example("from_the_right");
    let roads = table.space().roads.iter().map(|road| road.name.as_str());
    let memory = table.space().initial_memory(0);
    for (road, name) in roads.enumerate() {
        let left = draws(&table, row(&table, "pedestrian(from: Left)"), road, &memory, 20);
        assert_eq!(left.is_empty(), name == "corner", "{name}");
        let right = draws(&table, row(&table, "pedestrian(from: Right)"), road, &memory, 20);
        assert!(!right.is_empty() && right.iter().flat_map(spawns).all(|walks| walks.side == Side::Right));
    }
}

#[test]
fn motorcycles_and_scooters_ride_among_the_cars() {
    let table = example("motorcycle");
    let memory = table.space().initial_memory(0);
    let ahead = row(&table, "drive_ahead(lane: Current, mode: Far, then: Keep)");
    let drawn = draws(&table, ahead, 0, &memory, 400);
    let two_wheeled: Vec<&SpawnRequest> =
        drawn.iter().flat_map(spawns).filter(|spawn| spawn.body == Body::Motorcycle).collect();
    // Six kinds of vehicle have odds of one, two have odds of three.
    assert!((160..240).contains(&two_wheeled.len()), "{} of {}", two_wheeled.len(), drawn.len());
    let scooters: Vec<_> = two_wheeled.iter().filter_map(|spawn| spawn.own.map(|own| own.shape)).collect();
    assert!((70..130).contains(&scooters.len()), "{}", scooters.len());
    for scooter in scooters {
        let figures = [scooter.length_m, scooter.width_m, scooter.height_m, scooter.mass_t];
        assert_eq!(figures, [1.8, 0.7, 1.5, 0.17]);
    }
}

/// Random episodes of the rows whose labels begin so, in every fourth step of which nothing is done. Each is replayed to
/// the same log.
fn played(name: &str, rows: &str, episodes: usize) -> Vec<EpisodeLog> {
    let space = space_at(&format!("scenarios/examples/{name}.ava"));
    let run = run_of(space, episodes as u32, 7, &[]);
    let play = |number: usize| {
        let mut choose = |moment: &Moment<'_>| {
            let mut rng = avastra::rng::stream(number as u64, avastra::rng::Stream::Draw, moment.step as u64);
            let legal = run.table().offers(moment.situation).into_iter().filter_map(Result::ok);
            let is_played = |draw: &Draw| run.table().rows()[draw.row].label.starts_with(rows);
            let mut legal: Vec<Draw> = legal.filter(is_played).collect();
            match legal.is_empty() || avastra::rng::below(&mut rng, 4) == 0 {
                true => Choice::Pass,
                false => {
                    Choice::Act(legal.swap_remove(avastra::rng::below(&mut rng, legal.len() as u32) as usize))
                }
            }
        };
        let log = run.play(number, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, number, &log);
        log
    };
    (0..episodes).map(play).collect()
}

#[test]
fn rain_rises_one_level_a_time_and_dries() {
    let table = example("slow_rain");
    let space = table.space();
    let (mut rises, mut dries) = (0, 0);
    for log in played("slow_rain", "shower", 6) {
        let mut before = log.memory.clone();
        for step in &log.steps {
            let after = step.memory.clone();
            let levels = |memory| space.weather(memory).1.map(|level| level as i32);
            let ([rain, _, wet], [rain_now, _, wet_now]) = (levels(&before), levels(&after));
            assert!((rain_now - rain).abs() <= 1, "{rain} to {rain_now}");
            assert_eq!(wet_now, rain_now.max(wet - 1));
            rises += i32::from(rain_now > rain);
            dries += i32::from(wet_now < wet);
            before = after;
        }
    }
    assert!(rises > 5 && dries > 5, "{rises} {dries}");
}

#[test]
fn two_vehicles_at_most_and_never_in_a_row() {
    let table = example("two_vehicles");
    let vehicles = table.space().groups.iter().find(|group| group.name == "vehicles").expect("it is used");
    let mut counts = [0; 3];
    for log in played("two_vehicles", "", 8) {
        let is_vehicle = |step: &StepLog| match &step.outcome {
            Outcome::Done { draw, .. } => vehicles.actions.contains(&table.rows()[draw.row].action),
            Outcome::Passed | Outcome::Refused { .. } => false,
        };
        let steps: Vec<bool> = log.steps.iter().map(is_vehicle).collect();
        assert!(!steps.windows(2).any(|pair| pair == [true, true]), "{steps:?}");
        counts[steps.iter().filter(|is_vehicle| **is_vehicle).count()] += 1;
    }
    assert!(counts[2] > 0, "{counts:?}");
}

#[test]
fn wet_trucks_keep_twice_the_distance() {
    let table = example("wet_trucks");
    let row = row(&table, "drive_ahead(lane: Current, mode: Near, then: Keep)");
    for (sky, times) in [("None", 1.0), ("{ Wetness: Light, Rain: None, Fog: None }", 2.0)] {
        let memory =
            memory_from(table.space(), &format!("time: Noon, sky: {sky}"), 1).expect("it is a state");
        let drawn = draws(&table, row, 0, &memory, 40);
        let mut trucks = 0;
        for request in drawn.iter().flat_map(spawns) {
            let large = matches!(request.body, Body::BoxTruck | Body::SchoolBus);
            trucks += usize::from(large);
            let (base_m, times) = if large { (15.0, times) } else { (12.0, 1.0) };
            let wanted_m = times * (base_m + request.speed_mps * 0.5);
            assert!((request.distance_m - wanted_m).abs() < 1e-6, "{request:?}, not {wanted_m} m");
        }
        assert!(trucks > 0 && trucks < drawn.len(), "{trucks} of {}", drawn.len());
    }
}

#[test]
fn the_road_of_ones_own_is_driven_on_the_left() {
    let table = example("own_road");
    let road = &table.space().roads[0];
    assert_eq!(road.facts.limit_mps, 13.4112);
    assert!(road.route.path.length_m() > 300.0);
    let logs = played("own_road", "", 2);
    assert!(logs.iter().any(|log| log.distance_m > 200.0), "it drives");
}

#[test]
fn the_table_of_deepqtest_has_142_rows_and_all_are_drawn() {
    let table = example("deepqtest142");
    // Each time of day comes up: the clock may not jump to every other.
    let memories: Vec<_> = (0..20).map(|seed| table.space().initial_memory(seed)).collect();
    let roads = 0..table.space().roads.len();
    let is_drawn = |row: &usize| {
        let mut places = roads.clone().flat_map(|road| memories.iter().map(move |memory| (road, memory)));
        places.any(|(road, memory)| !draws(&table, *row, road, memory, 1).is_empty())
    };
    assert_eq!(table.rows().len(), 142);
    let never: Vec<&str> =
        (0..142).filter(|row| !is_drawn(row)).map(|row| table.rows()[row].label.as_str()).collect();
    assert!(never.is_empty(), "{never:?}");
}
