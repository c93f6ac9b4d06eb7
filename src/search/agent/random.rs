//! Random search, the paper's first baseline: with the rules' mask and the odds of rows, and without as published.

use std::collections::BTreeMap;

use ndarray::{Array1, ArrayView1};

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_world::action::RowOdds;

use super::acting::{Agent, Mask};

/// So many rows are asked for one after another before all are. Ours: with half of the rows legal, all are in one of 65,000 steps.
const TRIES: usize = 16;

/// Draws among the legal rows by their odds, each as likely until it is told others. Actions with a rate come first: each in
/// its part of the steps, shared by its legal rows; the rows with shares have what is left of a step.
///
/// It draws a row and asks whether that one is legal; if not, it draws again. That is the distribution of a draw among the legal rows.
#[derive(Default)]
pub struct MaskedRandom {
    odds: Vec<RowOdds>,
}

impl MaskedRandom {
    /// The share of a row among those that have shares.
    fn share(&self, row: usize) -> f64 {
        match self.odds.get(row) {
            None => 1.0,
            Some(RowOdds::Share(share)) => *share,
            Some(RowOdds::Chance { .. }) => 0.0,
        }
    }

    /// The chances of the legal rows whose actions have rates, 0 for others. None, if no action has one.
    fn legal_rates(&self, mut is_legal: impl FnMut(usize) -> bool) -> Option<Vec<f64>> {
        let mut legal = vec![false; self.odds.len()];
        let mut rows: BTreeMap<usize, u32> = BTreeMap::new();
        for (row, odds) in self.odds.iter().enumerate() {
            if let RowOdds::Chance { action, .. } = odds {
                legal[row] = is_legal(row);
                *rows.entry(*action).or_default() += u32::from(legal[row]);
            }
        }
        if rows.is_empty() {
            return None;
        }
        let chance = |(row, odds): (usize, &RowOdds)| match odds {
            RowOdds::Chance { action, chance } if legal[row] => chance / f64::from(rows[action]),
            RowOdds::Chance { .. } | RowOdds::Share(_) => 0.0,
        };
        let mut chances: Vec<f64> = self.odds.iter().enumerate().map(chance).collect();
        let sum: f64 = chances.iter().sum();
        // More than one action a step there cannot be.
        if sum > 1.0 {
            chances.iter_mut().for_each(|chance| *chance /= sum);
        }
        Some(chances)
    }
}

impl Agent for MaskedRandom {
    fn weigh(&mut self, odds: &dyn Fn() -> Vec<RowOdds>) {
        self.odds = odds();
    }

    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        if let Some(rates) = self.legal_rates(|row| legal.is_legal(row)) {
            let by_rate = weighted(&rates, rng::unit(rng));
            if by_rate.is_some() {
                return by_rate;
            }
            // Nothing is left of the step but what the sum was rounded by.
            if rates.iter().sum::<f64>() >= 1.0 - 1e-12 {
                return rates.iter().rposition(|chance| *chance > 0.0);
            }
        }
        let mut shares: Vec<f64> = (0..legal.rows()).map(|row| self.share(row)).collect();
        for _ in 0..TRIES {
            let row = by_shares(&shares, rng)?;
            if legal.is_legal(row) {
                return Some(row);
            }
        }
        let legal = legal.all()?;
        shares.iter_mut().zip(&legal).filter(|(_, legal)| !**legal).for_each(|(share, _)| *share = 0.0);
        by_shares(&shares, rng)
    }

    fn chances(&self, legal: ArrayView1<bool>) -> Option<Array1<f64>> {
        let rates = self.legal_rates(|row| legal[row]).unwrap_or_else(|| vec![0.0; legal.len()]);
        let left = (1.0 - rates.iter().sum::<f64>()).max(0.0);
        let share = |row: usize| if legal[row] { self.share(row) } else { 0.0 };
        let sum: f64 = (0..legal.len()).map(share).sum();
        let part = |(row, rate): (usize, f64)| match sum > 0.0 {
            true => rate + left * share(row) / sum,
            false => rate,
        };
        Some(rates.into_iter().enumerate().map(part).collect())
    }
}

/// A row by shares that need not add up to 1; `None` if all are 0.
fn by_shares(shares: &[f64], rng: &mut Rng) -> Option<usize> {
    let sum: f64 = shares.iter().sum();
    let last = shares.iter().rposition(|share| *share > 0.0)?;
    // The sum was rounded.
    Some(weighted(shares, rng::unit(rng) * sum).unwrap_or(last))
}

/// The row in whose part of the sum of the weights a ticket falls; `None` beyond the last.
fn weighted(weights: &[f64], mut ticket: f64) -> Option<usize> {
    weights.iter().position(|weight| {
        ticket -= weight;
        ticket < 0.0
    })
}

/// Uniform over all rows, legal or not.
pub struct RawRandom;

impl Agent for RawRandom {
    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        legal.any().then(|| rng::below(rng, legal.rows() as u32) as usize)
    }

    fn looks_at_mask(&self) -> bool {
        false
    }
}

