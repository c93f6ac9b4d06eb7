//! What an OpenSCENARIO file says, as far as it can be imported, without its map: who is there, where, how fast, and what the
//! others do when.

use std::collections::BTreeSet;

use roxmltree::{Document, Node};

use super::Files;
use super::action::{Begun, Headway, Speed, Target, Walk, begun};
use super::body::{Shape, body};
use super::position::Position;
use super::source::{Mark, Source, children, element, elements};
use super::trigger::{Trigger, both, is_less, trigger};
use super::vocabulary;
use super::weather::{Weather, weather};

/// The latest minor version that is read.
const MINOR_MAX: i32 = 3;

/// How long a scenario is played that names no time for its end, s.
const DURATION_S: f64 = 60.0;

/// The longest step of an episode, s: a scenario is one step.
pub(super) const DURATION_S_MAX: f64 = 600.0;

/// A file's scenario.
#[derive(Debug)]
pub struct Story {
    /// The map as the file names it, and where.
    pub map: (Mark, String),
    pub ego: Entity,
    pub others: Vec<Entity>,
    pub weather: Weather,
    pub duration_s: f64,
    /// What the file says of itself.
    pub description: String,
}

#[derive(Debug)]
pub struct Entity {
    pub name: String,
    pub mark: Mark,
    pub body: Shape,
    pub position: Option<(Mark, Position)>,
    /// The last counts; before the first an entity stands.
    pub speeds: Vec<Paced>,
    /// The way to the ego vehicle that an action of the start asks for.
    pub headway: Option<(Mark, Headway)>,
    pub changes: Vec<Change>,
    /// The ways of a pedestrian.
    pub walks: Vec<Walk>,
    /// Where the ego vehicle is to drive.
    pub goal: Option<(Mark, Position)>,
}

#[derive(Debug)]
pub struct Paced {
    pub mark: Mark,
    pub speed: Speed,
    /// Whether it is reached at once.
    pub at_once: bool,
    /// When it begins; empty: with the scenario.
    pub when: Trigger,
}

#[derive(Debug)]
pub struct Change {
    pub mark: Mark,
    pub to: Target,
    pub when: Trigger,
}

/// Reads a file. What cannot be said is refused; `None` if that is so much that nothing can be placed.
pub fn read(source: &mut Source, document: &Document, ego: Option<&str>, files: &dyn Files) -> Option<Story> {
    let root = document.root_element();
    let reason = "the root element of a scenario is `OpenSCENARIO`";
    source.refuse_if(!root.has_tag_name("OpenSCENARIO"), root, reason)?;
    let header = source.required(root, "FileHeader")?;
    source.minor = source.integer(header, "revMinor")?;
    if source.integer(header, "revMajor")? != 1 || !(0..=MINOR_MAX).contains(&source.minor) {
        return source.refuse(header, format!("OpenSCENARIO XML of 1.0 to 1.{MINOR_MAX} is read"));
    }
    if let Some(other) = children(root)
        .find(|child| matches!(child.tag_name().name(), "Catalog" | "ParameterValueDistribution"))
    {
        return source.refuse(other, "this is no scenario; give the file of one that uses it");
    }
    for (node, reason) in vocabulary::unknown(root) {
        source.refuse::<()>(node, reason);
    }
    source.declare(root);
    let network = source.required(root, "RoadNetwork")?;
    let logic = source.required(network, "LogicFile")?;
    let map = (source.mark(logic), source.text(logic, "filepath")?);
    if element(network, "TrafficSignals").is_some() {
        source.note("traffic lights follow the map's controllers, not the phases of the file");
    }
    let entities = entities(source, root, files);
    let mut cast = Cast::of(source, root, entities, ego)?;
    let storyboard = source.required(root, "Storyboard")?;
    let mut sky = Weather::default();
    if let Some(init) = element(storyboard, "Init") {
        for actions in elements(init, "Actions") {
            for action in children(actions) {
                match action.tag_name().name() {
                    "Private" => cast.start(source, action),
                    "GlobalAction" => sky = sky.then(weather(source, action).unwrap_or_default()),
                    _ => user_defined(source, action),
                }
            }
        }
    }
    for story in elements(storyboard, "Story") {
        source.declare(story);
        for act in elements(story, "Act") {
            cast.act(source, act);
        }
    }
    source.refuse_undeclared(root);
    if cast.ego_actions > 0 {
        let note = "what the story lets the ego vehicle do is left to the driving system under test";
        source.note(format!("{note} (actions of the file: {})", cast.ego_actions));
    }
    let duration_s = duration_s(source, storyboard);
    let description = header.attribute("description").unwrap_or("").to_owned();
    Some(Story { map, ego: cast.ego, others: cast.others, weather: sky, duration_s, description })
}

