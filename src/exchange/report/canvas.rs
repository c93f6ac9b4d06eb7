//! A drawing surface in world coordinates, north up, that writes SVG.
//!
//! Projection, lines, areas, words and the shape of a lane. Its users decide what is drawn, and in which colours.

use std::fmt::Write;

use avastra_base::geometry::{Pose, Vec2};
use avastra_base::outside::in_markup;
use avastra_road::{Lane, Strip};

/// Distance of the samples along a curved outline, m.
const STEP_M: f64 = 2.0;

/// Appends to an SVG document. A style is a text of SVG attributes.
pub struct Canvas<'a> {
    pub svg: &'a mut String,
    /// World point in the upper left corner, m.
    pub north_west: Vec2,
    pub px_per_m: f64,
}

impl Canvas<'_> {
    /// Pixel of a world point; SVG's y axis points down.
    pub fn at(&self, point: Vec2) -> (f64, f64) {
        let delta = (point - self.north_west) * self.px_per_m;
        (delta.x, -delta.y)
    }

    pub fn polygon(&mut self, points: &[Vec2], style: &str) {
        let points = self.points(points);
        let _ = writeln!(self.svg, r##"<polygon points="{points}" {style}/>"##);
    }

    pub fn polyline(&mut self, points: &[Vec2], style: &str) {
        let points = self.points(points);
        let _ = writeln!(self.svg, r##"<polyline points="{points}" fill="none" {style}/>"##);
    }

    /// Text that begins at a point, or is anchored as `style` says with `text-anchor`.
    pub fn text(&mut self, point: Vec2, text: &str, style: &str) {
        let at = self.at(point);
        write_text(self.svg, at, style, text);
    }

    /// `radius_px` is written as it is.
    pub fn circle(&mut self, centre: Vec2, radius_px: &str, style: &str) {
        let (x, y) = self.at(centre);
        let _ = writeln!(self.svg, r##"<circle cx="{x:.1}" cy="{y:.1}" r="{radius_px}" {style}/>"##);
    }

    fn points(&self, points: &[Vec2]) -> String {
        let mut text = String::new();
        for point in points {
            let (x, y) = self.at(*point);
            let _ = write!(text, "{x:.1},{y:.1} ");
        }
        text
    }
}

/// One edge of a lane, in its driving direction: the left one for `side` 1, the right one for -1.
pub fn lane_edge(lane: &Lane, side: f64) -> Vec<Vec2> {
    let length_m = lane.centre.length_m();
    let steps = (length_m / STEP_M).ceil().max(1.0) as usize;
    let point = |i: usize| {
        let station_m = length_m * i as f64 / steps as f64;
        let half_m = lane.width_at(station_m) / 2.0;
        lane.centre.pose_at(station_m).offset(0.0, side * half_m).position
    };
    (0..=steps).map(point).collect()
}

/// The surface of a lane.
pub fn lane_outline(lane: &Lane) -> Vec<Vec2> {
    let mut outline = lane_edge(lane, 1.0);
    outline.extend(lane_edge(lane, -1.0).iter().rev());
    outline
}

/// The surface of a walkway or of another lane that cars do not drive on.
pub fn strip_outline(strip: &Strip) -> Vec<Vec2> {
    let edge = |side: f64| {
        strip.centre.points().iter().zip(&strip.widths_m).map(move |(point, width_m)| {
            let pose = Pose { position: point.position, heading_rad: point.heading_rad };
            pose.offset(0.0, side * width_m / 2.0).position
        })
    };
    edge(1.0).chain(edge(-1.0).collect::<Vec<_>>().into_iter().rev()).collect()
}

/// A line without the points that lie on it anyway, to 2 cm.
pub fn thinned(points: &[Vec2]) -> Vec<Vec2> {
    const OFF_M: f64 = 0.02;
    let Some(&first) = points.first() else { return Vec::new() };
    let mut kept = vec![first];
    let mut last = 0;
    for index in 1..points.len() {
        let lies_on_the_way = |point: &Vec2, to: &Vec2| {
            let (way, aside) = (to - points[last], point - points[last]);
            // A point at which the line turns back is needed, however near it passes.
            way.perp(&aside).abs() <= OFF_M * way.norm() && way.dot(&aside) > 0.0 && aside.norm() < way.norm()
        };
        // All that was left out since the last point that was kept, or a wide bend would become a straight line.
        let is_needless = points
            .get(index + 1)
            .is_some_and(|next| points[last + 1..=index].iter().all(|point| lies_on_the_way(point, next)));
        if !is_needless {
            kept.push(points[index]);
            last = index;
        }
    }
    kept
}

/// Text at a pixel.
pub fn write_text(svg: &mut String, (x, y): (f64, f64), style: &str, text: &str) {
    let _ = writeln!(svg, r##"<text x="{x:.1}" y="{y:.1}" {style}>{}</text>"##, in_markup(text));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_line_keeps_its_corners_and_ends() {
        let points =
            |list: &[(f64, f64)]| -> Vec<Vec2> { list.iter().map(|&(x, y)| Vec2::new(x, y)).collect() };
        let line =
            points(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.001), (3.0, 0.0), (3.0, 2.0), (3.0, 4.0), (3.0, 1.0)]);
        let kept = points(&[(0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (3.0, 1.0)]);
        assert_eq!(thinned(&line), kept);
        assert_eq!(thinned(&line[..1]), line[..1]);
        assert!(thinned(&[]).is_empty());
    }

    #[test]
    fn a_bend_of_many_points_stays_a_bend() {
        let at = |n: u32| avastra_base::geometry::unit_vector(f64::from(n) * 0.01) * 50.0;
        let bend: Vec<Vec2> = (0..=150).map(at).collect();
        let kept = thinned(&bend);
        assert!(kept.len() > 10 && kept.len() < 120, "{}", kept.len());
        // Nothing that was left out lies far from what was kept.
        for point in &bend {
            let off_m = kept.windows(2).map(|pair| {
                let (way, aside) = (pair[1] - pair[0], point - pair[0]);
                let share = (way.dot(&aside) / way.norm_squared()).clamp(0.0, 1.0);
                (aside - way * share).norm()
            });
            assert!(off_m.fold(f64::INFINITY, f64::min) <= 0.021);
        }
    }
}
