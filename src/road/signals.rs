//! Traffic lights with their groups and stop lines, signs that say who gives way, crosswalks, and solid things.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use avastra_base::geometry::{Bounds, Pose, Vec2};

use super::graph::Builder;
use super::heights::is_apart;
use super::map::{
    Crosswalk, Lane, LaneIndex, LanePlace, Obstacle, Precedence, RoadError, RoadMap, Sign, SignKind,
    SignLine, Signal, Solid, StopLine,
};
use super::opendrive::{
    ControllerElement, Document, JunctionElement, Meaning, ObjectElement, ObjectKind, Orientation, Outline,
    RoadElement, RoadLink, SignalElement, wrong,
};

/// Signal heads of one group that are nearer to each other than this share a stop line, m.
const SHARED_LINE_M: f64 = 1.0;

/// A light so near to the beginning of a lane that leaves a junction stops no traffic of that lane, m.
const AT_THE_MOUTH_M: f64 = 1.0;

/// Limit on the lanes that signals hold for, counted once for each signal: a thousand lanes may meet at one light.
const HELD_MAX: usize = 1_000_000;

/// Adds all lights and signs: lights with a stop line on each lane they hold for.
///
/// # Errors
/// If they hold for more lanes than a map may have.
pub fn add_signals(builder: &mut Builder) -> Result<(), RoadError> {
    let placed = place_signals(builder);
    warn_of_controllers(builder, &placed);
    // For each light, the lanes it holds for, with the station of the light on them, m.
    let mut lights: Vec<Vec<(LaneIndex, f64)>> = vec![Vec::new(); placed.lights.len()];
    let mut held_lanes = 0;
    for (road_index, road) in builder.document.roads.iter().enumerate() {
        for (signal_index, signal) in road.signals.iter().enumerate() {
            if let Some(found) = placed.of(road_index, signal_index, signal) {
                let held = lanes_of(builder, road_index, signal);
                held_lanes += held.len();
                if held_lanes > HELD_MAX {
                    let message = format!(
                        "the signals up to here hold for more than {HELD_MAX} lanes in all; leave some out"
                    );
                    return Err(wrong(signal.line, message));
                }
                match found {
                    Found::Light(index) => lights[index].extend(held),
                    Found::Sign(index) => builder.map.signs[index].lanes.extend(held),
                }
            }
        }
    }
    set_groups(builder, &placed, &lights);
    let mut of_groups = GroupLines::new();
    for (index, held) in lights.iter().enumerate() {
        builder.map.signals[index].lanes = held.iter().map(|(lane, _)| *lane).collect();
        add_stop_lines(builder, index, held, &mut of_groups);
    }
    warn_of_idle_lights(builder, &placed, &lights);
    Ok(())
}

/// A signal of the file, as an index in the map's signals or in its signs.
#[derive(Clone, Copy)]
enum Found {
    Light(usize),
    Sign(usize),
}

/// Where the signals of the file went.
struct Placed<'a> {
    /// By road and place among its signals.
    own: BTreeMap<(usize, usize), Found>,
    /// The signal that a reference or a controller means by an id: the first that has it.
    by_id: BTreeMap<&'a str, Found>,
    /// For each light, its road and element.
    lights: Vec<(usize, &'a SignalElement)>,
}

impl Placed<'_> {
    /// The light or sign at the place of a signal or of a reference to one. Lights for people on foot hold no lane.
    fn of(&self, road: usize, place: usize, signal: &SignalElement) -> Option<Found> {
        if signal.reference {
            // It may point to a sign that was left out.
            return self.by_id.get(signal.id.as_str()).copied();
        }
        self.own.get(&(road, place)).copied().filter(|_| signal.meaning != Meaning::OtherLight)
    }
}

