//! Witnesses: values with which a row runs on a road, found by search.
//!
//! The search narrows the ranges by exact intervals, tries the middle and the ends of what is left,
//! and halves it where nothing fits. What it finds is judged in f64 by the evaluator that drawing
//! uses. The world around is taken to be empty: a spawn lands where it was asked to, and nobody needs
//! room. What it does not find may exist all the same.

use std::cell::Cell;
use std::collections::VecDeque;
use std::sync::Arc;

use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::{
    ActionDef, Bound, Domain, EffectDef, End, Facts, Initial, Interval, Memory, Road, Row, RuleBody,
    SPAWN_DISTANCE_M, SPAWN_SPEED_MPS, Space, StateDef, Type, Value, bounds, evaluate, locals,
};
use crate::prove::enclose::Values;
use crate::prove::reach::Prover;
use crate::units::Rational;

/// Boxes of ranges looked at for one choice of the listed values and one memory.
const BOXES_MAX: usize = 24;
/// Boxes looked at in one search for a single witness.
const BOXES_IN_ALL_MAX: usize = 20_000;
/// Choices of listed values, and memories, at most.
const CHOICES_MAX: usize = 256;
const MEMORIES_MAX: usize = 64;

/// Values with which a row runs, and what is remembered before.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// The drawn parameters, as declared.
    pub values: Vec<(Arc<str>, Value)>,
    pub memory: Memory,
}

/// A witness for a row on a road with the default rules; `None` if the search finds none.
pub fn witness(space: &Space, row: &Row, road: &Road) -> Option<Witness> {
    witness_within(space, row, road, &bounds(space, row.action), &Cell::new(BOXES_IN_ALL_MAX))
}

/// The same, given the bounds of the row's action, with so many boxes left to look at.
pub(super) fn witness_within(
    space: &Space,
    row: &Row,
    road: &Road,
    bounds: &[Bound],
    boxes_left: &Cell<usize>,
) -> Option<Witness> {
    let rules: Vec<usize> = row.rules.iter().copied().filter(|rule| !space.rules[*rule].optional).collect();
    Search { space, row, road, rules, bounds, boxes_left }.find(&|_, _| true)
}

/// A search under given rules.
pub(super) struct Search<'a> {
    pub space: &'a Space,
    pub row: &'a Row,
    pub road: &'a Road,
    pub rules: Vec<usize>,
    pub bounds: &'a [Bound],
    /// Boxes that may still be looked at; at 0 a search finds nothing more.
    pub boxes_left: &'a Cell<usize>,
}

/// What is asked of a witness beyond the rules: of all parameters, and the memory after.
pub(super) type Wish<'a> = dyn Fn(&[Value], &Memory) -> bool + 'a;

