//! How a rule is enforced. Everything that draws, replays, searches or checks asks this module.
//!
//! The checker compiles a rule once for every action that it binds, and a row of the action table knows
//! the rules that bind it ([`Row::rules`]). From there on:
//!
//! 1. [`RulesInForce`] says which rules apply: those that are not optional, changed by `--with` and
//!    `--without`.
//! 2. [`RowRules`] is one row on one road under the rules in force. Each of its rules makes a [`Demand`]
//!    on the row's action: a condition that must hold, or the moves that a state may make.
//! 3. [`RowRules::solve`] chooses values from exactly those that the clauses of a row leave: its rules and its `where`s,
//!    each with the parameters that decide it ([`Clause`]). It says which conditions it cannot solve.
//! 4. `bound` takes the limits of single numbers from the conditions, for example `speed <= road.limit`:
//!    for proofs, and for the words of a refusal.
//! 5. [`RowRules::breaches`] has the last word. It takes a complete [`Candidate`] (values, the memory before
//!    and after, what the world says) and returns every rule in force that the candidate breaks.
//!
//! `start` says which rules the states obey from the first moment on.
//!
//! Drawing and replaying (`action`), the search for witnesses (`prove::witness`) and the checker of scenarios
//! judge by `breaches`; they differ only in what the world says, if it is asked. Proofs (`prove::reach`)
//! work on sets of values and cannot call it, but they go over the same demands and bounds.

mod bound;
mod clause;
mod critical;
mod in_force;
mod judge;
mod polynomial;
mod room;
mod solve;
mod start;

pub use bound::Bound;
pub(crate) use bound::{allowed, bounds, locals};
pub use clause::{Clause, Source};
pub(crate) use clause::{clauses, states_read};
pub use in_force::{RulesInForce, UnknownRule};
pub use judge::{Breach, Candidate};
pub use room::Room;
pub use solve::{Before, Choose, Nearest, TRIES_MAX, Unsolved};

pub use start::NoStart;
pub(crate) use start::{Combinations, cells_read, state_at};

use crate::model::effort;
use crate::model::expr::Expr;
use crate::model::facts::RoadFacts;
use crate::model::space::Row;
use crate::model::space::{RuleBinding, RuleBody, RuleDef, Space};

/// One row on one road, under the rules in force.
#[derive(Clone, Copy)]
pub struct RowRules<'a> {
    pub space: &'a Space,
    pub row: &'a Row,
    /// `None`: the road is not known.
    pub road: Option<&'a RoadFacts>,
    pub in_force: &'a RulesInForce,
}

/// The demand of a rule on an action.
#[derive(Debug, Clone, Copy)]
pub enum Demand<'a> {
    /// The condition holds. State in it is the state after the action.
    Holds(&'a Expr),
    /// The cell of that state moves only as `allowed[from][to]` says.
    Moves { state: usize, cell: usize, allowed: &'a [Vec<bool>] },
}

impl<'a> Demand<'a> {
    /// The condition, if it is one.
    pub fn condition(self) -> Option<&'a Expr> {
        match self {
            Demand::Holds(condition) => Some(condition),
            Demand::Moves { .. } => None,
        }
    }
}

impl RuleBody {
    /// Whether the rule binds the action.
    pub fn binds(&self, action: usize) -> bool {
        match self {
            RuleBody::Holds(bindings) | RuleBody::During(bindings) => bound(bindings, action).is_some(),
            RuleBody::Phases { actions, .. } | RuleBody::Moves { actions, .. } => {
                actions.binary_search(&action).is_ok()
            }
        }
    }

    /// The condition that must hold when a road user of the action changes lanes.
    pub(crate) fn during(&self, action: usize) -> Option<&Expr> {
        let RuleBody::During(bindings) = self else { return None };
        bound(bindings, action)
    }

    /// The actions that the rule binds, in the order of their declarations.
    pub fn actions(&self) -> Vec<usize> {
        match self {
            RuleBody::Holds(bindings) | RuleBody::During(bindings) => {
                bindings.iter().map(|binding| binding.action).collect()
            }
            RuleBody::Phases { actions, .. } | RuleBody::Moves { actions, .. } => actions.clone(),
        }
    }

    /// The demand of the rule on an action when it is chosen; `None` if it demands nothing then.
    pub fn demand(&self, action: usize) -> Option<Demand<'_>> {
        match self {
            RuleBody::Holds(bindings) => bound(bindings, action).map(Demand::Holds),
            RuleBody::During(_) | RuleBody::Phases { .. } => None,
            RuleBody::Moves { state, cell, allowed, actions } => {
                let is_bound = actions.binary_search(&action).is_ok();
                is_bound.then_some(Demand::Moves { state: *state, cell: *cell, allowed })
            }
        }
    }
}

/// The condition for an action; bindings are sorted by their actions.
fn bound(bindings: &[RuleBinding], action: usize) -> Option<&Expr> {
    let found = bindings.binary_search_by_key(&action, |binding| binding.action);
    found.ok().map(|index| &bindings[index].condition)
}

/// For each action the rules that bind it, in the order of their declarations.
pub(crate) fn rules_by_action(rules: &[RuleDef], actions: usize) -> Vec<Vec<usize>> {
    let mut found = vec![Vec::new(); actions];
    for (rule, definition) in rules.iter().enumerate() {
        definition.body.actions().into_iter().for_each(|action| found[action].push(rule));
    }
    found
}

impl<'a> RowRules<'a> {
    /// The rules in force that bind the row, by index, and what each demands.
    pub fn demands(self) -> impl Iterator<Item = (usize, Demand<'a>)> {
        let rules = self.in_force.on_row(self.row);
        rules.filter_map(move |rule| Some((rule, self.space.rules[rule].body.demand(self.row.action)?)))
    }

    /// The conditions in force under which road users of the row may change lanes.
    pub fn during(self) -> impl Iterator<Item = &'a Expr> {
        let rules = self.in_force.on_row(self.row);
        rules.filter_map(move |rule| self.space.rules[rule].body.during(self.row.action))
    }

    /// The rules in force on the phases of a manoeuvre that the row gives to a vehicle.
    pub fn on_phases(self, manoeuvre: usize) -> impl Iterator<Item = &'a Expr> {
        let rules = self.in_force.on_row(self.row);
        rules.filter_map(move |rule| match &self.space.rules[rule].body {
            RuleBody::Phases { manoeuvre: of, condition, .. } if *of == manoeuvre => Some(condition),
            _ => None,
        })
    }

    /// The bounds on the numbers of the row: those of `where`s, and those of rules in force.
    pub fn bounds(self) -> impl Iterator<Item = &'a Bound> {
        effort::spend(self.space.bounds[self.row.action].len());
        let is_in_force = move |bound: &&Bound| bound.rule.is_none_or(|rule| self.in_force.contains(rule));
        self.space.bounds[self.row.action].iter().filter(is_in_force)
    }
}
