//! Motorways: the speeds that roads ask for, in ordinary traffic.

use std::sync::Arc;

use avastra::ads;
use avastra::sim::{Scene, Start, World};

use crate::world::space;

/// How long each drive is, s: most of the 7.3 km at 130 km/h.
const DRIVE_S: f64 = 120.0;
/// Ordinary vehicles around the ego vehicle.
const AMBIENT: u32 = 12;

#[test]
fn every_driver_keeps_to_motorways_at_their_speeds() {
    let space = space("r157.ava");
    for entry in ads::seeing() {
        let mut fastest_mps = 0.0_f64;
        for (number, road) in space.roads.iter().enumerate() {
            let scene = Arc::new(Scene::of(road));
            let set_mps = road.set_mps.expect("the road asks for a speed");
            let memory = space.initial_memory(1);
            let start = Start { ambient: AMBIENT, ..Start::drawn(&space, road, &memory, number as u64) };
            let mut world = World::new(Arc::clone(&scene), &start);
            assert_eq!(world.ego().speed_mps, set_mps, "{}", road.name);
            let mut driver = (entry.build)(&scene, 1);
            let mut sensed = world.sensed();
            let (mut most_mps, mut seen_m) = (0.0_f64, 0.0_f64);
            while world.time_s() < DRIVE_S && !world.arrived() {
                world.sense(&mut sensed);
                let control = driver.drive(&sensed);
                let contacts = world.tick(&control).to_vec();
                assert!(contacts.is_empty(), "{} on {}: {contacts:?}", entry.name, road.name);
                assert!(world.incidents().is_empty(), "{} on {}: others collide", entry.name, road.name);
                most_mps = most_mps.max(world.ego().speed_mps);
                seen_m = sensed.objects.iter().map(|object| object.distance_m).fold(seen_m, f64::max);
            }
            assert!(most_mps <= set_mps + 0.5, "{} on {}: {most_mps} m/s", entry.name, road.name);
            assert!(seen_m > 200.0, "{} on {}: it sees {seen_m} m", entry.name, road.name);
            let driven_m = world.ego_station_m();
            assert!(
                driven_m > 0.6 * set_mps * world.time_s(),
                "{} on {}: {driven_m} m",
                entry.name,
                road.name
            );
            fastest_mps = fastest_mps.max(most_mps);
        }
        assert!(fastest_mps > 34.0, "{}: {fastest_mps} m/s", entry.name);
    }
}
