//! Learning on problems whose answer is known.

use ndarray::{Array2, array};

use std::sync::Arc;

use crate::agent::trainable::Configured;
use crate::agent::trajectory::Experience;
use crate::agent::{Rows, Settings, by_name};
use avastra_base::rng::{Stream, stream};

use super::update::{loss, shorten, targets};
use super::*;

/// Plain settings for problems of a few states; each test changes what it is about.
const SMALL: &str = "
encoding: raw
state: full
pays_maker: false
loss: huber
average_decay: 0
discount: 0.9
n_step: 3
exploration_share: null
hidden_units: [16]
learning_rate: 0.003
batch_len: 16
learning_starts: 32
updates_per_step: 2
target_period_updates: 50
exploration_steps: 400
replay_capacity: 2000
";

/// [`SMALL`] without the settings of some lines, and with these lines.
fn small(changes: &str) -> LearnerSettings {
    let name = |line: &str| line.split(':').next().unwrap_or_default().to_owned();
    let changed: Vec<String> = changes.lines().map(name).collect();
    let kept = SMALL.lines().filter(|line| !changed.contains(&name(line)));
    let text = kept.chain(changes.lines()).collect::<Vec<_>>().join("\n");
    let read = Settings::from_yaml(by_name("ddqn").expect("it is registered"), None, &text);
    let settings = read.expect("it is trained").expect("the settings are sound");
    settings.learner().expect("it learns").clone()
}

fn learner(settings: LearnerSettings, rows: usize, seed: u64) -> Learner {
    let rows = Rows { allowed: vec![true; rows], environment: vec![false; rows] };
    settings.build(Arc::new(rows), seed)
}

/// State number `state`, one-hot.
fn sight(state: usize) -> Observation {
    let mut observation = Observation::zeros();
    observation.state[state] = 1.0;
    observation
}

fn experience(state: usize, row: usize, reward: f64, rows: usize) -> Experience {
    Experience { observation: sight(state), ..Experience::plain(row, reward, rows) }
}

/// An episode with a step for each reward; its rows and states count up from 0.
pub fn episode(rewards: &[f64]) -> Trajectory {
    let rows = 4;
    ended(rewards.iter().enumerate().map(|(at, &reward)| experience(at, at, reward, rows)).collect(), 9, rows)
}

/// An episode that ended by itself in a state.
fn ended(steps: Vec<Experience>, last: usize, rows: usize) -> Trajectory {
    Trajectory { last: sight(last), ..Trajectory::plain(steps, rows) }
}

#[test]
fn targets_follow_the_worked_example() {
    let transition = |discount, next_legal: [bool; 3]| Transition {
        inputs: vec![],
        row: 0,
        reward: 1.0,
        discount,
        next_inputs: vec![],
        next_legal: next_legal.to_vec(),
    };
    let (online, target) = (array![[0.5, 2.0, 3.0]], array![[10.0, 20.0, 5.0]]);
    let all = transition(0.9, [true; 3]);
    let target_of =
        |one: &Transition, choosing: &Array2<f32>| targets(&[one], choosing.view(), target.view());
    // The online network likes row 2, which the target network values at 5.
    assert_eq!(target_of(&all, &online), [1.0 + 0.9 * 5.0]);
    // DQN takes the target network's own best.
    assert_eq!(target_of(&all, &target), [1.0 + 0.9 * 20.0]);
    // Where row 2 is not legal, the online network likes row 1.
    assert_eq!(target_of(&transition(0.9, [true, true, false]), &online), [1.0 + 0.9 * 20.0]);
    assert_eq!(target_of(&transition(0.0, [true; 3]), &online), [1.0]);
    assert_eq!(target_of(&transition(0.9, [false; 3]), &online), [1.0]);
}

#[test]
fn the_loss_is_the_weighted_mean_and_its_slope_is_its_derivative() {
    let (td_errors, weights) = ([0.5, -3.0], [1.0, 0.5]);
    assert_eq!(loss(Loss::Squared, &td_errors, &weights), ((0.25 + 0.5 * 9.0) / 2.0, vec![0.5, -1.5]));
    assert_eq!(loss(Loss::Huber, &td_errors, &weights), ((0.125 + 0.5 * 2.5) / 2.0, vec![0.25, -0.25]));
}

