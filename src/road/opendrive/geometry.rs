//! Reference lines: lines, arcs, spirals and parametric cubics, with exact heading and curvature.

use avastra_base::geometry::{Vec2, unit_vector, wrap_angle};

/// A chain of curves over the road's station.
#[derive(Debug, Clone)]
pub struct ReferenceLine {
    pieces: Vec<Piece>,
    /// Curves that stand for the pieces where these meet at an angle; by rising station, without overlap.
    roundings: Vec<Piece>,
    /// Stations at which the line turns so sharply that no vehicle can follow, m.
    breaks_m: Vec<f64>,
    place_steps: u64,
}

/// A place where two pieces meet at an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    pub at_m: f64,
    pub position: Vec2,
    pub turn_rad: f64,
    /// How far the rounded line is from the corner, m; `None` if it is too sharp to be rounded.
    pub off_m: Option<f64>,
}

/// Pieces that meet at a smaller angle are taken as they are, rad. A lane 5 m beside leaps by 4 cm there.
const CORNER_RAD_MIN: f64 = 0.5 * core::f64::consts::PI / 180.0;

/// A sharper corner than this is no road, rad.
const CORNER_RAD_MAX: f64 = 60.0 * core::f64::consts::PI / 180.0;

/// Pieces shorter than twice this are rounding of the tool that wrote them: their angles say nothing, m.
const CORNER_M_MIN: f64 = 5e-4;

/// A corner is rounded with this radius, m, or a smaller one where there is less room. Each piece gives at most
/// half of its length, and the line stays within [`ROUNDED_M_MAX`] of the corner.
const ROUNDING_RADIUS_M: f64 = 100.0;
const ROUNDED_M_MAX: f64 = 0.5;

/// A point of a reference line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferencePoint {
    pub position: Vec2,
    pub heading_rad: f64,
    /// 1/m, positive to the left.
    pub curvature_per_m: f64,
    /// Derivative of the curvature by the station, 1/m².
    pub curvature_rate_per_m2: f64,
}

#[derive(Debug, Clone)]
pub struct Piece {
    pub begin_m: f64,
    pub length_m: f64,
    pub origin: Vec2,
    pub heading_rad: f64,
    /// The unit vector along the heading.
    forward: Vec2,
    pub shape: Shape,
}

#[derive(Debug, Clone)]
pub enum Shape {
    Line,
    Arc {
        curvature_per_m: f64,
    },
    Spiral {
        begin_per_m: f64,
        rate_per_m2: f64,
        /// Places at equal steps of the station up to the end, in the frame of the piece's beginning. A place between two
        /// of them needs one step of quadrature from the one before it.
        nodes: Vec<Vec2>,
        step_m: f64,
    },
    /// `u(p)`, `v(p)` in the frame of the piece's beginning.
    Cubic {
        u: [f64; 4],
        v: [f64; 4],
        /// Arc lengths at equal steps of `p`, from 0; the last is the whole length.
        lengths_m: Vec<f64>,
        p_max: f64,
    },
}

/// Steps of the arc length table of a parametric cubic.
const CUBIC_STEPS: u32 = 64;

/// Steps of the table of a clothoid: for each radian by which it would turn with its greatest curvature, and at most.
const SPIRAL_STEPS_PER_RAD: f64 = 4.0;
const SPIRAL_STEPS_MAX: f64 = 1000.0;

/// Abscissae and weights of the five-point Gauss-Legendre rule on `[-1, 1]`.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

impl ReferenceLine {
    /// From at least one piece, by rising beginning.
    pub fn new(pieces: Vec<Piece>) -> Option<ReferenceLine> {
        let place_steps = pieces.iter().map(|piece| piece.shape.steps()).max()?;
        Some(ReferenceLine { pieces, roundings: Vec::new(), breaks_m: Vec::new(), place_steps })
    }

    /// Most steps of work for a place on the line.
    pub fn place_steps(&self) -> u64 {
        self.place_steps
    }

