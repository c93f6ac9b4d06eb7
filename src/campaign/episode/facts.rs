//! The kind of a collision, as far as it is known when it happens.
//!
//! Sudden appearance is judged as in the published package. Its authors sorted out side and rear hits by hand. Here contact
//! point and motion decide them, unless the ego vehicle had to give way (`sim::right_of_way`). An ego vehicle that turns
//! across oncoming traffic is hit in the flank, but it is not the vehicle that was run into. The package's
//! "overlapping" cannot occur, because no obstacle appears within another's outline. Its "repeated" does not occur
//! either, because an obstacle that was touched once touches nothing again; the word stays for worlds in which it
//! can. Not taken over: that a second pedestrian of an episode never counts.

use avastra_base::geometry::Vec2;
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::OutcomeFacts;
use avastra_lang::model::vocabulary::Priority;
use avastra_world::sim::{Contact, VehicleParameters};

use super::log::Collision;

/// A collision this soon after the obstacle appeared is sudden, s (published package).
const SUDDEN_S: f64 = 0.75;
/// An obstacle that moves towards the ego vehicle's side faster than this ran into it, m/s: the ego vehicle
/// itself does not move sideways.
const SIDEWAYS_MPS: f64 = 0.1;

/// The facts about a collision; `before` are the earlier ones of the episode.
pub fn collision_facts(collision: &Collision, before: &[Collision]) -> OutcomeFacts {
    let ruling = &collision.contact.ruling;
    OutcomeFacts {
        collision: true,
        repeated: before.iter().any(|other| other.contact.obstacle == collision.contact.obstacle),
        // No excuse covers an ego vehicle that was not allowed to be there.
        sudden: !ruling.is_ego_wrong() && collision.contact.time_s - collision.spawned_s <= SUDDEN_S,
        struck: !ruling.is_ego_wrong() && struck(&collision.contact, &VehicleParameters::MKZ),
        priority: ruling.priority,
        // The body that was hit was nearest, and contact is certainty.
        hit: Some(collision.body),
        near: Some(collision.body),
        proc: 1.0,
        ..OutcomeFacts::default()
    }
}

/// A contact this near to two faces is at the corner between them, m. A first contact is known far more
/// exactly.
const CORNER_M: f64 = 1e-3;

/// Whether the obstacle ran into the ego vehicle rather than the other way round, whoever had to give way.
///
/// A standing obstacle runs into nothing, so this is false for it. Otherwise it is true in each of these cases. The ego
/// vehicle stood. It was hit at the rear. It was hit at the side behind its front axle, or before that axle by an obstacle
/// moving towards that side. It was hit at a front corner by an obstacle that moved sideways onto it faster than it drove.
pub fn struck(contact: &Contact, ego: &VehicleParameters) -> bool {
    if contact.obstacle_velocity_mps.norm() < STANDING_MPS {
        return false;
    }
    // The published package takes 1 m/s, at which a car creeps into a person.
    if contact.ego_speed_mps < STANDING_MPS {
        return true;
    }
    match outline_side(contact.on_ego, ego) {
        OutlineSide::Front => false,
        OutlineSide::Rear => true,
        OutlineSide::FrontCorner { leftward } => towards_mps(contact, leftward) > contact.ego_speed_mps,
        OutlineSide::Side { leftward } => {
            let front_axle_m = ego.wheelbase_m + ego.rear_axle_to_back_m - ego.length_m / 2.0;
            contact.on_ego.x < front_axle_m || towards_mps(contact, leftward) > SIDEWAYS_MPS
        }
    }
}

/// Whether another vehicle came from behind and ran into the rear of an ego vehicle that had priority.
pub fn run_into_from_behind(contact: &Contact, ego: &VehicleParameters) -> bool {
    let other = contact.obstacle_velocity_on_ego_mps;
    contact.ruling.priority == Priority::Ego
        && matches!(outline_side(contact.on_ego, ego), OutlineSide::Rear)
        && other.x > contact.ego_speed_mps
        && other.x > other.y.abs()
}

/// Whether the ego vehicle is at fault in a contact: it had to give way, or where neither had, it ran into the
/// obstacle.
pub fn at_fault(contact: &Contact) -> bool {
    match contact.ruling.priority {
        Priority::Other => true,
        Priority::Ego => false,
        Priority::None => !struck(contact, &VehicleParameters::MKZ),
    }
}

/// Speed of the obstacle towards a side of the ego vehicle, m/s; `leftward` as in [`OutlineSide`].
fn towards_mps(contact: &Contact, leftward: f64) -> f64 {
    -leftward * contact.obstacle_velocity_on_ego_mps.y
}

/// The side of the ego vehicle that a point belongs to, in words.
pub fn side(on_ego: Vec2, ego: &VehicleParameters) -> &'static str {
    match outline_side(on_ego, ego) {
        OutlineSide::Front => "front",
        OutlineSide::FrontCorner { leftward } if leftward > 0.0 => "front left",
        OutlineSide::FrontCorner { .. } => "front right",
        OutlineSide::Rear => "rear",
        OutlineSide::Side { leftward } if leftward > 0.0 => "left",
        OutlineSide::Side { .. } => "right",
    }
}

/// `leftward` is 1 on the left and -1 on the right.
enum OutlineSide {
    Front,
    FrontCorner { leftward: f64 },
    Rear,
    Side { leftward: f64 },
}

