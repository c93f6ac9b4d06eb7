//! Ways that road users follow exactly: on a map, or beside the ego vehicle's route from wherever they begin.

use std::sync::Arc;

use avastra_base::geometry::{Path, Vec2};

use crate::model::vocabulary::{TrajectoryField, Word};
use crate::syntax::ast::Block;

/// A way that a road user may follow. Where it lies for a road, [`Road::trajectories`](crate::model::Road) says.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryDef {
    pub name: String,
    pub docs: Vec<String>,
    pub declared: Block,
}

impl TrajectoryDef {
    /// Whether it lies beside the ego vehicle's route, and not on a map.
    pub fn is_beside_route(&self) -> bool {
        !self.declared.fields.iter().any(|field| field.name.text == TrajectoryField::Road.name())
    }
}

/// Where a trajectory lies for a road.
#[derive(Debug, Clone, PartialEq)]
pub enum Laid {
    OnMap(Arc<Trajectory>),
    BesideRoute(Arc<BesideRoute>),
}

/// A way in the plane that a road user may follow.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    pub path: Path,
    /// Height of the road at each vertex of the path, m.
    pub heights_m: Vec<f64>,
    /// How far one is turned to the left of the way at some stations, m and rad; empty if nowhere.
    pub turns: Vec<(f64, f64)>,
}

impl Trajectory {
    /// Height of the road at a station, m.
    pub fn height_at(&self, station_m: f64) -> f64 {
        let (segment, part) = self.path.locate(station_m);
        let (from_m, to_m) = (self.heights_m[segment], self.heights_m[segment + 1]);
        from_m + (to_m - from_m) * part
    }

    /// How far one is turned to the left of the way at a station, rad.
    pub fn turned_rad(&self, station_m: f64) -> f64 {
        let next = self.turns.partition_point(|(at_m, _)| *at_m < station_m);
        match (next.checked_sub(1).and_then(|before| self.turns.get(before)), self.turns.get(next)) {
            (Some((from_m, from_rad)), Some((to_m, to_rad))) => {
                from_rad + (to_rad - from_rad) * (station_m - from_m) / (to_m - from_m)
            }
            (Some((_, turn_rad)), None) | (None, Some((_, turn_rad))) => *turn_rad,
            (None, None) => 0.0,
        }
    }
}

/// Where a way leads through, and how far one is turned to its left there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WayPoint {
    pub place: Vec2,
    pub turned_rad: f64,
}

/// Straight pieces from point to point, and how far one is turned at the stations of the points: empty if nowhere. `None` if
/// fewer than two points differ.
pub fn through(points: &[WayPoint]) -> Option<(Path, Vec<(f64, f64)>)> {
    let places: Vec<Vec2> = points.iter().map(|point| point.place).collect();
    let path = Path::through(&places)?;
    let mut station_m = 0.0;
    let mut turns = Vec::new();
    for (nth, point) in points.iter().enumerate() {
        let step_m = nth.checked_sub(1).map_or(0.0, |before| (point.place - places[before]).norm());
        station_m += step_m;
        // A point that is written twice says how one is turned up to there, and from there on.
        turns.push((station_m, point.turned_rad));
    }
    if points.iter().all(|point| point.turned_rad == 0.0) {
        turns.clear();
    }
    Some((path, turns))
}

/// A way beside the ego vehicle's route: its places are metres along that route from where it begins, and to the left of it.
#[derive(Debug, Clone, PartialEq)]
pub struct BesideRoute {
    /// Near enough to each other to follow the bends of the route.
    points: Vec<WayPoint>,
}

/// Two points that are so near to each other are one, m.
const SAME_M: f64 = 1e-6;

/// How far points of a curve are apart, m, and into how many a piece is cut at least.
const STEP_M: f64 = 0.25;
const PIECES_MIN: usize = 8;

impl BesideRoute {
    /// A curve through the points (a centripetal Catmull-Rom spline: Yuksel, Schaefer and Keyser 2009). Behind each point
    /// that is written twice, a new curve begins. `None` if it has no length.
    pub fn new(points: &[WayPoint]) -> Option<BesideRoute> {
        let is_twice = |a: &WayPoint, b: &WayPoint| (a.place - b.place).norm() < SAME_M;
        let mut curved = Vec::new();
        for part in points.chunk_by(|a, b| !is_twice(a, b)) {
            curved.extend(curve(part));
        }
        let way = BesideRoute { points: curved };
        (way.length_m() >= SAME_M).then_some(way)
    }

    /// How long it is beside a straight route, m.
    pub fn length_m(&self) -> f64 {
        self.points.windows(2).map(|pair| (pair[1].place - pair[0].place).norm()).sum()
    }

