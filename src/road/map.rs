//! The lane graph, and how places on it are named and found.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use avastra_base::geometry::{Bounds, OrientedBox, Path, Pose, Vec2, wrap_angle};

use super::heights::Heights;
use super::index::LaneGrid;

/// Ends of linked lanes that are farther apart than this do not meet, m: a car would have to jump.
const LOOSE_M: f64 = 0.5;

/// Index of a lane in [`RoadMap::lanes`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LaneIndex(pub usize);

/// The name of a lane in its OpenDRIVE file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct LaneKey {
    pub road: String,
    /// Index of the lane section within the road. A section in which a limit or access changes counts as several.
    pub section: usize,
    /// OpenDRIVE's lane id: negative to the right of the reference line.
    pub lane: i32,
}

/// A point on a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LanePlace {
    pub lane: LaneIndex,
    /// m from the lane's beginning, in its driving direction.
    pub station_m: f64,
    /// m to the left of its centre.
    pub offset_m: f64,
}

/// A driving lane of one lane section. Its path runs in the direction of traffic.
#[derive(Debug, Clone)]
pub struct Lane {
    pub key: LaneKey,
    pub centre: Path,
    /// Width at each vertex of `centre`, m.
    pub widths_m: Vec<f64>,
    /// m/s.
    pub speed_limit_mps: f64,
    /// Whether the map states it; without a limit 50 km/h is taken.
    pub states_limit: bool,
    /// Whether its road is a motorway, on which nobody goes on foot.
    pub is_motorway: bool,
    /// Whether it is a bus lane.
    pub for_buses: bool,
    /// Whether traffic keeps left on its road.
    pub keeps_left: bool,
    pub successors: Vec<LaneIndex>,
    pub predecessors: Vec<LaneIndex>,
    /// Next driving lane to the left, in the same or the opposite direction, however wide the gap.
    pub left: Option<Neighbour>,
    pub right: Option<Neighbour>,
    /// The stretches on which a vehicle may change to the left (from and to, m), by rising station: outside
    /// junctions, into a neighbour of the same direction, where markings and widths permit it.
    pub changes_left_m: Vec<(f64, f64)>,
    /// The stretches on which a vehicle may change to the right.
    pub changes_right_m: Vec<(f64, f64)>,
    /// Index in [`RoadMap::junctions`], if the lane runs inside one.
    pub junction: Option<usize>,
    pub turn: Turn,
    /// Stop lines on this lane, by rising station.
    pub stop_lines: Vec<StopLine>,
    /// Where a stop or yield sign holds for this lane, by rising station. Empty where lights hold, too: they
    /// have precedence.
    pub sign_lines: Vec<SignLine>,
    /// The precedence that signs give a lane inside a junction; `Equal` for other lanes, and where lights stand.
    pub precedence: Precedence,
    pub(super) heights: Heights,
    /// Station of the road's reference line at each vertex of `centre`, m: rising or falling.
    pub(super) road_stations_m: Vec<f64>,
}

/// The lane beside a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    pub lane: LaneIndex,
    pub same_direction: bool,
    /// Width of whatever lies between the two lanes (a median), m; 0 where they share a line.
    pub gap_m: f64,
}

/// A side of a lane, in its driving direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    Left,
    Right,
}

/// The turn of a lane inside a junction; `Straight` everywhere else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    Straight,
    Left,
    Right,
    UTurn,
}

/// Where a lane or a route must stop for a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopLine {
    pub station_m: f64,
    /// Index in [`RoadMap::signals`].
    pub signal: usize,
}

/// Where a lane or a route must stop or give way because of a sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignLine {
    pub station_m: f64,
    /// `Stop` or `Yield`.
    pub kind: SignKind,
}

/// How traffic of a lane stands to crossing traffic by its signs: the lower of two goes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// It comes along a priority road.
    Priority,
    /// No sign says anything.
    Equal,
    /// It comes from a stop or yield sign.
    Yield,
}

