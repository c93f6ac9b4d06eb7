//! Events, conditions and actions as OpenSCENARIO describes them.

use avastra_base::geometry::Pose;
use avastra_road::{LanePlace, RoadMap};

use super::super::vertices::Vertex;
use super::super::xml::{Element, number};
use super::style::{BENEATH_M, Version};
use avastra_campaign::episode::Actor;
use avastra_world::sim::DT_S;

pub fn maneuver_group(name: &str, actor: Option<&str>, events: Vec<Element>) -> Element {
    let actors = Element::new("Actors")
        .with("selectTriggeringEntities", false)
        .holding_all(actor.map(|actor| Element::new("EntityRef").with("entityRef", actor)));
    Element::new("ManeuverGroup")
        .with("name", format!("{name}_group"))
        .with("maximumExecutionCount", 1)
        .holding(actors)
        .holding(Element::new("Maneuver").with("name", format!("{name}_maneuver")).holding_all(events))
}

/// Events run beside each other: with `override`, a later one would end those before it. It begins when all conditions
/// hold.
pub fn event(name: &str, actions: Vec<Element>, conditions: Vec<Element>) -> Element {
    event_of_groups(name, actions, vec![conditions])
}

/// One that begins when all conditions of some group hold.
pub fn event_of_groups(name: &str, actions: Vec<Element>, groups: Vec<Vec<Element>>) -> Element {
    let trigger = Element::new("StartTrigger").holding_all(groups.into_iter().map(all));
    Element::new("Event")
        .with("name", name)
        .with("priority", "parallel")
        .with("maximumExecutionCount", 1)
        .holding_all(actions)
        .holding(trigger)
}

/// An event at a time.
pub fn event_at(version: Version, name: &str, actions: Vec<Element>, from_s: f64) -> Element {
    event(name, actions, vec![from_time(version, &format!("{name}_time"), from_s)])
}

pub fn all(conditions: Vec<Element>) -> Element {
    Element::new("ConditionGroup").holding_all(conditions)
}

/// A condition that holds from a time on.
pub fn from_time(version: Version, name: &str, time_s: f64) -> Element {
    let rule = if version == Version::Carla { "greaterThan" } else { "greaterOrEqual" };
    let time = Element::new("SimulationTimeCondition").with("rule", rule).measured("value", time_s);
    condition(name, by_value(time))
}

/// A condition that holds when an event is over.
pub fn after_event(name: &str, event: &str) -> Element {
    condition(name, event_is(event, "completeState"))
}

/// That an event has this state.
pub fn event_is(event: &str, state: &str) -> Element {
    let state = Element::new("StoryboardElementStateCondition")
        .with("storyboardElementType", "event")
        .with("storyboardElementRef", event)
        .with("state", state);
    by_value(state)
}

/// A condition that holds when the reference points of two road users are this near, m.
pub fn within(version: Version, name: &str, (of, to): (&str, &str), metres: f64) -> Element {
    let (kind, rule) = match version {
        Version::Carla => ("cartesianDistance", "lessThan"),
        Version::V1_2 => ("euclidianDistance", "lessOrEqual"),
    };
    let distance = Element::new("RelativeDistanceCondition")
        .with("entityRef", to)
        .with("relativeDistanceType", kind)
        .with("freespace", false)
        .with("rule", rule)
        .measured("value", metres);
    of_any(name, of, distance)
}

/// A condition that holds when two road users touch.
pub fn touched(name: &str, of: &str, by: &str) -> Element {
    let collision =
        Element::new("CollisionCondition").holding(Element::new("EntityRef").with("entityRef", by));
    of_any(name, of, collision)
}

fn of_any(name: &str, entity: &str, what: Element) -> Element {
    condition(name, by_entity(entity, what))
}

/// A condition about an entity.
pub fn by_entity(entity: &str, what: Element) -> Element {
    let entities = Element::new("TriggeringEntities")
        .with("triggeringEntitiesRule", "any")
        .holding(Element::new("EntityRef").with("entityRef", entity));
    let what = Element::new("EntityCondition").holding(what);
    Element::new("ByEntityCondition").holding(entities).holding(what)
}

