//! `avastra table --row`: whether a row is legal here, and which rule refuses it.

use std::collections::BTreeMap;
use std::sync::Arc;

use avastra_campaign::emit;
use avastra_campaign::run::road_named;
use avastra_lang::check::state_argument::legal_memory_from;
use avastra_lang::model::{Memory, RuleBody, RulesInForce, Space, StateDef};
use avastra_world::action::{ActionTable, Refusal, Situation};
use avastra_world::sim::{Scene, Start, World};

use super::arguments::TableArguments;
use super::error::Failure;
use super::output::Output;

/// Fixed seed: the question is about the rules, not about drawn values.
const SEED: u64 = 0;

/// Judges a row at the start of a road, with the states as given.
pub fn why(
    output: &Output,
    arguments: &TableArguments,
    table: &ActionTable,
    number: usize,
) -> Result<(), Failure> {
    let asked = &arguments.why;
    let space = table.space();
    let Some(row) = table.rows().get(number) else {
        return Err(Failure::usage(format!(
            "no row {number}: the table has rows 0 to {}",
            table.rows().len().saturating_sub(1)
        )));
    };
    let road = match &arguments.road {
        Some(name) => road_named(space, name)?,
        None => 0,
    };
    let road = &space.roads[road];
    let rules = RulesInForce::new(space, &asked.with, &asked.without).map_err(Failure::usage)?;
    let memory = match &asked.state {
        None => space.memory_at_start(road, &rules, SEED).map_err(Failure::usage)?,
        Some(text) => legal_memory_from(space, text, road, &rules, SEED).map_err(Failure::usage)?,
    };
    let start = Start::drawn(space, road, &memory, SEED);
    let world = World::new(Arc::new(Scene::of(road)), &start);
    let situation = Situation {
        memory: &memory,
        road,
        rules: &rules,
        surroundings: &world,
        seed: SEED,
        step: 0,
        happened_s: &[],
    };
    let offer = table.offer(&situation, number);

    output.say(&format!("row {}: {} on {}", row.index, row.label, road.name));
    let states: Vec<(&str, String)> =
        space.states.iter().map(|state| (state.name.as_str(), shown(space, state, &memory))).collect();
    if !states.is_empty() {
        let states: Vec<String> = states.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        output.say(&format!("  with {}", states.join(", ")));
    }
    for &rule in row.rules.iter() {
        let state = match (rules.contains(rule), &space.rules[rule].body) {
            (false, _) => " (off)",
            (true, RuleBody::During(_)) => " (during lane changes)",
            (true, RuleBody::Phases { .. }) => " (as phases begin)",
            (true, _) => "",
        };
        output.say(&format!("  bound by {}{state}", space.rules[rule].name));
    }
    let (verdict, rule, reason) = match offer {
        Ok(draw) => (format!("legal, for example {}", emit::action_text(table, &draw)), None, None),
        Err(Refusal { rule, reason }) => {
            let by = rule.as_ref().map_or(String::new(), |rule| format!("rule `{rule}` says no: "));
            (format!("not legal: {by}{reason}"), rule, Some(reason))
        }
    };
    output.say(&format!("at the start of the road, {verdict}"));
    output.result(serde_json::json!({ "row": row.index, "label": row.label, "road": road.name,
                            "states": states.into_iter().collect::<BTreeMap<_, _>>(),
                            "legal": reason.is_none(), "rule": rule, "reason": reason }));
    Ok(())
}

/// The value of a state as `--state` takes it: `Night`, `{ Rain: High, Fog: None }`.
fn shown(space: &Space, state: &StateDef, memory: &Memory) -> String {
    let cells = &memory.cells()[state.first_cell..][..state.cells];
    let values: Vec<String> = cells.iter().map(|value| space.show(*value, state.ty)).collect();
    match by_key(space, state, &values) {
        Some(entries) => format!("{{ {entries} }}"),
        None => values.first().cloned().unwrap_or_default(),
    }
}

/// The values of a state with their keys: `Rain: High, Fog: None`; `None` if it has no keys, or one value at all of them.
pub fn by_key(space: &Space, state: &StateDef, values: &[String]) -> Option<String> {
    let keys = space.enums[state.key?.0].variants.iter().zip(values);
    let entries: Vec<String> = keys.map(|(key, value)| format!("{key}: {value}")).collect();
    values.iter().any(|value| *value != values[0]).then(|| entries.join(", "))
}
