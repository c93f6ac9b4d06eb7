//! One update of the online network: targets, TD errors, loss, gradient, step.

use ndarray::{Array2, ArrayView2};

use crate::agent::network::{Adam, Network};
use crate::agent::q_policy::best;
use crate::agent::replay::Transition;

use super::settings::{LearnerSettings, Loss};

/// One update of the online network on a batch: its loss, and the TD errors, shape `(batch,)`.
///
/// `weights` are the importance weights, shape `(batch,)`.
pub fn improve(
    online: &mut Network,
    target: &Network,
    adam: &mut Adam,
    settings: &LearnerSettings,
    batch: &[&Transition],
    weights: &[f32],
) -> (f64, Vec<f32>) {
    let states = stacked(batch, |transition| &transition.inputs);
    let next_states = stacked(batch, |transition| &transition.next_inputs);

    let next_values = target.q_values(next_states.view());
    // The only difference between the two algorithms is the network that chooses the next row.
    let targets = if settings.double {
        targets(batch, online.q_values(next_states.view()).view(), next_values.view())
    } else {
        targets(batch, next_values.view(), next_values.view())
    };
    let pass = online.forward(states.view());
    let td_errors = td_errors(batch, pass.q_values.view(), &targets);
    let (loss, slopes) = loss(settings.loss, &td_errors, weights);
    let mut gradient = online.gradient(&pass, placed(batch, &slopes, pass.q_values.dim()));
    if let Some(norm_max) = settings.gradient_norm_max {
        shorten(&mut gradient, norm_max);
    }
    adam.step(online.parameters_mut(), &gradient);
    (loss, td_errors)
}

/// States of a batch, one a row: shape `(batch, inputs)`.
fn stacked(batch: &[&Transition], inputs: fn(&Transition) -> &Vec<f32>) -> Array2<f32> {
    let shape = (batch.len(), inputs(batch[0]).len());
    let values = batch.iter().flat_map(|transition| inputs(transition)).copied().collect();
    Array2::from_shape_vec(shape, values).expect("all states have the same features")
}

/// The target Q-values, shape `(batch,)`: the reward, and the discounted value of the next state by the
/// target network, in the legal row that `choosing` likes best there.
///
/// Both arrays are Q-values of the next states, shape `(batch, rows)`: `values` by the target network, and
/// `choosing` by the online network (Double DQN, Eq. 4) or by the target network too (DQN).
pub(super) fn targets(batch: &[&Transition], choosing: ArrayView2<f32>, values: ArrayView2<f32>) -> Vec<f32> {
    debug_assert_eq!(choosing.dim(), values.dim());
    debug_assert_eq!(values.nrows(), batch.len());
    let target = |(at, transition): (usize, &&Transition)| {
        debug_assert_eq!(transition.next_legal.len(), values.ncols());
        match best(choosing.row(at), &transition.next_legal) {
            Some(row) if transition.discount > 0.0 => {
                transition.reward + transition.discount * values[[at, row]]
            }
            _ => transition.reward,
        }
    };
    batch.iter().enumerate().map(target).collect()
}

/// The Q-value of the row that was chosen, less its target: shape `(batch,)`, from Q-values of shape
/// `(batch, rows)`.
fn td_errors(batch: &[&Transition], q_values: ArrayView2<f32>, targets: &[f32]) -> Vec<f32> {
    debug_assert_eq!((q_values.nrows(), targets.len()), (batch.len(), batch.len()));
    let chosen = batch.iter().enumerate().map(|(at, transition)| q_values[[at, transition.row as usize]]);
    chosen.zip(targets).map(|(q_value, target)| q_value - target).collect()
}

/// The weighted mean loss of a batch, and its derivative by each TD error, shape `(batch,)`.
pub(super) fn loss(kind: Loss, td_errors: &[f32], weights: &[f32]) -> (f64, Vec<f32>) {
    debug_assert_eq!(td_errors.len(), weights.len());
    let count = td_errors.len();
    let (mut mean, mut slopes) = (0.0, Vec::with_capacity(count));
    for (&td_error, &weight) in td_errors.iter().zip(weights) {
        let (cost, slope) = match kind {
            Loss::Squared => (td_error * td_error, 2.0 * td_error),
            Loss::Huber if td_error.abs() < 1.0 => (td_error * td_error / 2.0, td_error),
            Loss::Huber => (td_error.abs() - 0.5, td_error.signum()),
        };
        mean += f64::from(weight * cost) / count as f64;
        slopes.push(weight * slope / count as f32);
    }
    (mean, slopes)
}

/// The derivative by every Q-value, of the given shape `(batch, rows)`: 0 but for the rows that were chosen.
fn placed(batch: &[&Transition], slopes: &[f32], shape: (usize, usize)) -> Array2<f32> {
    debug_assert_eq!((slopes.len(), shape.0), (batch.len(), batch.len()));
    let mut placed = Array2::zeros(shape);
    for (at, transition) in batch.iter().enumerate() {
        placed[[at, transition.row as usize]] = slopes[at];
    }
    placed
}

/// Scales a gradient down to a length.
pub(super) fn shorten(gradient: &mut [f32], norm_max: f64) {
    let squares: f64 = gradient.iter().map(|&slope| f64::from(slope) * f64::from(slope)).sum();
    let share = norm_max / (libm::sqrt(squares) + 1e-6);
    if share < 1.0 {
        gradient.iter_mut().for_each(|slope| *slope *= share as f32);
    }
}