/// A condition about no entity.
pub fn by_value(what: Element) -> Element {
    Element::new("ByValueCondition").holding(what)
}

fn condition(name: &str, what: Element) -> Element {
    condition_after(name, 0.0, what)
}

/// A condition that has held so long ago, s.
pub fn condition_after(name: &str, delay_s: f64, what: Element) -> Element {
    let condition = Element::new("Condition").with("name", name).measured("delay", delay_s);
    condition.with("conditionEdge", "none").holding(what)
}

pub fn action(name: &str, what: Element) -> Element {
    Element::new("Action").with("name", name).holding(what)
}

pub fn private(what: Element) -> Element {
    Element::new("PrivateAction").holding(what)
}

pub fn of_entity(name: &str, what: Element) -> Element {
    Element::new("GlobalAction").holding(Element::new("EntityAction").with("entityRef", name).holding(what))
}

pub fn teleport(position: Element) -> Element {
    private(Element::new("TeleportAction").holding(position))
}

/// Along a polyline with absolute times.
pub fn follow(name: &str, way: &[Vertex]) -> Element {
    let timing =
        Element::new("Timing").with("domainAbsoluteRelative", "absolute").with("scale", 1).with("offset", 0);
    let vertex = |vertex: &Vertex| (Some(vertex.time_s), vertex.pose);
    trajectory(name, way.iter().map(vertex), timing)
}

/// Along a polyline, as fast as other actions say. CARLA's ScenarioRunner wants times of a polyline, and none of a route.
pub fn walk(version: Version, name: &str, way: &[Pose]) -> Element {
    if version == Version::Carla {
        return route(&format!("{name}_way"), way.iter().map(position));
    }
    trajectory(name, way.iter().map(|pose| (None, *pose)), Element::new("None"))
}

fn trajectory(name: &str, way: impl Iterator<Item = (Option<f64>, Pose)>, timing: Element) -> Element {
    private(Element::new("RoutingAction").holding(along(
        name,
        way,
        timing,
        Element::new("FollowTrajectoryAction"),
    )))
}

/// Along places at whatever speed, from a way behind the first one on, m.
pub fn walk_from(name: &str, way: &[Pose], from_m: f64) -> Element {
    let follow = Element::new("FollowTrajectoryAction").measured("initialDistanceOffset", from_m);
    let way = way.iter().map(|pose| (None, *pose));
    private(Element::new("RoutingAction").holding(along(name, way, Element::new("None"), follow)))
}

fn along(
    name: &str,
    way: impl Iterator<Item = (Option<f64>, Pose)>,
    timing: Element,
    follow: Element,
) -> Element {
    let vertex = |(time_s, pose): (Option<f64>, Pose)| {
        let vertex = Element::new("Vertex").holding(position(&pose));
        time_s.into_iter().fold(vertex, |vertex, time_s| vertex.measured("time", time_s))
    };
    let trajectory = Element::new("Trajectory")
        .with("name", format!("{name}_way"))
        .with("closed", false)
        .holding(Element::new("Shape").holding(Element::new("Polyline").holding_all(way.map(vertex))));
    follow
        .holding(Element::new("TrajectoryRef").holding(trajectory))
        .holding(Element::new("TimeReference").holding(timing))
        .holding(Element::new("TrajectoryFollowingMode").with("followingMode", "position"))
}

pub fn position(pose: &Pose) -> Element {
    Element::new("Position").holding(world_position(pose))
}

/// So far beneath a place, m: where nothing else is.
pub fn beneath(pose: &Pose, metres: f64) -> Element {
    Element::new("Position").holding(world_position(pose).measured("z", -metres))
}

fn world_position(pose: &Pose) -> Element {
    Element::new("WorldPosition")
        .measured("x", pose.position.x)
        .measured("y", pose.position.y)
        .measured("h", pose.heading_rad)
}

