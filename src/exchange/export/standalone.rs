//! A scenario as text that needs no space: each step's action with the values that it had. An exported file carries it, so
//! that `avastra import` gets the scenario back and not only the ways of the road users.
//!
//! Left out: rules, what an external driving system answered, and claims, which are facts of the file already.

use std::collections::BTreeMap;
use std::fmt::Write;

use avastra_base::units::decimal;
use avastra_campaign::emit::{identifier, lane_point, quoted};
use avastra_campaign::episode::{EpisodeLog, Outcome};
use avastra_lang::model::body::parameters;
use avastra_lang::model::vocabulary::{Body, Phenomenon, TrajectoryField, Verb, Word};
use avastra_lang::model::{
    BodyDef, Memory, Road, SPAWN_SPEED_MPS, Scenario, SignalProgram, Space, TrajectoryDef, ticks_s,
};
use avastra_lang::syntax::ast::{ExprKind, Field, ItemKind};
use avastra_lang::syntax::print_item;
use avastra_world::action::{Begins, Effect, LightRequest, OrderRequest, SpawnRequest};
use avastra_world::sim::VehicleParameters;

/// The scenario in an exported file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Standalone {
    /// On one line, from the road to the end of the scenario; without the version of the language.
    pub text: String,
    /// Parts of the episode that the text cannot express. If there are none, the episode is the recorded one, to the bit.
    pub lacks: Vec<&'static str>,
}

/// `None` if its map has a name that no text can hold.
pub fn standalone(space: &Space, scenario: &Scenario, log: &EpisodeLog) -> Option<Standalone> {
    let road = &space.roads[scenario.road];
    let road_name = identifier(&road.name);
    let mut actions = Actions::default();
    let mut steps = String::new();
    let mut before = &log.memory;
    let (mut is_bound, mut is_directed) = (false, false);
    for (number, step) in log.steps.iter().enumerate() {
        let (effects, delay_ticks) = match &step.outcome {
            Outcome::Done { draw, delay_ticks, .. } => {
                is_bound |= draw.lane_changes.is_some();
                is_directed |= !draw.courses.is_empty();
                (draw.effects.clone(), *delay_ticks)
            }
            // `each step` also acts in a step without an action.
            Outcome::Passed | Outcome::Refused { .. } => (of_the_sky(space, before, &step.memory), 0),
        };
        before = &step.memory;
        let after = (delay_ticks > 0).then(|| format!(" after {} s", decimal(ticks_s(delay_ticks), false)));
        let after = after.unwrap_or_default();
        let call = actions.named(space, &effects);
        let _ = write!(steps, " {number}: {call}(){after},");
    }
    let mut text = road_text(road, &road_name)?;
    let has_twilight =
        actions.effects.iter().any(|effect| effect.contains("Dawn") || effect.contains("Dusk"))
            || space.weather(&log.memory).0.is_twilight();
    text += " enum Time = Morning | Noon | Night";
    text += if has_twilight { " | Dawn | Dusk" } else { "" };
    text += " enum Sky = Rain | Fog | Wetness";
    text += " enum Level = None < Light < Moderate < High";
    text += " state time: Time = any state sky: Sky -> Level = None";
    for body in actions.bodies.values() {
        let _ = write!(text, " {}", body_text(body));
    }
    for trajectory in actions.trajectories.values() {
        let _ = write!(text, " {}", trajectory_text(trajectory, &road_name));
    }
    text += &actions.text();
    let episode = &space.episode;
    let stalled = episode.stalled_steps.map(|steps| format!("stalled >= {steps}"));
    let stops = episode.stop_arrived.then(|| "arrived".to_owned()).into_iter().chain(stalled);
    let _ = write!(
        text,
        " episode {{ roads: [{road_name}], step: {} s, stop: {}, limit: {} steps }}",
        decimal(episode.step_s, false),
        stops.collect::<Vec<_>>().join(" or "),
        episode.step_limit
    );
    let is_external = log.conversation.is_some();
    let _ = write!(
        text,
        " scenario {} {{ {} road: {road_name} {} steps {{{steps} }} }}",
        identifier(&scenario.name),
        origin_text(scenario, log.seed, is_external),
        start_text(log),
    );
    let lacks = [
        is_bound.then_some("the rules on lane changes of its space"),
        is_directed.then_some("the manoeuvres of its space"),
        actions.is_moved.then_some("the place at which somebody begins"),
        is_external.then_some("the driving system, which does not come with avastra"),
    ];
    Some(Standalone { text, lacks: lacks.into_iter().flatten().collect() })
}

/// The actions of the text: one for each list of effects.
#[derive(Default)]
struct Actions<'a> {
    effects: Vec<String>,
    /// The author's own bodies that they let appear, by their index in the space.
    bodies: BTreeMap<usize, &'a BodyDef>,
    /// The trajectories that they follow, likewise.
    trajectories: BTreeMap<usize, &'a TrajectoryDef>,
    /// Whether a road user begins elsewhere in the text: beside the ego vehicle, or behind others at a junction.
    is_moved: bool,
}

