//! One finding of an episode, a collision or a breach, found again in other plays of the same scenario.
//!
//! An obstacle is known by the step and the effect that made it appear, because its number depends on
//! which other steps were carried out. Steps after the finding's own step are left out of every
//! play. One step without an action is added, so that a finding that only comes later is still seen.

use std::sync::Arc;

use crate::episode;
use crate::episode::{Breach, Choice, Collision, End, EpisodeLog, Moment, Script, Setup};
use avastra_drivers::external::FailureKind;
use avastra_drivers::{Foresight, Selected};

use super::avoidable::judge;
use super::counted::counted_at_need;
use crate::episode::at_fault;

/// A hazard begins at most this long before its collision, s: longer than any reaction or braking, because
/// ambient traffic may have appeared long before.
pub(super) const LOOK_BACK_S: f64 = 15.0;

/// A finding of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// By index among the collisions of the log.
    Collision(usize),
    /// By index among the breaches of the log.
    Breach(usize),
}

impl Found {
    /// The step in which it happened.
    pub fn step(self, log: &EpisodeLog) -> usize {
        match self {
            Found::Collision(index) => log.collisions[index].step,
            Found::Breach(index) => log.breaches[index].step,
        }
    }

    /// The noun for it: `crash` or `breach`.
    pub fn noun(self) -> &'static str {
        match self {
            Found::Collision(_) => "crash",
            Found::Breach(_) => "breach",
        }
    }
}

/// The fate of a finding in another play.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// The ego vehicle touches the same obstacle, or breaches the same requirement.
    Same,
    /// It runs into another road user.
    Other,
    /// It touches no road user, or only others that ran into it or had to give way; it keeps the requirement.
    Vanished,
    /// The obstacle never appeared: the play says nothing.
    Absent,
    /// An external driving system failed before that: the play says nothing.
    Failed,
}

impl Fate {
    /// In words, for tables; `noun` is [`Found::noun`].
    pub fn in_words(self, noun: &str) -> String {
        match self {
            Fate::Same => noun.to_owned(),
            Fate::Other => "another crash".to_owned(),
            Fate::Vanished => format!("no {noun}"),
            Fate::Absent => "never met".to_owned(),
            Fate::Failed => "it failed".to_owned(),
        }
    }
}

/// The outcome of a scenario that was found with a collision, played by another driving system. The space's verdict says
/// which collisions count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regression {
    /// A collision with the same obstacle counts.
    StillFails { time_s: f64 },
    /// It does not touch the obstacle, and no other collision counts; when other road users crash into each other, if they do.
    Fixed { others_crash_s: Option<f64> },
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
    /// How bad it is for the driving system: of several crashes of a scenario the worst is its outcome.
    pub fn rank(self) -> u32 {
        match self {
            Regression::Fixed { .. } => 0,
            Regression::NeverMet => 1,
            Regression::NotCounted { .. } => 2,
            Regression::OtherCrash => 3,
            Regression::AdsFailed(_) => 4,
            Regression::FailsAgain(_) => 5,
            Regression::StillFails { .. } => 6,
        }
    }

    /// Whether a crash remains that is not the one of the scenario: with another obstacle, or one that does not count.
    pub fn is_other_crash(self) -> bool {
        matches!(self, Regression::OtherCrash | Regression::NotCounted { .. })
    }
}

/// Plays what led to the nth collision of a log with another driving system; `setup` is what the log was
/// played from. The space's verdict says which collisions count.
pub fn regression(setup: &Setup, log: &EpisodeLog, index: usize, ads: &Selected) -> Regression {
    let crash = Case::new(setup, log, Found::Collision(index));
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
        (None, None, _) => Regression::Fixed { others_crash_s: again.others_crash_s() },
    }
}

/// A finding of an episode, and how to play up to it.
pub(super) struct Case<'a> {
    pub setup: &'a Setup,
    pub script: Script,
    pub what: What,
}

/// The finding that must be found again.
#[derive(Debug, Clone, Copy)]
pub(super) enum What {
    Collision {
        collision: Collision,
        /// The step at which the obstacle appeared, and its place among those that appeared then; `None` is
        /// ambient traffic.
        appeared: Option<(usize, usize)>,
    },
    Breach(Breach),
}

