//! Verdicts of the checker against sampling, on spaces made at random: what it calls dead is never
//! drawn, every witness runs, and a rule that it calls idle or implied refuses nothing.

use std::path::Path;
use std::sync::Arc;

use proptest::prelude::*;

use crate::action::tests::Plain;
use crate::action::{ActionTable, Offer, Situation};
use avastra_lang::check::{Loaded, ReadError, load};
use avastra_lang::model::{Reach, RulesInForce, Value, code};
use avastra_lang::prove::witness;

const HEAD: &str = "language 1
enum Mode = Near | Far
enum Level = None < Light < High
state fog: Level = None
state was: Mode = Near
road corner {
  map: \"made_up.xodr\"
  start: lane 1/-1 at 10 m
  goal: lane 1/-1 at 90 m
}
fn base(mode: Mode) -> Length = match mode { Near => 12 m
  Far => 50 m }
action thicken(each to: Level) { set fog = to }
";

/// A straight road of 100 m: small, because it is read twice for every space.
const MAP: &str = r#"<OpenDRIVE><header name="made up"/><road id="1" length="100" junction="-1">
<type s="0" type="town"><speed max="11" unit="m/s"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
</road></OpenDRIVE>"#;

pub(super) fn compiled(text: &str) -> Loaded {
    let is_map = |path: &Path| path.ends_with("made_up.xodr");
    let read = |path: &Path| -> Result<String, ReadError> {
        Ok(if is_map(path) { MAP.to_owned() } else { text.to_owned() })
    };
    load(Path::new("a.ava"), &read).unwrap()
}

/// A condition on `mode`, `speed`, `distance` and the states.
fn condition() -> impl Strategy<Value = String> {
    let op = || prop::sample::select(vec!["<", "<=", ">", ">=", "==", "!="]);
    let leaf = prop_oneof![
        (op(), 0..24_u32).prop_map(|(op, v)| format!("speed {op} {v} m/s")),
        (op(), 0..90_u32).prop_map(|(op, d)| format!("distance {op} {d} m")),
        (op(), 1..5_u32).prop_map(|(op, s)| format!("distance {op} base(mode) + speed * {s} s")),
        (op(), 1..5_u32).prop_map(|(op, k)| format!("speed * {k} {op} road.limit")),
        Just("speed <= road.limit".to_owned()),
        Just("mode == Near".to_owned()),
        Just("mode != was".to_owned()),
        Just("fog < High".to_owned()),
        (0..20_u32, 0..20_u32).prop_map(|(a, b)| format!("speed in {a} m/s .. {b} m/s")),
    ];
    leaf.prop_recursive(2, 6, 2, |inner| {
        (inner.clone(), prop::sample::select(vec!["and", "or", "implies"]), inner)
            .prop_map(|(a, op, b)| format!("({a}) {op} ({b})"))
    })
}