impl<'a> Actions<'a> {
    /// The name of the action with these effects.
    fn named(&mut self, space: &'a Space, effects: &[Effect]) -> String {
        let mut text: Vec<String> = effects.iter().map(|effect| self.effect(space, effect)).collect();
        text.retain(|effect| !effect.is_empty());
        if text.is_empty() {
            return "wait".to_owned();
        }
        let text = text.join(" ");
        let known = self.effects.iter().position(|known| *known == text);
        let index = known.unwrap_or_else(|| {
            self.effects.push(text);
            self.effects.len() - 1
        });
        action_name(index)
    }

    fn effect(&mut self, space: &'a Space, effect: &Effect) -> String {
        match effect {
            Effect::Time(time) => format!("set time = {}", time.name()),
            Effect::Sky(phenomenon, level) => format!("set sky[{}] = {}", phenomenon.name(), level.name()),
            Effect::Spawn(request) => self.spawn(space, request),
            Effect::Light(LightRequest { colour, at_m }) => {
                let at = at_m.map_or_else(String::new, |at_m| format!(", at: {} m", decimal(at_m, false)));
                format!("order light {{ colour: {}{at} }}", colour.name())
            }
            Effect::Order(OrderRequest { bearer, command, .. }) => {
                // An order of a manoeuvre, which the text lacks, lets its bearer drive on.
                let fields = command.written(&space.bearers).join(", ");
                let name = &space.bearers[*bearer];
                if fields.is_empty() { fields } else { format!("order {name} {{ {fields} }}") }
            }
        }
    }

    fn spawn(&mut self, space: &'a Space, request: &SpawnRequest) -> String {
        let mut name = |like: Body, own: Option<usize>| match own {
            None => like.name().to_owned(),
            Some(index) => {
                self.bodies.insert(index, &space.bodies[index]);
                space.bodies[index].name.clone()
            }
        };
        let body = name(request.body, request.own.map(|own| own.index));
        let cover = request.cover.map(|cover| name(cover, request.cover_own.map(|own| own.index)));
        let cover = cover.map_or_else(String::new, |cover| format!(" from behind {cover}"));
        let name = request.bearer.map_or_else(String::new, |who| format!(" as {}", space.bearers[who]));
        let mut distance_m = request.distance_m;
        let place = match request.trajectory.map(|on| (on, &space.trajectories[on.index])) {
            Some((on, trajectory)) => {
                self.trajectories.insert(on.index, trajectory);
                let (place, place_m) = match on.begins {
                    None => ("at", distance_m),
                    Some(Begins::BehindRear(way_m)) => ("behind", way_m),
                    Some(Begins::BeforeFront(way_m)) if way_m >= 0.0 => ("ahead", way_m),
                    Some(Begins::BeforeFront(way_m)) => ("behind", -way_m - VehicleParameters::MKZ.length_m),
                };
                // No distance says it.
                self.is_moved |= place_m < 0.0;
                distance_m = place_m.max(0.0);
                format!("on {} {place}", trajectory.name)
            }
            None if request.verb.begins_behind() => "behind".to_owned(),
            None => "ahead".to_owned(),
        };
        let mut fields = vec![format!("does: {}", request.verb.name())];
        if matches!(request.verb, Verb::DriveAhead | Verb::DriveBehind | Verb::Overtake) {
            fields.push(format!("lane: {}", request.lane.name()));
        }
        if matches!(request.verb, Verb::CrossRoad | Verb::Walk) {
            fields.push(format!("side: {}", request.side.name()));
        }
        if request.body.is_vehicle() && request.verb != Verb::Follow {
            fields.push(format!("then: {}", request.then.name()));
        }
        if request.verb != Verb::Stand {
            fields.push(format!("speed: {} m/s", decimal(request.speed_mps, false)));
        }
        fields.extend(request.told.written(&space.bearers));
        fields.push(format!("colour: {}", request.colour.name()));
        // The text does not say either how far behind the first of a row a road user comes to a junction.
        self.is_moved |= request.behind_first_m != 0.0;
        let distance = decimal(distance_m, false);
        format!("spawn {body}{name} {place} {distance} m{cover} {{ {} }}", fields.join(", "))
    }

    /// Their declarations. A space has at least one action.
    fn text(&self) -> String {
        if self.effects.is_empty() {
            return " state begun: Bool = false action begin() { set begun = true }".to_owned();
        }
        let declared = self.effects.iter().enumerate();
        declared.map(|(index, effects)| format!(" action {}() {{ {effects} }}", action_name(index))).collect()
    }
}

fn action_name(index: usize) -> String {
    format!("action_{}", index + 1)
}

