//! What the ego vehicle must keep: breaches and margins against the definition, and what becomes of a breach.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use avastra::action::ActionTable;
use avastra::check::Loaded;
use avastra::episode::{Breach, EpisodeLog, Script, run_with_margins};
use avastra::geometry::{OrientedBox, distance_m};
use avastra::model::Claim;
use avastra::model::vocabulary::{Body, Light};
use avastra::rng::{Stream, child_seed};
use avastra::run::{Run, Stage};
use avastra::sim::{DT_S, Obstacle, World};
use serde_json::Value;

use crate::command::{avastra, done, fails, last_line, outcome};
use crate::world::{FLICKER, assert_replays, read, run_against, space_at};

fn load(path: &str) -> Loaded {
    avastra::check::load(Path::new(path), &read).expect("it is there")
}

const SPACE: &str = "tests/cases/spaces/requirements.ava";

/// What a naive monitor notes at every tick: speed, rain, a yellow light ahead, a contact up to now.
struct Tick {
    time_s: f64,
    speed_mps: f64,
    rains: bool,
    is_yellow: bool,
}

/// An episode, and its ticks up to that of the first contact.
fn watched(run: &Run, number: usize) -> (EpisodeLog, Vec<Tick>) {
    let first = run.episode(number);
    let script = avastra::episode::Script::of_log(&first);
    let (mut ticks, mut touched) = (Vec::new(), false);
    let mut watch = |world: &World, _: &dyn avastra::ads::Ads, contacts: &[avastra::sim::Contact]| {
        // Nothing has happened yet before the first tick; that of the first contact is the last one.
        if touched || world.ticks() == 0 {
            return;
        }
        touched = !contacts.is_empty();
        let moment = world.moment_facts();
        ticks.push(Tick {
            time_s: world.time_s(),
            speed_mps: moment.ego_speed_mps,
            rains: rains(run, &first, world.time_s()),
            is_yellow: moment.ego_light == Light::Yellow,
        });
    };
    let log = run.play(number, &mut |moment| script.choose(moment), &mut watch);
    (log, ticks)
}

/// Whether it rains by the state `sky[Rain]` in the step that ends a tick at a time.
fn rains(run: &Run, log: &EpisodeLog, time_s: f64) -> bool {
    let space = run.space();
    let step = log.steps.partition_point(|step| step.time_s < time_s - 1e-6).max(1) - 1;
    let mut cells = 0..space.states.iter().map(|state| state.cells).sum();
    let cell = cells.find(|cell| space.cell_name(*cell) == "sky[Rain]").expect("there is a sky");
    log.memory_after(step).cells()[cell].variant() > 0
}

/// The breaches of a condition by the definition: first and last moment, s.
fn naive(
    ticks: &[Tick],
    asked: impl Fn(&Tick) -> bool,
    holds: impl Fn(&Tick) -> bool,
    within: usize,
) -> Vec<(f64, f64)> {
    let is_broken =
        |at: usize| at >= within && ticks[at - within..=at].iter().all(|tick| asked(tick) && !holds(tick));
    let mut found: Vec<(f64, f64)> = Vec::new();
    for at in (0..ticks.len()).filter(|at| is_broken(*at)) {
        match found.last_mut() {
            Some((_, last)) if (ticks[at].time_s - *last - DT_S).abs() < 1e-6 => *last = ticks[at].time_s,
            _ => found.push((ticks[at].time_s, ticks[at].time_s)),
        }
    }
    found
}

