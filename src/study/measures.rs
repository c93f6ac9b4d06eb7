//! Measures of danger, and the shapes of ways to collisions, taken while an episode is played.

use crate::episode::EpisodeLog;
use crate::mdp::Criticality;
use crate::mdp::Encroachment;
use crate::sim::Contact;
use crate::sim::World;

use super::shape::Shape;
use super::shape::Trail;

/// A watch that takes them.
#[derive(Debug, Clone, Default)]
pub struct Measures {
    /// By tick of ten in a second, with its time, s.
    moments: Vec<(f64, Criticality)>,
    encroachment: Encroachment,
    hit: Vec<u32>,
    trail: Trail,
    shapes: Vec<Option<Shape>>,
}

impl Measures {
    /// Takes in a tick.
    pub fn note(&mut self, world: &World, contacts: &[Contact]) {
        self.trail.note(world);
        self.shapes.extend(contacts.iter().map(|_| self.trail.shape()));
        self.hit.extend(contacts.iter().map(|contact| contact.obstacle));
        let mut now = Criticality::default();
        now.note(world, &|id| self.hit.contains(&id));
        if now != Criticality::default() {
            self.moments.push((world.time_s(), now));
        }
        self.encroachment.note(world);
    }

    /// The most critical values of each step of the log that was watched, and the least
    /// post-encroachment time, s.
    pub fn of_steps(&self, log: &EpisodeLog) -> (Vec<Criticality>, Option<f64>) {
        let mut steps = vec![Criticality::default(); log.steps.len()];
        for (time_s, moment) in &self.moments {
            // The last moment of a period belongs to its own step, whatever its last bit says.
            let after = log.steps.partition_point(|step| step.time_s + 1e-6 < *time_s);
            if let Some(step) = after.checked_sub(1) {
                steps[step] = steps[step].and(moment);
            }
        }
        (steps, self.encroachment.least_s(&|id| self.hit.contains(&id)))
    }

    /// The shape of the ego vehicle's way to each collision.
    pub fn shapes(&self) -> &[Option<Shape>] {
        &self.shapes
    }
}
