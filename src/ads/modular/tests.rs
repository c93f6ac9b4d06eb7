//! Closed loop on hand-made roads: the parts together.

use crate::ads::testing::Rig;
use crate::ads::testing::object;
use crate::ads::testing::straight;
use crate::ads::testing::winding;
use crate::geometry::Pose;
use crate::model::vocabulary::Body;
use crate::sim::SignalColour;

use super::Modular;
use super::ModularConfig;

fn rig(scene: &std::sync::Arc<crate::sim::Scene>, seed: u64) -> Rig {
    Rig::new(scene, Box::new(Modular::new(scene, &ModularConfig::default(), seed)), 0.0)
}

#[test]
fn it_keeps_its_lane_round_bends() {
    let scene = winding();
    for seed in 0..3 {
        let mut rig = rig(&scene, seed);
        let mut ticks = 0;
        while rig.station_m() < scene.route.goal_m {
            rig.tick();
            ticks += 1;
            assert!(ticks < 50 * 60, "it arrives within a minute");
        }
        assert!(rig.offset_m_max < 0.6, "{}", rig.offset_m_max);
    }
}

#[test]
fn it_stops_at_red_and_goes_on_at_green() {
    let scene = straight();
    let mut rig = rig(&scene, 1);
    rig.sensed.signals[0] = SignalColour::Red;
    rig.run(30.0);
    let front_m = rig.station_m() + 3.705;
    assert!(rig.sensed.ego.speed_mps < 0.01 && (97.0..100.0).contains(&front_m), "{front_m}");
    assert_eq!(rig.ads.status().reason.to_string(), "red light");
    rig.sensed.signals[0] = SignalColour::Green;
    rig.run(10.0);
    assert!(rig.sensed.ego.speed_mps > 9.0);
}

#[test]
fn it_stops_behind_what_stands() {
    let scene = straight();
    for (body, seed) in [(Body::Sedan, 1), (Body::BoxTruck, 2), (Body::SchoolBus, 3)] {
        let mut rig = rig(&scene, seed);
        rig.sensed.objects.push(object(1, body, Pose::new(150.0, -1.75, 0.0), 0.0));
        rig.run(40.0);
        assert!(rig.sensed.ego.speed_mps < 0.01);
        assert!((2.0..9.0).contains(&rig.gap_m_min), "{}", rig.gap_m_min);
    }
}

#[test]
fn it_gives_way_to_a_pedestrian_and_goes_on() {
    let scene = straight();
    for seed in 0..10 {
        let mut rig = rig(&scene, seed);
        rig.run(10.0);
        let ahead_m = rig.station_m() + 3.7 + 40.0;
        let heading_rad = core::f64::consts::FRAC_PI_2;
        rig.sensed.objects.push(object(1, Body::Pedestrian, Pose::new(ahead_m, -5.75, heading_rad), 1.2));
        let mut slowest_mps = f64::INFINITY;
        for _ in 0..700 {
            rig.tick();
            slowest_mps = rig.sensed.ego.speed_mps.min(slowest_mps);
        }
        assert!(rig.gap_m_min > 1.0, "{}", rig.gap_m_min);
        assert!(rig.sensed.ego.speed_mps > 8.0, "it goes on");
    }
}

/// Smallest gap to a car that crosses from the right, timed to meet the ego vehicle, m.
fn gap_to_a_crosser(brief_overlap_s: f64, seed: u64) -> f64 {
    let scene = straight();
    let mut config = ModularConfig::default();
    config.planning.brief_overlap_s = brief_overlap_s;
    let mut rig = Rig::new(&scene, Box::new(Modular::new(&scene, &config, seed)), 0.0);
    rig.run(10.0);
    let (meeting_m, speed_mps) = (rig.station_m() + 60.0, 10.0);
    let arrival_s = 60.0 / rig.sensed.ego.speed_mps;
    let from = Pose::new(meeting_m, -1.75 - speed_mps * arrival_s, core::f64::consts::FRAC_PI_2);
    rig.sensed.objects.push(object(1, Body::Sedan, from, speed_mps));
    rig.run(12.0);
    rig.gap_m_min
}

#[test]
fn a_brief_overlap_is_not_given_way_to_unless_that_is_switched_off() {
    for seed in 0..5 {
        assert!(gap_to_a_crosser(0.0, seed) > 1.0);
        assert!(gap_to_a_crosser(2.0, seed) < 1.0);
    }
}
