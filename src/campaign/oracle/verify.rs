//! The claims of an emitted scenario against what a replay finds.

use std::fmt::Display;

use crate::episode::{Breach, Collision, EpisodeLog};
use avastra_drivers::Module;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{COUNTED, Claim, Figure, Obstacle, Scenario, Space, digest_text};

use super::avoidable::Judgement;
use super::case::Found;
use super::cause::NoModules;
use super::kept::Breached;
use super::recurrence::Recurrence;
use super::{facts, unmet};

/// The text for a claim about a breach where there is none.
const NO_BREACH: &str = "kept, or not in force";

/// One claim, and what the replay says of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ClaimResult {
    /// The claim in words.
    pub claim: String,
    /// None if it could not be tried.
    pub confirmed: Option<bool>,
    /// The replay's finding instead, or `as claimed`; or why it was not tried.
    pub found: String,
}

impl ClaimResult {
    pub fn is_refuted(&self) -> bool {
        self.confirmed == Some(false)
    }
}

/// An external driving system that is known by its recorded answers alone cannot drive anything else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not tried (needs the driving system: `--ads`)")]
pub struct NoTries;

/// Findings that take many replays. Only some claims ask for them. Each is about the nth collision of the log.
pub struct Replays<'a> {
    /// The modules at fault.
    pub cause: &'a dyn Fn(usize) -> Result<Vec<Module>, NoModules>,
    /// The breached requirements, and the drivers that would have kept them; `None` if that is not tried.
    pub breached: &'a dyn Fn() -> Option<Vec<Breached>>,
    /// How often a finding happens again in so many replays under other chance: from the start, or from a moment on, s.
    pub recurrence: &'a dyn Fn(Found, Option<f64>, u32) -> Result<Recurrence, NoTries>,
    /// Steps that could be left out with the same crash; an external driving system must be there to try.
    pub spare_steps: &'a dyn Fn(usize) -> Result<Vec<usize>, NoTries>,
}

/// Checks every claim of a scenario, and that each of its steps was legal. `judgements` has one for
/// each collision of the log.
pub fn verify(
    space: &Space,
    scenario: &Scenario,
    log: &EpisodeLog,
    judgements: &[Judgement],
    replays: &Replays,
) -> Vec<ClaimResult> {
    let steps = log.refused().map(|(number, reason)| judged(format!("step {number} is legal"), Err(reason)));
    let played = Played { space, log, judgements, replays };
    steps.chain(scenario.claims.iter().map(|claim| played.check(claim))).collect()
}

/// The replay against which claims are checked.
#[derive(Clone, Copy)]
struct Played<'a> {
    space: &'a Space,
    log: &'a EpisodeLog,
    judgements: &'a [Judgement],
    replays: &'a Replays<'a>,
}