/// A set of lights. All lights of one group show the same colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    pub id: String,
    pub position: Vec2,
    /// Index in [`RoadMap::junctions`].
    pub junction: Option<usize>,
    /// Its place in the junction's cycle, from 0. Lights whose traffic does not cross share a place.
    pub group: usize,
    /// Whether it is for vehicles, not for people on foot, cycles or trams.
    pub for_vehicles: bool,
    /// The lanes that it holds for. Several heads of a group may share one stop line.
    pub lanes: Vec<LaneIndex>,
}

/// A sign that says who gives way. Lights have precedence where both stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Sign {
    pub id: String,
    pub kind: SignKind,
    pub position: Vec2,
    /// The lanes that it holds for, each with the station of the sign on it, m.
    pub lanes: Vec<(LaneIndex, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignKind {
    Stop,
    Yield,
    /// The road has priority, at the next junction or until further notice.
    PriorityRoad,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Junction {
    pub id: String,
    pub name: String,
    /// The connecting lanes inside.
    pub lanes: Vec<LaneIndex>,
    /// Number of signal groups in its cycle; 0 if it has no signals.
    pub groups: usize,
    /// Number of its lights if none of them holds a lane; 0 otherwise. Such a junction is driven as if it had
    /// no lights.
    pub idle_lights: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Crosswalk {
    pub id: String,
    /// Corners, in order.
    pub outline: Vec<Vec2>,
    /// Height of its road there, m.
    pub height_m: f64,
}

/// A lane of the map that is left out, because no car drives on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// For example ``of type `bus` ``.
    pub what: String,
    /// Whether some vehicles would use it, so that an author may look for it.
    pub for_vehicles: bool,
}

/// A lane that is no driving lane, as far as it matters to people on foot.
#[derive(Debug, Clone)]
pub struct Strip {
    pub kind: StripKind,
    pub key: LaneKey,
    /// Station of the road's reference line at each vertex of `centre`, m.
    pub road_stations_m: Vec<f64>,
    pub centre: Path,
    /// Width at each vertex of `centre`, m.
    pub widths_m: Vec<f64>,
    /// The box around `centre`.
    pub bounds: Bounds,
}

/// A solid thing of the map that stands in a lane.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// For example ``obstacle `7` ``.
    pub what: String,
    /// A lane that it stands in, and where: one that stands in several is there for each.
    pub place: LanePlace,
}

/// Something solid, such as a building, a wall or a tree: nobody walks through it.
#[derive(Debug, Clone)]
pub struct Solid {
    /// Corners, in order.
    pub outline: Vec<Vec2>,
    /// The box around them.
    pub bounds: Bounds,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StripKind {
    /// A pavement.
    Walkway,
    /// Parking, cycles, trams: vehicles are on it, though cars do not drive along it.
    Paved,
}

/// A whole map.
#[derive(Debug, Clone, Default)]
pub struct RoadMap {
    pub name: String,
    /// The OpenDRIVE file that it was read from, if it was a file.
    pub file: Option<PathBuf>,
    pub lanes: Vec<Lane>,
    pub signals: Vec<Signal>,
    pub signs: Vec<Sign>,
    pub junctions: Vec<Junction>,
    pub crosswalks: Vec<Crosswalk>,
    pub strips: Vec<Strip>,
    pub solids: Vec<Solid>,
    /// Solid things that stand in lanes, where whatever drives passes through them.
    pub obstacles: Vec<Obstacle>,
    /// Whether roads may pass over each other. If not, no heights need to be compared.
    pub has_levels: bool,
    /// Repairs, and elements that were left out or not understood.
    pub warnings: Vec<String>,
    /// The places in the plane that warnings are about: index of the warning, position.
    pub warned_at: Vec<(usize, Vec2)>,
    /// The map's lanes on which no car drives, by road and lane id.
    pub left_out: BTreeMap<(String, i32), LeftOut>,
    pub(super) grid: LaneGrid,
}

/// Why a map or a route cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RoadError {
    #[error("line {line}: {message}")]
    Map { line: u32, message: String },
    #[error("{message}")]
    Route { message: String },
}

impl RoadMap {
    pub fn lane(&self, index: LaneIndex) -> &Lane {
        &self.lanes[index.0]
    }

    /// A lane inside a junction, and the lanes that lead to it, one before the other, until they are
    /// [`SIGNS_BEFORE_M`] long or come out of another junction.
    pub fn approach(&self, lane: LaneIndex) -> impl Iterator<Item = LaneIndex> + '_ {
        let mut away_m = 0.0;
        let lanes = core::iter::successors(Some(lane), move |after| {
            let before = *self.lane(*after).predecessors.first()?;
            let is_near = away_m < SIGNS_BEFORE_M && self.lane(before).junction.is_none();
            away_m += self.lane(before).centre.length_m();
            is_near.then_some(before)
        });
        lanes.take(APPROACH_LANES_MAX)
    }

    /// The stop line before a lane inside a junction, or on it.
    pub fn stop_line_of(&self, lane: LaneIndex) -> Option<StopLine> {
        self.approach(lane).find_map(|lane| self.lane(lane).stop_lines.last().copied())
    }

    /// Makes the lanes at these places bus lanes, with what they go on as before and behind up to junctions.
    pub fn keep_for_buses(&mut self, places: &[LanePlace]) {
        let mut open: Vec<LaneIndex> = places.iter().map(|place| place.lane).collect();
        while let Some(index) = open.pop() {
            let lane = &mut self.lanes[index.0];
            if core::mem::replace(&mut lane.for_buses, true) || lane.junction.is_some() {
                continue;
            }
            let beside = [&lane.successors, &lane.predecessors].into_iter().flatten().copied();
            let beside: Vec<LaneIndex> = beside.collect();
            open.extend(beside.into_iter().filter(|next| self.lane(*next).junction.is_none()));
        }
        self.close_for_buses();
    }

    /// A lane inside a junction from which only bus lanes go on is one too: no other vehicle turns into it.
    pub(super) fn close_for_buses(&mut self) {
        let leads_there = |lane: &Lane| {
            lane.junction.is_some()
                && !lane.successors.is_empty()
                && lane.successors.iter().all(|next| self.lane(*next).for_buses)
        };
        let inside: Vec<usize> =
            (0..self.lanes.len()).filter(|index| leads_there(&self.lanes[*index])).collect();
        inside.into_iter().for_each(|index| self.lanes[index].for_buses = true);
    }

    /// The place named by an OpenDRIVE road, lane and station (`s` along the road's reference line).
    ///
    /// # Errors
    /// Which of the three does not exist.
    pub fn place(&self, road: &str, lane: i32, s_m: f64) -> Result<LanePlace, RoadError> {
        let missing = |message: String| RoadError::Route { message };
        let on_road = || self.lanes.iter().enumerate().filter(|(_, candidate)| candidate.key.road == road);
        if on_road().next().is_none() {
            let roads: BTreeSet<&str> = self.lanes.iter().map(|lane| lane.key.road.as_str()).collect();
            let message = format!("no driving lane on a road `{road}`; there are {}", listed(roads));
            return Err(missing(message + &self.left_out_text(road, lane)));
        }
        let in_lane = || on_road().filter(|(_, candidate)| candidate.key.lane == lane);
        if in_lane().next().is_none() {
            let lanes: BTreeSet<i32> = on_road().map(|(_, candidate)| candidate.key.lane).collect();
            let message = format!("road `{road}` has no driving lane {lane}; it has {}", listed(lanes));
            return Err(missing(message + &self.left_out_text(road, lane)));
        }
        // Where two sections meet, the place is in the section that begins there.
        let held = in_lane().rfind(|(_, candidate)| {
            let (from_m, to_m) = candidate.road_range_m();
            (from_m - 1e-3..=to_m + 1e-3).contains(&s_m)
        });
        let Some((index, candidate)) = held else {
            let ranges = in_lane().map(|(_, candidate)| {
                let (from_m, to_m) = candidate.road_range_m();
                format!("{from_m:.1} to {to_m:.1} m")
            });
            let ranges = listed(ranges);
            return Err(missing(format!(
                "lane {lane} of road `{road}` is not there at {s_m} m; it reaches from {ranges}"
            )));
        };
        Ok(LanePlace { lane: LaneIndex(index), station_m: candidate.station_of(s_m), offset_m: 0.0 })
    }

    /// The middle of a strip, a lane along which no car drives but people may be, in its direction, at a station of the
    /// road's reference line, and whether that is the line's direction; `None` if there is no such strip.
    pub fn strip_pose(&self, road: &str, lane: i32, s_m: f64) -> Option<(Pose, bool)> {
        let holds = |strip: &&Strip| {
            let (first_m, last_m) = ends(&strip.road_stations_m);
            let held = first_m.min(last_m) - 1e-3..=first_m.max(last_m) + 1e-3;
            strip.key.road == road && strip.key.lane == lane && held.contains(&s_m)
        };
        let strip = self.strips.iter().rfind(holds)?;
        let (first_m, last_m) = ends(&strip.road_stations_m);
        let pose = strip.centre.pose_at(station_beside(&strip.road_stations_m, &strip.centre, s_m));
        Some((pose, first_m < last_m))
    }

    /// Says of a lane that is no driving lane what it is, to be appended to a message; empty if the map has no such lane.
    fn left_out_text(&self, road: &str, lane: i32) -> String {
        let Some(LeftOut { what, .. }) = self.left_out.get(&(road.to_owned(), lane)) else {
            return String::new();
        };
        format!("; the map's lane {lane} is {what}, and no car drives on it")
    }

    /// The nearest lane within `reach_m`, its own width included; among equals the one whose heading
    /// fits `heading_rad` best.
    ///
    /// All lanes whose surface holds the point are equally near. Between them the heading decides, and a metre
    /// off the centre weighs as much as a tenth of a radian: lanes of a junction lie over each other. Of two
    /// with the same heading, the lane with the nearer centre is meant.
    pub fn nearest(&self, point: Vec2, heading_rad: f64, reach_m: f64) -> Option<LanePlace> {
        let mut best: Option<(f64, f64, LanePlace)> = None;
        self.grid.visit(&self.lanes, point, reach_m, |index, projection| {
            let lane = self.lane(index);
            let beyond_m = (projection.distance_m - lane.width_at(projection.station_m) / 2.0).max(0.0);
            let lane_heading_rad = lane.centre.heading_at(projection.station_m);
            let turn_rad = wrap_angle(lane_heading_rad - heading_rad).abs();
            let misfit = turn_rad + MISFIT_RAD_PER_M * projection.distance_m;
            let is_better = best.is_none_or(|(best_m, best_misfit, found)| {
                // If two fit equally well, the first counts.
                let fits_better = misfit < best_misfit || misfit == best_misfit && index < found.lane;
                beyond_m < best_m - 1e-9 || beyond_m < best_m + 1e-9 && fits_better
            });
            if beyond_m <= reach_m && is_better {
                let (station_m, offset_m) = (projection.station_m, projection.offset_m);
                best = Some((beyond_m, misfit, LanePlace { lane: index, station_m, offset_m }));
            }
            best.map_or(reach_m, |(best_m, ..)| best_m)
        });
        best.map(|(_, _, place)| place)
    }

    /// Whether a point lies beyond the middle of the road: on lanes that all run against a heading.
    pub fn runs_against(&self, point: Vec2, heading_rad: f64) -> bool {
        let fits = |place: LanePlace| {
            let lane_rad = self.lane(place.lane).centre.heading_at(place.station_m);
            wrap_angle(lane_rad - heading_rad).abs() <= core::f64::consts::FRAC_PI_2
        };
        self.nearest(point, heading_rad, 0.0).is_some_and(|place| !fits(place))
    }

    /// Whether any corner of a body lies, by more than [`BEYOND_M`], on lanes that all run against its heading.
    pub fn is_beyond_middle(&self, outline: &OrientedBox) -> bool {
        let within = OrientedBox {
            half_length_m: outline.half_length_m - BEYOND_M,
            half_width_m: outline.half_width_m - BEYOND_M,
            ..*outline
        };
        within.corners().iter().any(|corner| self.runs_against(*corner, outline.pose.heading_rad))
    }
}

