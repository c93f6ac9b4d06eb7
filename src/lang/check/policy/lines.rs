//! Checks the rules of a policy, line by line. The checks are proofs over boxes of states: what they report
//! about a line is true for every state.

use crate::check::names::unknown;
use crate::check::scenario::row;
use crate::check::scenario_value::in_unit;
use crate::model::expr::Comparison;
use crate::model::policy::{Condition, PolicyRule};
use crate::model::{Reach, Row, RulesInForce, Space, StateMeaning, code};
use crate::prove::forbids;
use crate::syntax::ast::{BinaryOp, Expr, ExprKind, Span, UnaryOp};
use crate::syntax::{Diagnostic, ast, listed, nearest};

use crate::check::policy::region::Region;
use crate::model::policy::{PolicyOrigin, VARIABLES, Variable, VariableKind, variable_index};

/// The checked lines of a policy.
///
/// # Errors
/// All mistakes in them.
pub(super) fn rules(
    lines: &[ast::PolicyLine],
    space: &Space,
    origin: &PolicyOrigin,
) -> Result<Vec<PolicyRule>, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    let mut rules = Vec::new();
    let mut above: Vec<(Region, Span)> = Vec::new();
    for line in lines {
        match rule(line, space) {
            Err(errors) => diagnostics.extend(errors),
            Ok(rule) => {
                let region = rule.conditions.iter().fold(Region::all(), |region, one| region.and(one));
                let place = line.condition.as_ref().map_or(line.span, |condition| condition.span);
                if region.is_empty() {
                    diagnostics.push(nowhere(&rule, place));
                } else {
                    diagnostics.extend(shadowed(&region, &above, line.span));
                    let calls = rule.rows.iter().zip(&line.actions);
                    diagnostics
                        .extend(calls.filter_map(|(&row, call)| illegal(space, origin, row, &region, call)));
                    // The box of an inexact line is too large, so it cannot prove that later lines are covered.
                    if rule.conditions.iter().all(Region::is_exact) {
                        above.push((region, line.span));
                    }
                }
                rules.push(rule);
            }
        }
    }
    if let Some(last) = lines.last().filter(|last| last.condition.is_some()) {
        let error = Diagnostic::error(code::POLICY_FORM, "the rules do not say what to do otherwise");
        diagnostics.push(error.at(last.span, "the last line has a condition").help("end with `_ => …`"));
    }
    if diagnostics.is_empty() { Ok(rules) } else { Err(diagnostics) }
}

fn rule(line: &ast::PolicyLine, space: &Space) -> Result<PolicyRule, Vec<Diagnostic>> {
    let mut conditions = Vec::new();
    let mut errors = Vec::new();
    if let Some(condition) = &line.condition {
        for part in parts(condition) {
            match self::condition(part) {
                Ok(condition) => conditions.push(condition),
                Err(error) => errors.push(error),
            }
        }
    }
    let mut rows: Vec<usize> = Vec::new();
    for call in &line.actions {
        match row(space, call) {
            Ok(row) if rows.contains(&row.index) => {
                let message = format!("`{}` stands twice in a line", row.label);
                let error = Diagnostic::error(code::POLICY_SHADOWED, message);
                errors.push(error.at(call.span, "never acts here").help("remove it"));
            }
            Ok(row) => rows.push(row.index),
            Err(found) => errors.extend(found),
        }
    }
    if errors.is_empty() { Ok(PolicyRule { conditions, rows }) } else { Err(errors) }
}

/// The comparisons that are joined by `and`.
fn parts(condition: &Expr) -> Vec<&Expr> {
    match &condition.kind {
        ExprKind::Binary { op: BinaryOp::And, left, right, .. } => {
            parts(left).into_iter().chain(parts(right)).collect()
        }
        _ => vec![condition],
    }
}

