//! Readable rules: how they act, and how they are distilled from a network.
//!
//! VIPER (Bastani, Pu and Solar-Lezama, 2018, arXiv 1805.08328): a decision tree imitates the network
//! where a wrong choice costs much. `train` decides what drives in which round.

mod list;
mod tree;

pub use list::{RulesSettings, chosen_by, distilled};
pub use tree::Visit;
