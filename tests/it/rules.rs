//! The rules of the shipped space: no episode breaks a rule that is on, and without a rule episodes break that
//! rule and no other.
//!
//! The predicates are written here by hand, from the paper and not from the space's file.
//!
//! The audit: every rule has a draw that breaks this rule alone. The draw is refused with the rule's name,
//! and passes without the rule. So this test fails if a rule is no longer enforced somewhere.

use std::sync::Arc;

use avastra::action::{
    ActionTable, Draw, Effect, Enforcement, Refusal, Situation, SpawnFacts, SpawnRequest, Surroundings, audit,
};
use avastra::check::state_argument::memory_from;
use avastra::episode::{Choice, Moment};
use avastra::model::vocabulary::{Body, TimeOfDay, Verb};
use avastra::model::{MomentFacts, RulesInForce, Type, Value};
use avastra::rng;
use avastra::rng::Stream;

use crate::world::{Wide, assert_replays, loaded, run, space};

const RULES: [&str; 5] = ["chronology", "npc_gap", "npc_speed", "walking_pace", "no_teleport"];

/// Limits of the four roads: 25 mph on Roads 1 and 2, 50 km/h on Roads 3 and 4.
const LIMITS_MPS: [f64; 4] = [11.176, 11.176, 50.0 / 3.6, 50.0 / 3.6];

/// Episodes on each road with all rules on. Without a rule, half as many break it many times.
const EPISODES: u32 = 10;

#[test]
fn no_episode_breaks_a_rule_and_each_switch_frees_its_own() {
    assert_eq!(broken(EPISODES, &[]), [false; 5], "with all rules on");
    for (index, rule) in RULES.into_iter().enumerate() {
        let mut expected = [false; 5];
        expected[index] = true;
        assert_eq!(broken(EPISODES / 2, &[rule]), expected, "without {rule}");
    }
}

/// Which of [`RULES`] some step broke, in this many episodes on each road, with the rules in `without` off.
fn broken(episodes: u32, without: &[&str]) -> [bool; 5] {
    let run = &run(episodes, 5, without);
    let mut broken = [false; 5];
    for number in 0..run.episodes() {
        let mut time = None;
        let limit_mps = LIMITS_MPS[number / episodes as usize];
        let log = run.play(
            number,
            &mut |moment| {
                let Some(draw) = drawn(run.table(), moment, number) else { return Choice::Pass };
                let before = time.unwrap_or_else(|| run.space().weather(moment.situation.memory).0);
                let after = judge(&draw, before, limit_mps, moment, &mut broken);
                time = Some(after);
                Choice::Act(draw)
            },
            &mut |_, _, _| {},
        );
        assert_replays(run, number, &log);
    }
    broken
}

/// Draws any legal row, from a random stream of the test's own.
fn drawn(table: &ActionTable, moment: &Moment, number: usize) -> Option<Draw> {
    let legal: Vec<Draw> = table.offers(moment.situation).into_iter().filter_map(Result::ok).collect();
    let mut rng = rng::stream(number as u64, Stream::Exploration, moment.step as u64);
    let nth = rng::below(&mut rng, legal.len().max(1) as u32) as usize;
    legal.into_iter().nth(nth)
}

/// Marks the rules that a draw breaks, and returns the time of day after it.
fn judge(
    draw: &Draw,
    mut time: TimeOfDay,
    limit_mps: f64,
    moment: &Moment,
    broken: &mut [bool; 5],
) -> TimeOfDay {
    for effect in &draw.effects {
        match effect {
            Effect::Time(next) => {
                broken[0] |= !follows(time, *next);
                time = *next;
            }
            Effect::Order(_) | Effect::Light(_) => unreachable!("the space orders nobody"),
            Effect::Spawn(request) if request.body == Body::Pedestrian => {
                broken[3] |= request.speed_mps > 1.4;
                broken[4] |= appears_too_near(request, moment);
            }
            Effect::Spawn(request) => {
                broken[1] |= !gap_is_as_the_paper_says(request);
                broken[2] |= request.speed_mps > limit_mps + 1e-9;
                broken[4] |= appears_too_near(request, moment);
            }
            Effect::Sky(..) => {}
        }
    }
    time
}

