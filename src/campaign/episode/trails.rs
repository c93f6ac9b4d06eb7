//! Where everybody was in the last seconds, as far as the kind of a collision asks.

use std::collections::VecDeque;

use avastra_base::geometry::Pose;
use avastra_lang::model::vocabulary::TrafficRule;
use avastra_road::{LanePlace, RoadMap, SignKind};
use avastra_world::sim::{Contact, DT_S, Obstacle, Scene, SignalColour, VehicleParameters, World};

use super::facts::side;
use super::precrash::{Before, Place, PreCrash, Step, Way};
use super::shape::Shape;

/// How far back it is looked, s.
const PAST_S: f64 = 5.0;
/// Time between two looks, ticks: 0.5 s.
const LOOK_TICKS: u64 = 25;

/// Looks at the world, the oldest first.
#[derive(Debug, Clone, Default)]
pub(super) struct Trails {
    looks: VecDeque<Look>,
}

#[derive(Debug, Clone)]
struct Look {
    tick: u64,
    ego: Place,
    ego_front_m: f64,
    red_runs: u32,
    others: Vec<(u32, Place)>,
}

impl Trails {
    /// Takes in a tick, or passes it over.
    pub fn note(&mut self, world: &World) {
        if !world.ticks().is_multiple_of(LOOK_TICKS) {
            return;
        }
        if self.looks.len() > (PAST_S / DT_S) as usize / LOOK_TICKS as usize {
            self.looks.pop_front();
        }
        self.looks.push_back(Look {
            tick: world.ticks(),
            ego: ego_now(world),
            ego_front_m: front_m(world),
            red_runs: world.red_runs(),
            others: world.obstacles().map(|obstacle| (obstacle.id, now(obstacle))).collect(),
        });
    }

    /// The shape of the ego vehicle's way to this moment, and the kind of a collision that begins now.
    pub fn kind(&self, world: &World, contact: &Contact, is_wreck: bool) -> (Shape, PreCrash) {
        let Scene { map, route, .. } = world.scene().as_ref();
        let step = |place: Place| {
            let Pose { position, heading_rad } = place.pose;
            let lane = map.nearest(position, heading_rad, BESIDE_M).map(|at| map.lane(at.lane));
            let in_junction = lane.is_some_and(|lane| lane.junction.is_some());
            Step { place, off_road_m: map.lane_room_m(position), in_junction }
        };
        let now = step(ego_now(world));
        let way = |looks: &mut dyn Iterator<Item = Place>| Way(looks.map(step).chain([now]).collect());
        let whole = way(&mut self.looks.iter().map(|look| look.ego)).shape();
        let (Some(first), Some(obstacle)) = (self.looks.front(), world.obstacle(contact.obstacle)) else {
            return (whole, PreCrash::Other);
        };
        // Both are looked at from the moment at which the other was there.
        let is_it = |(id, _): &&(u32, Place)| *id == contact.obstacle;
        let met: Vec<(&Look, Place)> =
            self.looks.iter().filter_map(|look| Some((look, look.others.iter().find(is_it)?.1))).collect();
        let ends = Place { pose: obstacle.outline.pose, velocity_mps: contact.obstacle_velocity_mps };
        let mut other = Way(met.iter().map(|(_, place)| step(*place)).chain([step(ends)]).collect());
        let mut ego = way(&mut met.iter().map(|(look, _)| look.ego));
        if met.is_empty() {
            ego = way(&mut core::iter::once(first.ego));
            other.0.insert(0, other.0[0]);
        }
        let looks = if met.is_empty() { vec![first] } else { met.iter().map(|(look, _)| *look).collect() };
        let others = |look: &Look| {
            let third = look.others.iter().filter(|other| !is_it(other));
            third.map(|(_, place)| *place).collect()
        };
        let third = looks.into_iter().map(others).chain([Vec::new()]).collect();
        let junction = self.junction(world);
        let is_signalized = junction.is_some_and(|junction| map.junctions[junction].groups > 0);
        let passed = first.ego_front_m..=front_m(world);
        let mut stops = route.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
        let stood = self.looks.iter().any(|look| look.ego.velocity_mps.norm() < STOOD_MPS);
        let ego_ran_stop = !stood && stops.any(|line| passed.contains(&line.station_m));
        let passed_lines = if obstacle.body.is_vehicle() { lines(map, &other) } else { Vec::new() };
        // The colour is that of the look before, at most half a second ago.
        let is_red = |(step, line): &(usize, Line)| match line {
            Line::Light(signal) => {
                world.signal_at(*signal, met.get(*step).map_or(0, |(look, _)| look.tick)) == SignalColour::Red
            }
            Line::Stop => false,
        };
        let other_stood = other.0.iter().any(|step| step.place.velocity_mps.norm() < STOOD_MPS);
        // The typology's country lets vehicles turn right at red after a stop.
        let may_pass = world.has_siren(contact.obstacle) || other_stood && other.shape() == Shape::RightTurn;
        let other_ran_red = passed_lines.iter().any(is_red) && !may_pass;
        let other_ran_stop = !other_stood && passed_lines.iter().any(|(_, line)| *line == Line::Stop);
        let before = Before {
            body: obstacle.body,
            has_failed: world.ignores(contact.obstacle, TrafficRule::Brakes),
            ran_red: world.red_runs() > first.red_runs || other_ran_red,
            ran_stop: ego_ran_stop || other_ran_stop,
            ego,
            other,
            third,
            in_junction: junction.is_some(),
            is_signalized,
            is_lengthwise: !matches!(side(contact.on_ego, &VehicleParameters::MKZ), "left" | "right"),
            is_wreck: is_wreck && obstacle.body.is_vehicle(),
        };
        (whole, before.kind())
    }