#[test]
fn breaches_are_those_of_a_naive_monitor() {
    let run = run_against("idm", space_at(SPACE), 8, 3, &[]);
    let space = run.space().clone();
    let (mut found, mut replayed, mut by_margin) = ([0; 3], 0, 0);
    for number in 0..run.episodes() {
        let (log, ticks) = watched(&run, number);
        let of = |name: &str| -> Vec<(f64, f64)> {
            let is_of = |breach: &&Breach| space.requirements[breach.requirement].name == name;
            log.breaches.iter().filter(is_of).map(|breach| (breach.time_s, breach.until_s)).collect()
        };
        let expected = [
            ("slow", naive(&ticks, |_| true, |tick| tick.speed_mps <= 9.0, 50)),
            ("slow_in_rain", naive(&ticks, |tick| tick.rains, |tick| tick.speed_mps <= 8.0, 0)),
            ("no_yellow", naive(&ticks, |_| true, |tick| !tick.is_yellow, 0)),
        ];
        for ((name, expected), found) in expected.iter().zip(&mut found) {
            assert_eq!(of(name), *expected, "{name} in episode {number}");
            *found += expected.len();
        }
        let smallest = |name: &str| {
            let is_of = |one: &&avastra::episode::Margin| space.requirements[one.requirement].name == name;
            log.margins.iter().find(is_of).expect("it is in force").smallest
        };
        let largest_of_second = ticks
            .windows(51)
            .map(|window| window.iter().map(|tick| 9.0 - tick.speed_mps).fold(f64::NEG_INFINITY, f64::max));
        assert_eq!(smallest("slow"), largest_of_second.reduce(f64::min), "episode {number}");
        assert_eq!(smallest("no_yellow"), None, "words have no margin");
        assert!(log.margins.iter().all(|one| space.requirements[one.requirement].name != "crawls"));
        // A step is paid for what is breached at some moment of it.
        for (index, step) in log.steps.iter().enumerate() {
            let end_s = log.steps.get(index + 1).map_or(log.duration_s, |next| next.time_s);
            let is_in = |(from_s, until_s): &(f64, f64)| *until_s > step.time_s && *from_s <= end_s + 1e-9;
            let of_step = |name: &str| of(name).iter().any(is_in);
            // So do verdicts on its collisions.
            for name in ["slow", "slow_in_rain", "no_yellow"] {
                let bit = space.requirements.iter().position(|of| of.name == name).expect("it is there");
                assert_eq!(log.breached_in(index) >> bit & 1 == 1, of_step(name), "{name} in step {index}");
            }
            let reward = match (of_step("slow"), of_step("slow_in_rain")) {
                (true, true) => 3.0,
                (true, false) => 2.0,
                (false, _) => {
                    let is_in = |window: &&[Tick]| {
                        let at_s = window[50].time_s;
                        at_s > step.time_s + 1e-9 && at_s <= end_s + 1e-9
                    };
                    let margin = |window: &[Tick]| {
                        window.iter().map(|tick| 9.0 - tick.speed_mps).fold(f64::NEG_INFINITY, f64::max)
                    };
                    let least = ticks.windows(51).filter(is_in).map(margin).reduce(f64::min);
                    least.filter(|least| *least < 0.5).unwrap_or(0.0)
                }
            };
            by_margin += usize::from(reward > 0.0 && reward < 0.5);
            assert_eq!(step.reward, reward, "step {index} of episode {number}");
        }
        replayed += usize::from(!log.breaches.is_empty());
        assert_replays(&run, number, &log);
    }
    assert!(found.iter().all(|count| *count > 0) && replayed > 4, "{found:?} in {replayed} episodes");
    assert!(by_margin > 2, "{by_margin} steps");
}

/// What pages draw of a requirement: its smallest margin is the one of the log, where each moment counts by itself.
#[test]
fn the_margins_over_time_reach_down_to_the_smallest_one() {
    let (mut compared, mut of_nobody) = (0, 0);
    for space in ["tests/cases/spaces/requirements.ava", "tests/cases/spaces/requirements_near.ava"] {
        let run = run_against("idm", space_at(space), 3, 5, &[]);
        let requirements = run.space().requirements.clone();
        for number in 0..run.episodes() {
            let script = Script::of_log(&run.episode(number));
            let setup = run.setup(number);
            let log = run_with_margins(&setup, &mut |moment| script.choose(moment), &mut |_, _, _| {});
            for series in &log.series {
                let required = &requirements[series.requirement];
                let told = log.margins.iter().find(|one| one.requirement == series.requirement);
                let told = told.expect("what is asked has a margin").smallest;
                let least = series.margins.iter().flatten().copied().reduce(f64::min);
                let of = format!("{} of {space}, episode {number}", required.name);
                of_nobody += usize::from(least.is_none());
                if required.within_ticks == 0 {
                    assert_eq!(least, told, "{of}");
                    compared += usize::from(least.is_some());
                }
            }
        }
    }
    assert!(compared > 50 && of_nobody > 0, "{compared} compared, {of_nobody} never asked");
}

/// What of a road user's gap, or of the ego vehicle, a naive monitor notes at every tick: `None` where nothing is asked.
type Margins = Vec<(f64, Option<f64>)>;

/// The breaches of margins by the definition, with the smallest margin that `within` leaves.
fn of_margins(margins: &Margins, within: usize) -> (Vec<(f64, f64)>, Option<f64>) {
    let ticks: Vec<Tick> = margins
        .iter()
        .map(|(time_s, margin)| Tick {
            time_s: *time_s,
            speed_mps: margin.unwrap_or(f64::NAN),
            rains: margin.is_some(),
            is_yellow: false,
        })
        .collect();
    let breaches = naive(&ticks, |tick| tick.rains, |tick| tick.speed_mps >= 0.0, within);
    let windows = margins.windows(within + 1).filter_map(|window| {
        let all: Option<Vec<f64>> = window.iter().map(|(_, margin)| *margin).collect();
        Some(all?.into_iter().fold(f64::NEG_INFINITY, f64::max))
    });
    (breaches, windows.reduce(f64::min))
}

/// The ticks in which a requirement of that name was asked, in ms.
fn series_asked(gaps: &BTreeMap<u32, Margins>, jerks: &Margins, name: &str) -> BTreeSet<u64> {
    let all: Vec<&Margins> = if name == "smooth" { vec![jerks] } else { gaps.values().collect() };
    let asked = all.into_iter().flatten().filter(|(_, margin)| margin.is_some());
    asked.map(|(time_s, _)| (time_s * 1000.0).round() as u64).collect()
}

