//! When something begins: the conditions of a file.

use std::collections::BTreeSet;

use avastra_lang::model::expr::Comparison;
use roxmltree::Node;

use super::position::{Position, position};
use super::source::{Mark, Source, children, element, elements};

/// Conditions of a trigger. An act's and an event's are multiplied.
const CONDITIONS_MAX: usize = 16;

/// Lanes beside each other.
const LANES_MAX: i32 = 20;

/// Groups of a trigger.
pub const GROUPS_MAX: usize = 64;

const STORYBOARD_ELEMENTS: [&str; 6] = ["story", "act", "maneuverGroup", "maneuver", "event", "action"];

const STATES: [&str; 7] = [
    "standbyState",
    "startTransition",
    "runningState",
    "endTransition",
    "stopTransition",
    "skipTransition",
    "completeState",
];

const OUTLINE: &str =
    "the distance from a road user's outline to a place is not read: `freespace=\"false\"` is";

const ROUTING: [&str; 5] = ["assignedRoute", "fastest", "leastIntersections", "shortest", "undefined"];

/// Groups, of which one must hold; in a group all conditions must.
pub type Trigger = Vec<Vec<Condition>>;

#[derive(Debug, Clone)]
pub struct Condition {
    pub mark: Mark,
    pub edge: Edge,
    /// The condition must have held, or come, so long ago, s.
    pub delay_s: f64,
    pub kind: When,
    /// Whether it begins the act, in which the event then waits for its own conditions.
    pub is_of_act: bool,
    /// Whether it holds while an element runs, and ceases with that.
    pub is_running: bool,
}

impl Condition {
    /// The time for which it waits, if it waits for one, s.
    pub fn time_s(&self) -> Option<f64> {
        match self.kind {
            When::Always => Some(self.delay_s),
            When::After(seconds) => Some(seconds + self.delay_s),
            _ => None,
        }
    }
}

/// Whether a condition must hold, begin to hold, or cease to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    None,
    Rising,
    Falling,
    Either,
}

#[derive(Debug, Clone, PartialEq)]
pub enum When {
    /// It holds from the beginning.
    Always,
    Never,
    /// The two touch; `None`: any two.
    Contact(Option<(String, String)>),
    /// After this time, s.
    After(f64),
    /// The distance of two entities is less or more than the way that the first one drives in `seconds`.
    Headway {
        pair: Pair,
        seconds: f64,
    },
    /// The distance of two entities is less or more than `metres`.
    Distance {
        pair: Pair,
        metres: f64,
    },
    /// The distance of two entities across the road is less or more than `metres`.
    Apart {
        pair: Pair,
        metres: f64,
    },
    /// The lanes beside an entity are free, so far ahead of it and so far behind.
    Clear(Box<Clearance>),
    /// The first would reach the second in less than `seconds`.
    Collides {
        pair: Pair,
        seconds: f64,
    },
    /// An entity is this near to a place, m, or farther away.
    Reaches {
        entity: String,
        position: PlaceMark,
        within_m: f64,
        is_less: bool,
    },
    /// An entity has gone so far, m.
    Travelled {
        entity: String,
        metres: f64,
    },
    /// An entity has stood for so long, s.
    Stands {
        entity: String,
        seconds: f64,
    },
    /// The speed of an entity is less or more, m/s.
    Speed {
        entity: String,
        mps: f64,
        rule: Comparison,
    },
    /// How much faster the first one is than the second, m/s.
    Faster {
        of: String,
        to: String,
        mps: f64,
        rule: Comparison,
    },
    /// An entity would reach a place in less than `seconds`.
    Nears {
        entity: String,
        position: PlaceMark,
        seconds: f64,
        /// From its outline.
        is_free_space: bool,
    },
    /// An element of the story has ended: its kind and its name.
    Ended {
        kind: &'static str,
        name: String,
    },
    /// It has begun.
    Begun {
        kind: &'static str,
        name: String,
    },
}

/// A position, which conditions compare.
#[derive(Debug, Clone)]
pub struct PlaceMark(pub Position);

impl PartialEq for PlaceMark {
    fn eq(&self, other: &PlaceMark) -> bool {
        format!("{:?} {:?}", self.0.kind, self.0.heading)
            == format!("{:?} {:?}", other.0.kind, other.0.heading)
    }
}