/// The changes of time of day and weather in a step without an action.
fn of_the_sky(space: &Space, before: &Memory, after: &Memory) -> Vec<Effect> {
    let ((time_before, sky_before), (time, sky)) = (space.weather(before), space.weather(after));
    let levels = Phenomenon::ALL.iter().zip(sky_before.iter().zip(sky));
    let changed = levels.filter(|(_, (before, after))| *before != after);
    let time = (time != time_before).then_some(Effect::Time(time));
    time.into_iter().chain(changed.map(|(phenomenon, (_, level))| Effect::Sky(*phenomenon, level))).collect()
}

fn road_text(road: &Road, name: &str) -> Option<String> {
    let map = road.map_path.file_name()?.to_str()?;
    let mut text = format!(
        "road {name} {{ map: {}, start: {}, goal: {}",
        quoted(map),
        lane_point(&road.map, road.start),
        lane_point(&road.map, road.goal)
    );
    // A limit that the author set is below some lane's of the file; one that no lane exceeds changes nothing.
    let [_, limit_mps] = road.facts.map_limits_mps;
    if limit_mps <= *SPAWN_SPEED_MPS.end() {
        let _ = write!(text, ", limit: {} m/s", decimal(limit_mps, false));
    }
    if let Some(set_mps) = road.set_mps {
        let _ = write!(text, ", set_speed: {} m/s", decimal(set_mps, false));
    }
    if let Some(phase_s) = road.signal_phase_s {
        let _ = write!(text, ", signal_phase: {} s", decimal(phase_s, false));
    }
    let SignalProgram { green_s, yellow_s, all_red_s } = road.signal_program;
    for (name, time_s) in [("green", green_s), ("yellow", yellow_s), ("all_red", all_red_s)] {
        time_s.iter().for_each(|time_s| text += &format!(", {name}: {} s", decimal(*time_s, false)));
    }
    let mut passed = road.route.lanes.iter().filter_map(|part| road.map.lane(part.lane).junction);
    if passed.any(|junction| road.map.junctions[junction].idle_lights > 0) {
        text += ", unlit: true";
    }
    text += " }";
    Some(text)
}

/// A trajectory on the map of the text's one road.
fn trajectory_text(trajectory: &TrajectoryDef, road: &str) -> String {
    let mut declared = trajectory.declared.clone();
    let is_road = |field: &&mut Field| field.name.text == TrajectoryField::Road.name();
    for field in declared.fields.iter_mut().filter(is_road) {
        field.value.kind = ExprKind::Name(road.to_owned());
    }
    let text = print_item(&ItemKind::Trajectory(declared));
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn body_text(body: &BodyDef) -> String {
    let BodyDef { name, like, shape, .. } = body;
    let of_engine = parameters(*like);
    let mut fields = vec![
        format!("like: {}", like.name()),
        format!("length: {} m", decimal(shape.length_m, false)),
        format!("width: {} m", decimal(shape.width_m, false)),
        format!("height: {} m", decimal(shape.height_m, false)),
        // To the gram.
        format!("mass: {:.3} kg", shape.mass_t * 1000.0),
        format!("acceleration: {} m/s^2", decimal(shape.acceleration_mps2_max, false)),
        format!("deceleration: {} m/s^2", decimal(shape.deceleration_mps2_max, false)),
    ];
    // Without one, axles keep their places in proportion to the length.
    if shape.wheelbase_m != of_engine.wheelbase_m * (shape.length_m / of_engine.length_m) {
        fields.push(format!("wheelbase: {} m", decimal(shape.wheelbase_m, false)));
    }
    format!("body {name} {{ {} }}", fields.join(", "))
}

/// The seed, and the driving system unless it is one of the user's own; how other vehicles drive, if not as by default.
fn origin_text(scenario: &Scenario, seed: u64, is_external: bool) -> String {
    let origin = &scenario.origin;
    let digest = ("profile_digest", &origin.profile_digest);
    let of_ads = [("ads", &origin.ads), ("profile", &origin.profile), digest];
    let of_ads = of_ads.into_iter().filter(|_| !is_external);
    let of_traffic = [("traffic", &origin.traffic), ("traffic_digest", &origin.traffic_digest)];
    let mut text = format!("origin {{ seed: {seed}");
    for (name, value) in of_ads.chain(of_traffic) {
        if let Some(value) = value {
            let _ = write!(text, ", {name}: {}", quoted(value));
        }
    }
    text += " }";
    text
}

fn start_text(log: &EpisodeLog) -> String {
    let start = &log.start;
    let [rain, fog, wetness] = start.sky.map(|level| level.name());
    format!(
        "start {{ time: {}, sky: {{ Rain: {rain}, Fog: {fog}, Wetness: {wetness} }}, ego_speed: {} m/s, \
         signal_phase: {} s, ambient: {}, traffic_seed: {} }}",
        start.time.name(),
        decimal(start.ego_mps, false),
        decimal(start.signal_phase_s, false),
        start.ambient,
        start.seed
    )
}
