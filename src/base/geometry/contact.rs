//! Distances between oriented boxes, rays, and the first contact of two moving boxes.
//!
//! All of it runs many times a tick, so it is written here rather than taken from a library. Distances and
//! rays are closed forms, and the first contact advances along the gap. The tests below compare it with
//! `parry2d`, which only they use; `tests/it/contacts.rs` shows that no contact is missed.

use super::extreme::{larger, smaller};
use super::pose::{OrientedBox, Pose, Vec2, extent_m, wrap_angle};

/// Boxes nearer than this count as touching, m. A contact is told at most a millisecond early if the gap
/// closes with at least a millimetre a second.
const CONTACT_M: f64 = 1e-6;

/// Circles around boxes pass each other with so much between them, m: far more than rounding.
const PASSING_M: f64 = 1e-3;

/// The gap between two boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Clearance {
    /// 0 if they touch or overlap, m.
    distance_m: f64,
    /// Nearest point of the first box.
    on_first: Vec2,
    /// Nearest point of the second box.
    on_second: Vec2,
}

/// A box that moves on a straight line, turning evenly, from where it stands to `end`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    pub start: OrientedBox,
    pub end: Pose,
}

/// Where and when two moving boxes first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstContact {
    /// Part of the motion done by then, in `[0, 1]`.
    pub fraction: f64,
    pub point: Vec2,
    /// Unit vector from the first box to the second across the gap that closed; zero if they touch
    /// from the beginning.
    pub normal: Vec2,
}

impl Sweep {
    /// The box after a part of the motion.
    pub fn at(&self, fraction: f64) -> OrientedBox {
        let start = &self.start.pose;
        let pose = Pose {
            position: start.position + self.displacement() * fraction,
            heading_rad: wrap_angle(start.heading_rad + self.turn_rad() * fraction),
        };
        OrientedBox { pose, ..self.start }
    }

    /// Velocity of the point of the box that is at `point` when `fraction` of the motion is done, in m per
    /// whole motion.
    pub fn rate_m(&self, fraction: f64, point: Vec2) -> Vec2 {
        let arm = point - self.at(fraction).pose.position;
        self.displacement() + Vec2::new(-arm.y, arm.x) * self.turn_rad()
    }

    /// Farthest that any point of the box moves, m.
    pub fn most_m(&self) -> f64 {
        self.displacement().norm() + self.turning_m()
    }

    fn displacement(&self) -> Vec2 {
        self.end.position - self.start.pose.position
    }

    /// By how much it turns, rad to the left.
    pub fn turn_rad(&self) -> f64 {
        wrap_angle(self.end.heading_rad - self.start.pose.heading_rad)
    }

    /// Farthest that a corner gets from where the centre began, the displacement not counted, m.
    fn reach_m(&self) -> f64 {
        (self.start.half_length_m + self.start.half_width_m) * (1.0 + self.turn_rad().abs())
    }

    /// Farthest that a corner travels by turning alone, m.
    fn turning_m(&self) -> f64 {
        self.turn_rad().abs() * self.start.radius_m()
    }
}

/// Distance between two boxes, m; 0 if they touch or overlap.
pub fn distance_m(a: &OrientedBox, b: &OrientedBox) -> f64 {
    Frame::of(a).distance_m(&Frame::of(b))
}

/// Distance and nearest points of two boxes.
///
/// Boxes that do not overlap are nearest at a corner of one of them, so eight corners are tried.
fn clearance(a: &OrientedBox, b: &OrientedBox) -> Clearance {
    let reach_m = a.radius_m() + b.radius_m();
    let near = (a.pose.position - b.pose.position).norm_squared() <= reach_m * reach_m;
    let (a, b) = (Frame::of(a), Frame::of(b));
    if near && a.overlaps(&b) {
        let touch = overlap_point(&a, &b);
        return Clearance { distance_m: 0.0, on_first: touch, on_second: touch };
    }
    let of_first = a.corners().map(|corner| (corner, b.nearest(corner)));
    let of_second = b.corners().map(|corner| (a.nearest(corner), corner));
    let mut best = (f64::INFINITY, Vec2::zeros(), Vec2::zeros());
    for (on_first, on_second) in of_first.into_iter().chain(of_second) {
        let squared = (on_second - on_first).norm_squared();
        if squared < best.0 {
            best = (squared, on_first, on_second);
        }
    }
    Clearance { distance_m: best.0.sqrt(), on_first: best.1, on_second: best.2 }
}

