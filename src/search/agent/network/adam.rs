//! Adam (Kingma and Ba, 2015, Algorithm 1), with the operations in PyTorch's order.

use crate::agent::checkpoint::{Reader, Writer};

/// The optimiser and its running moments, a mean and a square for each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    learning_rate: f64,
    mean: Vec<f32>,
    square: Vec<f32>,
    /// Each decay rate to the power of the number of steps, in `f64` so that it does not drift.
    mean_power: f64,
    square_power: f64,
}

/// Decay rates of the two moments, and the term that keeps the quotient finite: the algorithm's defaults,
/// which all our sources use.
const MEAN_DECAY: f64 = 0.9;
const SQUARE_DECAY: f64 = 0.999;
const FLOOR: f32 = 1e-8;

impl Adam {
    pub(in crate::agent) fn save(&self, bytes: &mut Writer) {
        bytes.f32s(&self.mean);
        bytes.f32s(&self.square);
        bytes.f64s(&[self.mean_power, self.square_power]);
    }

    /// Takes on the moments that were saved; `None` if the bytes end too soon.
    pub(in crate::agent) fn restore(&mut self, bytes: &mut Reader<'_>) -> Option<()> {
        let parameters = self.mean.len();
        (self.mean, self.square) = (bytes.f32s(parameters)?, bytes.f32s(parameters)?);
        let powers = bytes.f64s(2)?;
        (self.mean_power, self.square_power) = (powers[0], powers[1]);
        Some(())
    }

    /// For a network with `parameters` parameters.
    pub fn new(parameters: usize, learning_rate: f64) -> Adam {
        Adam {
            learning_rate,
            mean: vec![0.0; parameters],
            square: vec![0.0; parameters],
            mean_power: 1.0,
            square_power: 1.0,
        }
    }

    /// One step down the gradient.
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32]) {
        assert_eq!(parameters.len(), gradient.len(), "one slope for each parameter");
        assert_eq!(parameters.len(), self.mean.len(), "the optimiser is of another network");
        self.mean_power *= MEAN_DECAY;
        self.square_power *= SQUARE_DECAY;
        let rate = (self.learning_rate / (1.0 - self.mean_power)) as f32;
        let spread = libm::sqrt(1.0 - self.square_power) as f32;
        let (mean_share, square_share) = ((1.0 - MEAN_DECAY) as f32, (1.0 - SQUARE_DECAY) as f32);
        let moments = self.mean.iter_mut().zip(&mut self.square);
        for ((parameter, &slope), (mean, square)) in parameters.iter_mut().zip(gradient).zip(moments) {
            *mean = normal(*mean + (slope - *mean) * mean_share);
            *square = normal(*square * SQUARE_DECAY as f32 + slope * slope * square_share);
            *parameter -= rate * (*mean / (square.sqrt() / spread + FLOOR));
        }
    }
}

/// The number, or 0 if it is subnormal: a parameter whose slope stays 0 has moments that die away, and processors take
/// fifty times as long over a subnormal number.
#[inline(always)]
fn normal(number: f32) -> f32 {
    if number.abs() < f32::MIN_POSITIVE { 0.0 } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_the_learning_rate_against_the_slope() {
        let mut parameters = [1.0, 1.0];
        Adam::new(2, 0.01).step(&mut parameters, &[0.3, -20.0]);
        assert!((parameters[0] - 0.99).abs() < 1e-6 && (parameters[1] - 1.01).abs() < 1e-6);
    }

    #[test]
    fn moments_of_a_parameter_without_slope_end_at_nothing() {
        let (mut adam, mut parameters) = (Adam::new(1, 0.01), [1.0]);
        adam.step(&mut parameters, &[1e-12]);
        for _ in 0..30_000 {
            adam.step(&mut parameters, &[0.0]);
        }
        assert_eq!((adam.mean[0], adam.square[0]), (0.0, 0.0));
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let (mut adam, mut parameters) = (Adam::new(2, 0.02), [3.0_f32, -2.0]);
        for _ in 0..2000 {
            let gradient = [2.0 * (parameters[0] - 1.0), 20.0 * (parameters[1] - 0.5)];
            adam.step(&mut parameters, &gradient);
        }
        assert!((parameters[0] - 1.0).abs() < 1e-3 && (parameters[1] - 0.5).abs() < 1e-3, "{parameters:?}");
    }
}
