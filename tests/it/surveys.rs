//! The authored roads against their surveys: a road is a file under `tests/cases/roads/`, named as in
//! `scenarios/roads.ava`, and every fact in it must hold of the map or of the road's route.

use std::collections::BTreeMap;
use std::fmt::Debug;

use serde::Deserialize;

use avastra::geometry::{Path, Pose, Vec2, wrap_angle};
use avastra::model::Road;
use avastra::road::{LaneIndex, RoadMap, Route};

use crate::cases::root;
use crate::world::space;

/// A lane centre of the map runs at most this far from the surveyed one, m.
const AGREEMENT_M: f64 = 0.3;

/// A surveyed figure and its tolerance, written `50.6 ± 1`.
#[derive(Deserialize, Clone, Copy)]
#[serde(try_from = "String")]
struct Near {
    value: f64,
    tolerance: f64,
}

impl TryFrom<String> for Near {
    type Error = String;

    fn try_from(text: String) -> Result<Near, String> {
        let parts = text.split_once(" ± ").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        let (value, tolerance) = parts.ok_or_else(|| format!("`{text}` is not `value ± tolerance`"))?;
        Ok(Near { value, tolerance })
    }
}

/// What was surveyed of a road. Places are x and y (m), poses have a heading (rad) after them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Survey {
    start: (f64, f64, f64),
    goal: (f64, f64, f64),
    /// Start and goal of the space's road lie at most this far from the surveyed ones, m.
    places_within_m: f64,
    /// Length of the route from start to goal, m.
    goal_m: Near,
    /// Length of the route beyond the goal, m.
    beyond_goal_m: Option<Near>,
    /// The route bends nowhere more tightly than this, m.
    radius_m_min: Option<f64>,
    /// Lane changes of the route, in order.
    changes: Vec<Change>,
    /// Stop lines of the route, in order.
    stop_lines: Vec<StopLine>,
    /// Number of crosswalks on the map.
    crosswalks: usize,
    /// Where the route crosses crosswalks: from and to, m.
    route_crosswalks: Vec<(Near, Near)>,
    /// Number of lanes with which the route is in conflict.
    conflict_count: Option<usize>,
    /// Lanes with which the route is in conflict, named by their ways through the junction.
    #[serde(default)]
    conflicts: BTreeMap<String, Conflict>,
    #[serde(default)]
    beside: Vec<Beside>,
    /// The limit of every lane, m/s.
    speed_limit_mps: f64,
    /// Number of lanes for each kind of turn.
    #[serde(default)]
    turns: BTreeMap<String, usize>,
    /// Number of lanes that begin or end elsewhere than at the rim of the map.
    ends_on_the_way: usize,
    junctions: BTreeMap<String, Junction>,
    /// Centre of the lane that the route follows after its lane changes.
    line: Vec<(f64, f64)>,
    #[serde(default)]
    legs: BTreeMap<String, Leg>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    /// Positive to the left, m.
    lateral_m: Near,
    latest_m_max: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StopLine {
    /// Station on the route, m.
    at: Near,
    signal: String,
    junction: String,
    group: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Conflict {
    /// Station on the route, m.
    at: Option<Near>,
    angle_deg: Option<Near>,
}

/// The lanes beside the route, with the gap to each: an oncoming one to the left, one of the same
/// direction to the right.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Beside {
    /// Stations on the route, m.
    at: Vec<f64>,
    oncoming_left_m: Near,
    same_direction_right_m: Near,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Junction {
    /// Number of lights in each group of the signal cycle.
    lights: Option<Vec<usize>>,
    /// All ways through it, as `road/lane > road/lane`, sorted.
    ways: Option<Vec<String>>,
}

/// A surveyed carriageway.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Leg {
    /// Where the reference line begins.
    start: (f64, f64, f64),
    /// The reference line, piece by piece: length in m, curvature in 1/m.
    pieces: Vec<(f64, f64)>,
    /// Offset of each lane's centre at the begin and at the end, m, positive to the left.
    lanes: Vec<(f64, f64)>,
    /// The stretch of the carriageway that is compared with the map: from and to, m.
    compared: (f64, f64),
}