/// Room beside an entity that must be free.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    pub of: String,
    /// The only ones who count; empty: all others.
    pub others: Vec<String>,
    pub ahead_m: f64,
    pub behind_m: f64,
    /// Lanes to the left of the entity's lane, from and to; without them all lanes.
    pub lanes: Option<(i32, i32)>,
    pub is_free_space: bool,
    /// Whether those count who come the other way.
    pub has_oncoming: bool,
}

/// Two entities whose distance is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    pub of: String,
    pub to: String,
    pub rule: Comparison,
    /// Between the outlines, not the reference points.
    pub is_free_space: bool,
    /// As the crow flies, and not along the road.
    pub is_straight: bool,
}

/// The conditions of a start trigger; without any it holds at once. `None` if one is refused.
pub fn trigger(source: &mut Source, parent: Node) -> Option<Trigger> {
    let Some(trigger) = element(parent, "StartTrigger") else { return Some(Vec::new()) };
    conditions(source, trigger)
}

/// The conditions of a trigger, of which the one without any has none. `None` if one is refused.
pub fn conditions(source: &mut Source, trigger: Node) -> Option<Trigger> {
    if trigger.descendants().filter(|node| node.has_tag_name("Condition")).count() > CONDITIONS_MAX {
        return source.refuse(trigger, format!("it has more than {CONDITIONS_MAX} conditions"));
    }
    let mut groups = Some(Vec::new());
    for group in elements(trigger, "ConditionGroup") {
        let mut own = source.required(group, "Condition").map(|_| Trigger::new());
        for node in elements(group, "Condition") {
            let found = condition(source, node);
            let count = own.iter().chain(&found).map(|groups| groups.len().max(1)).product::<usize>();
            let reason = format!("its conditions on several entities make more than {GROUPS_MAX} groups");
            source.refuse_if(count > GROUPS_MAX, group, reason)?;
            own = found.zip(own).map(|(found, own)| both(&own, &found));
        }
        groups = own.zip(groups).map(|(own, groups)| [groups, own].concat());
    }
    groups
}

/// Both triggers hold: each group of the one with each of the other.
pub fn both(a: &Trigger, b: &Trigger) -> Trigger {
    if a.is_empty() || b.is_empty() {
        return a.iter().chain(b).cloned().collect();
    }
    a.iter().flat_map(|a| b.iter().map(move |b| a.iter().chain(b).cloned().collect())).collect()
}

/// Without what holds from the beginning, and without what never comes: `None` if nothing is left that comes, no groups if it
/// comes at once.
pub fn reduced(trigger: Trigger) -> Option<Trigger> {
    let had_groups = !trigger.is_empty();
    let comes = |all: &Vec<Condition>| all.iter().all(|condition| condition.kind != When::Never);
    let groups: Trigger = trigger
        .into_iter()
        .filter(comes)
        .map(|all| {
            let waits = |condition: &Condition| condition.kind != When::Always || condition.delay_s > 0.0;
            all.into_iter().filter(waits).collect::<Vec<Condition>>()
        })
        .collect();
    match () {
        () if had_groups && groups.is_empty() => None,
        () if groups.iter().any(Vec::is_empty) => Some(Vec::new()),
        () => Some(groups),
    }
}