    /// The stations between two others at which another curve begins, m. The search is quick, because a road may have as
    /// many curves as lane sections.
    pub fn beginnings_between(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = f64> {
        let first = self.pieces.partition_point(|piece| piece.begin_m <= from_m);
        let pieces = self.pieces[first..].iter().map(|piece| piece.begin_m);
        let first = self.roundings.partition_point(|curve| curve.begin_m + curve.length_m <= from_m);
        let rounded =
            self.roundings[first..].iter().flat_map(|curve| [curve.begin_m, curve.begin_m + curve.length_m]);
        let within = move |at_m: &f64| *at_m < to_m;
        pieces.take_while(within).chain(rounded.take_while(within))
    }

    /// Whether the line turns between two stations so sharply that no vehicle can follow.
    pub fn breaks_between(&self, from_m: f64, to_m: f64) -> bool {
        let first = self.breaks_m.partition_point(|at_m| *at_m <= from_m);
        self.breaks_m.get(first).is_some_and(|at_m| *at_m < to_m)
    }

    /// Length of all curves between two stations, m.
    pub fn bent_m(&self, from_m: f64, to_m: f64) -> f64 {
        let first = self.pieces.partition_point(|piece| piece.begin_m <= from_m).max(1) - 1;
        let pieces = self.pieces[first..].iter().take_while(|piece| piece.begin_m < to_m);
        let bent = pieces.filter(|piece| !matches!(piece.shape, Shape::Line));
        let within_m = |piece: &Piece| (piece.begin_m + piece.length_m).min(to_m) - piece.begin_m.max(from_m);
        bent.map(|piece| within_m(piece).max(0.0)).sum()
    }

    /// Puts a curve in the place of each corner, and tells all corners.
    ///
    /// Polylines with short pieces stand for bends. Beside such a corner the inner lanes would run backwards, and
    /// all lanes would turn at once with no curvature that tells a driver to slow down.
    pub fn round_corners(&mut self) -> Vec<Corner> {
        let mut corners = Vec::new();
        for index in 1..self.pieces.len() {
            let (before, after) = (&self.pieces[index - 1], &self.pieces[index]);
            let at_m = after.begin_m;
            let (end, begin) = (before.at(at_m - before.begin_m), after.at(0.0));
            let turn_rad = wrap_angle(begin.heading_rad - end.heading_rad);
            if turn_rad.abs() < CORNER_RAD_MIN {
                continue;
            }
            let next_m = self.pieces.get(index + 1).map_or(at_m + after.length_m, |next| next.begin_m);
            let room_m = (at_m - before.begin_m).min(next_m - at_m) / 2.0;
            if room_m < CORNER_M_MIN {
                continue;
            }
            let half_m = room_m
                .min(ROUNDING_RADIUS_M * libm::tan(turn_rad.abs() / 2.0))
                .min(ROUNDED_M_MAX / libm::tan(turn_rad.abs() / 4.0));
            let from = before.at(at_m - half_m - before.begin_m);
            let can_be_rounded = turn_rad.abs() < CORNER_RAD_MAX;
            let shape = can_be_rounded.then(|| rounding(from, after.at(half_m))).flatten();
            let origin = (from.position, from.heading_rad);
            let rounding = shape.map(|shape| Piece::new(at_m - half_m, 2.0 * half_m, origin, shape));
            let position = begin.position;
            let off_m = rounding.as_ref().map(|curve| (curve.at(half_m).position - position).norm());
            corners.push(Corner { at_m, position, turn_rad, off_m });
            match rounding {
                Some(curve) => self.roundings.push(curve),
                None => self.breaks_m.push(at_m),
            }
        }
        corners
    }

    /// Beyond its ends the line goes on straight.
    pub fn at(&self, s_m: f64) -> ReferencePoint {
        let begun = self.roundings.partition_point(|curve| curve.begin_m <= s_m);
        if let Some(curve) =
            self.roundings[..begun].last().filter(|curve| s_m < curve.begin_m + curve.length_m)
        {
            return curve.at(s_m - curve.begin_m);
        }
        let after = self.pieces.partition_point(|piece| piece.begin_m <= s_m);
        let piece = &self.pieces[after.max(1) - 1];
        piece.at(s_m - piece.begin_m)
    }

    /// Largest distance between the end of a piece and the beginning of the next, m, and the station.
    pub fn largest_gap(&self) -> (f64, f64) {
        let mut largest = (0.0, 0.0);
        for pair in self.pieces.windows(2) {
            let end = pair[0].at(pair[1].begin_m - pair[0].begin_m).position;
            let gap_m = (end - pair[1].origin).norm();
            if gap_m > largest.0 {
                largest = (gap_m, pair[1].begin_m);
            }
        }
        largest
    }
}

/// The curve from one point to another that keeps both headings: nearly an arc. `None` if there is no room.
fn rounding(from: ReferencePoint, to: ReferencePoint) -> Option<Shape> {
    let (forward, away) = (unit_vector(from.heading_rad), to.position - from.position);
    let (x, y) = (forward.dot(&away), forward.perp(&away));
    let turn_rad = wrap_angle(to.heading_rad - from.heading_rad);
    if away.norm() < 1e-3 {
        return None;
    }
    // With tangents of this length the cubic is within a thousandth of an arc.
    let tangent = if turn_rad.abs() < 1e-6 {
        away.norm()
    } else {
        2.0 * away.norm() * libm::tan(turn_rad / 4.0) / libm::sin(turn_rad / 2.0)
    };
    let last = unit_vector(turn_rad) * tangent;
    let u = [0.0, tangent, 3.0 * x - 2.0 * tangent - last.x, tangent + last.x - 2.0 * x];
    let v = [0.0, 0.0, 3.0 * y - last.y, last.y - 2.0 * y];
    Shape::cubic(u, v, 1.0)
}

impl Shape {
    /// A clothoid from one curvature to another over a length, m.
    pub fn spiral(begin_per_m: f64, end_per_m: f64, length_m: f64) -> Shape {
        let rate_per_m2 = (end_per_m - begin_per_m) / length_m;
        let sharpest_per_m = begin_per_m.abs().max(end_per_m.abs());
        let steps = (length_m * sharpest_per_m * SPIRAL_STEPS_PER_RAD).ceil().clamp(1.0, SPIRAL_STEPS_MAX);
        let step_m = length_m / steps;
        let mut at = Vec2::zeros();
        let mut nodes = vec![at];
        for i in 0..steps as u32 {
            let (from_m, to_m) = (step_m * f64::from(i), step_m * f64::from(i + 1));
            at += spiral_step(begin_per_m, rate_per_m2, from_m, to_m);
            nodes.push(at);
        }
        Shape::Spiral { begin_per_m, rate_per_m2, nodes, step_m }
    }

