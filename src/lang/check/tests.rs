//! The result of checking a file. `tests/cases/diagnostics` tests the messages about broken files.

use std::path::Path;
use std::sync::Arc;

use crate::check::state_argument::memory_from;
use crate::check::{KnownSpaces, Loaded, ReadError, differences, load, load_among, suggest_uses};
use crate::model::rules::RowRules;
use crate::model::vocabulary::{Body, Priority, Word};
use crate::model::{
    Avoidability, BodyWord, Claim, Facts, Memory, Obstacle, ObstacleKind, OutcomeFacts, Reach, RulesInForce,
    Space, Value, code, evaluate,
};
use crate::syntax::{Style, render};

/// A small sound space; tests put declarations of their own after it.
const BASE: &str = "language 1
enum Time = Morning | Noon | Night
enum Sky = Rain | Fog | Wetness
enum Level = None < Light < Moderate < High
enum Lane = Left | Current | Right
enum Side = Left | Right
enum Vehicle = Jeep | BoxTruck
state time: Time = any
state sky: Sky -> Level = None
fn gap(v: Speed) -> Length = 12 m + v * 0.5 s
action set_time(each to: Time) { set time = to }
action ahead(each lane: Lane, any vehicle: Vehicle, any speed: Speed in 10 m/s .. 20 m/s, any distance: Length in 1 m .. 120 m) {
  spawn vehicle ahead distance { lane: lane, speed: speed, does: DriveAhead }
}
road corner {
  map: \"corner.xodr\"
  start: lane 1/-1 at 105.88 m
  goal: lane 5/-3 at 75.27 m
}
";

/// Loads files given as `(name, text)`; the first is the root.
fn load_files(files: &[(&str, &str)]) -> Loaded {
    load(Path::new(files[0].0), &|path| read(files, path)).unwrap()
}

/// The text of a file, or of the map that the repository ships.
fn read(files: &[(&str, &str)], path: &Path) -> Result<String, ReadError> {
    let map = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/roads/corner.xodr");
    match files.iter().find(|(name, _)| Path::new(name) == path) {
        Some((_, text)) => Ok((*text).to_owned()),
        None if path.ends_with("corner.xodr") => Ok(std::fs::read_to_string(map).unwrap()),
        None => Err(ReadError::missing("no such file")),
    }
}

/// Loads a file that declares more than `BASE`.
fn based(more: &str) -> Loaded {
    load_files(&[("a.ava", &format!("{BASE}{more}"))])
}

/// The space of what was loaded, which has no mistakes.
fn space_of(loaded: &Loaded) -> Arc<Space> {
    loaded.space.clone().unwrap_or_else(|| panic!("{}", shown(loaded)))
}

fn cell(space: &Space, state: &str) -> usize {
    space.state(state).expect("it is declared").first_cell
}

fn action(space: &Space, name: &str) -> usize {
    space.actions.iter().position(|action| action.name == name).expect("it is declared")
}

/// The result of a function of one number.
fn called(space: &Space, function: &str, argument: f64) -> f64 {
    let function = space.functions.iter().find(|known| known.name == function).expect("it is declared");
    let locals = [Value::Number(argument)];
    evaluate(&function.body, &space.functions, &Facts::new(&locals, &Memory::default())).number()
}

fn codes(loaded: &Loaded) -> Vec<&'static str> {
    // `BASE` declares more than each test uses.
    let all = loaded.diagnostics.iter().map(|found| found.code);
    all.filter(|code| *code != code::UNUSED).collect()
}

fn shown(loaded: &Loaded) -> String {
    let all: Vec<String> =
        loaded.diagnostics.iter().map(|found| render(found, &loaded.sources, Style::Plain)).collect();
    all.join("\n")
}

const SCENARIO: &str = "language 1
use \"a.ava\"
scenario s {
  origin { seed: 7, episode: 412, policy: \"random\", ads: \"modular\", engine: \"plane/1\" }
  road: corner
  start { time: Noon, sky: { Rain: High }, signal_phase: 12.5 s, traffic_seed: 18446744073709551615 }
  steps {
    0: set_time(to: Night)
    1: wait()
    2: ahead(lane: Left) with { vehicle: BoxTruck, speed: 11.25 m/s, distance: 20.1 m }
  }
  expect collision with npc#2 at 14.22 s
  expect counted with npc#2
  expect avoidable by [cc, fsm] with npc#2
  expect proc == [0.0, 0.125]
  expect trace == \"sha256:abababababababababababababababababababababababababababababababab\"
  expect end == arrived
}
";

const CLOCK: &str = "rule chronology on time {
  Morning -> Morning | Noon
  Noon -> Noon | Night
  Night -> Night | Morning
}
verdict counted: collision and not repeated
";

