//! Proportional prioritised replay (Schaul et al., 2016), and with exponent 0 the plain kind.

use crate::rng;
use crate::rng::Rng;

use super::sum_tree::SumTree;

/// What a learner learns from: a state, what was done in it, and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Features of the state, shape `(inputs,)`.
    pub inputs: Vec<f32>,
    pub row: u32,
    /// Discounted sum of the rewards on the way to the next state.
    pub reward: f32,
    /// What the value of the next state is multiplied by: 0 if there is none.
    pub discount: f32,
    pub next_inputs: Vec<f32>,
    /// Rows that may be chosen in the next state, shape `(rows,)`.
    pub next_legal: Vec<bool>,
}

/// How TD errors become priorities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priorities {
    /// α of the paper on PER: 0 draws evenly, 1 in full proportion.
    pub exponent: f64,
    /// Added to every TD error, so that none is never drawn.
    pub floor: f64,
    /// Priority of the first transition, before there is any TD error.
    pub first: f64,
}

/// A transition that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub index: usize,
    /// Importance weight, in `(0, 1]`, the largest of its batch being 1.
    pub weight: f32,
}

/// The most recent transitions, up to a capacity.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    priorities: Priorities,
    capacity: usize,
    transitions: Vec<Transition>,
    /// Where the next transition goes once the buffer is full.
    next: usize,
    tree: SumTree,
    /// Largest priority so far: what a newcomer gets, so that it is looked at soon.
    priority_max: f64,
}

impl Replay {
    /// Holds `capacity` transitions, at least 1.
    pub fn new(capacity: usize, priorities: Priorities) -> Replay {
        Replay {
            priorities,
            capacity,
            transitions: Vec::new(),
            next: 0,
            tree: SumTree::new(capacity),
            priority_max: priorities.first,
        }
    }

    /// A buffer as it was: transitions with their priorities by index.
    pub(in crate::agent) fn restored(
        capacity: usize,
        priorities: Priorities,
        items: Vec<(Transition, f64)>,
        next: usize,
        priority_max: f64,
    ) -> Replay {
        let mut replay = Replay { next, priority_max, ..Replay::new(capacity, priorities) };
        for (index, (transition, priority)) in items.into_iter().enumerate() {
            replay.transitions.push(transition);
            replay.tree.set(index, priority);
        }
        replay
    }

    /// Every transition with its priority, the place of the next one, and the largest priority.
    pub(in crate::agent) fn contents(&self) -> (impl Iterator<Item = (&Transition, f64)>, usize, f64) {
        let items = self.transitions.iter().enumerate().map(|(at, one)| (one, self.tree.get(at)));
        (items, self.next, self.priority_max)
    }

    pub fn len(&self) -> usize {
        self.transitions.len()
    }

    /// The last transitions, at most `count`, the newest first.
    pub fn latest(&self, count: usize) -> impl Iterator<Item = &Transition> {
        let newest = self.next + self.capacity - 1;
        (0..count.min(self.len())).map(move |back| &self.transitions[(newest - back) % self.capacity])
    }

    pub fn get(&self, index: usize) -> &Transition {
        &self.transitions[index]
    }

    /// Keeps a transition, in place of the oldest if there is no more room.
    pub fn push(&mut self, transition: Transition) {
        let index = if self.transitions.len() < self.capacity {
            self.transitions.push(transition);
            self.transitions.len() - 1
        } else {
            self.transitions[self.next] = transition;
            self.next
        };
        self.tree.set(index, self.priority_max);
        self.next = (index + 1) % self.capacity;
    }

    /// Draws a batch, one from each of `count` equal parts of the whole mass, with replacement.
    ///
    /// `importance_exponent` (β) makes up for the uneven draw: 0 not at all, 1 in full. The buffer
    /// must not be empty.
    pub fn sample(&self, count: usize, importance_exponent: f64, rng: &mut Rng) -> Vec<Sample> {
        let part = self.tree.total() / count as f64;
        let mut samples = Vec::with_capacity(count);
        let mut weights = Vec::with_capacity(count);
        for nth in 0..count {
            let index = self.tree.find(part * (nth as f64 + rng::unit(rng)));
            let probability = self.tree.get(index) / self.tree.total();
            weights.push(libm::pow(self.len() as f64 * probability, -importance_exponent));
            samples.push(index);
        }
        let weight_max = weights.iter().copied().fold(0.0, f64::max);
        let drawn = samples.into_iter().zip(weights);
        drawn.map(|(index, weight)| Sample { index, weight: (weight / weight_max) as f32 }).collect()
    }

    /// Sets a priority by a new TD error.
    pub fn update(&mut self, index: usize, td_error: f64) {
        let priority = libm::pow(td_error.abs() + self.priorities.floor, self.priorities.exponent);
        self.priority_max = self.priority_max.max(priority);
        self.tree.set(index, priority);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Stream, stream};

    fn transition(reward: f32) -> Transition {
        let (inputs, next_inputs) = (vec![0.0], vec![0.0]);
        Transition { inputs, row: 0, reward, discount: 0.9, next_inputs, next_legal: vec![true] }
    }

    fn filled(exponent: f64) -> Replay {
        let mut replay = Replay::new(5, Priorities { exponent, floor: 0.1, first: 1.0 });
        for reward in 0..5 {
            replay.push(transition(reward as f32));
            replay.update(reward, reward as f64);
        }
        replay
    }

    #[test]
    fn it_draws_and_weighs_by_the_formula() {
        for exponent in [0.0, 0.6, 1.0] {
            let (replay, mut rng) = (filled(exponent), stream(3, Stream::Replay, 0));
            let mass = |index: usize| libm::pow(index as f64 + 0.1, exponent);
            let total: f64 = (0..5).map(mass).sum();
            let mut drawn = [0_u32; 5];
            for _ in 0..2000 {
                let samples = replay.sample(10, 0.5, &mut rng);
                let weight = |index: usize| libm::pow(5.0 * mass(index) / total, -0.5);
                let most = samples.iter().map(|sample| weight(sample.index)).fold(0.0, f64::max);
                for sample in samples {
                    drawn[sample.index] += 1;
                    let expected = weight(sample.index) / most;
                    assert!((f64::from(sample.weight) - expected).abs() < 1e-6);
                }
            }
            for (index, &count) in drawn.iter().enumerate() {
                let (found, expected) = (f64::from(count) / 20_000.0, mass(index) / total);
                assert!((found - expected).abs() < 0.01, "{exponent} {index}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_oldest_gives_way_and_newcomers_come_first() {
        let mut replay = filled(1.0);
        replay.push(transition(9.0));
        assert_eq!((replay.len(), replay.get(0).reward), (5, 9.0));
        assert_eq!(replay.tree.get(0), 4.1);
        replay.push(transition(8.0));
        assert_eq!((replay.get(0).reward, replay.get(1).reward), (9.0, 8.0));
        let latest = |replay: &Replay, count| replay.latest(count).map(|one| one.reward).collect::<Vec<_>>();
        assert_eq!(latest(&replay, 3), [8.0, 9.0, 4.0]);
        assert_eq!(latest(&replay, 9), [8.0, 9.0, 4.0, 3.0, 2.0]);
        let mut short = Replay::new(5, Priorities { exponent: 1.0, floor: 0.1, first: 1.0 });
        short.push(transition(7.0));
        assert_eq!(latest(&short, 3), [7.0]);
    }
}
