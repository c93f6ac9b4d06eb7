//! Random search, the paper's first baseline: with the rules' mask and the odds of rows, and without as published.

use ndarray::{Array1, ArrayView1};

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::registry::Agent;

/// Draws among the legal rows by their odds, each as likely until it is told others.
#[derive(Default)]
pub struct MaskedRandom {
    odds: Vec<u32>,
}

impl MaskedRandom {
    /// The odds of the legal rows, 0 for others.
    fn legal_odds<'a>(&'a self, legal: ArrayView1<'a, bool>) -> impl Iterator<Item = u32> + 'a {
        (0..legal.len()).map(move |row| if legal[row] { self.odds.get(row).copied().unwrap_or(1) } else { 0 })
    }
}

impl Agent for MaskedRandom {
    fn weigh(&mut self, odds: &dyn Fn() -> Vec<u32>) {
        self.odds = odds();
    }

    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        let sum: u32 = self.legal_odds(legal).sum();
        if sum == 0 {
            return None;
        }
        let mut ticket = rng::below(rng, sum);
        self.legal_odds(legal).position(|odds| match ticket.checked_sub(odds) {
            Some(left) => {
                ticket = left;
                false
            }
            None => true,
        })
    }

    fn chances(&self, legal: ArrayView1<bool>) -> Option<Array1<f64>> {
        let sum = f64::from(self.legal_odds(legal).sum::<u32>().max(1));
        Some(self.legal_odds(legal).map(|odds| f64::from(odds) / sum).collect())
    }
}

/// Uniform over all rows, legal or not.
pub struct RawRandom;

impl Agent for RawRandom {
    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        Some(rng::below(rng, legal.len() as u32) as usize)
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
        agent.weigh(&|| vec![1, 7, 0, 3]);
        let legal = Array1::from_vec(vec![true, false, true, true]);
        let chances = agent.chances(legal.view()).unwrap();
        assert_eq!(chances.to_vec(), [0.25, 0.0, 0.0, 0.75]);
        let mut seen = [0.0; 4];
        for _ in 0..4000 {
            let row = agent.choose(&Observation::zeros(), legal.view(), &mut rng).unwrap();
            seen[row] += 1.0 / 4000.0;
        }
        assert!(seen.iter().zip(&chances).all(|(seen, chance)| (seen - chance).abs() < 0.03), "{seen:?}");
        // Without odds each open row is as likely, and is drawn as by `any`.
        let mut equal = MaskedRandom::default();
        let [mut one, mut other] = [stream(5, Stream::Exploration, 1), stream(5, Stream::Exploration, 1)];
        for _ in 0..100 {
            let row = equal.choose(&Observation::zeros(), legal.view(), &mut one);
            assert_eq!(row, any(legal.iter(), &mut other));
        }
        // Where all that is legal has no odds, nothing happens.
        let none = Array1::from_vec(vec![false, false, true, false]);
        assert_eq!(agent.choose(&Observation::zeros(), none.view(), &mut rng), None);
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
