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
        let choices = legal.iter().filter(|&&is_legal| is_legal).count();
        let nth = rng::below(rng, choices as u32) as usize;
        let mut rows = legal.iter().enumerate().filter(|&(_, &is_legal)| is_legal).map(|(row, _)| row);
        rows.nth(nth)
    }
}

/// Uniform over all rows, legal or not.
pub struct RawRandom;

impl Agent for RawRandom {
    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        Some(rng::below(rng, legal.len() as u32) as usize)
    }
}
