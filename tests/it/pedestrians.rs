//! People on foot cross no wall and no parked vehicle, and appear and end beside the carriageway.

use std::sync::Arc;

use avastra::action::{Effect, SpawnRequest, Surroundings};
use avastra::ads;
use avastra::episode::Outcome;
use avastra::geometry::distance_m;
use avastra::model::vocabulary::{Body, Level, Side, TimeOfDay, Verb};
use avastra::sim::{Control, Obstacle, Scene, Start, World};

use crate::world::{assert_replays, run_of, space, space_at};

/// Spawns of each row on each road.
const SPAWNS: usize = 150;
/// Half a person's width, m.
const HALF_WIDTH_M: f64 = 0.25;

fn walks_ahead(side: Side, distance_m: f64, speed_mps: f64, cover: Option<Body>) -> SpawnRequest {
    SpawnRequest { side, cover, ..SpawnRequest::new(Verb::Walk, distance_m, speed_mps) }
}

#[test]
fn walks_lead_from_kerb_to_kerb_on_every_road() {
    let space = space("avastra45.ava");
    std::thread::scope(|threads| {
        for road in &space.roads {
            threads.spawn(move || {
                let scene = Arc::new(Scene::of(road));
                for side in [Side::Left, Side::Right] {
                    let walks = walks(&scene, side, &[None]);
                    assert!(walks >= SPAWNS, "{walks} walks from the {side:?} on {}", road.name);
                    let covers = [Body::SUV, Body::BoxTruck, Body::SchoolBus, Body::Hatchback].map(Some);
                    let hidden = self::walks(&scene, side, &covers);
                    assert!(hidden >= SPAWNS / 2, "{hidden} from behind on the {side:?} of {}", road.name);
                }
            });
        }
    });
}

#[test]
fn a_step_out_from_behind_is_an_action_that_replays() {
    let run = run_of(space_at("tests/cases/spaces/step_out.ava"), 3, 4, &[]);
    let mut stepped_out = 0;
    for number in 0..run.episodes() {
        let log = run.episode(number);
        for step in &log.steps {
            let Outcome::Done { spawned, .. } = &step.outcome else { continue };
            assert_eq!(spawned.len(), 2, "a pedestrian and a parked vehicle");
            assert_eq!(spawned[1], spawned[0] + 1);
            stepped_out += 1;
        }
        assert_replays(&run, number, &log);
    }
    assert!(stepped_out > 20, "{stepped_out}");
}

/// Tries spawns of all distances all along a road and follows each to its end; returns how many there were.
fn walks(scene: &Arc<Scene>, side: Side, covers: &[Option<Body>]) -> usize {
    let start = Start {
        reactions: 0,
        reactions_from_s: 0.0,
        ego_mps: avastra::model::START_MPS,
        time: TimeOfDay::Noon,
        sky: [Level::None; 3],
        signal_phase_s: 3.0,
        seed: 5,
        ambient: 0,
        traffic: Default::default(),
    };
    let mut world = World::new(scene.clone(), &start);
    let entry = ads::REGISTRY.iter().find(|entry| entry.name == "idm").expect("it is registered");
    let mut driver = (entry.build)(scene, start.seed);
    let mut sensed = world.sensed();
    let (mut found, mut tried) = (0, 0);
    while !world.arrived() && found < SPAWNS {
        for distance_m in (8..80).step_by(6) {
            let speed_mps = 1.0 + 0.01 * f64::from(distance_m);
            let cover = covers[tried % covers.len()];
            let request = walks_ahead(side, f64::from(distance_m), speed_mps, cover);
            tried += 1;
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
    if request.cover.is_some() {
        assert_hidden(&world, &begin);
    }
    let (mut last, mut still) = (begin, 0);
    // The ego vehicle may stop right in its way; then it goes back.
    while still < 1100 {
        world.tick(&brakes);
        let Some(now) = world.obstacle(id) else { break };
        still = if now.velocity_mps.norm() == 0.0 { still + 1 } else { 0 };
        assert!(!scene.map.is_solid(now.outline.pose.position, HALF_WIDTH_M), "{request:?} {now:?}");
        for other in world.obstacles().filter(|other| other.id != id) {
            assert!(distance_m(&now.outline, &other.outline) > 0.0, "{request:?} {now:?}");
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

/// The vehicle beside a pedestrian is on no lane, and hides all of the pedestrian below its roof.
fn assert_hidden(world: &World, pedestrian: &Obstacle) {
    let cover = world.obstacle(pedestrian.id + 1).expect("the cover came with the pedestrian");
    assert_eq!(cover.verb, Verb::Stand);
    for corner in cover.outline.corners() {
        assert!(world.scene().map.lane_room_m(corner) >= 0.0, "{cover:?}");
    }
    let seen = world.sensed().objects.iter().find(|object| object.id == pedestrian.id).copied();
    let above = (1.0 - cover.height_m / pedestrian.height_m).max(0.0);
    assert!(seen.is_none_or(|object| object.visible_fraction <= above + 1e-9), "{pedestrian:?} {cover:?}");
}
