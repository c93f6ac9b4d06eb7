//! The kind of a collision, as people who know crashes call it: the pre-crash types of NHTSA (Najm, Smith and Yanagisawa 2007,
//! "Pre-Crash Scenario Typology for Crash Avoidance Research", DOT HS 810 767).
//!
//! The typology has 37 types, in an order in which the first that fits applies. It is about what both parties did before it
//! became critical; here that is the last 5 s. These of the 37 cannot happen in this world, and are left out: 1 (vehicle
//! failure), 2 and 3 (control loss), 6 to 8 (road edge departure), 9 and 10 (animals), 15 and 17 (backing, parking), 32 and 33
//! (evasive action alone), 34 (no collision), 35 and 36 (objects). How angles and speeds tell the others apart is ours, and a
//! vehicle that had crashed before is a kind of its own.

use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::Body;

use super::shape::Shape;

/// Two who head less apart than this drive in the same direction, rad (45°); more than 180° less this: in opposite ones.
const ALIKE_RAD: f64 = core::f64::consts::FRAC_PI_4;
/// A lead vehicle whose speed changes by less than this over the time that is looked at has a constant one, m/s.
const CONSTANT_MPS: f64 = 1.0;

/// A pre-crash type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PreCrash {
    RunningRedLight,
    RunningStopSign,
    PedestrianWithManoeuvre,
    PedestrianWithoutManoeuvre,
    CyclistWithManoeuvre,
    CyclistWithoutManoeuvre,
    TurningSameDirection,
    ChangingLanesSameDirection,
    DriftingSameDirection,
    ManoeuvreOppositeDirection,
    NoManoeuvreOppositeDirection,
    FollowingVehicleManoeuvre,
    LeadAccelerating,
    LeadSlower,
    LeadDecelerating,
    LeadStopped,
    LeftTurnAcrossPathSignalized,
    RightTurnSignalized,
    LeftTurnAcrossPath,
    StraightCrossingPaths,
    TurningNonSignalized,
    Other,
    /// With a vehicle that had crashed into somebody else before. No type of NHTSA's.
    Wreck,
}

impl PreCrash {
    /// Its number among the 37.
    pub fn number(self) -> Option<u32> {
        Some(match self {
            PreCrash::RunningRedLight => 4,
            PreCrash::RunningStopSign => 5,
            PreCrash::PedestrianWithManoeuvre => 11,
            PreCrash::PedestrianWithoutManoeuvre => 12,
            PreCrash::CyclistWithManoeuvre => 13,
            PreCrash::CyclistWithoutManoeuvre => 14,
            PreCrash::TurningSameDirection => 16,
            PreCrash::ChangingLanesSameDirection => 18,
            PreCrash::DriftingSameDirection => 19,
            PreCrash::ManoeuvreOppositeDirection => 20,
            PreCrash::NoManoeuvreOppositeDirection => 21,
            PreCrash::FollowingVehicleManoeuvre => 22,
            PreCrash::LeadAccelerating => 23,
            PreCrash::LeadSlower => 24,
            PreCrash::LeadDecelerating => 25,
            PreCrash::LeadStopped => 26,
            PreCrash::LeftTurnAcrossPathSignalized => 27,
            PreCrash::RightTurnSignalized => 28,
            PreCrash::LeftTurnAcrossPath => 29,
            PreCrash::StraightCrossingPaths => 30,
            PreCrash::TurningNonSignalized => 31,
            PreCrash::Other => 37,
            PreCrash::Wreck => return None,
        })
    }

    /// Its name, by the typology.
    pub fn name(self) -> &'static str {
        match self {
            PreCrash::RunningRedLight => "running a red light",
            PreCrash::RunningStopSign => "running a stop sign",
            PreCrash::PedestrianWithManoeuvre => "pedestrian, the vehicle making a manoeuvre",
            PreCrash::PedestrianWithoutManoeuvre => "pedestrian, the vehicle making no manoeuvre",
            PreCrash::CyclistWithManoeuvre => "cyclist, the vehicle making a manoeuvre",
            PreCrash::CyclistWithoutManoeuvre => "cyclist, the vehicle making no manoeuvre",
            PreCrash::TurningSameDirection => "turning, same direction",
            PreCrash::ChangingLanesSameDirection => "changing lanes, same direction",
            PreCrash::DriftingSameDirection => "drifting, same direction",
            PreCrash::ManoeuvreOppositeDirection => "making a manoeuvre, opposite direction",
            PreCrash::NoManoeuvreOppositeDirection => "making no manoeuvre, opposite direction",
            PreCrash::FollowingVehicleManoeuvre => "following vehicle making a manoeuvre",
            PreCrash::LeadAccelerating => "lead vehicle accelerating",
            PreCrash::LeadSlower => "lead vehicle moving at lower constant speed",
            PreCrash::LeadDecelerating => "lead vehicle decelerating",
            PreCrash::LeadStopped => "lead vehicle stopped",
            PreCrash::LeftTurnAcrossPathSignalized => "left turn across path, signalized junction",
            PreCrash::RightTurnSignalized => "turning right, signalized junction",
            PreCrash::LeftTurnAcrossPath => "left turn across path, non-signalized junction",
            PreCrash::StraightCrossingPaths => "straight crossing paths, non-signalized junction",
            PreCrash::TurningNonSignalized => "turning, non-signalized junction",
            PreCrash::Other => "other",
            PreCrash::Wreck => "wreck of another crash",
        }
    }
}