impl<'a> Case<'a> {
    /// A finding of a log that was played from `setup`.
    pub fn new(setup: &'a Setup, log: &EpisodeLog, found: Found) -> Case<'a> {
        let what = match found {
            Found::Collision(index) => {
                let collision = log.collisions[index];
                let obstacle = collision.contact.obstacle;
                let place = |(step, logged): (usize, &episode::StepLog)| {
                    Some((step, logged.outcome.spawned().iter().position(|id| *id == obstacle)?))
                };
                What::Collision { collision, appeared: log.steps.iter().enumerate().find_map(place) }
            }
            Found::Breach(index) => What::Breach(log.breaches[index]),
        };
        let mut script = Script::of_log(log);
        script.steps.truncate(found.step(log) + 1);
        script.steps.push(None);
        Case { setup, script, what }
    }

    /// When it happened, s.
    pub fn time_s(&self) -> f64 {
        match self.what {
            What::Collision { collision, .. } => collision.contact.time_s,
            What::Breach(breach) => breach.time_s,
        }
    }

    /// The beginning of the hazard, s: when its obstacle appeared, but at most [`LOOK_BACK_S`] before.
    pub fn begins_s(&self) -> f64 {
        let begun_s = match self.what {
            What::Collision { collision, .. } => collision.spawned_s,
            What::Breach(_) => 0.0,
        };
        begun_s.max(self.time_s() - LOOK_BACK_S)
    }

    /// Plays the script with a driving system.
    pub fn play(&self, ads: &Selected) -> EpisodeLog {
        let setup = Setup { ads: ads.clone(), ..self.setup.clone() };
        let choose = |moment: &Moment<'_>| self.script.choose(moment);
        play(&setup, choose).0
    }

    /// Its fate in the log of another play.
    pub fn fate(&self, log: &EpisodeLog) -> Fate {
        let is_same = match self.what {
            What::Collision { .. } => {
                let Some(obstacle) = self.obstacle(log) else { return Fate::Absent };
                log.collisions.iter().any(|collision| collision.contact.obstacle == obstacle)
            }
            What::Breach(_) => self.is_again(log),
        };
        if is_same {
            Fate::Same
        } else if log.failure.is_some() {
            Fate::Failed
        } else if log.collisions.iter().any(|collision| at_fault(&collision.contact)) {
            Fate::Other
        } else {
            Fate::Vanished
        }
    }

    /// Whether another play has the same collision, or breaches the same requirement. If the ego vehicle is at fault in the
    /// collision of this one, it must be there, too.
    pub fn is_again(&self, log: &EpisodeLog) -> bool {
        match self.what {
            What::Collision { collision, .. } => {
                let Some(obstacle) = self.obstacle(log) else { return false };
                let is_blamed = at_fault(&collision.contact);
                let same = |other: &Collision| {
                    other.contact.obstacle == obstacle && (!is_blamed || at_fault(&other.contact))
                };
                log.collisions.iter().any(same)
            }
            What::Breach(breach) => log.breaches.iter().any(|other| other.requirement == breach.requirement),
        }
    }

    /// As [`Case::is_again`]; `None` if the driving system failed in the play before, so that it says nothing.
    pub fn tells(&self, log: &EpisodeLog) -> Option<bool> {
        let is_again = self.is_again(log);
        (is_again || log.failure.is_none()).then_some(is_again)
    }

    /// The obstacle's number in another play, if the case is about one that appears there.
    fn obstacle(&self, log: &EpisodeLog) -> Option<u32> {
        match self.what {
            What::Collision { appeared: Some((step, place)), .. } => {
                log.steps.get(step)?.outcome.spawned().get(place).copied()
            }
            What::Collision { collision, .. } => Some(collision.contact.obstacle),
            What::Breach(_) => None,
        }
    }
}

/// Plays an episode and records where all other road users were.
pub(super) fn play(setup: &Setup, mut choose: impl FnMut(&Moment) -> Choice) -> (EpisodeLog, Arc<Foresight>) {
    let mut foresight = Foresight::default();
    let log = episode::run_watched(setup, &mut choose, &mut |world, _, _| {
        foresight.record(world.ticks(), world.obstacles());
    });
    (log, Arc::new(foresight))
}