fn follows(time: TimeOfDay, next: TimeOfDay) -> bool {
    use TimeOfDay::{Morning, Night, Noon};
    matches!((time, next), (Morning, Morning | Noon) | (Noon, Noon | Night) | (Night, Night | Morning))
}

/// Eq. 7 with the paper's figures, where the speed counts for half a second.
fn gap_is_as_the_paper_says(request: &SpawnRequest) -> bool {
    let size_m = if matches!(request.body, Body::BoxTruck | Body::SchoolBus) { 3.0 } else { 0.0 };
    let off_m = |mode_m: f64| request.distance_m - (mode_m + size_m + 0.5 * request.speed_mps);
    off_m(12.0).abs() < 1e-9 || (off_m(50.0).abs() < 1e-9 && request.verb != Verb::Overtake)
}

fn appears_too_near(request: &SpawnRequest, moment: &Moment) -> bool {
    match moment.situation.surroundings.survey(request) {
        Ok(facts) => facts.spawn_gap_m < facts.safety_gap_m,
        Err(_) => false,
    }
}

/// A draw that breaks one rule alone.
struct Breach {
    rule: &'static str,
    road: &'static str,
    /// The states before the draw.
    states: &'static str,
    row: &'static str,
    /// The drawn values; numbers are in SI units.
    values: &'static [(&'static str, &'static str)],
    /// The gap that a careful driver would need, m.
    safety_gap_m: f64,
    enforced: Enforcement,
}

const SEDAN: (&str, &str) = ("vehicle", "Sedan");
const RED: (&str, &str) = ("colour", "Red");

/// What most breaches have in common.
const USUAL: Breach = Breach {
    rule: "",
    road: "corner",
    states: "time: Noon",
    row: "",
    values: &[],
    safety_gap_m: 0.0,
    enforced: Enforcement::Draw,
};

const BREACHES: [Breach; 8] = [
    Breach { rule: "chronology", row: "set_time(to: Morning)", enforced: Enforcement::Transition, ..USUAL },
    Breach {
        rule: "npc_gap",
        row: "drive_ahead(lane: Current, mode: Near, then: Keep)",
        values: &[SEDAN, RED, ("speed", "10"), ("distance", "17.5")],
        ..USUAL
    },
    Breach {
        rule: "ped_gap",
        row: "pedestrian(from: Left)",
        values: &[("mode", "Near"), ("speed", "1"), ("distance", "20.5")],
        ..USUAL
    },
    Breach {
        rule: "npc_speed",
        row: "drive_ahead(lane: Current, mode: Near, then: Keep)",
        values: &[SEDAN, RED, ("speed", "12"), ("distance", "18")],
        ..USUAL
    },
    Breach {
        rule: "walking_pace",
        row: "pedestrian(from: Right)",
        values: &[("mode", "Far"), ("speed", "1.5"), ("distance", "40")],
        ..USUAL
    },
    Breach {
        rule: "lane_exists",
        road: "boulevard",
        row: "drive_ahead(lane: Left, mode: Near, then: Keep)",
        values: &[SEDAN, RED, ("speed", "10"), ("distance", "17")],
        ..USUAL
    },
    Breach {
        rule: "no_teleport",
        row: "pedestrian(from: Left)",
        values: &[("mode", "Near"), ("speed", "1"), ("distance", "20")],
        safety_gap_m: 20.5,
        enforced: Enforcement::Survey,
        ..USUAL
    },
    Breach { rule: "wet_needs_cause", states: "time: Noon, sky: None", row: "wet(how: High)", ..USUAL },
];

