//! The world of one episode.

mod playback;

use std::sync::Arc;

use crate::action::{Effect, SpawnFacts, SpawnRequest, Surroundings};
use crate::geometry::{FirstContact, Frame, OrientedBox, Pose, Sweep, Vec2, first_contact, wrap_angle};
use crate::model::vocabulary::{Body, Colour, Level, TimeOfDay, Verb};

use super::ambient::{Ambient, COMMANDED_MAX, RENEWAL_TICKS, is_gone};
use super::contact::{Party, common_speed_mps, meet};
use super::ego::{Control, Ego, VehicleParameters};
use super::environment::Environment;
use super::mover::{Around, Moved, Mover};
use super::placement;
use super::scene::Scene;
use super::sense::{
    Conditions, EgoMotion, FRAME_TICKS, RANGE_M, Sensed, SensedObject, SignalColour, visible_fraction,
};
use super::signals::SignalClock;

/// Name of this simulated world. Raised whenever the same seed no longer gives the same episode, so
/// that an old scenario is told apart from a refuted one.
pub const ENGINE: &str = "plane/3";

/// One physics step, s: 50 Hz.
pub const DT_S: f64 = 0.02;

/// Speed at which an episode begins, m/s.
const START_MPS: f64 = 3.0;

/// Obstacles at a time (published package): the next one removes the oldest.
const OBSTACLES_MAX: usize = 10;

/// Obstacles whose gap after a tick is at least this are not looked at for contacts, m: far more than
/// rounding.
const CLOSE_M: f64 = 1e-3;

/// How far along the route the ego vehicle is looked for from where it was, m. More than it drives
/// in a tick, so that it is found again after a corner cut, and less than any loop of a route.
const ROUTE_SEARCH_M: f64 = 2.0;

/// How an episode begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    pub time: TimeOfDay,
    pub rain: Level,
    pub fog: Level,
    pub wetness: Level,
    /// Where in their cycle the signals begin, s.
    pub signal_phase_s: f64,
    /// Seed of the choices of other road users.
    pub seed: u64,
    /// Vehicles of ambient traffic that are kept around the ego vehicle, at most `model::AMBIENT_MAX`.
    pub ambient: u32,
}

/// The whole state of an episode: `Clone` is a snapshot.
#[derive(Debug, Clone)]
pub struct World {
    scene: Arc<Scene>,
    ticks: u64,
    ego: Ego,
    /// Outline of the ego vehicle, kept because everybody asks for it.
    ego_outline: OrientedBox,
    /// The same with its axes worked out.
    ego_frame: Frame,
    /// Rear axle beside the route.
    ego_station_m: f64,
    ego_offset_m: f64,
    red_runs: u32,
    environment: Environment,
    conditions: Conditions,
    signals: SignalClock,
    obstacles: Vec<Obstacle>,
    /// What moves the obstacle of the same index.
    movers: Vec<Mover>,
    /// Those that began in the tick before.
    contacts: Vec<Contact>,
    incidents: Vec<Incident>,
    next_id: u32,
    ambient: Ambient,
    /// Of the choices of other road users.
    seed: u64,
}

/// A road user other than the ego vehicle, as others may see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// From 1, in order of appearance; ambient traffic has numbers of its own.
    pub id: u32,
    pub body: Body,
    pub colour: Colour,
    pub verb: Verb,
    pub outline: OrientedBox,
    /// Unit vector along the outline's heading, kept because everybody asks for it.
    pub forward: Vec2,
    pub height_m: f64,
    /// Heading of the lane that it drives in; its own on foot.
    pub lane_heading_rad: f64,
    pub velocity_mps: Vec2,
    /// Gap between its outline and the ego vehicle's, m; 0 if they touch.
    pub distance_m: f64,
    pub spawned_tick: u64,
}

impl Obstacle {
    /// Whether it is ambient traffic, which no action made appear.
    pub fn is_ambient(&self) -> bool {
        self.id > COMMANDED_MAX
    }
}

