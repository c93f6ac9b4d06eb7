//! Marks: how fast avastra is on this machine, one line `mark NAME VALUE UNIT` each.
//!
//! A mark is the median of several repeats, per CPU second of this process where there is such a clock, so that
//! a busy machine changes little; only the mark of two cores uses the wall clock. `cargo bench --bench marks --
//! WORD` measures only the marks whose name contains the word. Build time and memory of a whole process are not
//! measured here.
//!
//! For comparison, on one core of the same kind of machine (Zen 3, 2.4 GHz nominal), per CPU second.
//! What a tick includes differs between simulators. Ours includes sensing, the driving system, ten obstacles
//! with their behaviour, swept contacts and the collision probability, at 50 Hz:
//!
//! | simulator | a tick or step | per s | source |
//! |---|---|---|---|
//! | highway-env 1.12.1 | 10 others, 20 Hz: dynamics, behaviour, collisions | 420 | measured |
//! | MetaDrive 0.4.3 | 13 vehicles, 50 Hz, with lidar | 360 | measured |
//! | Scenic 3.1.1, Newtonian | 3 actors, 10 Hz | 409 | measured |
//! | SUMO 1.28 | 23 vehicles, 10 Hz, all read back; no dynamics in the plane | 6,270 | measured |
//! | PufferLib 3.0.0, C, native | 14 agents, 27 logged cars, 10 Hz; no behaviour | 31,000 | measured |
//! | GPUDrive | agents x steps, on one GPU | 1,000,000 | arXiv 2408.01584 |
//! | this machine's floor | 10 bicycles and 45 pairs of boxes, nothing else, f64 with libm | 4,000,000 | measured |

mod clock;

use std::alloc::{GlobalAlloc, Layout, System};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use avastra::action::{ActionTable, Effect, SpawnRequest};
use avastra::ads::external::{ExternalSettings, Observation, Program, Target};
use avastra::check::ReadError;
use avastra::editor::{Files, Workspace, diagnostics};
use avastra::mdp::ProcKind;
use avastra::model::Space;
use avastra::model::vocabulary::{LaneChoice, Level, Side, TimeOfDay, Verb};
use avastra::run::{Arena, Conditions, Run, RunSettings};
use avastra::sim::{Scene, Sensed, Start, TrafficProfile, World};
use avastra::{ads, episode};

use clock::cpu_s;

const REPEATS: usize = 7;
/// Ticks of one repeat: six seconds of traffic.
const TICKS: u64 = 300;
/// Episodes of one repeat of the scaling mark.
const EPISODES: u32 = 24;

