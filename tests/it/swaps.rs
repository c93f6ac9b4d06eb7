//! Causes for any driving system: what `diagnose` says of failures of sound drivers with a planted fault.

use avastra::ads::Alteration;
use avastra::episode;
use avastra::episode::{EpisodeLog, Script, Setup};
use avastra::oracle;
use avastra::oracle::{Found, HangsOn};
use avastra::rng;
use avastra::rng::Stream;
use avastra::run::{EpisodeSummary, Run};
use avastra::sim::SignalColour;

use crate::world::{run_against, space_at};

/// The faults that are planted for good in what a sound driver is told, or in what becomes of its commands. This list was written
/// before any of its failures was looked at.
const PLANTED: [(&str, Alteration); 10] = [
    ("is not told of people", Alteration::WithoutPeople),
    ("is told that lights are green", Alteration::Lights(SignalColour::Green)),
    ("is told that others stand", Alteration::Standing),
    ("is told 0.6 s late", Alteration::Late(0.6)),
    ("is told others 1.5 times as far", Alteration::Distances(1.5)),
    ("is told left for right", Alteration::Mirrored),
    ("is told others 0.6 m smaller on each side", Alteration::Larger(-0.6)),
    ("acts 0.5 s late", Alteration::Delayed(0.5)),
    ("brakes with two fifths", Alteration::Braking(0.4)),
    ("steers 0.02 rad to the left", Alteration::Steering(0.02)),
];
/// The drivers that they are planted in.
const DRIVERS: [&str; 3] = ["idm", "reactive", "frenet"];
/// The spaces in which their failures are looked for.
const SPACES: [&str; 2] = ["scenarios/avastra45_law.ava", "scenarios/manoeuvres.ava"];
/// Failures of each fault, drawn by this seed.
const FAILURES: usize = 11;
const SEED: u64 = 61;
/// Episodes on each road.
const EPISODES: u32 = 40;

/// What may be named of a fault: of late pictures and late commands, only the delay shows from outside; of wrong distances and wrong
/// sizes, only the room.
fn is_right(fault: &str, named: HangsOn) -> bool {
    match fault {
        "is not told of people" => named == HangsOn::IgnoredRoadUser,
        "is told that lights are green" => named == HangsOn::IgnoredLights,
        "is told that others stand" => named == HangsOn::IgnoredSpeeds,
        "is told 0.6 s late" | "acts 0.5 s late" => named == HangsOn::Delay,
        "is told others 1.5 times as far" | "is told others 0.6 m smaller on each side" => {
            named == HangsOn::Room
        }
        "is told left for right" => named == HangsOn::Sides,
        "brakes with two fifths" => named == HangsOn::Brakes,
        "steers 0.02 rad to the left" => named == HangsOn::Steering,
        _ => unreachable!("it is not planted"),
    }
}

/// A failure that a planted fault makes: the driver without it does not fail so in the same scenario.
struct Failing {
    ads: &'static str,
    space: &'static str,
    number: usize,
    setup: Setup,
    log: EpisodeLog,
    found: Found,
}

/// The failure of an episode that a fault makes, if it makes one.
fn failing(
    ads: &'static str,
    space: &'static str,
    run: &Run,
    number: usize,
    fault: Alteration,
) -> Option<Failing> {
    let healthy = run.setup(number);
    let setup = Setup { ads: healthy.ads.clone().altered(fault, 0.0), ..healthy.clone() };
    let log = run.played(&setup);
    let summary = EpisodeSummary::judged(&setup, number, &log);
    let found = summary.first_found(&log)?;
    let again = Script::of_log(&log);
    let sound = episode::run(&healthy, &mut |moment| again.choose(moment));
    let is_made = match found {
        Found::Collision(_) => sound.collisions.is_empty(),
        Found::Breach(index) => {
            let requirement = log.breaches[index].requirement;
            !sound.breaches.iter().any(|breach| breach.requirement == requirement)
        }
    };
    is_made.then_some(Failing { ads, space, number, setup, log, found })
}

/// The failures of a fault, drawn by a seed.
fn failures(fault: Alteration, seed: u64) -> Vec<Failing> {
    let mut all = Vec::new();
    for ads in DRIVERS {
        for space in SPACES {
            let run = run_against(ads, space_at(space), EPISODES, seed, &[]);
            let failing = (0..run.episodes()).filter_map(|number| failing(ads, space, &run, number, fault));
            all.extend(failing);
        }
    }
    let mut rng = rng::stream(seed, Stream::Noise, 0);
    let mut drawn = Vec::new();
    while !all.is_empty() && drawn.len() < FAILURES {
        let index = (rng::unit(&mut rng) * all.len() as f64) as usize;
        drawn.push(all.swap_remove(index));
    }
    drawn
}

