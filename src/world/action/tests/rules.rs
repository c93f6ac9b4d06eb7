use std::cell::Cell;
use std::path::Path;

use super::{Plain, table, value_of};
use crate::action::{ActionTable, Draw, Refusal, Situation};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::check::{ReadError, load};
use avastra_lang::model::rules::{Before, Choose, Room, RowRules, TRIES_MAX, Unsolved};
use avastra_lang::model::{RulesInForce, Value, locals};
use avastra_lang::syntax::{Style, render};

#[test]
fn draws_are_short_and_independent_of_each_other() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let rules = RulesInForce::by_default(table.space());
    let road = &table.space().roads[0];
    let situation = Situation {
        memory: &memory,
        road,
        rules: &rules,
        surroundings: &Plain(0.0),
        seed: 3,
        step: 4,
        happened_s: &[],
    };
    for (row, offer) in table.offers(&situation).iter().enumerate() {
        assert_eq!(*offer, table.offer(&situation, row));
        let Ok(draw) = offer else { continue };
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
    let situation = Situation {
        memory: &memory,
        road,
        rules: &rules,
        surroundings: &Plain(0.0),
        seed: 3,
        step: 4,
        happened_s: &[],
    };
    let row = table.rows().iter().position(|row| row.label.starts_with("drive_ahead(lane: Current")).unwrap();
    let mut draw = table.offer(&situation, row).unwrap();
    for (name, value) in &mut draw.values {
        if &**name == "speed" {
            *value = Value::Number(19.0);
        }
    }
    let refusals = table.check(&situation, row, &draw.values).unwrap_err();
    let rules: Vec<&str> = refusals.iter().filter_map(|refusal| refusal.rule.as_deref()).collect();
    assert_eq!(rules, ["npc_gap", "npc_speed"]);
    assert!(refusals[1].reason.contains("speed = 19 m/s, wanted <= 11.176 m/s"), "{}", refusals[1].reason);
}

#[test]
fn a_first_draw_lies_where_its_shares_say() {
    let table = table("scenarios/avastra45.ava");
    let memory = table.space().initial_memory(3);
    let rules = RulesInForce::by_default(table.space());
    let road = &table.space().roads[0];
    let situation = Situation {
        memory: &memory,
        road,
        rules: &rules,
        surroundings: &Plain(0.0),
        seed: 3,
        step: 4,
        happened_s: &[],
    };
    let row = table.rows().iter().position(|row| row.label.starts_with("pedestrian(from: Left")).unwrap();
    let drawn = |shares: &[f64]| {
        let draw = table.offers_at(&situation, shares).swap_remove(row).unwrap();
        (value_of(&draw.values, "mode").unwrap(), value_of(&draw.values, "speed").unwrap().number())
    };
    // Side, mode, speed: the rule bounds the speed by 1.4 m/s.
    let (near, slow_mps) = drawn(&[0.5, 0.0, 0.0]);
    let (far, fast_mps) = drawn(&[0.5, 0.9, 0.99]);
    assert!(near != far && slow_mps == 0.5 && (1.35..=1.4).contains(&fast_mps), "{slow_mps} {fast_mps}");
    // A parameter without a share is drawn by chance, and so are all of them without shares.
    assert_eq!(drawn(&[0.5, 0.9]).0, far);
    assert_eq!(table.offers_at(&situation, &[]), table.offers(&situation));
}

#[test]
fn the_text_of_one_road_has_its_ranges() {
    let text = table("scenarios/avastra45.ava").text(Some("corner"));
    assert!(text.contains("speed 10.00..11.18 m/s"), "{text}");
}

struct ByChance(Rng);

impl Choose for ByChance {
    fn value(&mut self, _: usize, left: &[Value]) -> Value {
        left[rng::below(&mut self.0, left.len() as u32) as usize]
    }

    fn number(&mut self, _: usize, room: &Room) -> Option<f64> {
        room.at(rng::unit(&mut self.0))
    }
}

/// A table of a space on Road 2 that declares this.
fn declared(declarations: &str) -> ActionTable {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let root = scenarios.join("test.ava");
    let read = |path: &Path| match path.ends_with("test.ava") {
        true => Ok(format!("language 1\nuse \"roads.ava\"\n{declarations}")),
        false => std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string())),
    };
    let loaded = load(&root, &read).expect("it can be read");
    let shown = loaded.diagnostics.iter().map(|found| render(found, &loaded.sources, Style::Plain));
    ActionTable::new(
        loaded.space.clone().unwrap_or_else(|| panic!("{}", shown.collect::<Vec<_>>().join("\n"))),
    )
}

