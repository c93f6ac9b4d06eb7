//! How one moment becomes the next: a tick of the world. `playback` moves it by a recording, `survey` answers what drawing asks.

mod commands;
mod contact;
pub mod ego;
mod incident;
mod playback;
mod survey;
#[cfg(any(test, feature = "testing"))]
mod testing;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use avastra_base::geometry::{Frame, OrientedBox, Pose, Sweep, Vec2, larger, smaller};
use avastra_lang::model::COMMANDED_MAX;
use avastra_road::{SignKind, is_apart};

use crate::place::ambient::{RENEWAL_TICKS, is_gone};
use crate::scene::Scene;
use crate::state::ambient::Ambient;
use crate::state::contact::Contact;
use crate::state::ego::{Ego, VehicleParameters};
use crate::state::environment::Environment;
use crate::state::obstacle::Moved;
use crate::state::passed::Passed;
use crate::state::road_user::{RoadUser, Room, Travel};
use crate::state::sensed::SignalColour;
use crate::state::signals::{Colours, SignalClock};
use crate::state::time::{DT_S, FRAME_S, FRAME_TICKS, ticks};
use crate::state::world::{Start, World};
use crate::step::contact::{Party, meet};
use crate::step::ego::Control;
use crate::step::incident::{Bump, CLOSE_M, bump, exchange, impact};
use crate::view::sense::visible_fraction;

/// Added to the way of two bodies before they are taken to be too far apart to touch, m: far more than rounding.
const NEAR_M: f64 = 1e-3;

/// Road users with a smaller gap between them are looked at in each tick, m: what two at 50 km/h close in 7 ticks.
const NEARBY_M: f64 = 4.0;

/// How far along the route the ego vehicle is looked for from where it was, m. More than it drives
/// in a tick, so that it is found again after a corner cut, and less than any loop of a route.
const ROUTE_SEARCH_M: f64 = 2.0;

/// A vehicle that was hit from behind is pushed for so long, ticks: 2 s. Ours: with brakes it stands within it.
const PUSHED_TICKS: u64 = ticks(2.0);

/// The ego vehicle in a tick, before any contact.
struct EgoTick {
    party: Party,
    speed_mps: f64,
    /// Farthest that any point of it moves, m.
    most_m: f64,
}

impl World {
    /// The beginning of an episode: the ego vehicle rolls with its rear axle on the start of the route. Beside ambient
    /// traffic, if asked for, nothing else is there.
    pub fn new(scene: Arc<Scene>, start: &Start) -> World {
        World::with_ego_at(scene, start, 0.0, start.ego_mps)
    }

    /// The beginning of an episode that begins elsewhere on the route, at another speed.
    pub fn with_ego_at(scene: Arc<Scene>, start: &Start, station_m: f64, speed_mps: f64) -> World {
        let environment = Environment::new(start.time, start.sky);
        let signals = SignalClock::new(start.signal_phase_s, scene.signal_program);
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
            colours: Colours::at(&signals, &scene.map, 0),
            signals,
            switch: None,
            signals_until: Vec::new(),
            users: Vec::with_capacity(COMMANDED_MAX as usize),
            next_id: 1,
            travel: Travel::default(),
            ambient: Ambient::new(start.ambient),
            traffic: start.traffic,
            weather_tick: 0,
            seed: start.seed,
            reactions: start.reactions,
            reactions_from: (start.reactions_from_s / DT_S).round() as u64,
            contacts: Vec::new(),
            incidents: Vec::new(),
            scene,
        };
        for _ in 0..world.ambient.wanted {
            world.renew_ambient(true);
        }
        world
    }

    /// Advances by [`DT_S`]; returns the contacts that began.
    ///
    /// An obstacle that the ego vehicle touched once brakes to rest and touches it no more. Two obstacles that touch
    /// each other slide to rest (see [`World::incidents`]). A wreck leaves when it has stood for 2 s and the ego
    /// vehicle does not see it. A driver that waited for others for 20 s also leaves once the ego vehicle does not see
    /// it.
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
        self.travel = Travel { done_m: self.travel.done_m + self.travel.now_m, now_m: 0.0 };
        self.measure();
        self.ticks += 1;
        self.colours.pass(&self.signals, &self.scene.map, self.ticks);
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
        let near = self.near(users, index, &moved.pose);
        let bumped = bump(users, index, near, &moved.pose, self.ticks);
        debug_assert_eq!(
            bumped,
            bump(users, index, u64::MAX, &moved.pose, self.ticks),
            "a road user near by is missed"
        );
        if let Some(Bump { other, pose, normal, incident }) = bumped {
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
        let way_m = (moved.pose.position - before.outline.pose.position).norm();
        self.travel.now_m = larger(self.travel.now_m, way_m);
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

    /// The road users that the one at `index` may touch on its way to `end`: one bit for each of the first [`Room::LISTED`].
    /// A pair that was far apart is checked again only when both could have closed the gap.
    fn near(&self, users: &mut [RoadUser], index: usize, end: &Pose) -> u64 {
        let Travel { done_m, now_m } = self.travel;
        let outline = users[index].obstacle.outline;
        let way_m = (end.position - outline.pose.position).norm() + CLOSE_M;
        let among = (users.len(), self.next_id, self.ambient.next_id);
        let known = users[index].mover.room;
        if known.among == among && 2.0 * (done_m - known.since_m) + now_m + way_m < known.gap_m {
            return known.near;
        }
        let circle_m = |outline: &OrientedBox| outline.half_length_m + outline.half_width_m;
        let mut room = Room { near: 0, gap_m: f64::INFINITY, since_m: done_m, among };
        for (other, RoadUser { obstacle, .. }) in users.iter().enumerate().take(Room::LISTED) {
            let away = obstacle.outline.pose.position - outline.pose.position;
            let gap_m = away.norm() - circle_m(&obstacle.outline) - circle_m(&outline);
            if gap_m < NEARBY_M {
                room.near |= 1 << other;
            } else {
                room.gap_m = smaller(room.gap_m, gap_m);
            }
        }
        users[index].mover.room = room;
        room.near
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
        if self.scene.map.has_levels {
            for index in 0..self.users.len() {
                self.users[index].obstacle.is_apart = self.alone().is_apart_from_ego(&self.users[index]);
            }
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
            // A vehicle that is pushed over a line by another one has not passed it.
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
