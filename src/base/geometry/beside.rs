//! Places beside a path, by the tangent of the path there.

use super::extreme::{larger, smaller};
use super::pose::Vec2;

/// A place beside a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// m along the path; beyond the ends it goes on straight.
    pub station_m: f64,
    /// m to the left of the path.
    pub offset_m: f64,
    /// Unit vector along the path there.
    pub forward: Vec2,
}

/// A stretch of stations, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    pub from_m: f64,
    pub to_m: f64,
}

impl Span {
    pub fn middle_m(&self) -> f64 {
        (self.from_m + self.to_m) / 2.0
    }
}

impl Beside {
    /// The part of a strip `half_way_m` to each side of the path that a box centred here takes.
    /// `forward` is the unit vector along the box.
    pub fn taken(&self, forward: Vec2, length_m: f64, width_m: f64, half_way_m: f64) -> Option<Span> {
        let cosine = self.forward.dot(&forward);
        let sine = self.forward.x * forward.y - self.forward.y * forward.x;
        let across_m = (sine.abs() * length_m + cosine.abs() * width_m) / 2.0;
        if self.offset_m.abs() - across_m >= half_way_m {
            return None;
        }
        // All of the box is in the strip.
        if self.offset_m.abs() + across_m <= half_way_m {
            let along_m = (cosine.abs() * length_m + sine.abs() * width_m) / 2.0;
            return Some(Span { from_m: self.station_m - along_m, to_m: self.station_m + along_m });
        }
        let centre = Vec2::new(self.station_m, self.offset_m);
        let ahead = Vec2::new(cosine, sine) * (length_m / 2.0);
        let left = Vec2::new(-sine, cosine) * (width_m / 2.0);
        let corners =
            [centre + ahead + left, centre - ahead + left, centre - ahead - left, centre + ahead - left];
        let mut span = Span { from_m: f64::INFINITY, to_m: f64::NEG_INFINITY };
        for index in 0..4 {
            let (a, b) = (corners[index], corners[(index + 1) % 4]);
            let (right, left) = if a.y <= b.y { (a, b) } else { (b, a) };
            if right.y > half_way_m || left.y < -half_way_m {
                continue;
            }
            let rise_m = larger(left.y - right.y, 1e-9);
            for edge_m in [larger(right.y, -half_way_m), smaller(left.y, half_way_m)] {
                let station_m = right.x + (left.x - right.x) * ((edge_m - right.y) / rise_m).clamp(0.0, 1.0);
                span.from_m = smaller(span.from_m, station_m);
                span.to_m = larger(span.to_m, station_m);
            }
        }
        (span.from_m <= span.to_m).then_some(span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_part_on_the_way_is_taken() {
        let beside = Beside { station_m: 10.0, offset_m: -3.0, forward: Vec2::new(1.0, 0.0) };
        // Across the way, its front reaching to -1: half a metre of it is on a way of ±1.5 m.
        let across = beside.taken(Vec2::new(0.0, 1.0), 4.0, 2.0, 1.5).expect("its front is there");
        assert!((across.from_m - 9.0).abs() < 1e-9 && (across.to_m - 11.0).abs() < 1e-9, "{across:?}");
        assert_eq!(beside.taken(Vec2::new(1.0, 0.0), 4.0, 2.0, 1.5), None);
        // Turned by 45° only a corner is there.
        let half = core::f64::consts::FRAC_1_SQRT_2;
        let corner = beside.taken(Vec2::new(half, half), 4.0, 2.0, 1.5).expect("a corner is there");
        assert!(corner.from_m > 9.0 && corner.to_m < 12.0, "{corner:?}");
    }
}
