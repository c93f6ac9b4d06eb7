//! Every entry of the registry: it repeats itself, a copy goes on as the original; and drives of them on hand-made roads.
//! That all arrive in every weather is tested with the shipped roads (`tests/it/drives`).

use core::f64::consts::PI;
use std::sync::Arc;

use avastra_base::geometry::Pose;
use avastra_lang::model::vocabulary::Body;
use avastra_road::testing::{lanes as lanes_of, street};
use avastra_world::sim::testing::overpass;
use avastra_world::sim::{DT_S, Scene, SignalColour, VehicleParameters, World};

use super::driver::Ads;
use super::registry::{REGISTRY, by_name};
use super::status::Reason;
use super::testing::{Rig, object, straight};

#[test]
fn nothing_slows_down_for_traffic_on_a_bridge() {
    // The speeds of a drive under (or, on the flat, across) a road on which a queue drives or not.
    let speeds_mps = |entry: &super::registry::Entry, height_m: f64, queue: bool| {
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
    for entry in REGISTRY {
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
            let mut rig = Rig::new(&scene, (entry.build)(&scene, 5), 8.0);
            rig.sensed.objects.push(object(1, Body::SUV, Pose::new(60.0, -1.75, 0.0), 7.0));
            rig.sensed.objects.push(object(2, Body::BoxTruck, Pose::new(300.0, 1.75, PI), 9.0));
            rig
        };
        let (mut first, mut again) = (build(), build());
        for tick in 0..1500 {
            assert_eq!(first.tick(), again.tick(), "{} at tick {tick}", entry.name);
        }
        assert!(first.offset_m_max < 0.4, "{}: {}", entry.name, first.offset_m_max);
        assert!(first.gap_m_min > 1.2, "{}: {}", entry.name, first.gap_m_min);
        assert_eq!(first.ads.status(), again.ads.status());

        let mut copy = first.ads.clone();
        for _ in 0..200 {
            first.measure();
            assert_eq!(copy.drive(&first.sensed), first.tick(), "{}", entry.name);
        }
    }
}

/// The drivers that share the rules' stops (`stops`), and how long each may take to come to rest, s.
#[test]
fn a_red_light_is_stopped_at_and_left_at_green() {
    let scene = straight();
    for (name, stops_s) in [("frenet", 30.0), ("reactive", 25.0)] {
        let entry = by_name(name).expect("it is registered");
        let mut rig = Rig::new(&scene, (entry.build)(&scene, 5), 10.0);
        rig.sensed.signals[0] = SignalColour::Red;
        rig.run(stops_s);
        let front_m = VehicleParameters::MKZ.front_m(rig.station_m());
        assert!(rig.sensed.ego.speed_mps == 0.0 && (97.0..100.0).contains(&front_m), "{name}: {front_m}");
        assert_eq!(rig.ads.status().reason, Reason::RedLight, "{name}");
        rig.sensed.signals[0] = SignalColour::Green;
        rig.run(10.0);
        assert!(rig.station_m() > 130.0, "{name}: {}", rig.station_m());
    }
}

/// Three lanes of 3.5 m to the east; the route is on the middle one (y = -5.25) from x = 20.
fn three_lanes() -> Arc<Scene> {
    let broken = r#"<roadMark sOffset="0" type="broken"/>"#;
    let lanes = [-1, -2, -3].map(|id| (id, "driving", 3.5, broken));
    let road = street("1", [0.0, 0.0, 0.0, 600.0], "-1", "", &lanes_of(&lanes), "");
    avastra_world::sim::testing::scene(&road, ("1", -2, 20.0), ("1", -2, 500.0))
}

/// The common test "cutin-brake": A, 60 m ahead, brakes from 4 s on; B, 25 m ahead in the left lane, moves over
/// from 2 s on, and brakes from 5 s on to stop behind A. Least gap (m), and the driver's speed at the end.
fn cut_in_and_brake(ads: &dyn Fn(&Arc<Scene>) -> Box<dyn Ads>) -> (f64, f64) {
    let scene = three_lanes();
    let mut rig = Rig::new(&scene, ads(&scene), 14.0);
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
    (rig.gap_m_min, rig.sensed.ego.speed_mps)
}

#[test]
fn a_cut_in_that_brakes_is_survived() {
    for entry in REGISTRY {
        let (gap_m_min, speed_mps) = cut_in_and_brake(&|scene| (entry.build)(scene, 5));
        // The sampling planner still rolls up to the standing car then, 9 m behind it.
        assert!(gap_m_min > 0.0 && speed_mps < 2.5, "{}: {gap_m_min} m, {speed_mps} m/s", entry.name);
    }
}
