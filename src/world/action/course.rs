//! The manoeuvre that a road user does, with the values that its action gave it. The world asks it at every tick; it holds
//! no state itself.

use std::sync::Arc;

use avastra_lang::model::command::Command;
use avastra_lang::model::expr::{Expr, Who};
use avastra_lang::model::vocabulary::{Field, Known};
use avastra_lang::model::{ManoeuvreDef, PhaseDef, REPEAT, Value};

use super::later::{Later, LaterMoment};

/// Phases, one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Which manoeuvre it is, by its index in the space.
    pub manoeuvre: usize,
    /// It and all to which it may hand over, and which of them it is.
    parts: Arc<[Part]>,
    pub part: usize,
    /// How often it goes through its phases.
    times: usize,
    later: Later,
}

/// A manoeuvre, by its index in the space, with the rules in force on the moments at which its phases begin.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub manoeuvre: usize,
    pub definition: ManoeuvreDef,
    pub rules: Vec<Expr>,
}

impl Course {
    /// The part of that place, with the values of its arguments.
    pub(super) fn new(parts: Arc<[Part]>, part: usize, later: Later) -> Course {
        let Part { manoeuvre, definition, .. } = &parts[part];
        let moment = LaterMoment::default();
        // It asks for no moment. A `repeat` without a value counts as once.
        let times = definition.repeat.as_ref().map_or(1.0, |times| later.value(times, &moment).number());
        let times = times.clamp(*REPEAT.start(), *REPEAT.end()).max(*REPEAT.start()) as usize;
        Course { manoeuvre: *manoeuvre, parts, part, times, later }
    }

    fn definition(&self) -> &ManoeuvreDef {
        &self.parts[self.part].definition
    }

    fn rules(&self) -> &[Expr] {
        &self.parts[self.part].rules
    }

    /// How many phases it has, each counted as often as it comes.
    pub fn phases(&self) -> usize {
        self.definition().phases.len() * self.times
    }

    /// A phase, counted as often as it comes.
    pub fn phase(&self, phase: usize) -> &PhaseDef {
        let phases = &self.definition().phases;
        &phases[phase % phases.len()]
    }

    /// Whether rules say when its phases may begin.
    pub fn is_ruled(&self) -> bool {
        !self.rules().is_empty()
    }

    /// The value of an expression of its phases, if that is the same at every moment.
    pub fn constant(&self, expr: &Expr) -> Option<Value> {
        (expr.known() == Known::Road).then(|| self.later.value(expr, &LaterMoment::default()))
    }

    /// The name of whom a phase asks, by its index in the space.
    pub fn bearer(&self, who: Who) -> usize {
        who.bearer(&self.later.locals)
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
            let PhaseDef { once, held, within, after, only_if, command, then } = phase;
            let given = then.iter().flat_map(|call| &call.arguments);
            let parts = once.iter().chain(held).chain(within).chain(after).chain(only_if);
            parts.chain(command.parts()).chain(given).flat_map(asked).collect()
        };
        let phases = &self.definition().phases;
        phases.iter().flat_map(parts).chain(self.rules().iter().flat_map(asked)).collect()
    }

    /// Whether a phase waits for something.
    pub fn waits(&self, phase: usize) -> bool {
        self.phase(phase).once.is_some()
    }

    /// Whether what a phase waits for has come.
    pub fn has_come(&self, phase: usize, moment: &LaterMoment) -> bool {
        self.phase(phase).once.as_ref().is_none_or(|once| self.later.value(once, moment).truth())
    }

    /// How long that must have held without a break, s; 0 if nothing is written.
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
        self.rules().iter().all(|rule| self.later.value(rule, moment).truth())
    }

    /// Whether a phase that may begin comes at all.
    pub fn comes(&self, phase: usize, moment: &LaterMoment) -> bool {
        let only_if = self.phase(phase).only_if.as_ref();
        only_if.is_none_or(|condition| self.later.value(condition, moment).truth())
    }

    /// The manoeuvre to which a phase hands over.
    pub fn next(&self, phase: usize, moment: &LaterMoment) -> Option<Course> {
        let call = self.phase(phase).then.as_ref()?;
        let part = self.parts.iter().position(|part| part.manoeuvre == call.manoeuvre)?;
        let value = |argument: &Expr| self.later.value(argument, moment);
        let locals = call.arguments.iter().map(value).collect();
        Some(Course::new(Arc::clone(&self.parts), part, Later { locals, ..self.later.clone() }))
    }

    /// The speed alone that a phase tells, m/s; `None` if it has no value.
    pub fn speed_mps(&self, phase: usize, moment: &LaterMoment) -> Option<f64> {
        let speed = self.phase(phase).command.expr(Field::Speed)?;
        Some(self.later.value(speed, moment).number()).filter(|mps| !mps.is_nan())
    }

    /// The command of a phase to the road user, within the bounds of orders; `None` if a needed figure has no value.
    pub fn command(&self, phase: usize, moment: &LaterMoment) -> Option<Command> {
        self.later.command(&self.phase(phase).command, moment).within_bounds()
    }
}

/// A time, s. One below 0 or without a value is over.
fn not_negative(value: Value) -> f64 {
    value.number().max(0.0)
}
