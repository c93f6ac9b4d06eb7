//! One collision of an episode, found again in other plays of the same scenario.
//!
//! An obstacle is known by the step and the effect that made it appear, because its number depends on
//! which other steps were carried out. What comes after the collision's own step is left out of every
//! play; one step without an action is added, so that a collision that only comes later is still seen.

use std::sync::Arc;

use crate::episode;
use crate::episode::{Choice, Collision, End, EpisodeLog, Moment, Script, Setup};
use avastra_drivers::external::FailureKind;
use avastra_drivers::{Foresight, Selected};

use super::avoidable::judge;
use super::counted::counted_at_need;
use crate::episode::at_fault;

/// What became of a collision in another play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// The ego vehicle touches the same obstacle.
    Crash,
    /// It runs into another road user.
    Other,
    /// It touches no road user, or only others that ran into it or had to give way.
    Vanished,
    /// The obstacle never appeared: the play says nothing.
    Absent,
}

impl Fate {
    /// In words, for tables.
    pub fn in_words(self) -> &'static str {
        match self {
            Fate::Crash => "crash",
            Fate::Other => "another crash",
            Fate::Vanished => "no crash",
            Fate::Absent => "never met",
        }
    }
}

/// The outcome of a scenario that was found with a collision, played by another driving system. The space's verdict says
/// which collisions count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regression {
    /// A collision with the same obstacle counts.
    StillFails { time_s: f64 },
    /// It does not touch the obstacle, and no other collision counts.
    Fixed,
    /// A collision with another road user counts.
    OtherCrash,
    /// It touches the same obstacle, but no collision counts.
    NotCounted { time_s: f64 },
    /// The obstacle never appears, because another drive left no legal place for it.
    NeverMet,
    /// An external driving system failed before it hit anything.
    AdsFailed(FailureKind),
    /// The scenario ends with a failure of an external driving system, which fails in the same way.
    FailsAgain(FailureKind),
}

impl Regression {
    /// Whether a crash remains that is not the one of the scenario: with another obstacle, or one that does not count.
    pub fn is_other_crash(self) -> bool {
        matches!(self, Regression::OtherCrash | Regression::NotCounted { .. })
    }
}

/// Plays what led to the nth collision of a log with another driving system; `setup` is what the log was
/// played from. The space's verdict says which collisions count.
pub fn regression(setup: &Setup, log: &EpisodeLog, index: usize, ads: &Selected) -> Regression {
    let crash = Crash::new(setup, log, index);
    let again = crash.play(ads);
    let by_other = Setup { ads: ads.clone(), ..setup.clone() };
    let judge = || judge(&by_other, &crash.script, &again);
    let counted = counted_at_need(setup.table.space(), &again, judge);
    let obstacle = crash.obstacle(&again);
    let is_own = |collision: &&Collision| obstacle == Some(collision.contact.obstacle);
    let own_counted = counted.iter().map(|&index| &again.collisions[index]).find(is_own);
    match (own_counted, again.collisions.iter().find(is_own), again.end) {
        (Some(own), _, _) => Regression::StillFails { time_s: own.contact.time_s },
        _ if !counted.is_empty() => Regression::OtherCrash,
        (None, Some(own), _) => Regression::NotCounted { time_s: own.contact.time_s },
        (None, None, End::Failed(kind)) => Regression::AdsFailed(kind),
        (None, None, _) if obstacle.is_none() => Regression::NeverMet,
        (None, None, _) => Regression::Fixed,
    }
}

/// A collision of an episode, and how to play up to it.
pub(super) struct Crash<'a> {
    pub setup: &'a Setup<'a>,
    pub script: Script,
    /// The step at which the obstacle appeared, and its place among those that appeared then; `None` is
    /// ambient traffic.
    appeared: Option<(usize, usize)>,
    pub collision: Collision,
}

impl<'a> Crash<'a> {
    /// The nth collision of a log that was played from `setup`.
    pub fn new(setup: &'a Setup<'a>, log: &EpisodeLog, index: usize) -> Crash<'a> {
        let collision = log.collisions[index];
        let obstacle = collision.contact.obstacle;
        let place = |(step, logged): (usize, &episode::StepLog)| {
            Some((step, logged.outcome.spawned().iter().position(|id| *id == obstacle)?))
        };
        let appeared = log.steps.iter().enumerate().find_map(place);
        let mut script = Script::of_log(log);
        script.steps.truncate(collision.step + 1);
        script.steps.push(None);
        Crash { setup, script, appeared, collision }
    }

    /// Plays the script with a driving system.
    pub fn play(&self, ads: &Selected) -> EpisodeLog {
        let setup = Setup { ads: ads.clone(), ..self.setup.clone() };
        let choose = |moment: &Moment<'_>| self.script.choose(setup.table, moment);
        play(&setup, choose).0
    }

    /// What another play made of it.
    pub fn fate(&self, log: &EpisodeLog) -> Fate {
        let Some(obstacle) = self.obstacle(log) else { return Fate::Absent };
        if log.collisions.iter().any(|collision| collision.contact.obstacle == obstacle) {
            return Fate::Crash;
        }
        if log.collisions.iter().any(|collision| at_fault(&collision.contact)) {
            Fate::Other
        } else {
            Fate::Vanished
        }
    }

    /// The collision in another play, if the ego vehicle is at fault there, too.
    pub fn again<'l>(&self, log: &'l EpisodeLog) -> Option<&'l Collision> {
        let obstacle = self.obstacle(log)?;
        let same =
            |collision: &&Collision| collision.contact.obstacle == obstacle && at_fault(&collision.contact);
        log.collisions.iter().find(same)
    }

    /// The obstacle's number in another play.
    fn obstacle(&self, log: &EpisodeLog) -> Option<u32> {
        let Some((step, place)) = self.appeared else { return Some(self.collision.contact.obstacle) };
        log.steps.get(step)?.outcome.spawned().get(place).copied()
    }
}

/// Plays an episode and records where all other road users were.
pub(super) fn play(setup: &Setup, mut choose: impl FnMut(&Moment) -> Choice) -> (EpisodeLog, Arc<Foresight>) {
    let mut foresight = Foresight::default();
    let log = episode::run(setup, &mut choose, &mut |world, _, _| {
        foresight.record(world.ticks(), world.obstacles());
    });
    (log, Arc::new(foresight))
}
