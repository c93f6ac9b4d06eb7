//! A whole map as SVG: lanes with their driving directions, junctions, signals, crosswalks, and a route through it.
//!
//! Everything comes from the lane graph, so the picture shows how the map was understood: an edge is dashed if the
//! lane beside it runs the same way, yellow if it runs the other way, dark if there is none. Road markings, and
//! everything else that the file holds, are left out.

use std::fmt::Write;

use avastra_base::geometry::{Bounds, Path, Vec2};
use avastra_base::outside::in_markup;
use avastra_road::{Lane, LaneIndex, Neighbour, RoadMap, Route};

use super::canvas::{Canvas, lane_edge, lane_outline};

/// The longer edge of the picture, px.
const LONGER_PX: f64 = 1600.0;
/// Margin around the map, px.
const MARGIN_PX: f64 = 50.0;
/// A gap between opposing lanes is drawn as a median from this width on, m.
const MEDIAN_M_MIN: f64 = 0.3;
/// Distance between two arrows along a lane, m.
const ARROW_M: f64 = 40.0;
/// Colours of the signal groups of a junction, in the order of its cycle.
const GROUP_PAINTS: [&str; 6] = ["#c2185b", "#1565c0", "#2e7d32", "#ef6c00", "#6a1b9a", "#00838f"];

/// Draws a map, and a route through it with its start, goal and lane changes.
pub fn draw(map: &RoadMap, route: Option<&Route>) -> String {
    let Bounds { least: south_west, most: north_east } = bounds(map);
    let size_m = north_east - south_west;
    let px_per_m = (LONGER_PX - 2.0 * MARGIN_PX) / size_m.x.max(size_m.y).max(1.0);
    let (width_px, height_px) =
        (size_m.x * px_per_m + 2.0 * MARGIN_PX, size_m.y * px_per_m + 2.0 * MARGIN_PX);
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width_px:.0}" height="{height_px:.0}" viewBox="0 0 {width_px:.0} {height_px:.0}" font-family="sans-serif">
<defs><pattern id="zebra" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect width="3" height="6" fill="#ffffff"/></pattern></defs>
<rect width="100%" height="100%" fill="#f3f4ee"/>"##
    );
    let margin_m = MARGIN_PX / px_per_m;
    let north_west = Vec2::new(south_west.x - margin_m, north_east.y + margin_m);
    let mut drawing = Drawing { canvas: Canvas { svg: &mut svg, north_west, px_per_m }, map };
    drawing.medians();
    drawing.surfaces();
    drawing.edges();
    drawing.junctions();
    drawing.arrows_and_names();
    if let Some(route) = route {
        drawing.route(route);
    }
    drawing.signals();
    drawing.warnings();
    drawing.scale_and_north(south_west, north_east);
    svg.push_str("</svg>\n");
    svg
}

/// The box around all that is drawn. A map has at least one lane.
fn bounds(map: &RoadMap) -> Bounds {
    let of_lanes = map.lanes.iter().flat_map(lane_outline);
    let of_crosswalks = map.crosswalks.iter().flat_map(|crosswalk| crosswalk.outline.iter().copied());
    Bounds::around(&of_lanes.chain(of_crosswalks).collect::<Vec<_>>())
}

struct Drawing<'a> {
    canvas: Canvas<'a>,
    map: &'a RoadMap,
}

