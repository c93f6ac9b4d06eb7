//! The content of an OpenSCENARIO file, as far as it can be imported, without its map: the entities, their places and
//! speeds, and what the others do when.

use std::collections::BTreeSet;
use std::rc::Rc;

use roxmltree::{Document, Node};

use avastra_lang::model::COMMANDED_MAX;

use crate::export::SPEED_LIMIT;

use super::action::{Act, ActKind, Headway, Over, Speed, Way, act};
use super::body::{Body, body};
use super::catalogue;
use super::position::Position;
use super::sky::{Change, Sky};
use super::source::{DURATION_S_MAX, Mark, Source, children, element, elements, plain};
use super::trigger::{
    Condition, Edge, GROUPS_MAX, Trigger, When, acts_at_once, both, conditions, is_less, reduced, trigger,
};
use super::weather::{Weather, weather};

/// The latest minor version that is read.
const MINOR_MAX: i32 = 3;

/// The most events of one entity: as many as a manoeuvre of the language has phases.
const PHASES_MAX: usize = 100;

/// How long a scenario is played that names no time for its end, s.
const DURATION_S: f64 = 60.0;

/// A file's scenario.
#[derive(Debug)]
pub struct Story {
    /// The map as the file names it, and where.
    pub map: (Mark, String),
    pub ego: Entity,
    pub others: Vec<Entity>,
    /// As the scenario begins.
    pub weather: Weather,
    /// In the order of the file.
    pub changes: Vec<Change>,
    pub duration_s: f64,
    /// The speed limit of the ego vehicle's road, m/s, which an export of avastra says.
    pub limit_mps: Option<f64>,
    /// The description in the file.
    pub description: String,
}

#[derive(Debug)]
pub struct Entity {
    pub name: String,
    pub mark: Mark,
    pub body: Body,
    pub position: Option<Position>,
    /// The speed with which it begins; the last that the file says counts.
    pub speed: Option<(Mark, Speed)>,
    /// Its free space ahead of the ego vehicle.
    pub headway: Option<(Mark, String, Headway)>,
    /// The trajectory that it follows from the beginning.
    pub way: Option<Way>,
    /// The places through which it drives, from the beginning.
    pub route: Option<(Mark, Vec<Position>)>,
    pub events: Vec<Event>,
}

/// The actions of an entity, and when they begin.
#[derive(Debug, Clone)]
pub struct Event {
    pub mark: Mark,
    /// The names of its actions, the event, its manoeuvre, the manoeuvre group and the act, each with its kind.
    pub names: Vec<(&'static str, String)>,
    pub when: Trigger,
    pub acts: Vec<Act>,
    /// Whether its beginning ends what else of its manoeuvre is under way.
    pub overwrites: bool,
    /// Whether the file lets it happen several times.
    pub comes_again: bool,
    /// The trigger that stops its act, and where it stands.
    pub stop: Option<Rc<(Mark, Trigger)>>,
}

impl Entity {
    /// The entity's events after this one, in the order of the file.
    pub fn after(&self, event: &Event) -> impl Iterator<Item = &Event> {
        self.events.iter().skip_while(move |other| !core::ptr::eq(*other, event)).skip(1)
    }
}

impl Event {
    /// An action from the beginning, as an event.
    fn of_init(mark: Mark, kind: ActKind) -> Event {
        let acts = vec![Act { mark: mark.clone(), kind }];
        let (names, when) = (Vec::new(), Vec::new());
        Event { mark, names, when, acts, overwrites: false, comes_again: false, stop: None }
    }

    pub fn name(&self) -> &str {
        let own = self.names.iter().find(|(kind, _)| *kind == "event");
        own.map_or("what the beginning lets it do", |(_, name)| name)
    }

    /// Whether two stand in one manoeuvre.
    pub fn is_beside(&self, other: &Event) -> bool {
        let within = |event: &Event| {
            let outer = event.names.iter().filter(|(kind, _)| !matches!(*kind, "event" | "action"));
            outer.cloned().collect::<Vec<_>>()
        };
        !self.names.is_empty() && within(self) == within(other)
    }

