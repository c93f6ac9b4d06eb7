//! Joins the moves of a way into one path, and notes where each lane and each lane change lies on it.

use avastra_base::geometry::{Path, Vec2};

use super::lane_change::{Place, Stretch};
use super::map::{LanePlace, RoadMap};
use super::route::{RouteLane, RouteLaneChange};
use super::search::Move;

/// Two lanes are joined over this length, m. Otherwise a millimetre between the end of one and the beginning of
/// the next would become a segment across the road.
const JOINT_M: f64 = 0.1;

/// Distance between the vertices of a lane change, m.
const CHANGE_STEP_M: f64 = 0.5;

/// A path while it is being built.
pub struct Joined<'a> {
    map: &'a RoadMap,
    points: Vec<(Vec2, f64, f64)>,
    length_m: f64,
    /// The path has come to this station of the last lane, m.
    lane_station_m: f64,
    pub lanes: Vec<RouteLane>,
    pub changes: Vec<RouteLaneChange>,
}

impl<'a> Joined<'a> {
    pub fn new(map: &'a RoadMap, start: LanePlace) -> Joined<'a> {
        let length_m = map.lane(start.lane).centre.length_m();
        let first = RouteLane { lane: start.lane, from_m: -start.station_m, enter_m: 0.0, to_m: 0.0 };
        Joined {
            map,
            points: Vec::new(),
            length_m: 0.0,
            lane_station_m: start.station_m.clamp(0.0, length_m),
            lanes: vec![first],
            changes: Vec::new(),
        }
    }

    pub fn add(&mut self, step: &Move) {
        match step {
            Move::Follow(next) => {
                self.end_lane();
                let length_m = self.map.lane(*next).centre.length_m();
                // If there are no points yet, the route began at the very end of the lane before.
                self.lane_station_m = if self.points.is_empty() { 0.0 } else { JOINT_M.min(length_m / 2.0) };
                let here_m = self.length_m;
                self.lanes.push(RouteLane { lane: *next, from_m: here_m, enter_m: here_m, to_m: here_m });
            }
            Move::Change { stretch, length_m } => self.change(stretch, *length_m),
        }
    }

    /// The whole path, to the end of the last lane. `None` if it has no length.
    pub fn path(&mut self) -> Option<Path> {
        self.end_lane();
        Path::new(core::mem::take(&mut self.points))
    }

    fn end_lane(&mut self) {
        let centre = &self.map.lane(self.last().lane).centre;
        self.advance(centre.length_m());
        self.last().to_m = self.length_m;
    }

    fn last(&mut self) -> &mut RouteLane {
        self.lanes.last_mut().expect("there is a lane from the beginning")
    }

    /// Extends the path along the last lane up to a station.
    fn advance(&mut self, lane_station_m: f64) {
        let centre = &self.map.lane(self.last().lane).centre;
        let part = centre.part(self.lane_station_m, lane_station_m);
        for point in part.iter().flat_map(Path::points) {
            self.add_point((point.position, point.heading_rad, point.curvature_per_m));
        }
        self.lane_station_m = self.lane_station_m.max(lane_station_m);
    }

    fn add_point(&mut self, point: (Vec2, f64, f64)) {
        self.length_m += self.points.last().map_or(0.0, |last| (point.0 - last.0).norm());
        self.points.push(point);
    }

    fn change(&mut self, stretch: &Stretch, length_m: f64) {
        let map = self.map;
        self.advance(stretch.pairs[0].from_m);
        if self.points.is_empty() {
            self.add_point(stretch.blend(map, length_m, 0.0));
        }
        let begin_m = self.length_m;
        let steps = (length_m / CHANGE_STEP_M).ceil().max(1.0) as u32;
        let mut shifts_m = vec![(begin_m, stretch.shift_m(map, stretch.place(0.0)))];
        let mut before = stretch.place(0.0);
        for i in 1..=steps {
            let fraction = f64::from(i) / f64::from(steps);
            let place = stretch.place(length_m * fraction);
            self.add_point(stretch.blend(map, length_m, fraction));
            self.pass(stretch, before, place, fraction);
            before = place;
            shifts_m.push((self.length_m, stretch.shift_m(map, place)));
        }
        let end_m = self.length_m;
        self.lane_station_m = stretch.target_station_m(map, before);
        self.last().from_m = end_m - self.lane_station_m;
        let latest_m = shifts_beyond(map, stretch, length_m, end_m, &mut shifts_m);
        let lateral_m = stretch.shift_m(map, before);
        self.changes.push(RouteLaneChange { begin_m, end_m, latest_m, lateral_m, shifts_m });
    }

    /// Notes the lanes of a change: the path is in the source lanes up to the middle of the change, then in the
    /// target lanes.
    fn pass(&mut self, stretch: &Stretch, before: Place, place: Place, fraction: f64) {
        let pair = &stretch.pairs[place.pair];
        let lane = if fraction < 0.5 { pair.source } else { pair.target };
        if self.last().lane == lane {
            return;
        }
        let in_source = fraction < 0.5;
        let lane_station_m =
            if in_source { place.station_m } else { stretch.target_station_m(self.map, place) };
        let from_m = self.length_m - lane_station_m;
        let ahead = place.pair > before.pair;
        let left_m = if ahead { from_m } else { self.length_m };
        let last = *self.last();
        self.last().to_m = left_m;
        if ahead && last.lane == stretch.pairs[before.pair].target {
            // For a lane entered midway, its begin is computed from its end, which is the more exact figure.
            self.last().from_m = left_m - self.map.lane(last.lane).centre.length_m();
        }
        self.lanes.push(RouteLane { lane, from_m, enter_m: left_m, to_m: left_m });
    }
}

/// Appends the shifts behind the end of a change up to the end of its stretch, and returns the station there.
fn shifts_beyond(
    map: &RoadMap,
    stretch: &Stretch,
    changed_m: f64,
    end_m: f64,
    shifts_m: &mut Vec<(f64, f64)>,
) -> f64 {
    let rest_m = stretch.length_m() - changed_m;
    let steps = rest_m.ceil().max(0.0) as u32;
    let mut station_m = end_m;
    let mut before = stretch.place(changed_m);
    for i in 1..=steps {
        let place = stretch.place(changed_m + rest_m * f64::from(i) / f64::from(steps));
        let target_m = |place| stretch.target_station_m(map, place);
        station_m += if place.pair == before.pair {
            target_m(place) - target_m(before)
        } else {
            let ended = map.lane(stretch.pairs[before.pair].target).centre.length_m();
            ended - target_m(before) + target_m(place)
        };
        shifts_m.push((station_m, stretch.shift_m(map, place)));
        before = place;
    }
    station_m
}