    /// A parametric cubic with `p` from 0 to `p_max`. `None` if it stands still somewhere.
    pub fn cubic(u: [f64; 4], v: [f64; 4], p_max: f64) -> Option<Shape> {
        let mut lengths_m = vec![0.0];
        let step = p_max / f64::from(CUBIC_STEPS);
        let mut length_m = 0.0;
        for i in 0..CUBIC_STEPS {
            let from = step * f64::from(i);
            length_m += quadrature(from, from + step, |p| {
                let (du, dv) = (derivative(&u, p), derivative(&v, p));
                libm::sqrt(du * du + dv * dv)
            });
            lengths_m.push(length_m);
        }
        let rising = lengths_m.windows(2).all(|pair| pair[1] > pair[0]);
        (rising && length_m.is_finite()).then_some(Shape::Cubic { u, v, lengths_m, p_max })
    }

    /// Steps of work for a place: about 20 ns each.
    fn steps(&self) -> u64 {
        match self {
            Shape::Line => 1,
            Shape::Arc { .. } => 2,
            Shape::Spiral { .. } | Shape::Cubic { .. } => 10,
        }
    }

    /// The parameter at which a parametric cubic has a length, m; `None` for other shapes.
    pub fn parameter_at(&self, length_m: f64) -> Option<f64> {
        match self {
            Shape::Cubic { u, v, lengths_m, p_max } => Some(parameter_at(u, v, lengths_m, *p_max, length_m)),
            Shape::Line | Shape::Arc { .. } | Shape::Spiral { .. } => None,
        }
    }
}

impl Piece {
    /// A piece with its origin and its heading there, rad.
    pub fn new(begin_m: f64, length_m: f64, (origin, heading_rad): (Vec2, f64), shape: Shape) -> Piece {
        Piece { begin_m, length_m, origin, heading_rad, forward: unit_vector(heading_rad), shape }
    }

    /// Beyond its ends a piece goes on straight.
    fn at(&self, distance_m: f64) -> ReferencePoint {
        let beyond_m = distance_m - distance_m.clamp(0.0, self.length_m);
        if beyond_m.abs() < 1e-6 {
            return self.within(distance_m);
        }
        let end = self.within(distance_m - beyond_m);
        ReferencePoint {
            position: end.position + unit_vector(end.heading_rad) * beyond_m,
            curvature_per_m: 0.0,
            curvature_rate_per_m2: 0.0,
            ..end
        }
    }