    /// When it comes, if that is a time, s.
    pub fn time_s(&self) -> Option<f64> {
        time_s(&self.when)
    }
}

/// When a trigger comes, if that is a time, s.
fn time_s(trigger: &Trigger) -> Option<f64> {
    match trigger.as_slice() {
        [] => Some(0.0),
        [all] => match all.as_slice() {
            [only] => only.time_s(),
            _ => None,
        },
        _ => None,
    }
}

impl Story {
    pub fn entity(&self, name: &str) -> Option<&Entity> {
        core::iter::once(&self.ego).chain(&self.others).find(|entity| entity.name == name)
    }
}

/// Reads a file. Content that the language cannot say is refused; `None` if nothing can be placed without it.
pub fn read(source: &mut Source, document: &Document, ego: Option<&str>) -> Option<Story> {
    let root = document.root_element();
    let header = check_header(source, root)?;
    if let Some(other) = children(root)
        .find(|child| matches!(child.tag_name().name(), "Catalog" | "ParameterValueDistribution"))
    {
        return source.refuse(other, "this is no scenario; give the file of one that uses it");
    }
    source.declare(root);
    // Nothing else is to be told of values that the file itself excludes.
    if source.is_excluded {
        return None;
    }
    catalogue::locate(source, root);
    source.acts_at_once = acts_at_once(root);
    variables(source, root);
    let network = source.required(root, "RoadNetwork")?;
    let logic = source.required(network, "LogicFile")?;
    let map = (source.mark(logic), source.text(logic, "filepath")?);
    if element(network, "TrafficSignals").is_some() {
        source.note("traffic lights follow the map's controllers, not the phases of the file");
    }
    let entities = entities(source, root);
    // If the file assigns a controller anywhere, all entities are taken to have one from the beginning.
    if root.descendants().any(|node| node.has_tag_name("AssignControllerAction")) {
        source.controlled.extend(entities.iter().map(|entity| entity.name.clone()));
    }
    let mut cast = Cast::of(source, root, entities, ego)?;
    let storyboard = source.required(root, "Storyboard")?;
    let mut sky = Weather::default();
    if let Some(init) = element(storyboard, "Init") {
        for actions in elements(init, "Actions") {
            for action in children(actions) {
                match action.tag_name().name() {
                    "Private" => cast.start(source, action),
                    "GlobalAction" if is_signal(action) => signals(source),
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
    if cast.ego.way.is_some() {
        source
            .note("the ego vehicle drives along lanes, and not along the trajectory that the file gives it");
    }
    let gone = core::mem::take(&mut cast.gone);
    cast.others.retain(|entity| !gone.contains(&entity.name));
    let ego_mps = match &cast.ego.speed {
        Some((_, Speed::Absolute(mps))) => *mps,
        _ => 0.0,
    };
    let duration_s = duration_s(source, storyboard, &cast.ego.name, ego_mps);
    let description = header.attribute("description").unwrap_or("").to_owned();
    let limit_mps = own_limit_mps(source, header);
    let Cast { ego, others, changes, .. } = cast;
    if let Some(other) = others.get(COMMANDED_MAX as usize) {
        let reason = format!("a file has at most {COMMANDED_MAX} road users beside the ego vehicle");
        return source.refuse(&other.mark, reason);
    }
    Some(Story { map, ego, others, weather: sky, changes, duration_s, limit_mps, description })
}

/// The header of a file whose version is read.
pub fn check_header<'a, 'input>(source: &mut Source, root: Node<'a, 'input>) -> Option<Node<'a, 'input>> {
    let reason = "the root element of a scenario is `OpenSCENARIO`";
    source.refuse_if(!root.has_tag_name("OpenSCENARIO"), root, reason)?;
    let header = source.required(root, "FileHeader")?;
    source.minor = source.integer(header, "revMinor")?;
    if source.integer(header, "revMajor")? != 1 || !(0..=MINOR_MAX).contains(&source.minor) {
        return source.refuse(header, format!("OpenSCENARIO XML of 1.0 to 1.{MINOR_MAX} is read"));
    }
    // So ScenarioRunner marks files that count as CARLA does.
    source.is_left_handed =
        header.attribute("description").is_some_and(|description| description.starts_with("CARLA:"));
    if source.is_left_handed {
        source.note(
            "the description begins with `CARLA:`, so its world is left-handed: `y`, headings and offsets count to the right",
        );
    }
    Some(header)
}

/// The speed limit that an export of avastra has in its header, m/s: no element of the format holds one.
fn own_limit_mps(source: &mut Source, header: Node) -> Option<f64> {
    header.attribute("author").filter(|author| *author == "avastra")?;
    let mut facts = elements(header, "Properties").flat_map(children);
    let limit = facts.find(|fact| fact.attribute("name") == Some(SPEED_LIMIT))?;
    source.number(limit, "value")
}

/// Notes the variables of the file: their values, or that the story sets them.
fn variables(source: &mut Source, root: Node) {
    for one in elements(root, "VariableDeclarations").flat_map(children) {
        if let (Some(name), Some(value)) = (source.named(one, "name"), source.text(one, "value")) {
            source.variables.insert(name, Some(value));
        }
    }
    let set = root.descendants().filter(|node| node.has_tag_name("VariableAction"));
    for name in set.filter_map(|node| node.attribute("variableRef")) {
        source.variables.insert(plain(name).to_owned(), None);
    }
}

/// The entities and what is known of them so far.
struct Cast {
    ego: Entity,
    others: Vec<Entity>,
    ego_actions: usize,
    /// Changes of the weather.
    changes: Vec<Change>,
    /// The entities that leave as the scenario begins.
    gone: BTreeSet<String>,
    /// The elements that never come: kind and name.
    never: Vec<(&'static str, String)>,
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
        // The only one there is may have another name.
        let found = found.or_else(|| match entities.as_slice() {
            [only] if ego.is_none() && listed.len() == 1 && only.body.has_more_than_two_wheels() => {
                source.note(format!("`{}`, the only one there is, is taken for the ego vehicle", only.name));
                Some(0)
            }
            _ => None,
        });
        let Some(at) = found else {
            let mut torn = listed.iter().filter(|name| source.is_torn(name));
            if torn.any(|name| is_ego(name) || entities.is_empty()) {
                return None;
            }
            let names: Vec<String> = entities.iter().map(|entity| format!("`{}`", entity.name)).collect();
            source.refuse_if(names.is_empty(), root, "no entity can be read")?;
            let reason = match ego {
                Some(ego) => format!("no entity is called `{ego}`: there are {}", names.join(", ")),
                None => {
                    format!("which entity is the ego vehicle? Name it with `--ego`: {}", names.join(", "))
                }
            };
            return source.refuse(root, reason);
        };
        let ego = entities.remove(at);
        let (gone, never, changes) = (BTreeSet::new(), Vec::new(), Vec::new());
        Some(Cast { ego, others: entities, ego_actions: 0, changes, gone, never })
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
            let begun = source.about(&name, |source| act(source, action, &name, is_ego));
            let entity = if is_ego { Some(&mut self.ego) } else { self.other(&name) };
            if let (Some(begun), Some(entity)) = (begun, entity) {
                entity.begin(begun);
            }
        }
    }

    fn act(&mut self, source: &mut Source, act: Node) {
        let mut begins = None;
        let before: Vec<usize> = self.others.iter().map(|entity| entity.events.len()).collect();
        for group in elements(act, "ManeuverGroup") {
            if !is_carried_out(source, group) {
                continue;
            }
            let Some(actors) = element(group, "Actors") else { continue };
            if source.switch(actors, "selectTriggeringEntities", false) != Some(false) {
                source.refuse::<()>(actors, "who acts is named: those that a condition selects are not read");
                continue;
            }
            let mut names = Vec::new();
            for actor in elements(actors, "EntityRef") {
                let Some(name) = source.text(actor, "entityRef") else { continue };
                if self.knows(source, actor, &name) {
                    names.push(name);
                }
            }
            // An actor that was named and is not known has been reported already.
            if names.is_empty() && element(actors, "EntityRef").is_some() {
                continue;
            }
            let scope = Scope { act, group, names: &names };
            for part in children(group) {
                match part.tag_name().name() {
                    "Maneuver" => {
                        source.declare(part);
                        self.manoeuvre(source, &scope, part, &mut begins);
                    }
                    "CatalogReference" => {
                        catalogue::entry(source, part, &[catalogue::MANOEUVRE], |source, manoeuvre| {
                            self.manoeuvre(source, &scope, manoeuvre, &mut begins);
                            Some(())
                        });
                    }
                    _ => {}
                }
            }
        }
        let Some(stop) = element(act, "StopTrigger").filter(|stop| children(*stop).next().is_some()) else {
            return;
        };
        if self.others.iter().zip(&before).all(|(entity, from)| entity.events.len() == *from) {
            return;
        }
        // A trigger that never comes stops nothing.
        let Some(when) = conditions(source, stop).and_then(reduced) else { return };
        let stop = Rc::new((source.mark(stop), when));
        for (entity, from) in self.others.iter_mut().zip(before) {
            entity.events[from..].iter_mut().for_each(|event| event.stop = Some(Rc::clone(&stop)));
        }
    }

    fn manoeuvre(
        &mut self,
        source: &mut Source,
        scope: &Scope,
        manoeuvre: Node,
        begins: &mut Option<Option<Trigger>>,
    ) {
        let has_several = elements(manoeuvre, "Event").nth(1).is_some();
        for event in elements(manoeuvre, "Event") {
            if !is_carried_out(source, event) {
                continue;
            }
            let priority = source.word(event, "priority", &["override", "overwrite", "parallel", "skip"]);
            if has_several && priority == Some("skip") {
                source.refuse::<()>(
                    event,
                    "what is skipped while another event of its manoeuvre goes on is not read",
                );
            }
            let actions: Vec<Node> = elements(event, "Action").flat_map(children).collect();
            let own: Vec<&String> = scope.names.iter().filter(|name| !self.is_ego(name)).collect();
            let (private, global): (Vec<Node>, Vec<Node>) =
                actions.iter().partition(|action| action.has_tag_name("PrivateAction"));
            if own.is_empty() {
                if scope.names.is_empty() && !private.is_empty() {
                    source.refuse::<()>(event, "no road user is named that acts");
                }
                self.ego_actions += private.len();
            }
            let does = if own.is_empty() { Vec::new() } else { private };
            let changes: Vec<Node> =
                global.into_iter().filter(|action| changes_the_world(source, *action)).collect();
            if does.is_empty() && changes.is_empty() {
                continue;
            }
            let begins = begins.get_or_insert_with(|| of_act(source, scope.act)).clone();
            // Errors of an action are reported even where its trigger is refused.
            let when = trigger(source, event).zip(begins).and_then(|(own, act)| {
                let reason =
                    format!("with those of its act it has more than {GROUPS_MAX} groups of conditions");
                source.refuse_if(own.len() * act.len() > GROUPS_MAX, event, reason)?;
                Some(both(&act, &own))
            });
            if when.is_none() {
                own.iter().for_each(|name| source.tear(name));
            }
            let when = when.map(|when| self.without_contacts(source, when, &own)).map(reduced);
            let names = scope.names_of(source, manoeuvre, event);
            // It never comes.
            if matches!(when, Some(None)) {
                self.never.extend(names);
                continue;
            }
            for action in changes {
                self.change(source, action, when.as_ref().and_then(Option::as_ref));
            }
            for name in own {
                let acts: Vec<Act> = does
                    .iter()
                    .flat_map(|action| children(*action))
                    .filter_map(|action| source.about(name, |source| act(source, action, name, false)))
                    .collect();
                let mark = source.mark(event);
                if let (Some(Some(when)), Some(entity)) = (&when, self.other(name)) {
                    let reason = format!("more than {PHASES_MAX} events of one entity");
                    if entity.events.len() >= PHASES_MAX {
                        source.refuse::<()>(event, reason);
                        return;
                    }
                    let times = executions(source, event) * executions(source, scope.group);
                    let overwrites = matches!(priority, Some("override" | "overwrite"));
                    let (names, when) = (names.clone(), when.clone());
                    let event = Event { mark, names, when, acts, overwrites, comes_again: false, stop: None };
                    entity.repeat(source, event, times);
                }
            }
        }
    }

    /// Whether it waits for something that never comes.
    fn never_comes(&self, kind: &When) -> bool {
        let (When::Ended { kind, name } | When::Begun { kind, name }) = kind else { return false };
        let last = name.rsplit("::").next();
        self.never.iter().any(|(of, known)| of == kind && Some(known.as_str()) == last)
    }

    /// A trigger in which a contact of the acting entity never comes, nor what waits for that: a contact ends what both
    /// do.
    fn without_contacts(&self, source: &mut Source, mut when: Trigger, own: &[&String]) -> Trigger {
        for condition in when.iter_mut().flatten() {
            let is_over = match &condition.kind {
                When::Contact(Some((of, with))) => {
                    !own.is_empty() && own.iter().all(|name| [of, with].contains(name))
                }
                // The elements around it have begun all the same.
                When::Begun { kind: "event" | "action", .. } | When::Ended { .. } => {
                    self.never_comes(&condition.kind)
                }
                _ => false,
            };
            if matches!(condition.kind, When::Contact(_)) && is_over {
                source
                    .note("what a road user does after a contact is not played: a contact ends what both do");
            }
            if is_over {
                condition.kind = When::Never;
            }
        }
        when
    }

    /// An action of the story that moves no entity.
    fn change(&mut self, source: &mut Source, action: Node, when: Option<&Trigger>) {
        let inner = children(action).next().unwrap_or(action);
        if inner.has_tag_name("EnvironmentAction") {
            let mark = source.mark(inner);
            if let (Some(weather), Some(when)) = (weather(source, action), when) {
                let Some(at_s) = time_s(when) else {
                    source.refuse::<()>(&mark, "a sky that changes at a time is read, not with what happens");
                    return;
                };
                if !Sky::can_change_at(at_s) {
                    source.note("the sky changes at whole tenths of a second");
                }
                self.changes.push(Change { mark, at_s, weather });
            }
            return;
        }
        let is_at_once = |when: &Trigger| {
            when.is_empty()
                || when.iter().any(|all| all.iter().all(|one| one.time_s().is_some_and(|at_s| at_s <= 0.1)))
        };
        if !inner.has_tag_name("EntityAction") || element(inner, "DeleteEntityAction").is_none() {
            source.refuse::<()>(inner, "this action is not read in the story");
            return;
        }
        let Some(name) = source.text(inner, "entityRef") else { return };
        if !when.is_some_and(is_at_once) {
            source.refuse::<()>(inner, "no road user leaves during the story");
        } else if self.knows(source, inner, &name) {
            self.gone.insert(name);
        }
    }
}

/// Where an event stands.
struct Scope<'a, 'input> {
    act: Node<'a, 'input>,
    group: Node<'a, 'input>,
    names: &'a [String],
}

impl Scope<'_, '_> {
    fn names_of(&self, source: &Source, manoeuvre: Node, event: Node) -> Vec<(&'static str, String)> {
        let outer =
            [("act", self.act), ("maneuverGroup", self.group), ("maneuver", manoeuvre), ("event", event)];
        let actions = elements(event, "Action").map(|action| ("action", action)).collect::<Vec<_>>();
        let all = outer.into_iter().chain(actions);
        // A name that is no text is left out: nothing refers to it.
        let named = |node: Node| super::source::filled(node.attribute("name")?, source.parameters()).ok();
        all.filter_map(|(kind, node)| Some((kind, named(node)?))).collect()
    }
}

impl Entity {
    /// Adds an event that is executed `times` times. A condition that holds from a time on holds again as soon as the
    /// event has ended.
    fn repeat(&mut self, source: &mut Source, event: Event, times: f64) {
        let conditions = || event.when.iter().flatten();
        let is_time =
            |one: &Condition| matches!(one.kind, When::Always | When::After(_) | When::Ended { .. });
        let holds_on = conditions().all(|one| is_time(one) && one.edge == Edge::None);
        let comes_once =
            event.when.iter().any(|all| all.iter().any(|one| is_time(one) && one.edge == Edge::Rising))
                && event.when.len() == 1;
        if times < 2.0 || comes_once || event.acts.is_empty() {
            self.events.push(event);
            return;
        }
        if event.acts.iter().all(Act::is_idempotent) {
            source.note(
                "what a file lets happen several times happens once, where its goal is the same each time",
            );
            self.events.push(Event { comes_again: true, ..event });
            return;
        }
        if !holds_on {
            let reason = "it happens again whenever its conditions hold again, which is read of times alone: \
                          `maximumExecutionCount=\"1\"` is read";
            source.refuse::<()>(&event.mark, reason);
            return;
        }
        if self.events.len() as f64 + times > PHASES_MAX as f64 {
            source.refuse::<()>(
                &event.mark,
                format!("with it happening again, more than {PHASES_MAX} events of one entity"),
            );
            return;
        }
        let mut when = event.when.clone();
        for nth in 1..=times as usize {
            let mut one = Event { when, ..event.clone() };
            let name = format!("{} ×{nth}", event.name());
            let (mark, kind) = (event.mark.clone(), When::Ended { kind: "event", name: name.clone() });
            when = vec![vec![Condition {
                mark,
                edge: Edge::None,
                delay_s: 0.0,
                kind,
                is_of_act: false,
                is_running: false,
            }]];
            one.names.push(("event", name));
            self.events.push(one);
        }
    }

    /// Takes over an action from the beginning.
    fn begin(&mut self, begun: Act) {
        let Act { mark, kind } = begun;
        match kind {
            ActKind::Placed(position) => self.position = Some(position),
            ActKind::Ahead(of, headway) => self.headway = Some((mark, of, headway)),
            ActKind::Speed(speed, dynamics) => {
                let is_at_once = matches!(dynamics.over, Over::AtOnce) && !dynamics.is_continuous;
                if is_at_once || self.speed.is_none() && matches!(speed, Speed::Absolute(0.0)) {
                    self.speed = Some((mark, speed));
                } else {
                    self.events.push(Event::of_init(mark, ActKind::Speed(speed, dynamics)));
                }
            }
            ActKind::Follow(way) => self.way = Some(*way),
            ActKind::Route(places) => self.route = Some((mark, places)),
            ActKind::Profile(_)
            | ActKind::Lane(..)
            | ActKind::Offset(..)
            | ActKind::Meet(_)
            | ActKind::Keep(_) => {
                self.events.push(Event::of_init(mark, kind));
            }
        }
    }
}

fn entities(source: &mut Source, root: Node) -> Vec<Entity> {
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
        let Some(body) = source.about(&name, |source| body(source, node)) else { continue };
        if elements(node, "ObjectController").any(|controller| children(controller).next().is_some()) {
            source.controlled.insert(name.clone());
        }
        found.push(Entity {
            name,
            mark: source.mark(node),
            body,
            position: None,
            speed: None,
            headway: None,
            way: None,
            route: None,
            events: Vec::new(),
        });
    }
    found
}

/// Whether a global action changes what others meet; those of the player and of variables do not.
fn changes_the_world(source: &mut Source, action: Node) -> bool {
    if action.has_tag_name("UserDefinedAction") {
        user_defined(source, action);
        return false;
    }
    let inner = children(action).next().unwrap_or(action);
    match inner.tag_name().name() {
        "VariableAction" => {
            if let Some(name) = source.named(inner, "variableRef") {
                source.variables.insert(name, None);
            }
            false
        }
        "InfrastructureAction" => {
            signals(source);
            false
        }
        _ => true,
    }
}

fn is_signal(action: Node) -> bool {
    children(action).next().is_some_and(|inner| inner.has_tag_name("InfrastructureAction"))
}

fn signals(source: &mut Source) {
    source.note("traffic lights follow the map's controllers, not the phases of the file");
}

fn user_defined(source: &mut Source, action: Node) {
    match action.tag_name().name() {
        "UserDefinedAction" => source.note("commands for the player of the file are not taken over"),
        _ => {
            source.refuse::<()>(children(action).next().unwrap_or(action), "this action is not read");
        }
    }
}

/// The trigger of an act.
fn of_act(source: &mut Source, act: Node) -> Option<Trigger> {
    let mut begins = trigger(source, act)?;
    begins.iter_mut().flatten().for_each(|condition| condition.is_of_act = true);
    Some(begins)
}

/// Whether something is carried out at all.
fn is_carried_out(source: &mut Source, node: Node) -> bool {
    let reason = "`maximumExecutionCount` is less than 1: leave out what never happens";
    let count = source.number_or(node, "maximumExecutionCount", 1.0);
    count.and_then(|count| source.refuse_if(count < 1.0, node, reason)).is_some()
}

/// How often something is carried out at most.
fn executions(source: &mut Source, node: Node) -> f64 {
    source.number_or(node, "maximumExecutionCount", 1.0).unwrap_or(1.0)
}

/// When the scenario ends. It ends at the first of the times that its stop trigger names, each with what must come beside
/// it, or when the ego vehicle can have gone as far as the trigger names.
fn duration_s(source: &mut Source, storyboard: Node, ego: &str, ego_mps: f64) -> f64 {
    let trigger = element(storyboard, "StopTrigger");
    let (mut latest_s, mut surely_s): (f64, f64) = (0.0, f64::INFINITY);
    for group in trigger.iter().flat_map(|trigger| elements(*trigger, "ConditionGroup")) {
        let (mut group_s, mut is_known): (f64, bool) = (0.0, true);
        for condition in elements(group, "Condition") {
            let delay_s = source.number_or(condition, "delay", 0.0).unwrap_or(0.0);
            let own_s = ends_s(source, condition, ego, ego_mps);
            group_s = group_s.max(own_s.map_or(0.0, |(own_s, _)| own_s + delay_s));
            is_known &= own_s.is_some_and(|(_, is_known)| is_known);
        }
        latest_s = latest_s.max(group_s);
        if is_known && group_s > 0.0 {
            surely_s = surely_s.min(group_s);
        }
    }
    let latest_s = latest_s.min(surely_s);
    if latest_s <= 0.0 {
        source.note(format!("the file names no time above 0 for its end: {DURATION_S} s are played"));
        return DURATION_S;
    }
    if latest_s > DURATION_S_MAX {
        source.note(format!("{DURATION_S_MAX} s are played of the file's {latest_s:.0}"));
    }
    latest_s.min(DURATION_S_MAX)
}

/// When a condition of the stop trigger comes, s, and whether that is known for certain.
fn ends_s(source: &mut Source, condition: Node, ego: &str, ego_mps: f64) -> Option<(f64, bool)> {
    let named = |name: &str| condition.descendants().find(|node| node.has_tag_name(name));
    if let Some(node) = named("SimulationTimeCondition") {
        return (!is_less(source, node)?).then_some((source.number(node, "value")?, true));
    }
    let node = named("TraveledDistanceCondition").filter(|_| ego_mps > 0.0)?;
    let by = named("ByEntityCondition")?;
    let mut refs = by.descendants().filter(|node| node.has_tag_name("EntityRef"));
    let is_of_ego = refs.any(|node| node.attribute("entityRef") == Some(ego));
    let way_m = source.number(node, "value").filter(|_| is_of_ego)?;
    // Half as long again, for one that slows down, and some seconds to come to a stop.
    Some((1.5 * way_m / ego_mps + 5.0, false))
}