#[test]
fn scenarios_are_read() {
    let space = format!("{BASE}{CLOCK}");
    let loaded = load_files(&[("s.ava", SCENARIO), ("a.ava", &space)]);
    assert!(codes(&loaded).is_empty(), "{}", shown(&loaded));
    let (space, scenario) = (loaded.space.unwrap(), loaded.scenario.unwrap());
    assert_eq!(space.path, Path::new("a.ava"));
    assert_eq!(scenario.origin.seed, Some(7));
    assert_eq!(scenario.start.traffic_seed, Some(u64::MAX));
    let rows: Vec<Option<usize>> = scenario.steps.iter().map(|step| step.row).collect();
    assert_eq!(rows, [Some(2), None, Some(3)]);
    assert_eq!(scenario.steps[2].drawn[2].1.number(), 20.1);
    let npc = Obstacle { kind: ObstacleKind::Npc, number: 2 };
    let Claim::Collision { obstacle: Some(found), time: Some(time) } = &scenario.claims[0] else { panic!() };
    assert_eq!(*found, npc);
    assert!(time.rounds(14.2249) && !time.rounds(14.23));
    let by = Some(vec!["cc".to_owned(), "fsm".to_owned()]);
    let avoidable = Claim::Avoidability { class: Avoidability::Avoidable, by, obstacle: Some(npc) };
    assert_eq!(scenario.claims[2], avoidable);
    assert_eq!(scenario.claims.len(), 6);
}

/// Files that are loaded one after another with the same [`KnownSpaces`] give what each gives alone.
#[test]
fn a_space_that_is_known_changes_nothing() {
    let space = format!("{BASE}{CLOCK}");
    let broken = space.replace("gap(v: Speed)", "gap(v: Sped)");
    let wrong = SCENARIO.replace("road: corner", "road: other");
    let sealed = SCENARIO.replace("\"a.ava\"", "\"a.ava\" digest \"sha256:0\"");
    let further = format!("{SCENARIO}let more = 3 m\n");
    let without = SCENARIO.replace("\"a.ava\"", "\"a.ava\" without chronology");
    let elsewhere = SCENARIO.replace("\"a.ava\"", "\"broken.ava\"");
    let twice = format!("{SCENARIO}{}", SCENARIO.split_once("ava\"\n").unwrap().1);
    let roots = [
        SCENARIO,
        &wrong,
        &sealed,
        &further,
        &without,
        &elsewhere,
        &twice,
        "language 1\nlet",
        &space,
        SCENARIO,
    ];
    let mut known = KnownSpaces::default();
    let mut shared: Vec<Arc<Space>> = Vec::new();
    for root in roots {
        let files = [("s.ava", root), ("a.ava", space.as_str()), ("broken.ava", broken.as_str())];
        let alone = load_files(&files);
        let among = load_among(Path::new("s.ava"), &|path| read(&files, path), &mut known).unwrap();
        assert_eq!(shown(&among), shown(&alone), "{root}");
        assert_eq!(among.scenario, alone.scenario, "{root}");
        assert_eq!(among.references.pattern(), alone.references.pattern(), "{root}");
        assert_eq!(among.space.is_some(), alone.space.is_some(), "{root}");
        shared.extend(among.space.filter(|_| root == SCENARIO));
    }
    assert!(Arc::ptr_eq(&shared[0], &shared[1]), "the space was checked once");
}

/// A time is compared in the unit and to the decimals in which it is written.
#[test]
fn times_may_have_any_unit() {
    let space = format!("{BASE}{CLOCK}");
    let figure = |written: &str| {
        let scenario = SCENARIO.replace("at 14.22 s", &format!("at {written}"));
        assert_ne!(scenario, SCENARIO);
        let loaded = load_files(&[("s.ava", &scenario), ("a.ava", &space)]);
        let scenario = loaded.scenario.clone().unwrap_or_else(|| panic!("{}", shown(&loaded)));
        let Claim::Collision { time: Some(time), .. } = &scenario.claims[0] else { panic!() };
        *time
    };
    for (written, is, is_not) in [
        ("0.401 min", 24.06, 24.1),
        ("24060 ms", 24.0604, 24.061),
        ("24.06 s", 24.062, 24.07),
        ("2406e-2 s", 24.062, 24.07),
        ("0.2406e2 s", 24.062, 24.07),
        ("24 s", 24.3, 24.6),
    ] {
        let figure = figure(written);
        assert!(figure.rounds(is) && !figure.rounds(is_not), "{written}: {figure:?}");
        assert!((figure.si() - is).abs() < 0.5, "{written}");
    }
}

#[test]
fn whole_numbers_beyond_those_of_states_are_refused() {
    let is_refused = |more: &str| codes(&based(more)).contains(&code::NUMBER);
    let most = "9007199254740991";
    assert!(!is_refused(&format!("state far: Int = {most}\nstate near: Int = -{most}")));
    assert!(!is_refused(&format!("let far = {most}")));
    // 2^53 + 1 is no f64: rounded, it would pass for 2^53.
    for beyond in ["9007199254740992", "9007199254740993", "-9007199254740992"] {
        assert!(is_refused(&format!("state far: Int = {beyond}")), "{beyond}");
        assert!(is_refused(&format!("let far = {beyond}")), "{beyond}");
    }
    assert!(is_refused(&format!("let far = {most}\nstate sum: Int = far + 1")));
    assert!(is_refused("state far: Ratio = 9007199254740993.0"));
    let range = format!("let far = {most}\naction add(each n: Int in far .. far + 1) {{ set time = Noon }}");
    assert!(is_refused(&range));
    assert!(is_refused("action add(each n: Int in 1 .. 9007199254740993) { set time = Noon }"));
}