impl Leg {
    /// Pose on the reference line.
    fn at(&self, station_m: f64) -> Pose {
        let mut pose = Pose::new(self.start.0, self.start.1, self.start.2);
        let mut left_m = station_m;
        for (length_m, curvature_per_m) in &self.pieces {
            let step_m = left_m.min(*length_m);
            let turn_rad = step_m * curvature_per_m;
            // The chord of an arc lies half its angle off the tangent.
            let half_rad = turn_rad / 2.0;
            let chord_m =
                if half_rad.abs() < 1e-9 { step_m } else { step_m * libm::sin(half_rad) / half_rad };
            let along = Pose { heading_rad: pose.heading_rad + half_rad, ..pose };
            pose = Pose { heading_rad: pose.heading_rad + turn_rad, ..along.offset(chord_m, 0.0) };
            left_m -= step_m;
        }
        pose
    }
}

/// Where a road and its survey differ. All differences are shown together.
struct Differences(Vec<String>);

impl Differences {
    fn holds(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds {
            self.0.push(what());
        }
    }

    fn equal<T: PartialEq + Debug>(&mut self, what: &str, found: T, surveyed: T) {
        self.holds(found == surveyed, || format!("{what}: {found:?}, surveyed {surveyed:?}"));
    }

    fn near(&mut self, what: &str, found: f64, surveyed: Near) {
        let Near { value, tolerance } = surveyed;
        self.holds((found - value).abs() <= tolerance, || {
            format!("{what}: {found}, not {value} ± {tolerance}")
        });
    }

    /// Compares things in order: there are as many as surveyed, and each is as surveyed.
    fn each<T: Debug, S>(
        &mut self,
        what: &str,
        found: &[T],
        surveyed: &[S],
        mut compare: impl FnMut(&mut Differences, &T, &S),
    ) {
        self.holds(found.len() == surveyed.len(), || format!("{what}: {found:?}"));
        for (found, surveyed) in found.iter().zip(surveyed) {
            compare(self, found, surveyed);
        }
    }
}

#[test]
fn roads_agree_with_their_surveys() {
    let space = space("roads.ava");
    let roads = &space.roads;
    assert_eq!(roads.len(), 4);
    let mut differences = Differences(Vec::new());
    for road in roads {
        let path = root().join("tests/cases/roads").join(&road.name).with_extension("yaml");
        let text = std::fs::read_to_string(&path).expect("every road has a survey");
        let survey: Survey =
            serde_yaml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", road.name));
        let mut found = Differences(Vec::new());
        found.equal("warnings", &road.map.warnings, &Vec::new());
        places(&mut found, road, &survey);
        route(&mut found, &road.route, &survey);
        stops(&mut found, road, &survey);
        conflicts(&mut found, road, &survey);
        neighbours(&mut found, road, &survey);
        carriageways(&mut found, &road.map, &survey);
        junctions(&mut found, &road.map, &survey);
        links(&mut found, &road.map, &survey);
        lanes(&mut found, &road.map, &survey);
        differences.0.extend(found.0.into_iter().map(|text| format!("{}: {text}", road.name)));
    }
    assert!(differences.0.is_empty(), "{}", differences.0.join("\n"));
}

/// Checks that start and goal lie where they were surveyed, and are found there.
fn places(found: &mut Differences, road: &Road, survey: &Survey) {
    for (what, place, (x, y, heading_rad)) in
        [("start", road.start, survey.start), ("goal", road.goal, survey.goal)]
    {
        let position = road.map.lane(place.lane).centre.pose_at(place.station_m).position;
        let distance_m = (position - Vec2::new(x, y)).norm();
        found.holds(distance_m < survey.places_within_m, || {
            format!("{what} at {position:?}, {distance_m} m off")
        });
        let nearest = road.map.nearest(Vec2::new(x, y), heading_rad, 1.0);
        let same = nearest.is_some_and(|near| {
            near.lane == place.lane && (near.station_m - place.station_m).abs() < survey.places_within_m
        });
        found.holds(same, || format!("{what}: {nearest:?} is found near it, not {place:?}"));
    }
}

