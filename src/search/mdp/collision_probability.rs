//! Collision probability (ProC): how near the ego vehicle is to a crash, in `[0, 1]`.
//!
//! Paper, "Collision Probability Measurement", Eqs. 9–16, with repairs. Distances are between outlines, so
//! that ProC reaches 1 at contact. Decelerations are magnitudes. A safety distance is never below the least
//! gap. Oncoming traffic adds its own braking distance. ProC is a ratio of distances, not the probability of
//! anything; the name is the paper's.

use avastra_base::geometry::wrap_angle;
use avastra_base::kinematics::braking_m;
use avastra_world::sim::{FRAME_TICKS, Obstacle, World};

use super::released_probability::{PERIOD_TICKS, released_probability};

/// Braking of every vehicle, magnitude, m/s². Paper: 6 (Berkeley algorithm).
const VEHICLE_DECEL_MPS2: f64 = 6.0;
/// Braking of a pedestrian, m/s². DeepCollision's code: 1.5.
const PEDESTRIAN_DECEL_MPS2: f64 = 1.5;
/// `R_min`: the least gap between vehicles in one lane, m. Paper: 5.
const GAP_M_MIN: f64 = 5.0;
/// Added to the lateral safety distance, m. Paper: 0, which makes it 0 beside parallel traffic, so that such traffic is
/// no danger; DeepCollision's and the published code: 5.
const LATERAL_MARGIN_M: f64 = 5.0;

/// The ways to compute ProC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ProcKind {
    /// Ours: the paper's equations, repaired, with a lateral margin.
    #[default]
    Avastra,
    /// The paper's equations, repaired only where they cannot be computed.
    Paper,
    /// The value that the published package computes: [`super::released_probability`].
    Released,
}

impl ProcKind {
    /// ProC of the ego vehicle at this moment, see `collision_probability`; `None` at ticks at which it is not computed. Ours is
    /// computed in each frame, 10 times a second, that of the package twice a second.
    pub fn danger(self, world: &World, is_hit: &dyn Fn(u32) -> bool) -> Option<Danger> {
        let every_ticks = if self == ProcKind::Released { PERIOD_TICKS } else { FRAME_TICKS };
        world.ticks().is_multiple_of(every_ticks).then(|| match self {
            ProcKind::Avastra => collision_probability(world, LATERAL_MARGIN_M, is_hit),
            ProcKind::Paper => collision_probability(world, 0.0, is_hit),
            ProcKind::Released => released_probability(world, is_hit),
        })
    }
}

/// ProC at a moment, and which road user contributes most to it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Danger {
    pub probability: f64,
    /// Its id; `None` if no road user is a danger.
    pub nearest: Option<u32>,
}

/// The greatest probability of each dimension so far.
#[derive(Default)]
pub(super) struct Most {
    longitudinal: f64,
    lateral: f64,
    greatest: f64,
    nearest: Option<u32>,
}

impl Most {
    pub fn add_longitudinal(&mut self, id: u32, probability: f64) {
        self.longitudinal = self.longitudinal.max(probability);
        self.note(id, probability);
    }

    pub fn add_lateral(&mut self, id: u32, probability: f64) {
        self.lateral = self.lateral.max(probability);
        self.note(id, probability);
    }

    fn note(&mut self, id: u32, probability: f64) {
        if probability > self.greatest {
            (self.greatest, self.nearest) = (probability, Some(id));
        }
    }

    pub fn danger(&self) -> Danger {
        Danger { probability: combined(self.longitudinal, self.lateral), nearest: self.nearest }
    }
}

/// Longitudinal safety distance `LoSD` (m), Eq. 9, of a follower behind a leader.
///
/// Speeds along the lane, at least 0. At least [`GAP_M_MIN`]: a faster leader needs no more room.
fn longitudinal_safety_distance_m(
    follower_mps: f64,
    follower_decel_mps2: f64,
    leader_mps: f64,
    leader_decel_mps2: f64,
) -> f64 {
    // The paper gives the deceleration as -6 m/s². Its magnitude is meant: with the sign, a faster
    // follower would need less room.
    let longer_m = braking_m(follower_mps, follower_decel_mps2) - braking_m(leader_mps, leader_decel_mps2);
    longer_m.max(0.0) + GAP_M_MIN
}

