//! The world of one episode, and what a tick does to it. `world/playback` moves it by a recording, `world/survey`
//! answers what drawing asks.

mod commands;
mod playback;
mod survey;
#[cfg(any(test, feature = "testing"))]
mod testing;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use avastra_base::geometry::{Frame, OrientedBox, Pose, Sweep, Vec2};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::command::Command;
use avastra_lang::model::vocabulary::{Body, Level, LightColour, TimeOfDay, TrafficRule};
use avastra_lang::model::{COMMANDED_MAX, Memory, NpcFacts, Road, Space};
use avastra_road::{RouteLaneChange, SignKind, is_apart};

use super::ambient::{Ambient, RENEWAL_TICKS, is_gone};
use super::around::Around;
use super::contact::{Contact, Party, meet};
use super::ego::{Control, Ego, VehicleParameters};
use super::environment::Environment;
use super::incident::{Bump, Incident, bump, exchange, impact};
use super::moment::npc_facts;
use super::right_of_way::{Passed, light_before, room_before_m};
use super::road_user::{Moved, Obstacle, PhaseCount, RoadUser};
use super::sense::visible_fraction;
use crate::scene::Scene;
use crate::scene::traffic::TrafficProfile;
use crate::state::sensed::{Conditions, EgoMotion, Sensed, SensedObject, SignalColour};
use crate::state::signals::SignalClock;
use crate::state::time::{DT_S, FRAME_S, FRAME_TICKS, ticks};
use crate::state::trace::Trace;

/// Name of this simulated world. Raised whenever the same seed no longer gives the same episode and trace, so that an
/// old scenario is told apart from a refuted one.
pub const ENGINE: &str = "plane/17";

/// What stands farther ahead than this on the route does not block the ego vehicle, m: a queue of five cars.
const QUEUE_M: f64 = 40.0;

/// A queue before a light is at most this long, m: seven cars.
const LIGHT_QUEUE_M: f64 = 50.0;

/// An ego vehicle farther than this from its way and from every lane of the map has left the map, m. One that went astray beside
/// a street is nearer.
const OFF_MAP_M: f64 = 20.0;

/// Added to the way of two bodies before they are taken to be too far apart to touch, m: far more than rounding.
const NEAR_M: f64 = 1e-3;

/// How far along the route the ego vehicle is looked for from where it was, m. More than it drives
/// in a tick, so that it is found again after a corner cut, and less than any loop of a route.
const ROUTE_SEARCH_M: f64 = 2.0;

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
    /// Which of the moments of a frame (0.1 s) each of them looks at the world in: 0 by their numbers, otherwise by chance
    /// from this seed. So others react by up to a frame sooner or later.
    pub reactions: u64,
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
            ambient: 0,
            traffic: TrafficProfile::default(),
        }
    }
}

/// What a traffic light was told to show, once the ego vehicle's front is at that station.
#[derive(Debug, Clone, Copy)]
struct Switch {
    /// In `RoadMap::signals`.
    signal: usize,
    colour: LightColour,
    at_m: f64,
}

/// A vehicle that was hit from behind is pushed for so long, ticks: 2 s. Ours: with brakes it stands within it.
const PUSHED_TICKS: u64 = ticks(2.0);