/// A body that is beyond the middle of the road by less than this only touches the line, m. Ours: drivers keep lanes no better.
const BEYOND_M: f64 = 0.1;

/// How far before a junction its lights and signs may stand, m. Ours.
pub const SIGNS_BEFORE_M: f64 = 40.0;

/// Limit on the lanes of an approach: no real one has sections of 20 cm.
const APPROACH_LANES_MAX: usize = 200;

/// How much a metre beside the centre of a lane weighs against a turn, rad.
const MISFIT_RAD_PER_M: f64 = 0.1;

impl Lane {
    /// How far the next lane begins from where this one ends, m; `None` where they meet.
    pub(super) fn leap_m(&self, next: &Lane) -> Option<f64> {
        let end = self.centre.pose_at(self.centre.length_m()).position;
        let apart_m = (next.centre.pose_at(0.0).position - end).norm();
        (apart_m > LOOSE_M).then_some(apart_m)
    }

    /// Whether its traffic runs in the direction of the road's reference line.
    pub fn is_along(&self) -> bool {
        self.road_stations_m[0] < self.road_stations_m[self.road_stations_m.len() - 1]
    }

    /// The next driving lane to a side, of either direction.
    pub fn neighbour(&self, side: Side) -> Option<Neighbour> {
        match side {
            Side::Left => self.left,
            Side::Right => self.right,
        }
    }

