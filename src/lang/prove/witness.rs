//! Witnesses: values with which a row runs on a road.
//!
//! Values are solved for as drawing solves for them (`model::rules`), and judged as drawing judges. The world around
//! is taken to be empty: a spawn lands where it was asked to, and no gap is too small. A rule that asks more of the
//! world than that holds at some moment, as far as is known here.
//!
//! If a rule asks about a gap, or the witness must meet a further wish, the search narrows the ranges by exact intervals.
//! It tries the ends and the middle of the rest, and halves the box where nothing fits. Values that this search does not
//! find may still exist.

use std::cell::Cell;
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use crate::model::OFFSET_M;
use crate::model::body::parameters;
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{Before, Candidate, Choose, Demand, Nearest, Room, RowRules, cells_read};
use crate::model::vocabulary::Field;
use crate::model::{
    ActionDef, Domain, End, Facts, Interval, Memory, Parameter, Road, Row, RulesInForce, SPAWN_SPEED_MPS,
    SetDef, Space, SpawnFacts, Type, Value, WorldFacts, effort, evaluate, locals, rounded_into,
    spawn_distance_m, spawn_out_of_bounds,
};
use crate::prove::enclose::{Known, Values};
use crate::prove::lists::{distinct, product};
use crate::prove::moment::{Case, may_hold_together, newcomers};
use crate::prove::reach::declared;
use crate::prove::sums::oppose;
use avastra_base::units::Rational;

/// The most boxes of ranges looked at for one choice of the listed values and one memory.
const BOXES_MAX: usize = 24;
/// The most boxes looked at in one search for a single witness.
const BOXES_IN_ALL_MAX: usize = 20_000;
/// Judgements of solving for each box, on average; most rows need some fifty for one box.
const TRIES_A_BOX: usize = 10;
/// Judgements of solving for one row and one memory.
const TRIES_A_MEMORY: usize = 5_000;
/// The most choices of listed values, and the most memories, that are tried.
const CHOICES_MAX: usize = 256;
const MEMORIES_MAX: usize = 64;
/// The first ranges of a row: every combination of their ends is tried. All later ranges take the same end as the
/// last of these.
const CORNER_BITS: usize = 3;
/// The shares of what is left that are tried for each parameter: the middle, and the two ends.
const SHARES: [f64; 3] = [0.5, 0.0, 1.0 - f64::EPSILON];

/// Values with which a row runs, and the memory before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// The drawn parameters, as declared.
    pub values: Vec<(Arc<str>, Value)>,
    pub memory: Memory,
}

/// A witness for a row on a road with the default rules; `None` if the search finds none.
pub fn witness(space: &Space, row: &Row, road: &Road) -> Option<Witness> {
    let in_force = RulesInForce::by_default(space);
    let rules = RowRules { space, row, road: Some(&road.facts), in_force: &in_force };
    let search = Search { rules, left: &Left::new(BOXES_IN_ALL_MAX), moment: None };
    search.memories().0.into_iter().find_map(|memory| {
        let Found::Runs(values) = search.at(&memory) else { return None };
        Some(Witness { values: search.action().drawn_of(&values), memory })
    })
}

/// The finding about a row with one memory before it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Found {
    /// Values of all its parameters with which it runs.
    Runs(Vec<Value>),
    /// No values obey the rules.
    Never,
    /// No values were found.
    Unknown,
}

/// A search for values of a row on a road under the rules in force.
pub(super) struct Search<'a> {
    pub rules: RowRules<'a>,
    pub left: &'a Left,
    /// The known facts of the moment; `None`: any moment.
    pub moment: Option<&'a Case>,
}

/// The work left to searches; at 0 they find nothing more.
pub(super) struct Left {
    /// Boxes to look at.
    boxes: Cell<usize>,
    /// Judgements of solving.
    tries: Cell<usize>,
}

impl Left {
    pub fn new(boxes: usize) -> Left {
        Left { boxes: Cell::new(boxes), tries: Cell::new(boxes.saturating_mul(TRIES_A_BOX)) }
    }

    pub fn is_spent(&self) -> bool {
        self.boxes.get() == 0 || self.tries.get() == 0
    }

    fn take_box(&self) {
        self.boxes.set(self.boxes.get().saturating_sub(1));
    }
}

/// Takes the same share of everything that is left.
struct Share(f64);

impl Choose for Share {
    fn value(&mut self, _local: usize, left: &[Value]) -> Value {
        left[((left.len() as f64 * self.0) as usize).min(left.len() - 1)]
    }

    fn number(&mut self, _local: usize, room: &Room) -> Option<f64> {
        room.at(self.0)
    }
}

