//! What the clock, the sky, the odds and the lanes do: wishes whose effect is seen in the world.

use std::collections::BTreeMap;
use std::sync::Arc;

use avastra::action::{ActionTable, RowOdds, Situation};
use avastra::episode::{Choice, Moment};
use avastra::model::vocabulary::{Body, Level, TimeOfDay};
use avastra::model::{Memory, RulesInForce};
use avastra::sim::{Scene, Sensed, Start, World};

use crate::command::done;
use crate::wishes::{row, wish};
use crate::world::{Wide, assert_replays, run_of, space_at};

/// The odds of all rows in a state, on the first road.
fn shares(odds: Vec<RowOdds>) -> Vec<f64> {
    let share = |odds: RowOdds| match odds {
        RowOdds::Share(share) => share,
        RowOdds::Chance { .. } => panic!("a rate"),
    };
    odds.into_iter().map(share).collect()
}

fn odds_of(table: &ActionTable, memory: &Memory) -> Vec<f64> {
    let rules = RulesInForce::new(table.space(), &[], &[]).expect("no rule is named");
    let surroundings = &Wide { safety_gap_m: 0.0 };
    let road = &table.space().roads[0];
    let situation =
        Situation { memory, road, rules: &rules, surroundings, seed: 1, step: 0, happened_s: &[] };
    shares(table.odds(&situation))
}

#[test]
fn in_most_steps_nothing_happens() {
    let table = wish("rare_pedestrians");
    let odds = |action: &str| {
        let rows = table.rows().iter().zip(odds_of(&table, &table.space().initial_memory(1)));
        let of_action = rows.filter(|(row, _)| row.label.split('(').next() == Some(action));
        of_action.map(|(_, odds)| odds).collect::<Vec<_>>()
    };
    assert_eq!(odds("nothing"), [1000.0]);
    assert_eq!(odds("pedestrian"), [5.0; 2]);
    assert_eq!(odds("cross_road"), [20.0; 8]);
    assert_eq!(odds("fog"), [1.0; 3], "what is not named is `_`");
}

#[test]
fn without_odds_each_action_is_as_likely_and_weather_and_time_come_seldom() {
    let table = ActionTable::new(space_at("scenarios/avastra45.ava"));
    let mut of_actions: BTreeMap<&str, f64> = BTreeMap::new();
    for (row, odds) in table.rows().iter().zip(odds_of(&table, &table.space().initial_memory(1))) {
        let name = &table.space().actions[row.action].name;
        *of_actions.entry(name.as_str()).or_default() += odds;
    }
    let settings = ["clear_sky", "rain", "fog", "wet", "set_time"];
    let setting: f64 = settings.iter().map(|name| of_actions.remove(name).expect("it is there")).sum();
    assert!((setting - 0.15).abs() < 1e-12, "{setting}");
    let each = 0.85 / of_actions.len() as f64;
    assert!(of_actions.values().all(|odds| (odds - each).abs() < 1e-12), "{of_actions:?}");
}