#[test]
fn what_is_asked_of_each_road_user_near_is_asked_of_each_by_itself() {
    let run = run_against("idm", space_at("tests/cases/spaces/requirements_near.ava"), 10, 5, &[]);
    let space = run.space().clone();
    let (mut found, mut lately, mut asked_in, mut began) = ([0; 3], 0, [0.0; 6], 0);
    for number in 0..run.episodes() {
        let log = run.episode(number);
        let script = avastra::episode::Script::of_log(&log);
        let (mut gaps, mut jerks): (BTreeMap<u32, Margins>, Margins) = Default::default();
        let (mut accelerations, mut touched) = (Vec::new(), false);
        // The outlines of all ticks, the least time since one of two left the place of the other, and whether somebody is close.
        let mut past: Vec<(OrientedBox, BTreeMap<u32, OrientedBox>)> = Vec::new();
        let (mut left_s, mut close): (Option<f64>, Vec<bool>) = (None, Vec::new());
        let mut watch = |world: &World, _: &dyn avastra::ads::Ads, contacts: &[avastra::sim::Contact]| {
            // The tick of the first contact is the last one.
            if touched || world.ticks() == 0 {
                return;
            }
            touched = !contacts.is_empty();
            let (time_s, drives) = (world.time_s(), world.ego().speed_mps >= 2.0);
            for obstacle in
                world.obstacles().filter(|obstacle| !obstacle.is_apart && obstacle.distance_m <= 100.0)
            {
                if matches!(obstacle.body, Body::Pedestrian | Body::BoxTruck) {
                    let margin = drives.then_some(obstacle.distance_m - 12.0);
                    gaps.entry(obstacle.id).or_default().push((time_s, margin));
                }
            }
            let near = world.obstacles().filter(|one| !one.is_apart && one.distance_m <= 100.0);
            for obstacle in near.clone().filter(|_| drives) {
                let (ego, other) = (world.ego_outline(), obstacle.outline);
                let overlaps = |(then, others): &&(OrientedBox, BTreeMap<u32, OrientedBox>)| {
                    let was = others.get(&obstacle.id);
                    distance_m(then, &other) <= 0.0 || was.is_some_and(|was| distance_m(was, &ego) <= 0.0)
                };
                let ago = past.iter().rev().take(250).position(|then| overlaps(&then));
                let ago_s = ago.map_or(100.0, |ago| (ago + 1) as f64 * DT_S);
                left_s = left_s.into_iter().chain([ago_s]).reduce(f64::min);
            }
            let is_close = |one: &Obstacle| {
                matches!(one.body, Body::Pedestrian | Body::BoxTruck) && one.distance_m < 12.0
            };
            close.push(near.clone().any(is_close));
            let others = world.obstacles().map(|one| (one.id, one.outline)).collect();
            past.push((world.ego_outline(), others));
            accelerations.push(world.ego().acceleration_mps2);
            let before = accelerations.len().checked_sub(51).map(|at| accelerations[at]);
            let jerk = before.map_or(0.0, |before| accelerations[accelerations.len() - 1] - before);
            jerks.push((time_s, Some(jerk + 2.0)));
        };
        let again = run.play(number, &mut |moment| script.choose(moment), &mut watch);
        assert_eq!(again.breaches, log.breaches);
        for (index, (name, within)) in
            [("keeps_off", 0), ("keeps_off_long", 25), ("smooth", 0)].into_iter().enumerate()
        {
            let is_of = |breach: &&Breach| space.requirements[breach.requirement].name == name;
            let of: Vec<(Option<u32>, f64, f64)> = log
                .breaches
                .iter()
                .filter(is_of)
                .map(|one| (one.obstacle, one.time_s, one.until_s))
                .collect();
            let series = match name {
                "smooth" => vec![(None, &jerks)],
                _ => gaps.iter().map(|(id, margins)| (Some(*id), margins)).collect(),
            };
            let mut expected = Vec::new();
            let mut smallest: Option<f64> = None;
            for (id, margins) in series {
                let (breaches, least) = of_margins(margins, within);
                expected.extend(breaches.into_iter().map(|(from_s, until_s)| (id, from_s, until_s)));
                smallest = smallest.into_iter().chain(least).reduce(f64::min);
            }
            expected.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            let mut of = of;
            of.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            assert_eq!(of, expected, "{name} in episode {number}");
            let margin = log.margins.iter().find(|one| space.requirements[one.requirement].name == name);
            let margin = margin.expect("it is in force");
            assert_eq!(margin.smallest, smallest, "{name} in episode {number}");
            // Of several at once it is asked once.
            let asked: BTreeSet<u64> = series_asked(&gaps, &jerks, name);
            assert!((margin.asked_s - asked.len() as f64 * DT_S).abs() < 1e-9, "{name} in episode {number}");
            found[index] += expected.len();
        }
        // Of some of them means: there is one of them.
        let ticks_of = |name: &str| -> BTreeSet<u64> {
            let ticks = |s: f64| (s / DT_S).round() as u64;
            let is_of = |breach: &&Breach| space.requirements[breach.requirement].name == name;
            let of = log.breaches.iter().filter(is_of);
            of.flat_map(|one| ticks(one.time_s)..=ticks(one.until_s)).collect()
        };
        assert_eq!(ticks_of("nobody_near"), ticks_of("keeps_off"), "episode {number}");
        assert_eq!(ticks_of("few_near"), ticks_of("keeps_off"), "episode {number}");
        let by_definition = [
            "leader_is_ahead",
            "in_the_same_lane",
            "in_another_lane",
            "on_the_road",
            "mean_of_squares",
            "mean_at_rest",
        ];
        for (name, asked) in by_definition.into_iter().zip(&mut asked_in) {
            assert_eq!(ticks_of(name), BTreeSet::new(), "{name} in episode {number}");
            let is_of = |one: &&avastra::episode::Margin| space.requirements[one.requirement].name == name;
            *asked += log.margins.iter().find(is_of).expect("it is in force").asked_s;
        }
        for name in ["at_first", "at_first_ago"] {
            assert_eq!(ticks_of(name), (1..=50).collect(), "{name} in episode {number}");
        }
        for name in ["begins_once", "after_once"] {
            let ticks = ticks_of(name);
            assert!(ticks.iter().all(|tick| *tick == 1), "{name} in episode {number}");
            began += ticks.len();
        }
        let smallest = |name: &str| {
            let is_of = |one: &&avastra::episode::Margin| space.requirements[one.requirement].name == name;
            log.margins.iter().find(is_of).expect("it is in force").smallest
        };
        assert_eq!(smallest("nobody_near"), smallest("keeps_off"));
        // As often as it looks back over all outlines.
        assert_eq!(smallest("left_long_ago"), left_s.map(|left_s| left_s - 1.5), "episode {number}");
        lately += usize::from(left_s.is_some_and(|left_s| left_s < 5.0));
        // More than 2 s in 10 s are 101 ticks of 500.
        let close_in =
            |tick: usize| close[tick.saturating_sub(499)..=tick].iter().filter(|one| **one).count();
        let wanted = (0..close.len()).filter(|tick| close_in(*tick) > 100).map(|tick| tick as u64 + 1);
        assert_eq!(ticks_of("keeps_off_half"), wanted.collect(), "episode {number}");
        // What is excused is as what is not asked, as long as every tick counts by itself.
        assert_eq!(ticks_of("keeps_off_unless"), ticks_of("keeps_off"), "episode {number}");
        assert_eq!(smallest("keeps_off_unless"), smallest("keeps_off"));
        assert_replays(&run, number, &log);
    }
    assert!(found.iter().all(|count| *count > 3) && lately > 3, "{found:?}, {lately}");
    assert!(asked_in.iter().all(|asked_s| *asked_s > 5.0), "{asked_in:?}");
    assert!(began > 3, "{began}");
}