/// The offers that a space makes for its only row, in so many episodes.
fn offered(table: &ActionTable, episodes: u64) -> Vec<Result<Draw, Refusal>> {
    let memory = table.space().initial_memory(1);
    let rules = RulesInForce::by_default(table.space());
    let offer = |seed| {
        let (road, surroundings) = (&table.space().roads[0], &Plain(0.0));
        table.offer(
            &Situation { memory: &memory, road, rules: &rules, surroundings, seed, step: 4, happened_s: &[] },
            0,
        )
    };
    (0..episodes).map(offer).collect()
}

/// A rule about a magnitude, or about the smaller of two distances, bounds the distances that are drawn.
#[test]
fn draws_keep_to_rules_about_magnitudes_and_the_least() {
    for (rule, is_kept) in [
        ("abs(distance - 60 m) >= 40 m", (|m| m <= 20.0 || m >= 100.0) as fn(f64) -> bool),
        ("abs(distance - 60 m) <= 10 m", |m| (50.0..=70.0).contains(&m)),
        ("min(distance, 120 m - distance) <= 20 m", |m| m <= 20.0 || m >= 100.0),
        ("max(distance, 120 m - distance) <= 70 m", |m| (50.0..=70.0).contains(&m)),
    ] {
        let table = declared(&format!(
            "action ahead(any distance: Length in 5 m .. 115 m) {{
  spawn Sedan ahead distance {{ lane: Current, speed: 10 m/s, does: DriveAhead }}
}}
rule kept on ahead: {rule}
"
        ));
        let draws = offered(&table, 60);
        let metres: Vec<f64> = draws
            .iter()
            .map(|draw| value_of(&draw.as_ref().expect(rule).values, "distance").unwrap().number())
            .collect();
        assert!(metres.iter().all(|m| is_kept(*m)), "{rule}: {metres:?}");
        let below = metres.iter().filter(|m| **m < 60.0).count();
        assert!((15..=45).contains(&below), "{rule}: {below} of 60 below the middle");
    }
}

/// A pedestrian that appears in the same row, before or after the car, takes nothing from the order.
#[test]
fn an_order_reaches_the_vehicle_it_names() {
    let car = "spawn Sedan as car ahead 40 m { lane: Current, speed: 10 m/s, does: DriveAhead }";
    let walker = "spawn Pedestrian as walker ahead 60 m { side: Right, speed: 1 m/s, does: Walk }";
    for both in [[car, walker], [walker, car]] {
        let table =
            declared(&format!("action both() {{\n{}\norder car {{ lane: Left }}\n}}\n", both.join("\n")));
        let offer = &offered(&table, 1)[0];
        assert!(offer.is_ok(), "{offer:?}");
    }
}

/// Values that the solver keeps for its next solution change no solution. Here large vehicles have no distance: every
/// third draw meets one and is made again backwards.
#[test]
fn a_solver_used_again_draws_what_a_new_one_draws() {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let root = scenarios.join("avastra45.ava");
    let read = |path: &Path| {
        let text = std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()))?;
        let (from, to) = ("let weight_size = 1.0", "let weight_size = 128.0");
        assert!(path != root || text.contains(from), "the space weighs otherwise");
        Ok(text.replace(from, to))
    };
    let space = load(&root, &read).expect("it can be read").space.expect("it is sound");
    let (memory, rules, road) = (space.initial_memory(3), RulesInForce::by_default(&space), &space.roads[0]);
    let (mut draws, mut again, mut anew) = (0, 0, 0);
    for row in &space.rows {
        let action = &space.actions[row.action];
        let parameters = action.parameters.iter().enumerate();
        let open: Vec<usize> = parameters.filter(|(_, p)| !p.axis).map(|(local, _)| local).collect();
        let row_rules = RowRules { space: &space, row, road: Some(&road.facts), in_force: &rules };
        let given = locals(action, row, &[]);
        let (kept_tries, new_tries) = (Cell::new(TRIES_MAX), Cell::new(TRIES_MAX));
        let before = |tries| Before { memory: &memory, world: None, tries };
        let Ok(mut kept) = row_rules.solver(given.clone(), &open, before(&kept_tries)) else { continue };
        for draw in 0..24 {
            kept_tries.set(TRIES_MAX);
            new_tries.set(TRIES_MAX);
            let chance = || ByChance(rng::stream(draw, Stream::Draw, row.index as u64));
            let told = |unsolved: Unsolved| (unsolved.clause, unsolved.local, unsolved.is_proved);
            let found = kept.solve(&mut chance()).map_err(told);
            let wanted = row_rules.solve(given.clone(), &open, before(&new_tries), &mut chance());
            assert_eq!(found, wanted.map_err(told), "{}", row.label);
            draws += usize::from(found.is_ok());
            again += TRIES_MAX - kept_tries.get();
            anew += TRIES_MAX - new_tries.get();
        }
    }
    assert!(draws > 500 && again * 2 < anew, "{draws} draws, {again} tries and {anew}");
}