/// Checks that the route has the surveyed length, follows the surveyed line once its lane changes are over,
/// and is not too tight.
fn route(found: &mut Differences, route: &Route, survey: &Survey) {
    found.near("length to the goal", route.goal_m, survey.goal_m);
    if let Some(beyond_m) = survey.beyond_goal_m {
        found.near("length beyond the goal", route.path.length_m() - route.goal_m, beyond_m);
    }
    found.each("lane changes", &route.changes, &survey.changes, |found, change, surveyed| {
        found.near("width of the lane change", change.lateral_m, surveyed.lateral_m);
        found.holds(change.latest_m < surveyed.latest_m_max, || format!("the change may wait: {change:?}"));
    });
    let line = Path::new(survey.line.iter().map(|(x, y)| (Vec2::new(*x, *y), 0.0, 0.0))).expect("a line");
    let beside_m =
        survey.changes.first().map_or(Near { value: 0.0, tolerance: AGREEMENT_M }, |change| change.lateral_m);
    found.near("start, beside the line", line.project(route.path.pose_at(0.0).position).distance_m, beside_m);
    let changed_m = route.changes.last().map_or(0.0, |change| change.end_m);
    let mut station_m = changed_m;
    while station_m < route.goal_m {
        let distance_m = line.project(route.path.pose_at(station_m).position).distance_m;
        found.holds(distance_m < AGREEMENT_M, || format!("route at {station_m} m: {distance_m} m off"));
        station_m += 0.5;
    }
    for (x, y) in &survey.line {
        let here = route.path.project(Vec2::new(*x, *y));
        let agrees = here.distance_m < AGREEMENT_M || here.station_m < changed_m;
        found.holds(agrees, || format!("line at {x}, {y}: {} m off", here.distance_m));
    }
    let bend_per_m = route.path.points().iter().map(|point| point.curvature_per_m.abs()).fold(0.0, f64::max);
    let least_m = survey.radius_m_min.unwrap_or(0.0);
    found.holds(1.0 / bend_per_m > least_m, || format!("a bend with a radius of {} m", 1.0 / bend_per_m));
}

/// Checks stop lines and crosswalks.
fn stops(found: &mut Differences, road: &Road, survey: &Survey) {
    found.each("stop lines", &road.route.stop_lines, &survey.stop_lines, |found, line, surveyed| {
        let signal = &road.map.signals[line.signal];
        let junction = signal.junction.map_or("", |index| &road.map.junctions[index].name);
        found.near(&surveyed.signal, line.station_m, surveyed.at);
        let named = (signal.id.as_str(), junction, signal.group);
        found.equal("light", named, (&surveyed.signal, &surveyed.junction, surveyed.group));
    });
    found.equal("crosswalks", road.map.crosswalks.len(), survey.crosswalks);
    found.each(
        "crosswalks of the route",
        &road.route.crosswalks_m,
        &survey.route_crosswalks,
        |found, span, surveyed| {
            found.near("begin of a crosswalk", span.0, surveyed.0);
            found.near("end of a crosswalk", span.1, surveyed.1);
        },
    );
}

fn conflicts(found: &mut Differences, road: &Road, survey: &Survey) {
    let conflicts = &road.route.conflicts;
    if let Some(count) = survey.conflict_count {
        found.equal("conflicts", conflicts.len(), count);
    }
    for (way, surveyed) in &survey.conflicts {
        let Some(conflict) = conflicts.iter().find(|conflict| way_of(&road.map, conflict.lane) == *way)
        else {
            found.0.push(format!("no conflict with {way}"));
            continue;
        };
        if let Some(at) = surveyed.at {
            found.near(&format!("conflict with {way}"), conflict.station_m, at);
        }
        if let Some(angle_deg) = surveyed.angle_deg {
            found.near(&format!("angle of {way}"), conflict.angle_rad.to_degrees(), angle_deg);
        }
    }
}

fn neighbours(found: &mut Differences, road: &Road, survey: &Survey) {
    for beside in &survey.beside {
        for station_m in &beside.at {
            let lane = road.map.lane(road.route.lane_at(*station_m).lane);
            for (side, neighbour, same_direction, gap_m) in [
                ("left", lane.left, false, beside.oncoming_left_m),
                ("right", lane.right, true, beside.same_direction_right_m),
            ] {
                let what = format!("{side} of the route at {station_m} m");
                let Some(neighbour) = neighbour else {
                    found.0.push(format!("no lane to the {what}"));
                    continue;
                };
                found.equal(&what, neighbour.same_direction, same_direction);
                found.near(&what, neighbour.gap_m, gap_m);
            }
        }
    }
}

