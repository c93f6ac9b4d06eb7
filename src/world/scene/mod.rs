//! A road as the world needs it: the map, the ego vehicle's route, and what follows from both.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use avastra_base::geometry::{Path, Vec2};
use avastra_lang::model::{CROSSWALK_GAP_M_MAX, Laid, Road, SignalProgram};
use avastra_road::{FootWay, LaneIndex, Neighbour, RoadMap, Route};

pub(crate) mod junction;
pub(crate) mod lanes;
mod oncoming;
#[macro_use]
pub(crate) mod settings;
pub(crate) mod traffic;
pub(crate) mod way;

use junction::{RouteArea, route_areas};
use oncoming::{OncomingEdge, oncoming_edges};
pub use way::RANGE_M;
use way::Roads;

/// How far vehicles are sensed on a motorway, m: as far as the long-range radar that Apollo takes reaches (Continental ARS
/// 408-21).
const MOTORWAY_RANGE_M: f64 = 250.0;

/// The route is looked at in points this far from each other, m, and in so many of them. They reach as far as vehicles
/// are sensed on motorways.
pub(crate) const WAY_STEP_M: f64 = 10.0;
const WAY_POINTS: usize = (MOTORWAY_RANGE_M / WAY_STEP_M) as usize;

/// Points of the route ahead of a station.
pub(crate) struct WayPoints<'a> {
    /// Station of the first one, m.
    pub first_m: f64,
    pub points: &'a [Vec2],
    /// The least x and y of them, and the greatest.
    pub least: Vec2,
    pub greatest: Vec2,
}

/// Points all along a route, and for each the least and the greatest x and y of those that are ahead of it.
#[derive(Debug)]
struct RoutePoints {
    points: Vec<Vec2>,
    bounds: Vec<(Vec2, Vec2)>,
}

impl RoutePoints {
    fn new(path: &Path) -> RoutePoints {
        let count = (path.length_m() / WAY_STEP_M) as usize;
        let points: Vec<Vec2> = (0..=count).map(|nth| path.position_at(nth as f64 * WAY_STEP_M)).collect();
        let none = Vec2::new(f64::INFINITY, f64::INFINITY);
        let bounds = (0..=points.len()).map(|first| {
            let ahead = &points[first..(first + WAY_POINTS).min(points.len())];
            ahead
                .iter()
                .fold((none, -none), |(least, greatest), point| (least.inf(point), greatest.sup(point)))
        });
        RoutePoints { bounds: bounds.collect(), points }
    }

    fn ahead(&self, station_m: f64) -> WayPoints<'_> {
        let first = ((station_m / WAY_STEP_M).max(0.0) as usize).min(self.points.len());
        let points = &self.points[first..(first + WAY_POINTS).min(self.points.len())];
        let (least, greatest) = self.bounds[first];
        WayPoints { first_m: first as f64 * WAY_STEP_M, points, least, greatest }
    }
}

/// The parts that stay the same during all episodes of one road. Shared, never copied.
#[derive(Debug)]
pub struct Scene {
    pub map: Arc<RoadMap>,
    /// Where the ego vehicle is to go.
    pub route: Route,
    /// The speed that it is to want on a free road, m/s; `None`: its driver's own.
    pub set_mps: Option<f64>,
    /// Whether all of the route is a motorway.
    pub is_motorway: bool,
    /// How far vehicles are sensed, m.
    pub range_m: f64,
    pub(crate) signal_program: SignalProgram,
    /// Where the space's trajectories lie; `None` for those on other maps.
    pub(crate) trajectories: Vec<Option<Laid>>,
    /// Where the ways of others cross or join the route, by rising station.
    pub(crate) route_areas: Vec<RouteArea>,
    pub(crate) roads: Roads,
    foot_ways: FootWays,
    /// Lanes outside junctions, each with the sum of the lengths up to its end, m.
    streets: Vec<(LaneIndex, f64)>,
    /// Points of the route, and the edges of oncoming lanes at every metre of it. Only requirements
    /// ask for them.
    route_points: OnceLock<RoutePoints>,
    oncoming: OnceLock<Vec<Option<OncomingEdge>>>,
    /// A circle around each crosswalk of the map: its middle and its radius, m.
    crosswalk_circles: Vec<(Vec2, f64)>,
    /// The number of each lane of the route, as [`Scene::lane_number`] counts.
    lane_numbers: Vec<i32>,
    /// For each crosswalk of the route, the one of the map, by index.
    route_crosswalks: Vec<Option<usize>>,
}

