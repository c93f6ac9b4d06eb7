//! Randomness: one seed, one named stream per consumer.
//!
//! Every consumer draws from a separate stream. So a new draw in one place shifts no other, and a replay
//! needs nothing but the seed. The generator is named (ChaCha8), because `StdRng` may change between
//! releases. The draws are written here, because the distributions of `rand` may change too: a draw is part
//! of the file format.

use rand::Rng as _;
use rand::SeedableRng;

/// The one generator of avastra.
pub type Rng = rand_chacha::ChaCha8Rng;

/// The purpose of a stream. The discriminant is part of every replay: never renumber, only add.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// Seeds of single episodes, derived from the seed of a run.
    Episode = 1,
    /// Initial state of an episode: time of day, phase of the signals.
    Reset = 2,
    /// The `any` parameters of an action row.
    Draw = 3,
    /// The agent's choice among rows.
    Exploration = 4,
    /// Localisation error of the driving system.
    Localization = 5,
    /// Perception error of the driving system.
    Perception = 6,
    /// Choices of other road users, for example which way to turn.
    Traffic = 7,
    /// Ambient traffic: where a vehicle appears and of what kind; one index for each attempt.
    Ambient = 8,
    /// Small changes of a scenario, to see whether it still crashes.
    Variation = 9,
    /// Other errors of a driving system in the same episode, to see what chance does.
    Noise = 10,
    /// First weights of a network.
    Initialization = 21,
    /// Which transitions a learner draws for an update.
    Replay = 22,
    /// Seeds of the episodes that a trained policy is judged by.
    Evaluation = 23,
    /// The next trial of a search.
    Search = 25,
    /// Seeds of the trainings of a study, one index each.
    StudyTraining = 31,
    /// Seeds of the evaluations of a study, one index each.
    StudyEvaluation = 32,
    /// Which values a bootstrap draws again.
    Bootstrap = 33,
    /// Seeds of the episodes in which rules learn from a network.
    Distillation = 41,
    /// The order into which the values of a variable are shuffled; one index for each variable and repeat.
    Permutation = 42,
    /// Seeds of the parts of an estimate.
    Estimate = 51,
    /// Values that a file of another tool leaves to chance; one index for each parameter.
    Import = 61,
}

/// The stream of one consumer; `index` tells its uses apart, and may be the number of a step.
pub fn stream(seed: u64, stream: Stream, index: u64) -> Rng {
    let mut key = [0_u8; 32];
    key[0..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(stream as u64).to_le_bytes());
    key[16..24].copy_from_slice(&index.to_le_bytes());
    key[24..32].copy_from_slice(b"avastra1");
    Rng::from_seed(key)
}

/// A seed for a child, for example one episode of a run.
pub fn child_seed(seed: u64, consumer: Stream, index: u64) -> u64 {
    stream(seed, consumer, index).next_u64()
}

/// Uniform in `[0, 1)`, from 53 bits.
pub fn unit(rng: &mut Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
}

/// Uniform in `[low, high)`; `low` if the range is empty.
pub fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low).max(0.0) * unit(rng)
}

/// Uniform in `0..count`, without modulo bias (Lemire). `count` must be positive.
pub fn below(rng: &mut Rng, count: u32) -> u32 {
    assert!(count > 0, "a draw needs at least one choice");
    let threshold = count.wrapping_neg() % count;
    loop {
        let product = u64::from(rng.next_u32()) * u64::from(count);
        if product as u32 >= threshold {
            return (product >> 32) as u32;
        }
    }
}

/// Standard normal, by Box–Muller; each call uses two draws and keeps one value.
pub fn normal(rng: &mut Rng) -> f64 {
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(rng)));
    radius * libm::cos(core::f64::consts::TAU * unit(rng))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn below_stays_below_and_reaches_all() {
        let mut rng = stream(1, Stream::Draw, 0);
        let mut seen = [0_u32; 6];
        for _ in 0..6000 {
            seen[below(&mut rng, 6) as usize] += 1;
        }
        assert!(seen.iter().all(|&n| (850..1150).contains(&n)), "{seen:?}");
    }

    #[test]
    fn normal_has_unit_variance() {
        let mut rng = stream(1, Stream::Draw, 0);
        let draws: Vec<f64> = (0..20_000).map(|_| normal(&mut rng)).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
    }
}