fn main() {
    let space = load();
    let scene = Arc::new(Scene::of(&space.roads[0]));
    let world = crowded(&scene);
    println!("# {} obstacles around the ego vehicle", world.obstacles().len());
    for name in ["modular", "frenet", "reactive", "idm"] {
        mark(&format!("ticks_per_s_{name}"), "ticks/s", || ticks_per_s(&world, &scene, name));
    }
    for name in ["modular", "frenet", "reactive", "idm"] {
        mark(&format!("allocations_per_tick_{name}"), "", || {
            let mut drive = Drive::new(&world, &scene, name);
            // Buffers grow during the first frames.
            (0..TICKS).for_each(|_| drive.tick());
            allocated(|| (0..TICKS).for_each(|_| drive.tick())).0 as f64 / TICKS as f64
        });
    }
    mark("world_bytes", "bytes", || {
        let (_, heap) = allocated(|| drop(black_box(world.clone())));
        heap as f64 + size_of::<World>() as f64
    });
    mark("snapshot", "us", || median(|| seconds(10_000, || drop(black_box(world.clone())))) * 1e6);
    mark("parse_check_table", "ms", || {
        median(|| seconds(1, || drop(black_box(ActionTable::new(load()))))) * 1e3
    });
    mark("keystroke_to_diagnostics", "ms", || {
        let mut editing = Editing::new();
        median(|| seconds(5, || editing.keystroke())) * 1e3
    });
    let attached = Attached::new(&space);
    mark("external_round_trips_per_s", "/s", || median(|| attached.round_trips_per_s()));
    mark("external_share_of_episode", "", || median(|| attached.share()));
    let run = run(space);
    mark("episodes_per_s", "episodes/s", || median(|| episodes_per_s(&run)));
    mark("episodes_two_cores_over_one", "x", || {
        // The two are measured in turn, so that a machine that changes its speed changes both.
        median(|| two_cores_over_one(&run))
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
    let read = |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
    avastra::check::load(&path, &read).expect("it is shipped").space.expect("the shipped space is sound")
}

/// A world with as many obstacles as find room, at most ten.
fn crowded(scene: &Arc<Scene>) -> World {
    let start = Start {
        reactions: 0,
        reactions_from_s: 0.0,
        ego_mps: avastra::model::START_MPS,
        time: TimeOfDay::Noon,
        sky: [Level::None; 3],
        signal_phase_s: 0.0,
        seed: 1,
        ambient: 0,
        traffic: TrafficProfile::default(),
    };
    let mut world = World::new(scene.clone(), &start);
    let verbs = [Verb::DriveAhead, Verb::DriveOpposite, Verb::Overtake, Verb::Walk];
    for distance_m in [8.0, 15.0, 22.0, 30.0, 38.0, 46.0, 54.0, 62.0, 70.0, 90.0] {
        for verb in verbs {
            for lane in [LaneChoice::Current, LaneChoice::Right] {
                if world.obstacles().len() == 10 {
                    return world;
                }
                let speed_mps = if verb == Verb::Walk { 1.2 } else { 9.0 };
                let asked = SpawnRequest::new(verb, distance_m, speed_mps);
                let request = SpawnRequest { lane, side: Side::Left, ..asked };
                // A place that is taken does not matter: there are more places than needed.
                let _ = world.apply(&Effect::Spawn(request));
            }
        }
    }
    world
}

/// The shipped files, for an editor that has one of them open.
struct Shipped;

impl Files for Shipped {
    fn read(&self, path: &Path) -> Result<String, ReadError> {
        std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()))
    }

    fn below(&self, _: &Path) -> Vec<PathBuf> {
        Vec::new()
    }

    fn nearby(&self, _: &Path) -> Vec<(String, String)> {
        Vec::new()
    }

    fn entries(&self, _: &Path) -> Vec<(String, bool)> {
        Vec::new()
    }
}

/// Edits of the 45-action space, whose four maps the workspace has read already.
struct Editing {
    workspace: Workspace,
    path: PathBuf,
    text: String,
    keystrokes: u64,
}

impl Editing {
    fn new() -> Editing {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/avastra45.ava");
        let text = std::fs::read_to_string(&path).expect("it is shipped");
        let mut editing = Editing { workspace: Workspace::new(Shipped), path, text, keystrokes: 0 };
        editing.workspace.open(editing.path.clone(), editing.text.clone());
        black_box(diagnostics::all(&mut editing.workspace));
        editing
    }

    /// Changes a digit in the range of a parameter, from the text to its mistakes. Never inlined, so that a
    /// profiler can be told to count this and nothing else.
    #[inline(never)]
    fn keystroke(&mut self) {
        self.keystrokes += 1;
        let text = self.text.replacen("1 m .. 120 m", &format!("1 m .. {} m", 120 + self.keystrokes), 1);
        self.workspace.open(self.path.clone(), text);
        let found = black_box(diagnostics::all(&mut self.workspace));
        assert!(found.contains_key(&self.path), "the document has its list");
    }
}

/// A driving system in a world of its own.
struct Drive {
    world: World,
    driver: Box<dyn ads::Ads>,
    sensed: Sensed,
    most: f64,
}

impl Drive {
    fn new(world: &World, scene: &Arc<Scene>, name: &str) -> Drive {
        let entry = ads::by_name(name).expect("it is registered");
        Drive { world: world.clone(), driver: (entry.build)(scene, 1), sensed: world.sensed(), most: 0.0 }
    }

    /// A whole tick: sensing, driving, moving, contacts, collision probability. Never inlined, so that
    /// a profiler can be told to count this and nothing else.
    #[inline(never)]
    fn tick(&mut self) {
        self.world.sense(&mut self.sensed);
        self.world.tick(&self.driver.drive(&self.sensed));
        let now = ProcKind::Avastra.danger(&self.world, &|_| false);
        self.most = self.most.max(now.map_or(0.0, |danger| danger.probability));
    }
}

fn ticks_per_s(world: &World, scene: &Arc<Scene>, name: &str) -> f64 {
    let repeat = || {
        let mut drive = Drive::new(world, scene, name);
        let took = seconds(TICKS, || drive.tick());
        black_box(drive.most);
        took
    };
    1.0 / median(repeat)
}