/// The first moment at which two moving boxes touch, if they do before the motion ends.
///
/// Conservative advancement along the gap: the gap cannot close before the displacement along its
/// direction, plus the travel of the corners by turning, add up to its width. So a step of that part of
/// the motion never jumps over a contact; for boxes that do not turn it lands on the contact.
pub fn first_contact(a: &Sweep, b: &Sweep) -> Option<FirstContact> {
    let approach = a.displacement() - b.displacement();
    let between = b.start.pose.position - a.start.pose.position;
    // Broad phase: circles around the boxes do not meet. They are a little too large, and need no root.
    let reach_m = a.reach_m() + b.reach_m() + approach.x.abs() + approach.y.abs() + CONTACT_M;
    if between.norm_squared() > reach_m * reach_m {
        return None;
    }
    // Circles around the boxes pass each other: each stays around its box, however that turns.
    let way_m2 = approach.norm_squared();
    let nearest = if way_m2 > 0.0 { (between.dot(&approach) / way_m2).clamp(0.0, 1.0) } else { 0.0 };
    let radii_m = a.start.radius_m() + b.start.radius_m() + PASSING_M;
    if (between - approach * nearest).norm_squared() > radii_m * radii_m {
        return None;
    }
    let turning_m = a.turning_m() + b.turning_m();
    // Most of the other pairs have a gap that is wider than the motion can close.
    let closing_m = approach.norm() + turning_m + 2.0 * CONTACT_M;
    let (first, second) = (Frame::of(&a.start), Frame::of(&b.start));
    if first.is_apart(&second, closing_m) || first.distance_m(&second) > closing_m {
        return None;
    }
    let mut fraction = 0.0;
    let mut normal = Vec2::zeros();
    loop {
        let gap = clearance(&a.at(fraction), &b.at(fraction));
        // A gap of no width has no direction: touching boxes keep the last one.
        if gap.distance_m > CONTACT_M / 100.0 {
            normal = (gap.on_second - gap.on_first) / gap.distance_m;
        }
        if gap.distance_m <= CONTACT_M {
            return Some(FirstContact { fraction, point: (gap.on_first + gap.on_second) / 2.0, normal });
        }
        let closing_m = approach.dot(&normal) + turning_m;
        if closing_m * (1.0 - fraction) < gap.distance_m - CONTACT_M {
            return None;
        }
        // Half the tolerance beyond the gap, so that the approach ends; the other half is for rounding.
        fraction = (fraction + (gap.distance_m - CONTACT_M / 2.0) / closing_m).min(1.0);
    }
}

/// A box with its axes worked out once, for several questions about distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    centre: Vec2,
    forward: Vec2,
    half_length_m: f64,
    half_width_m: f64,
}

impl Frame {
    pub fn of(shape: &OrientedBox) -> Frame {
        Frame::along(shape, shape.pose.forward())
    }

    /// The frame of a box whose unit vector ahead is known already.
    pub fn along(shape: &OrientedBox, forward: Vec2) -> Frame {
        Frame {
            centre: shape.pose.position,
            forward,
            half_length_m: shape.half_length_m,
            half_width_m: shape.half_width_m,
        }
    }

    /// Unit vector ahead.
    pub fn forward(&self) -> Vec2 {
        self.forward
    }

    /// Distance along a ray to the box, m, if it is hit within `reach_m`; 0 from inside. `direction` is
    /// a unit vector.
    ///
    /// The ray is inside the box where it is between both pairs of parallel sides.
    pub fn ray_hit_m(&self, origin: Vec2, direction: Vec2, reach_m: f64) -> Option<f64> {
        let to_centre = self.centre - origin;
        let (mut enters_m, mut leaves_m) = (0.0_f64, reach_m);
        for (axis, half_m) in [(self.forward, self.half_length_m), (self.left(), self.half_width_m)] {
            let (along, centre_m) = (axis.dot(&direction), axis.dot(&to_centre));
            if along == 0.0 {
                if centre_m.abs() > half_m {
                    return None;
                }
                continue;
            }
            let (one_m, other_m) = ((centre_m - half_m) / along, (centre_m + half_m) / along);
            enters_m = larger(enters_m, smaller(one_m, other_m));
            leaves_m = smaller(leaves_m, larger(one_m, other_m));
        }
        (enters_m <= leaves_m).then_some(enters_m)
    }