impl Search<'_> {
    /// The first values that run and fulfil the wish.
    pub fn find(&self, wish: &Wish<'_>) -> Option<Witness> {
        let action = &self.space.actions[self.row.action];
        let choices = choices(action, &locals(action, self.row, &[]));
        for memory in self.memories() {
            for chosen in &choices {
                if self.boxes_left.get() == 0 {
                    return None;
                }
                if let Some(values) = self.numbers(action, chosen, &memory, wish) {
                    let drawn = action.parameters.iter().zip(values).filter(|(parameter, _)| !parameter.axis);
                    let values = drawn.map(|(parameter, value)| (parameter.name.clone(), value)).collect();
                    return Some(Witness { values, memory });
                }
            }
        }
        None
    }

    /// Looks for numbers, given everything that is chosen from lists.
    fn numbers(
        &self,
        action: &ActionDef,
        chosen: &[Value],
        memory: &Memory,
        wish: &Wish<'_>,
    ) -> Option<Vec<Value>> {
        let open: Vec<usize> = ranges(action).collect();
        let values = |value: &Value| match value {
            Value::Bool(truth) => Values::truth(*truth),
            Value::Variant(_, variant) => Values::Variants(1 << variant),
            Value::Number(number) => {
                Values::Number(Rational::from_f64(*number).map_or(Interval::ALL, Interval::point))
            }
        };
        let before: Vec<Values> = memory.cells().iter().map(values).collect();
        let mut declared: Vec<Values> = chosen.iter().map(values).collect();
        for local in &open {
            if let Domain::Range(low, high) = &action.parameters[*local].domain {
                declared[*local] = Values::Number(Interval::closed(*low, *high));
            }
        }
        let prover = Prover {
            space: self.space,
            row: self.row,
            values: chosen,
            bounds: self.bounds,
            road: Some(self.road),
        };
        let mut boxes = VecDeque::from([declared]);
        for _ in 0..BOXES_MAX.min(self.boxes_left.get()) {
            self.boxes_left.set(self.boxes_left.get() - 1);
            let Some(narrowed) = prover.narrow(boxes.pop_front()?, &before, &self.rules) else { continue };
            for pick in 0..1_usize << open.len().min(3) {
                if let Some(found) = self.candidate(action, chosen, &open, &narrowed, pick, memory, wish) {
                    return Some(found);
                }
            }
            if let Some(found) = self.candidate(action, chosen, &open, &narrowed, usize::MAX, memory, wish) {
                return Some(found);
            }
            boxes.extend(halves(&narrowed, &open));
        }
        None
    }

    /// One point of a box: `pick` says for each range whether its low or its high end is taken, or
    /// [`usize::MAX`] the middle of all.
    #[expect(clippy::too_many_arguments, reason = "it is the inside of two loops of `numbers`")]
    fn candidate(
        &self,
        action: &ActionDef,
        chosen: &[Value],
        open: &[usize],
        narrowed: &[Values],
        pick: usize,
        memory: &Memory,
        wish: &Wish<'_>,
    ) -> Option<Vec<Value>> {
        let mut values = chosen.to_vec();
        for (index, local) in open.iter().enumerate() {
            let interval = narrowed[*local].interval();
            let (End::At(low, low_in), End::At(high, high_in)) = (interval.low, interval.high) else {
                return None;
            };
            let middle = low.checked_add(high)?.checked_div(Rational::integer(2))?;
            let end = match pick {
                usize::MAX => middle,
                pick if pick >> index.min(2) & 1 == 0 && low_in => low,
                pick if pick >> index.min(2) & 1 == 1 && high_in => high,
                _ => middle,
            };
            values[*local] = Value::Number(end.to_f64());
        }
        // Equalities are solved as drawing solves them: once for what waits for nothing, once more for
        // what waited.
        for _ in 0..2 {
            for local in open {
                for bound in self.bounds.iter().filter(|bound| bound.local == *local) {
                    let in_force = bound.rule.is_none_or(|rule| self.rules.contains(&rule));
                    if bound.op != Comparison::Equal || !in_force || !bound.is_known_early() {
                        continue;
                    }
                    let facts = Facts { road: Some(&self.road.facts), ..Facts::new(&values, memory) };
                    let holds = |guard: &Expr| evaluate(guard, &self.space.functions, &facts).truth();
                    if bound.guards.iter().all(holds) {
                        values[*local] =
                            Value::Number(evaluate(&bound.limit, &self.space.functions, &facts).number());
                    }
                }
            }
        }
        self.runs(action, &values, memory, wish).then_some(values)
    }

    /// Whether these values run in an empty world, and fulfil the wish.
    fn runs(&self, action: &ActionDef, values: &[Value], memory: &Memory, wish: &Wish<'_>) -> bool {
        let space = self.space;
        let in_domain = |(parameter, value): (&crate::model::Parameter, &Value)| {
            parameter.axis || parameter.domain.holds(*value)
        };
        if !action.parameters.iter().zip(values).all(in_domain) {
            return false;
        }
        let after = space.memory_after(self.row.action, values, memory);
        let base = Facts { road: Some(&self.road.facts), ..Facts::new(values, &after) };
        let number = |expr: &Expr| evaluate(expr, &space.functions, &base).number();
        let mut gaps_m = Vec::new();
        for effect in &action.effects {
            let EffectDef::Spawn(spawn) = effect else { continue };
            let (speed_mps, distance_m) = (number(&spawn.speed), number(&spawn.distance));
            if !SPAWN_SPEED_MPS.contains(&speed_mps) || !SPAWN_DISTANCE_M.contains(&distance_m) {
                return false;
            }
            gaps_m.push((distance_m, 0.0));
        }
        let holds = |condition: &Expr| match condition.needs_survey() {
            true => gaps_m.iter().all(|gaps_m| {
                evaluate(condition, &space.functions, &Facts { gaps_m: *gaps_m, ..base }).truth()
            }),
            false => evaluate(condition, &space.functions, &base).truth(),
        };
        let by_rule = |rule: &usize| match &space.rules[*rule].body {
            RuleBody::Holds(bindings) => {
                let mut bindings = bindings.iter().filter(|binding| binding.action == self.row.action);
                bindings.all(|binding| holds(&binding.condition))
            }
            RuleBody::Moves { .. } => space.forbidden_move(&space.rules[*rule], memory, &after).is_none(),
        };
        action.parameters.iter().filter_map(|parameter| parameter.condition.as_ref()).all(holds)
            && self.rules.iter().all(by_rule)
            && wish(values, &after)
    }

    /// What may be remembered: the initial memory first, then every value of the cells that the rules
    /// or effects of the row read.
    fn memories(&self) -> Vec<Memory> {
        let space = self.space;
        let mut memories = vec![Memory::default()];
        for state in &space.states {
            let initial = initial(space, state);
            for cell in 0..state.cells {
                let values = match self.reads(state, cell) {
                    true => all_values(space, state.ty, initial),
                    false => vec![initial],
                };
                let room = MEMORIES_MAX / memories.len();
                let longer = memories.iter().flat_map(|memory| {
                    values.iter().take(room.max(1)).map(|value| {
                        let mut memory = memory.clone();
                        memory.cells.push(*value);
                        memory
                    })
                });
                memories = longer.collect();
            }
        }
        memories
    }

    /// Whether a rule or an effect of the row depends on what the cell was before.
    fn reads(&self, state: &StateDef, cell: usize) -> bool {
        let named = |expr: &Expr| {
            expr.any(|kind| match kind {
                ExprKind::Cell(named) => *named == state.first_cell + cell,
                ExprKind::CellAt(first, _) => *first == state.first_cell,
                _ => false,
            })
        };
        let by_rule = |rule: &usize| match &self.space.rules[*rule].body {
            RuleBody::Holds(bindings) => bindings
                .iter()
                .filter(|binding| binding.action == self.row.action)
                .any(|binding| named(&binding.condition)),
            RuleBody::Moves { state: moved, .. } => self.space.states[*moved].first_cell == state.first_cell,
        };
        let by_effect = |effect: &EffectDef| match effect {
            EffectDef::Set(set) => named(&set.value) || set.key.as_ref().is_some_and(named),
            EffectDef::Spawn(spawn) => named(&spawn.speed) || named(&spawn.distance),
        };
        self.rules.iter().any(by_rule) || self.space.actions[self.row.action].effects.iter().any(by_effect)
    }
}

