//! Files as a newcomer writes them, each with a wish. A test for each shows that the wish came true.

use std::cell::Cell;
use std::collections::BTreeSet;

use avastra::action::{ActionTable, Draw, Effect, Situation};
use avastra::check::state_argument::memory_from;
use avastra::emit::{Provenance, unclaimed};
use avastra::episode::{Choice, Moment, Outcome, Script};
use avastra::model::vocabulary::{Level, Light, TimeOfDay, Word};
use avastra::model::{End, Memory, OutcomeFacts, Reach, RulesInForce, Value};
use avastra::run::Run;
use avastra::sim::DT_S;
use avastra::syntax::ast::FileId;
use avastra::syntax::{Diagnostic, format, print};

use crate::cases::{cases, each_case, root, stem};
use crate::command::{avastra, done, outcome};
use crate::examples::example;
use crate::world::{Wide, assert_replays, read, run_against, run_of, space_at};

pub fn wish(name: &str) -> ActionTable {
    ActionTable::new(space_at(&format!("tests/cases/wishes/{name}.ava")))
}

pub fn row(table: &ActionTable, label: &str) -> usize {
    let mut rows = table.rows().iter();
    rows.position(|row| row.label == label).unwrap_or_else(|| panic!("no row `{label}`"))
}

/// The legal draws of a row on a road, one for each of this many seeds at most.
pub fn draws(table: &ActionTable, row: usize, road: usize, memory: &Memory, seeds: u64) -> Vec<Draw> {
    let rules = RulesInForce::new(table.space(), &[], &[]).expect("no rule is named");
    let road = &table.space().roads[road];
    let offer = |seed| {
        let situation = Situation {
            memory,
            road,
            rules: &rules,
            surroundings: &Wide { safety_gap_m: 0.0 },
            seed,
            step: 0,
            happened_s: &[],
        };
        table.offer(&situation, row).ok()
    };
    (0..seeds).filter_map(offer).collect()
}

pub fn number(draw: &Draw, name: &str) -> f64 {
    drawn(draw, name).number()
}

fn drawn(draw: &Draw, name: &str) -> Value {
    let found = draw.values.iter().find(|(known, _)| &**known == name);
    found.unwrap_or_else(|| panic!("no value `{name}`")).1
}

/// The least and the greatest value that a row still draws on a road.
fn left(table: &ActionTable, row: usize, road: usize, name: &str) -> (f64, f64) {
    let Reach::Open(ranges) = &table.rows()[row].roads[road] else { panic!("row {row} is masked") };
    let (_, range) = ranges.iter().find(|(known, _)| &**known == name).expect("it is a drawn number");
    let end = |end: End| match end {
        End::At(value, _) => value.to_f64(),
        End::Unbounded => f64::INFINITY,
    };
    (end(range.low), end(range.high))
}

#[test]
fn wishes_compile_as_they_are_written() {
    let wishes = cases("wishes");
    assert!(wishes.len() > 10);
    for (stem, path) in wishes {
        let text = read(&path).expect("a case is readable");
        assert!(text.starts_with("//! Wish: "), "{stem}");
        assert_eq!(format(FileId(0), &text).expect("it parses"), text, "{stem}");
        let loaded = avastra::check::load(&path, &read).expect("a case is readable");
        let messages = |all: &[Diagnostic]| all.iter().map(|found| found.message.clone()).collect::<Vec<_>>();
        assert!(loaded.diagnostics.is_empty(), "{stem}: {:?}", messages(&loaded.diagnostics));
    }
}

/// For how long a wish is shown from its first row on, s, and how often, s.
const SHOWN_S: f64 = 36.0;
const EVERY_S: f64 = 2.0;

/// A space with more rows is another one's, and its wish is about what is drawn.
const ROWS_SHOWN: usize = 8;

