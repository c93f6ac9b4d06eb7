//! Tests of a tick of the world, beside those of `sim::tests`: they reach into its state.

use super::*;
use crate::sim::testing;
use avastra_lang::model::vocabulary::{Priority, Verb};

#[test]
fn of_two_contacts_in_a_tick_neither_sees_the_other() {
    let mut world = testing::world(&testing::straight());
    world.ego.motion.speed_mps = 10.0;
    for distance_m in [8.0, 10.0] {
        world.spawn(&testing::request(Verb::Stand, distance_m, 0.0)).expect("there is room");
    }
    // Side by side, where no request would put them.
    let beside = world.users[0].obstacle.outline.pose.position + Vec2::new(0.0, 0.7);
    world.users[1].obstacle.outline.pose.position = beside;
    let contacts = loop {
        let contacts = world.tick(&Control::default()).to_vec();
        if !contacts.is_empty() {
            break contacts;
        }
    };
    let [first, second] = contacts[..] else { panic!("{contacts:?}") };
    assert_eq!(first.ego_speed_mps, second.ego_speed_mps);
    let left = VehicleParameters::MKZ.mass_t / (VehicleParameters::MKZ.mass_t + 0.075);
    let expected_mps = first.ego_speed_mps * left * left;
    assert!(
        (world.ego().speed_mps - expected_mps).abs() < 1e-9,
        "the second impact acts on the speed that the first left"
    );
}

#[test]
fn a_wreck_has_priority_unless_it_came_to_lie_there_too_late() {
    let priority = |distance_m: f64, turned_rad: f64| {
        let mut world = testing::world(&testing::straight());
        let drives = |world: &World| Control {
            throttle_pct: if world.ego().speed_mps < 10.0 { 60.0 } else { 0.0 },
            ..Control::default()
        };
        while world.ego().speed_mps < 10.0 {
            world.tick(&drives(&world));
        }
        world.spawn(&testing::request(Verb::DriveAhead, distance_m, 0.1)).expect("there is room");
        let user = &mut world.users[0];
        user.obstacle.outline.pose.heading_rad += turned_rad;
        user.obstacle.forward = user.obstacle.outline.pose.forward();
        user.obstacle.velocity_mps = Vec2::zeros();
        user.mover.crash(9);
        loop {
            if let Some(contact) = world.tick(&drives(&world)).first() {
                return contact.ruling.priority;
            }
            assert!(world.time_s() < 60.0);
        }
    };
    // 10 m/s: 4 m until the brakes act, and 17 m to stop gently. How the wreck lies changes nothing.
    for turned_rad in [0.0, 1.2, 3.0] {
        assert_eq!(priority(26.0, turned_rad), Priority::Other, "{turned_rad}");
        assert_eq!(priority(12.0, turned_rad), Priority::None, "{turned_rad}");
    }
}

#[test]
fn a_wreck_in_its_lane_blocks_the_ego_vehicle_and_one_beside_does_not() {
    let mut world = testing::world(&testing::straight());
    world.spawn(&testing::request(Verb::DriveAhead, 12.0, 4.0)).expect("there is room");
    let stop = Control { brake_pct: 100.0, ..Control::default() };
    (0..100).for_each(|_| drop(world.tick(&stop).to_vec()));
    assert!(!world.is_blocked(), "it drives");
    world.users[0].mover.crash(9);
    (0..200).for_each(|_| drop(world.tick(&stop).to_vec()));
    assert!(world.is_blocked());
    world.users[0].obstacle.outline.pose.position += Vec2::new(0.0, 3.5);
    assert!(!world.is_blocked(), "it stands in the other lane");
    world.users[0].obstacle.outline.pose.position -= Vec2::new(0.0, 3.5);
    world.ego.motion.touched = true;
    assert!(!world.is_blocked(), "the ego vehicle is a wreck itself");
}

#[test]
fn a_vehicle_that_left_its_lane_is_astray() {
    let mut world = testing::world(&testing::straight());
    let steers = |steer_rad| Control { throttle_pct: 20.0, steer_rad, ..Control::default() };
    while world.ego_offset_m() < 1.6 {
        world.tick(&steers(0.1));
        assert!(!world.is_astray() && world.time_s() < 20.0);
    }
    while world.ego_offset_m() < 1.8 {
        world.tick(&steers(0.1));
    }
    assert!(world.is_astray());
    world.ego.motion.touched = true;
    assert!(!world.is_astray(), "it was pushed");
}

#[test]
fn beyond_the_end_of_its_way_and_far_from_all_lanes_the_ego_vehicle_has_left_the_map() {
    let scene = testing::straight();
    let drive = |steer_rad: f64| {
        let mut world = testing::world(&scene);
        while !world.left_the_map() {
            let throttle_pct = if world.ego().speed_mps < 10.0 { 40.0 } else { 0.0 };
            world.tick(&Control { throttle_pct, steer_rad, ..Control::default() });
            assert!(world.time_s() < 120.0);
        }
        world.ego_outline().pose.position
    };
    let ahead = drive(0.0);
    // The goal is at x = 500, and the way ends 60 m beyond it.
    assert!((ahead.x + 2.35 - 560.0).abs() < 0.3 && (ahead.y + 1.75).abs() < 0.1, "{ahead}");
    // The outermost lane ends at y = 7: 20 m beyond it.
    let aside = drive(0.02);
    assert!(aside.x < 400.0 && (27.0..30.0).contains(&aside.y), "{aside}");
}

#[test]
fn the_ego_vehicle_arrives_and_counts_red_lights() {
    let mut world = testing::world(&testing::crossing());
    let throttle = Control { throttle_pct: 40.0, ..Control::default() };
    // 100 m in 8 s, the stop line at 185 m after about 13 s, when its light is yellow.
    while !world.arrived() {
        let control = if world.ego().speed_mps < 10.0 { throttle } else { Control::default() };
        world.tick(&control);
        assert!(world.time_s() < 60.0);
    }
    assert!((world.ego_station_m() + 3.705 - 399.0).abs() < 0.3);
    assert_eq!(world.ego_offset_m(), 0.0);
    assert_eq!(world.red_runs(), 1);
}
