//! The actions of a file that an entity executes: a place, a speed, another lane, a way.

use core::f64::consts::FRAC_PI_2;

use roxmltree::Node;

use super::position::{Position, position, route};
use super::shape::{Shape, shape_of};
use super::source::{DURATION_S_MAX, Mark, Source, children, element};

const FOLLOWING: [&str; 2] = ["follow", "position"];

const FRAMES: [&str; 5] = ["entity", "lane", "road", "trajectory", "world"];

/// An action as it was read.
#[derive(Debug, Clone)]
pub struct Act {
    pub mark: Mark,
    pub kind: ActKind,
}

#[derive(Debug, Clone)]
pub enum ActKind {
    Placed(Position),
    Speed(Speed, Dynamics),
    Profile(Vec<SpeedEntry>),
    /// Ahead of the entity of that name at once.
    Ahead(String, Headway),
    Keep(Box<Kept>),
    Lane(Target, f64, Dynamics),
    Offset(Aside, Dynamics),
    Meet(Box<Meeting>),
    Follow(Box<Way>),
    /// Along the lanes through these places.
    Route(Vec<Position>),
}

impl Act {
    /// Whether it changes nothing where its goal is reached already.
    pub fn is_idempotent(&self) -> bool {
        match &self.kind {
            ActKind::Speed(Speed::Absolute(_), dynamics) => !dynamics.is_continuous,
            ActKind::Lane(Target::Lane(_), ..) | ActKind::Offset(Aside::InLane(_), _) => true,
            ActKind::Placed(_) | ActKind::Route(_) => true,
            _ => false,
        }
    }
}

/// A place across the road.
#[derive(Debug, Clone)]
pub enum Aside {
    /// To the left of the middle of its lane in the road's direction, m.
    InLane(f64),
    /// So much to the left of an entity, as that looks, m.
    Of(String, f64),
}

#[derive(Debug, Clone)]
pub enum Speed {
    Absolute(f64),
    /// More than another entity's, m/s.
    More(String, f64),
    /// Times another entity's.
    Times(String, f64),
}

/// A speed that is reached evenly in some time.
#[derive(Debug, Clone, Copy)]
pub struct SpeedEntry {
    pub mps: f64,
    pub time_s: f64,
}

/// How a value goes over to another.
#[derive(Debug, Clone, Copy)]
pub struct Dynamics {
    pub over: Over,
    /// The greatest rate of change, as a multiple of the mean one.
    pub peak: f64,
    /// Whether the goal moves with another entity's from moment to moment.
    pub is_continuous: bool,
}

#[derive(Debug, Clone, Copy)]
pub enum Over {
    AtOnce,
    /// At a rate of 0: nothing changes.
    Never,
    /// s.
    Time(f64),
    /// m.
    Way(f64),
    /// By the greatest rate of change: m/s² for a speed, m/s for a lateral place.
    Rate(f64),
}

/// A distance to another entity.
#[derive(Debug, Clone)]
pub enum Headway {
    Way(f64),
    /// At the other one's speed, s.
    Time(f64),
}

/// A distance to another entity that is kept, or reached within bounds.
#[derive(Debug, Clone)]
pub struct Kept {
    pub of: String,
    pub headway: Headway,
    pub is_free_space: bool,
    /// Whether it is ahead of the other one; `None`: as it is.
    pub is_ahead: Option<bool>,
    /// Without them it is there at once.
    pub bounds: Option<Bounds>,
    pub is_continuous: bool,
}

/// The limits of an entity that comes to a distance: acceleration and deceleration, m/s², and speed, m/s.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    pub gains_mps2: f64,
    pub loses_mps2: f64,
    pub speed_mps_max: f64,
}

#[derive(Debug, Clone)]
pub enum Target {
    Lane(i32),
    /// So many lanes to the left of an entity's.
    Beside(String, i32),
}