/// Each wish with what comes of it: its rows, each as soon as it is legal, and where everybody is as each step ends.
#[test]
fn wishes_happen_as_is_written_down() {
    each_case("wishes", |path| {
        let table = wish(&stem(path));
        let rows = table.rows().len();
        if rows > ROWS_SHOWN {
            return format!("{rows} rows, not played: the wish is about what is drawn of them\n");
        }
        let run = run_against("idm", table.space().clone(), 2, 8, &[]);
        let played = (0..run.episodes()).map(|episode| shown(&run, episode)).max_by_key(|(acts, _)| *acts);
        let (acts, text) = played.expect("there is a road");
        assert!(acts > 0, "no row is legal on any road");
        text
    });
}

/// How many rows were carried out in an episode, the scenario that it is, and where everybody was as each step ended.
fn shown(run: &Run, episode: usize) -> (usize, String) {
    let (table, space) = (run.table(), run.table().space());
    let mut open: Vec<usize> = (0..table.rows().len()).collect();
    let since_s = Cell::new(None);
    let mut choose = |moment: &Moment| {
        let now_s = moment.ticks() as f64 * DT_S;
        if since_s.get().is_some_and(|since_s: f64| now_s - since_s >= SHOWN_S) {
            return Choice::Stop;
        }
        let legal = |row: &usize| table.offer(moment.situation, *row).ok();
        let Some((nth, draw)) = open.iter().enumerate().find_map(|(nth, row)| Some((nth, legal(row)?)))
        else {
            return Choice::Pass;
        };
        since_s.set(since_s.get().or(Some(now_s)));
        open.remove(nth);
        Choice::Act(draw)
    };
    let mut places = String::new();
    let ticks = (EVERY_S / DT_S).round() as u64;
    let log = run.play(episode, &mut choose, &mut |world, _, _| {
        if since_s.get().is_none() || !world.ticks().is_multiple_of(ticks) {
            return;
        }
        let moment = world.moment_facts();
        let (time_s, front_m, mps) = (world.time_s(), moment.ego_front_m, moment.ego_speed_mps);
        places += &format!("{time_s:>5.1} s  ego front {front_m:.1} m, {mps:.2} m/s\n");
        for obstacle in world.obstacles() {
            let bearer = (0..space.bearers.len()).find(|who| world.bearer_id(*who) == Some(obstacle.id));
            let name = bearer.map_or(obstacle.body.name(), |who| &space.bearers[who]);
            let npc = world.npc_facts(obstacle.id).expect("it is there");
            let (rear_m, front_m, left_m, mps) = (npc.rear_m, npc.front_m, npc.offset_m, npc.speed_mps);
            places +=
                &format!("         {name} {rear_m:.1} to {front_m:.1} m, {left_m:.2} m left, {mps:.2} m/s\n");
        }
    });
    assert_replays(run, episode, &log);
    let acts = log.steps.iter().filter(|step| matches!(step.outcome, Outcome::Done { .. })).count();
    let space_path = "wish.ava";
    let source = Provenance {
        command: "test",
        name: "wish",
        space_path,
        episode: 0,
        agent: "none",
        without: &[],
        with: &[],
    };
    let text = print(&unclaimed(table, &log, "As it happens.", &source));
    // Where the scenario comes from changes with every word of its space.
    let [from, to] = ["  road: ", "\n}\n"].map(|mark| text.find(mark).expect("it has a road and an end"));
    let acted: Vec<&str> = text[from..to].lines().filter(|line| !line.ends_with(": wait()")).collect();
    (acts, format!("{}\n\n{places}", acted.join("\n")))
}

/// What every step does to a state comes before the judgement of a draw, though the row itself sets nothing.
#[test]
fn every_second_step_is_slow() {
    let table = wish("slow_every_second_step");
    let space = table.space();
    let (cold, rules) = (space.initial_memory(0), RulesInForce::by_default(space));
    let hot = space.memory_after_wait(&cold, 1, Some(&space.roads[0].facts), None, &rules);
    let speeds = |memory: &Memory| -> Vec<f64> {
        draws(&table, 0, 0, memory, 40).iter().map(|draw| number(draw, "speed")).collect()
    };
    let (slow, free) = (speeds(&cold), speeds(&hot));
    assert!(slow.len() == 40 && slow.iter().all(|speed| *speed <= 4.0), "{slow:?}");
    assert!(free.len() == 40 && free.iter().any(|speed| *speed > 8.0), "{free:?}");
}

