//! Expressions computed as far as possible beforehand: calls are replaced by bodies, constants are folded.

use crate::model::expr::{Expr, ExprKind, Who};
use crate::model::{FnDef, Type, effort};
use crate::prove::enclose::{Known, enclose};
use crate::syntax::ast::Span;

/// Steps for the copy of one operation. Copies are kept and written as text, so the limit of steps also bounds memory.
const COPIED_STEPS: usize = 32;

/// The expression with its locals replaced, its calls opened and its spans removed, so that two expressions
/// of the same form are equal.
pub(super) fn reduce(expr: &Expr, functions: &[FnDef], locals: &[Expr]) -> Expr {
    effort::spend(COPIED_STEPS);
    // Arguments are copied wherever they are named, so nested calls may double them each time.
    if effort::is_spent() {
        return Expr { kind: ExprKind::Bool(false), ty: Type::Bool, span: Span::NONE };
    }
    let inner = |expr: &Expr| Box::new(reduce(expr, functions, locals));
    let all = |exprs: &[Expr]| exprs.iter().map(|expr| reduce(expr, functions, locals)).collect::<Vec<_>>();
    let kind = match &expr.kind {
        ExprKind::Local(index) => {
            effort::spend(COPIED_STEPS * locals[*index].operations());
            return locals[*index].clone();
        }
        ExprKind::Call(function, arguments) => {
            return reduce(&functions[*function].body, functions, &all(arguments));
        }
        ExprKind::Bool(_)
        | ExprKind::Number(_)
        | ExprKind::Variant(..)
        | ExprKind::Cell(_)
        | ExprKind::Fact(_)
        | ExprKind::OfRoadUser(..) => expr.kind.clone(),
        ExprKind::OfBearer(who, fact) => ExprKind::OfBearer(reduced_who(*who, locals), *fact),
        ExprKind::IsThere(who) => ExprKind::IsThere(reduced_who(*who, locals)),
        ExprKind::CellAt(first, key) => {
            let key = inner(key);
            match key.kind {
                ExprKind::Variant(_, key) => ExprKind::Cell(first + key),
                _ => ExprKind::CellAt(*first, key),
            }
        }
        ExprKind::OfNumbers(word, numbers) => ExprKind::OfNumbers(*word, all(numbers)),
        ExprKind::Not(of) => ExprKind::Not(inner(of)),
        ExprKind::Negate(of) => ExprKind::Negate(inner(of)),
        ExprKind::Arithmetic(op, left, right) => ExprKind::Arithmetic(*op, inner(left), inner(right)),
        ExprKind::Compare(op, left, right) => ExprKind::Compare(*op, inner(left), inner(right)),
        ExprKind::Near(word, bodies, of) => ExprKind::Near(*word, bodies.clone(), inner(of)),
        ExprKind::Past(of, word, ticks) => ExprKind::Past(inner(of), *word, *ticks),
        ExprKind::And(left, right) => ExprKind::And(inner(left), inner(right)),
        ExprKind::Or(left, right) => ExprKind::Or(inner(left), inner(right)),
        ExprKind::Implies(left, right) => ExprKind::Implies(inner(left), inner(right)),
        ExprKind::InRange(of, low, high) => ExprKind::InRange(inner(of), inner(low), inner(high)),
        ExprKind::InList(of, list) => ExprKind::InList(inner(of), all(list)),
        ExprKind::OnRoad(_) | ExprKind::Since(..) | ExprKind::Breached(_) | ExprKind::Margin(_) => {
            expr.kind.clone()
        }
        ExprKind::IsWord(fact, words) => ExprKind::IsWord(*fact, words.clone()),
        ExprKind::IsWordOf(who, fact, words) => {
            ExprKind::IsWordOf(reduced_who(*who, locals), *fact, words.clone())
        }
        ExprKind::IsBody(fact, bodies) => ExprKind::IsBody(*fact, bodies.clone()),
        ExprKind::InLanes(of, lanes) => ExprKind::InLanes(inner(of), lanes.clone()),
        ExprKind::Match { subject, arm_of, arms } => {
            let subject = inner(subject);
            let chosen = match subject.kind {
                ExprKind::Variant(_, variant) => Some(variant),
                ExprKind::Bool(truth) => Some(usize::from(truth)),
                _ => None,
            };
            if let Some(variant) = chosen {
                return reduce(&arms[arm_of[variant]], functions, locals);
            }
            ExprKind::Match { subject, arm_of: arm_of.clone(), arms: all(arms) }
        }
    };
    fold(Expr { kind, ty: expr.ty, span: Span::NONE })
}

/// The name itself, once the parameter is known.
pub(super) fn reduced_who(who: Who, locals: &[Expr]) -> Who {
    let Who::Given(local) = who else { return who };
    match locals[local].kind {
        ExprKind::Variant(_, bearer) => Who::Named(bearer),
        ExprKind::Local(local) => Who::Given(local),
        _ => who,
    }
}

/// A literal, if the expression depends on nothing that is open.
fn fold(expr: Expr) -> Expr {
    let open = |kind: &ExprKind| {
        matches!(
            kind,
            ExprKind::Local(_)
                | ExprKind::Cell(_)
                | ExprKind::CellAt(..)
                | ExprKind::Fact(_)
                | ExprKind::OfRoadUser(..)
                | ExprKind::OfBearer(..)
                | ExprKind::IsThere(_)
                | ExprKind::InLanes(..)
                | ExprKind::OnRoad(_)
                | ExprKind::Since(..)
                | ExprKind::Past(..)
                | ExprKind::Near(..)
                | ExprKind::Breached(_)
                | ExprKind::Margin(_)
                | ExprKind::IsWord(..)
                | ExprKind::IsWordOf(..)
                | ExprKind::IsBody(..)
        )
    };
    if expr.any(open) {
        return expr;
    }
    let known = Known { functions: &[], locals: &[], cells: &[], road: None, case: None };
    match enclose(&expr, &known).literal(expr.ty) {
        Some(kind) => Expr { kind, ..expr },
        None => expr,
    }
}
