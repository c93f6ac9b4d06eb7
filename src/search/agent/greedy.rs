//! Greedy search: tries every legal row one observation period ahead and takes the most dangerous.
//!
//! DeepCollision's third baseline, which rolls the simulator back after each of its actions. There
//! the highest collision probability wins. Here a collision that counts comes first, and one that does
//! not count is worth nothing: the agent is judged by those that count.

use ndarray::ArrayView1;

use crate::mdp::Observation;
use avastra_base::rng::Rng;

use super::branch::{Branch, Trial};
use super::random::any;
use super::registry::Agent;

/// One step of lookahead.
#[derive(Debug, Clone, Default)]
pub struct Greedy {
    /// Time driven in branches in this episode, s.
    branched_s: f64,
}

impl Agent for Greedy {
    fn begin(&mut self) {
        self.branched_s = 0.0;
    }

    /// Without a branch to look into, every row is as good as any other.
    fn choose(&mut self, _: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        any(legal, rng)
    }

    fn choose_ahead(
        &mut self,
        _: &Observation,
        legal: ArrayView1<bool>,
        branch: &Branch<'_>,
        rng: &mut Rng,
    ) -> Option<usize> {
        let mut most = f64::NEG_INFINITY;
        let mut best = vec![false; legal.len()];
        for row in (0..legal.len()).filter(|&row| legal[row]) {
            let trial = branch(row);
            self.branched_s += trial.simulated_s;
            let danger = danger(&trial);
            if danger > most {
                best.fill(false);
                most = danger;
            }
            best[row] = danger == most;
        }
        any(&best, rng)
    }

    fn looks_ahead(&self) -> bool {
        true
    }

    fn branched_s(&self) -> f64 {
        self.branched_s
    }
}

/// How dangerous an outcome is: a collision that counts most of all, one that does not count not at all.
fn danger(trial: &Trial) -> f64 {
    match trial {
        Trial { counted: true, .. } => 2.0,
        Trial { collided: true, .. } => 0.0,
        Trial { proc, .. } => *proc,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};
    use ndarray::Array1;

    fn trial(proc: f64, collided: bool, counted: bool) -> Trial {
        Trial { proc, collided, counted, simulated_s: 6.0 }
    }

    #[test]
    fn what_counts_comes_first_and_equals_take_turns() {
        let legal = Array1::from_vec(vec![true, true, true, false, true]);
        let chosen = |trials: Vec<Trial>| {
            let mut rng = stream(1, Stream::Exploration, 0);
            let mut agent = Greedy::default();
            let mut seen = [0; 5];
            for _ in 0..100 {
                agent.begin();
                let branch = |row: usize| trials[row];
                let row = agent.choose_ahead(&Observation::zeros(), legal.view(), &branch, &mut rng);
                seen[row.unwrap()] += 1;
                assert_eq!(agent.branched_s(), 24.0);
            }
            seen
        };
        let quiet = trial(0.4, false, false);
        let (close, hit) = (trial(0.9, false, false), trial(1.0, true, false));
        let counts = trial(1.0, true, true);
        assert_eq!(chosen(vec![quiet, close, counts, counts, hit]), [0, 0, 100, 0, 0]);
        assert_eq!(chosen(vec![quiet, close, hit, counts, quiet]), [0, 100, 0, 0, 0]);
        let seen = chosen(vec![close, close, quiet, close, close]);
        assert!(seen[0] > 15 && seen[1] > 15 && seen[4] > 15 && seen[2] + seen[3] == 0, "{seen:?}");
    }
}
