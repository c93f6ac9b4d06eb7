//! What a search did in an episode, so that it can be done again.

use ndarray::ArrayView1;

use crate::agent::q_policy::any;
use crate::mdp::{Observation, variable};
use crate::rng;
use crate::rng::Rng;

/// A choice that gives the same action wherever it is made again at the same moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Gene {
    pub row: u32,
    /// Seed of the draws of its step.
    pub draw_seed: u64,
}

impl Gene {
    /// Any row, with draws of its own.
    pub fn random(rows: usize, rng: &mut Rng) -> Gene {
        Gene { row: rng::below(rng, rows as u32), draw_seed: seed(rng) }
    }
}

/// A seed for draws.
pub fn seed(rng: &mut Rng) -> u64 {
    use rand::Rng as _;
    rng.next_u64()
}

/// The choices of an episode by step; `None` where nothing could be chosen, or has not been yet.
pub type Genes = Vec<Option<Gene>>;

/// Notes a choice.
pub fn note(genes: &mut Genes, step: usize, gene: Gene) {
    if genes.len() <= step {
        genes.resize(step + 1, None);
    }
    genes[step] = Some(gene);
}

/// Where an episode began, m: enough to tell roads apart.
pub fn start_of(observation: &Observation) -> [f32; 2] {
    ["egoX", "egoY"].map(|name| observation.get(variable(name).expect("it is a variable")))
}

/// Any of the legal rows, each as likely.
pub fn any_legal(legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
    any(&legal.to_vec(), rng)
}
