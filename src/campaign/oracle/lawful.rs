//! How fast a careful driver would have been going: within the limit, within its sight, and so that it can stop for a
//! pedestrian who waits at a crosswalk or crosses on it.
//!
//! A driver that was faster is judged as accident analysts do: from the same place, at the speed that was allowed there
//! ("avoidable at the permitted speed").

use avastra_base::geometry::Projection;
use avastra_base::kinematics::{
    CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S, CAREFUL_JERK_MPS3, GRAVITY_MPS2, SPEEDING_MPS, STANDING_MPS,
};
use avastra_drivers::in_sight;
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::{Obstacle, Sensed, SignalColour, VehicleParameters, World};

/// A person no farther from a crosswalk waits to cross on it, m. Ours.
const WAITS_M: f64 = 1.5;
/// One that walks away from the ego vehicle's route, so far beside a vehicle in the middle of it, has crossed, m. Ours.
const CROSSED_M: f64 = 1.5;
/// Braking of a comfortable stop, before a crosswalk at which a person waits or before a line, m/s². Ours.
pub const COMFORTABLE_MPS2: f64 = 3.0;
/// From the moment when something comes into sight until full braking, s: perception, reaction, and half of the time in which braking
/// builds up. For the other half the driver counts as braking fully.
const DELAY_S: f64 = CAREFUL_DELAY_S + CAREFUL_BRAKING_MPS2 / CAREFUL_JERK_MPS3 / 2.0;
/// A careful driver that sees no farther than this keeps a car's width of it in hand, m. Ours.
const SPARE_M: f64 = 2.0;

/// The people at crosswalks whom a careful driver has seen. It keeps them in mind where something hides them later.
#[derive(Debug, Clone, Default)]
pub struct Minded {
    /// By number, as `SensedObject::id`.
    seen: Vec<u32>,
}

impl Minded {
    /// Notes who is in sight at the next crosswalk, and has not crossed.
    pub fn notice(&mut self, world: &World, sensed: &Sensed) {
        if world.scene().route.crosswalks_m.is_empty() {
            return;
        }
        for object in sensed.objects.iter().filter(|object| object.body == Body::Pedestrian) {
            let is_new = !self.seen.contains(&object.id) && in_sight(object, &sensed.conditions);
            if is_new && world.obstacle(object.id).is_some_and(|found| crosses(world, found)) {
                self.seen.push(object.id);
            }
        }
    }

    /// Whether one of them is still at the next crosswalk, and has not crossed.
    fn holds(&self, world: &World) -> bool {
        let mut people = self.seen.iter().filter_map(|id| world.obstacle(*id));
        people.any(|person| crosses(world, person))
    }
}

/// The speed at which a careful driver goes here, m/s.
pub fn careful_mps(world: &World, minded: &Minded) -> f64 {
    let scene = world.scene();
    let limit_mps = scene.map.lane(scene.route.lane_at(world.ego_station_m()).lane).speed_limit_mps;
    let conditions = world.conditions();
    let braking_mps2 = CAREFUL_BRAKING_MPS2.min(conditions.friction * GRAVITY_MPS2);
    let sight_mps = stops_within_mps(conditions.visibility_m - SPARE_M, DELAY_S, braking_mps2);
    limit_mps.min(sight_mps).min(crosswalk_mps(world, minded))
}

/// The speed that the ego vehicle has, unless it is faster than a careful driver would be.
pub fn lawful_mps(world: &World, minded: &Minded) -> f64 {
    let (own_mps, careful_mps) = (world.ego().speed_mps, careful_mps(world, minded));
    if own_mps > careful_mps + SPEEDING_MPS { careful_mps } else { own_mps }
}

/// The speed from which a driver can stop for the pedestrians that it has seen at the next crosswalk and that have not
/// crossed, m/s; infinite without any.
fn crosswalk_mps(world: &World, minded: &Minded) -> f64 {
    let front_m = VehicleParameters::MKZ.front_m(world.ego_station_m());
    let Some((begin_m, _)) = next_crosswalk(world) else { return f64::INFINITY };
    match minded.holds(world) {
        true => {
            let braking_mps2 = COMFORTABLE_MPS2.min(world.conditions().friction * GRAVITY_MPS2);
            stops_within_mps(begin_m - front_m, DELAY_S, braking_mps2)
        }
        false => f64::INFINITY,
    }
}

/// Whether a pedestrian stands on the next crosswalk of the route, or within [`WAITS_M`] of it.
pub fn waits_at_crosswalk(world: &World, obstacle: &Obstacle) -> bool {
    obstacle.velocity_mps.norm() < STANDING_MPS && at_crosswalk(world, obstacle).is_some()
}

/// Whether a pedestrian is at the next crosswalk, and does not walk away from the route beyond it.
fn crosses(world: &World, obstacle: &Obstacle) -> bool {
    at_crosswalk(world, obstacle).is_some_and(|place| {
        let left_mps = world.scene().route.path.pose_at(place.station_m).left().dot(&obstacle.velocity_mps);
        let beside_m = place.offset_m.abs() - world.ego_outline().half_width_m;
        beside_m < CROSSED_M || place.offset_m * left_mps <= 0.0
    })
}

/// Where a pedestrian is along the route, if it is on the next crosswalk or within [`WAITS_M`] of it.
fn at_crosswalk(world: &World, obstacle: &Obstacle) -> Option<Projection> {
    let (begin_m, end_m) = next_crosswalk(world)?;
    let position = obstacle.outline.pose.position;
    if obstacle.body != Body::Pedestrian || world.scene().crosswalk_gap_m(position) > WAITS_M {
        return None;
    }
    let place = world.scene().route.path.project_near(position, begin_m, 20.0);
    (begin_m - WAITS_M..end_m + WAITS_M).contains(&place.station_m).then_some(place)
}

/// The next crosswalk before the front, unless a light there is green for the ego vehicle.
fn next_crosswalk(world: &World) -> Option<(f64, f64)> {
    let front_m = VehicleParameters::MKZ.front_m(world.ego_station_m());
    let route = &world.scene().route;
    let next = route.crosswalks_m.iter().copied().find(|(begin_m, _)| *begin_m > front_m);
    next.filter(|(begin_m, _)| world.light_before(*begin_m) != Some(SignalColour::Green))
}

/// The speed from which a driver that begins to brake after some time stops within a distance, m/s.
pub fn stops_within_mps(room_m: f64, delay_s: f64, braking_mps2: f64) -> f64 {
    // v t + v² / 2a = room.
    let delay_mps = delay_s * braking_mps2;
    (delay_mps * delay_mps + 2.0 * braking_mps2 * room_m.max(0.0)).sqrt() - delay_mps
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::kinematics::stopping_m;

    #[test]
    fn a_driver_stops_within_the_distance_from_the_speed_that_it_gives() {
        for room_m in [0.0, 1.0, 26.4, 50.0, 300.0] {
            for braking_mps2 in [3.0, 7.6] {
                let mps = stops_within_mps(room_m, DELAY_S, braking_mps2);
                assert!((stopping_m(mps, DELAY_S, braking_mps2) - room_m).abs() < 1e-9);
            }
        }
    }
}
