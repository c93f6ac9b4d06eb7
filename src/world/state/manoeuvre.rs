//! Which phase of a manoeuvre a road user is in.

use std::sync::Arc;

use avastra_lang::model::command::Command;
use avastra_lang::model::vocabulary::Field;

use crate::action::Course;
use crate::state::trace::{Trace, Traced, traced};

/// How far a road user is with a manoeuvre. To be handed over to another one adds that one's phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct PhaseCount {
    pub begun: u32,
    pub ended: u32,
    pub all: u32,
}

/// A manoeuvre under way.
#[derive(Debug, Clone)]
pub struct Running {
    pub course: Arc<Course>,
    pub phase: usize,
    pub stage: Stage,
    /// Tick at which the stage began.
    pub since: u64,
    pub tracked: Option<Tracked>,
}

impl Running {
    pub fn new(course: Arc<Course>, tick: u64) -> Running {
        Running { course, phase: 0, stage: Stage::Waiting(None), since: tick, tracked: None }
    }

    /// The phase that is under way: its manoeuvre, by its index in the space, its number from 1, and the tick in which it
    /// began.
    pub fn under_way(&self) -> Option<(usize, u32, u64)> {
        let is_under_way = matches!(self.stage, Stage::UnderWay(_));
        is_under_way.then_some((self.course.manoeuvre, self.phase as u32 + 1, self.since))
    }

    /// How many phases it has.
    pub fn phases(&self) -> u32 {
        self.course.phases() as u32
    }
}

/// A phase whose speed is told anew in every tick, until another one is told.
#[derive(Debug, Clone)]
pub struct Tracked {
    pub course: Arc<Course>,
    pub phase: usize,
    /// The command at its beginning.
    pub first: Command,
}

#[expect(clippy::large_enum_variant, reason = "few road users do a manoeuvre, and a command is plain data")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stage {
    /// Until what the phase waits for has held for long enough: the tick since which it has held.
    Waiting(Option<u64>),
    /// Until this tick, and until the rules let the phase begin.
    Holding(u64),
    /// Until the road user has done what it was told.
    UnderWay(Command),
    /// No phase is left; a speed is still tracked.
    Over,
}

traced! {
    Running { course, phase, stage, since, tracked };
    Tracked { course, phase, first };
}

impl Traced for Command {
    /// Only what later ticks read: the driver has the rest.
    fn trace(&self, trace: &mut Trace) {
        (self.speed_mps(), self.rate_mps2()).trace(trace);
        (self.says(Field::Turn), self.says(Field::Lane)).trace(trace);
        (self.says(Field::Offset), self.keep_m().is_some()).trace(trace);
        (self.keep_s().is_some(), self.says(Field::Early)).trace(trace);
    }
}

impl Traced for Course {
    fn trace(&self, trace: &mut Trace) {
        // Not which manoeuvre: they are numbered as the space declares them.
        (self.part, self.arguments().count()).trace(trace);
        self.arguments().for_each(|argument| trace.word(argument));
    }
}

impl Traced for Stage {
    fn trace(&self, trace: &mut Trace) {
        match self {
            Stage::Waiting(held) => (0_u64, *held).trace(trace),
            Stage::Holding(until) => (1_u64, *until).trace(trace),
            Stage::UnderWay(command) => (2_u64, *command).trace(trace),
            Stage::Over => trace.word(3),
        }
    }
}
