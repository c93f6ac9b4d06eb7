//! Interval evaluation: all values that an expression may have, given all values of what it names.
//!
//! The static counterpart of `eval`, over exact numbers. It over-approximates, so "never true" is a
//! proof and "may be true" is not.

use crate::model::effort;
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind};
use crate::model::rules::allowed;
use crate::model::vocabulary::{Fact, NearWord, NumberWord, PastWord};
use crate::model::{
    AMBIENT_MAX, COMMANDED_MAX, FnDef, Interval, RoadFacts, SINCE_S_MAX, TICK_MS, Type, Value,
};
use crate::prove::moment::Case;
use crate::prove::sums::{difference, is_same, lacks_value, may_lack_a_value};
use avastra_base::units::Rational;

/// The most variants of an enum: a set of them fits one integer.
pub(crate) const VARIANTS_MAX: usize = 128;

/// Steps for the product of two intervals: up to four products of fractions, each brought to its lowest terms.
const PRODUCT_STEPS: usize = 3;

/// A set of values of one type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Values {
    Truth {
        may_hold: bool,
        may_fail: bool,
    },
    Number(Interval),
    /// Bit `i` is variant `i`.
    Variants(u128),
}

/// The facts known where an expression stands.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    pub functions: &'a [FnDef],
    pub locals: &'a [Values],
    pub cells: &'a [Values],
    /// `None`: any road.
    pub road: Option<&'a RoadFacts>,
    /// `None`: any moment.
    pub case: Option<&'a Case>,
}

/// The numbers of the bits that are set: the variants of [`Values::Variants`].
pub(crate) fn bits(mut set: u128) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let bit = (set != 0).then(|| set.trailing_zeros() as usize)?;
        set &= set - 1;
        Some(bit)
    })
}

impl Values {
    pub const UNKNOWN_TRUTH: Values = Values::Truth { may_hold: true, may_fail: true };

    pub fn truth(value: bool) -> Values {
        Values::Truth { may_hold: value, may_fail: !value }
    }

    /// One value alone.
    pub fn point(value: Value) -> Values {
        match value {
            Value::Bool(truth) => Values::truth(truth),
            Value::Variant(_, variant) => Values::Variants(1 << variant),
            Value::Number(number) => {
                Values::Number(Rational::from_rounded(number).map_or(Interval::ALL, Interval::point))
            }
        }
    }

    pub fn may_hold(self) -> bool {
        matches!(self, Values::Truth { may_hold: true, .. })
    }

    pub fn may_fail(self) -> bool {
        matches!(self, Values::Truth { may_fail: true, .. })
    }

    pub fn interval(self) -> Interval {
        match self {
            Values::Number(interval) => interval,
            Values::Truth { .. } | Values::Variants(_) => Interval::ALL,
        }
    }

    /// The positions as bits; `false` is bit 0 and `true` is bit 1.
    pub fn variants(self) -> u128 {
        match self {
            Values::Variants(set) => set,
            Values::Truth { may_hold, may_fail } => u128::from(may_fail) | u128::from(may_hold) << 1,
            Values::Number(_) => 0,
        }
    }

    /// The only value, as a literal of this type; `None` if there are several.
    pub fn literal(self, ty: Type) -> Option<ExprKind> {
        match (self, ty) {
            (Values::Number(interval), _) => interval.single().map(ExprKind::Number),
            (Values::Variants(set), Type::Enum(of)) if set.is_power_of_two() => {
                Some(ExprKind::Variant(of, set.trailing_zeros() as usize))
            }
            (Values::Truth { may_hold, may_fail }, _) if may_hold != may_fail => {
                Some(ExprKind::Bool(may_hold))
            }
            (Values::Truth { .. } | Values::Variants(_), _) => None,
        }
    }

