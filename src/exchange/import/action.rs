//! What the actions of a file ask of an entity: a place, a speed, another lane, a way.

use roxmltree::Node;

use super::position::{Position, position};
use super::source::{Mark, Source, children, element, elements};
use super::story::DURATION_S_MAX;

const FOLLOWING: [&str; 2] = ["follow", "position"];

const STRATEGIES: [&str; 4] = ["fastest", "leastIntersections", "random", "shortest"];

/// An action as it was read.
#[derive(Debug, Clone)]
pub enum Begun {
    Placed(Mark, Position),
    Speed(Mark, Speed, bool),
    Headway(Mark, Headway),
    Change(Mark, Target),
    Walk(Walk),
    Goal(Mark, Position),
}

#[derive(Debug, Clone)]
pub enum Speed {
    Absolute(f64),
    /// More than another entity's, m/s.
    More(String, f64),
    /// Times another entity's.
    Times(String, f64),
}

/// The free space ahead of the ego vehicle.
#[derive(Debug, Clone)]
pub enum Headway {
    Way(f64),
    /// At the ego vehicle's speed, s.
    Time(f64),
}

#[derive(Debug, Clone)]
pub enum Target {
    Lane(i32),
    /// So many lanes to the left of an entity's.
    Beside(String, i32),
}

#[derive(Debug, Clone)]
pub struct Walk {
    pub mark: Mark,
    /// At least one place; what lies between the first and the last must lie straight between them.
    pub way: Vec<(Mark, Position)>,
    /// From the first vertex to the last, if they have times.
    pub duration_s: Option<f64>,
}

/// What an action within a `PrivateAction` begins; `None` if nothing that matters, or it is refused.
pub fn begun(source: &mut Source, action: Node, is_ego: bool) -> Option<Begun> {
    let mark = source.mark(action);
    match action.tag_name().name() {
        "TeleportAction" => {
            let place = source.required(action, "Position")?;
            Some(Begun::Placed(mark, position(source, place)?))
        }
        "LongitudinalAction" | "LateralAction" | "RoutingAction" => {
            let inner = children(action).next()?;
            moved(source, inner, is_ego)
        }
        "ControllerAction" | "ActivateControllerAction" | "AssignControllerAction" => {
            if !is_ego && drives(source, action)? {
                return source.refuse(
                    action,
                    "a controller of the player's drives it, of which the file says no more",
                );
            }
            None
        }
        "VisibilityAction" => {
            for name in ["graphics", "sensors", "traffic"] {
                if !source.switch(action, name, true)? {
                    return source.refuse(action, "all road users can be seen");
                }
            }
            None
        }
        "AppearanceAction" => {
            source.note("lights and animations of vehicles are not taken over");
            None
        }
        _ => source.refuse(action, "this action is not read"),
    }
}

/// Whether a controller takes over one of the two motions.
fn drives(source: &mut Source, action: Node) -> Option<bool> {
    let mut drives = false;
    for activated in action.descendants().filter(|node| node.has_tag_name("ActivateControllerAction")) {
        for name in ["longitudinal", "lateral"] {
            drives |= source.switch(activated, name, true)?;
        }
    }
    Some(drives)
}

/// Whether a change of speed or lane happens at once.
fn at_once(source: &mut Source, dynamics: Node) -> Option<bool> {
    let shape = source.word(dynamics, "dynamicsShape", &["linear", "cubic", "sinusoidal", "step"])?;
    let dimension = source.word(dynamics, "dynamicsDimension", &["time", "distance", "rate"])?;
    source.word(dynamics, "followingMode", &FOLLOWING)?;
    let value = match (dimension, dynamics.has_attribute("value")) {
        (_, false) if shape == "step" => 0.0,
        ("rate", _) => match source.number(dynamics, "value")? {
            0.0 if shape != "step" => {
                return source.refuse(dynamics, "`value` is 0: at that rate it never ends");
            }
            rate => rate,
        },
        _ => source.amount(dynamics, "value")?,
    };
    let reason = format!("it takes {value} s: nothing lasts longer than {DURATION_S_MAX} s");
    source.refuse_if(dimension == "time" && value > DURATION_S_MAX, dynamics, reason)?;
    Some(shape == "step" || (dimension == "time" && value == 0.0))
}

