//! Places on the map of `scenarios/roads/corner.xodr`: how they are named, found, and reached by a route.

use crate::{LaneIndex, RoadError, RoadMap, Route};
use avastra_base::geometry::Vec2;

const CORNER: &str = include_str!("../../../scenarios/roads/corner.xodr");

pub fn corner() -> RoadMap {
    RoadMap::from_opendrive("corner", CORNER).unwrap()
}

#[test]
fn every_lane_is_found_again_from_its_own_centre() {
    let map = corner();
    for (index, lane) in map.lanes.iter().enumerate() {
        for fraction in [0.05, 0.5, 0.95] {
            let station_m = lane.centre.length_m() * fraction;
            let pose = lane.centre.pose_at(station_m);
            let found = map.nearest(pose.position, pose.heading_rad, 0.5).unwrap();
            // Inside junctions lanes lie over each other; outside them a place has only one lane.
            if lane.junction.is_none() {
                assert_eq!(found.lane, LaneIndex(index));
                assert!((found.station_m - station_m).abs() < 1e-6);
            }
            assert!(found.offset_m.abs() < 0.6, "{:?}: {found:?}", lane.key);
        }
    }
    assert_eq!(map.nearest(Vec2::new(500.0, 500.0), 0.0, 3.0), None);
}

/// With a reach beyond all cells, the search tries all lanes.
#[test]
fn the_grid_finds_what_a_search_through_all_lanes_finds() {
    let map = corner();
    for i in 0..60 {
        for j in 0..60 {
            let point = Vec2::new(f64::from(i) * 6.1 - 200.0, f64::from(j) * 6.7 - 110.0);
            let heading_rad = f64::from(i * j % 7) - 3.0;
            let all = map.nearest(point, heading_rad, 1e6).unwrap();
            let lane = map.lane(all.lane);
            let beyond_m = lane.centre.project(point).distance_m - lane.width_at(all.station_m) / 2.0;
            let expected = (beyond_m <= 5.0).then_some(all);
            assert_eq!(map.nearest(point, heading_rad, 5.0), expected, "at {point:?}");
        }
    }
}

#[test]
fn places_are_named_or_refused() {
    let map = corner();
    let place = map.place("1", 2, 30.0).unwrap();
    let lane = map.lane(place.lane);
    assert!((place.station_m - (lane.centre.length_m() - 30.0)).abs() < 1e-6);
    for (road, lane, s_m, part) in
        [("99", -1, 0.0, "road `99`"), ("1", 3, 0.0, "lane 3"), ("1", -1, 900.0, "not there at 900 m")]
    {
        let Err(RoadError::Route { message }) = map.place(road, lane, s_m) else { panic!() };
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_route_may_begin_where_a_lane_ends() {
    let map = corner();
    let mut start = map.place("1", -1, 151.431).unwrap();
    let goal = map.place("2", -1, 10.0).unwrap();
    start.station_m = map.lane(start.lane).centre.length_m();
    let route = Route::find(&map, start, goal).unwrap();
    let way_m = map.lane(route.lanes[1].lane).centre.length_m();
    assert!((route.goal_m - way_m - 10.0).abs() < 1e-3, "{}", route.goal_m);
    assert!(
        (route.path.pose_at(route.goal_m).position
            - map.lane(goal.lane).centre.pose_at(goal.station_m).position)
            .norm()
            < 1e-3
    );
}