#[test]
fn more_cars_come_in_the_rush_hour() {
    let table = wish("rush_hour");
    let (car, hour) = (row(&table, "car()"), table.space().state("hour").expect("it is declared").first_cell);
    let run = run_of(table.space().clone(), 16, 5, &[]);
    // Steps with a free choice, and cars among them, in the first minute and in the second.
    let (mut steps, mut cars) = ([0; 2], [0; 2]);
    for episode in 0..run.episodes() {
        let mut random = (avastra::agent::by_name("random").map(|entry| match entry.kind {
            avastra::agent::Kind::Ready(build) => build(),
            _ => panic!("it learns nothing"),
        }))
        .expect("it is in the registry");
        let mut choose = |moment: &Moment| {
            let choice = avastra::run::choose(random.as_mut(), moment);
            let elapsed_s = moment.situation.surroundings.moment().elapsed_s;
            let is_rush = moment.situation.memory.cells()[hour].variant() == 1;
            // What a step does at its end is known to the next one.
            assert!(!is_rush || (60.0..=126.0).contains(&elapsed_s), "{elapsed_s} s");
            assert!(is_rush || !(66.1..=120.0).contains(&elapsed_s), "{elapsed_s} s");
            let odds = shares(table.odds(moment.situation));
            assert_eq!(odds, if is_rush { [100.0, 20.0, 5.0] } else { [100.0, 2.0, 1.0] });
            if table.offer(moment.situation, car).is_ok() {
                steps[usize::from(is_rush)] += 1;
                let is_car = matches!(&choice, Choice::Act(draw) if draw.row == car);
                cars[usize::from(is_rush)] += usize::from(is_car);
            }
            choice
        };
        let log = run.play(episode, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, episode, &log);
    }
    let share = |part: usize| f64::from(cars[part] as u32) / f64::from(steps[part] as u32);
    assert!(steps[0] > 50 && steps[1] > 20, "{steps:?}");
    assert!(share(1) > 2.0 * share(0), "{cars:?} of {steps:?}");
}

#[test]
fn own_states_are_in_the_database() {
    let directory = tempfile::tempdir().expect("a directory is made");
    let out = directory.path().join("run");
    let space = "tests/cases/wishes/rush_hour.ava";
    done(&[
        "run",
        space,
        "--road",
        "corner",
        "--ads",
        "idm",
        "--episodes",
        "2",
        "--out",
        &out.display().to_string(),
    ]);
    let database = rusqlite::Connection::open(out.join("run.db")).expect("it is a database");
    let mut steps = database.prepare("SELECT time_s, states FROM step").expect("the columns are there");
    let steps = steps.query_map([], |row| Ok((row.get::<_, f64>(0)?, row.get::<_, String>(1)?)));
    let mut seen = 0;
    for step in steps.expect("they are read") {
        let (at_s, states) = step.expect("it is read");
        let is_rush = (60.0..=120.0).contains(&at_s);
        let wanted = if is_rush { r#"{"hour":"Rush"}"# } else { r#"{"hour":"Quiet"}"# };
        assert_eq!(states, wanted, "at {at_s} s");
        seen += 1;
    }
    assert!(seen > 5, "{seen} steps");
}

#[test]
fn dusk_becomes_night_within_two_steps_and_one_car_has_no_lights() {
    let table = wish("dusk_then_dark");
    let rows = [row(&table, "car()"), row(&table, "dark_car()")];
    let run = run_of(table.space().clone(), 8, 5, &[]);
    let mut seen = 0;
    for episode in 0..run.episodes() {
        let wanted = rows[episode % 2];
        let mut choose = |moment: &Moment| match table.offer(moment.situation, wanted) {
            Ok(draw) if moment.step == 2 => Choice::Act(draw),
            _ => Choice::Pass,
        };
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            let is_dark = world.time_s() > 12.0;
            let time = if is_dark { TimeOfDay::Night } else { TimeOfDay::Dusk };
            assert_eq!(world.time_of_day(), time, "{} s", world.time_s());
            let light = world.conditions().light;
            assert!(if is_dark { light < 0.2 } else { light < 0.8 && light > 0.2 }, "{light}");
            let Sensed { objects, .. } = world.sensed();
            seen += objects.len();
            assert!(objects.iter().all(|object| object.is_unlit == (wanted == rows[1])));
        });
        assert_replays(&run, episode, &log);
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn fog_begins_in_the_middle_of_the_route() {
    let table = wish("fog_on_the_second_half");
    let run = run_of(table.space().clone(), 8, 5, &[]);
    let (mut clear, mut foggy) = (0, 0);
    for episode in 0..run.episodes() {
        let mut is_second_half = false;
        let mut choose = |moment: &Moment| {
            let facts = moment.situation.surroundings.moment();
            is_second_half = facts.ego_rear_m > facts.ego_route_left_m;
            let offer = table.offer(moment.situation, 0);
            if moment.step.is_multiple_of(4) { offer.map_or(Choice::Pass, Choice::Act) } else { Choice::Pass }
        };
        let mut found = Vec::new();
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            let facts = world.moment_facts();
            found.push((facts.ego_rear_m > facts.ego_route_left_m, world.sky()[1]));
        });
        assert_replays(&run, episode, &log);
        // Fog comes with the step that begins there, so at most a second later.
        for pair in found.windows(51) {
            let [(before, _), .., (after, fog)] = pair else { panic!("a window is not empty") };
            if before == after {
                assert_eq!(*fog, if *after { Level::High } else { Level::None });
                *(if *after { &mut foggy } else { &mut clear }) += 1;
            }
        }
    }
    assert!(clear > 1000 && foggy > 1000, "{clear} {foggy}");
}