/// The entities and what is known of them so far.
struct Cast {
    ego: Entity,
    others: Vec<Entity>,
    ego_actions: usize,
}

impl Cast {
    fn of(source: &mut Source, root: Node, mut entities: Vec<Entity>, ego: Option<&str>) -> Option<Cast> {
        let is_ego = |name: &str| match ego {
            Some(ego) => name == ego,
            None => matches!(name.to_lowercase().as_str(), "ego" | "hero" | "egovehicle" | "ego_vehicle"),
        };
        let listed: Vec<&str> =
            elements(root, "Entities").flat_map(children).filter_map(|node| node.attribute("name")).collect();
        let found = entities.iter().position(|entity| is_ego(&entity.name));
        let found = found.or((ego.is_none() && listed.len() == 1 && entities.len() == 1).then_some(0));
        let Some(at) = found else {
            let mut torn = listed.iter().filter(|name| source.is_torn(name));
            if torn.any(|name| is_ego(name) || entities.is_empty()) {
                return None;
            }
            let names: Vec<String> = entities.iter().map(|entity| format!("`{}`", entity.name)).collect();
            source.refuse_if(names.is_empty(), root, "no entity can be read")?;
            let reason =
                format!("which entity is the ego vehicle? Name it with `--ego`: {}", names.join(", "));
            return source.refuse(root, reason);
        };
        let ego = entities.remove(at);
        Some(Cast { ego, others: entities, ego_actions: 0 })
    }

    fn is_ego(&self, name: &str) -> bool {
        self.ego.name == name
    }

    fn other(&mut self, name: &str) -> Option<&mut Entity> {
        self.others.iter_mut().find(|entity| entity.name == name)
    }

    /// Whether an entity has a name that an element asks for; refuses a name that none has.
    fn knows(&mut self, source: &mut Source, node: Node, name: &str) -> bool {
        let is_known = self.is_ego(name) || self.other(name).is_some();
        source.refuse_if(!is_known && !source.is_torn(name), node, format!("no entity is called `{name}`"));
        is_known
    }

    /// Actions of an entity at the beginning.
    fn start(&mut self, source: &mut Source, private: Node) {
        let Some(name) = source.text(private, "entityRef") else { return };
        if !self.knows(source, private, &name) {
            return;
        }
        let is_ego = self.is_ego(&name);
        for action in elements(private, "PrivateAction").flat_map(children) {
            let distance = action.descendants().find(|node| node.has_tag_name("LongitudinalDistanceAction"));
            if let Some(distance) = distance.filter(|_| !is_ego)
                && source.text(distance, "entityRef").is_some_and(|of| !self.is_ego(&of))
            {
                source.refuse::<()>(distance, "only a distance to the ego vehicle is read");
                continue;
            }
            let begun = source.about(&name, |source| begun(source, action, is_ego));
            let entity = if is_ego { Some(&mut self.ego) } else { self.other(&name) };
            if let (Some(begun), Some(entity)) = (begun, entity) {
                entity.begin(begun, Vec::new());
            }
        }
    }

    fn act(&mut self, source: &mut Source, act: Node) {
        let mut begins = None;
        if let Some(stop) = element(act, "StopTrigger").filter(|stop| children(*stop).next().is_some()) {
            source.refuse::<()>(stop, "an act goes on to the end of the scenario");
        }
        for group in elements(act, "ManeuverGroup") {
            is_carried_out(source, group);
            if let Some(catalogue) = element(group, "CatalogReference") {
                source.refuse::<()>(catalogue, "manoeuvres of catalogues are not read");
            }
            let Some(actors) = element(group, "Actors") else { continue };
            if source.switch(actors, "selectTriggeringEntities", false) != Some(false) {
                source.refuse::<()>(actors, "who acts is named: those that a condition selects are not read");
                continue;
            }
            let (mut names, mut is_read) = (Vec::new(), true);
            for actor in elements(actors, "EntityRef") {
                let Some(name) = source.text(actor, "entityRef") else { continue };
                if self.knows(source, actor, &name) {
                    names.push(name);
                } else {
                    is_read = false;
                }
            }
            if names.is_empty() {
                source.refuse_if(is_read, actors, "it names nobody who acts");
                continue;
            }
            for manoeuvre in elements(group, "Maneuver") {
                source.declare(manoeuvre);
                for event in elements(manoeuvre, "Event") {
                    is_carried_out(source, event);
                    source.word(event, "priority", &["override", "overwrite", "parallel", "skip"]);
                    let actions: Vec<Node> = elements(event, "Action").flat_map(children).collect();
                    let own: Vec<&String> = names.iter().filter(|name| !self.is_ego(name)).collect();
                    let is_global = actions.iter().any(|action| !action.has_tag_name("PrivateAction"));
                    if own.is_empty() && !is_global {
                        self.ego_actions += actions.len();
                        continue;
                    }
                    let begins = begins.get_or_insert_with(|| trigger(source, act)).clone();
                    self.event(source, &own, event, &actions, begins);
                }
            }
        }
    }

