//! Unfair spawns: at some legal speed they lie within the stopping distance of a careful driver.
//!
//! The driver is that of UN R157 (Annex 4, Appendix 3): 0.4 s of perception, 0.75 s of reaction, then
//! 0.774 g. The time in which the brake builds up is left out: it only adds to the distance, and this proof
//! needs a lower bound. The world computes the whole distance (`spawn_gap >= safety_gap`).

use crate::model::rules::{Demand, RowRules};
use crate::model::vocabulary::{Field, Known, LaneChoice, Verb, Word};
use crate::model::{
    Facts, Memory, Road, Row, RulesInForce, Space, SpawnDef, Value, code, effort, evaluate, locals,
};
use crate::prove::lists::{OpenRow, open_rows};
use crate::prove::witness::{Left, Search, Witness};
use crate::syntax::Diagnostic;
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S, stopping_m};
use avastra_base::units::{Dimension, quantity, quantity_in, unit_of_all};

/// The most boxes of ranges looked at for all actions together; each action has an equal share.
const BOXES_MAX: usize = 50_000;

/// A smaller difference between the distances is taken for rounding, m.
const MARGIN_M: f64 = 0.01;

/// One remark for each action that can spawn unfairly on some road, with the speeds that show it.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let left = Left::new(BOXES_MAX / space.actions.len());
        for spawn in action.spawns() {
            let mut open = open_rows(space, space.rows_of(index)).take_while(|_| !effort::is_spent());
            diagnostics.extend(open.find_map(|OpenRow { row, road, .. }| {
                let found = unfair(space, row, road, spawn, &left)?;
                Some(remark(space, row, road, spawn, &found))
            }));
        }
    }
    diagnostics
}

/// Values with which a row spawns within the stopping distance on a road; `None` if none are found. Also `None` if a rule
/// asks the world, about the gap or the speed of the ego vehicle, and so decides by itself. A road user beside the middle
/// of a lane need not be in the way, and the distance to another road user is not known here.
fn unfair(space: &Space, row: &Row, road: &Road, spawn: &SpawnDef, left: &Left) -> Option<Witness> {
    let in_force = RulesInForce::by_default(space);
    let rules = RowRules { space, row, road: Some(&road.facts), in_force: &in_force };
    let asks = |demand| matches!(demand, Demand::Holds(condition) if condition.known() > Known::Road);
    let is_elsewhere = spawn.told.says(Field::Offset) || spawn.of.is_some() || spawn.trajectory.is_some();
    if is_elsewhere || rules.demands().any(|(_, demand)| asks(demand)) {
        return None;
    }
    Search { rules, left, moment: None }.find(&|values, memory| {
        let facts = Facts { road: Some(&road.facts), ..Facts::new(values, memory) };
        let figures = figures(space, road, spawn, values, memory);
        spawn.appears(&space.functions, &facts) && figures.needed_m > figures.distance_m + MARGIN_M
    })
}

/// Way from a speed to rest: reaction, then full brakes, m.
fn braked_m(speed_mps: f64) -> f64 {
    stopping_m(speed_mps, CAREFUL_DELAY_S, CAREFUL_BRAKING_MPS2)
}

/// How fast the ego vehicle is at most, m/s: at the limit, or as fast as it is to want to be.
fn driven_mps(road: &Road) -> f64 {
    road.facts.limit_mps.min(road.set_mps.unwrap_or(f64::INFINITY))
}

/// The spawn, and the gap that a driver at that speed needs.
struct Figures {
    speed_mps: f64,
    distance_m: f64,
    /// The gap that the driver needs at least.
    needed_m: f64,
}

fn figures(space: &Space, road: &Road, spawn: &SpawnDef, values: &[Value], memory: &Memory) -> Figures {
    let facts = Facts { road: Some(&road.facts), ..Facts::new(values, memory) };
    let number = |expr| evaluate(expr, &space.functions, &facts).number();
    let (speed_mps, distance_m) = (number(&spawn.speed), number(&spawn.distance));
    let ego_mps = driven_mps(road);
    let needed_m = match spawn.verb.word(&space.functions, &facts) {
        // In another lane, and before another line, it is not in the way.
        Verb::DriveAhead if spawn.lane.word(&space.functions, &facts) != LaneChoice::Current => {
            f64::NEG_INFINITY
        }
        Verb::CrossRoad if speed_mps == 0.0 => f64::NEG_INFINITY,
        Verb::DriveAhead | Verb::WalkAhead => braked_m((ego_mps - speed_mps).max(0.0)),
        Verb::DriveOpposite | Verb::WalkOpposite => {
            braked_m(ego_mps) + speed_mps * (CAREFUL_DELAY_S + ego_mps / CAREFUL_BRAKING_MPS2)
        }
        Verb::CrossRoad | Verb::Walk | Verb::Stand => braked_m(ego_mps),
        // A vehicle from behind sees the ego vehicle, which need do nothing.
        Verb::Overtake | Verb::DriveBehind => 0.0,
        // Where it begins has nothing to do with the ego vehicle.
        Verb::Follow => 0.0,
    };
    Figures { speed_mps, distance_m, needed_m }
}

fn remark(space: &Space, row: &Row, road: &Road, spawn: &SpawnDef, found: &Witness) -> Diagnostic {
    let action = &space.actions[row.action];
    let values = locals(action, row, &found.values);
    let after = space.memory_after(row.action, &values, &found.memory, Some(&road.facts), None);
    let figures = figures(space, road, spawn, &values, &after);
    let facts = Facts { road: Some(&road.facts), ..Facts::new(&values, &after) };
    let verb = spawn.verb.word(&space.functions, &facts);
    let shown = |value: f64, dimension: Dimension| match unit_of_all(&[value], dimension) {
        Some(unit) => quantity_in(value, dimension, Some(unit)),
        None => quantity((value * 100.0).round() / 100.0, dimension),
    };
    let message = format!("`{}` can appear where a careful driver could not avoid it", action.name);
    Diagnostic::remark(code::UNFAIR, message)
        .at(
            spawn.distance.span,
            format!("{} in `{}`", shown(figures.distance_m, Dimension::LENGTH), row.label),
        )
        .note(format!(
            "a careful driver at {}, the {} of `{}`, needs {} for a `{}` at {}",
            shown(driven_mps(road), Dimension::SPEED),
            if driven_mps(road) < road.facts.limit_mps { "`set_speed`" } else { "limit" },
            road.name,
            shown(figures.needed_m, Dimension::LENGTH),
            verb.name(),
            shown(figures.speed_mps, Dimension::SPEED),
        ))
        .help("forbid it with `rule no_teleport: spawn_gap >= safety_gap`, or begin farther away")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published distances of the regulation's driver include the time in which the brake builds
    /// up; ours must lie below them, and not by much.
    #[test]
    fn the_bound_lies_just_below_the_published_distances() {
        for (speed_kmph, distance_m) in [(10.0, 4.4), (30.0, 16.5), (50.0, 32.7), (60.0, 42.4)] {
            let bound_m = braked_m(speed_kmph / 3.6);
            assert!(bound_m < distance_m && bound_m > 0.8 * distance_m, "{speed_kmph} km/h: {bound_m}");
        }
    }
}