#[test]
fn it_is_always_night() {
    let table = wish("night_only");
    assert_eq!(table.rows().len(), 42);
    assert!(table.rows().iter().all(|row| !row.label.starts_with("set_time")));
    assert!(table.space().rules.iter().all(|rule| rule.name != "chronology"), "it has nothing to bind");
    for seed in 0..20 {
        let memory = table.space().initial_memory(seed);
        assert_eq!(table.space().weather(&memory).0, TimeOfDay::Night);
    }
}

#[test]
fn only_the_crossroad_has_no_pedestrians() {
    let table = wish("no_pedestrians_on_one_road");
    for row in table.rows().iter().filter(|row| row.label.starts_with("pedestrian")) {
        for (road, reach) in table.space().roads.iter().zip(&row.roads) {
            let masked = matches!(reach, Reach::Dead { .. });
            assert_eq!(masked, road.name == "crossroad", "{} on {}", row.label, road.name);
        }
        let memory = table.space().initial_memory(1);
        for (road, there) in table.space().roads.iter().enumerate() {
            let walked = !draws(&table, row.index, road, &memory, 20).is_empty();
            assert_eq!(walked, there.name != "crossroad");
        }
    }
}

#[test]
fn trucks_are_twice_as_likely() {
    let count = |table: &ActionTable| {
        let row = row(table, "drive_ahead(lane: Current, mode: Far, then: Keep)");
        let memory = table.space().initial_memory(1);
        let all = draws(table, row, 0, &memory, 1400);
        let is_truck = |draw: &&Draw| drawn(draw, "vehicle").variant() == 4;
        (all.len(), all.iter().filter(is_truck).count())
    };
    // Two bodies of seven are trucks instead of one of six; four standard deviations are 68 and 56.
    let (all, trucks) = count(&wish("more_trucks"));
    assert!(all == 1400 && trucks.abs_diff(400) < 68, "{trucks} of {all}");
    let (all, trucks) = count(&ActionTable::new(space_at("scenarios/avastra45.ava")));
    assert!(all == 1400 && trucks.abs_diff(233) < 56, "{trucks} of {all}");
}

#[test]
fn snow_is_seen_and_felt() {
    let table = wish("snow");
    let memory = table.space().initial_memory(1);
    let row = row(&table, "snow(how: Light)");
    let draw = &draws(&table, row, 0, &memory, 1)[0];
    assert_eq!(table.space().weather(&draw.memory_after).1, [Level::None, Level::Light, Level::High]);
}

#[test]
fn the_limit_of_the_school_binds_every_vehicle() {
    let table = wish("school_zone");
    let limit_mps = 30.0 / 3.6;
    let road = &table.space().roads[0];
    assert!(road.map.lanes.iter().all(|lane| lane.speed_limit_mps <= limit_mps), "the ADS reads it there");
    let row = row(&table, "drive_ahead(lane: Current, mode: Far, then: Keep)");
    let (low, high) = left(&table, row, 0, "speed");
    assert!(low == 5.0 && (high - limit_mps).abs() < 1e-12, "{low} .. {high}");
    let memory = table.space().initial_memory(1);
    let all = draws(&table, row, 0, &memory, 100);
    assert!(all.len() == 100 && all.iter().all(|draw| number(draw, "speed") <= limit_mps));
}

#[test]
fn there_is_a_third_distance() {
    let table = wish("third_distance");
    let row = row(&table, "drive_ahead(lane: Current, mode: Middle, then: Keep)");
    let (low, high) = left(&table, row, 0, "distance");
    // 30 m and the way driven in half a second; 3 m more for large vehicles.
    assert!(low >= 30.0 + 0.5 * 10.0 && high <= 33.0 + 0.5 * 20.0, "{low} .. {high}");
}

