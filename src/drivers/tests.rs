//! Every entry of the registry: it repeats itself, a copy goes on as the original; and drives of them on hand-made roads.
//! That all arrive in every weather is tested with the shipped roads (`tests/it/drives`).

use core::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::Body;
use avastra_road::RouteLaneChange;
use avastra_road::testing::{lanes as lanes_of, street};
use avastra_world::sim::testing::overpass;
use avastra_world::sim::{DT_S, SignalColour, VehicleParameters, World};

use super::registry::{Entry, REGISTRY, seeing};
use super::status::{Manoeuvre, Reason};
use super::testing::{Rig, SOURCE_Y_M, TARGET_Y_M, object, straight, two_lanes, winding};

#[test]
fn nothing_slows_down_for_traffic_on_a_bridge() {
    // The speeds of a drive under (or, on the flat, across) a road on which a queue drives or not.
    let speeds_mps = |entry: &Entry, height_m: f64, queue: bool| {
        let scene = overpass(height_m);
        let mut world = World::new(Arc::clone(&scene), &avastra_world::sim::testing::start());
        if queue {
            (0..16).for_each(|i| world.put("2", -1, "", 100.0 + 12.0 * f64::from(i), 5.0));
        }
        let mut ads = (entry.build)(&scene, 1);
        let (mut sensed, mut speeds_mps, mut contacts) = (world.sensed(), Vec::new(), 0);
        while !world.arrived() && world.time_s() < 60.0 {
            world.sense(&mut sensed);
            contacts += world.tick(&ads.drive(&sensed)).len();
            speeds_mps.push(world.ego().speed_mps);
        }
        assert!(height_m == 0.0 || world.arrived() && contacts == 0, "{}", entry.name);
        speeds_mps
    };
    for entry in seeing() {
        let alone = speeds_mps(entry, 6.0, false);
        assert!(speeds_mps(entry, 6.0, true) == alone, "{} yields to traffic above it", entry.name);
        assert!(speeds_mps(entry, 0.0, true) != alone, "{} does not meet traffic on the flat", entry.name);
    }
}

#[test]
fn all_keep_a_straight_lane_repeat_themselves_and_copy() {
    let scene = straight();
    for entry in REGISTRY {
        let build = || {
            let mut rig = Rig::driven_by(entry.name, &scene, 5, 8.0);
            rig.sensed.objects.push(object(1, Body::SUV, Pose::new(60.0, -1.75, 0.0), 7.0));
            rig.sensed.objects.push(object(2, Body::BoxTruck, Pose::new(300.0, 1.75, PI), 9.0));
            rig
        };
        let (mut first, mut again) = (build(), build());
        for tick in 0..1500 {
            assert_eq!(first.tick(), again.tick(), "{} at tick {tick}", entry.name);
        }
        assert!(first.offset_m_max < 0.4, "{}: {}", entry.name, first.offset_m_max);
        let sees = seeing().any(|one| one.name == entry.name);
        assert!(!sees || first.gap_m_min > 1.2, "{}: {}", entry.name, first.gap_m_min);
        assert_eq!(first.ads.status(), again.ads.status());

        let mut copy = first.ads.clone();
        for _ in 0..200 {
            first.measure();
            assert_eq!(copy.drive(&first.sensed), first.tick(), "{}", entry.name);
        }
    }
}

#[test]
fn a_red_light_is_stopped_at_and_left_at_green() {
    let scene = straight();
    // How long each may take to come to rest, s.
    for (name, speed_mps, stops_s) in
        [("frenet", 10.0, 30.0), ("reactive", 10.0, 25.0), ("modular", 0.0, 30.0)]
    {
        let mut rig = Rig::driven_by(name, &scene, 1, speed_mps);
        rig.sensed.signals[0] = SignalColour::Red;
        rig.run(stops_s);
        let front_m = VehicleParameters::MKZ.front_m(rig.station_m());
        assert!(rig.speed_mps() < 0.01 && (97.0..100.0).contains(&front_m), "{name}: {front_m}");
        assert_eq!(rig.ads.status().reason, Reason::RedLight, "{name}");
        rig.sensed.signals[0] = SignalColour::Green;
        rig.run(10.0);
        assert!(rig.station_m() > 130.0, "{name}: {}", rig.station_m());
    }
}