/// The first failure of `idm` with a fault, and what it hangs on.
fn first_of(fault: Alteration) -> Option<HangsOn> {
    let run = run_against("idm", space_at(SPACES[0]), 20, 1, &[]);
    let failing = (0..run.episodes()).find_map(|number| failing("idm", SPACES[0], &run, number, fault));
    let Failing { setup, log, found, .. } = failing.expect("it fails");
    let swaps = oracle::swaps(&setup, &log, found);
    assert_eq!(oracle::swaps(&setup, &log, found), swaps);
    swaps.hangs_on
}

#[test]
fn what_is_not_used_is_named() {
    assert_eq!(first_of(Alteration::Lights(SignalColour::Green)), Some(HangsOn::IgnoredLights));
    assert_eq!(first_of(Alteration::Braking(0.3)), Some(HangsOn::Brakes));
}

/// What became of the failures of a fault.
#[derive(Default)]
struct Measured {
    of: u32,
    named: u32,
    right: u32,
    text: String,
}

fn measured(fault: &str, alteration: Alteration, seed: u64) -> Measured {
    let failures = failures(alteration, seed);
    let mut measured =
        Measured { text: format!("{fault}: {} failures\n", failures.len()), ..Measured::default() };
    for Failing { ads, space, number, setup, log, found } in &failures {
        let swaps = oracle::swaps(setup, log, *found);
        let verdict = swaps.hangs_on;
        let is_right = verdict.is_some_and(|verdict| is_right(fault, verdict));
        measured.of += 1;
        measured.named += u32::from(verdict.is_some());
        measured.right += u32::from(is_right);
        measured.text += &format!("  {ads} {space} {number} {found:?}: {verdict:?}\n");
        if !is_right {
            measured.text += &format!("{swaps:#?}\n");
        }
    }
    measured
}

/// `SEED=7 cargo test --test it -- --ignored --nocapture swaps::the_planted` draws others.
#[test]
#[ignore = "it plays some 100,000 episodes: a quarter of an hour"]
#[expect(clippy::disallowed_methods, reason = "another seed is said in the environment")]
fn the_planted_faults_are_named() {
    let seed = std::env::var("SEED").map_or(SEED, |text| text.parse().expect("a seed"));
    let all: Vec<Measured> = std::thread::scope(|threads| {
        let begun: Vec<_> = PLANTED
            .iter()
            .map(|(fault, alteration)| threads.spawn(move || measured(fault, *alteration, seed)))
            .collect();
        begun.into_iter().map(|thread| thread.join().expect("it ends")).collect()
    });
    all.iter().for_each(|measured| println!("{}", measured.text));
    for ((fault, _), Measured { of, named, right, .. }) in PLANTED.iter().zip(&all) {
        println!("{fault:<45}{of:>4} failures,{named:>4} named,{right:>4} right");
    }
    let sum = |count: fn(&Measured) -> u32| all.iter().map(count).sum::<u32>();
    let (of, named, right) =
        (sum(|measured| measured.of), sum(|measured| measured.named), sum(|measured| measured.right));
    println!("{named} of {of} named, {right} of them right");
    assert!(named * 10 >= of * 6 && right * 10 >= named * 9, "{named} of {of} named, {right} right");
}

/// The drivers without a fault fail, too. How often is something named that nobody planted?
#[test]
#[ignore = "it plays some 10,000 episodes: a few minutes"]
fn drivers_without_a_fault_are_told() {
    for ads in DRIVERS {
        let mut told = std::collections::BTreeMap::<&str, u32>::new();
        for space in SPACES {
            let run = run_against(ads, space_at(space), EPISODES, SEED, &[]);
            for number in 0..run.episodes() {
                let setup = run.setup(number);
                let log = run.played(&setup);
                if let Some(found) = EpisodeSummary::judged(&setup, number, &log).first_found(&log) {
                    let swaps = oracle::swaps(&setup, &log, found);
                    assert!(swaps.found_s >= swaps.from_s);
                    *told.entry(swaps.hangs_on.map_or("none", HangsOn::name)).or_default() += 1;
                }
            }
        }
        println!("{ads}: {told:?}");
    }
}