/// Every choice of the listed values, the first values first; what is a range stays as it is.
fn choices(action: &ActionDef, values: &[Value]) -> Vec<Vec<Value>> {
    let mut chosen = vec![values.to_vec()];
    for (local, parameter) in action.parameters.iter().enumerate().filter(|(_, p)| !p.axis) {
        let Domain::Values(values) = &parameter.domain else { continue };
        let room = (CHOICES_MAX / chosen.len()).max(1);
        // What is likelier stands there more than once, and would use up the room.
        let mut different: Vec<Value> = Vec::new();
        for value in values {
            if different.len() < room && !different.contains(value) {
                different.push(*value);
            }
        }
        let longer = chosen.iter().flat_map(|locals| {
            different.iter().map(move |value| {
                let mut locals = locals.clone();
                locals[local] = *value;
                locals
            })
        });
        chosen = longer.collect();
    }
    chosen
}

/// The drawn parameters with a range.
fn ranges(action: &ActionDef) -> impl Iterator<Item = usize> {
    let all = action.parameters.iter().enumerate();
    all.filter(|(_, p)| !p.axis && matches!(p.domain, Domain::Range(..))).map(|(local, _)| local)
}

/// The box cut in two across its widest range; nothing if every range is a point.
fn halves(narrowed: &[Values], open: &[usize]) -> Vec<Vec<Values>> {
    let width = |local: &usize| match narrowed[*local].interval() {
        Interval { low: End::At(low, _), high: End::At(high, _) } => high.checked_sub(low),
        _ => None,
    };
    let widest =
        open.iter().filter_map(|local| Some((width(local)?, *local))).max_by_key(|(width, _)| *width);
    let Some((_, local)) = widest.filter(|(width, _)| *width > Rational::ZERO) else { return Vec::new() };
    let interval = narrowed[local].interval();
    let (End::At(low, _), End::At(high, _)) = (interval.low, interval.high) else { return Vec::new() };
    let middle = low.checked_add(high).and_then(|sum| sum.checked_div(Rational::integer(2)));
    let Some(middle) = middle else { return Vec::new() };
    let half = |interval: Interval| {
        let mut values = narrowed.to_vec();
        values[local] = Values::Number(interval);
        values
    };
    vec![
        half(Interval { low: interval.low, high: End::At(middle, true) }),
        half(Interval { low: End::At(middle, true), high: interval.high }),
    ]
}

/// What the cells of a state begin as; of what is drawn, the first value.
fn initial(space: &Space, state: &StateDef) -> Value {
    match &state.initial {
        Initial::Value(expr) => evaluate(expr, &space.functions, &Facts::new(&[], &Memory::default())),
        Initial::Any => match state.ty {
            Type::Enum(of) => Value::Variant(of, 0),
            Type::Bool | Type::Int | Type::Quantity(_) => Value::Bool(false),
        },
    }
}

/// All values of a finite type, `first` before the others.
fn all_values(space: &Space, ty: Type, first: Value) -> Vec<Value> {
    let mut values = vec![first];
    match ty {
        Type::Enum(of) => values.extend((0..space.enums[of.0].variants.len()).map(|v| Value::Variant(of, v))),
        Type::Bool => values.extend([false, true].map(Value::Bool)),
        Type::Int | Type::Quantity(_) => {}
    }
    let mut kept: Vec<Value> = Vec::new();
    for value in values {
        if !kept.contains(&value) {
            kept.push(value);
        }
    }
    kept
}
