//! What the ego vehicle must keep, at a moment: whether it is asked for, whether it holds, and by how much.
//!
//! The margin is the quantitative meaning of signal temporal logic (Fainekos and Pappas 2009, Donzé and Maler 2010): of
//! a comparison the difference of its sides, of `and` the smaller of two, of `or` the larger. Above 0 it implies that
//! the condition holds, below 0 that it does not.

use crate::model::eval::{
    Facts, MomentFacts, TickFacts, arithmetic, compare_numbers, evaluate, of_moment, of_tick,
};
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use crate::model::space::{FnDef, RequirementDef};
use crate::model::value::Type;
use crate::model::vocabulary::{Light, Word, WordFact};
use avastra_base::units::Dimension;

/// How a requirement stands at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    pub holds: bool,
    /// In SI; NaN for a condition without one.
    pub margin: f64,
}

/// A requirement as it is asked at every tick: its numbers are fractions no more, and what they come to is known.
#[derive(Debug, Clone)]
pub struct ReadyRequirement {
    when: Option<Node>,
    condition: Node,
    has_margin: bool,
    bearers: Vec<usize>,
}

/// An expression. What is asked often has a node of its own, the rest is left to the evaluator of all expressions.
#[derive(Debug, Clone)]
enum Node {
    Number(f64),
    Fact(Of),
    Arithmetic(Arithmetic, Box<Node>, Box<Node>),
    /// Compares a fact with a number, which is what most conditions do.
    Bound(Of, Comparison, f64),
    /// Compares numbers.
    Compare(Comparison, Box<Node>, Box<Node>),
    InRange(Box<Node>, Box<Node>, Box<Node>),
    Not(Box<Node>),
    /// Joined by `and`, in their order.
    And(Vec<Node>),
    Or(Box<Node>, Box<Node>),
    Implies(Box<Node>, Box<Node>),
    /// Whether the next light is one of these.
    IsLight(Vec<Light>),
    Other(Expr),
}

/// How a fact is read.
#[derive(Debug, Clone, Copy)]
enum Of {
    Moment(fn(&MomentFacts) -> f64),
    Tick(fn(&TickFacts) -> f64),
}

impl RequirementDef {
    /// Made ready to be asked often.
    pub fn ready(&self) -> ReadyRequirement {
        ReadyRequirement {
            when: self.when.as_ref().map(Node::of),
            condition: Node::of(&self.condition),
            has_margin: self.margin.is_some(),
            bearers: self.bearers.clone(),
        }
    }
}

impl ReadyRequirement {
    /// How it stands; `None` where nothing is asked, because `when` does not hold or a road user that it names is not
    /// there.
    pub fn at(&self, functions: &[FnDef], facts: &Facts<'_>) -> Option<Kept> {
        let is_there = |who: &usize| {
            facts.world.is_some_and(|world| world.bearers.iter().any(|(known, _)| known == who))
        };
        let at = At { functions, facts };
        if !self.bearers.iter().all(is_there) || self.when.as_ref().is_some_and(|when| !at.holds(when)) {
            return None;
        }
        Some(match self.has_margin {
            true => at.kept(&self.condition),
            false => Kept { holds: at.holds(&self.condition), margin: f64::NAN },
        })
    }
}

impl Node {
    fn of(expr: &Expr) -> Node {
        let node = |expr: &Expr| Box::new(Node::of(expr));
        let is_number = |expr: &Expr| matches!(expr.ty, Type::Int | Type::Quantity(_));
        match &expr.kind {
            ExprKind::Number(number) => Node::Number(number.to_f64()),
            ExprKind::Fact(fact) => match (of_moment(*fact), of_tick(*fact)) {
                (Some(of), _) => Node::Fact(Of::Moment(of)),
                (None, Some(of)) => Node::Fact(Of::Tick(of)),
                (None, None) => Node::Other(expr.clone()),
            },
            ExprKind::Arithmetic(op, left, right) => match (Node::of(left), Node::of(right)) {
                (Node::Number(left), Node::Number(right)) => Node::Number(arithmetic(*op, left, right)),
                (left, right) => Node::Arithmetic(*op, Box::new(left), Box::new(right)),
            },
            ExprKind::Compare(op, left, right) if is_number(left) => {
                match (Node::of(left), Node::of(right)) {
                    (Node::Fact(of), Node::Number(number)) => Node::Bound(of, *op, number),
                    (left, right) => Node::Compare(*op, Box::new(left), Box::new(right)),
                }
            }
            ExprKind::InRange(value, low, high) if is_number(value) => {
                Node::InRange(node(value), node(low), node(high))
            }
            ExprKind::IsWord(WordFact::EgoLight, words) => {
                Node::IsLight(words.iter().filter_map(|word| Light::from_name(word)).collect())
            }
            ExprKind::Not(inner) => Node::Not(node(inner)),
            ExprKind::And(left, right) => {
                let parts = |node: Node| match node {
                    Node::And(parts) => parts,
                    node => vec![node],
                };
                Node::And([parts(Node::of(left)), parts(Node::of(right))].concat())
            }
            ExprKind::Or(left, right) => Node::Or(node(left), node(right)),
            ExprKind::Implies(left, right) => Node::Implies(node(left), node(right)),
            _ => Node::Other(expr.clone()),
        }
    }
}

/// A moment at which nodes are asked.
#[derive(Clone, Copy)]
struct At<'a> {
    functions: &'a [FnDef],
    facts: &'a Facts<'a>,
}