    /// The values one by one; numbers stay together.
    pub fn each(self) -> Vec<Values> {
        match self {
            Values::Variants(set) => bits(set).map(|bit| Values::Variants(1 << bit)).collect(),
            Values::Truth { may_hold: true, may_fail: true } => {
                vec![Values::truth(false), Values::truth(true)]
            }
            Values::Truth { .. } | Values::Number(_) => vec![self],
        }
    }

    /// The only value of an enum or a truth value; `None` for numbers, and if there are several.
    pub fn value(self, ty: Type) -> Option<Value> {
        match (self, ty) {
            (Values::Variants(set), Type::Enum(of)) if set.is_power_of_two() => {
                Some(Value::Variant(of, set.trailing_zeros() as usize))
            }
            (Values::Truth { may_hold, may_fail }, Type::Bool) if may_hold != may_fail => {
                Some(Value::Bool(may_hold))
            }
            _ => None,
        }
    }

    /// The values in both; all of `self` if there are none, since nearly equal numbers pass comparisons, too.
    fn both(self, other: Values) -> Values {
        match (self, other) {
            (Values::Number(a), Values::Number(b)) if !a.intersect(&b).is_empty() => {
                Values::Number(a.intersect(&b))
            }
            (Values::Variants(a), Values::Variants(b)) if a & b != 0 => Values::Variants(a & b),
            (Values::Truth { may_hold: true, may_fail: true }, Values::Truth { .. }) => other,
            _ => self,
        }
    }

    /// Everything in either.
    pub fn union(self, other: Values) -> Values {
        match (self, other) {
            (Values::Number(a), Values::Number(b)) => Values::Number(a.hull(&b)),
            (Values::Variants(a), Values::Variants(b)) => Values::Variants(a | b),
            (a, b) => Values::Truth {
                may_hold: a.may_hold() || b.may_hold(),
                may_fail: a.may_fail() || b.may_fail(),
            },
        }
    }
}