#[test]
fn a_finding_says_how_often_it_recurs() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("found").display().to_string();
    // Sensors that miss, so that much depends on the draw of their noise.
    let run = [
        "run",
        SPACE,
        "--ads",
        FLICKER,
        "--episodes",
        "12",
        "--seed",
        "3",
        "--road",
        "crossroad",
        "--repeat",
        "8",
    ];
    let found = last_line(&done(&[&run[..], &["--format", "json", "--out", &out]].concat()));
    let all = found["found"].as_array().expect("a list");
    let recurred = |of: &Value| of["recurrence"]["recurred"].as_i64().expect("it was tried");
    let replays = |of: &Value| of["recurrence"]["replays"].as_i64().expect("it was tried");
    // Seven of one kind are sure, and after one of each kind nothing can be sure any more.
    assert!(all.iter().all(|of| (2..=7).contains(&replays(of)) && (0..=replays(of)).contains(&recurred(of))));
    let counts = ["replayed", "recurring"].map(|name| found["totals"][name].as_i64().expect("a number"));
    assert!(counts[0] as usize >= all.len() && counts[1] <= counts[0], "{counts:?}");
    // What does not recur comes last.
    let rare: Vec<bool> = all.iter().map(|of| recurred(of) < 7).collect();
    assert!(rare.is_sorted(), "{rare:?}");

    let critical = found["critical"].as_array().expect("a list");
    assert_eq!(critical.len(), all.len());
    let first = critical[0].as_str().expect("a path");
    assert!(first.contains(all[0]["road"].as_str().expect("a name")));
    let text = fs::read_to_string(first).expect("it was written");
    assert!(text.contains("recurrence == ") && text.contains(" under other noise."), "{text}");
    assert!(done(&["replay", first]).contains(" holds, "));
    // The replays are counted here once more, by hand.
    let scenario = load(first);
    let table = ActionTable::new(scenario.space.clone().expect("a space without mistakes"));
    let scenario = scenario.scenario.expect("it has a scenario");
    let stage = Stage::new(&table, &scenario).expect("it plays");
    let ads = avastra::run::recorded(&scenario).expect("it is known");
    let script = avastra::episode::Script::of_scenario(&scenario);
    let log = stage.play(&ads, &mut |_, _, _| {});
    for claim in &scenario.claims {
        let Claim::Recurrence { requirement: Some(name), recurred, replays, .. } = claim else { continue };
        let again = |number: &u32| {
            let mut setup = stage.setup(&ads.clone().with_other_noise(*number));
            setup.start.reactions = child_seed(setup.seed, Stream::Noise, u64::from(*number)) | 1;
            let mut steps = 0..=script.steps.len();
            let choose = &mut |moment: &avastra::episode::Moment| match steps.next() {
                Some(step) if step < script.steps.len() => script.choose(moment),
                Some(_) => avastra::episode::Choice::Pass,
                None => avastra::episode::Choice::Stop,
            };
            avastra::episode::run(&setup, choose).breach_of(table.space(), name).is_some()
        };
        assert_eq!((1..=*replays).filter(again).count(), *recurred as usize, "{name}");
    }
    assert!(log.breach_of(table.space(), "slow").is_some());

    // A claim that does not hold is refuted, and a review mends it.
    let lie: String = text
        .lines()
        .map(|line| match line.split_once("slow.recurrence == ") {
            Some((before, _)) => format!("{before}slow.recurrence == 0 / 6\n"),
            None => format!("{line}\n"),
        })
        .collect();
    assert_ne!(lie, text, "the first one is a breach that recurs");
    fs::write(first, &lie).expect("it can be written");
    let (status, said, _) = outcome(&mut avastra(&["replay", first]));
    assert!(status != 0 && said.contains("  claimed slow.recurrence 0 of 6"), "{said}");
    let (_, said, _) = outcome(&mut avastra(&["test", "--accept", first]));
    assert!(said.contains("1 scenario written anew"), "{said}");
    assert_eq!(fs::read_to_string(first).expect("it is there"), text);

    // Where nothing is asked, nothing is claimed.
    let none = scratch.path().join("none").display().to_string();
    let found =
        last_line(&done(&[&run[..10], &["--repeat", "0", "--format", "json", "--out", &none]].concat()));
    assert_eq!(
        (&found["totals"]["replayed"], &found["found"][0]["recurrence"]),
        (&Value::from(0), &Value::Null)
    );
}