fn place_signals<'a>(builder: &mut Builder<'a>) -> Placed<'a> {
    let document = builder.document;
    let mut placed = Placed { own: BTreeMap::new(), by_id: BTreeMap::new(), lights: Vec::new() };
    // Ids that several signals have: the line of the second, and how many more there are.
    let mut doubled: BTreeMap<&str, (u32, usize)> = BTreeMap::new();
    for (road_index, road) in document.roads.iter().enumerate() {
        for (place, signal) in road.signals.iter().enumerate().filter(|(_, signal)| !signal.reference) {
            let position = position(road, signal.s_m, signal.t_m);
            let id = signal.id.clone();
            let found = match signal.meaning {
                Meaning::Sign(kind) => {
                    builder.map.signs.push(Sign { id, kind, position, lanes: Vec::new() });
                    Found::Sign(builder.map.signs.len() - 1)
                }
                Meaning::Light | Meaning::OtherLight => {
                    builder.map.signals.push(Signal {
                        id,
                        position,
                        junction: None,
                        group: 0,
                        for_vehicles: signal.meaning == Meaning::Light,
                        lanes: Vec::new(),
                    });
                    placed.lights.push((road_index, signal));
                    Found::Light(builder.map.signals.len() - 1)
                }
            };
            placed.own.insert((road_index, place), found);
            if let Entry::Vacant(entry) = placed.by_id.entry(signal.id.as_str()) {
                entry.insert(found);
            } else {
                doubled.entry(signal.id.as_str()).or_insert((signal.line, 0)).1 += 1;
            }
        }
    }
    for (id, (line, times)) in doubled {
        let message =
            format!("{times} more signals have the id `{id}`: references and controllers mean the first one");
        builder.warn(line, message);
    }
    placed
}

fn warn_of_controllers(builder: &mut Builder, placed: &Placed) {
    for controller in &builder.document.controllers {
        let is_light = |id: &String| matches!(placed.by_id.get(id.as_str()), Some(Found::Light(_)));
        let missing: Vec<_> = controller.signals.iter().filter(|(id, _)| !is_light(id)).collect();
        if let Some((first, line)) = missing.first() {
            let message = format!(
                "controller `{}` switches {} signals that are no lights, `{first}` the first of them",
                controller.id,
                missing.len()
            );
            builder.warn(*line, message);
        }
    }
}

/// Gives every light its junction and its group. Lights that no controller of a junction switches form a group
/// for each arm, so that two crossing streets are never green together.
fn set_groups(builder: &mut Builder, placed: &Placed, held: &[Vec<(LaneIndex, f64)>]) {
    let switched = switched(builder);
    let mut arms: BTreeMap<(usize, Arm), usize> = BTreeMap::new();
    let (mut of_arms, mut lone) = (0, 0);
    for (index, (road_index, signal)) in placed.lights.iter().enumerate() {
        let place = switched.get(signal.id.as_str()).copied().or_else(|| {
            let (junction, arm) = arm(builder, *road_index, signal, &held[index])?;
            of_arms += 1;
            let groups = &mut builder.map.junctions[junction].groups;
            let group = *arms.entry((junction, arm)).or_insert_with(|| {
                *groups += 1;
                *groups - 1
            });
            Some((junction, group))
        });
        lone += usize::from(place.is_none());
        builder.map.signals[index].junction = place.map(|(junction, _)| junction);
        builder.map.signals[index].group = place.map_or(0, |(_, group)| group);
    }
    let warnings = &mut builder.map.warnings;
    if of_arms > 0 {
        warnings.push(format!(
            "no junction's controller switches {of_arms} signals: each arm of their junctions is a group of its own"
        ));
    }
    if lone > 0 {
        warnings.push(format!(
            "{lone} signals belong to no junction and have no controller in one: each is its own group"
        ));
    }
}

/// An arm of a junction: a road, and whether its traffic drives along the reference line.
type Arm = (usize, bool);

/// Junction and arm of a light, by the traffic that it stops. A light that holds no lane belongs to the end of
/// the road near which it stands.
fn arm(
    builder: &Builder,
    road_index: usize,
    signal: &SignalElement,
    held: &[(LaneIndex, f64)],
) -> Option<(usize, Arm)> {
    let map = &builder.map;
    for (index, _) in held {
        let lane = map.lane(*index);
        let arm_of =
            |lane: &Lane| Some((builder.roads.get(lane.key.road.as_str()).copied()?, lane.is_along()));
        if let Some(junction) = lane.junction {
            let before = lane.predecessors.first().map_or(lane, |before| map.lane(*before));
            return Some((junction, arm_of(before)?));
        }
        if let Some(junction) = lane.successors.iter().find_map(|next| map.lane(*next).junction) {
            return Some((junction, arm_of(lane)?));
        }
    }
    let road = &builder.document.roads[road_index];
    let along = match signal.orientation {
        Orientation::Along => true,
        Orientation::Against => false,
        Orientation::Both => signal.s_m > road.length_m / 2.0,
    };
    let ahead = if along { &road.successor } else { &road.predecessor };
    let Some(RoadLink::Junction { id, .. }) = ahead else { return None };
    Some((builder.junctions.get(id.as_str()).copied()?, (road_index, along)))
}

