//! A space as OpenSCENARIO: what each row of its table lets happen at the start, as a template and the values of its parameters.
//!
//! Each row on each road is laid out by itself: its road users appear in a world, and `story` writes down what they do. Rows whose files
//! differ in numbers alone share a `template`; what differs are its parameters, and a second file lists their values.
//!
//! Rows whose road users are led by avastra's drivers are left out: how these drive, no other player knows.

mod template;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use avastra_campaign::episode::{Recorder, Setup};
use avastra_campaign::run::Arena;
use avastra_lang::model::{Row, SPAWN_SPEED_MPS, Type};
use avastra_world::action::{Draw, Effect, Situation};
use avastra_world::sim::World;

use super::super::xml::{Element, number};
use super::actions::{lane_position, maneuver_group, speed, teleport};
use super::entity::entity;
use super::environment::environment;
use super::story::{Cast, Newcomer};
use super::{Ego, Version, destination, file_header, property, staged};
use template::Template;

/// The seed of drawn values: a file has one value of each.
const SEED: u64 = 0;

/// The fact of a file that holds the speed limit of the ego vehicle's road, m/s.
pub const SPEED_LIMIT: &str = "speed_limit";

/// Files of a space.
pub struct SpaceFiles {
    pub templates: Vec<SpaceFile>,
    /// Why rows were left out, and which, each with its road.
    pub left_out: BTreeMap<String, Vec<String>>,
}

/// A scenario, and the values of its parameters.
pub struct SpaceFile {
    /// The name of the action, with a number if it needs several.
    pub name: String,
    pub text: String,
    /// `None` if a single row needs no parameters.
    pub variations: Option<String>,
    /// The OpenDRIVE file.
    pub map_path: PathBuf,
    /// How many rows it stands for, each on one road.
    pub rows: usize,
}