    /// Where it lies if it begins at this station of a route. `None` if the bends of that leave nothing of it.
    pub fn laid(&self, route: &Path, begins_m: f64, height_m: impl Fn(f64) -> f64) -> Option<Trajectory> {
        let beside = |point: &WayPoint| {
            let place = route.pose_at(begins_m + point.place.x).offset(0.0, point.place.y).position;
            WayPoint { place, turned_rad: point.turned_rad }
        };
        let points: Vec<WayPoint> = self.points.iter().map(beside).collect();
        let (path, turns) = through(&points)?;
        // The way has its points in order, without those that are the same as the one before.
        let mut nth = 0;
        let heights_m = path.points().iter().map(|at| {
            while points.get(nth + 1).is_some() && points[nth].place != at.position {
                nth += 1;
            }
            height_m((begins_m + self.points[nth].place.x).clamp(0.0, route.length_m()))
        });
        let heights_m = heights_m.collect();
        Some(Trajectory { path, heights_m, turns })
    }
}

/// Points of a curve through others.
fn curve(points: &[WayPoint]) -> Vec<WayPoint> {
    let places: Vec<Vec2> = points.iter().map(|point| point.place).collect();
    let mut curved = points[..1].to_vec();
    for (nth, pair) in points.windows(2).enumerate() {
        let (from, to) = (pair[0].place, pair[1].place);
        // Beyond its ends the curve goes on straight.
        let before = nth.checked_sub(1).map_or(from + from - to, |nth| places[nth]);
        let after = places.get(nth + 2).copied().unwrap_or(to + to - from);
        let pieces = (((to - from).norm() / STEP_M).ceil() as usize).max(PIECES_MIN);
        curved.extend((1..=pieces).map(|piece| {
            let part = piece as f64 / pieces as f64;
            let turned_rad = pair[0].turned_rad + (pair[1].turned_rad - pair[0].turned_rad) * part;
            WayPoint { place: spline([before, from, to, after], part), turned_rad }
        }));
    }
    curved
}

/// The part of the way from the second point to the third (Barry and Goldman 1988), with knots by the root of the distances.
fn spline([a, b, c, d]: [Vec2; 4], part: f64) -> Vec2 {
    let knot = |from: Vec2, to: Vec2| (to - from).norm().sqrt();
    let (ab, bc, cd) = (knot(a, b), knot(b, c), knot(c, d));
    let (t_b, t_c, t_d) = (ab, ab + bc, ab + bc + cd);
    let t = t_b + (t_c - t_b) * part;
    let between = |from: Vec2, from_t: f64, to: Vec2, to_t: f64| {
        from * ((to_t - t) / (to_t - from_t)) + to * ((t - from_t) / (to_t - from_t))
    };
    let (first, second, third) = (between(a, 0.0, b, t_b), between(b, t_b, c, t_c), between(c, t_c, d, t_d));
    between(between(first, 0.0, second, t_c), t_b, between(second, t_b, third, t_d), t_c)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(along_m: f64, left_m: f64) -> WayPoint {
        WayPoint { place: Vec2::new(along_m, left_m), turned_rad: 0.0 }
    }

    #[test]
    fn a_curve_leads_through_its_points_and_straight_where_they_lie_in_line() {
        let written = [point(0.0, -3.0), point(10.0, -1.0), point(20.0, 0.0), point(60.0, 0.0)];
        let way = BesideRoute::new(&written).expect("has a length");
        for one in &written {
            let nearest_m = way.points.iter().map(|point| (point.place - one.place).norm());
            assert!(nearest_m.fold(f64::INFINITY, f64::min) < 1e-9, "{one:?}");
        }
        let route = Path::through(&[Vec2::zeros(), Vec2::new(500.0, 0.0)]).expect("a route");
        let laid = way.laid(&route, 100.0, |_| 0.0).expect("laid");
        assert!((laid.path.position_at(0.0) - Vec2::new(100.0, -3.0)).norm() < 1e-9);
        let end = laid.path.position_at(laid.path.length_m());
        assert!((end - Vec2::new(160.0, 0.0)).norm() < 1e-9);
        let straight =
            BesideRoute::new(&[point(0.0, 0.0), point(5.0, 0.0), point(50.0, 0.0)]).expect("straight");
        assert!(straight.points.iter().all(|point| point.place.y == 0.0));
    }

    #[test]
    fn a_point_written_twice_is_a_corner() {
        let out = [point(0.0, -8.0), point(0.0, -2.0), point(0.0, -2.0), point(20.0, -2.0)];
        let way = BesideRoute::new(&out).expect("has a length");
        assert!(way.points.iter().all(|point| point.place.x < 1e-9 || (point.place.y + 2.0).abs() < 1e-9));
        assert!(BesideRoute::new(&[point(1.0, 1.0), point(1.0, 1.0)]).is_none());
    }
}