#[test]
fn the_formula_is_the_authors_own() {
    let table = wish("own_formula");
    let memory = table.space().initial_memory(1);
    for (mode, base_m) in [("Near", 12.0), ("Far", 50.0)] {
        let row = row(&table, &format!("drive_opposite(mode: {mode}, then: Keep)"));
        let all = draws(&table, row, 3, &memory, 50);
        assert!(!all.is_empty());
        for draw in all {
            let extra_m = if drawn(&draw, "vehicle").variant() >= 4 { 3.0 } else { 0.0 };
            let wanted_m = 2.0 * base_m + extra_m + number(&draw, "speed");
            assert!((number(&draw, "distance") - wanted_m).abs() < 1e-9);
        }
    }
}

#[test]
fn every_vehicle_is_slower_in_the_rain() {
    let table = wish("slower_in_rain");
    let row = row(&table, "cross_road(side: Left, mode: Far, then: Keep)");
    let fastest_mps = |rain: &str| {
        let memory = memory_from(table.space(), &format!("time: Noon, sky: {{ Rain: {rain} }}"), 1);
        let all = draws(&table, row, 3, &memory.expect("the states are there"), 100);
        assert_eq!(all.len(), 100);
        all.iter().map(|draw| number(draw, "speed")).fold(0.0, f64::max)
    };
    let limit_mps = 50.0 / 3.6;
    assert!(fastest_mps("None") > 0.9 * limit_mps && fastest_mps("Light") > 0.9 * limit_mps);
    assert!(fastest_mps("Moderate") <= 0.9 * limit_mps);
    assert!(fastest_mps("High") <= limit_mps - 5.0 / 3.6);
}

#[test]
fn pedestrians_come_only_while_the_ego_vehicle_drives() {
    let table = wish("only_while_driving");
    let rows = ["pedestrian(from: Left)", "pedestrian(from: Right)"].map(|label| row(&table, label));
    let run = run_of(table.space().clone(), 1, 2, &[]);
    let (mut slow, mut walked) = (0, 0);
    for number in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let speed_mps = moment.situation.surroundings.moment().ego_speed_mps;
            let offers = rows.map(|row| table.offer(moment.situation, row));
            for offer in &offers {
                let Err(refusal) = offer else { continue };
                let refused = refusal.rule.as_deref() == Some("only_while_driving");
                assert!(!refused || speed_mps < 8.0, "{refusal:?} at {speed_mps} m/s");
            }
            let legal = offers.into_iter().find_map(Result::ok);
            assert!(legal.is_none() || speed_mps >= 8.0, "{legal:?} at {speed_mps} m/s");
            slow += usize::from(speed_mps < 8.0);
            walked += usize::from(legal.is_some());
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let log = run.play(number, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, number, &log);
    }
    assert!(slow > 0 && walked > 0, "{slow} {walked}");
}