/// Where somebody was, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub pose: Pose,
    pub speed_mps: f64,
}

/// What somebody did in the last seconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    pub from: Place,
    pub to: Place,
}

impl Way {
    pub fn shape(&self) -> Shape {
        Shape::between((self.from.pose, self.from.speed_mps), (self.to.pose, self.to.speed_mps))
    }
}

/// What led to a collision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    pub body: Body,
    pub ego: Way,
    pub other: Way,
    /// Whether the ego vehicle, or a vehicle that ignores lights, passed a red one.
    pub ran_red: bool,
    pub ran_stop: bool,
    /// Whether the ego vehicle was in a junction, and whether it has lights.
    pub in_junction: bool,
    pub is_signalized: bool,
    /// Whether the ego vehicle was hit at its front or rear, and not at a side.
    pub is_lengthwise: bool,
    /// Whether the other had crashed before.
    pub is_wreck: bool,
}

impl Before {
    /// The first type that fits.
    pub fn kind(&self) -> PreCrash {
        let (ego, other) = (self.ego.shape(), self.other.shape());
        // A bend of the road turns a vehicle, too, and is no manoeuvre.
        let turns = |shape: Shape, to: Shape| self.in_junction && shape == to;
        let turns_left = turns(ego, Shape::LeftTurn) || turns(other, Shape::LeftTurn);
        let turns_right = turns(ego, Shape::RightTurn) || turns(other, Shape::RightTurn);
        let ego_turns = turns(ego, Shape::LeftTurn) || turns(ego, Shape::RightTurn);
        let is_manoeuvring = ego_turns || ego == Shape::LaneChange;
        if self.is_wreck {
            return PreCrash::Wreck;
        }
        if self.ran_red {
            return PreCrash::RunningRedLight;
        }
        if self.ran_stop {
            return PreCrash::RunningStopSign;
        }
        match self.body {
            Body::Pedestrian if is_manoeuvring => return PreCrash::PedestrianWithManoeuvre,
            Body::Pedestrian => return PreCrash::PedestrianWithoutManoeuvre,
            Body::Bicycle if is_manoeuvring => return PreCrash::CyclistWithManoeuvre,
            Body::Bicycle => return PreCrash::CyclistWithoutManoeuvre,
            _ => {}
        }
        let (ego_from, other_from) = (self.ego.from.pose, self.other.from.pose);
        let apart_rad = wrap_angle(other_from.heading_rad - ego_from.heading_rad).abs();
        if apart_rad < ALIKE_RAD {
            return self.same_direction(ego, other, turns_left || turns_right);
        }
        let is_opposite = apart_rad > core::f64::consts::PI - ALIKE_RAD;
        match (is_opposite, self.is_signalized) {
            (true, true) if turns_left => PreCrash::LeftTurnAcrossPathSignalized,
            (true, false) if turns_left => PreCrash::LeftTurnAcrossPath,
            (true, _) if is_manoeuvring || turns_right || other == Shape::LaneChange => {
                PreCrash::ManoeuvreOppositeDirection
            }
            (true, _) => PreCrash::NoManoeuvreOppositeDirection,
            (false, true) if turns_right => PreCrash::RightTurnSignalized,
            (false, false) if turns_left || turns_right => PreCrash::TurningNonSignalized,
            (false, false) => PreCrash::StraightCrossingPaths,
            (false, true) => PreCrash::Other,
        }
    }

    fn same_direction(&self, ego: Shape, other: Shape, turns: bool) -> PreCrash {
        let ahead_m = unit_vector(self.ego.from.pose.heading_rad)
            .dot(&(self.other.from.pose.position - self.ego.from.pose.position));
        let (lead, follower) = if ahead_m > 0.0 { (&self.other, ego) } else { (&self.ego, other) };
        if follower == Shape::LaneChange && self.is_lengthwise {
            return PreCrash::FollowingVehicleManoeuvre;
        }
        if [ego, other].contains(&Shape::LaneChange) {
            return PreCrash::ChangingLanesSameDirection;
        }
        if !self.is_lengthwise {
            return if turns { PreCrash::TurningSameDirection } else { PreCrash::DriftingSameDirection };
        }
        let (before_mps, after_mps) = (lead.from.speed_mps, lead.to.speed_mps);
        match after_mps - before_mps {
            _ if before_mps.max(after_mps) < STANDING_MPS => PreCrash::LeadStopped,
            change_mps if change_mps < -CONSTANT_MPS => PreCrash::LeadDecelerating,
            change_mps if change_mps > CONSTANT_MPS => PreCrash::LeadAccelerating,
            _ if after_mps < STANDING_MPS => PreCrash::LeadStopped,
            _ => PreCrash::LeadSlower,
        }
    }
}

