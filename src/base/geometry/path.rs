//! Paths: polylines dense enough to be read as smooth curves.
//!
//! A path carries station, heading and curvature at each vertex. Between vertices the position is a chord
//! with the heading interpolated. Makers sample so densely that the chord is within a millimetre of the curve
//! (see `road`), so no user of a path needs the curve itself.
//!
//! Where a point lies beside a path can be asked in four ways:
//!
//! | function | answer | for |
//! |---|---|---|
//! | [`Path::project`] | the nearest point of all, exact | a point that may be anywhere |
//! | [`Path::project_near`] | the nearest point of a stretch, exact | a vehicle that was seen there before |
//! | [`Path::project_from`] | a point at a right angle near a guess, within 2 cm; none far aside | drivers, for every other road user |
//! | `ads::kit` | the tangent of the nearest even sample | a driving system, for every predicted position |

use super::beside::Beside;
use super::extreme::larger;
use super::pose::{Pose, Vec2, unit_vector, wrap_angle};

/// A vertex of a [`Path`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Distance from the beginning, along the path, m.
    pub station_m: f64,
    pub position: Vec2,
    pub heading_rad: f64,
    /// 1/m, positive to the left.
    pub curvature_per_m: f64,
}

/// Where a point lies beside a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// m along the path, within `[0, length]`.
    pub station_m: f64,
    /// m to the left of the path.
    pub offset_m: f64,
    /// Distance to the nearest point of the path, m; larger than `|offset_m|` beyond the ends.
    pub distance_m: f64,
}

/// A straight line between two places of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    pub begin: Vec2,
    /// Unit vector along it.
    pub forward: Vec2,
    pub heading_rad: f64,
    /// Whether the path is straight from the one place to the other.
    pub is_straight: bool,
}

/// A directed curve: at least two vertices, stations strictly rising from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    points: Vec<PathPoint>,
    /// The unit vector along the heading of each vertex.
    forwards: Vec<Vec2>,
    /// Whether each segment is straight: both its vertices head along it.
    straights: Vec<bool>,
    /// The segment that holds each of some evenly spread places: where the search for a station begins; with [`SURE`]
    /// where it ends there, too.
    cells: Vec<u32>,
    cells_per_m: f64,
    /// The box around each run of [`BLOCK`] segments.
    blocks: Vec<Bounds>,
    sharpest_per_m: f64,
}

/// Number of segments that share a box: a projection looks only into boxes that can hold its answer.
const BLOCK: usize = 16;

/// Number of cells for each vertex: bends have many vertices close together, and a cell should hold few of them.
const CELLS_PER_VERTEX: usize = 8;

/// Marks a cell that lies in one segment, as do those beside it, so that rounding changes nothing.
const SURE: u32 = 1 << 31;

/// A segment whose end is less than this beside the heading of its beginning is straight, m.
const STRAIGHT_M: f64 = 1e-6;

/// A path turns at once by more than this, rad; less is rounding.
const TURN_RAD_MIN: f64 = 1e-6;

/// Length of the segment in which a path turns at once, m.
const TURN_M: f64 = 1e-4;

/// Moves the last vertex back by [`TURN_M`] along its segment. `false` if there is no segment long enough.
fn step_back(points: &mut [PathPoint]) -> bool {
    let [.., before, last] = points else { return false };
    let chord_m = last.station_m - before.station_m;
    if chord_m < 2.0 * TURN_M {
        return false;
    }
    last.position -= (last.position - before.position) * (TURN_M / chord_m);
    last.station_m -= TURN_M;
    true
}

/// A box with its sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub least: Vec2,
    pub most: Vec2,
}

impl Bounds {
    /// Around the vertices of a path, of which there is at least one.
    pub fn of(points: &[PathPoint]) -> Bounds {
        Bounds::grow(points[0].position, points.iter().map(|point| point.position))
    }

    /// Around some points, of which there is at least one.
    pub fn around(points: &[Vec2]) -> Bounds {
        Bounds::grow(points[0], points.iter().copied())
    }

    fn grow(begin: Vec2, points: impl Iterator<Item = Vec2>) -> Bounds {
        points.fold(Bounds { least: begin, most: begin }, |bounds, point| Bounds {
            least: bounds.least.inf(&point),
            most: bounds.most.sup(&point),
        })
    }

