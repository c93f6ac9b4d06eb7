//! Marks: how fast avastra is on this machine, one line `mark NAME VALUE UNIT` each.
//!
//! A mark is the median of several repeats. `cargo bench --bench marks -- WORD` measures only those
//! whose name holds the word. Build time and memory of a whole process are not measured here.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use avastra::action::ActionTable;
use avastra::action::Effect;
use avastra::action::SpawnRequest;
use avastra::ads;
use avastra::episode;
use avastra::mdp::ProcSettings;
use avastra::mdp::collision_probability;
use avastra::model::ReadError;
use avastra::model::Space;
use avastra::model::vocabulary::Body;
use avastra::model::vocabulary::Colour;
use avastra::model::vocabulary::LaneChoice;
use avastra::model::vocabulary::Level;
use avastra::model::vocabulary::Side;
use avastra::model::vocabulary::Then;
use avastra::model::vocabulary::TimeOfDay;
use avastra::model::vocabulary::Verb;
use avastra::sim::Scene;
use avastra::sim::Start;
use avastra::sim::World;
use avastra::study;
use avastra::study::Run;
use avastra::study::RunSettings;

const REPEATS: usize = 7;
/// Ticks of one repeat: six seconds of traffic.
const TICKS: u64 = 300;
/// Episodes of one repeat of the scaling mark.
const EPISODES: u32 = 24;

fn main() {
    let space = load();
    let scene = Arc::new(episode::scene(&space.roads[0]));
    let world = crowded(&scene);
    println!("# {} obstacles around the ego vehicle", world.obstacles().len());
    for name in ["modular", "idm"] {
        mark(&format!("ticks_per_s_{name}"), "ticks/s", || ticks_per_s(&world, &scene, name));
    }
    mark("snapshot", "us", || median(|| seconds(10_000, || drop(black_box(world.clone())))) * 1e6);
    mark("parse_check_table", "ms", || {
        median(|| seconds(1, || drop(black_box(ActionTable::new(load()))))) * 1e3
    });
    let run = run(space);
    mark("episodes_per_s", "episodes/s", || median(|| episodes_per_s(&run, 1)));
    mark("episodes_two_cores_over_one", "x", || {
        // In turn, so that a machine that changes its speed changes both.
        median(|| 1.0 / episodes_per_s(&run, 1) * episodes_per_s(&run, 2))
    });
    mark("episodes_real_time_factor", "x", || real_time_factor(&run));
}

/// Measures and prints a mark, unless the command line asks for others.
fn mark(name: &str, unit: &str, measure: impl FnOnce() -> f64) {
    let mut words = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).peekable();
    if words.peek().is_none() || words.any(|word| name.contains(&word)) {
        println!("mark {name} {:.3} {unit}", measure());
    }
}

/// The 45-action space, from text to table, maps included.
fn load() -> Arc<Space> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/avastra45.ava");
    let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError(error.to_string()));
    avastra::model::load(&path, &read).expect("it is shipped").space.expect("the shipped space is sound")
}

/// A world with as many obstacles as find room, at most ten.
fn crowded(scene: &Arc<Scene>) -> World {
    let start = Start {
        time: TimeOfDay::Noon,
        rain: Level::None,
        fog: Level::None,
        wetness: Level::None,
        signal_phase_s: 0.0,
        seed: 1,
        ambient: 0,
    };
    let mut world = World::new(scene.clone(), &start);
    let verbs = [Verb::DriveAhead, Verb::DriveOpposite, Verb::Overtake, Verb::Walk];
    for distance_m in [8.0, 15.0, 22.0, 30.0, 38.0, 46.0, 54.0, 62.0, 70.0, 90.0] {
        for verb in verbs {
            for lane in [LaneChoice::Current, LaneChoice::Right] {
                if world.obstacles().len() == 10 {
                    return world;
                }
                let request = SpawnRequest {
                    body: if verb == Verb::Walk { Body::Pedestrian } else { Body::Sedan },
                    colour: Colour::Red,
                    verb,
                    lane,
                    side: Side::Left,
                    then: Then::Keep,
                    speed_mps: if verb == Verb::Walk { 1.2 } else { 9.0 },
                    distance_m,
                };
                // A place that is taken is no failure here: there are more places than needed.
                let _ = world.apply(&Effect::Spawn(request));
            }
        }
    }
    world
}

/// Whole ticks: sensing, driving, moving, contacts, collision probability.
fn ticks_per_s(world: &World, scene: &Arc<Scene>, name: &str) -> f64 {
    let entry = ads::by_name(name).expect("it is registered");
    let settings = ProcSettings::default();
    let repeat = || {
        let mut world = world.clone();
        let mut driver = (entry.build)(scene, 1);
        let mut sensed = world.sensed();
        let mut most = 0.0_f64;
        let took = seconds(TICKS, || {
            world.sense(&mut sensed);
            world.tick(&driver.drive(&sensed));
            most = most.max(collision_probability(&world, &settings, &|_| false));
        });
        black_box(most);
        took
    };
    1.0 / median(repeat)
}

fn run(space: Arc<Space>) -> Run {
    let settings = RunSettings {
        avastra: String::new(),
        engine: String::new(),
        space: String::new(),
        space_digest: String::new(),
        roads: vec![space.roads[0].name.clone()],
        ads: "modular".to_owned(),
        profile: None,
        agent: "random".to_owned(),
        policy: None,
        episodes: EPISODES,
        seed: 1,
        ambient: 0,
        without: Vec::new(),
        with: Vec::new(),
        avoidability: Default::default(),
    };
    Run::new(ActionTable::new(space), settings).expect("the settings name what exists")
}

fn episodes_per_s(run: &Run, jobs: usize) -> f64 {
    let numbers: Vec<usize> = (0..EPISODES as usize).collect();
    let took = seconds(1, || {
        study::play::<()>(run, &numbers, jobs, &AtomicBool::new(false), &mut |_, _| Ok(()))
            .expect("nothing here fails");
    });
    f64::from(EPISODES) / took
}

/// Simulated seconds that one core plays in a second.
fn real_time_factor(run: &Run) -> f64 {
    let simulated_s: f64 = (0..EPISODES as usize).map(|number| run.episode(number).duration_s).sum();
    simulated_s / f64::from(EPISODES) * median(|| episodes_per_s(run, 1))
}

/// Seconds that one call takes, over so many calls.
fn seconds(calls: u64, mut call: impl FnMut()) -> f64 {
    #[allow(clippy::disallowed_methods, reason = "a benchmark is about the clock")]
    let started = Instant::now();
    for _ in 0..calls {
        call();
    }
    started.elapsed().as_secs_f64() / calls as f64
}

fn median(mut repeat: impl FnMut() -> f64) -> f64 {
    let mut values: Vec<f64> = (0..REPEATS).map(|_| repeat()).collect();
    values.sort_by(f64::total_cmp);
    values[REPEATS / 2]
}