#[test]
fn what_stands_is_stopped_behind_and_what_drives_is_followed() {
    // How long each may take to come to rest and to be as fast as the other, s, and the gap at rest, m.
    for (name, stops_s, gap_m, follows_s) in
        [("frenet", 30.0, 0.5..3.0, 15.0), ("reactive", 25.0, 1.5..4.0, 20.0)]
    {
        let mut rig = Rig::driven_by(name, &straight(), 1, 10.0);
        rig.sensed.objects.push(object(1, Body::Sedan, Pose::new(90.0, -1.75, 0.0), 0.0));
        rig.run(stops_s);
        assert_eq!(rig.speed_mps(), 0.0, "{name}");
        assert!(gap_m.contains(&rig.gap_m_min), "{name}: {}", rig.gap_m_min);
        assert_eq!(rig.ads.status().reason, Reason::Stop(1), "{name}");
        rig.sensed.objects[0].velocity_mps = Vec2::new(6.0, 0.0);
        rig.run(follows_s);
        assert!((rig.speed_mps() - 6.0).abs() < 0.3, "{name}: {}", rig.speed_mps());
    }
}

#[test]
fn bends_are_driven_through_within_the_lane() {
    let scene = winding();
    for (name, seed) in [("modular", 0), ("modular", 1), ("modular", 2), ("reactive", 0)] {
        let mut rig = Rig::driven_by(name, &scene, seed, if name == "modular" { 0.0 } else { 6.0 });
        while rig.station_m() < scene.route.goal_m {
            rig.tick();
            assert!(rig.sensed.time_s < 60.0, "{name} arrives within a minute");
        }
        assert!(rig.offset_m_max < 0.6, "{name}: {}", rig.offset_m_max);
    }
}

#[test]
fn a_lane_change_waits_where_it_is_just_possible_until_there_is_a_gap() {
    // How far each may be beside the middle of its lane, and how near to another vehicle, m.
    for (name, aside_m, gap_m) in
        [("frenet", 0.3, 0.5), ("reactive", 0.1, 1.0), ("idm", 0.1, 1.0), ("modular", 0.3, 0.8)]
    {
        let mut rig = Rig::driven_by(name, &two_lanes(100.0), 1, 8.0);
        // A queue stands beside all that is left of the way.
        rig.sensed.objects = (0..14)
            .map(|i| object(i + 1, Body::Sedan, Pose::new(f64::from(i) * 8.0, TARGET_Y_M, 0.0), 0.0))
            .collect();
        rig.run(30.0);
        let place = rig.place();
        assert!((place.y - SOURCE_Y_M).abs() < aside_m, "{name}: {place:?}");
        let wait_m = rig.scene.route.changes[0].latest_m - RouteLaneChange::LENGTH_M_MIN;
        assert!((wait_m - 6.0..wait_m + 1.0).contains(&place.x), "{name}: {place:?} against {wait_m}");
        let status = rig.ads.status();
        assert!(status.manoeuvre == Manoeuvre::AwaitGap || status.reason == Reason::LaneChange, "{name}");
        // The queue moves off; behind it there is room.
        for object in &mut rig.sensed.objects {
            object.velocity_mps = Vec2::new(9.0, 0.0);
        }
        rig.run(40.0);
        let place = rig.place();
        assert!((place.y - TARGET_Y_M).abs() < aside_m && place.x > 150.0, "{name}: {place:?}");
        assert!(rig.gap_m_min > gap_m, "{name}: {}", rig.gap_m_min);
    }
}

#[test]
fn a_faster_vehicle_passes_before_the_lane_is_changed() {
    for (name, aside_m) in [("idm", 0.1), ("modular", 0.3)] {
        let mut rig = Rig::driven_by(name, &two_lanes(300.0), 1, 8.0);
        rig.sensed.objects = vec![object(1, Body::Sedan, Pose::new(-15.0, TARGET_Y_M, 0.0), 13.0)];
        rig.run(1.0);
        assert!((rig.place().y - SOURCE_Y_M).abs() < aside_m, "{name}: {:?}", rig.place());
        rig.run(20.0);
        assert!((rig.place().y - TARGET_Y_M).abs() < aside_m, "{name}: {:?}", rig.place());
        assert!(rig.gap_m_min > 1.0, "{name}: {}", rig.gap_m_min);
    }
}

#[test]
fn the_lane_is_changed_with_the_route_on_a_free_road() {
    for (name, aside_m) in [("frenet", 0.1), ("modular", 0.3)] {
        let mut rig = Rig::driven_by(name, &two_lanes(200.0), 1, 8.0);
        assert!(rig.run_any(30.0, |rig| rig.ads.status().manoeuvre == Manoeuvre::LaneChange), "{name}");
        assert_eq!(rig.ads.status().manoeuvre, Manoeuvre::LaneFollow, "{name}");
        assert!((rig.place().y - TARGET_Y_M).abs() < aside_m, "{name}: {:?}", rig.place());
    }
}

