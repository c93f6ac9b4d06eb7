//! The whole state of an episode.

use std::sync::Arc;

use avastra_base::geometry::OrientedBox;
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::vocabulary::{Level, LightColour, TimeOfDay, TrafficRule};
use avastra_lang::model::{Memory, Road, Space};

use crate::scene::Scene;
use crate::scene::traffic::TrafficProfile;
use crate::state::ambient::Ambient;
use crate::state::contact::{Contact, Incident};
use crate::state::ego::{Ego, VehicleParameters};
use crate::state::environment::Environment;
use crate::state::manoeuvre::PhaseCount;
use crate::state::obstacle::Obstacle;
use crate::state::passed::Passed;
use crate::state::road_user::{RoadUser, Travel};
use crate::state::sensed::{Conditions, EgoMotion, SignalColour};
use crate::state::signals::{Colours, SignalClock};
use crate::state::time::DT_S;
use crate::state::trace::traced;

/// Name of this simulated world. Raised whenever the same seed no longer gives the same episode and trace, so that an
/// old scenario is told apart from a refuted one.
pub const ENGINE: &str = "plane/18";

/// A queue before a light is at most this long, m: seven cars.
const LIGHT_QUEUE_M: f64 = 50.0;

/// Signals begin anywhere in this span, s: a whole number of cycles of two, three and four groups.
const PHASES_S: f64 = 204.0;

/// How an episode begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Speed of the ego vehicle, m/s.
    pub ego_mps: f64,
    pub time: TimeOfDay,
    /// Levels of rain, fog and wetness.
    pub sky: [Level; 3],
    /// Time in the signals' cycle at which the episode begins, s.
    pub signal_phase_s: f64,
    /// Seed of the choices of other road users.
    pub seed: u64,
    /// The moment of a frame (0.1 s) in which each of them looks at the world. With 0 it follows from their numbers,
    /// otherwise it is drawn from this seed. So others react by up to a frame sooner or later.
    pub reactions: u64,
    /// Until this moment of the episode, s, they look as with `reactions` 0.
    pub reactions_from_s: f64,
    /// Vehicles of ambient traffic that are kept around the ego vehicle, at most `model::AMBIENT_MAX`.
    pub ambient: u32,
    /// How other vehicles drive.
    pub traffic: TrafficProfile,
}

impl Start {
    /// The start of an episode with this seed and memory, without ambient traffic, under the default traffic profile.
    pub fn drawn(space: &Space, road: &Road, memory: &Memory, seed: u64) -> Start {
        let mut rng = rng::stream(seed, Stream::Reset, 1);
        // A multiple of 1/64 s is a short decimal in a file.
        let signal_phase_s = (rng::between(&mut rng, 0.0, PHASES_S) * 64.0).floor() / 64.0;
        let (time, sky) = space.weather(memory);
        Start {
            ego_mps: road.ego_mps,
            time,
            sky,
            signal_phase_s: road.signal_phase_s.unwrap_or(signal_phase_s),
            seed,
            reactions: 0,
            reactions_from_s: 0.0,
            ambient: 0,
            traffic: TrafficProfile::default(),
        }
    }
}

/// The colour ordered for a traffic light, once the ego vehicle's front is at that station.
#[derive(Debug, Clone, Copy)]
pub struct Switch {
    /// In `RoadMap::signals`.
    pub signal: usize,
    pub colour: LightColour,
    pub at_m: f64,
}