impl Scene {
    /// The scene of a road of a space.
    pub fn of(road: &Road) -> Scene {
        let trajectories = road.trajectories.clone();
        let signal_program = road.signal_program;
        Scene {
            set_mps: road.set_mps,
            signal_program,
            trajectories,
            ..Scene::new(road.map.clone(), road.route.clone())
        }
    }

    pub fn new(map: Arc<RoadMap>, route: Route) -> Scene {
        let mut streets = Vec::new();
        let mut end_m = 0.0;
        for (index, lane) in map.lanes.iter().enumerate().filter(|(_, lane)| lane.junction.is_none()) {
            end_m += lane.centre.length_m();
            streets.push((LaneIndex(index), end_m));
        }
        let is_motorway = route.lanes.iter().all(|part| map.lane(part.lane).is_motorway);
        let roads = Roads::new(map.clone());
        let route_areas = route_areas(&roads.areas, &route);
        let circle = |outline: &[Vec2]| {
            let middle = outline.iter().sum::<Vec2>() / outline.len().max(1) as f64;
            (middle, outline.iter().map(|corner| (corner - middle).norm()).fold(0.0, f64::max))
        };
        let crosswalk_circles = map.crosswalks.iter().map(|crosswalk| circle(&crosswalk.outline)).collect();
        let on_route = |(from_m, to_m): &(f64, f64)| {
            let middle = route.path.position_at((from_m + to_m) / 2.0);
            (0..map.crosswalks.len()).find(|crosswalk| map.crosswalk_gap_m(*crosswalk, middle) <= 0.0)
        };
        let route_crosswalks = route.crosswalks_m.iter().map(on_route).collect();
        let mut lane_numbers: Vec<i32> = vec![0];
        for part in route.lanes.windows(2) {
            let is_beside = |side: Option<Neighbour>| side.is_some_and(|beside| beside.lane == part[1].lane);
            let of = map.lane(part[0].lane);
            let by = i32::from(is_beside(of.left)) - i32::from(is_beside(of.right));
            lane_numbers.push(lane_numbers[lane_numbers.len() - 1] + by);
        }
        Scene {
            lane_numbers,
            crosswalk_circles,
            route_crosswalks,
            route_areas,
            roads,
            foot_ways: FootWays::default(),
            streets,
            route_points: OnceLock::new(),
            oncoming: OnceLock::new(),
            is_motorway,
            range_m: if is_motorway { MOTORWAY_RANGE_M } else { RANGE_M },
            map,
            route,
            signal_program: SignalProgram::default(),
            trajectories: Vec::new(),
            set_mps: None,
        }
    }

    /// Half the width of the route's lane at a station of the route, m.
    pub fn half_width_m(&self, station_m: f64) -> f64 {
        let here = self.route.lane_at(station_m);
        self.map.lane(here.lane).width_at(station_m - here.from_m) / 2.0
    }

    /// The number of the lane at a station and an offset of the route. The lane in which the route begins has 0, those
    /// to its left 1, 2 and so on. Where the route changes lanes, its lane has another number from there on.
    pub(crate) fn lane_number(&self, station_m: f64, offset_m: f64) -> i32 {
        let mut number = self.route_lane_number(station_m);
        let Some((right_m, left_m)) = self.strip(station_m, number) else { return number };
        if (right_m..=left_m).contains(&offset_m) {
            return number;
        }
        let side = if offset_m > left_m { 1 } else { -1 };
        // In the gap between two lanes the one nearer to the route counts; beyond all of them, the outermost.
        while let Some((right_m, left_m)) = self.strip(station_m, number + side) {
            let is_beyond = if side > 0 { offset_m > right_m } else { offset_m < left_m };
            if !is_beyond {
                break;
            }
            number += side;
        }
        number
    }

    /// The number of the route's lane at a station.
    pub(crate) fn route_lane_number(&self, station_m: f64) -> i32 {
        let after = self.route.lanes.partition_point(|lane| lane.enter_m <= station_m);
        self.lane_numbers[after.max(1) - 1]
    }

