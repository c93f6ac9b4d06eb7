//! The ways that trajectories of a file lead: straight pieces, clothoids, curves of control points.

use avastra_base::geometry::{Path, Pose, Vec2, unit_vector, wrap_angle};
use roxmltree::Node;

use super::catalogue;
use super::place::Places;
use super::position::{Position, position};
use super::source::{Mark, Source, element, elements};

/// Curves are drawn in pieces that lie this near to them, m.
const NEAR_M: f64 = 0.005;

/// The longest piece of a curve, m, and the number of pieces beyond which a way is a mistake.
const PIECE_M: f64 = 5.0;
const PIECES_MAX: usize = 4_000;

/// The highest order of a curve of control points, and the most of these.
const ORDER_MAX: usize = 10;
const CONTROLS_MAX: usize = 1_000;

/// A longer way is a mistake, m.
const WAY_M_MAX: f64 = 50_000.0;

/// Knots of a curve of control points are looked at in so many steps each.
const STEPS: usize = 16;

/// A way, and the times at which an entity is at its places, if the file says that.
#[derive(Debug, Clone)]
pub struct Shape {
    pub mark: Mark,
    /// Whether it has times that are not read.
    pub drops_times: bool,
    kind: ShapeKind,
}

#[derive(Debug, Clone)]
enum ShapeKind {
    /// Places, each with its time, s.
    Polyline(Vec<(Position, Option<f64>)>),
    Spline(Vec<Segment>),
    Nurbs {
        order: usize,
        controls: Vec<(Position, f64)>,
        knots: Vec<f64>,
    },
}

/// A piece whose curvature changes evenly.
#[derive(Debug, Clone)]
struct Segment {
    /// Where it begins, if not at the end of the one before it, or where the entity is.
    start: Option<Position>,
    from_per_m: f64,
    to_per_m: f64,
    length_m: f64,
}

/// A way in the plane.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub points: Vec<Vec2>,
    pub path: Path,
    /// Stations with the times at which they are reached, m and s; empty if the file says none.
    pub timed: Vec<(f64, f64)>,
    /// Whether some of its vertices have a time and others have none.
    pub is_timed_in_part: bool,
    /// The vertex whose stated heading is farthest from the way's direction there, and by how much, rad.
    pub turned: Option<(Mark, f64)>,
}

/// The shape within a `TrajectoryRef`, or within a `FollowTrajectoryAction` of 1.0.
pub fn shape_of(source: &mut Source, parent: Node) -> Option<Shape> {
    if let Some(trajectory) = element(parent, "Trajectory") {
        return shape(source, trajectory);
    }
    let reference = source.required(parent, "CatalogReference")?;
    catalogue::entry(source, reference, &[catalogue::TRAJECTORY], shape)
}

fn shape(source: &mut Source, trajectory: Node) -> Option<Shape> {
    source.scoped(trajectory, |source| shape_in(source, trajectory))
}

fn shape_in(source: &mut Source, trajectory: Node) -> Option<Shape> {
    if source.switch(trajectory, "closed", false)? {
        return source.refuse(trajectory, "a trajectory leads one way: `closed` leads back");
    }
    let outer = source.required(trajectory, "Shape")?;
    let Some(inner) = super::source::children(outer).next() else {
        return source.refuse(outer, "it is empty");
    };
    let mark = source.mark(inner);
    let mut drops_times = false;
    let kind = match inner.tag_name().name() {
        "Polyline" => {
            let mut vertices = Vec::new();
            for vertex in elements(inner, "Vertex") {
                let place = source.required(vertex, "Position")?;
                let time_s = match vertex.has_attribute("time") {
                    true => Some(source.number(vertex, "time")?),
                    false => None,
                };
                vertices.push((position(source, place)?, time_s));
            }
            source.refuse_if(vertices.len() < 2, inner, "it has fewer than two vertices")?;
            source.refuse_if(vertices.len() > PIECES_MAX, inner, "it has too many vertices")?;
            ShapeKind::Polyline(vertices)
        }
        "ClothoidSpline" => {
            let mut segments = Vec::new();
            for node in elements(inner, "ClothoidSplineSegment") {
                let start = match element(node, "PositionStart") {
                    Some(place) => Some(position(source, place)?),
                    None => None,
                };
                let turns = source.number_or(node, "hOffset", 0.0)? != 0.0;
                source.refuse_if(turns, node, "`hOffset` is a corner in the way, which is not read")?;
                drops_times |= node.has_attribute("timeStart");
                segments.push(Segment {
                    start,
                    from_per_m: source.left(node, "curvatureStart")?,
                    to_per_m: source.left(node, "curvatureEnd")?,
                    length_m: source.amount(node, "length")?,
                });
            }
            drops_times |= inner.has_attribute("timeEnd");
            source.refuse_if(segments.is_empty(), inner, "it has no segments")?;
            source.refuse_if(segments.len() > PIECES_MAX, inner, "it has too many segments")?;
            ShapeKind::Spline(segments)
        }
        "Clothoid" => {
            let place = source.required(inner, "Position")?;
            let start = Some(position(source, place)?);
            let length_m = source.amount(inner, "length")?;
            let from_per_m = source.left(inner, "curvature")?;
            let name = if inner.has_attribute("curvaturePrime") { "curvaturePrime" } else { "curvatureDot" };
            let to_per_m = from_per_m + source.left(inner, name)? * length_m;
            drops_times = inner.has_attribute("startTime") || inner.has_attribute("stopTime");
            ShapeKind::Spline(vec![Segment { start, from_per_m, to_per_m, length_m }])
        }
        "Nurbs" => {
            let order = source.integer(inner, "order")?.max(0) as usize;
            let (mut controls, mut knots) = (Vec::new(), Vec::new());
            for node in elements(inner, "ControlPoint") {
                let place = source.required(node, "Position")?;
                controls.push((position(source, place)?, source.number_or(node, "weight", 1.0)?));
                drops_times |= node.has_attribute("time");
            }
            for node in elements(inner, "Knot") {
                knots.push(source.number(node, "value")?);
            }
            let fits = order >= 2 && controls.len() >= order && knots.len() == controls.len() + order;
            let is_rising = knots.windows(2).all(|pair| pair[0] <= pair[1]);
            source.refuse_if(!fits || !is_rising, inner, "its order, control points and knots do not fit")?;
            let is_large = order > ORDER_MAX || controls.len() > CONTROLS_MAX;
            source.refuse_if(
                is_large,
                inner,
                format!("curves of order {ORDER_MAX} and {CONTROLS_MAX} points are read"),
            )?;
            let is_light = controls.iter().any(|(_, weight)| *weight <= 0.0);
            source.refuse_if(is_light, inner, "the weight of a control point is above 0")?;
            ShapeKind::Nurbs { order, controls, knots }
        }
        _ => return source.refuse(inner, "such a shape is not read"),
    };
    if drops_times {
        source.note(
            "the times of a clothoid or of control points are not taken over: their road user keeps its speed",
        );
    }
    Some(Shape { mark, drops_times, kind })
}

