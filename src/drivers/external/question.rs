//! The messages to a driving system: the map, the beginning of an episode, and each step.

use std::path::Path;

use crate::driver::Ads;
use crate::modular::Modular;
use crate::status::PerceivedObject;
use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use avastra_lang::model::vocabulary::{Body, ShownLights};
use avastra_road::{LaneIndex, Neighbour, Precedence, RoadMap, Side, SignKind, Turn};
use avastra_world::sim::{DT_S, EgoMotion, Scene, Sensed, SignalColour, VehicleParameters};

use super::message::{
    Class, ConditionsMessage, ConflictMessage, CrosswalkMessage, EgoMessage, Goal, Init, LaneMessage,
    LaneSign, LaneStop, Light, Map, NeighborMessage, ObjectMessage, PROTOCOL, Point, PrecedenceWord, Reset,
    RouteChange, RouteMessage, RouteSign, RouteStop, RouteStretch, SignWord, SignalPlace, SignalState, Start,
    Step, TurnWord, Vehicle, VehicleLights,
};
use super::settings::ExternalSettings;

/// Points of lanes are at most this far apart, m.
const LANE_SPACING_M: f64 = 2.0;
/// Distance between the points of a route's path, m.
const PATH_SPACING_M: f64 = 1.0;
/// Lights farther away are left out, m.
const SIGNALS_M: f64 = 150.0;
/// A vehicle this far outside of every lane is on none, m.
const LANE_REACH_M: f64 = 0.5;
/// Standard deviation that localisation is told to have, m: `modular`'s in an open street.
const POSITION_STD_M: f64 = 0.07;
/// Seeds are integers that every language reads exactly.
const SEED_BITS: u32 = 53;

/// A number as a message has it: to the micrometre, and finite.
pub fn number(value: f64) -> f64 {
    if value.is_finite() { (value * 1e6).round() / 1e6 + 0.0 } else { 1e9_f64.copysign(value) }
}

/// A message for each of the items.
fn each<T, M>(items: &[T], message: impl Fn(&T) -> M) -> Vec<M> {
    items.iter().map(message).collect()
}

fn point(position: Vec2) -> Point {
    [number(position.x), number(position.y)]
}

pub fn init(settings: &ExternalSettings) -> Init {
    let car = VehicleParameters::MKZ;
    Init {
        protocol: PROTOCOL.to_owned(),
        simulator: concat!("avastra ", env!("CARGO_PKG_VERSION")).to_owned(),
        tick_us: micros(DT_S),
        period_us: micros(settings.period_s),
        observation: settings.observation,
        vehicle: Vehicle {
            length: car.length_m,
            width: car.width_m,
            height: car.height_m,
            wheelbase: car.wheelbase_m,
            rear_axle_to_front: car.rear_axle_to_front_m,
            rear_axle_to_back: car.rear_axle_to_back_m,
            max_steer: car.steer_rad_max,
            max_steer_rate: car.steer_rate_radps_max,
            max_accel: car.acceleration_mps2_max,
            max_decel: car.deceleration_mps2_max,
            mass: 1000.0 * car.mass_t,
        },
        answer: settings.answer,
    }
}

/// A time as a message has it, µs.
pub fn micros(time_s: f64) -> u64 {
    (time_s * 1e6).round() as u64
}

fn lane_id(map: &RoadMap, lane: LaneIndex) -> String {
    let key = &map.lane(lane).key;
    format!("{}/{}/{}", key.road, key.section, key.lane)
}

pub fn map(map: &RoadMap, opendrive: Option<&Path>) -> Map {
    let lanes = (0..map.lanes.len()).map(|index| lane(map, LaneIndex(index)));
    let signals = map.signals.iter().filter(|signal| signal.for_vehicles).map(|signal| SignalPlace {
        id: signal.id.clone(),
        x: number(signal.position.x),
        y: number(signal.position.y),
    });
    Map {
        id: map.name.clone(),
        opendrive: opendrive.map(|path| path.to_string_lossy().into_owned()),
        lanes: lanes.collect(),
        signals: signals.collect(),
        crosswalks: each(&map.crosswalks, |crosswalk| CrosswalkMessage {
            id: crosswalk.id.clone(),
            outline: each(&crosswalk.outline, |corner| point(*corner)),
        }),
    }
}