    /// From where to where the lane of a number reaches beside a station, m to the left of the route; `None` if there is none.
    pub(crate) fn strip(&self, station_m: f64, number: i32) -> Option<(f64, f64)> {
        let half_m = self.half_width_m(station_m);
        let (here, mut lane) = (self.route.path.position_at(station_m), self.route.lane_at(station_m).lane);
        // In a lane change the route is on its way from one centre to another.
        let is_in_change = self.route.changes.iter().any(|of| (of.begin_m..=of.end_m).contains(&station_m));
        let centre_m = if is_in_change { -self.map.lane(lane).centre.project(here).offset_m } else { 0.0 };
        let (mut right_m, mut left_m) = (centre_m - half_m, centre_m + half_m);
        let (nth, mut is_ours) = (number - self.route_lane_number(station_m), true);
        for _ in 0..nth.abs() {
            let of = self.map.lane(lane);
            // Our left is the right of oncoming traffic.
            let next = if (nth > 0) == is_ours { of.left } else { of.right }?;
            let beside = self.map.lane(next.lane);
            let width_m = beside.width_at(beside.centre.project(here).station_m);
            (right_m, left_m) = match nth > 0 {
                true => (left_m + next.gap_m, left_m + next.gap_m + width_m),
                false => (right_m - next.gap_m - width_m, right_m - next.gap_m),
            };
            is_ours ^= !next.same_direction;
            lane = next.lane;
        }
        Some((right_m, left_m))
    }

    /// Distance from a point to the nearest crosswalk, m: 0 on one, at most [`CROSSWALK_GAP_M_MAX`].
    pub fn crosswalk_gap_m(&self, point: Vec2) -> f64 {
        self.crosswalk_circles.iter().enumerate().fold(CROSSWALK_GAP_M_MAX, |least_m, (crosswalk, circle)| {
            let (middle, radius_m) = circle;
            match (point - middle).norm() - radius_m < least_m {
                true => least_m.min(self.map.crosswalk_gap_m(crosswalk, point)),
                false => least_m,
            }
        })
    }

    /// Distance from a point to the nth crosswalk of the route, m: 0 on it, at most [`CROSSWALK_GAP_M_MAX`].
    pub(crate) fn route_crosswalk_gap_m(&self, nth: usize, point: Vec2) -> f64 {
        let Some(crosswalk) = self.route_crosswalks.get(nth).copied().flatten() else {
            return CROSSWALK_GAP_M_MAX;
        };
        let (middle, radius_m) = self.crosswalk_circles[crosswalk];
        match (point - middle).norm() - radius_m < CROSSWALK_GAP_M_MAX {
            true => self.map.crosswalk_gap_m(crosswalk, point).min(CROSSWALK_GAP_M_MAX),
            false => CROSSWALK_GAP_M_MAX,
        }
    }

    /// Points of the route from a station on, as far as it goes and as they are looked at.
    pub(crate) fn points_ahead(&self, station_m: f64) -> WayPoints<'_> {
        self.route_points.get_or_init(|| RoutePoints::new(&self.route.path)).ahead(station_m)
    }

    /// The near edge of the oncoming lane beside a station of the route, to the metre.
    pub(crate) fn oncoming_at(&self, station_m: f64) -> Option<OncomingEdge> {
        let edges = self.oncoming.get_or_init(|| oncoming_edges(&self.map, &self.route));
        *edges.get(station_m.max(0.0).round() as usize)?
    }

    /// The place at a fraction of all streets laid end to end, so that every metre is equally likely.
    pub(crate) fn street_at(&self, fraction: f64) -> Option<(LaneIndex, f64)> {
        let at_m = fraction * self.streets.last()?.1;
        let index = self.streets.partition_point(|street| street.1 <= at_m).min(self.streets.len() - 1);
        let begin_m = if index == 0 { 0.0 } else { self.streets[index - 1].1 };
        Some((self.streets[index].0, at_m - begin_m))
    }

    /// The way on foot over the road at a station of the route, along the crosswalk if one is there.
    ///
    /// # Errors
    /// Why people do not cross there, in words that complete "cannot spawn: …".
    pub(crate) fn foot_way(&self, station_m: f64) -> Result<FootWay, &'static str> {
        // Even if a thread panicked while it held the lock, the ways in here are whole.
        let known = || self.foot_ways.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(way) = known().get(&station_m.to_bits()) {
            return *way;
        }
        let here = self.route.path.pose_at(station_m);
        let mut left = here.left();
        if let Some(along) = self.map.crosswalk_at(here.position) {
            let along = if along.dot(&left) < 0.0 { -along } else { along };
            // An outline that is longer along the road than across says nothing of the way over it.
            if along.dot(&left) > core::f64::consts::FRAC_1_SQRT_2 {
                left = along;
            }
        }
        let way = self.map.foot_way(here.position, left);
        let mut known = known();
        if known.len() >= FOOT_WAYS_MAX {
            known.clear();
        }
        known.insert(station_m.to_bits(), way);
        way
    }
}

/// Number of ways on foot that are kept for a road: several rows and draws of a moment ask for the same.
const FOOT_WAYS_MAX: usize = 2048;

/// The ways on foot that were asked for lately, by the bits of their station.
#[derive(Debug, Default)]
struct FootWays(Mutex<BTreeMap<u64, Result<FootWay, &'static str>>>);
