//! The region of states in which a line of a policy applies: a box over the variables, in exact numbers.
//!
//! "Empty" and "covered" are proofs. Variables with whole numbers (`obstacles`) are treated like all other
//! numbers.

use crate::model::{End, Interval};
use avastra_base::units::Rational;

use crate::model::policy::{Condition, VARIABLES, VariableKind};
use crate::model::rules::allowed;

/// A box: the values that are left of each variable, in the order of [`VARIABLES`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Region(Vec<Side>);

/// The values that are left of one variable.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    Numbers(Interval),
    /// A bit for each word that is left.
    Words(u32),
}

/// A box that falls into more pieces than this is not proved to be covered.
const PIECES_MAX: usize = 4096;

impl Region {
    /// The box of all states.
    pub fn all() -> Region {
        let end = |end: Option<f64>| {
            end.and_then(Rational::from_f64).map_or(End::Unbounded, |value| End::At(value, true))
        };
        let side = |kind: &VariableKind| match kind {
            VariableKind::Quantity { low, high, .. } => {
                Side::Numbers(Interval { low: end(*low), high: end(*high) })
            }
            VariableKind::Words { words, .. } => Side::Words(u32::MAX >> (32 - words.len())),
        };
        Region(VARIABLES.iter().map(|variable| side(&variable.kind)).collect())
    }

    /// The part of the box in which a condition holds.
    pub fn and(&self, condition: &Condition) -> Region {
        let mut region = self.clone();
        let side = &mut region.0[condition.variable];
        *side = side.and(condition);
        region
    }

    /// Whether [`Region::and`] gives exactly the states that fulfil the condition. If the threshold is too small
    /// or too large for an exact number, it gives the whole box.
    pub fn is_exact(condition: &Condition) -> bool {
        Rational::from_f64(condition.value).is_some()
    }

    pub fn is_empty(&self) -> bool {
        self.0.iter().any(Side::is_empty)
    }

    /// The words that are left of a variable, one bit each.
    pub fn words(&self, variable: usize) -> u32 {
        match self.0[variable] {
            Side::Words(words) => words,
            Side::Numbers(_) => 0,
        }
    }

    /// Whether other boxes together cover this one; `false` if the answer would take too long.
    pub fn is_covered(&self, others: &[Region]) -> bool {
        let mut rest = if self.is_empty() { Vec::new() } else { vec![self.clone()] };
        for other in others {
            rest = rest.iter().flat_map(|piece| piece.without(other)).collect();
            if rest.len() > PIECES_MAX {
                return false;
            }
        }
        rest.is_empty()
    }

    /// The part of the box outside another box, as boxes that do not overlap.
    fn without(&self, other: &Region) -> Vec<Region> {
        let mut pieces = Vec::new();
        let mut inner = self.clone();
        for variable in 0..self.0.len() {
            let (shared, outside) = inner.0[variable].split(&other.0[variable]);
            if shared.is_empty() {
                return vec![self.clone()];
            }
            for side in outside.into_iter().filter(|side| !side.is_empty()) {
                let mut piece = inner.clone();
                piece.0[variable] = side;
                pieces.push(piece);
            }
            inner.0[variable] = shared;
        }
        pieces
    }
}

impl Side {
    fn is_empty(&self) -> bool {
        match self {
            Side::Numbers(interval) => interval.is_empty(),
            Side::Words(words) => *words == 0,
        }
    }

    fn and(&self, condition: &Condition) -> Side {
        match (self, VARIABLES[condition.variable].kind) {
            (Side::Words(words), VariableKind::Words { words: all, .. }) => {
                let holds = |at: &usize| condition.comparison.holds(f64::from(all[*at].1), condition.value);
                Side::Words((0..all.len()).filter(holds).map(|at| 1 << at).sum::<u32>() & words)
            }
            (Side::Numbers(interval), _) => {
                let Some(value) = Rational::from_f64(condition.value) else { return *self };
                let wanted = allowed(condition.comparison, &Interval::point(value));
                Side::Numbers(interval.intersect(&wanted))
            }
            (Side::Words(_), VariableKind::Quantity { .. }) => *self,
        }
    }

