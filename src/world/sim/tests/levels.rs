//! Roads that pass over each other.

use crate::sim::{Control, SensedObject, World, testing};

/// Rolls on at about 10 m/s.
fn roll(world: &World) -> Control {
    Control { throttle_pct: if world.ego().speed_mps < 10.0 { 40.0 } else { 0.0 }, ..Control::default() }
}

#[test]
fn what_passes_above_is_neither_seen_nor_met() {
    // Contacts, the most vehicles of the queue that are sensed on their way to the bridge, and where a vehicle is that
    // drives ahead. Those that have passed and come down the ramp are seen again.
    let drive = |height_m: f64, queue: bool| {
        let mut world = testing::world(&testing::overpass(height_m));
        world.put("1", -1, "", 130.0, 9.0);
        if queue {
            (0..16).for_each(|i| world.put("2", -1, "", 100.0 + 12.0 * f64::from(i), 5.0));
        }
        let (mut contacts, mut sensed) = (0, 0);
        while world.ego_station_m() < 260.0 && world.time_s() < 60.0 {
            contacts += world.tick(&roll(&world)).len();
            let on_the_way = |object: &&SensedObject| object.pose.position.y < -5.0;
            sensed = sensed.max(world.sensed().objects.iter().filter(on_the_way).count());
        }
        let ahead = world.obstacle(1).expect("it is still on the map");
        (contacts, sensed, ahead.outline.pose.position.x)
    };
    let alone = drive(6.0, false);
    assert_eq!((alone.0, alone.1), (0, 0));
    assert_eq!(drive(6.0, true), alone, "the queue passes above");
    let flat = drive(0.0, true);
    assert!(flat.0 > 0 && flat.1 > 0 && flat.2 < alone.2, "{flat:?}: the queue is in the way");
    let low = drive(3.0, true);
    assert!(low.0 > 0, "no bridge is as low as 3 m");
}

#[test]
fn a_vehicle_up_the_hill_is_on_the_same_level() {
    let mut world = testing::world(&testing::hill());
    assert!(world.scene().map.has_levels);
    world.put("1", -1, "", 180.0, 2.0);
    assert_eq!(world.sensed().objects.len(), 1);
    let scene = world.scene();
    let ego_m = scene.route.height_at(&scene.map, world.ego_station_m());
    let above_m = world.obstacle(1).expect("it was put there").elevation_m - ego_m;
    assert!((above_m - 8.0).abs() < 0.1, "{above_m}");
    let mut contacts = 0;
    while world.time_s() < 20.0 {
        contacts += world.tick(&roll(&world)).len();
    }
    assert_eq!(contacts, 1, "it is in the way");
}