/// A space with one action that spawns, and up to three rules on it.
fn space() -> impl Strategy<Value = String> {
    let range = |max: u32| (1..max, 1..max).prop_map(|(a, b)| (a.min(b), a.max(b)));
    (range(24), range(90), prop::collection::vec(condition(), 1..4)).prop_map(|(speed, distance, rules)| {
        let mut text = HEAD.to_owned();
        text.push_str(&format!(
            "action ahead(each mode: Mode, any speed: Speed in {} m/s .. {} m/s, any distance: Length in {} m .. {} m) {{\n  \
               spawn Sedan ahead distance {{ lane: Current, speed: speed, does: DriveAhead }}\n  set was = mode\n}}\n",
            speed.0, speed.1, distance.0, distance.1
        ));
        for (index, rule) in rules.iter().enumerate() {
            text.push_str(&format!("rule r{index} on ahead: {rule}\n"));
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn verdicts_agree_with_sampling(text in space(), seed in 0..1000_u64) {
        // Dead rows are then no error: an optional rule makes no row dead.
        let optional = compiled(&text.replace("\nrule ", "\noptional rule "));
        let shown = || optional.diagnostics.iter().map(|found| found.message.clone()).collect::<Vec<_>>();
        let loose = optional.space.clone();
        prop_assert!(loose.is_some(), "{:?}\n{}", shown(), text);
        let loose = loose.expect("it was just seen");
        let verdicts = compiled(&text);
        let table = ActionTable::new(loose.clone());
        let names: Vec<String> = loose.rules.iter().map(|rule| rule.name.clone()).collect();
        let rules = RulesInForce::new(&loose, &names, &[]).unwrap();
        let road = &loose.roads[0];
        // A space with dead rows is refused; its error names the rows by number.
        let named_dead = |row: usize| verdicts.diagnostics.iter().any(|found| {
            found.code == code::DEAD
                && found.labels.iter().any(|label| names_row(&label.text, row))
        });
        for row in table.rows().iter().filter(|row| row.label.starts_with("ahead")) {
            let reach = verdicts.space.as_ref().map(|space| space.rows[row.index].roads[0].clone());
            let is_dead = match &reach {
                Some(reach) => matches!(reach, Reach::Dead { .. }),
                None => named_dead(row.index),
            };
            for draw in 0..64 {
                let memory = loose.initial_memory(seed + draw);
                let situation =
                    Situation { memory: &memory, road, rules: &rules, surroundings: &Plain(0.0), seed: seed + draw, step: 0 };
                let offer = table.offer(&situation, row.index);
                prop_assert!(!(is_dead && matches!(offer, Offer::Legal(_))), "dead row drawn\n{}", text);
                // Draws alone would not find every value, so a grid over the declared ranges is tried too.
                let shares = [draw % 8, draw / 8].map(|part| part as f64 / 7.0);
                let values: Vec<(Arc<str>, Value)> = loose.actions[row.action]
                    .drawn()
                    .zip(shares)
                    .map(|(parameter, share)| {
                        let (low, high) = parameter.domain.ends();
                        (parameter.name.clone(), Value::Number(low + (high - low) * share))
                    })
                    .collect();
                let judged = table.check(&situation, row.index, &values);
                prop_assert!(!(is_dead && judged.is_ok()), "dead row runs\n{}", text);
                let refusals = judged.err().unwrap_or_default();
                let by = |rule: &str| refusals.iter().any(|refusal| refusal.rule.as_deref() == Some(rule));
                for found in &verdicts.diagnostics {
                    let mut named = found.message.split('`').skip(1).step_by(2);
                    // A rule that follows from others refuses nothing that the others let pass.
                    let is_true = match found.code {
                        code::NEVER_ACTS => !named.any(by),
                        code::IMPLIED => {
                            let is_refused = named.next().is_some_and(by);
                            !is_refused || named.any(by)
                        }
                        _ => true,
                    };
                    prop_assert!(is_true, "{}\n{}", found.message, text);
                }
            }
            if let Some(space) = &verdicts.space
                && let Some(found) = witness(space, &space.rows[row.index], &space.roads[0])
            {
                let strict = ActionTable::new(space.clone());
                let in_force = RulesInForce::new(space, &[], &[]).unwrap();
                let situation = Situation {
                    memory: &found.memory, road: &space.roads[0], rules: &in_force, surroundings: &Plain(0.0), seed, step: 0,
                };
                let judged = strict.check(&situation, row.index, &found.values);
                prop_assert!(judged.is_ok(), "{:?}\n{}", judged, text);
                prop_assert!(!is_dead, "a dead row has a witness\n{}", text);
            }
        }
    }
}

/// Whether `row 3`, `rows 3..5` or `rows 3, 7` names the row.
fn names_row(text: &str, row: usize) -> bool {
    let Some(numbers) = text.strip_prefix("rows ").or(text.strip_prefix("row ")) else { return false };
    match numbers.split_once("..") {
        Some((first, last)) => {
            let (Ok(first), Ok(last)) = (first.parse::<usize>(), last.parse::<usize>()) else { return false };
            (first..=last).contains(&row)
        }
        None => numbers.split(", ").any(|number| number.parse() == Ok(row)),
    }
}

/// Equalities that depend on each other are solved in the order of their dependence, whatever the order of
/// declaration: by drawing, and by the search for witnesses.
#[test]
fn a_chain_of_equalities_is_solved_from_its_end() {
    let speeds =
        ["first", "second", "third", "fourth"].map(|name| format!("any {name}: Speed in 1 m/s .. 20 m/s"));
    let text = format!(
        "{HEAD}action ahead({}) {{ spawn Sedan ahead 50 m {{ lane: Current, speed: first, does: DriveAhead }} }}\n\
         rule r0 on ahead: first == second * 0.5 + 4 m/s\n\
         rule r1 on ahead: second == third * 0.5 + 4 m/s\n\
         rule r2 on ahead: third == fourth * 0.5 + 4 m/s\n",
        speeds.join(", ")
    );
    let space = compiled(&text).space.unwrap();
    let row = space.rows.iter().find(|row| row.label == "ahead()").unwrap();
    let road = &space.roads[0];
    assert!(witness(&space, row, road).is_some());
    let rules = RulesInForce::by_default(&space);
    let memory = space.initial_memory(0);
    for step in 0..8 {
        let situation =
            Situation { memory: &memory, road, rules: &rules, surroundings: &Plain(0.0), seed: 0, step };
        let offer = ActionTable::new(space.clone()).offer(&situation, row.index);
        assert!(matches!(offer, Offer::Legal(_)), "{offer:?}");
    }
}

/// Every row of the shipped spaces has a witness on every road, and every witness runs.
#[test]
fn shipped_rows_have_witnesses_that_run() {
    for path in ["scenarios/avastra45.ava", "scenarios/deepcollision52.ava"] {
        let table = crate::action::tests::table(path);
        let space = table.space();
        let rules = RulesInForce::new(space, &[], &[]).unwrap();
        for row in table.rows() {
            for (road, reach) in space.roads.iter().zip(&row.roads) {
                if matches!(reach, Reach::Dead { .. }) {
                    continue;
                }
                let found =
                    witness(space, row, road).unwrap_or_else(|| panic!("{} on {}", row.label, road.name));
                let memory = &found.memory;
                let situation =
                    Situation { memory, road, rules: &rules, surroundings: &Plain(0.0), seed: 0, step: 0 };
                let judged = table.check(&situation, row.index, &found.values);
                assert!(judged.is_ok(), "{} on {}: {judged:?}", row.label, road.name);
            }
        }
    }
}
