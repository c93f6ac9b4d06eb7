//! n-step returns (Mnih et al., 2016, Section 4): an episode becomes transitions, one for each step.

use super::q_policy::QPolicy;
use super::replay::Transition;
use super::trajectory::Trajectory;

/// A transition for each step: the discounted rewards of the next `n_step` steps, and the state after them.
///
/// `rewards` has shape `(steps,)`. Near the end fewer rewards are left. The value of the last state does not
/// count where the episode ended by itself. An episode that was cut off is bootstrapped from it.
pub(super) fn transitions(episode: &Trajectory, rewards: &[f64], policy: &QPolicy) -> Vec<Transition> {
    let (settings, count) = (policy.settings(), episode.steps.len());
    debug_assert_eq!(rewards.len(), count);
    let steps = episode.steps.iter().map(|step| (&step.observation, &step.legal));
    let moments = steps.chain([(&episode.last, &episode.last_legal)]);
    let states: Vec<(Vec<f32>, Vec<bool>)> = moments
        .map(|(observation, legal)| {
            let rows = policy.rows.allowed.iter().zip(legal);
            let may_choose = |(&allowed, &legal)| allowed && (legal || !settings.choice.masks_target);
            (policy.features.encode(observation), rows.map(may_choose).collect())
        })
        .collect();
    let transition = |at: usize| {
        let end = (at + settings.n_step).min(count);
        let (mut reward, mut discount) = (0.0, 1.0);
        for &next in &rewards[at..end] {
            reward += discount * next;
            discount *= settings.discount;
        }
        if end == count && episode.terminal && settings.arrival_is_terminal {
            discount = 0.0;
        }
        let (next_inputs, next_legal) = states[end].clone();
        Transition {
            inputs: states[at].0.clone(),
            row: episode.steps[at].row as u32,
            reward: reward as f32,
            discount: discount as f32,
            next_inputs,
            next_legal,
        }
    };
    (0..count).map(transition).collect()
}