/// A condition as groups: one that asks about several entities is one for each.
fn condition(source: &mut Source, node: Node) -> Option<Trigger> {
    let delay_s = source.number_or(node, "delay", 0.0)?;
    source.refuse_if(delay_s < 0.0, node, "its `delay` is less than 0")?;
    let edge = source.word(node, "conditionEdge", &["none", "rising", "falling", "risingOrFalling"])?;
    let mut edge = match edge {
        "rising" => Edge::Rising,
        "falling" => Edge::Falling,
        "risingOrFalling" => Edge::Either,
        _ => Edge::None,
    };
    if let Some(value) = element(node, "ByValueCondition") {
        let Some(inner) = children(value).next() else { return source.refuse(value, "it is empty") };
        let mut is_running = false;
        let kind = match inner.tag_name().name() {
            "SimulationTimeCondition" => {
                let seconds = source.number(inner, "value")?;
                // That it is the beginning holds there, and lets begin what waits for it.
                let is_beginning = seconds == 0.0 && inner.attribute("rule") == Some("equalTo");
                if !is_beginning && is_less(source, inner)? {
                    return source.refuse(inner, "only times that have passed are read");
                }
                let reason = "times do not cease: `conditionEdge=\"falling\"` waits for nothing";
                source.refuse_if(edge == Edge::Falling, node, reason)?;
                if seconds + delay_s <= 0.0 { When::Always } else { When::After(seconds) }
            }
            "StoryboardElementStateCondition" => {
                let of = source.word(inner, "storyboardElementType", &STORYBOARD_ELEMENTS)?;
                let state = source.word(inner, "state", &STATES)?;
                let reason = "of a state it is read that it begins, not that it ceases";
                source.refuse_if(matches!(edge, Edge::Falling | Edge::Either), inner, reason)?;
                let name = source.text(inner, "storyboardElementRef")?;
                // A transition lasts for a moment, as an edge does.
                if matches!(state, "startTransition" | "endTransition") {
                    edge = Edge::Rising;
                }
                is_running = state == "runningState";
                match state {
                    "startTransition" | "runningState" if of == "story" => When::Always,
                    "startTransition" | "runningState" if of == "act" => {
                        let reason = "the beginning of an act is read where the act begins at once";
                        let last = name.rsplit("::").next().unwrap_or_default();
                        source.refuse_if(!source.acts_at_once.contains(last), inner, reason)?;
                        When::Always
                    }
                    "startTransition" | "runningState" => When::Begun { kind: of, name },
                    "completeState" | "endTransition" => When::Ended { kind: of, name },
                    _ => return source.refuse(inner, "only what has begun or ended is read"),
                }
            }
            "ParameterCondition" => {
                let name = source.named(inner, "parameterRef")?;
                let Some(value) = source.parameter(&name).map(str::to_owned) else {
                    return source.refuse(inner, format!("no parameter is called `{name}`"));
                };
                constant(source, inner, &value)?
            }
            "VariableCondition" => {
                let name = source.named(inner, "variableRef")?;
                match source.variables.get(&name).cloned() {
                    Some(Some(value)) => constant(source, inner, &value)?,
                    Some(None) => {
                        return source.refuse(inner, "a variable that the story sets is not read here");
                    }
                    None => return source.refuse(inner, format!("no variable is called `{name}`")),
                }
            }
            _ => return source.refuse(inner, "this condition is not read"),
        };
        let reason = "it does not cease to hold: `conditionEdge=\"falling\"` waits for nothing";
        source.refuse_if(edge == Edge::Falling && kind == When::Always, inner, reason)?;
        return Some(vec![vec![Condition {
            mark: source.mark(inner),
            edge,
            delay_s,
            kind,
            is_of_act: false,
            is_running,
        }]]);
    }
    let by_entity = source.required(node, "ByEntityCondition")?;
    let list = source.required(by_entity, "TriggeringEntities")?;
    let rule = source.word(list, "triggeringEntitiesRule", &["any", "all"])?;
    let mut names = Vec::new();
    for entity in elements(list, "EntityRef") {
        names.push(source.text(entity, "entityRef")?);
    }
    let outer = source.required(by_entity, "EntityCondition")?;
    let Some(inner) = children(outer).next() else { return source.refuse(outer, "it is empty") };
    source.refuse_if(names.is_empty(), list, "it names no entity")?;
    let reason = "when a condition on several entities begins to hold, or ceases, is not read: `conditionEdge=\"none\"` is";
    source.refuse_if(names.len() > 1 && edge != Edge::None, list, reason)?;
    let mut found = Vec::new();
    for of in &names {
        let kind = of_entity(source, inner, of)?;
        found.push(Condition {
            mark: source.mark(inner),
            edge,
            delay_s,
            kind,
            is_of_act: false,
            is_running: false,
        });
    }
    Some(if rule == "all" { vec![found] } else { found.into_iter().map(|one| vec![one]).collect() })
}