/// The side of the ego vehicle's outline that a point lies nearest to. `point` is in the frame of
/// the outline's centre: x ahead, y left, m.
fn outline_side(point: Vec2, ego: &VehicleParameters) -> OutlineSide {
    let to_end_m = ego.length_m / 2.0 - point.x.abs();
    let to_side_m = ego.width_m / 2.0 - point.y.abs();
    let leftward = if point.y >= 0.0 { 1.0 } else { -1.0 };
    if point.x >= 0.0 && (to_end_m - to_side_m).abs() < CORNER_M && to_end_m.abs() < CORNER_M {
        OutlineSide::FrontCorner { leftward }
    } else if to_end_m > to_side_m {
        OutlineSide::Side { leftward }
    } else if point.x >= 0.0 {
        OutlineSide::Front
    } else {
        OutlineSide::Rear
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::{PreCrash, Shape};
    use avastra_lang::model::BodyWord;
    use avastra_lang::model::vocabulary::{Body, Priority, Verb};
    use avastra_world::sim::Ruling;

    fn collision(x_m: f64, y_m: f64, ego_speed_mps: f64, (ahead_mps, left_mps): (f64, f64)) -> Collision {
        let contact = Contact {
            time_s: 10.0,
            obstacle: 1,
            point: Vec2::zeros(),
            on_ego: Vec2::new(x_m, y_m),
            ego_speed_mps,
            obstacle_velocity_mps: Vec2::new(ahead_mps, left_mps),
            obstacle_velocity_on_ego_mps: Vec2::new(ahead_mps, left_mps),
            closing_speed_mps: 1.0,
            ruling: Ruling::default(),
        };
        Collision {
            shape: Shape::Straight,
            kind: PreCrash::Other,
            contact,
            step: 0,
            body: BodyWord::engine(Body::Sedan),
            mass_t: 1.55,
            verb: Verb::DriveAhead,
            spawned_s: 5.0,
        }
    }

    #[test]
    fn the_vehicle_that_struck_the_other_is_found() {
        let mkz = VehicleParameters::MKZ;
        let cases = [
            ("front", collision(2.35, 0.3, 8.0, (3.0, 0.0)), false),
            ("standing", collision(2.35, 0.3, 0.0, (-3.0, 0.0)), true),
            ("creeping", collision(2.35, 0.3, 0.5, (-3.0, 0.0)), false),
            ("both standing", collision(2.35, 0.3, 0.0, (0.0, 0.05)), false),
            ("rear", collision(-2.35, 0.0, 8.0, (12.0, 0.0)), true),
            ("flank", collision(0.0, 1.03, 8.0, (8.0, -0.5)), true),
            ("flank, swung into a standing vehicle", collision(0.0, 1.03, 8.0, (0.0, 0.0)), false),
            ("front corner, turning into a standing vehicle", collision(2.0, 1.03, 8.0, (0.0, 0.0)), false),
            ("front corner, hit from the left", collision(2.0, 1.03, 8.0, (0.0, -1.5)), true),
            ("front corner, hit from the right", collision(2.0, -1.03, 8.0, (0.0, 1.5)), true),
            (
                "front corner, a vehicle on the right moving away",
                collision(2.0, -1.03, 8.0, (0.0, -1.5)),
                false,
            ),
            ("the corner itself, front by a hair", collision(2.35002, 1.03, 8.0, (0.0, -1.5)), false),
            ("the corner itself, side by a hair", collision(2.35, 1.03002, 8.0, (0.0, -1.5)), false),
            (
                "the corner itself, by a vehicle faster than the ego vehicle",
                collision(2.35, 1.03, 4.0, (0.0, -9.0)),
                true,
            ),
        ];
        for (name, collision, expected) in cases {
            assert_eq!(struck(&collision.contact, &mkz), expected, "{name}");
        }
    }

    #[test]
    fn an_ego_vehicle_that_had_to_give_way_was_not_run_into() {
        let flank = collision(0.0, 1.03, 8.0, (8.0, -0.5));
        for (priority, expected) in [(Priority::None, true), (Priority::Ego, true), (Priority::Other, false)]
        {
            let contact = Contact { ruling: Ruling { priority, ..Ruling::default() }, ..flank.contact };
            let found = collision_facts(&Collision { contact, ..flank }, &[]);
            assert_eq!(found.struck, expected, "{priority:?}");
        }
    }

    #[test]
    fn one_that_comes_from_behind_is_faster_and_meets_the_rear() {
        let mkz = VehicleParameters::MKZ;
        let is_so = |x_m: f64, velocity_mps: (f64, f64), priority: Priority| {
            let ruling = Ruling { priority, ..Ruling::default() };
            let contact = Contact { ruling, ..collision(x_m, 0.0, 8.0, velocity_mps).contact };
            run_into_from_behind(&contact, &mkz)
        };
        assert!(is_so(-2.35, (12.0, 0.0), Priority::Ego));
        assert!(!is_so(-2.35, (12.0, 0.0), Priority::Other), "the ego vehicle cut in");
        assert!(!is_so(-2.35, (5.0, 0.0), Priority::Ego), "it is slower");
        assert!(!is_so(-2.35, (9.0, -11.0), Priority::Ego), "it crosses");
        assert!(!is_so(2.35, (12.0, 0.0), Priority::Ego), "it meets the front");
    }
}
