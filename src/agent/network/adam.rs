//! Adam (Kingma and Ba, 2015, Algorithm 1), with the operations in PyTorch's order.

/// The optimiser and its running moments, a mean and a square for each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    pub(in crate::agent) mean: Vec<f32>,
    pub(in crate::agent) square: Vec<f32>,
    /// Each decay rate to the power of the number of steps, in `f64` so that it does not drift.
    pub(in crate::agent) mean_power: f64,
    pub(in crate::agent) square_power: f64,
}

/// Decay rates of the two moments, and the term that keeps the quotient finite: the algorithm's defaults,
/// which all our sources use.
const MEAN_DECAY: f64 = 0.9;
const SQUARE_DECAY: f64 = 0.999;
const FLOOR: f32 = 1e-8;

impl Adam {
    /// For so many parameters.
    pub fn new(parameters: usize) -> Adam {
        Adam {
            mean: vec![0.0; parameters],
            square: vec![0.0; parameters],
            mean_power: 1.0,
            square_power: 1.0,
        }
    }

    /// One step down the gradient.
    pub fn step(&mut self, parameters: &mut [f32], gradient: &[f32], learning_rate: f64) {
        assert_eq!(parameters.len(), gradient.len(), "one slope for each parameter");
        assert_eq!(parameters.len(), self.mean.len(), "the optimiser is of another network");
        self.mean_power *= MEAN_DECAY;
        self.square_power *= SQUARE_DECAY;
        let rate = (learning_rate / (1.0 - self.mean_power)) as f32;
        let spread = libm::sqrt(1.0 - self.square_power) as f32;
        let moments = (self.mean.as_mut_slice(), self.square.as_mut_slice());
        move_parameters(parameters, gradient, moments, (rate, spread));
    }
}

/// The moments (mean and square) take the gradient in, and the parameters move, with a rate and a spread.
///
/// Each number has its own operations, so wide registers change nothing but the time: above all where a mean has died away
/// to a subnormal number, because a processor stops for these once an instruction, however many of them it holds.
fn move_parameters(
    parameters: &mut [f32],
    gradient: &[f32],
    moments: (&mut [f32], &mut [f32]),
    how: (f32, f32),
) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has just said that it knows the instructions.
        return unsafe { move_avx512(parameters, gradient, moments, how) };
    } else if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: as above.
        return unsafe { move_avx2(parameters, gradient, moments, how) };
    }
    move_inlined(parameters, gradient, moments, how);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn move_avx512(parameters: &mut [f32], gradient: &[f32], moments: (&mut [f32], &mut [f32]), how: (f32, f32)) {
    move_inlined(parameters, gradient, moments, how);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn move_avx2(parameters: &mut [f32], gradient: &[f32], moments: (&mut [f32], &mut [f32]), how: (f32, f32)) {
    move_inlined(parameters, gradient, moments, how);
}

#[inline(always)]
fn move_inlined(
    parameters: &mut [f32],
    gradient: &[f32],
    (mean, square): (&mut [f32], &mut [f32]),
    (rate, spread): (f32, f32),
) {
    let (mean_share, square_share) = ((1.0 - MEAN_DECAY) as f32, (1.0 - SQUARE_DECAY) as f32);
    let moments = mean.iter_mut().zip(square);
    for ((parameter, &slope), (mean, square)) in parameters.iter_mut().zip(gradient).zip(moments) {
        *mean += (slope - *mean) * mean_share;
        *square = *square * SQUARE_DECAY as f32 + slope * slope * square_share;
        *parameter -= rate * (*mean / (square.sqrt() / spread + FLOOR));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_the_learning_rate_against_the_slope() {
        let mut parameters = [1.0, 1.0];
        Adam::new(2).step(&mut parameters, &[0.3, -20.0], 0.01);
        assert!((parameters[0] - 0.99).abs() < 1e-6 && (parameters[1] - 1.01).abs() < 1e-6);
    }

    /// Also of numbers that are subnormal.
    #[test]
    fn every_width_gives_the_same_bits() {
        let power_of_two = |at: usize| f32::from_bits((127 - 3 * (at as u32 % 42)) << 23);
        let number = |at: usize| (at as f32 - 40.5) * power_of_two(at);
        type Kernel = unsafe fn(&mut [f32], &[f32], (&mut [f32], &mut [f32]), (f32, f32));
        let moved = |by: Kernel| {
            let [mut parameters, mut mean] =
                [1, 3].map(|part| (0..99).map(|at| number(at * part)).collect::<Vec<f32>>());
            let mut square: Vec<f32> = mean.iter().map(|mean| mean * mean).collect();
            for part in [7, 0, 5] {
                let gradient: Vec<f32> = (0..99).map(|at| number(at * part) * part as f32).collect();
                // SAFETY: the processor knows the instructions of every kernel that is given.
                unsafe { by(&mut parameters, &gradient, (&mut mean, &mut square), (1e-3, 0.5)) };
            }
            [parameters, mean, square].concat().into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let plain = moved(move_inlined);
        assert!(plain.iter().any(|bits| f32::from_bits(*bits).is_subnormal()));
        assert_eq!(moved(move_parameters), plain);
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            assert_eq!(moved(move_avx2), plain);
        }
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let (mut adam, mut parameters) = (Adam::new(2), [3.0_f32, -2.0]);
        for _ in 0..2000 {
            let gradient = [2.0 * (parameters[0] - 1.0), 20.0 * (parameters[1] - 0.5)];
            adam.step(&mut parameters, &gradient, 0.02);
        }
        assert!((parameters[0] - 1.0).abs() < 1e-3 && (parameters[1] - 0.5).abs() < 1e-3, "{parameters:?}");
    }
}
