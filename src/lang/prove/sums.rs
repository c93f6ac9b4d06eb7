//! Comparisons as sums: what two sides share is cancelled, and comparisons of the same facts are held against each other.

use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use crate::model::rules::allowed;
use crate::model::vocabulary::PastWord;
use crate::model::{Interval, Type, effort};
use crate::prove::enclose::{Known, Values, enclose};
use avastra_base::units::Rational;

/// The most comparisons of one question that are held against each other.
const COMPARED_MAX: usize = 64;

/// The left side minus the right one; `None` if they share no name, or if one side may have no value.
pub(super) fn difference(left: &Expr, right: &Expr, known: &Known<'_>) -> Option<Interval> {
    if is_same(left, right) && !may_lack_a_value(left, known) {
        return Some(Interval::point(Rational::ZERO));
    }
    let mut sum = Sum { terms: Vec::new(), constant: Rational::ZERO, are_shared: false };
    sum.add(left, Rational::ONE, known)?;
    sum.add(right, Rational::integer(-1), known)?;
    let of_term =
        |(term, factor): &(&Expr, Rational)| enclose(term, known).interval().mul(&Interval::point(*factor));
    let constant = Interval::point(sum.constant);
    sum.are_shared.then(|| sum.terms.iter().map(of_term).fold(constant, |sum, term| sum.add(&term)))
}

/// A sum of parts of expressions, each with its factor.
struct Sum<'a> {
    terms: Vec<(&'a Expr, Rational)>,
    constant: Rational,
    /// Whether something was added that was there already.
    are_shared: bool,
}

impl<'a> Sum<'a> {
    /// Adds an expression times a factor; `None` if it is no number, or may have no value.
    fn add(&mut self, expr: &'a Expr, factor: Rational, known: &Known<'_>) -> Option<()> {
        let fixed = |expr: &Expr| enclose(expr, known).interval().single();
        match &expr.kind {
            ExprKind::Number(number) => {
                self.constant = self.constant.checked_add(number.checked_mul(factor)?)?;
            }
            ExprKind::Negate(inner) => self.add(inner, factor.checked_neg()?, known)?,
            ExprKind::Arithmetic(op, left, right) => match op {
                Arithmetic::Add => {
                    self.add(left, factor, known)?;
                    self.add(right, factor, known)?;
                }
                Arithmetic::Subtract => {
                    self.add(left, factor, known)?;
                    self.add(right, factor.checked_neg()?, known)?;
                }
                Arithmetic::Multiply => match (fixed(left), fixed(right)) {
                    (_, Some(by)) => self.add(left, factor.checked_mul(by)?, known)?,
                    (Some(by), _) => self.add(right, factor.checked_mul(by)?, known)?,
                    (None, None) if may_lack_a_value(expr, known) => return None,
                    (None, None) => self.terms.push((expr, factor)),
                },
                Arithmetic::Divide => self.add(left, factor.checked_div(fixed(right)?)?, known)?,
            },
            _ if !matches!(expr.ty, Type::Int | Type::Quantity(_)) || may_lack_a_value(expr, known) => {
                return None;
            }
            _ => match self.terms.iter_mut().find(|(term, _)| is_same(term, expr)) {
                Some((_, sum)) => {
                    *sum = sum.checked_add(factor)?;
                    self.are_shared = true;
                }
                None => self.terms.push((expr, factor)),
            },
        }
        Some(())
    }

    /// How many times another sum this one is, both without their constants.
    fn times(&self, other: &Sum<'_>) -> Option<Rational> {
        if self.terms.len() != other.terms.len() {
            return None;
        }
        let of = |(term, factor): &(&Expr, Rational)| {
            let (_, same) = other.terms.iter().find(|(one, _)| is_same(one, term))?;
            factor.checked_div(*same)
        };
        let times = of(self.terms.first()?)?;
        self.terms.iter().all(|term| of(term) == Some(times)).then_some(times)
    }
}

/// Whether two expressions are the same name.
pub(super) fn is_same(left: &Expr, right: &Expr) -> bool {
    match (&left.kind, &right.kind) {
        (ExprKind::CellAt(a, left), ExprKind::CellAt(b, right)) => a == b && is_same(left, right),
        (ExprKind::Local(_) | ExprKind::Cell(_) | ExprKind::Fact(_) | ExprKind::Variant(..), right) => {
            left.kind == *right
        }
        _ => false,
    }
}

/// A quotient by 0 has no value, nor has a fact about a road user that is not there, nor an argument that is one of them.
pub(super) fn may_lack_a_value(expr: &Expr, known: &Known<'_>) -> bool {
    expr.any(|kind| match kind {
        ExprKind::Arithmetic(Arithmetic::Divide, ..) | ExprKind::Margin(_) => true,
        ExprKind::Past(_, PastWord::Change | PastWord::Ago, _) => true,
        ExprKind::Call(..) | ExprKind::OfRoadUser(..) | ExprKind::OfBearer(..) => true,
        ExprKind::Local(index) => known.locals.get(*index) == Some(&Values::Number(Interval::ALL)),
        _ => false,
    })
}