    /// The stretches on which a vehicle may change to a side: from and to, m.
    pub fn changes_m(&self, side: Side) -> &[(f64, f64)] {
        match side {
            Side::Left => &self.changes_left_m,
            Side::Right => &self.changes_right_m,
        }
    }

    /// Width at a station, clamped to the lane, m.
    pub fn width_at(&self, station_m: f64) -> f64 {
        self.interpolated(&self.widths_m, station_m)
    }

    /// The ends of a line across the lane at a station: left, right.
    pub fn across(&self, station_m: f64) -> [Vec2; 2] {
        let half_m = self.width_at(station_m) / 2.0;
        let pose = self.centre.pose_at(station_m);
        [pose.offset(0.0, half_m).position, pose.offset(0.0, -half_m).position]
    }

    /// The lane's own station beside a station of the road's reference line, clamped to the lane, m.
    pub fn station_of(&self, s_m: f64) -> f64 {
        station_beside(&self.road_stations_m, &self.centre, s_m)
    }

    /// Station of the road's reference line beside a station of the lane, clamped to the lane, m.
    pub fn road_station_m(&self, station_m: f64) -> f64 {
        self.interpolated(&self.road_stations_m, station_m)
    }

    /// A value at a station, from those at the vertices of the centre line.
    fn interpolated(&self, values: &[f64], station_m: f64) -> f64 {
        let (index, fraction) = self.centre.locate(station_m);
        values[index] + (values[index + 1] - values[index]) * fraction.clamp(0.0, 1.0)
    }

