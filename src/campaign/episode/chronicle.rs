//! What is kept of an episode from tick to tick. The loop asks it only whether somebody has been hit.

use std::collections::BTreeMap;

use avastra_drivers::Ads;
use avastra_lang::model::{BodyWord, Memory};
use avastra_world::sim::{Contact, DT_S, Incident, Trace, World};

use super::log::{Collision, Held};
use super::monitor::Monitor;
use super::setup::Setup;
use super::trails::Trails;

#[derive(Clone)]
pub(super) struct Chronicle {
    pub held: Vec<Held>,
    /// The author's own bodies among the road users, by number.
    pub own_bodies: BTreeMap<u32, usize>,
    pub collisions: Vec<Collision>,
    pub incidents: Vec<Incident>,
    trails: Trails,
    /// `None` where nothing is required.
    pub monitor: Option<Monitor>,
    pub trace: Trace,
    pub distance_m: f64,
}

impl Chronicle {
    /// Of an episode that begins in this world.
    pub fn new(setup: &Setup, world: &World) -> Chronicle {
        let mut trails = Trails::default();
        trails.note(world);
        Chronicle {
            held: Vec::new(),
            own_bodies: BTreeMap::new(),
            collisions: Vec::new(),
            incidents: Vec::new(),
            trails,
            monitor: Monitor::new(setup),
            trace: Trace::default(),
            distance_m: 0.0,
        }
    }

    /// What the driving system answered, before the world moves.
    pub fn note_answer(&mut self, world: &World, ads: &dyn Ads) {
        let status = ads.status();
        if self.held.last().is_none_or(|held| !held.still(status)) {
            self.held.push(Held::new(world.time_s(), status));
        }
    }

    /// The world after a tick of a step, in which these contacts began.
    pub fn note(&mut self, setup: &Setup, step: usize, memory: &Memory, world: &World, contacts: &[Contact]) {
        for &contact in contacts {
            self.collisions.push(self.collision(world, contact, step));
        }
        self.incidents.extend_from_slice(world.incidents());
        self.trails.note(world);
        if let Some(monitor) = self.monitor.as_mut().filter(|_| self.collisions.is_empty()) {
            monitor.judge(setup, (world, &self.own_bodies), memory, step);
        }
        self.distance_m += world.ego().speed_mps * DT_S;
        world.trace(&mut self.trace);
    }

    pub fn has_hit(&self, id: u32) -> bool {
        self.collisions.iter().any(|collision| collision.contact.obstacle == id)
    }

    pub fn body(&self, world: &World, id: u32) -> Option<BodyWord> {
        let own = self.own_bodies.get(&id).copied();
        world.obstacle(id).map(|obstacle| BodyWord { like: obstacle.body, own })
    }

    fn collision(&self, world: &World, contact: Contact, step: usize) -> Collision {
        let id = contact.obstacle;
        let obstacle = world.obstacle(id).expect("an obstacle stays for some time after it is hit");
        let has_crashed =
            self.incidents.iter().any(|incident| [incident.obstacle, incident.other].contains(&id));
        let (shape, kind) = self.trails.kind(world, &contact, has_crashed);
        Collision {
            contact,
            shape,
            kind,
            step,
            body: BodyWord { like: obstacle.body, own: self.own_bodies.get(&id).copied() },
            mass_t: world.body(id).map_or(0.0, |body| body.mass_t),
            verb: obstacle.verb,
            spawned_s: obstacle.spawned_tick as f64 * DT_S,
        }
    }
}