    /// Around this box and another.
    pub fn with(&self, other: &Bounds) -> Bounds {
        Bounds { least: self.least.inf(&other.least), most: self.most.sup(&other.most) }
    }

    /// Squared distance to the box, m²; rounded down, so that no point of a segment in it is nearer.
    pub fn distance_m2_min(&self, point: Vec2) -> f64 {
        let outside_m =
            |axis: usize| larger(larger(self.least[axis] - point[axis], point[axis] - self.most[axis]), 0.0);
        let (x_m, y_m) = (outside_m(0), outside_m(1));
        (x_m * x_m + y_m * y_m) * (1.0 - 1e-9)
    }

    /// The box that reaches farther by `room_m` on each side.
    pub fn grown(&self, room_m: f64) -> Bounds {
        let room = Vec2::repeat(room_m);
        Bounds { least: self.least - room, most: self.most + room }
    }

    /// Whether the boxes share a point.
    pub fn meets(&self, other: &Bounds) -> bool {
        (0..2).all(|axis| self.least[axis] <= other.most[axis] && other.least[axis] <= self.most[axis])
    }
}

/// Two straight pieces that meet at less than this stand for a curve, rad. Ours: turns of 5 m radius that are drawn to 2 cm have
/// 0.25 rad a piece.
const CORNER_RAD: f64 = 0.26;

impl Path {
    /// A path through points that already know their heading and curvature.
    ///
    /// Stations are measured anew as chord lengths from 0; points closer than 1 µm to their predecessor are
    /// dropped. If such a point has another heading, the path turns there at once, and the predecessor moves
    /// back a little. Otherwise its heading would reach into the next segment. `None` if fewer than two
    /// remain.
    pub fn new(samples: impl IntoIterator<Item = (Vec2, f64, f64)>) -> Option<Path> {
        let mut points: Vec<PathPoint> = Vec::new();
        for (position, heading_rad, curvature_per_m) in samples {
            let station_m = match points.last() {
                None => 0.0,
                Some(last) => {
                    let chord_m = (position - last.position).norm();
                    if chord_m < 1e-6 {
                        let turn_rad = wrap_angle(heading_rad - last.heading_rad);
                        if turn_rad.abs() < TURN_RAD_MIN || !step_back(&mut points) {
                            continue;
                        }
                    }
                    let last = points[points.len() - 1];
                    last.station_m + (position - last.position).norm()
                }
            };
            points.push(PathPoint { station_m, position, heading_rad, curvature_per_m });
        }
        if points.len() < 2 {
            return None;
        }
        let cell_count = points.len() * CELLS_PER_VERTEX;
        let cells_per_m = cell_count as f64 / points[points.len() - 1].station_m;
        let mut segment = 0;
        let cells = (0..cell_count).map(|cell| {
            let from_m = cell as f64 / cells_per_m;
            while segment + 2 < points.len() && points[segment + 1].station_m <= from_m {
                segment += 1;
            }
            segment as u32
        });
        let blocks = (0..points.len() - 1).step_by(BLOCK).map(|first| {
            let last = (first + BLOCK).min(points.len() - 1);
            Bounds::of(&points[first..=last])
        });
        let segments: Vec<u32> = cells.collect();
        let last = points.len() as u32 - 2;
        let is_sure = |cell: usize| {
            let (before, after) = (segments[cell.saturating_sub(1)], segments.get(cell + 1).unwrap_or(&last));
            before == segments[cell] && *after == segments[cell]
        };
        let cells = (0..cell_count).map(|cell| segments[cell] | if is_sure(cell) { SURE } else { 0 });
        let forwards = points.iter().map(|point| unit_vector(wrap_angle(point.heading_rad)));
        let forwards: Vec<Vec2> = forwards.collect();
        let is_straight = |(pair, forward): (&[PathPoint], &Vec2)| {
            let chord = pair[1].position - pair[0].position;
            pair[0].heading_rad == pair[1].heading_rad
                && forward.perp(&chord).abs() < STRAIGHT_M
                && forward.dot(&chord) > 0.0
        };
        Some(Path {
            cells: cells.collect(),
            cells_per_m,
            blocks: blocks.collect(),
            straights: points.windows(2).zip(&forwards).map(is_straight).collect(),
            forwards,
            sharpest_per_m: points.iter().map(|point| point.curvature_per_m.abs()).fold(0.0, f64::max),
            points,
        })
    }

