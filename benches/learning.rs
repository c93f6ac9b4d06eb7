//! Marks of learning: updates a CPU second on one core, one line `mark NAME VALUE UNIT` each, and the rate of the
//! multiplications and additions that the products of the passes alone need.
//!
//! An update draws a batch of 64 by priority, makes Double DQN's three forward passes and the backward pass,
//! takes a step of Adam, and sets the new priorities. There are 19 inputs and 45 rows, as in the paper.

mod clock;

use std::hint::black_box;
use std::sync::Arc;

use avastra::agent::{Experience, Rows, Settings, Trajectory};
use avastra::mdp::{Observation, STATE_LEN};
use avastra::rng::Stream;
use avastra::{agent, rng};
use ndarray::Array1;

use clock::cpu_s;

const ROWS: usize = 45;
/// Transitions of an update: the paper's.
const BATCH: usize = 64;
/// Repeats of each mark; the median counts.
const REPEATS: usize = 7;
/// Steps of an episode, which is the number of updates measured at once.
const STEPS: usize = 100;

fn main() {
    for hidden in [[64, 64], [256, 256], [1024, 512]] {
        let [first, second] = hidden;
        let (updates, choices) = measured(&format!("hidden_units: [{first}, {second}]\n"));
        println!("mark updates_per_s_{first}_{second} {updates:.0} updates/s");
        // Three passes forward and one back, which is two products: ten operations for each weight and transition.
        let weights = STATE_LEN * first + first * second + second * ROWS;
        println!(
            "mark products_{first}_{second} {:.1} Gflop/s",
            updates * (10 * BATCH * weights) as f64 * 1e-9
        );
        println!("mark choice_{first}_{second} {choices:.1} us");
    }
}

/// Updates a second, and the time of a greedy choice, us.
fn measured(text: &str) -> (f64, f64) {
    let entry = agent::by_name("ddqn").expect("it is registered");
    let text = format!("{text}learning_starts: 1\nexploration_begin: 0\nexploration_end: 0\n");
    let settings = Settings::from_yaml(entry, Some("paper"), &text).expect("it is trained");
    let rows = Rows { allowed: vec![true; ROWS], environment: vec![false; ROWS] };
    let mut learner = settings.expect("the settings are sound").build(Arc::new(rows), 1);
    let mut rng = rng::stream(1, Stream::Traffic, 0);
    // Fills the replay memory and warms up the caches.
    (0..20).for_each(|_| {
        black_box(learner.learn(&episode(&mut rng, 100), &mut rng.clone()).expect("it learns").loss);
    });
    let seconds: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let episode = episode(&mut rng, STEPS);
            let begin = cpu_s();
            black_box(learner.learn(&episode, &mut rng).expect("it learns"));
            cpu_s() - begin
        })
        .collect();
    let look = observation(&mut rng);
    let mut legal = vec![true; ROWS];
    let choices: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let begin = cpu_s();
            for _ in 0..200 {
                black_box(learner.choose(&look, &mut legal, &mut rng));
            }
            (cpu_s() - begin) / 200.0
        })
        .collect();
    (STEPS as f64 / median(seconds), median(choices) * 1e6)
}

fn episode(rng: &mut rng::Rng, steps: usize) -> Trajectory {
    let step = |rng: &mut rng::Rng| Experience {
        observation: observation(rng),
        legal: Array1::from_elem(ROWS, true),
        row: rng::below(rng, ROWS as u32) as usize,
        reward: rng::normal(rng),
        hits: Vec::new(),
        crashes: Vec::new(),
    };
    Trajectory {
        steps: (0..steps).map(|_| step(rng)).collect(),
        last: observation(rng),
        last_legal: Array1::from_elem(ROWS, true),
        terminal: true,
    }
}

fn observation(rng: &mut rng::Rng) -> Observation {
    let mut observation = Observation::zeros();
    observation.state.iter_mut().for_each(|value| *value = rng::normal(rng) as f32);
    observation
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
