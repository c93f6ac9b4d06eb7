//! Rules on states and time where time alone passes: `elapsed >= 30 s implies sky[Rain] == None`.
//!
//! A rule that holds from the first moment on is asked of every action. A step may also pass without an action. Then
//! nothing can be refused, so the proof has to show that the rule holds there too. It follows the states of an episode from
//! step to step, each with all results of an action or a wait. They are sets of values ([`Values`]), so too many may be
//! followed, never too few. So a rule may be refused that would hold, but no broken rule passes.

use core::ops::RangeInclusive;
use std::collections::BTreeSet;

use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{Demand, cells_read};
use crate::model::{
    Initial, Interval, Reach, Road, Row, RuleBody, RuleDef, RulesInForce, STATE_MAX, SetDef, Space, Type,
    code, effort,
};
use crate::prove::enclose::{Known, Values, bits, enclose};
use crate::prove::lists::{distinct, product};
use crate::prove::moment::Case;
use crate::prove::reach::declared;
use crate::syntax::{Diagnostic, listed};
use avastra_base::units::Rational;

/// The most states that are followed on one road.
const STATES_MAX: usize = 2_000;
/// The most conditions that are evaluated on one road.
const WORK_MAX: usize = 400_000;
/// The most values of one set of states that are told apart; beyond it they stay together.
const PARTS_MAX: usize = 256;

/// A rule that time breaks on a road, or that was not shown to last.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("on `{road}` {}", self.words())]
pub struct BrokenByTime {
    pub road: String,
    pub rule: String,
    /// The index of the rule.
    index: usize,
    how: How,
}

#[derive(Debug, Clone, PartialEq)]
enum How {
    /// The step that breaks it, its time, s, and the states before it in words.
    At(u64, f64, String),
    /// There are too many states to be followed.
    TooMany,
    /// The states that were met until this step made too much work.
    TooLong(u64),
}

impl BrokenByTime {
    fn words(&self) -> String {
        match &self.how {
            How::At(step, time_s, states) => {
                format!(
                    "time breaks rule `{}` in a step without an action: at step {step} ({time_s} s), where {states}",
                    self.rule
                )
            }
            How::TooMany | How::TooLong(_) => {
                format!("whether rule `{}` lasts as time passes is not known", self.rule)
            }
        }
    }
}

/// One error for each rule that time breaks on some road. One warning for each optional rule with which time breaks a rule,
/// if it is in force beside the default rules.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut found: Vec<BrokenByTime> = Vec::new();
    let mut with_optional: Vec<(usize, BrokenByTime)> = Vec::new();
    for road in &space.roads {
        let mut in_force = RulesInForce::by_default(space);
        while let Err(broken) = lasts(space, road, &in_force) {
            if effort::is_spent() {
                break;
            }
            in_force = in_force.except(broken.index);
            if !found.iter().any(|known| known.index == broken.index) {
                found.push(broken);
            }
        }
        let optional = (0..space.rules.len()).filter(|rule| space.rules[*rule].optional);
        for rule in optional.take_while(|_| !effort::is_spent()) {
            let is_open =
                space.rules[rule].binds_start() && !with_optional.iter().any(|(known, _)| *known == rule);
            let broken = if is_open { lasts(space, road, &in_force.with(rule)).err() } else { None };
            with_optional.extend(broken.map(|broken| (rule, broken)));
        }
    }
    let of_optional = with_optional.iter().map(|(rule, broken)| warning(space, &space.rules[*rule], broken));
    found.iter().map(|broken| error(space, broken)).chain(of_optional).collect()
}

fn warning(space: &Space, optional: &RuleDef, broken: &BrokenByTime) -> Diagnostic {
    let error = error(space, broken);
    let message = format!("with optional rule `{}`: {}", optional.name, error.message);
    let mut warning = Diagnostic::warning(code::BROKEN_BY_TIME, message);
    if space.rules[broken.index].name != optional.name {
        warning = warning.at(optional.span, "a run that asks for it is refused");
    }
    warning.labels.extend(error.labels);
    Diagnostic { help: error.help, ..warning }
}

