//! Top views as SVG: road, signals, ego vehicle, obstacles, what is perceived and what is planned.
//!
//! One panel is one moment, north up, centred on the ego vehicle; all panels of a picture have one scale, chosen so
//! that the obstacles are visible. True obstacles are filled, with their way since the first panel; what the
//! driving system believes is dashed, so that a missed or misplaced object is seen at a glance. Chevrons show the
//! direction of a lane; a yellow line separates opposing traffic.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::ads::{PerceivedObject, Status};
use crate::geometry::{OrientedBox, Pose, Vec2};
use crate::model::vocabulary::{Body, Colour, Phenomenon, Word};
use crate::road::Lane;
use crate::sim::{Obstacle, SignalColour, World};

use super::canvas::{Canvas, across, escape, lane_edge, lane_outline};

/// Edge of a panel, px.
const PANEL_PX: f64 = 480.0;
/// Panels side by side.
const COLUMNS: usize = 4;
/// How far a panel reaches from the ego vehicle in each direction, m: at least and at most.
const VIEW_RADIUS_M: (f64, f64) = (35.0, 110.0);
/// Room that a panel shows beyond the farthest obstacle within reach, m.
const VIEW_MARGIN_M: f64 = 8.0;
/// Distance between two chevrons of a lane, and their size, m.
const CHEVRON_EVERY_M: f64 = 15.0;
const CHEVRON_M: f64 = 0.7;
/// Height of the caption under a panel, px.
const CAPTION_PX: f64 = 56.0;
/// An arrow for a velocity is as long as the way driven in this time, s.
const VELOCITY_S: f64 = 1.0;

/// What one panel shows.
pub struct Snapshot {
    pub world: World,
    pub status: Status,
    /// Points at which the ego vehicle touched an obstacle within the last moments.
    pub contact: Option<Vec2>,
}

/// The moments in rows of four, as one SVG document. `names` are what the author calls road users, by number, where the
/// engine has no name for them.
pub fn picture(moments: &[Snapshot], names: &BTreeMap<u32, String>) -> String {
    let columns = moments.len().clamp(1, COLUMNS);
    let rows = moments.len().max(1).div_ceil(columns);
    let width_px = PANEL_PX * columns as f64;
    let height_px = (PANEL_PX + CAPTION_PX) * rows as f64;
    let radius_m = view_radius_m(moments);
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width_px}" height="{height_px}" viewBox="0 0 {width_px} {height_px}" font-family="sans-serif">
<rect width="100%" height="100%" fill="#ffffff"/>"##
    );
    for (index, moment) in moments.iter().enumerate() {
        let left_px = PANEL_PX * (index % columns) as f64;
        let top_px = (PANEL_PX + CAPTION_PX) * (index / columns) as f64;
        let _ = writeln!(
            svg,
            r##"<svg x="{left_px}" y="{top_px}" width="{PANEL_PX}" height="{PANEL_PX}"><rect width="100%" height="100%" fill="#e9eee4" stroke="#888888"/>"##
        );
        Panel::new(&mut svg, &moment.world, radius_m, names).draw(moment, &moments[..index]);
        svg.push_str("</svg>\n");
        caption(&mut svg, (left_px, top_px), moment);
    }
    svg.push_str("</svg>\n");
    svg
}

/// The reach of every panel: up to the farthest obstacle of any moment, within the bounds of a panel.
fn view_radius_m(moments: &[Snapshot]) -> f64 {
    let (least_m, most_m) = VIEW_RADIUS_M;
    let away_m = |moment: &Snapshot, obstacle: &Obstacle| {
        let away = obstacle.outline.pose.position - moment.world.ego_outline().pose.position;
        away.x.abs().max(away.y.abs()) + VIEW_MARGIN_M
    };
    moments
        .iter()
        .flat_map(|moment| moment.world.obstacles().map(move |obstacle| away_m(moment, obstacle)))
        .filter(|radius_m| *radius_m <= most_m)
        .fold(least_m, f64::max)
}

/// Draws in world coordinates around the ego vehicle.
struct Panel<'a> {
    canvas: Canvas<'a>,
    centre: Vec2,
    radius_m: f64,
    names: &'a BTreeMap<u32, String>,
}