impl Played<'_> {
    fn check(self, claim: &Claim) -> ClaimResult {
        let Played { space, log, judgements, replays } = self;
        match claim {
            Claim::Collision { obstacle, time } => {
                let outcome = self.collision(*obstacle).and_then(|index| match time {
                    Some(claimed) if !claimed.rounds(log.collisions[index].contact.time_s) => {
                        Err(format!("at {:.2} s", log.collisions[index].contact.time_s))
                    }
                    _ => Ok(()),
                });
                judged(format!("collision{}{}", with(*obstacle), at(time.as_ref())), outcome)
            }
            Claim::Verdict { name, obstacle } => {
                let outcome = self.collision(*obstacle).and_then(|index| self.has_verdict(name, index));
                judged(format!("{name}{}", with(*obstacle)), outcome)
            }
            Claim::Breach { requirement, time } => {
                let outcome = match (log.breach_of(space, requirement), time) {
                    (None, _) => Err(NO_BREACH.to_owned()),
                    (Some(breach), Some(claimed)) if !claimed.rounds(breach.time_s) => {
                        Err(format!("at {:.2} s", breach.time_s))
                    }
                    (Some(_), _) => Ok(()),
                };
                judged(format!("{requirement}.breached{}", at(time.as_ref())), outcome)
            }
            Claim::Kept { requirement, by } => {
                let claim = format!("{requirement}.kept by [{}]", by.join(", "));
                let Some(found) = (replays.breached)() else { return untried(claim, "not tried") };
                let is_meant = |found: &&Breached| space.requirements[found.requirement].name == *requirement;
                match found.iter().find(is_meant) {
                    None => judged(claim, Err(NO_BREACH.to_owned())),
                    Some(found) if found.kept_by == *by => judged(claim, Ok(())),
                    Some(found) => judged(claim, Err(format!("kept by [{}]", found.kept_by.join(", ")))),
                }
            }
            Claim::Avoidability { class, by, obstacle } => {
                let judge = |index: usize| {
                    let found = &judgements[index];
                    let same_drivers = by.as_ref().is_none_or(|by| *by == found.avoided_by);
                    if *class == found.class && same_drivers { Ok(()) } else { Err(in_words(found)) }
                };
                let claim = format!("{}{}{}", class.name(), by_whom(by.as_deref()), with(*obstacle));
                judged(claim, self.collision(*obstacle).and_then(judge))
            }
            Claim::Cause { modules, obstacle } => {
                let judge = |index: usize| {
                    let found = (replays.cause)(index).map_err(|error| error.to_string())?;
                    let found: Vec<&str> = found.into_iter().map(Module::name).collect();
                    let same = modules.iter().map(String::as_str).eq(found.iter().copied());
                    if same { Ok(()) } else { Err(format!("[{}]", found.join(", "))) }
                };
                let claim = format!("cause [{}]{}", modules.join(", "), with(*obstacle));
                judged(claim, self.collision(*obstacle).and_then(judge))
            }
            Claim::Priority { priority, obstacle } => {
                let judge = |index: usize| match log.collisions[index].contact.ruling.priority {
                    found if found == *priority => Ok(()),
                    found => Err(format!("priority {}", found.name())),
                };
                let claim = format!("priority {}{}", priority.name(), with(*obstacle));
                judged(claim, self.collision(*obstacle).and_then(judge))
            }
            Claim::Recurrence { requirement, obstacle, from, recurred, replays: wanted } => {
                let of = requirement.as_ref().map_or_else(String::new, |name| format!("{name}."));
                let claim =
                    format!("{of}recurrence {recurred} of {wanted}{}{}", with(*obstacle), at(from.as_ref()));
                let found = self.finding(requirement.as_deref(), *obstacle);
                let from_s = from.map(|from| from.si());
                let time_s = |found: Found| match found {
                    Found::Collision(index) => log.collisions[index].contact.time_s,
                    Found::Breach(index) => log.breaches[index].time_s,
                };
                let is_before = |found: &Found| from_s.is_none_or(|from_s| from_s < time_s(*found));
                let found = found.and_then(|found| {
                    if is_before(&found) {
                        Ok(found)
                    } else {
                        Err(format!("it happened before, at {:.2} s", time_s(found)))
                    }
                });
                match found.map(|found| (replays.recurrence)(found, from_s, *wanted)) {
                    Err(none) => judged(claim, Err(none)),
                    Ok(Ok(found)) if found.replays < *wanted => {
                        untried(claim, "not tried (the driving system failed in too many replays)")
                    }
                    Ok(Ok(found)) if found.recurred == *recurred => judged(claim, Ok(())),
                    Ok(Ok(found)) => judged(claim, Err(found.to_string())),
                    Ok(Err(no_tries)) => untried(claim, no_tries),
                }
            }
            Claim::Minimal { obstacle } => {
                let claim = format!("minimal{}", with(*obstacle));
                match self.collision(*obstacle).map(|index| (replays.spare_steps)(index)) {
                    Err(none) => judged(claim, Err(none)),
                    Ok(Ok(spare)) if spare.is_empty() => judged(claim, Ok(())),
                    Ok(Ok(spare)) => {
                        let spare: Vec<String> = spare.iter().map(usize::to_string).collect();
                        let found =
                            format!("the same crash without step {}", spare.join(", or without step "));
                        judged(claim, Err(found))
                    }
                    Ok(Err(no_tries)) => untried(claim, no_tries),
                }
            }
            Claim::Proc(claimed) => {
                let found: Vec<f64> = log.steps.iter().map(|step| step.proc).collect();
                let fits = claimed.len() == found.len()
                    && claimed.iter().zip(&found).all(|(claimed, found)| claimed.rounds(*found));
                let shown: Vec<String> = found.iter().map(|proc| format!("{proc:.3}")).collect();
                let result = if fits { Ok(()) } else { Err(format!("[{}]", shown.join(", "))) };
                judged("collision probability of each step".to_owned(), result)
            }
            Claim::Trace(claimed) => {
                let found = digest_text(&log.trace());
                let result = if &found == claimed { Ok(()) } else { Err(found) };
                judged("trace of the whole state".to_owned(), result)
            }
            Claim::End(claimed) => {
                let found = log.end.name();
                let result = if found == claimed { Ok(()) } else { Err(found.to_owned()) };
                judged(format!("end {claimed}"), result)
            }
        }
    }

    /// The first collision with an obstacle, or with any obstacle.
    fn collision(self, obstacle: Option<Obstacle>) -> Result<usize, String> {
        let meant =
            |collision: &Collision| obstacle.is_none_or(|wanted| collision.contact.obstacle == wanted.number);
        let collisions = &self.log.collisions;
        let index = collisions.iter().position(meant).ok_or_else(|| "no such collision".to_owned())?;
        let body = collisions[index].body.like;
        match obstacle {
            Some(wanted) if !wanted.kind.fits(body.is_vehicle()) => {
                Err(format!("npc#{} is a {}", wanted.number, body.name()))
            }
            _ => Ok(index),
        }
    }

    /// The first breach of a requirement, or without one the first collision with an obstacle.
    fn finding(self, requirement: Option<&str>, obstacle: Option<Obstacle>) -> Result<Found, String> {
        let Some(name) = requirement else { return self.collision(obstacle).map(Found::Collision) };
        let is_meant = |breach: &Breach| self.space.requirements[breach.requirement].name == name;
        let first = self.log.breaches.iter().position(is_meant);
        first.map(Found::Breach).ok_or_else(|| NO_BREACH.to_owned())
    }

    /// Whether a collision has a verdict of the space.
    fn has_verdict(self, name: &str, index: usize) -> Result<(), String> {
        let judgement = &self.judgements[index];
        let facts = facts(self.log, index, judgement);
        match self.space.verdict(name, facts, self.log.memory_after(self.log.collisions[index].step)) {
            Some(true) => Ok(()),
            _ if name == COUNTED => {
                let unmet = unmet(self.space, self.log, index, judgement).join(", ");
                Err(format!("not met: {unmet} ({})", in_words(judgement)))
            }
            _ => Err(format!(
                "repeated: {}, sudden: {}, struck: {}, priority: {}, {}",
                facts.repeated,
                facts.sudden,
                facts.struck,
                facts.priority.name(),
                in_words(judgement)
            )),
        }
    }
}

fn with(obstacle: Option<Obstacle>) -> String {
    obstacle.map_or(String::new(), |obstacle| format!(" with {obstacle}"))
}

/// When it is claimed to be.
fn at(time: Option<&Figure>) -> String {
    time.map_or(String::new(), |time| format!(" at {time}"))
}

/// The class of a collision and the reference drivers that avoid it.
fn in_words(judgement: &Judgement) -> String {
    format!("{}{}", judgement.class.name(), by_whom(Some(&judgement.avoided_by)))
}

fn by_whom(drivers: Option<&[String]>) -> String {
    drivers.map_or(String::new(), |drivers| format!(" by [{}]", drivers.join(", ")))
}

fn untried(claim: String, why: impl Display) -> ClaimResult {
    ClaimResult { claim, confirmed: None, found: why.to_string() }
}

fn judged(claim: String, found: Result<(), String>) -> ClaimResult {
    match found {
        Ok(()) => ClaimResult { claim, confirmed: Some(true), found: "as claimed".to_owned() },
        Err(found) => ClaimResult { claim, confirmed: Some(false), found },
    }
}