#[test]
fn a_training_plays_an_example_of_each_failure_again() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("trained").display().to_string();
    let train = ["train", "scenarios/avastra45.ava", "--road", "corner", "--episodes", "16", "--seed", "2"];
    let found =
        last_line(&done(&[&train[..], &["--ads", FLICKER, "--format", "json", "--out", &out]].concat()));
    let groups = found["groups"].as_array().expect("a list");
    assert!(!groups.is_empty(), "such sensors make crashes");
    for group in groups {
        // Only of a kind of which all were tried may it be said that it does not recur.
        assert!(group["recurring"].as_u64() > Some(0) || group["tried"] == group["count"], "{group}");
        let file = format!("{out}/critical/corner_{:04}.ava", group["episode"].as_i64().expect("a number"));
        let text = fs::read_to_string(&file).expect("it was written");
        assert!(text.contains("  expect recurrence == ") && text.contains(" with npc#"), "{text}");
        assert!(done(&["replay", &file]).contains(" holds, "));
    }
    // The database is sound, and a second end changes nothing.
    let read = || fs::read(format!("{out}/run.db")).expect("it is there");
    let before = read();
    let (_, _, said) = outcome(&mut avastra(&["report", &out]));
    assert!(!said.contains("were changed"), "{said}");
    done(&["train", "--resume", &out]);
    assert!(read() == before, "nothing is played again");
}

