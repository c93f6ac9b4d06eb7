//! Polynomials in the numbers that are still to be drawn, and the places where their signs change.
//!
//! Plain arithmetic over `f64`: a root is found to the last digits, not exactly. It decides only where conditions are
//! tried; the conditions themselves are judged by evaluation.

use crate::model::effort;

/// The most numbers of an action that can be solved together.
pub(super) const NUMBERS_MAX: usize = 6;
/// Limits of one polynomial: its degree, and its terms.
const DEGREE_MAX: u32 = 16;
const TERMS_MAX: usize = 120;
/// The most rows of a resultant's determinant.
const SYLVESTER_MAX: usize = 6;
/// The most polynomials that a projection may give.
const PROJECTED_MAX: usize = 400;

/// The power of each number in a term.
type Powers = [u8; NUMBERS_MAX];

/// A sum of terms, sorted by their powers; empty is 0.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polynomial {
    terms: Vec<(Powers, f64)>,
}

impl Polynomial {
    pub fn constant(value: f64) -> Polynomial {
        Polynomial { terms: if value == 0.0 { Vec::new() } else { vec![([0; NUMBERS_MAX], value)] } }
    }

    /// The number with that index.
    pub fn number(index: usize) -> Polynomial {
        let mut powers = [0; NUMBERS_MAX];
        powers[index] = 1;
        Polynomial { terms: vec![(powers, 1.0)] }
    }

    pub fn is_constant(&self) -> bool {
        self.terms.iter().all(|(powers, _)| *powers == [0; NUMBERS_MAX])
    }

    /// The value of a polynomial that is none.
    pub fn value(&self) -> Option<f64> {
        self.is_constant().then(|| self.terms.first().map_or(0.0, |(_, factor)| *factor))
    }

    pub fn is_finite(&self) -> bool {
        self.terms.iter().all(|(_, factor)| factor.is_finite())
    }

    pub fn plus(&self, other: &Polynomial) -> Option<Polynomial> {
        let mut terms = Vec::with_capacity(self.terms.len() + other.terms.len());
        let (mut left, mut right) = (self.terms.iter().peekable(), other.terms.iter().peekable());
        loop {
            let term = match (left.peek(), right.peek()) {
                (Some(a), Some(b)) if a.0 == b.0 => {
                    let sum = (a.0, a.1 + b.1);
                    left.next();
                    right.next();
                    sum
                }
                (Some(a), Some(b)) if a.0 > b.0 => *right.next()?,
                (Some(_), _) => *left.next()?,
                (None, Some(_)) => *right.next()?,
                (None, None) => break,
            };
            if term.1 != 0.0 {
                terms.push(term);
            }
        }
        (terms.len() <= TERMS_MAX).then_some(Polynomial { terms })
    }

    pub fn times(&self, other: &Polynomial) -> Option<Polynomial> {
        effort::spend(1 + self.terms.len() * other.terms.len());
        let mut product = Polynomial { terms: Vec::new() };
        for (powers, factor) in &self.terms {
            let row = other.terms.iter().map(|(more, other)| {
                let mut sum = *powers;
                sum.iter_mut().zip(more).for_each(|(power, more)| *power += more);
                let degree: u32 = sum.iter().map(|power| u32::from(*power)).sum();
                (degree <= DEGREE_MAX).then_some((sum, factor * other))
            });
            product = product.plus(&Polynomial { terms: row.collect::<Option<_>>()? })?;
        }
        Some(product)
    }

    pub fn scaled(&self, factor: f64) -> Polynomial {
        match factor == 0.0 {
            true => Polynomial::constant(0.0),
            false => Polynomial { terms: self.terms.iter().map(|(p, value)| (*p, value * factor)).collect() },
        }
    }

    pub fn minus(&self, other: &Polynomial) -> Option<Polynomial> {
        self.plus(&other.scaled(-1.0))
    }

    pub fn divided(&self, divisor: f64) -> Polynomial {
        Polynomial { terms: self.terms.iter().map(|(p, value)| (*p, value / divisor)).collect() }
    }