#[test]
fn the_second_truck_brakes() {
    let table = wish("second_truck_brakes");
    let [trucks, brakes] = [row(&table, "trucks()"), row(&table, "middle_brakes()")];
    let run = run_of(table.space().clone(), 8, 6, &[]);
    let (mut braked, mut rows) = (0, 0);
    for episode in 0..run.episodes() {
        let mut begun: Option<(f64, f64)> = None;
        let mut choose = |moment: &Moment| match moment.step {
            0 => table.offer(moment.situation, trucks).map_or(Choice::Pass, Choice::Act),
            _ => match table.offer(moment.situation, brakes) {
                Ok(draw) if begun.is_none() => {
                    let facts = moment.situation.surroundings.moment();
                    // Somebody else may be nearer than the last truck; along the route that one is within 40 m.
                    let last = moment.situation.surroundings.bearer(0).expect("it is there");
                    assert!(last.rear_m - facts.ego_front_m <= 40.0);
                    begun = Some((number(&draw, "rate"), facts.elapsed_s));
                    Choice::Act(draw)
                }
                _ => Choice::Pass,
            },
        };
        // Time and speed of the middle truck, the second to appear.
        let mut speeds: Vec<(f64, f64)> = Vec::new();
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            let has_just_appeared =
                world.obstacle(1).is_some_and(|last| last.spawned_tick + 1 == world.ticks());
            if let [Some(last), Some(middle), Some(first)] = [1, 2, 3].map(|id| world.npc_facts(id))
                && has_just_appeared
            {
                // Along the lane, which is bent there.
                for gap_m in [middle.rear_m - last.front_m, first.rear_m - middle.front_m] {
                    assert!((gap_m - 15.0).abs() < 0.5, "{gap_m} m");
                }
                rows += 1;
            }
            let truck = world.obstacle(2).filter(|_| contacts.is_empty());
            speeds.extend(truck.map(|truck| (world.time_s(), truck.velocity_mps.norm())));
        });
        assert_replays(&run, episode, &log);
        let Some((rate_mps2, begun_s)) = begun else { continue };
        let before_mps = speeds.iter().rfind(|(at_s, _)| *at_s <= begun_s).expect("it was there").1;
        for (at_s, speed_mps) in speeds.iter().filter(|(at_s, _)| (begun_s..begun_s + 1.5).contains(at_s)) {
            let wanted_mps = (before_mps - rate_mps2 * (at_s - begun_s)).max(0.0);
            // A velocity is the mean of a tick.
            let within_mps = rate_mps2 * DT_S + 1e-6;
            assert!(
                (speed_mps - wanted_mps).abs() <= within_mps,
                "{speed_mps} at {at_s} s, not {wanted_mps}"
            );
        }
        braked += 1;
    }
    assert!(braked > 0 && rows == run.episodes(), "{braked} trucks braked, {rows} rows");
}

#[test]
fn a_leader_stops_and_goes() {
    let table = wish("stop_and_go");
    let stops = row(&table, "stops()");
    let run = run_of(table.space().clone(), 8, 6, &[]);
    let mut stopped = 0;
    for episode in 0..run.episodes() {
        let mut begun: Option<(f64, f64)> = None;
        let mut choose = |moment: &Moment| match table.offer(moment.situation, stops) {
            Ok(draw) if begun.is_none() => {
                begun = Some((number(&draw, "rate"), moment.situation.surroundings.moment().elapsed_s));
                Choice::Act(draw)
            }
            _ => Choice::Pass,
        };
        let mut speeds: Vec<(f64, f64)> = Vec::new();
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            let leader = world.obstacle(1).filter(|_| contacts.is_empty());
            speeds.extend(leader.map(|leader| (world.time_s(), leader.velocity_mps.norm())));
        });
        assert_replays(&run, episode, &log);
        let Some((rate_mps2, begun_s)) = begun else { continue };
        let speed_at = |after_s: f64| {
            let at = speeds.iter().find(|(at_s, _)| (at_s - begun_s - after_s).abs() < DT_S / 2.0);
            at.map(|(_, speed_mps)| *speed_mps)
        };
        // Nobody else is there, so the leader does what it was told: 3 s at its speed, a stop, 2 s at rest, off again.
        let Some(before_mps) = speed_at(3.0) else { continue };
        let stop_s = before_mps / rate_mps2;
        let wanted = [
            (3.0 + stop_s / 2.0, before_mps / 2.0),
            (3.0 + stop_s + 1.0, 0.0),
            (3.0 + stop_s + 2.0 + 2.0, 3.0),
        ];
        for (after_s, wanted_mps) in wanted {
            let Some(speed_mps) = speed_at((after_s / DT_S).round() * DT_S) else { continue };
            // A velocity is the mean of a tick, and the time is that of the nearest one.
            assert!(
                (speed_mps - wanted_mps).abs() < 2.0 * rate_mps2 * DT_S,
                "{speed_mps} after {after_s} s, not {wanted_mps}"
            );
            stopped += 1;
        }
    }
    assert!(stopped >= 3, "{stopped} figures of a leader that stopped");
}