impl Shape {
    /// The way in the plane. `here` is where its entity is, for a way that begins there.
    pub fn drawn(&self, source: &mut Source, places: &mut Places, here: Option<Pose>) -> Option<Drawn> {
        let (mut timed, mut is_timed_in_part, mut turned) = (Vec::new(), false, None);
        let points = match &self.kind {
            ShapeKind::Polyline(vertices) => {
                let (mut points, mut headings): (Vec<Vec2>, Vec<Option<f64>>) = (Vec::new(), Vec::new());
                let mut station_m = 0.0;
                for (position, time_s) in vertices {
                    let pose = places.placed(source, position)?.pose;
                    let point = pose.position;
                    headings.push(position.states_heading.then_some(pose.heading_rad));
                    station_m += points.last().map_or(0.0, |last| (point - last).norm());
                    timed.extend(time_s.map(|time_s| (station_m, time_s)));
                    points.push(point);
                }
                is_timed_in_part = !timed.is_empty() && timed.len() < vertices.len();
                if is_timed_in_part {
                    timed.clear();
                }
                let marks = vertices.iter().map(|(position, _)| position.mark.clone());
                let all = marks.zip(turns_rad(&points, &headings));
                turned = all.max_by(|a, b| a.1.total_cmp(&b.1));
                points
            }
            ShapeKind::Spline(segments) => {
                let (mut pose, mut points) = (here, Vec::new());
                for segment in segments {
                    if let Some(start) = &segment.start {
                        pose = Some(places.placed(source, start)?.pose);
                    }
                    let Some(begin) = pose else {
                        return source.refuse(&self.mark, "it does not say where it begins");
                    };
                    pose = Some(segment.draw(begin, &mut points));
                    let reason = "it is longer than a way can be";
                    source.refuse_if(points.len() > PIECES_MAX, &self.mark, reason)?;
                }
                points
            }
            ShapeKind::Nurbs { order, controls, knots } => {
                let mut known = Vec::new();
                for (position, weight) in controls {
                    known.push((places.placed(source, position)?.pose.position, *weight));
                }
                nurbs(*order, &known, knots)
            }
        };
        match Path::through(&points) {
            Some(path) if path.length_m() > WAY_M_MAX => {
                source.refuse(&self.mark, "it is longer than a way can be")
            }
            Some(path) => Some(Drawn { points, path, timed, is_timed_in_part, turned }),
            None => source.refuse(&self.mark, "its way has no length"),
        }
    }
}