/// Junction and group of each signal that a junction's controller switches.
fn switched<'a>(builder: &mut Builder<'a>) -> BTreeMap<&'a str, (usize, usize)> {
    let document = builder.document;
    // The first of several with one id holds.
    let controllers: BTreeMap<&str, &'a ControllerElement> =
        document.controllers.iter().rev().map(|controller| (controller.id.as_str(), controller)).collect();
    let mut groups = BTreeMap::new();
    for (junction_index, junction) in document.junctions.iter().enumerate() {
        for (group, (id, line)) in junction.controllers.iter().enumerate() {
            let Some(controller) = controllers.get(id.as_str()).copied() else {
                let message =
                    format!("junction `{}` names controller `{id}`, which does not exist", junction.id);
                builder.warn(*line, message);
                continue;
            };
            for (signal, _) in &controller.signals {
                groups.insert(signal.as_str(), (junction_index, group));
            }
        }
    }
    groups
}

/// Warns of lights that hold no lane, and marks junctions without a light that holds one. A light whose lanes are all
/// for cycles or trams counts as none for vehicles.
fn warn_of_idle_lights(builder: &mut Builder, placed: &Placed, held: &[Vec<(LaneIndex, f64)>]) {
    let mut lit = vec![(0, 0); builder.map.junctions.len()];
    for (index, (road_index, signal)) in placed.lights.iter().enumerate() {
        let idle = held[index].is_empty();
        let road = &builder.document.roads[*road_index];
        let lanes = &road.sections[road.section_at(signal.s_m)].lanes;
        let mut named = lanes.iter().filter(|lane| signal.names(lane.id)).peekable();
        let others_only = idle && named.peek().is_some() && named.all(|lane| lane.undriven.is_some());
        if signal.meaning == Meaning::OtherLight || others_only {
            builder.map.signals[index].for_vehicles = false;
            continue;
        }
        if idle {
            builder.warn(signal.line, format!("light `{}` holds no lane: it stops nobody", signal.id));
        }
        if let Some(junction) = builder.map.signals[index].junction {
            lit[junction].0 += 1;
            lit[junction].1 += usize::from(!idle);
        }
    }
    for (junction, (lights, working)) in builder.map.junctions.iter_mut().zip(lit) {
        junction.idle_lights = if working == 0 { lights } else { 0 };
    }
}

/// The stations of the stop lines of each lane, junction and group, as the bits of numbers from 0, which sort as the numbers
/// do.
type GroupLines = BTreeMap<(LaneIndex, usize, usize), BTreeSet<u64>>;

fn add_stop_lines(
    builder: &mut Builder,
    index: usize,
    held: &[(LaneIndex, f64)],
    of_groups: &mut GroupLines,
) {
    let Signal { junction, group, .. } = builder.map.signals[index];
    for &(lane_index, station_m) in held {
        if let Some(junction) = junction {
            let known = of_groups.entry((lane_index, junction, group)).or_default();
            let bits = station_m.max(0.0).to_bits();
            let beside = [known.range(..=bits).next_back(), known.range(bits..).next()];
            let shares = |other: &u64| (f64::from_bits(*other) - station_m).abs() < SHARED_LINE_M;
            if beside.into_iter().flatten().any(shares) {
                continue;
            }
            known.insert(bits);
        }
        builder.map.lanes[lane_index.0].stop_lines.push(StopLine { station_m, signal: index });
    }
}

