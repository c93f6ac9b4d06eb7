//! Drives of the whole system on hand-made roads.

use std::sync::Arc;

use crate::status::Reason;
use crate::testing::{Rig, object, straight, two_lanes, winding};
use avastra_base::geometry::{Pose, Vec2};
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::Scene;

use super::Reactive;

const TARGET_Y_M: f64 = -1.75;

fn rig(scene: &Arc<Scene>, speed_mps: f64) -> Rig {
    Rig::new(scene, Box::new(Reactive::new(scene)), speed_mps)
}

#[test]
fn it_follows_its_lane_through_bends() {
    let mut rig = rig(&winding(), 6.0);
    rig.run(40.0);
    assert!(rig.station_m() > 310.0, "{}", rig.station_m());
    assert!(rig.offset_m_max < 0.6, "{}", rig.offset_m_max);
}

#[test]
fn it_stops_behind_what_stands_and_follows_what_drives() {
    let mut rig = rig(&straight(), 10.0);
    rig.sensed.objects.push(object(1, Body::Sedan, Pose::new(90.0, -1.75, 0.0), 0.0));
    rig.run(25.0);
    assert_eq!(rig.sensed.ego.speed_mps, 0.0);
    assert!((1.5..4.0).contains(&rig.gap_m_min), "{}", rig.gap_m_min);
    rig.sensed.objects[0].velocity_mps = Vec2::new(6.0, 0.0);
    rig.run(20.0);
    assert!((rig.sensed.ego.speed_mps - 6.0).abs() < 0.3, "{}", rig.sensed.ego.speed_mps);
    assert_eq!(rig.ads.status().reason, Reason::Follow(1));
}

#[test]
fn it_brakes_hard_for_a_step_into_its_corridor_and_not_for_a_pedestrian_beside() {
    let mut rig = rig(&straight(), 10.0);
    let walker = |y_m: f64| Pose::new(40.0, y_m, core::f64::consts::FRAC_PI_2);
    rig.sensed.objects.push(object(1, Body::Pedestrian, walker(-7.4), 1.4));
    let mut hardest_pct = 0.0_f64;
    for _ in 0..500 {
        hardest_pct = hardest_pct.max(rig.tick().brake_pct);
    }
    assert!(hardest_pct > 60.0 && rig.gap_m_min > 0.0, "{hardest_pct} {}", rig.gap_m_min);

    let mut rig = self::rig(&straight(), 10.0);
    rig.sensed.objects.push(object(1, Body::Pedestrian, walker(-4.5), 0.0));
    rig.run(5.0);
    assert!(rig.station_m() > 45.0, "{}", rig.station_m());
}

#[test]
fn it_changes_lanes_with_the_route_once_the_lane_is_free() {
    let mut rig = rig(&two_lanes(100.0), 8.0);
    rig.sensed.objects = (0..14)
        .map(|i| object(i + 1, Body::Sedan, Pose::new(f64::from(i) * 8.0, TARGET_Y_M, 0.0), 0.0))
        .collect();
    rig.run(30.0);
    assert!((rig.sensed.ego.rear_axle.position.y + 5.25).abs() < 0.1, "{:?}", rig.sensed.ego.rear_axle);
    assert_eq!(rig.ads.status().reason, Reason::LaneChange);
    for object in &mut rig.sensed.objects {
        object.velocity_mps = Vec2::new(9.0, 0.0);
    }
    rig.run(40.0);
    let place = rig.sensed.ego.rear_axle.position;
    assert!((place.y - TARGET_Y_M).abs() < 0.1 && place.x > 150.0, "{place:?}");
    assert!(rig.gap_m_min > 1.0, "{}", rig.gap_m_min);
}
