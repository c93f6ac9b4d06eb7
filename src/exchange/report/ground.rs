//! The shape of a road for the page: what lies around the route, in columns of centimetres.

use avastra_base::geometry::{Bounds, Vec2};
use avastra_road::{Lane, Neighbour, Strip, StripKind};
use avastra_world::sim::Scene;

use super::canvas::{lane_edge, strip_outline};
use super::columns::Columns;

/// Lines are kept to this, m.
const STEP_M: f64 = 0.01;

/// Everything farther than this from the bounds of the route is left out, m.
const AROUND_M: f64 = 150.0;

/// A wider gap between two lanes is a median, m.
const MEDIAN_M_MIN: f64 = 0.5;

#[derive(serde::Serialize)]
struct Ground {
    name: String,
    lanes: Vec<LaneShape>,
    strips: Vec<StripShape>,
    solids: Vec<Line>,
    crosswalks: Vec<Line>,
    stop_lines: Vec<StopShape>,
    signals: Vec<SignalShape>,
    route: Line,
    goal: [f64; 2],
}

/// Columns of x and y.
type Line = [usize; 2];

#[derive(serde::Serialize)]
struct LaneShape {
    left: Line,
    right: Line,
    in_junction: bool,
    /// `edge`, `oncoming` or `same`: what lies beyond.
    beyond_left: &'static str,
    beyond_right: &'static str,
    limit_mps: f64,
}

#[derive(serde::Serialize)]
struct StripShape {
    outline: Line,
    is_walkway: bool,
}

#[derive(serde::Serialize)]
struct StopShape {
    at: [[f64; 2]; 2],
    /// Number of the signal, or none for a sign.
    signal: Option<usize>,
}

#[derive(serde::Serialize)]
struct SignalShape {
    at: [f64; 2],
    id: String,
}

/// The road as packed columns.
pub fn ground(scene: &Scene) -> String {
    let (map, path) = (&scene.map, &scene.route.path);
    let near = path.bounds().grown(AROUND_M);
    let mut columns = Columns::default();
    let lanes: Vec<&Lane> = map.lanes.iter().filter(|lane| lane.centre.bounds().meets(&near)).collect();
    let strips = map.strips.iter().filter(|strip| strip.bounds.meets(&near));
    let solids = map.solids.iter().filter(|solid| solid.bounds.meets(&near));
    let crosswalks = map.crosswalks.iter().filter(|one| Bounds::around(&one.outline).meets(&near));
    let signals = map.signals.iter();
    let ground = Ground {
        name: map.name.clone(),
        lanes: lanes.iter().map(|lane| lane_shape(&mut columns, lane)).collect(),
        strips: strips.map(|strip| strip_shape(&mut columns, strip)).collect(),
        solids: solids.map(|solid| line(&mut columns, &solid.outline)).collect(),
        crosswalks: crosswalks.map(|crosswalk| line(&mut columns, &crosswalk.outline)).collect(),
        signals: signals
            .map(|signal| SignalShape { at: point(signal.position), id: signal.id.clone() })
            .collect(),
        stop_lines: lanes.iter().flat_map(|lane| stop_lines(lane)).collect(),
        route: columns.add_points(STEP_M, path.points().iter().map(|point| point.position)),
        goal: point(path.position_at(scene.route.goal_m)),
    };
    columns.pack(&ground)
}

fn line(columns: &mut Columns, points: &[Vec2]) -> Line {
    columns.add_points(STEP_M, points.iter().copied())
}

fn lane_shape(columns: &mut Columns, lane: &Lane) -> LaneShape {
    let beyond = |side: Option<Neighbour>| match side {
        None => "edge",
        Some(beside) if beside.same_direction => "same",
        Some(beside) if beside.gap_m < MEDIAN_M_MIN => "oncoming",
        Some(_) => "edge",
    };
    LaneShape {
        left: line(columns, &lane_edge(lane, 1.0)),
        right: line(columns, &lane_edge(lane, -1.0)),
        in_junction: lane.junction.is_some(),
        beyond_left: beyond(lane.left),
        beyond_right: beyond(lane.right),
        limit_mps: lane.speed_limit_mps,
    }
}

fn strip_shape(columns: &mut Columns, strip: &Strip) -> StripShape {
    let is_walkway = strip.kind == StripKind::Walkway;
    StripShape { outline: line(columns, &strip_outline(strip)), is_walkway }
}

fn stop_lines(lane: &Lane) -> Vec<StopShape> {
    let lights = lane.stop_lines.iter().map(|line| (line.station_m, Some(line.signal)));
    let signs = lane.sign_lines.iter().map(|line| (line.station_m, None));
    lights
        .chain(signs)
        .map(|(station_m, signal)| StopShape { at: lane.across(station_m).map(point), signal })
        .collect()
}

fn point(position: Vec2) -> [f64; 2] {
    [position.x, position.y].map(|value| (value * 100.0).round() / 100.0)
}
