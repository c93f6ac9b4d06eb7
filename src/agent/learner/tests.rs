//! Learning on problems whose answer is known.

use ndarray::{Array1, array};

use crate::agent::hyperparameters::{Encoding, StateSet};
use crate::agent::presets;
use crate::agent::trajectory::Experience;
use crate::mdp::Closeness;
use crate::rng::stream;

use super::*;

/// Plain settings for problems of a few states; each test changes what it is about.
fn small() -> Hyperparameters {
    Hyperparameters {
        encoding: Encoding::Raw,
        state: StateSet::Full,
        hidden_units: vec![16],
        learning_rate: 3e-3,
        batch_len: 16,
        learning_starts: 32,
        updates_per_step: 2,
        target_period_updates: 50,
        exploration_steps: 400,
        replay_capacity: 2000,
        ..presets::avastra()
    }
}

fn learner(settings: Hyperparameters, rows: usize, seed: u64) -> Learner {
    let rows = Rows { allowed: vec![true; rows], environment: vec![false; rows] };
    Learner::new(Arc::new(settings), Arc::new(rows), seed)
}

/// State number `state`, one-hot.
fn sight(state: usize) -> Observation {
    let mut observation = Observation::zeros();
    observation.state[state] = 1.0;
    observation
}

fn all(rows: usize) -> Array1<bool> {
    Array1::from_elem(rows, true)
}

fn experience(state: usize, row: usize, reward: f64, rows: usize) -> Experience {
    Experience {
        observation: sight(state),
        legal: all(rows),
        row,
        reward,
        hits: Vec::new(),
        collided: false,
        crashes: Vec::new(),
    }
}

#[test]
fn targets_follow_the_worked_example() {
    let transition = |discount, next_legal| Transition {
        inputs: vec![],
        row: 0,
        reward: 1.0,
        discount,
        next_inputs: vec![],
        next_legal,
    };
    let (online, target) = (array![0.5, 2.0, 3.0], array![10.0, 20.0, 5.0]);
    let all = transition(0.9, vec![true; 3]);
    // The online network likes row 2, which the target network values at 5.
    assert_eq!(td_target(&all, online.view(), target.view()), 1.0 + 0.9 * 5.0);
    // DQN takes the target network's own best.
    assert_eq!(td_target(&all, target.view(), target.view()), 1.0 + 0.9 * 20.0);
    // Where row 2 is not legal, the online network likes row 1.
    let masked = transition(0.9, vec![true, true, false]);
    assert_eq!(td_target(&masked, online.view(), target.view()), 1.0 + 0.9 * 20.0);
    assert_eq!(td_target(&transition(0.0, vec![true; 3]), online.view(), target.view()), 1.0);
    assert_eq!(td_target(&transition(0.9, vec![false; 3]), online.view(), target.view()), 1.0);
}

#[test]
fn returns_take_n_steps_and_know_the_end() {
    let settings = Hyperparameters { n_step: 2, discount: 0.5, ..small() };
    let episode = |terminal| Trajectory {
        steps: (0..3).map(|at| experience(at, at, (at + 1) as f64, 4)).collect(),
        last: sight(9),
        last_legal: array![true, false, false, false],
        terminal,
        closeness: Closeness::default(),
    };
    let of = |settings: Hyperparameters, terminal| learner(settings, 4, 0).transitions(&episode(terminal));
    let found = of(settings.clone(), true);
    let figures: Vec<_> = found.iter().map(|one| (one.reward, one.discount)).collect();
    // 1 + 0.5 · 2, then 2 + 0.5 · 3, then 3.
    assert_eq!(figures, [(2.0, 0.25), (3.5, 0.0), (3.0, 0.0)]);
    assert_eq!(found[0].next_inputs[2], 1.0);
    // A truncated episode is bootstrapped, and so is every end for the published package.
    let discounts = |found: Vec<Transition>| found.iter().map(|one| one.discount).collect::<Vec<_>>();
    assert_eq!(discounts(of(settings.clone(), false)), [0.25, 0.25, 0.5]);
    let released = Hyperparameters { arrival_is_terminal: false, ..settings };
    assert_eq!(discounts(of(released.clone(), true)), [0.25, 0.25, 0.5]);
    assert_eq!(of(released, true)[2].next_legal, [true, false, false, false]);
}

