//! A recording as OpenSCENARIO XML (ASAM, 1.2 and 1.3): what any player of that format shows again.
//!
//! Everyone is a `FollowTrajectoryAction` along a polyline with absolute times, so a player needs no model of driving. The
//! last vertex is at the end of the recording, because a player may let what has no vertex left roll on. A road user that
//! appears or leaves on the way is added and deleted. Names, in the file's order: `ego`, then `npc_N` for the road user
//! that claims call `npc#N`.
//!
//! Left out: what a driving system saw or planned, heights (a player puts road users on the map's road), and lights of
//! vehicles.

mod entity;
mod environment;

use crate::episode::Actor;
use crate::geometry::Pose;
use crate::sim::DT_S;

use super::DATE;
use super::recording::Recording;
use super::vertices::{Vertex, vertices};
use super::xml::{Element, number};

use entity::{ahead_of_centre_m, entity};
use environment::{environment, signals};

/// The standard's version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    V1_2,
    V1_3,
}

/// What the file says of the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ego {
    /// It drives as it was recorded.
    Trajectory,
    /// It has a controller named `ads`, which the player provides, and is told the goal.
    Controller,
    /// It stands at its start with its first speed; the player moves it or lets it roll.
    None,
}

/// The file's text. `map_file` is the path of the map from it.
pub fn openscenario(recording: &Recording, map_file: &str, version: Version, ego: Ego) -> String {
    let minor = match version {
        Version::V1_2 => 2,
        Version::V1_3 => 3,
    };
    let network = Element::new("RoadNetwork")
        .holding(Element::new("LogicFile").with("filepath", map_file))
        .holding_all(signals(recording));
    Element::new("OpenSCENARIO")
        .holding(header(recording, minor))
        .holding(Element::new("CatalogLocations"))
        .holding(network)
        .holding(Element::new("Entities").holding_all(recording.actors().map(|actor| entity(actor, ego))))
        .holding(storyboard(recording, ego))
        .document()
}

fn header(recording: &Recording, minor: u8) -> Element {
    let property =
        |(name, value): &(String, String)| Element::new("Property").with("name", name).with("value", value);
    let description = match recording.docs.iter().find(|line| !line.starts_with("Emitted by")) {
        Some(line) => line,
        None => &recording.name,
    };
    Element::new("FileHeader")
        .with("revMajor", 1)
        .with("revMinor", minor)
        .with("date", format!("{DATE}T00:00:00"))
        .with("description", description)
        .with("author", "avastra")
        .holding(Element::new("Properties").holding_all(recording.facts.iter().map(property)))
}

fn storyboard(recording: &Recording, ego: Ego) -> Element {
    let groups = recording.actors().filter_map(|actor| group(recording, actor, ego));
    let groups: Vec<Element> = groups.chain(weather_group(recording)).collect();
    let story = (!groups.is_empty()).then(|| {
        let act = Element::new("Act")
            .with("name", "recording")
            .holding_all(groups)
            .holding(Element::new("StartTrigger").holding(from_time("start", 0.0)));
        Element::new("Story").with("name", "recording").holding(act)
    });
    Element::new("Storyboard")
        .holding(init(recording, ego))
        .holding_all(story)
        .holding(Element::new("StopTrigger").holding(from_time("end", recording.duration_s())))
}

/// Sky, and everyone that is there at the start.
fn init(recording: &Recording, ego: Ego) -> Element {
    let mut actions = Element::new("Actions");
    if let Some(sky) = recording.seen.skies.first() {
        actions = actions.holding(environment(sky, 0));
    }
    let present = recording.actors().filter(|actor| actor.first_tick() == 0);
    let actions = actions.holding_all(present.map(|actor| {
        let first = actor.samples[0];
        let place = first.pose.offset(ahead_of_centre_m(actor), 0.0);
        let mut private = Element::new("Private")
            .with("entityRef", actor.name())
            .holding(private(Element::new("TeleportAction").holding(position(&place))))
            .holding(private(speed(first.velocity_mps.norm())));
        if actor.id == 0 && ego == Ego::Controller {
            private =
                private.holding(self::private(activation())).holding(self::private(destination(recording)));
        }
        private
    }));
    Element::new("Init").holding(actions)
}

/// What a road user does; `None` if the player moves it.
fn group(recording: &Recording, actor: &Actor, ego: Ego) -> Option<Element> {
    if actor.id == 0 && ego != Ego::Trajectory {
        return None;
    }
    let name = actor.name();
    let way = vertices(actor, ahead_of_centre_m(actor));
    let first_s = actor.first_tick() as f64 * DT_S;
    let mut actions = Vec::new();
    if actor.first_tick() > 0 {
        let added = Element::new("AddEntityAction").holding(position(&way[0].pose));
        actions.push(action(format!("{name}_appears"), of_entity(&name, added)));
    }
    // A single vertex is no way: the road user appears in the last tick.
    if way.len() > 1 {
        actions.push(action(format!("{name}_follows"), private(follow(&name, &way))));
    }
    let mut events = Vec::new();
    if !actions.is_empty() {
        events.push(event(format!("{name}_moves"), actions, first_s));
    }
    if actor.last_tick() < recording.seen.end_tick {
        let deleted = of_entity(&name, Element::new("DeleteEntityAction"));
        let gone_s = (actor.last_tick() + 1) as f64 * DT_S;
        events.push(event(
            format!("{name}_leaves"),
            vec![action(format!("{name}_deleted"), deleted)],
            gone_s,
        ));
    }
    (!events.is_empty()).then(|| maneuver_group(&name, Some(&name), events))
}