#[test]
fn words_of_other_places_get_the_one_that_is_meant() {
    for (more, hint) in [
        ("rule late on set_time: time == \"Noon\"", "write `Noon`: words stand without quotes"),
        ("verdict counted: crash", "write `collision`"),
    ] {
        let told = shown(&based(more));
        assert!(told.contains(hint), "{told}");
    }
}

#[test]
fn a_spawn_out_of_bounds_is_told_once() {
    let fly = "action fly() { spawn Jeep ahead 40 m { lane: Current, speed: 300 km/h, does: DriveAhead } }";
    let found = codes(&based(fly));
    assert!(found.contains(&code::OUT_OF_BOUNDS) && !found.contains(&code::UNDECIDED), "{found:?}");
}

#[test]
fn states_can_be_given_as_text() {
    let space = space_of(&based(""));
    let memory = memory_from(&space, "time: Night, sky: { Rain: High }", 0).unwrap();
    let (time, sky) = space.weather(&memory);
    assert_eq!(format!("{time:?} {sky:?}"), "Night [High, None, None]");
    let plain =
        space.plain_weather().into_iter().fold(memory, |memory, (cell, value)| memory.with(cell, value));
    assert_eq!(format!("{:?}", space.weather(&plain)), "(Noon, [None, None, None])");
    assert!(memory_from(&space, "}", 0).is_err());
}

#[test]
fn each_key_of_a_map_begins_and_moves_by_itself() {
    let space = space_of(&based(
        "state calm: Sky -> Bool = { Rain: any, Fog: true, _: false }
action shower(each how: Level) { set sky[Rain] = how }
action weather(each what: Sky) { set sky[what] = Light }
rule slow_rain on sky[Rain] {
  None -> None | Light
  Light -> Light | Moderate
  Moderate -> High | Light
  High -> Moderate
}
",
    ));
    let mut rains = [0, 0];
    for seed in 0..64 {
        let memory = space.initial_memory(seed);
        let cells = &memory.cells()[cell(&space, "calm")..];
        rains[cells[0].variant()] += 1;
        assert_eq!([cells[1].truth(), cells[2].truth()], [true, false]);
    }
    assert!(rains.iter().all(|count| *count > 10), "{rains:?}");
    let rule = space.rules.iter().position(|rule| rule.name == "slow_rain").expect("it is declared");
    let bound = space.rows.iter().filter(|row| row.rules.contains(&rule)).map(|row| row.label.as_str());
    let rows: Vec<&str> = bound.collect();
    let shower = ["None", "Light", "Moderate", "High"].map(|how| format!("shower(how: {how})"));
    let expected: Vec<&str> = shower.iter().map(String::as_str).chain(["weather(what: Rain)"]).collect();
    assert_eq!(rows, expected);
}

#[test]
fn what_every_step_does_comes_last_and_keeps_to_the_rules() {
    let space = space_of(&based(
        "state count: Int = 0
state rest: Int = 0
on ahead also { set count = count + 1, set rest = rest + 2 }
on ahead also { set count = count * 10 }
each step {
  set rest = match rest { 0 => 0  _ => rest - 1 }
  set sky[Wetness] = match sky[Wetness] { None => Light  Light => Moderate  _ => High }
}
rule never_soaked: sky[Wetness] <= Moderate
",
    ));
    let cell = |name: &str| cell(&space, name);
    let action = action(&space, "ahead");
    let locals = vec![Value::Bool(false); space.actions[action].parameters.len()];
    let after = space.memory_after(action, &locals, &space.initial_memory(0), None, None);
    assert_eq!(after.cells()[cell("count")], Value::Number(10.0));
    assert_eq!(after.cells()[cell("rest")], Value::Number(1.0));
    let (road, rules) = (&space.roads[0].facts, RulesInForce::by_default(&space));
    let wait = |memory: &Memory| space.memory_after_wait(memory, 1, Some(road), None, &rules);
    let waited = wait(&after);
    assert_eq!(waited.cells()[cell("rest")], Value::Number(0.0));
    assert_eq!(waited.cells()[cell("sky") + 2].variant(), 2);
    // Another level would break the rule, so nothing of it happens.
    assert_eq!(wait(&waited), waited);
}

#[test]
fn whole_numbers_choose_between_arms() {
    let space = space_of(&based(
        "state count: Int = 0
fn room(n: Int) -> Length = match n { 0 | 2 => 30 m  3 => 40 m  _ => 50 m }
action more() {
  set count = count + 1
  spawn Sedan ahead room(count) { lane: Current, speed: 5 m/s, does: DriveAhead }
}
rule not_too_often on more: count <= 2
",
    ));
    let rooms = [-1.0, 0.0, 1.0, 2.0, 3.0].map(|n| called(&space, "room", n));
    assert_eq!(rooms, [50.0, 30.0, 50.0, 30.0, 40.0]);
    let memory = space.memory_after(action(&space, "more"), &[], &space.initial_memory(0), None, None);
    assert_eq!(memory.cells()[cell(&space, "count")], Value::Number(1.0));
}