/// Whether comparisons that must all hold exclude each other: `a > b` and `b > a`, `a > b + 1` and `a < b`. All that they
/// name is a fact or a drawn number, so that it is the same wherever it is named.
///
/// Two measured numbers are equal if they are nearly so, and `a == b` and `a == b + 1e-12` may both hold. With `are_apart`,
/// that is ignored for `==`, and the result is no proof. For `<=` it is always ignored (docs/limits.md).
pub(super) fn oppose(conditions: &[&Expr], known: &Known<'_>, are_apart: bool) -> bool {
    let mut comparisons = Vec::new();
    conditions.iter().for_each(|condition| conjuncts(condition, &mut comparisons));
    let mut bounded: Vec<(Sum<'_>, Interval)> = Vec::new();
    for (op, left, right) in comparisons.into_iter().take(COMPARED_MAX) {
        effort::spend(1 + 4 * bounded.len());
        let mut sum = Sum { terms: Vec::new(), constant: Rational::ZERO, are_shared: false };
        let added =
            sum.add(left, Rational::ONE, known).and_then(|()| sum.add(right, Rational::integer(-1), known));
        sum.terms.retain(|(_, factor)| *factor != Rational::ZERO);
        // A comparison of one fact with a number is met by the pieces of that fact.
        let (Some(()), Some(limit)) = (added, sum.constant.checked_neg()) else { continue };
        if sum.terms.len() < 2 || !sum.terms.iter().all(|(term, _)| is_fixed(term)) {
            continue;
        }
        let is_exact = left.ty == Type::Int && right.ty == Type::Int;
        let Some(range) = leaves(op, limit, is_exact || are_apart) else { continue };
        match bounded.iter_mut().find_map(|(other, known)| Some((sum.times(other)?, known))) {
            // The sum is `times` the other one, so the other one is the sum divided by that.
            Some((times, known)) => {
                let Some(by) = Rational::ONE.checked_div(times) else { continue };
                *known = known.intersect(&range.mul(&Interval::point(by)));
                if known.is_empty() {
                    return true;
                }
            }
            None => bounded.push((sum, range)),
        }
    }
    false
}

/// The comparisons that hold whenever the condition does.
fn conjuncts<'a>(condition: &'a Expr, found: &mut Vec<(Comparison, &'a Expr, &'a Expr)>) {
    match &condition.kind {
        ExprKind::And(left, right) => {
            conjuncts(left, found);
            conjuncts(right, found);
        }
        ExprKind::Compare(op, left, right) => found.push((*op, left, right)),
        ExprKind::InRange(inner, low, high) => {
            found
                .extend([(Comparison::GreaterEqual, &**inner, &**low), (Comparison::LessEqual, inner, high)]);
        }
        _ => {}
    }
}

/// Whether a term is the same in every condition of a draw. A state is not: a `where` may ask for it before the effects and
/// a rule after them.
fn is_fixed(term: &Expr) -> bool {
    matches!(term.kind, ExprKind::Fact(_) | ExprKind::Local(_))
}

/// The part of the left side that a comparison with a limit leaves; `None` if that is everything.
fn leaves(op: Comparison, limit: Rational, is_exact: bool) -> Option<Interval> {
    let is_told = match op {
        Comparison::Less | Comparison::LessEqual | Comparison::Greater | Comparison::GreaterEqual => true,
        Comparison::Equal => is_exact,
        Comparison::NotEqual => false,
    };
    is_told.then(|| allowed(op, &Interval::point(limit)))
}

/// Whether a sum has surely no value, because of a division by 0. Differences that only exact numbers make 0 are not
/// counted.
pub(super) fn lacks_value(expr: &Expr, known: &Known<'_>) -> bool {
    match &expr.kind {
        ExprKind::Negate(inner) => lacks_value(inner, known),
        ExprKind::Arithmetic(op, left, right) => {
            *op == Arithmetic::Divide && is_zero(right, known)
                || lacks_value(left, known)
                || lacks_value(right, known)
        }
        ExprKind::OfNumbers(_, numbers) => numbers.iter().any(|number| lacks_value(number, known)),
        _ => false,
    }
}

fn is_zero(expr: &Expr, known: &Known<'_>) -> bool {
    match &expr.kind {
        ExprKind::Negate(inner) => is_zero(inner, known),
        ExprKind::Arithmetic(Arithmetic::Multiply, left, right) => {
            is_zero(left, known) || is_zero(right, known)
        }
        ExprKind::Arithmetic(Arithmetic::Subtract, left, right) => is_same(left, right),
        ExprKind::Arithmetic(..) => false,
        _ => enclose(expr, known).interval().single() == Some(Rational::ZERO),
    }
}
