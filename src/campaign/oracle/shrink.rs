//! The smallest scenario that still makes the same crash, or the same breach.
//!
//! Fewest actions first (ddmin, Zeller and Hildebrandt 2002), then fewest steps, ambient vehicles, delays
//! and effects, then the plainest start (noon under a clear sky) and values; all passes repeat until nothing
//! changes. Every candidate is played, and every action in it must be legal by the rules of the space. The crash is the same
//! if body and verb of the obstacle, pre-crash type, harm, priority and the class of the verdict are the same. The space's
//! verdict must also still count it, or still not. A breach is the same if it is one of the same requirement, and a careful
//! driver still keeps that, or still none does.
//!
//! It must recur, too, as far as that was tried. What recurs (`Recurrence::recurs`) still does. What does not may recur less
//! often, down to the lower end of its 95 % interval. For a rounder number nothing is traded: it recurs as often as what is
//! shrunk, and is no softer than the best candidate so far. Replays come last and stop as soon as
//! they have decided, because most candidates fail the cheap checks. The result is 1-minimal: if any one step is removed, or
//! replaced by waiting, the crash is gone, is another one, or recurs too rarely.

use crate::episode;
use crate::episode::{Choice, Collision, EpisodeLog, Moment, Outcome, Script, ScriptedAction, Setup};
use avastra_lang::model::vocabulary::{Verb, Word};
use avastra_lang::model::{Avoidability, BodyWord, Domain, Memory, Value};
use avastra_world::action::ActionTable;
use avastra_world::sim::Start;

use super::avoidable::{Judgement, judge};
use super::case::Found;
use super::counted::counts;
use super::kept::breached;
use super::recurrence::{Recurrence, Replayed};
use super::severity::severity;

/// Most rounds of all passes. Each round makes something smaller or plainer; most crashes need two.
const ROUNDS_MAX: usize = 8;

/// A smaller scenario with the same crash.
#[derive(Debug, Clone, PartialEq)]
pub struct Shrunk {
    pub script: Script,
    pub start: Start,
    /// States of the space at the start.
    pub memory: Memory,
    pub log: EpisodeLog,
    /// One for each collision of the log.
    pub judgements: Vec<Judgement>,
    /// The finding that was kept, in the log.
    pub found: Found,
    /// How often what was shrunk recurs, if that was asked.
    pub recurrence_before: Option<Recurrence>,
    /// Episodes that were played to find it.
    pub plays: u32,
}

/// The figures that make a finding worth keeping.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Worth {
    /// When it happens, s since the episode began.
    pub time_s: f64,
    /// Speed at which the gap closed, m/s; `None` of a breach.
    pub impact_mps: Option<f64>,
    /// `None` of a breach.
    pub harm: Option<&'static str>,
    pub kind: Option<&'static str>,
    pub priority: Option<&'static str>,
    /// The margin of a breach, below 0, if it has one.
    pub margin: Option<f64>,
    pub recurrence: Option<Recurrence>,
}

impl Worth {
    /// That of a finding of a log.
    pub fn new(log: &EpisodeLog, found: Found, recurrence: Option<Recurrence>) -> Worth {
        match found {
            Found::Collision(index) => {
                let collision = &log.collisions[index];
                let severity = severity(collision);
                Worth {
                    time_s: collision.contact.time_s,
                    impact_mps: Some(severity.closing_speed_mps),
                    harm: Some(severity.harm.name()),
                    kind: Some(collision.kind.name()),
                    priority: Some(collision.contact.ruling.priority.name()),
                    margin: None,
                    recurrence,
                }
            }
            Found::Breach(index) => {
                let breach = &log.breaches[index];
                let (time_s, margin) = (breach.time_s, breach.margin);
                Worth { time_s, impact_mps: None, harm: None, kind: None, priority: None, margin, recurrence }
            }
        }
    }

    /// Whether it is the same but for how hard and how often.
    fn is_alike(&self, other: &Worth) -> bool {
        (self.harm, self.kind, self.priority) == (other.harm, other.kind, other.priority)
    }

    /// Whether another is at least as hard.
    fn is_no_harder_than(&self, other: &Worth) -> bool {
        let at_most =
            |one: Option<f64>, other: Option<f64>| one.zip(other).is_none_or(|(one, other)| one <= other);
        at_most(self.impact_mps, other.impact_mps) && at_most(other.margin, self.margin)
    }
}

