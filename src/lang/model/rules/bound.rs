//! The limits that the conditions of rules and `where`s set to single numbers: `speed <= road.limit`.

use crate::model::effort;
use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::interval::{End, Interval};
use crate::model::rules::{Demand, rules_by_action};
use crate::model::space::{ActionDef, RuleDef};
use crate::model::value::Type;
use crate::model::vocabulary::Known;

/// Steps for the copy of one operation. Copies are kept, so the limit of steps also bounds memory.
const COPIED_STEPS: usize = 16;

/// `local op limit`, wherever all guards hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// The rule that says so; `None` is the parameter's own `where`.
    pub rule: Option<usize>,
    pub local: usize,
    pub op: Comparison,
    pub limit: Expr,
    pub guards: Vec<Expr>,
    /// Whether values are drawn within it: it asks nothing about a spawn.
    pub is_drawn_within: bool,
    /// The parameters that the limit and the guards name.
    needs: Vec<usize>,
}

impl Bound {
    /// Whether the limit or a guard names the parameter.
    pub fn needs(&self, local: usize) -> bool {
        self.needs.contains(&local)
    }
}

/// By action: every bound on its numeric parameters, first by their `where`s, then by the rules in the
/// order of their declarations.
pub(crate) fn bounds(actions: &[ActionDef], rules: &[RuleDef]) -> Vec<Vec<Bound>> {
    let binding = rules_by_action(rules, actions.len());
    let of_action = |(index, action): (usize, &ActionDef)| {
        let mut found = Vec::new();
        for condition in action.parameters.iter().filter_map(|parameter| parameter.condition.as_ref()) {
            collect(condition, None, &mut Vec::new(), &mut found);
        }
        for &rule in binding[index].iter().take_while(|_| !effort::is_spent()) {
            if let Some(Demand::Holds(condition)) = rules[rule].body.demand(index) {
                collect(condition, Some(rule), &mut Vec::new(), &mut found);
            }
        }
        found
    };
    actions.iter().enumerate().map(of_action).collect()
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

/// Adds the bounds of a condition: of a comparison, of both sides of `and`, and of what a guard implies.
/// A condition of any other form bounds nothing; it is still judged.
fn collect(condition: &Expr, rule: Option<usize>, guards: &mut Vec<Expr>, into: &mut Vec<Bound>) {
    let mut note = |side: &Expr, op: Comparison, limit: &Expr| {
        if let (ExprKind::Local(local), Type::Quantity(_) | Type::Int) = (&side.kind, side.ty)
            && !locals(limit).contains(local)
        {
            let mut parts = guards.iter().chain([limit]);
            let needs = parts.clone().flat_map(locals).collect();
            let is_drawn_within = parts.all(|expr| expr.known() < Known::Spawn);
            let (limit, guards) = (limit.clone(), guards.clone());
            let copied: usize = guards.iter().chain([&limit]).map(Expr::operations).sum();
            effort::spend(COPIED_STEPS * copied);
            into.push(Bound { rule, local: *local, op, limit, guards, is_drawn_within, needs });
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

/// The parameters that an expression names.
pub fn locals(expr: &Expr) -> Vec<usize> {
    expr.filter_map(ExprKind::local)
}