/// Safety distance (m) of two vehicles that drive towards each other: both must stop. Ours, after RSS;
/// the paper has no such case and would subtract the oncoming speed.
fn opposing_safety_distance_m(ego_mps: f64, other_mps: f64, other_decel_mps2: f64) -> f64 {
    braking_m(ego_mps, VEHICLE_DECEL_MPS2) + braking_m(other_mps, other_decel_mps2) + GAP_M_MIN
}

/// Lateral safety distance `LaSD` (m), Eq. 10: `(v sin β)² / (a sin β)`, which is `v² |sin β| / a`
/// and so 0 in parallel traffic, plus a margin.
fn lateral_safety_distance_m(ego_mps: f64, lane_angle_rad: f64, margin_m: f64) -> f64 {
    ego_mps * ego_mps * libm::sin(lane_angle_rad).abs() / VEHICLE_DECEL_MPS2 + margin_m
}

/// How much of a safety distance is used up (Eqs. 14 and 15), in `[0, 1]`; 0 where none is needed.
pub(super) fn probability(safety_distance_m: f64, current_distance_m: f64) -> f64 {
    if safety_distance_m <= 0.0 {
        return 0.0;
    }
    ((safety_distance_m - current_distance_m) / safety_distance_m).clamp(0.0, 1.0)
}

/// The probabilities of both dimensions as one, Eq. 16.
fn combined(longitudinal: f64, lateral: f64) -> f64 {
    let (most, least) = (longitudinal.max(lateral), longitudinal.min(lateral));
    most + (1.0 - most) * least
}

/// ProC of the ego vehicle with regard to all obstacles, at this moment.
///
/// An obstacle is in the ego vehicle's lane if its centre lies within half the width of the route's lane.
/// Then Eq. 9 applies, with the vehicle behind as the follower, or the opposing safety distance if the two
/// drive towards each other. Otherwise Eq. 10 applies; its angle β is between the headings of the ego
/// vehicle and of the obstacle's lane, or of the pedestrian. The greatest probability of each
/// dimension counts, and Eq. 16 joins the two. Obstacles that the ego vehicle has hit already (`is_hit`)
/// are left out.
fn collision_probability(world: &World, lateral_margin_m: f64, is_hit: &dyn Fn(u32) -> bool) -> Danger {
    let mut most = Most::default();
    for obstacle in world.obstacles_on_level() {
        if is_hit(obstacle.id) || beyond_reach(world, obstacle, lateral_margin_m) {
            continue;
        }
        let current_m = obstacle.distance_m;
        let position = obstacle.outline.pose.position;
        // Places of the route that are farther along it than this cannot be the nearest.
        let reach_m = 2.0 * (position - world.ego().rear_axle.position).norm() + world.ego_offset_m().abs();
        let beside = world.scene().route.path.project_near(position, world.ego_station_m(), reach_m);
        if beside.offset_m.abs() <= world.scene().half_width_m(beside.station_m) {
            let ahead = beside.station_m >= world.ego_station_m();
            let safety_m = same_lane_safety_m(world, obstacle, ahead);
            most.add_longitudinal(obstacle.id, probability(safety_m, current_m));
        } else {
            let angle_rad = wrap_angle(obstacle.lane_heading_rad - world.ego().rear_axle.heading_rad);
            let safety_m = lateral_safety_distance_m(world.ego().speed_mps, angle_rad, lateral_margin_m);
            most.add_lateral(obstacle.id, probability(safety_m, current_m));
        }
    }
    most.danger()
}