    /// Whether a ray hits the box within `reach_m`, as [`Frame::ray_hit_m`] has it; quicker for rays that pass by.
    pub fn is_hit(&self, origin: Vec2, direction: Vec2, reach_m: f64) -> bool {
        let aside_m = direction.perp(&(self.centre - origin)).abs();
        // No corner is farther from the centre than half the length and half the width together.
        aside_m <= self.half_length_m + self.half_width_m
            && self.ray_hit_m(origin, direction, reach_m).is_some()
    }

    /// Whether the boxes are farther apart than `gap_m` along an axis of this box. This is quick, and says
    /// too little: boxes for which it is false may be farther apart, too.
    pub fn is_apart(&self, other: &Frame, gap_m: f64) -> bool {
        let between = other.centre - self.centre;
        let half_m = (other.half_length_m, other.half_width_m);
        let (along_m, across_m) = extent_m(other.forward, self.forward, half_m);
        self.forward.dot(&between).abs() > self.half_length_m + along_m + gap_m
            || self.forward.perp(&between).abs() > self.half_width_m + across_m + gap_m
    }

    /// Distance to another box, m; 0 if they touch or overlap.
    ///
    /// Boxes that do not overlap are nearest at a corner of one of them. Each box takes the corners of the
    /// other in its own frame, where the nearest point needs no search.
    pub fn distance_m(&self, other: &Frame) -> f64 {
        let between = other.centre - self.centre;
        let (cosine, sine) = (self.forward.dot(&other.forward), self.forward.perp(&other.forward));
        let there = Vec2::new(self.forward.dot(&between), self.forward.perp(&between));
        let here = Vec2::new(-other.forward.dot(&between), -other.forward.perp(&between));
        let extent = |shape: &Frame| {
            let (along, across) = (cosine.abs(), sine.abs());
            Vec2::new(
                shape.half_length_m * along + shape.half_width_m * across,
                shape.half_length_m * across + shape.half_width_m * along,
            )
        };
        let meets = |shape: &Frame, centre: Vec2, extent: Vec2| {
            centre.x.abs() <= shape.half_length_m + extent.x
                && centre.y.abs() <= shape.half_width_m + extent.y
        };
        if meets(self, there, extent(other)) && meets(other, here, extent(self)) {
            return 0.0;
        }
        let nearest_m2 = |shape: &Frame, centre: Vec2, ahead: Vec2, left: Vec2| {
            let to_m2 = |corner: Vec2| {
                let outside_x_m = larger(corner.x.abs() - shape.half_length_m, 0.0);
                let outside_y_m = larger(corner.y.abs() - shape.half_width_m, 0.0);
                outside_x_m * outside_x_m + outside_y_m * outside_y_m
            };
            let (front, back) = (centre + ahead, centre - ahead);
            let of_front = smaller(to_m2(front + left), to_m2(front - left));
            smaller(of_front, smaller(to_m2(back + left), to_m2(back - left)))
        };
        let ahead = Vec2::new(cosine, sine);
        let left = Vec2::new(-sine, cosine);
        let of_other = nearest_m2(self, there, ahead * other.half_length_m, left * other.half_width_m);
        // Seen from the other box, this one is turned the other way.
        let ahead = Vec2::new(cosine, -sine);
        let left = Vec2::new(sine, cosine);
        let of_self = nearest_m2(other, here, ahead * self.half_length_m, left * self.half_width_m);
        smaller(of_other, of_self).sqrt()
    }

    fn left(&self) -> Vec2 {
        Vec2::new(-self.forward.y, self.forward.x)
    }

    /// Corners, counter-clockwise from front left.
    pub fn corners(&self) -> [Vec2; 4] {
        let (ahead, aside) = (self.forward * self.half_length_m, self.left() * self.half_width_m);
        let centre = self.centre;
        [centre + ahead + aside, centre - ahead + aside, centre - ahead - aside, centre + ahead - aside]
    }

