//! A state with a transition rule as a graph: which values an episode can come to, and how.

use std::collections::VecDeque;

use crate::model::{Reach, Row, RuleBody, RuleDef, RulesInForce, Space, Type, Value, code, effort};
use crate::prove::enclose::{Values, bits};
use crate::prove::reach::{declared, numbers};
use crate::syntax::{Diagnostic, listed};

/// The most starts of an episode that are looked at.
const STARTS_MAX: usize = 1_000;

/// The graph of one rule.
struct Graph<'a> {
    allowed: &'a [Vec<bool>],
    /// Rows that set the state, and the values that each may set, as bits.
    rows: Vec<(&'a Row, u128)>,
    /// Values that a step without an action may set, as bits.
    waits: u128,
    /// Values that an episode may begin with, as bits.
    begin: u128,
}

/// One remark for values that no move leaves; one warning each for values that no episode reaches, and for rows that
/// no move enables.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let begins = begins(space);
    for (index, rule) in space.rules.iter().enumerate().take_while(|_| !effort::is_spent()) {
        let Some(graph) = graph(space, index, &begins) else { continue };
        let RuleBody::Moves { state, cell, .. } = &rule.body else { continue };
        let moved = space.cell_name(*cell);
        let state = &space.states[*state];
        let Type::Enum(of) = state.ty else { continue };
        let variants = &space.enums[of.0].variants;
        let name = |value: usize| variants[value].as_str();
        let reached = graph.reached();
        let all = u128::MAX >> (128 - variants.len());
        // The only move allowed from such a value is back to itself.
        let moves = |from: usize| graph.allowed[from].iter().enumerate();
        let is_stuck = |from: &usize| moves(*from).all(|(to, allowed)| *allowed == (to == *from));
        let stuck: Vec<&str> = bits(reached).filter(is_stuck).map(name).collect();
        if !stuck.is_empty() && variants.len() > 1 && graph.rows.len() > 1 {
            let message = format!("`{moved}` can never leave {}", listed(&stuck));
            // The rule says so itself, so it may well be meant.
            let remark = Diagnostic::remark(code::STUCK, message)
                .at(rule.span, "allows no move from there to another value")
                .help(format!("add `{} -> …` with another value, if an episode should go on", stuck[0]));
            diagnostics.push(remark);
        }
        // A value that no move leads to was reported with the rule itself.
        let led_to =
            |value: &usize| (0..variants.len()).any(|from| from != *value && graph.allowed[from][*value]);
        let unreached: Vec<&str> = bits(all & !reached).filter(led_to).map(name).collect();
        if !unreached.is_empty() {
            let begin: Vec<&str> = bits(graph.begin).map(name).collect();
            let message = format!("`{moved}` never comes to {}", listed(&unreached));
            let warning = Diagnostic::warning(code::UNREACHABLE, message)
                .at(rule.span, format!("no actions lead there from {}", listed(&begin)))
                .beside(state.span, "begins here");
            diagnostics
                .push(warning.help("begin elsewhere, allow more moves, or add an action that sets it"));
        }
        let never = graph.never_enabled();
        if let Some(first) = never.first() {
            let message = format!("`{}` is never enabled", first.label);
            let warning = Diagnostic::warning(code::NEVER_ENABLED, message)
                .at(space.actions[first.action].span, numbers(&never))
                .beside(rule.span, format!("forbids it wherever `{moved}` can be"));
            diagnostics.push(warning.help("allow the move, or remove the rows with `where`"));
        }
    }
    diagnostics
}

/// The shortest sequence of rows that brings a state from one value to another under a transition rule;
/// empty if there is none, or if both values are the same.
pub(crate) fn shortest_way<'a>(space: &'a Space, rule: &'a RuleDef, from: Value, to: Value) -> Vec<&'a Row> {
    let Some(graph) = graph_of(space, rule) else { return Vec::new() };
    graph.way(from.variant(), to.variant()).into_iter().map(|index| graph.rows[index].0).collect()
}

/// The rows that a transition rule allows from that value. Only rows that always set the same value count.
pub(crate) fn next_rows<'a>(space: &'a Space, rule: &'a RuleDef, from: Value) -> Vec<&'a Row> {
    let Some(graph) = graph_of(space, rule) else { return Vec::new() };
    let allowed =
        |sets: u128| sets.is_power_of_two() && graph.allowed[from.variant()][sets.trailing_zeros() as usize];
    graph.rows.iter().filter(|(_, sets)| allowed(*sets)).map(|(row, _)| *row).collect()
}

/// Whether a transition rule forbids a row wherever the state has one of these values (bits).
pub(crate) fn forbids(space: &Space, rule: &RuleDef, row: &Row, from: u128) -> bool {
    let Some(graph) = graph_of(space, rule) else { return false };
    let sets = graph.rows.iter().find(|(other, _)| other.index == row.index).map_or(0, |(_, sets)| *sets);
    sets != 0 && !bits(from).any(|from| bits(sets).any(|to| graph.allowed[from][to]))
}