    /// The junction that the ego vehicle is in, from its front to its rear.
    fn junction(&self, world: &World) -> Option<usize> {
        let Scene { map, route, .. } = world.scene().as_ref();
        let rear_m = VehicleParameters::MKZ.rear_m(world.ego_station_m());
        [front_m(world), world.ego_station_m(), rear_m]
            .into_iter()
            .find_map(|station_m| map.lane(route.lane_at(station_m).lane).junction)
    }
}

/// Slower than this it stood at a stop sign, m/s. Ours.
const STOOD_MPS: f64 = 0.5;

/// Farther away than this one is in no lane, m.
const BESIDE_M: f64 = 1.0;

/// A line at which a lane stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    /// Of a light: an index in [`RoadMap::signals`].
    Light(usize),
    /// Of a stop sign.
    Stop,
}

/// The lines that a vehicle passed in its lanes, each with the step before.
fn lines(map: &RoadMap, way: &Way) -> Vec<(usize, Line)> {
    let lane_at = |step: &Step| {
        let Pose { position, heading_rad } = step.place.pose;
        map.nearest(position, heading_rad, BESIDE_M)
    };
    let lanes: Vec<Option<LanePlace>> = way.0.iter().map(lane_at).collect();
    let mut passed = Vec::new();
    for (step, pair) in lanes.windows(2).enumerate() {
        let [Some(before), Some(after)] = pair else { continue };
        // Where the lane has ended in between, all that was left of it was passed.
        let until_m = if after.lane == before.lane { after.station_m } else { f64::INFINITY };
        let is_passed = |station_m: f64| (before.station_m..until_m).contains(&station_m);
        let lane = map.lane(before.lane);
        let lights = lane.stop_lines.iter().filter(|line| is_passed(line.station_m));
        passed.extend(lights.map(|line| (step, Line::Light(line.signal))));
        let stops = lane.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
        let stops = stops.filter(|line| is_passed(line.station_m));
        passed.extend(stops.map(|_| (step, Line::Stop)));
    }
    passed
}

fn ego_now(world: &World) -> Place {
    let ego = world.ego();
    Place { pose: ego.rear_axle, velocity_mps: ego.rear_axle.forward() * ego.speed_mps }
}

fn front_m(world: &World) -> f64 {
    VehicleParameters::MKZ.front_m(world.ego_station_m())
}

fn now(obstacle: &Obstacle) -> Place {
    Place { pose: obstacle.outline.pose, velocity_mps: obstacle.velocity_mps }
}