#[test]
fn returns_take_n_steps_and_know_the_end() {
    let settings = small("n_step: 2\ndiscount: 0.5");
    let of = |settings: LearnerSettings, terminal| {
        let last_legal = array![true, false, false, false];
        let episode = Trajectory { terminal, last_legal, ..episode(&[1.0, 2.0, 3.0]) };
        transitions(&episode, &[1.0, 2.0, 3.0], &learner(settings, 4, 0).policy)
    };
    let found = of(settings.clone(), true);
    let figures: Vec<_> = found.iter().map(|one| (one.reward, one.discount)).collect();
    // 1 + 0.5 · 2, then 2 + 0.5 · 3, then 3.
    assert_eq!(figures, [(2.0, 0.25), (3.5, 0.0), (3.0, 0.0)]);
    assert_eq!(found[0].next_inputs[2], 1.0);
    // A truncated episode is bootstrapped, and so is every end for the published package.
    let discounts = |found: Vec<Transition>| found.iter().map(|one| one.discount).collect::<Vec<_>>();
    assert_eq!(discounts(of(settings.clone(), false)), [0.25, 0.25, 0.5]);
    let released = LearnerSettings { arrival_is_terminal: false, ..settings };
    assert_eq!(discounts(of(released.clone(), true)), [0.25, 0.25, 0.5]);
    assert_eq!(of(released, true)[2].next_legal, [true, false, false, false]);
    // Longer than the episode: all of it, and its end.
    let longer = of(small("n_step: 50\ndiscount: 0.5"), false);
    let figures: Vec<_> = longer.iter().map(|one| (one.reward, one.discount)).collect();
    assert_eq!(figures, [(2.75, 0.125), (3.5, 0.25), (3.0, 0.5)]);
}

#[test]
fn a_collision_pays_where_its_obstacle_was_made() {
    let payment = small("collision_reward: 20\nuncounted_reward: 0").payment;
    let mut trajectory = episode(&[-1.0, 0.4, 20.0, 20.0]);
    trajectory.steps[2].crashes = vec![Some(0), Some(0)];
    trajectory.steps[3].crashes = vec![None];
    // An uncounted collision, which the reward of its step says already, changes nothing.
    trajectory.steps[1].hits = vec![0];
    assert_eq!(payment.paid_to_makers(&trajectory), [20.0, 0.4, 0.0, 20.0]);
    // The step of one collision may have made the obstacle of another.
    trajectory.steps[3].crashes = vec![Some(2)];
    assert_eq!(payment.paid_to_makers(&trajectory), [20.0, 0.4, 20.0, 0.0]);
}

#[test]
fn on_shuffled_states_it_no_longer_knows_when() {
    // Row 0 is right in state 0, row 1 in state 1.
    let settings = small("discount: 0\nevaluation_epsilon: 0");
    let mut learner = learner(settings, 2, 7);
    for number in 0..200 {
        let (state, row) = (number % 2, number / 2 % 2);
        let reward = f64::from(u8::from(state == row));
        let one = ended(vec![experience(state, row, reward, 2)], 9, 2);
        learner.learn(&one, &mut stream(number as u64, Stream::Replay, 0)).unwrap();
    }
    let right = |mut agent: Box<dyn Agent>| {
        let chosen = |step: usize| {
            let mut rng = stream(3, Stream::Exploration, step as u64);
            agent.choose(&sight(step % 2), &mut vec![true; 2], &mut rng).expect("rows are open") == step % 2
        };
        (0..200).map(chosen).filter(|is_right| *is_right).count()
    };
    assert_eq!(right(learner.actor()), 200);
    let by_luck = right(learner.shuffled().expect("it is a network"));
    assert!((70..130).contains(&by_luck), "{by_luck} of 200");
}

#[test]
fn a_loss_that_is_no_number_ends_the_lessons() {
    let mut learner = learner(small("loss: squared\nlearning_starts: 1\nupdates_per_step: 1"), 2, 3);
    // Its square is beyond the numbers of a network.
    let one = ended(vec![experience(0, 1, 1e30, 2)], 9, 2);
    let found = learner.learn(&one, &mut stream(0, Stream::Replay, 0)).unwrap_err();
    assert_eq!(found, Diverged { update: 1 });
}

