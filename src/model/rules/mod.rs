//! How a rule is enforced. Everything that draws, replays, searches or checks asks this module.
//!
//! The checker compiles a rule once for every action that it binds, and a row of the action table knows
//! the rules that bind it ([`Row::rules`]). From there on:
//!
//! 1. [`RulesInForce`] says which rules apply: those that are not optional, changed by `--with` and
//!    `--without`.
//! 2. [`RowRules`] is one row on one road under the rules in force. Each of its rules makes a [`Demand`]
//!    on the row's action: a condition that must hold, or the moves that a state may make.
//! 3. [`RowRules::solve`] chooses values from exactly what the clauses of a row leave: its rules and its `where`s,
//!    each with the parameters that decide it ([`Clause`]). What it cannot solve it says.
//! 4. `bound` takes from the conditions what they say about single numbers, for example `speed <= road.limit`:
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

pub(crate) use bound::{Bound, allowed, bounds};
pub(crate) use clause::{Clause, Source, clauses};
pub use in_force::{RulesInForce, UnknownRule};
pub(crate) use judge::{Breach, Candidate};
pub(crate) use room::Room;
pub(crate) use solve::{Before, Choose, Nearest, TRIES_MAX, Unsolved};

pub use start::NoStart;
pub(crate) use start::cells_read;

use bound::locals;

use crate::model::expr::Expr;
use crate::model::row::Row;
use crate::model::space::{RoadFacts, RuleBody, Space};

/// One row on one road, under the rules in force.
#[derive(Clone, Copy)]
pub(crate) struct RowRules<'a> {
    pub space: &'a Space,
    pub row: &'a Row,
    /// `None`: the road is not known.
    pub road: Option<&'a RoadFacts>,
    pub in_force: &'a RulesInForce,
}

/// What a rule demands of an action.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Demand<'a> {
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
        self.demand(action).is_some() || self.during(action).is_some()
    }

    /// What must hold when a road user of the action changes lanes.
    pub(crate) fn during(&self, action: usize) -> Option<&Expr> {
        let RuleBody::During(bindings) = self else { return None };
        bindings.iter().find(|binding| binding.action == action).map(|binding| &binding.condition)
    }

    /// What the rule demands of an action when it is chosen; `None` if it demands nothing then.
    pub(crate) fn demand(&self, action: usize) -> Option<Demand<'_>> {
        match self {
            RuleBody::Holds(bindings) => {
                let binding = bindings.iter().find(|binding| binding.action == action)?;
                Some(Demand::Holds(&binding.condition))
            }
            RuleBody::During(_) => None,
            RuleBody::Moves { state, cell, allowed, actions } => {
                actions.contains(&action).then_some(Demand::Moves { state: *state, cell: *cell, allowed })
            }
        }
    }
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

    /// The bounds on the numbers of the row: those of `where`s, and those of rules in force.
    pub fn bounds(self) -> impl Iterator<Item = &'a Bound> {
        let is_in_force = move |bound: &&Bound| bound.rule.is_none_or(|rule| self.in_force.contains(rule));
        self.space.bounds[self.row.action].iter().filter(is_in_force)
    }
}