/// Changes of weather and time of day after the start.
fn weather_group(recording: &Recording) -> Option<Element> {
    let change = |(number, sky)| {
        let action = action(format!("sky_{number}"), environment(sky, number));
        event(format!("sky_{number}_begins"), vec![action], sky.time_s)
    };
    let events: Vec<Element> = recording.seen.skies.iter().enumerate().skip(1).map(change).collect();
    (!events.is_empty()).then(|| maneuver_group("sky", None, events))
}

fn maneuver_group(name: &str, actor: Option<&str>, events: Vec<Element>) -> Element {
    let actors = Element::new("Actors")
        .with("selectTriggeringEntities", false)
        .holding_all(actor.map(|actor| Element::new("EntityRef").with("entityRef", actor)));
    Element::new("ManeuverGroup")
        .with("name", format!("{name}_group"))
        .with("maximumExecutionCount", 1)
        .holding(actors)
        .holding(Element::new("Maneuver").with("name", format!("{name}_maneuver")).holding_all(events))
}

/// Events run beside each other: with `override`, a later one would end those before it.
fn event(name: String, actions: Vec<Element>, from_s: f64) -> Element {
    let trigger = Element::new("StartTrigger").holding(from_time(&format!("{name}_time"), from_s));
    Element::new("Event")
        .with("name", name)
        .with("priority", "parallel")
        .with("maximumExecutionCount", 1)
        .holding_all(actions)
        .holding(trigger)
}

/// A condition that holds from a time on.
fn from_time(name: &str, time_s: f64) -> Element {
    let time =
        Element::new("SimulationTimeCondition").with("rule", "greaterOrEqual").measured("value", time_s);
    let condition = Element::new("Condition")
        .with("name", name)
        .with("delay", 0)
        .with("conditionEdge", "none")
        .holding(Element::new("ByValueCondition").holding(time));
    Element::new("ConditionGroup").holding(condition)
}

fn action(name: String, what: Element) -> Element {
    Element::new("Action").with("name", name).holding(what)
}

fn private(what: Element) -> Element {
    Element::new("PrivateAction").holding(what)
}

fn of_entity(name: &str, what: Element) -> Element {
    Element::new("GlobalAction").holding(Element::new("EntityAction").with("entityRef", name).holding(what))
}

fn follow(name: &str, way: &[Vertex]) -> Element {
    let vertex = |vertex: &Vertex| {
        Element::new("Vertex").measured("time", vertex.time_s).holding(position(&vertex.pose))
    };
    let trajectory = Element::new("Trajectory")
        .with("name", format!("{name}_way"))
        .with("closed", false)
        .holding(Element::new("Shape").holding(Element::new("Polyline").holding_all(way.iter().map(vertex))));
    let timing =
        Element::new("Timing").with("domainAbsoluteRelative", "absolute").with("scale", 1).with("offset", 0);
    let follow = Element::new("FollowTrajectoryAction")
        .holding(Element::new("TrajectoryRef").holding(trajectory))
        .holding(Element::new("TimeReference").holding(timing))
        .holding(Element::new("TrajectoryFollowingMode").with("followingMode", "position"));
    Element::new("RoutingAction").holding(follow)
}

fn position(pose: &Pose) -> Element {
    Element::new("Position").holding(
        Element::new("WorldPosition")
            .measured("x", pose.position.x)
            .measured("y", pose.position.y)
            .measured("h", pose.heading_rad),
    )
}

fn speed(speed_mps: f64) -> Element {
    let at_once = Element::new("SpeedActionDynamics")
        .with("dynamicsShape", "step")
        .with("dynamicsDimension", "time")
        .with("value", 0);
    let target = Element::new("SpeedActionTarget")
        .holding(Element::new("AbsoluteTargetSpeed").measured("value", speed_mps));
    Element::new("LongitudinalAction").holding(Element::new("SpeedAction").holding(at_once).holding(target))
}

fn activation() -> Element {
    let activate = Element::new("ActivateControllerAction").with("lateral", true).with("longitudinal", true);
    Element::new("ControllerAction").holding(activate)
}

/// Where the ego vehicle is to go.
fn destination(recording: &Recording) -> Element {
    let lane = recording.map.lane(recording.goal.lane);
    let place = Element::new("LanePosition")
        .with("roadId", &lane.key.road)
        .with("laneId", lane.key.lane)
        .with("s", number(lane.road_station_m(recording.goal.station_m)));
    let position = Element::new("Position").holding(place);
    Element::new("RoutingAction").holding(Element::new("AcquirePositionAction").holding(position))
}
