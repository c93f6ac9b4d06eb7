//! How the memory begins and how actions change it.

use std::collections::BTreeSet;

use crate::model::effort;
use crate::model::eval::evaluate;
use crate::model::expr::{Expr, ExprKind};
use crate::model::facts::RoadFacts;
use crate::model::facts::{Facts, WorldFacts};
use crate::model::rules::{Combinations, RulesInForce, cells_read};
use crate::model::space::{Initial, Road, RuleBody, RuleDef, SetDef, Space, StateDef, StateMeaning};
use crate::model::value::{Memory, Type, Value};
use crate::model::vocabulary::{Level, TimeOfDay};
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

impl Space {
    /// The states as they are declared; those that begin as `any` are drawn from [`Stream::Reset`], whatever the rules
    /// say. [`Space::memory_at_start`] also asks the rules.
    pub fn initial_memory(&self, seed: u64) -> Memory {
        let mut rng = rng::stream(seed, Stream::Reset, 0);
        let mut memory = Memory::default();
        for state in &self.states {
            for initial in &state.initial {
                let value = match initial {
                    Initial::Any => self.draw(state.ty, &mut rng),
                    Initial::Value(expr) => {
                        evaluate(expr, &self.functions, &Facts::new(&[], &Memory::default()))
                    }
                };
                memory.cells.push(value);
            }
        }
        memory
    }

    /// The memories with which an episode may begin on a road, at most `count_max`, and whether these are all.
    pub(crate) fn initial_memories(
        &self,
        road: &Road,
        rules: &RulesInForce,
        count_max: usize,
    ) -> (Vec<Memory>, bool) {
        let begun = self.initial_memory(0);
        // The last cell varies fastest. None is made beyond `count_max`.
        let starts = Combinations::of(self, &begun, self.open_cells().into_iter().rev());
        let all = self.start_count();
        let are_all = all <= count_max;
        let mut memories: Vec<Memory> = (0..all.min(count_max)).map(|number| starts.get(number).1).collect();
        memories.retain(|memory| self.broken_start(memory, &road.facts, rules).is_none());
        if memories.is_empty() {
            memories.extend(self.memory_at_start(road, rules, 0));
        }
        (memories, are_all)
    }

    /// The number of memories with which an episode may begin, before any rule; at most `usize::MAX`.
    pub(crate) fn start_count(&self) -> usize {
        let open = self.open_cells();
        effort::spend(open.len());
        let counts = open.into_iter().map(|cell| self.drawn_values(self.state_of(cell).ty).len());
        counts.fold(1, usize::saturating_mul)
    }

    /// A state by name.
    pub fn state(&self, name: &str) -> Option<&StateDef> {
        self.states.iter().find(|state| state.name == name)
    }

    /// The weather in the memory: time of day, and levels of rain, fog and wetness. Without such a state it is noon with a
    /// clear sky.
    pub fn weather(&self, memory: &Memory) -> (TimeOfDay, [Level; 3]) {
        let (mut time, mut sky) = (TimeOfDay::Noon, [Level::None; 3]);
        for state in &self.states {
            let cells = &memory.cells[state.first_cell..][..state.cells];
            match &state.meaning {
                StateMeaning::Private => {}
                StateMeaning::Time(words) => time = words[cells[0].variant()],
                StateMeaning::Sky(phenomena, levels) => {
                    for (phenomenon, cell) in phenomena.iter().zip(cells) {
                        sky[*phenomenon as usize] = levels[cell.variant()];
                    }
                }
            }
        }
        (time, sky)
    }

    /// The cells for weather and time of day with their plainest values: noon, and the level `None`. Cells
    /// whose enum has no such word are left out.
    pub fn plain_weather(&self) -> Vec<(usize, Value)> {
        let mut plain = Vec::new();
        for state in &self.states {
            let variant = match &state.meaning {
                StateMeaning::Private => None,
                StateMeaning::Time(words) => words.iter().position(|word| *word == TimeOfDay::Noon),
                StateMeaning::Sky(_, levels) => levels.iter().position(|level| *level == Level::None),
            };
            if let (Some(variant), Type::Enum(of)) = (variant, state.ty) {
                let cells = state.first_cell..state.first_cell + state.cells;
                plain.extend(cells.map(|cell| (cell, Value::Variant(of, variant))));
            }
        }
        plain
    }

    /// The memory after a step with this action and these parameter values, which begins at the moment of `world`. Where
    /// there is none, what asks about it does not happen.
    pub fn memory_after(
        &self,
        action: usize,
        locals: &[Value],
        before: &Memory,
        road: Option<&RoadFacts>,
        world: Option<&WorldFacts>,
    ) -> Memory {
        effort::spend(before.cells.len());
        let mut after = before.clone();
        self.sets(Some(action)).for_each(|set| self.change(&mut after, set, locals, road, world));
        after
    }

    /// The memory after a step without an action. The effects of every step do not happen if they would break a rule in
    /// force that stands for all states or orders their changes, or give a state no value. `step` is the number of the
    /// step, `world` the moment at which it begins. Without `world`, effects that ask about it do not happen.
    pub fn memory_after_wait(
        &self,
        before: &Memory,
        step: u64,
        road: Option<&RoadFacts>,
        world: Option<&WorldFacts>,
        rules: &RulesInForce,
    ) -> Memory {
        if self.each_step.is_empty() {
            return before.clone();
        }
        effort::spend(before.cells.len());
        let mut after = before.clone();
        self.sets(None).for_each(|set| self.change(&mut after, set, &[], road, world));
        if self.may_wait(before, &after, step, road, rules) { after } else { before.clone() }
    }

