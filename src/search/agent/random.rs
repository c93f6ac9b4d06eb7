//! Random search, the paper's first baseline: with the rules' mask and the odds of rows, and without as published.

use std::collections::BTreeMap;

use ndarray::{Array1, ArrayView1};

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_world::action::RowOdds;

use super::acting::{Agent, Mask};

/// Draws among the legal rows by their odds, each as likely until it is told others. Actions with a rate come first: each in
/// its part of the steps, shared by its legal rows; the rows with shares have what is left of a step.
#[derive(Default)]
pub struct MaskedRandom {
    odds: Vec<RowOdds>,
}

impl MaskedRandom {
    /// The shares of the legal rows, 0 for others.
    fn legal_shares<'a>(&'a self, legal: ArrayView1<'a, bool>) -> impl Iterator<Item = u32> + 'a {
        (0..legal.len()).map(move |row| match self.odds.get(row) {
            _ if !legal[row] => 0,
            None => 1,
            Some(RowOdds::Share(share)) => *share,
            Some(RowOdds::Chance { .. }) => 0,
        })
    }

    /// The chances of the legal rows whose actions have rates, 0 for others. None, if no action has one.
    fn legal_rates(&self, legal: ArrayView1<bool>) -> Option<Vec<f64>> {
        let mut rows: BTreeMap<usize, u32> = BTreeMap::new();
        for (row, odds) in self.odds.iter().enumerate() {
            if let RowOdds::Chance { action, .. } = odds {
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
        let legal = legal.all()?;
        let legal = legal.view();
        if let Some(rates) = self.legal_rates(legal) {
            let mut ticket = rng::unit(rng);
            let by_rate = rates.iter().position(|chance| {
                ticket -= chance;
                ticket < 0.0
            });
            if by_rate.is_some() {
                return by_rate;
            }
            // Nothing is left of the step but what the sum was rounded by.
            if rates.iter().sum::<f64>() >= 1.0 - 1e-12 {
                return rates.iter().rposition(|chance| *chance > 0.0);
            }
        }
        let sum: u32 = self.legal_shares(legal).sum();
        if sum == 0 {
            return None;
        }
        let mut ticket = rng::below(rng, sum);
        self.legal_shares(legal).position(|share| match ticket.checked_sub(share) {
            Some(left) => {
                ticket = left;
                false
            }
            None => true,
        })
    }

    fn chances(&self, legal: ArrayView1<bool>) -> Option<Array1<f64>> {
        let rates = self.legal_rates(legal).unwrap_or_else(|| vec![0.0; legal.len()]);
        let left = (1.0 - rates.iter().sum::<f64>()).max(0.0);
        let sum = f64::from(self.legal_shares(legal).sum::<u32>().max(1));
        let shares = self.legal_shares(legal).map(|share| left * f64::from(share) / sum);
        Some(shares.zip(rates).map(|(share, rate)| share + rate).collect())
    }
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
        agent.weigh(&|| [1, 7, 0, 3].map(RowOdds::Share).to_vec());
        let legal = Array1::from_vec(vec![true, false, true, true]);
        let chances = agent.chances(legal.view()).unwrap();
        assert_eq!(chances.to_vec(), [0.25, 0.0, 0.0, 0.75]);
        let mut seen = [0.0; 4];
        for _ in 0..4000 {
            let row = agent.choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng).unwrap();
            seen[row] += 1.0 / 4000.0;
        }
        assert!(seen.iter().zip(&chances).all(|(seen, chance)| (seen - chance).abs() < 0.03), "{seen:?}");
        // Without odds each open row is as likely, and is drawn as by `any`.
        let mut equal = MaskedRandom::default();
        let [mut one, mut other] = [stream(5, Stream::Exploration, 1), stream(5, Stream::Exploration, 1)];
        for _ in 0..100 {
            let row = equal.choose(&Observation::zeros(), &mut legal.to_vec(), &mut one);
            assert_eq!(row, any(legal.iter(), &mut other));
        }
        // Where all that is legal has no odds, nothing happens.
        let none = Array1::from_vec(vec![false, false, true, false]);
        assert_eq!(agent.choose(&Observation::zeros(), &mut none.to_vec(), &mut rng), None);
    }

    #[test]
    fn actions_with_rates_come_in_their_part_of_the_steps() {
        let mut rng = stream(4, Stream::Exploration, 0);
        let mut agent = MaskedRandom::default();
        let rate = |action, chance| RowOdds::Chance { action, chance };
        agent
            .weigh(&|| vec![rate(0, 0.1), rate(0, 0.1), rate(1, 0.05), RowOdds::Share(1), RowOdds::Share(3)]);
        for (legal, wanted) in [
            ([true; 5], [0.05, 0.05, 0.05, 0.2125, 0.6375]),
            // One of its rows has all of an action's rate; the share of what is not legal is the others'.
            ([true, false, false, false, true], [0.1, 0.0, 0.0, 0.0, 0.9]),
            // What is left is no action.
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