/// Rows share a proof if the values that decide it are equal: `copy` decides nothing, `time` only what a rule sees after
/// the step.
#[test]
fn a_row_that_shares_a_proof_has_its_own() {
    let text = format!(
        "{BASE}road outer {{ map: \"corner.xodr\", start: lane 1/-2 at 80 m, goal: lane 1/-2 at 100 m }}
        enum Does = DriveAhead | DriveOpposite
        action b(each copy: Int in 1 .. 3, each part: Int in 3 .. 4, each lane: Lane, each far: Bool, each to: Time, each does: Does,
                  any speed: Speed in 10 m/s .. 20 m/s) {{
          set time = to
          spawn Jeep ahead 30 m {{ lane: lane, speed: speed, does: does }}
        }}
        rule slow on b: speed <= part * 4 m/s and (lane in road.lanes or far)
        rule clock on b: time != Night or ego.speed <= 10 m/s
        rule moves on b: npc.speed >= 5 m/s and ego.junction_ahead >= 20 m
"
    );
    let loaded = load_files(&[("a.ava", &text)]);
    let space = loaded.space.as_ref().unwrap_or_else(|| panic!("{}", shown(&loaded)));
    let dead =
        space.rows.iter().filter(|row| row.roads.iter().any(|reach| matches!(reach, Reach::Dead { .. })));
    // On `outer`, a third of the lanes, unless the row is far.
    assert_eq!(dead.count(), 216 / 3 / 2);
    let in_force = RulesInForce::by_default(space);
    for row in &space.rows {
        for (road, reach) in space.roads.iter().zip(&row.roads) {
            let rules = RowRules { space, row, road: Some(&road.facts), in_force: &in_force };
            assert_eq!(rules.reach(), *reach, "{} on {}", row.label, road.name);
        }
    }
}

#[test]
fn rows_are_masked_only_where_they_are_dead() {
    let loaded = based(
        "road outer {\n  map: \"corner.xodr\"\n  start: lane 1/-2 at 80 m\n  goal: lane 1/-2 at 100 m\n}\n\
         rule lane_exists on ahead: lane in road.lanes\nexpect every(actions, realisable)\n",
    );
    assert!(codes(&loaded).is_empty(), "{}", shown(&loaded));
    assert!(loaded.remarks.iter().any(|remark| remark.code == "AV0402"), "{:?}", loaded.remarks);
    let space = loaded.space.unwrap();
    let masked = |road: usize| {
        let dead = space.rows.iter().filter(|row| matches!(row.roads[road], Reach::Dead { .. }));
        dead.map(|row| row.label.as_str()).collect::<Vec<_>>()
    };
    assert_eq!(masked(0), Vec::<&str>::new());
    assert_eq!(masked(1), ["ahead(lane: Right)"]);
}

#[test]
fn rewards_and_verdicts_are_computed() {
    let space = space_of(&based(
        "reward {\n collision => 7.5\n proc > 20 % => proc\n _ => -1\n}\nverdict counted: collision and not struck\n",
    ));
    let states = Memory::default();
    let quiet = OutcomeFacts { proc: 0.5, ..Default::default() };
    let crash = OutcomeFacts { collision: true, ..quiet };
    let hit = OutcomeFacts { struck: true, ..crash };
    assert_eq!(
        [crash, quiet, Default::default()].map(|outcome| space.reward(outcome, &states, &[])),
        [7.5, 0.5, -1.0]
    );
    assert_eq!([crash, quiet, hit].map(|outcome| space.counts(outcome, &states)), [true, false, false]);

    let space = space_of(&based("verdict counted: collision and avoidable\n"));
    let careless = OutcomeFacts { avoidable: true, ..crash };
    assert_eq!([crash, careless].map(|outcome| space.counts(outcome, &states)), [false, true]);
    assert_eq!(space.verdict("unknown", crash, &states), None);

    for (condition, expected) in [
        ("priority == ego", [true, false, false]),
        ("priority != ego", [false, true, true]),
        ("other == priority", [false, true, false]),
        ("priority in [ego, none]", [true, false, true]),
    ] {
        let space = space_of(&based(&format!("verdict counted: {condition}\n")));
        let counts = |priority| space.counts(OutcomeFacts { priority, ..crash }, &states);
        assert_eq!(Priority::ALL.iter().copied().map(counts).collect::<Vec<_>>(), expected, "{condition}");
    }
}

