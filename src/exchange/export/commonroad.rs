//! A recording as a CommonRoad scenario (XML 2020a, TUM): lanelets, traffic lights, everyone's trajectory, and a planning
//! problem, so that planners of that world can be tried on a crash.
//!
//! A time step is 0.1 s. Numbers: lanelet `n` is the nth lane of the map. The number of the road user that claims call
//! `npc#N` ends in N (`10002` is `npc#2`). With N = 0 it is the ego vehicle, if that is asked for. The planning problem
//! is to be on the route at the end of the recording without a contact. The goal of the episode is mostly farther away.
//!
//! Two departures. The schema wants every obstacle to be there at step 0; one that appears later begins later here, which
//! `commonroad-io` reads and writes too. Lights repeat what was recorded, not their whole cycle.
//!
//! Left out: weather (the format has words that do not fit ours), crosswalks, and signs other than speed limits.

use avastra_base::geometry::Vec2;
use avastra_campaign::episode::{Actor, Lights, Sample};
use avastra_lang::model::vocabulary::Body;
use avastra_road::{Lane, LaneIndex, Neighbour, RoadMap, Turn};

use super::DATE;
use super::recording::Recording;
use super::xml::{Element, number};

/// Ticks of a time step.
const STEP_TICKS: u64 = 5;
const STEP_S: f64 = 0.1;
/// Lanes beside each other share a border if nothing wider than this lies between them, m.
const BORDER_M: f64 = 0.3;
/// The goal may be reached within this many steps before the end: 1 s.
const GOAL_STEPS: u64 = 10;
/// Numbers of road users begin at a multiple of this.
const NUMBERS: usize = 10_000;

/// The file's text; with the ego vehicle's own drive as an obstacle, if that is asked for.
pub fn commonroad(recording: &Recording, with_ego: bool) -> String {
    let map = &recording.map;
    let mut taken = map.lanes.len();
    let mut next_id = || {
        taken += 1;
        taken
    };
    let limits: Vec<usize> = map.lanes.iter().map(|_| next_id()).collect();
    let lights: Vec<(usize, &Lights)> =
        recording.seen.lights.iter().map(|lights| (next_id(), lights)).collect();
    let junctions: Vec<Element> =
        (0..map.junctions.len()).filter_map(|junction| intersection(map, junction, &mut next_id)).collect();
    let problem = planning_problem(recording, next_id());
    let base = next_id().div_ceil(NUMBERS) * NUMBERS;
    let actors = recording.actors().filter(|actor| with_ego || actor.id != 0);
    let lanelets =
        map.lanes.iter().enumerate().map(|(index, lane)| lanelet(map, index, lane, limits[index], &lights));
    Element::new("commonRoad")
        .with("commonRoadVersion", "2020a")
        .with("benchmarkID", benchmark(&recording.name))
        .with("date", DATE)
        .with("author", "avastra")
        .with("affiliation", "avastra")
        .with("source", "avastra")
        .with("timeStepSize", STEP_S)
        .holding(nowhere())
        .holding(
            Element::new("scenarioTags").holding(Element::new("simulated")).holding(Element::new("critical")),
        )
        .holding_all(lanelets)
        .holding_all(map.lanes.iter().zip(&limits).map(|(lane, number)| limit(lane, *number)))
        .holding_all(lights.iter().map(|(number, lights)| light(recording, *number, lights)))
        .holding_all(junctions)
        .holding_all(actors.filter_map(|actor| obstacle(actor, base)))
        .holding(problem)
        .document()
}

/// A name in the form that the format asks for; ZAM is its country for what lies nowhere.
fn benchmark(name: &str) -> String {
    let name: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    format!("ZAM_{}-1_1_T-1", if name.is_empty() { "Scenario" } else { &name })
}

/// Our maps have no place on earth; these numbers say so.
fn nowhere() -> Element {
    Element::new("location")
        .holding(Element::text("geoNameId", -999))
        .holding(Element::text("gpsLatitude", 999))
        .holding(Element::text("gpsLongitude", 999))
}