/// To be at a place when the master is at another.
#[derive(Debug, Clone)]
pub struct Meeting {
    pub master: String,
    pub master_at: Position,
    pub own_at: Position,
    pub speed: Option<Speed>,
    pub steady: Steady,
}

/// How long before the place the final speed is held.
#[derive(Debug, Clone, Copy)]
pub enum Steady {
    No,
    Way(f64),
    Time(f64),
}

#[derive(Debug, Clone)]
pub struct Way {
    pub shape: Shape,
    pub from_m: f64,
    /// How the times of its places count: more, and times; `None`: they do not.
    pub timing: Option<(f64, f64)>,
    /// Whether the times count from the beginning of the scenario.
    pub is_absolute: bool,
    /// Whether an entity that follows it steers along it, and so has its own headings.
    pub is_steered: bool,
}

/// Reads an action of an entity within a `PrivateAction`; `None` if it does nothing that matters, or is refused.
pub fn act(source: &mut Source, action: Node, name: &str, is_ego: bool) -> Option<Act> {
    let mark = source.mark(action);
    match action.tag_name().name() {
        "TeleportAction" => {
            let place = source.required(action, "Position")?;
            Some(Act { mark, kind: ActKind::Placed(position(source, place)?) })
        }
        "LongitudinalAction" | "LateralAction" | "RoutingAction" => {
            let inner = children(action).next()?;
            let mark = source.mark(inner);
            moved(source, inner, is_ego).map(|kind| Act { mark, kind })
        }
        "SynchronizeAction" if !is_ego => meeting(source, action).map(|kind| Act { mark, kind }),
        "SynchronizeAction" => None,
        "ControllerAction" | "ActivateControllerAction" | "AssignControllerAction" => {
            let overridden = action.descendants().filter(|node| node.has_attribute("active"));
            for pedal in overridden.collect::<Vec<Node>>() {
                let moves = !is_ego && source.switch(pedal, "active", false)?;
                source.refuse_if(moves, pedal, "pedals and a wheel that move by themselves are not read")?;
            }
            if !is_ego && drives(source, action)? && source.controlled.contains(name) {
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
            drives |= source.switch(activated, name, false)?;
        }
    }
    Some(drives)
}

/// How a value goes over. `dimension`: what a file leaves out.
fn dynamics(source: &mut Source, node: Node) -> Option<Dynamics> {
    let shape = source.word(node, "dynamicsShape", &["linear", "cubic", "sinusoidal", "step"])?;
    let dimension = source.word(node, "dynamicsDimension", &["time", "distance", "rate"])?;
    source.word(node, "followingMode", &FOLLOWING)?;
    let peak = match shape {
        "sinusoidal" => FRAC_PI_2,
        "cubic" => 1.5,
        _ => 1.0,
    };
    if shape == "step" {
        return Some(Dynamics { over: Over::AtOnce, peak, is_continuous: false });
    }
    let value = if dimension == "rate" {
        source.number(node, "value")?.abs()
    } else {
        source.amount(node, "value")?
    };
    let reason = format!("it takes {value} s: nothing lasts longer than {DURATION_S_MAX} s");
    source.refuse_if(dimension == "time" && value > DURATION_S_MAX, node, reason)?;
    let over = match dimension {
        "rate" if value == 0.0 => Over::Never,
        _ if value == 0.0 => Over::AtOnce,
        "rate" => Over::Rate(value),
        "distance" => Over::Way(value),
        _ => Over::Time(value),
    };
    Some(Dynamics { over, peak, is_continuous: false })
}

fn moved(source: &mut Source, action: Node, is_ego: bool) -> Option<ActKind> {
    match action.tag_name().name() {
        "SpeedAction" => {
            let node = source.required(action, "SpeedActionDynamics")?;
            let dynamics = dynamics(source, node)?;
            let target = source.required(action, "SpeedActionTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetSpeed") {
                return Some(ActKind::Speed(Speed::Absolute(source.number(absolute, "value")?), dynamics));
            }
            let relative = source.required(target, "RelativeTargetSpeed")?;
            let (entity, value) = (source.text(relative, "entityRef")?, source.number(relative, "value")?);
            let is_continuous = source.switch(relative, "continuous", false)?;
            let dynamics = Dynamics { is_continuous, ..dynamics };
            let speed = match source.text(relative, "speedTargetValueType")?.as_str() {
                "delta" => Speed::More(entity, value),
                "factor" => Speed::Times(entity, value),
                _ => return source.refuse(relative, "`speedTargetValueType` is `delta` or `factor`"),
            };
            Some(ActKind::Speed(speed, dynamics))
        }
        "SpeedProfileAction" if !is_ego => profile(source, action).map(ActKind::Profile),
        _ if is_ego && !action.has_tag_name("FollowTrajectoryAction") && !is_route(action) => None,
        "LongitudinalDistanceAction" => distance(source, action),
        "LaneChangeAction" => {
            let node = source.required(action, "LaneChangeActionDynamics")?;
            let dynamics = dynamics(source, node)?;
            let offset_m = source.left_or_0(action, "targetLaneOffset")?;
            let target = source.required(action, "LaneChangeTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetLane") {
                let lane = Target::Lane(source.integer(absolute, "value")?);
                return Some(ActKind::Lane(lane, offset_m, dynamics));
            }
            let relative = source.required(target, "RelativeTargetLane")?;
            let (entity, lanes) = (source.text(relative, "entityRef")?, source.integer(relative, "value")?);
            Some(ActKind::Lane(Target::Beside(entity, lanes), offset_m, dynamics))
        }
        "LaneOffsetAction" => {
            if source.switch(action, "continuous", false)? {
                source.note("an offset in a lane is reached, and then kept");
            }
            let node = source.required(action, "LaneOffsetActionDynamics")?;
            let shape = source.word(node, "dynamicsShape", &["linear", "cubic", "sinusoidal", "step"])?;
            let dynamics = match (shape, node.has_attribute("maxLateralAcc")) {
                ("step", _) => Dynamics { over: Over::AtOnce, peak: 1.0, is_continuous: false },
                (_, true) => {
                    let most_mps2 = source.amount(node, "maxLateralAcc")?;
                    source.refuse_if(most_mps2 == 0.0, node, "`maxLateralAcc` is 0: it never gets there")?;
                    // Kept for the way, which is not known here.
                    Dynamics { over: Over::Rate(-most_mps2), peak: 1.0, is_continuous: false }
                }
                _ => {
                    source.note("an offset without `maxLateralAcc` is reached at 1 m/s on average");
                    Dynamics { over: Over::Rate(1.0), peak: 1.0, is_continuous: false }
                }
            };
            let target = source.required(action, "LaneOffsetTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetLaneOffset") {
                return Some(ActKind::Offset(Aside::InLane(source.left(absolute, "value")?), dynamics));
            }
            let relative = source.required(target, "RelativeTargetLaneOffset")?;
            let of = source.text(relative, "entityRef")?;
            Some(ActKind::Offset(Aside::Of(of, source.left(relative, "value")?), dynamics))
        }
        "FollowTrajectoryAction" => way(source, action).map(|way| ActKind::Follow(Box::new(way))),
        "AssignRouteAction" => route(source, action).map(ActKind::Route),
        "AcquirePositionAction" => {
            let place = source.required(action, "Position")?;
            Some(ActKind::Route(vec![position(source, place)?]))
        }
        _ => source.refuse(action, "this action is not read"),
    }
}

fn profile(source: &mut Source, action: Node) -> Option<Vec<SpeedEntry>> {
    let is_followed = source.word(action, "followingMode", &FOLLOWING)? != "position";
    if is_followed {
        source.note("speeds change evenly, also where the file has a curve");
    }
    if action.has_attribute("entityRef") {
        return source.refuse(action, "a profile of speeds that are relative to an entity is not read");
    }
    let mut most_mps = f64::INFINITY;
    if let Some(bounds) = element(action, "DynamicConstraints") {
        most_mps = source.number_or(bounds, "maxSpeed", f64::INFINITY)?;
        if bounds.attributes().any(|one| one.name() != "maxSpeed") {
            source.note(
                "of a profile's bounds `maxSpeed` alone is read: its times say how fast a speed changes",
            );
        }
    }
    let mut entries = Vec::new();
    for node in children(action).filter(|node| node.has_tag_name("SpeedProfileEntry")) {
        if !node.has_attribute("time") {
            return source.refuse(node, "without a `time` the player chooses how fast the speed changes");
        }
        let (mps, time_s) = (source.number(node, "speed")?, source.amount(node, "time")?);
        source.refuse_if(mps > most_mps, node, format!("{mps} m/s is above the `maxSpeed` {most_mps}"))?;
        entries.push(SpeedEntry { mps, time_s });
    }
    source.refuse_if(entries.is_empty(), action, "it has no `SpeedProfileEntry`")?;
    let begins_at_once = entries.first().is_some_and(|first: &SpeedEntry| first.time_s == 0.0);
    let reason = "a profile that is followed begins with the speed that is there: its first time is above 0";
    source.refuse_if(is_followed && begins_at_once, action, reason)?;
    Some(entries)
}

fn is_route(action: Node) -> bool {
    action.has_tag_name("AssignRouteAction") || action.has_tag_name("AcquirePositionAction")
}

fn distance(source: &mut Source, action: Node) -> Option<ActKind> {
    let of = source.text(action, "entityRef")?;
    let is_continuous = source.switch(action, "continuous", false)?;
    let is_free_space = source.switch(action, "freespace", false)?;
    let sides = ["any", "leadingReferencedEntity", "trailingReferencedEntity"];
    let side = source.word(action, "displacement", &sides)?;
    source.word(action, "coordinateSystem", &FRAMES)?;
    let headway = match action.attribute("timeGap") {
        Some(_) => Headway::Time(source.amount(action, "timeGap")?),
        None => Headway::Way(source.amount(action, "distance")?),
    };
    let bounds = element(action, "DynamicConstraints");
    if is_continuous || bounds.is_some() {
        let is_ahead = match side {
            "leadingReferencedEntity" => Some(true),
            "trailingReferencedEntity" => Some(false),
            _ => None,
        };
        let bounds = match bounds {
            Some(node) => within(source, node)?,
            None => None,
        };
        let kept = Kept { of, headway, is_free_space, is_ahead, bounds, is_continuous };
        return Some(ActKind::Keep(Box::new(kept)));
    }
    if !is_free_space {
        return source.refuse(action, "only `freespace=\"true\"` is read: between the bumpers");
    }
    match side {
        "trailingReferencedEntity" => {
            return source.refuse(
                action,
                "a distance without bounds that is not kept is read ahead of the ego vehicle alone",
            );
        }
        // 1.0 has no such attribute. Later, players need not take its absence as ahead.
        "" if source.minor > 0 => {
            let reason = "without `displacement` it need not be ahead: `leadingReferencedEntity` is";
            return source.refuse(action, reason);
        }
        _ => {}
    }
    Some(ActKind::Ahead(of, headway))
}

/// The bounds of an entity that comes to a distance; `None` if they bind nothing.
fn within(source: &mut Source, bounds: Node) -> Option<Option<Bounds>> {
    if bounds.has_attribute("maxAccelerationRate") || bounds.has_attribute("maxDecelerationRate") {
        source.note("how fast an acceleration changes is not bounded");
    }
    let gains_mps2 = source.number_or(bounds, "maxAcceleration", f64::INFINITY)?;
    let loses_mps2 = source.number_or(bounds, "maxDeceleration", f64::INFINITY)?;
    let speed_mps_max = source.number_or(bounds, "maxSpeed", f64::INFINITY)?;
    let is_bound = gains_mps2.is_finite() && loses_mps2.is_finite();
    let reason = "bounds of a distance are a `maxAcceleration` and a `maxDeceleration` above 0, or neither";
    let is_whole = is_bound || gains_mps2.is_infinite() && loses_mps2.is_infinite();
    source.refuse_if(!is_whole || gains_mps2 <= 0.0 || loses_mps2 <= 0.0, bounds, reason)?;
    let reason = "a `maxSpeed` is read beside a `maxAcceleration` and a `maxDeceleration`, and is above 0";
    source.refuse_if(speed_mps_max <= 0.0 || speed_mps_max.is_finite() && !is_bound, bounds, reason)?;
    Some(is_bound.then_some(Bounds { gains_mps2, loses_mps2, speed_mps_max }))
}

fn meeting(source: &mut Source, action: Node) -> Option<ActKind> {
    let master = source.text(action, "masterEntityRef")?;
    let (at, own) =
        (source.required(action, "TargetPositionMaster")?, source.required(action, "TargetPosition")?);
    let (master_at, own_at) = (position(source, at)?, position(source, own)?);
    let (mut speed, mut steady) = (None, Steady::No);
    if let Some(last) = element(action, "FinalSpeed") {
        let Some(inner) = children(last).next() else { return source.refuse(last, "it is empty") };
        speed = Some(match inner.tag_name().name() {
            "AbsoluteSpeed" => Speed::Absolute(source.number(inner, "value")?),
            "RelativeSpeedToMaster" => match source.text(inner, "speedTargetValueType")?.as_str() {
                "delta" => Speed::More(master.clone(), source.number(inner, "value")?),
                "factor" => Speed::Times(master.clone(), source.number(inner, "value")?),
                _ => return source.refuse(inner, "`speedTargetValueType` is `delta` or `factor`"),
            },
            _ => return source.refuse(inner, "such a speed is not read"),
        });
        if let Some(held) = children(inner).next() {
            steady = match held.tag_name().name() {
                "TargetDistanceSteadyState" => Steady::Way(source.amount(held, "distance")?),
                "TargetTimeSteadyState" => Steady::Time(source.amount(held, "time")?),
                _ => return source.refuse(held, "such a steady state is not read"),
            };
        }
    }
    Some(ActKind::Meet(Box::new(Meeting { master, master_at, own_at, speed, steady })))
}

fn way(source: &mut Source, action: Node) -> Option<Way> {
    let from_m = source.number_or(action, "initialDistanceOffset", 0.0)?;
    let mode = match element(action, "TrajectoryFollowingMode") {
        Some(mode) => source.word(mode, "followingMode", &FOLLOWING)?,
        None => "",
    };
    let is_steered = mode == "follow";
    if is_steered {
        source.note("who is to steer along a trajectory is on it exactly");
    }
    let outer = element(action, "TrajectoryRef").unwrap_or(action);
    let shape = shape_of(source, outer)?;
    let timing = element(action, "TimeReference").and_then(|node| element(node, "Timing"));
    let (mut found, mut is_absolute) = (None, false);
    if let Some(timing) = timing {
        is_absolute = source.word(timing, "domainAbsoluteRelative", &["absolute", "relative"])? == "absolute";
        let (more_s, times) =
            (source.number_or(timing, "offset", 0.0)?, source.number_or(timing, "scale", 1.0)?);
        source.refuse_if(times <= 0.0, timing, format!("`scale` is {times}: times go on, by more than 0"))?;
        if times != 1.0 {
            source
                .note("the times of a trajectory are those of its places times `scale`, and `offset` later");
        }
        found = Some((more_s, times));
    }
    Some(Way { shape, from_m, timing: found, is_absolute, is_steered })
}
