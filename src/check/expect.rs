//! Static claims of a space: `expect count(actions) == 45`, `expect every(actions, realisable)`.

use crate::check::checker::{Checker, each};
use crate::check::names::unknown;
use crate::model::{ExpectDef, Reach, Row, Space, code};
use crate::syntax::ast::{BinaryOp, ItemKind, Span};
use crate::syntax::{Diagnostic, ast};

impl Checker {
    /// Judges every claim; gives those that hold.
    pub(super) fn expects(&mut self, items: &[&ast::Item], space: &Space) -> Vec<ExpectDef> {
        let mut held = Vec::new();
        for (_, expect) in each(items, pick) {
            if self.claim(&expect.claim, expect.span, space).is_some() {
                held.push(ExpectDef { text: describe(&expect.claim), span: expect.span });
            }
        }
        held
    }

    /// Without a sound space, claims of the wrong form are reported all the same.
    pub(super) fn look_at_expects(&mut self, items: &[&ast::Item]) {
        for (_, expect) in each(items, pick) {
            if !is_static(&expect.claim) {
                self.report(not_static(expect.span));
            }
        }
    }

    fn claim(&mut self, claim: &ast::Expr, span: Span, space: &Space) -> Option<()> {
        match &claim.kind {
            ast::ExprKind::Call(call) if call.name.text == "every" => {
                let rows = self.rows_of(call.args.first(), call.span, space)?;
                let realisable = call.args.get(1).is_some_and(
                    |argument| matches!(&argument.value.kind, ast::ExprKind::Name(name) if name == "realisable"),
                );
                if call.args.len() != 2 || !realisable {
                    self.report(not_static(call.span));
                    return None;
                }
                let dead: Vec<&str> =
                    rows.iter().filter(|row| is_dead(row)).map(|row| row.label.as_str()).collect();
                if dead.is_empty() {
                    return Some(());
                }
                let message = format!("{} of {} rows can never run", dead.len(), rows.len());
                let error = Diagnostic::error(code::FALSE_CLAIM, message).at(span, "this is false");
                self.report(
                    dead.iter().take(5).fold(error, |error, row| error.note(format!("{row} cannot"))),
                );
                None
            }
            ast::ExprKind::Binary { op, left, right, .. } => {
                let (left, right) = (self.count(left, space)?, self.count(right, space)?);
                let holds = match op {
                    BinaryOp::Equal => left == right,
                    BinaryOp::NotEqual => left != right,
                    BinaryOp::Less => left < right,
                    BinaryOp::LessEqual => left <= right,
                    BinaryOp::Greater => left > right,
                    BinaryOp::GreaterEqual => left >= right,
                    _ => {
                        self.report(not_static(span));
                        return None;
                    }
                };
                if holds {
                    return Some(());
                }
                let message = format!("{left} {} {right} does not hold", op.symbol());
                let error = Diagnostic::error(code::FALSE_CLAIM, message).at(claim.span, "this is false");
                self.report(
                    error.help("`avastra table FILE` lists the rows: correct the claim, or what makes them"),
                );
                None
            }
            _ => {
                self.report(not_static(span));
                None
            }
        }
    }

    fn count(&mut self, expr: &ast::Expr, space: &Space) -> Option<u64> {
        match &expr.kind {
            ast::ExprKind::Call(call) if call.name.text == "count" && call.args.len() == 1 => {
                self.rows_of(call.args.first(), call.span, space).map(|rows| rows.len() as u64)
            }
            ast::ExprKind::Number(number)
                if number.unit.is_none() && number.digits.parse::<u64>().is_ok() =>
            {
                number.digits.parse().ok()
            }
            _ => {
                let error = Diagnostic::error(code::NOT_STATIC, "wanted a number of rows");
                self.report(error.at(expr.span, "not one").help("write `count(actions)` or a whole number"));
                None
            }
        }
    }

    /// Rows of an action, a group, or of all `actions`.
    fn rows_of<'a>(
        &mut self,
        argument: Option<&ast::Arg>,
        span: Span,
        space: &'a Space,
    ) -> Option<Vec<&'a Row>> {
        let Some(ast::Arg { value, .. }) = argument else {
            self.report(not_static(span));
            return None;
        };
        let ast::ExprKind::Name(name) = &value.kind else {
            self.report(
                Diagnostic::error(code::NOT_STATIC, "wanted an action or a group")
                    .at(value.span, "not a name"),
            );
            return None;
        };
        if name == "actions" {
            return Some(space.rows.iter().collect());
        }
        let group = space.groups.iter().find(|group| group.name == *name).map(|group| group.actions.clone());
        let action = space.actions.iter().position(|action| action.name == *name).map(|action| vec![action]);
        let Some(actions) = group.or(action) else {
            let groups = space.groups.iter().map(|group| group.name.as_str());
            let actions = space.actions.iter().map(|action| action.name.as_str());
            self.report(unknown("action", name, value.span, groups.chain(actions).chain(["actions"])));
            return None;
        };
        Some(space.rows.iter().filter(|row| actions.contains(&row.action)).collect())
    }
}

fn pick(kind: &ItemKind) -> Option<&ast::Expect> {
    match kind {
        ItemKind::Expect(expect) => Some(expect),
        _ => None,
    }
}

fn is_static(claim: &ast::Expr) -> bool {
    match &claim.kind {
        ast::ExprKind::Call(call) => call.name.text == "every",
        ast::ExprKind::Binary { .. } => true,
        _ => false,
    }
}

fn not_static(span: Span) -> Diagnostic {
    Diagnostic::error(code::NOT_STATIC, "this cannot be expected of a space")
        .at(span, "unknown claim")
        .help("claims are `count(actions) == 45` and `every(actions, realisable)`; an action or a group may stand for `actions`")
}

fn is_dead(row: &Row) -> bool {
    !row.roads.is_empty() && row.roads.iter().all(|reach| matches!(reach, Reach::Dead { .. }))
}

fn describe(claim: &ast::Expr) -> String {
    match &claim.kind {
        ast::ExprKind::Binary { op, left, right, .. } => {
            format!("{} {} {}", describe(left), op.symbol(), describe(right))
        }
        ast::ExprKind::Call(call) => {
            let arguments: Vec<String> = call.args.iter().map(|argument| describe(&argument.value)).collect();
            format!("{}({})", call.name.text, arguments.join(", "))
        }
        ast::ExprKind::Name(name) => name.clone(),
        ast::ExprKind::Number(number) => number.digits.clone(),
        _ => String::new(),
    }
}