fn lanelet(map: &RoadMap, index: usize, lane: &Lane, limit: usize, lights: &[(usize, &Lights)]) -> Element {
    let (mut left, mut right) = (Element::new("leftBound"), Element::new("rightBound"));
    for vertex in lane.centre.points() {
        let [on_left, on_right] = lane.across(vertex.station_m);
        left = left.holding(point(on_left));
        right = right.holding(point(on_right));
    }
    let beside = |name, neighbour: Option<Neighbour>| {
        let neighbour = neighbour.filter(|neighbour| neighbour.gap_m <= BORDER_M)?;
        let direction = if neighbour.same_direction { "same" } else { "opposite" };
        Some(reference(name, number_of(neighbour.lane)).with("drivingDir", direction))
    };
    let links = |name, lanes: &[LaneIndex]| -> Vec<Element> {
        lanes.iter().map(|lane| reference(name, number_of(*lane))).collect()
    };
    let here: Vec<usize> = lights
        .iter()
        .filter(|(_, lights)| map.signals[lights.signal].lanes.contains(&LaneIndex(index)))
        .map(|(number, _)| *number)
        .collect();
    let stop = lane.stop_lines.last().map(|line| {
        Element::new("stopLine")
            .holding_all(lane.across(line.station_m).map(point))
            .holding(Element::text("lineMarking", "solid"))
            .holding_all(here.iter().map(|number| reference("trafficLightRef", *number)))
    });
    Element::new("lanelet")
        .with("id", index + 1)
        .holding(left)
        .holding(right)
        .holding_all(links("predecessor", &lane.predecessors))
        .holding_all(links("successor", &lane.successors))
        .holding_all(beside("adjacentLeft", lane.left))
        .holding_all(beside("adjacentRight", lane.right))
        .holding_all(stop)
        .holding(Element::text("laneletType", if lane.junction.is_some() { "intersection" } else { "urban" }))
        .holding(Element::text("userOneWay", "vehicle"))
        .holding(reference("trafficSignRef", limit))
        .holding_all(here.iter().map(|number| reference("trafficLightRef", *number)))
}

fn number_of(lane: LaneIndex) -> usize {
    lane.0 + 1
}

fn reference(name: &'static str, number: usize) -> Element {
    Element::new(name).with("ref", number)
}

/// A speed limit, as the sign that is put up for it (274 in the format's catalogue).
fn limit(lane: &Lane, number: usize) -> Element {
    let sign = Element::new("trafficSignElement")
        .holding(Element::text("trafficSignID", "274"))
        .holding(Element::text("additionalValue", self::number(lane.speed_limit_mps)));
    let [_, beside] = lane.across(0.0);
    Element::new("trafficSign")
        .with("id", number)
        .holding(sign)
        .holding(Element::new("position").holding(point(beside)))
        .holding(Element::text("virtual", true))
}

fn light(recording: &Recording, number: usize, lights: &Lights) -> Element {
    let ends = lights.changes.iter().skip(1).map(|(tick, _)| *tick).chain([recording.seen.end_tick]);
    let elements = lights.changes.iter().zip(ends).filter_map(|((from, colour), to)| {
        // Whole steps whose sum does not drift from the recorded time.
        let steps = to.div_ceil(STEP_TICKS) - from.div_ceil(STEP_TICKS);
        let element = Element::new("cycleElement")
            .holding(Element::text("duration", steps))
            .holding(Element::text("color", colour.name()));
        (steps > 0).then_some(element)
    });
    let cycle = Element::new("cycle").holding_all(elements);
    let place = point(recording.map.signals[lights.signal].position);
    Element::new("trafficLight")
        .with("id", number)
        .holding(cycle)
        .holding(Element::new("position").holding(place))
        .holding(Element::text("active", true))
}

