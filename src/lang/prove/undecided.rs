//! Rows that were not found to run: those of which nothing is known, and those that would run only in states to
//! which no episode comes.

use std::collections::BTreeSet;

use crate::model::expr::{Arithmetic, Expr, ExprKind};
use crate::model::rules::RowRules;
use crate::model::vocabulary::Known;
use crate::model::{ActionDef, Row, RuleBody, RuleDef, RulesInForce, Space, code, effort};
use crate::prove::clock::never_enabled;
use crate::prove::lists::rule_names;
use crate::prove::reach::numbers;
use crate::prove::realise::{Realisable, Realised, is_about_time};
use crate::prove::spawn_bounds;
use crate::prove::witness::{Found, Left, Search};
use crate::syntax::{Diagnostic, listed};

/// The most boxes of ranges that are looked at to find the rules which leave a row undecided.
const BOXES_MAX: usize = 2_000;

/// One error for the rules that leave rows undecided, and one warning for each action with rows that no episode
/// enables.
pub(super) fn report(space: &Space, realisable: &Realisable) -> Vec<Diagnostic> {
    let mut diagnostics = report_unknown(space, realisable);
    diagnostics.extend(report_optional(space, realisable));
    let told: BTreeSet<usize> = never_enabled(space).into_iter().collect();
    let in_force = RulesInForce::by_default(space);
    // Where no episode begins, no state is reached.
    if space.roads.iter().any(|road| space.memory_at_start(road, &in_force, 0).is_err()) {
        return diagnostics;
    }
    for (action, definition) in space.actions.iter().enumerate() {
        let is_unreached = |row: &&Row| {
            let found = &realisable[row.index];
            found.contains(&Realised::Unreached)
                && found.iter().all(|found| matches!(found, Realised::Unreached | Realised::Never))
                && !told.contains(&row.index)
        };
        let unreached: Vec<&Row> = space.rows_of(action).iter().filter(is_unreached).collect();
        let Some(first) = unreached.first() else { continue };
        let message = format!("`{}` is never enabled", first.label);
        let warning =
            Diagnostic::warning(code::NEVER_ENABLED, message).at(definition.span, numbers(&unreached));
        let rules = RowRules { space, row: first, road: None, in_force: &in_force };
        let (only, help) = match is_about_time(rules) {
            true => (
                "at times, or in states, with which no step begins",
                "let the rule hold when a step begins, or add an action that leads to such a state in time",
            ),
            false => (
                "in states to which no episode comes",
                "begin in such a state, or add an action that leads to one",
            ),
        };
        let obeyed: Vec<usize> = in_force.on_row(first).collect();
        let note = format!("it would obey {} only {only}", rule_names(space, &obeyed));
        diagnostics.push(warning.note(note).help(help));
    }
    diagnostics
}

/// One warning for each optional rule with which it is not known of some rows whether they run.
fn report_optional(space: &Space, realisable: &Realisable) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for (rule, definition) in space.rules.iter().enumerate().filter(|(_, rule)| rule.optional) {
        effort::spend(space.rows.len());
        if effort::is_spent() {
            break;
        }
        let (in_force, left) = (RulesInForce::by_default(space).with(rule), Left::new(BOXES_MAX));
        let is_unknown = |row: &&Row| {
            let mut roads = space.roads.iter().zip(&realisable[row.index]);
            row.rules.binary_search(&rule).is_ok()
                && roads.any(|(road, found)| {
                    *found == Realised::Runs
                        && is_unknown(
                            RowRules { space, row, road: Some(&road.facts), in_force: &in_force },
                            &left,
                        )
                })
        };
        let rows: Vec<&Row> = space.rows.iter().filter(is_unknown).collect();
        let Some(first) = rows.first() else { continue };
        let message = format!(
            "with optional rule `{}`: whether {} can run is not known",
            definition.name,
            numbers(&rows)
        );
        let warning = Diagnostic::warning(code::UNDECIDED, message)
            .at(definition.span, why(&[definition]))
            .beside(space.actions[first.action].span, numbers(&rows));
        diagnostics.push(warning.note("no values were found, and no proof that there are none"));
    }
    diagnostics
}

/// Whether neither values nor a proof that there are none were found for a row after any memory.
fn is_unknown(rules: RowRules<'_>, left: &Left) -> bool {
    let search = Search { rules, left, moment: None };
    search.memories().0.iter().all(|memory| search.at(memory) == Found::Unknown)
}

/// The rows of an action of which it is not known whether they run, with the roads on which that is so.
struct Unknown<'a> {
    action: &'a ActionDef,
    rows: Vec<&'a Row>,
    roads: Vec<&'a str>,
    /// The rules without which they would run, or be known not to.
    rules: Vec<usize>,
}