    /// The point of the box that is nearest to `point`; the point itself if it lies inside.
    fn nearest(&self, point: Vec2) -> Vec2 {
        let away = point - self.centre;
        let ahead_m = away.dot(&self.forward).clamp(-self.half_length_m, self.half_length_m);
        let left_m = away.dot(&self.left()).clamp(-self.half_width_m, self.half_width_m);
        self.centre + self.forward * ahead_m + self.left() * left_m
    }

    /// Half of the box's extent along a unit vector, m.
    fn reach_m(&self, axis: Vec2) -> f64 {
        self.half_length_m * self.forward.dot(&axis).abs() + self.half_width_m * self.left().dot(&axis).abs()
    }

    /// Whether the boxes overlap: no axis of either separates them.
    fn overlaps(&self, other: &Frame) -> bool {
        let between = other.centre - self.centre;
        let meets = |axis: Vec2| between.dot(&axis).abs() <= self.reach_m(axis) + other.reach_m(axis);
        meets(self.forward) && meets(self.left()) && meets(other.forward) && meets(other.left())
    }
}

/// A point shared by two overlapping boxes: the middle of the corners of what they share.
fn overlap_point(a: &Frame, b: &Frame) -> Vec2 {
    let mut shared: Vec<Vec2> = b.corners().to_vec();
    let sides = [
        (a.forward, a.half_length_m),
        (-a.forward, a.half_length_m),
        (a.left(), a.half_width_m),
        (-a.left(), a.half_width_m),
    ];
    for (outward, half_m) in sides {
        shared = clipped(&shared, |point| half_m - (point - a.centre).dot(&outward));
    }
    if shared.is_empty() {
        // The boxes touch in a point, which rounding has lost.
        return (a.nearest(b.centre) + b.nearest(a.centre)) / 2.0;
    }
    shared.iter().sum::<Vec2>() / shared.len() as f64
}

