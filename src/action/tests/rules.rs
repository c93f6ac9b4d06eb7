use proptest::prelude::*;

use super::{Full, Plain, named, table, value_of};
use crate::action::{ActionTable, Draw, Effect, Offer, Situation, Surroundings};
use crate::model::vocabulary::{Body, TimeOfDay, Verb};
use crate::model::{Memory, RulesInForce};

const SAFETY_GAP_M: f64 = 19.0;

/// The rules of avastra45 by hand: names of those that a draw breaks.
fn broken(table: &ActionTable, before: &Memory, draw: &Draw) -> Vec<&'static str> {
    let mut broken = Vec::new();
    let row = &table.rows()[draw.row];
    let clock = |memory: &Memory| table.space().weather(memory).0;
    let allowed = match clock(before) {
        TimeOfDay::Morning => [TimeOfDay::Morning, TimeOfDay::Noon],
        TimeOfDay::Noon => [TimeOfDay::Noon, TimeOfDay::Night],
        TimeOfDay::Night => [TimeOfDay::Night, TimeOfDay::Morning],
    };
    if !allowed.contains(&clock(&draw.memory_after)) {
        broken.push("chronology");
    }
    for effect in &draw.effects {
        let Effect::Spawn(spawn) = effect else { continue };
        let far = row.label.contains("mode: Far");
        let large = matches!(spawn.body, Body::BoxTruck | Body::SchoolBus);
        let gap_m = if far { 50.0 } else { 12.0 } + if large { 3.0 } else { 0.0 } + spawn.speed_mps * 0.5;
        let fits = (spawn.distance_m - gap_m).abs() < 1e-9;
        let vehicle = spawn.verb != Verb::Walk;
        if vehicle && !fits {
            broken.push("npc_gap");
        }
        if vehicle && spawn.speed_mps > table.space().roads[0].facts.limit_mps {
            broken.push("npc_speed");
        }
        if !vehicle && spawn.speed_mps > 1.4 {
            broken.push("walking_pace");
        }
        if spawn.distance_m < SAFETY_GAP_M {
            broken.push("no_teleport");
        }
    }
    broken
}

fn offers(
    table: &ActionTable,
    memory: &Memory,
    without: &[&str],
    surroundings: &dyn Surroundings,
    seed: u64,
    step: u64,
) -> Vec<Offer> {
    let rules = RulesInForce::new(table.space(), &[], &named(without)).unwrap();
    let road = &table.space().roads[0];
    table.offers(&Situation { memory, road, rules: &rules, surroundings, seed, step })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_draw_breaks_a_rule(seed: u64, step in 0_u64..20) {
        let table = table("scenarios/avastra45.ava");
        let memory = table.space().initial_memory(seed);
        let surroundings = Plain { safety_gap_m: SAFETY_GAP_M };
        for offer in offers(&table, &memory, &[], &surroundings, seed, step) {
            match offer {
                Offer::Legal(draw) => {
                    prop_assert_eq!(broken(&table, &memory, &draw), Vec::<&str>::new());
                    // The judge of replays agrees with the drawer, on the same values.
                    let rules = RulesInForce::new(table.space(), &[], &[]).unwrap();
                    let road = &table.space().roads[0];
                    let situation =
                        Situation { memory: &memory, road, rules: &rules, surroundings: &surroundings, seed, step };
                    prop_assert_eq!(table.check(&situation, draw.row, &draw.values), Ok(draw));
                }
                Offer::Refused(refusal) => prop_assert!(refusal.rule.is_some(), "{}", refusal.reason),
            }
        }
    }
}

#[test]
fn optional_rules_wait_to_be_asked() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(1);
    let surroundings = Plain { safety_gap_m: 0.0 };
    let road = &table.space().roads[0];
    let row = table.rows().iter().position(|row| row.label == "wet(how: High)").unwrap();
    let judge = |with: &[&str]| {
        let rules = RulesInForce::new(table.space(), &named(with), &[]).unwrap();
        let situation =
            Situation { memory: &memory, road, rules: &rules, surroundings: &surroundings, seed: 1, step: 0 };
        table.offer(&situation, row)
    };
    assert!(matches!(judge(&[]), Offer::Legal(_)));
    let Offer::Refused(refusal) = judge(&["wet_needs_cause"]) else { panic!("must be refused") };
    assert_eq!(refusal.rule.as_deref(), Some("wet_needs_cause"));
}

#[test]
fn a_full_world_refuses_without_a_rule() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(1);
    for (row, offer) in offers(&table, &memory, &["chronology"], &Full, 1, 0).into_iter().enumerate() {
        match offer {
            Offer::Legal(draw) => assert!(!draw.effects.iter().any(|e| matches!(e, Effect::Spawn(_)))),
            Offer::Refused(refusal) => {
                assert_eq!(refusal.rule, None, "row {row}");
                assert!(refusal.reason.contains("no room"), "{}", refusal.reason);
            }
        }
    }
}

#[test]
fn draws_are_short_and_independent_of_each_other() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let surroundings = Plain { safety_gap_m: 0.0 };
    let all = offers(&table, &memory, &[], &surroundings, 3, 4);
    let rules = RulesInForce::new(table.space(), &[], &[]).unwrap();
    let road = &table.space().roads[0];
    let situation =
        Situation { memory: &memory, road, rules: &rules, surroundings: &surroundings, seed: 3, step: 4 };
    for (row, offer) in all.iter().enumerate() {
        assert_eq!(*offer, table.offer(&situation, row));
        let Offer::Legal(draw) = offer else { continue };
        if let Some(speed) = value_of(&draw.values, "speed") {
            let steps = speed.number() * 64.0;
            assert_eq!(steps.floor(), steps, "{}", table.rows()[row].label);
        }
    }
}

#[test]
fn given_values_are_judged_by_the_same_rules() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let surroundings = Plain { safety_gap_m: 0.0 };
    let rules = RulesInForce::new(table.space(), &[], &[]).unwrap();
    let road = &table.space().roads[0];
    let situation =
        Situation { memory: &memory, road, rules: &rules, surroundings: &surroundings, seed: 3, step: 4 };
    let row = table.rows().iter().position(|row| row.label.starts_with("drive_ahead(lane: Current")).unwrap();
    let Offer::Legal(mut draw) = table.offer(&situation, row) else { panic!("must be legal") };
    for (name, value) in &mut draw.values {
        if &**name == "speed" {
            *value = crate::model::Value::Number(19.0);
        }
    }
    let refusals = table.check(&situation, row, &draw.values).unwrap_err();
    let rules: Vec<&str> = refusals.iter().filter_map(|refusal| refusal.rule.as_deref()).collect();
    assert_eq!(rules, ["npc_gap", "npc_speed"]);
    assert!(refusals[1].reason.contains("speed = 19 m/s, wanted <= 11.176 m/s"), "{}", refusals[1].reason);
    draw.values.pop();
    let refusals = table.check(&situation, row, &draw.values).unwrap_err();
    assert_eq!(refusals[0].reason, "`distance` is missing");
}