/// Where in a box a candidate is taken from.
#[derive(Clone, Copy)]
enum Place {
    /// Bit `i` says whether the high end of the ith range is taken, or the low end. An end that does not
    /// belong to its range gives way to the middle.
    Corner(usize),
    Middle,
}

/// A wish beyond the rules, given all parameters and the memory after.
pub(super) type Wish<'a> = dyn Fn(&[Value], &Memory) -> bool + 'a;

impl Search<'_> {
    /// The first values that run and fulfil the wish.
    pub fn find(&self, wish: &Wish<'_>) -> Option<Witness> {
        let choices = self.choices();
        for memory in self.memories().0 {
            for chosen in &choices {
                if self.left.is_spent() || effort::is_spent() {
                    return None;
                }
                if let Some(values) = self.numbers(chosen, &memory, wish) {
                    return Some(Witness { values: self.action().drawn_of(&values), memory });
                }
            }
        }
        None
    }

    /// The finding with this memory before the row.
    pub fn at(&self, memory: &Memory) -> Found {
        self.left.take_box();
        if self.asks_about_moment() && !self.may_run(&followed(memory)) {
            return Found::Never;
        }
        let lent = self.left.tries.get().min(TRIES_A_MEMORY);
        let tries = Cell::new(lent);
        let found = self.solved(memory, &tries);
        self.left.tries.set(self.left.tries.get() - (lent - tries.get()));
        if let Some(found) = found {
            return found;
        }
        if self.left.is_spent() || tries.get() == 0 || effort::is_spent() {
            return Found::Unknown;
        }
        // Only rules about the gap of the spawn, and its bounds, are left to try.
        let found = self.choices().iter().find_map(|chosen| self.numbers(chosen, memory, &|_, _| true));
        found.map_or(Found::Unknown, Found::Runs)
    }

    /// Whether the row may run after these values of the cells, as far as intervals tell.
    pub fn may_run(&self, before: &[Values]) -> bool {
        let declared = declared(self.rules.space, self.rules.row);
        self.rules.narrow(declared, before, self.moment).is_some()
    }

    /// Values by solving alone; `None` if they exist and the row does not run with them, or if they are not found.
    fn solved(&self, memory: &Memory, tries: &Cell<usize>) -> Option<Found> {
        let action = self.action();
        let parameters = action.parameters.iter().enumerate();
        let open: Vec<usize> = parameters.filter(|(_, p)| !p.axis).map(|(local, _)| local).collect();
        let given = locals(action, self.rules.row, &[]);
        for share in SHARES {
            // Without a world, rules that ask it hold: they are left to the moment.
            let before = Before { memory, world: None, tries };
            match self.rules.solve(given.clone(), &open, before, &mut Share(share)) {
                Ok(values) if self.runs_in_empty(&values, memory) => return Some(Found::Runs(values)),
                Ok(_) => {}
                Err(unsolved) if unsolved.is_proved => return Some(Found::Never),
                Err(_) => return None,
            }
        }
        None
    }

    pub fn action(&self) -> &ActionDef {
        &self.rules.space.actions[self.rules.row.action]
    }

    /// Looks for numbers, given everything that is chosen from lists.
    fn numbers(&self, chosen: &[Value], memory: &Memory, wish: &Wish<'_>) -> Option<Vec<Value>> {
        let action = self.action();
        let open: Vec<usize> = action.drawn_numbers().collect();
        let before = followed(memory);
        let corners = 0..1_usize << open.len().min(CORNER_BITS);
        let mut boxes = VecDeque::from([self.ranges(chosen, &open)]);
        for _ in 0..BOXES_MAX.min(self.left.boxes.get()) {
            self.left.take_box();
            let Some(narrowed) = self.rules.narrow(boxes.pop_front()?, &before, self.moment) else {
                continue;
            };
            for place in corners.clone().map(Place::Corner).chain([Place::Middle]) {
                let values = self.candidate(chosen, &open, &narrowed, place, memory);
                if let Some(found) = values.filter(|values| self.runs(values, memory, wish)) {
                    return Some(found);
                }
            }
            boxes.extend(halves(&narrowed, &open));
        }
        None
    }

    /// Every choice of the listed values, the first values first; what is a range holds a placeholder.
    fn choices(&self) -> Vec<Vec<Value>> {
        let action = self.action();
        let mut chosen = vec![locals(action, self.rules.row, &[])];
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
            chosen = product(&chosen, &different, |locals, value| locals[local] = value);
        }
        chosen
    }

    /// The values chosen from lists, and the whole ranges of the open numbers.
    fn ranges(&self, chosen: &[Value], open: &[usize]) -> Vec<Values> {
        let mut ranges = points(chosen);
        for local in open {
            if let Domain::Range(low, high) = &self.action().parameters[*local].domain {
                ranges[*local] = Values::Number(Interval::closed(*low, *high));
            }
        }
        ranges
    }

    /// One point of a box, its equalities solved as drawing solves them.
    fn candidate(
        &self,
        chosen: &[Value],
        open: &[usize],
        narrowed: &[Values],
        place: Place,
        memory: &Memory,
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
        let mut nearest = Nearest { wanted: values.clone() };
        self.rules
            .solve(values, open, Before { memory, world: None, tries: &self.left.tries }, &mut nearest)
            .ok()
    }

    /// Whether these values run in an empty world, and fulfil the wish.
    fn runs(&self, values: &[Value], before: &Memory, wish: &Wish<'_>) -> bool {
        self.runs_in_empty(values, before) && wish(values, &self.after(values, before))
    }

    fn after(&self, values: &[Value], before: &Memory) -> Memory {
        self.rules.space.memory_after(self.rules.row.action, values, before, self.rules.road, None)
    }

    /// Whether these values run in an empty world, as far as that can be told.
    fn runs_in_empty(&self, values: &[Value], before: &Memory) -> bool {
        let (space, action) = (self.rules.space, self.action());
        let in_domain =
            |(parameter, value): (&Parameter, &Value)| parameter.axis || parameter.domain.holds(*value);
        if !action.parameters.iter().zip(values).all(in_domain) {
            return false;
        }
        let after = &self.after(values, before);
        let facts = Facts { road: self.rules.road, ..Facts::new(values, after) };
        let number = |expr: &Expr| evaluate(expr, &space.functions, &facts).number();
        let mut spawns = Vec::new();
        for spawn in action.spawns().filter(|spawn| spawn.appears(&space.functions, &facts)) {
            let speed_mps = rounded_into(number(&spawn.speed), SPAWN_SPEED_MPS);
            let body = spawn.body.word(&space.functions, &facts);
            let shape = body.own.map_or_else(|| parameters(body.like), |own| space.bodies[own].shape);
            let more_m = spawn.behind_first_m(shape.length_m, &space.functions, &facts);
            let verb = spawn.verb.word(&space.functions, &facts);
            let distance_m = rounded_into(number(&spawn.distance) + more_m, spawn_distance_m(verb));
            let offset_m =
                spawn.told.expr(Field::Offset).map(|offset| rounded_into(number(offset), OFFSET_M));
            if spawn_out_of_bounds(verb, speed_mps, distance_m).is_some()
                || offset_m.is_some_and(|offset_m| !OFFSET_M.contains(&offset_m))
            {
                return false;
            }
            // The spawn lands where it was asked to, and no gap is unfair. The distance to a trajectory, or to another road
            // user beside which it spawns, is not known here.
            let is_elsewhere = spawn.of.is_some() || spawn.trajectory.is_some() || distance_m < 0.0;
            let spawn_gap_m = if is_elsewhere { f64::INFINITY } else { distance_m };
            spawns.push(SpawnFacts { spawn_gap_m, ..SpawnFacts::default() });
        }
        let world = WorldFacts { spawns, ..WorldFacts::default() };
        let candidate = Candidate { values, before, after, world: Some(&world) };
        // Conditions on the moment or the place are judged by whether one that meets them may come, not by this world.
        self.rules.breaches(candidate).all(|breach| breach.asks_about_moment())
            && (!self.asks_about_moment() || self.is_left_open(candidate))
    }

    fn asks_about_moment(&self) -> bool {
        self.rules.conditions().iter().any(|condition| condition.asks_about_moment())
    }

    /// The states that one step with this row leads to, and whether there can be no other.
    pub fn successors(&self, memory: &Memory) -> (Vec<Memory>, bool) {
        let action = self.action();
        // The effects of every step are left out: a step without this row leads there too.
        let sets: Vec<&SetDef> = action.sets().collect();
        if sets.is_empty() {
            return (Vec::new(), true);
        }
        self.left.take_box();
        let names = |expr: &Expr, local: usize| expr.any(|kind| *kind == ExprKind::Local(local));
        let parts = || sets.iter().flat_map(|set| set.key.iter().chain([&set.value]));
        let open: Vec<usize> = action.drawn_numbers().collect();
        let mut is_complete = !open.iter().any(|local| parts().any(|part| names(part, *local)));
        let mut after = Vec::new();
        let choices = self.choices();
        is_complete &= choices.len() < CHOICES_MAX;
        for chosen in choices.into_iter().take_while(|_| !effort::is_spent()) {
            let before = Before { memory, world: None, tries: &self.left.tries };
            match self.rules.solve(chosen, &open, before, &mut Share(SHARES[0])) {
                Ok(values) => {
                    let led_to = self.after(&values, memory);
                    // An effect without a value is refused.
                    let is_kept = led_to.cells().iter().all(|value| value.is_kept());
                    let candidate =
                        Candidate { values: &values, before: memory, after: &led_to, world: None };
                    let may_come = !self.asks_about_moment() || self.is_left_open(candidate);
                    if !may_come {
                        let ranges = self.ranges(&values, &open);
                        is_complete &= self.rules.narrow(ranges, &followed(memory), self.moment).is_none();
                    } else if is_kept && !after.contains(&led_to) {
                        after.push(led_to);
                    }
                }
                Err(unsolved) => is_complete &= unsolved.is_proved,
            }
        }
        (after, is_complete)
    }

    /// Whether some moment or place, which an empty world does not have, might meet all conditions with these values.
    fn is_left_open(&self, candidate: Candidate<'_>) -> bool {
        let (locals, cells) = (points(candidate.values), followed(candidate.after));
        let known = Known { case: self.moment, ..self.rules.known(&locals, &cells) };
        let newcomers = || newcomers(self.action(), &known, true);
        let conditions = self.rules.conditions();
        !oppose(&conditions, &known, true)
            && may_hold_together(&conditions, &known, &self.rules.space.episode, newcomers)
    }

    /// Memories to try: the initial one first, then every value of the cells that the rules or effects of the
    /// row read. Gives also whether there can be no other.
    pub fn memories(&self) -> (Vec<Memory>, bool) {
        let space = self.rules.space;
        let mut begun = space.initial_memory(0);
        // A cell that is drawn has the first value of its type.
        for cell in space.open_cells() {
            begun.cells[cell] = match space.state_of(cell).ty {
                Type::Enum(of) => Value::Variant(of, 0),
                Type::Bool | Type::Int | Type::Quantity(_) => Value::Bool(false),
            };
        }
        let (mut memories, mut is_complete) = (vec![begun], true);
        for cell in self.read() {
            let state = space.state_of(cell);
            let values = all_values(space, state.ty, memories[0].cells[cell]);
            let room = (MEMORIES_MAX / memories.len()).max(1);
            is_complete &= values.len() <= room;
            is_complete &= !matches!(state.ty, Type::Int | Type::Quantity(_));
            let tried = &values[..values.len().min(room)];
            if tried.len() == 1 {
                continue;
            }
            effort::spend(memories.len() * tried.len() * memories[0].cells.len());
            memories = product(&memories, tried, |memory, value| memory.cells[cell] = value);
        }
        (memories, is_complete)
    }

    /// Whether a rule or an effect of the row depends on what any state was before.
    pub fn reads_any(&self) -> bool {
        !self.read().is_empty()
    }

    /// The cells whose values before the step decide a rule or an effect of the row.
    fn read(&self) -> BTreeSet<usize> {
        let states = &self.rules.space.states;
        let (mut found, mut moved) = (BTreeSet::new(), Vec::new());
        let mut named = |expr: &Expr| found.extend(cells_read(expr, states));
        for set in self.rules.space.sets(Some(self.rules.row.action)).take_while(|_| !effort::is_spent()) {
            set.key.iter().chain([&set.value]).for_each(&mut named);
        }
        for spawn in self.action().spawns() {
            let count = spawn.row.as_ref().and_then(|row| row.count.as_ref());
            let offset = spawn.told.expr(Field::Offset);
            [&spawn.speed, &spawn.distance].into_iter().chain(offset).chain(count).for_each(&mut named);
        }
        for (_, demand) in self.rules.demands() {
            match demand {
                Demand::Holds(condition) => named(condition),
                Demand::Moves { cell, .. } => moved.push(cell),
            }
        }
        found.extend(moved);
        found
    }
}

pub(super) fn points(values: &[Value]) -> Vec<Values> {
    values.iter().map(|value| Values::point(*value)).collect()
}

/// The cells of a memory that an episode reaches, each as the short fraction beside it. Computed values are rounded: 0.3 -
/// 0.1 - 0.1 is 0.09999999999999998. A draw that takes 0.1 from that has 0, because it takes the two for equal. A proof
/// that took the number for exact would have less.
fn followed(memory: &Memory) -> Vec<Values> {
    let cell = |value: &Value| match value {
        Value::Number(number) => {
            Values::Number(Rational::from_computed(*number).map_or(Interval::ALL, Interval::point))
        }
        _ => Values::point(*value),
    };
    memory.cells().iter().map(cell).collect()
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

/// All values of a finite type, `first` before the others.
fn all_values(space: &Space, ty: Type, first: Value) -> Vec<Value> {
    let mut values = vec![first];
    match ty {
        Type::Enum(of) => values.extend((0..space.enums[of.0].variants.len()).map(|v| Value::Variant(of, v))),
        Type::Bool => values.extend([false, true].map(Value::Bool)),
        Type::Int | Type::Quantity(_) => {}
    }
    distinct(values)
}