#[test]
fn credit_goes_back_to_where_the_obstacle_appeared() {
    let mut episode = Trajectory {
        steps: (0..3).map(|at| experience(at, 0, -1.0, 2)).collect(),
        last: sight(9),
        last_legal: all(2),
        terminal: true,
        closeness: Closeness::default(),
    };
    episode.steps[2].hits = vec![0];
    episode.steps[1].hits = vec![1];
    assert_eq!(credited(&episode, 7.5), [7.5, -1.0, 2.5]);
}

#[test]
fn exploration_falls_as_the_settings_say() {
    let at = |exploration, steps| {
        let settings =
            Hyperparameters { exploration, exploration_end: 0.1, exploration_steps: 100, ..small() };
        epsilon(&settings, steps)
    };
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    near(at(Exploration::Linear, 50), 0.55);
    near(at(Exploration::Linear, 500), 0.1);
    near(at(Exploration::Exponential, 100), 0.1 + 0.9 * 0.367_879_441_171);
    near(at(Exploration::ExponentialThenEnd, 100), 0.1 + 0.9 * 0.367_879_441_171);
    near(at(Exploration::ExponentialThenEnd, 101), 0.1);
}

#[test]
fn inverted_exploration_begins_greedy() {
    let settings = Hyperparameters { exploration_inverted: true, ..small() };
    let mut learner = learner(settings, 8, 3);
    let mut rng = stream(1, Stream::Exploration, 0);
    let chosen: Vec<_> = (0..20).map(|_| learner.choose(&sight(0), all(8).view(), &mut rng)).collect();
    assert!(chosen.iter().all(|row| *row == chosen[0]), "{chosen:?}");
}

#[test]
fn the_gate_keeps_weather_from_changing_at_every_step() {
    let settings = Hyperparameters { environment_gate_steps: 3, ..small() };
    let rows = Rows { allowed: vec![true; 3], environment: vec![true, true, false] };
    let mut learner = Learner::new(Arc::new(settings), Arc::new(rows), 0);
    let mut open = |row: usize| {
        learner.policy.chosen(row);
        learner.policy.open(all(3).view())
    };
    assert_eq!(open(0), [false, false, true]);
    assert_eq!(open(2), [false, false, true]);
    assert_eq!(open(2), [false, true, true]);
}

/// A corridor of five states: row 1 goes right, row 0 left; the right end is worth 1, the left end,
/// which is nearer, 0.2. Optimal is right from everywhere but, at this discount, the leftmost state.
fn corridor(state: usize, row: usize) -> (f64, Option<usize>) {
    match (state, row) {
        (0, 0) => (0.2, None),
        (4, 1) => (1.0, None),
        (state, 0) => (0.0, Some(state - 1)),
        (state, _) => (0.0, Some(state + 1)),
    }
}

#[test]
fn every_kind_of_the_algorithm_solves_a_known_problem() {
    let known = || Hyperparameters { n_step: 1, discount: 0.6, updates_per_step: 4, ..small() };
    let plain = Hyperparameters { double: false, dueling: false, priority_exponent: 0.0, ..known() };
    for settings in [known(), Hyperparameters { dueling: false, ..known() }, plain] {
        let mut learner = learner(settings, 2, 11);
        for episode in 0..220 {
            let mut rng = stream(episode, Stream::Exploration, 0);
            let (mut state, mut steps, mut terminal) = (episode as usize % 5, Vec::new(), false);
            while steps.len() < 20 && !terminal {
                let row = learner.choose(&sight(state), all(2).view(), &mut rng).expect("rows are open");
                let (reward, next) = corridor(state, row);
                steps.push(experience(state, row, reward, 2));
                terminal = next.is_none();
                state = next.unwrap_or(state);
            }
            let trajectory = Trajectory {
                steps,
                last: sight(state),
                last_legal: all(2),
                terminal,
                closeness: Closeness::default(),
            };
            learner.learn(&trajectory, &mut stream(episode, Stream::Replay, 0));
        }
        // 0.6⁴ < 0.2 < 0.6³: by the discounted sum, only the leftmost state had better go left.
        let greedy: Vec<usize> =
            (0..5).map(|state| learner.policy.greedy(&sight(state), &[true; 2]).expect("open")).collect();
        assert_eq!(greedy, [0, 1, 1, 1, 1]);
        let values = |state| learner.policy.q_values(&sight(state));
        for (state, expected) in [(1, 0.216), (2, 0.36), (3, 0.6), (4, 1.0)] {
            assert!((values(state)[1] - expected).abs() < 0.06, "{state}: {}", values(state));
        }
    }
}

