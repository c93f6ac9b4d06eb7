//! People on foot cross no wall and no parked vehicle, and appear and end beside the carriageway.

use std::sync::Arc;

use avastra::action::{Effect, SpawnRequest, Surroundings};
use avastra::model::vocabulary::{Body, Colour, LaneChoice, Level, Side, Then, TimeOfDay, Verb};
use avastra::sim::{Control, Obstacle, Scene, Start, World};
use avastra::{ads, episode};

use crate::world::space;

/// Spawns of each row on each road.
const SPAWNS: usize = 150;
/// Half a person's width, m.
const HALF_WIDTH_M: f64 = 0.25;

fn walks_ahead(side: Side, distance_m: f64, speed_mps: f64) -> SpawnRequest {
    SpawnRequest {
        body: Body::Pedestrian,
        colour: Colour::Black,
        verb: Verb::Walk,
        lane: LaneChoice::Current,
        side,
        then: Then::Keep,
        speed_mps,
        distance_m,
    }
}

#[test]
fn walks_lead_from_kerb_to_kerb_on_every_road() {
    let space = space("avastra45.ava");
    std::thread::scope(|threads| {
        for road in &space.roads {
            threads.spawn(move || {
                let scene = Arc::new(episode::scene(road));
                for side in [Side::Left, Side::Right] {
                    let walks = walks(&scene, side);
                    assert!(walks >= SPAWNS, "{walks} walks from the {side:?} on {}", road.name);
                }
            });
        }
    });
}

/// Tries spawns of all distances all along a road and follows each to its end; returns how many there were.
fn walks(scene: &Arc<Scene>, side: Side) -> usize {
    let start = Start {
        time: TimeOfDay::Noon,
        rain: Level::None,
        fog: Level::None,
        wetness: Level::None,
        signal_phase_s: 3.0,
        seed: 5,
        ambient: 0,
        traffic: Default::default(),
    };
    let mut world = World::new(scene.clone(), &start);
    let entry = ads::REGISTRY.iter().find(|entry| entry.name == "idm").expect("it is registered");
    let mut driver = (entry.build)(scene, start.seed);
    let mut sensed = world.sensed();
    let mut found = 0;
    while !world.arrived() && found < SPAWNS {
        for distance_m in (8..80).step_by(6) {
            let speed_mps = 1.0 + 0.01 * f64::from(distance_m);
            let request = walks_ahead(side, f64::from(distance_m), speed_mps);
            if world.survey(&request).is_ok() {
                follow(world.clone(), &request);
                found += 1;
            }
        }
        for _ in 0..40 {
            world.sense(&mut sensed);
            world.tick(&driver.drive(&sensed));
        }
    }
    found
}

/// Makes a pedestrian appear while the ego vehicle stands still, and checks every step of its way.
fn follow(mut world: World, request: &SpawnRequest) {
    let id = world.apply(&Effect::Spawn(*request)).expect("there is room").expect("a newcomer has an id");
    let scene = world.scene().clone();
    let brakes = Control { brake_pct: 100.0, ..Control::default() };
    let begin = *world.obstacle(id).expect("it just came");
    assert_beside(&scene, &begin);
    let (mut last, mut still) = (begin, 0);
    // The ego vehicle may stop right in its way; then it goes back.
    while still < 1100 {
        world.tick(&brakes);
        let Some(now) = world.obstacle(id) else { break };
        still = if now.velocity_mps.norm() == 0.0 { still + 1 } else { 0 };
        let position = now.outline.pose.position;
        assert!(!scene.map.is_solid(position, HALF_WIDTH_M), "{request:?} {now:?}");
        let parked = |other: &&Obstacle| other.verb == Verb::Stand && other.body.is_vehicle();
        for other in world.obstacles().filter(parked) {
            let apart_m = avastra::geometry::distance_m(&now.outline, &other.outline);
            assert!(apart_m > 0.0, "{request:?} {now:?}");
        }
        last = *now;
    }
    assert_beside(&scene, &last);
}

/// A pedestrian stands on no driving lane.
fn assert_beside(scene: &Scene, pedestrian: &Obstacle) {
    let room_m = scene.map.lane_room_m(pedestrian.outline.pose.position);
    assert!(room_m >= HALF_WIDTH_M, "{room_m} m on {}: {pedestrian:?}", scene.map.name);
}
