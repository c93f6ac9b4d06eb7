//! Which phase of a manoeuvre a road user is in.

use std::sync::Arc;

use avastra_lang::model::command::Command;

use crate::action::Course;
use crate::state::trace::Trace;

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

    pub fn trace(&self, trace: &mut Trace) {
        let Running { course, phase, stage, since, tracked } = self;
        trace.words([course.part as u64, *phase as u64, *since, course.arguments().count() as u64]);
        trace.words(course.arguments());
        match *stage {
            Stage::Waiting(held) => trace.words([0, held.map_or(0, |tick| tick + 1)]),
            Stage::Holding(until) => trace.words([1, until]),
            Stage::UnderWay(command) => {
                trace.word(2);
                trace_command(&command, trace);
            }
            Stage::Over => trace.word(3),
        }
        trace.flags([tracked.is_some()]);
        if let Some(Tracked { course, phase, first }) = tracked {
            trace.words([course.part as u64, *phase as u64, course.arguments().count() as u64]);
            trace.words(course.arguments());
            trace_command(first, trace);
        }
    }
}

/// A phase whose speed is told anew in every tick, until another one is told.
#[derive(Debug, Clone)]
pub struct Tracked {
    pub course: Arc<Course>,
    pub phase: usize,
    /// What it told first.
    pub first: Command,
}

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

/// What was told, as far as it is still asked.
fn trace_command(command: &Command, trace: &mut Trace) {
    let Command {
        speed_mps,
        rate_mps2,
        turn,
        // Whether one of them is said is asked below; how, was handed over to the driver as it was told.
        lane: _,
        offset_m: _,
        keep_m: _,
        keep_s: _,
        early_s: _,
        // These were handed over as they were told.
        is_continuous: _,
        aside_mps: _,
        aside_s: _,
        time_gap_s: _,
        to: _,
        at_m: _,
        reach_m: _,
        steady_m: _,
        ignores: _,
        siren: _,
        lights: _,
    } = command;
    trace.flags([
        speed_mps.is_some(),
        rate_mps2.is_some(),
        turn.is_some(),
        command.goes_aside(),
        command.pursues(),
    ]);
    trace.numbers(speed_mps.iter().chain(rate_mps2).copied());
}