#[test]
fn a_space_without_a_verdict_counts_as_the_paper_does() {
    let scenario = SCENARIO.replace("expect trace", "expect counted\n  expect trace");
    let loaded = load_files(&[("s.ava", &scenario), ("a.ava", BASE)]);
    assert!(codes(&loaded).is_empty(), "{}", shown(&loaded));
    let space = space_of(&loaded);
    let crash = OutcomeFacts { collision: true, ..Default::default() };
    let states = Memory::default();
    let again = OutcomeFacts { repeated: true, ..crash };
    let sudden = OutcomeFacts { sudden: true, ..crash };
    let found = [crash, again, sudden, Default::default()].map(|outcome| space.counts(outcome, &states));
    assert_eq!(found, [true, false, false, false]);
}

#[test]
fn digests_cover_everything_that_is_used() {
    const ROOT: &str = "language 1\nuse \"parts/b.ava\"\n";
    const PART: &str = "language 1\nroad r {\n  map: \"../corner.xodr\"\n  start: lane 1/-1 at 105.88 m\n  goal: lane 5/-3 at 75.27 m\n}\n";
    let map = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/roads/corner.xodr");
    let map = std::fs::read_to_string(map).unwrap();
    let load_at = |folder: &str, root: &str, part: &str, map: &str| {
        let files = [("s.ava", root), ("a.ava", ROOT), ("parts/b.ava", part), ("corner.xodr", map)];
        let files = files.map(|(name, text)| (Path::new(folder).join(name).display().to_string(), text));
        load_files(&files.each_ref().map(|(name, text)| (name.as_str(), *text)))
    };
    let space =
        load_at("", "language 1\nuse \"a.ava\"\nuse \"parts/b.ava\" digest \"sha256:0\"\n", PART, &map);
    assert_eq!(codes(&space), ["AV0110"]);
    // The digest that `use` compares is the one that the space has when it is loaded as the root.
    let plain = load_at("", ROOT, PART, &map);
    assert!(plain.diagnostics.is_empty(), "{}", shown(&plain));
    let digest = {
        let loaded = load_at("", "language 1\nuse \"a.ava\" digest \"sha256:0\"\n", PART, &map);
        loaded.diagnostics[0].notes[0].rsplit(' ').next().unwrap().to_owned()
    };
    let user = format!("language 1\nuse \"a.ava\" digest \"{digest}\"\n");
    assert_eq!(codes(&load_at("", &user, PART, &map)), Vec::<&str>::new());
    assert_eq!(codes(&load_at("else/where", &user, PART, &map)), Vec::<&str>::new());
    assert_eq!(codes(&load_at("/far/away", &user, PART, &map)), Vec::<&str>::new());
    let shorter = PART.replace("75.27", "70");
    assert_eq!(codes(&load_at("", &user, &shorter, &map)), ["AV0110"]);
    assert_eq!(codes(&load_at("", &user, PART, &format!("{map}\n"))), ["AV0110"]);
    let moved = load_at("else/where", ROOT, PART, &map).space.unwrap();
    assert_eq!(moved.meaning, plain.space.unwrap().meaning);
}

#[test]
fn digests_cover_meaning_and_not_text() {
    let base = format!(
        "{BASE}let far = 17 m\nfn twice(x: Length) -> Length = 2 * x\n{CLOCK}rule g on ahead: distance <= far\n"
    );
    let meaning = |files: &[(&str, &str)]| space_of(&load_files(files)).meaning.clone();
    let of = |text: &str| meaning(&[("a.ava", text)]);
    let then = of(&base);
    let same = [
        ("a comment", base.replace("let far = 17 m", "// why\nlet far = 17 m // m")),
        ("documentation", base.replace("let far", "/// How far.\nlet far")),
        ("spaces", base.replace("let far = 17 m", "let  far\n = 17 m")),
        ("a claim", format!("{base}expect count(actions) == 6\n")),
        ("the order of helpers", {
            let far = "let far = 17 m\n";
            format!("{}{far}", base.replace(far, ""))
        }),
    ];
    for (what, text) in same {
        assert_eq!(of(&text), then, "{what}");
    }
    let (head, helpers) = ("language 1\n", "let far = 17 m\nfn twice(x: Length) -> Length = 2 * x\n");
    let body = base.replace(helpers, "").replace(head, "");
    let apart = [
        ("a.ava", &*format!("{head}use \"helpers.ava\"\n{body}")),
        ("helpers.ava", &*format!("{head}{helpers}")),
    ];
    assert_eq!(meaning(&apart), then, "helpers in a file of their own");
    let seal = then.seal();
    let other = [
        (base.replace("17 m", "13 m"), "changed or new: let `far`"),
        (base.replace("distance <= far", "distance < far"), "changed or new: rule `g`"),
        (base.replace("2 * x", "3 * x"), "changed or new: fn `twice`"),
        (format!("{base}rule h on ahead: distance > 1 m\n"), "changed or new: rule `h`"),
        (base.replace("rule g on ahead: distance <= far\n", ""), "1 declaration of then missing"),
    ];
    for (text, differences) in other {
        assert_eq!(of(&text).differences(&seal).as_deref(), Some(differences));
    }
    let without = [("b.ava", "language 1\nuse \"a.ava\" without g\n"), ("a.ava", &*base)];
    assert_eq!(meaning(&without).differences(&seal).as_deref(), Some("1 declaration of then missing"));
}