fn error(space: &Space, broken: &BrokenByTime) -> Diagnostic {
    let rule = &space.rules[broken.index];
    let (message, label) = match &broken.how {
        How::At(step, time_s, states) => (
            format!("time alone breaks rule `{}`", rule.name),
            format!("does not hold at step {step} ({time_s} s) where {states}, if that step has no action"),
        ),
        How::TooMany => (broken.words(), "too many states to follow from step to step".to_owned()),
        How::TooLong(step) => (broken.words(), format!("the states were followed to step {step} alone")),
    };
    let read = rule.start.iter().flat_map(|start| cells_read(start, &space.states));
    let cells = distinct(read.map(|cell| space.cell_name(cell)));
    let help = match &broken.how {
        How::At(..) => format!(
            "let `each step {{ … }}` set {} in time, counting the steps in a state of its own; or bind the rule to \
             actions by `on`, if it is about them alone",
            listed(&cells)
        ),
        How::TooMany | How::TooLong(_) => format!(
            "let {} and what sets {} have fewer values, with counters that stop; or bind the rule to actions by `on`, \
             if it is about them alone",
            listed(&cells),
            if cells.len() == 1 { "it" } else { "them" }
        ),
    };
    let error = Diagnostic::error(code::BROKEN_BY_TIME, message).at(rule.span, label).help(help);
    match space.each_step_asks_the_world() {
        true => error.note("what `each step` sets by facts of the moment may have any value in a proof"),
        false => error,
    }
}

/// Whether the rules in force on states and time hold at every step of every episode on the road.
///
/// # Errors
/// The first rule that a step without an action may break.
pub fn lasts(space: &Space, road: &Road, in_force: &RulesInForce) -> Result<(), BrokenByTime> {
    // Rules that hold from the first moment on and ask for the time.
    let is_timed = |rule: &usize| space.rules[*rule].start.as_ref().is_some_and(Expr::asks_the_world);
    let timed: Vec<usize> = in_force.all().filter(is_timed).collect();
    let Some(&first) = timed.first() else { return Ok(()) };
    let followed = followed(space, in_force, &timed);
    let (met, moves) = (Vec::new(), Vec::new());
    let mut states = States { space, road, in_force, timed, followed, met, moves, work: 0 };
    let mut now = states.begin();
    let last = u64::from(space.episode.step_limit).saturating_sub(1);
    for step in 0..=last {
        let mut next = BTreeSet::new();
        for state in &now {
            if let Err(rule) = states.go_on(*state, step..=step, &mut next) {
                return Err(states.broken(rule, step, *state));
            }
        }
        if states.is_too_large() {
            let how = if states.met.len() > STATES_MAX { How::TooMany } else { How::TooLong(step) };
            let (road, rule) = (road.name.clone(), space.rules[first].name.clone());
            return Err(BrokenByTime { road, rule, index: first, how });
        }
        if next == now && states.stay_within(&now, step..=last) {
            break;
        }
        now = next;
    }
    Ok(())
}

/// All values of every cell; of those that no timed rule depends on, every value that there is.
type Cells = Vec<Values>;

/// The result of one row in a state.
struct Move {
    row: usize,
    locals: Vec<Values>,
    to: usize,
}

/// The states that were met, and what can become of each.
struct States<'a> {
    space: &'a Space,
    road: &'a Road,
    in_force: &'a RulesInForce,
    /// The rules that time may break.
    timed: Vec<usize>,
    /// The cells on which these depend.
    followed: Vec<usize>,
    met: Vec<Cells>,
    /// By state: what rows make of it, and what every step makes of it.
    moves: Vec<Option<(Vec<Move>, Vec<usize>)>>,
    work: usize,
}