/// By how much each heading is turned out of the directions in which a way comes to its point and leaves it, rad; 0 of none.
/// At an end the way is taken to bend on as it does beside it.
fn turns_rad(points: &[Vec2], headings: &[Option<f64>]) -> Vec<f64> {
    let ways = points.windows(2).map(|pair| pair[1] - pair[0]);
    let known: Vec<Option<f64>> =
        ways.map(|way| (way.norm() > 1e-6).then(|| libm::atan2(way.y, way.x))).collect();
    let beyond = |end: f64, next: Option<f64>| next.map_or(end, |next| end + wrap_angle(end - next));
    headings
        .iter()
        .enumerate()
        .map(|(nth, heading)| {
            let mut before = known[..nth].iter().rev().copied().flatten();
            let mut after = known[nth..].iter().copied().flatten();
            let (comes, leaves) = match (before.next(), after.next()) {
                (Some(comes), Some(leaves)) => (comes, leaves),
                (Some(comes), None) => (comes, beyond(comes, before.next())),
                (None, Some(leaves)) => (beyond(leaves, after.next()), leaves),
                (None, None) => return 0.0,
            };
            let Some(heading) = heading else { return 0.0 };
            let [a, b] = [comes, leaves].map(|way| wrap_angle(heading - way));
            let is_between = a * b <= 0.0 && a.abs() + b.abs() < core::f64::consts::PI;
            if is_between { 0.0 } else { a.abs().min(b.abs()) }
        })
        .collect()
}

impl Segment {
    /// Adds its points, the first one included; where it ends.
    fn draw(&self, begin: Pose, points: &mut Vec<Vec2>) -> Pose {
        let sharpest_per_m = self.from_per_m.abs().max(self.to_per_m.abs());
        let is_straight = sharpest_per_m == 0.0;
        let piece_m =
            if is_straight { self.length_m } else { (8.0 * NEAR_M / sharpest_per_m).sqrt().min(PIECE_M) };
        let count = (self.length_m / piece_m).ceil().clamp(1.0, PIECES_MAX as f64);
        let step_m = self.length_m / count;
        if points.last().is_none_or(|last| (last - begin.position).norm() > 1e-6) {
            points.push(begin.position);
        }
        let heading_at = |s_m: f64| {
            let bend_per_m2 = (self.to_per_m - self.from_per_m) / self.length_m.max(f64::MIN_POSITIVE);
            begin.heading_rad + self.from_per_m * s_m + bend_per_m2 * s_m * s_m / 2.0
        };
        let mut at = begin.position;
        for nth in 0..count as usize {
            // Simpson's rule over each piece, which turns little.
            let from_m = nth as f64 * step_m;
            let [first, middle, last] =
                [0.0, 0.5, 1.0].map(|part| unit_vector(heading_at(from_m + part * step_m)));
            at += (first + middle * 4.0 + last) * (step_m / 6.0);
            points.push(at);
        }
        Pose { position: at, heading_rad: heading_at(self.length_m) }
    }
}

/// A curve by de Boor's algorithm, in weighted points.
fn nurbs(order: usize, controls: &[(Vec2, f64)], knots: &[f64]) -> Vec<Vec2> {
    let degree = order - 1;
    let mut points = Vec::new();
    for span in degree..controls.len() {
        if knots[span + 1] <= knots[span] {
            continue;
        }
        let last = if span + 1 == controls.len() { STEPS } else { STEPS - 1 };
        for step in 0..=last {
            let at = knots[span] + (knots[span + 1] - knots[span]) * step as f64 / STEPS as f64;
            let mut weighted: Vec<(Vec2, f64)> = (0..=degree)
                .map(|nth| controls[span - degree + nth])
                .map(|(point, weight)| (point * weight, weight))
                .collect();
            for level in 1..=degree {
                for nth in (level..=degree).rev() {
                    let low = knots[span - degree + nth];
                    let part = (at - low) / (knots[span + 1 + nth - level] - low);
                    let (before, here) = (weighted[nth - 1], weighted[nth]);
                    weighted[nth] =
                        (before.0 * (1.0 - part) + here.0 * part, before.1 * (1.0 - part) + here.1 * part);
                }
            }
            let (sum, weight) = weighted[degree];
            points.push(sum / weight);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_and_curves_lead_where_they_should() {
        let arc =
            Segment { start: None, from_per_m: 0.1, to_per_m: 0.1, length_m: 5.0 * core::f64::consts::PI };
        let mut points = Vec::new();
        let end = arc.draw(Pose::new(0.0, 0.0, 0.0), &mut points);
        assert!((end.position - Vec2::new(10.0, 10.0)).norm() < 0.01, "{:?}", end.position);
        let clothoid = Segment { start: None, from_per_m: 0.0, to_per_m: 0.1, length_m: 10.0 };
        let end = clothoid.draw(Pose::new(0.0, 0.0, 0.0), &mut Vec::new());
        // Fresnel's integrals by their series: x = L - L θ² / 10, y = L θ / 3 - L θ³ / 42, with θ = 0.5.
        assert!((end.position - Vec2::new(9.7578, 1.6375)).norm() < 0.01, "{:?}", end.position);
        let half = 0.5_f64.sqrt();
        let quarter = [(Vec2::new(1.0, 0.0), 1.0), (Vec2::new(1.0, 1.0), half), (Vec2::new(0.0, 1.0), 1.0)];
        let points = nurbs(3, &quarter, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert!(points.iter().all(|point| (point.norm() - 1.0).abs() < 1e-9), "a quarter circle");
    }
}
