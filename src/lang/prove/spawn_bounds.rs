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

fn lies_in(interval: &Interval, range: &RangeInclusive<f64>) -> bool {
    let end = |value: f64| Rational::from_f64(value).expect("the bounds are small whole numbers");
    let bounds = Interval::closed(end(*range.start()), end(*range.end()));
    interval.is_empty() || interval.intersect(&bounds) == *interval
}