/// The ego vehicle touched an obstacle that it did not touch in the tick before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Since the episode began, s.
    pub time_s: f64,
    /// Id of the obstacle.
    pub obstacle: u32,
    /// Where they met, in the world, m.
    pub point: Vec2,
    /// The point in the frame of the ego outline's centre: x ahead, y left, m.
    pub on_ego: Vec2,
    /// Before the contact, m/s.
    pub ego_speed_mps: f64,
    /// Before the contact, in the world, m/s.
    pub obstacle_velocity_mps: Vec2,
    /// The same in the frame of the ego outline: x ahead, y left, m/s.
    pub obstacle_velocity_on_ego_mps: Vec2,
    /// Speed at which the gap between the outlines closed where they met, m/s, not negative.
    pub closing_speed_mps: f64,
}

/// Two obstacles touched each other. Both stand where it happened, and leave 2 s later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incident {
    /// Since the episode began, s.
    pub time_s: f64,
    /// Id of who moved into the other.
    pub obstacle: u32,
    pub other: u32,
    /// Where they met, in the world, m.
    pub point: Vec2,
}

impl World {
    /// The beginning of an episode: the ego vehicle rolls at 3 m/s with its rear axle on the start of
    /// the route, and nobody else is there.
    pub fn new(scene: Arc<Scene>, start: &Start) -> World {
        let ego = Ego::new(scene.route.path.pose_at(0.0), START_MPS);
        let environment = Environment::new(start.time, [start.rain, start.fog, start.wetness]);
        let mut world = World {
            ticks: 0,
            ego_outline: ego.outline(),
            ego_frame: Frame::of(&ego.outline()),
            ego,
            ego_station_m: 0.0,
            ego_offset_m: 0.0,
            red_runs: 0,
            conditions: environment.conditions(START_MPS),
            environment,
            signals: SignalClock::new(start.signal_phase_s),
            obstacles: Vec::with_capacity(OBSTACLES_MAX),
            movers: Vec::with_capacity(OBSTACLES_MAX),
            contacts: Vec::new(),
            incidents: Vec::new(),
            next_id: 1,
            ambient: Ambient::new(start.ambient),
            seed: start.seed,
            scene,
        };
        for _ in 0..world.ambient.wanted() {
            world.renew_ambient(true);
        }
        world
    }

    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Advances by [`DT_S`]; returns the contacts that began.
    ///
    /// An obstacle that the ego vehicle touched once brakes to rest, leaves 2 s later, and touches it no
    /// more. Two obstacles that touch each other stand at once (see [`World::incidents`]).
    pub fn tick(&mut self, control: &Control) -> &[Contact] {
        self.contacts.clear();
        self.incidents.clear();
        let outline = self.ego_outline;
        let friction = self.environment.grip().friction(self.ego.motion.speed_mps);
        self.ego.step(control, friction, DT_S);
        self.ego_outline = self.ego.outline();
        self.ego_frame = Frame::of(&self.ego_outline);
        self.follow_route();
        // Taken once: of two contacts in a tick, the second does not see what the first did to the ego.
        let ego = Party {
            sweep: Sweep { start: outline, end: self.ego_outline.pose },
            velocity_mps: self.ego_frame.forward() * self.ego.motion.speed_mps,
        };
        let ego_mps = self.ego.motion.speed_mps;
        // Taken out for the tick, so that each can move while it looks at the world.
        let mut movers = core::mem::take(&mut self.movers);
        let mut index = 0;
        while index < movers.len() {
            if self.tick_obstacle(index, &mut movers, &ego, ego_mps) {
                index += 1;
            } else {
                movers.remove(index);
                self.obstacles.remove(index);
            }
        }
        self.movers = movers;
        for obstacle in &mut self.obstacles {
            let outline = Frame::along(&obstacle.outline, obstacle.forward);
            obstacle.distance_m = self.ego_frame.distance_m(&outline);
        }
        self.ticks += 1;
        if self.ambient.wanted() > 0 && self.ticks.is_multiple_of(RENEWAL_TICKS) {
            self.renew_ambient(false);
        }
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.environment.pass(FRAME_TICKS as f64 * DT_S);
            self.conditions = self.environment.conditions(self.ego.motion.speed_mps);
            self.look();
        }
        &self.contacts
    }

    /// Carries out an effect.
    ///
    /// # Errors
    /// Why a spawn is impossible; the world is then unchanged. The id of the newcomer otherwise.
    pub fn apply(&mut self, effect: &Effect) -> Result<Option<u32>, String> {
        match effect {
            Effect::Time(time) => self.environment.time = *time,
            Effect::Sky(phenomenon, level) => self.environment.set(*phenomenon, *level),
            Effect::Spawn(request) => return self.spawn(request).map(Some),
        }
        self.conditions = self.environment.conditions(self.ego.motion.speed_mps);
        Ok(None)
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
        self.ego_outline
    }

    /// Station of the ego vehicle's rear axle on the route, m.
    pub fn ego_station_m(&self) -> f64 {
        self.ego_station_m
    }

    /// How far the ego vehicle's rear axle is to the left of the route, m.
    pub fn ego_offset_m(&self) -> f64 {
        self.ego_offset_m
    }

    /// Stop lines of the route that the ego vehicle's front passed under a red light.
    pub fn red_runs(&self) -> u32 {
        self.red_runs
    }

    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
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
        [self.environment.rain, self.environment.fog, self.environment.wetness]
    }

    /// Light, weather and grip.
    pub fn conditions(&self) -> Conditions {
        self.conditions
    }

    /// Colour of a signal now, by index in `RoadMap::signals`.
    pub fn signal(&self, signal: usize) -> SignalColour {
        self.signals.colour(&self.scene.map, signal, self.ticks)
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
    /// Everything is of this tick, except lines of sight, which are looked at ten times a second.
    pub fn sense(&self, into: &mut Sensed) {
        into.time_s = self.time_s();
        into.ego = self.ego.motion;
        into.conditions = self.conditions;
        into.signals.clear();
        into.signals.extend((0..self.scene.map.signals.len()).map(|signal| self.signal(signal)));
        into.objects.clear();
        for (obstacle, mover) in self.obstacles.iter().zip(&self.movers) {
            let away = obstacle.outline.pose.position - self.ego_outline.pose.position;
            if away.norm_squared() > RANGE_M * RANGE_M {
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
            });
        }
    }

    /// Feeds every bit of the state that later ticks depend on to `sink`, in a fixed order.
    pub fn trace(&self, sink: &mut dyn FnMut(u64)) {
        sink(self.ticks);
        self.ego.trace(sink);
        sink(self.ego_station_m.to_bits());
        sink(self.ego_offset_m.to_bits());
        sink(u64::from(self.red_runs));
        self.environment.trace(sink);
        sink(self.conditions.friction.to_bits());
        self.signals.trace(sink);
        sink(u64::from(self.next_id));
        self.ambient.trace(sink);
        sink(self.seed);
        for (obstacle, mover) in self.obstacles.iter().zip(&self.movers) {
            sink(u64::from(obstacle.id));
            sink(obstacle.spawned_tick);
            for word in [obstacle.body as u64, obstacle.colour as u64, obstacle.verb as u64] {
                sink(word);
            }
            let pose = &obstacle.outline.pose;
            for value in [pose.position.x, pose.position.y, pose.heading_rad] {
                sink(value.to_bits());
            }
            for value in obstacle.velocity_mps.iter() {
                sink(value.to_bits());
            }
            mover.trace(sink);
        }
    }

    /// Whether the ego vehicle's front bumper is at most 1 m before the goal, or beyond it.
    pub fn arrived(&self) -> bool {
        self.ego_front_m() >= self.scene.route.goal_m - 1.0
    }

    /// Station of the ego vehicle's front bumper on the route, m.
    fn ego_front_m(&self) -> f64 {
        VehicleParameters::MKZ.front_m(self.ego_station_m)
    }

    fn around<'a>(&'a self, movers: [&'a [Mover]; 2]) -> Around<'a> {
        Around {
            scene: &self.scene,
            ego: &self.ego.motion,
            ego_outline: &self.ego_outline,
            ego_forward: self.ego_frame.forward(),
            ego_velocity_mps: self.ego_frame.forward() * self.ego.motion.speed_mps,
            ego_station_m: self.ego_station_m,
            obstacles: &self.obstacles,
            movers,
            signals: &self.signals,
            tick: self.ticks,
            friction: self.conditions.friction,
            grip: self.environment.grip(),
            visibility_m: self.conditions.visibility_m,
            seed: self.seed,
        }
    }

    fn spawn(&mut self, request: &SpawnRequest) -> Result<u32, String> {
        let placed = placement::place(&self.around([&self.movers, &[]]), request, self.next_id)?;
        let commanded = self.obstacles.iter().filter(|obstacle| !obstacle.is_ambient());
        if commanded.count() == OBSTACLES_MAX {
            let oldest = self.obstacles.iter().position(|obstacle| !obstacle.is_ambient());
            self.remove(oldest.expect("there are ten of them"));
        }
        let id = placed.obstacle.id;
        self.obstacles.push(placed.obstacle);
        self.movers.push(placed.mover);
        self.next_id += 1;
        self.look();
        Ok(id)
    }

    fn remove(&mut self, index: usize) {
        self.obstacles.remove(index);
        self.movers.remove(index);
    }

    /// Lets ambient traffic leave and appear; `begins` is before the first tick.
    fn renew_ambient(&mut self, begins: bool) {
        let ego_outline = self.ego_outline;
        let gone = |obstacle: &Obstacle| obstacle.is_ambient() && is_gone(obstacle, &ego_outline);
        while let Some(index) = self.obstacles.iter().position(gone) {
            self.remove(index);
        }
        let present = self.obstacles.iter().filter(|obstacle| obstacle.is_ambient()).count();
        if !self.ambient.lacks(present) {
            return;
        }
        // A copy, because the attempt looks at the world.
        let mut ambient = self.ambient.clone();
        if let Some(placed) = ambient.attempt(&self.around([&self.movers, &[]]), begins) {
            self.obstacles.push(placed.obstacle);
            self.movers.push(placed.mover);
        }
        self.ambient = ambient;
    }

    /// Moves one obstacle and looks whether it touches anybody; `false` if it left.
    /// `ego_mps` is the ego vehicle's speed before any contact of this tick.
    fn tick_obstacle(&mut self, index: usize, movers: &mut [Mover], ego: &Party, ego_mps: f64) -> bool {
        let before = self.obstacles[index];
        let (earlier, rest) = movers.split_at_mut(index);
        let (mover, later) = rest.split_first_mut().expect("every obstacle has its mover");
        let Some(mut moved) = mover.step(&before, &self.around([&*earlier, &*later])) else { return false };
        if let Some((other, pose, incident)) = self.bump(index, &before, &moved.pose) {
            moved = Moved { pose, forward: pose.forward(), velocity_mps: Vec2::zeros(), ..moved };
            mover.crash();
            let hit = if other < index { &mut earlier[other] } else { &mut later[other - index - 1] };
            hit.crash();
            self.obstacles[other].velocity_mps = Vec2::zeros();
            self.incidents.push(incident);
        }
        let obstacle = &mut self.obstacles[index];
        (obstacle.outline.pose, obstacle.velocity_mps) = (moved.pose, moved.velocity_mps);
        (obstacle.forward, obstacle.lane_heading_rad) = (moved.forward, moved.lane_heading_rad);
        if mover.touched {
            return true;
        }
        let other = Party {
            sweep: Sweep { start: before.outline, end: moved.pose },
            velocity_mps: moved.velocity_mps,
        };
        if let Some(contact) = meet(ego, ego_mps, &other, before.id, self.ticks) {
            let heading = self.ego_frame.forward();
            let along_mps = heading.dot(&moved.velocity_mps);
            // Impacts chain: the second acts on the speed that the first left.
            let common_mps = common_speed_mps(self.ego.motion.speed_mps, along_mps, mover.size.mass_t);
            self.ego.motion.speed_mps = common_mps;
            // Who is pushed forward goes on at what the push gives; who is stopped stays.
            mover.touch((moved.forward.dot(&heading) * common_mps).max(0.0));
            self.contacts.push(contact);
        }
        true
    }

    /// The first other obstacle in the way of a motion: its index, where the motion ends, and what to
    /// tell of it.
    ///
    /// Obstacles move one after another, each among the others as they stand at that moment. So no
    /// two can come to overlap, whatever the size of a step.
    fn bump(&self, index: usize, this: &Obstacle, end: &Pose) -> Option<(usize, Pose, Incident)> {
        let outline = &this.outline;
        let way = end.position - outline.pose.position;
        if way == Vec2::zeros() && end.heading_rad == outline.pose.heading_rad {
            return None;
        }
        let sweep = Sweep { start: *outline, end: *end };
        let own = Frame::along(outline, this.forward);
        // No corner moves farther than this.
        let radius_m = outline.half_length_m + outline.half_width_m;
        let turn_rad = wrap_angle(end.heading_rad - outline.pose.heading_rad);
        let most_m = way.norm() + turn_rad.abs() * radius_m;
        let reach_m = radius_m + most_m;
        let mut first: Option<(usize, FirstContact)> = None;
        for (other, obstacle) in self.obstacles.iter().enumerate() {
            let near_m = reach_m + obstacle.outline.half_length_m + obstacle.outline.half_width_m;
            let away = obstacle.outline.pose.position - outline.pose.position;
            if other == index || away.x.abs() > near_m || away.y.abs() > near_m {
                continue;
            }
            if own.is_apart(&Frame::along(&obstacle.outline, obstacle.forward), most_m + CLOSE_M) {
                continue;
            }
            let still = Sweep { start: obstacle.outline, end: obstacle.outline.pose };
            if let Some(contact) = first_contact(&sweep, &still)
                && first.is_none_or(|(_, found)| contact.fraction < found.fraction)
            {
                first = Some((other, contact));
            }
        }
        let (other, contact) = first?;
        let incident = Incident {
            time_s: (self.ticks as f64 + contact.fraction) * DT_S,
            obstacle: self.obstacles[index].id,
            other: self.obstacles[other].id,
            point: contact.point,
        };
        Some((other, sweep.at(contact.fraction).pose, incident))
    }

    /// Looks along the lines of sight from the ego vehicle's roof.
    fn look(&mut self) {
        let eye = self.ego_outline.pose.position;
        for (obstacle, mover) in self.obstacles.iter().zip(&mut self.movers) {
            mover.visible_fraction = visible_fraction(eye, obstacle, &self.obstacles);
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
        let passed = front_before_m..self.ego_front_m();
        self.red_runs += route
            .stop_lines
            .iter()
            .filter(|line| passed.contains(&line.station_m) && self.signal(line.signal) == SignalColour::Red)
            .count() as u32;
    }
}

impl Surroundings for World {
    fn survey(&self, request: &SpawnRequest) -> Result<SpawnFacts, String> {
        let around = self.around([&self.movers, &[]]);
        let placed = placement::place(&around, request, self.next_id)?;
        Ok(placement::facts(&around, request, &placed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::vocabulary::{LaneChoice, Side, Then};
    use crate::sim::testing;

    #[test]
    fn of_two_contacts_in_a_tick_neither_sees_the_other() {
        let mut world = testing::world(&testing::straight());
        world.ego.motion.speed_mps = 10.0;
        for distance_m in [8.0, 10.0] {
            let request = SpawnRequest {
                body: Body::Pedestrian,
                colour: Colour::Red,
                verb: Verb::Stand,
                lane: LaneChoice::Current,
                side: Side::Right,
                then: Then::Keep,
                speed_mps: 0.0,
                distance_m,
            };
            world.spawn(&request).expect("there is room");
        }
        // Side by side, where no request would put them.
        let beside = world.obstacles[0].outline.pose.position + Vec2::new(0.0, 0.7);
        world.obstacles[1].outline.pose.position = beside;
        let contacts = loop {
            let contacts = world.tick(&Control::default()).to_vec();
            if !contacts.is_empty() {
                break contacts;
            }
        };
        let [first, second] = contacts[..] else { panic!("{contacts:?}") };
        assert_eq!(first.ego_speed_mps, second.ego_speed_mps);
        let common_mps = |speed_mps| common_speed_mps(speed_mps, 0.0, 0.075);
        assert_eq!(world.ego().speed_mps, common_mps(common_mps(first.ego_speed_mps)));
    }

    #[test]
    fn the_ego_vehicle_arrives_and_counts_red_lights() {
        let mut world = testing::world(&testing::crossing());
        let throttle = Control { throttle_pct: 40.0, ..Control::default() };
        // 100 m in 8 s, the stop line at 185 m after about 13 s, when its light is yellow.
        while !world.arrived() {
            let control = if world.ego().speed_mps < 10.0 { throttle } else { Control::default() };
            world.tick(&control);
            assert!(world.time_s() < 60.0);
        }
        assert!((world.ego_station_m() + 3.705 - 399.0).abs() < 0.3);
        assert_eq!(world.ego_offset_m(), 0.0);
        assert_eq!(world.red_runs(), 1);
    }
}