/// The whole state of an episode: `Clone` is a snapshot.
#[derive(Debug, Clone)]
pub struct World {
    scene: Arc<Scene>,
    // The state: what later ticks depend on. `trace` covers all of it but scene and profile of traffic, which no tick changes.
    ticks: u64,
    ego: Ego,
    /// Place of the ego vehicle's rear axle beside the route.
    ego_station_m: f64,
    ego_offset_m: f64,
    /// Height of the road under it, m. It follows from the station.
    ego_elevation_m: f64,
    red_runs: u32,
    ego_passed: Passed,
    /// Until this tick another vehicle pushes the ego vehicle.
    pushed_until: u64,
    environment: Environment,
    conditions: Conditions,
    signals: SignalClock,
    /// What a light was told to show.
    switch: Option<Switch>,
    /// In order of appearance.
    users: Vec<RoadUser>,
    next_id: u32,
    ambient: Ambient,
    traffic: TrafficProfile,
    /// Tick from which time of day and weather may change.
    weather_tick: u64,
    /// Seed of the choices of other road users, and that of when they look.
    seed: u64,
    reactions: u64,
    // What the last tick has to tell. No later tick reads it.
    contacts: Vec<Contact>,
    incidents: Vec<Incident>,
    /// The clocks of the lights before orders moved them, and up to which tick each counted: what was shown in the past. No tick
    /// reads it, either.
    signals_until: Vec<(u64, SignalClock)>,
}

/// The ego vehicle in a tick, before any contact.
struct EgoTick {
    party: Party,
    speed_mps: f64,
    /// Farthest that any point of it moves, m.
    most_m: f64,
}

impl World {
    /// The beginning of an episode: the ego vehicle rolls with its rear axle on the start of
    /// the route; beside ambient traffic, if asked for, nothing else is there.
    pub fn new(scene: Arc<Scene>, start: &Start) -> World {
        World::with_ego_at(scene, start, 0.0, start.ego_mps)
    }

