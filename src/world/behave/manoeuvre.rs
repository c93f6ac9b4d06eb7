//! How a manoeuvre goes on: which phase begins, what it tells, and when it is over.

use std::sync::Arc;

use avastra_lang::model::command::{Command, Moves};
use avastra_lang::model::vocabulary::Field;

use crate::action::LaterMoment;
use crate::state::manoeuvre::{Running, Stage, Tracked};
use crate::state::time::{DT_S, ticks};

/// A road user within this of a phase's speed has reached it, m/s, or within this part of it. Without a `rate`, the
/// driver model only approaches the speed.
const SPEED_REACHED_MPS: f64 = 0.1;
const SPEED_REACHED_PART: f64 = 0.02;

/// How far a road user is with what it was told.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Below 0 back to where it began, on foot.
    pub speed_mps: f64,
    /// Whether it is in the lane and at the offset that it was told.
    pub is_aside: bool,
    /// Whether the junction at which it was told to turn is behind it.
    pub has_turned: bool,
    /// Whether it is beside the ego vehicle as it was told, or was.
    pub has_met: bool,
    pub moves: Moves,
    /// Whether it is where its walk ends, this way or back: no speed would get it farther.
    pub is_over: bool,
}

impl Progress {
    /// Whether it has done what a command says.
    pub fn meets(&self, command: &Command) -> bool {
        let speed_mps = command.speed_mps().filter(|_| !command.pursues());
        // A road user that stands as told moves no farther to the side.
        let stands = self.moves != Moves::Walks && speed_mps == Some(0.0) && self.speed_mps == 0.0;
        !command.is_continuous()
            && speed_mps.is_none_or(|mps| self.is_over || self.has_speed(mps))
            && (self.has_met || !command.pursues())
            && (self.is_aside || stands || !command.goes_aside())
            && (self.has_turned || command.turn().is_none())
    }

    /// Whether it has the speed that a phase wants, m/s. A stop is exact, and a road user on a trajectory reaches every
    /// speed exactly.
    fn has_speed(&self, wanted_mps: f64) -> bool {
        let is_exact = wanted_mps == 0.0 || self.moves == Moves::Follows;
        let near_mps = SPEED_REACHED_MPS.max(SPEED_REACHED_PART * wanted_mps.abs());
        self.speed_mps == wanted_mps || !is_exact && (self.speed_mps - wanted_mps).abs() < near_mps
    }
}

/// The result of a tick for a manoeuvre.
pub struct Advance {
    /// The rest of the manoeuvre.
    pub rest: Option<Running>,
    /// The command of a phase that begins now, for the driver.
    pub command: Option<Command>,
    /// How many phases have begun, and ended. One that is left out has done both.
    pub begun: u32,
    pub ended: u32,
    /// Whether what is left is another manoeuvre.
    pub hands_over: bool,
}

impl Running {
    /// The value now of a phase's continuous speed, at the rate with which the phase began; `None` if there is none, or
    /// it has no value now.
    pub fn tracked(&self, moment: &LaterMoment, moves: Moves) -> Option<Command> {
        let Tracked { course, phase, first } = self.tracked.as_ref()?;
        let now = first.only(&[Field::Rate]).with(Field::Speed, course.speed_mps(*phase, moment)?);
        Some(now.for_who(moves))
    }

    /// The names of road users that its phases ask about.
    pub fn bearers(&self) -> Vec<usize> {
        let tracked = self.tracked.iter().filter(|tracked| !Arc::ptr_eq(&tracked.course, &self.course));
        self.course
            .bearers()
            .into_iter()
            .chain(tracked.flat_map(|tracked| tracked.course.bearers()))
            .collect()
    }

    /// Advances by one tick. `progress`: how far the road user is with what it was told.
    pub fn advance(mut self, moment: &LaterMoment, progress: Progress, tick: u64) -> Advance {
        let (mut begun, mut ended) = (0, 0);
        let stays = |rest, command, begun, ended| Advance { rest, command, begun, ended, hands_over: false };
        loop {
            match self.stage {
                Stage::Waiting(held) => {
                    let held = self.course.has_come(self.phase, moment).then(|| held.unwrap_or(tick));
                    let is_long = |since: u64| tick - since >= ticks(self.course.held_s(self.phase, moment));
                    if held.is_some_and(is_long) {
                        let holds = ticks(self.course.after_s(self.phase, moment));
                        (self.stage, self.since) = (Stage::Holding(tick.saturating_add(holds)), tick);
                        continue;
                    }
                    self.stage = Stage::Waiting(held);
                    let waited_s = (tick - self.since) as f64 * DT_S;
                    let is_over =
                        self.course.within_s(self.phase, moment).is_some_and(|most_s| waited_s >= most_s);
                    let rest = if is_over { self.over() } else { Some(self) };
                    return stays(rest, None, begun, ended);
                }
                Stage::Holding(until) if tick >= until && self.course.may_begin(moment) => {
                    if !self.course.comes(self.phase, moment) {
                        begun += 1;
                        ended += 1;
                        if !self.goes_on(tick) {
                            return stays(self.over(), None, begun, ended);
                        }
                        continue;
                    }
                    let Some(command) = self.course.command(self.phase, moment) else {
                        return stays(self.over(), None, begun, ended);
                    };
                    begun += 1;
                    let command = command.for_who(progress.moves);
                    if command.speed_mps().is_some() || command.pursues() {
                        let course = Arc::clone(&self.course);
                        let tracked = Tracked { course, phase: self.phase, first: command };
                        self.tracked = command.is_continuous().then_some(tracked);
                    }
                    if let Some(next) = self.course.next(self.phase, moment) {
                        let rest = Running { tracked: self.tracked, ..Running::new(Arc::new(next), tick) };
                        let (rest, command) = (Some(rest), Some(command));
                        return Advance { hands_over: true, ..stays(rest, command, begun, ended + 1) };
                    }
                    (self.stage, self.since) = (Stage::UnderWay(command), tick);
                    return stays(Some(self), Some(command), begun, ended);
                }
                Stage::UnderWay(command)
                    if tick > self.since && (progress.meets(&command) || self.next_has_come(moment)) =>
                {
                    ended += 1;
                    if !self.goes_on(tick) {
                        return stays(self.over(), None, begun, ended);
                    }
                }
                Stage::Over | Stage::Holding(_) | Stage::UnderWay(_) => {
                    return stays(Some(self), None, begun, ended);
                }
            }
        }
    }

    /// The rest once no phase is left: a speed that is tracked.
    fn over(self) -> Option<Running> {
        self.tracked.is_some().then_some(Running { stage: Stage::Over, ..self })
    }

    /// Goes on to the next phase, if there is one.
    fn goes_on(&mut self, tick: u64) -> bool {
        self.phase += 1;
        (self.stage, self.since) = (Stage::Waiting(None), tick);
        self.phase < self.course.phases()
    }

    /// Whether what the next phase waits for has come: it does not wait for the end of this one.
    fn next_has_come(&self, moment: &LaterMoment) -> bool {
        self.phase + 1 < self.course.phases()
            && self.course.waits(self.phase + 1)
            && self.course.has_come(self.phase + 1, moment)
    }
}
