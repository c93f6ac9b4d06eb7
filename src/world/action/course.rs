//! The manoeuvre that a road user does, with the values that its action gave it. The world asks it at every tick; it holds
//! no state itself.

use avastra_lang::model::expr::Expr;
use avastra_lang::model::{ORDER_RATE_MPS2, PhaseDef, SPAWN_SPEED_MPS, Value};

use super::later::{Later, LaterMoment};

/// Phases, one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    pub(super) phases: Vec<PhaseDef>,
    pub(super) later: Later,
}

impl Course {
    pub fn phases(&self) -> usize {
        self.phases.len()
    }

    /// The values of the arguments, in bits.
    pub fn arguments(&self) -> impl Iterator<Item = u64> {
        self.later.locals.iter().map(|value| value.bits())
    }

    /// The names of road users that a phase asks about.
    pub fn bearers(&self, phase: usize) -> Vec<usize> {
        let PhaseDef { once, within, after, speed, rate } = &self.phases[phase];
        let parts = once.iter().chain(within).chain(after).chain([speed]).chain(rate);
        parts.flat_map(Expr::bearers).collect()
    }

    /// Whether what a phase waits for has come.
    pub fn has_come(&self, phase: usize, moment: &LaterMoment) -> bool {
        self.phases[phase].once.as_ref().is_none_or(|once| self.later.value(once, moment).truth())
    }

    /// How long a phase waits for that, s; `None` if it waits for ever. A time without a value (a division by 0) is over.
    pub fn within_s(&self, phase: usize, moment: &LaterMoment) -> Option<f64> {
        Some(not_negative(self.later.value(self.phases[phase].within.as_ref()?, moment)))
    }

    /// How long a phase waits after that, s.
    pub fn after_s(&self, phase: usize, moment: &LaterMoment) -> f64 {
        self.phases[phase].after.as_ref().map_or(0.0, |after| not_negative(self.later.value(after, moment)))
    }

    /// The speed that a phase goes over to, m/s, and how fast, m/s²: as asked for, within what an order may ask. `None` for
    /// a speed without a value.
    pub fn wants(&self, phase: usize, moment: &LaterMoment) -> Option<(f64, Option<f64>)> {
        let PhaseDef { speed, rate, .. } = &self.phases[phase];
        let within = |value: Value, range: core::ops::RangeInclusive<f64>| {
            let number = value.number();
            (!number.is_nan()).then(|| number.clamp(*range.start(), *range.end()))
        };
        let speed_mps = within(self.later.value(speed, moment), SPAWN_SPEED_MPS)?;
        Some((
            speed_mps,
            rate.as_ref().and_then(|rate| within(self.later.value(rate, moment), ORDER_RATE_MPS2)),
        ))
    }
}

/// A time, s. One below 0 or without a value is over.
fn not_negative(value: Value) -> f64 {
    value.number().max(0.0)
}
