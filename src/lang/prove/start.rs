//! Rules under which no episode can begin.

use crate::model::{Initial, NoStart, RulesInForce, Space, code, effort};
use crate::prove::lists::distinct;
use crate::syntax::{Diagnostic, listed};

/// One error for each rule that leaves no states to begin with on some roads; a road shows its first one alone. One
/// warning for each optional rule that leaves none beside those by default.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let by_default = RulesInForce::by_default(space);
    let found = without_start(space, &by_default);
    let mut diagnostics: Vec<Diagnostic> =
        found.iter().map(|(no_start, roads)| error(space, no_start, roads)).collect();
    let is_open = |rule: &usize| {
        let rule = &space.rules[*rule];
        found.is_empty() && rule.optional && rule.binds_start()
    };
    for rule in (0..space.rules.len()).filter(is_open).take_while(|_| !effort::is_spent()) {
        let Some((no_start, roads)) = without_start(space, &by_default.with(rule)).pop() else { continue };
        let error = error(space, &no_start, &roads);
        let message = format!("with optional rule `{}`: {}", space.rules[rule].name, error.message);
        let warning = Diagnostic::warning(code::NO_START, message);
        diagnostics.push(Diagnostic { labels: error.labels, help: error.help, ..warning });
    }
    diagnostics
}

/// The rules that leave no states to begin with, and the roads where that is so.
fn without_start<'a>(space: &'a Space, in_force: &RulesInForce) -> Vec<(NoStart, Vec<&'a str>)> {
    let mut found: Vec<(NoStart, Vec<&str>)> = Vec::new();
    for road in &space.roads {
        let Err(no_start) = space.memory_at_start(road, in_force, 0) else { continue };
        match found.iter_mut().find(|(known, _)| known.index == no_start.index) {
            Some((_, roads)) => roads.push(&road.name),
            None => found.push((no_start, vec![&road.name])),
        }
    }
    found
}

fn error(space: &Space, no_start: &NoStart, roads: &[&str]) -> Diagnostic {
    let rule = &space.rules[no_start.index];
    let place = match roads.len() == space.roads.len() {
        true => String::new(),
        false => format!(" on {}", listed(roads)),
    };
    let error = Diagnostic::error(code::NO_START, format!("{}{place}", no_start.words()));
    let error = match no_start.is_too_large {
        true => error.at(rule.span, "the states that it shares with other rules have too many combinations"),
        false => error.at(rule.span, "holds from the start on"),
    };
    // Cells of a map may share what they begin with.
    let begun = distinct(no_start.cells.iter().map(|cell| {
        let state = space.state_of(*cell);
        match &state.initial[*cell - state.first_cell] {
            Initial::Value(expr) => (expr.span, "begins so"),
            Initial::Any => (state.span, "is drawn"),
        }
    }));
    let error = begun.into_iter().fold(error, |error, (span, how)| error.beside(span, how));
    let mut names: Vec<String> = no_start.cells.iter().map(|cell| space.cell_name(*cell)).collect();
    names.dedup();
    let names = match names.len() {
        // A long list hides what to do.
        many @ 7.. => format!("the {many} states that it reads"),
        _ => listed(&names),
    };
    error.help(match no_start.is_too_large {
        true => {
            format!("let {names} begin with fixed values or have fewer; or bind the rule to actions by `on`")
        }
        false => format!(
            "let {names} begin as the rule allows, for example as `any`; or bind the rule to actions by `on`"
        ),
    })
}
