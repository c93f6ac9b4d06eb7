//! What a published model of careful driving says about an encounter.

use super::encounter::Encounter;
use super::reflex::Braking;

/// A model of how a careful driver brakes.
pub trait Model: Clone + Send + 'static {
    /// Times and slopes of its reaction.
    fn braking(&self) -> Braking;

    /// The deceleration that it wants because of a road user, m/s²; 0 is no risk.
    fn demand_mps2(&self, encounter: &Encounter) -> f64;
}
