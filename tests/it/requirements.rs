//! What the ego vehicle must keep: breaches and margins against the definition, and what becomes of a breach.

use std::fs;

use avastra::episode::{Breach, EpisodeLog};
use avastra::model::vocabulary::Light;
use avastra::run::Run;
use avastra::sim::{DT_S, World};
use serde_json::Value;

use crate::command::{avastra, done, fails, last_line, outcome};
use crate::world::{assert_replays, run_against, space_at};

const SPACE: &str = "tests/cases/spaces/requirements.ava";

/// What a naive monitor notes at every tick: speed, rain, a yellow light ahead, a contact up to now.
struct Tick {
    time_s: f64,
    speed_mps: f64,
    rains: bool,
    is_yellow: bool,
}

/// An episode, and its ticks up to the first contact.
fn watched(run: &Run, number: usize) -> (EpisodeLog, Vec<Tick>) {
    let first = run.episode(number);
    let script = avastra::episode::Script::of_log(&first);
    let (mut ticks, mut touched) = (Vec::new(), false);
    let mut watch = |world: &World, _: &dyn avastra::ads::Ads, contacts: &[avastra::sim::Contact]| {
        touched |= !contacts.is_empty();
        // Nothing has happened yet before the first tick.
        if touched || world.ticks() == 0 {
            return;
        }
        let moment = world.moment_facts();
        ticks.push(Tick {
            time_s: world.time_s(),
            speed_mps: moment.ego_speed_mps,
            rains: rains(run, &first, world.time_s()),
            is_yellow: moment.ego_light == Light::Yellow,
        });
    };
    let log = run.play(number, &mut |moment| script.choose(run.table(), moment), &mut watch);
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
    let (mut found, mut replayed) = ([0; 3], 0);
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
            let reward = match (of_step("slow"), of_step("slow_in_rain")) {
                (true, true) => 3.0,
                (true, false) => 2.0,
                (false, _) => 0.0,
            };
            assert_eq!(step.reward, reward, "step {index} of episode {number}");
        }
        replayed += usize::from(!log.breaches.is_empty());
        assert_replays(&run, number, &log);
    }
    assert!(found.iter().all(|count| *count > 0) && replayed > 4, "{found:?} in {replayed} episodes");
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
        avastra(&run).args(["--fail-on-breach", "--quiet"]).arg("--out").arg(scratch.path().join("again")),
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
}
