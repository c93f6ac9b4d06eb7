//! Spawns and orders whose figures may leave the bounds of `model::limits`.

use core::ops::RangeInclusive;

use crate::model::command::OFFSET_M;
use crate::model::expr::ExprKind;
use crate::model::vocabulary::Word;
use crate::model::{Interval, MEET, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, Space, code, effort};
use crate::prove::reach::spawn_figures;
use crate::syntax::Diagnostic;
use avastra_base::units::Rational;

/// One error for each figure of a spawn or an order that may leave its bounds, with the first row that shows it. Rules are ignored, because `--without` can switch them off.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    (0..space.actions.len()).flat_map(|action| errors(space, action)).collect()
}

/// Whether [`report`] has an error about a spawn or an order of an action.
pub(crate) fn is_out(space: &Space, action: usize) -> bool {
    errors(space, action).next().is_some()
}

fn errors(space: &Space, action: usize) -> impl Iterator<Item = Diagnostic> {
    let of_spawns = space.actions[action].spawns().flat_map(|spawn| {
        [
            Some(("speed", "a spawn", "m/s", &spawn.speed, SPAWN_SPEED_MPS)),
            Some(("distance", "a spawn", "m", &spawn.distance, SPAWN_DISTANCE_M)),
            spawn.offset.as_ref().map(|offset| ("offset", "a spawn", "m", offset, OFFSET_M)),
            spawn.meet.as_ref().map(|meet| ("meet", "a spawn", "", meet, MEET)),
        ]
    });
    let of_spawns = of_spawns.flatten();
    let of_orders = space.actions[action]
        .orders()
        .flat_map(|order| order.command.figures())
        .map(|figure| (figure.field.name(), "an order", figure.unit, figure.expr, figure.bounds));
    of_spawns.chain(of_orders).filter_map(move |(what, whose, unit, expr, range)| {
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