/// A junction: for each lane that leads to it, where it goes on. `None` if no lane does. `next_id` gives the next free number.
fn intersection(map: &RoadMap, junction: usize, next_id: &mut impl FnMut() -> usize) -> Option<Element> {
    let inside = &map.junctions[junction].lanes;
    let mut incoming: Vec<LaneIndex> =
        inside.iter().flat_map(|lane| map.lane(*lane).predecessors.iter().copied()).collect();
    incoming.sort_unstable();
    incoming.dedup();
    incoming.retain(|lane| map.lane(*lane).junction != Some(junction));
    if incoming.is_empty() {
        return None;
    }
    let own = next_id();
    let arms: Vec<Element> = incoming
        .into_iter()
        .map(|lane| {
            let onward = |name, turns: &[Turn]| -> Vec<Element> {
                let successors = map.lane(lane).successors.iter().filter(|next| inside.contains(next));
                successors
                    .filter(|next| turns.contains(&map.lane(**next).turn))
                    .map(|next| reference(name, number_of(*next)))
                    .collect()
            };
            Element::new("incoming")
                .with("id", next_id())
                .holding(reference("incomingLanelet", number_of(lane)))
                .holding_all(onward("successorsRight", &[Turn::Right]))
                .holding_all(onward("successorsStraight", &[Turn::Straight]))
                .holding_all(onward("successorsLeft", &[Turn::Left, Turn::UTurn]))
        })
        .collect();
    Some(Element::new("intersection").with("id", own).holding_all(arms))
}

/// A road user with its trajectory; `None` if it is not there at two steps.
fn obstacle(actor: &Actor, base: usize) -> Option<Element> {
    let mut steps = actor.samples.iter().filter(|sample| sample.tick % STEP_TICKS == 0);
    let first = steps.next()?;
    let later: Vec<Element> = steps.map(|sample| state("state", sample)).collect();
    if later.is_empty() {
        return None;
    }
    let rectangle = Element::new("rectangle")
        .holding(Element::text("length", number(actor.shape.length_m)))
        .holding(Element::text("width", number(actor.shape.width_m)));
    let obstacle = Element::new("dynamicObstacle")
        .with("id", base + actor.id as usize)
        .holding(Element::text("type", kind(actor.body)))
        .holding(Element::new("shape").holding(rectangle))
        .holding(state("initialState", first))
        .holding(Element::new("trajectory").holding_all(later));
    Some(obstacle)
}

fn kind(body: Body) -> &'static str {
    match body {
        Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback => "car",
        Body::BoxTruck => "truck",
        Body::SchoolBus => "bus",
        Body::Pedestrian => "pedestrian",
        // CommonRoad has no word for animals and things.
        Body::Animal | Body::Object => "unknown",
        Body::Motorcycle => "motorcycle",
        Body::Bicycle => "bicycle",
    }
}

fn state(name: &'static str, sample: &Sample) -> Element {
    Element::new(name)
        .holding(Element::new("position").holding(point(sample.pose.position)))
        .holding(exact("orientation", sample.pose.heading_rad))
        .holding(Element::new("time").holding(Element::text("exact", sample.tick / STEP_TICKS)))
        .holding(exact("velocity", sample.speed_mps()))
}

/// Where the ego vehicle is at the start, and that it is to be on its route at the end.
fn planning_problem(recording: &Recording, own: usize) -> Element {
    let first = &recording.seen.ego.samples[0];
    let start = state("initialState", first).holding(exact("yawRate", 0.0)).holding(exact("slipAngle", 0.0));
    let end = (recording.seen.end_tick / STEP_TICKS).max(1);
    let time = Element::new("time")
        .holding(Element::text("intervalStart", end.saturating_sub(GOAL_STEPS)))
        .holding(Element::text("intervalEnd", end));
    let mut lanes = recording.route.clone();
    lanes.sort_unstable();
    lanes.dedup();
    let on_route = lanes.into_iter().map(|lane| reference("lanelet", number_of(lane)));
    let goal =
        Element::new("goalState").holding(time).holding(Element::new("position").holding_all(on_route));
    Element::new("planningProblem").with("id", own).holding(start).holding(goal)
}

fn exact(name: &'static str, value: f64) -> Element {
    Element::new(name).holding(Element::text("exact", number(value)))
}

fn point(at: Vec2) -> Element {
    Element::new("point").holding(Element::text("x", number(at.x))).holding(Element::text("y", number(at.y)))
}
