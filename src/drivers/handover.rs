//! Two drivers of one drive: the second watches from the start and takes over at a moment.
//!
//! This answers what another driver would have made of a hazard. The first drives up to it, so that the
//! hazard is the same to the bit; the second drives from there on, with all that it has seen until then.

use avastra_world::sim::{Control, Sensed};

use super::driver::Ads;
use super::external::{Conversation, Failure};
use super::status::Status;

/// The first driver until a moment, the second from then on. Until then the second drives, too, but its
/// commands are not obeyed.
#[derive(Clone)]
pub struct Handover {
    first: Box<dyn Ads>,
    second: Box<dyn Ads>,
    /// The moment, s since the start of the episode.
    at_s: f64,
    is_over: bool,
}

impl Handover {
    pub fn new(first: Box<dyn Ads>, second: Box<dyn Ads>, at_s: f64) -> Handover {
        Handover { first, second, at_s, is_over: false }
    }
}

impl Ads for Handover {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let second = self.second.drive(sensed);
        // Times are sums of ticks: the least bit must not decide.
        self.is_over |= sensed.time_s >= self.at_s - 1e-6;
        if self.is_over { second } else { self.first.drive(sensed) }
    }

    fn status(&self) -> &Status {
        if self.is_over { self.second.status() } else { self.first.status() }
    }

    fn failure(&self) -> Option<&Failure> {
        if self.is_over { self.second.failure() } else { self.first.failure() }
    }

    fn conversation(&self) -> Option<Conversation> {
        if self.is_over { self.second.conversation() } else { self.first.conversation() }
    }
}