fn lane(map: &RoadMap, index: LaneIndex) -> LaneMessage {
    let lane = map.lane(index);
    let length_m = lane.centre.length_m();
    let pieces = (length_m / LANE_SPACING_M).ceil().max(1.0) as usize;
    let stations: Vec<f64> = (0..=pieces).map(|piece| length_m * piece as f64 / pieces as f64).collect();
    let beside = |part: f64| {
        let at = |station_m: &f64| {
            let aside_m = part * lane.width_at(*station_m) / 2.0;
            point(lane.centre.pose_at(*station_m).offset(0.0, aside_m).position)
        };
        each(&stations, at)
    };
    let ids = |lanes: &[LaneIndex]| each(lanes, |lane| lane_id(map, *lane));
    let neighbour = |found: Option<Neighbour>| {
        found.map(|found| NeighborMessage {
            id: lane_id(map, found.lane),
            same_direction: found.same_direction,
            gap: number(found.gap_m),
        })
    };
    let changes = |side| each(lane.changes_m(side), |(from, to)| [number(*from), number(*to)]);
    LaneMessage {
        id: lane_id(map, index),
        length: number(length_m),
        s: each(&stations, |station_m| number(*station_m)),
        centerline: beside(0.0),
        left: beside(1.0),
        right: beside(-1.0),
        speed_limit: number(lane.speed_limit_mps),
        turn: match lane.turn {
            Turn::Straight => TurnWord::Straight,
            Turn::Left => TurnWord::Left,
            Turn::Right => TurnWord::Right,
            Turn::UTurn => TurnWord::UTurn,
        },
        junction: lane.junction.map(|junction| map.junctions[junction].id.clone()),
        successors: ids(&lane.successors),
        predecessors: ids(&lane.predecessors),
        left_neighbor: neighbour(lane.left),
        right_neighbor: neighbour(lane.right),
        changes_left: changes(Side::Left),
        changes_right: changes(Side::Right),
        stop_lines: each(&lane.stop_lines, |line| LaneStop {
            s: number(line.station_m),
            signal: map.signals[line.signal].id.clone(),
        }),
        signs: lane
            .sign_lines
            .iter()
            .filter_map(|line| Some(LaneSign { s: number(line.station_m), kind: sign(line.kind)? }))
            .collect(),
        precedence: match lane.precedence {
            Precedence::Priority => PrecedenceWord::Priority,
            Precedence::Equal => PrecedenceWord::Equal,
            Precedence::Yield => PrecedenceWord::Yield,
        },
    }
}

fn sign(kind: SignKind) -> Option<SignWord> {
    match kind {
        SignKind::Stop => Some(SignWord::Stop),
        SignKind::Yield => Some(SignWord::Yield),
        SignKind::PriorityRoad => None,
    }
}

/// The beginning of an episode with this first moment.
pub fn reset(scene: &Scene, sensed: &Sensed, seed: u64) -> Reset {
    let Scene { map, route, .. } = scene;
    let length_m = route.path.length_m();
    let place = |station_m: f64| {
        let pose = route.path.pose_at(station_m);
        let limit_mps = map.lane(route.lane_at(station_m).lane).speed_limit_mps;
        [
            number(pose.position.x),
            number(pose.position.y),
            number(wrap_angle(pose.heading_rad)),
            number(route.path.curvature_at(station_m)),
            number(limit_mps),
        ]
    };
    let whole = (length_m / PATH_SPACING_M).ceil() as usize;
    let stations = (0..whole).map(|index| index as f64 * PATH_SPACING_M).chain([length_m]);
    let goal = route.path.pose_at(route.goal_m);
    let ego = &sensed.ego;
    Reset {
        episode_seed: None,
        seed: seed & ((1 << SEED_BITS) - 1),
        map: map.name.clone(),
        start: Start {
            x: number(ego.rear_axle.position.x),
            y: number(ego.rear_axle.position.y),
            heading: number(ego.rear_axle.heading_rad),
            speed: number(ego.speed_mps),
        },
        goal: Goal {
            x: number(goal.position.x),
            y: number(goal.position.y),
            heading: number(wrap_angle(goal.heading_rad)),
            lane: lane_id(map, route.lane_at(route.goal_m).lane),
            route_s: number(route.goal_m),
        },
        route: RouteMessage {
            lanes: each(&route.lanes, |lane| RouteStretch {
                id: lane_id(map, lane.lane),
                from: number(lane.enter_m),
                to: number(lane.to_m),
            }),
            length: number(length_m),
            spacing: PATH_SPACING_M,
            path: stations.map(place).collect(),
            changes: each(&route.changes, |change| RouteChange {
                from: number(change.begin_m),
                to: number(change.end_m),
                latest: number(change.latest_m),
                lateral: number(change.lateral_m),
            }),
            stop_lines: each(&route.stop_lines, |line| RouteStop {
                route_s: number(line.station_m),
                signal: map.signals[line.signal].id.clone(),
            }),
            signs: route
                .sign_lines
                .iter()
                .filter_map(|line| {
                    Some(RouteSign { route_s: number(line.station_m), kind: sign(line.kind)? })
                })
                .collect(),
            crosswalks: each(&route.crosswalks_m, |(from, to)| [number(*from), number(*to)]),
            conflicts: None,
        },
    }
}

/// Where the route crosses other lanes.
pub fn conflicts(Scene { map, route, .. }: &Scene) -> Vec<ConflictMessage> {
    each(&route.conflicts, |conflict| ConflictMessage {
        route_s: number(conflict.station_m),
        lane: lane_id(map, conflict.lane),
        s: number(conflict.lane_station_m),
        angle: number(conflict.angle_rad),
    })
}