/// Shrinks what led to a finding in a log that was played from `setup`; `judgements` has one for each collision. Recurrence is
/// tried in at most `replays` replays, 0 if it may fall.
pub fn shrink(
    setup: &Setup,
    log: &EpisodeLog,
    found: Found,
    judgements: &[Judgement],
    replays: u32,
) -> Shrunk {
    let mut search = Search::new(setup, (log, found), judgements, replays);
    let mut best = Candidate::of(setup, log, found);
    for _ in 0..ROUNDS_MAX {
        let before = best.clone();
        search.fewest_actions(&mut best);
        search.fewest_steps(&mut best);
        search.fewest_ambient(&mut best);
        search.fewest_delays(&mut best);
        search.fewest_effects(&mut best);
        search.plainest_start(&mut best);
        search.plainest_values(&mut best);
        if best == before {
            break;
        }
    }
    let (kept, _) = search.keeps(&best, None).expect("every candidate that was taken makes the crash");
    let recurrence_before = (replays > 0).then(|| search.recurrence());
    Shrunk {
        recurrence_before,
        script: best.script,
        start: best.start,
        memory: best.memory,
        log: kept.log,
        judgements: kept.judgements,
        found: kept.found,
        plays: search.plays,
    }
}

/// Steps that are not needed for the nth collision of a log. Each alone could be removed, or replaced by waiting: the
/// collision stays the same, and recurs as it must, tried in at most `replays` replays. Empty if the scenario is
/// 1-minimal.
pub fn spare_steps(
    setup: &Setup,
    log: &EpisodeLog,
    index: usize,
    judgements: &[Judgement],
    replays: u32,
) -> Vec<usize> {
    let found = Found::Collision(index);
    let mut search = Search::new(setup, (log, found), judgements, replays);
    let whole = Candidate::of(setup, log, found);
    let steps = whole.script.steps.len();
    let is_spare = |&step: &usize| {
        let mut waiting = whole.clone();
        let acts = waiting.script.steps[step].take().is_some();
        let mut shorter = whole.clone();
        shorter.script.steps.remove(step);
        (acts && search.holds(&waiting, Purpose::Size).is_some())
            || (steps > 1 && search.holds(&shorter, Purpose::Size).is_some())
    };
    (0..steps).filter(is_spare).collect()
}

/// A scenario that is made smaller.
#[derive(Debug, Clone, PartialEq)]
struct Candidate {
    script: Script,
    start: Start,
    memory: Memory,
}

impl Candidate {
    /// The scenario that led to a finding in a log.
    fn of(setup: &Setup, log: &EpisodeLog, found: Found) -> Candidate {
        let mut script = Script::of_log(log);
        script.steps.truncate(found.step(log) + 1);
        Candidate { script, start: setup.start, memory: setup.memory.clone() }
    }
}

/// A candidate that makes the crash or the breach.
struct Kept {
    log: EpisodeLog,
    judgements: Vec<Judgement>,
    found: Found,
}

/// The properties that must stay.
enum Wanted {
    Crash {
        body: BodyWord,
        verb: Verb,
        class: Avoidability,
        counts: bool,
    },
    Breach {
        requirement: usize,
        /// Whether a careful driver keeps it.
        is_kept: bool,
    },
}

/// The purpose of a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// Fewer or simpler parts.
    Size,
    /// The same parts with plainer values.
    Roundness,
}

/// One shrinking: what must stay, and the number of plays so far, replays included.
struct Search<'a> {
    setup: &'a Setup,
    wanted: Wanted,
    /// The log and the finding that are shrunk, and how hard the finding is.
    log: &'a EpisodeLog,
    found: Found,
    worth: Worth,
    /// How hard the best candidate so far is.
    best_worth: Worth,
    replays: u32,
    /// How often what is shrunk recurs, once that was asked.
    recurrence: Option<Recurrence>,
    plays: u32,
}

/// A step, and an action to try there: its values are wishes, which the rules may change.
type Wish<'w> = Option<(usize, &'w ScriptedAction)>;

impl<'a> Search<'a> {
    fn new(
        setup: &'a Setup,
        (log, found): (&'a EpisodeLog, Found),
        judgements: &[Judgement],
        replays: u32,
    ) -> Search<'a> {
        let wanted = match found {
            Found::Collision(index) => Wanted::Crash {
                body: log.collisions[index].body,
                verb: log.collisions[index].verb,
                class: judgements[index].class,
                counts: counts(setup.table.space(), log, index, &judgements[index]),
            },
            Found::Breach(index) => {
                let requirement = log.breaches[index].requirement;
                Wanted::Breach { requirement, is_kept: is_kept(setup, log, requirement) }
            }
        };
        let worth = Worth::new(log, found, None);
        let best_worth = worth.clone();
        Search { setup, wanted, log, found, worth, best_worth, replays, recurrence: None, plays: 0 }
    }