/// A condition about an entity.
fn of_entity(source: &mut Source, inner: Node, of: &str) -> Option<When> {
    let entity = of.to_owned();
    let kind = match inner.tag_name().name() {
        "TimeHeadwayCondition" => {
            frame(source, inner)?;
            When::Headway { pair: pair(source, inner, of)?, seconds: source.amount(inner, "value")? }
        }
        "RelativeDistanceCondition" if inner.attribute("relativeDistanceType") == Some("lateral") => {
            source.word(inner, "coordinateSystem", &["entity", "lane", "road", "trajectory", "world"])?;
            When::Apart { pair: pair(source, inner, of)?, metres: source.amount(inner, "value")? }
        }
        "RelativeDistanceCondition" => {
            frame(source, inner)?;
            When::Distance { pair: pair(source, inner, of)?, metres: source.amount(inner, "value")? }
        }
        "RelativeClearanceCondition" => When::Clear(Box::new(clearance(source, inner, of)?)),
        "TimeToCollisionCondition" => {
            frame(source, inner)?;
            let target = source.required(inner, "TimeToCollisionConditionTarget")?;
            let rule = rule(source, inner)?;
            let is_free_space = source.switch(inner, "freespace", false)?;
            source.refuse_if(!asks_for_less(rule), inner, "only `lessThan` is read")?;
            let seconds = source.amount(inner, "value")?;
            if let Some(place) = element(target, "Position") {
                let position = PlaceMark(position(source, place)?);
                When::Nears { entity, position, seconds, is_free_space }
            } else {
                let to = source.required(target, "EntityRef")?;
                let to = source.text(to, "entityRef")?;
                source.refuse_if(entity == to, inner, "it asks about one entity and itself")?;
                let is_straight = is_straight(inner);
                When::Collides { pair: Pair { of: entity, to, rule, is_free_space, is_straight }, seconds }
            }
        }
        "ReachPositionCondition" => {
            let place = source.required(inner, "Position")?;
            let within_m = source.amount(inner, "tolerance")?;
            When::Reaches { entity, position: PlaceMark(position(source, place)?), within_m, is_less: true }
        }
        "DistanceCondition" => {
            frame(source, inner)?;
            let place = source.required(inner, "Position")?;
            let within_m = source.amount(inner, "value")?;
            let is_less = is_less(source, inner)?;
            let is_free_space = source.switch(inner, "freespace", false)?;
            source.refuse_if(is_free_space, inner, OUTLINE)?;
            When::Reaches { entity, position: PlaceMark(position(source, place)?), within_m, is_less }
        }
        "TraveledDistanceCondition" => When::Travelled { entity, metres: source.amount(inner, "value")? },
        "CollisionCondition" => {
            let with = match element(inner, "EntityRef") {
                Some(with) => Some((entity, source.text(with, "entityRef")?)),
                None => None,
            };
            When::Contact(with)
        }
        "StandStillCondition" => When::Stands { entity, seconds: source.amount(inner, "duration")? },
        "SpeedCondition" => {
            along(source, inner)?;
            When::Speed { entity, mps: source.number(inner, "value")?, rule: rule(source, inner)? }
        }
        "RelativeSpeedCondition" => {
            along(source, inner)?;
            let (to, mps) = (source.text(inner, "entityRef")?, source.number(inner, "value")?);
            When::Faster { of: entity, to, mps, rule: rule(source, inner)? }
        }
        _ => return source.refuse(inner, "this condition is not read"),
    };
    Some(kind)
}

fn clearance(source: &mut Source, node: Node, of: &str) -> Option<Clearance> {
    let mut ranges = elements(node, "RelativeLaneRange");
    let lanes = match (ranges.next(), ranges.next()) {
        (None, _) => None,
        (Some(range), None) => Some((source.integer(range, "from")?, source.integer(range, "to")?)),
        (_, Some(second)) => return source.refuse(second, "one range of lanes is read"),
    };
    let is_wide = |(from, to): (i32, i32)| from > to || to.saturating_sub(from) > LANES_MAX;
    let reason = format!("lanes go from a lesser to a greater number, and are {LANES_MAX} at most");
    source.refuse_if(lanes.is_some_and(is_wide), node, reason)?;
    let mut others = Vec::new();
    for entity in elements(node, "EntityRef") {
        others.push(source.text(entity, "entityRef")?);
    }
    Some(Clearance {
        of: of.to_owned(),
        others,
        ahead_m: source.amount(node, "distanceForward")?,
        behind_m: source.amount(node, "distanceBackward")?,
        lanes,
        is_free_space: source.switch(node, "freeSpace", false)?,
        has_oncoming: source.switch(node, "oppositeLanes", false)?,
    })
}

