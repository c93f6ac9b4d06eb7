//! What the ego vehicle must keep, at a moment: whether it is asked for, whether it holds, and by how much.
//!
//! The margin is the quantitative meaning of signal temporal logic (Fainekos and Pappas 2009, Donzé and Maler 2010): of
//! a comparison the difference of its sides, of `and` the smaller of two, of `or` the larger. Above 0 it implies that
//! the condition holds, below 0 that it does not.

use crate::model::eval::{Facts, evaluate};
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use crate::model::space::{FnDef, RequirementDef};
use crate::model::value::Type;

/// How a requirement stands at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    pub holds: bool,
    /// In SI; NaN for a condition without one.
    pub margin: f64,
}

impl RequirementDef {
    /// How it stands; `None` where nothing is asked, because `when` does not hold or a road user that it names is not
    /// there.
    pub fn at(&self, functions: &[FnDef], facts: &Facts<'_>) -> Option<Kept> {
        let is_there = |who: &usize| {
            facts.world.is_some_and(|world| world.bearers.iter().any(|(known, _)| known == who))
        };
        if !self.bearers.iter().all(is_there) {
            return None;
        }
        if self.when.as_ref().is_some_and(|when| !evaluate(when, functions, facts).truth()) {
            return None;
        }
        let holds = evaluate(&self.condition, functions, facts).truth();
        let margin = self.margin.map_or(f64::NAN, |_| margin(&self.condition, functions, facts));
        Some(Kept { holds, margin })
    }
}

/// The type of a condition's margin; `None` if it has none: truth values, words and `==` have no distance, and distances of
/// different types cannot be compared.
pub(crate) fn margin_type(condition: &Expr) -> Option<Type> {
    match &condition.kind {
        ExprKind::Compare(Comparison::Equal | Comparison::NotEqual, ..) => None,
        ExprKind::Compare(_, left, _) => match left.ty {
            Type::Int => Some(Type::Quantity(avastra_base::units::Dimension::RATIO)),
            Type::Quantity(_) => Some(left.ty),
            Type::Bool | Type::Enum(_) => None,
        },
        ExprKind::InRange(value, low, _) => match value.ty {
            Type::Quantity(_) => Some(value.ty),
            Type::Int => margin_type_of_whole(low.ty),
            Type::Bool | Type::Enum(_) => None,
        },
        ExprKind::Not(inner) => margin_type(inner),
        ExprKind::And(left, right) | ExprKind::Or(left, right) | ExprKind::Implies(left, right) => {
            margin_type(left).filter(|ty| margin_type(right) == Some(*ty))
        }
        _ => None,
    }
}

/// A whole number may be compared with ratios.
fn margin_type_of_whole(other: Type) -> Option<Type> {
    matches!(other, Type::Int | Type::Quantity(_))
        .then_some(Type::Quantity(avastra_base::units::Dimension::RATIO))
}

/// The margin of a condition that has one.
fn margin(condition: &Expr, functions: &[FnDef], facts: &Facts<'_>) -> f64 {
    let number = |expr: &Expr| evaluate(expr, functions, facts).number();
    let of = |expr: &Expr| margin(expr, functions, facts);
    match &condition.kind {
        ExprKind::Compare(Comparison::Less | Comparison::LessEqual, left, right) => {
            number(right) - number(left)
        }
        ExprKind::Compare(_, left, right) => number(left) - number(right),
        ExprKind::InRange(value, low, high) => {
            let value = number(value);
            (value - number(low)).min(number(high) - value)
        }
        ExprKind::Not(inner) => -of(inner),
        ExprKind::And(left, right) => of(left).min(of(right)),
        ExprKind::Or(left, right) => of(left).max(of(right)),
        ExprKind::Implies(left, right) => (-of(left)).max(of(right)),
        _ => f64::NAN,
    }
}

