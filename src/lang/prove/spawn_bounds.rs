//! Spawns and orders whose figures may leave the bounds of `model::limits`.

use core::ops::RangeInclusive;
use std::collections::BTreeSet;

use crate::model::expr::ExprKind;
use crate::model::field::WrittenFigure;
use crate::model::vocabulary::{Field, Word};
use crate::model::{
    ACTION_ODDS_MAX, Interval, LIGHT_AT_M, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, Space, Type, WordExpr, code,
    effort, spawn_distance_m,
};
use crate::prove::enclose::{Known, enclose};
use crate::prove::reach::spawn_figures;
use crate::syntax::Diagnostic;
use crate::syntax::ast::Span;
use avastra_base::units::{Dimension, Rational};

/// One error for each figure of a spawn, an order or odds that may leave its bounds, with the first row that shows it. Rules
/// are ignored, because `--without` can switch them off.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    let of_rows = (0..space.actions.len()).flat_map(|action| errors(space, action));
    of_rows.chain(of_odds(space)).collect()
}

/// The error for odds of actions beyond their bounds.
pub(crate) fn odds_out_of_bounds(span: Span) -> Diagnostic {
    let error = Diagnostic::error(code::SETTING, "odds of actions are whole numbers");
    error.at(span, format!("wanted a whole number from 0 to {ACTION_ODDS_MAX}"))
}

/// One error for the odds of each action that may leave their bounds, once for a line that names several.
fn of_odds(space: &Space) -> Vec<Diagnostic> {
    let step_s = space.episode.step_s;
    let cells = space.cells_unknown();
    let known = Known { functions: &space.functions, locals: &[], cells: &cells, road: None, case: None };
    let mut found: Vec<Diagnostic> = Vec::new();
    let mut seen = BTreeSet::new();
    for odds in space.actions.iter().filter_map(|action| action.odds.as_ref()) {
        let may_be = enclose(odds, &known).interval();
        let is_rate = odds.ty == Type::Quantity(Dimension::RATE);
        let range = 0.0..=if is_rate { 1.0 / step_s } else { f64::from(ACTION_ODDS_MAX) };
        if lies_in(&may_be, &range) || !seen.insert((odds.span.file, odds.span.start)) {
            continue;
        }
        if is_rate {
            let error = Diagnostic::error(code::SETTING, "rates of actions lie from 0 to one a step");
            found.push(error.at(odds.span, format!("wanted at most 1 / ({step_s} s)")));
            continue;
        }
        let error = odds_out_of_bounds(odds.span);
        let help = "choose them by `match`, as in `match hour { Morning => 5, _ => 1 }`";
        found.push(if odds.reads_memory() { error.help(help) } else { error });
    }
    found
}

/// Whether [`report`] has an error about a spawn or an order of an action.
pub(crate) fn is_out(space: &Space, action: usize) -> bool {
    errors(space, action).next().is_some()
}

fn errors(space: &Space, action: usize) -> impl Iterator<Item = Diagnostic> {
    let of_spawns = space.actions[action].spawns().flat_map(|spawn| {
        let distance_m = match &spawn.verb {
            WordExpr::Fixed(verb) if !spawn.behind => spawn_distance_m(*verb),
            _ => SPAWN_DISTANCE_M,
        };
        let second = || spawn.row.as_ref().filter(|row| row.nth == 1);
        [
            Some(("speed", "a spawn", "m/s", &spawn.speed, SPAWN_SPEED_MPS)),
            Some(("distance", "a spawn", "m", &spawn.distance, distance_m)),
            second().map(|row| ("gap", "a row", "m", &row.apart, SPAWN_DISTANCE_M)),
            second()
                .and_then(|row| Some(("count", "a row", "", row.count.as_ref()?, 1.0..=row.named as f64))),
        ]
    });
    let of_spawns = of_spawns.flatten();
    let of_orders = space.actions[action].orders().flat_map(|order| {
        order.command.figures().map(|WrittenFigure { field, expr, unit }| {
            let bounds = match field {
                Field::Speed => order.moves.speeds_mps(),
                _ => unit.bounds,
            };
            (field.name(), "an order", unit.name, expr, bounds)
        })
    });
    let told = space.actions[action].spawns().flat_map(|spawn| spawn.told.figures());
    let of_spawns =
        of_spawns.chain(told.map(|WrittenFigure { field, expr, unit }| {
            (field.name(), "a spawn", unit.name, expr, unit.bounds)
        }));
    let of_lights = space.actions[action].light_orders();
    let of_lights =
        of_lights.filter_map(|light| Some(("at", "an order", "m", light.at.as_ref()?, LIGHT_AT_M)));
    of_spawns.chain(of_orders).chain(of_lights).filter_map(move |(what, whose, unit, expr, range)| {
        let mut rows = space.rows_of(action).iter().take_while(|_| !effort::is_spent());
        let (row, found) = rows.find_map(|row| {
            let found = spawn_figures(space, row, expr)?;
            (!lies_in(&found, &range)).then_some((row, found))
        })?;
        let message = format!("the {what} of {whose} may lie out of bounds");
        let error = Diagnostic::error(code::OUT_OF_BOUNDS, message)
            .at(expr.span, format!("{} in `{}`", found.shown(expr.ty, found.unit(expr.ty)), row.label))
            .note("rules do not count here: they can be switched off");
        let (low, high) = (range.start(), range.end());
        let how = match expr.any(|kind| matches!(kind, ExprKind::Local(_))) {
            true => "give its parameters ranges that keep it within",
            false => "keep it within",
        };
        let help = format!("{how} {low} .. {high} {unit}").trim_end().to_owned();
        Some(error.help(help))
    })
}

fn lies_in(interval: &Interval, range: &RangeInclusive<f64>) -> bool {
    let end = |value: f64| Rational::from_rounded(value).expect("the bounds are short numbers");
    let bounds = Interval::closed(end(*range.start()), end(*range.end()));
    interval.is_empty() || interval.intersect(&bounds) == *interval
}