/// The lanes that a signal holds for, with its station on them, m.
///
/// Writers of maps disagree about `orientation`; their lights are read by what they can mean:
/// - `validity` names lanes: it goes before the orientation, which chooses only where both directions are named.
///   Lane 0 is no driving lane: a light with that validity alone holds through its references.
/// - A light at the very beginning of lanes that leave a junction would stop traffic that has passed it. It is
///   meant for the lanes that come to the junction there (LGSVL's maps) or, on a one-way road or with lanes
///   named, for the ways through the junction that lead to it.
/// - A light inside a junction stops traffic before the junction.
fn lanes_of(builder: &Builder, road_index: usize, signal: &SignalElement) -> Vec<(LaneIndex, f64)> {
    let road = &builder.document.roads[road_index];
    let section_index = road.section_at(signal.s_m);
    let is_sign = matches!(signal.meaning, Meaning::Sign(_));
    let named = |id: i32| signal.validity.is_empty() || signal.names(id);
    let ids: Vec<i32> = road.sections[section_index].lanes.iter().map(|lane| lane.id).collect();
    let lanes = |wanted: &dyn Fn(i32) -> bool| -> Vec<LaneIndex> {
        let ids = ids.iter().filter(|id| wanted(**id));
        ids.filter_map(|id| builder.lane_index(road_index, section_index, *id)).collect()
    };
    let fits = |id: i32| match signal.orientation {
        Orientation::Along => road.runs_along(id),
        Orientation::Against => !road.runs_along(id),
        Orientation::Both => true,
    };
    let mut held = lanes(&|id| named(id) && fits(id));
    if held.is_empty() {
        held = lanes(&named);
    }
    let at_light = |lane: &LaneIndex| (*lane, builder.map.lane(*lane).station_of(signal.s_m));
    let leaves = |lane: &LaneIndex| {
        let (index, station_m) = at_light(lane);
        let lane = builder.map.lane(index);
        let mut before = lane.predecessors.iter().map(|before| builder.map.lane(*before));
        let from_junction = before.any(|before| before.junction.is_some());
        lane.junction.is_none() && from_junction && station_m < AT_THE_MOUTH_M
    };
    if !held.is_empty() && held.iter().all(leaves) {
        let coming = lanes(&|id| !fits(id));
        if signal.validity.is_empty() && !coming.is_empty() {
            held = coming;
        } else if !is_sign {
            held = held.iter().flat_map(|lane| builder.map.lane(*lane).predecessors.clone()).collect();
        }
    }
    let line = |lane: LaneIndex| {
        let inside = builder.map.lane(lane).junction.is_some();
        if inside && !is_sign { (lane, 0.0) } else { at_light(&lane) }
    };
    held.into_iter().map(line).collect()
}

/// Notes on every lane the signs that hold for it, and on the lanes inside junctions what follows from them.
pub fn set_precedence<'a>(document: &'a Document, map: &mut RoadMap) {
    for sign in &map.signs {
        for &(index, station_m) in sign.lanes.iter().filter(|_| sign.kind != SignKind::PriorityRoad) {
            let lane = &mut map.lanes[index.0];
            if lane.stop_lines.is_empty() {
                lane.sign_lines.push(SignLine { station_m, kind: sign.kind });
            }
        }
    }
    for lane in &mut map.lanes {
        lane.sign_lines.sort_by(|a, b| a.station_m.total_cmp(&b.station_m));
    }
    let priority_signs = map.signs.iter().filter(|sign| sign.kind == SignKind::PriorityRoad);
    let on_priority_road: BTreeSet<LaneIndex> =
        priority_signs.flat_map(|sign| sign.lanes.iter().map(|(lane, _)| *lane)).collect();
    let named = |junction: &'a JunctionElement| -> Records<'a> {
        junction.priorities.iter().map(|(high, low)| (high.as_str(), low.as_str())).unzip()
    };
    let records: Vec<Records> = document.junctions.iter().map(named).collect();
    let precedence = |lane: LaneIndex| {
        if map.stop_line_of(lane).is_some() {
            Precedence::Equal
        } else if map.approach(lane).any(|lane| !map.lane(lane).sign_lines.is_empty()) {
            Precedence::Yield
        } else if map.approach(lane).any(|lane| on_priority_road.contains(&lane)) {
            Precedence::Priority
        } else {
            recorded(&records, map, lane)
        }
    };
    let inside = map.junctions.iter().flat_map(|junction| junction.lanes.iter().copied());
    let found: Vec<_> = inside.map(|lane| (lane, precedence(lane))).collect();
    for (lane, precedence) in found {
        map.lanes[lane.0].precedence = precedence;
    }
}

/// The roads that the `priority` records of a junction name: those that go first, and those that give way.
type Records<'a> = (BTreeSet<&'a str>, BTreeSet<&'a str>);

/// The precedence of a lane by the `priority` records of its junction: they name its road or the road before it.
fn recorded(records: &[Records], map: &RoadMap, index: LaneIndex) -> Precedence {
    let lane = map.lane(index);
    let Some(junction) = lane.junction else { return Precedence::Equal };
    let before = lane.predecessors.iter().map(|before| &map.lane(*before).key.road);
    let mut roads = core::iter::once(&lane.key.road).chain(before).map(String::as_str);
    let (high, low) = &records[junction];
    if roads.clone().any(|road| low.contains(road)) {
        Precedence::Yield
    } else if roads.any(|road| high.contains(road)) {
        Precedence::Priority
    } else {
        Precedence::Equal
    }
}

