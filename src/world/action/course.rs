//! The manoeuvre that a road user does, with the values that its action gave it. The world asks it at every tick; it holds
//! no state itself.

use avastra_lang::model::command::Command;
use avastra_lang::model::expr::{Expr, Who};
use avastra_lang::model::{PhaseDef, Value};

use super::later::{Later, LaterMoment};

/// Phases, one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Which manoeuvre it is, by its index in the space.
    pub manoeuvre: usize,
    pub(super) phases: Vec<PhaseDef>,
    /// How often it goes through them.
    pub(super) times: usize,
    /// The rules in force on the moments at which phases begin.
    pub(super) rules: Vec<Expr>,
    pub(super) later: Later,
}

impl Course {
    /// How many phases it has, each counted as often as it comes.
    pub fn phases(&self) -> usize {
        self.phases.len() * self.times
    }

    fn phase(&self, phase: usize) -> &PhaseDef {
        &self.phases[phase % self.phases.len()]
    }

    /// The values of the arguments, in bits.
    pub fn arguments(&self) -> impl Iterator<Item = u64> {
        self.later.locals.iter().map(|value| value.bits())
    }

    /// The names of road users that its phases and their rules ask about: several phases may be asked in one tick.
    pub fn bearers(&self) -> Vec<usize> {
        let name = |who: Who| who.bearer(&self.later.locals);
        let asked = |expr: &Expr| expr.asked().into_iter().map(name).collect::<Vec<_>>();
        let parts = |phase: &'_ PhaseDef| -> Vec<usize> {
            let PhaseDef { once, held, within, after, command } = phase;
            let parts = once.iter().chain(held).chain(within).chain(after).chain(command.parts());
            parts.flat_map(asked).collect()
        };
        self.phases.iter().flat_map(parts).chain(self.rules.iter().flat_map(asked)).collect()
    }

    /// Whether a phase waits for something.
    pub fn waits(&self, phase: usize) -> bool {
        self.phase(phase).once.is_some()
    }

    /// Whether what a phase waits for has come.
    pub fn has_come(&self, phase: usize, moment: &LaterMoment) -> bool {
        self.phase(phase).once.as_ref().is_none_or(|once| self.later.value(once, moment).truth())
    }

    /// How long that must have held without a break, s.
    pub fn held_s(&self, phase: usize, moment: &LaterMoment) -> f64 {
        self.time_s(self.phase(phase).held.as_ref(), moment)
    }

    /// How long a phase waits for that, s; `None` if it waits for ever. A time without a value (a division by 0) is over.
    pub fn within_s(&self, phase: usize, moment: &LaterMoment) -> Option<f64> {
        Some(not_negative(self.later.value(self.phase(phase).within.as_ref()?, moment)))
    }

    /// How long a phase waits after that, s.
    pub fn after_s(&self, phase: usize, moment: &LaterMoment) -> f64 {
        self.time_s(self.phase(phase).after.as_ref(), moment)
    }

    fn time_s(&self, written: Option<&Expr>, moment: &LaterMoment) -> f64 {
        written.map_or(0.0, |time| not_negative(self.later.value(time, moment)))
    }

    /// Whether the rules let a phase begin.
    pub fn may_begin(&self, moment: &LaterMoment) -> bool {
        self.rules.iter().all(|rule| self.later.value(rule, moment).truth())
    }

    /// What a phase tells the vehicle, within what an order may say. `None` if its speed or its offset has no value; a
    /// `rate`, an `aside` or a `time_gap` without one is left out.
    pub fn command(&self, phase: usize, moment: &LaterMoment) -> Option<Command> {
        self.later.command(&self.phase(phase).command, moment).within_bounds()
    }
}

/// A time, s. One below 0 or without a value is over.
fn not_negative(value: Value) -> f64 {
    value.number().max(0.0)
}