/// The part of a convex polygon where `inside` is not negative (Sutherland and Hodgman); `inside` is
/// a signed distance from a line.
fn clipped(polygon: &[Vec2], inside: impl Fn(Vec2) -> f64) -> Vec<Vec2> {
    let mut kept = Vec::new();
    for (index, &from) in polygon.iter().enumerate() {
        let to = polygon[(index + 1) % polygon.len()];
        let (from_m, to_m) = (inside(from), inside(to));
        if from_m >= 0.0 {
            kept.push(from);
        }
        if (from_m < 0.0) != (to_m < 0.0) {
            kept.push(from + (to - from) * (from_m / (from_m - to_m)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry2d::query::RayCast;
    use proptest::prelude::*;

    fn cuboid(shape: &OrientedBox) -> parry2d::shape::Cuboid {
        parry2d::shape::Cuboid::new(parry2d::math::Vector::new(shape.half_length_m, shape.half_width_m))
    }

    fn parry_pose(shape: &OrientedBox) -> parry2d::math::Pose {
        parry2d::math::Pose::new(to_parry(shape.pose.position), shape.pose.heading_rad)
    }

    fn parry_distance_m(a: &OrientedBox, b: &OrientedBox) -> f64 {
        parry2d::query::distance(&parry_pose(a), &cuboid(a), &parry_pose(b), &cuboid(b))
            .expect("two boxes are always comparable")
            .distance
    }

    fn to_parry(point: Vec2) -> parry2d::math::Vector {
        parry2d::math::Vector::new(point.x, point.y)
    }

    prop_compose! {
        fn any_box()(x_m in -8.0_f64..8.0, y_m in -8.0_f64..8.0, heading_rad in -3.2_f64..3.2,
                     length_m in 0.3_f64..11.0, width_m in 0.3_f64..2.6) -> OrientedBox {
            OrientedBox::new(Pose::new(x_m, y_m, heading_rad), length_m, width_m)
        }
    }

    proptest! {
        #[test]
        fn rays_are_parrys(target in any_box(), x_m in -8.0_f64..8.0, y_m in -8.0_f64..8.0,
                           heading_rad in -3.2_f64..3.2, reach_m in 0.0_f64..20.0) {
            let (origin, direction) = (Vec2::new(x_m, y_m), Pose::new(0.0, 0.0, heading_rad).forward());
            let ray = parry2d::query::Ray::new(to_parry(origin), to_parry(direction));
            let parrys = cuboid(&target).cast_ray(&parry_pose(&target), &ray, reach_m, true);
            match (Frame::of(&target).ray_hit_m(origin, direction, reach_m), parrys) {
                (Some(ours_m), Some(parrys_m)) => prop_assert!((ours_m - parrys_m).abs() < 1e-6),
                (None, None) => {}
                // The two may differ only on a ray that grazes a corner or ends on a side.
                (ours, parrys) => {
                    let grown = |by_m: f64| {
                        let (length_m, width_m) = (2.0 * target.half_length_m, 2.0 * target.half_width_m);
                        let grown = OrientedBox::new(target.pose, length_m + by_m, width_m + by_m);
                        Frame::of(&grown).ray_hit_m(origin, direction, reach_m).is_some()
                    };
                    prop_assert!(grown(1e-6) && !grown(-1e-6), "{ours:?} {parrys:?}");
                }
            }
        }

        #[test]
        fn distances_are_parrys(a in any_box(), b in any_box()) {
            let found = clearance(&a, &b);
            prop_assert!((found.distance_m - parry_distance_m(&a, &b)).abs() < 1e-6, "{found:?}");
            prop_assert!((found.distance_m - distance_m(&a, &b)).abs() < 1e-9, "{found:?}");
            let (first, second) = (Frame::of(&a), Frame::of(&b));
            prop_assert!(!first.is_apart(&second, found.distance_m + 1e-9), "{found:?}");
            // For a gap of 0, one of the two boxes always tells whether they are apart.
            let is_known = |gap_m: f64| first.is_apart(&second, gap_m) || second.is_apart(&first, gap_m);
            prop_assert_eq!(is_known(0.0), found.distance_m > 0.0);
            let (a, b) = (Frame::of(&a), Frame::of(&b));
            prop_assert!((a.nearest(found.on_first) - found.on_first).norm() < 1e-9, "{found:?}");
            prop_assert!((b.nearest(found.on_second) - found.on_second).norm() < 1e-9, "{found:?}");
        }

        #[test]
        fn a_first_contact_is_a_contact_and_the_first(
            a in any_box(), b in any_box(), dx_m in -6.0_f64..6.0, dy_m in -6.0_f64..6.0, turn_rad in -0.3_f64..0.3,
        ) {
            let moving = Sweep {
                start: a,
                end: Pose::new(a.pose.position.x + dx_m, a.pose.position.y + dy_m, wrap_angle(a.pose.heading_rad + turn_rad)),
            };
            let still = Sweep { start: b, end: b.pose };
            // The naive twin: a thousand small steps.
            let naive = (0..=1000).map(|i| f64::from(i) / 1000.0).find(|&f| parry_distance_m(&moving.at(f), &b) <= 0.0);
            match (first_contact(&moving, &still), naive) {
                (None, naive) => prop_assert_eq!(naive, None),
                (Some(first), Some(naive)) => prop_assert!(first.fraction <= naive + 1e-9, "{first:?} after {naive}"),
                // A graze between two of the small steps.
                (Some(first), None) => {
                    prop_assert!(parry_distance_m(&moving.at(first.fraction), &b) <= 2.0 * CONTACT_M, "{first:?}");
                }
            }
        }
    }

    fn car(x_m: f64, y_m: f64, heading_rad: f64) -> OrientedBox {
        OrientedBox::new(Pose::new(x_m, y_m, heading_rad), 4.0, 2.0)
    }

    #[test]
    fn a_fast_crossing_is_not_missed() {
        // In one motion the second box passes wholly through the first.
        let still = Sweep { start: car(0.0, 0.0, 0.0), end: Pose::new(0.0, 0.0, 0.0) };
        let fast = Sweep {
            start: car(0.0, -50.0, core::f64::consts::FRAC_PI_2),
            end: Pose::new(0.0, 50.0, core::f64::consts::FRAC_PI_2),
        };
        let contact = first_contact(&still, &fast).expect("it passes through");
        // Its front touches at y = -1, that is after 47 of 100 m.
        assert!((contact.fraction - 0.47).abs() < 1e-5, "{contact:?}");
        assert!((contact.point.y + 1.0).abs() < 1e-3, "{contact:?}");
    }
}
