//! What a condition says about one number: the bounds from which drawing and proving both start.

use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::interval::{End, Interval};
use crate::model::space::{RuleBody, Space};
use crate::model::value::Type;

/// `local op limit`, wherever all guards hold.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bound {
    /// The rule that says so; `None` is the parameter's own `where`.
    pub rule: Option<usize>,
    pub local: usize,
    pub op: Comparison,
    pub limit: Expr,
    pub guards: Vec<Expr>,
}

/// Every bound on a numeric parameter of the action, by all its rules and conditions.
pub(crate) fn bounds(space: &Space, action: usize) -> Vec<Bound> {
    let mut found = Vec::new();
    for parameter in &space.actions[action].parameters {
        if let Some(condition) = &parameter.condition {
            collect(condition, None, &mut Vec::new(), &mut found);
        }
    }
    for (rule, definition) in space.rules.iter().enumerate() {
        let RuleBody::Holds(bindings) = &definition.body else { continue };
        for binding in bindings.iter().filter(|binding| binding.action == action) {
            collect(&binding.condition, Some(rule), &mut Vec::new(), &mut found);
        }
    }
    found
}

impl Bound {
    /// Whether the limit or a guard names the parameter.
    pub fn needs(&self, local: usize) -> bool {
        names(&self.limit, local) || self.guards.iter().any(|guard| names(guard, local))
    }

    /// Whether it can be computed before the world is asked and before the memory changes.
    pub fn is_known_early(&self) -> bool {
        let late = |expr: &Expr| expr.needs_survey() || expr.reads_memory();
        !late(&self.limit) && !self.guards.iter().any(late)
    }
}

/// The numbers that the comparison allows, given those of the limit.
pub(crate) fn allowed(op: Comparison, limit: &Interval) -> Interval {
    let open = |end: End| match end {
        End::At(value, _) => End::At(value, false),
        End::Unbounded => End::Unbounded,
    };
    match op {
        Comparison::Equal => *limit,
        Comparison::NotEqual => Interval::ALL,
        Comparison::Less => Interval { low: End::Unbounded, high: open(limit.high) },
        Comparison::LessEqual => Interval { low: End::Unbounded, high: limit.high },
        Comparison::Greater => Interval { low: open(limit.low), high: End::Unbounded },
        Comparison::GreaterEqual => Interval { low: limit.low, high: End::Unbounded },
    }
}

fn collect(condition: &Expr, rule: Option<usize>, guards: &mut Vec<Expr>, into: &mut Vec<Bound>) {
    let mut note = |side: &Expr, op: Comparison, limit: &Expr| {
        if let (ExprKind::Local(local), Type::Quantity(_) | Type::Int) = (&side.kind, side.ty)
            && !names(limit, *local)
        {
            into.push(Bound { rule, local: *local, op, limit: limit.clone(), guards: guards.clone() });
        }
    };
    match &condition.kind {
        ExprKind::Compare(op, left, right) => {
            note(left, *op, right);
            note(right, op.mirrored(), left);
        }
        ExprKind::InRange(value, low, high) => {
            note(value, Comparison::GreaterEqual, low);
            note(value, Comparison::LessEqual, high);
        }
        ExprKind::And(left, right) => {
            collect(left, rule, guards, into);
            collect(right, rule, guards, into);
        }
        ExprKind::Implies(guard, consequence) => {
            guards.push((**guard).clone());
            collect(consequence, rule, guards, into);
            guards.pop();
        }
        _ => {}
    }
}

fn names(expr: &Expr, local: usize) -> bool {
    expr.any(|kind| matches!(kind, ExprKind::Local(named) if *named == local))
}
