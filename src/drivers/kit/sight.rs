//! A simple perception: what is in range and in sight, ten times a second, and a little late.
//! It is for driving systems that are about planning or control. Ranges and delays are those of `modular`. An object
//! that is seen is seen as it is: noise, missed frames, ghosts and wrong classes are left out; `modular` has them.

use avastra_world::sim::{Conditions, FRAME_S, Scene, Sensed, SensedObject};

/// How far pedestrians are seen by day, m. Ours, as in `scenarios/ads/default.yaml`.
const PEDESTRIAN_M: f64 = 60.0;
/// An object is not seen if less than this share of it is in sight. Ours, as in `scenarios/ads/default.yaml`.
const VISIBLE_FRACTION_MIN: f64 = 0.2;

/// The objects that a driver has seen.
#[derive(Debug, Clone, Default)]
pub struct Sight {
    /// How far vehicles are seen, m: as far as anything is sensed.
    vehicle_m: f64,
    /// Factor of the range for pedestrians in full darkness, in `[0, 1]`.
    night_factor: f64,
    /// The objects in sight at the last two looks, the newer last.
    looks: [Vec<SensedObject>; 2],
    known: Vec<SensedObject>,
}

impl Sight {
    /// Sensors whose range for pedestrians falls by a factor in full darkness: 1 for a LiDAR.
    pub fn new(scene: &Scene, night_factor: f64) -> Sight {
        Sight { vehicle_m: scene.range_m, night_factor, ..Sight::default() }
    }

    /// Looks once; to be called every frame. The driver then knows the look of the frame before (0.1 s),
    /// carried on at constant velocity. An object is known after two looks in a row, as trackers confirm what
    /// they see.
    pub fn look(&mut self, sensed: &Sensed) {
        let [older, newer] = &mut self.looks;
        let confirmed = |object: &&SensedObject| older.iter().any(|before| before.id == object.id);
        self.known.clear();
        self.known.extend(newer.iter().filter(confirmed).map(|object| {
            let mut object = *object;
            object.pose.position += object.velocity_mps * FRAME_S;
            object
        }));
        core::mem::swap(older, newer);
        newer.clear();
        let in_sight = |object: &&SensedObject| {
            object.visible_fraction >= VISIBLE_FRACTION_MIN
                && object.distance_m <= range_m(object, &sensed.conditions, self.vehicle_m, self.night_factor)
        };
        newer.extend(sensed.objects.iter().filter(in_sight));
    }

    /// The objects that the driver knows, each as it should be now. Its distance is that of the look.
    pub fn known(&self) -> &[SensedObject] {
        &self.known
    }
}

/// How far an object of its kind is seen, m: no farther than the fog allows.
fn range_m(object: &SensedObject, conditions: &Conditions, vehicle_m: f64, night_factor: f64) -> f64 {
    let dark_share = night_factor + (1.0 - night_factor) * conditions.light;
    let clear_m = match object.body.is_vehicle() {
        true if object.is_unlit => vehicle_m * dark_share,
        true => vehicle_m,
        false => PEDESTRIAN_M * dark_share,
    };
    clear_m.min(conditions.visibility_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CLEAR_DAY, object, sensed, straight};
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;

    /// The numbers of the looks, from 1, after which the object is known.
    fn known_after(seen: SensedObject, conditions: Conditions, night_factor: f64) -> Vec<usize> {
        let sensed = Sensed { conditions, ..sensed(Pose::new(0.0, 0.0, 0.0), 10.0, vec![seen]) };
        let mut sight = Sight::new(&straight(), night_factor);
        let look = |_: &usize| {
            sight.look(&sensed);
            !sight.known().is_empty()
        };
        (1..=4).filter(look).collect()
    }

    #[test]
    fn what_is_in_range_and_in_sight_is_known_after_two_looks_and_a_delay() {
        let car = SensedObject { distance_m: 90.0, ..object(1, Body::Sedan, Pose::new(90.0, 0.0, 0.0), 0.0) };
        let walker = SensedObject { distance_m: 40.0, body: Body::Pedestrian, ..car };
        assert_eq!(known_after(car, CLEAR_DAY, 1.0), [3, 4]);
        let hidden = SensedObject { visible_fraction: 0.1, ..car };
        assert!(known_after(hidden, CLEAR_DAY, 1.0).is_empty());
        assert!(known_after(car, Conditions { visibility_m: 50.0, ..CLEAR_DAY }, 1.0).is_empty());
        let night = Conditions { light: 0.15, ..CLEAR_DAY };
        assert_eq!(known_after(walker, night, 1.0), [3, 4]);
        assert!(known_after(walker, night, 0.4).is_empty());
    }
}