    /// How often what is shrunk recurs.
    fn recurrence(&mut self) -> Recurrence {
        if let Some(known) = self.recurrence {
            return known;
        }
        let Search { setup, log, found, replays, .. } = *self;
        // With all steps of the file, as its claim was made: another finding may come later.
        let again = Replayed::new(setup, &Script::of_log(log), log);
        let recurrence = again.tested(found, replays);
        self.plays += again.plays();
        self.recurrence = Some(recurrence);
        recurrence
    }

    /// As [`Search::keeps`], if it is worth as much. Returns its script, and how hard it is.
    fn holds(&mut self, candidate: &Candidate, purpose: Purpose) -> Option<(Script, Worth)> {
        let (kept, script) = self.keeps(candidate, None)?;
        let worth = self.worth_of(candidate, &script, &kept, purpose)?;
        Some((script, worth))
    }

    /// How hard a candidate is, if it recurs as it must, and for a rounder number is no softer.
    fn worth_of(
        &mut self,
        candidate: &Candidate,
        script: &Script,
        kept: &Kept,
        purpose: Purpose,
    ) -> Option<Worth> {
        let worth = Worth::new(&kept.log, kept.found, None);
        let is_softer = purpose == Purpose::Roundness && !self.best_worth.is_no_harder_than(&worth);
        (!is_softer && self.recurs(candidate, script, kept, purpose)).then_some(worth)
    }

    /// Whether a candidate recurs as often as it must.
    fn recurs(&mut self, candidate: &Candidate, script: &Script, kept: &Kept, purpose: Purpose) -> bool {
        if self.replays == 0 {
            return true;
        }
        let recurrence = self.recurrence();
        let setup = self.begin(candidate);
        let again = Replayed::new(&setup, script, &kept.log);
        let Recurrence { recurred, replays } = recurrence;
        let holds = match purpose {
            Purpose::Size if recurrence.recurs() => again.tested(kept.found, self.replays).recurs(),
            Purpose::Size => {
                let lowest = (recurrence.interval()[0] * f64::from(replays)).ceil() as u32;
                again.is_again_in(kept.found, lowest, replays)
            }
            Purpose::Roundness => again.is_again_in(kept.found, recurred, replays),
        };
        self.plays += again.plays();
        holds
    }

    /// Plays a candidate; `None` if the crash is another or none, or an action is not legal. With a wish,
    /// the action of one step is carried out with the legal values nearest to it. The second of the
    /// results is the script as it was carried out, up to the crash.
    fn keeps(&mut self, candidate: &Candidate, wish: Wish) -> Option<(Kept, Script)> {
        self.plays += 1;
        let log = self.play(candidate, wish);
        let is_refused = |step: &episode::StepLog| matches!(step.outcome, Outcome::Refused { .. });
        if log.steps.iter().any(is_refused) {
            return None;
        }
        let mut script = Script::of_log(&log);
        let setup = self.begin(candidate);
        let judged = || judge(&setup, &script, &log);
        let (found, judgements) = match self.wanted {
            Wanted::Crash { body, verb, class, counts: is_counted } => {
                let alike = |index: &usize| {
                    let Collision { body: hit, verb: done, .. } = log.collisions[*index];
                    let worth = Worth::new(&log, Found::Collision(*index), None);
                    hit == body && done == verb && worth.is_alike(&self.worth)
                };
                if !(0..log.collisions.len()).any(|index| alike(&index)) {
                    return None;
                }
                let judgements = judged();
                let same = |index: &usize| {
                    let counts = counts(self.setup.table.space(), &log, *index, &judgements[*index]);
                    alike(index) && judgements[*index].class == class && counts == is_counted
                };
                (Found::Collision((0..log.collisions.len()).find(same)?), judgements)
            }
            Wanted::Breach { requirement, is_kept: was_kept } => {
                let index = log.first_breach(requirement)?;
                if is_kept(&setup, &log, requirement) != was_kept {
                    return None;
                }
                (Found::Breach(index), judged())
            }
        };
        script.steps.truncate(found.step(&log) + 1);
        Some((Kept { log, judgements, found }, script))
    }

