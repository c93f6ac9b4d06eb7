//! Piecewise cubic polynomials along a road: widths, borders and lane offsets.

use core::ops::{Add, Mul, Sub};

/// A function value with its first and second derivative by the station.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet {
    pub value: f64,
    pub first: f64,
    pub second: f64,
}

impl Add for Jet {
    type Output = Jet;

    fn add(self, other: Jet) -> Jet {
        Jet {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }
}

impl Sub for Jet {
    type Output = Jet;

    fn sub(self, other: Jet) -> Jet {
        self + other * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Jet;

    fn mul(self, factor: f64) -> Jet {
        Jet { value: self.value * factor, first: self.first * factor, second: self.second * factor }
    }
}

/// `a + b x + c x² + d x³` with `x` the distance from `begin_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    pub begin_m: f64,
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
}

/// Cubics by rising begin. Each holds until the next begins; the first one also holds before its begin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cubics(Vec<Cubic>);

impl Cubics {
    pub fn new(mut pieces: Vec<Cubic>) -> Cubics {
        // The sort is stable: of two pieces that begin at one station, the later one in the file holds.
        pieces.sort_by(|x, y| x.begin_m.total_cmp(&y.begin_m));
        Cubics(pieces)
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn beginnings(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|piece| piece.begin_m)
    }

    /// The beginnings of pieces that lie between two stations, m.
    pub fn beginnings_between(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = f64> {
        let first = self.0.partition_point(|piece| piece.begin_m <= from_m);
        self.0[first..].iter().map(|piece| piece.begin_m).take_while(move |at_m| *at_m < to_m)
    }

    /// Whether the value is the same everywhere.
    pub fn is_constant(&self) -> bool {
        let is_flat = |piece: &Cubic| piece.b == 0.0 && piece.c == 0.0 && piece.d == 0.0;
        self.0.len() < 2 && self.0.iter().all(is_flat)
    }

    /// The pieces that hold between two distances, counted from the first of them.
    pub fn between(&self, from_m: f64, to_m: f64) -> Cubics {
        let begun = self.0.partition_point(|piece| piece.begin_m <= from_m).max(1) - 1;
        let there = self.0.get(begun..).unwrap_or_default().iter();
        let there = there.take_while(|piece| piece.begin_m < to_m || piece.begin_m <= from_m);
        Cubics(there.map(|piece| Cubic { begin_m: piece.begin_m - from_m, ..*piece }).collect())
    }

    /// 0 if there are no pieces.
    pub fn at(&self, station_m: f64) -> Jet {
        let after = self.0.partition_point(|piece| piece.begin_m <= station_m);
        let Some(piece) = self.0.get(after.max(1) - 1) else {
            return Jet::default();
        };
        let Cubic { begin_m, a, b, c, d } = *piece;
        let x = station_m - begin_m;
        Jet {
            value: a + x * (b + x * (c + x * d)),
            first: b + x * (2.0 * c + x * 3.0 * d),
            second: 2.0 * c + x * 6.0 * d,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_piece_holds_until_the_next() {
        let pieces = Cubics::new(vec![
            Cubic { begin_m: 10.0, a: 5.0, b: 0.0, c: 1.0, d: 2.0 },
            Cubic { begin_m: 0.0, a: 3.0, b: 0.5, c: 0.0, d: 0.0 },
        ]);
        assert_eq!(pieces.at(4.0), Jet { value: 5.0, first: 0.5, second: 0.0 });
        assert_eq!(pieces.at(12.0), Jet { value: 25.0, first: 28.0, second: 26.0 });
        assert_eq!(Cubics::default().at(1.0), Jet::default());
        assert_eq!(pieces.beginnings_between(-1.0, 10.0).collect::<Vec<_>>(), [0.0]);
        assert_eq!(pieces.beginnings_between(0.0, 11.0).collect::<Vec<_>>(), [10.0]);
        assert!(!pieces.is_constant() && Cubics::default().is_constant());
    }
}
