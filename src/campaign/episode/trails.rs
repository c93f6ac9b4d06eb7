//! The places of all road users in the last seconds, as far as the kind of a collision asks.

use core::ops::Range;
use std::collections::VecDeque;

use avastra_base::geometry::{Pose, wrap_angle};
use avastra_lang::model::vocabulary::{BodyClass, RoadKind, TrafficRule, Turn};
use avastra_road::{LaneIndex, LanePlace, RoadMap};
use avastra_world::sim::{Contact, DT_S, Obstacle, Scene, SignalColour, VehicleParameters, World};

use super::facts::side;
use super::precrash::{Before, Manoeuvre, Place, PreCrash, Step, Way};
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
            red_runs: world.red_runs(),
            others: world.obstacles().map(|obstacle| (obstacle.id, now(obstacle))).collect(),
        });
    }

    /// The shape of the ego vehicle's way to this moment, and the kind of a collision that begins now.
    pub fn kind(&self, world: &World, contact: &Contact, is_wreck: bool) -> (Shape, PreCrash) {
        let map = &world.scene().map;
        // The contact has changed the speeds already.
        let heading = world.ego().rear_axle.forward();
        let ego_ends = Place { velocity_mps: heading * contact.ego_speed_mps, ..ego_now(world) };
        let way = |places: &mut dyn Iterator<Item = Place>, ends: Place| Way {
            steps: places.chain([ends]).map(|place| step(map, place)).collect(),
            intends: None,
            is_known: false,
        };
        let whole = way(&mut self.looks.iter().map(|look| look.ego), ego_ends).shape();
        let (Some(first), Some(obstacle)) = (self.looks.front(), world.obstacle(contact.obstacle)) else {
            return (whole, PreCrash::Other);
        };
        let ends = Place { pose: obstacle.outline.pose, velocity_mps: contact.obstacle_velocity_mps };
        // Both are looked at from the moment at which the other was there.
        let is_it = |(id, _): &&(u32, Place)| *id == contact.obstacle;
        let met = self.looks.iter().filter_map(|look| Some((look, look.others.iter().find(is_it)?.1)));
        let mut met: Vec<(&Look, Place)> = met.collect();
        if met.is_empty() {
            met.push((first, ends));
        }
        let others =
            |look: &Look| look.others.iter().filter(|other| !is_it(other)).map(|other| other.1).collect();
        let third = met.iter().map(|(look, _)| others(look)).chain([Vec::new()]).collect();
        let mut ego = way(&mut met.iter().map(|(look, _)| look.ego), ego_ends);
        let mut other = way(&mut met.iter().map(|(_, place)| *place), ends);
        ego.intends = ego_intends(world);
        other.intends = world.npc_facts(contact.obstacle).and_then(|facts| {
            let at_junction = facts.in_next_junction || facts.junction_ahead_m < BEGINS_M;
            turn(facts.turn).filter(|_| at_junction)
        });
        let changes_lanes = world.changes_lanes(contact.obstacle);
        other.is_known = changes_lanes.is_some();
        if changes_lanes == Some(true) {
            other.intends = other.intends.or(Some(Manoeuvre::LaneChange));
        }
        let ticks: Vec<u64> = met.iter().map(|(look, _)| look.tick).chain([world.ticks()]).collect();
        let other_ran_red = ran_red(world, obstacle, &other, &ticks);
        let junction = self.junction(world);
        let before = Before {
            body: obstacle.body,
            has_failed: world.ignores(contact.obstacle, TrafficRule::Brakes),
            ran_red: world.red_runs() > first.red_runs || other_ran_red,
            ran_stop: world.ego_runs_stop()
                || world.runs_stop(contact.obstacle) && !world.has_siren(contact.obstacle),
            ego,
            other,
            third,
            in_junction: junction.is_some(),
            is_signalized: junction.is_some_and(|junction| map.junctions[junction].groups > 0),
            is_lengthwise: is_lengthwise(contact),
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

/// A vehicle no farther before a junction begins its turn, m. Ours.
const BEGINS_M: f64 = 3.0;

/// The manoeuvre that the route requires of the ego vehicle where it is.
fn ego_intends(world: &World) -> Option<Manoeuvre> {
    let station_m = world.ego_station_m();
    let moment = world.moment_facts();
    // Counted from the rear axle.
    let begins_m = VehicleParameters::MKZ.front_m(0.0) + BEGINS_M;
    let at_junction = moment.ego_road == RoadKind::InJunction || moment.ego_junction_ahead_m < begins_m;
    let is_changing = || {
        let mut changes = world.scene().route.changes.iter();
        changes.any(|change| (change.begin_m..change.latest_m).contains(&station_m))
            && world.is_between_lanes()
    };
    turn(moment.ego_turn).filter(|_| at_junction).or_else(|| is_changing().then_some(Manoeuvre::LaneChange))
}

fn turn(turn: Turn) -> Option<Manoeuvre> {
    match turn {
        Turn::Left => Some(Manoeuvre::LeftTurn),
        Turn::Right => Some(Manoeuvre::RightTurn),
        _ => None,
    }
}

/// Whether the ends met, and not a flank: at a corner, the motion across it decides.
fn is_lengthwise(contact: &Contact) -> bool {
    match side(contact.on_ego, &VehicleParameters::MKZ) {
        "left" | "right" => false,
        "front left" | "front right" => {
            let other = contact.obstacle_velocity_on_ego_mps;
            (contact.ego_speed_mps - other.x).abs() >= other.y.abs()
        }
        _ => true,
    }
}

/// Slower than this it stood at a stop sign, m/s. Ours.
const STOOD_MPS: f64 = 0.5;

/// Farther away than this one is in no lane, m.
const BESIDE_M: f64 = 1.0;

fn step(map: &RoadMap, place: Place) -> Step {
    let Pose { position, heading_rad } = place.pose;
    let at = map.nearest(position, heading_rad, BESIDE_M);
    let lane_rad = at.map_or(heading_rad, |at| map.lane(at.lane).centre.heading_at(at.station_m));
    let is_against = wrap_angle(lane_rad - heading_rad).abs() > core::f64::consts::FRAC_PI_2;
    let lane_rad = lane_rad + if is_against { core::f64::consts::PI } else { 0.0 };
    let in_junction = at.is_some_and(|at| map.lane(at.lane).junction.is_some());
    Step { place, off_road_m: map.lane_room_m(position), in_junction, lane_rad, is_against }
}

/// Whether another vehicle passed a red light. One with a siren may. `ticks`: of its steps.
fn ran_red(world: &World, vehicle: &Obstacle, way: &Way, ticks: &[u64]) -> bool {
    if !BodyClass::Vehicle.holds(vehicle.body) || world.has_siren(vehicle.id) {
        return false;
    }
    let stood =
        |step: usize| way.steps[..=step].iter().any(|step| step.place.velocity_mps.norm() < STOOD_MPS);
    // The typology's country lets vehicles turn right at red after a stop.
    let turns_right = way.shape() == Shape::RightTurn;
    let passed = lights(&world.scene().map, way, vehicle.outline.half_length_m);
    passed.iter().any(|&Passed { step, part, signal }| {
        let tick = ticks[step] + (part * (ticks[step + 1] - ticks[step]) as f64) as u64;
        let is_red = world.signal_at(signal, tick) == SignalColour::Red;
        is_red && !(turns_right && stood(step))
    })
}

/// The stop line of a light that the front of a vehicle passed.
#[derive(Debug, Clone, Copy)]
struct Passed {
    /// The step before, and the part of the way to the next one.
    step: usize,
    part: f64,
    /// Index in [`RoadMap::signals`].
    signal: usize,
}

fn lights(map: &RoadMap, way: &Way, half_length_m: f64) -> Vec<Passed> {
    let lane_at = |step: &Step| {
        let Pose { position, heading_rad } = step.place.pose;
        map.nearest(position + step.place.pose.forward() * half_length_m, heading_rad, BESIDE_M)
    };
    let lanes: Vec<Option<LanePlace>> = way.steps.iter().map(lane_at).collect();
    let mut passed = Vec::new();
    for (step, pair) in lanes.windows(2).enumerate() {
        let [Some(before), Some(after)] = pair else { continue };
        let stretches = stretches(map, before, after);
        let whole_m: f64 = stretches.iter().map(|(_, stations_m)| stations_m.end - stations_m.start).sum();
        let mut driven_m = 0.0;
        for (index, stations_m) in stretches {
            let lane = map.lane(index);
            let there = lane.stop_lines.iter().filter(|line| stations_m.contains(&line.station_m));
            passed.extend(there.map(|line| Passed {
                step,
                part: (driven_m + line.station_m - stations_m.start) / whole_m,
                signal: line.signal,
            }));
            driven_m += stations_m.end - stations_m.start;
        }
    }
    passed
}

/// The stretches of lanes from one place to another that its lane leads to, within half a second. If the other place is
/// beside the lane, as after a lane change: the stretch of the new lane from where the vehicle was beside it.
fn stretches(map: &RoadMap, before: &LanePlace, after: &LanePlace) -> Vec<(LaneIndex, Range<f64>)> {
    if before.lane == after.lane {
        return vec![(before.lane, before.station_m..after.station_m)];
    }
    let length_m = |lane: LaneIndex| map.lane(lane).centre.length_m();
    let first = (before.lane, before.station_m..length_m(before.lane).next_up());
    let last = (after.lane, 0.0..after.station_m);
    let next = &map.lane(before.lane).successors;
    if next.contains(&after.lane) {
        return vec![first, last];
    }
    if let Some(between) = next.iter().find(|lane| map.lane(**lane).successors.contains(&after.lane)) {
        return vec![first, (*between, 0.0..length_m(*between).next_up()), last];
    }
    let here = map.lane(before.lane).centre.position_at(before.station_m);
    let from_m = map.lane(after.lane).centre.project(here).station_m;
    vec![(after.lane, from_m..after.station_m)]
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
