//! The one evaluator of expressions: it computes rules, functions and verdicts in `f64`.
//!
//! Evaluation cannot fail: the checker has resolved names and types, and functions cannot recurse. A missing value (a
//! division by 0, a number too large) is NaN, which satisfies no comparison but `!=`.

use crate::model::effort;
use crate::model::expr::{Comparison, Expr, ExprKind, FnDef, Who, WordExpr};
use crate::model::facts::{Facts, NearFacts, NpcFacts, SINCE_S_MAX, SpawnFacts};
use crate::model::numbers::{arithmetic, compare, of_numbers};
use crate::model::value::Value;
use crate::model::vocabulary::{LaneChoice, NearWord, PastWord, Word, WordFact};

/// A call of a function with at most this many parameters allocates nothing.
const FEW: usize = 4;

/// The value of an expression.
pub fn evaluate(expr: &Expr, functions: &[FnDef], facts: &Facts<'_>) -> Value {
    effort::spend(1);
    let value = |expr: &Expr| evaluate(expr, functions, facts);
    match &expr.kind {
        ExprKind::Bool(truth) => Value::Bool(*truth),
        ExprKind::Number(number) => Value::Number(number.to_f64()),
        ExprKind::Variant(of, index) => Value::Variant(*of, *index),
        ExprKind::Local(index) => facts.locals[*index],
        ExprKind::Cell(cell) => facts.memory.cells[*cell],
        ExprKind::CellAt(first, key) => facts.memory.cells[first + value(key).variant()],
        ExprKind::Fact(fact) => fact.value(facts),
        ExprKind::OfRoadUser(id, fact) => {
            let mut users = facts.world.into_iter().flat_map(|world| &world.road_users);
            fact.value(&about(users.find(|(known, _)| known == id).map(|(_, npc)| *npc), facts))
        }
        ExprKind::OfBearer(who, fact) => fact.value(&about(bearer(who.bearer(facts.locals), facts), facts)),
        ExprKind::Since(actions, _) => Value::Number(facts.world.map_or(f64::NAN, |world| {
            let happened_s = |action: &usize| world.happened_s.get(*action).copied();
            let last_s = actions.iter().filter_map(happened_s).fold(f64::NEG_INFINITY, f64::max);
            // As near as `elapsed` to the exact time.
            ((world.moment.elapsed_s - last_s) * 1000.0).round().min(SINCE_S_MAX * 1000.0) / 1000.0
        })),
        // Only requirements remember the past.
        ExprKind::Past(_, PastWord::Change | PastWord::Total | PastWord::Times, _) => Value::Number(0.0),
        ExprKind::Past(condition, ..) => evaluate(condition, functions, facts),
        ExprKind::Near(word, bodies, condition) => {
            let near = facts.world.map_or(&[][..], |world| &world.near);
            let holds =
                |near: &NearFacts| evaluate(condition, functions, &about(Some(near.npc), facts)).truth();
            let mut meant = near.iter().filter(|near| near.is_of(bodies));
            match word {
                NearWord::Some => Value::Bool(meant.any(holds)),
                NearWord::Count => Value::Number(meant.filter(|near| holds(near)).count() as f64),
            }
        }
        ExprKind::Margin(requirement) => {
            Value::Number(facts.margins.get(*requirement).copied().unwrap_or(f64::NAN))
        }
        ExprKind::Breached(requirement) => Value::Bool(facts.outcome.breached >> requirement & 1 == 1),
        ExprKind::IsThere(who) => Value::Bool(bearer(who.bearer(facts.locals), facts).is_some()),
        ExprKind::Call(function, arguments) => {
            let body = &functions[*function].body;
            let mut few = [Value::Bool(false); FEW];
            match few.get_mut(..arguments.len()) {
                Some(locals) => {
                    locals.iter_mut().zip(arguments).for_each(|(local, argument)| *local = value(argument));
                    evaluate(body, functions, &Facts { locals, ..*facts })
                }
                None => {
                    let locals: Vec<Value> = arguments.iter().map(value).collect();
                    evaluate(body, functions, &Facts { locals: &locals, ..*facts })
                }
            }
        }
        ExprKind::OfNumbers(word, numbers) => {
            Value::Number(of_numbers(*word, numbers.iter().map(|expr| value(expr).number())))
        }
        ExprKind::Not(inner) => Value::Bool(!value(inner).truth()),
        ExprKind::Negate(inner) => Value::Number(-value(inner).number()),
        ExprKind::Arithmetic(op, left, right) => {
            Value::Number(arithmetic(*op, value(left).number(), value(right).number()))
        }
        ExprKind::Compare(op, left, right) => Value::Bool(compare(*op, value(left), value(right))),
        ExprKind::And(left, right) => Value::Bool(value(left).truth() && value(right).truth()),
        ExprKind::Or(left, right) => Value::Bool(value(left).truth() || value(right).truth()),
        ExprKind::Implies(left, right) => Value::Bool(!value(left).truth() || value(right).truth()),
        ExprKind::InRange(inner, low, high) => {
            let inner = value(inner);
            let above = compare(Comparison::GreaterEqual, inner, value(low));
            Value::Bool(above && compare(Comparison::LessEqual, inner, value(high)))
        }
        ExprKind::InList(inner, list) => {
            let inner = value(inner);
            Value::Bool(list.iter().any(|item| compare(Comparison::Equal, inner, value(item))))
        }
        ExprKind::InLanes(inner, lanes) => Value::Bool(has_lane(facts, lanes[value(inner).variant()])),
        ExprKind::OnRoad(names) => Value::Bool(facts.road.is_some_and(|road| names.contains(&road.name))),
        ExprKind::IsWord(fact, words) => {
            Value::Bool(word_of(*fact, facts).is_some_and(|word| words.iter().any(|one| one == word)))
        }
        ExprKind::IsWordOf(who, fact, words) => {
            let word = word_of_bearer(*who, *fact, facts);
            Value::Bool(word.is_some_and(|word| words.iter().any(|one| one == word)))
        }
        ExprKind::IsBody(fact, bodies) => {
            let found = if *fact == WordFact::Hit { facts.outcome.hit } else { facts.outcome.near };
            Value::Bool(found.is_some_and(|found| bodies.iter().any(|named| found.is(*named))))
        }
        ExprKind::Match { subject, arm_of, arms } => value(&arms[arm_of[value(subject).variant()]]),
    }
}