#[test]
fn a_leader_slows_down_and_then_stops() {
    let table = wish("slows_and_stops");
    let run = run_of(table.space().clone(), 8, 4, &[]);
    for (action, stops) in [("slows()", true), ("gives_up()", false)] {
        let wanted = row(&table, action);
        let mut stood = 0;
        for episode in 0..run.episodes() {
            let mut choose = |moment: &Moment| match table.offer(moment.situation, wanted) {
                Ok(draw) if moment.step == 0 => Choice::Act(draw),
                _ => Choice::Pass,
            };
            let mut stands = false;
            let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
                let leader = world.obstacle(1).filter(|_| contacts.is_empty());
                stands |= leader.is_some_and(|leader| leader.velocity_mps.norm() == 0.0);
            });
            assert_replays(&run, episode, &log);
            stood += u64::from(stands);
        }
        assert_eq!(stood > 0, stops, "{action}: {stood} of {} stood", run.episodes());
    }
}

#[test]
fn a_leader_brakes_when_it_is_near() {
    let table = wish("brakes_when_near");
    let [waits, hurries] = [row(&table, "waits()"), row(&table, "hurries()")];
    let run = run_of(table.space().clone(), 8, 6, &[]);
    let (mut braked, mut ordered) = (0, 0);
    for episode in 0..run.episodes() {
        let mut acted = 0;
        let mut choose = |moment: &Moment| {
            let wanted = if acted == 0 { waits } else { hurries };
            let is_asked = acted == 0 || acted == 1 && episode % 2 == 1;
            match table.offer(moment.situation, wanted) {
                Ok(draw) if is_asked => {
                    acted += 1;
                    Choice::Act(draw)
                }
                _ => Choice::Pass,
            }
        };
        // The gap at which it has braked. A bend slows it down, too, but not so far.
        let mut braked_m: Option<f64> = None;
        let log = run.play(episode, &mut choose, &mut |world, _, contacts| {
            let leader =
                world.obstacle(1).filter(|leader| contacts.is_empty() && leader.velocity_mps.norm() < 2.2);
            braked_m = braked_m.or(leader.map(|leader| leader.distance_m));
        });
        assert_replays(&run, episode, &log);
        ordered += usize::from(acted == 2);
        if let (1, Some(braked_m)) = (acted, braked_m) {
            assert!((2.0..=25.0).contains(&braked_m), "{braked_m} m");
            braked += 1;
        }
    }
    assert!(braked > 0 && ordered > 0, "{braked} braked, {ordered} were ordered");
}

#[test]
fn no_vehicle_appears_near_a_junction() {
    let table = example("away_from_junctions");
    let run = run_of(table.space().clone(), 1, 4, &[]);
    let (mut refused, mut appeared) = (BTreeSet::new(), 0);
    for number in 0..run.episodes() {
        let mut choose = |moment: &Moment| {
            let facts = moment.situation.surroundings.moment();
            let mut legal = None;
            for offer in table.offers(moment.situation) {
                match offer {
                    Err(refusal) => refused.extend(refusal.rule),
                    Ok(draw) => {
                        for effect in &draw.effects {
                            let Effect::Spawn(request) = effect else { continue };
                            if !request.body.is_vehicle() {
                                continue;
                            }
                            let newcomer =
                                moment.situation.surroundings.survey(request).expect("it was legal");
                            assert!(newcomer.npc.junction_ahead_m >= 30.0, "{newcomer:?}");
                            assert!(facts.ego_junction_ahead_m >= 30.0 && facts.ego_light != Light::Red);
                            appeared += 1;
                            legal = Some(draw.clone());
                        }
                    }
                }
            }
            legal.map_or(Choice::Pass, Choice::Act)
        };
        let log = run.play(number, &mut choose, &mut |_, _, _| {});
        assert_replays(&run, number, &log);
    }
    let wanted = ["no_spawn_near_junctions", "not_at_red"];
    assert!(appeared > 0 && wanted.iter().all(|rule| refused.contains(*rule)), "{appeared} {refused:?}");
}