    /// A path straight from point to point. At slight bends its heading turns evenly, at others at once. `None` if fewer than two
    /// points differ.
    pub fn through(points: &[Vec2]) -> Option<Path> {
        let mut apart: Vec<Vec2> = Vec::new();
        for point in points {
            if apart.last().is_none_or(|last| (point - last).norm() > 1e-6) {
                apart.push(*point);
            }
        }
        let headings: Vec<f64> = apart
            .windows(2)
            .map(|pair| {
                let way = pair[1] - pair[0];
                libm::atan2(way.y, way.x)
            })
            .collect();
        let mut samples = Vec::new();
        for (nth, point) in apart.iter().enumerate() {
            let (before, after) = (nth.checked_sub(1).and_then(|nth| headings.get(nth)), headings.get(nth));
            match (before, after) {
                (Some(before), Some(after)) => {
                    let turn_rad = wrap_angle(after - before);
                    if turn_rad.abs() < CORNER_RAD {
                        let pieces_m = (point - apart[nth - 1]).norm() + (apart[nth + 1] - point).norm();
                        samples.push((
                            *point,
                            wrap_angle(before + turn_rad / 2.0),
                            2.0 * turn_rad / pieces_m,
                        ));
                    } else {
                        samples.extend([(*point, *before, 0.0), (*point, *after, 0.0)]);
                    }
                }
                (Some(heading), None) | (None, Some(heading)) => samples.push((*point, *heading, 0.0)),
                (None, None) => {}
            }
        }
        Path::new(samples)
    }

    pub fn points(&self) -> &[PathPoint] {
        &self.points
    }

    pub fn length_m(&self) -> f64 {
        self.points[self.points.len() - 1].station_m
    }

    /// The greatest curvature at a vertex, to either side, 1/m.
    pub fn sharpest_per_m(&self) -> f64 {
        self.sharpest_per_m
    }

    /// The box around the whole path.
    pub fn bounds(&self) -> Bounds {
        self.blocks.iter().fold(self.blocks[0], |bounds, block| bounds.with(block))
    }

    /// The segments, in order, of those runs whose box meets the box: none that meets it is left out.
    pub fn segments_near<'a>(&'a self, near: &'a Bounds) -> impl Iterator<Item = &'a [PathPoint]> {
        let blocks = self.blocks.iter().enumerate().filter(|(_, block)| block.meets(near));
        blocks.flat_map(|(block, _)| {
            let last = ((block + 1) * BLOCK).min(self.points.len() - 1);
            self.points[block * BLOCK..=last].windows(2)
        })
    }

    /// The box around the part between two stations.
    pub fn bounds_between(&self, from_m: f64, to_m: f64) -> Bounds {
        let inner = &self.points[self.vertex_after(from_m)..=self.vertex_after(to_m)];
        let inner = inner.iter().take_while(|point| point.station_m < to_m).map(|point| point.position);
        Bounds::grow(self.position_at(from_m), inner.chain([self.position_at(to_m)]))
    }

    /// The pose at a station; beyond the ends the path goes on straight.
    pub fn pose_at(&self, station_m: f64) -> Pose {
        let (index, fraction) = self.locate(station_m);
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        Pose {
            position: a.position + (b.position - a.position) * fraction,
            heading_rad: heading_between(a, b, fraction),
        }
    }

    /// The heading of [`Path::pose_at`], rad.
    pub fn heading_at(&self, station_m: f64) -> f64 {
        let (index, fraction) = self.locate(station_m);
        heading_between(&self.points[index], &self.points[index + 1], fraction)
    }

    /// The position of [`Path::pose_at`], without the work for its heading.
    pub fn position_at(&self, station_m: f64) -> Vec2 {
        let (index, fraction) = self.locate(station_m);
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        a.position + (b.position - a.position) * fraction
    }

    /// The position of [`Path::pose_at`], and the unit vector along its heading: without trigonometry where the path is
    /// straight.
    pub fn along(&self, station_m: f64) -> (Vec2, Vec2) {
        let (index, fraction) = self.locate(station_m);
        self.along_segment(index, fraction)
    }

