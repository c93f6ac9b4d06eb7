//! What chooses rows: state variables, collision probability and reward ([`mdp`]), and the agents that learn from them
//! ([`agent`]). An agent sees the state vector and the mask of legal rows, never the world or the driving system.

pub mod mdp;
pub mod agent;