/// Where somebody is who moves so.
pub(super) fn place(pose: Pose, velocity_mps: Vec2) -> Place {
    Place { pose, speed_mps: velocity_mps.norm() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64, heading_deg: f64, speed_mps: f64) -> Place {
        Place { pose: Pose::new(x_m, y_m, heading_deg.to_radians()), speed_mps }
    }

    /// The ego vehicle drives 50 m along +x at 10 m/s; in town, at no junction.
    fn before(other: [Place; 2]) -> Before {
        Before {
            body: Body::Sedan,
            ego: Way { from: at(0.0, 0.0, 0.0, 10.0), to: at(50.0, 0.0, 0.0, 10.0) },
            other: Way { from: other[0], to: other[1] },
            ran_red: false,
            ran_stop: false,
            in_junction: false,
            is_signalized: false,
            is_lengthwise: true,
            is_wreck: false,
        }
    }

    #[test]
    fn who_is_ahead_tells_the_types_of_rear_ends() {
        let lead = |from_mps: f64, to_mps: f64| {
            before([at(40.0, 0.0, 0.0, from_mps), at(54.0, 0.0, 0.0, to_mps)]).kind().number()
        };
        assert_eq!(lead(0.0, 0.0), Some(26));
        assert_eq!(lead(8.0, 0.0), Some(25));
        assert_eq!(lead(3.0, 3.5), Some(24));
        assert_eq!(lead(2.0, 6.0), Some(23));
        // Hit from behind: the ego vehicle is the one ahead.
        let behind = before([at(-30.0, 0.0, 0.0, 16.0), at(46.0, 0.0, 0.0, 14.0)]);
        assert_eq!(behind.kind(), PreCrash::LeadSlower);
        let cut_in = before([at(10.0, 3.5, 0.0, 9.0), at(54.0, 0.0, 0.0, 8.0)]);
        assert_eq!(cut_in.kind(), PreCrash::ChangingLanesSameDirection);
        let beside =
            Before { is_lengthwise: false, ..before([at(0.0, 2.5, 0.0, 10.0), at(50.0, 1.9, 0.0, 10.0)]) };
        assert_eq!(beside.kind(), PreCrash::DriftingSameDirection);
        let mut swerve = before([at(40.0, 3.5, 0.0, 2.0), at(54.0, 3.5, 0.0, 2.0)]);
        swerve.ego.to = at(50.0, 3.5, 0.0, 10.0);
        assert_eq!(swerve.kind(), PreCrash::FollowingVehicleManoeuvre);
    }

    #[test]
    fn junctions_lights_and_turns_tell_the_types_of_crossing_ways() {
        let crossing = before([at(50.0, -30.0, 90.0, 8.0), at(50.0, 0.0, 90.0, 8.0)]);
        assert_eq!(crossing.kind(), PreCrash::StraightCrossingPaths);
        assert_eq!(Before { is_signalized: true, ..crossing }.kind(), PreCrash::Other);
        assert_eq!(Before { ran_red: true, ..crossing }.kind(), PreCrash::RunningRedLight);
        assert_eq!(Before { is_wreck: true, ran_red: true, ..crossing }.kind(), PreCrash::Wreck);
        let oncoming = before([at(100.0, 3.0, 180.0, 8.0), at(54.0, 0.5, 180.0, 8.0)]);
        assert_eq!(oncoming.kind(), PreCrash::ManoeuvreOppositeDirection);
        let turned = [at(80.0, 3.5, 180.0, 6.0), at(52.0, 0.0, -90.0, 6.0)];
        let left = Before { in_junction: true, ..before(turned) };
        assert_eq!(left.kind(), PreCrash::LeftTurnAcrossPath);
        assert_eq!(Before { is_signalized: true, ..left }.kind().number(), Some(27));
        // A bend is no turn.
        assert_eq!(before(turned).kind(), PreCrash::NoManoeuvreOppositeDirection);
        let from_the_side = [at(60.0, -20.0, 90.0, 5.0), at(54.0, -1.0, 20.0, 5.0)];
        let right = Before { in_junction: true, ..before(from_the_side) };
        assert_eq!(right.kind(), PreCrash::TurningNonSignalized);
        assert_eq!(Before { is_signalized: true, ..right }.kind(), PreCrash::RightTurnSignalized);
    }

    #[test]
    fn people_and_cyclists_have_types_of_their_own() {
        let walker = Before {
            body: Body::Pedestrian,
            ..before([at(50.0, -5.0, 90.0, 1.5), at(50.0, 0.0, 90.0, 1.5)])
        };
        assert_eq!(walker.kind().number(), Some(12));
        let mut turning = Before { in_junction: true, ..walker };
        turning.ego.to = at(20.0, 20.0, 90.0, 5.0);
        assert_eq!(turning.kind().number(), Some(11));
        assert_eq!(Before { body: Body::Bicycle, ..turning }.kind().number(), Some(13));
        assert_eq!(Before { body: Body::Bicycle, ..walker }.kind().number(), Some(14));
    }
}
