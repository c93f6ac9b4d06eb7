//! A road as the world needs it: the map, the ego vehicle's route, and what follows from both.

use std::sync::Arc;

use crate::road::{LaneIndex, RoadMap, Route};

use super::junction::ConflictAreas;
use super::right_of_way::{RouteArea, route_areas};
use super::way::Ways;

/// What stays the same during all episodes of one road. Shared, never copied.
#[derive(Debug)]
pub struct Scene {
    pub map: Arc<RoadMap>,
    /// Where the ego vehicle is to go.
    pub route: Route,
    areas: ConflictAreas,
    route_areas: Vec<RouteArea>,
    ways: Ways,
    /// Lanes outside junctions, each with the sum of the lengths up to its end, m.
    streets: Vec<(LaneIndex, f64)>,
}

impl Scene {
    pub fn new(map: Arc<RoadMap>, route: Route) -> Scene {
        let mut streets = Vec::new();
        let mut end_m = 0.0;
        for (index, lane) in map.lanes.iter().enumerate().filter(|(_, lane)| lane.junction.is_none()) {
            end_m += lane.centre.length_m();
            streets.push((LaneIndex(index), end_m));
        }
        let areas = ConflictAreas::new(&map);
        let route_areas = route_areas(&areas, &route);
        Scene { areas, route_areas, ways: Ways::default(), streets, map, route }
    }

    /// The place at a fraction of all streets laid end to end, so that every metre is equally likely.
    pub(super) fn street_at(&self, fraction: f64) -> Option<(LaneIndex, f64)> {
        let at_m = fraction * self.streets.last()?.1;
        let index = self.streets.partition_point(|street| street.1 <= at_m).min(self.streets.len() - 1);
        let begin_m = if index == 0 { 0.0 } else { self.streets[index - 1].1 };
        Some((self.streets[index].0, at_m - begin_m))
    }

    pub(super) fn ways(&self) -> &Ways {
        &self.ways
    }

    /// Where the ways of others cross or join the route, by rising station.
    pub(super) fn route_areas(&self) -> &[RouteArea] {
        &self.route_areas
    }

    pub(super) fn conflict_areas(&self) -> &ConflictAreas {
        &self.areas
    }
}
