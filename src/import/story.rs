//! What an OpenSCENARIO file says, as far as it can be imported, without its map: who is there, where, how fast, and what the
//! others do when.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

use super::Files;
use super::source::{Mark, Source, children, element, elements, filled};

/// How long a scenario is played that names no time for its end, s.
const DURATION_S: f64 = 60.0;

/// The longest step of an episode, s: a scenario is one step.
const DURATION_S_MAX: f64 = 600.0;

/// Conditions of a trigger. An act's and an event's are multiplied.
const CONDITIONS_MAX: usize = 16;

/// Weather that is farther to be seen through, m, and rougher than this is clear and dry.
const CLEAR_M: f64 = 1000.0;
const DRY_FRICTION: f64 = 0.9;

/// A file's scenario.
#[derive(Debug)]
pub struct Story {
    /// The map as the file names it, and where.
    pub map: (Mark, String),
    pub ego: Entity,
    pub others: Vec<Entity>,
    /// The engine's word for the time of day.
    pub time: Option<&'static str>,
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

/// The body that the engine has for it, and its own size.
#[derive(Debug, Clone)]
pub struct Shape {
    pub like: &'static str,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// From the reference point, a vehicle's rear axle, to the middle.
    pub middle_m: f64,
}

#[derive(Debug, Clone)]
pub enum Position {
    Lane { road: String, lane: i32, s_m: f64, offset_m: f64, turned: bool },
    RelativeLane { entity: String, lanes: i32, ahead_m: f64, offset_m: f64 },
    World { x_m: f64, y_m: f64, heading_rad: f64 },
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
pub enum Speed {
    Absolute(f64),
    /// More than another entity's, m/s.
    More(String, f64),
    /// Times another entity's.
    Times(String, f64),
}

/// The free space ahead of the ego vehicle.
#[derive(Debug)]
pub enum Headway {
    Way(f64),
    /// At the ego vehicle's speed, s.
    Time(f64),
}

#[derive(Debug)]
pub struct Change {
    pub mark: Mark,
    pub to: Target,
    pub when: Trigger,
}

#[derive(Debug)]
pub enum Target {
    Lane(i32),
    /// So many lanes to the left of an entity's.
    Beside(String, i32),
}

#[derive(Debug)]
pub struct Walk {
    pub mark: Mark,
    pub begin: Position,
    pub end: Position,
    /// From the first vertex to the last, if they have times.
    pub duration_s: Option<f64>,
}

/// Groups, of which one must hold; in a group all conditions must.
pub type Trigger = Vec<Vec<Condition>>;

#[derive(Debug, Clone)]
pub struct Condition {
    pub mark: Mark,
    pub kind: When,
}

#[derive(Debug, Clone)]
pub enum When {
    /// It holds from the beginning.
    Always,
    /// After so many seconds.
    After(f64),
    /// The distance of two entities is less or more than so many seconds of the first one's speed.
    Headway { pair: Pair, seconds: f64 },
    /// It is less or more than so many metres.
    Distance { pair: Pair, metres: f64 },
    /// The first would reach the second in less than so many seconds.
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

/// Reads a file. What cannot be said is refused; `None` if that is so much that nothing can be placed.
pub fn read(source: &mut Source, document: &Document, ego: Option<&str>, files: &dyn Files) -> Option<Story> {
    let root = document.root_element();
    if !root.has_tag_name("OpenSCENARIO") {
        return source.refuse(root, "the root element of a scenario is `OpenSCENARIO`");
    }
    let header = required(source, root, "FileHeader")?;
    if source.integer(header, "revMajor")? != 1 {
        return source.refuse(header, "OpenSCENARIO XML of version 1 is read");
    }
    if let Some(other) = children(root)
        .find(|child| matches!(child.tag_name().name(), "Catalog" | "ParameterValueDistribution"))
    {
        return source.refuse(other, "this is no scenario; give the file of one that uses it");
    }
    source.declare(root);
    let network = required(source, root, "RoadNetwork")?;
    let logic = required(source, network, "LogicFile")?;
    let map = (source.mark(logic), source.text(logic, "filepath")?);
    if element(network, "TrafficSignals").is_some() {
        source.note("traffic lights follow the map's controllers, not the phases of the file");
    }
    let entities = entities(source, root, files);
    let mut cast = Cast::of(source, root, entities, ego)?;
    let storyboard = required(source, root, "Storyboard")?;
    let mut time = None;
    if let Some(init) = element(storyboard, "Init") {
        for actions in elements(init, "Actions") {
            for action in children(actions) {
                match action.tag_name().name() {
                    "Private" => cast.start(source, action),
                    "GlobalAction" => time = environment(source, action).or(time),
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
    source.refuse_unknown(root);
    if cast.ego_actions > 0 {
        let note = "what the story lets the ego vehicle do is left to the driving system under test";
        source.note(format!("{note} (actions of the file: {})", cast.ego_actions));
    }
    let duration_s = duration_s(source, storyboard);
    let description = header.attribute("description").unwrap_or("").to_owned();
    Some(Story { map, ego: cast.ego, others: cast.others, time, duration_s, description })
}

/// The entities and what is known of them so far.
struct Cast {
    ego: Entity,
    others: Vec<Entity>,
    ego_actions: usize,
}

impl Cast {
    fn of(source: &mut Source, root: Node, mut entities: Vec<Entity>, ego: Option<&str>) -> Option<Cast> {
        let is_ego = |entity: &Entity| match ego {
            Some(name) => entity.name == name,
            None => {
                matches!(entity.name.to_lowercase().as_str(), "ego" | "hero" | "egovehicle" | "ego_vehicle")
            }
        };
        let found = entities.iter().position(is_ego);
        let found = found.or((ego.is_none() && entities.len() == 1).then_some(0));
        let Some(at) = found else {
            let names: Vec<String> = entities.iter().map(|entity| format!("`{}`", entity.name)).collect();
            if names.is_empty() {
                return source.refuse(root, "no entity can be read");
            }
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

    /// Actions of an entity at the beginning.
    fn start(&mut self, source: &mut Source, private: Node) {
        let Some(name) = source.text(private, "entityRef") else { return };
        let is_ego = self.is_ego(&name);
        if !is_ego && self.other(&name).is_none() {
            return;
        }
        for action in elements(private, "PrivateAction").flat_map(children) {
            let distance = action.descendants().find(|node| node.has_tag_name("LongitudinalDistanceAction"));
            if let Some(distance) = distance.filter(|_| !is_ego)
                && source.text(distance, "entityRef").is_some_and(|of| !self.is_ego(&of))
            {
                source.refuse::<()>(distance, "only a distance to the ego vehicle is read");
                continue;
            }
            let begun = begun(source, action, is_ego);
            let entity = if is_ego { Some(&mut self.ego) } else { self.other(&name) };
            if let (Some(begun), Some(entity)) = (begun, entity) {
                entity.begin(begun, Vec::new());
            }
        }
    }

    fn act(&mut self, source: &mut Source, act: Node) {
        let mut begins = None;
        for group in elements(act, "ManeuverGroup") {
            if let Some(catalogue) = element(group, "CatalogReference") {
                source.refuse::<()>(catalogue, "manoeuvres of catalogues are not read");
            }
            let Some(actors) = element(group, "Actors") else { continue };
            let mut names = Vec::new();
            for actor in elements(actors, "EntityRef") {
                let Some(name) = source.text(actor, "entityRef") else { continue };
                if !self.is_ego(&name) && self.other(&name).is_none() {
                    source.refuse::<()>(actor, format!("no entity is called `{name}`"));
                    continue;
                }
                names.push(name);
            }
            if names.is_empty() {
                source.refuse::<()>(actors, "it names nobody who acts");
                continue;
            }
            for manoeuvre in elements(group, "Maneuver") {
                source.declare(manoeuvre);
                for event in elements(manoeuvre, "Event") {
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
        for action in actions {
            if !action.has_tag_name("PrivateAction") {
                user_defined(source, *action);
                continue;
            }
            for act in children(*action) {
                let begun = begun(source, act, false);
                let is_placing = matches!(begun, Some(Begun::Placed(..) | Begun::Headway(..)));
                if is_placing {
                    source.refuse::<()>(act, "nothing is placed anew in the story");
                    continue;
                }
                for name in actors {
                    let again = begin_again(&begun);
                    if let (Some(begun), Some(when), Some(entity)) = (again, &when, self.other(name)) {
                        entity.begin(begun, when.clone());
                    }
                }
            }
        }
    }
}

/// An action as it was read.
enum Begun {
    Placed(Mark, Position),
    Speed(Mark, Speed, bool),
    Headway(Mark, Headway),
    Change(Mark, Target),
    Walk(Walk),
    Goal(Mark, Position),
}

/// A copy for the next actor of an event.
fn begin_again(begun: &Option<Begun>) -> Option<Begun> {
    Some(match begun.as_ref()? {
        Begun::Speed(mark, speed, at_once) => {
            let speed = match speed {
                Speed::Absolute(mps) => Speed::Absolute(*mps),
                Speed::More(entity, mps) => Speed::More(entity.clone(), *mps),
                Speed::Times(entity, factor) => Speed::Times(entity.clone(), *factor),
            };
            Begun::Speed(mark.clone(), speed, *at_once)
        }
        Begun::Change(mark, Target::Lane(lane)) => Begun::Change(mark.clone(), Target::Lane(*lane)),
        Begun::Change(mark, Target::Beside(entity, lanes)) => {
            Begun::Change(mark.clone(), Target::Beside(entity.clone(), *lanes))
        }
        Begun::Walk(walk) => Begun::Walk(Walk {
            mark: walk.mark.clone(),
            begin: walk.begin.clone(),
            end: walk.end.clone(),
            duration_s: walk.duration_s,
        }),
        Begun::Placed(..) | Begun::Headway(..) | Begun::Goal(..) => return None,
    })
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

/// What an action within a `PrivateAction` begins; `None` if nothing that matters, or it is refused.
fn begun(source: &mut Source, action: Node, is_ego: bool) -> Option<Begun> {
    let mark = source.mark(action);
    match action.tag_name().name() {
        "TeleportAction" => {
            let place = required(source, action, "Position")?;
            Some(Begun::Placed(mark, position(source, place)?))
        }
        "LongitudinalAction" | "LateralAction" | "RoutingAction" => {
            let inner = children(action).next()?;
            moved(source, inner, is_ego)
        }
        "ControllerAction" | "ActivateControllerAction" | "AssignControllerAction" => {
            if !is_ego && drives(action) {
                return source.refuse(
                    action,
                    "a controller of the player's drives it, of which the file says no more",
                );
            }
            None
        }
        "VisibilityAction" => {
            if ["graphics", "sensors", "traffic"]
                .into_iter()
                .any(|name| action.attribute(name) == Some("false"))
            {
                return source.refuse(action, "all road users can be seen");
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
fn drives(action: Node) -> bool {
    action.descendants().filter(|node| node.has_tag_name("ActivateControllerAction")).any(|activated| {
        ["longitudinal", "lateral"].into_iter().any(|name| activated.attribute(name) != Some("false"))
    })
}

fn moved(source: &mut Source, action: Node, is_ego: bool) -> Option<Begun> {
    let mark = source.mark(action);
    match action.tag_name().name() {
        "SpeedAction" => {
            let dynamics = required(source, action, "SpeedActionDynamics")?;
            let is_step = dynamics.attribute("dynamicsShape") == Some("step");
            let at_once = is_step
                || (dynamics.attribute("dynamicsDimension") == Some("time")
                    && source.number(dynamics, "value")? == 0.0);
            let target = required(source, action, "SpeedActionTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetSpeed") {
                let mps = source.number(absolute, "value")?;
                return Some(Begun::Speed(mark, Speed::Absolute(mps), at_once));
            }
            let relative = required(source, target, "RelativeTargetSpeed")?;
            let (entity, value) = (source.text(relative, "entityRef")?, source.number(relative, "value")?);
            if relative.attribute("continuous") == Some("true") {
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
            if action.attribute("continuous") == Some("true") {
                return source.refuse(action, "a vehicle keeps its speed, not its distance");
            }
            if action.attribute("freespace") != Some("true") {
                return source.refuse(action, "only `freespace=\"true\"` is read: between the bumpers");
            }
            let headway = match action.attribute("timeGap") {
                Some(_) => Headway::Time(source.number(action, "timeGap")?),
                None => Headway::Way(source.number(action, "distance")?),
            };
            Some(Begun::Headway(mark, headway))
        }
        "LaneChangeAction" => {
            source.note(
                "a lane change takes as long as the engine's drivers need, and waits until the lane is free",
            );
            let target = required(source, action, "LaneChangeTarget")?;
            if let Some(absolute) = element(target, "AbsoluteTargetLane") {
                return Some(Begun::Change(mark, Target::Lane(source.integer(absolute, "value")?)));
            }
            let relative = required(source, target, "RelativeTargetLane")?;
            let (entity, lanes) = (source.text(relative, "entityRef")?, source.integer(relative, "value")?);
            Some(Begun::Change(mark, Target::Beside(entity, lanes)))
        }
        "FollowTrajectoryAction" => walk(source, action).map(Begun::Walk),
        "AssignRouteAction" if is_ego => {
            let last = action.descendants().rfind(|node| node.has_tag_name("Waypoint"));
            let place = last.and_then(|waypoint| element(waypoint, "Position"));
            let Some(place) = place else {
                return source.refuse(action, "it has no waypoint with a position");
            };
            Some(Begun::Goal(mark, position(source, place)?))
        }
        "AcquirePositionAction" if is_ego => {
            let place = required(source, action, "Position")?;
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
    let trajectory = action.descendants().find(|node| node.has_tag_name("Polyline"));
    let Some(polyline) = trajectory else {
        return source.refuse(action, "a pedestrian walks straight across the road: a `Polyline` is read");
    };
    let vertices: Vec<Node> = elements(polyline, "Vertex").collect();
    let (Some(first), Some(last)) = (vertices.first(), vertices.last()) else {
        return source.refuse(polyline, "it has no vertices");
    };
    let (from, to) = (required(source, *first, "Position")?, required(source, *last, "Position")?);
    let times = (source.number_or(*first, "time", 0.0)?, source.number_or(*last, "time", 0.0)?);
    let duration_s = (times.1 > times.0).then_some(times.1 - times.0);
    Some(Walk { mark, begin: position(source, from)?, end: position(source, to)?, duration_s })
}

fn position(source: &mut Source, parent: Node) -> Option<Position> {
    let Some(place) = children(parent).next() else { return source.refuse(parent, "it is empty") };
    match place.tag_name().name() {
        "LanePosition" => {
            let (road, lane) = (source.text(place, "roadId")?, source.integer(place, "laneId")?);
            let (s_m, offset_m) = (source.number(place, "s")?, source.number_or(place, "offset", 0.0)?);
            Some(Position::Lane { road, lane, s_m, offset_m, turned: turned(source, place)? })
        }
        "RelativeLanePosition" => {
            let (entity, lanes) = (source.text(place, "entityRef")?, source.integer(place, "dLane")?);
            let along = if place.has_attribute("ds") { "ds" } else { "dsLane" };
            let ahead_m = source.number(place, along)?;
            if turned(source, place)? {
                return source.refuse(place, "nobody drives against its lane");
            }
            let offset_m = source.number_or(place, "offset", 0.0)?;
            Some(Position::RelativeLane { entity, lanes, ahead_m, offset_m })
        }
        "WorldPosition" => {
            let (x_m, y_m) = (source.number(place, "x")?, source.number(place, "y")?);
            Some(Position::World { x_m, y_m, heading_rad: source.number_or(place, "h", 0.0)? })
        }
        _ => source.refuse(place, "read are LanePosition, RelativeLanePosition and WorldPosition"),
    }
}

/// Whether an orientation points backwards along the road.
fn turned(source: &mut Source, place: Node) -> Option<bool> {
    let Some(orientation) = element(place, "Orientation") else { return Some(false) };
    let heading_rad = source.number_or(orientation, "h", 0.0)?;
    Some(orientation.attribute("type") != Some("absolute") && libm::cos(heading_rad) < 0.0)
}

fn entities(source: &mut Source, root: Node, files: &dyn Files) -> Vec<Entity> {
    let mut found = Vec::new();
    let Some(list) = required(source, root, "Entities") else { return found };
    for node in children(list) {
        if !node.has_tag_name("ScenarioObject") {
            source.refuse::<()>(node, "groups of entities are not read");
            continue;
        }
        let (Some(name), Some(body)) = (source.text(node, "name"), body(source, root, node, files)) else {
            continue;
        };
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

fn body(source: &mut Source, root: Node, object: Node, files: &dyn Files) -> Option<Shape> {
    if let Some(reference) = element(object, "CatalogReference") {
        return of_catalogue(source, root, reference, files);
    }
    let described = children(object).find(|node| is_described(*node));
    let Some(described) = described else {
        return source.refuse(object, "only vehicles and pedestrians are read");
    };
    shape(described).map_or_else(|reason| source.refuse(described, reason), Some)
}

fn is_described(node: Node) -> bool {
    matches!(node.tag_name().name(), "Vehicle" | "Pedestrian" | "MiscObject")
}

fn of_catalogue(source: &mut Source, root: Node, reference: Node, files: &dyn Files) -> Option<Shape> {
    let (catalogue, entry) = (source.text(reference, "catalogName")?, source.text(reference, "entryName")?);
    let locations: Vec<Node> = elements(root, "CatalogLocations").flat_map(children).collect();
    for location in locations {
        if !matches!(location.tag_name().name(), "VehicleCatalog" | "PedestrianCatalog") {
            continue;
        }
        let Some(directory) = element(location, "Directory") else { continue };
        let path = source.text(directory, "path")?;
        let texts = match files.catalogues(&path) {
            Ok(texts) => texts,
            Err(reason) => return source.refuse(directory, format!("`{path}`: {reason}")),
        };
        for text in &texts {
            let Ok(document) = crate::road::well_formed(text) else { continue };
            let is_named = |node: &Node, name: &str| node.attribute("name") == Some(name);
            let list = document.descendants().find(|node| node.has_tag_name("Catalog"));
            let Some(list) = list.filter(|node| is_named(node, &catalogue)) else { continue };
            let found = children(list).find(|node| is_described(*node) && is_named(node, &entry));
            if let Some(found) = found {
                return shape(found).map_or_else(
                    |reason| source.refuse(reference, format!("`{entry}` of `{catalogue}`: {reason}")),
                    Some,
                );
            }
        }
    }
    source.refuse(reference, format!("no vehicle or pedestrian `{entry}` in a catalogue `{catalogue}`"))
}

/// The body of a `Vehicle` or `Pedestrian`.
fn shape(node: Node) -> Result<Shape, String> {
    let category = |name: &str| node.attribute(name).unwrap_or("").to_owned();
    let like = match node.tag_name().name() {
        "Vehicle" => match category("vehicleCategory").as_str() {
            "car" => "Sedan",
            "van" => "SUV",
            "truck" => "BoxTruck",
            "bus" => "SchoolBus",
            "motorbike" => "Motorcycle",
            "bicycle" => "Bicycle",
            other => return Err(format!("no vehicle of the category `{other}` is known")),
        },
        "Pedestrian" => match category("pedestrianCategory").as_str() {
            "pedestrian" | "" => "Pedestrian",
            other => return Err(format!("no pedestrian of the category `{other}` is known")),
        },
        _ => return Err("only vehicles and pedestrians are read".to_owned()),
    };
    let bounds = element(node, "BoundingBox").ok_or("it has no `BoundingBox`")?;
    // An entry of a catalogue may have parameters of its own, with defaults.
    let declared = elements(node, "ParameterDeclarations").flat_map(children);
    let declared = declared.filter_map(|one| Some((one.attribute("name")?, one.attribute("value")?)));
    let mut parameters = BTreeMap::new();
    for (name, value) in declared {
        if let Ok(value) = filled(value, &parameters) {
            parameters.insert(name.to_owned(), value);
        }
    }
    let number = |name: &'static str, attribute: &str| {
        let found = element(bounds, name).and_then(|node| node.attribute(attribute));
        let found = found.and_then(|text| filled(text, &parameters).ok());
        let value =
            found.and_then(|text| text.trim().parse::<f64>().ok()).filter(|value| value.abs() < 1000.0);
        value.ok_or_else(|| format!("`{attribute}` of its `{name}` is no number"))
    };
    Ok(Shape {
        like,
        length_m: number("Dimensions", "length")?,
        width_m: number("Dimensions", "width")?,
        height_m: number("Dimensions", "height")?,
        middle_m: number("Center", "x")?,
    })
}

/// The time of day of an `EnvironmentAction`; weather is refused unless it is dry and clear.
fn environment(source: &mut Source, global: Node) -> Option<&'static str> {
    let action = children(global).next()?;
    if !action.has_tag_name("EnvironmentAction") {
        return source.refuse(action, "this action is not read");
    }
    let Some(environment) = element(action, "Environment") else {
        return source.refuse(action, "environments of catalogues are not read");
    };
    for node in environment.descendants() {
        let is_dry = match node.tag_name().name() {
            "Precipitation" => node.attribute("precipitationType").is_none_or(|kind| kind == "dry"),
            "Fog" if node.has_attribute("visualRange") => source.number(node, "visualRange")? >= CLEAR_M,
            "RoadCondition" if node.has_attribute("frictionScaleFactor") => {
                source.number(node, "frictionScaleFactor")? >= DRY_FRICTION
            }
            _ => true,
        };
        if !is_dry {
            source.refuse::<()>(node, "weather is not taken over: only dry and clear environments are read");
        }
    }
    let time = element(environment, "TimeOfDay")?;
    let text = source.text(time, "dateTime")?;
    let hour = text.split_once('T').and_then(|(_, clock)| clock.get(..2)?.parse::<u32>().ok());
    match hour {
        Some(6..=11) => Some("Morning"),
        Some(12..=17) => Some("Noon"),
        Some(0..=23) => Some("Night"),
        _ => source.refuse(time, format!("`{text}` is no date and time")),
    }
}

fn user_defined(source: &mut Source, action: Node) {
    match action.tag_name().name() {
        "UserDefinedAction" => source.note("commands for the player of the file are not taken over"),
        _ => {
            source.refuse::<()>(children(action).next().unwrap_or(action), "this action is not read");
        }
    }
}

/// The conditions of a start trigger; without one it holds at once. `None` if one is refused.
fn trigger(source: &mut Source, parent: Node) -> Option<Trigger> {
    let Some(trigger) = element(parent, "StartTrigger") else { return Some(Vec::new()) };
    if trigger.descendants().filter(|node| node.has_tag_name("Condition")).count() > CONDITIONS_MAX {
        return source.refuse(trigger, format!("it has more than {CONDITIONS_MAX} conditions"));
    }
    let mut groups = Some(Vec::new());
    for group in elements(trigger, "ConditionGroup") {
        let mut all = Some(Vec::new());
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
fn both(a: &Trigger, b: &Trigger) -> Trigger {
    if a.is_empty() || b.is_empty() {
        return a.iter().chain(b).cloned().collect();
    }
    a.iter().flat_map(|a| b.iter().map(move |b| a.iter().chain(b).cloned().collect())).collect()
}

fn condition(source: &mut Source, node: Node) -> Option<Condition> {
    let delay_s = source.number_or(node, "delay", 0.0)?;
    if node.attribute("conditionEdge") == Some("falling") {
        return source.refuse(node, "only what begins to hold is read, not what ends");
    }
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
                let of = source.text(inner, "storyboardElementType")?;
                let state = source.text(inner, "state")?;
                let begins = matches!(state.as_str(), "startTransition" | "runningState");
                if !(begins && matches!(of.as_str(), "act" | "story")) || delay_s > 0.0 {
                    let reason = "an event does not wait for another: what ends when is up to the drivers";
                    return source.refuse(inner, reason);
                }
                When::Always
            }
            _ => return source.refuse(inner, "this condition is not read"),
        };
        return Some(Condition { mark: source.mark(inner), kind });
    }
    let by_entity = required(source, node, "ByEntityCondition")?;
    let list = required(source, by_entity, "TriggeringEntities")?;
    let mut names = Vec::new();
    for entity in elements(list, "EntityRef") {
        names.push(source.text(entity, "entityRef")?);
    }
    let outer = required(source, by_entity, "EntityCondition")?;
    let Some(inner) = children(outer).next() else { return source.refuse(outer, "it is empty") };
    let [of] = names.as_slice() else {
        return source.refuse(list, "a condition asks about one entity");
    };
    if delay_s > 0.0 {
        return source.refuse(node, "a delay is read of times alone");
    }
    let kind = match inner.tag_name().name() {
        "TimeHeadwayCondition" => {
            When::Headway { pair: pair(source, inner, of)?, seconds: source.number(inner, "value")? }
        }
        "RelativeDistanceCondition" => {
            if inner.attribute("relativeDistanceType") == Some("lateral") {
                return source.refuse(inner, "lateral distances are not read");
            }
            When::Distance { pair: pair(source, inner, of)?, metres: source.number(inner, "value")? }
        }
        "TimeToCollisionCondition" => {
            let target =
                element(inner, "TimeToCollisionConditionTarget").and_then(|node| element(node, "EntityRef"));
            let Some(target) = target else { return source.refuse(inner, "the target is an entity") };
            let to = source.text(target, "entityRef")?;
            let is_less = is_less(source, inner)?;
            let is_free_space = inner.attribute("freespace") == Some("true");
            let pair = Pair { of: of.clone(), to, is_less, is_free_space };
            if !is_less {
                return source.refuse(inner, "only `lessThan` is read");
            }
            When::Collides { pair, seconds: source.number(inner, "value")? }
        }
        "ReachPositionCondition" => {
            let place = required(source, inner, "Position")?;
            let within_m = source.number(inner, "tolerance")?;
            When::Reaches { entity: of.clone(), position: position(source, place)?, within_m }
        }
        _ => return source.refuse(inner, "this condition is not read"),
    };
    Some(Condition { mark: source.mark(inner), kind })
}

fn pair(source: &mut Source, node: Node, of: &str) -> Option<Pair> {
    let to = source.text(node, "entityRef")?;
    let is_free_space = node.attribute("freespace") == Some("true");
    Some(Pair { of: of.to_owned(), to, is_less: is_less(source, node)?, is_free_space })
}

fn is_less(source: &mut Source, node: Node) -> Option<bool> {
    match source.text(node, "rule")?.as_str() {
        "lessThan" | "lessOrEqual" => Some(true),
        "greaterThan" | "greaterOrEqual" => Some(false),
        other => source.refuse(node, format!("the rule `{other}` is not read: more or less is")),
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
        source.note(format!("the file names no time for its end: {DURATION_S} s are played"));
        return DURATION_S;
    }
    if latest_s > DURATION_S_MAX {
        source.note(format!("{DURATION_S_MAX} s are played of the file's {latest_s:.0}"));
    }
    latest_s.min(DURATION_S_MAX)
}

/// A child that must be there.
fn required<'a, 'input>(
    source: &mut Source,
    node: Node<'a, 'input>,
    name: &'static str,
) -> Option<Node<'a, 'input>> {
    let found = element(node, name);
    if found.is_none() {
        source.refuse::<()>(node, format!("it has no `{name}`"));
    }
    found
}