/// Any of the open rows, each as likely; none if no row is open.
pub(super) fn any<'a>(open: impl IntoIterator<Item = &'a bool>, rng: &mut Rng) -> Option<usize> {
    let rows = open.into_iter().enumerate().filter(|&(_, &is_open)| is_open);
    let rows: Vec<usize> = rows.map(|(row, _)| row).collect();
    (!rows.is_empty()).then(|| rows[rng::below(rng, rows.len() as u32) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};

    #[test]
    fn rows_come_by_their_odds() {
        let mut rng = stream(3, Stream::Exploration, 0);
        let mut agent = MaskedRandom::default();
        agent.weigh(&|| [1.0, 7.0, 0.0, 3.0].map(RowOdds::Share).to_vec());
        let legal = Array1::from_vec(vec![true, false, true, true]);
        let chances = agent.chances(legal.view()).unwrap();
        assert_eq!(chances.to_vec(), [0.25, 0.0, 0.0, 0.75]);
        let mut seen = [0.0; 4];
        for _ in 0..4000 {
            let row = agent.choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng).unwrap();
            seen[row] += 1.0 / 4000.0;
        }
        assert!(seen.iter().zip(&chances).all(|(seen, chance)| (seen - chance).abs() < 0.03), "{seen:?}");
        // Without odds each open row is as likely.
        let equal = MaskedRandom::default();
        assert_eq!(equal.chances(legal.view()).unwrap().to_vec(), [1.0 / 3.0, 0.0, 1.0 / 3.0, 1.0 / 3.0]);
        // Where all that is legal has no odds, nothing happens.
        let none = Array1::from_vec(vec![false, false, true, false]);
        assert_eq!(agent.choose(&Observation::zeros(), &mut none.to_vec(), &mut rng), None);
    }

    /// Rows that say how often they were asked for.
    struct Asked(Vec<bool>, Vec<u32>);

    impl Mask for Asked {
        fn is_legal(&mut self, row: usize) -> bool {
            self.1[row] += 1;
            self.0[row]
        }

        fn all(&mut self) -> Option<Array1<bool>> {
            self.1.iter_mut().for_each(|asked| *asked += 1);
            self.0.all()
        }

        fn rows(&self) -> usize {
            self.0.len()
        }
    }

    #[test]
    fn only_rows_that_are_drawn_are_asked_for_and_the_rare_one_comes_all_the_same() {
        let mut rng = stream(6, Stream::Exploration, 0);
        let mut agent = MaskedRandom::default();
        let mut half = Asked((0..1000).map(|row| row % 2 == 0).collect(), vec![0; 1000]);
        for _ in 0..100 {
            let row = agent.choose(&Observation::zeros(), &mut half, &mut rng).unwrap();
            assert_eq!(row % 2, 0);
        }
        let asked: u32 = half.1.iter().sum();
        assert!((150..260).contains(&asked), "{asked} of 100,000");
        // With one legal row in a thousand, all rows are asked for in nearly each step, and that row is chosen.
        let mut rare = Asked((0..1000).map(|row| row == 7).collect(), vec![0; 1000]);
        for _ in 0..20 {
            assert_eq!(agent.choose(&Observation::zeros(), &mut rare, &mut rng), Some(7));
        }
        let mut none = Asked(vec![false; 5], vec![0; 5]);
        assert_eq!(agent.choose(&Observation::zeros(), &mut none, &mut rng), None);
    }

    #[test]
    fn actions_with_rates_come_in_their_part_of_the_steps() {
        let mut rng = stream(4, Stream::Exploration, 0);
        let mut agent = MaskedRandom::default();
        let rate = |action, chance| RowOdds::Chance { action, chance };
        agent.weigh(&|| {
            vec![rate(0, 0.1), rate(0, 0.1), rate(1, 0.05), RowOdds::Share(1.0), RowOdds::Share(3.0)]
        });
        for (legal, wanted) in [
            ([true; 5], [0.05, 0.05, 0.05, 0.2125, 0.6375]),
            // One of its rows has all of an action's rate; the share of what is not legal is the others'.
            ([true, false, false, false, true], [0.1, 0.0, 0.0, 0.0, 0.9]),
            // The remaining share is no action.
            ([false, false, true, false, false], [0.0, 0.0, 0.05, 0.0, 0.0]),
        ] {
            let legal = Array1::from_vec(legal.to_vec());
            let chances = agent.chances(legal.view()).unwrap();
            assert!(chances.iter().zip(wanted).all(|(chance, wanted)| (chance - wanted).abs() < 1e-12));
            let mut seen = [0.0; 5];
            for _ in 0..20_000 {
                if let Some(row) = agent.choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng) {
                    seen[row] += 1.0 / 20_000.0;
                }
            }
            assert!(seen.iter().zip(wanted).all(|(seen, wanted)| (seen - wanted).abs() < 0.01), "{seen:?}");
        }
    }

    #[test]
    fn any_open_row_is_as_likely_as_another() {
        let mut rng = stream(3, Stream::Exploration, 0);
        let mut seen = [0_u32; 5];
        for _ in 0..3000 {
            seen[any(&[false, true, false, true, true], &mut rng).unwrap()] += 1;
        }
        assert_eq!((seen[0], seen[2]), (0, 0));
        assert!([1, 3, 4].iter().all(|&row: &usize| (900..1100).contains(&seen[row])), "{seen:?}");
        assert_eq!(any(&[false; 5], &mut rng), None);
    }
}