#[test]
fn what_is_left_out_takes_with_it_what_it_leaves_empty() {
    let base = format!("{BASE}{CLOCK}rule awake: time != Night\n");
    let own = |base: &str, text: &str| {
        let text = format!("language 1\nuse \"base.ava\" without {text}\n");
        load_files(&[("own.ava", &text), ("base.ava", base)])
    };
    let names = |loaded: &Loaded| -> Vec<String> {
        space_of(loaded).rules.iter().map(|rule| rule.name.clone()).collect()
    };
    assert!(names(&own(&base, "set_time")).iter().all(|name| name != "chronology" && name != "awake"));
    // A new action is bound by the rules that bound the action left out.
    let kept = names(&own(&base, "set_time\naction noon() { set time = Noon }"));
    assert!(["chronology", "awake"].iter().all(|rule| kept.iter().any(|name| name == rule)), "{kept:?}");
    let circle = format!("{base}group one = two\ngroup two = one\n");
    assert!(codes(&own(&circle, "one")).iter().all(|code| *code != "AV0101"));
}

#[test]
fn overrides_stand_where_the_old_one_stood() {
    let base = format!("{BASE}let far = 12 m\nlet near = far / 2\n{CLOCK}expect count(actions) == 6\n");
    let own = |text: &str| {
        let text = format!("language 1\nuse \"base.ava\"\n{text}\n");
        load_files(&[("own.ava", &text), ("base.ava", &base)])
    };
    // Constants may use each other in any order.
    let sound = own("let farther = 40 m\noverride let far = farther\noverride enum Lane = Left | Current\n\
         override fn gap(v: Speed) -> Length = near + v * 1 s\nrule g on ahead: distance <= gap(speed)\n\
         override rule chronology on time {\n Morning -> Night\n Noon -> Noon | Night\n Night -> Morning | Noon\n}\n\
         action extra() { set time = Night }\nexpect count(actions) == 6");
    let space = space_of(&sound);
    let labels: Vec<&str> = space.rows.iter().map(|row| row.label.as_str()).collect();
    assert_eq!(labels.len(), 6);
    assert_eq!(labels[3..], ["ahead(lane: Left)", "ahead(lane: Current)", "extra()"]);
    assert_eq!(space.rules[0].name, "chronology");
    // Two files that do not use each other cannot both override the same constant.
    let one = "language 1\nuse \"base.ava\"\noverride let far = 1 m\n";
    let both = "language 1\nuse \"one.ava\"\nuse \"two.ava\"\n";
    let found = load_files(&[("both.ava", both), ("one.ava", one), ("two.ava", one), ("base.ava", &base)]);
    assert_eq!(codes(&found), ["AV0112"], "{}", shown(&found));
    let last = "language 1\nuse \"one.ava\"\noverride let far = 2 m\n";
    let found = load_files(&[("last.ava", last), ("one.ava", one), ("base.ava", &base)]);
    assert_eq!(codes(&found), Vec::<&str>::new(), "{}", shown(&found));
}

/// Which file is named is in `snapshots/missing_use`.
#[test]
fn a_missing_use_can_be_added() {
    let mut loaded = load_files(&[("a.ava", "language 1\nlet far = wide + 1 m\n")]);
    suggest_uses(&mut loaded, &[("b.ava".to_owned(), "language 1\nlet wide = 3 m\n".to_owned())]);
    assert_eq!(loaded.diagnostics[0].fixes[0].text, "\nuse \"b.ava\"");
}

/// Such a call was dropped without a word, and its rule with it.
#[test]
fn an_argument_is_given_once() {
    for call in ["less(x: distance, x: 3 m)", "less(y: distance, 3 m)"] {
        let text = format!("fn less(x: Length, y: Length) -> Bool = x < y\nrule g on ahead: {call}\n");
        assert_eq!(codes(&based(&text)), ["AV0102"], "{call}");
    }
}

mod hostile {
    use proptest::prelude::*;

    use super::*;

    /// Deletes, doubles and swaps words, as the edits say.
    fn scrambled(text: &str, edits: Vec<(usize, usize, u8)>) -> String {
        let mut words: Vec<&str> = text.split(' ').collect();
        for (at, other, edit) in edits {
            let (at, other) = (at % words.len(), other % words.len());
            match edit {
                0 => {
                    words.remove(at);
                }
                1 => words[at] = words[other],
                _ => words.swap(at, other),
            }
        }
        words.join(" ")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// The texts that `tests/it/hostile.rs` makes up have next to no scenarios over a space that they may use.
        #[test]
        fn scrambled_scenarios_do_not_panic(edits in prop::collection::vec((0_usize..200, 0_usize..200, 0_u8..3), 1..4)) {
            let space = format!("{BASE}{CLOCK}");
            let loaded = load_files(&[("s.ava", &scrambled(SCENARIO, edits)), ("a.ava", &space)]);
            shown(&loaded);
        }
    }
}

