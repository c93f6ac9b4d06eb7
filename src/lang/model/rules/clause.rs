//! The clauses that a row's values must satisfy: each `where`, and each rule that binds the action, with the parameters
//! that decide it.

use std::collections::BTreeSet;

use crate::model::effort;
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{Demand, locals, rules_by_action, state_at};
use crate::model::space::{ActionDef, SetDef, Space, StateDef};

/// One `where` or one rule of an action.
#[derive(Debug, Clone, PartialEq)]
pub struct Clause {
    pub source: Source,
    /// The parameters that decide it: those that it names, and those that decide the states which it reads,
    /// because it reads them as they are after the action.
    needs: Vec<usize>,
    /// Whether it depends on what the step does to the memory.
    pub reads_effects: bool,
    /// Whether it asks about the moment in the world.
    pub asks_the_world: bool,
    /// The names of road users that it asks about, by index in `Space::bearers`.
    pub bearers: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The `where` of the parameter with that index.
    Where(usize),
    /// The rule with that index.
    Rule(usize),
}

impl Clause {
    fn new(
        source: Source,
        condition: Option<&Expr>,
        needs: Vec<usize>,
        reads_effects: bool,
        count: usize,
    ) -> Clause {
        let asks_the_world = condition.is_some_and(Expr::asks_the_world);
        let bearers = condition.map(|condition| condition.bearers(count)).unwrap_or_default();
        Clause { source, needs, reads_effects, asks_the_world, bearers }
    }

    pub fn needs(&self, local: usize) -> bool {
        self.needs.contains(&local)
    }

    pub fn needs_any(&self, locals: &[usize]) -> bool {
        locals.iter().any(|local| self.needs(*local))
    }

    /// The rule; `None` for a `where`.
    pub fn rule(&self) -> Option<usize> {
        match self.source {
            Source::Where(_) => None,
            Source::Rule(rule) => Some(rule),
        }
    }
}

/// By action: its `where`s, then the rules that bind it, in the order of their declarations.
pub(crate) fn clauses(space: &Space) -> Vec<Vec<Clause>> {
    let Space { actions, rules, states, bearers, .. } = space;
    let binding = rules_by_action(rules, actions.len());
    let of_action = |(index, action): (usize, &ActionDef)| {
        let sets: Vec<&SetDef> = space.sets(Some(index)).collect();
        let mut found = Vec::new();
        for (parameter, definition) in action.parameters.iter().enumerate() {
            if let Some(condition) = &definition.condition {
                let (source, mut needs) = (Source::Where(parameter), locals(condition));
                let read = states_read(condition, states);
                let reads_effects = add_effects(&sets, states, read, &mut needs);
                found.push(Clause::new(source, Some(condition), needs, reads_effects, bearers.len()));
            }
        }
        for &rule in &binding[index] {
            effort::spend(sets.len());
            if effort::is_spent() {
                break;
            }
            let demand = rules[rule].body.demand(index);
            let (mut needs, read) = match demand {
                Some(Demand::Holds(condition)) => (locals(condition), states_read(condition, states)),
                Some(Demand::Moves { state, .. }) => (Vec::new(), vec![state]),
                None => continue,
            };
            let reads_effects = add_effects(&sets, states, read, &mut needs);
            let condition = demand.and_then(Demand::condition);
            found.push(Clause::new(Source::Rule(rule), condition, needs, reads_effects, bearers.len()));
        }
        found
    };
    actions.iter().enumerate().map(of_action).collect()
}

/// Adds the parameters that decide these states after the step; whether the step sets any of them.
fn add_effects(sets: &[&SetDef], states: &[StateDef], read: Vec<usize>, needs: &mut Vec<usize>) -> bool {
    let mut is_set = false;
    let mut read: BTreeSet<usize> = read.into_iter().collect();
    // Backwards, because an effect reads what the effects before it have set.
    for SetDef { state, key, value, .. } in sets.iter().rev() {
        if !read.contains(state) {
            continue;
        }
        is_set = true;
        for part in key.iter().chain([value]) {
            needs.extend(locals(part));
            needs.sort_unstable();
            needs.dedup();
            read.extend(states_read(part, states));
        }
    }
    is_set
}

/// The states that an expression names, by index.
pub(crate) fn states_read(expr: &Expr, states: &[StateDef]) -> Vec<usize> {
    expr.filter_map(|kind| match kind {
        ExprKind::Cell(cell) | ExprKind::CellAt(cell, _) => Some(state_at(*cell, states)),
        _ => None,
    })
}