/// The whole state of an episode: `Clone` is a snapshot.
#[derive(Debug, Clone)]
pub struct World {
    pub(crate) scene: Arc<Scene>,
    // The state: what later ticks depend on. `trace` covers all of it but scene and profile of traffic, which no tick changes.
    pub(crate) ticks: u64,
    pub(crate) ego: Ego,
    /// Place of the ego vehicle's rear axle beside the route.
    pub(crate) ego_station_m: f64,
    pub(crate) ego_offset_m: f64,
    /// Height of the road under it, m. It follows from the station.
    pub(crate) ego_elevation_m: f64,
    pub(crate) red_runs: u32,
    pub(crate) ego_passed: Passed,
    /// Until this tick another vehicle pushes the ego vehicle.
    pub(crate) pushed_until: u64,
    pub(crate) environment: Environment,
    pub(crate) conditions: Conditions,
    pub(crate) signals: SignalClock,
    /// The colours that they show in this tick.
    pub(crate) colours: Colours,
    /// The order to a light.
    pub(crate) switch: Option<Switch>,
    /// In order of appearance.
    pub(crate) users: Vec<RoadUser>,
    pub(crate) next_id: u32,
    pub(crate) travel: Travel,
    pub(crate) ambient: Ambient,
    pub(crate) traffic: TrafficProfile,
    /// Tick from which time of day and weather may change.
    pub(crate) weather_tick: u64,
    /// Seed of the choices of other road users, and that of when they look.
    pub(crate) seed: u64,
    pub(crate) reactions: u64,
    /// Tick from which `reactions` hold.
    pub(crate) reactions_from: u64,
    // The contacts and incidents of the last tick. No later tick reads them.
    pub(crate) contacts: Vec<Contact>,
    pub(crate) incidents: Vec<Incident>,
    /// The clocks of the lights before orders moved them, and up to which tick each counted: what was shown in the past. No tick
    /// reads it, either.
    pub(crate) signals_until: Vec<(u64, SignalClock)>,
}

impl World {
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Dimensions, mass and limits of a road user; `None` if there is none with that id.
    pub fn body(&self, id: u32) -> Option<&BodyParameters> {
        self.user(id).map(|user| &user.mover.size)
    }

    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    pub fn time_s(&self) -> f64 {
        self.ticks as f64 * DT_S
    }

    pub fn ego(&self) -> EgoMotion {
        self.ego.motion
    }

    pub fn ego_outline(&self) -> OrientedBox {
        self.ego.outline
    }

    /// Station of the ego vehicle's rear axle on the route, m.
    pub fn ego_station_m(&self) -> f64 {
        self.ego_station_m
    }

    /// How far the ego vehicle's rear axle is to the left of the route, m.
    pub fn ego_offset_m(&self) -> f64 {
        self.ego_offset_m
    }

    /// Whether the ego vehicle comes to a light that is not green, or waits in the queue before one.
    pub fn waits_for_light(&self) -> bool {
        let front_m = self.ego_front_m();
        let mut ahead = self.scene.route.stop_lines.iter().filter(|line| line.station_m > front_m - 1.0);
        let next = ahead.next().filter(|line| line.station_m < front_m + LIGHT_QUEUE_M);
        next.is_some_and(|line| self.signal(line.signal) != SignalColour::Green)
    }

    /// Stop lines of the route that the ego vehicle's front passed under a red light.
    pub fn red_runs(&self) -> u32 {
        self.red_runs
    }

    /// All road users but the ego vehicle, in order of appearance.
    pub fn obstacles(&self) -> impl ExactSizeIterator<Item = &Obstacle> + Clone {
        self.users.iter().map(|user| &user.obstacle)
    }

    /// The obstacles whose roads neither pass over nor under that of the ego vehicle.
    pub fn obstacles_on_level(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles().filter(|obstacle| !obstacle.is_apart)
    }

    /// The road user with an id, if it is there.
    pub fn obstacle(&self, id: u32) -> Option<&Obstacle> {
        self.obstacles().find(|obstacle| obstacle.id == id)
    }

    /// Whether the road user with an id ignores a rule of the road; false if it is not there, or on foot.
    pub fn ignores(&self, id: u32, rule: TrafficRule) -> bool {
        self.users.iter().any(|user| user.obstacle.id == id && user.mover.ignores(rule))
    }

    /// Whether the road user with an id is an emergency vehicle under way.
    pub fn has_siren(&self, id: u32) -> bool {
        self.users.iter().any(|user| user.obstacle.id == id && user.mover.has_siren())
    }

    /// How far the road user with an id is with its manoeuvre; 0 if it is not there.
    pub fn phases(&self, id: u32) -> PhaseCount {
        let user = self.user(id);
        user.map_or(PhaseCount::default(), |user| user.mover.phases)
    }

    /// The phase that the road user with an id is in: the index of its manoeuvre in the space, the phase's number from
    /// 1, and the tick in which the phase began.
    pub fn phase(&self, id: u32) -> Option<(usize, u32, u64)> {
        let user = self.user(id)?;
        user.mover.course.as_ref()?.under_way()
    }

    /// By how much the road user with an id missed the moment of its last `early`, s; below 0 if it was too soon.
    pub fn late_s(&self, id: u32) -> Option<f64> {
        self.user(id)?.mover.late_s()
    }