    /// The part that lies inside another side, and the parts that lie outside it.
    fn split(&self, other: &Side) -> (Side, [Side; 2]) {
        match (self, other) {
            (Side::Numbers(own), Side::Numbers(other)) => {
                let below = match other.low {
                    End::Unbounded => NOTHING,
                    End::At(value, closed) => {
                        own.intersect(&Interval { low: End::Unbounded, high: End::At(value, !closed) })
                    }
                };
                let above = match other.high {
                    End::Unbounded => NOTHING,
                    End::At(value, closed) => {
                        own.intersect(&Interval { low: End::At(value, !closed), high: End::Unbounded })
                    }
                };
                (Side::Numbers(own.intersect(other)), [Side::Numbers(below), Side::Numbers(above)])
            }
            (Side::Words(own), Side::Words(other)) => {
                (Side::Words(own & other), [Side::Words(own & !other), Side::Words(0)])
            }
            (Side::Numbers(_), Side::Words(_)) | (Side::Words(_), Side::Numbers(_)) => {
                unreachable!("the sides of one variable are of one kind")
            }
        }
    }
}

/// The empty interval.
const NOTHING: Interval = Interval { low: End::At(Rational::ONE, true), high: End::At(Rational::ZERO, true) };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::expr::Comparison;
    use crate::model::policy::variable_index;
    use proptest::prelude::*;

    fn condition(name: &str, comparison: Comparison, value: f64) -> Condition {
        Condition { variable: variable_index(name).unwrap(), comparison, value }
    }

    #[test]
    fn words_and_ends_of_variables_count() {
        let all = Region::all();
        let low = all.and(&condition("ego_speed", Comparison::LessEqual, 5.0));
        let night = all.and(&condition("time", Comparison::Equal, 20.0));
        let day = all.and(&condition("time", Comparison::NotEqual, 20.0));
        assert!(all.is_covered(&[
            night.clone(),
            low.clone(),
            day.and(&condition("ego_speed", Comparison::Greater, 5.0))
        ]));
        assert!(!all.is_covered(&[night, low]));
        assert!(all.and(&condition("throttle", Comparison::Greater, 100.0)).is_empty());
        assert!(all.and(&condition("rain", Comparison::Less, 0.0)).is_empty());
        assert!(Region::is_exact(&condition("ego_speed", Comparison::Less, 0.1)));
        assert!(!Region::is_exact(&condition("ego_speed", Comparison::Less, 1e-30)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// A box is covered exactly if no point of it lies outside the other boxes.
        #[test]
        fn covered_boxes_have_no_point_outside(
            bounds in proptest::collection::vec((0..6_u8, 0..6_u8, 0..6_u8, 0..6_u8), 1..5),
        ) {
            let cut = |(a, b, c, d): (u8, u8, u8, u8)| {
                Region::all()
                    .and(&condition("ego_speed", Comparison::GreaterEqual, f64::from(a)))
                    .and(&condition("ego_speed", Comparison::Less, f64::from(b)))
                    .and(&condition("ego_x", Comparison::Greater, f64::from(c)))
                    .and(&condition("ego_x", Comparison::LessEqual, f64::from(d)))
            };
            let regions: Vec<Region> = bounds.iter().map(|all| cut(*all)).collect();
            let holds = |(a, b, c, d): (u8, u8, u8, u8), x: f64, y: f64| {
                f64::from(a) <= x && x < f64::from(b) && f64::from(c) < y && y <= f64::from(d)
            };
            let steps = || (0..12).map(|at| f64::from(at) * 0.5);
            let outside = steps().any(|x| steps().any(|y| {
                holds(bounds[0], x, y) && !bounds[1..].iter().any(|other| holds(*other, x, y))
            }));
            prop_assert_eq!(!regions[0].is_covered(&regions[1..]), outside);
        }
    }
}
