//! What a search did in an episode, so that it can be done again.

use ndarray::ArrayView1;

use crate::agent::random::any;
use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

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

    /// Its row at this step. One that is not legal gives way, for good, to a legal one that follows from the gene and the step
    /// alone; `None` if there is none.
    pub fn legal_row(&mut self, step: usize, legal: ArrayView1<bool>) -> Option<usize> {
        if !legal[self.row as usize] {
            let mut rng = rng::stream(self.draw_seed, Stream::Search, step as u64);
            self.row = any(legal, &mut rng)? as u32;
        }
        Some(self.row as usize)
    }
}

/// A seed for draws.
pub fn seed(rng: &mut Rng) -> u64 {
    use rand::Rng as _;
    rng.next_u64()
}

/// Position of the ego vehicle at the start of an episode, m: enough to tell roads apart.
pub fn start_of(observation: &Observation) -> [f32; 2] {
    ["egoX", "egoY"].map(|name| observation.named(name))
}