/// All values that the expression may have.
pub(crate) fn enclose(expr: &Expr, known: &Known<'_>) -> Values {
    effort::spend(1);
    let values = |expr: &Expr| enclose(expr, known);
    match &expr.kind {
        ExprKind::Bool(truth) => Values::truth(*truth),
        ExprKind::Number(number) => Values::Number(Interval::point(*number)),
        ExprKind::Variant(_, index) => Values::Variants(1 << index),
        ExprKind::Local(index) => known.locals[*index],
        ExprKind::Cell(cell) => known.cells[*cell],
        ExprKind::CellAt(first, key) => {
            let keys = values(key).variants();
            effort::spend(keys.count_ones() as usize);
            let chosen = bits(keys).map(|key| known.cells[first + key]);
            chosen.reduce(Values::union).unwrap_or(Values::Variants(0))
        }
        ExprKind::Fact(fact) => match known.case.and_then(|case| case.number(*fact)) {
            Some(piece) => Values::Number(piece),
            None => fact_values(*fact, known),
        },
        ExprKind::OfRoadUser(_, fact) => fact_values(*fact, known),
        // While it is not there, it has no value: as after a division by 0, no comparison is certain.
        ExprKind::OfBearer(_, fact) if fact_range(*fact).is_none() => Values::UNKNOWN_TRUTH,
        ExprKind::OfBearer(..) => Values::Number(Interval::ALL),
        ExprKind::IsThere(_) | ExprKind::Breached(_) => Values::UNKNOWN_TRUTH,
        // Facts of this moment say nothing of earlier moments.
        ExprKind::Past(_, PastWord::Change, _) | ExprKind::Margin(_) => Values::Number(Interval::ALL),
        ExprKind::Past(_, PastWord::Total, ticks) => {
            let most_s = Rational::new((*ticks * TICK_MS).into(), 1000);
            Values::Number(
                most_s.map_or(Interval::NOT_NEGATIVE, |most_s| Interval::closed(Rational::ZERO, most_s)),
            )
        }
        ExprKind::Past(_, PastWord::Times, ticks) => Values::Number(between(0.0, f64::from(*ticks))),
        // The road users near are not known; there may be none.
        ExprKind::Near(word, _, condition) => {
            let may_hold = enclose(condition, &Known { case: None, ..*known }).may_hold();
            match (word, may_hold) {
                (NearWord::Some, true) => Values::UNKNOWN_TRUTH,
                (NearWord::Some, false) => Values::truth(false),
                (NearWord::Count, true) => {
                    Values::Number(between(0.0, f64::from(COMMANDED_MAX + AMBIENT_MAX)))
                }
                (NearWord::Count, false) => Values::Number(Interval::point(Rational::ZERO)),
            }
        }
        // At first neither has a value, and what has none does not hold.
        ExprKind::Past(condition, PastWord::Throughout | PastWord::Ago, _) => {
            match enclose(condition, &Known { case: None, ..*known }) {
                number @ Values::Number(_) => number,
                truth => Values::Truth { may_hold: truth.may_hold(), may_fail: true },
            }
        }
        ExprKind::Past(condition, ..) => enclose(condition, &Known { case: None, ..*known }),
        ExprKind::Since(..) => Values::Number(between(0.0, SINCE_S_MAX)),
        ExprKind::Call(function, arguments) => {
            let locals: Vec<Values> = arguments.iter().map(values).collect();
            enclose(&known.functions[*function].body, &Known { locals: &locals, ..*known })
        }
        ExprKind::OfNumbers(word, numbers) => {
            let numbers: Vec<Interval> = numbers.iter().map(|number| values(number).interval()).collect();
            Values::Number(match (word, numbers.as_slice()) {
                (NumberWord::Min, [left, right]) => left.min(right),
                (NumberWord::Max, [left, right]) => left.max(right),
                (_, [number]) => number.max(&number.neg()).intersect(&Interval::NOT_NEGATIVE),
                _ => Interval::ALL,
            })
        }
        ExprKind::Not(inner) => not(values(inner)),
        ExprKind::Negate(inner) => Values::Number(values(inner).interval().neg()),
        ExprKind::Arithmetic(Arithmetic::Subtract, left, right)
            if is_same(left, right) && !may_lack_a_value(left, known) =>
        {
            Values::Number(Interval::point(Rational::ZERO))
        }
        ExprKind::Arithmetic(op, left, right) => {
            let (left, right) = (values(left).interval(), values(right).interval());
            if matches!(op, Arithmetic::Multiply | Arithmetic::Divide) {
                effort::spend(PRODUCT_STEPS);
            }
            Values::Number(match op {
                Arithmetic::Add => left.add(&right),
                Arithmetic::Subtract => left.add(&right.neg()),
                Arithmetic::Multiply => left.mul(&right),
                Arithmetic::Divide => left.div(&right),
            })
        }
        ExprKind::Compare(op, left, right) => compare_parts(*op, left, right, known),
        ExprKind::And(left, right) => and(values(left), values(right)),
        ExprKind::Or(left, right) => or(values(left), values(right)),
        ExprKind::Implies(left, right) => or(not(values(left)), values(right)),
        ExprKind::InRange(inner, low, high) => {
            let compared = |op, end: &Expr| compare_parts(op, inner, end, known);
            and(compared(Comparison::GreaterEqual, low), compared(Comparison::LessEqual, high))
        }
        ExprKind::InList(inner, list) => {
            let equals = list.iter().map(|item| compare_parts(Comparison::Equal, inner, item, known));
            equals.reduce(or).unwrap_or(Values::truth(false))
        }
        ExprKind::InLanes(inner, lanes) => match known.road {
            None => Values::UNKNOWN_TRUTH,
            Some(road) => {
                let inside = bits(values(inner).variants()).map(|v| road.has_lane(lanes[v]));
                let (may_hold, may_fail) =
                    inside.fold((false, false), |(hold, fail), inside| (hold || inside, fail || !inside));
                Values::Truth { may_hold, may_fail }
            }
        },
        ExprKind::OnRoad(names) => match known.road {
            None => Values::UNKNOWN_TRUTH,
            Some(road) => Values::truth(names.contains(&road.name)),
        },
        ExprKind::IsWord(fact, words) => match known.case.and_then(|case| case.word(*fact)) {
            Some(word) => Values::truth(words.iter().any(|one| one == word)),
            None => Values::UNKNOWN_TRUTH,
        },
        ExprKind::IsWordOf(..) | ExprKind::IsBody(..) => Values::UNKNOWN_TRUTH,
        ExprKind::Match { subject, arm_of, arms } => {
            // Each arm is looked at once, however many variants take it, because nested `match`es would multiply.
            let mut taken: Vec<(usize, u128)> = Vec::new();
            for variant in bits(values(subject).variants()) {
                match taken.iter_mut().find(|(arm, _)| *arm == arm_of[variant]) {
                    Some((_, variants)) => *variants |= 1 << variant,
                    None => taken.push((arm_of[variant], 1 << variant)),
                }
            }
            let chosen =
                taken.into_iter().map(|(arm, variants)| within(&arms[arm], subject, variants, known));
            chosen.reduce(Values::union).unwrap_or_else(|| values(&arms[0]))
        }
    }
}