fn same_lane_safety_m(world: &World, obstacle: &Obstacle, ahead: bool) -> f64 {
    let ego = world.ego();
    let along_mps = obstacle.velocity_mps.dot(&ego.rear_axle.forward());
    let (ego_mps, other_decel_mps2) = (ego.speed_mps, decel_mps2(obstacle));
    if ahead && along_mps < 0.0 {
        opposing_safety_distance_m(ego_mps, -along_mps, other_decel_mps2)
    } else if ahead {
        longitudinal_safety_distance_m(ego_mps, VEHICLE_DECEL_MPS2, along_mps, other_decel_mps2)
    } else {
        longitudinal_safety_distance_m(along_mps.max(0.0), other_decel_mps2, ego_mps, VEHICLE_DECEL_MPS2)
    }
}

fn decel_mps2(obstacle: &Obstacle) -> f64 {
    if obstacle.body.is_vehicle() { VEHICLE_DECEL_MPS2 } else { PEDESTRIAN_DECEL_MPS2 }
}

/// Whether every safety distance that could apply is shorter than the gap: then ProC is 0, and the
/// costly projection is not needed.
fn beyond_reach(world: &World, obstacle: &Obstacle, lateral_margin_m: f64) -> bool {
    let speed_mps = world.ego().speed_mps;
    let other_m = obstacle.velocity_mps.norm_squared() / (2.0 * decel_mps2(obstacle));
    let longest_m = speed_mps * speed_mps / VEHICLE_DECEL_MPS2 + other_m + GAP_M_MIN.max(lateral_margin_m);
    obstacle.distance_m > longest_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn safety_distances_match_worked_figures() {
        // Paper's constants at the speeds of RSS's usual table: 9.33, 21.33 and 5 m.
        for (follower, leader, expected) in [(14.0, 12.0, 9.333), (14.0, 0.0, 21.333), (20.0, 20.0, 5.0)] {
            let safety_m = longitudinal_safety_distance_m(follower, 6.0, leader, 6.0);
            assert!((safety_m - expected).abs() < 1e-3, "{follower} behind {leader}: {safety_m}");
        }
        assert!((opposing_safety_distance_m(12.0, 6.0, 6.0) - 20.0).abs() < 1e-12);
        let right_angle = core::f64::consts::FRAC_PI_2;
        assert!((lateral_safety_distance_m(15.0, right_angle, 0.0) - 37.5).abs() < 1e-12);
        assert_eq!(lateral_safety_distance_m(15.0, 0.0, 0.0), 0.0);
    }

    #[test]
    fn contact_is_certain_and_a_needless_distance_is_safe() {
        assert_eq!(probability(12.0, 0.0), 1.0);
        assert_eq!(probability(12.0, 12.0), 0.0);
        assert_eq!(probability(0.0, 0.0), 0.0);
        assert_eq!(combined(1.0, 0.3), 1.0);
    }

    proptest! {
        #[test]
        fn proc_stays_in_bounds_and_falls_with_the_gap(
            safety_m in 0.1_f64..80.0, near_m in 0.0_f64..60.0, more_m in 0.0_f64..60.0, lateral in 0.0_f64..=1.0,
        ) {
            let (near, far) = (probability(safety_m, near_m), probability(safety_m, near_m + more_m));
            prop_assert!((0.0..=1.0).contains(&near) && far <= near);
            let both = combined(near, lateral);
            prop_assert!(both >= near.max(lateral) && both <= 1.0);
            prop_assert_eq!(both, combined(lateral, near));
        }

        #[test]
        fn a_faster_follower_needs_no_less_room(follower in 0.0_f64..30.0, more in 0.0_f64..10.0, leader in 0.0_f64..30.0) {
            let slow = longitudinal_safety_distance_m(follower, 6.0, leader, 6.0);
            let fast = longitudinal_safety_distance_m(follower + more, 6.0, leader, 6.0);
            prop_assert!(slow >= 5.0 && fast >= slow);
        }
    }
}
