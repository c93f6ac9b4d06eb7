//! Static claims of a space: `expect count(actions) == 45`, `expect every(actions, realisable)`.

use crate::check::checker::{Checker, Claim, each};
use crate::check::mistakes::Report;
use crate::model::effort;
use crate::model::vocabulary::{SpaceClaim, Word};
use crate::model::{Row, Space, code};
use crate::prove::{Realisable, Realised};
use crate::syntax::ast::{BinaryOp, ItemKind, Span};
use crate::syntax::{Diagnostic, ast};

/// Rows named in one diagnostic, at most.
const ROWS_SHOWN: usize = 5;

impl Checker {
    /// Judges every claim.
    pub(super) fn expects(&mut self, items: &[&ast::Item], space: &Space, realisable: &Realisable) {
        for (_, expect) in each(items, ItemKind::as_expect) {
            if effort::is_spent() {
                return;
            }
            self.claim(&expect.claim, expect.span, space, realisable);
        }
    }

    /// Reports claims of the wrong form. Used when the space is not sound and no claim can be judged.
    pub(super) fn look_at_expects(&mut self, items: &[&ast::Item]) {
        for (_, expect) in each(items, ItemKind::as_expect) {
            if !is_static(&expect.claim) {
                self.report(not_static(expect.span));
            }
        }
    }

    /// Notes the names of a claim, judged or not.
    pub(super) fn note_claim(&mut self, claim: &ast::Expr) {
        match &claim.kind {
            ast::ExprKind::Binary { left, right, .. } => {
                self.note_claim(left);
                self.note_claim(right);
            }
            ast::ExprKind::Call(call) => {
                self.references.word_named::<SpaceClaim>(call.name.span, &call.name.text);
                call.args.iter().for_each(|argument| self.note_claim(&argument.value));
            }
            ast::ExprKind::Name(name) => {
                self.references.word_named::<SpaceClaim>(claim.span, name);
                self.references.uses_target(claim.span, name);
            }
            ast::ExprKind::Number(number) => self.references.number(number),
            _ => {}
        }
    }

    fn claim(&mut self, claim: &ast::Expr, span: Span, space: &Space, realisable: &Realisable) -> Option<()> {
        match &claim.kind {
            ast::ExprKind::Call(call) if call.name.text == SpaceClaim::Every.name() => {
                let rows = self.rows_of(call.args.first(), call.span, space)?;
                let is_known = |kind: &ast::ExprKind| matches!(kind, ast::ExprKind::Name(name) if name == SpaceClaim::Realisable.name());
                let is_claimed = call.args.get(1).is_some_and(|argument| is_known(&argument.value.kind));
                if call.args.len() != 2 || !is_claimed {
                    return self.reject(not_static(call.span));
                }
                let idle: Vec<(&str, &str)> = rows
                    .iter()
                    .filter_map(|row| Some((row.label.as_str(), obstacle(&realisable[row.index])?)))
                    .collect();
                if idle.is_empty() {
                    let rows: Vec<usize> = rows.iter().map(|row| row.index).collect();
                    // Several claims about the same rows are judged once.
                    if !self.claims.iter().any(|known| known.rows == rows) {
                        effort::spend(rows.len());
                        self.claims.push(Claim { span, rows });
                    }
                    return Some(());
                }
                let message = format!("{} of {} rows were not found to run", idle.len(), rows.len());
                let error = Diagnostic::error(code::FALSE_CLAIM, message).at(span, "this is not shown");
                let shown = idle.iter().take(ROWS_SHOWN);
                self.reject(shown.fold(error, |error, (row, why)| error.note(format!("{row} {why}"))))
            }
            ast::ExprKind::Binary { op, left, right, .. } => {
                let (left, right) = (self.count(left, space)?, self.count(right, space)?);
                let BinaryOp::Compare(comparison) = op else { return self.reject(not_static(span)) };
                if comparison.holds(left, right) {
                    return Some(());
                }
                let message = format!("{left} {} {right} does not hold", op.symbol());
                let error = Diagnostic::error(code::FALSE_CLAIM, message).at(claim.span, "this is false");
                self.reject(
                    error.help("`avastra table FILE` lists the rows: correct the claim, or what makes them"),
                )
            }
            _ => self.reject(not_static(span)),
        }
    }

    fn count(&mut self, expr: &ast::Expr, space: &Space) -> Option<u64> {
        match &expr.kind {
            ast::ExprKind::Call(call)
                if call.name.text == SpaceClaim::Count.name() && call.args.len() == 1 =>
            {
                self.rows_of(call.args.first(), call.span, space).map(|rows| rows.len() as u64)
            }
            ast::ExprKind::Number(number)
                if number.unit.is_none() && number.digits.parse::<u64>().is_ok() =>
            {
                number.digits.parse().ok()
            }
            _ => {
                let error = Diagnostic::error(code::NOT_STATIC, "wanted a number of rows");
                self.reject(error.at(expr.span, "not one").help("write `count(actions)` or a whole number"))
            }
        }
    }

    /// The rows of an action, of a group, or of all `actions`.
    fn rows_of<'a>(
        &mut self,
        argument: Option<&ast::Arg>,
        span: Span,
        space: &'a Space,
    ) -> Option<Vec<&'a Row>> {
        let Some(ast::Arg { value, .. }) = argument else {
            return self.reject(not_static(span));
        };
        let ast::ExprKind::Name(name) = &value.kind else {
            let error = Diagnostic::error(code::NOT_STATIC, "wanted an action or a group");
            return self.reject(error.at(value.span, "not a name"));
        };
        effort::spend(space.rows.len());
        if name == SpaceClaim::Actions.name() {
            return Some(space.rows.iter().collect());
        }
        let group = space.groups.iter().find(|group| group.name == *name).map(|group| group.actions.clone());
        let action = self.action_names.get(name).map(|action| vec![action]);
        let Some(mut actions) = group.or(action) else {
            let groups = space.groups.iter().map(|group| group.name.as_str());
            let actions = space.actions.iter().map(|action| action.name.as_str());
            let candidates = groups.chain(actions).chain([SpaceClaim::Actions.name()]);
            let error = self.unknown("action", name, value.span, candidates);
            return self.reject(error);
        };
        actions.sort_unstable();
        Some(actions.into_iter().flat_map(|action| space.rows_of(action)).collect())
    }
}

fn is_static(claim: &ast::Expr) -> bool {
    match &claim.kind {
        ast::ExprKind::Call(call) => call.name.text == SpaceClaim::Every.name(),
        ast::ExprKind::Binary { .. } => true,
        _ => false,
    }
}

fn not_static(span: Span) -> Diagnostic {
    Diagnostic::error(code::NOT_STATIC, "this cannot be expected of a space")
        .at(span, "unknown claim")
        .help("claims are `count(actions) == 45` and `every(actions, realisable)`; an action or a group may stand for `actions`")
}

/// Why a row is not known to run on any road; `None` if it runs on one.
fn obstacle(found: &[Realised]) -> Option<&'static str> {
    // Without roads there is nothing to run on, and the roads of another space are not known here.
    if found.is_empty() || found.contains(&Realised::Runs) {
        return None;
    }
    let has = |wanted| found.contains(&wanted);
    Some(match () {
        () if has(Realised::NotSearched) => {
            "was not searched for: the searches for other rows came to their limit"
        }
        () if has(Realised::Unknown) => "may run or not: its rules could not be solved",
        () if has(Realised::Elsewhere) => {
            "runs in states, or at times, of which it is not known whether a step begins so"
        }
        () if has(Realised::Unreached) => "runs only in states, or at times, with which no step begins",
        () => "cannot run",
    })
}