/// A row on a road, with the file that it would have alone.
struct RowFile {
    action: usize,
    map_path: PathBuf,
    file: Element,
    /// The values of the action's parameters, with their types in OpenSCENARIO.
    values: Vec<(String, String, &'static str)>,
}

/// Writes down all rows of a space on the roads of an arena. `scenario_file` says what the file of a name will be called, `map_file` what its
/// map will.
pub fn space(
    arena: &Arena,
    scenario_file: &dyn Fn(&str) -> String,
    map_file: &dyn Fn(&PathBuf) -> String,
) -> SpaceFiles {
    let space = arena.table().space();
    let mut left_out: BTreeMap<String, Vec<String>> = BTreeMap::new();
    // In the order of their first rows.
    let mut places: BTreeMap<(usize, PathBuf, String), usize> = BTreeMap::new();
    let mut forms: Vec<Vec<RowFile>> = Vec::new();
    for (nth, row) in arena.rows_on_roads() {
        let road = arena.road(nth);
        let row = &space.rows[row];
        match laid(&arena.setup(nth, SEED), row, &map_file(&road.map_path)) {
            Err(reason) => {
                left_out.entry(reason).or_default().push(format!("{} on {}", row.label, road.name));
            }
            Ok(laid) => {
                let next = forms.len();
                let form = template::form(&laid.file);
                let place = *places.entry((laid.action, laid.map_path.clone(), form)).or_insert(next);
                if place == next {
                    forms.push(Vec::new());
                }
                forms[place].push(laid);
            }
        }
    }
    let mut templates = Vec::new();
    for (place, rows) in forms.iter().enumerate() {
        let action = rows[0].action;
        let own = &space.actions[action].name;
        let count = |forms: &[Vec<RowFile>]| forms.iter().filter(|rows| rows[0].action == action).count();
        let name = match count(&forms) {
            1 => own.clone(),
            _ => format!("{own}_{}", count(&forms[..=place])),
        };
        let Template { text, variations } = template::of(rows, &scenario_file(&name));
        let map_path = rows[0].map_path.clone();
        templates.push(SpaceFile { name, text, variations, map_path, rows: rows.len() });
    }
    SpaceFiles { templates, left_out }
}

/// A row on its road as a file with the row's own numbers.
///
/// # Errors
/// Why it is left out, in words.
fn laid(setup: &Setup, row: &Row, map_file: &str) -> Result<RowFile, String> {
    let space = setup.table.space();
    if !space.each_step.is_empty() {
        return Err("the space changes its states in every step".to_owned());
    }
    let mut world = World::new(Arc::clone(&setup.scene), &setup.start);
    let happened_s = vec![f64::NEG_INFINITY; space.actions.len()];
    let situation = Situation {
        memory: &setup.memory,
        road: setup.road(),
        rules: &setup.rules,
        surroundings: &world,
        seed: setup.seed,
        step: 0,
        happened_s: &happened_s,
    };
    let draw = setup.table.offer(&situation, row.index).map_err(|refusal| refusal.in_words())?;
    let appeared = world.carry_out(&draw).map_err(|(_, reason)| reason)?;
    if setup.start.ambient > 0 {
        return Err("its road has traffic of its own".to_owned());
    }
    let mut seen = Recorder::default();
    seen.note(&world, setup.ads.build(&setup.scene, setup.seed).as_ref(), &[]);
    let mut newcomers = Vec::new();
    for (nth, id) in appeared {
        let Effect::Spawn(request) = &draw.effects[nth] else { continue };
        let actor = seen.others.iter().find(|actor| actor.id == id);
        let (actor, facts) = actor.zip(world.npc_facts(id)).expect("who appeared is there");
        let name = request.bearer.map_or_else(|| actor.name(), |who| space.bearers[who].clone());
        if newcomers.iter().any(|newcomer: &Newcomer| newcomer.name == name) {
            return Err("two of its road users would have one name".to_owned());
        }
        newcomers.push(Newcomer { name, actor, request, course: draw.course(nth), facts });
    }
    if draw.effects.iter().any(|effect| matches!(effect, Effect::Order(_) | Effect::Light(_))) {
        return Err("it gives orders".to_owned());
    }
    let duration_s = space.episode.step_s * f64::from(space.episode.step_limit);
    let cast =
        Cast { road: setup.road(), ego_front_m: world.moment_facts().ego_front_m, newcomers, duration_s };
    let file = file(setup, row, &seen, &cast, map_file)?;
    let values = values(setup, row, &draw);
    Ok(RowFile { action: row.action, map_path: setup.road().map_path.clone(), file, values })
}

/// The document of a row; its parameters are declared where templates are made.
fn file(setup: &Setup, row: &Row, seen: &Recorder, cast: &Cast, map_file: &str) -> Result<Element, String> {
    let space = setup.table.space();
    let action = &space.actions[row.action];
    let road = setup.road();
    let description = action.docs.first().map_or_else(|| action.name.clone(), Clone::clone);
    // The file of the map need not have the limit of the road, and OpenSCENARIO has no place for one.
    let limit_mps = road.facts.map_limits_mps[1];
    let limit = (limit_mps <= *SPAWN_SPEED_MPS.end()).then(|| property(SPEED_LIMIT, &number(limit_mps)));
    let properties = Element::new("Properties").holding(property("action", &action.name)).holding_all(limit);
    let header = file_header(Version::V1_2, &description).holding(properties);
    let network = Element::new("RoadNetwork").holding(Element::new("LogicFile").with("filepath", map_file));
    let others = cast.newcomers.iter().map(|newcomer| entity(newcomer.actor, &newcomer.name, Ego::None));
    let entities = Element::new("Entities").holding(entity(&seen.ego, "ego", Ego::None)).holding_all(others);
    let ego = Element::new("Private")
        .with("entityRef", "ego")
        .holding(teleport(lane_position(&road.map, road.start)))
        .holding(speed(setup.start.ego_mps))
        .holding(destination(&road.map, road.goal));
    let (mut begins, mut groups) = (vec![ego], Vec::new());
    for (nth, newcomer) in cast.newcomers.iter().enumerate() {
        let (begin, events) = cast.story(nth)?;
        begins.push(begin);
        if !events.is_empty() {
            groups.push(maneuver_group(&newcomer.name, Some(&newcomer.name), events));
        }
    }
    let sky = seen.skies.first().map(|sky| environment(sky, 0));
    let init = sky.into_iter().chain(begins);
    let storyboard = staged(Version::V1_2, "others", init, groups, cast.duration_s);
    Ok(Element::new("OpenSCENARIO")
        .holding(header)
        .holding(Element::new("CatalogLocations"))
        .holding(network)
        .holding(entities)
        .holding(storyboard))
}

/// The values of the row's parameters, as declared: numbers in SI units.
fn values(setup: &Setup, row: &Row, draw: &Draw) -> Vec<(String, String, &'static str)> {
    let space = setup.table.space();
    let known = row.axes.iter().chain(&draw.values);
    let known: BTreeMap<&str, _> = known.map(|(name, value)| (&**name, *value)).collect();
    let parameters = space.actions[row.action].parameters.iter();
    let said = parameters.map(|parameter| {
        let value = known[&*parameter.name];
        let (text, kind) = match parameter.ty {
            Type::Bool => (space.show(value, parameter.ty), "boolean"),
            Type::Enum(_) => (space.show(value, parameter.ty), "string"),
            Type::Int | Type::Quantity(_) => (number(value.number()), "double"),
        };
        (parameter.name.to_string(), text, kind)
    });
    said.collect()
}
