//! Random search, the paper's first baseline: with the rules' mask, and without as published.

use ndarray::ArrayView1;

use crate::mdp::Observation;
use crate::rng;
use crate::rng::Rng;

use super::registry::Agent;

/// Uniform over the legal rows.
pub struct MaskedRandom;

impl Agent for MaskedRandom {
    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        any(legal, rng)
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
    use crate::rng::{Stream, stream};

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