/// Checks that lane centres of the map run along every surveyed lane, in its direction.
fn carriageways(found: &mut Differences, map: &RoadMap, survey: &Survey) {
    for (name, leg) in &survey.legs {
        let length_m: f64 = leg.pieces.iter().map(|(length_m, _)| length_m).sum();
        let (from_m, to_m) = leg.compared;
        for (index, (begin_m, end_m)) in leg.lanes.iter().enumerate() {
            for i in 0..=20 {
                let station_m = from_m + (to_m - from_m) * f64::from(i) / 20.0;
                let offset_m = begin_m + (end_m - begin_m) * station_m / length_m;
                let distance_m = distance_m(map, leg.at(station_m).offset(0.0, offset_m));
                found.holds(distance_m < AGREEMENT_M, || {
                    format!("{name}, lane {index} at {station_m:.1} m: {distance_m} m off")
                });
            }
        }
    }
}

/// Distance from a pose to the nearest lane centre that has about its heading.
fn distance_m(map: &RoadMap, pose: Pose) -> f64 {
    let near = map.lanes.iter().map(|lane| {
        let projected = lane.centre.project(pose.position);
        let heading_rad = lane.centre.pose_at(projected.station_m).heading_rad;
        (projected.distance_m, wrap_angle(heading_rad - pose.heading_rad).abs())
    });
    let fits = near.filter(|(_, turn_rad)| *turn_rad < 0.35).map(|(distance_m, _)| distance_m);
    fits.fold(f64::INFINITY, f64::min)
}

fn junctions(found: &mut Differences, map: &RoadMap, survey: &Survey) {
    for (name, surveyed) in &survey.junctions {
        let Some(index) = map.junctions.iter().position(|junction| junction.name == *name) else {
            found.0.push(format!("no junction {name}"));
            continue;
        };
        if let Some(lights) = &surveyed.lights {
            let of_group = |group| {
                map.signals
                    .iter()
                    .filter(|light| (light.junction, light.group) == (Some(index), group))
                    .count()
            };
            let counts: Vec<usize> = (0..map.junctions[index].groups).map(of_group).collect();
            found.equal(&format!("lights of {name}"), &counts, lights);
        }
        if let Some(surveyed) = &surveyed.ways {
            let mut ways: Vec<_> = map.junctions[index].lanes.iter().map(|lane| way_of(map, *lane)).collect();
            ways.sort();
            found.equal(&format!("ways through {name}"), &ways, surveyed);
        }
    }
}

/// The way through a junction that a lane belongs to, as `road/lane > road/lane`.
fn way_of(map: &RoadMap, lane: LaneIndex) -> String {
    let lane = map.lane(lane);
    let name = |index: &LaneIndex| format!("{}/{}", map.lane(*index).key.road, map.lane(*index).key.lane);
    let names = |lanes: &[LaneIndex]| lanes.iter().map(name).collect::<Vec<_>>().join(" and ");
    format!("{} > {}", names(&lane.predecessors), names(&lane.successors))
}

/// Checks that each lane begins where those before it end, in position and heading; few have none before.
fn links(found: &mut Differences, map: &RoadMap, survey: &Survey) {
    for lane in &map.lanes {
        let end = lane.centre.pose_at(lane.centre.length_m());
        for next in &lane.successors {
            let begin = map.lane(*next).centre.pose_at(0.0);
            let gap_m = (begin.position - end.position).norm();
            let turn_rad = wrap_angle(begin.heading_rad - end.heading_rad).abs();
            let joins = gap_m < 0.05 && turn_rad < 1.0_f64.to_radians();
            found.holds(joins, || {
                format!("{:?} to {:?}: {gap_m} m, {turn_rad} rad", lane.key, map.lane(*next).key)
            });
        }
    }
    let on_the_way = map.lanes.iter().filter(|lane| {
        let at_rim = lane.junction.is_none() && lane.key.section == 0;
        !at_rim && (lane.predecessors.is_empty() || lane.successors.is_empty())
    });
    found.equal("lanes that begin or end on the way", on_the_way.count(), survey.ends_on_the_way);
}

fn lanes(found: &mut Differences, map: &RoadMap, survey: &Survey) {
    for (turn, count) in &survey.turns {
        let lanes = map.lanes.iter().filter(|lane| format!("{:?}", lane.turn) == *turn);
        found.equal(turn, lanes.count(), *count);
    }
    for lane in map.lanes.iter().filter(|lane| lane.speed_limit_mps != survey.speed_limit_mps) {
        found.0.push(format!("{:?} has a limit of {} m/s", lane.key, lane.speed_limit_mps));
    }
}