/// The graph of a rule that is looked at alone.
fn graph_of<'a>(space: &'a Space, rule: &'a RuleDef) -> Option<Graph<'a>> {
    let index = space.rules.iter().position(|known| known.name == rule.name)?;
    graph(space, index, &begins(space))
}

fn graph<'a>(space: &'a Space, index: usize, begins: &[Option<u128>]) -> Option<Graph<'a>> {
    let RuleBody::Moves { cell, allowed, actions, .. } = &space.rules[index].body else { return None };
    let begin = begins[*cell].unwrap_or(u128::MAX >> (128 - allowed.len()));
    let bound = actions.iter().flat_map(|action| space.rows_of(*action));
    let rows =
        bound.filter(|row| row.rules.binary_search(&index).is_ok()).take_while(|_| !effort::is_spent());
    let unknown = space.cells_unknown();
    let rows = rows.map(|row| {
        let after = space.cells_after(row.action, &declared(space, row), &unknown);
        match after[*cell] {
            Values::Variants(set) => (row, set),
            Values::Truth { .. } | Values::Number(_) => (row, 0),
        }
    });
    let rows = rows.collect();
    let waits = match space.cells_after_wait(&unknown)[*cell] {
        Values::Variants(set) if space.may_set_each_step(*cell) => set,
        Values::Variants(_) | Values::Truth { .. } | Values::Number(_) => 0,
    };
    Some(Graph { allowed, rows, waits, begin })
}

/// For each cell the values with which it may begin on some road, as bits; `None` if there are too many starts to look
/// at.
fn begins(space: &Space) -> Vec<Option<u128>> {
    let mut begins: Vec<Option<u128>> = vec![None; space.states.iter().map(|state| state.cells).sum()];
    // Only transition rules ask for them.
    if !space.rules.iter().any(|rule| matches!(rule.body, RuleBody::Moves { .. })) {
        return begins;
    }
    let in_force = RulesInForce::by_default(space);
    let is_few = space.start_count() <= STARTS_MAX;
    // A fixed cell has one value, however many the others have.
    let count_max = if is_few { STARTS_MAX } else { 1 };
    for road in &space.roads {
        for memory in space.initial_memories(road, &in_force, count_max).0 {
            effort::spend(begins.len());
            for (begin, value) in begins.iter_mut().zip(memory.cells()) {
                *begin = Some(begin.unwrap_or(0) | 1 << value.variant());
            }
        }
    }
    if !is_few {
        space.open_cells().into_iter().for_each(|cell| begins[cell] = None);
    }
    begins
}

/// The rows, by number, that a transition rule allows in no state which it lets an episode come to.
pub(super) fn never_enabled(space: &Space) -> Vec<usize> {
    let begins = begins(space);
    let rules = (0..space.rules.len()).take_while(|_| !effort::is_spent());
    let graphs = rules.filter_map(|rule| graph(space, rule, &begins));
    graphs.flat_map(|graph| graph.never_enabled()).map(|row| row.index).collect()
}

impl<'a> Graph<'a> {
    /// The rows that are allowed from no value that an episode can reach.
    fn never_enabled(&self) -> Vec<&'a Row> {
        let reached = self.reached();
        self.rows
            .iter()
            .filter(|(row, _)| row.roads.iter().any(|reach| matches!(reach, Reach::Open(_))))
            .filter(|(_, sets)| !bits(reached).any(|from| bits(*sets).any(|to| self.allowed[from][to])))
            .map(|(row, _)| *row)
            .collect()
    }

    /// Every value that an episode can reach.
    fn reached(&self) -> u128 {
        let mut reached = self.begin;
        loop {
            let sets = self.rows.iter().fold(self.waits, |all, (_, sets)| all | sets);
            effort::spend(self.rows.len() + (reached.count_ones() * sets.count_ones()) as usize);
            let next = bits(reached)
                .flat_map(|from| bits(sets).filter(move |to| self.allowed[from][*to]))
                .fold(reached, |all, to| all | 1 << to);
            if next == reached {
                return reached;
            }
            reached = next;
        }
    }

    /// The shortest way, found breadth first, over rows that always set the same value.
    fn way(&self, from: usize, to: usize) -> Vec<usize> {
        let mut came_by: Vec<Option<(usize, usize)>> = vec![None; self.allowed.len()];
        let mut open = VecDeque::from([from]);
        while let Some(value) = open.pop_front() {
            if value == to {
                break;
            }
            for (index, (_, sets)) in self.rows.iter().enumerate() {
                let next = sets.trailing_zeros() as usize;
                if sets.is_power_of_two()
                    && self.allowed[value][next]
                    && next != from
                    && came_by[next].is_none()
                {
                    came_by[next] = Some((value, index));
                    open.push_back(next);
                }
            }
        }
        let mut way = Vec::new();
        let mut at = to;
        while let Some((before, row)) = came_by[at].filter(|_| at != from) {
            way.push(row);
            at = before;
        }
        way.reverse();
        way
    }
}
