//! Top views as SVG, for papers and tickets: road, signals, ego vehicle, others, what is perceived and what is planned.
//!
//! One panel is one moment, north up, as near as the ego vehicle and what it hits allow; each has its own scale. True
//! road users are filled. They show their heading, their speed (an arrow for the way of the next second), the lights of
//! those that brake, and their way since the first panel. The beliefs of the driving system are dashed, so that a missed
//! or misplaced object is seen at a glance. A caption says in words what a panel shows.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use avastra_base::folded;
use avastra_base::geometry::{Bounds, OrientedBox, Vec2};
use avastra_base::kinematics::STANDING_MPS;
use avastra_base::outside::in_markup;
use avastra_drivers::{PerceivedObject, Status};
use avastra_lang::model::vocabulary::{Body, Word};
use avastra_road::{Lane, StripKind};
use avastra_world::sim::{Contact, Obstacle, SignalColour, World};

use super::canvas::{Canvas, lane_edge, lane_outline, strip_outline, thinned, write_text};
use super::labels::Labels;
use super::words;

/// Edge of a panel, px.
const PANEL_PX: f64 = 400.0;
/// Panels side by side.
const COLUMNS: usize = 5;
/// Heights of a line of the title above all panels, of the room around it, of the caption under each, and of the legend under
/// all, px.
const TITLE_LINE_PX: f64 = 20.0;
const TITLE_ROOM_PX: f64 = 10.0;
/// The mean width of a letter of the title, px: wider than most, so that a line fits.
const TITLE_LETTER_PX: f64 = 8.4;
const CAPTION_PX: f64 = 62.0;
const LEGEND_PX: f64 = 24.0;
/// How far a panel reaches from its centre in each direction, m: at least and at most.
const VIEW_RADIUS_M: (f64, f64) = (14.0, 45.0);
/// Room that a panel shows beyond the two that it is about, m.
const VIEW_MARGIN_M: f64 = 9.0;
/// Distance between two chevrons of a lane, and their size, m.
const CHEVRON_EVERY_M: f64 = 15.0;
const CHEVRON_M: f64 = 0.7;
/// An arrow for a velocity is as long as the way driven in this time, s.
const VELOCITY_S: f64 = 1.0;
/// Height of names, px.
const NAME_PX: f64 = 12.0;

/// The content of one panel.
pub struct Snapshot {
    pub world: World,
    pub status: Status,
    /// A contact of the ego vehicle within the last moments.
    pub contact: Option<Contact>,
    /// Numbers of the vehicles that brake; 0 is the ego vehicle.
    pub braking: BTreeSet<u32>,
}

/// The subject of a picture.
pub struct Subject {
    /// In a sentence.
    pub title: String,
    /// Number and time of what the ego vehicle hits, if it hits anything.
    pub hit: Option<(u32, f64)>,
    /// The author's names for road users, by number, where the engine has no name for them.
    pub names: BTreeMap<u32, String>,
}

