//! Acting by scripts that a search has found: the same rows in the same steps, on any start.
//!
//! Values are drawn anew: the old draws fitted only the moment in which they were made.

use ndarray::ArrayView1;

use crate::agent::random::any;
use crate::agent::registry::Agent;
use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::genes::start_of;

/// A script and what came of it when it was played.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// Where the ego vehicle started, m.
    pub start: [f32; 2],
    pub rows: Vec<u32>,
    /// Collisions that counted.
    pub crashes: usize,
    pub fitness: f64,
}

/// Adds a script to the best, of which `most` are kept for each start: those with most collisions that
/// count, then the fittest.
pub fn keep(best: &mut Vec<Found>, found: Found, most: usize) {
    let start = found.start;
    if best.iter().any(|known| known.rows == found.rows && known.start == start) {
        return;
    }
    best.push(found);
    best.sort_by(|a, b| b.crashes.cmp(&a.crashes).then(b.fitness.total_cmp(&a.fitness)));
    let mut seen = 0;
    best.retain(|known| {
        seen += usize::from(known.start == start);
        known.start != start || seen <= most
    });
}

/// Plays one of the scripts, chosen at random among those that begin nearest; where the script's row is not
/// legal, a random legal one.
#[derive(Debug, Clone)]
pub struct Scripts {
    scripts: Vec<Found>,
    chosen: Option<usize>,
    step: usize,
}

impl Scripts {
    pub fn new(scripts: Vec<Found>) -> Scripts {
        Scripts { scripts, chosen: None, step: 0 }
    }

    fn choose_script(&self, observation: &Observation, rng: &mut Rng) -> Option<usize> {
        let [x_m, y_m] = start_of(observation);
        let apart = |found: &Found| {
            let (dx_m, dy_m) = (found.start[0] - x_m, found.start[1] - y_m);
            dx_m * dx_m + dy_m * dy_m
        };
        let least = self.scripts.iter().map(apart).min_by(f32::total_cmp)?;
        let near: Vec<usize> =
            (0..self.scripts.len()).filter(|&index| apart(&self.scripts[index]) <= least).collect();
        Some(near[rng::below(rng, near.len() as u32) as usize])
    }
}

impl Agent for Scripts {
    fn begin(&mut self) {
        self.chosen = None;
    }

    fn draw_seed(&mut self, step: usize) -> Option<u64> {
        self.step = step;
        None
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        self.chosen = self.chosen.or_else(|| self.choose_script(observation, rng));
        let script = self.chosen.map(|chosen| &self.scripts[chosen].rows);
        let row = script.map(|rows| rows[self.step % rows.len()] as usize);
        row.filter(|&row| legal[row]).or_else(|| any(legal, rng))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::variable;
    use avastra_base::rng::{Stream, stream};
    use ndarray::Array1;

    #[test]
    fn the_best_for_a_start_are_kept_and_played_there() {
        let found = |x_m: f32, row: u32, crashes| Found {
            start: [x_m, 0.0],
            rows: vec![row, row],
            crashes,
            fitness: f64::from(row),
        };
        let mut best = Vec::new();
        for (start, row, crashes) in [(0.0, 0, 1), (0.0, 1, 0), (0.0, 2, 0), (50.0, 3, 0), (0.0, 2, 0)] {
            keep(&mut best, found(start, row, crashes), 2);
        }
        let rows: Vec<u32> = best.iter().map(|found| found.rows[0]).collect();
        assert_eq!(rows, [0, 3, 2]);

        let mut agent = Scripts::new(best);
        let mut rng = stream(1, Stream::Exploration, 0);
        let legal = Array1::from_elem(5, true);
        let mut there = Observation::zeros();
        there.beyond[variable("egoX").unwrap() - crate::mdp::STATE_LEN] = 49.0;
        agent.begin();
        assert_eq!(agent.choose(&there, legal.view(), &mut rng), Some(3));
        let mut seen = [0; 5];
        for _ in 0..100 {
            agent.begin();
            seen[agent.choose(&Observation::zeros(), legal.view(), &mut rng).unwrap()] += 1;
        }
        assert!(seen[0] > 30 && seen[2] > 30 && seen[0] + seen[2] == 100, "{seen:?}");
    }
}
