//! Causes: `diagnose` names each fault that is planted in the driving system, from the crashes that it makes.

use std::sync::Arc;

use avastra::ads::{ModularConfig, Module};
use avastra::episode::{EpisodeLog, Script};
use avastra::model::Space;
use avastra::oracle;
use avastra::oracle::{Diagnosis, Fate, Found, Replayed, Verdict};
use avastra::run::{Profile, Run};

use crate::cases::root;
use crate::profiles::profile;
use crate::world::{read, run_of, under};

/// Episodes on each road.
const EPISODES: u32 = 50;
/// A fault, and where one of its crashes is found.
struct Planted {
    /// The fault is shipped as `scenarios/ads/faults/NAME.yaml`; its name begins with the module at fault.
    name: &'static str,
    space: &'static str,
    /// The search for a crash begins at this episode.
    begin: usize,
    /// Of the run. In `step_out` few episodes need the second hypothesis.
    seed: u64,
}

/// Random search finds most of them in the shipped space. The others need a narrow road, a leader that brakes,
/// or pedestrians that step out: the spaces of `tests/cases/faults` have these. Other shipped faults are missing.
/// Late steering costs a lane's width only in bends. Lane-bound prediction decides no crash, because a vehicle
/// that leaves its lane is in the way very soon after the moment at which a better prediction would know. A bus
/// that splits is still kept clear of, because both of its parts are. Perception that hangs is noticed, and the
/// vehicle brakes until it is back. Emergency braking that is off or late decides no crash, since the planner's fallback
/// brakes at once.
const PLANTED: [Planted; 17] = [
    planted("control_weak_brakes", "tests/cases/faults/leader.ava", 0),
    planted("latency_half_second", "tests/cases/faults/leader.ava", 0),
    planted("latency_unwatched", "tests/cases/faults/step_out.ava", 0),
    planted("localization_bias", "tests/cases/faults/oncoming.ava", 0),
    planted("localization_noise", SHIPPED, 50),
    planted("perception_blind_to_large_vehicles", SHIPPED, 50),
    planted("perception_blind_to_pedestrians", SHIPPED, 0),
    planted("perception_dropouts", SHIPPED, 0),
    planted("perception_flicker", SHIPPED, 50),
    planted("perception_half_range", "tests/cases/faults/leader.ava", 0),
    planted("planning_never_yields", SHIPPED, 50),
    planted("planning_tailgates", "tests/cases/faults/leader.ava", 0),
    planted("prediction_frozen", SHIPPED, 0),
    Planted { seed: 5, ..planted("prediction_one_hypothesis", "tests/cases/faults/step_out.ava", 0) },
    planted("tracking_late", "tests/cases/faults/step_out.ava", 0),
    planted("tracking_merges", SHIPPED, 0),
    planted("tracking_no_velocity", SHIPPED, 50),
];
const SHIPPED: &str = "scenarios/avastra45.ava";

const fn planted(name: &'static str, space: &'static str, begin: usize) -> Planted {
    Planted { name, space, begin, seed: 3 }
}

/// Number of replays of a crash with other noise. At least a third of them must crash too: a fault's crash is no accident.
const REPLAYS: u32 = 6;

/// Small changes in every module, so that the cause is not simply the one module that differs from the default.
const DECOYS: &str = "tests/cases/faults/decoys.yaml";

/// Crashes of a profile that are looked at, at most.
const CRASHES: usize = 3;

