//! Witnesses: values with which a row runs on a road, found by search.
//!
//! The search narrows the ranges by exact intervals, tries the ends and the middle of what is left, and
//! halves the box where nothing fits. Each try is solved and judged as a draw is, in f64. The world around is
//! taken to be empty: a spawn lands where it was asked to, and no gap is too small. Values that the search
//! does not find may still exist.

use std::cell::Cell;
use std::collections::VecDeque;
use std::sync::Arc;

use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{Breach, Candidate, Demand, Room, RowRules};
use crate::model::{
    ActionDef, Domain, EffectDef, End, Facts, Initial, Interval, Memory, Parameter, Road, Row, RulesInForce,
    Space, SpawnFacts, StateDef, Type, Value, WorldFacts, evaluate, locals, spawn_out_of_bounds,
};
use crate::prove::enclose::{Known, Values, enclose};
use crate::units::Rational;

/// The most boxes of ranges looked at for one choice of the listed values and one memory.
const BOXES_MAX: usize = 24;
/// The most boxes looked at in one search for a single witness.
const BOXES_IN_ALL_MAX: usize = 20_000;
/// The most choices of listed values, and the most memories, that are tried.
const CHOICES_MAX: usize = 256;
const MEMORIES_MAX: usize = 64;
/// The first ranges of a row: every combination of their ends is tried. All later ranges take the same end as the
/// last of these.
const CORNER_BITS: usize = 3;

/// Values with which a row runs, and the memory before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// The drawn parameters, as declared.
    pub values: Vec<(Arc<str>, Value)>,
    pub memory: Memory,
}

/// A witness for a row on a road with the default rules; `None` if the search finds none.
pub fn witness(space: &Space, row: &Row, road: &Road) -> Option<Witness> {
    witness_within(space, row, road, &Cell::new(BOXES_IN_ALL_MAX))
}

/// As [`witness`], with so many boxes left to look at.
pub(super) fn witness_within(
    space: &Space,
    row: &Row,
    road: &Road,
    boxes_left: &Cell<usize>,
) -> Option<Witness> {
    let in_force = RulesInForce::by_default(space);
    let rules = RowRules { space, row, road: Some(&road.facts), in_force: &in_force };
    Search { rules, boxes_left }.find(&|_, _| true)
}

/// A search for values of a row on a road under the rules in force.
pub(super) struct Search<'a> {
    pub rules: RowRules<'a>,
    /// Boxes that may still be looked at; at 0 a search finds nothing more.
    pub boxes_left: &'a Cell<usize>,
}

/// Where in a box a candidate is taken from.
#[derive(Clone, Copy)]
enum Place {
    /// Bit `i` says whether the high end of the ith range is taken, or the low end. An end that does not
    /// belong to its range gives way to the middle.
    Corner(usize),
    Middle,
}

/// What is asked of a witness beyond the rules, given all parameters and the memory after.
pub(super) type Wish<'a> = dyn Fn(&[Value], &Memory) -> bool + 'a;

