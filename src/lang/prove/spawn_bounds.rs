//! Spawns whose speed or distance may leave the bounds of `model::limits`.

use core::ops::RangeInclusive;

use crate::model::expr::Expr;
use crate::model::{EffectDef, Interval, SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, Space, code, effort};
use crate::prove::reach::spawn_figures;
use crate::syntax::Diagnostic;
use avastra_base::units::Rational;

/// One error for each speed or distance of a spawn that may leave its bounds, with the first row that shows
/// it. Rules are ignored, because `--without` can switch them off.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        for effect in &action.effects {
            let EffectDef::Spawn(spawn) = effect else { continue };
            let figures: [(&str, &str, &Expr, &RangeInclusive<f64>); 2] = [
                ("speed", "m/s", &spawn.speed, &SPAWN_SPEED_MPS),
                ("distance", "m", &spawn.distance, &SPAWN_DISTANCE_M),
            ];
            for (what, unit, expr, range) in figures {
                let mut rows = space.rows_of(index).iter().take_while(|_| !effort::is_spent());
                let found = rows.find_map(|row| {
                    let found = spawn_figures(space, row, expr)?;
                    (!lies_in(&found, range)).then_some((row, found))
                });
                let Some((row, found)) = found else { continue };
                let message = format!("the {what} of a spawn may lie out of bounds");
                let error = Diagnostic::error(code::OUT_OF_BOUNDS, message)
                    .at(expr.span, format!("{found} {unit} in `{}`", row.label))
                    .note("rules do not count here: they can be switched off")
                    .help(format!(
                        "give its parameters ranges that keep it within {} .. {} {unit}",
                        range.start(),
                        range.end()
                    ));
                diagnostics.push(error);
            }
        }
    }
    diagnostics
}

/// Whether [`report`] has an error about a spawn of an action.
pub(crate) fn is_out(space: &Space, action: usize) -> bool {
    let spawns = space.actions[action].effects.iter().filter_map(|effect| match effect {
        EffectDef::Spawn(spawn) => Some(spawn),
        EffectDef::Set(_) => None,
    });
    let figures =
        spawns.flat_map(|spawn| [(&spawn.speed, &SPAWN_SPEED_MPS), (&spawn.distance, &SPAWN_DISTANCE_M)]);
    figures.into_iter().any(|(expr, range)| {
        let mut rows = space.rows_of(action).iter().take_while(|_| !effort::is_spent());
        rows.any(|row| spawn_figures(space, row, expr).is_some_and(|found| !lies_in(&found, range)))
    })
}

fn lies_in(interval: &Interval, range: &RangeInclusive<f64>) -> bool {
    let end = |value: f64| Rational::from_f64(value).expect("the bounds are small whole numbers");
    let bounds = Interval::closed(end(*range.start()), end(*range.end()));
    interval.is_empty() || interval.intersect(&bounds) == *interval
}