    /// As [`Path::along`], at a fraction of a segment.
    fn along_segment(&self, index: usize, fraction: f64) -> (Vec2, Vec2) {
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        let forward = if a.heading_rad == b.heading_rad {
            self.forwards[index]
        } else {
            unit_vector(heading_between(a, b, fraction))
        };
        (a.position + (b.position - a.position) * fraction, forward)
    }

    /// The straight line from the place at one station to that at a later one: without trigonometry where the path is straight.
    pub fn chord(&self, from_m: f64, to_m: f64) -> Chord {
        let (index, fraction) = self.locate(from_m);
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        let begin = a.position + (b.position - a.position) * fraction;
        let reaches_to = to_m <= b.station_m || index + 2 == self.points.len();
        if self.straights[index] && reaches_to && (fraction >= 0.0 || index == 0) {
            let heading_rad = wrap_angle(a.heading_rad);
            return Chord { begin, forward: self.forwards[index], heading_rad, is_straight: true };
        }
        let along = self.position_at(to_m) - begin;
        let heading_rad = libm::atan2(along.y, along.x);
        Chord { begin, forward: along / along.norm(), heading_rad, is_straight: false }
    }

    /// 1/m, positive to the left; 0 beyond the ends.
    pub fn curvature_at(&self, station_m: f64) -> f64 {
        let (index, fraction) = self.locate(station_m);
        if !(0.0..=1.0).contains(&fraction) {
            return 0.0;
        }
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        a.curvature_per_m + (b.curvature_per_m - a.curvature_per_m) * fraction
    }

    /// The nearest point of the whole path; the first, if several are equally near.
    pub fn project(&self, point: Vec2) -> Projection {
        self.project_segments(point, 0, self.points.len() - 1)
    }

    /// How far along the path and to its left a point lies, m. Before its start and beyond its end it goes on straight.
    pub fn beside(&self, point: Vec2) -> (f64, f64) {
        let nearest_m = self.project(point).station_m;
        let (position, along) = self.along(nearest_m);
        let away = point - position;
        (nearest_m + along.dot(&away), along.perp(&away))
    }

    /// How far it turns between two stations, rad to the left; more than half a turn, too.
    pub fn turned_rad(&self, from_m: f64, to_m: f64) -> f64 {
        let heading_rad = |part: u32| self.heading_at(from_m + (to_m - from_m) * f64::from(part) / 8.0);
        (0..8).map(|part| wrap_angle(heading_rad(part + 1) - heading_rad(part))).sum()
    }

    /// The nearest point among stations within `reach_m` of `near_m`: quicker, and does not jump
    /// to another branch where the path passes near itself.
    pub fn project_near(&self, point: Vec2, near_m: f64, reach_m: f64) -> Projection {
        let first = self.segment(near_m - reach_m);
        let last = self.segment(near_m + reach_m) + 1;
        self.project_segments(point, first, last)
    }

    /// Where a point lies beside the path, by stepping along tangents from a guess that is at most a bend
    /// away: much quicker than a search. `None` for points so far aside that the steps do not settle.
    pub fn project_from(&self, point: Vec2, guess_m: f64) -> Option<Beside> {
        let mut station_m = guess_m;
        for _ in 0..5 {
            let (index, fraction) = self.locate(station_m);
            let (position, forward) = self.along_segment(index, fraction);
            let away = point - position;
            let ahead_m = forward.dot(&away);
            station_m += ahead_m;
            // On a straight segment one step leads there.
            let stays = self.straights[index]
                && (station_m >= self.points[index].station_m || index == 0)
                && (station_m <= self.points[index + 1].station_m || index + 2 == self.points.len());
            if stays || ahead_m.abs() < 0.02 {
                return Some(Beside { station_m, offset_m: forward.perp(&away), forward });
            }
        }
        None
    }

    /// The part between two stations, clamped to the path. `None` if it is shorter than 1 µm.
    pub fn part(&self, from_m: f64, to_m: f64) -> Option<Path> {
        let (from_m, to_m) = (from_m.max(0.0), to_m.min(self.length_m()));
        let end = |station_m: f64| {
            let pose = self.pose_at(station_m);
            (pose.position, pose.heading_rad, self.curvature_at(station_m))
        };
        if to_m - from_m < 1e-6 {
            return None;
        }
        let inner = self.points.iter().filter(|p| p.station_m > from_m + 1e-6 && p.station_m < to_m - 1e-6);
        let inner = inner.map(|p| (p.position, p.heading_rad, p.curvature_per_m));
        Path::new([end(from_m)].into_iter().chain(inner).chain([end(to_m)]))
    }