/// Adds all crosswalks and solid things, with their corners in the plane.
pub fn add_objects(builder: &mut Builder) {
    for road in &builder.document.roads {
        for object in &road.objects {
            let outline = outline(road, object);
            match object.kind {
                ObjectKind::Crosswalk => {
                    let (id, height_m) = (object.id.clone(), road.elevation.at(object.s_m).value);
                    builder.map.crosswalks.push(Crosswalk { id, outline, height_m });
                }
                ObjectKind::Solid => {
                    let bounds = Bounds::around(&outline);
                    builder.map.solids.push(Solid { outline, bounds });
                }
            }
        }
    }
}

/// The corners of an object in the plane.
fn outline(road: &RoadElement, object: &ObjectElement) -> Vec<Vec2> {
    match &object.outline {
        Outline::Local(corners) => {
            let heading_rad = road.reference.at(object.s_m).heading_rad + object.heading_rad;
            let pose = Pose { position: position(road, object.s_m, object.t_m), heading_rad };
            corners.iter().map(|(u, v)| pose.to_world(Vec2::new(*u, *v))).collect()
        }
        Outline::Road(corners) => corners.iter().map(|(s, t)| position(road, *s, *t)).collect(),
    }
}

/// Something solid that reaches farther into a lane than this stands in it, m. Walls and barriers stand at edges.
const REACHES_M: f64 = 0.3;

/// The outlines of solid things are looked at in such steps, m, and in at most so many of one edge and of a map.
const OUTLINE_STEP_M: f64 = 1.0;
const EDGE_STEPS_MAX: f64 = 100.0;
const OUTLINE_STEPS_MAX: usize = 200_000;

/// Finds the solid things that stand in lanes, and warns of them: nothing that drives knows them.
pub fn find_obstacles(document: &Document, map: &mut RoadMap) {
    let (mut steps, mut count) = (0, 0);
    for road in &document.roads {
        let solid = |object: &&ObjectElement| object.kind == ObjectKind::Solid && object.is_on_the_ground;
        for object in road.objects.iter().filter(solid) {
            let height_m = road.elevation.at(object.s_m).value;
            let corners = outline(road, object);
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            let points = edges.flat_map(|(from, to)| {
                let count = ((to - from).norm() / OUTLINE_STEP_M).ceil().clamp(1.0, EDGE_STEPS_MAX);
                (0..count as u32).map(move |nth| from + (to - from) * (f64::from(nth) / count))
            });
            let mut places: BTreeMap<LaneIndex, LanePlace> = BTreeMap::new();
            for point in points {
                steps += 1;
                if steps > OUTLINE_STEPS_MAX {
                    break;
                }
                let Some(place) = map.nearest(point, 0.0, 0.0) else { continue };
                let lane = map.lane(place.lane);
                let is_deep = place.offset_m.abs() < lane.width_at(place.station_m) / 2.0 - REACHES_M;
                if is_deep && !is_apart(lane.height_at(place.station_m), height_m) {
                    places.entry(place.lane).or_insert(place);
                }
            }
            count += usize::from(!places.is_empty());
            map.obstacles.extend(places.into_values().map(|place| {
                let what = format!("{} `{}`", object.word, object.id);
                Obstacle { what, place }
            }));
        }
    }
    if let Some(Obstacle { what, place }) = map.obstacles.first() {
        let lane = map.lane(place.lane);
        let warning = format!(
            "solid objects that stand in driving lanes: {count}; whatever drives passes through them; the first is {what} in lane {} of road `{}` at s {:.1}",
            lane.key.lane,
            lane.key.road,
            lane.road_station_m(place.station_m)
        );
        map.warned_at.push((map.warnings.len(), lane.centre.position_at(place.station_m)));
        map.warnings.push(warning);
    }
    if steps > OUTLINE_STEPS_MAX {
        let warning = "so many solid objects stand beside the roads that not all were looked at: more may stand in driving lanes";
        map.warnings.push(warning.to_owned());
    }
}

fn position(road: &RoadElement, s_m: f64, t_m: f64) -> Vec2 {
    let reference = road.reference.at(s_m);
    Pose { position: reference.position, heading_rad: reference.heading_rad }.offset(0.0, t_m).position
}