/// The names of the acts that wait for nothing but times that have come when the scenario begins.
pub fn acts_at_once(root: Node) -> BTreeSet<String> {
    let acts = root.descendants().filter(|one| one.has_tag_name("Act"));
    let at_once = acts.filter(|act| begins_at_once(*act));
    at_once.filter_map(|act| act.attribute("name").map(str::to_owned)).collect()
}

fn begins_at_once(act: Node) -> bool {
    let Some(trigger) = element(act, "StartTrigger") else { return true };
    let number = |node: &Node, name: &str| node.attribute(name).map_or(Some(0.0), |text| text.parse().ok());
    let is_past = |condition: Node| {
        let time = condition.descendants().find(|one| one.has_tag_name("SimulationTimeCondition"));
        let at_s = time.and_then(|time| number(&time, "value"));
        at_s.is_some_and(|at_s: f64| at_s <= 0.0)
            && number(&condition, "delay").is_some_and(|delay_s: f64| delay_s <= 0.0)
    };
    trigger.descendants().filter(|one| one.has_tag_name("Condition")).all(is_past)
}

/// Whether a value that does not change compares so.
fn constant(source: &mut Source, node: Node, value: &str) -> Option<When> {
    let (rule, wanted) = (source.text(node, "rule")?, source.text(node, "value")?);
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let order = match (number(value), number(&wanted)) {
        (Some(value), Some(wanted)) => value.total_cmp(&wanted),
        _ => value.cmp(&wanted),
    };
    let holds = match rule.as_str() {
        "equalTo" => order.is_eq(),
        "notEqualTo" => order.is_ne(),
        "lessThan" => order.is_lt(),
        "lessOrEqual" => order.is_le(),
        "greaterThan" => order.is_gt(),
        "greaterOrEqual" => order.is_ge(),
        other => return source.refuse(node, format!("the rule `{other}` is not read")),
    };
    Some(if holds { When::Always } else { When::Never })
}

/// Refuses speeds to the side and upwards.
fn along(source: &mut Source, node: Node) -> Option<()> {
    let direction = source.word(node, "direction", &["longitudinal", "lateral", "vertical"])?;
    source.refuse_if(matches!(direction, "lateral" | "vertical"), node, "only speeds ahead are read")
}

/// Refuses distances across the road, and words for what a distance counts along that no version has.
fn frame(source: &mut Source, node: Node) -> Option<()> {
    source.word(node, "coordinateSystem", &["entity", "lane", "road", "trajectory", "world"])?;
    source.word(node, "routingAlgorithm", &ROUTING)?;
    source.switch(node, "alongRoute", true)?;
    let kinds = ["longitudinal", "lateral", "cartesianDistance", "euclidianDistance"];
    if source.word(node, "relativeDistanceType", &kinds)? == "lateral" {
        return source.refuse(node, "lateral distances are not read");
    }
    Some(())
}

/// Whether a distance is one as the crow flies.
fn is_straight(node: Node) -> bool {
    matches!(node.attribute("relativeDistanceType"), Some("euclidianDistance" | "cartesianDistance"))
}

fn pair(source: &mut Source, node: Node, of: &str) -> Option<Pair> {
    let to = source.text(node, "entityRef")?;
    let is_free_space = source.switch(node, "freespace", false)?;
    let is_straight = is_straight(node);
    source.refuse_if(of == to, node, "it asks about one entity and itself")?;
    Some(Pair { of: of.to_owned(), to, rule: rule(source, node)?, is_free_space, is_straight })
}

/// Whether a comparison is for less than a bound, and not for more.
pub fn asks_for_less(rule: Comparison) -> bool {
    matches!(rule, Comparison::Less | Comparison::LessEqual)
}

/// Whether the rule of a condition asks for less.
pub fn is_less(source: &mut Source, node: Node) -> Option<bool> {
    Some(asks_for_less(rule(source, node)?))
}

fn rule(source: &mut Source, node: Node) -> Option<Comparison> {
    match source.text(node, "rule")?.as_str() {
        "lessThan" => Some(Comparison::Less),
        "lessOrEqual" => Some(Comparison::LessEqual),
        "greaterThan" => Some(Comparison::Greater),
        "greaterOrEqual" => Some(Comparison::GreaterEqual),
        other => source.refuse(node, format!("the rule `{other}` is not read: more or less is")),
    }
}
