//! What an agent is, and every agent by name. A new one is a file and one line here; the conformance
//! tests run through them all.

use ndarray::ArrayView1;

use crate::mdp::StateVector;
use crate::rng::Rng;

use super::random;

/// Chooses rows of the action table.
pub trait Agent: Send {
    /// The row to carry out next. `legal` has shape `(rows,)`; at least one is true.
    fn choose(&mut self, state: &StateVector, legal: ArrayView1<bool>, rng: &mut Rng) -> usize;
}

/// An agent that can be asked for by name.
pub struct Entry {
    pub name: &'static str,
    pub summary: &'static str,
    /// A fresh agent for one episode.
    pub build: fn() -> Box<dyn Agent>,
}

/// Every agent of avastra.
pub const REGISTRY: &[Entry] = &[
    Entry {
        name: "random",
        summary: "uniform over the rows that the rules allow at the moment",
        build: || Box::new(random::MaskedRandom),
    },
    Entry {
        name: "random-raw",
        summary: "uniform over all rows, as the published random search; an illegal choice is a step lost",
        build: || Box::new(random::RawRandom),
    },
];

/// The agent of that name.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    REGISTRY.iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::STATE_LEN;
    use crate::rng::Stream;
    use crate::rng::stream;
    use ndarray::Array1;

    #[test]
    fn every_agent_chooses_a_row_and_repeats_itself() {
        let state = StateVector::zeros(STATE_LEN);
        let legal = Array1::from_vec(vec![false, true, false, true, true]);
        for entry in REGISTRY {
            let choices = |seed| -> Vec<usize> {
                let mut agent = (entry.build)();
                let mut rng = stream(seed, Stream::Exploration, 0);
                (0..50).map(|_| agent.choose(&state, legal.view(), &mut rng)).collect()
            };
            assert!(choices(1).iter().all(|&row| row < legal.len()), "{}", entry.name);
            assert_eq!(choices(1), choices(1), "{}", entry.name);
            assert_ne!(choices(1), choices(2), "{}", entry.name);
        }
    }

    #[test]
    fn masked_random_obeys_the_mask_evenly() {
        let state = StateVector::zeros(STATE_LEN);
        let legal = Array1::from_vec(vec![false, true, false, true, true]);
        let mut agent = (by_name("random").expect("it is registered").build)();
        let mut rng = stream(3, Stream::Exploration, 0);
        let mut seen = [0_u32; 5];
        for _ in 0..3000 {
            seen[agent.choose(&state, legal.view(), &mut rng)] += 1;
        }
        assert_eq!((seen[0], seen[2]), (0, 0));
        assert!([1, 3, 4].iter().all(|&row: &usize| (900..1100).contains(&seen[row])), "{seen:?}");
    }
}
