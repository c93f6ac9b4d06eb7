//! What the replay of an emitted scenario looked like, tick by tick.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::action::ActionTable;
use crate::ads::Selected;
use crate::geometry::{Pose, Vec2};
use crate::model::body::BodyParameters;
use crate::model::vocabulary::{Body, Level, TimeOfDay, Word};
use crate::model::{Claim, Scenario};
use crate::oracle;
use crate::oracle::{ClaimResult, NoModules, NoTries, Replays};
use crate::road::{LaneIndex, LanePlace, RoadMap};
use crate::run::{RunError, Stage};
use crate::sim::{Contact, DT_S, SignalColour, VehicleParameters, World, friction_scale};

/// Everything that can be seen of an episode from outside the vehicles.
#[derive(Debug, Clone)]
pub struct Recording {
    pub name: String,
    /// What the scenario's file says of it, line by line.
    pub docs: Vec<String>,
    pub map: Arc<RoadMap>,
    /// The OpenDRIVE file.
    pub map_path: PathBuf,
    /// Where the ego vehicle is to go.
    pub goal: LanePlace,
    /// The lanes of its route, in order.
    pub route: Vec<LaneIndex>,
    /// The last tick.
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
    /// Where the scenario comes from and what it claims: name and value.
    pub facts: Vec<(String, String)>,
}

/// A road user, from its appearance to its leaving.
#[derive(Debug, Clone)]
pub struct Actor {
    /// As claims number it; 0 is the ego vehicle.
    pub id: u32,
    /// What it is like, in the engine's words.
    pub body: Body,
    pub shape: BodyParameters,
    /// One for each tick, without gaps.
    pub samples: Vec<Sample>,
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
    /// Index in [`RoadMap::signals`].
    pub signal: usize,
    /// The tick from which it shows a colour; the first is 0.
    pub changes: Vec<(u64, SignalColour)>,
}

/// Why a scenario has no recording.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error(transparent)]
    Run(#[from] RunError),
    /// The replay is not what the scenario says.
    #[error("it does not replay: claimed {}, found {}", claims[0].claim, claims[0].found)]
    Refuted { claims: Vec<ClaimResult> },
}

impl Actor {
    /// What it is called in all formats: `ego`, or `npc_3` for the one that claims call `npc#3`.
    pub fn name(&self) -> String {
        if self.id == 0 { "ego".to_owned() } else { format!("npc_{}", self.id) }
    }

    /// Whether it is not a pedestrian.
    pub fn is_vehicle(&self) -> bool {
        self.body.is_vehicle()
    }

    pub fn first_tick(&self) -> u64 {
        self.samples[0].tick
    }

    pub fn last_tick(&self) -> u64 {
        self.samples[self.samples.len() - 1].tick
    }
}

impl Lights {
    /// The colour at a tick.
    pub fn at(&self, tick: u64) -> SignalColour {
        self.changes[self.changes.partition_point(|(from, _)| *from <= tick) - 1].1
    }
}

impl Recording {
    pub fn duration_s(&self) -> f64 {
        self.end_tick as f64 * DT_S
    }

    /// The ego vehicle and the others.
    pub fn actors(&self) -> impl Iterator<Item = &Actor> {
        core::iter::once(&self.ego).chain(&self.others)
    }
}

/// Plays a scenario again and writes down what happens. What it claims about the drive itself (collisions, end, digest of
/// all ticks) must hold; verdicts about collisions are handed on as they are written.
///
/// # Errors
/// If it cannot be played, or plays otherwise than it claims.
pub fn record(table: &ActionTable, scenario: &Scenario, ads: &Selected) -> Result<Recording, ExportError> {
    let stage = Stage::new(table, scenario)?;
    let mut recorder = Recorder::default();
    let log = stage.play(ads, &mut |world, _, contacts| recorder.note(world, contacts));
    let driven = |claim: &&Claim| {
        matches!(claim, Claim::Collision { .. } | Claim::Trace(_) | Claim::Proc(_) | Claim::End(_))
    };
    let claims = scenario.claims.iter().filter(driven).cloned().collect();
    let replays = Replays { cause: &|_| Err(NoModules { ads: ads.title() }), spare_steps: &|_| Err(NoTries) };
    let drive = Scenario { claims, ..scenario.clone() };
    let mut claims = oracle::verify(table.space(), &drive, &log, &[], &replays);
    claims.retain(ClaimResult::is_refuted);
    if !claims.is_empty() {
        return Err(ExportError::Refuted { claims });
    }
    let road = &table.space().roads[scenario.road];
    Ok(Recording {
        name: scenario.name.clone(),
        docs: scenario.docs.clone(),
        map: road.map.clone(),
        map_path: road.map_path.clone(),
        goal: road.goal,
        route: road.route.lanes.iter().map(|part| part.lane).collect(),
        end_tick: recorder.ticks,
        ego: recorder.ego.expect("an episode is seen once before its first tick"),
        others: recorder.others,
        skies: recorder.skies,
        lights: recorder.lights,
        touches: recorder.touches,
        facts: facts(scenario, &road.name),
    })
}