#[test]
fn rules_of_the_first_step_bind_the_start() {
    let space = space_of(&based(
        "state dark: Bool = any
action switch(each to: Bool) { set dark = to }
rule begins: step == 0 implies dark
rule early: elapsed >= 12 s or dark
",
    ));
    let dark = cell(&space, "dark");
    let rules = RulesInForce::by_default(&space);
    for seed in 0..20 {
        let memory = space.memory_at_start(&space.roads[0], &rules, seed).expect("it may be dark");
        assert_eq!(memory.cells()[dark], Value::Bool(true), "seed {seed}");
    }
}

/// Red breaks the rule, and is drawn in 16 of 20 episodes. One in four of those, and one in four of all, has to begin
/// Green.
#[test]
fn what_is_drawn_again_keeps_its_odds() {
    let space = space_of(&based(
        "enum Colour = Red | Green | Blue
odds Colour { Red => 16, Blue => 3 }
state colour: Colour = any
action paint(each to: Colour where to != Red) { set colour = to }
rule no_red: colour != Red
",
    ));
    let (colour, rules) = (cell(&space, "colour"), RulesInForce::by_default(&space));
    let drawn =
        (0..400).map(|seed| space.memory_at_start(&space.roads[0], &rules, seed).expect("two are left"));
    let colours: Vec<usize> = drawn.map(|memory| memory.cells()[colour].variant()).collect();
    let of = |variant: usize| colours.iter().filter(|drawn| **drawn == variant).count();
    // Four standard deviations to each side.
    assert!(of(0) == 0 && (66..=134).contains(&of(1)), "{} red, {} green, {} blue", of(0), of(1), of(2));
}

/// Which key the rule reads is known at the start alone.
#[test]
fn all_keys_that_a_rule_may_read_are_drawn_again() {
    let base = BASE.replace("state sky: Sky -> Level = None", "state sky: Sky -> Level = any");
    for key in ["Rain", "Fog", "Wetness"] {
        let more = format!(
            "state at: Sky = {key}
action look(each to: Sky) {{ set at = to }}
action soak(each to: Level) {{ set sky[{key}] = to }}
rule bright: sky[at] == High
"
        );
        let space = space_of(&load_files(&[("a.ava", &format!("{base}{more}"))]));
        let (sky, rules) = (cell(&space, "sky"), RulesInForce::by_default(&space));
        for seed in 0..10 {
            let memory = space.memory_at_start(&space.roads[0], &rules, seed).expect("High is left");
            let at = memory.cells()[cell(&space, "at")].variant();
            assert_eq!(memory.cells()[sky + at].variant(), 3, "{key}, seed {seed}");
        }
    }
}

/// Only the world knows whether the ego vehicle is fast, so `check` does not refuse the scenario.
#[test]
fn a_scenario_is_not_refused_for_what_the_moment_decides() {
    let space = format!(
        "{BASE}state fast: Bool = false
each step {{ set fast = ego.speed > 3 m/s }}
rule only_when_fast on ahead: fast
"
    );
    let scenario = "language 1
use \"a.ava\"
scenario s {
  road: corner
  start { time: Noon }
  steps {
    1: ahead(lane: Left) with { vehicle: BoxTruck, speed: 11.25 m/s, distance: 20.1 m }
  }
}
";
    let loaded = load_files(&[("s.ava", scenario), ("a.ava", &space)]);
    assert!(!codes(&loaded).contains(&code::BROKEN_RULE), "{}", shown(&loaded));
}

/// After 256 proofs it is foreseen what the others take.
#[test]
fn a_thousand_small_proofs_are_not_too_many() {
    let loaded = based(
        "state n: Int = 100
action count(each x: Int in 1 .. 40, each y: Int in 1 .. 40) { set n = x + 41 * y }
rule some: n > 1
rule few: n < 1900
",
    );
    let space = space_of(&loaded);
    let rows = space.rows.iter().filter(|row| row.label.starts_with("count("));
    let open = rows.filter(|row| matches!(row.roads[0], Reach::Open(_))).count();
    assert_eq!(open, 1600, "{}", shown(&loaded));
}

#[test]
fn hit_and_near_name_bodies_of_ones_own() {
    let space = space_of(&based(
        "body Scooter { like: Motorcycle, length: 1.8 m }
reward {
  near == Scooter => 3
  hit in [Motorcycle, Sedan] => 2
  _ => 0
}
",
    ));
    let scooter = BodyWord { like: Body::Motorcycle, own: Some(0) };
    let reward = |hit: Option<BodyWord>, near: Option<BodyWord>| {
        space.reward(OutcomeFacts { hit, near, ..OutcomeFacts::default() }, &space.initial_memory(0), &[])
    };
    let motorcycle = BodyWord::engine(Body::Motorcycle);
    assert_eq!(reward(None, Some(scooter)), 3.0);
    assert_eq!(reward(None, Some(motorcycle)), 0.0);
    // A body that is like a motorcycle is one.
    assert_eq!(reward(Some(scooter), None), 2.0);
    assert_eq!(reward(Some(motorcycle), None), 2.0);
    assert_eq!(reward(Some(BodyWord::engine(Body::SUV)), None), 0.0);
    assert_eq!(space.body_name(scooter), "Scooter");
}

