//! Where everybody was in the last seconds, as far as the kind of a collision asks.

use std::collections::VecDeque;

use avastra_lang::model::vocabulary::{Body, TrafficRule};
use avastra_road::SignKind;
use avastra_world::sim::{Contact, DT_S, Obstacle, Scene, VehicleParameters, World};

use super::facts::side;
use super::precrash::{Before, Place, PreCrash, Way, place};
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
            ego: ego_now(world),
            ego_front_m: front_m(world),
            red_runs: world.red_runs(),
            others: world.obstacles().map(|obstacle| (obstacle.id, now(obstacle))).collect(),
        });
    }

    /// The shape of the ego vehicle's way to this moment, and the kind of a collision that begins now.
    pub fn kind(&self, world: &World, contact: &Contact, is_wreck: bool) -> (Shape, PreCrash) {
        let ego = ego_now(world);
        let Some(first) = self.looks.front() else { return (Shape::Straight, PreCrash::Other) };
        let whole = Way { from: first.ego, to: ego };
        let Some(obstacle) = world.obstacle(contact.obstacle) else {
            return (whole.shape(), PreCrash::Other);
        };
        // Both are looked at from the moment at which the other was there.
        let met = self.looks.iter().find_map(|look| {
            let (_, other) = look.others.iter().find(|(id, _)| *id == contact.obstacle)?;
            Some((look.ego, *other))
        });
        let other = place(obstacle.outline.pose, contact.obstacle_velocity_mps);
        let (ego_from, other_from) = met.unwrap_or((first.ego, other));
        let junction = self.junction(world);
        let Scene { map, route, .. } = world.scene().as_ref();
        let is_signalized = junction.is_some_and(|junction| map.junctions[junction].groups > 0);
        let passed = first.ego_front_m..=front_m(world);
        let mut stops = route.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
        let stood = self.looks.iter().any(|look| look.ego.speed_mps < STOOD_MPS);
        let other_ran_red = is_signalized && world.ignores(contact.obstacle, TrafficRule::Signals);
        let before = Before {
            body: obstacle.body,
            ego: Way { from: ego_from, to: ego },
            other: Way { from: other_from, to: other },
            ran_red: world.red_runs() > first.red_runs || other_ran_red,
            ran_stop: !stood && stops.any(|line| passed.contains(&line.station_m)),
            in_junction: junction.is_some(),
            is_signalized,
            is_lengthwise: !matches!(side(contact.on_ego, &VehicleParameters::MKZ), "left" | "right"),
            is_wreck: is_wreck && obstacle.body != Body::Pedestrian,
        };
        (whole.shape(), before.kind())
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

fn ego_now(world: &World) -> Place {
    let ego = world.ego();
    Place { pose: ego.rear_axle, speed_mps: ego.speed_mps }
}

fn front_m(world: &World) -> f64 {
    VehicleParameters::MKZ.front_m(world.ego_station_m())
}

fn now(obstacle: &Obstacle) -> Place {
    place(obstacle.outline.pose, obstacle.velocity_mps)
}
