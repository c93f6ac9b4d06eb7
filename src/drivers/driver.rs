//! The interface of every driving system.

use avastra_world::sim::{Control, Sensed};

use super::external::{Conversation, Failure};
use super::status::Status;

/// A driving system under test, or a reference driver.
pub trait Ads: CloneAds + Send {
    /// Its command for the next tick. Called once a tick (50 Hz).
    fn drive(&mut self, sensed: &Sensed) -> Control;

    /// The driving system's present beliefs, plans and commands.
    fn status(&self) -> &Status;

    /// Deceleration that a careful driver's model alone gave in the last tick, m/s²; 0 before it reacts, and for others.
    fn braking_mps2(&self) -> f64 {
        0.0
    }

    /// From now on it drives where up to now another one drove and it watched. A reference driver then begins no lane
    /// change that the other has not begun either, before it has looked for a gap itself.
    fn take_over(&mut self, sensed: &Sensed) {
        let _ = sensed;
    }

    /// Why it cannot drive any more. Only an external one fails; the episode ends there.
    fn failure(&self) -> Option<&Failure> {
        None
    }

    /// The questions and answers of this episode, if the driving system is an external one.
    fn conversation(&self) -> Option<Conversation> {
        None
    }
}

/// A copy that goes on exactly as the original would: part of a snapshot. Whatever is `Clone` has it.
pub trait CloneAds {
    fn clone_box(&self) -> Box<dyn Ads>;
}

impl<T: Ads + Clone + 'static> CloneAds for T {
    fn clone_box(&self) -> Box<dyn Ads> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Ads> {
    fn clone(&self) -> Box<dyn Ads> {
        (**self).clone_box()
    }
}
