use super::{Plain, table, value_of};
use crate::action::{Offer, Situation};
use crate::model::RulesInForce;

#[test]
fn draws_are_short_and_independent_of_each_other() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let rules = RulesInForce::by_default(table.space());
    let road = &table.space().roads[0];
    let situation =
        Situation { memory: &memory, road, rules: &rules, surroundings: &Plain, seed: 3, step: 4 };
    for (row, offer) in table.offers(&situation).iter().enumerate() {
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
    let rules = RulesInForce::by_default(table.space());
    let road = &table.space().roads[0];
    let situation =
        Situation { memory: &memory, road, rules: &rules, surroundings: &Plain, seed: 3, step: 4 };
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

#[test]
fn a_first_draw_lies_where_its_shares_say() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let rules = RulesInForce::by_default(table.space());
    let road = &table.space().roads[0];
    let situation =
        Situation { memory: &memory, road, rules: &rules, surroundings: &Plain, seed: 3, step: 4 };
    let row = table.rows().iter().position(|row| row.label.starts_with("pedestrian(from: Left")).unwrap();
    let drawn = |shares: &[f64]| {
        let Offer::Legal(draw) = &table.offers_at(&situation, shares)[row] else { panic!("must be legal") };
        (value_of(&draw.values, "mode").unwrap(), value_of(&draw.values, "speed").unwrap().number())
    };
    // Side, mode, speed: the rule bounds the speed by 1.4 m/s.
    let (near, slow_mps) = drawn(&[0.5, 0.0, 0.0]);
    let (far, fast_mps) = drawn(&[0.5, 0.9, 0.99]);
    assert!(near != far && slow_mps == 0.5 && (1.35..=1.4).contains(&fast_mps), "{slow_mps} {fast_mps}");
    // What is left out is drawn by chance, and so is all of it without shares.
    assert_eq!(drawn(&[0.5, 0.9]).0, far);
    assert_eq!(table.offers_at(&situation, &[]), table.offers(&situation));
}
