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
