//! The Q-network: a multilayer perceptron in `f32` whose arithmetic is the same on every machine.

mod adam;
mod perceptron;
mod product;

pub use adam::Adam;
pub use perceptron::{Initialization, Network, NetworkSettings, Shape};
