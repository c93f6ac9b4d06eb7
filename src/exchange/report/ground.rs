//! The shape of a road for the page: what lies around the route, in columns of centimetres.

use avastra_base::geometry::{Bounds, Vec2};
use avastra_road::{Lane, Neighbour, Strip, StripKind};
use avastra_world::sim::Scene;

use super::canvas::{lane_edge, strip_outline};
use super::columns::Columns;

/// Lines are kept to this, m.
const STEP_M: f64 = 0.01;

/// What lies farther than this from the bounds of the route is left out, m.
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
#[derive(serde::Serialize)]
struct Line(usize, usize);

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
    let map = &scene.map;
    let near = scene.route.path.bounds().grown(AROUND_M);
    let mut drawer = Drawer { columns: Columns::default() };
    let lanes: Vec<&Lane> = map.lanes.iter().filter(|lane| lane.centre.bounds().meets(&near)).collect();
    let stop_lines: Vec<StopShape> = lanes.iter().flat_map(|lane| stop_lines(lane)).collect();
    let route: Vec<Vec2> = scene.route.path.points().iter().map(|point| point.position).collect();
    let goal = scene.route.path.position_at(scene.route.goal_m);
    let in_reach = |outline: &&[Vec2]| Bounds::around(outline).meets(&near);
    let ground = Ground {
        name: map.name.clone(),
        lanes: lanes.iter().map(|lane| drawer.lane(lane)).collect(),
        strips: map
            .strips
            .iter()
            .filter(|strip| strip.bounds.meets(&near))
            .map(|strip| drawer.strip(strip))
            .collect(),
        solids: map
            .solids
            .iter()
            .map(|solid| solid.outline.as_slice())
            .filter(in_reach)
            .map(|outline| drawer.line(outline))
            .collect(),
        crosswalks: map
            .crosswalks
            .iter()
            .map(|crosswalk| crosswalk.outline.as_slice())
            .filter(in_reach)
            .map(|outline| drawer.line(outline))
            .collect(),
        signals: map
            .signals
            .iter()
            .map(|signal| SignalShape { at: point(signal.position), id: signal.id.clone() })
            .collect(),
        stop_lines,
        route: drawer.line(&route),
        goal: point(goal),
    };
    drawer.columns.pack(&ground)
}

struct Drawer {
    columns: Columns,
}

impl Drawer {
    fn line(&mut self, points: &[Vec2]) -> Line {
        let x = self.columns.add(STEP_M, points.iter().map(|point| point.x));
        Line(x, self.columns.add(STEP_M, points.iter().map(|point| point.y)))
    }

    fn lane(&mut self, lane: &Lane) -> LaneShape {
        let beyond = |side: Option<Neighbour>| match side {
            None => "edge",
            Some(beside) if beside.same_direction => "same",
            Some(beside) if beside.gap_m < MEDIAN_M_MIN => "oncoming",
            Some(_) => "edge",
        };
        LaneShape {
            left: self.line(&lane_edge(lane, 1.0)),
            right: self.line(&lane_edge(lane, -1.0)),
            in_junction: lane.junction.is_some(),
            beyond_left: beyond(lane.left),
            beyond_right: beyond(lane.right),
            limit_mps: lane.speed_limit_mps,
        }
    }

    fn strip(&mut self, strip: &Strip) -> StripShape {
        StripShape { outline: self.line(&strip_outline(strip)), is_walkway: strip.kind == StripKind::Walkway }
    }
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
