//! Space-filling random search: a Latin hypercube (McKay, Beckman and Conover, 1979) over rows and drawn values, in
//! place of independent draws, which leave holes and come in heaps.
//!
//! The legal rows are cut into ten parts, and so is the range of each drawn value. Ten steps in a row take one from each
//! part, in a random order. An episode has its own hypercubes, from its seed: so episodes stay independent of each other,
//! and a run is the same on any number of threads.

use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

use super::acting::{Agent, Mask};

/// Steps of one hypercube: about as many as an episode has.
const STEPS: usize = 10;
/// Axes: the row, and as many drawn values. A row that draws more leaves the others to chance.
const AXES: usize = 9;

/// Evenly spread rows and drawn values.
#[derive(Debug, Default)]
pub struct SpaceFilling {
    /// The point of this step, each axis in `[0, 1)`.
    point: [f64; AXES],
}

impl Agent for SpaceFilling {
    fn draw_shares(&mut self, step: usize, seed: u64) -> &[f64] {
        self.point = point(step, seed);
        &self.point[1..]
    }

    /// The row at the point's place among the legal ones.
    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, _: &mut Rng) -> Option<usize> {
        let legal = legal.all()?;
        let rows: Vec<usize> = (0..legal.len()).filter(|&row| legal[row]).collect();
        rows.get((self.point[0] * rows.len() as f64) as usize).copied()
    }
}

/// The point of a step: on each axis a random place in the stratum that a random order gives to the step.
fn point(step: usize, seed: u64) -> [f64; AXES] {
    let mut rng = rng::stream(seed, Stream::Search, (step / STEPS) as u64);
    let mut axis = || {
        let mut strata: [usize; STEPS] = core::array::from_fn(|stratum| stratum);
        for last in (1..STEPS).rev() {
            strata.swap(last, rng::below(&mut rng, last as u32 + 1) as usize);
        }
        let places: [f64; STEPS] =
            core::array::from_fn(|at| (strata[at] as f64 + rng::unit(&mut rng)) / STEPS as f64);
        places[step % STEPS]
    };
    core::array::from_fn(|_| axis())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array1;

    #[test]
    fn ten_steps_take_each_tenth_of_each_axis_once() {
        for seed in 0..5 {
            for axis in 0..AXES {
                let tenth = |step: usize| (point(step, seed)[axis] * 10.0) as usize;
                for first in [0, 10] {
                    let mut tenths: Vec<usize> = (first..first + 10).map(tenth).collect();
                    tenths.sort_unstable();
                    assert_eq!(tenths, (0..10).collect::<Vec<_>>());
                }
            }
        }
        assert_ne!(point(0, 1), point(0, 2));
        assert_ne!(point(0, 1)[0], point(10, 1)[0], "each hypercube has an order of its own");
    }

    #[test]
    fn rows_come_evenly_and_none_that_is_illegal() {
        let mut agent = SpaceFilling::default();
        let legal = Array1::from_vec(vec![true, false, true, true, true, true]);
        let mut rng = rng::stream(1, Stream::Exploration, 0);
        let mut seen = [0; 6];
        for step in 0..10 {
            agent.draw_shares(step, 7);
            seen[agent
                .choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng)
                .expect("rows are legal")] += 1;
        }
        assert_eq!(seen, [2, 0, 2, 2, 2, 2]);
        assert_eq!(agent.choose(&Observation::zeros(), &mut vec![false; 6], &mut rng), None);
    }
}
