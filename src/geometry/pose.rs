//! Vectors, poses and oriented boxes.

use core::f64::consts::PI;
use core::f64::consts::TAU;

/// A point or a displacement in the plane, m.
pub type Vec2 = nalgebra::Vector2<f64>;

/// The unit vector that points along a heading (rad).
pub fn unit_vector(heading_rad: f64) -> Vec2 {
    let (sin, cos) = libm::sincos(heading_rad);
    Vec2::new(cos, sin)
}

/// The same angle in `(-π, π]`.
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let turns = ((angle_rad + PI) / TAU).ceil() - 1.0;
    let wrapped = angle_rad - turns * TAU;
    // Rounding may leave the result a hair outside.
    if wrapped > PI {
        wrapped - TAU
    } else if wrapped <= -PI {
        wrapped + TAU
    } else {
        wrapped
    }
}

/// A position (m) and a heading (rad, counter-clockwise from +x).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    pub position: Vec2,
    pub heading_rad: f64,
}

impl Pose {
    pub fn new(x_m: f64, y_m: f64, heading_rad: f64) -> Pose {
        Pose { position: Vec2::new(x_m, y_m), heading_rad }
    }

    /// Unit vector along the heading.
    pub fn forward(&self) -> Vec2 {
        unit_vector(self.heading_rad)
    }

    /// Unit vector to the left of the heading.
    pub fn left(&self) -> Vec2 {
        let forward = self.forward();
        Vec2::new(-forward.y, forward.x)
    }

    /// The pose `ahead_m` forward and `left_m` to the left, with the same heading.
    pub fn offset(&self, ahead_m: f64, left_m: f64) -> Pose {
        let forward = self.forward();
        let left = Vec2::new(-forward.y, forward.x);
        Pose { position: self.position + forward * ahead_m + left * left_m, heading_rad: self.heading_rad }
    }

    /// A world point in this frame: x ahead, y to the left (m).
    pub fn to_local(&self, point: Vec2) -> Vec2 {
        let forward = self.forward();
        let delta = point - self.position;
        Vec2::new(forward.dot(&delta), forward.x * delta.y - forward.y * delta.x)
    }

    /// A point of this frame in the world.
    pub fn to_world(&self, local: Vec2) -> Vec2 {
        let forward = self.forward();
        self.position + forward * local.x + Vec2::new(-forward.y, forward.x) * local.y
    }
}

/// A rectangle on the road: the outline of a vehicle or a pedestrian. `pose` is its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    pub pose: Pose,
    pub half_length_m: f64,
    pub half_width_m: f64,
}

impl OrientedBox {
    /// A box of the given full length and width, centred on `pose`.
    pub fn new(pose: Pose, length_m: f64, width_m: f64) -> OrientedBox {
        OrientedBox { pose, half_length_m: length_m / 2.0, half_width_m: width_m / 2.0 }
    }

    /// Corners, counter-clockwise from front left.
    pub fn corners(&self) -> [Vec2; 4] {
        let ahead = self.pose.forward() * self.half_length_m;
        let left = self.pose.left() * self.half_width_m;
        let centre = self.pose.position;
        [centre + ahead + left, centre - ahead + left, centre - ahead - left, centre + ahead - left]
    }

    /// Radius of the circle around the box, m.
    pub fn radius_m(&self) -> f64 {
        libm::sqrt(self.half_length_m * self.half_length_m + self.half_width_m * self.half_width_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_into_the_half_open_turn() {
        for (angle, wrapped) in
            [(0.0, 0.0), (PI, PI), (-PI, PI), (3.0 * PI, PI), (TAU + 0.5, 0.5), (-TAU - 0.5, -0.5)]
        {
            assert!((wrap_angle(angle) - wrapped).abs() < 1e-12, "{angle} gives {}", wrap_angle(angle));
        }
    }

    #[test]
    fn local_and_world_are_inverse() {
        let pose = Pose::new(3.0, -2.0, 0.7);
        let point = Vec2::new(11.0, 4.5);
        assert!((pose.to_world(pose.to_local(point)) - point).norm() < 1e-12);
        assert!((pose.to_local(pose.offset(2.0, 1.0).position) - Vec2::new(2.0, 1.0)).norm() < 1e-12);
    }
}
