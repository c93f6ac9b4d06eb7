//! What every driving system can do.

use crate::sim::{Control, Sensed};

use super::status::Status;

/// A driving system under test, or a reference driver.
pub trait Ads: Send {
    /// Its command for the next tick. Called once a tick (50 Hz).
    fn drive(&mut self, sensed: &Sensed) -> Control;

    /// What it believes, wants and commands at the moment.
    fn status(&self) -> &Status;

    /// A copy that goes on exactly as this one would: part of a snapshot.
    fn clone_box(&self) -> Box<dyn Ads>;
}

impl Clone for Box<dyn Ads> {
    fn clone(&self) -> Box<dyn Ads> {
        self.clone_box()
    }
}