    /// The first and the last station of the road's reference line beside the lane, m.
    fn road_range_m(&self) -> (f64, f64) {
        let (first_m, last_m) = ends(&self.road_stations_m);
        (first_m.min(last_m), first_m.max(last_m))
    }
}

fn ends(stations_m: &[f64]) -> (f64, f64) {
    (stations_m[0], stations_m[stations_m.len() - 1])
}

/// The station of a lane's centre line beside a station of the road's reference line, of which each vertex has its own, m.
fn station_beside(stations_m: &[f64], centre: &Path, s_m: f64) -> f64 {
    let (first_m, last_m) = ends(stations_m);
    let rising = first_m < last_m;
    let after = stations_m.partition_point(|at_m| if rising { *at_m <= s_m } else { *at_m >= s_m });
    let after = after.clamp(1, stations_m.len() - 1);
    let (from_m, to_m) = (stations_m[after - 1], stations_m[after]);
    let fraction = ((s_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
    let (a, b) = (&centre.points()[after - 1], &centre.points()[after]);
    a.station_m + (b.station_m - a.station_m) * fraction
}

/// Most names that a message lists: a city has thousands of roads.
const LISTED_MAX: usize = 40;

fn listed(items: impl IntoIterator<Item = impl ToString>) -> String {
    let mut names: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    let more = names.len().saturating_sub(LISTED_MAX);
    names.truncate(LISTED_MAX);
    names.extend((more > 0).then(|| format!("{more} more")));
    names.join(", ")
}