impl Breach {
    fn judged(&self, table: &ActionTable, with: &[&str], without: &[&str]) -> Result<Draw, Vec<Refusal>> {
        let space = table.space();
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let rules = RulesInForce::new(space, &owned(with), &owned(without)).expect("the rules exist");
        let road = space.roads.iter().find(|road| road.name == self.road).expect("the road exists");
        let row = table.rows().iter().find(|row| row.label == self.row).expect("the row exists");
        let parameters = &space.actions[row.action].parameters;
        let value = |(name, text): &(&str, &str)| {
            let parameter = parameters.iter().find(|known| *known.name == **name).expect("it is drawn");
            let value = match parameter.ty {
                Type::Enum(of) => {
                    let variants = &space.enums[of.0].variants;
                    let variant = variants.iter().position(|variant| variant == text);
                    Value::Variant(of, variant.expect("the variant exists"))
                }
                _ => Value::Number(text.parse().expect("it is a number")),
            };
            (Arc::from(*name), value)
        };
        let values: Vec<(Arc<str>, Value)> = self.values.iter().map(value).collect();
        let memory = memory_from(space, self.states, 1).expect("the states exist");
        let surroundings = Wide { safety_gap_m: self.safety_gap_m };
        let situation = Situation {
            memory: &memory,
            road,
            rules: &rules,
            surroundings: &surroundings,
            seed: 1,
            step: 0,
            happened_s: &[],
        };
        table.check(&situation, row.index, &values)
    }
}

#[test]
fn every_rule_refuses_its_own_breach_and_no_other_does() {
    let table = ActionTable::new(space("avastra45.ava"));
    let audit = audit(&table);
    let mut names: Vec<&str> = audit.rules.iter().map(|rule| rule.name.as_str()).collect();
    let mut broken: Vec<&str> = BREACHES.iter().map(|breach| breach.rule).collect();
    names.sort_unstable();
    broken.sort_unstable();
    assert_eq!(names, broken, "every rule of the audit has its breach");
    for breach in &BREACHES {
        let entry = audit.rules.iter().find(|rule| rule.name == breach.rule).expect("it is in the audit");
        assert_eq!(entry.enforced, breach.enforced, "{}", breach.rule);
        let with: &[&str] = if entry.optional { &[breach.rule] } else { &[] };
        let refusals = breach.judged(&table, with, &[]).expect_err(breach.rule);
        let by: Vec<Option<&str>> = refusals.iter().map(|refusal| refusal.rule.as_deref()).collect();
        assert_eq!(by, [Some(breach.rule)], "{refusals:?}");
        let without: &[&str] = if entry.optional { &[] } else { &[breach.rule] };
        assert!(breach.judged(&table, &[], without).is_ok(), "{} is switched off", breach.rule);
        // With every other rule switched off, this one still refuses.
        let others: Vec<&str> = names.iter().copied().filter(|name| *name != breach.rule).collect();
        assert!(breach.judged(&table, with, &others).is_err(), "{} alone", breach.rule);
    }
}

/// The checker of scenarios refuses these draws too. Rules that ask the world are left to the replay.
#[test]
fn a_scenario_with_a_breach_does_not_compile() {
    let compiled = |breach: &Breach, origin: &str| -> Vec<String> {
        let unit = |name: &str| match name {
            "speed" => " m/s",
            "distance" => " m",
            _ => "",
        };
        let values: Vec<String> =
            breach.values.iter().map(|(name, text)| format!("{name}: {text}{}", unit(name))).collect();
        let drawn =
            if values.is_empty() { String::new() } else { format!("with {{ {} }}", values.join(", ")) };
        let text = format!(
            "language 1\nuse \"avastra45.ava\"\nscenario s {{\n{origin}\nroad: {}\nstart {{ {} }}\nsteps {{ 0: {} {drawn} }}\n}}\n",
            breach.road, breach.states, breach.row
        );
        let loaded = loaded("scenarios/s.ava", &text);
        assert_eq!(loaded.scenario.is_some(), loaded.diagnostics.is_empty());
        loaded.diagnostics.iter().map(|found| format!("{} {}", found.code, found.message)).collect()
    };
    for breach in &BREACHES {
        let rule = breach.rule;
        let optional = rule == "wet_needs_cause";
        let on = if optional { format!("origin {{ with: [{rule}] }}") } else { String::new() };
        let off = if optional { String::new() } else { format!("origin {{ without: [{rule}] }}") };
        let wanted = match breach.enforced {
            Enforcement::Survey | Enforcement::Change | Enforcement::Phase => Vec::new(),
            Enforcement::Draw | Enforcement::Transition => {
                vec![format!("AV0605 step 0 breaks rule `{rule}`")]
            }
        };
        assert_eq!(compiled(breach, &on), wanted, "{rule}");
        assert_eq!(compiled(breach, &off), Vec::<String>::new(), "{rule} is switched off");
    }
}