/// All values of an arm of a `match`, which is taken where the subject is one of these variants. The names in the subject
/// have only some of their values there.
fn within(arm: &Expr, subject: &Expr, variants: u128, known: &Known<'_>) -> Values {
    let mut narrower = Vec::new();
    match subject.ty {
        // 1 is `false` alone, and 2 `true`.
        Type::Bool if variants.is_power_of_two() => narrow(subject, variants == 2, known, &mut narrower),
        Type::Enum(_) => narrower.push((subject, Values::Variants(variants))),
        Type::Bool | Type::Int | Type::Quantity(_) => {}
    }
    narrower
        .retain(|(name, _)| matches!(name.kind, ExprKind::Local(_) | ExprKind::Cell(_) | ExprKind::Fact(_)));
    if narrower.is_empty() {
        return enclose(arm, known);
    }
    effort::spend(known.locals.len() + known.cells.len());
    let (mut locals, mut cells) = (known.locals.to_vec(), known.cells.to_vec());
    let mut case = known.case.cloned().unwrap_or_default();
    for (name, only) in narrower {
        match name.kind {
            ExprKind::Local(index) => locals[index] = locals[index].both(only),
            ExprKind::Cell(cell) => cells[cell] = cells[cell].both(only),
            ExprKind::Fact(fact) => {
                let before = enclose(name, &Known { case: Some(&case), ..*known });
                if let Values::Number(piece) = before.both(only) {
                    case.set_number(fact, piece);
                }
            }
            _ => {}
        }
    }
    enclose(arm, &Known { locals: &locals, cells: &cells, case: Some(&case), ..*known })
}