    /// Its coefficients as a polynomial in one number, the constant one first; never empty.
    fn coefficients(&self, number: usize) -> Vec<Polynomial> {
        let mut found = vec![Polynomial { terms: Vec::new() }];
        for (powers, factor) in &self.terms {
            let degree = usize::from(powers[number]);
            while found.len() <= degree {
                found.push(Polynomial { terms: Vec::new() });
            }
            let mut rest = *powers;
            rest[number] = 0;
            found[degree].terms.push((rest, *factor));
        }
        found
    }

    fn derivative(&self, number: usize) -> Polynomial {
        let lowered = self.terms.iter().filter(|(powers, _)| powers[number] > 0).map(|(powers, factor)| {
            let mut lower = *powers;
            lower[number] -= 1;
            (lower, factor * f64::from(powers[number]))
        });
        Polynomial { terms: lowered.collect() }
    }

    /// The numbers between two ends where the polynomial may change its sign, if it has no other number than this.
    /// Some of them may be places where it only turns.
    pub fn turns(&self, number: usize, low: f64, high: f64) -> Vec<f64> {
        let coefficients: Vec<f64> = self
            .coefficients(number)
            .iter()
            .map(|coefficient| coefficient.terms.first().map_or(0.0, |(_, factor)| *factor))
            .collect();
        turns(&coefficients, low, high)
    }
}

/// [`Polynomial::turns`] for dense coefficients, the constant one first.
fn turns(coefficients: &[f64], low: f64, high: f64) -> Vec<f64> {
    let degree = coefficients.iter().rposition(|factor| *factor != 0.0).unwrap_or(0);
    if degree == 0 {
        return Vec::new();
    }
    if degree == 1 {
        let root = -coefficients[0] / coefficients[1];
        return if (low..=high).contains(&root) { vec![root] } else { Vec::new() };
    }
    let slope: Vec<f64> =
        coefficients.iter().enumerate().skip(1).map(|(power, factor)| power as f64 * factor).collect();
    // Between two places where the slope is 0 there is at most one root.
    let mut found = turns(&slope, low, high);
    let ends: Vec<f64> = [low].into_iter().chain(found.iter().copied()).chain([high]).collect();
    let value = |x: f64| coefficients.iter().rev().fold(0.0, |sum, factor| sum * x + factor);
    for pair in ends.windows(2) {
        let (mut from, mut to) = (pair[0], pair[1]);
        let rises = value(from) < value(to);
        if (value(from) < 0.0) == (value(to) < 0.0) {
            continue;
        }
        loop {
            let middle = from + (to - from) / 2.0;
            if middle <= from || middle >= to {
                break;
            }
            match (value(middle) < 0.0) == rises {
                true => from = middle,
                false => to = middle,
            }
        }
        found.extend([from, to]);
    }
    found.sort_unstable_by(f64::total_cmp);
    found
}

/// Polynomials without the number: between two places where one of them changes its sign, the roots of the given
/// ones in that number neither meet nor vanish. (The projection of cylindrical decomposition, as Collins has it.)
/// `None` if they become too many or too large.
pub(super) fn project(polynomials: &[Polynomial], number: usize) -> Option<Vec<Polynomial>> {
    let mut projected: Vec<Polynomial> = Vec::new();
    let mut add = |found: Polynomial| -> Option<()> {
        effort::spend(1 + projected.len());
        if effort::is_spent() {
            return None;
        }
        if !found.is_constant() && !projected.contains(&found) {
            projected.push(found);
        }
        (projected.len() <= PROJECTED_MAX).then_some(())
    };
    let mut with: Vec<(&Polynomial, Vec<Polynomial>)> = Vec::new();
    for polynomial in polynomials {
        let coefficients = polynomial.coefficients(number);
        match coefficients.len() {
            1 => add(polynomial.clone())?,
            _ => with.push((polynomial, coefficients)),
        }
    }
    for (index, (polynomial, coefficients)) in with.iter().enumerate() {
        for coefficient in coefficients {
            add(coefficient.clone())?;
        }
        if coefficients.len() > 2 {
            let slope = polynomial.derivative(number).coefficients(number);
            add(resultant(coefficients, &slope)?)?;
        }
        for (_, others) in &with[index + 1..] {
            add(resultant(coefficients, others)?)?;
        }
    }
    Some(projected)
}

