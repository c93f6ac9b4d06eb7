//! Agents: who decides, step by step, what happens around the car.
//!
//! An agent sees the state vector and which rows are legal; never the world.

mod random;
mod registry;

pub use registry::Agent;
pub use registry::Entry;
pub use registry::REGISTRY;
pub use registry::by_name;