#[test]
fn frenet_keeps_its_lane_at_the_limit() {
    let mut rig = Rig::driven_by("frenet", &straight(), 1, 6.0);
    rig.run(20.0);
    assert!((rig.speed_mps() - 11.18).abs() < 0.1, "{}", rig.speed_mps());
    assert!(rig.offset_m_max < 0.05, "{}", rig.offset_m_max);
    assert_eq!(rig.ads.status().reason, Reason::Cruise);
}

#[test]
fn frenet_leaves_room_to_those_at_the_edge_of_its_lane_and_to_those_that_cross() {
    // 1.4 m beside the middle of the lane: the vehicle itself takes 1.03 m.
    for (pose, speed_mps, gap_m) in
        [(Pose::new(80.0, -3.2, 0.0), 0.0, 0.25), (Pose::new(45.0, -9.0, FRAC_PI_2), 1.4, 0.5)]
    {
        let mut rig = Rig::driven_by("frenet", &straight(), 1, 8.0);
        rig.sensed.objects.push(object(1, Body::Pedestrian, pose, speed_mps));
        rig.run(25.0);
        assert!(rig.station_m() > 100.0 && rig.gap_m_min > gap_m, "{} {}", rig.station_m(), rig.gap_m_min);
    }
}

#[test]
fn reactive_brakes_hard_for_a_step_into_its_corridor_and_not_for_a_pedestrian_beside() {
    let with_walker = |y_m: f64, speed_mps: f64| {
        let mut rig = Rig::driven_by("reactive", &straight(), 1, 10.0);
        rig.sensed.objects.push(object(1, Body::Pedestrian, Pose::new(40.0, y_m, FRAC_PI_2), speed_mps));
        rig
    };
    let mut rig = with_walker(-7.4, 1.4);
    assert!(rig.run_any(10.0, |rig| rig.ads.status().control.brake_pct > 60.0) && rig.gap_m_min > 0.0);
    let mut rig = with_walker(-4.5, 0.0);
    rig.run(5.0);
    assert!(rig.station_m() > 45.0, "{}", rig.station_m());
}

/// The common test "cutin-brake": A, 60 m ahead, brakes from 4 s on; B, 25 m ahead in the left lane, moves over
/// from 2 s on, and brakes from 5 s on to stop behind A.
#[test]
fn a_cut_in_that_brakes_is_survived() {
    // Three lanes of 3.5 m to the east; the route is on the middle one (y = -5.25) from x = 20.
    let broken = r#"<roadMark sOffset="0" type="broken"/>"#;
    let lanes = lanes_of(&[-1, -2, -3].map(|id| (id, "driving", 3.5, broken)));
    let road = street("1", [0.0, 0.0, 0.0, 600.0], "-1", "", &lanes, "");
    let scene = avastra_world::sim::testing::scene(&road, ("1", -2, 20.0), ("1", -2, 500.0));
    for entry in seeing() {
        let mut rig = Rig::driven_by(entry.name, &scene, 5, 14.0);
        rig.sensed.signals.clear();
        rig.sensed.objects = vec![
            object(1, Body::Sedan, Pose::new(20.0 + 60.0, -5.25, 0.0), 12.0),
            object(2, Body::Sedan, Pose::new(20.0 + 25.0, -1.75, 0.0), 12.0),
        ];
        for _ in 0..600 {
            let time_s = rig.sensed.time_s;
            for (object, brakes_s) in rig.sensed.objects.iter_mut().zip([4.0, 5.0]) {
                if time_s >= brakes_s {
                    object.velocity_mps.x = (object.velocity_mps.x - 6.0 * DT_S).max(0.0);
                }
            }
            let cutter = &mut rig.sensed.objects[1];
            cutter.velocity_mps.y = if time_s >= 2.0 && cutter.pose.position.y > -5.25 { -1.5 } else { 0.0 };
            rig.tick();
        }
        rig.measure();
        let (gap_m, speed_mps) = (rig.gap_m_min, rig.speed_mps());
        // The sampling planner still rolls up to the standing car then, 9 m behind it.
        assert!(gap_m > 0.0 && speed_mps < 2.5, "{}: {gap_m} m, {speed_mps} m/s", entry.name);
    }
}
