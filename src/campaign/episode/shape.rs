//! The shape of a way up to a collision, in one word.
//!
//! Coarse on purpose: it separates failures and does not describe them. It looks at the last 5 s (up to 5.5 s), or less in a
//! younger episode. It asks how far the vehicle has turned, how far it has moved aside, and how much of its speed is left.
//! A bend of the road is a turn like one at a junction. The bounds are ours.

use avastra_base::geometry::{Pose, Vec2, unit_vector, wrap_angle};

/// A vehicle that has turned by more than this makes a turn, rad (20°).
pub(super) const TURN_RAD: f64 = core::f64::consts::PI / 9.0;
/// A vehicle that has moved aside by more than this, seen along its heading before and after, changes lanes, m: a
/// little more than half of a lane.
pub(super) const ASIDE_M: f64 = 2.0;
/// A vehicle that has kept less than this part of its speed is stopping.
const KEPT_PART: f64 = 0.5;

/// A class of ways. The first one whose condition holds applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    LeftTurn,
    RightTurn,
    LaneChange,
    Stopping,
    Straight,
}

impl Shape {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Shape::LeftTurn => "left turn",
            Shape::RightTurn => "right turn",
            Shape::LaneChange => "lane change",
            Shape::Stopping => "stopping",
            Shape::Straight => "straight",
        }
    }

    /// The way from one pose and speed (m/s) to another.
    pub(super) fn between((from, from_mps): (Pose, f64), (to, to_mps): (Pose, f64)) -> Shape {
        let turned_rad = wrap_angle(to.heading_rad - from.heading_rad);
        let left_m = |heading_rad| {
            let forward = unit_vector(heading_rad);
            Vec2::new(-forward.y, forward.x).dot(&(to.position - from.position))
        };
        // An arc ends on one side of its first heading and begins on that same side of its last; a lane change has
        // opposite sides.
        let (before_m, after_m) = (left_m(from.heading_rad), left_m(to.heading_rad));
        let aside_m = if before_m * after_m > 0.0 { before_m.abs().min(after_m.abs()) } else { 0.0 };
        if turned_rad > TURN_RAD {
            Shape::LeftTurn
        } else if turned_rad < -TURN_RAD {
            Shape::RightTurn
        } else if aside_m > ASIDE_M {
            Shape::LaneChange
        } else if to_mps < KEPT_PART * from_mps {
            Shape::Stopping
        } else {
            Shape::Straight
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_told_by_turn_offset_and_speed() {
        let shape = |x_m, y_m, heading_rad, to_mps| {
            Shape::between((Pose::new(0.0, 0.0, 0.0), 10.0), (Pose::new(x_m, y_m, heading_rad), to_mps))
                .name()
        };
        assert_eq!(shape(50.0, 0.5, 0.0, 9.0), "straight");
        assert_eq!(shape(30.0, 0.5, 0.0, 2.0), "stopping");
        assert_eq!(shape(50.0, 3.5, 0.02, 10.0), "lane change");
        assert_eq!(shape(50.0, -3.5, 0.0, 2.0), "lane change");
        assert_eq!(shape(20.0, 20.0, 1.5, 5.0), "left turn");
        assert_eq!(shape(20.0, -20.0, -1.5, 2.0), "right turn");
        // A gentle bend of 0.3 rad and 100 m radius, and a turn that has only begun.
        let (sine, cosine) = (libm::sin(0.3), libm::cos(0.3));
        assert_eq!(shape(100.0 * sine, 100.0 * (1.0 - cosine), 0.3, 10.0), "straight");
        assert_eq!(shape(45.0, 1.5, 0.3, 10.0), "straight");
    }
}