#[test]
fn a_training_writes_each_episode_with_a_breach() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("trained").display().to_string();
    let train = ["train", SPACE, "--road", "corner", "--episodes", "8", "--seed", "2", "--ads", "idm"];
    let found = last_line(&done(&[&train[..], &["--format", "json", "--out", &out]].concat()));
    let requirements = found["requirements"].as_array().expect("a list");
    let breached: Vec<&Value> =
        requirements.iter().filter(|of| of["breaches"].as_i64().is_some_and(|count| count > 0)).collect();
    assert!(breached.len() > 1, "{requirements:?}");
    for of in &breached {
        let [requirement, scenario] =
            ["requirement", "scenario"].map(|word| of[word].as_str().expect("a name"));
        let file = format!("{out}/critical/{scenario}.ava");
        let text = fs::read_to_string(&file).expect("it was written");
        assert!(text.contains(&format!("  expect {requirement}.breached at ")), "{text}");
        assert!(text.contains(&format!("  expect {requirement}.recurrence == ")), "{text}");
        assert!(done(&["replay", &file]).contains(" holds, "));
        let [breached_in, tried_in] =
            ["breached_in", "tried_in"].map(|word| of[word].as_i64().expect("a number"));
        assert!((1..=breached_in).contains(&tried_in), "{of}");
    }
    let written = fs::read_dir(format!("{out}/critical")).expect("it is there");
    let is_scenario = |name: &str| name.starts_with("corner_") && name.ends_with(".ava");
    let files = written
        .filter(|entry| is_scenario(&entry.as_ref().expect("it can be read").file_name().to_string_lossy()));
    let database = rusqlite::Connection::open(format!("{out}/run.db")).expect("a database");
    let query = "SELECT count(DISTINCT episode) FROM breach";
    let episodes: i64 = database.query_row(query, [], |row| row.get(0)).expect("a number");
    assert_eq!(files.count() as i64, episodes);
    let read = || fs::read(format!("{out}/run.db")).expect("it is there");
    let before = read();
    done(&["train", "--resume", &out]);
    assert!(read() == before, "nothing is played again");
}

#[test]
fn near_misses_are_kept_as_scenarios_that_end_as_they_did() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let kept = |name: &str, more: &[&str]| -> Vec<(String, String)> {
        let out = scratch.path().join(name).display().to_string();
        let run = [
            "run",
            "scenarios/avastra45_law.ava",
            "--ads",
            "idm",
            "--episodes",
            "3",
            "--keep",
            "8",
            "--out",
            &out,
        ];
        let found = last_line(&done(&[&run[..], more, &["--format", "json"]].concat()));
        let files = found["kept"].as_array().expect("a list").iter().filter_map(Value::as_str);
        files
            .map(|file| (file.replace(&out, ""), fs::read_to_string(file).expect("it was written")))
            .collect()
    };
    let all = kept("one", &[]);
    assert_eq!(all.len(), 8);
    // First come the nearest misses of each requirement that was asked.
    let named: BTreeSet<&str> = all[..6].iter().filter_map(|(_, text)| text.split('`').nth(5)).collect();
    assert!(named.len() >= 4, "an episode may be the nearest one of two: {named:?}");
    for (_, text) in &all {
        assert!(text.contains("/// Nothing is found here: `") && text.contains("  expect end == "), "{text}");
    }
    assert_eq!(kept("again", &["--jobs", "1"]), all, "they depend on no number of threads");
    let first = format!("{}{}", scratch.path().join("one").display(), all[0].0);
    assert!(done(&["replay", &first]).contains(" holds, "));
    let page = done(&["report", &scratch.path().join("one").display().to_string()]);
    assert!(page.contains("8 scenarios"), "{page}");

    // What somebody has edited stays.
    fs::write(&first, "mine").expect("it can be written");
    done(&["run", "--resume", &scratch.path().join("one").display().to_string()]);
    assert_eq!(fs::read_to_string(&first).expect("it is there"), "mine");
}

#[test]
fn what_does_not_count_is_kept_first() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("run").display().to_string();
    let run =
        ["run", "scenarios/r157.ava", "--episodes", "20", "--seed", "7", "--repeat", "0", "--out", &out];
    let found = last_line(&done(&[&run[..], &["--keep", "30", "--format", "json"]].concat()));
    let totals = &found["totals"];
    let uncounted = totals["episodes_with_collision"].as_u64().zip(totals["episodes_with_counted"].as_u64());
    let uncounted = uncounted.map(|(all, counted)| (all - counted) as usize).expect("numbers");
    assert!((1..30).contains(&uncounted), "{totals}");
    let kept: Vec<String> = found["kept"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|file| fs::read_to_string(file.as_str().expect("a path")).expect("it was written"))
        .collect();
    let is_uncounted = |text: &String| {
        text.contains("/// A collision with ") && text.contains(" does not count. Not met: `")
    };
    assert!(kept[..uncounted].iter().all(is_uncounted), "{}", kept[0]);
    assert!(!kept[uncounted..].iter().any(is_uncounted), "then the nearest misses");
}

