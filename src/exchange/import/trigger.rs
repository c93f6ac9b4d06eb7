//! When something begins: the conditions of a file.

use roxmltree::Node;

use super::position::{Position, position};
use super::source::{Mark, Source, children, element, elements};

/// Conditions of a trigger. An act's and an event's are multiplied.
const CONDITIONS_MAX: usize = 16;

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

const ROUTING: [&str; 5] = ["assignedRoute", "fastest", "leastIntersections", "shortest", "undefined"];

/// Groups, of which one must hold; in a group all conditions must.
pub type Trigger = Vec<Vec<Condition>>;

#[derive(Debug, Clone)]
pub struct Condition {
    pub mark: Mark,
    /// It asks for what begins to hold.
    pub is_rising: bool,
    pub kind: When,
}

#[derive(Debug, Clone)]
pub enum When {
    /// It holds from the beginning.
    Always,
    /// After this time, s.
    After(f64),
    /// The distance of two entities is less or more than the way that the first one drives in `seconds`.
    Headway { pair: Pair, seconds: f64 },
    /// The distance of two entities is less or more than `metres`.
    Distance { pair: Pair, metres: f64 },
    /// The first would reach the second in less than `seconds`.
    Collides { pair: Pair, seconds: f64 },
    /// An entity is this near to a place, m.
    Reaches { entity: String, position: Position, within_m: f64 },
}

/// Two entities whose distance is compared.
#[derive(Debug, Clone)]
pub struct Pair {
    pub of: String,
    pub to: String,
    pub is_less: bool,
    /// Between the outlines, not the reference points.
    pub is_free_space: bool,
}

/// The conditions of a start trigger; without any it holds at once. `None` if one is refused.
pub fn trigger(source: &mut Source, parent: Node) -> Option<Trigger> {
    let Some(trigger) = element(parent, "StartTrigger") else { return Some(Vec::new()) };
    if trigger.descendants().filter(|node| node.has_tag_name("Condition")).count() > CONDITIONS_MAX {
        return source.refuse(trigger, format!("it has more than {CONDITIONS_MAX} conditions"));
    }
    let mut groups = Some(Vec::new());
    for group in elements(trigger, "ConditionGroup") {
        let mut all = Some(Vec::new());
        if source.required(group, "Condition").is_none() {
            all = None;
        }
        for node in elements(group, "Condition") {
            match condition(source, node) {
                Some(found) => all.iter_mut().for_each(|all| all.push(found.clone())),
                None => all = None,
            }
        }
        match (all, &mut groups) {
            (Some(all), Some(groups)) => groups.push(all),
            _ => groups = None,
        }
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

fn condition(source: &mut Source, node: Node) -> Option<Condition> {
    let delay_s = source.number_or(node, "delay", 0.0)?;
    source.refuse_if(delay_s < 0.0, node, "its `delay` is less than 0")?;
    let edge = source.word(node, "conditionEdge", &["none", "rising", "falling", "risingOrFalling"])?;
    let is_rising = edge == "rising";
    source.refuse_if(edge.ends_with("alling"), node, "only what begins to hold is read, not what ends")?;
    if let Some(value) = element(node, "ByValueCondition") {
        let Some(inner) = children(value).next() else { return source.refuse(value, "it is empty") };
        let kind = match inner.tag_name().name() {
            "SimulationTimeCondition" => {
                let seconds = source.number(inner, "value")?;
                if is_less(source, inner)? {
                    return source.refuse(inner, "only times that have passed are read");
                }
                if seconds + delay_s <= 0.0 { When::Always } else { When::After(seconds + delay_s) }
            }
            "StoryboardElementStateCondition" => {
                let of = source.word(inner, "storyboardElementType", &STORYBOARD_ELEMENTS)?;
                let state = source.word(inner, "state", &STATES)?;
                let begins = matches!(state, "startTransition" | "runningState");
                let reason = "an event does not wait for another: what ends when is up to the drivers";
                source.refuse_if(
                    !(begins && matches!(of, "act" | "story")) || delay_s > 0.0,
                    inner,
                    reason,
                )?;
                When::Always
            }
            _ => return source.refuse(inner, "this condition is not read"),
        };
        return Some(Condition { mark: source.mark(inner), is_rising, kind });
    }
    let by_entity = source.required(node, "ByEntityCondition")?;
    let list = source.required(by_entity, "TriggeringEntities")?;
    source.word(list, "triggeringEntitiesRule", &["any", "all"])?;
    let mut names = Vec::new();
    for entity in elements(list, "EntityRef") {
        names.push(source.text(entity, "entityRef")?);
    }
    let outer = source.required(by_entity, "EntityCondition")?;
    let Some(inner) = children(outer).next() else { return source.refuse(outer, "it is empty") };
    let [of] = names.as_slice() else {
        let reason =
            if names.is_empty() { "it names no entity" } else { "a condition asks about one entity" };
        return source.refuse(list, reason);
    };
    source.refuse_if(delay_s > 0.0, node, "a delay is read of times alone")?;
    let kind = match inner.tag_name().name() {
        "TimeHeadwayCondition" => {
            frame(source, inner)?;
            When::Headway { pair: pair(source, inner, of)?, seconds: source.amount(inner, "value")? }
        }
        "RelativeDistanceCondition" => {
            frame(source, inner)?;
            When::Distance { pair: pair(source, inner, of)?, metres: source.amount(inner, "value")? }
        }
        "TimeToCollisionCondition" => {
            frame(source, inner)?;
            let target =
                element(inner, "TimeToCollisionConditionTarget").and_then(|node| element(node, "EntityRef"));
            let Some(target) = target else { return source.refuse(inner, "the target is an entity") };
            let to = source.text(target, "entityRef")?;
            let is_less = is_less(source, inner)?;
            let is_free_space = source.switch(inner, "freespace", false)?;
            let pair = Pair { of: of.clone(), to, is_less, is_free_space };
            source.refuse_if(!is_less, inner, "only `lessThan` is read")?;
            When::Collides { pair, seconds: source.amount(inner, "value")? }
        }
        "ReachPositionCondition" => {
            let place = source.required(inner, "Position")?;
            let within_m = source.amount(inner, "tolerance")?;
            When::Reaches { entity: of.clone(), position: position(source, place)?, within_m }
        }
        _ => return source.refuse(inner, "this condition is not read"),
    };
    Some(Condition { mark: source.mark(inner), is_rising, kind })
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

fn pair(source: &mut Source, node: Node, of: &str) -> Option<Pair> {
    let to = source.text(node, "entityRef")?;
    let is_free_space = source.switch(node, "freespace", false)?;
    Some(Pair { of: of.to_owned(), to, is_less: is_less(source, node)?, is_free_space })
}

pub fn is_less(source: &mut Source, node: Node) -> Option<bool> {
    match source.text(node, "rule")?.as_str() {
        "lessThan" | "lessOrEqual" => Some(true),
        "greaterThan" | "greaterOrEqual" => Some(false),
        other => source.refuse(node, format!("the rule `{other}` is not read: more or less is")),
    }
}
