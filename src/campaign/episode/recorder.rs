//! An episode as seen from outside the vehicles, tick by tick: the way of each road user, sky, lights and contacts.
//!
//! One recorder for all that shows an episode again: exports, pages and pictures. It leaves out the state of the driving
//! system; the exports, pages and pictures that show it add it themselves.

use std::collections::{BTreeMap, BTreeSet};

use avastra_base::geometry::{Pose, Vec2};
use avastra_drivers::Ads;
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::vocabulary::{Body, BodyClass, Level, ShownLights, TimeOfDay};
use avastra_world::sim::{
    Contact, DT_S, Incident, Obstacle, SignalColour, VehicleParameters, World, friction_scale,
};

/// The ego vehicle's brake lights are on above this much brake, %. Ours: a brake that only rubs lights nothing.
const BRAKE_PCT_MIN: f64 = 1.0;
/// Other vehicles have no pedals: their brake lights are on where they lost more than 1 m/s² over the last 0.3 s. Ours.
const BRAKING_TICKS: usize = 15;
const BRAKING_MPS2: f64 = 1.0;

/// Watches an episode from before its first tick on, and keeps what can be seen.
#[derive(Debug, Clone)]
pub struct Recorder {
    /// The last tick that was seen.
    pub end_tick: u64,
    pub ego: Actor,
    /// All others, in order of appearance.
    pub others: Vec<Actor>,
    /// By rising time; the first is the one of the start.
    pub skies: Vec<Sky>,
    /// The lights that hold a lane.
    pub lights: Vec<Lights>,
    /// Contacts of the ego vehicle with others.
    pub touches: Vec<Touch>,
    /// Crashes of others into each other.
    pub crashes: Vec<Crash>,
    /// Where in `others` a road user is.
    places: BTreeMap<u32, usize>,
}

/// A road user, from its appearance to its leaving.
#[derive(Debug, Clone)]
pub struct Actor {
    /// As claims number it; 0 is the ego vehicle.
    pub id: u32,
    /// Its body, in the engine's words.
    pub body: Body,
    pub shape: BodyParameters,
    /// As it was when it appeared; `None` for the ego vehicle.
    pub first: Option<Obstacle>,
    /// One for each tick, without gaps.
    pub samples: Vec<Sample>,
    /// The tick from which its brake lights are on or off; empty until they are on for the first time.
    pub brake_lights: Vec<(u64, bool)>,
    /// The tick from which it shows what it was told to; empty until that is something.
    pub lights: Vec<(u64, ShownLights)>,
    /// The phases of manoeuvres that began.
    pub phases: Vec<Phase>,
}

/// A phase of a manoeuvre begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Phase {
    /// In this tick.
    pub tick: u64,
    /// The manoeuvre, by its index in the space.
    pub manoeuvre: usize,
    /// From 1.
    pub number: u32,
}

/// A road user at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub tick: u64,
    /// Middle of the outline.
    pub pose: Pose,
    pub velocity_mps: Vec2,
}

/// The ego vehicle and another begin to touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touch {
    /// At the end of the tick in which they do.
    pub tick: u64,
    pub id: u32,
}

/// Two others crash into each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crash {
    /// At the end of the tick in which they do.
    pub tick: u64,
    pub ids: [u32; 2],
}

/// Time of day and weather, from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    pub time_s: f64,
    pub time_of_day: TimeOfDay,
    /// Levels of rain, fog and wetness.
    pub levels: [Level; 3],
    pub rain_mmph: f64,
    pub visibility_m: f64,
    /// Water on the road, mm.
    pub water_mm: f64,
    /// The part of a dry road's friction that is left.
    pub friction_scale: f64,
}

/// A set of lights, and what it showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Lights {
    /// Index in [`RoadMap::signals`](avastra_road::RoadMap::signals).
    pub signal: usize,
    /// The tick from which it shows a colour; the first is 0.
    pub changes: Vec<(u64, SignalColour)>,
}

impl Default for Recorder {
    fn default() -> Recorder {
        Recorder {
            end_tick: 0,
            ego: Actor::ego(),
            others: Vec::new(),
            skies: Vec::new(),
            lights: Vec::new(),
            touches: Vec::new(),
            crashes: Vec::new(),
            places: BTreeMap::new(),
        }
    }
}