    fn play(&self, candidate: &Candidate, wish: Wish) -> EpisodeLog {
        let setup = self.begin(candidate);
        let choose = &mut |moment: &Moment<'_>| match wish {
            Some((step, ScriptedAction { row, values, .. })) if step == moment.step => {
                Choice::judged(*row, setup.table.nearest(moment.situation, *row, values))
            }
            _ => candidate.script.choose(moment),
        };
        episode::run(&setup, choose)
    }

    fn begin(&self, candidate: &Candidate) -> Setup {
        Setup { start: candidate.start, memory: candidate.memory.clone(), ..self.setup.clone() }
    }

    /// Takes a candidate if it keeps the crash and what that is worth.
    fn take(&mut self, best: &mut Candidate, candidate: Candidate, purpose: Purpose) -> bool {
        let Some((script, worth)) = self.holds(&candidate, purpose) else { return false };
        *best = Candidate { script, ..candidate };
        self.best_worth = worth;
        true
    }

    /// Replaces actions by waiting: ddmin over the steps that do something.
    fn fewest_actions(&mut self, best: &mut Candidate) {
        let mut parts = 2;
        loop {
            let acting: Vec<usize> =
                (0..best.script.steps.len()).filter(|&step| best.script.steps[step].is_some()).collect();
            if acting.is_empty() {
                return;
            }
            let size = acting.len().div_ceil(parts.min(acting.len()));
            let without = |chunk: &[usize]| {
                let mut candidate = best.clone();
                chunk.iter().for_each(|&step| candidate.script.steps[step] = None);
                candidate
            };
            let candidates: Vec<Candidate> = acting.chunks(size).map(without).collect();
            let found = candidates.into_iter().any(|candidate| self.take(best, candidate, Purpose::Size));
            if found {
                parts = 2.max(parts - 1);
            } else if size == 1 {
                return;
            } else {
                parts = (2 * parts).min(acting.len());
            }
        }
    }

    /// Leaves steps out, so that all later ones come earlier.
    fn fewest_steps(&mut self, best: &mut Candidate) {
        let mut step = 0;
        while step < best.script.steps.len() {
            let mut candidate = best.clone();
            candidate.script.steps.remove(step);
            if candidate.script.steps.is_empty() || !self.take(best, candidate, Purpose::Size) {
                step += 1;
            }
        }
    }

    /// Ambient vehicles: none, or as few as halving finds.
    fn fewest_ambient(&mut self, best: &mut Candidate) {
        let mut fewer = 0;
        while fewer < best.start.ambient {
            let mut candidate = best.clone();
            candidate.start.ambient = fewer;
            if self.take(best, candidate, Purpose::Size) {
                return;
            }
            fewer += (best.start.ambient - fewer).div_ceil(2);
        }
    }

    /// Actions at the beginning of their step.
    fn fewest_delays(&mut self, best: &mut Candidate) {
        for step in 0..best.script.steps.len() {
            let mut candidate = best.clone();
            let Some(action) = candidate.script.steps.get_mut(step).and_then(Option::as_mut) else {
                continue;
            };
            if action.trigger.take().is_some() {
                self.take(best, candidate, Purpose::Size);
            }
        }
    }

    /// Rows that do less, with the same values for parameters of the same name.
    fn fewest_effects(&mut self, best: &mut Candidate) {
        let log = self.play(best, None);
        self.plays += 1;
        for (step, logged) in log.steps.iter().enumerate().take(best.script.steps.len()) {
            let Outcome::Done { draw, .. } = &logged.outcome else { continue };
            for row in 0..self.setup.table.rows().len() {
                if effects(&self.setup.table, row)
                    >= draw.effects.len().min(effects(&self.setup.table, draw.row))
                {
                    continue;
                }
                let mut candidate = best.clone();
                candidate.script.steps[step] =
                    Some(ScriptedAction { row, values: draw.values.clone(), trigger: None });
                if self.take(best, candidate, Purpose::Size) {
                    break;
                }
            }
        }
    }

    /// Noon under a clear sky, or as much of it as keeps the crash.
    fn plainest_start(&mut self, best: &mut Candidate) {
        let space = self.setup.table.space();
        let plain: Vec<(usize, Value)> = space.plain_weather();
        let all: Vec<&[(usize, Value)]> = core::iter::once(&plain[..]).chain(plain.chunks(1)).collect();
        for cells in all {
            let mut candidate = best.clone();
            for &(cell, value) in cells {
                candidate.memory = candidate.memory.with(cell, value);
            }
            if candidate.memory == best.memory {
                continue;
            }
            let Start { ego_mps, signal_phase_s, seed, ambient, traffic, .. } = best.start;
            let start = Start::drawn(space, self.setup.road(), &candidate.memory, self.setup.seed);
            candidate.start = Start { ego_mps, signal_phase_s, seed, ambient, traffic, ..start };
            self.take(best, candidate, Purpose::Roundness);
        }
    }

    /// Round numbers, or the bounds of what rules allow; the first of a list's words.
    fn plainest_values(&mut self, best: &mut Candidate) {
        let phase_s = best.start.signal_phase_s;
        for unit_s in [10.0, 1.0] {
            let mut candidate = best.clone();
            candidate.start.signal_phase_s = (phase_s / unit_s).floor() * unit_s;
            if candidate.start != best.start && self.take(best, candidate, Purpose::Roundness) {
                break;
            }
        }
        for step in 0..best.script.steps.len() {
            let values = best.script.steps.get(step).cloned().flatten().map(|action| action.values.len());
            for value in 0..values.unwrap_or(0) {
                self.plainest_value(best, step, value);
            }
        }
    }

    fn plainest_value(&mut self, best: &mut Candidate, step: usize, index: usize) {
        let Some(Some(action)) = best.script.steps.get(step).cloned() else { return };
        let (name, value) = action.values[index].clone();
        let parameters =
            &self.setup.table.space().actions[self.setup.table.rows()[action.row].action].parameters;
        let parameter = parameters.iter().find(|parameter| parameter.name == name);
        let domain = &parameter.expect("a legal action has values for its own parameters").domain;
        let with = |value: Value| {
            let mut wish = action.clone();
            wish.values[index].1 = value;
            wish
        };
        let candidates: Vec<Value> = match domain {
            Domain::Values(values) => values.iter().copied().take_while(|other| *other != value).collect(),
            Domain::Range(..) => {
                let ends = <[f64; 2]>::from(domain.ends());
                let number = value.number();
                let reached = ends.map(|end| self.reached(best, step, &with(Value::Number(end)), index));
                if reached.contains(&Some(number)) {
                    // A bound of a rule is plain; only rounder numbers are plainer.
                    round(number).into_iter().take(2).map(Value::Number).collect()
                } else {
                    let bounds = reached.into_iter().flatten();
                    round(number).into_iter().chain(bounds).map(Value::Number).collect()
                }
            }
        };
        for wanted in candidates {
            let wish = with(wanted);
            let Some((kept, script)) = self.keeps(best, Some((step, &wish))) else { continue };
            // A value that the rules have changed is no plainer than the old one.
            let got = script.steps.get(step).and_then(Option::as_ref);
            if got.is_some_and(|got| got.values[index].1 == wanted)
                && let Some(worth) = self.worth_of(best, &script, &kept, Purpose::Roundness)
            {
                best.script = script;
                self.best_worth = worth;
                return;
            }
        }
    }

    /// The value that the rules allow for a wish for one value.
    fn reached(&mut self, best: &Candidate, step: usize, wish: &ScriptedAction, index: usize) -> Option<f64> {
        self.plays += 1;
        let log = self.play(best, Some((step, wish)));
        match &log.steps.get(step)?.outcome {
            Outcome::Done { draw, .. } => Some(draw.values[index].1.number()),
            Outcome::Passed | Outcome::Refused { .. } => None,
        }
    }
}

/// Whether a careful driver keeps a requirement that is breached in a log.
fn is_kept(setup: &Setup, log: &EpisodeLog, requirement: usize) -> bool {
    let found = breached(setup, &Script::of_log(log), log);
    found.iter().any(|found| found.requirement == requirement && !found.kept_by.is_empty())
}

/// Number of effects that a row has in its space.
fn effects(table: &ActionTable, row: usize) -> usize {
    table.space().actions[table.rows()[row].action].effects.len()
}

/// Rounder numbers near a number, the roundest first: multiples of 10, 5, 1 and a half. Empty if the number
/// is as round already.
fn round(number: f64) -> Vec<f64> {
    let mut found = Vec::new();
    for unit in [10.0, 5.0, 1.0, 0.5] {
        let nearest = (number / unit).round() * unit;
        if nearest == number {
            break;
        }
        if !found.contains(&nearest) {
            found.push(nearest);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounder_numbers_come_first() {
        assert_eq!(round(11.28125), [10.0, 11.0, 11.5]);
        assert_eq!(round(12.5), [10.0, 15.0, 13.0]);
        assert_eq!(round(15.0), [20.0]);
        assert!(round(20.0).is_empty());
        assert_eq!(round(0.75), [0.0, 1.0]);
    }
}
