//! A healthy driving system with nothing in its way: whatever the weather, it arrives.

use std::sync::Arc;

use avastra::ads;
use avastra::episode;
use avastra::model::vocabulary::Level;
use avastra::model::vocabulary::TimeOfDay;
use avastra::model::vocabulary::Word;
use avastra::sim::Scene;
use avastra::sim::Start;
use avastra::sim::World;

use crate::world::space;

/// How far from the middle of its lane the rear axle may come, m. The lanes are 4 m wide, the
/// vehicle 2.06 m: so it stays in its lane with a quarter of a metre to spare on either side.
const OFFSET_M_MAX: f64 = 0.7;

#[test]
fn undisturbed_drives_arrive_in_every_weather() {
    let space = space("avastra45.ava");
    for road in &space.roads {
        let scene = Arc::new(episode::scene(road));
        for entry in ads::REGISTRY {
            for seed in 0..100 {
                drive(&scene, entry, seed, road.facts.limit_mps);
            }
        }
    }
}

#[test]
fn a_healthy_driving_system_survives_ambient_traffic() {
    let space = space("avastra45.ava");
    let (mut drives, mut hit) = (0, Vec::new());
    for road in &space.roads {
        let scene = Arc::new(episode::scene(road));
        for entry in ads::REGISTRY {
            for seed in 0..40 {
                drives += 1;
                let start = Start { ambient: 8, ..start(seed) };
                let mut world = World::new(scene.clone(), &start);
                let mut driver = (entry.build)(&scene, seed);
                let mut sensed = world.sensed();
                let mut contact = None;
                while !world.arrived() && contact.is_none() {
                    assert!(world.time_s() < 240.0, "{} with {start:?}: does not arrive", entry.name);
                    world.sense(&mut sensed);
                    contact = world.tick(&driver.drive(&sensed)).first().copied();
                }
                hit.extend(contact.map(|contact| (entry.name, seed, contact)));
            }
        }
    }
    // Long vehicles cut corners, and the driving systems do not look to the side.
    assert!(hit.len() * 10 <= drives, "{hit:?}");
}

/// Every level of every phenomenon comes up at every time of day; signals begin anywhere.
fn start(seed: u64) -> Start {
    let pick = |n: u64| Level::ALL[(seed / n % 4) as usize];
    let time = TimeOfDay::ALL[(seed % 3) as usize];
    let signal_phase_s = (seed * 7 % 60) as f64;
    Start { time, rain: pick(3), fog: pick(12), wetness: pick(5), signal_phase_s, seed, ambient: 0 }
}

fn drive(scene: &Arc<Scene>, entry: &ads::Entry, seed: u64, limit_mps: f64) {
    let start = start(seed);
    let mut world = World::new(scene.clone(), &start);
    let mut driver = (entry.build)(scene, seed);
    let mut sensed = world.sensed();
    let who = format!("{} with {start:?}", entry.name);
    while !world.arrived() {
        assert!(world.time_s() < 240.0, "{who}: does not arrive");
        world.sense(&mut sensed);
        let contacts = world.tick(&driver.drive(&sensed));
        assert!(contacts.is_empty(), "{who}: {contacts:?}");
        assert!(world.ego().speed_mps <= 1.05 * limit_mps, "{who}: {} m/s", world.ego().speed_mps);
        let offset_m = world.ego_offset_m();
        assert!(offset_m.abs() <= OFFSET_M_MAX, "{who}: {offset_m} m off at {} m", world.ego_station_m());
    }
    assert_eq!(world.red_runs(), 0, "{who}: ran a red light");
}