#[test]
fn the_module_at_fault_is_named() {
    let decoys = profile(DECOYS);
    let mut wrong = Vec::new();
    for Planted { name, space, begin, seed } in PLANTED {
        let module = module_of(name);
        let usual = run_of(made(space), EPISODES, seed, &[]);
        let planted = decoys.with_module_of(module, &fault(name));
        let run = under(&usual, |conditions| conditions.profile = Some(Profile::new(&planted)));
        let crashes = (begin..run.episodes()).filter_map(|number| crash(&run, number, module));
        let mut named = crashes.take(CRASHES).map(|(number, log, index)| {
            let found = oracle::diagnose(
                &run.setup(number),
                &log,
                Found::Collision(index),
                &ModularConfig::default(),
            );
            (number, found.expect("it has modules").cause)
        });
        // What is not told apart from chance, or from another module's part in it, is no mistake; but one of the crashes
        // must be told.
        let is_tied = |cause: &[Module]| cause.len() > 1 && cause.contains(&module);
        match named.find(|(_, cause)| !cause.is_empty() && !is_tied(cause)) {
            Some((_, cause)) if cause == [module] => {}
            found => wrong.push(format!("{name}: {found:?}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A module that is as in the baseline is never blamed, and the verdict follows from the table, also if no module differs.
#[test]
fn what_is_as_in_the_baseline_is_not_blamed() {
    let degraded = profile("scenarios/ads/degraded.yaml");
    let planted = degraded.with_module_of(Module::Perception, &fault("perception_flicker"));
    let default = ModularConfig::default();
    let usual = run_of(made(SHIPPED), EPISODES, 3, &[]);
    let run = under(&usual, |conditions| conditions.profile = Some(Profile::new(&planted)));
    let mut diagnosed = 0;
    for number in 0..run.episodes() {
        let (summary, log) = run.judged(number);
        let Some(index) = summary.collisions.iter().find(|finding| finding.counted) else { continue };
        let (setup, index) = (run.setup(number), index.number);
        let against = |baseline: &ModularConfig| {
            oracle::diagnose(&setup, &log, Found::Collision(index), baseline).expect("it has modules")
        };
        let found = against(&default);
        let as_default = |module: &Module| planted.with_module_of(*module, &default) == planted;
        assert!(!found.cause.iter().any(as_default), "episode {number}: {found:?}");
        assert!(found.evidence.differs() && follows(&found), "episode {number}: {found:?}");
        let own = against(&planted);
        assert!(!own.evidence.differs() && follows(&own), "episode {number}: {own:?}");
        diagnosed += 1;
        if diagnosed == CRASHES {
            return;
        }
    }
    panic!("{diagnosed} crashes in {} episodes", run.episodes());
}

/// Whether a verdict follows from the table that is printed above it.
fn follows(found: &Diagnosis) -> bool {
    let evidence = &found.evidence;
    let told_apart: Vec<Module> = evidence.told_apart().map(|found| found.module).collect();
    let excess = |module: Module| {
        let own = evidence.measured.iter().find(|measure| measure.module == module);
        own.map_or(0.0, |measure| measure.excess())
    };
    match (found.verdict, found.cause.as_slice()) {
        (Verdict::Outside | Verdict::Deciding, named @ [_, ..]) => {
            named.iter().all(|module| told_apart.contains(module))
        }
        (Verdict::Weakness, [_]) => found.weakness.is_some(),
        (Verdict::Measured, [module]) => excess(*module) > 1.0 && told_apart.contains(module),
        (Verdict::Brittle, [Module::Planning]) => told_apart.iter().all(|module| excess(*module) <= 1.0),
        (Verdict::Together, [_, _]) => !evidence.pairs.is_empty(),
        (Verdict::Baseline, []) => evidence.baseline.is_some_and(|fate| fate != Fate::Vanished),
        (Verdict::Chance, []) => evidence.chance.is_some() && told_apart.is_empty(),
        (Verdict::Unexplained, []) => evidence.chance.is_none(),
        _ => false,
    }
}

/// A space in which obstacles may be unavoidable; the notes about that are no mistakes here.
fn made(name: &str) -> Arc<Space> {
    let loaded = avastra::check::load(&root().join(name), &read).expect("it is there");
    assert!(!loaded.diagnostics.iter().any(|found| found.is_error()), "{name}: {:?}", loaded.diagnostics);
    loaded.space.expect("a space without mistakes is a space")
}

/// The counted collision of an episode, if the fault makes it: with the default settings of the faulty module
/// it vanishes, and other noise does not remove it.
fn crash(run: &Run, number: usize, module: Module) -> Option<(usize, EpisodeLog, usize)> {
    let (summary, log) = run.judged(number);
    let index = summary.collisions.iter().find(|finding| finding.counted)?.number;
    let setup = run.setup(number);
    let planted = setup.ads.profile().expect("it has modules");
    let healthy = planted.with_module_of(module, &ModularConfig::default());
    let fate = oracle::fate(&setup, &log, Found::Collision(index), &healthy).expect("it has modules");
    let again = || {
        Replayed::new(&setup, &Script::of_log(&log), &log).is_again_in(
            Found::Collision(index),
            REPLAYS / 3,
            REPLAYS,
        )
    };
    (fate == Fate::Vanished && again()).then_some((number, log, index))
}

/// A shipped fault.
fn fault(name: &str) -> ModularConfig {
    profile(&format!("scenarios/ads/faults/{name}.yaml"))
}

/// The module that the name of a fault begins with.
fn module_of(name: &str) -> Module {
    let module = Module::ALL.into_iter().find(|module| name.starts_with(module.name()));
    module.unwrap_or_else(|| panic!("{name} begins with no module"))
}