/// Long sums are read, checked and evaluated within the stack of a thread.
#[test]
fn the_longest_sums_are_checked() {
    let sum = format!("1 m{}", " + 1 m".repeat(128));
    let space = space_of(&based(&format!(
        "fn long(x: Length) -> Length = {}
rule far on ahead: long(distance) >= distance + {}
",
        sum.replace("1 m", "x"),
        sum.replacen(" + 1 m", "", 4)
    )));
    assert_eq!(called(&space, "long", 0.5), 64.5);
}

/// A file that only uses several others is a space: its claims, digest and differences are those of all of them.
#[test]
fn a_file_that_uses_several_is_a_space_of_its_own() {
    let with = |more: &str| {
        let first = format!("{BASE}expect count(actions) == 6\n");
        let root = "language 1\nuse \"a.ava\"\nuse \"b.ava\"\n";
        let more = format!("language 1\nstate calm: Bool = false\n{more}");
        load_files(&[("s.ava", root), ("a.ava", &first), ("b.ava", &more)])
    };
    let (one, other) = (with("action rest() { set calm = true }\n"), with(""));
    assert!(codes(&one).is_empty() && codes(&other).is_empty(), "{}", shown(&one));
    let space = one.space.as_ref().expect("it has no mistakes");
    assert_eq!((space.path.as_path(), space.rows.len()), (Path::new("s.ava"), 7));
    assert_eq!(differences(&other, &one).map(|found| found.len()), Some(2), "the action and its row");
}

/// `diff` tells every change of the digest, also one that changes neither a row nor a range.
#[test]
fn every_declaration_that_differs_is_told() {
    let more = "state calm: Bool = false
on ahead also { set calm = true }
each step { set calm = false }
rule calm_first on ahead: speed <= road.limit
rule roomy: spawn_gap >= safety_gap
reward {
  collision => 1
  _ => 0
}
";
    let loaded = |text: &str| load_files(&[("a.ava", text)]);
    let text = format!("{BASE}{CLOCK}{more}");
    let old = loaded(&text);
    assert!(codes(&old).is_empty(), "{}", shown(&old));
    let told = |from: &str, to: &str| -> String {
        assert!(text.contains(from), "{from}");
        let new = loaded(&text.replacen(from, to, 1));
        assert!(codes(&new).is_empty(), "{}", shown(&new));
        let line = |found: &crate::check::Difference| {
            format!("{} {}: {}", found.change, found.subject, found.detail)
        };
        let found = differences(&old, &new).expect("both are sound");
        found.iter().map(line).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(told("language 1\n", "language 1\n// looked at\n"), "");
    assert_eq!(
        told("distance {", "distance + 5 m {"),
        "changed action `ahead`: spawn vehicle ahead distance { lane: lane, speed: speed, does: DriveAhead } → \
         spawn vehicle ahead distance + 5 m { lane: lane, speed: speed, does: DriveAhead }"
    );
    for (from, to, wanted) in [
        ("speed: speed, does", "speed: speed - 1 m/s, does", "changed action `ahead`: spawn vehicle "),
        ("speed: speed, does", "speed: speed, colour: Red, does", "changed action `ahead`: spawn vehicle "),
        ("{ set time = to }", "{ set time = to set sky = None }", "changed action `set_time`: "),
        ("set calm = false", "set calm = calm", "changed `each step`: "),
        ("set calm = true", "set calm = not calm", "changed `on ahead also`: "),
        ("collision => 1", "collision => 2", "changed `reward`: collision => 1 → collision => 2"),
        ("and not repeated", "and not sudden", "changed verdict `counted`: "),
        ("at 105.88 m", "at 100 m", "changed road `corner`: start: lane 1/-1 at 105.88 m → "),
        ("spawn_gap >=", "spawn_gap >", "changed rule `roomy`: "),
        ("speed <= road.limit", "speed <= 90 % * road.limit", "tightened rule `calm_first`: speed "),
        ("rule roomy: spawn_gap >= safety_gap\n", "", "removed rule `roomy`: rule roomy: spawn_gap"),
        ("rule roomy", "optional rule roomy", "loosened rule `roomy`: it is optional now"),
    ] {
        assert!(told(from, to).starts_with(wanted), "`{wanted}` in\n{}", told(from, to));
    }
    let narrowed = told("in 10 m/s .. 20 m/s", "in 11 m/s .. 20 m/s");
    assert!(narrowed.contains("draws of `ahead`: ") && narrowed.contains("speed 10 .. "), "{narrowed}");
    assert!(!narrowed.contains(" rule `"), "no rule has changed:\n{narrowed}");
    let rules = "rule calm_first on ahead: speed <= road.limit\nrule roomy: spawn_gap >= safety_gap\n";
    let turned = "rule roomy: spawn_gap >= safety_gap\nrule calm_first on ahead: speed <= road.limit\n";
    assert_eq!(told(rules, turned), "moved rule `roomy`: it comes before rule `calm_first` now");
}
