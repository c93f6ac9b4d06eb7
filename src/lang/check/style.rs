//! Style: what is right and yet harder to read than it need be. Only a space's own file is looked at.
//!
//! Layout is `fmt`'s business, not ours.

use crate::model::code;
use crate::syntax::ast::{BinaryOp, Comparison, Expr, ExprKind, ItemKind, Name};
use crate::syntax::{Diagnostic, ast, print_expr};

/// One warning for each oddity.
pub(super) fn report(own: &[&ast::Item]) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for item in own {
        names(&item.kind, &mut diagnostics);
        conditions(&item.kind, &mut diagnostics);
    }
    diagnostics
}

/// Types and their variants begin with a capital letter, everything else is in small letters: so a
/// reader knows a variant from a parameter.
fn names(kind: &ItemKind, into: &mut Vec<Diagnostic>) {
    let inside: Vec<&Name> = match kind {
        // It bears the name of an enum.
        ItemKind::Odds(_) => return,
        ItemKind::Enum(declared) => declared.variants.iter().collect(),
        ItemKind::Fn(declared) => declared.params.iter().map(|param| &param.name).collect(),
        ItemKind::Manoeuvre(declared) => declared.params.iter().map(|param| &param.name).collect(),
        ItemKind::Action(declared) => declared.params.iter().map(|param| &param.name).collect(),
        _ => Vec::new(),
    };
    let capitals = match kind {
        ItemKind::Enum(_) => Some("types and variants begin with a capital letter"),
        ItemKind::Body(_) => Some("bodies begin with a capital letter"),
        _ => None,
    };
    for name in kind.name().into_iter().chain(inside) {
        match capitals {
            Some(rule) if name.text.starts_with(|first: char| first.is_ascii_lowercase()) => {
                into.push(named(name, rule, capital(&name.text)));
            }
            None if name.text.contains(|c: char| c.is_ascii_uppercase()) => {
                let rule = "names other than types and variants are in small letters";
                into.push(named(name, rule, small(&name.text)));
            }
            _ => {}
        }
    }
}

fn named(name: &Name, rule: &str, better: String) -> Diagnostic {
    Diagnostic::warning(code::NAME_STYLE, format!("`{}` looks like something else", name.text))
        .at(name.span, rule)
        .help(format!("call it `{better}`"))
}

/// `near_by` as `NearBy`.
fn capital(name: &str) -> String {
    let part = |part: &str| {
        let mut letters = part.chars();
        letters
            .next()
            .map_or(String::new(), |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    name.split('_').map(part).collect()
}

/// `NearBy` as `near_by`.
fn small(name: &str) -> String {
    let mut text = String::new();
    let mut after_small = false;
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && after_small {
            text.push('_');
        }
        after_small = letter.is_ascii_lowercase() || letter.is_ascii_digit();
        text.push(letter.to_ascii_lowercase());
    }
    text
}

/// `x == true`, wherever a condition stands.
fn conditions(kind: &ItemKind, into: &mut Vec<Diagnostic>) {
    let conditions: Vec<&Expr> = match kind {
        ItemKind::Rule(ast::Rule { body: ast::RuleBody::Holds { condition, .. }, .. }) => vec![condition],
        ItemKind::Require(declared) => declared.conditions().collect(),
        ItemKind::Verdict(declared) => vec![&declared.condition],
        ItemKind::Fn(declared) => vec![&declared.body],
        ItemKind::Manoeuvre(declared) => {
            declared.phases.iter().flat_map(|phase| phase.once.iter().chain(&phase.only_if)).collect()
        }
        ItemKind::Reward(cases) => cases.iter().filter_map(|case| case.condition.as_ref()).collect(),
        ItemKind::Action(declared) => declared.params.iter().filter_map(|p| p.condition.as_ref()).collect(),
        _ => Vec::new(),
    };
    conditions.into_iter().for_each(|condition| compared(condition, into));
}

fn compared(expr: &Expr, into: &mut Vec<Diagnostic>) {
    match &expr.kind {
        ExprKind::Binary { op, left, right, .. } => {
            compared(left, into);
            compared(right, into);
            let (truth, other) = match (&left.kind, &right.kind) {
                (_, ExprKind::Bool(truth)) => (*truth, left),
                (ExprKind::Bool(truth), _) => (*truth, right),
                _ => return,
            };
            let holds = match op {
                BinaryOp::Compare(Comparison::Equal) => truth,
                BinaryOp::Compare(Comparison::NotEqual) => !truth,
                _ => return,
            };
            let other = match &other.kind {
                ExprKind::Binary { .. } | ExprKind::Range { .. } => format!("({})", print_expr(other)),
                _ => print_expr(other),
            };
            let better = if holds { other } else { format!("not {other}") };
            let message = format!("comparing with `{truth}` says nothing more");
            into.push(
                Diagnostic::warning(code::COMPARED_WITH_TRUTH, message)
                    .at(expr.span, "true or false already")
                    .help(format!("write `{better}`"))
                    .fix(format!("write `{better}`"), expr.span, better),
            );
        }
        ExprKind::Unary { operand, .. } => compared(operand, into),
        ExprKind::Call(call) => call.args.iter().for_each(|argument| compared(&argument.value, into)),
        ExprKind::Match { arms, .. } => arms.iter().for_each(|arm| compared(&arm.value, into)),
        _ => {}
    }
}