#[test]
fn a_child_runs_out_from_behind_a_van_only_above_20_kmph() {
    let table = wish("child_behind_a_van");
    let run = run_of(table.space().clone(), 8, 5, &[]);
    let (mut came, mut refused) = (0, 0);
    for episode in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let is_fast = moment.situation.surroundings.moment().ego_speed_mps > 20.0 / 3.6;
            let legal = (0..2).find_map(|row| table.offer(moment.situation, row).ok());
            assert!(is_fast || legal.is_none());
            refused += usize::from(!is_fast);
            came += usize::from(legal.is_some());
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let log = run.play(episode, &mut choose, &mut |world, _, _| {
            for child in world.obstacles().filter(|one| one.body == Body::Pedestrian) {
                let van = world.obstacle(child.id + 1).expect("they appear together and leave one by one");
                assert_eq!((van.body, van.velocity_mps.norm(), child.height_m), (Body::BoxTruck, 0.0, 1.1));
            }
        });
        assert_replays(&run, episode, &log);
    }
    assert!(came > 3 && refused > 3, "{came} {refused}");
}

#[test]
fn only_buses_and_one_who_breaks_the_rule_are_in_the_bus_lane() {
    let table = wish("bus_lane");
    let space = table.space();
    let (bus, pushy) = (row(&table, "bus()"), row(&table, "pushy_car()"));
    let (road, rules) = (&space.roads[0], RulesInForce::by_default(space));
    let scene = Arc::new(Scene::of(road));
    let memory = space.initial_memory(1);
    // The bus lane is the third of three, each 3.5 m wide; the route is the middle of the second.
    let is_in_bus_lane = |offset_m: f64| offset_m < -1.75;
    let (mut others, mut came) = (0, [0; 2]);
    for seed in 0..12 {
        let start = Start { ambient: 20, ..Start::drawn(space, road, &memory, seed) };
        let mut world = World::new(Arc::clone(&scene), &start);
        let situation = Situation {
            memory: &memory,
            road,
            rules: &rules,
            surroundings: &world,
            seed,
            step: 0,
            happened_s: &[],
        };
        let wanted = if seed % 2 == 0 { bus } else { pushy };
        if let Ok(draw) = table.offer(&situation, wanted)
            && world.carry_out(&draw).is_ok()
        {
            came[usize::from(wanted == pushy)] += 1;
        }
        let mut driver = (avastra::ads::by_name("idm").expect("it is one of ours").build)(&scene, seed);
        while world.time_s() < 40.0 && !world.arrived() {
            let control = driver.drive(&world.sensed());
            world.tick(&control);
            for other in world.obstacles().filter(|other| other.is_ambient()) {
                let facts = world.npc_facts(other.id).expect("it is there");
                assert!(other.body == Body::SchoolBus || !is_in_bus_lane(facts.offset_m), "{other:?}");
                others += 1;
            }
            if let Some(facts) = world.npc_facts(1) {
                assert!(is_in_bus_lane(facts.offset_m), "{facts:?}");
            }
        }
    }
    assert!(others > 1000 && came.iter().all(|count| *count > 3), "{others} {came:?}");
}