fn moved(source: &mut Source, action: Node, is_ego: bool) -> Option<Begun> {
    let mark = source.mark(action);
    match action.tag_name().name() {
        "SpeedAction" => {
            let dynamics = source.required(action, "SpeedActionDynamics")?;
            let at_once = at_once(source, dynamics)?;
            let target = source.required(action, "SpeedActionTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetSpeed") {
                let mps = source.number(absolute, "value")?;
                return Some(Begun::Speed(mark, Speed::Absolute(mps), at_once));
            }
            let relative = source.required(target, "RelativeTargetSpeed")?;
            let (entity, value) = (source.text(relative, "entityRef")?, source.number(relative, "value")?);
            if source.switch(relative, "continuous", false)? {
                source.note("a speed relative to another's is taken at the beginning, and kept");
            }
            let speed = match source.text(relative, "speedTargetValueType")?.as_str() {
                "delta" => Speed::More(entity, value),
                "factor" => Speed::Times(entity, value),
                _ => return source.refuse(relative, "`speedTargetValueType` is `delta` or `factor`"),
            };
            Some(Begun::Speed(mark, speed, at_once))
        }
        "LongitudinalDistanceAction" if !is_ego => {
            if source.switch(action, "continuous", false)? {
                return source.refuse(action, "a vehicle keeps its speed, not its distance");
            }
            if !source.switch(action, "freespace", false)? {
                return source.refuse(action, "only `freespace=\"true\"` is read: between the bumpers");
            }
            let sides = ["any", "leadingReferencedEntity", "trailingReferencedEntity"];
            match source.word(action, "displacement", &sides)? {
                "trailingReferencedEntity" => {
                    return source.refuse(action, "only a distance ahead of the ego vehicle is read");
                }
                // 1.0 has no such attribute. Later, players need not take its absence as ahead.
                "" if source.minor > 0 => {
                    let reason = "without `displacement` it need not be ahead: `leadingReferencedEntity` is";
                    return source.refuse(action, reason);
                }
                _ => {}
            }
            source.word(action, "coordinateSystem", &["entity", "lane", "road", "trajectory", "world"])?;
            let headway = match action.attribute("timeGap") {
                Some(_) => Headway::Time(source.amount(action, "timeGap")?),
                None => Headway::Way(source.amount(action, "distance")?),
            };
            Some(Begun::Headway(mark, headway))
        }
        "LaneChangeAction" => {
            let dynamics = source.required(action, "LaneChangeActionDynamics")?;
            // Either way its time is the drivers': only its words are looked at.
            at_once(source, dynamics)?;
            if source.number_or(action, "targetLaneOffset", 0.0)? != 0.0 {
                return source.refuse(action, "vehicles keep to the middle of their lanes");
            }
            let target = source.required(action, "LaneChangeTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetLane") {
                return Some(Begun::Change(mark, Target::Lane(source.integer(absolute, "value")?)));
            }
            let relative = source.required(target, "RelativeTargetLane")?;
            let (entity, lanes) = (source.text(relative, "entityRef")?, source.integer(relative, "value")?);
            Some(Begun::Change(mark, Target::Beside(entity, lanes)))
        }
        "FollowTrajectoryAction" => walk(source, action).map(Begun::Walk),
        "AssignRouteAction" if is_ego => {
            let waypoints = action.descendants().filter(|node| node.has_tag_name("Waypoint"));
            let waypoints: Vec<Node> = waypoints.collect();
            for waypoint in &waypoints {
                source.word(*waypoint, "routeStrategy", &STRATEGIES)?;
            }
            let place = waypoints.last().and_then(|waypoint| element(*waypoint, "Position"));
            let Some(place) = place else {
                return source.refuse(action, "it has no waypoint with a position");
            };
            Some(Begun::Goal(mark, position(source, place)?))
        }
        "AcquirePositionAction" if is_ego => {
            let place = source.required(action, "Position")?;
            Some(Begun::Goal(mark, position(source, place)?))
        }
        "LaneOffsetAction" | "LateralDistanceAction" => {
            source.refuse(action, "vehicles keep to the middle of their lanes")
        }
        "LongitudinalDistanceAction" | "SpeedProfileAction" | "SynchronizeAction" => {
            source.refuse(action, "a vehicle keeps the speed with which it appears")
        }
        "AssignRouteAction" | "AcquirePositionAction" => {
            source.refuse(action, "vehicles follow their lanes, and draw their way at junctions")
        }
        _ => source.refuse(action, "this action is not read"),
    }
}

fn walk(source: &mut Source, action: Node) -> Option<Walk> {
    let mark = source.mark(action);
    if source.number_or(action, "initialDistanceOffset", 0.0)? != 0.0 {
        return source.refuse(action, "a pedestrian walks its way from the beginning");
    }
    let within = |name: &'static str| action.descendants().find(move |node| node.has_tag_name(name));
    if let Some(mode) = within("TrajectoryFollowingMode") {
        source.word(mode, "followingMode", &FOLLOWING)?;
    }
    if let Some(trajectory) = within("Trajectory")
        && source.switch(trajectory, "closed", false)?
    {
        return source.refuse(trajectory, "a pedestrian walks one way: `closed` leads back");
    }
    let timing = within("Timing");
    let scale = timing.map_or(Some(1.0), |timing| scale(source, timing))?;
    let Some(polyline) = within("Polyline") else {
        return source.refuse(action, "a pedestrian walks straight across the road: a `Polyline` is read");
    };
    let vertices: Vec<Node> = elements(polyline, "Vertex").collect();
    let (Some(first), Some(last)) = (vertices.first(), vertices.last()) else {
        return source.refuse(polyline, "it has no vertices");
    };
    let mut way = Vec::new();
    for vertex in &vertices {
        let place = source.required(*vertex, "Position")?;
        way.push((source.mark(*vertex), position(source, place)?));
    }
    // Without `Timing` the times of the vertices are not kept: it walks with its speed.
    let times = (source.number_or(*first, "time", 0.0)?, source.number_or(*last, "time", 0.0)?);
    let duration_s = (times.1 - times.0) * scale;
    let duration_s = (timing.is_some() && duration_s > 0.0).then_some(duration_s);
    Some(Walk { mark, way, duration_s })
}

/// By how much the times of a way are stretched.
fn scale(source: &mut Source, timing: Node) -> Option<f64> {
    source.word(timing, "domainAbsoluteRelative", &["absolute", "relative"])?;
    if source.number_or(timing, "offset", 0.0)? != 0.0 {
        return source.refuse(timing, "a pedestrian sets out when it is triggered: `offset` is 0");
    }
    let scale = source.number_or(timing, "scale", 1.0)?;
    source.refuse_if(scale <= 0.0, timing, format!("`scale` is {scale}: times go on, by more than 0"))?;
    Some(scale)
}