/// The resultant of two polynomials in one number, given by their coefficients: 0 where they have a root in common.
fn resultant(left: &[Polynomial], right: &[Polynomial]) -> Option<Polynomial> {
    let (m, n) = (left.len() - 1, right.len() - 1);
    let size = m + n;
    if size > SYLVESTER_MAX {
        return None;
    }
    let zero = Polynomial { terms: Vec::new() };
    let mut matrix = vec![vec![zero; size]; size];
    for row in 0..n {
        for (power, coefficient) in left.iter().enumerate() {
            matrix[row][row + m - power] = coefficient.clone();
        }
    }
    for row in 0..m {
        for (power, coefficient) in right.iter().enumerate() {
            matrix[n + row][row + n - power] = coefficient.clone();
        }
    }
    determinant(&matrix, 0, &(0..size).collect::<Vec<_>>())
}

/// By expansion along the rows from `row` on, over these columns.
fn determinant(matrix: &[Vec<Polynomial>], row: usize, columns: &[usize]) -> Option<Polynomial> {
    if columns.is_empty() {
        return Some(Polynomial::constant(1.0));
    }
    let mut sum = Polynomial { terms: Vec::new() };
    for (place, column) in columns.iter().enumerate() {
        let entry = &matrix[row][*column];
        if entry.terms.is_empty() {
            continue;
        }
        let rest: Vec<usize> = columns.iter().copied().filter(|other| other != column).collect();
        let product = entry.times(&determinant(matrix, row + 1, &rest)?)?;
        sum = match place % 2 {
            0 => sum.plus(&product)?,
            _ => sum.minus(&product)?,
        };
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn linear(x: f64, y: f64, constant: f64) -> Polynomial {
        let sum = Polynomial::number(0).scaled(x).plus(&Polynomial::number(1).scaled(y)).unwrap();
        sum.plus(&Polynomial::constant(constant)).unwrap()
    }

    #[test]
    fn two_lines_meet_where_their_resultant_is_zero() {
        // y = x + 3 and y = 20 - x meet at x = 8.5.
        let projected = project(&[linear(-1.0, 1.0, -3.0), linear(1.0, 1.0, -20.0)], 1).unwrap();
        let places: Vec<f64> = projected.iter().flat_map(|p| p.turns(0, 0.0, 100.0)).collect();
        assert!(places.contains(&8.5), "{places:?}");
    }

    #[test]
    fn a_circle_turns_back_at_its_sides() {
        // x² + y² = 25 has values of y only for x from -5 to 5.
        let square = |number| Polynomial::number(number).times(&Polynomial::number(number)).unwrap();
        let circle = square(0).plus(&square(1)).unwrap().plus(&Polynomial::constant(-25.0)).unwrap();
        let projected = project(&[circle], 1).unwrap();
        let places: Vec<f64> = projected.iter().flat_map(|p| p.turns(0, -10.0, 10.0)).collect();
        for side in [-5.0, 5.0] {
            assert!(places.iter().any(|place| (place - side).abs() < 1e-6), "{places:?}");
        }
    }

    #[test]
    fn what_is_too_large_is_said() {
        let mut power = Polynomial::number(0);
        for _ in 0..4 {
            power = power.times(&power).unwrap();
        }
        assert!(power.times(&power).is_none());
    }

    proptest! {
        #[test]
        fn every_root_is_found(roots in prop::collection::vec(-20..20_i32, 1..5)) {
            let factor = |root: &i32| Polynomial::number(0).minus(&Polynomial::constant(f64::from(*root))).unwrap();
            let all = roots.iter().map(factor).reduce(|a, b| a.times(&b).unwrap()).unwrap();
            let found = all.turns(0, -30.0, 30.0);
            for root in &roots {
                // A root that occurs k times is found to about the kth root of the precision.
                prop_assert!(found.iter().any(|place| (place - f64::from(*root)).abs() < 1e-2), "{} {:?}", root, found);
            }
        }
    }
}
