//! The chronicle of an episode, tick by tick. The loop reports every tick and every new road user to it, and asks it which
//! road users have been hit. It returns the facts of each step and, in the end, the records. Nothing here moves the world.

use std::collections::BTreeMap;

use avastra_drivers::Ads;
use avastra_lang::model::{BodyWord, Memory, OutcomeFacts};
use avastra_world::action::Effect;
use avastra_world::sim::{Contact, DT_S, Incident, Obstacle, Trace, Traced, World};

use super::facts::collision_facts;
use super::log::{Collision, Held};
use super::margins::MarginSeries;
use super::monitor::{Breach, Margin, Monitor};
use super::setup::Setup;
use super::trails::Trails;

/// How near the ego vehicle is to a collision, and with what.
#[derive(Clone, Copy)]
pub(super) struct Near {
    pub probability: f64,
    pub body: Option<BodyWord>,
}

/// The facts that were known as a step began.
pub(super) struct StepBegins {
    time_s: f64,
    collisions: usize,
}

/// The records of an episode after its end.
pub(super) struct Records {
    pub held: Vec<Held>,
    pub collisions: Vec<Collision>,
    pub incidents: Vec<Incident>,
    pub breaches: Vec<Breach>,
    pub margins: Vec<Margin>,
    pub series: Vec<MarginSeries>,
    pub distance_m: f64,
}

#[derive(Clone)]
pub(super) struct Chronicle {
    // Later judgements depend on these fields.
    /// The author's own bodies among the road users, by number.
    own_bodies: BTreeMap<u32, usize>,
    collisions: Vec<Collision>,
    /// `None` where nothing is required.
    monitor: Option<Monitor>,
    trails: Trails,
    // Records alone.
    /// Kept if it was asked for.
    series: Vec<MarginSeries>,
    held: Vec<Held>,
    incidents: Vec<Incident>,
    trace: Trace,
    distance_m: f64,
}

impl Chronicle {
    /// The chronicle of an episode that begins in this world.
    pub fn new(setup: &Setup, world: &World) -> Chronicle {
        let mut trails = Trails::default();
        trails.note(world);
        Chronicle {
            held: Vec::new(),
            series: Vec::new(),
            own_bodies: BTreeMap::new(),
            collisions: Vec::new(),
            incidents: Vec::new(),
            trails,
            monitor: Monitor::new(setup),
            trace: Trace::default(),
            distance_m: 0.0,
        }
    }

    /// From now on the margins of each tick are kept, too.
    pub fn keep_series(&mut self, setup: &Setup) {
        let asked = |monitor| MarginSeries::of_asked(monitor, setup.table.space());
        self.series = self.monitor.as_ref().map(asked).unwrap_or_default();
    }

    /// An effect has made road users appear, the first of whom has this number.
    pub fn appeared(&mut self, effect: &Effect, first: u32) {
        self.own_bodies.extend(effect.own_bodies(first));
    }

    pub fn begin_step(&self, time_s: f64) -> StepBegins {
        StepBegins { time_s, collisions: self.collisions.len() }
    }

    /// The facts of the step that began so, and its smallest margins. The first collision of a step decides.
    pub fn end_step(&mut self, begins: StepBegins, near: Near) -> (OutcomeFacts, &[f64]) {
        let met = begins.collisions;
        let facts = match self.collisions.get(met) {
            Some(first) => collision_facts(first, &self.collisions[..met]),
            None => OutcomeFacts { proc: near.probability, near: near.body, ..OutcomeFacts::default() },
        };
        let breached = self.monitor.as_ref().map_or(0, |monitor| monitor.breached_since(begins.time_s));
        let margins = self.monitor.as_mut().map_or(&[][..], Monitor::end_step);
        (OutcomeFacts { breached, ..facts }, margins)
    }

    pub fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// A digest of every bit of the world up to now.
    pub fn digest(&self) -> [u8; 32] {
        self.trace.digest()
    }

    pub fn into_records(self) -> Records {
        let Chronicle { held, collisions, incidents, monitor, series, distance_m, .. } = self;
        let (breaches, margins) = monitor.map_or_else(Default::default, Monitor::found);
        Records { held, collisions, incidents, breaches, margins, series, distance_m }
    }

    /// Notes the driving system's answer, before the world moves.
    pub fn note_answer(&mut self, world: &World, ads: &dyn Ads) {
        let status = ads.status();
        if self.held.last().is_none_or(|held| !held.still(status)) {
            self.held.push(Held::new(world.time_s(), status));
        }
    }

    /// The world after a tick of a step, in which these contacts began.
    pub fn note(&mut self, setup: &Setup, step: usize, memory: &Memory, world: &World, contacts: &[Contact]) {
        // The tick of the first contact is judged, too: some requirements are broken by it.
        let is_whole = self.collisions.is_empty();
        for &contact in contacts {
            self.collisions.push(self.collision(world, contact, step));
        }
        self.incidents.extend_from_slice(world.incidents());
        self.trails.note(world);
        if let Some(monitor) = self.monitor.as_mut().filter(|_| is_whole) {
            monitor.judge(setup, (world, &self.own_bodies), memory, step);
            if contacts.is_empty() {
                self.series.iter_mut().for_each(|series| series.note(monitor));
            }
        }
        self.distance_m += world.ego().speed_mps * DT_S;
        world.trace(&mut self.trace);
    }

    pub fn has_hit(&self, id: u32) -> bool {
        self.collisions.iter().any(|collision| collision.contact.obstacle == id)
    }

    pub fn body(&self, world: &World, id: u32) -> Option<BodyWord> {
        world.obstacle(id).map(|obstacle| self.body_of(obstacle))
    }

    fn body_of(&self, obstacle: &Obstacle) -> BodyWord {
        BodyWord { like: obstacle.body, own: self.own_bodies.get(&obstacle.id).copied() }
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
            body: self.body_of(obstacle),
            mass_t: world.body(id).map_or(0.0, |body| body.mass_t),
            verb: obstacle.verb,
            spawned_s: obstacle.spawned_tick as f64 * DT_S,
        }
    }
}