#[test]
fn near_misses_of_pedestrians_weigh_double() {
    let table = example("pedestrians_weigh_double");
    let run = run_of(table.space().clone(), 1, 8, &[]);
    let pedestrians = ["pedestrian(from: Left)", "pedestrian(from: Right)"].map(|label| row(&table, label));
    let (mut double, mut single) = (0, 0);
    for number in 0..run.episodes() {
        // In some episodes nothing but pedestrians appears, in others nothing but vehicles.
        let mut choose = |moment: &Moment| {
            let offers = table.offers(moment.situation).into_iter().enumerate();
            let legal = offers.filter_map(|(row, offer)| match offer {
                Ok(draw) if pedestrians.contains(&row) == (number % 2 == 0) => Some(draw),
                _ => None,
            });
            let spawns = |draw: &Draw| draw.effects.iter().any(|effect| matches!(effect, Effect::Spawn(_)));
            let mut legal: Vec<Draw> = legal.filter(spawns).collect();
            let chosen = (number + 5 * moment.step) % legal.len().max(1);
            if legal.is_empty() { Choice::Pass } else { Choice::Act(legal.swap_remove(chosen)) }
        };
        let log = run.play(number, &mut choose, &mut |_, _, _| {});
        let is_hit = |index: usize| log.collisions.iter().any(|collision| collision.step == index);
        for (index, step) in log.steps.iter().enumerate().filter(|(_, step)| step.proc > 0.2) {
            let weight = if number % 2 == 0 { 2.0 } else { 1.0 };
            if !is_hit(index) {
                assert_eq!(step.reward, weight * step.proc, "step {index} of episode {number}");
                *(if number % 2 == 0 { &mut double } else { &mut single }) += 1;
            }
        }
        assert_replays(&run, number, &log);
    }
    assert!(double > 0 && single > 0, "{double} {single}");
}

#[test]
fn a_pedestrian_comes_when_the_ego_vehicle_is_30_m_from_the_junction() {
    let path = root().join("tests/cases/wishes/crosses_at_30_m.ava");
    let loaded = avastra::check::load(&path, &read).expect("it is there");
    let (space, scenario) = (loaded.space.expect("it is sound"), loaded.scenario.expect("it holds one"));
    let number = space.roads.iter().position(|road| road.name == "corner").expect("it is there");
    let run = run_of(space, 1, 4, &[]);
    let script = Script::of_scenario(&scenario);
    let mut seen = Vec::new();
    let log = run.play(number, &mut |moment| script.choose(moment), &mut |world, _, _| {
        let appeared = world.obstacles().next().map(|obstacle| obstacle.spawned_tick);
        seen.push((world.moment_facts().ego_junction_ahead_m, appeared));
    });
    let Outcome::Done { delay_ticks, .. } = log.steps[0].outcome else { panic!("{:?}", log.steps[0]) };
    assert!(delay_ticks > 0 && delay_ticks < 300, "{delay_ticks}");
    // What is seen first was before the first tick.
    let spawned = seen.iter().find_map(|(_, spawned)| *spawned).expect("it appeared") as usize;
    assert_eq!(spawned, delay_ticks as usize);
    assert!(seen[spawned].0 <= 30.0 && seen[spawned - 1].0 > 30.0, "{:?}", &seen[spawned - 1..=spawned]);
    // The log has the tick alone, and plays to the same bits; so does the file that is written of it.
    assert_replays(&run, number, &log);
    let source = Provenance {
        command: "test",
        name: "again",
        space_path: "avastra45.ava",
        episode: 0,
        agent: "none",
        without: &[],
        with: &[],
    };
    let text = print(&unclaimed(run.table(), &log, "Again.", &source));
    assert!(text.contains(&format!("}} after {} s", f64::from(delay_ticks) * 20.0 / 1000.0)), "{text}");
}