    fn event(
        &mut self,
        source: &mut Source,
        actors: &[&String],
        event: Node,
        actions: &[Node],
        begins: Option<Trigger>,
    ) {
        // What an action asks for is told even where its trigger is refused.
        let when = trigger(source, event).zip(begins).map(|(event, act)| both(&act, &event));
        if when.is_none() {
            actors.iter().for_each(|name| source.tear(name));
        }
        for action in actions {
            if !action.has_tag_name("PrivateAction") {
                user_defined(source, *action);
                continue;
            }
            for act in children(*action) {
                for name in actors {
                    let begun = source.about(name, |source| {
                        let begun = begun(source, act, false);
                        match begun {
                            Some(Begun::Placed(..) | Begun::Headway(..)) => {
                                source.refuse(act, "nothing is placed anew in the story")
                            }
                            _ => begun,
                        }
                    });
                    if let (Some(begun), Some(when), Some(entity)) = (begun, &when, self.other(name)) {
                        entity.begin(begun, when.clone());
                    }
                }
            }
        }
    }
}

impl Entity {
    fn begin(&mut self, begun: Begun, when: Trigger) {
        match begun {
            Begun::Placed(mark, position) => self.position = Some((mark, position)),
            Begun::Headway(mark, headway) => self.headway = Some((mark, headway)),
            Begun::Speed(mark, speed, at_once) => self.speeds.push(Paced { mark, speed, at_once, when }),
            Begun::Change(mark, to) => self.changes.push(Change { mark, to, when }),
            Begun::Walk(walk) => self.walks.push(walk),
            Begun::Goal(mark, position) => self.goal = Some((mark, position)),
        }
    }
}

fn entities(source: &mut Source, root: Node, files: &dyn Files) -> Vec<Entity> {
    let (mut found, mut names) = (Vec::new(), BTreeSet::new());
    let Some(list) = source.required(root, "Entities") else { return found };
    for node in children(list) {
        if !node.has_tag_name("ScenarioObject") {
            source.refuse::<()>(node, "groups of entities are not read");
            continue;
        }
        let Some(name) = source.text(node, "name") else { continue };
        if !names.insert(name.clone()) {
            source.tear(&name);
            source.refuse::<()>(node, format!("another entity is called `{name}`, too"));
            continue;
        }
        let Some(body) = source.about(&name, |source| body(source, root, node, files)) else { continue };
        found.push(Entity {
            name,
            mark: source.mark(node),
            body,
            position: None,
            speeds: Vec::new(),
            headway: None,
            changes: Vec::new(),
            walks: Vec::new(),
            goal: None,
        });
    }
    found
}

fn user_defined(source: &mut Source, action: Node) {
    match action.tag_name().name() {
        "UserDefinedAction" => source.note("commands for the player of the file are not taken over"),
        _ => {
            source.refuse::<()>(children(action).next().unwrap_or(action), "this action is not read");
        }
    }
}

/// Refuses what is to be carried out no times.
fn is_carried_out(source: &mut Source, node: Node) {
    if source.number_or(node, "maximumExecutionCount", 1.0).is_some_and(|count| count < 1.0) {
        source.refuse::<()>(node, "`maximumExecutionCount` is less than 1: leave out what never happens");
    }
}

/// When the scenario ends: the latest time that its stop trigger names.
fn duration_s(source: &mut Source, storyboard: Node) -> f64 {
    let mut latest_s: f64 = 0.0;
    let trigger = element(storyboard, "StopTrigger");
    for node in trigger.iter().flat_map(|trigger| trigger.descendants()) {
        if node.has_tag_name("SimulationTimeCondition") && is_less(source, node) == Some(false) {
            latest_s = latest_s.max(source.number(node, "value").unwrap_or(0.0));
        }
    }
    if latest_s <= 0.0 {
        source.note(format!("the file names no time above 0 for its end: {DURATION_S} s are played"));
        return DURATION_S;
    }
    if latest_s > DURATION_S_MAX {
        source.note(format!("{DURATION_S_MAX} s are played of the file's {latest_s:.0}"));
    }
    latest_s.min(DURATION_S_MAX)
}
