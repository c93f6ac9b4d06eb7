//! Vectors, poses and oriented boxes.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};

/// A point or a displacement in the plane, m.
pub type Vec2 = nalgebra::Vector2<f64>;

/// The unit vector that points along a heading (rad).
///
/// This is most of a tick's trigonometry, and its angles are a few turns at most. So it sums Taylor terms
/// within an eighth of a turn of a multiple of a quarter turn, without `libm`'s care for huge angles. The
/// bits are the same on every machine, and right within two units of the last digit.
pub fn unit_vector(heading_rad: f64) -> Vec2 {
    if heading_rad.is_nan() || heading_rad.abs() > FEW_TURNS_RAD {
        let (sin, cos) = libm::sincos(heading_rad);
        return Vec2::new(cos, sin);
    }
    let shifted = heading_rad * FRAC_2_PI + TO_INTEGER;
    let quarters = shifted - TO_INTEGER;
    let rest = (heading_rad - quarters * QUARTER_HIGH_RAD) - quarters * QUARTER_LOW_RAD;
    let (sin, cos) = (short_sin(rest), short_cos(rest));
    let (x, y) = if shifted.to_bits() & 1 == 0 { (cos, sin) } else { (-sin, cos) };
    if shifted.to_bits() & 2 == 0 { Vec2::new(x, y) } else { Vec2::new(-x, -y) }
}

/// Up to this angle, subtracting whole quarter turns in two parts loses nothing that matters.
const FEW_TURNS_RAD: f64 = 1000.0;

/// 1.5 · 2⁵²: a number that is added to it is rounded to an integer, which is then in the lowest bits.
const TO_INTEGER: f64 = 6_755_399_441_055_744.0;

/// π/2 to 26 bits, so that its products with small integers are exact; and the rest of π/2, with the
/// 6.1e-17 by which it exceeds the nearest `f64`.
const QUARTER_HIGH_RAD: f64 = f64::from_bits(FRAC_PI_2.to_bits() & !0x7ff_ffff);
const QUARTER_LOW_RAD: f64 = (FRAC_PI_2 - QUARTER_HIGH_RAD) + 6.123_233_995_736_766e-17;

/// Sine within π/4 of 0: Taylor's terms up to the 17th power, the next is below 1e-19.
fn short_sin(x: f64) -> f64 {
    const TERMS: [f64; 8] = [
        1.0 / 355_687_428_096_000.0,
        -1.0 / 1_307_674_368_000.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
    ];
    let square = x * x;
    x + x * square * TERMS.iter().fold(0.0, |sum, term| sum * square + term)
}

/// Cosine within π/4 of 0: Taylor's terms up to the 16th power, the next is below 1e-17.
fn short_cos(x: f64) -> f64 {
    const TERMS: [f64; 7] = [
        1.0 / 20_922_789_888_000.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
    ];
    let square = x * x;
    1.0 - (square / 2.0 - square * square * TERMS.iter().fold(0.0, |sum, term| sum * square + term))
}

/// An angle, brought into `(-π, π]` by whole turns.
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
        Pose { position: self.to_world(Vec2::new(ahead_m, left_m)), heading_rad: self.heading_rad }
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

    /// Half the length along the unit vector `along` and half the width across it, m; `forward` is the unit vector
    /// along the box.
    pub fn half_extent_m(&self, forward: Vec2, along: Vec2) -> (f64, f64) {
        extent_m(forward, along, (self.half_length_m, self.half_width_m))
    }

    /// Radius of the circle around the box, m.
    pub fn radius_m(&self) -> f64 {
        libm::sqrt(self.half_length_m * self.half_length_m + self.half_width_m * self.half_width_m)
    }
}

/// Length along the unit vector `along` and width across it, m, of a box of a size (length and width, m) that points
/// along the unit vector `forward`. For a box of half the size both are half.
#[inline]
pub fn extent_m(forward: Vec2, along: Vec2, (length_m, width_m): (f64, f64)) -> (f64, f64) {
    let (cosine, sine) = (along.dot(&forward).abs(), along.perp(&forward).abs());
    (length_m * cosine + width_m * sine, length_m * sine + width_m * cosine)
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
    fn unit_vectors_are_libms() {
        for step in -40_000..=40_000 {
            let heading_rad = f64::from(step) * 0.000_5 + f64::from(step % 7) * 1e-9;
            let (sin, cos) = libm::sincos(heading_rad);
            let found = unit_vector(heading_rad);
            let error = (found.x - cos).abs().max((found.y - sin).abs());
            assert!(error <= f64::EPSILON, "{heading_rad}: {error}");
        }
        assert_eq!(unit_vector(0.0), Vec2::new(1.0, 0.0));
        assert_eq!(unit_vector(1e9), Vec2::new(libm::cos(1e9), libm::sin(1e9)));
        assert!(unit_vector(f64::NAN).x.is_nan() && unit_vector(f64::INFINITY).x.is_nan());
    }

    #[test]
    fn local_and_world_are_inverse() {
        let pose = Pose::new(3.0, -2.0, 0.7);
        let point = Vec2::new(11.0, 4.5);
        assert!((pose.to_world(pose.to_local(point)) - point).norm() < 1e-12);
        assert!((pose.to_local(pose.offset(2.0, 1.0).position) - Vec2::new(2.0, 1.0)).norm() < 1e-12);
    }
}