fn condition(expr: &Expr) -> Result<Condition, Diagnostic> {
    let unclear = || {
        Diagnostic::error(code::POLICY_FORM, "a line of a policy compares variables with values")
            .at(expr.span, "no such comparison")
            .help("write `when ego_speed > 8 m/s and time == Night`; for `or`, write two lines")
    };
    let ExprKind::Binary { op: BinaryOp::Compare(comparison), op_span, left, right } = &expr.kind else {
        return Err(unclear());
    };
    let comparison = *comparison;
    let ExprKind::Name(name) = &left.kind else { return Err(unclear()) };
    let index = variable(name, left.span)?;
    let variable = &VARIABLES[index];
    let value = match variable.kind {
        VariableKind::Words { words, ordered } => {
            if !ordered && comparison.orders() {
                let error = Diagnostic::error(code::UNORDERED, format!("`{name}` has no order"));
                return Err(error.at(*op_span, "cannot compare").help("compare it by `==` or `!=`"));
            }
            word(variable, words, right)?
        }
        VariableKind::Quantity { .. } => {
            if comparison == Comparison::NotEqual {
                return Err(unclear());
            }
            number(variable, right)?
        }
    };
    Ok(Condition { variable: index, comparison, value })
}

fn variable(name: &str, span: Span) -> Result<usize, Diagnostic> {
    variable_index(name).ok_or_else(|| {
        let message = format!("unknown variable `{name}`");
        let error = Diagnostic::error(code::POLICY_VARIABLE, message).at(span, "no policy sees it");
        match nearest(name, VARIABLES.iter().map(|variable| variable.name)) {
            Some(near) => error.meant(span, near),
            None => error.help("`avastra explain AV0705` lists the variables"),
        }
    })
}

/// The index of a variable, and the value that an observation holds for it. A number may stand without its
/// unit.
pub(in crate::check) fn value_of(name: &ast::Name, given: &Expr) -> Result<(usize, f32), Diagnostic> {
    let index = variable(&name.text, name.span)?;
    let value = match (VARIABLES[index].kind, bare(given)) {
        (VariableKind::Words { words, .. }, _) => word(&VARIABLES[index], words, given)?,
        (VariableKind::Quantity { .. }, Some(value)) => value,
        (VariableKind::Quantity { .. }, None) => number(&VARIABLES[index], given)?,
    };
    Ok((index, value as f32))
}

/// A number without a unit.
fn bare(given: &Expr) -> Option<f64> {
    match &given.kind {
        ExprKind::Unary { op: UnaryOp::Negate, operand } => bare(operand).map(|value| -value),
        ExprKind::Number(literal) if literal.unit.is_none() => literal.digits.parse().ok(),
        _ => None,
    }
}

/// The number that stands for a word.
fn word(variable: &Variable, words: &[(&str, f32)], given: &Expr) -> Result<f64, Diagnostic> {
    let names = || words.iter().map(|(word, _)| *word);
    let ExprKind::Name(name) = &given.kind else {
        let message = format!("`{}` is a word", variable.name);
        let error = Diagnostic::error(code::TYPE_MISMATCH, message).at(given.span, "no word");
        return Err(error.help(format!("it is {}", listed(&names().collect::<Vec<_>>()))));
    };
    let found = words.iter().find(|(word, _)| word == name);
    found.map(|(_, value)| f64::from(*value)).ok_or_else(|| unknown("word", name, given.span, names()))
}

/// A number in the variable's own unit; exact if it is written in that unit.
fn number(variable: &Variable, given: &Expr) -> Result<f64, Diagnostic> {
    if let ExprKind::Unary { op: UnaryOp::Negate, operand } = &given.kind {
        return number(variable, operand).map(|value| -value);
    }
    let ExprKind::Number(literal) = &given.kind else {
        let message = format!("`{}` is a number", variable.name);
        return Err(Diagnostic::error(code::TYPE_MISMATCH, message).at(given.span, "no number"));
    };
    in_unit(literal, variable.dimension(), variable.factor(), &format!("`{}` is", variable.name))
}