impl Drawing<'_> {
    /// A ring around every place that was repaired or left out; its title says what.
    fn warnings(&mut self) {
        for (index, position) in &self.map.warned_at {
            let (x, y) = self.canvas.at(*position);
            let title = in_markup(&self.map.warnings[*index]);
            let _ = writeln!(
                self.canvas.svg,
                r##"<circle cx="{x:.1}" cy="{y:.1}" r="9" fill="none" stroke="#d50000" stroke-width="2"><title>{title}</title></circle>"##
            );
        }
    }

    /// The strips between opposing lanes that do not touch.
    fn medians(&mut self) {
        for (index, lane) in self.map.lanes.iter().enumerate() {
            let Some(beside) = lane.left.filter(|beside| !beside.same_direction) else { continue };
            // Both lanes name each other; one of them draws.
            let other = self.map.lane(beside.lane);
            let mutual = other.left.is_some_and(|back| back.lane == LaneIndex(index));
            if beside.gap_m < MEDIAN_M_MIN || lane.junction.is_some() || (mutual && beside.lane.0 < index) {
                continue;
            }
            let strip = median(lane, other);
            self.canvas.polygon(&strip, r##"fill="#cfdcb8""##);
        }
    }

    fn surfaces(&mut self) {
        // Streets are drawn over the lanes of junctions.
        for inside in [true, false] {
            for lane in self.map.lanes.iter().filter(|lane| lane.junction.is_some() == inside) {
                let fill = if inside { "#d4d7da" } else { "#c2c6ca" };
                let points = lane_outline(lane);
                let title = format!(
                    "road {} lane {}, {:.1} m long, {:.2} m/s",
                    lane.key.road,
                    lane.key.lane,
                    lane.centre.length_m(),
                    lane.speed_limit_mps
                );
                let _ = write!(self.canvas.svg, "<g><title>{}</title>", in_markup(&title));
                self.canvas.polygon(&points, &format!(r##"fill="{fill}""##));
                self.canvas.svg.push_str("</g>\n");
            }
        }
        for crosswalk in &self.map.crosswalks {
            let style = r##"fill="url(#zebra)" stroke="#ffffff" stroke-width="0.8""##;
            self.canvas.polygon(&crosswalk.outline, style);
        }
    }

    fn edges(&mut self) {
        for lane in &self.map.lanes {
            if lane.junction.is_some() {
                let centre: Vec<Vec2> = lane.centre.points().iter().map(|point| point.position).collect();
                self.canvas.polyline(&centre, r##"stroke="#8a9097" stroke-width="0.7""##);
                continue;
            }
            for (side, beside) in [(1.0, lane.left), (-1.0, lane.right)] {
                self.canvas.polyline(&lane_edge(lane, side), edge_style(beside));
            }
        }
    }

    fn junctions(&mut self) {
        for junction in &self.map.junctions {
            let inside = junction.lanes.iter().map(|lane| self.map.lane(*lane));
            let outline = hull(inside.flat_map(lane_outline).collect());
            let style = r##"fill="none" stroke="#35629c" stroke-width="1" stroke-dasharray="7 4""##;
            self.canvas.polygon(&outline, style);
            // The name goes to the hull's northernmost corner, off the lanes.
            if let Some(corner) = outline.iter().copied().max_by(|a, b| a.y.total_cmp(&b.y)) {
                let name = if junction.name.is_empty() { &junction.id } else { &junction.name };
                let style = r##"font-size="15" font-weight="bold" fill="#35629c" text-anchor="middle""##;
                let above = Vec2::new(0.0, 6.0 / self.canvas.px_per_m);
                self.canvas.text(corner + above, name, style);
            }
        }
    }

    fn arrows_and_names(&mut self) {
        for lane in &self.map.lanes {
            let length_m = lane.centre.length_m();
            let arrows = (length_m / ARROW_M).ceil().max(1.0);
            let inside = lane.junction.is_some();
            let mut station_m = length_m / arrows / 2.0;
            while station_m < length_m && !(inside && length_m < 8.0) {
                self.arrow(&lane.centre, station_m, if inside { "#8a9097" } else { "#4c5258" });
                station_m += length_m / arrows;
            }
            if !inside && length_m > 5.0 {
                let name = format!("{}/{}", lane.key.road, lane.key.lane);
                let at = lane.centre.pose_at((length_m / 2.0).min(9.0)).position;
                let style = r##"font-size="9" fill="#202428" text-anchor="middle""##;
                self.canvas.text(at, &name, style);
            }
        }
    }

    fn arrow(&mut self, centre: &Path, station_m: f64, paint: &str) {
        let pose = centre.pose_at(station_m);
        let head = [pose.offset(-0.8, 0.7), pose.offset(0.8, 0.0), pose.offset(-0.8, -0.7)];
        let head = head.map(|corner| corner.position);
        self.canvas.polyline(&head, &format!(r##"stroke="{paint}" stroke-width="1.2""##));
    }

    fn route(&mut self, route: &Route) {
        let style = r##"stroke="#e65100" stroke-opacity="0.75" stroke-width="4" stroke-linejoin="round""##;
        self.canvas.polyline(&stretch(&route.path, 0.0, route.goal_m), style);
        for change in &route.changes {
            let style = r##"stroke="#6a00c8" stroke-width="5" stroke-linecap="round""##;
            self.canvas.polyline(&stretch(&route.path, change.begin_m, change.end_m), style);
            // Beside the middle of the change, on the side that it leaves.
            let middle = route.path.pose_at((change.begin_m + change.end_m) / 2.0);
            let aside_px = if change.lateral_m > 0.0 { -16.0 } else { 16.0 };
            let at = middle.offset(0.0, aside_px / self.canvas.px_per_m).position;
            let style = r##"font-size="12" fill="#6a00c8" text-anchor="middle""##;
            self.canvas.text(at, "lane change", style);
        }
        for (station_m, name, paint) in [(0.0, "start", "#1b7f3a"), (route.goal_m, "goal", "#111111")] {
            let at = route.path.pose_at(station_m);
            let style = format!(r##"fill="{paint}" stroke="#ffffff" stroke-width="1.5""##);
            self.canvas.circle(at.position, "6", &style);
            let style = format!(r##"font-size="14" font-weight="bold" fill="{paint}""##);
            self.canvas.text(at.position + Vec2::new(8.0, 8.0) / self.canvas.px_per_m, name, &style);
        }
    }

    /// Stop lines and lights, in the colour of their group, with its number in the junction's cycle.
    fn signals(&mut self) {
        for lane in &self.map.lanes {
            for line in &lane.stop_lines {
                let paint = group_paint(self.map.signals[line.signal].group);
                let style = format!(r##"stroke="{paint}" stroke-width="3""##);
                self.canvas.polyline(&lane.across(line.station_m), &style);
            }
        }
        for signal in &self.map.signals {
            let (x, y) = self.canvas.at(signal.position);
            let paint = group_paint(signal.group);
            let _ = writeln!(
                self.canvas.svg,
                r##"<g><title>{}</title><circle cx="{x:.1}" cy="{y:.1}" r="5" fill="{paint}"/><text x="{x:.1}" y="{:.1}" font-size="8" fill="#ffffff" text-anchor="middle">{}</text></g>"##,
                in_markup(&signal.id),
                y + 3.0,
                signal.group
            );
        }
    }

    fn scale_and_north(&mut self, south_west: Vec2, north_east: Vec2) {
        let m_per_px = 1.0 / self.canvas.px_per_m;
        // The longest of the usual lengths that fits in a fifth of the picture.
        let widest_m = LONGER_PX / 5.0 * m_per_px;
        let length_m = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0]
            .into_iter()
            .rfind(|length_m| *length_m <= widest_m)
            .unwrap_or(1.0);
        let ink = r##"stroke="#111111" stroke-width="2""##;
        let left = south_west - Vec2::new(0.0, 25.0 * m_per_px);
        let right = left + Vec2::new(length_m, 0.0);
        let tick = Vec2::new(0.0, 6.0 * m_per_px);
        self.canvas.polyline(&[left + tick, left, right, right + tick], ink);
        let words = r##"font-size="13" fill="#111111""##;
        self.canvas.text(right + Vec2::new(6.0 * m_per_px, 0.0), &format!("{length_m} m"), words);
        let foot = north_east + Vec2::new(20.0, -10.0) * m_per_px;
        let tip = foot + Vec2::new(0.0, 36.0 * m_per_px);
        let wing = |side: f64| tip + Vec2::new(5.0 * side, -10.0) * m_per_px;
        self.canvas.polyline(&[foot, tip, wing(-1.0), tip, wing(1.0)], ink);
        let words = r##"font-size="13" font-weight="bold" fill="#111111" text-anchor="middle""##;
        self.canvas.text(foot - Vec2::new(0.0, 14.0 * m_per_px), "N", words);
    }
}

/// The strip from the left edge of a lane to that of the oncoming lane beside it.
fn median(lane: &Lane, oncoming: &Lane) -> Vec<Vec2> {
    let near = lane_edge(lane, 1.0);
    let mut strip = near.clone();
    strip.extend(near.iter().rev().map(|point| {
        let beside_m = oncoming.centre.project(*point).station_m;
        oncoming.across(beside_m)[0]
    }));
    strip
}

fn edge_style(beside: Option<Neighbour>) -> &'static str {
    match beside {
        Some(Neighbour { same_direction: true, .. }) => {
            r##"stroke="#ffffff" stroke-width="1" stroke-dasharray="6 5""##
        }
        Some(Neighbour { gap_m, .. }) if gap_m < MEDIAN_M_MIN => r##"stroke="#d9a400" stroke-width="1.6""##,
        _ => r##"stroke="#5a4636" stroke-width="1.2""##,
    }
}

fn group_paint(group: usize) -> &'static str {
    GROUP_PAINTS[group % GROUP_PAINTS.len()]
}

fn stretch(path: &Path, from_m: f64, to_m: f64) -> Vec<Vec2> {
    let part = path.part(from_m, to_m);
    part.iter().flat_map(Path::points).map(|point| point.position).collect()
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = &Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp(&(point - b)) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut outline = half(&mut points.iter());
    outline.extend(half(&mut points.iter().rev()));
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: &str = include_str!("../../../scenarios/roads/corner.xodr");

    #[test]
    fn a_hull_leaves_out_what_is_inside() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (1.0, 1.0), (2.0, 2.0), (0.0, 2.0), (1.0, 0.0)];
        let found = hull(corners.iter().map(|(x, y)| Vec2::new(*x, *y)).collect());
        let expected = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        assert_eq!(found, expected.map(|(x, y)| Vec2::new(x, y)));
    }

    #[test]
    fn a_picture_of_the_corner_holds_all_its_parts() {
        let map = RoadMap::from_opendrive("corner", CORNER).unwrap();
        let start = map.place("1", -1, 105.88).unwrap();
        let goal = map.place("5", -3, 75.27).unwrap();
        let route = Route::find(&map, start, goal).unwrap();
        let svg = draw(&map, Some(&route));
        let count = |part: &str| svg.matches(part).count();
        assert_eq!(count("<title>road "), map.lanes.len());
        assert_eq!(count("<circle"), map.signals.len() + 2);
        assert_eq!(count("url(#zebra)"), map.crosswalks.len());
        let stop_lines: usize = map.lanes.iter().map(|lane| lane.stop_lines.len()).sum();
        assert_eq!(count(r##"stroke-width="3""##), stop_lines);
        for name in [">J_6<", ">J_8<", ">start<", ">goal<", ">N<", ">5/-3<"] {
            assert_eq!(count(name), 1, "{name}");
        }
        assert!(!draw(&map, None).contains(">goal<"));
    }
}
