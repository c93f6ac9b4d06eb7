//! The perceptron: hidden layers with ReLU, a linear output, and optionally a dueling head.
//!
//! All parameters lie in one vector, layer by layer, each its weights `(inputs, outputs)` by rows and
//! then its biases. So an optimiser, a copy, a file and a digest each see one slice of numbers.
//!
//! The dueling head (Wang et al., 2016, Eq. 9) is one more output that holds the state's value. The streams
//! share all hidden layers, which is all that networks of this size need.

use ndarray::{Array2, ArrayView1, ArrayView2, Axis, s};

use crate::agent::checked::{Requirement, SettingsError, require, within};
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::product::product;

/// Settings of [`Network`].
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NetworkSettings {
    /// Widths of the hidden layers, each 1 to 4096; one to four of them.
    pub hidden_units: Vec<usize>,
    /// Whether the network has a dueling head (Wang et al., 2016).
    pub dueling: bool,
    pub initialization: Initialization,
}

impl NetworkSettings {
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let widths = &self.hidden_units;
        require([Requirement {
            name: "hidden_units",
            is_met: (1..=4).contains(&widths.len()) && widths.iter().all(|width| (1..=4096).contains(width)),
            value: format!("{widths:?}"),
            wanted: "one to four widths from 1 to 4096",
        }])?;
        require(match self.initialization {
            Initialization::Normal(deviation) => {
                Some(within("initialization", deviation, 0.0..=10.0, "`he`, or normal from 0 to 10"))
            }
            Initialization::He => None,
        })
    }
}

/// A network without its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Widths: inputs, hidden layers, actions.
    pub layers: Vec<usize>,
    pub dueling: bool,
}

impl Shape {
    /// Inputs and outputs of each layer's weights; the value of a dueling head is its last output.
    fn weights(&self) -> impl DoubleEndedIterator<Item = (usize, usize)> + ExactSizeIterator {
        let last = self.layers.len() - 2;
        let head = usize::from(self.dueling);
        let pairs = self.layers.windows(2).enumerate();
        pairs.map(move |(at, pair)| (pair[0], pair[1] + if at == last { head } else { 0 }))
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.weights().map(|(inputs, outputs)| (inputs + 1) * outputs).sum()
    }
}

/// How the first weights are drawn.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Initialization {
    /// Normal with variance 2 / inputs (He et al., 2015), biases 0.
    He,
    /// Normal with this standard deviation, biases uniform within ±1 / √inputs: what the published
    /// packages do, on top of PyTorch's default biases.
    Normal(f64),
}

/// A Q-network.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    shape: Shape,
    parameters: Vec<f32>,
}

/// One pass of a batch through a network, with what the way back needs.
pub struct Pass<'a> {
    /// Shape `(batch, inputs)`.
    inputs: ArrayView2<'a, f32>,
    /// Outputs of each hidden layer, each of shape `(batch, width)`.
    hidden: Vec<Array2<f32>>,
    /// Shape `(batch, actions)`.
    pub q_values: Array2<f32>,
}

impl Network {
    /// A network that knows nothing yet.
    pub fn new(shape: Shape, initialization: Initialization, rng: &mut Rng) -> Network {
        let mut parameters = Vec::with_capacity(shape.parameters());
        for (inputs, outputs) in shape.weights() {
            let (deviation, bias_max) = match initialization {
                Initialization::He => (libm::sqrt(2.0 / inputs as f64), 0.0),
                Initialization::Normal(deviation) => (deviation, 1.0 / libm::sqrt(inputs as f64)),
            };
            parameters.extend((0..inputs * outputs).map(|_| (deviation * rng::normal(rng)) as f32));
            parameters.extend((0..outputs).map(|_| rng::between(rng, -bias_max, bias_max) as f32));
        }
        Network { shape, parameters }
    }

    /// A network of given parameters, as many as the shape has.
    pub fn from_parameters(shape: Shape, parameters: Vec<f32>) -> Network {
        assert_eq!(shape.parameters(), parameters.len(), "the parameters are those of the shape");
        Network { shape, parameters }
    }

    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// All parameters, in the order that the module describes.
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    pub fn parameters_mut(&mut self) -> &mut [f32] {
        &mut self.parameters
    }

