//! Free space: whether a place is seen to be empty.
//!
//! A ray of the LiDAR ends at whatever stands in its way, also at what the detector makes no object of. A place
//! is seen empty if a ray passes over it. Left out: the rays' own range in fog, and what is lower or higher than
//! the rays; the places asked for are near by.

use avastra_base::geometry::{Frame, OrientedBox, Pose, Vec2};
use avastra_world::sim::{Sensed, VehicleParameters};

/// Cells of the grid in which rays are entered, m. Autoware's occupancy grid: 0.5.
const CELL_M: f64 = 0.5;

/// Whether a place is seen to be empty. It is given on the map, as seen from where the vehicle believes its rear
/// axle is.
pub fn sees_empty(place: Vec2, sensed: &Sensed, localized: &Pose) -> bool {
    let rear_axle = &sensed.ego.rear_axle;
    let eye = rear_axle.offset(VehicleParameters::MKZ.rear_axle_to_centre_m(), 0.0).position;
    let way = rear_axle.to_world(localized.to_local(place)) - eye;
    let distance_m = way.norm();
    if distance_m < CELL_M {
        return true;
    }
    // An object in a part of a cell takes all of it.
    let ends_at =
        |outline: OrientedBox| Frame::of(&outline).ray_hit_m(eye, way / distance_m, distance_m).is_some();
    !sensed.objects.iter().any(|object| {
        let near_m = distance_m + object.length_m + CELL_M;
        (object.pose.position - eye).norm_squared() < near_m * near_m
            && ends_at(OrientedBox::new(object.pose, object.length_m + CELL_M, object.width_m + CELL_M))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{object, sensed};
    use avastra_lang::model::vocabulary::Body;

    #[test]
    fn a_place_is_empty_if_nothing_stands_on_it_or_before_it() {
        let seen_empty = |bodies: &[(Body, f64)], localized: Pose, place: Vec2| {
            let objects = bodies.iter().map(|(body, x_m)| object(1, *body, Pose::new(*x_m, 0.0, 0.0), 0.0));
            let sensed = sensed(Pose::new(0.0, 0.0, 0.0), 0.0, objects.collect());
            sees_empty(place, &sensed, &localized)
        };
        let (right, place) = (Pose::new(0.0, 0.0, 0.0), Vec2::new(12.0, 0.0));
        assert!(seen_empty(&[], right, place));
        assert!(!seen_empty(&[(Body::Sedan, 12.0)], right, place), "it is there");
        assert!(!seen_empty(&[(Body::Pedestrian, 12.0)], right, place + Vec2::new(0.0, 0.2)));
        assert!(!seen_empty(&[(Body::BoxTruck, 7.0)], right, place), "it is hidden");
        assert!(seen_empty(&[(Body::Sedan, 20.0)], right, place), "it has driven on");
        // The vehicle believes itself 3 m too far to the left, and so everything else.
        let left = Pose::new(0.0, 3.0, 0.0);
        assert!(!seen_empty(&[(Body::Sedan, 12.0)], left, place + Vec2::new(0.0, 3.0)));
        assert!(seen_empty(&[(Body::Sedan, 12.0)], left, place));
    }
}