    fn within(&self, distance_m: f64) -> ReferencePoint {
        let forward = self.forward;
        let left = Vec2::new(-forward.y, forward.x);
        let local = match &self.shape {
            Shape::Line => local_point(distance_m, 0.0, 0.0, 0.0, 0.0),
            Shape::Arc { curvature_per_m } => arc(*curvature_per_m, distance_m),
            Shape::Spiral { begin_per_m, rate_per_m2, nodes, step_m } => {
                let node = ((distance_m / step_m).max(0.0) as usize).min(nodes.len() - 1);
                let from_m = *step_m * node as f64;
                let position = nodes[node] + spiral_step(*begin_per_m, *rate_per_m2, from_m, distance_m);
                let heading_rad = spiral_heading_rad(*begin_per_m, *rate_per_m2, distance_m);
                let curvature_per_m = begin_per_m + rate_per_m2 * distance_m;
                local_point(position.x, position.y, heading_rad, curvature_per_m, *rate_per_m2)
            }
            Shape::Cubic { u, v, lengths_m, p_max } => {
                // OpenDRIVE counts stations as arc lengths; where the stated length disagrees with the
                // curve's own, the station is stretched so that the curve ends where it says.
                let whole_m = lengths_m[lengths_m.len() - 1];
                cubic(u, v, parameter_at(u, v, lengths_m, *p_max, distance_m / self.length_m * whole_m))
            }
        };
        ReferencePoint {
            position: self.origin + forward * local.position.x + left * local.position.y,
            heading_rad: self.heading_rad + local.heading_rad,
            ..local
        }
    }
}

fn local_point(x_m: f64, y_m: f64, heading_rad: f64, curvature_per_m: f64, rate: f64) -> ReferencePoint {
    ReferencePoint {
        position: Vec2::new(x_m, y_m),
        heading_rad,
        curvature_per_m,
        curvature_rate_per_m2: rate,
    }
}

fn arc(curvature_per_m: f64, distance_m: f64) -> ReferencePoint {
    let turn_rad = curvature_per_m * distance_m;
    if turn_rad.abs() < 1e-9 {
        return local_point(distance_m, turn_rad * distance_m / 2.0, turn_rad, curvature_per_m, 0.0);
    }
    let (sin, cos) = libm::sincos(turn_rad);
    local_point(sin / curvature_per_m, (1.0 - cos) / curvature_per_m, turn_rad, curvature_per_m, 0.0)
}

/// Heading of a clothoid against that of its beginning, rad.
fn spiral_heading_rad(begin_per_m: f64, rate_per_m2: f64, distance_m: f64) -> f64 {
    distance_m * (begin_per_m + distance_m * rate_per_m2 / 2.0)
}

/// The way along a clothoid from one station to another by quadrature: below 1e-9 m of error, as no step turns by more
/// than a quarter radian.
fn spiral_step(begin_per_m: f64, rate_per_m2: f64, from_m: f64, to_m: f64) -> Vec2 {
    let heading_rad = |s_m: f64| spiral_heading_rad(begin_per_m, rate_per_m2, s_m);
    Vec2::new(
        quadrature(from_m, to_m, |s_m| libm::cos(heading_rad(s_m))),
        quadrature(from_m, to_m, |s_m| libm::sin(heading_rad(s_m))),
    )
}

fn cubic(u: &[f64; 4], v: &[f64; 4], p: f64) -> ReferencePoint {
    let (du, dv) = (derivative(u, p), derivative(v, p));
    let (ddu, ddv) = (2.0 * u[2] + 6.0 * u[3] * p, 2.0 * v[2] + 6.0 * v[3] * p);
    let (dddu, dddv) = (6.0 * u[3], 6.0 * v[3]);
    let speed = libm::sqrt(du * du + dv * dv).max(1e-9);
    let cross = du * ddv - dv * ddu;
    let cubed = speed * speed * speed;
    let rate =
        (du * dddv - dv * dddu) / cubed - 3.0 * cross * (du * ddu + dv * ddv) / (cubed * speed * speed);
    local_point(value(u, p), value(v, p), libm::atan2(dv, du), cross / cubed, rate / speed)
}

/// The parameter at an arc length; beyond the ends it goes on at the rate of the last step.
fn parameter_at(u: &[f64; 4], v: &[f64; 4], lengths_m: &[f64], p_max: f64, length_m: f64) -> f64 {
    let after = lengths_m.partition_point(|at_m| *at_m <= length_m);
    let index = after.clamp(1, lengths_m.len() - 1) - 1;
    let step = p_max / (lengths_m.len() - 1) as f64;
    let begin = step * index as f64;
    let fraction = (length_m - lengths_m[index]) / (lengths_m[index + 1] - lengths_m[index]);
    let mut p = begin + step * fraction;
    if !(0.0..=1.0).contains(&fraction) {
        return p;
    }
    let speed = |p: f64| {
        let (du, dv) = (derivative(u, p), derivative(v, p));
        libm::sqrt(du * du + dv * dv)
    };
    // Newton's method; the table makes the first guess good to a thousandth.
    for _ in 0..4 {
        let excess_m = lengths_m[index] + quadrature(begin, p, speed) - length_m;
        p = (p - excess_m / speed(p).max(1e-9)).clamp(begin, begin + step);
    }
    p
}

fn value(c: &[f64; 4], p: f64) -> f64 {
    c[0] + p * (c[1] + p * (c[2] + p * c[3]))
}

fn derivative(c: &[f64; 4], p: f64) -> f64 {
    c[1] + p * (2.0 * c[2] + p * 3.0 * c[3])
}

fn quadrature(from: f64, to: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    GAUSS.iter().map(|(at, weight)| weight * function(middle + half * at)).sum::<f64>() * half
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use super::*;

    fn piece(length_m: f64, shape: Shape) -> Piece {
        Piece::new(0.0, length_m, (Vec2::zeros(), 0.0), shape)
    }

    /// Fresnel integrals at 1 (Abramowitz and Stegun, table 7.7): C = 0.7798934, S = 0.4382591.
    #[test]
    fn a_spiral_is_the_fresnel_integral() {
        let end_per_m = core::f64::consts::PI;
        let end = piece(1.0, Shape::spiral(0.0, end_per_m, 1.0)).at(1.0);
        assert!((end.position - Vec2::new(0.779_893_400_4, 0.438_259_147_4)).norm() < 1e-9, "{end:?}");
        assert!((end.heading_rad - FRAC_PI_2).abs() < 1e-12);
    }

    /// Straights of 4 m that turn by a twelfth of a circle stand for a circle: the rounded line has its radius.
    #[test]
    fn corners_become_the_bend_that_they_stand_for() {
        let turn_rad = FRAC_PI_2 / 6.0;
        let mut at = (Vec2::zeros(), 0.0);
        let pieces = (0..6).map(|i| {
            let straight = Piece::new(4.0 * f64::from(i), 4.0, at, Shape::Line);
            at = (at.0 + unit_vector(at.1) * 4.0, at.1 + turn_rad);
            straight
        });
        let mut line = ReferenceLine::new(pieces.collect()).unwrap();
        let corners = line.round_corners();
        assert_eq!(corners.len(), 5);
        assert!(corners.iter().all(|corner| corner.off_m.is_some_and(|off_m| off_m < 0.14)), "{corners:?}");
        let radius_m = 2.0 / libm::tan(turn_rad / 2.0);
        let mut before = line.at(2.0);
        for i in 21..220 {
            let here = line.at(f64::from(i) * 0.1);
            assert!((here.curvature_per_m * radius_m - 1.0).abs() < 0.01, "{here:?}");
            assert!((here.position - before.position).norm() < 0.101, "{here:?}");
            assert!(wrap_angle(here.heading_rad - before.heading_rad).abs() < 0.11 / radius_m);
            before = here;
        }
        assert_eq!(line.at(1.0).curvature_per_m, 0.0);
    }

    #[test]
    fn a_line_that_turns_back_is_not_rounded() {
        let there = piece(4.0, Shape::Line);
        let back = Piece::new(4.0, 4.0, (Vec2::new(4.0, 0.0), 3.0), Shape::Line);
        let mut line = ReferenceLine::new(vec![there, back]).unwrap();
        assert_eq!(line.round_corners()[0].off_m, None);
        assert!(line.breaks_between(3.0, 5.0) && !line.breaks_between(4.0, 8.0));
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let shapes = [
            Shape::Line,
            Shape::Arc { curvature_per_m: -0.2 },
            Shape::spiral(0.1, -0.3, 10.0),
            Shape::cubic([0.0, 12.0, 1.0, -2.0], [0.0, 0.0, 5.0, -1.0], 1.0).unwrap(),
            Shape::cubic([0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.01, 0.002], 10.0).unwrap(),
        ];
        for shape in shapes {
            let length_m = match &shape {
                Shape::Cubic { lengths_m, .. } => *lengths_m.last().unwrap(),
                _ => 10.0,
            };
            let curve = piece(length_m, shape);
            for i in 1..20 {
                let (s, h) = (length_m * f64::from(i) / 20.0, 1e-4);
                let (a, b, c) = (curve.at(s - h), curve.at(s), curve.at(s + h));
                let tangent = (c.position - a.position) / (2.0 * h);
                assert!((tangent - unit_vector(b.heading_rad)).norm() < 1e-6, "{curve:?} at {s}");
                let curvature = (c.heading_rad - a.heading_rad) / (2.0 * h);
                assert!((curvature - b.curvature_per_m).abs() < 1e-5, "{curve:?} at {s}");
                let rate = (c.curvature_per_m - a.curvature_per_m) / (2.0 * h);
                assert!((rate - b.curvature_rate_per_m2).abs() < 1e-4, "{curve:?} at {s}");
            }
        }
    }
}