/// Reports a line whose conditions no state fulfils.
fn nowhere(rule: &PolicyRule, place: Span) -> Diagnostic {
    let alone = |condition: &&Condition| Region::all().and(condition).is_empty();
    let label = match rule.conditions.iter().find(alone) {
        Some(condition) => format!("`{}` is never that", VARIABLES[condition.variable].name),
        None => "these exclude each other".to_owned(),
    };
    let error = Diagnostic::error(code::POLICY_NOWHERE, "the line applies nowhere");
    error.at(place, label).help("remove the line, or widen its conditions")
}

/// Reports a line that never acts because the lines above it apply to all of its states.
fn shadowed(region: &Region, above: &[(Region, Span)], line: Span) -> Option<Diagnostic> {
    let regions: Vec<Region> = above.iter().map(|(region, _)| region.clone()).collect();
    if !region.is_covered(&regions) {
        return None;
    }
    let error = Diagnostic::error(code::POLICY_SHADOWED, "the line never gets its turn").at(line, "shadowed");
    // If one line above covers it alone, only that line is named.
    let alone = above.iter().find(|(other, _)| region.is_covered(std::slice::from_ref(other)));
    let error = match alone {
        Some((_, span)) => error.beside(*span, "applies wherever it would"),
        None => error.note("the lines above it together apply wherever it would"),
    };
    Some(error.help("remove the line, or move it up"))
}

/// Reports a row that is legal for no state of the line, on every road of the policy.
fn illegal(
    space: &Space,
    origin: &PolicyOrigin,
    row: usize,
    region: &Region,
    call: &ast::Call,
) -> Option<Diagnostic> {
    let row = &space.rows[row];
    let message = format!("`{}` can never act here", row.label);
    let error = Diagnostic::error(code::POLICY_ROW, message);
    // Nothing is known of rules that the space does not have.
    let in_force = RulesInForce::new(space, &origin.with, &origin.without).ok()?;
    if let Some(reason) = dead(space, origin, &in_force, row) {
        let error = error.at(call.span, "no road of the policy allows it").note(reason);
        return Some(error.help("remove the row from the line"));
    }
    let time = variable_index("time").expect("it is a variable");
    let (clock, meant) = space.states.iter().enumerate().find_map(|(at, state)| match &state.meaning {
        StateMeaning::Time(words) => Some((at, words)),
        StateMeaning::Private | StateMeaning::Sky(..) => None,
    })?;
    let from = (0..meant.len()).filter(|&variant| region.words(time) >> (meant[variant] as u32) & 1 == 1);
    let from: u128 = from.map(|variant| 1 << variant).sum();
    let forbidding = in_force.all().map(|rule| &space.rules[rule]).find(|rule| match &rule.body {
        crate::model::RuleBody::Moves { state, .. } => *state == clock && forbids(space, rule, row, from),
        crate::model::RuleBody::Holds(_)
        | crate::model::RuleBody::During(_)
        | crate::model::RuleBody::Phases { .. } => false,
    })?;
    let error = error
        .at(call.span, format!("forbidden by `{}` at every time that the line leaves", forbidding.name))
        .beside(forbidding.span, "the rule");
    Some(error.help("remove the row from the line, or narrow the line by `time`"))
}

/// The reason why a row can run on no road of the policy, under the rules that the policy was trained with.
fn dead(space: &Space, origin: &PolicyOrigin, in_force: &RulesInForce, row: &Row) -> Option<String> {
    let roads = space.roads.iter().zip(&row.roads).filter(|(road, _)| origin.roads.contains(&road.name));
    let mut reasons = roads.map(|(road, reach)| match reach {
        Reach::Dead { rules, reason } if rules.iter().all(|&rule| in_force.contains(rule)) => {
            Some(format!("on `{}`: {reason}", road.name))
        }
        Reach::Dead { .. } | Reach::Open(_) => None,
    });
    let first = reasons.next()??;
    reasons.all(|reason| reason.is_some()).then_some(first)
}