    /// The beginning of an episode that begins elsewhere on the route, at another speed.
    pub fn with_ego_at(scene: Arc<Scene>, start: &Start, station_m: f64, speed_mps: f64) -> World {
        let environment = Environment::new(start.time, start.sky);
        let mut world = World {
            ticks: 0,
            ego: Ego::new(scene.route.path.pose_at(station_m), speed_mps),
            ego_station_m: station_m,
            ego_offset_m: 0.0,
            ego_elevation_m: scene.route.height_at(&scene.map, station_m),
            red_runs: 0,
            ego_passed: Passed::default(),
            pushed_until: 0,
            conditions: environment.conditions(speed_mps),
            environment,
            signals: SignalClock::new(start.signal_phase_s, scene.signal_program),
            switch: None,
            signals_until: Vec::new(),
            users: Vec::with_capacity(COMMANDED_MAX as usize),
            next_id: 1,
            ambient: Ambient::new(start.ambient),
            traffic: start.traffic,
            weather_tick: 0,
            seed: start.seed,
            reactions: start.reactions,
            contacts: Vec::new(),
            incidents: Vec::new(),
            scene,
        };
        for _ in 0..world.ambient.wanted {
            world.renew_ambient(true);
        }
        world
    }

    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Advances by [`DT_S`]; returns the contacts that began.
    ///
    /// An obstacle that the ego vehicle touched once brakes to rest and touches it no more. Two obstacles
    /// that touch each other slide to rest (see [`World::incidents`]). A wreck leaves when it has stood for
    /// 2 s and the ego vehicle does not see it; so do drivers who waited for others for 20 s.
    pub fn tick(&mut self, control: &Control) -> &[Contact] {
        self.contacts.clear();
        self.incidents.clear();
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.watch_rights();
        }
        self.direct();
        let start = self.ego.outline;
        let friction = self.environment.grip().friction(self.ego.motion.speed_mps);
        self.ego.step(control, friction, DT_S);
        self.follow_route();
        // Taken once: of two contacts in a tick, the second does not see what the first did to the ego.
        let ego = Party {
            sweep: Sweep { start, end: self.ego.outline.pose },
            velocity_mps: self.ego.velocity_mps(),
        };
        let ego = EgoTick { most_m: ego.sweep.most_m(), party: ego, speed_mps: self.ego.motion.speed_mps };
        // Taken out for the tick, so that each can move while it looks at the others and at the world.
        let mut users = core::mem::take(&mut self.users);
        let mut index = 0;
        while index < users.len() {
            if self.tick_user(index, &mut users, &ego) {
                index += 1;
            } else {
                users.remove(index);
            }
        }
        self.users = users;
        self.measure();
        self.ticks += 1;
        self.switch_light();
        if self.ambient.wanted > 0 && self.ticks.is_multiple_of(RENEWAL_TICKS) {
            self.renew_ambient(false);
        }
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.environment.pass(FRAME_S);
            self.conditions = self.environment.conditions(self.ego.motion.speed_mps);
            self.look();
        }
        &self.contacts
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

    /// What can be asked about the road user with an id, if it is there.
    pub fn npc_facts(&self, id: u32) -> Option<NpcFacts> {
        let user = self.user(id)?;
        let facts = npc_facts(&self.alone(), &user.obstacle, &user.mover.motion);
        let (priority, crashed) = (user.mover.rights.now(self.ticks), user.mover.has_crashed());
        Some(NpcFacts { priority, crashed, ..facts })
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

    /// The phase that the road user with an id is in: its manoeuvre, by its index in the space, its number from 1, and the tick
    /// in which it began.
    pub fn phase(&self, id: u32) -> Option<(usize, u32, u64)> {
        let user = self.user(id)?;
        user.mover.course.as_ref()?.under_way()
    }

    /// Whether the road user with an id has done what a command says: it has the speed, is in the lane and at the place
    /// beside its middle, and the junction of its turn is behind it.
    pub fn has_done(&self, id: u32, command: &Command) -> bool {
        let user = self.user(id);
        let progress = user.and_then(|user| user.mover.motion.progress(&self.alone()));
        progress.is_some_and(|progress| progress.meets(command))
    }

    /// By how much the road user with an id missed the moment of its last `early`, s; below 0 if it was too soon.
    pub fn late_s(&self, id: u32) -> Option<f64> {
        self.user(id)?.mover.late_s()
    }

    /// The id of the latest bearer of a name, if one is there.
    pub fn bearer_id(&self, who: usize) -> Option<u32> {
        Some(self.users[self.bearer(who)?].obstacle.id)
    }

    /// What can be asked about the latest bearer of a name, if one is there.
    pub fn bearer_facts(&self, who: usize) -> Option<NpcFacts> {
        self.npc_facts(self.users[self.bearer(who)?].obstacle.id)
    }

    /// The index of the latest bearer of a name.
    fn bearer(&self, who: usize) -> Option<usize> {
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
        self.signals.colour(&self.scene.map, signal, self.ticks)
    }

    /// Colour of a signal at a tick that is past.
    pub fn signal_at(&self, signal: usize, tick: u64) -> SignalColour {
        let then = self.signals_until.iter().find(|(until, _)| tick < *until);
        then.map_or(&self.signals, |(_, clock)| clock).colour(&self.scene.map, signal, tick)
    }

    /// What the sensors see now, in buffers of its own.
    pub fn sensed(&self) -> Sensed {
        let mut sensed = Sensed {
            time_s: 0.0,
            ego: self.ego.motion,
            objects: Vec::new(),
            signals: Vec::new(),
            conditions: self.conditions,
        };
        self.sense(&mut sensed);
        sensed
    }

    /// Fills `into` with what the sensors see now; its buffers are reused.
    ///
    /// Everything is of this tick, except lines of sight, which are worked out ten times a second.
    pub fn sense(&self, into: &mut Sensed) {
        into.time_s = self.time_s();
        into.ego = self.ego.motion;
        into.conditions = self.conditions;
        into.signals.clear();
        into.signals.extend((0..self.scene.map.signals.len()).map(|signal| self.signal(signal)));
        into.objects.clear();
        let range_m = self.scene.range_m;
        for RoadUser { obstacle, mover } in self.users.iter().filter(|user| !user.obstacle.is_apart) {
            let away = obstacle.outline.pose.position - self.ego.outline.pose.position;
            if away.norm_squared() > range_m * range_m {
                continue;
            }
            into.objects.push(SensedObject {
                id: obstacle.id,
                body: obstacle.body,
                pose: obstacle.outline.pose,
                velocity_mps: obstacle.velocity_mps,
                length_m: mover.size.length_m,
                width_m: mover.size.width_m,
                height_m: mover.size.height_m,
                visible_fraction: mover.visible_fraction,
                distance_m: obstacle.distance_m,
                is_unlit: mover.is_unlit() || obstacle.body == Body::Object,
                has_siren: mover.has_siren(),
                lights: obstacle.lights,
            });
        }
    }

    /// Feeds every bit of the state that later ticks depend on to `trace`, in a fixed order. Here, and for everything that moves,
    /// a pattern names every field, so that a new one cannot be forgotten.
    pub fn trace(&self, trace: &mut Trace) {
        let World {
            ticks,
            ego,
            ego_station_m,
            ego_offset_m,
            red_runs,
            ego_passed,
            environment,
            conditions,
            signals,
            switch,
            users,
            next_id,
            ambient,
            weather_tick,
            seed,
            reactions,
            // No tick changes these.
            scene: _,
            traffic: _,
            // It follows from the station.
            ego_elevation_m: _,
            // It follows from the contacts, and they from what is traced.
            pushed_until: _,
            // No tick reads these.
            contacts: _,
            incidents: _,
            signals_until: _,
        } = self;
        trace.word(*ticks);
        ego.trace(trace);
        trace.numbers([*ego_station_m, *ego_offset_m]);
        trace.word(u64::from(*red_runs));
        ego_passed.trace(trace);
        environment.trace(trace);
        // All but the friction follows from the environment.
        trace.number(conditions.friction);
        signals.trace(trace);
        trace.flags([switch.is_some()]);
        if let Some(Switch { signal, colour, at_m }) = *switch {
            trace.words([signal as u64, colour as u64]);
            trace.number(at_m);
        }
        trace.word(u64::from(*next_id));
        ambient.trace(trace);
        trace.words([*weather_tick, *seed, *reactions, users.len() as u64]);
        for user in users {
            user.trace(trace);
        }
    }

    /// Whether the ego vehicle's front bumper is at most 1 m before the goal, or beyond it.
    pub fn arrived(&self) -> bool {
        self.ego_front_m() >= self.scene.route.goal_m - 1.0
    }

    /// Whether something stands in the ego vehicle's way that will not go: a wreck, or a driver that waits for
    /// others that wait for it. Vehicles that stand between them belong to the same queue. After a contact the ego
    /// vehicle itself is a wreck.
    pub fn is_blocked(&self) -> bool {
        let front_m = self.ego_front_m();
        let stands_in_way = |user: &RoadUser| user.mover.is_stuck(&user.obstacle) && !user.obstacle.is_apart;
        !self.ego.motion.touched
            && self.users.iter().filter(|user| stands_in_way(user)).any(|user| {
                let Obstacle { outline, forward, .. } = &user.obstacle;
                let beside = self.scene.route.path.project_from(outline.pose.position, front_m);
                let (length_m, width_m) = (2.0 * outline.half_length_m, 2.0 * outline.half_width_m);
                let taken = beside.and_then(|beside| {
                    beside.taken(*forward, length_m, width_m, self.ego.outline.half_width_m)
                });
                taken.is_some_and(|span| span.to_m > front_m && span.from_m < front_m + QUEUE_M)
            })
    }

    /// Whether the ego vehicle is in a junction that it was not allowed to enter: at red, late at yellow, or past a stop sign
    /// without having stood.
    pub fn ego_runs_signal(&self) -> bool {
        self.ego_passed.is_running_signal(&self.scene.map, &self.ego.outline)
    }

    /// This world with an ego vehicle that drives no faster than so.
    pub fn with_ego_at_most(&self, speed_mps: f64) -> World {
        let mut world = self.clone();
        world.ego.motion.speed_mps = world.ego.motion.speed_mps.min(speed_mps);
        world
    }

    /// Whether a road user lies across the strip that the ego vehicle drives on, before its front.
    pub fn is_in_the_way(&self, obstacle: &Obstacle) -> bool {
        room_before_m(obstacle, &self.alone()).is_some()
    }

    /// Whether the ego vehicle is over a line of its lane: in a lane change, or astray.
    pub fn is_between_lanes(&self) -> bool {
        let half_m = self.scene.half_width_m(self.ego_station_m);
        self.ego_offset_m.abs() + VehicleParameters::MKZ.width_m / 2.0 > half_m
    }

    /// The colour of the light that holds for a crosswalk of the route, which begins at a station.
    pub fn light_before(&self, crosswalk_m: f64) -> Option<SignalColour> {
        light_before(crosswalk_m, &self.alone())
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

    /// Whether the road user with an id drives into a junction across the route of the ego vehicle, which goes first there.
    pub fn cuts_across_ego(&self, id: u32) -> bool {
        let around = self.alone();
        let user = self.user(id);
        user.is_some_and(|RoadUser { obstacle, mover }| {
            mover.rights.cuts_across_ego(obstacle, &mover.motion, &self.ego_passed, &around)
        })
    }

    /// As [`World::ego_runs_signal`], of the road user with an id.
    pub fn runs_signal(&self, id: u32) -> bool {
        let user = self.user(id);
        user.is_some_and(|user| {
            user.mover.rights.passed.is_running_signal(&self.scene.map, &user.obstacle.outline)
        })
    }

    /// Whether the ego vehicle has left its lane without a contact: the middle of its rear axle is beside it. During a
    /// lane change it is in one of two lanes.
    pub fn is_astray(&self) -> bool {
        let (route, station_m) = (&self.scene.route, self.ego_station_m);
        let half_m = self.scene.half_width_m(station_m);
        let changes = |change: &RouteLaneChange| (change.begin_m..change.latest_m).contains(&station_m);
        !self.ego.motion.touched && self.ego_offset_m.abs() > half_m && !route.changes.iter().any(changes)
    }

    /// Whether the ego vehicle has driven off the map: its front bumper is beyond the end of its way (the end of the
    /// lanes, or 60 m past the goal), or no lane is near it. Nothing can happen there, because road users appear beside
    /// the way.
    pub fn left_the_map(&self) -> bool {
        let (map, path) = (&self.scene.map, &self.scene.route.path);
        let Pose { position, heading_rad } = self.ego.motion.rear_axle;
        let aside_m = (position - path.position_at(self.ego_station_m)).norm();
        let is_near_road = aside_m <= OFF_MAP_M || map.nearest(position, heading_rad, OFF_MAP_M).is_some();
        !is_near_road || self.ego_front_m() >= path.length_m()
    }

    fn user(&self, id: u32) -> Option<&RoadUser> {
        self.users.iter().find(|user| user.obstacle.id == id)
    }

    /// Station of the ego vehicle's front bumper on the route, m.
    fn ego_front_m(&self) -> f64 {
        VehicleParameters::MKZ.front_m(self.ego_station_m)
    }

    /// The world around no road user in particular.
    pub(super) fn alone(&self) -> Around<'_> {
        self.around([&self.users, &[]])
    }

    fn around<'a>(&'a self, users: [&'a [RoadUser]; 2]) -> Around<'a> {
        Around {
            scene: &self.scene,
            ego: &self.ego.motion,
            ego_outline: &self.ego.outline,
            ego_forward: self.ego.frame.forward(),
            ego_velocity_mps: self.ego.velocity_mps(),
            ego_elevation_m: self.ego_elevation_m,
            ego_station_m: self.ego_station_m,
            ego_offset_m: self.ego_offset_m,
            ego_passed: self.ego_passed,
            users,
            signals: &self.signals,
            tick: self.ticks,
            friction: self.conditions.friction,
            grip: self.environment.grip(),
            visibility_m: self.conditions.visibility_m,
            traffic: &self.traffic,
            seed: self.seed,
            reactions: self.reactions,
        }
    }

    /// Lets ambient traffic leave and appear; `begins` is before the first tick.
    fn renew_ambient(&mut self, begins: bool) {
        let (ego_outline, range_m) = (self.ego.outline, self.scene.range_m);
        let is_gone =
            |user: &RoadUser| user.obstacle.is_ambient() && is_gone(&user.obstacle, &ego_outline, range_m);
        self.users.retain(|user| !is_gone(user));
        let present = self.obstacles().filter(|obstacle| obstacle.is_ambient()).count();
        if present >= self.ambient.wanted as usize {
            return;
        }
        // A copy, because the attempt looks at the world.
        let mut ambient = self.ambient.clone();
        let newcomer = ambient.attempt(&self.alone(), begins);
        self.users.extend(newcomer);
        self.ambient = ambient;
    }

    /// Notes for each road user whether it came into the ego vehicle's way or the ego vehicle into its way.
    fn watch_rights(&mut self) {
        let mut users = core::mem::take(&mut self.users);
        let around = self.around([&[], &[]]);
        for RoadUser { obstacle, mover } in users.iter_mut().filter(|user| !user.obstacle.is_apart) {
            if mover.has_crashed() {
                mover.rights.watch_wreck(obstacle, &around);
            } else {
                let in_sight = around.is_in_sight(obstacle, mover.visible_fraction);
                mover.rights.watch(obstacle, &mover.motion, &self.ego_passed, in_sight, &around);
            }
        }
        self.users = users;
    }

    /// Moves one road user and finds what it touches; `false` if it left.
    fn tick_user(&mut self, index: usize, users: &mut [RoadUser], ego: &EgoTick) -> bool {
        let (earlier, rest) = users.split_at_mut(index);
        let (user, later) = rest.split_first_mut().expect("the index is that of a user");
        let before = user.obstacle;
        let Some(mut moved) = user.mover.step(&before, &self.around([earlier, later])) else { return false };
        if let Some(Bump { other, pose, normal, incident }) = bump(users, index, &moved.pose, self.ticks) {
            // Obstacles that touch already push where the one that moves goes.
            let pushes = moved.velocity_mps.try_normalize(0.0).unwrap_or(moved.forward);
            let normal = if normal == Vec2::zeros() { pushes } else { normal };
            let mass_t = |index: usize| users[index].mover.size.mass_t;
            let other_mps = users[other].obstacle.velocity_mps;
            let (velocity_mps, other_mps) =
                impact(normal, (mass_t(index), moved.velocity_mps), (mass_t(other), other_mps));
            moved = Moved { pose, forward: pose.forward(), velocity_mps, ..moved };
            users[other].obstacle.velocity_mps = other_mps;
            let known = users[index].mover.crash(incident.other) == Some(incident.other);
            let known_there = users[other].mover.crash(incident.obstacle) == Some(incident.obstacle);
            // Two that slide on together may touch in every tick; that is one incident.
            if !known && !known_there {
                self.incidents.push(incident);
            }
        }
        let RoadUser { obstacle, mover } = &mut users[index];
        let along_mps = |forward: Vec2, velocity_mps: Vec2| forward.dot(&velocity_mps);
        let gained_mps =
            along_mps(moved.forward, moved.velocity_mps) - along_mps(before.forward, before.velocity_mps);
        obstacle.acceleration_mps2 = gained_mps / DT_S;
        (obstacle.outline.pose, obstacle.velocity_mps) = (moved.pose, moved.velocity_mps);
        (obstacle.forward, obstacle.lane_heading_rad) = (moved.forward, moved.lane_heading_rad);
        obstacle.elevation_m = mover.elevation_m().unwrap_or(obstacle.elevation_m);
        if mover.touched || is_apart(self.ego_elevation_m, obstacle.elevation_m) {
            return true;
        }
        let sweep = mover.sweep(before.outline, moved.pose);
        if before.distance_m > ego.most_m + sweep.most_m() + NEAR_M {
            // The gap is wider than both together can close it in a tick.
            return true;
        }
        let other = Party { sweep, velocity_mps: moved.velocity_mps };
        if let Some((contact, normal)) = meet(&ego.party, ego.speed_mps, &other, before.id, self.ticks) {
            let around = self.around([&[], &[]]);
            let ruling = if mover.has_crashed() {
                mover.rights.at_contact_with_wreck(obstacle, &around)
            } else {
                mover.rights.at_contact(obstacle, &mover.motion, contact.point, &around)
            };
            // If two impacts happen in one tick, the second acts on the speed that is left after the first.
            let now_mps = self.ego.velocity_mps();
            let lost_mps = (ego.party.velocity_mps - now_mps).dot(&normal);
            let closing_mps = (contact.closing_speed_mps - lost_mps).max(0.0);
            let this = (VehicleParameters::MKZ.mass_t, now_mps);
            let that = (mover.size.mass_t, moved.velocity_mps);
            let (ego_mps, other_mps) = exchange(normal, closing_mps, this, that);
            let after_mps = self.ego.frame.forward().dot(&ego_mps).max(0.0);
            if after_mps > self.ego.motion.speed_mps {
                self.pushed_until = self.ticks + PUSHED_TICKS;
            }
            self.ego.motion.speed_mps = after_mps;
            self.ego.motion.touched = true;
            mover.touch(moved.forward.dot(&other_mps).max(0.0));
            self.contacts.push(Contact { ruling, ..contact });
        }
        true
    }

    /// Brings the gaps to the ego vehicle up to date.
    fn measure(&mut self) {
        for RoadUser { obstacle, .. } in &mut self.users {
            let outline = Frame::along(&obstacle.outline, obstacle.forward);
            obstacle.distance_m = self.ego.frame.distance_m(&outline);
        }
    }

    /// Brings up to date what is seen along the lines of sight from the ego vehicle's roof.
    fn look(&mut self) {
        let eye = self.ego.outline.pose.position;
        for index in 0..self.users.len() {
            self.users[index].obstacle.is_apart = self.alone().is_apart_from_ego(&self.users[index]);
        }
        for index in 0..self.users.len() {
            let target = &self.users[index].obstacle;
            let visible_fraction =
                if target.is_apart { 0.0 } else { visible_fraction(eye, target, self.obstacles_on_level()) };
            self.users[index].mover.visible_fraction = visible_fraction;
        }
    }

    /// Finds the ego vehicle beside its route again, and counts the red lights it passed.
    fn follow_route(&mut self) {
        let front_before_m = self.ego_front_m();
        let route = &self.scene.route;
        let found =
            route.path.project_near(self.ego.motion.rear_axle.position, self.ego_station_m, ROUTE_SEARCH_M);
        self.ego_station_m = found.station_m;
        self.ego_offset_m = found.offset_m;
        self.ego_elevation_m = route.height_at(&self.scene.map, found.station_m);
        let passed = front_before_m..self.ego_front_m();
        if self.ticks < self.pushed_until {
            // What another vehicle pushes over a line has not passed it.
            return;
        }
        let mut ego_passed = self.ego_passed;
        let stops = route.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
        let stops = stops.map(|line| (line.station_m, route.lane_at(line.station_m).lane));
        let (speed_mps, around) = (self.ego.motion.speed_mps, self.alone());
        ego_passed.pass(&route.stop_lines, stops, (passed.start, passed.end), speed_mps, &around);
        self.red_runs += route
            .stop_lines
            .iter()
            .filter(|line| passed.contains(&line.station_m) && self.signal(line.signal) == SignalColour::Red)
            .count() as u32;
        self.ego_passed = ego_passed;
    }
}