#[test]
fn a_moment_that_does_not_come_is_said() {
    let path = "tests/cases/wishes/crosses_at_30_m.ava";
    let text =
        read(&root().join(path)).expect("it is there").replace("<= 30 m", "<= 30 m and npc#7.gap < 5 m");
    let folder = tempfile::tempdir().expect("a folder");
    let space = root().join("scenarios/avastra45.ava");
    let text = text.replace("../../../scenarios/avastra45.ava", &space.display().to_string());
    let file = folder.path().join("late.ava");
    std::fs::write(&file, text).expect("it can be written");
    let (status, stdout, _) = outcome(&mut avastra(&["replay", &file.display().to_string()]));
    let reason = "`once ego.junction_ahead <= 30 m and npc#7.gap < 5 m` did not come within the step";
    assert!(status != 0 && stdout.contains(reason), "{stdout}");
}

#[test]
fn what_the_world_refuses_is_said_with_its_speed() {
    let space = "tests/cases/wishes/only_while_driving.ava";
    let reason = "rule `only_while_driving` says no: ego.speed = 3 m/s, wanted >= 8 m/s";
    let (_, stdout, _) = outcome(&mut avastra(&["table", space, "--row", "13"]));
    assert!(stdout.contains(reason), "{stdout}");
    let scenario = "tests/cases/diagnostics/scenarios/ego_speed_is_left_to_the_replay.ava";
    let (status, stdout, _) = outcome(&mut avastra(&["replay", scenario]));
    assert!(status != 0 && stdout.contains("`only_while_driving`: ego.speed = 3 m/s"), "{stdout}");
}

#[test]
fn a_scenario_by_hand_holds_what_it_claims() {
    let path = root().join("tests/cases/wishes/by_hand.ava").display().to_string();
    done(&["replay", &path]);
}

#[test]
fn the_reward_is_the_authors_own() {
    let table = wish("own_reward");
    let verbs = ["drive_ahead", "overtake", "drive_opposite", "cross_road"];
    assert!(table.rows().iter().all(|row| !verbs.iter().any(|verb| row.label.starts_with(verb))));
    assert!(table.space().groups.iter().all(|group| group.name == "environment"));
    let rules: Vec<&str> = table.space().rules.iter().map(|rule| rule.name.as_str()).collect();
    assert_eq!(rules, ["chronology", "ped_gap", "walking_pace", "no_teleport", "wet_needs_cause"]);
    let reward = |collision, struck, proc| {
        table.space().reward(
            OutcomeFacts { collision, struck, proc, ..OutcomeFacts::default() },
            &Memory::default(),
            &[],
        )
    };
    assert_eq!(reward(true, false, 1.0), 10.0);
    assert_eq!(reward(true, true, 1.0), 2.0);
    assert_eq!((reward(false, false, 0.75), reward(false, false, 0.5)), (1.5, 0.0));
}

#[test]
fn the_limit_of_the_newcomers_own_lane_may_bind() {
    let map = std::fs::read_to_string(root().join("scenarios/roads/corner.xodr")).expect("it is shipped");
    let turn = map.find("id=\"803\"").expect("the route turns there");
    let (before, turn) = map.split_at(turn);
    let map = before.to_owned() + &turn.replacen("max=\"11.176\"", "max=\"9.26\"", 1);
    let space = "language 1
road turn {
  map: \"turn.xodr\"
  start: lane 1/-1 at 105.88 m
  goal: lane 5/-3 at 75.27 m
}
action ahead(any speed: Speed in 10 m/s .. 11 m/s) {
  spawn Sedan ahead 40 m { lane: Current, speed: speed, does: DriveAhead }
}
optional rule whole_way on ahead: speed <= road.limit
rule own_lane on ahead: speed <= npc.limit
";
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("turn.ava").display().to_string();
    std::fs::write(folder.path().join("turn.xodr"), map).expect("it can be written");
    std::fs::write(&file, space).expect("it can be written");
    let stdout = done(&["road", &file]);
    assert!(stdout.contains("road.limit is 33 km/h: lane 803/-1 from"), "{stdout}");
    let (_, stdout, _) = outcome(&mut avastra(&["table", &file, "--row", "0"]));
    assert!(stdout.contains("legal, for example ahead() with { speed: 10"), "{stdout}");
}