    /// Whether a step without an action may change the memory so, under the rules in force.
    pub(crate) fn may_wait(
        &self,
        before: &Memory,
        after: &Memory,
        step: u64,
        road: Option<&RoadFacts>,
        rules: &RulesInForce,
    ) -> bool {
        let is_broken = |rule: usize| {
            let RuleBody::Moves { cell, allowed, .. } = &self.rules[rule].body else {
                return !self.stands(rule, after, road, step);
            };
            let [from, to] = [before, after].map(|memory| memory.cells[*cell].variant());
            self.may_set_each_step(*cell) && !allowed[from][to]
        };
        let is_kept = after.cells.iter().all(|value| value.is_kept());
        is_kept && !rules.all().any(is_broken)
    }

    /// Whether what every step does asks about its moment.
    pub fn each_step_asks_the_world(&self) -> bool {
        self.each_step.iter().any(SetDef::asks_the_world)
    }

    /// Whether a rule, what every step does, or the odds of an action ask how long ago an action happened.
    pub fn asks_when_actions_happened(&self) -> bool {
        let asks = |expr: &Expr| expr.any(|kind| matches!(kind, ExprKind::Since(..)));
        let rule_asks = |rule: &RuleDef| match &rule.body {
            RuleBody::Holds(bindings) => bindings.iter().any(|binding| asks(&binding.condition)),
            RuleBody::During(_) | RuleBody::Phases { .. } | RuleBody::Moves { .. } => false,
        };
        self.rules.iter().any(rule_asks)
            || self.each_step.iter().flat_map(SetDef::parts).any(asks)
            || self.actions.iter().any(|action| action.odds.as_ref().is_some_and(asks))
    }

    /// The named road users about which what every step does asks.
    pub fn bearers_of_each_step(&self) -> impl Iterator<Item = usize> {
        self.each_step.iter().flat_map(SetDef::parts).flat_map(|part| part.bearers(self.bearers.len()))
    }

    /// The cells whose value depends on the moment at which a step begins. They are all cells that every step sets, if a
    /// part of its effects asks about the moment, and the cells that are set from them.
    pub(crate) fn cells_of_the_moment(&self) -> BTreeSet<usize> {
        let mut found: BTreeSet<usize> = BTreeSet::new();
        if !self.each_step_asks_the_world() {
            return found;
        }
        let count: usize = self.states.iter().map(|state| state.cells).sum();
        // The effects of every step happen as a whole or not at all, so the moment decides all of them.
        let of_each_step = |cell: &usize| self.each_step.iter().any(|set| self.sets_cell(set, *cell));
        found.extend((0..count).filter(of_each_step));
        let all: Vec<&SetDef> =
            self.actions.iter().flat_map(|action| action.sets()).chain(&self.each_step).collect();
        loop {
            let known = found.len();
            for set in &all {
                effort::spend(count);
                let reads =
                    |part: &Expr| cells_read(part, &self.states).iter().any(|cell| found.contains(cell));
                if set.parts().any(reads) {
                    found.extend((0..count).filter(|cell| self.sets_cell(set, *cell)));
                }
            }
            if found.len() == known || effort::is_spent() {
                return found;
            }
        }
    }

    /// Whether the effects of every step may set a cell.
    pub(crate) fn may_set_each_step(&self, cell: usize) -> bool {
        effort::spend(self.each_step.len());
        self.sets(None).any(|set| self.sets_cell(set, cell))
    }

    /// Whether an effect sets a cell, as far as its key is written out.
    pub(crate) fn sets_cell(&self, set: &SetDef, cell: usize) -> bool {
        let state = &self.states[set.state];
        let position = cell.checked_sub(state.first_cell).filter(|position| *position < state.cells);
        position.is_some_and(|position| match set.key.as_ref().map(|key| &key.kind) {
            Some(ExprKind::Variant(_, key)) => *key == position,
            _ => true,
        })
    }

    fn change(
        &self,
        memory: &mut Memory,
        set: &SetDef,
        locals: &[Value],
        road: Option<&RoadFacts>,
        world: Option<&WorldFacts>,
    ) {
        if world.is_none() && set.asks_the_world() {
            return;
        }
        let facts = Facts { road, world, ..Facts::new(locals, memory) };
        let value = evaluate(&set.value, &self.functions, &facts);
        let key = set.key.as_ref().map(|key| evaluate(key, &self.functions, &facts).variant());
        let state = &self.states[set.state];
        effort::spend(key.map_or(state.cells, |_| 1));
        match key {
            Some(key) => memory.cells[state.first_cell + key] = value,
            None => memory.cells[state.first_cell..][..state.cells].fill(value),
        }
    }

    /// Draws a value of a type. The checker allows `any` states only for finite types.
    fn draw(&self, ty: Type, rng: &mut Rng) -> Value {
        let values = self.drawn_values(ty);
        let mut ticket = rng::below(rng, values.iter().map(|(odds, _)| odds).sum());
        let drawn = values.iter().find(|(odds, _)| match ticket.checked_sub(*odds) {
            Some(rest) => {
                ticket = rest;
                false
            }
            None => true,
        });
        drawn.expect("the ticket is below the sum of the odds").1
    }
}