/// A step. `observer` is who believes what is shown; without one, the truth is shown. `route_m` is the place on the
/// route.
pub fn step(
    scene: &Scene,
    sensed: &Sensed,
    observer: Option<&Modular>,
    (seq, t_us): (u64, u64),
    route_m: (f64, f64),
) -> Step {
    let localized = pose(sensed, observer);
    let position_std = if observer.is_some() { POSITION_STD_M } else { 0.0 };
    let far_m = if observer.is_some() { sensed.conditions.visibility_m } else { f64::INFINITY };
    let signals = scene.map.signals.iter().zip(&sensed.signals).filter(|(signal, _)| signal.for_vehicles);
    let signals = signals.filter_map(|(signal, colour)| {
        let away_m = (signal.position - sensed.ego.rear_axle.position).norm();
        let state = if away_m > far_m { Light::Unknown } else { light(*colour) };
        (away_m <= SIGNALS_M).then(|| SignalState { id: signal.id.clone(), state })
    });
    let conditions = &sensed.conditions;
    Step {
        seq,
        t_us,
        ego: ego(scene, &sensed.ego, &localized, position_std, route_m),
        objects: match observer {
            Some(observer) => each(&observer.status().perceived, believed),
            None => each(&sensed.objects, |object| ObjectMessage {
                visible: number(object.visible_fraction),
                lights: shown(object.lights),
                ..believed(&PerceivedObject::as_it_is(object))
            }),
        },
        signals: signals.collect(),
        conditions: ConditionsMessage {
            light: number(conditions.light),
            rain: number(conditions.rain_mmph),
            visibility: number(conditions.visibility_m),
            water: number(conditions.water_mm),
            friction: number(conditions.friction),
        },
    }
}

/// Where the driving system is shown its rear axle to be.
pub fn pose(sensed: &Sensed, observer: Option<&Modular>) -> Pose {
    observer.and_then(|observer| observer.status().localized).unwrap_or(sensed.ego.rear_axle)
}

fn ego(scene: &Scene, motion: &EgoMotion, pose: &Pose, position_std: f64, route_m: (f64, f64)) -> EgoMessage {
    let velocity_mps = unit_vector(pose.heading_rad) * motion.speed_mps;
    let on = scene.map.nearest(pose.position, pose.heading_rad, LANE_REACH_M);
    EgoMessage {
        x: number(pose.position.x),
        y: number(pose.position.y),
        heading: number(wrap_angle(pose.heading_rad)),
        vx: number(velocity_mps.x),
        vy: number(velocity_mps.y),
        speed: number(motion.speed_mps),
        accel: number(motion.acceleration_mps2),
        yaw_rate: number(motion.yaw_rate_radps),
        steer: number(motion.steer_rad),
        touched: motion.touched,
        lane: on.map(|place| lane_id(&scene.map, place.lane)),
        s: on.map_or(0.0, |place| number(place.station_m)),
        d: on.map_or(0.0, |place| number(place.offset_m)),
        route_s: number(route_m.0),
        route_d: number(route_m.1),
        position_std,
    }
}

/// An object as it is believed to be now, under the number of its track.
fn believed(object: &PerceivedObject) -> ObjectMessage {
    ObjectMessage {
        id: object.track.into(),
        class: match object.body {
            Body::Pedestrian => Class::Pedestrian,
            Body::SchoolBus => Class::Bus,
            Body::BoxTruck => Class::Truck,
            Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback => Class::Car,
            Body::Motorcycle => Class::Motorcycle,
            Body::Bicycle => Class::Cyclist,
            Body::Animal => Class::Animal,
            Body::Object => Class::Object,
        },
        x: number(object.pose.position.x),
        y: number(object.pose.position.y),
        heading: number(wrap_angle(object.pose.heading_rad)),
        vx: number(object.velocity_mps.x),
        vy: number(object.velocity_mps.y),
        length: number(object.length_m),
        width: number(object.width_m),
        height: number(object.height_m),
        visible: 1.0,
        lights: None,
        ax: None,
        ay: None,
        yaw_rate: None,
        age: None,
        npc: None,
    }
}

/// The lights that a vehicle was told to show.
fn shown(lights: ShownLights) -> Option<VehicleLights> {
    match lights {
        ShownLights::Off => None,
        ShownLights::Hazard => Some(VehicleLights::Hazard),
        ShownLights::Left => Some(VehicleLights::Left),
        ShownLights::Right => Some(VehicleLights::Right),
        ShownLights::Flash => Some(VehicleLights::Flash),
    }
}

fn light(colour: SignalColour) -> Light {
    match colour {
        SignalColour::Red => Light::Red,
        SignalColour::Yellow => Light::Yellow,
        SignalColour::Green => Light::Green,
    }
}
