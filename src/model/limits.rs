//! Bounds on the numbers that reach the world, whoever wrote them: a space, a scenario, a draw.
//!
//! The checker proves them for every row (`report`); the action table holds every draw to them again.

use core::ops::RangeInclusive;

use crate::model::bound::bounds;
use crate::model::code;
use crate::model::expr::Expr;
use crate::model::interval::Interval;
use crate::model::reach::spawn_figures;
use crate::model::space::{EffectDef, Space};
use crate::syntax::Diagnostic;
use crate::units::Rational;

/// The tick of physics, ms: an observation period is a whole number of ticks.
pub const TICK_MS: u32 = 20;

/// Speeds at which anything may be spawned, m/s.
pub const SPAWN_SPEED_MPS: RangeInclusive<f64> = 0.0..=70.0;

/// Distances from the ego vehicle at which anything may be spawned, m.
pub const SPAWN_DISTANCE_M: RangeInclusive<f64> = 0.0..=1000.0;

/// Where the cycle of the signals may begin, s.
pub const SIGNAL_PHASE_S: RangeInclusive<f64> = 0.0..=3600.0;

/// Most ambient vehicles around the ego vehicle.
pub const AMBIENT_MAX: u32 = 20;

/// Every spawn whose speed or distance may leave its bounds, once, with the first row that shows it.
/// Rules do not count: `--without` can switch them off.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let bounds = bounds(space, index);
        for effect in &action.effects {
            let EffectDef::Spawn(spawn) = effect else { continue };
            let figures: [(&str, &str, &Expr, &RangeInclusive<f64>); 2] = [
                ("speed", "m/s", &spawn.speed, &SPAWN_SPEED_MPS),
                ("distance", "m", &spawn.distance, &SPAWN_DISTANCE_M),
            ];
            for (what, unit, expr, range) in figures {
                let mut rows = space.rows.iter().filter(|row| row.action == index);
                let found = rows.find_map(|row| {
                    let found = spawn_figures(space, row, &bounds, expr)?;
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