/// Where a scenario comes from and what it claims.
fn facts(scenario: &Scenario, road: &str) -> Vec<(String, String)> {
    let origin = &scenario.origin;
    let seed = origin.seed.map(|seed| seed.to_string());
    let known = [
        ("road", Some(road)),
        ("seed", seed.as_deref()),
        ("policy", origin.policy.as_deref()),
        ("ads", origin.ads.as_deref()),
        ("profile", origin.profile.as_deref()),
        ("profile_digest", origin.profile_digest.as_deref()),
        ("engine", origin.engine.as_deref()),
        ("traffic_digest", origin.traffic_digest.as_deref()),
    ];
    let scenario_name = [("scenario".to_owned(), scenario.name.clone())];
    let known = known.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned())));
    scenario_name.into_iter().chain(known).chain(scenario.claims.iter().filter_map(fact)).collect()
}

/// A claim as a name and a value. The collision probabilities of the steps are left out: they mean nothing elsewhere.
fn fact(claim: &Claim) -> Option<(String, String)> {
    let of = |what: &str, obstacle: &Option<crate::model::scenario::Obstacle>| match obstacle {
        Some(obstacle) => format!("{what} npc_{}", obstacle.number),
        None => what.to_owned(),
    };
    Some(match claim {
        Claim::Collision { obstacle, time } => {
            let time = time.map_or_else(|| "at any time".to_owned(), |time| time.to_string());
            (of("collision", obstacle), time)
        }
        Claim::Verdict { name, obstacle } => (of("verdict", obstacle), name.clone()),
        Claim::Avoidability { class, by, obstacle } => {
            let by = by.as_ref().map_or_else(String::new, |by| format!(" by {}", by.join(", ")));
            (of("avoidability", obstacle), format!("{}{by}", class.name()))
        }
        Claim::Cause { modules, obstacle } => (of("cause", obstacle), modules.join(", ")),
        Claim::Priority { priority, obstacle } => (of("priority", obstacle), priority.name().to_owned()),
        Claim::Minimal { obstacle } => (of("minimal", obstacle), "true".to_owned()),
        Claim::End(end) => ("end".to_owned(), end.clone()),
        Claim::Trace(digest) => ("trace".to_owned(), digest.clone()),
        Claim::Proc(_) => return None,
    })
}

/// Collects what is seen after every tick.
#[derive(Default)]
struct Recorder {
    ticks: u64,
    ego: Option<Actor>,
    others: Vec<Actor>,
    /// Where in `others` a road user is.
    places: BTreeMap<u32, usize>,
    skies: Vec<Sky>,
    lights: Vec<Lights>,
    touches: Vec<Touch>,
}

impl Recorder {
    fn note(&mut self, world: &World, contacts: &[Contact]) {
        let tick = world.ticks();
        self.ticks = tick;
        let ego = world.ego();
        let forward = ego.rear_axle.forward();
        let sample = Sample { tick, pose: world.ego_outline().pose, velocity_mps: forward * ego.speed_mps };
        self.ego.get_or_insert_with(ego_actor).samples.push(sample);
        for obstacle in world.obstacles() {
            let place = *self.places.entry(obstacle.id).or_insert(self.others.len());
            if place == self.others.len() {
                let shape = *world.body(obstacle.id).expect("it is there");
                self.others.push(Actor { id: obstacle.id, body: obstacle.body, shape, samples: Vec::new() });
            }
            let sample = Sample { tick, pose: obstacle.outline.pose, velocity_mps: obstacle.velocity_mps };
            self.others[place].samples.push(sample);
        }
        self.note_sky(world);
        self.note_lights(world);
        self.touches.extend(contacts.iter().map(|contact| Touch { tick, id: contact.obstacle }));
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

/// The ego vehicle, seen nowhere yet.
pub(super) fn ego_actor() -> Actor {
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
    Actor { id: 0, body: Body::Sedan, shape, samples: Vec::new() }
}