impl Recorder {
    /// Records the present tick. Call it as a [`Watch`](super::Watch) is called: before the first tick, and after every
    /// tick.
    pub fn note(&mut self, world: &World, ads: &dyn Ads, contacts: &[Contact]) {
        let tick = world.ticks();
        self.end_tick = tick;
        let ego = world.ego();
        let velocity_mps = ego.rear_axle.forward() * ego.speed_mps;
        self.ego.samples.push(Sample { tick, pose: world.ego_outline().pose, velocity_mps });
        self.ego.light_brakes(tick, ads.status().control.brake_pct > BRAKE_PCT_MIN);
        for obstacle in world.obstacles() {
            let place = *self.places.entry(obstacle.id).or_insert(self.others.len());
            if place == self.others.len() {
                let shape = *world.body(obstacle.id).expect("an obstacle of the world has a body");
                let (id, body, first) = (obstacle.id, obstacle.body, Some(*obstacle));
                self.others.push(Actor { id, body, shape, first, ..Actor::ego() });
            }
            let sample = Sample { tick, pose: obstacle.outline.pose, velocity_mps: obstacle.velocity_mps };
            let actor = &mut self.others[place];
            if actor.lights_at(tick) != obstacle.lights {
                actor.lights.push((tick, obstacle.lights));
            }
            actor.note(sample);
            let phase = world.phase(obstacle.id);
            let phase = phase.map(|(manoeuvre, number, tick)| Phase { tick, manoeuvre, number });
            actor.phases.extend(phase.filter(|phase| actor.phases.last() != Some(phase)));
        }
        self.note_sky(world);
        self.note_lights(world);
        self.touches.extend(contacts.iter().map(|contact| Touch { tick, id: contact.obstacle }));
        let ids = |incident: &Incident| [incident.obstacle, incident.other];
        self.crashes.extend(world.incidents().iter().map(|incident| Crash { tick, ids: ids(incident) }));
    }

    /// The numbers of those that a road user begins to touch in a tick; 0 is the ego vehicle.
    pub fn met_by(&self, id: u32, tick: u64) -> Vec<u32> {
        let touches = self.touches.iter().map(|touch| (touch.tick, [0, touch.id]));
        let crashes = self.crashes.iter().map(|crash| (crash.tick, crash.ids));
        let now = touches.chain(crashes).filter(|(at, _)| *at == tick).map(|(_, ids)| ids);
        now.filter_map(|[one, other]| match id {
            _ if id == one => Some(other),
            _ if id == other => Some(one),
            _ => None,
        })
        .collect()
    }

    /// Numbers of the road users whose brake lights are on at a tick; 0 is the ego vehicle.
    pub fn braking(&self, tick: u64) -> BTreeSet<u32> {
        let actors = core::iter::once(&self.ego).chain(&self.others);
        actors.filter(|actor| actor.brakes_at(tick)).map(|actor| actor.id).collect()
    }

    fn note_sky(&mut self, world: &World) {
        let (time_of_day, levels) = (world.time_of_day(), world.sky());
        if self.skies.last().is_some_and(|sky| (sky.time_of_day, sky.levels) == (time_of_day, levels)) {
            return;
        }
        let conditions = world.conditions();
        self.skies.push(Sky {
            time_s: world.time_s(),
            time_of_day,
            levels,
            rain_mmph: conditions.rain_mmph,
            visibility_m: conditions.visibility_m,
            water_mm: conditions.water_mm,
            friction_scale: friction_scale(conditions.water_mm),
        });
    }

    fn note_lights(&mut self, world: &World) {
        let tick = world.ticks();
        if tick == 0 {
            let signals = world.scene().map.signals.iter().enumerate();
            let holding = signals.filter(|(_, signal)| signal.for_vehicles && !signal.lanes.is_empty());
            self.lights = holding.map(|(signal, _)| Lights { signal, changes: Vec::new() }).collect();
        }
        for lights in &mut self.lights {
            let colour = world.signal(lights.signal);
            if lights.changes.last().is_none_or(|(_, last)| *last != colour) {
                lights.changes.push((tick, colour));
            }
        }
    }
}