    /// This path followed by others; each is expected to begin where the one before ends.
    pub fn join<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Option<Path> {
        let points = paths.into_iter().flat_map(|path| &path.points);
        Path::new(points.map(|p| (p.position, p.heading_rad, p.curvature_per_m)))
    }

    /// The nearest point among the segments from `first` up to the vertex `last`.
    fn project_segments(&self, point: Vec2, first: usize, last: usize) -> Projection {
        if last - first <= BLOCK {
            return self.projection(point, self.nearest(point, first..last));
        }
        let blocks = first / BLOCK..=(last - 1) / BLOCK;
        let within = |block: usize| (block * BLOCK).max(first)..((block + 1) * BLOCK).min(last);
        let bound = |block: usize| self.blocks[block].distance_m2_min(point);
        // The nearest box is a guess: the distance to what is in it rules out most other boxes.
        let mut guess = (*blocks.start(), f64::INFINITY);
        for block in blocks.clone() {
            let bound_m2 = bound(block);
            if bound_m2 < guess.1 {
                guess = (block, bound_m2);
            }
        }
        let guessed = self.nearest(point, within(guess.0));
        let mut best = Nearest { segment: first, fraction: 0.0, distance_m2: f64::INFINITY };
        for block in blocks {
            let found = if block == guess.0 {
                guessed
            } else if bound(block) <= guessed.distance_m2 {
                self.nearest(point, within(block))
            } else {
                continue;
            };
            if found.distance_m2 < best.distance_m2 {
                best = found;
            }
        }
        self.projection(point, best)
    }

    fn projection(&self, point: Vec2, best: Nearest) -> Projection {
        let (a, b) = (&self.points[best.segment], &self.points[best.segment + 1]);
        let chord = b.position - a.position;
        let length_m = b.station_m - a.station_m;
        let delta = point - (a.position + chord * best.fraction);
        Projection {
            station_m: a.station_m + best.fraction * length_m,
            offset_m: (chord.x * delta.y - chord.y * delta.x) / length_m,
            distance_m: best.distance_m2.sqrt(),
        }
    }

    /// The nearest point of some segments; the first, if several are equally near.
    fn nearest(&self, point: Vec2, segments: core::ops::Range<usize>) -> Nearest {
        let mut best = Nearest { segment: segments.start, fraction: 0.0, distance_m2: f64::INFINITY };
        for segment in segments {
            let (a, b) = (&self.points[segment], &self.points[segment + 1]);
            let chord = b.position - a.position;
            let length_m = b.station_m - a.station_m;
            let away = point - a.position;
            let fraction = (away.dot(&chord) / (length_m * length_m)).clamp(0.0, 1.0);
            let distance_m2 = (away - chord * fraction).norm_squared();
            if distance_m2 < best.distance_m2 {
                best = Nearest { segment, fraction, distance_m2 };
            }
        }
        best
    }

    /// Index of the first vertex beyond a station, or of the last vertex.
    pub fn vertex_after(&self, station_m: f64) -> usize {
        if station_m < 0.0 { 0 } else { self.segment(station_m) + 1 }
    }

    /// The two vertices around a station; of a station beyond an end those of the segment there.
    pub fn segment_at(&self, station_m: f64) -> (&PathPoint, &PathPoint) {
        let index = self.segment(station_m);
        (&self.points[index], &self.points[index + 1])
    }

    /// Index of the segment that holds a station, clamped to the ends.
    fn segment(&self, station_m: f64) -> usize {
        // The conversion makes 0 of what is negative.
        let cell = (station_m * self.cells_per_m) as u32 as usize;
        let begin = self.cells[cell.min(self.cells.len() - 1)];
        let mut index = (begin & !SURE) as usize;
        if begin & SURE != 0 {
            return index;
        }
        while index + 2 < self.points.len() && self.points[index + 1].station_m <= station_m {
            index += 1;
        }
        // Rounding may have named the cell after the right one.
        while index > 0 && self.points[index].station_m > station_m {
            index -= 1;
        }
        index
    }