/// Number and bytes of the allocations that a call makes, on all threads.
fn allocated(call: impl FnOnce()) -> (u64, u64) {
    let counts = || (CALLS.load(Ordering::Relaxed), BYTES.load(Ordering::Relaxed));
    let before = counts();
    call();
    let after = counts();
    (after.0 - before.0, after.1 - before.1)
}

/// The system's allocator, and a count of what it is asked for.
struct Counting;

static CALLS: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: everything is the system allocator's; growing goes through `alloc`, as the trait has it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size() as u64, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from the same allocator above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// A driving system in another process: the toy, with accelerations, which sees the truth.
struct Attached {
    program: Arc<Program>,
    arena: Arena,
}

impl Attached {
    fn new(space: &Arc<Space>) -> Attached {
        let words = [env!("CARGO_BIN_EXE_avastra"), "ads", "toy"].map(str::to_owned);
        let settings = ExternalSettings {
            observation: Observation::Truth,
            ..ExternalSettings::of(Target::Program(words.to_vec()))
        };
        let program = Program::new(settings);
        let roads = [space.roads[0].name.clone()];
        let ads = ads::Selected::external(Arc::clone(&program));
        let table = ActionTable::new(Arc::clone(space));
        let arena = Arena::new(table, &roads, ads, &[], &[]).expect("the road is there");
        Attached { program, arena }
    }

    /// An episode without actions: how many questions, and wall time with the process and with known answers, s.
    fn episode(&self) -> (f64, f64, f64) {
        let drive = || {
            #[allow(clippy::disallowed_methods, reason = "a benchmark is about the clock")]
            let start = Instant::now();
            let setup = self.arena.setup(0, 1);
            let log = episode::run(&setup, &mut |_| episode::Choice::Pass);
            assert!(log.failure.is_none(), "{:?}", log.failure);
            let questions = log.conversation.map_or(0, |conversation| conversation.exchanges.len());
            (questions as f64, start.elapsed().as_secs_f64())
        };
        self.program.forget();
        let (questions, asked_s) = drive();
        (questions, asked_s, drive().1)
    }

    fn round_trips_per_s(&self) -> f64 {
        let (questions, asked_s, known_s) = self.episode();
        questions / (asked_s - known_s).max(1e-9)
    }

    fn share(&self) -> f64 {
        let (_, asked_s, known_s) = self.episode();
        1.0 - known_s / asked_s
    }
}

fn run(space: Arc<Space>) -> Run {
    let conditions = Conditions { roads: vec![space.roads[0].name.clone()], ..Conditions::of(&space) };
    let settings = RunSettings::new(conditions, "random", EPISODES, 1);
    Run::new(ActionTable::new(space), settings).expect("the settings name what exists")
}

fn episodes_per_s(run: &Run) -> f64 {
    f64::from(EPISODES) / seconds(1, || play(run, 1))
}

/// By the wall clock: how much faster two threads are than one.
fn two_cores_over_one(run: &Run) -> f64 {
    let wall_s = |jobs| {
        #[allow(clippy::disallowed_methods, reason = "a benchmark is about the clock")]
        let started = Instant::now();
        play(run, jobs);
        started.elapsed().as_secs_f64()
    };
    wall_s(1) / wall_s(2)
}

fn play(run: &Run, jobs: usize) {
    let numbers: Vec<usize> = (0..EPISODES as usize).collect();
    avastra::run::play::<()>(run, &numbers, jobs, &AtomicBool::new(false), &mut |_, _| Ok(()))
        .expect("nothing here fails");
}

/// Simulated seconds that one core plays in a second.
fn real_time_factor(run: &Run) -> f64 {
    let simulated_s: f64 = (0..EPISODES as usize).map(|number| run.episode(number).duration_s).sum();
    simulated_s / f64::from(EPISODES) * median(|| episodes_per_s(run))
}

/// Seconds for one call, as the mean of so many calls.
fn seconds(calls: u64, mut call: impl FnMut()) -> f64 {
    let started_s = cpu_s();
    for _ in 0..calls {
        call();
    }
    (cpu_s() - started_s) / calls as f64
}

fn median(mut repeat: impl FnMut() -> f64) -> f64 {
    let mut values: Vec<f64> = (0..REPEATS).map(|_| repeat()).collect();
    values.sort_by(f64::total_cmp);
    values[REPEATS / 2]
}
