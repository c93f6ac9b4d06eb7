//! Drives of the whole system on hand-made roads.

use std::sync::Arc;

use crate::status::{Manoeuvre, Reason};
use crate::testing::{Rig, object, straight, two_lanes};
use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::Scene;

use super::Frenet;

const TARGET_Y_M: f64 = -1.75;

fn rig(scene: &Arc<Scene>, speed_mps: f64) -> Rig {
    Rig::new(scene, Box::new(Frenet::new(scene)), speed_mps)
}

#[test]
fn it_keeps_its_lane_at_the_limit() {
    let mut rig = rig(&straight(), 6.0);
    rig.run(20.0);
    assert!((rig.sensed.ego.speed_mps - 11.18).abs() < 0.1, "{}", rig.sensed.ego.speed_mps);
    assert!(rig.offset_m_max < 0.05, "{}", rig.offset_m_max);
    assert_eq!(rig.ads.status().reason, Reason::Cruise);
}

#[test]
fn it_stops_behind_what_stands_and_follows_what_drives() {
    let mut rig = rig(&straight(), 10.0);
    rig.sensed.objects.push(object(1, Body::Sedan, Pose::new(90.0, -1.75, 0.0), 0.0));
    rig.run(30.0);
    assert_eq!(rig.sensed.ego.speed_mps, 0.0);
    assert!((0.5..3.0).contains(&rig.gap_m_min), "{}", rig.gap_m_min);
    assert_eq!(rig.ads.status().reason, Reason::Stop(1));
    rig.sensed.objects[0].velocity_mps = Vec2::new(6.0, 0.0);
    rig.run(15.0);
    assert!((rig.sensed.ego.speed_mps - 6.0).abs() < 0.3, "{}", rig.sensed.ego.speed_mps);
}

#[test]
fn it_leaves_room_to_what_stands_at_the_edge_of_its_lane() {
    let mut rig = rig(&straight(), 8.0);
    // 1.4 m beside the middle of the lane: the vehicle itself takes 1.03 m.
    rig.sensed.objects.push(object(1, Body::Pedestrian, Pose::new(80.0, -3.2, 0.0), 0.0));
    rig.run(20.0);
    assert!(rig.station_m() > 100.0 && rig.gap_m_min > 0.25, "{} {}", rig.station_m(), rig.gap_m_min);
}

#[test]
fn it_lets_a_pedestrian_cross() {
    let mut rig = rig(&straight(), 8.0);
    let walker = Pose::new(45.0, -9.0, core::f64::consts::FRAC_PI_2);
    rig.sensed.objects.push(object(1, Body::Pedestrian, walker, 1.4));
    rig.run(25.0);
    assert!(rig.gap_m_min > 0.5 && rig.station_m() > 100.0, "{} {}", rig.gap_m_min, rig.station_m());
}

#[test]
fn it_changes_lanes_with_the_route() {
    let mut rig = rig(&two_lanes(200.0), 8.0);
    let mut changed_ticks = 0;
    for _ in 0..1300 {
        rig.tick();
        changed_ticks += u32::from(rig.ads.status().manoeuvre == Manoeuvre::LaneChange);
    }
    assert!((100..500).contains(&changed_ticks), "{changed_ticks}");
    assert!((rig.sensed.ego.rear_axle.position.y - TARGET_Y_M).abs() < 0.1, "{:?}", rig.sensed.ego.rear_axle);
}

#[test]
fn it_awaits_a_gap() {
    let mut rig = rig(&two_lanes(100.0), 8.0);
    rig.sensed.objects = (0..14)
        .map(|i| object(i + 1, Body::Sedan, Pose::new(f64::from(i) * 8.0, TARGET_Y_M, 0.0), 0.0))
        .collect();
    rig.run(30.0);
    assert!((rig.sensed.ego.rear_axle.position.y + 5.25).abs() < 0.3, "{:?}", rig.sensed.ego.rear_axle);
    assert_eq!(rig.ads.status().manoeuvre, Manoeuvre::AwaitGap);
    for object in &mut rig.sensed.objects {
        object.velocity_mps = Vec2::new(9.0, 0.0);
    }
    rig.run(40.0);
    let place = rig.sensed.ego.rear_axle.position;
    assert!((place.y - TARGET_Y_M).abs() < 0.1 && place.x > 150.0, "{place:?}");
    assert!(rig.gap_m_min > 0.5, "{}", rig.gap_m_min);
}