impl Search<'_> {
    /// The first values that run and fulfil the wish.
    pub fn find(&self, wish: &Wish<'_>) -> Option<Witness> {
        let action = self.action();
        let choices = choices(action, &locals(action, self.rules.row, &[]));
        for memory in self.memories() {
            for chosen in &choices {
                if self.boxes_left.get() == 0 {
                    return None;
                }
                if let Some(values) = self.numbers(chosen, &memory, wish) {
                    return Some(Witness { values: action.drawn_of(&values), memory });
                }
            }
        }
        None
    }

    fn action(&self) -> &ActionDef {
        &self.rules.space.actions[self.rules.row.action]
    }

    /// Looks for numbers, given everything that is chosen from lists.
    fn numbers(&self, chosen: &[Value], memory: &Memory, wish: &Wish<'_>) -> Option<Vec<Value>> {
        let action = self.action();
        let open: Vec<usize> = action.drawn_numbers().collect();
        let before: Vec<Values> = memory.cells().iter().map(|value| Values::point(*value)).collect();
        let mut declared: Vec<Values> = chosen.iter().map(|value| Values::point(*value)).collect();
        for local in &open {
            if let Domain::Range(low, high) = &action.parameters[*local].domain {
                declared[*local] = Values::Number(Interval::closed(*low, *high));
            }
        }
        let corners = 0..1_usize << open.len().min(CORNER_BITS);
        let mut boxes = VecDeque::from([declared]);
        for _ in 0..BOXES_MAX.min(self.boxes_left.get()) {
            self.boxes_left.set(self.boxes_left.get() - 1);
            let Some(narrowed) = self.rules.narrow(boxes.pop_front()?, &before) else { continue };
            for place in corners.clone().map(Place::Corner).chain([Place::Middle]) {
                let values = self.candidate(chosen, &open, &narrowed, place);
                if let Some(found) = values.filter(|values| self.runs(values, memory, wish)) {
                    return Some(found);
                }
            }
            boxes.extend(halves(&narrowed, &open));
        }
        None
    }

    /// One point of a box, its equalities solved as drawing solves them.
    fn candidate(
        &self,
        chosen: &[Value],
        open: &[usize],
        narrowed: &[Values],
        place: Place,
    ) -> Option<Vec<Value>> {
        let mut values = chosen.to_vec();
        for (index, local) in open.iter().enumerate() {
            let interval = narrowed[*local].interval();
            let (End::At(low, low_in), End::At(high, high_in)) = (interval.low, interval.high) else {
                return None;
            };
            let middle = low.checked_add(high)?.checked_div(Rational::integer(2))?;
            let is_high = |corner: usize| corner >> index.min(CORNER_BITS - 1) & 1 == 1;
            let number = match place {
                Place::Corner(corner) if is_high(corner) && high_in => high,
                Place::Corner(corner) if !is_high(corner) && low_in => low,
                Place::Corner(_) | Place::Middle => middle,
            };
            values[*local] = Value::Number(number.to_f64());
        }
        let settle = |_, value: Value, room: &Room| room.settle(value.number()).ok_or(());
        self.rules.solve(&mut values, open.to_vec(), settle).ok()?;
        Some(values)
    }

    /// Whether these values run in an empty world, and fulfil the wish.
    fn runs(&self, values: &[Value], before: &Memory, wish: &Wish<'_>) -> bool {
        let (space, action) = (self.rules.space, self.action());
        let in_domain =
            |(parameter, value): (&Parameter, &Value)| parameter.axis || parameter.domain.holds(*value);
        if !action.parameters.iter().zip(values).all(in_domain) {
            return false;
        }
        let after = &space.memory_after(self.rules.row.action, values, before);
        let facts = Facts { road: self.rules.road, ..Facts::new(values, after) };
        let number = |expr: &Expr| evaluate(expr, &space.functions, &facts).number();
        let mut spawns = Vec::new();
        for effect in &action.effects {
            let EffectDef::Spawn(spawn) = effect else { continue };
            let (speed_mps, distance_m) = (number(&spawn.speed), number(&spawn.distance));
            if spawn_out_of_bounds(speed_mps, distance_m).is_some() {
                return false;
            }
            // The spawn lands where it was asked to, and no gap is unfair.
            spawns.push(SpawnFacts { spawn_gap_m: distance_m, ..SpawnFacts::default() });
        }
        let world = WorldFacts { spawns, ..WorldFacts::default() };
        let candidate = Candidate { values, before, after, world: Some(&world) };
        let runs = self.rules.breaches(candidate).all(|breach| self.is_left_open(breach, candidate));
        runs && wish(values, after)
    }

    /// Whether what a candidate breaks depends on a moment or a place that an empty world does not have, and might
    /// hold there.
    fn is_left_open(&self, breach: Breach<'_>, candidate: Candidate<'_>) -> bool {
        let condition = match breach {
            Breach::Where(_, condition)
            | Breach::Condition { condition, .. }
            | Breach::Spawn { condition, .. } => condition,
            Breach::Move { .. } => return false,
        };
        let points = |values: &[Value]| values.iter().map(|value| Values::point(*value)).collect::<Vec<_>>();
        let known = Known {
            functions: &self.rules.space.functions,
            locals: &points(candidate.values),
            cells: &points(candidate.after.cells()),
            road: self.rules.road,
        };
        condition.asks_about_moment() && enclose(condition, &known).may_hold()
    }

    /// Memories to try: the initial one first, then every value of the cells that the rules or effects of the
    /// row read.
    fn memories(&self) -> Vec<Memory> {
        let space = self.rules.space;
        let mut memories = vec![Memory::default()];
        for state in &space.states {
            for cell in 0..state.cells {
                let initial = initial(space, state, cell);
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
        let by_rule = |demand| match demand {
            Demand::Holds(condition) => named(condition),
            Demand::Moves { cell: moved, .. } => moved == state.first_cell + cell,
        };
        let by_effect = |effect: &EffectDef| match effect {
            EffectDef::Set(set) => named(&set.value) || set.key.as_ref().is_some_and(named),
            EffectDef::Spawn(spawn) => named(&spawn.speed) || named(&spawn.distance),
        };
        self.rules.demands().any(|(_, demand)| by_rule(demand)) || self.action().effects.iter().any(by_effect)
    }
}

/// Every choice of the listed values, the first values first; what is a range stays as it is.
fn choices(action: &ActionDef, values: &[Value]) -> Vec<Vec<Value>> {
    let mut chosen = vec![values.to_vec()];
    for (local, parameter) in action.parameters.iter().enumerate().filter(|(_, p)| !p.axis) {
        let Domain::Values(values) = &parameter.domain else { continue };
        let room = (CHOICES_MAX / chosen.len()).max(1);
        // A value that is likelier stands in the list more than once; one time is enough here.
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

/// The value that a cell of a state begins with; the first of its type if it is drawn.
fn initial(space: &Space, state: &StateDef, cell: usize) -> Value {
    match &state.initial[cell] {
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
