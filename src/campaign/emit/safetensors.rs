//! A policy's weights in the safetensors format, for other tools.
//!
//! Named and laid out as PyTorch's `Sequential(Linear, ReLU, Linear, …)` has them: `0.weight` of shape
//! (outputs, inputs), `0.bias`, then `2.weight`, and so on. The value of a dueling head is the last
//! output of the last layer.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, serialize};

use avastra_search::agent::Network;

/// The bytes of the file.
pub fn safetensors(network: &Network) -> Vec<u8> {
    let tensors: Vec<(String, Vec<usize>, Vec<u8>)> = network
        .layers()
        .iter()
        .enumerate()
        .flat_map(|(at, (weights, biases))| {
            // Ours is (inputs, outputs), so its columns are read one after another.
            let weights_bytes = weights.t().iter().flat_map(|weight| weight.to_le_bytes()).collect();
            let biases_bytes = biases.iter().flat_map(|bias| bias.to_le_bytes()).collect();
            let shape = vec![weights.ncols(), weights.nrows()];
            [
                (format!("{}.weight", 2 * at), shape, weights_bytes),
                (format!("{}.bias", 2 * at), vec![biases.len()], biases_bytes),
            ]
        })
        .collect();
    let views = tensors.iter().map(|(name, shape, bytes)| {
        let view = TensorView::new(Dtype::F32, shape.clone(), bytes);
        (name.as_str(), view.expect("the bytes are as many as the shape wants"))
    });
    serialize(views, None).expect("names and shapes are sound")
}