impl States<'_> {
    fn is_too_large(&self) -> bool {
        self.met.len() > STATES_MAX || self.work > WORK_MAX || effort::is_spent()
    }

    /// The states with which an episode may begin.
    fn begin(&mut self) -> BTreeSet<usize> {
        let fixed = self.space.initial_memory(0);
        let mut cells = self.space.cells_unknown();
        for cell in &self.followed {
            let state = self.space.state_of(*cell);
            if let Initial::Value(_) = state.initial[*cell - state.first_cell] {
                cells[*cell] = Values::point(fixed.cells()[*cell]);
            }
        }
        let at_first = Case::of_steps(&self.space.episode, 0..=0, false);
        let mut begun = BTreeSet::new();
        for start in self.parts(&cells) {
            if self.stands(&start, &at_first).0 {
                begun.insert(self.number(start));
            }
        }
        begun
    }

    /// Whether all these steps lead from these states to these alone, and break no timed rule there: then no episode is
    /// too long to be followed.
    fn stay_within(&mut self, now: &BTreeSet<usize>, steps: RangeInclusive<u64>) -> bool {
        let mut next = BTreeSet::new();
        let keeps = |state: &usize| self.go_on(*state, steps.clone(), &mut next).is_ok();
        now.iter().all(keeps) && next.is_subset(now) && !self.is_too_large()
    }

    /// Adds the states that come after one, in any of these steps; the first timed rule that may be broken there.
    fn go_on(
        &mut self,
        state: usize,
        steps: RangeInclusive<u64>,
        next: &mut BTreeSet<usize>,
    ) -> Result<(), usize> {
        if self.is_too_large() {
            return Ok(());
        }
        let (moves, waits) = match self.moves[state].take() {
            Some(known) => known,
            None => (self.moves_of(state), self.waits_of(state)),
        };
        let at_begin = Case::of_steps(&self.space.episode, steps.clone(), false);
        // Where every step does something, actions happen when their step begins (AV0609).
        let of_action = Case::of_steps(&self.space.episode, steps, self.space.each_step.is_empty());
        let mut broken = None;
        for wait in &waits {
            let (may_hold, may_fail) = match self.space.each_step.is_empty() {
                // Nothing happens, so nothing is kept from happening.
                true => (false, true),
                false => self.stands_after(&self.met[state], &self.met[*wait], &at_begin),
            };
            if may_hold {
                next.insert(*wait);
            }
            if may_fail {
                let fails = |rule: &&usize| self.condition(**rule, &self.met[state], &at_begin).may_fail();
                broken = broken.or(self.timed.iter().find(fails).copied());
                next.insert(state);
            }
        }
        for Move { row, locals, to } in &moves {
            if self.may_obey(*row, locals, state, *to, &of_action) {
                next.insert(*to);
            }
        }
        effort::spend((moves.len() + waits.len()) * (1 + next.len()));
        self.work += (moves.len() + waits.len()) * self.space.rules.len().max(1);
        self.moves[state] = Some((moves, waits));
        broken.map_or(Ok(()), Err)
    }

    /// Whether all rules that stand for all states may hold at a moment, and whether one may fail.
    fn stands(&self, cells: &[Values], case: &Case) -> (bool, bool) {
        let found = self.in_force.all().map(|rule| self.condition(rule, cells, case));
        found.fold((true, false), |(hold, fail), found| (hold && found.may_hold(), fail || found.may_fail()))
    }

    /// As [`States::stands`], with the moves that every step would make.
    fn stands_after(&self, from: &[Values], to: &[Values], case: &Case) -> (bool, bool) {
        let mut found = self.stands(to, case);
        // The effects of every step do not happen either where a number would leave the limits of a state.
        let most = STATE_MAX as i64;
        let kept = Interval::closed(Rational::integer(-most), Rational::integer(most));
        for cell in &self.followed {
            if let Values::Number(number) = to[*cell] {
                found =
                    (found.0 && !number.intersect(&kept).is_empty(), found.1 || number.hull(&kept) != kept);
            }
        }
        for rule in self.in_force.all() {
            let RuleBody::Moves { cell, allowed, .. } = &self.space.rules[rule].body else { continue };
            if self.space.may_set_each_step(*cell) {
                let (may, may_not) = may_move(allowed, from[*cell], to[*cell]);
                found = (found.0 && may, found.1 || may_not);
            }
        }
        found
    }

    /// The value of a rule in a state, if the rule stands for all states; any other rule holds.
    fn condition(&self, rule: usize, cells: &[Values], case: &Case) -> Values {
        let condition = self.space.rules[rule].start.as_ref();
        condition.map_or(Values::truth(true), |condition| enclose(condition, &self.known(&[], cells, case)))
    }

    fn known<'k>(&'k self, locals: &'k [Values], cells: &'k [Values], case: &'k Case) -> Known<'k> {
        let functions = &self.space.functions;
        Known { functions, locals, cells, road: Some(&self.road.facts), case: Some(case) }
    }

    /// Whether the rules on a row may allow what it makes of a state.
    fn may_obey(&self, row: usize, locals: &[Values], from: usize, to: usize, case: &Case) -> bool {
        let row = &self.space.rows[row];
        let (from, to) = (&self.met[from], &self.met[to]);
        self.in_force.on_row(row).all(|rule| match self.space.rules[rule].body.demand(row.action) {
            Some(Demand::Holds(condition)) => enclose(condition, &self.known(locals, to, case)).may_hold(),
            Some(Demand::Moves { cell, allowed, .. }) => may_move(allowed, from[cell], to[cell]).0,
            None => true,
        })
    }

    /// The moves from a state by the rows that set a followed cell; the other rows lead where a wait does.
    fn moves_of(&mut self, state: usize) -> Vec<Move> {
        let mut moves = Vec::new();
        // Other rules than those by default may enable rows that are dead by default.
        let is_by_default = *self.in_force == RulesInForce::by_default(self.space);
        for row in &self.space.rows {
            effort::spend(self.space.roads.len());
            if effort::is_spent() {
                break;
            }
            let is_open = row
                .roads
                .iter()
                .zip(&self.space.roads)
                .any(|(reach, road)| road.name == self.road.name && matches!(reach, Reach::Open(_)));
            if !is_open && is_by_default {
                continue;
            }
            let set = self.space.cells_set(row.action, &declared(self.space, row));
            if !self.followed.iter().any(|cell| set.contains(cell)) {
                continue;
            }
            for locals in self.choices(row) {
                let after = self.space.cells_after(row.action, &locals, &self.met[state]);
                for part in self.parts(&self.of_followed(&after)) {
                    let (row, to, locals) = (row.index, self.number(part), locals.clone());
                    moves.push(Move { row, locals, to });
                }
            }
        }
        moves
    }

    /// The values of a row's parameters, one by one where its effects name them.
    fn choices(&self, row: &Row) -> Vec<Vec<Values>> {
        let mut chosen = vec![declared(self.space, row)];
        let sets: Vec<&SetDef> = self.space.sets(Some(row.action)).collect();
        for local in 0..chosen[0].len() {
            let is_local = |kind: &ExprKind| *kind == ExprKind::Local(local);
            let names = |set: &&SetDef| set.key.iter().chain([&set.value]).any(|part| part.any(is_local));
            if !sets.iter().any(names) {
                continue;
            }
            let parts = chosen[0][local].each();
            if chosen.len() * parts.len() > PARTS_MAX {
                continue;
            }
            chosen = product(&chosen, &parts, |locals, part| locals[local] = part);
        }
        chosen
    }

    fn waits_of(&mut self, state: usize) -> Vec<usize> {
        let after = self.space.cells_after_wait(&self.met[state]);
        self.parts(&self.of_followed(&after)).into_iter().map(|part| self.number(part)).collect()
    }

    /// The cells that are not followed forgotten.
    fn of_followed(&self, cells: &[Values]) -> Cells {
        let mut kept = self.space.cells_unknown();
        self.followed.iter().for_each(|cell| kept[*cell] = cells[*cell]);
        kept
    }

    /// A set of states as states of single values, as far as these can be listed.
    fn parts(&self, cells: &Cells) -> Vec<Cells> {
        let mut parts = vec![cells.clone()];
        for cell in &self.followed {
            let values = cells[*cell].each();
            // A single value splits nothing.
            if values.len() == 1 || parts.len() * values.len() > PARTS_MAX {
                continue;
            }
            effort::spend(parts.len() * values.len() * cells.len());
            parts = product(&parts, &values, |part, value| part[*cell] = value);
        }
        parts
    }

    fn number(&mut self, cells: Cells) -> usize {
        effort::spend(self.met.len() + cells.len());
        if let Some(known) = self.met.iter().position(|known| *known == cells) {
            return known;
        }
        self.met.push(cells);
        self.moves.push(None);
        self.met.len() - 1
    }

    fn broken(&self, index: usize, step: u64, state: usize) -> BrokenByTime {
        let rule = &self.space.rules[index];
        let states = &self.space.states;
        let read: BTreeSet<usize> = rule.start.iter().flat_map(|start| cells_read(start, states)).collect();
        let words = |cell: &usize| {
            let (name, values) = (self.space.cell_name(*cell), self.met[state][*cell]);
            format!("`{name}` is {}", self.shown(values, self.space.state_of(*cell).ty))
        };
        let states: Vec<String> = read.iter().map(words).collect();
        BrokenByTime {
            road: self.road.name.clone(),
            rule: rule.name.clone(),
            index,
            how: How::At(step, self.space.episode.time_s(step), states.join(" and ")),
        }
    }

    fn shown(&self, values: Values, ty: Type) -> String {
        match (values, ty) {
            (Values::Variants(set), Type::Enum(of)) => {
                let variants = &self.space.enums[of.0].variants;
                bits(set).map(|variant| variants[variant].as_str()).collect::<Vec<_>>().join(" or ")
            }
            (Values::Truth { may_hold: true, may_fail: false }, _) => "true".to_owned(),
            (Values::Truth { may_hold: false, .. }, _) => "false".to_owned(),
            (Values::Number(interval), ty) => interval.shown(ty, interval.unit(ty)),
            (Values::Truth { .. } | Values::Variants(_), _) => "unknown".to_owned(),
        }
    }
}