/// Where a condition divides by something that is not a number of its own, here or in a function that it calls.
pub(crate) fn open_divisor<'a>(condition: &'a Expr, functions: &'a [FnDef]) -> Option<&'a Expr> {
    let mut found = None;
    let mut called = Vec::new();
    let look = |expr: &'a Expr, found: &mut Option<&'a Expr>, called: &mut Vec<usize>| match &expr.kind {
        ExprKind::Arithmetic(Arithmetic::Divide, _, divisor)
            if !matches!(divisor.kind, ExprKind::Number(_)) =>
        {
            found.get_or_insert(divisor);
        }
        ExprKind::Call(function, _) => called.push(*function),
        _ => {}
    };
    condition.walk_all(&mut |expr| look(expr, &mut found, &mut called));
    let mut looked = 0;
    while let Some(function) = called.get(looked).copied() {
        looked += 1;
        if !called[..looked - 1].contains(&function) {
            functions.get(function)?.body.walk_all(&mut |expr| look(expr, &mut found, &mut called));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::vocabulary::Fact;
    use crate::model::{Memory, WorldFacts};
    use crate::syntax::ast::Span;
    use avastra_base::units::{Dimension, Rational};

    fn expr(kind: ExprKind) -> Box<Expr> {
        Box::new(Expr { kind, ty: Type::Bool, span: Span::NONE })
    }

    fn speed(kind: ExprKind) -> Box<Expr> {
        Box::new(Expr { kind, ty: Type::Quantity(Dimension::SPEED), span: Span::NONE })
    }

    /// Conditions on one number, all that a seed can make up.
    fn made_up(seed: &mut u64, depth: u32) -> Box<Expr> {
        let mut next = |most: u64| {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 33) % most
        };
        let kind = next(if depth == 0 { 5 } else { 9 });
        let number = |value: u64| speed(ExprKind::Number(Rational::integer(value as i64)));
        let fact = || speed(ExprKind::Fact(Fact::EgoSpeed));
        let compare =
            [Comparison::Less, Comparison::LessEqual, Comparison::Greater, Comparison::GreaterEqual];
        match kind {
            0..=3 => expr(ExprKind::Compare(compare[kind as usize], fact(), number(next(20)))),
            4 => {
                let low = next(20);
                expr(ExprKind::InRange(fact(), number(low), number(low + next(5))))
            }
            5 => expr(ExprKind::Not(made_up(seed, depth - 1))),
            6 => expr(ExprKind::And(made_up(seed, depth - 1), made_up(seed, depth - 1))),
            7 => expr(ExprKind::Or(made_up(seed, depth - 1), made_up(seed, depth - 1))),
            _ => expr(ExprKind::Implies(made_up(seed, depth - 1), made_up(seed, depth - 1))),
        }
    }

    #[test]
    fn a_margin_has_the_sign_of_its_condition_and_no_less_than_its_size() {
        let memory = Memory { cells: Vec::new() };
        let mut seed = 7;
        for _ in 0..2_000 {
            let condition = *made_up(&mut seed, 4);
            assert_eq!(margin_type(&condition), Some(Type::Quantity(Dimension::SPEED)));
            let at = |value: f64| {
                let mut world = WorldFacts::default();
                world.moment.ego_speed_mps = value;
                let facts = Facts { world: Some(&world), ..Facts::new(&[], &memory) };
                (evaluate(&condition, &[], &facts).truth(), margin(&condition, &[], &facts))
            };
            for half in 0..50 {
                let value = f64::from(half) * 0.5;
                let (holds, margin) = at(value);
                assert!(margin == 0.0 || holds == (margin > 0.0), "{condition:?} at {value}");
                // Whoever is nearer than the margin has the same answer.
                for near in [value - 0.99 * margin.abs(), value + 0.99 * margin.abs()] {
                    assert!(margin == 0.0 || at(near).0 == holds, "{condition:?} at {value} and {near}");
                }
            }
        }
    }
}