impl Panel<'_> {
    fn new<'a>(
        svg: &'a mut String,
        world: &World,
        radius_m: f64,
        names: &'a BTreeMap<u32, String>,
    ) -> Panel<'a> {
        let centre = world.ego_outline().pose.position;
        let north_west = centre + Vec2::new(-radius_m, radius_m);
        let canvas = Canvas { svg, north_west, px_per_m: PANEL_PX / (2.0 * radius_m) };
        Panel { canvas, centre, radius_m, names }
    }

    /// `earlier` are the moments of the panels before.
    fn draw(&mut self, moment: &Snapshot, earlier: &[Snapshot]) {
        let world = &moment.world;
        let map = &world.scene().map;
        for lane in &map.lanes {
            self.lane(lane);
        }
        for crosswalk in &map.crosswalks {
            self.canvas.polygon(&crosswalk.outline, r##"fill="#ffffff" fill-opacity="0.55""##);
        }
        for lane in &map.lanes {
            for line in &lane.stop_lines {
                self.stop_line(lane, line.station_m, world.signal(line.signal));
            }
        }
        let route: Vec<Vec2> = world.scene().route.path.points().iter().map(|p| p.position).collect();
        self.canvas.polyline(&route, r##"stroke="#5b7fb5" stroke-width="1.5" stroke-dasharray="6 5""##);
        for lane in &map.lanes {
            self.direction(lane);
        }
        for obstacle in world.obstacles() {
            self.trail(obstacle, earlier);
            self.obstacle(obstacle);
        }
        self.body(&world.ego_outline(), r##"fill="#1f5fd0" stroke="#0a2a66""##);
        for object in &moment.status.perceived {
            self.perceived(object);
        }
        self.canvas.polyline(&moment.status.planned, r##"stroke="#12913a" stroke-width="2.5""##);
        if let Some(point) = moment.contact {
            self.cross(point);
        }
    }

    fn shows(&self, lane: &Lane) -> bool {
        lane.centre.project(self.centre).distance_m <= self.radius_m * 1.5
    }

    fn lane(&mut self, lane: &Lane) {
        if !self.shows(lane) {
            return;
        }
        let fill = if lane.junction.is_some() { "#c9cccf" } else { "#bfc3c7" };
        let style = format!(r##"fill="{fill}" stroke="#f4f4f4" stroke-width="0.8""##);
        self.canvas.polygon(&lane_outline(lane), &style);
    }

    /// Chevrons in the driving direction; not inside junctions, where lanes overlap.
    fn direction(&mut self, lane: &Lane) {
        if lane.junction.is_some() || !self.shows(lane) {
            return;
        }
        let mut station_m = CHEVRON_EVERY_M / 2.0;
        while station_m < lane.centre.length_m() {
            let tip = lane.centre.pose_at(station_m);
            let wing = |side: f64| tip.offset(-CHEVRON_M, CHEVRON_M * side).position;
            let style = r##"stroke="#ffffff" stroke-width="1.2" stroke-opacity="0.8""##;
            self.canvas.polyline(&[wing(1.0), tip.position, wing(-1.0)], style);
            station_m += CHEVRON_EVERY_M;
        }
        if lane.left.is_some_and(|left| !left.same_direction) {
            let edge = lane_edge(lane, 1.0);
            self.canvas.polyline(&edge, r##"stroke="#d8a400" stroke-width="1.4""##);
        }
    }

    /// The way of an obstacle since the first panel.
    fn trail(&mut self, obstacle: &Obstacle, earlier: &[Snapshot]) {
        let known = earlier.iter().filter_map(|moment| moment.world.obstacle(obstacle.id));
        let mut way: Vec<Vec2> = known.map(|other| other.outline.pose.position).collect();
        way.push(obstacle.outline.pose.position);
        self.canvas.polyline(&way, r##"stroke="#7a1fa0" stroke-width="1.4" stroke-dasharray="1 3""##);
    }

    fn stop_line(&mut self, lane: &Lane, station_m: f64, colour: SignalColour) {
        let paint = match colour {
            SignalColour::Red => "#d62020",
            SignalColour::Yellow => "#e8b400",
            SignalColour::Green => "#1fae4b",
        };
        self.canvas.polyline(&across(lane, station_m), &format!(r##"stroke="{paint}" stroke-width="4""##));
    }

    fn obstacle(&mut self, obstacle: &Obstacle) {
        let fill = paint(obstacle.colour);
        let style = if obstacle.body == Body::Pedestrian {
            r##"fill="#b0128a" stroke="#5a0046""##.to_owned()
        } else {
            format!(r##"fill="{fill}" stroke="#202020""##)
        };
        self.body(&obstacle.outline, &style);
        let centre = obstacle.outline.pose.position;
        let arrow = [centre, centre + obstacle.velocity_mps * VELOCITY_S];
        self.canvas.polyline(&arrow, r##"stroke="#202020" stroke-width="1.2""##);
        let body = self.names.get(&obstacle.id).map_or(obstacle.body.name(), String::as_str);
        let name = format!("{} {body}", obstacle.id);
        let style = r##"font-size="11" fill="#202020""##;
        self.canvas.text(centre + Vec2::new(1.5, 1.5), &name, style);
    }

    fn perceived(&mut self, object: &PerceivedObject) {
        let outline = OrientedBox::new(object.pose, object.length_m, object.width_m);
        self.body(&outline, r##"fill="none" stroke="#e06a00" stroke-width="1.6" stroke-dasharray="4 3""##);
        let mut way = vec![object.pose.position];
        way.extend(&object.predicted);
        self.canvas.polyline(&way, r##"stroke="#e06a00" stroke-width="1" stroke-dasharray="2 3""##);
    }

    /// An outline with a line across its front, which shows the heading.
    fn body(&mut self, outline: &OrientedBox, style: &str) {
        self.canvas.polygon(&outline.corners(), style);
        let nose = Pose::offset(&outline.pose, outline.half_length_m * 0.6, 0.0);
        let across = [
            nose.offset(0.0, outline.half_width_m).position,
            nose.offset(outline.half_length_m * 0.4, 0.0).position,
            nose.offset(0.0, -outline.half_width_m).position,
        ];
        self.canvas.polyline(&across, r##"stroke="#101010" stroke-width="0.8""##);
    }

    fn cross(&mut self, point: Vec2) {
        for (dx, dy) in [(1.2, 1.2), (1.2, -1.2)] {
            let arm = Vec2::new(dx, dy);
            self.canvas.polyline(&[point - arm, point + arm], r##"stroke="#d60000" stroke-width="3""##);
        }
    }
}

fn caption(svg: &mut String, (left_px, top_px): (f64, f64), moment: &Snapshot) {
    let world = &moment.world;
    let sky: Vec<String> = Phenomenon::ALL
        .iter()
        .zip(world.sky())
        .filter(|(_, level)| level.intensity() > 0.0)
        .map(|(phenomenon, level)| format!("{} {}", phenomenon.name(), level.name()))
        .collect();
    let sky = if sky.is_empty() { "clear".to_owned() } else { sky.join(", ") };
    let lines = [
        format!(
            "t = {:.2} s   {:.1} km/h   {}, {sky}",
            world.time_s(),
            world.ego().speed_mps * 3.6,
            world.time_of_day().name()
        ),
        format!(
            "{}   throttle {:.0} %, brake {:.0} %",
            moment.status.reason_text(),
            moment.status.control.throttle_pct,
            moment.status.control.brake_pct
        ),
        "filled: true   dashed: perceived   green: planned   dotted: came from there".to_owned(),
    ];
    for (index, line) in lines.iter().enumerate() {
        let y_px = top_px + PANEL_PX + 16.0 * (index as f64 + 1.0);
        let _ = writeln!(
            svg,
            r##"<text x="{:.0}" y="{y_px:.0}" font-size="12" fill="#202020">{}</text>"##,
            left_px + 6.0,
            escape(line)
        );
    }
}

fn paint(colour: Colour) -> &'static str {
    match colour {
        Colour::Pink => "#f08bc0",
        Colour::Red => "#d63333",
        Colour::Yellow => "#f0d030",
        Colour::Black => "#3c3c3c",
        Colour::White => "#fafafa",
        Colour::Skyblue => "#7cc4f0",
    }
}