/// The moments in rows of five, as one SVG document.
pub fn picture(moments: &[Snapshot], subject: &Subject) -> String {
    let columns = moments.len().clamp(1, COLUMNS);
    let rows = moments.len().max(1).div_ceil(columns);
    let width_px = PANEL_PX * columns as f64;
    let lines = folded(&subject.title, ((width_px - 12.0) / TITLE_LETTER_PX) as usize);
    let title_px = TITLE_LINE_PX * lines.len() as f64 + TITLE_ROOM_PX;
    let height_px = title_px + (PANEL_PX + CAPTION_PX) * rows as f64 + LEGEND_PX;
    let mut svg = String::new();
    let title = in_markup(&subject.title);
    let _ = writeln!(
        svg,
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width_px}" height="{height_px}" viewBox="0 0 {width_px} {height_px}" font-family="sans-serif" role="img">
<title>{title}</title>
<rect width="100%" height="100%" fill="#ffffff"/>"##
    );
    for (index, line) in lines.iter().enumerate() {
        let place = (6.0, TITLE_LINE_PX * (index + 1) as f64);
        write_text(&mut svg, place, r##"font-size="15" font-weight="bold" fill="#14181f""##, line);
    }
    for (index, moment) in moments.iter().enumerate() {
        let left_px = PANEL_PX * (index % columns) as f64;
        let top_px = title_px + (PANEL_PX + CAPTION_PX) * (index / columns) as f64;
        let _ = writeln!(
            svg,
            r##"<svg x="{left_px}" y="{top_px}" width="{PANEL_PX}" height="{PANEL_PX}"><rect width="100%" height="100%" fill="#e6ece0"/>"##
        );
        Panel::new(&mut svg, moment, subject).draw(&moments[..index]);
        svg.push_str(r##"<rect width="100%" height="100%" fill="none" stroke="#8d949e"/></svg>"##);
        svg.push('\n');
        caption(&mut svg, (left_px, top_px), moment, subject);
    }
    let legend = "filled: true · dashed: perceived, with predictions · green: planned · arrow: the way of the next second · red lights: braking · dotted: way so far";
    // A narrow picture has room for the most needed alone.
    let legend = if columns >= 2 { legend } else { "filled: true · dashed: perceived · green: planned" };
    write_text(&mut svg, (6.0, height_px - 8.0), r##"font-size="12" fill="#5a6372""##, legend);
    svg.push_str("</svg>\n");
    svg
}

/// Draws in world coordinates around what matters.
struct Panel<'a> {
    canvas: Canvas<'a>,
    moment: &'a Snapshot,
    subject: &'a Subject,
    view: Bounds,
}

impl Panel<'_> {
    fn new<'a>(svg: &'a mut String, moment: &'a Snapshot, subject: &'a Subject) -> Panel<'a> {
        let ego = moment.world.ego_outline().pose.position;
        let (centre, radius_m) = view_of(ego, other_place(moment, subject));
        let corner = Vec2::new(radius_m, radius_m);
        let north_west = centre + Vec2::new(-radius_m, radius_m);
        let canvas = Canvas { svg, north_west, px_per_m: PANEL_PX / (2.0 * radius_m) };
        Panel { canvas, moment, subject, view: Bounds { least: centre - corner, most: centre + corner } }
    }

    /// `earlier` are the moments of the panels before.
    fn draw(&mut self, earlier: &[Snapshot]) {
        let world = &self.moment.world;
        let map = &world.scene().map;
        let lanes: Vec<&Lane> =
            map.lanes.iter().filter(|lane| lane.centre.bounds().grown(4.0).meets(&self.view)).collect();
        for strip in map.strips.iter().filter(|strip| strip.bounds.grown(4.0).meets(&self.view)) {
            let fill = match strip.kind {
                StripKind::Walkway => r##"fill="#dcd7cf""##,
                StripKind::Paved => r##"fill="#ced2d8""##,
            };
            self.canvas.polygon(&thinned(&strip_outline(strip)), fill);
        }
        for in_junction in [true, false] {
            lanes
                .iter()
                .filter(|lane| lane.junction.is_some() == in_junction)
                .for_each(|lane| self.lane(lane));
        }
        for crosswalk in map.crosswalks.iter().filter(|one| Bounds::around(&one.outline).meets(&self.view)) {
            self.canvas.polygon(&crosswalk.outline, r##"fill="#ffffff" fill-opacity="0.6""##);
        }
        let route: Vec<Vec2> = world.scene().route.path.points().iter().map(|p| p.position).collect();
        self.line(&thinned(&route), r##"stroke="#5f83bd" stroke-width="1.5" stroke-dasharray="6 5""##);
        lanes.iter().for_each(|lane| self.direction(lane));
        for lane in &lanes {
            for line in &lane.stop_lines {
                self.stop_line(lane, line.station_m, world.signal(line.signal));
            }
        }
        let status = &self.moment.status;
        self.line(
            &thinned(&status.planned),
            r##"stroke="#0f8a3c" stroke-width="3" stroke-opacity="0.85" stroke-linecap="round""##,
        );
        for obstacle in world.obstacles() {
            self.trail(obstacle, earlier);
            self.obstacle(obstacle);
        }
        self.ego();
        for object in &status.perceived {
            self.perceived(object);
        }
        if let Some(contact) = &self.moment.contact {
            self.cross(contact.point);
        }
        self.names();
        self.scale_and_north();
    }

    /// A line, if any of it is in the panel.
    fn line(&mut self, points: &[Vec2], style: &str) {
        if !points.is_empty() && Bounds::around(points).meets(&self.view) {
            self.canvas.polyline(points, style);
        }
    }

    fn lane(&mut self, lane: &Lane) {
        let fill = if lane.junction.is_some() { "#ced2d8" } else { "#c3c8cf" };
        self.canvas.polygon(&thinned(&lane_outline(lane)), &format!(r##"fill="{fill}""##));
        if lane.junction.is_some() {
            return;
        }
        for (side, beside) in [(1.0, lane.left), (-1.0, lane.right)] {
            let style = match beside {
                Some(beside) if beside.same_direction => {
                    r##"stroke="#ffffff" stroke-width="1" stroke-dasharray="7 8""##
                }
                Some(beside) if beside.gap_m < 0.5 => r##"stroke="#d9a400" stroke-width="1.4""##,
                _ => r##"stroke="#8d949e" stroke-width="1.2""##,
            };
            self.line(&thinned(&lane_edge(lane, side)), style);
        }
    }

    /// Chevrons in the driving direction; not inside junctions, where lanes overlap.
    fn direction(&mut self, lane: &Lane) {
        if lane.junction.is_some() {
            return;
        }
        let mut station_m = CHEVRON_EVERY_M / 2.0;
        while station_m < lane.centre.length_m() {
            let tip = lane.centre.pose_at(station_m);
            let wing = |side: f64| tip.offset(-CHEVRON_M, CHEVRON_M * side).position;
            let style = r##"stroke="#ffffff" stroke-width="1.2" stroke-opacity="0.8""##;
            self.line(&[wing(1.0), tip.position, wing(-1.0)], style);
            station_m += CHEVRON_EVERY_M;
        }
    }

    /// The way of an obstacle since the first panel.
    fn trail(&mut self, obstacle: &Obstacle, earlier: &[Snapshot]) {
        let known = earlier.iter().filter_map(|moment| moment.world.obstacle(obstacle.id));
        let mut way: Vec<Vec2> = known.map(|other| other.outline.pose.position).collect();
        way.push(obstacle.outline.pose.position);
        self.line(&way, r##"stroke="#23272e" stroke-width="1.3" stroke-dasharray="1 3""##);
    }

    /// The line in the colour of its light, with a letter: red and green are one colour to some.
    fn stop_line(&mut self, lane: &Lane, station_m: f64, colour: SignalColour) {
        let (paint, letter) = match colour {
            SignalColour::Red => ("#c81e1e", "R"),
            SignalColour::Yellow => ("#d79300", "Y"),
            SignalColour::Green => ("#1a8f45", "G"),
        };
        let line = lane.across(station_m);
        self.line(&line, &format!(r##"stroke="{paint}" stroke-width="4""##));
        let middle = (line[0] + line[1]) / 2.0;
        let (x, y) = self.canvas.at(middle);
        if (0.0..=PANEL_PX).contains(&x) && (0.0..=PANEL_PX).contains(&y) {
            self.canvas.circle(middle, "6.5", &format!(r##"fill="{paint}""##));
            let style = r##"font-size="9" font-weight="bold" fill="#ffffff" text-anchor="middle""##;
            write_text(self.canvas.svg, (x, y + 3.2), style, letter);
        }
    }

    fn ego(&mut self) {
        let outline = self.moment.world.ego_outline();
        let velocity_mps = outline.pose.forward() * self.moment.world.ego().speed_mps;
        self.arrow(&outline, velocity_mps, "#08285f");
        self.vehicle(&outline, r##"fill="#1c5fd4" stroke="#08285f" stroke-width="1.2""##, "#ffffff");
        if self.moment.braking.contains(&0) {
            self.brake_lights(&outline);
        }
    }

    fn obstacle(&mut self, obstacle: &Obstacle) {
        self.arrow(&obstacle.outline, obstacle.velocity_mps, "#23272e");
        if !obstacle.body.is_vehicle() {
            let radius_px = format!("{:.1}", (0.4 * self.canvas.px_per_m).max(4.0));
            let style = r##"fill="#b0128a" stroke="#5a0046""##;
            self.canvas.circle(obstacle.outline.pose.position, &radius_px, style);
            return;
        }
        let style = r##"fill="#f2ede4" stroke="#23272e" stroke-width="1.2""##;
        if obstacle.body == Body::Object {
            return self.canvas.polygon(&obstacle.outline.corners(), style);
        }
        self.vehicle(&obstacle.outline, style, "#23272e");
        if self.moment.braking.contains(&obstacle.id) {
            self.brake_lights(&obstacle.outline);
        }
    }

    /// An outline with its windscreen, which shows the heading.
    fn vehicle(&mut self, outline: &OrientedBox, style: &str, screen: &str) {
        self.canvas.polygon(&outline.corners(), style);
        let at = |ahead: f64, left: f64| {
            outline.pose.offset(outline.half_length_m * ahead, outline.half_width_m * left).position
        };
        let style = format!(r##"stroke="{screen}" stroke-width="1.2""##);
        self.canvas.polyline(&[at(0.35, 0.8), at(0.55, 0.0), at(0.35, -0.8)], &style);
    }

    fn brake_lights(&mut self, outline: &OrientedBox) {
        for side in [0.7, -0.7] {
            let at = outline.pose.offset(-outline.half_length_m, outline.half_width_m * side).position;
            let style = r##"fill="#ff2a1f" stroke="#7a0c06" stroke-width="0.6""##;
            self.canvas.circle(at, "3.4", style);
        }
    }

    /// From the front of a body, along its way of the next second.
    fn arrow(&mut self, outline: &OrientedBox, velocity_mps: Vec2, paint: &str) {
        let speed_mps = velocity_mps.norm();
        if speed_mps < STANDING_MPS {
            return;
        }
        let ahead = velocity_mps / speed_mps;
        let from = outline.pose.position + ahead * outline.half_length_m.min(2.5);
        let tip = from + velocity_mps * VELOCITY_S;
        let wing_m = 6.0 / self.canvas.px_per_m;
        let left = Vec2::new(-ahead.y, ahead.x);
        let wing = |side: f64| tip - ahead * wing_m + left * (side * wing_m * 0.55);
        let style = format!(r##"stroke="{paint}" stroke-width="1.6""##);
        self.line(&[from, tip], &style);
        self.line(&[wing(1.0), tip, wing(-1.0)], &style);
    }

    fn perceived(&mut self, object: &PerceivedObject) {
        let corners = OrientedBox::new(object.pose, object.length_m, object.width_m).corners();
        if Bounds::around(&corners).meets(&self.view) {
            let style = r##"fill="none" stroke="#c94f00" stroke-width="1.6" stroke-dasharray="4 3""##;
            self.canvas.polygon(&corners, style);
        }
        let mut way = vec![object.pose.position];
        way.extend(&object.predicted);
        self.line(&thinned(&way), r##"stroke="#c94f00" stroke-width="1" stroke-dasharray="2 3""##);
    }

    fn cross(&mut self, point: Vec2) {
        let arm_m = 9.0 / self.canvas.px_per_m;
        for (paint, width_px) in [("#ffffff", 6), ("#c81e1e", 3)] {
            for side in [1.0, -1.0] {
                let arm = Vec2::new(arm_m, arm_m * side);
                let style = format!(r##"stroke="{paint}" stroke-width="{width_px}""##);
                self.canvas.polyline(&[point - arm, point + arm], &style);
            }
        }
    }

    /// Names and speeds: first of the two that the picture is about, then of the others.
    fn names(&mut self) {
        let world = &self.moment.world;
        let ego = world.ego_outline();
        let mut named = vec![(ego, format!("ego {}", kmh(world.ego().speed_mps)), "#1c5fd4")];
        let hit = self.subject.hit.map(|(id, _)| id);
        let mut others: Vec<&Obstacle> =
            world.obstacles().filter(|one| Some(one.id) == hit || !one.is_ambient()).collect();
        others.sort_by_key(|obstacle| Some(obstacle.id) != hit);
        for obstacle in others {
            let own = self.subject.names.get(&obstacle.id);
            let body = own.map_or(obstacle.body.name(), String::as_str);
            let name = format!("{body} #{} {}", obstacle.id, kmh(obstacle.velocity_mps.norm()));
            named.push((obstacle.outline, name, "#23272e"));
        }
        let px_per_m = self.canvas.px_per_m;
        let away_px = |outline: &OrientedBox| (outline.half_width_m * px_per_m).max(8.0) + 4.0;
        let mut labels = Labels::new(PANEL_PX);
        // Scale and north have their corners.
        labels.keep((60.0, PANEL_PX - 12.0), 62.0);
        labels.keep((PANEL_PX - 20.0, PANEL_PX - 26.0), 28.0);
        for (outline, _, _) in &named {
            // A long body is three places: its ends and its middle.
            for share in [-1.0, 0.0, 1.0] {
                let place = outline.pose.offset(share * outline.half_length_m, 0.0).position;
                labels.keep(self.canvas.at(place), away_px(outline) - 4.0);
            }
        }
        if let Some(contact) = &self.moment.contact {
            labels.keep(self.canvas.at(contact.point), 12.0);
        }
        for (outline, name, paint) in named {
            let at = self.canvas.at(outline.pose.position);
            if !(0.0..=PANEL_PX).contains(&at.0) || !(0.0..=PANEL_PX).contains(&at.1) {
                continue;
            }
            let Some(place) = labels.place(at, &name, NAME_PX, away_px(&outline)) else { continue };
            let style = format!(
                r##"font-size="{NAME_PX}" font-weight="bold" fill="{paint}" stroke="#ffffff" stroke-width="3" stroke-opacity="0.85" paint-order="stroke""##
            );
            write_text(self.canvas.svg, place, &style, &name);
        }
    }

    fn scale_and_north(&mut self) {
        let px_per_m = self.canvas.px_per_m;
        let length_m =
            [50.0, 20.0, 10.0, 5.0].into_iter().find(|m| m * px_per_m <= PANEL_PX / 3.5).unwrap_or(2.0);
        let (left, base, right) = (10.0, PANEL_PX - 10.0, 10.0 + length_m * px_per_m);
        let (north, middle) = (PANEL_PX - 18.0, f64::midpoint(left, right));
        let _ = writeln!(
            self.canvas.svg,
            r##"<g stroke="#14181f" stroke-width="2" fill="none"><path d="M{left} {0:.1}V{base:.1}H{right:.1}V{0:.1}"/><path d="M{north} {1:.1}V{2:.1}M{3} {4:.1}L{north} {2:.1}L{5} {4:.1}"/></g>"##,
            base - 5.0,
            PANEL_PX - 8.0,
            PANEL_PX - 32.0,
            north - 5.0,
            PANEL_PX - 24.0,
            north + 5.0
        );
        let style = r##"font-size="11" font-weight="bold" fill="#14181f" text-anchor="middle""##;
        write_text(self.canvas.svg, (middle, base - 6.0), style, &format!("{length_m} m"));
        write_text(self.canvas.svg, (north, PANEL_PX - 36.0), style, "N");
    }
}

/// Where what the ego vehicle hits is; before it appears, and without a collision, what is nearest.
fn other_place(moment: &Snapshot, subject: &Subject) -> Option<Vec2> {
    let world = &moment.world;
    let hit = subject.hit.and_then(|(id, _)| world.obstacle(id));
    let nearest = || world.obstacles_on_level().min_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    hit.or_else(nearest).map(|obstacle| obstacle.outline.pose.position)
}

/// Centre and radius of a panel: between the two if both fit, else around the ego vehicle.
fn view_of(ego: Vec2, other: Option<Vec2>) -> (Vec2, f64) {
    let (least_m, most_m) = VIEW_RADIUS_M;
    let Some(other) = other else { return (ego, most_m / 2.0) };
    let apart = other - ego;
    let radius_m = apart.x.abs().max(apart.y.abs()) / 2.0 + VIEW_MARGIN_M;
    if radius_m > most_m { (ego, most_m / 2.0) } else { (ego + apart / 2.0, radius_m.max(least_m)) }
}

/// A panel in words.
fn caption(svg: &mut String, (left_px, top_px): (f64, f64), moment: &Snapshot, subject: &Subject) {
    let world = &moment.world;
    let time_s = world.time_s();
    let when = match (&moment.contact, subject.hit) {
        (Some(contact), _) => format!(" · contact with #{}", contact.obstacle),
        (None, Some((_, hit_s))) if hit_s > time_s => {
            format!(" · {:.1} s before the contact", hit_s - time_s)
        }
        _ => String::new(),
    };
    let control = &moment.status.control;
    let pedals = match moment.braking.contains(&0) {
        true => format!("brakes with {:.0} %", control.brake_pct),
        false => format!("throttle {:.0} %", control.throttle_pct),
    };
    let sky = words::sky(world.time_of_day(), world.sky());
    let lines = [
        (r##"font-size="13" font-weight="bold" fill="#14181f""##, format!("{time_s:.2} s{when}")),
        (
            r##"font-size="12" fill="#14181f""##,
            format!(
                "ego {}, {pedals}; limited by: {}",
                kmh(world.ego().speed_mps),
                moment.status.reason_text()
            ),
        ),
        (r##"font-size="12" fill="#5a6372""##, sky),
    ];
    for (index, (style, line)) in lines.iter().enumerate() {
        write_text(svg, (left_px + 6.0, top_px + PANEL_PX + 17.0 + 17.0 * index as f64), style, line);
    }
}

fn kmh(speed_mps: f64) -> String {
    format!("{:.0} km/h", speed_mps * 3.6)
}