/// The values that names may have where a condition is `truth`, as far as comparisons in it say so.
fn narrow<'e>(condition: &'e Expr, truth: bool, known: &Known<'_>, found: &mut Vec<(&'e Expr, Values)>) {
    effort::spend(1);
    // A comparison fails, too, where a side has no value: then it says nothing of the other one.
    let is_sure = |sides: [&Expr; 2]| truth || !sides.iter().any(|side| may_lack_a_value(side, known));
    match &condition.kind {
        ExprKind::Local(_) | ExprKind::Cell(_) => found.push((condition, Values::truth(truth))),
        ExprKind::Not(inner) => narrow(inner, !truth, known, found),
        ExprKind::And(left, right) if truth => {
            narrow(left, true, known, found);
            narrow(right, true, known, found);
        }
        ExprKind::Or(left, right) if !truth => {
            narrow(left, false, known, found);
            narrow(right, false, known, found);
        }
        ExprKind::Implies(left, right) if !truth => {
            narrow(left, true, known, found);
            narrow(right, false, known, found);
        }
        ExprKind::Compare(op, left, right) if is_sure([left, right]) => {
            let op = if truth { *op } else { op.negated() };
            // Measured numbers are equal if they are nearly so.
            let is_exact = left.ty == Type::Int && right.ty == Type::Int;
            for (name, op, other) in [(left, op, right), (right, op.mirrored(), left)] {
                match enclose(other, known) {
                    Values::Number(limit) if is_exact || op != Comparison::Equal => {
                        found.push((name, Values::Number(allowed(op, &limit))));
                    }
                    only @ Values::Variants(_) if op == Comparison::Equal => found.push((name, only)),
                    Values::Variants(set) if op == Comparison::NotEqual && set.is_power_of_two() => {
                        found.push((name, Values::Variants(!set)));
                    }
                    Values::Number(_) | Values::Variants(_) | Values::Truth { .. } => {}
                }
            }
        }
        ExprKind::InRange(inner, low, high) if truth => {
            for (op, end) in [(Comparison::GreaterEqual, low), (Comparison::LessEqual, high)] {
                found.push((inner, Values::Number(allowed(op, &enclose(end, known).interval()))));
            }
        }
        _ => {}
    }
}

fn fact_values(fact: Fact, known: &Known<'_>) -> Values {
    match (fact, known.road) {
        (Fact::RoadLimit, Some(road)) => Values::Number(Interval::point(road.limit)),
        (Fact::EgoOverStop, Some(road)) if !road.has_stop_sign => {
            Values::Number(between(NO_LINE_M, NO_LINE_M))
        }
        _ => fact_range(fact).map_or(Values::UNKNOWN_TRUTH, Values::Number),
    }
}

/// The value of facts of lines where there is no line, m.
const NO_LINE_M: f64 = -100.0;

fn between(low: f64, high: f64) -> Interval {
    match (Rational::from_f64(low), Rational::from_f64(high)) {
        (Some(low), Some(high)) => Interval::closed(low, high),
        _ => Interval::ALL,
    }
}

/// The range of a fact that is a number, on any road and at any moment.
pub(super) fn fact_range(fact: Fact) -> Option<Interval> {
    let (low, high) = fact.range().into_inner();
    (fact.ty() != Type::Bool).then(|| match (low, high) {
        (0.0, f64::INFINITY) => Interval::NOT_NEGATIVE,
        (f64::NEG_INFINITY, f64::INFINITY) => Interval::ALL,
        (low, high) => {
            debug_assert!(low.is_finite() && high.is_finite(), "no other half line is known");
            between(low, high)
        }
    })
}

fn not(inner: Values) -> Values {
    Values::Truth { may_hold: inner.may_fail(), may_fail: inner.may_hold() }
}

fn and(left: Values, right: Values) -> Values {
    Values::Truth {
        may_hold: left.may_hold() && right.may_hold(),
        may_fail: left.may_fail() || right.may_fail(),
    }
}

fn or(left: Values, right: Values) -> Values {
    Values::Truth {
        may_hold: left.may_hold() || right.may_hold(),
        may_fail: left.may_fail() && right.may_fail(),
    }
}

/// Compares two expressions. A name has the same value on both sides: `step > step` never holds, whatever the step is, and
/// `ego.speed > ego.speed + nearest.gap` neither.
fn compare_parts(op: Comparison, left: &Expr, right: &Expr, known: &Known<'_>) -> Values {
    if lacks_value(left, known) || lacks_value(right, known) {
        return Values::truth(op == Comparison::NotEqual);
    }
    // A past number, and its change, have no value at first.
    let looks_back =
        |expr: &Expr| expr.any(|kind| matches!(kind, ExprKind::Past(_, PastWord::Change | PastWord::Ago, _)));
    let found = compare_known(op, left, right, known);
    match looks_back(left) || looks_back(right) {
        true => found.union(Values::truth(op == Comparison::NotEqual)),
        false => found,
    }
}

