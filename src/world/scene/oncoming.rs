//! Where the oncoming traffic beside a route begins.

use avastra_base::geometry::{Vec2, unit_vector};
use avastra_road::{RoadMap, Route};

/// The near edge of the nearest oncoming lane beside a place of the route.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OncomingEdge {
    /// From the middle of the route, m.
    pub away_m: f64,
    pub is_left: bool,
    /// Unit vector along the route.
    pub along: Vec2,
}

/// The edges at every metre of a route; none in junctions, and where there is no oncoming lane.
pub(super) fn oncoming_edges(map: &RoadMap, route: &Route) -> Vec<Option<OncomingEdge>> {
    let edge = |station_m: f64| {
        let lane = route.lane_at(station_m).lane;
        if map.lane(lane).junction.is_some() {
            return None;
        }
        let here = route.path.pose_at(station_m);
        let on_lane_m = map.lane(lane).centre.project(here.position).station_m;
        let opposing = map.opposing(lane, on_lane_m)?;
        let other = map.lane(opposing.lane);
        let aside_m = here.to_local(other.centre.position_at(opposing.station_m)).y;
        let away_m = aside_m.abs() - other.width_at(opposing.station_m) / 2.0;
        Some(OncomingEdge { away_m, is_left: aside_m > 0.0, along: unit_vector(here.heading_rad) })
    };
    (0..=route.path.length_m() as usize).map(|metre| edge(metre as f64)).collect()
}