#[test]
fn the_mean_of_the_networks_acts_in_the_end() {
    let settings = small("average_decay: 0.75\nupdates_per_step: 1\nlearning_starts: 1");
    let mut learner = learner(settings, 4, 5);
    let mut mean: Vec<f32> = Vec::new();
    for number in 1..=6_u32 {
        let one = ended(vec![experience(0, 1, 1.0, 4)], 9, 4);
        assert_eq!(
            learner.learn(&one, &mut stream(u64::from(number), Stream::Replay, 0)).unwrap().updates,
            1
        );
        let online = learner.policy.network().parameters();
        // A plain mean of the first four, a running mean from then on.
        let share = 1.0 / number.min(4) as f32;
        mean = match number {
            1 => online.to_vec(),
            _ => mean.iter().zip(online).map(|(mean, online)| mean + share * (online - mean)).collect(),
        };
    }
    let trained = learner.policy().expect("a learner has a network").network().parameters();
    assert!(trained.iter().zip(&mean).all(|(found, expected)| (found - expected).abs() < 1e-5));
    assert!(trained != learner.policy.network().parameters());
}

#[test]
fn inverted_exploration_begins_greedy() {
    let settings = small("exploration_inverted: true");
    let mut learner = learner(settings, 8, 3);
    let mut rng = stream(1, Stream::Exploration, 0);
    let chosen: Vec<_> = (0..20).map(|_| learner.choose(&sight(0), &mut vec![true; 8], &mut rng)).collect();
    assert!(chosen.iter().all(|row| *row == chosen[0]), "{chosen:?}");
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
    for kind in ["", "\ndueling: false", "\ndueling: false\ndouble: false\npriority_exponent: 0"] {
        let settings = small(&format!("n_step: 1\ndiscount: 0.6\nupdates_per_step: 4{kind}"));
        let mut learner = learner(settings, 2, 11);
        for episode in 0..220 {
            let mut rng = stream(episode, Stream::Exploration, 0);
            let (mut state, mut steps, mut terminal) = (episode as usize % 5, Vec::new(), false);
            while steps.len() < 20 && !terminal {
                let row = learner.choose(&sight(state), &mut vec![true; 2], &mut rng).expect("rows are open");
                let (reward, next) = corridor(state, row);
                steps.push(experience(state, row, reward, 2));
                terminal = next.is_none();
                state = next.unwrap_or(state);
            }
            let trajectory = Trajectory { terminal, ..ended(steps, state, 2) };
            learner.learn(&trajectory, &mut stream(episode, Stream::Replay, 0)).unwrap();
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
    // Old transitions are forgotten well before the target network is renewed, so that the two networks' errors are
    // their own.
    let renewal = "replay_capacity: 40\ntarget_period_updates: 400";
    let plain = "dueling: false\nn_step: 1\npriority_exponent: 0\ndiscount: 1\nlearning_rate: 0.01";
    let rest = "exploration_end: 1\nloss: squared";
    let settings = small(&format!("double: {double}\n{plain}\n{rest}\n{renewal}"));
    let mut learner = learner(settings, ROWS, seed);
    let mut rng = stream(seed, Stream::Traffic, 0);
    let (mut sum, mut count) = (0.0, 0.0);
    for episode in 0..600 {
        let rows: Vec<usize> = (0..2).map(|_| rng::below(&mut rng, ROWS as u32) as usize).collect();
        let noise = rng::normal(&mut rng);
        let steps = vec![experience(0, rows[0], 0.0, ROWS), experience(1, rows[1], noise, ROWS)];
        learner.learn(&ended(steps, 2, ROWS), &mut stream(seed, Stream::Replay, episode)).unwrap();
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
fn a_long_gradient_is_shortened_and_a_short_one_is_not() {
    let mut long = [3.0, 4.0];
    shorten(&mut long, 1.0);
    assert!(long.iter().zip([0.6, 0.8]).all(|(found, wanted): (&f32, f32)| (found - wanted).abs() < 1e-5));
    let mut short = [0.3, 0.4];
    shorten(&mut short, 1.0);
    assert_eq!(short, [0.3, 0.4]);
}

#[test]
fn the_target_is_renewed_after_so_many_updates() {
    let mut learner =
        learner(small("updates_per_step: 1\nlearning_starts: 1\ntarget_period_updates: 3"), 4, 5);
    let first = learner.target.parameters().to_vec();
    for number in 1..=6_u32 {
        let one = ended(vec![experience(0, 1, 1.0, 4)], 9, 4);
        learner.learn(&one, &mut stream(u64::from(number), Stream::Replay, 0)).unwrap();
        let is_renewed = learner.target.parameters() == learner.policy.network.parameters();
        assert_eq!(is_renewed, number % 3 == 0, "after {number}");
        assert_eq!(learner.target.parameters() == first, number < 3, "after {number}");
    }
}