/// One error for each set of rules that leaves rows undecided, whichever actions they belong to.
fn report_unknown(space: &Space, realisable: &Realisable) -> Vec<Diagnostic> {
    let in_force = RulesInForce::by_default(space);
    let mut together: Vec<Vec<Unknown<'_>>> = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let mut of_action: Vec<Unknown<'_>> = Vec::new();
        for (number, road) in space.roads.iter().enumerate() {
            let is_undecided = |row: &&Row| realisable[row.index][number] == Realised::Unknown;
            let rows: Vec<&Row> = space.rows_of(index).iter().filter(is_undecided).collect();
            match of_action.iter_mut().find(|known| known.rows == rows) {
                _ if rows.is_empty() => {}
                Some(known) => known.roads.push(&road.name),
                None => {
                    // Without any one of the other rules the row is undecided still.
                    let (row, left) = (rows[0], Left::new(BOXES_MAX));
                    let rules = RowRules { space, row, road: Some(&road.facts), in_force: &in_force };
                    let rules = rules.conflict(&|fewer| is_unknown(fewer, &left));
                    of_action.push(Unknown { action, rows, roads: vec![&road.name], rules });
                }
            }
        }
        // No search finds a place for a newcomer that is faster or farther away than any: that is told elsewhere.
        if !of_action.is_empty() && spawn_bounds::is_out(space, index) {
            continue;
        }
        for one in of_action {
            let alike = |many: &&mut Vec<Unknown<'_>>| {
                !one.rules.is_empty() && many[0].rules == one.rules && many[0].roads == one.roads
            };
            match together.iter_mut().find(alike) {
                Some(many) => many.push(one),
                None => together.push(vec![one]),
            }
        }
    }
    together.iter().map(|many| error(space, many)).collect()
}

fn error(space: &Space, many: &[Unknown<'_>]) -> Diagnostic {
    let first = &many[0];
    let actions: Vec<&str> = many.iter().map(|one| one.action.name.as_str()).collect();
    let message = format!("whether {} can run on {} is not known", listed(&actions), listed(&first.roads));
    let error = Diagnostic::error(code::UNDECIDED, message).at(first.action.span, numbers(&first.rows));
    let others = many[1..].iter();
    let error = others.fold(error, |error, one| error.beside(one.action.span, numbers(&one.rows)));
    let rules: Vec<&RuleDef> = first.rules.iter().map(|rule| &space.rules[*rule]).collect();
    let why = why(&rules);
    let error = rules.iter().fold(error, |error, rule| error.beside(rule.span, why));
    let obeyed = match rule_names(space, &first.rules).as_str() {
        "" => String::new(),
        names => format!(" that obey {names}"),
    };
    let error = error.note(format!("no values were found{obeyed}, and no proof that there are none"));
    error.help(match () {
        () if ask(&rules, Known::Spawn) => {
            "a newcomer is taken to appear as far away and as fast as its spawn asks: let the rule allow that"
        }
        () if are_of_states(&rules) => {
            "a proof follows the first few hundred states: let such a one be among them, or begin in one"
        }
        () => "say it by sums, products and `match`, of at most six drawn numbers and with low powers",
    })
}

/// The reason why rules leave rows undecided.
fn why(rules: &[&RuleDef]) -> &'static str {
    match () {
        () if ask(rules, Known::Spawn) => "not found to hold for a newcomer",
        () if ask(rules, Known::World) => "not found to hold at a moment",
        () if are_of_states(rules) => "not met in the states that were followed",
        () if have_powers(rules) => "too complicated to be solved",
        () => "not solved for so many numbers",
    }
}

/// Whether the rules are about states alone, and nothing that is drawn decides them.
fn are_of_states(rules: &[&RuleDef]) -> bool {
    let is_state = |kind: &ExprKind| matches!(kind, ExprKind::Cell(_) | ExprKind::CellAt(..));
    let is_drawn = |kind: &ExprKind| kind.local().is_some();
    !rules.is_empty() && rules.iter().all(|rule| has(rule, is_state) && !has(rule, is_drawn))
}

/// Whether a rule has more than sums of numbers, each times a constant.
fn have_powers(rules: &[&RuleDef]) -> bool {
    let is_fixed = |expr: &Expr| matches!(expr.kind, ExprKind::Number(_));
    let is_power = |kind: &ExprKind| match kind {
        ExprKind::Arithmetic(Arithmetic::Multiply, left, right) => !is_fixed(left) && !is_fixed(right),
        ExprKind::Arithmetic(Arithmetic::Divide, _, by) => !is_fixed(by),
        ExprKind::Call(..) => true,
        _ => false,
    };
    rules.iter().any(|rule| has(rule, is_power))
}

/// Whether a rule asks for a fact that is known from then on.
fn ask(rules: &[&RuleDef], from: Known) -> bool {
    let asks = |kind: &ExprKind| matches!(kind, ExprKind::Fact(fact) if fact.known() == from);
    rules.iter().any(|rule| has(rule, asks))
}

/// Whether a part of the condition that a rule demands passes the test, for some action.
fn has(rule: &RuleDef, test: impl Fn(&ExprKind) -> bool) -> bool {
    let RuleBody::Holds(bindings) = &rule.body else { return false };
    bindings.iter().any(|binding| binding.condition.any(&test))
}
