//! Where two paths cross or join, and where a path is inside an outline.

use avastra_base::geometry::{Bounds, Path, PathPoint, Vec2};

/// A lane that joins the route does so where the centre lines have come this near, m.
const MERGE_M: f64 = 1.5;

/// Two crossings of one lane nearer than this are one, m.
const SAME_CROSSING_M: f64 = 1.0;

/// Where a lane comes within [`MERGE_M`] of the route and stays there: (station on the route, on the lane), m.
pub fn merge(route: &Path, lane: &Path) -> Option<(f64, f64)> {
    let near = |point: &PathPoint| (route.project(point.position), point.station_m);
    let mut first = None;
    for (projection, lane_station_m) in dense(lane).iter().map(near).rev() {
        if projection.distance_m > MERGE_M {
            break;
        }
        first = Some((projection.station_m, lane_station_m));
    }
    first
}

/// The vertices of a path, with further points where they are more than half a metre apart.
fn dense(path: &Path) -> Vec<PathPoint> {
    let mut points = Vec::new();
    for pair in path.points().windows(2) {
        let steps = ((pair[1].station_m - pair[0].station_m) / 0.5).ceil().max(1.0);
        for i in 0..steps as u32 {
            let fraction = f64::from(i) / steps;
            points.push(PathPoint {
                station_m: pair[0].station_m + (pair[1].station_m - pair[0].station_m) * fraction,
                position: pair[0].position + (pair[1].position - pair[0].position) * fraction,
                ..pair[0]
            });
        }
    }
    points.extend(path.points().last());
    points
}

/// Where two paths cross: (station on the first, station on the second), m.
pub fn crossings(a: &Path, b: &Path) -> Vec<(f64, f64)> {
    let mut steps = u64::MAX;
    crossings_within(a, b, &mut steps)
}

/// As [`crossings`], with a limit of work: one step for each segment of the first path, and one for each comparison with a
/// segment of the second. Subtracts them from `steps`, and ends early when none are left.
pub fn crossings_within(a: &Path, b: &Path, steps: &mut u64) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    // A little larger because of rounding.
    let near = b.bounds().grown(1e-3);
    for p in a.points().windows(2) {
        *steps = steps.saturating_sub(1);
        if *steps == 0 {
            break;
        }
        // Most segments of a route are far from the other lane: their boxes tell so quickly.
        let here = Bounds::of(p);
        if !here.meets(&near) {
            continue;
        }
        for q in b.segments_near(&here.grown(1e-3)) {
            *steps = steps.saturating_sub(1);
            let Some((x, y)) = segment_crossing(p[0].position, p[1].position, q[0].position, q[1].position)
            else {
                continue;
            };
            let station_a_m = p[0].station_m + (p[1].station_m - p[0].station_m) * x;
            let station_b_m = q[0].station_m + (q[1].station_m - q[0].station_m) * y;
            if found.iter().all(|(known_m, _)| (known_m - station_a_m).abs() > SAME_CROSSING_M) {
                found.push((station_a_m, station_b_m));
            }
        }
    }
    found
}

/// The fractions along two segments at which they cross; `None` if they do not cross or are parallel.
pub fn segment_crossing(a: Vec2, b: Vec2, c: Vec2, d: Vec2) -> Option<(f64, f64)> {
    let (p, q, delta) = (b - a, d - c, c - a);
    let cross = p.x * q.y - p.y * q.x;
    if cross.abs() < 1e-12 {
        return None;
    }
    let x = (delta.x * q.y - delta.y * q.x) / cross;
    let y = (delta.x * p.y - delta.y * p.x) / cross;
    ((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)).then_some((x, y))
}

/// Between which stations a path runs inside a polygon, m.
pub fn spans_inside(path: &Path, outline: &[Vec2]) -> Vec<(f64, f64)> {
    let mut cuts_m = vec![0.0, path.length_m()];
    // A little larger because of rounding.
    let near = Bounds::around(outline).grown(1e-3);
    for pair in path.segments_near(&near) {
        for (c, d) in edges(outline) {
            if let Some((x, _)) = segment_crossing(pair[0].position, pair[1].position, *c, *d) {
                cuts_m.push(pair[0].station_m + (pair[1].station_m - pair[0].station_m) * x);
            }
        }
    }
    cuts_m.sort_by(f64::total_cmp);
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for pair in cuts_m.windows(2) {
        let middle = path.pose_at((pair[0] + pair[1]) / 2.0).position;
        if pair[1] - pair[0] >= 1e-6 && holds(outline, middle) {
            append(&mut spans, pair[0], pair[1]);
        }
    }
    spans
}

/// Adds a span behind all others; it becomes part of the last one if they touch.
pub fn append(spans: &mut Vec<(f64, f64)>, from_m: f64, to_m: f64) {
    match spans.last_mut() {
        Some(last) if from_m - last.1 < 1e-6 => last.1 = to_m,
        _ => spans.push((from_m, to_m)),
    }
}

/// The edges of a polygon.
pub fn edges(outline: &[Vec2]) -> impl Iterator<Item = (&Vec2, &Vec2)> {
    outline.iter().zip(outline.iter().cycle().skip(1))
}

/// Whether a polygon holds a point (even-odd rule).
pub fn holds(outline: &[Vec2], point: Vec2) -> bool {
    let crossed = edges(outline).filter(|(a, b)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)
    });
    crossed.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(from: (f64, f64), to: (f64, f64)) -> Path {
        Path::new([from, to].map(|(x_m, y_m)| (Vec2::new(x_m, y_m), 0.0, 0.0))).unwrap()
    }

    #[test]
    fn paths_cross_where_they_do() {
        let east = straight((0.0, 0.0), (10.0, 0.0));
        let north = straight((4.0, -3.0), (4.0, 3.0));
        assert_eq!(crossings(&east, &north), [(4.0, 3.0)]);
        let beside = straight((0.0, 1.0), (10.0, 1.0));
        assert!(crossings(&east, &beside).is_empty());
        assert_eq!(merge(&east, &beside), Some((0.0, 0.0)));
    }

    #[test]
    fn a_path_is_inside_a_polygon_between_its_edges() {
        let east = straight((0.0, 0.0), (10.0, 0.0));
        let corners = [(2.0, -1.0), (5.0, -1.0), (5.0, 1.0), (2.0, 1.0)];
        let square: Vec<Vec2> = corners.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
        assert_eq!(spans_inside(&east, &square), [(2.0, 5.0)]);
        let around: Vec<Vec2> = square.iter().map(|corner| corner * 10.0 - Vec2::new(30.0, 0.0)).collect();
        assert_eq!(spans_inside(&east, &around), [(0.0, 10.0)]);
    }
}