/// Compares what has a value.
fn compare_known(op: Comparison, left: &Expr, right: &Expr, known: &Known<'_>) -> Values {
    let apart = compare(op, enclose(left, known), enclose(right, known));
    if !(apart.may_hold() && apart.may_fail()) {
        return apart;
    }
    let zero = Interval::point(Rational::ZERO);
    match difference(left, right, known) {
        // Nearly equal numbers are `==`, so only those that are the same are surely so.
        Some(found) if found == zero || !matches!(op, Comparison::Equal | Comparison::NotEqual) => {
            compare(op, Values::Number(found), Values::Number(zero))
        }
        _ => apart,
    }
}

fn compare(op: Comparison, left: Values, right: Values) -> Values {
    // `(may hold, may fail)` of equality, of less, and of less or equal.
    let (less, at_most, equal) = match (left, right) {
        (Values::Number(a), Values::Number(b)) => (
            (!b.is_at_most(&a), !a.is_below(&b)),
            (!b.is_below(&a), !a.is_at_most(&b)),
            (!a.intersect(&b).is_empty(), a.single().is_none() || a.single() != b.single()),
        ),
        (Values::Variants(a), Values::Variants(b)) if a != 0 && b != 0 => {
            let (low, high) = (u128::trailing_zeros, |set: u128| 127 - set.leading_zeros());
            (
                (low(a) < high(b), high(a) >= low(b)),
                (low(a) <= high(b), high(a) > low(b)),
                (a & b != 0, !(a == b && a.is_power_of_two())),
            )
        }
        (Values::Variants(_), Values::Variants(_)) => ((false, true), (false, true), (false, true)),
        (a, b) => {
            let same = a.may_hold() && b.may_hold() || a.may_fail() && b.may_fail();
            let differ = a.may_hold() && b.may_fail() || a.may_fail() && b.may_hold();
            ((true, true), (true, true), (same, differ))
        }
    };
    let (may_hold, may_fail) = match op {
        Comparison::Equal => equal,
        Comparison::NotEqual => (equal.1, equal.0),
        Comparison::Less => less,
        Comparison::LessEqual => at_most,
        Comparison::Greater => (at_most.1, at_most.0),
        Comparison::GreaterEqual => (less.1, less.0),
    };
    Values::Truth { may_hold, may_fail }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Facts, Memory, evaluate};
    use crate::syntax::ast::{FileId, Span};
    use proptest::prelude::*;

    fn number(kind: ExprKind) -> Expr {
        Expr { kind, ty: Type::Int, span: Span::new(FileId(0), 0, 0) }
    }

    /// `a * x + b * y - (c * x - d)`, with `x` and `y` as parameters.
    fn sum([a, b, c, d]: [i64; 4]) -> Expr {
        let literal = |value| number(ExprKind::Number(Rational::integer(value)));
        let of = |op, left, right| number(ExprKind::Arithmetic(op, Box::new(left), Box::new(right)));
        let times = |factor, local| of(Arithmetic::Multiply, literal(factor), number(ExprKind::Local(local)));
        let inner = of(Arithmetic::Subtract, times(c, 0), literal(d));
        of(Arithmetic::Subtract, of(Arithmetic::Add, times(a, 0), times(b, 1)), inner)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Shared terms of two sums are cancelled: the verdict holds for every value, and where nothing else is left it is
        /// sharp.
        #[test]
        fn sums_that_share_terms_are_compared(
            left in prop::array::uniform4(-3..4_i64), right in prop::array::uniform4(-3..4_i64),
            low in prop::array::uniform2(-5..5_i64), wide in prop::array::uniform2(0..4_i64), at in prop::array::uniform2(0..4_i64),
            op in 0..6_usize,
        ) {
            use Comparison::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
            let op = [Equal, NotEqual, Less, LessEqual, Greater, GreaterEqual][op];
            let (l, r) = (sum(left), sum(right));
            let compared = Expr {
                ty: Type::Bool,
                ..number(ExprKind::Compare(op, Box::new(l), Box::new(r)))
            };
            let interval = |of: usize| {
                Values::Number(Interval::closed(Rational::integer(low[of]), Rational::integer(low[of] + wide[of])))
            };
            let known = Known { functions: &[], locals: &[interval(0), interval(1)], cells: &[], road: None, case: None };
            let found = enclose(&compared, &known);
            let values = [0, 1].map(|of| Value::Number((low[of] + at[of].min(wide[of])) as f64));
            let holds = evaluate(&compared, &[], &Facts::new(&values, &Memory::default())).truth();
            let is_allowed = if holds { found.may_hold() } else { found.may_fail() };
            prop_assert!(is_allowed);
            let shares_all = left[0] - left[2] == right[0] - right[2] && left[1] == right[1];
            let is_sharp = !(found.may_hold() && found.may_fail());
            prop_assert!(is_sharp || !shares_all || matches!(op, Equal | NotEqual));
        }

        /// The value of an arm of a `match` lies within the enclosed values, however its condition narrows them. So do the
        /// lesser, the greater and the size of two numbers.
        #[test]
        fn an_arm_has_the_values_that_its_condition_leaves(
            left in prop::array::uniform4(-3..4_i64), right in prop::array::uniform4(-3..4_i64),
            low in prop::array::uniform2(-5..5_i64), wide in prop::array::uniform2(0..4_i64), at in prop::array::uniform2(0..4_i64),
            limits in prop::array::uniform2(-6..6_i64), ops in prop::array::uniform2(0..6_usize), joined in 0..5_usize, word in 0..4_usize,
        ) {
            use Comparison::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
            let all = [Equal, NotEqual, Less, LessEqual, Greater, GreaterEqual];
            let truth = |kind| Box::new(Expr { ty: Type::Bool, ..number(kind) });
            let compared = |local: usize, other: Expr| {
                let name = Box::new(number(ExprKind::Local(local)));
                truth(ExprKind::Compare(all[ops[local]], name, Box::new(other)))
            };
            let limit = |of: usize| number(ExprKind::Number(Rational::integer(limits[of])));
            // The second one is compared with the first one, too.
            let (one, other) = (compared(0, limit(0)), compared(1, if word == 0 { number(ExprKind::Local(0)) } else { limit(1) }));
            let subject = match joined {
                0 => truth(ExprKind::And(one, other)),
                1 => truth(ExprKind::Or(one, other)),
                2 => truth(ExprKind::Implies(one, other)),
                3 => truth(ExprKind::Not(truth(ExprKind::Or(one, other)))),
                _ => one,
            };
            let sums = vec![sum(left), sum(right)];
            let chosen = match word {
                0 | 1 => sums[0].clone(),
                2 => number(ExprKind::OfNumbers(NumberWord::Min, sums.clone())),
                _ => number(ExprKind::OfNumbers(NumberWord::Abs, sums[..1].to_vec())),
            };
            let largest = number(ExprKind::OfNumbers(NumberWord::Max, sums));
            let expr = number(ExprKind::Match { subject, arm_of: vec![1, 0], arms: vec![chosen, largest] });
            let interval = |of: usize| {
                Values::Number(Interval::closed(Rational::integer(low[of]), Rational::integer(low[of] + wide[of])))
            };
            let known = Known { functions: &[], locals: &[interval(0), interval(1)], cells: &[], road: None, case: None };
            let values = [0, 1].map(|of| Value::Number((low[of] + at[of].min(wide[of])) as f64));
            let found = evaluate(&expr, &[], &Facts::new(&values, &Memory::default())).number();
            let found = Rational::integer(found as i64);
            prop_assert!(enclose(&expr, &known).interval().contains(found), "{found:?}");
        }
    }
}