    /// Segment and fraction of it; the fraction leaves `[0, 1]` beyond the ends.
    pub fn locate(&self, station_m: f64) -> (usize, f64) {
        let index = self.segment(station_m);
        let (a, b) = (&self.points[index], &self.points[index + 1]);
        (index, (station_m - a.station_m) / (b.station_m - a.station_m))
    }
}

/// The heading at a fraction of the segment between two vertices, rad.
fn heading_between(a: &PathPoint, b: &PathPoint, fraction: f64) -> f64 {
    // Most segments are straight.
    if a.heading_rad == b.heading_rad {
        return wrap_angle(a.heading_rad);
    }
    let turn_rad = wrap_angle(b.heading_rad - a.heading_rad) * fraction.clamp(0.0, 1.0);
    wrap_angle(a.heading_rad + turn_rad)
}

/// The nearest point of a path, and its distance.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    segment: usize,
    /// Part of the segment before the point, in `[0, 1]`.
    fraction: f64,
    distance_m2: f64,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn quarter_circle(radius_m: f64, steps: usize) -> Path {
        Path::new((0..=steps).map(|i| {
            let angle = core::f64::consts::FRAC_PI_2 * i as f64 / steps as f64;
            let position = Vec2::new(radius_m * libm::sin(angle), radius_m * (1.0 - libm::cos(angle)));
            (position, angle, 1.0 / radius_m)
        }))
        .expect("more than two points")
    }

    #[test]
    fn slight_bends_turn_evenly_and_corners_at_once() {
        let bend = [Vec2::new(0.0, 0.0), Vec2::new(10.0, 0.0), Vec2::new(19.8, 2.0)];
        let bend = Path::through(&bend).expect("a way");
        assert!(bend.heading_at(5.0) > 0.01 && bend.heading_at(10.0) > bend.heading_at(5.0));
        let corner = [Vec2::new(0.0, 0.0), Vec2::new(10.0, 0.0), Vec2::new(10.0, 10.0)];
        let corner = Path::through(&corner).expect("a way");
        assert!(corner.heading_at(9.9).abs() < 1e-9);
        assert!((corner.heading_at(10.1) - core::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert!((corner.length_m() - 20.0).abs() < 1e-3);
        assert!(Path::through(&[Vec2::zeros(), Vec2::zeros()]).is_none());
    }

    #[test]
    fn poses_and_projections_agree() {
        let path = quarter_circle(10.0, 200);
        for i in 0..=40 {
            let station_m = path.length_m() * f64::from(i) / 40.0;
            let beside = path.pose_at(station_m).offset(0.0, 1.5).position;
            let found = path.project(beside);
            assert!((found.station_m - station_m).abs() < 0.05, "{found:?} at {station_m}");
            assert!((found.offset_m - 1.5).abs() < 1e-3, "{found:?}");
            let near = path.project_near(beside, station_m, 2.0);
            assert_eq!(near, found);
        }
    }

    #[test]
    fn cells_find_the_segment_that_a_search_finds() {
        // Vertices by the centimetre, by the metre and far apart.
        let steps_m = [0.01, 0.013, 0.02, 1.0, 1.0, 1.7, 40.0, 0.01, 0.01, 3.0];
        let mut x_m = 0.0;
        let samples = core::iter::once(0.0).chain(steps_m.iter().cycle().take(60).copied()).map(|step_m| {
            x_m += step_m;
            (Vec2::new(x_m, 0.0), 0.0, 0.0)
        });
        let path = Path::new(samples).expect("many points");
        let searched = |station_m: f64| {
            path.points.partition_point(|p| p.station_m <= station_m).clamp(1, path.points.len() - 1) - 1
        };
        let vertices =
            path.points.iter().flat_map(|p| [p.station_m.next_down(), p.station_m, p.station_m.next_up()]);
        let between = (-50..3000).map(|i| f64::from(i) * 0.1);
        for station_m in vertices.chain(between).chain([f64::NEG_INFINITY, f64::INFINITY]) {
            assert_eq!(path.segment(station_m), searched(station_m), "{station_m}");
        }
    }

    #[test]
    fn beyond_the_ends_a_path_is_straight() {
        let line = |to_m| Path::new([0.0, to_m].map(|x_m| (Vec2::new(x_m, 0.0), 0.0, 0.0)));
        let path = line(10.0).expect("a line");
        assert_eq!(path.pose_at(12.0).position, Vec2::new(12.0, 0.0));
        assert_eq!(path.pose_at(-2.0).position, Vec2::new(-2.0, 0.0));
        assert!(line(0.0).is_none());
    }

    #[test]
    fn a_path_that_turns_at_once_keeps_both_headings() {
        let east = Path::new([0.0, 10.0].map(|x_m| (Vec2::new(x_m, 0.0), 0.0, 0.0))).expect("a line");
        let up = Path::new([0.0, 10.0].map(|y_m| (Vec2::new(10.0, y_m), 1.5, 0.0))).expect("a line");
        let both = Path::join([&east, &up]).expect("twenty metres");
        assert_eq!(both.length_m(), 20.0);
        assert_eq!(both.pose_at(9.999).heading_rad, 0.0);
        assert_eq!(both.pose_at(10.001).heading_rad, 1.5);
        assert_eq!(both.pose_at(10.0).position, Vec2::new(10.0, 0.0));
    }

    #[test]
    fn a_part_keeps_the_ends() {
        let path = quarter_circle(10.0, 50);
        let part = path.part(3.0, 9.0).expect("six metres");
        assert!((part.length_m() - 6.0).abs() < 1e-9);
        assert!((part.pose_at(0.0).position - path.pose_at(3.0).position).norm() < 1e-9);
    }

    #[test]
    fn a_zigzag_is_not_straight_though_its_corners_head_alike() {
        let corners =
            [(0.0, 0.0), (10.0, 1.0), (20.0, 0.0), (30.0, 1.0)].map(|(x_m, y_m)| Vec2::new(x_m, y_m));
        let path = Path::through(&corners).expect("a way");
        for at_m in [11.0, 14.0, 17.0, 21.0] {
            let chord = path.chord(at_m, at_m + 2.5);
            let along = path.position_at(at_m + 2.5) - path.position_at(at_m);
            assert!((chord.forward - along.normalize()).norm() < 1e-9 && !chord.is_straight, "{at_m}");
        }
    }

    proptest! {
        /// Blocks change how long a projection takes and not a bit of it.
        #[test]
        fn blocks_find_what_a_search_of_all_segments_finds(
            turns in prop::collection::vec((-0.6..0.6_f64, 0.1..9.0_f64), 2..90),
            x_m in -80.0..80.0_f64, y_m in -80.0..80.0_f64, near_m in 0.0..400.0_f64,
        ) {
            let mut at = Pose { position: Vec2::zeros(), heading_rad: 0.0 };
            let samples: Vec<_> = turns.iter().map(|(turn_rad, step_m)| {
                // A third of the segments goes straight on.
                let turn_rad = if turn_rad.abs() < 0.2 { 0.0 } else { *turn_rad };
                at = Pose { heading_rad: at.heading_rad + turn_rad, ..at }.offset(*step_m, 0.0);
                (at.position, at.heading_rad, 0.0)
            }).collect();
            let path = Path::new(samples).expect("many points");
            let point = Vec2::new(x_m, y_m);
            let all = path.nearest(point, 0..path.points.len() - 1);
            let found = path.project(point);
            prop_assert_eq!(found.distance_m, all.distance_m2.sqrt());
            let begin = &path.points[all.segment];
            let length_m = path.points[all.segment + 1].station_m - begin.station_m;
            prop_assert_eq!(found.station_m, begin.station_m + all.fraction * length_m);
            let chord = path.chord(near_m - 2.0, near_m + 0.7);
            let (begin, end) = (path.position_at(near_m - 2.0), path.position_at(near_m + 0.7));
            prop_assert!((chord.begin - begin).norm() < 1e-9);
            prop_assert!((chord.begin + chord.forward * (end - begin).norm() - end).norm() < 1e-6);
            prop_assert!((unit_vector(chord.heading_rad) - chord.forward).norm() < 1e-9);
            let near = path.project_near(point, near_m, 25.0);
            let part = path.nearest(point, path.segment(near_m - 25.0)..path.segment(near_m + 25.0) + 1);
            prop_assert_eq!(near.distance_m, part.distance_m2.sqrt());
        }
    }
}