/// Whether a move between two sets of values may be allowed, and whether it may be forbidden.
fn may_move(allowed: &[Vec<bool>], from: Values, to: Values) -> (bool, bool) {
    let (Values::Variants(from), Values::Variants(to)) = (from, to) else { return (true, true) };
    let pairs = bits(from).flat_map(|from| bits(to).map(move |to| allowed[from][to]));
    pairs.fold((false, false), |(may, may_not), allowed| (may || allowed, may_not || !allowed))
}

/// The cells on which timed rules depend. They are the cells that the rules read, the cells that decide whether the effects
/// of every step happen, and the cells from which one of these is set.
fn followed(space: &Space, in_force: &RulesInForce, timed: &[usize]) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    for rule in in_force.all() {
        match (&space.rules[rule].start, &space.rules[rule].body) {
            (Some(start), _) => {
                let read = cells_read(start, &space.states);
                if timed.contains(&rule) || read.iter().any(|cell| space.may_set_each_step(*cell)) {
                    found.extend(read);
                }
            }
            (None, RuleBody::Moves { cell, .. }) if space.may_set_each_step(*cell) => found.push(*cell),
            (None, _) => {}
        }
    }
    effort::spend(found.len());
    let has_number = |cell: &usize| !matches!(space.state_of(*cell).ty, Type::Bool | Type::Enum(_));
    let cells = 0..space.states.iter().map(|state| state.cells).sum();
    found.extend(cells.filter(|cell| has_number(cell) && space.may_set_each_step(*cell)));
    let mut next = 0;
    found.sort_unstable();
    found.dedup();
    let mut seen: BTreeSet<usize> = found.iter().copied().collect();
    let sets: Vec<&SetDef> =
        space.actions.iter().flat_map(|action| action.sets()).chain(&space.each_step).collect();
    while let Some(cell) = found.get(next).copied() {
        next += 1;
        effort::spend(sets.len());
        if effort::is_spent() {
            break;
        }
        for set in sets.iter().filter(|set| space.sets_cell(set, cell)) {
            for part in set.key.iter().chain([&set.value]) {
                found.extend(cells_read(part, &space.states).into_iter().filter(|read| seen.insert(*read)));
            }
        }
    }
    found
}