impl At<'_> {
    fn number(self, node: &Node) -> f64 {
        match node {
            Node::Number(number) => *number,
            Node::Fact(of) => self.fact(*of),
            Node::Arithmetic(op, left, right) => arithmetic(*op, self.number(left), self.number(right)),
            Node::Other(expr) => evaluate(expr, self.functions, self.facts).number(),
            Node::Bound(..)
            | Node::Compare(..)
            | Node::InRange(..)
            | Node::Not(_)
            | Node::And(..)
            | Node::Or(..)
            | Node::Implies(..)
            | Node::IsLight(_) => f64::NAN,
        }
    }

    fn fact(self, of: Of) -> f64 {
        self.facts.world.map_or(f64::NAN, |world| match of {
            Of::Moment(of) => of(&world.moment),
            Of::Tick(of) => of(&world.tick),
        })
    }

    fn holds(self, node: &Node) -> bool {
        match node {
            Node::Bound(of, op, number) => compare_numbers(*op, self.fact(*of), *number),
            Node::Compare(op, left, right) => compare_numbers(*op, self.number(left), self.number(right)),
            Node::InRange(value, low, high) => {
                let value = self.number(value);
                compare_numbers(Comparison::GreaterEqual, value, self.number(low))
                    && compare_numbers(Comparison::LessEqual, value, self.number(high))
            }
            Node::Not(inner) => !self.holds(inner),
            Node::And(parts) => parts.iter().all(|part| self.holds(part)),
            Node::Or(left, right) => self.holds(left) || self.holds(right),
            Node::Implies(left, right) => !self.holds(left) || self.holds(right),
            Node::IsLight(lights) => {
                self.facts.world.is_some_and(|world| lights.contains(&world.moment.ego_light))
            }
            Node::Other(expr) => evaluate(expr, self.functions, self.facts).truth(),
            Node::Number(_) | Node::Fact(_) | Node::Arithmetic(..) => false,
        }
    }

    /// Truth and margin of a condition that has one.
    fn kept(self, node: &Node) -> Kept {
        let two = |left: &Node, right: &Node| (self.kept(left), self.kept(right));
        match node {
            Node::Bound(of, op, number) => compared(*op, self.fact(*of), *number),
            Node::Compare(op, left, right) => compared(*op, self.number(left), self.number(right)),
            Node::InRange(value, low, high) => {
                let [value, low, high] = [value, low, high].map(|node| self.number(node));
                let holds = compare_numbers(Comparison::GreaterEqual, value, low)
                    && compare_numbers(Comparison::LessEqual, value, high);
                Kept { holds, margin: (value - low).min(high - value) }
            }
            Node::Not(inner) => {
                let Kept { holds, margin } = self.kept(inner);
                Kept { holds: !holds, margin: -margin }
            }
            Node::And(parts) => {
                let all = Kept { holds: true, margin: f64::INFINITY };
                parts.iter().map(|part| self.kept(part)).fold(all, |all, part| Kept {
                    holds: all.holds && part.holds,
                    margin: all.margin.min(part.margin),
                })
            }
            Node::Or(left, right) => {
                let (left, right) = two(left, right);
                Kept { holds: left.holds || right.holds, margin: left.margin.max(right.margin) }
            }
            Node::Implies(left, right) => {
                let (left, right) = two(left, right);
                Kept { holds: !left.holds || right.holds, margin: (-left.margin).max(right.margin) }
            }
            Node::Number(_) | Node::Fact(_) | Node::Arithmetic(..) | Node::IsLight(_) | Node::Other(_) => {
                Kept { holds: self.holds(node), margin: f64::NAN }
            }
        }
    }
}

fn compared(op: Comparison, left: f64, right: f64) -> Kept {
    let is_less = matches!(op, Comparison::Less | Comparison::LessEqual);
    let margin = if is_less { right - left } else { left - right };
    Kept { holds: compare_numbers(op, left, right), margin }
}

/// The dimension of a condition's margin; `None` if it has none: truth values, words and `==` have no distance, and distances
/// of different dimensions cannot be compared.
pub(crate) fn margin_dimension(condition: &Expr) -> Option<Dimension> {
    match &condition.kind {
        ExprKind::Compare(Comparison::Equal | Comparison::NotEqual, ..) => None,
        ExprKind::Compare(_, value, _) | ExprKind::InRange(value, ..) => match value.ty {
            Type::Int => Some(Dimension::RATIO),
            Type::Quantity(dimension) => Some(dimension),
            Type::Bool | Type::Enum(_) => None,
        },
        ExprKind::Not(inner) => margin_dimension(inner),
        ExprKind::And(left, right) | ExprKind::Or(left, right) | ExprKind::Implies(left, right) => {
            margin_dimension(left).filter(|dimension| margin_dimension(right) == Some(*dimension))
        }
        _ => None,
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
    use avastra_base::units::Rational;

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
            assert_eq!(margin_dimension(&condition), Some(Dimension::SPEED));
            let ready = Node::of(&condition);
            let at = |value: f64| {
                let mut world = WorldFacts::default();
                world.moment.ego_speed_mps = value;
                let facts = Facts { world: Some(&world), ..Facts::new(&[], &memory) };
                let Kept { holds, margin } = At { functions: &[], facts: &facts }.kept(&ready);
                // It is the evaluator's answer, and that of the way without a margin.
                assert_eq!(holds, evaluate(&condition, &[], &facts).truth());
                assert_eq!(holds, At { functions: &[], facts: &facts }.holds(&ready));
                (holds, margin)
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