#[test]
fn a_breach_is_explained_and_estimated() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("found").display().to_string();
    let space = "tests/cases/spaces/requirements_near.ava";
    let run = ["run", space, "--ads", FLICKER, "--episodes", "20", "--seed", "3", "--repeat", "0"];
    let found = last_line(&done(&[&run[..], &["--format", "json", "--out", &out]].concat()));
    let critical: Vec<&str> =
        found["critical"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    let breach = critical.iter().find(|file| {
        let text = fs::read_to_string(file).expect("it was written");
        text.contains("smooth.breached") && !text.contains("expect counted")
    });
    let breach = breach.expect("a driver that sees little brakes hard");
    let told = last_line(&done(&["diagnose", breach, "--format", "json"]));
    let told = &told["scenarios"][0];
    assert_eq!(
        (&told["requirement"].is_string(), &told["diagnosis"]["noun"]),
        (&true, &Value::from("breach"))
    );
    let said = done(&["diagnose", breach]);
    assert!(said.contains("is not kept at ") && !said.contains("crash"), "{said}");

    let estimate = |event: &str, out: &str| {
        let out = scratch.path().join(out).display().to_string();
        let asked =
            ["estimate", space, "--ads", "idm", "--road", "corner", "--parts", "2", "--episodes", "10"];
        last_line(&done(&[&asked[..], &["--event", event, "--out", &out, "--format", "json"]].concat()))
    };
    let of = |found: &Value| found["results"]["together"]["probability"].as_f64().expect("a number");
    let [any, one] = [("breach", "any"), ("keeps_off", "one")].map(|(event, out)| estimate(event, out));
    assert!(of(&one) > 0.0 && of(&any) >= of(&one), "{any} {one}");
    assert_eq!(one["results"]["event"], "keeps_off");
    let first = one["critical"][0].as_str().expect("it met some");
    assert!(done(&["replay", first]).contains(" holds, "));
    let asked = ["estimate", space, "--out", "never"];
    fails(&[&asked[..], &["--event", "keeps_of"]].concat(), "no event `keeps_of`: did you mean `keeps_off`?");
    fails(&[&asked[..], &["--event", "breach", "--method", "probe"]].concat(), "estimate by counting");
    let none = ["estimate", "scenarios/avastra45.ava", "--event", "breach", "--out", "never"];
    fails(&none, "no requirement of this space is in force");
}

#[test]
fn a_breach_is_a_finding_that_replays() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("found").display().to_string();
    let run = ["run", SPACE, "--ads", "idm", "--episodes", "2", "--seed", "3"];
    let found = last_line(&done(&[&run[..], &["--format", "json", "--out", &out]].concat()));
    let requirements = found["requirements"].as_array().expect("a list");
    let of = |name: &str| requirements.iter().find(|one| one["requirement"] == name).unwrap_or(&Value::Null);
    let breaches = of("slow")["breaches"].as_i64().expect("a number");
    assert!(breaches > 0 && of("slow")["smallest"].as_f64().is_some_and(|smallest| smallest < 0.0));
    assert_eq!((of("slow")["unit"].as_str(), of("no_yellow")["smallest"].as_f64()), (Some("m/s"), None));
    assert_eq!(of("stops_at_red")["breaches"], 0);
    assert_eq!(*of("crawls"), Value::Null, "it is optional");

    // Each is a scenario whose claims hold, and which a driving system that drives on still fails.
    let critical = found["critical"].as_array().expect("a list");
    let first = critical[0].as_str().expect("a path");
    let text = fs::read_to_string(first).expect("it was written");
    assert!(
        text.contains("  expect slow.breached at ") && text.contains("  expect slow.kept by ["),
        "{text}"
    );
    assert!(text.contains("The ego vehicle does not keep `"), "{text}");
    let replayed = done(&["replay", first]);
    assert!(replayed.contains(" holds, "), "{replayed}");
    let (status, said, _) = outcome(&mut avastra(&["test", first]));
    assert!(status != 0 && said.contains("1 scenario: 1 still fail"), "{said}");
    let said = done(&["replay", first, "--ads", "modular"]);
    assert!(said.contains("; breaches no_yellow at ") && said.contains("; keeps slow\n"), "{said}");
    let (_, other, _) = outcome(&mut avastra(&["test", first, "--ads", "modular"]));
    assert!(other.contains("still fail"), "modular is as fast: {other}");
    let reviewed = outcome(&mut avastra(&["test", "--review", first])).1;
    assert!(reviewed.contains(": same\n"), "{reviewed}");

    // It becomes smaller, and is the same breach.
    let said = done(&["shrink", first]);
    assert!(said.contains(" became "), "{said}");
    let shrunk = first.replace("/critical/", "/shrunk/");
    let smaller = fs::read_to_string(&shrunk).expect("it was written");
    assert!(smaller.contains("  expect slow.breached at ") && smaller.len() < text.len(), "{smaller}");
    assert!(done(&["replay", &shrunk]).contains(" holds, "));
    let (status, ..) = outcome(
        avastra(&run).args(["--fail-on", "breach", "--quiet"]).arg("--out").arg(scratch.path().join("again")),
    );
    assert_eq!(status, 4);

    // A claim that does not hold is refuted.
    let lie = text.replacen("slow.breached at ", "slow.breached at 1", 1);
    fs::write(first, &lie).expect("it can be written");
    let (status, said, _) = outcome(&mut avastra(&["replay", first]));
    assert!(status != 0 && said.contains("  claimed slow.breached at "), "{said}");
    fs::write(first, lie.replacen("expect slow.breached", "expect crawls.breached", 1))
        .expect("it can be written");
    let said = outcome(&mut avastra(&["replay", first])).1;
    assert!(said.contains("  found   kept, or not in force"), "{said}");
}