/// A place in a lane, along its traffic.
pub fn lane_position(map: &RoadMap, place: LanePlace) -> Element {
    let position = in_lane(map, place);
    let is_aside = number(place.offset_m) != "0";
    let position = if is_aside { position.measured("offset", offset_m(map, place)) } else { position };
    Element::new("Position").holding(position)
}

/// A place in a lane that says its offset, also where that is 0.
pub fn lane_position_aside(map: &RoadMap, place: LanePlace) -> Element {
    let aside = in_lane(map, place).measured("offset", offset_m(map, place));
    Element::new("Position").holding(aside)
}

fn in_lane(map: &RoadMap, place: LanePlace) -> Element {
    let lane = map.lane(place.lane);
    Element::new("LanePosition")
        .with("roadId", &lane.key.road)
        .with("laneId", lane.key.lane)
        .with("s", number(lane.road_station_m(place.station_m)))
}

/// The standard's offset is to the left of the road's reference line, ours to that of traffic.
fn offset_m(map: &RoadMap, place: LanePlace) -> f64 {
    if map.lane(place.lane).is_along() { place.offset_m } else { -place.offset_m }
}

/// A speed at once.
pub fn speed(speed_mps: f64) -> Element {
    speed_within(speed_mps, 0.0)
}

/// A speed that is reached evenly within a time.
pub fn speed_within(speed_mps: f64, time_s: f64) -> Element {
    let dynamics = Element::new("SpeedActionDynamics")
        .with("dynamicsShape", if time_s > 0.0 { "linear" } else { "step" })
        .with("dynamicsDimension", "time")
        .measured("value", time_s);
    let target = Element::new("SpeedActionTarget")
        .holding(Element::new("AbsoluteTargetSpeed").measured("value", speed_mps));
    let action = Element::new("SpeedAction").holding(dynamics).holding(target);
    private(Element::new("LongitudinalAction").holding(action))
}

/// A change to the lane that lies `lanes_left` to the left of the own one, within `metres` of way.
pub fn change_lane(version: Version, name: &str, lanes_left: i32, metres: f64) -> Element {
    let dynamics = Element::new("LaneChangeActionDynamics")
        .with("dynamicsShape", if version == Version::Carla { "linear" } else { "sinusoidal" })
        .with("dynamicsDimension", "distance")
        .measured("value", metres);
    let lane = Element::new("RelativeTargetLane").with("entityRef", name).with("value", lanes_left);
    let target = Element::new("LaneChangeTarget").holding(lane);
    let action = Element::new("LaneChangeAction").holding(dynamics).holding(target);
    private(Element::new("LateralAction").holding(action))
}

/// A way over lanes.
pub fn route(name: &str, places: impl Iterator<Item = Element>) -> Element {
    let waypoint =
        |position: Element| Element::new("Waypoint").with("routeStrategy", "shortest").holding(position);
    let route =
        Element::new("Route").with("name", name).with("closed", false).holding_all(places.map(waypoint));
    private(Element::new("RoutingAction").holding(Element::new("AssignRouteAction").holding(route)))
}

/// A road user that leaves sinks out of sight in the tick after its last, and is deleted in the next: esmini prints an error
/// where one that touches another is gone at once.
pub fn leaves(end_tick: u64, actor: &Actor, version: Version) -> Vec<Element> {
    let name = actor.name();
    let last = actor.samples[actor.samples.len() - 1];
    if last.tick >= end_tick {
        return Vec::new();
    }
    let away = teleport(beneath(&last.pose, BENEATH_M));
    let deleted = of_entity(&name, Element::new("DeleteEntityAction"));
    let parts = [("leaves", "sinks", away), ("is_gone", "deleted", deleted)];
    let event = |(ticks, (event, does, what)): (u64, (&str, &str, Element))| {
        let from_s = (last.tick + ticks) as f64 * DT_S;
        event_at(version, &format!("{name}_{event}"), vec![action(&format!("{name}_{does}"), what)], from_s)
    };
    (1..).zip(parts).map(event).collect()
}
