//! Causes: faults planted in the driving system are found again by the crashes that they make.

use std::path::PathBuf;

use avastra::ads::ModularConfig;
use avastra::ads::Module;
use avastra::episode::EpisodeLog;
use avastra::oracle;
use avastra::oracle::Fate;
use avastra::study::Profile;
use avastra::study::Run;
use avastra::study::RunSettings;

use crate::cases::root;
use crate::world::run;

/// Episodes on each road in which a fault must make a crash.
const EPISODES: u32 = 50;
/// Where the search begins, so that it is short; it goes on through all episodes.
const BEGIN: [(&str, usize); 0] = [];
/// Small variations of a crash, half of which at least must crash, too: a fault's crash is no accident.
const VARIATIONS: u32 = 6;

/// Every module a little other than it comes, so that a cause is not told by what differs alone.
const DECOYS: &str = "
localization: { position_sigma_m: 0.06 }
perception: { range_factor: 0.95, latency_frames: 2 }
tracking: { velocity_factor: 0.98 }
prediction: { lateral_speed_mps: 0.5 }
planning: { acceleration_mps2_max: 1.8, nudge_buffer_m: 0.35 }
control: { actuators: { brake_mps2_max: 8.0 } }
";

#[test]
fn the_module_at_fault_is_named() {
    let decoys = ModularConfig::from_yaml(DECOYS).expect("they are settings");
    let usual = run(EPISODES, 3, &[]);
    let (mut tried, mut named) = (0, 0);
    for (name, fault) in faults() {
        let module = module_of(&name);
        let planted = decoys.with_module_of(module, &fault);
        let settings = RunSettings { profile: Some(Profile::new(&planted)), ..usual.settings().clone() };
        let run = Run::new(usual.table().clone(), settings).expect("the settings name what exists");
        let begin = BEGIN.iter().find(|(known, _)| *known == name).map_or(0, |(_, number)| *number);
        let numbers = (begin..run.episodes()).chain(0..begin);
        let Some((number, log, index)) = numbers.filter_map(|number| crash(&run, number, &decoys)).next()
        else {
            eprintln!("{name}: no crash");
            continue;
        };
        tried += 1;
        let cause = oracle::diagnose(&run.setup(number), &log, index, &ModularConfig::default());
        let cause = cause.expect("it has modules").cause;
        eprintln!("{name}: {number} {cause:?}");
        named += usize::from(cause == [module]);
    }
    eprintln!("{named} of {tried}");
}

/// The counted collision of an episode, if the fault makes it: it is no accident, and without the fault
/// there is none.
fn crash(run: &Run, number: usize, healthy: &ModularConfig) -> Option<(usize, EpisodeLog, usize)> {
    let (summary, log) = run.judged(number);
    let index = summary.collisions.iter().find(|finding| finding.counted)?.number;
    let setup = run.setup(number);
    let fate = oracle::fate(&setup, &log, index, healthy).expect("it has modules");
    let likely = || 2 * oracle::likelihood(&setup, &log, index, VARIATIONS).crashes >= VARIATIONS;
    (fate == Fate::Vanished && likely()).then_some((number, log, index))
}

/// Every shipped fault; its file's name begins with the module at fault.
fn faults() -> Vec<(String, ModularConfig)> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(root().join("scenarios/ads/faults"))
        .expect("it is shipped")
        .map(|entry| entry.expect("it reads").path())
        .collect();
    files.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("it is readable");
        let name = path.file_stem().expect("it has a name").to_string_lossy().into_owned();
        (name, ModularConfig::from_yaml(&text).expect("it is a profile"))
    };
    files.into_iter().map(read).collect()
}

fn module_of(name: &str) -> Module {
    let module = Module::ALL.into_iter().find(|module| name.starts_with(module.name()));
    module.unwrap_or_else(|| panic!("{name} begins with no module"))
}
