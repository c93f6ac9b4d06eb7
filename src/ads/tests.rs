//! Every entry of the registry: it drives, repeats itself, and a copy goes on as the original.

use core::f64::consts::PI;
use std::sync::Arc;

use crate::geometry::Pose;
use crate::model::vocabulary::{Body, Level, TimeOfDay, Word};
use crate::sim::{Scene, SignalColour, Start, VehicleParameters, World};

use super::driver::Ads;
use super::registry::REGISTRY;
use super::testing::{Rig, corner, object, straight};

/// Result of a drive without obstacles.
#[derive(Debug)]
struct Drive {
    arrived: bool,
    duration_s: f64,
    offset_m_max: f64,
    offset_at_m: f64,
    over_limit_max: f64,
    red_runs: usize,
    lateral_mps2_max: f64,
}

fn drive_alone(scene: &Arc<Scene>, ads: &mut dyn Ads, start: &Start) -> Drive {
    let mut world = World::new(Arc::clone(scene), start);
    let mut sensed = world.sensed();
    let mut drive = Drive {
        arrived: false,
        duration_s: 0.0,
        offset_m_max: 0.0,
        offset_at_m: 0.0,
        over_limit_max: 0.0,
        red_runs: 0,
        lateral_mps2_max: 0.0,
    };
    let front_m = |world: &World| VehicleParameters::MKZ.front_m(world.ego_station_m());
    while !world.arrived() && world.time_s() < 240.0 {
        world.sense(&mut sensed);
        let before_m = front_m(&world);
        let control = ads.drive(&sensed);
        world.tick(&control);
        let after_m = front_m(&world);
        for line in &scene.route.stop_lines {
            if before_m < line.station_m
                && after_m >= line.station_m
                && sensed.signals[line.signal] == SignalColour::Red
            {
                drive.red_runs += 1;
            }
        }
        let offset_m = scene
            .route
            .path
            .project_near(world.ego().rear_axle.position, world.ego_station_m(), 5.0)
            .offset_m
            .abs();
        if offset_m > drive.offset_m_max {
            drive.offset_m_max = offset_m;
            drive.offset_at_m = world.ego_station_m();
        }
        let lane = scene.route.lane_at(world.ego_station_m()).lane;
        let part = world.ego().speed_mps / scene.map.lane(lane).speed_limit_mps;
        drive.over_limit_max = drive.over_limit_max.max(part);
        drive.lateral_mps2_max =
            drive.lateral_mps2_max.max((world.ego().speed_mps * world.ego().yaw_rate_radps).abs());
    }
    drive.arrived = world.arrived();
    drive.duration_s = world.time_s();
    drive
}

#[test]
fn all_drive_the_corner_in_any_weather() {
    let scene = corner();
    for entry in REGISTRY {
        for seed in 0..24_u64 {
            let level = |shift: u64| Level::ALL[((seed + shift) % 4) as usize];
            let start = Start {
                time: TimeOfDay::ALL[(seed % 3) as usize],
                rain: level(0),
                fog: level(seed / 4),
                wetness: level(seed / 3),
                signal_phase_s: seed as f64 * 3.7,
                seed,
                ambient: 0,
            };
            let mut ads = (entry.build)(&scene, seed);
            let drive = drive_alone(&scene, ads.as_mut(), &start);
            assert!(drive.arrived, "{} {seed}: {drive:?}", entry.name);
            assert_eq!(drive.red_runs, 0, "{} {seed}: {drive:?}", entry.name);
            assert!(drive.over_limit_max < 1.05, "{} {seed}: {drive:?}", entry.name);
            assert!(drive.offset_m_max < 0.6, "{} {seed}: {drive:?}", entry.name);
        }
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