    /// Hard copy of another network's parameters; the shapes must be the same.
    pub fn copy_from(&mut self, other: &Network) {
        assert_eq!(self.shape, other.shape, "a copy is of the same shape");
        self.parameters.clone_from(&other.parameters);
    }

    /// Moves every parameter by a share of the way to another network's, share in `[0, 1]`; the shapes must be the same.
    pub fn approach(&mut self, other: &Network, share: f32) {
        assert_eq!(self.shape, other.shape, "it approaches one of the same shape");
        for (own, goal) in self.parameters.iter_mut().zip(&other.parameters) {
            *own += share * (goal - *own);
        }
    }

    /// Q-values, shape `(batch, actions)`, of inputs `(batch, inputs)`.
    pub fn q_values(&self, inputs: ArrayView2<f32>) -> Array2<f32> {
        self.forward(inputs).q_values
    }

    /// Passes inputs `(batch, inputs)` through the network.
    pub fn forward<'a>(&self, inputs: ArrayView2<'a, f32>) -> Pass<'a> {
        let mut hidden = self.outputs(inputs);
        let q_values = self.joined(hidden.pop().expect("a network has a layer"));
        Pass { inputs, hidden, q_values }
    }

    /// Outputs of each layer, hidden ones after ReLU, the last as it is.
    fn outputs(&self, inputs: ArrayView2<f32>) -> Vec<Array2<f32>> {
        assert_eq!(inputs.ncols(), self.shape.layers[0], "the network has another number of inputs");
        let layers = self.layers();
        let mut outputs: Vec<Array2<f32>> = Vec::with_capacity(layers.len());
        for (at, (weights, biases)) in layers.iter().enumerate() {
            let from = outputs.last().map_or(inputs, |output| output.view());
            let mut to = Array2::zeros((from.nrows(), weights.ncols()));
            product(from, weights.view(), to.view_mut());
            let is_hidden = at + 1 < layers.len();
            for mut row in to.rows_mut() {
                row.iter_mut().zip(biases).for_each(|(value, &bias)| *value += bias);
            }
            if is_hidden {
                to.iter_mut().for_each(|value| *value = if *value <= 0.0 { 0.0 } else { *value });
            }
            outputs.push(to);
        }
        outputs
    }

    /// Advantages and value of a dueling head as Q-values; without one, the output itself.
    fn joined(&self, output: Array2<f32>) -> Array2<f32> {
        if !self.shape.dueling {
            return output;
        }
        let actions = output.ncols() - 1;
        let mut q_values = output.slice(s![.., ..actions]).to_owned();
        for (mut row, &value) in q_values.rows_mut().into_iter().zip(output.column(actions)) {
            let mean = row.iter().sum::<f32>() / actions as f32;
            row.iter_mut().for_each(|advantage| *advantage += value - mean);
        }
        q_values
    }

    /// The gradient of a loss, one number for each parameter, from a pass through this network and the
    /// derivative of the loss by each of its Q-values, shape `(batch, actions)`.
    pub fn gradient(&self, pass: &Pass, slopes: Array2<f32>) -> Vec<f32> {
        debug_assert_eq!(slopes.dim(), pass.q_values.dim());
        let mut slope = self.parted(slopes);
        let mut gradient = vec![0.0; self.parameters.len()];
        let mut end = gradient.len();
        for (at, (weights, _)) in self.layers().iter().enumerate().rev() {
            let (rows, columns) = weights.dim();
            let begin = end - (rows + 1) * columns;
            let (by_weights, by_biases) = gradient[begin..end].split_at_mut(rows * columns);
            end = begin;
            let from = if at == 0 { pass.inputs } else { pass.hidden[at - 1].view() };
            let by_weights = ndarray::ArrayViewMut2::from_shape((rows, columns), by_weights);
            product(from.t(), slope.view(), by_weights.expect("the slice has the layer's length"));
            for row in slope.rows() {
                by_biases.iter_mut().zip(row).for_each(|(sum, &term)| *sum += term);
            }
            if at > 0 {
                let mut before = Array2::zeros((slope.nrows(), rows));
                product(slope.view(), weights.t(), before.view_mut());
                // The derivative of ReLU is 1 where its output was positive, and 0 elsewhere.
                let passed = before.iter_mut().zip(&pass.hidden[at - 1]);
                passed.for_each(|(slope, &output)| *slope = if output <= 0.0 { 0.0 } else { *slope });
                slope = before;
            }
        }
        gradient
    }

    /// The derivative by a dueling head's outputs from that by the Q-values: the transpose of
    /// `joined`.
    fn parted(&self, slopes: Array2<f32>) -> Array2<f32> {
        if !self.shape.dueling {
            return slopes;
        }
        let actions = slopes.ncols();
        let mut parted = Array2::zeros((slopes.nrows(), actions + 1));
        for (from, mut to) in slopes.rows().into_iter().zip(parted.axis_iter_mut(Axis(0))) {
            let sum: f32 = from.iter().sum();
            for (slope, &by_q) in to.iter_mut().zip(from) {
                *slope = by_q - sum / actions as f32;
            }
            to[actions] = sum;
        }
        parted
    }

    /// Weights `(inputs, outputs)` and biases of each layer.
    pub fn layers(&self) -> Vec<(ArrayView2<'_, f32>, ArrayView1<'_, f32>)> {
        let mut rest = self.parameters.as_slice();
        let layers = self.shape.weights().map(|(inputs, outputs)| {
            let (weights, others) = rest.split_at(inputs * outputs);
            let (biases, others) = others.split_at(outputs);
            rest = others;
            let weights = ArrayView2::from_shape((inputs, outputs), weights);
            (weights.expect("the slice has the layer's length"), ArrayView1::from(biases))
        });
        layers.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};

    fn network(dueling: bool) -> Network {
        let shape = Shape { layers: vec![4, 8, 6, 3], dueling };
        Network::new(shape, Initialization::Normal(0.3), &mut stream(5, Stream::Initialization, 0))
    }

    fn inputs() -> Array2<f32> {
        let mut rng = stream(6, Stream::Initialization, 0);
        Array2::from_shape_simple_fn((7, 4), || rng::normal(&mut rng) as f32)
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        for dueling in [false, true] {
            let (mut network, inputs) = (network(dueling), inputs());
            // A loss whose derivative differs for every Q-value: Σ (q - place)² / 2.
            let place = |at: usize| (at as f32 * 0.37) % 1.0;
            let loss = |network: &Network| -> f64 {
                let squares = network.q_values(inputs.view()).into_iter().enumerate();
                squares.map(|(at, q)| f64::from(q - place(at)) * f64::from(q - place(at)) / 2.0).sum()
            };
            let pass = network.forward(inputs.view());
            let mut slopes = pass.q_values.clone();
            slopes.iter_mut().enumerate().for_each(|(at, q)| *q -= place(at));
            let gradient = network.gradient(&pass, slopes);
            let mut kinks = 0;
            for (at, &slope) in gradient.iter().enumerate() {
                let here = network.parameters[at];
                let mut difference = |step: f32| {
                    let mut loss_at = |parameter| {
                        network.parameters[at] = parameter;
                        loss(&network)
                    };
                    let difference = (loss_at(here + step) - loss_at(here - step)) / (2.0 * f64::from(step));
                    network.parameters[at] = here;
                    difference
                };
                let (wide, narrow) = (difference(1.0 / 128.0), difference(1.0 / 256.0));
                // The loss is a parabola in each parameter, but for the kinks of ReLU.
                if (wide - narrow).abs() > 1e-3 * (1.0 + narrow.abs()) {
                    kinks += 1;
                    continue;
                }
                let error = (narrow - f64::from(slope)).abs();
                assert!(error < 4e-3 * (1.0 + narrow.abs()), "{dueling} {at}: {narrow} {slope}");
            }
            assert!(kinks * 5 < gradient.len(), "{kinks} of {}", gradient.len());
        }
    }

    #[test]
    fn a_dueling_head_averages_to_the_value() {
        let network = network(true);
        let outputs = network.outputs(inputs().view());
        let values = outputs[2].column(3).to_owned();
        let means = network.q_values(inputs().view()).mean_axis(Axis(1)).expect("there are actions");
        assert!((values - means).iter().all(|difference| difference.abs() < 1e-5));
    }

    #[test]
    fn one_row_has_the_bits_that_it_has_in_a_batch() {
        let network = network(true);
        let whole = network.q_values(inputs().view());
        for (at, row) in inputs().rows().into_iter().enumerate() {
            assert_eq!(network.q_values(row.insert_axis(Axis(0))).row(0), whole.row(at));
        }
    }
}