    /// The id of the latest bearer of a name, if one is there.
    pub fn bearer_id(&self, who: usize) -> Option<u32> {
        Some(self.users[self.bearer(who)?].obstacle.id)
    }

    /// The index of the latest bearer of a name.
    pub(crate) fn bearer(&self, who: usize) -> Option<usize> {
        self.users.iter().rposition(|user| user.mover.bearer == Some(who))
    }

    /// Contacts among obstacles that began in the tick before.
    pub fn incidents(&self) -> &[Incident] {
        &self.incidents
    }

    pub fn time_of_day(&self) -> TimeOfDay {
        self.environment.time
    }

    /// Levels of rain, fog and wetness.
    pub fn sky(&self) -> [Level; 3] {
        self.environment.sky
    }

    /// Light, weather and grip.
    pub fn conditions(&self) -> Conditions {
        self.conditions
    }

    /// Colour of a signal now, by index in `RoadMap::signals`.
    pub fn signal(&self, signal: usize) -> SignalColour {
        self.colours.now[signal]
    }

    /// Colour of a signal at a tick that is past.
    pub fn signal_at(&self, signal: usize, tick: u64) -> SignalColour {
        let then = self.signals_until.iter().find(|(until, _)| tick < *until);
        then.map_or(&self.signals, |(_, clock)| clock).colour(&self.scene.map, signal, tick)
    }

    /// Whether the ego vehicle's front bumper is at most 1 m before the goal, or beyond it.
    pub fn arrived(&self) -> bool {
        self.ego_front_m() >= self.scene.route.goal_m - 1.0
    }

    /// Whether the ego vehicle is in a junction that it was not allowed to enter: at red, late at yellow, or past a
    /// stop sign without having stood.
    pub fn ego_runs_signal(&self) -> bool {
        self.ego_passed.is_running_signal(&self.scene.map, &self.ego.outline)
    }

    /// This world with an ego vehicle that drives no faster than so.
    pub fn with_ego_at_most(&self, speed_mps: f64) -> World {
        let mut world = self.clone();
        world.ego.motion.speed_mps = world.ego.motion.speed_mps.min(speed_mps);
        world
    }

    /// Whether the ego vehicle is in a junction that it entered past a stop sign without having stood.
    pub fn ego_runs_stop(&self) -> bool {
        self.ego_passed.is_running_stop(&self.scene.map, &self.ego.outline)
    }

    /// As [`World::ego_runs_stop`], of the road user with an id.
    pub fn runs_stop(&self, id: u32) -> bool {
        let user = self.user(id);
        user.is_some_and(|RoadUser { obstacle, mover }| {
            mover.rights.passed.is_running_stop(&self.scene.map, &obstacle.outline)
        })
    }

    /// Whether the road user with an id drives a lane change; `None` if no driver leads it along lanes.
    pub fn changes_lanes(&self, id: u32) -> Option<bool> {
        self.user(id)?.mover.changes_lanes()
    }

    /// As [`World::ego_runs_signal`], of the road user with an id.
    pub fn runs_signal(&self, id: u32) -> bool {
        let user = self.user(id);
        user.is_some_and(|user| {
            user.mover.rights.passed.is_running_signal(&self.scene.map, &user.obstacle.outline)
        })
    }

    pub(crate) fn user(&self, id: u32) -> Option<&RoadUser> {
        self.users.iter().find(|user| user.obstacle.id == id)
    }

    /// Station of the ego vehicle's front bumper on the route, m.
    pub(crate) fn ego_front_m(&self) -> f64 {
        VehicleParameters::MKZ.front_m(self.ego_station_m)
    }
}

traced! {
    Switch { signal, colour, at_m };
    World {
        ticks, ego, ego_station_m, ego_offset_m, red_runs, ego_passed, environment,
        // All but the friction follows from the environment.
        conditions => conditions.friction, signals, switch, users, next_id, ambient, weather_tick, seed,
        reactions
    } but {
        // No tick changes these.
        scene, traffic, reactions_from,
        // It follows from the station, and what is shown from the clock.
        ego_elevation_m, colours,
        // It follows from the contacts, and they from what is traced.
        pushed_until,
        // It saves work, and changes nothing.
        travel,
        // No tick reads these.
        contacts, incidents, signals_until
    };
}