#[test]
fn who_asks_whether_somebody_is_there_sees_them() {
    let run = run_against("idm", space_at("tests/cases/spaces/requirements_there.ava"), 1, 1, &[]);
    let log = run.episode(0);
    assert_replays(&run, 0, &log);
    let requirements = &run.space().requirements;
    let breached = |breach: &Breach| requirements[breach.requirement].name.as_str();
    let breached: BTreeSet<&str> = log.breaches.iter().map(breached).collect();
    assert_eq!(breached, BTreeSet::from(["is_slow", "is_slow_if_named", "is_slow_while_there"]));
}

#[test]
fn requirements_are_switched_as_rules_are() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let run = |name: &str, more: &[&str]| -> Vec<String> {
        let out = scratch.path().join(name).display().to_string();
        let run = ["run", SPACE, "--ads", "idm", "--episodes", "1", "--road", "corner", "--out", &out];
        let found = last_line(&done(&[&run[..], more, &["--format", "json"]].concat()));
        let all = found["requirements"].as_array().expect("a list").iter();
        all.filter_map(|one| Some(one["requirement"].as_str()?.to_owned())).collect()
    };
    let usual = run("usual", &[]);
    assert!(usual.contains(&"slow".to_owned()) && !usual.contains(&"crawls".to_owned()));
    let switched = run("switched", &["--with", "crawls", "--without", "slow"]);
    assert!(!switched.contains(&"slow".to_owned()) && switched.contains(&"crawls".to_owned()));
    fails(&["run", SPACE, "--without", "slo"], "unknown rule `slo`; did you mean `slow`?");

    // A scenario keeps what was switched, and is taken by all that take scenarios.
    let file = format!("{}/switched/critical/corner_0000.ava", scratch.path().display());
    let text = fs::read_to_string(&file).expect("it was written");
    assert!(text.contains("without: [slow]") && text.contains("with: [crawls]"), "{text}");
    assert!(text.contains("crawls.breached") && !text.contains("expect slow."), "{text}");
    done(&["check", &file]);
    assert!(done(&["replay", &file]).contains(" holds, "));
    assert!(outcome(&mut avastra(&["test", &file])).1.contains("1 still fail"));
    done(&["shrink", &file]);
    done(&["export", "--to", "csv", &file]);
    fs::write(&file, text.replace("without: [slow]", "without: [slo]")).expect("it can be written");
    let (status, _, error) = outcome(&mut avastra(&["check", &file]));
    assert_ne!(status, 0);
    assert!(error.contains("unknown rule or requirement `slo`"), "{error}");
}

#[test]
fn a_scenario_is_about_what_it_claims_first() {
    let scratch = tempfile::tempdir().expect("a scratch directory");
    let out = scratch.path().join("found").display().to_string();
    let asked =
        ["run", SPACE, "--ads", "idm", "--episodes", "2", "--seed", "2", "--repeat", "3", "--road", "corner"];
    let found = last_line(&done(&[&asked[..], &["--format", "json", "--out", &out]].concat()));
    let first = found["critical"][0].as_str().expect("a path").to_owned();
    let text = fs::read_to_string(&first).expect("it was written");
    let groups: Vec<&str> = text.matches(".breached at").collect();
    assert!(groups.len() >= 2, "{text}");

    // Each claim of a recurrence is mended by that of its own requirement.
    let wrong = text.replace(".recurrence == 3 / 3", ".recurrence == 1 / 3");
    assert_ne!(wrong, text);
    fs::write(&first, &wrong).expect("it can be written");
    outcome(&mut avastra(&["test", "--accept", &first]));
    assert_eq!(fs::read_to_string(&first).expect("it is there"), text);

    // Whoever claims the other one first has it shrunk.
    let lines: Vec<&str> = text.lines().collect();
    let is_of = |line: &str, name: &str| line.starts_with(&format!("  expect {name}."));
    let name_of = |line: &str| {
        line.trim().strip_prefix("expect ").and_then(|rest| rest.split('.').next().map(str::to_owned))
    };
    let names: Vec<String> =
        lines.iter().filter(|line| line.contains(".breached at")).filter_map(|line| name_of(line)).collect();
    let last = names.last().expect("two are breached");
    let (own, others): (Vec<&str>, Vec<&str>) = lines.iter().partition(|line| is_of(line, last));
    let at = others.iter().position(|line| line.starts_with("  expect")).expect("it has claims");
    let turned = [&others[..at], &own, &others[at..]].concat().join("\n") + "\n";
    fs::write(&first, turned).expect("it can be written");
    done(&["shrink", &first]);
    let shrunk = fs::read_to_string(first.replace("/critical/", "/shrunk/")).expect("it was written");
    let claim = shrunk.lines().find(|line| line.starts_with("  expect")).expect("it has claims");
    assert!(is_of(claim, last), "{shrunk}");
    assert!(shrunk.contains(&format!("does not keep `{last}`")), "{shrunk}");
}
