//! Spawns whose speed or distance may leave the bounds of `model::limits`.

use core::ops::RangeInclusive;

use crate::model::{Interval, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, Space, code, effort};
use crate::prove::reach::spawn_figures;
use crate::syntax::Diagnostic;
use avastra_base::units::Rational;

/// One error for each speed or distance of a spawn that may leave its bounds, with the first row that shows
/// it. Rules are ignored, because `--without` can switch them off.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    (0..space.actions.len()).flat_map(|action| errors(space, action)).collect()
}

/// Whether [`report`] has an error about a spawn of an action.
pub(crate) fn is_out(space: &Space, action: usize) -> bool {
    errors(space, action).next().is_some()
}

fn errors(space: &Space, action: usize) -> impl Iterator<Item = Diagnostic> {
    let figures = space.actions[action].spawns().flat_map(|spawn| {
        [
            ("speed", "m/s", &spawn.speed, &SPAWN_SPEED_MPS),
            ("distance", "m", &spawn.distance, &SPAWN_DISTANCE_M),
        ]
    });
    figures.filter_map(move |(what, unit, expr, range)| {
        let mut rows = space.rows_of(action).iter().take_while(|_| !effort::is_spent());
        let (row, found) = rows.find_map(|row| {
            let found = spawn_figures(space, row, expr)?;
            (!lies_in(&found, range)).then_some((row, found))
        })?;
        let message = format!("the {what} of a spawn may lie out of bounds");
        let error = Diagnostic::error(code::OUT_OF_BOUNDS, message)
            .at(expr.span, format!("{found} {unit} in `{}`", row.label))
            .note("rules do not count here: they can be switched off");
        let (low, high) = (range.start(), range.end());
        let help = format!("give its parameters ranges that keep it within {low} .. {high} {unit}");
        Some(error.help(help))
    })
}

fn lies_in(interval: &Interval, range: &RangeInclusive<f64>) -> bool {
    let end = |value: f64| Rational::from_f64(value).expect("the bounds are small whole numbers");
    let bounds = Interval::closed(end(*range.start()), end(*range.end()));
    interval.is_empty() || interval.intersect(&bounds) == *interval
}
