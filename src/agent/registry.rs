//! What an agent is, and every agent by name. A new one is a file and one line here; the conformance
//! tests run through them all.

use ndarray::ArrayView1;

use crate::mdp::Observation;
use crate::rng::Rng;

use super::presets;
use super::presets::Preset;
use super::random;

/// Chooses rows of the action table.
pub trait Agent: Send {
    /// A new episode begins.
    fn begin(&mut self) {}

    /// The row to carry out next, or none. `legal` has shape `(rows,)`; at least one is true.
    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize>;
}

/// An agent that can be asked for by name.
pub struct Entry {
    pub name: &'static str,
    pub summary: &'static str,
    pub kind: Kind,
}

/// How one comes by an agent.
pub enum Kind {
    /// It can act at once: a fresh one for each episode.
    Ready(fn() -> Box<dyn Agent>),
    /// It has to be trained: its presets, the default first. See [`super::Learner`].
    Learning(&'static [Preset]),
}

/// Every agent of avastra.
pub const REGISTRY: &[Entry] = &[
    Entry {
        name: "none",
        summary: "nothing happens but ordinary traffic, if there is any",
        kind: Kind::Ready(|| Box::new(Idle)),
    },
    Entry {
        name: "random",
        summary: "uniform over the rows that the rules allow at the moment",
        kind: Kind::Ready(|| Box::new(random::MaskedRandom)),
    },
    Entry {
        name: "random-raw",
        summary: "uniform over all rows, as the published random search; an illegal choice is a step lost",
        kind: Kind::Ready(|| Box::new(random::RawRandom)),
    },
    Entry {
        name: "ddqn",
        summary: "the paper's agent: Double DQN with prioritised replay",
        kind: Kind::Learning(presets::DDQN),
    },
    Entry {
        name: "deep_collision",
        summary: "DeepCollision's agent: plain DQN over 12 variables",
        kind: Kind::Learning(presets::DEEP_COLLISION),
    },
];

/// Never chooses anything.
struct Idle;

impl Agent for Idle {
    fn choose(&mut self, _: &Observation, _: ArrayView1<bool>, _: &mut Rng) -> Option<usize> {
        None
    }
}

/// The agent of that name.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    REGISTRY.iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::agent::Learner;
    use crate::agent::Rows;
    use crate::rng::Stream;
    use crate::rng::stream;
    use ndarray::Array1;

    /// A fresh agent of an entry, for five rows.
    fn fresh(entry: &Entry, seed: u64) -> Vec<Box<dyn Agent>> {
        let rows = || Arc::new(Rows { allowed: vec![true; 5], environment: vec![false; 5] });
        match entry.kind {
            Kind::Ready(build) => vec![build()],
            Kind::Learning(presets) => {
                let learner = |preset: &Preset| -> Box<dyn Agent> {
                    Box::new(Learner::new(Arc::new((preset.settings)()), rows(), seed))
                };
                presets.iter().map(learner).collect()
            }
        }
    }

    #[test]
    fn every_agent_but_none_chooses_a_row_and_repeats_itself() {
        let legal = Array1::from_vec(vec![false, true, false, true, true]);
        for entry in REGISTRY {
            let choices = |seed| -> Vec<Vec<Option<usize>>> {
                let choices = |mut agent: Box<dyn Agent>| {
                    let mut rng = stream(seed, Stream::Exploration, 0);
                    agent.begin();
                    let observation = Observation::zeros();
                    let choose = |_| agent.choose(&observation, legal.view(), &mut rng);
                    (0..50).map(choose).collect()
                };
                fresh(entry, seed).into_iter().map(choices).collect()
            };
            assert_eq!(choices(1), choices(1), "{}", entry.name);
            if entry.name == "none" {
                assert!(choices(1).iter().flatten().all(Option::is_none));
                continue;
            }
            let is_row = |row: &Option<usize>| row.is_some_and(|row| row < legal.len());
            assert!(choices(1).iter().flatten().all(is_row), "{}", entry.name);
            assert_ne!(choices(1), choices(2), "{}", entry.name);
        }
    }

    #[test]
    fn masked_random_obeys_the_mask_evenly() {
        let legal = Array1::from_vec(vec![false, true, false, true, true]);
        let mut agent = random::MaskedRandom;
        let mut rng = stream(3, Stream::Exploration, 0);
        let mut seen = [0_u32; 5];
        for _ in 0..3000 {
            seen[agent.choose(&Observation::zeros(), legal.view(), &mut rng).unwrap()] += 1;
        }
        assert_eq!((seen[0], seen[2]), (0, 0));
        assert!([1, 3, 4].iter().all(|&row: &usize| (900..1100).contains(&seen[row])), "{seen:?}");
    }
}
