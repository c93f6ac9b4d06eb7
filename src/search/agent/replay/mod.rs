//! Experience replay: transitions that are kept, and drawn again by their priority.

mod buffer;
mod sum_tree;

pub use buffer::{Replay, ReplaySettings, Transition};