/// Ranges, lists, `where` and missing or unknown values are enforced without a rule.
#[test]
fn what_an_action_says_of_its_values_is_enforced() {
    const TEXT: &str = "language 1
use \"roads.ava\"
enum Body = Jeep | SUV | Sedan
action a(any d: Length in 1 m .. 9 m where d < 5 m, any body: Body in [Jeep, SUV]) {
  spawn body ahead 40 m + d { lane: Current, speed: 5 m/s, does: DriveAhead }
}";
    let table = ActionTable::new(loaded("scenarios/a.ava", TEXT).space.expect("it is sound"));
    let space = table.space();
    let rules = RulesInForce::new(space, &[], &[]).expect("no rule is named");
    let memory = space.initial_memory(1);
    let (roomy, full) = (Wide { safety_gap_m: 0.0 }, Full);
    let judged = |values: &[(&str, Value)], surroundings: &dyn Surroundings| {
        let values: Vec<(Arc<str>, Value)> =
            values.iter().map(|(name, value)| (Arc::from(*name), *value)).collect();
        let road = &space.roads[0];
        let situation = Situation {
            memory: &memory,
            road,
            rules: &rules,
            surroundings,
            seed: 1,
            step: 0,
            happened_s: &[],
        };
        table.check(&situation, 0, &values).map_err(|refusals| {
            assert!(refusals.iter().all(|refusal| refusal.rule.is_none()));
            refusals.into_iter().map(|refusal| refusal.reason).collect::<Vec<_>>().join("; ")
        })
    };
    let Type::Enum(of) = space.actions[0].parameters[1].ty else { panic!("a body is of an enum") };
    let (d, jeep, sedan) = (Value::Number, Value::Variant(of, 0), Value::Variant(of, 2));
    assert!(judged(&[("d", d(4.0)), ("body", jeep)], &roomy).is_ok());
    let cases: [(&[(&str, Value)], &str); 5] = [
        (&[("d", d(5.0)), ("body", jeep)], "the `where` of `d` does not hold"),
        (&[("d", d(0.5)), ("body", jeep)], "`d` is 0.5 m, its range is 1 m .. 9 m"),
        (&[("d", d(4.0)), ("body", sedan)], "`body` is Sedan, its range is Jeep | SUV"),
        (&[("d", d(4.0))], "`body` is missing"),
        (&[("d", d(4.0)), ("body", jeep), ("e", jeep)], "`a` draws no `e`"),
    ];
    for (values, reason) in cases {
        assert_eq!(judged(values, &roomy).expect_err(reason), reason);
    }
    let crowded = judged(&[("d", d(4.0)), ("body", jeep)], &full).expect_err("there is no room");
    assert_eq!(crowded, "cannot spawn: no room");
}

/// A world without room for any spawn.
struct Full;

impl Surroundings for Full {
    fn survey(&self, _request: &SpawnRequest) -> Result<SpawnFacts, String> {
        Err("no room".to_owned())
    }

    fn moment(&self) -> MomentFacts {
        MomentFacts { ego_speed_mps: 10.0, ..MomentFacts::default() }
    }
}