fn bearer(who: usize, facts: &Facts<'_>) -> Option<NpcFacts> {
    let mut bearers = facts.world.into_iter().flat_map(|world| &world.bearers);
    bearers.find(|(known, _)| *known == who).map(|(_, npc)| *npc)
}

/// The same facts, with this road user, if it is there, as the newcomer.
pub(crate) fn about<'a>(npc: Option<NpcFacts>, facts: &Facts<'a>) -> Facts<'a> {
    Facts { spawn: npc.map(|npc| SpawnFacts { npc, ..SpawnFacts::default() }), ..*facts }
}

/// The word that a fact is; `None` where it is not known.
pub(crate) fn word_of(fact: WordFact, facts: &Facts<'_>) -> Option<&'static str> {
    match fact {
        WordFact::EgoLight => facts.world.map(|world| world.moment.ego_light.name()),
        WordFact::EgoRoad => facts.world.map(|world| world.moment.ego_road.name()),
        WordFact::EgoCrosses => facts.world.map(|world| world.tick.crosses.name()),
        WordFact::EgoTurn => facts.world.map(|world| world.moment.ego_turn.name()),
        WordFact::NpcTurn => facts.spawn.map(|spawn| spawn.npc.turn.name()),
        WordFact::NpcLight => facts.spawn.map(|spawn| spawn.npc.light.name()),
        WordFact::NpcPriority => facts.spawn.map(|spawn| spawn.npc.priority.name()),
        WordFact::Priority => Some(facts.outcome.priority.name()),
        WordFact::Hit => facts.outcome.hit.map(|body| body.like.name()),
        WordFact::Near => facts.outcome.near.map(|body| body.like.name()),
    }
}

/// The word that a fact about the latest bearer of a name is; `None` where there is none.
pub(crate) fn word_of_bearer(who: Who, fact: WordFact, facts: &Facts<'_>) -> Option<&'static str> {
    word_of(fact, &about(bearer(who.bearer(facts.locals), facts), facts))
}

fn has_lane(facts: &Facts<'_>, lane: LaneChoice) -> bool {
    facts.road.is_some_and(|road| road.has_lane(lane))
}

impl<W> WordExpr<W> {
    /// The expression that chooses the word, if it is not fixed.
    pub fn expr(&self) -> Option<&Expr> {
        match self {
            WordExpr::Fixed(_) => None,
            WordExpr::Of(expr, _) => Some(expr),
        }
    }
}

impl<W: Copy> WordExpr<W> {
    /// The word that the expression gives.
    pub fn word(&self, functions: &[FnDef], facts: &Facts<'_>) -> W {
        match self {
            WordExpr::Fixed(word) => *word,
            WordExpr::Of(expr, words) => words[evaluate(expr, functions, facts).variant()],
        }
    }
}
