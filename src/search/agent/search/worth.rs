//! The record of what choices have led to, by situation and row: a crash that counts is worth 1.
//!
//! A situation's own record is short, so the mean of a row in it is shrunk towards the row's mean in all
//! situations, and that towards the mean of all rows.

use ndarray::ArrayView1;

use crate::agent::trajectory::Trajectory;
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::situation::SITUATIONS;

/// How many worths were noted, and their sum.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Tally {
    count: f64,
    sum: f64,
}

impl Tally {
    pub fn note(&mut self, worth: f64) {
        self.count += 1.0;
        self.sum += worth;
    }

    /// The mean, shrunk towards `prior`, which weighs as much as `weight` observations.
    pub fn mean(&self, prior: f64, weight: f64) -> f64 {
        (self.sum + prior * weight) / (self.count + weight)
    }
}

/// How to treat a row whose record is short. The number is the assumed standard deviation of the worth of
/// one choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// The row is worth trying: noise is added to its mean.
    Try(f64),
    /// The record may be luck: its mean is lowered. Otherwise the best of many rows is a lucky one.
    Avoid(f64),
}

impl Doubt {
    /// How far a mean is moved for it; `weight` as in [`Tally::mean`].
    pub fn shift(self, tally: &Tally, weight: f64, rng: &mut Rng) -> f64 {
        let error = 1.0 / (tally.count + weight).sqrt();
        match self {
            Doubt::Try(spread) => spread * error * rng::normal(rng),
            Doubt::Avoid(spread) => -spread * error,
        }
    }
}

/// The record.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Worth {
    rows: usize,
    all: Tally,
    /// By row.
    of_row: Vec<Tally>,
    /// By situation, then by row.
    own: Vec<Tally>,
}

impl Worth {
    pub fn new(rows: usize) -> Worth {
        let none = Tally::default();
        Worth { rows, all: none, of_row: vec![none; rows], own: vec![none; rows * SITUATIONS] }
    }

    /// Whether it is a record of this many rows.
    pub fn is_of(&self, rows: usize) -> bool {
        self.rows == rows && self.of_row.len() == rows && self.own.len() == rows * SITUATIONS
    }

    pub fn note(&mut self, situation: u32, row: usize, worth: f64) {
        self.all.note(worth);
        self.of_row[row].note(worth);
        self.own[situation as usize * self.rows + row].note(worth);
    }

    /// The legal row of the highest expected worth after doubt; any of the highest if there are several.
    pub fn best(
        &self,
        situation: u32,
        legal: ArrayView1<bool>,
        weight: f64,
        doubt: Doubt,
        rng: &mut Rng,
    ) -> Option<usize> {
        let mut most = f64::NEG_INFINITY;
        let mut best = Vec::new();
        for row in (0..self.rows).filter(|&row| legal[row]) {
            let own = &self.own[situation as usize * self.rows + row];
            let expected = own.mean(self.of_row[row].mean(self.all.mean(0.0, 1.0), weight), weight);
            let value = expected + doubt.shift(own, weight, rng);
            if value > most {
                best.clear();
                most = value;
            }
            if value == most {
                best.push(row);
            }
        }
        (!best.is_empty()).then(|| best[rng::below(rng, best.len() as u32) as usize])
    }
}

/// The worth of each choice of an episode: 1 for each crash that counts whose obstacle it made appear, and
/// `discount` to the power of n if it came n choices before such a choice. A crash with an obstacle that none
/// of these choices made appear is credited to the choice at which it happened.
pub fn worths(episode: &Trajectory, discount: f64) -> Vec<f64> {
    let mut worths = vec![0.0; episode.steps.len()];
    for (at, step) in episode.steps.iter().enumerate() {
        for crash in &step.crashes {
            let mut worth = 1.0;
            for earlier in (0..=crash.unwrap_or(at)).rev() {
                worths[earlier] += worth;
                worth *= discount;
            }
        }
    }
    worths
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};
    use ndarray::Array1;

    #[test]
    fn a_short_record_leans_on_all_others() {
        let mut worth = Worth::new(3);
        let mut rng = stream(1, Stream::Search, 0);
        let legal = Array1::from_elem(3, true);
        let best = |worth: &Worth, situation, rng: &mut Rng| {
            worth.best(situation, legal.view(), 10.0, Doubt::Avoid(0.3), rng).unwrap()
        };
        for _ in 0..50 {
            worth.note(4, 1, 0.5);
            worth.note(4, 0, 0.0);
        }
        assert_eq!(best(&worth, 4, &mut rng), 1);
        assert_eq!(best(&worth, 9, &mut rng), 1, "an unknown situation takes what is good elsewhere");
        for _ in 0..50 {
            worth.note(9, 1, 0.0);
            worth.note(9, 2, 0.4);
        }
        assert_eq!((best(&worth, 9, &mut rng), best(&worth, 4, &mut rng)), (2, 1));
        // One lucky choice is not yet better than fifty good ones.
        worth.note(4, 0, 1.0);
        assert_eq!(best(&worth, 4, &mut rng), 1);
        let masked = Array1::from_vec(vec![true, false, false]);
        assert_eq!(worth.best(4, masked.view(), 10.0, Doubt::Try(0.3), &mut rng), Some(0));
    }
}
