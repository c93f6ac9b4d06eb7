//! At a junction a careful driver gives way to road users that have priority, and to others once they visibly take it.

use avastra_lang::model::vocabulary::Priority;
use avastra_road::{Conflict, LaneIndex, LanePlace, RoadMap};
use avastra_world::sim::{Scene, Sensed, SensedObject, VehicleParameters, right_of_way};

/// A vehicle that would have to brake harder than this to stop before the ego vehicle's way will not give way,
/// m/s²: harder than most drivers brake for another (UN R79 calls it critical).
const GIVES_WAY_MPS2: f64 = 3.0;
/// Farther away than this a vehicle is in no lane, m.
const BESIDE_M: f64 = 1.0;
/// How far ahead conflicts are looked at, m.
const AHEAD_M: f64 = 80.0;

/// Whether the ego vehicle, with its front at `front_m`, may go before a road user that would cross its way: it
/// has priority wherever the lane of the other meets the route, the other has no siren, and it can still stop gently.
pub fn goes_before(scene: &Scene, sensed: &Sensed, object: &SensedObject, front_m: f64) -> bool {
    if !object.body.is_vehicle() || object.has_siren {
        return false;
    }
    let (map, route) = (&scene.map, &scene.route);
    let Some(place) = map.nearest(object.pose.position, object.pose.heading_rad, BESIDE_M) else {
        return false;
    };
    let near = route.conflicts.iter().filter(|at| (front_m..front_m + AHEAD_M).contains(&at.station_m));
    let mut meets = near.filter_map(|at| Some((at, gap_m(map, &place, at, object)?))).peekable();
    let speed_mps = object.velocity_mps.norm();
    let colour = |signal: usize| sensed.signals[signal];
    meets.peek().is_some()
        && meets.all(|(at, gap_m)| {
            let own: LaneIndex = route.lane_at(at.station_m).lane;
            right_of_way(map, colour, own, at.lane) == Priority::Ego
                && speed_mps * speed_mps <= 2.0 * GIVES_WAY_MPS2 * gap_m
        })
}

/// From the front of a road user to the ego vehicle's way at a conflict, m, if its lane leads there.
fn gap_m(map: &RoadMap, place: &LanePlace, at: &Conflict, object: &SensedObject) -> Option<f64> {
    let room_m = (object.length_m + VehicleParameters::MKZ.width_m) / 2.0;
    let mut way_m = at.lane_station_m - room_m;
    for lane in map.approach(at.lane) {
        if lane == place.lane {
            return Some(way_m - place.station_m);
        }
        // The lane before ends where this one begins.
        let before = *map.lane(lane).predecessors.first()?;
        way_m += map.lane(before).centre.length_m();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{object, sensed};
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;
    use avastra_world::sim::{SignalColour, testing};
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn it_waits_for_those_with_priority_and_for_those_that_take_it() {
        let goes = |signals: [&str; 2], to_middle_m: f64, speed_mps: f64| {
            let scene = testing::crossing_of(signals[0], signals[1]);
            // To the north through x = 300, where the way of the ego vehicle is at y = -1.75.
            let pose = Pose::new(300.0, -1.75 - to_middle_m, FRAC_PI_2);
            let other = object(1, Body::Sedan, pose, speed_mps);
            let signals = vec![SignalColour::Green; scene.map.signals.len()];
            let sensed = Sensed { signals, ..sensed(Pose::new(260.0, -1.75, 0.0), 10.0, vec![other]) };
            goes_before(&scene, &sensed, &other, 164.0)
        };
        let (none, yields, priority) = ("274", "205", "306");
        assert!(!goes([none, none], 40.0, 10.0), "it comes from the right");
        assert!(goes([priority, yields], 40.0, 10.0) && goes([none, yields], 40.0, 10.0));
        assert!(!goes([priority, yields], 15.0, 10.0), "it can no longer stop gently");
        assert!(goes([priority, yields], 15.0, 5.0));
    }
}