impl Actor {
    /// The ego vehicle, seen nowhere yet.
    pub fn ego() -> Actor {
        let mkz = VehicleParameters::MKZ;
        let shape = BodyParameters {
            length_m: mkz.length_m,
            width_m: mkz.width_m,
            height_m: mkz.height_m,
            wheelbase_m: mkz.wheelbase_m,
            rear_axle_m: mkz.rear_axle_to_centre_m(),
            mass_t: mkz.mass_t,
            acceleration_mps2_max: mkz.acceleration_mps2_max,
            deceleration_mps2_max: mkz.deceleration_mps2_max,
        };
        Actor {
            id: 0,
            body: Body::Sedan,
            shape,
            first: None,
            samples: Vec::new(),
            brake_lights: Vec::new(),
            lights: Vec::new(),
            phases: Vec::new(),
        }
    }

    /// Its name in other tools: `ego`, or `npc_3` for the road user that claims call `npc#3`.
    pub fn name(&self) -> String {
        if self.id == 0 { "ego".to_owned() } else { format!("npc_{}", self.id) }
    }

    /// Whether it is not on foot.
    pub fn is_vehicle(&self) -> bool {
        self.body.is_vehicle()
    }

    pub fn first_tick(&self) -> u64 {
        self.samples[0].tick
    }

    pub fn last_tick(&self) -> u64 {
        self.samples[self.samples.len() - 1].tick
    }

    /// Whether its brake lights are on at a tick.
    pub fn brakes_at(&self, tick: u64) -> bool {
        let changes = self.brake_lights.partition_point(|(from, _)| *from <= tick);
        changes > 0 && self.brake_lights[changes - 1].1 && tick <= self.last_tick()
    }

    /// Its lights at a tick.
    pub fn lights_at(&self, tick: u64) -> ShownLights {
        let changes = self.lights.partition_point(|(from, _)| *from <= tick);
        changes.checked_sub(1).map_or(ShownLights::Off, |last| self.lights[last].1)
    }

    fn note(&mut self, sample: Sample) {
        let before = self.samples.len().checked_sub(BRAKING_TICKS).map(|index| &self.samples[index]);
        let lost_mps = before.map_or(0.0, |before| before.velocity_mps.norm() - sample.velocity_mps.norm());
        self.samples.push(sample);
        let brakes = lost_mps > BRAKING_MPS2 * BRAKING_TICKS as f64 * DT_S;
        self.light_brakes(sample.tick, brakes && BodyClass::Vehicle.holds(self.body));
    }

    fn light_brakes(&mut self, tick: u64, on: bool) {
        if self.brake_lights.last().is_some_and(|(_, last)| *last) != on {
            self.brake_lights.push((tick, on));
        }
    }
}

impl Sample {
    /// Along its heading, m/s; negative backwards.
    pub fn speed_mps(&self) -> f64 {
        self.velocity_mps.dot(&self.pose.forward())
    }
}

impl Lights {
    /// The colour at a tick.
    pub fn at(&self, tick: u64) -> SignalColour {
        self.changes[self.changes.partition_point(|(from, _)| *from <= tick) - 1].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vehicle with a speed at each tick, from tick 100 on.
    fn driven(speeds_mps: impl IntoIterator<Item = f64>) -> Actor {
        let mut actor = Actor::ego();
        for (index, speed_mps) in speeds_mps.into_iter().enumerate() {
            let velocity_mps = Vec2::new(speed_mps, 0.0);
            actor.note(Sample { tick: 100 + index as u64, pose: Pose::new(0.0, 0.0, 0.0), velocity_mps });
        }
        actor
    }

    #[test]
    fn brake_lights_are_on_while_a_vehicle_slows_down() {
        // A second at 10 m/s, a second of braking with 2 m/s², a second at 8 m/s.
        let speed_mps = |tick: u32| 10.0 - 2.0 * (f64::from(tick.clamp(50, 100)) - 50.0) * DT_S;
        let actor = driven((0..150).map(speed_mps));
        // 0.3 s × 1 m/s² are lost after 0.15 s, and lost no more in the last 0.15 s.
        assert_eq!(actor.brake_lights, [(158, true), (208, false)]);
        assert_eq!([157, 158, 207, 208].map(|tick| actor.brakes_at(tick)), [false, true, true, false]);
        assert!(!actor.brakes_at(0), "it is not there yet");
    }

    #[test]
    fn a_vehicle_that_backs_up_faster_does_not_brake() {
        let actor = driven((0..100).map(|tick| -2.0 * f64::from(tick) * DT_S));
        assert!(actor.brake_lights.is_empty());
    }
}