/// From the first state every row leads to the second; there each of ten rows is worth 0 on average, with
/// a deviation of 1. The first state is worth 0, whatever is done.
fn mean_estimate(double: bool, seed: u64) -> f64 {
    const ROWS: usize = 10;
    let settings = Hyperparameters {
        double,
        dueling: false,
        n_step: 1,
        priority_exponent: 0.0,
        discount: 1.0,
        learning_rate: 1e-2,
        exploration_end: 1.0,
        loss: Loss::Squared,
        // Old transitions are forgotten well before the target network is renewed, so that the two
        // networks' errors are their own.
        replay_capacity: 40,
        target_period_updates: 400,
        ..small()
    };
    let mut learner = learner(settings, ROWS, seed);
    let mut rng = stream(seed, Stream::Traffic, 0);
    let (mut sum, mut count) = (0.0, 0.0);
    for episode in 0..600 {
        let rows: Vec<usize> = (0..2).map(|_| rng::below(&mut rng, ROWS as u32) as usize).collect();
        let noise = rng::normal(&mut rng);
        let steps = vec![experience(0, rows[0], 0.0, ROWS), experience(1, rows[1], noise, ROWS)];
        let trajectory = Trajectory {
            steps,
            last: sight(2),
            last_legal: all(ROWS),
            terminal: true,
            closeness: Closeness::default(),
        };
        learner.learn(&trajectory, &mut stream(seed, Stream::Replay, episode));
        if episode >= 200 {
            sum += f64::from(learner.policy.q_values(&sight(0)).mean().expect("there are rows"));
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn double_q_learning_overestimates_less() {
    let mean = |double| (0..4).map(|seed| mean_estimate(double, seed)).sum::<f64>() / 4.0;
    let (plain, double) = (mean(false), mean(true));
    assert!(plain > 0.2, "DQN should overestimate a value of 0: {plain}");
    assert!(double < 0.7 * plain, "DDQN {double}, DQN {plain}");
}

#[test]
fn a_restored_learner_goes_on_alike() {
    let settings = Hyperparameters { random_decay: 0.05, replay_capacity: 60, ..small() };
    let rows = Arc::new(Rows { allowed: vec![true; 2], environment: vec![false; 2] });
    let episode = |learner: &mut Learner, number| {
        let mut rng = stream(number, Stream::Exploration, 0);
        let steps = (0..12).map(|at| {
            let row = learner.choose(&sight(at % 5), all(2).view(), &mut rng).expect("rows are open");
            experience(at % 5, row, at as f64 * 0.1, 2)
        });
        let steps = steps.collect();
        let trajectory = Trajectory {
            steps,
            last: sight(0),
            last_legal: all(2),
            terminal: number % 2 == 0,
            closeness: Closeness::default(),
        };
        learner.learn(&trajectory, &mut stream(number, Stream::Replay, 0))
    };
    let settings = Arc::new(settings);
    let mut whole = Learner::new(settings.clone(), rows.clone(), 5);
    for number in 0..8 {
        episode(&mut whole, number);
    }
    let bytes = whole.save();
    let mut restored = Learner::restore(settings.clone(), rows.clone(), &bytes).expect("it was saved");
    assert_eq!(restored.save(), bytes);
    for number in 8..14 {
        assert_eq!(episode(&mut whole, number), episode(&mut restored, number));
    }
    assert_eq!(whole.save(), restored.save());
    assert!(Learner::restore(settings.clone(), rows.clone(), &bytes[..bytes.len() - 1]).is_none());
    assert!(Learner::restore(settings, rows, b"avackpt0").is_none());
}
