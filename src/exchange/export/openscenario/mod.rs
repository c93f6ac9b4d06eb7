//! A recording as OpenSCENARIO XML (ASAM, 1.2 and 1.3, and 1.0 for CARLA): what players of that format show again.
//!
//! Exactly, everyone is a `FollowTrajectoryAction` along a polyline with absolute times, so a player needs no model of
//! driving. The last vertex is at the end of the recording, because a player may let what has no vertex left roll on.
//! `natural` has the others as actions that a person would write. `space` writes a space, of which nothing is recorded. A
//! road user that appears or leaves on the way is added and deleted. Names, in the file's order: `ego`, then `npc_N` for the
//! road user that claims call `npc#N`.
//!
//! Left out: what a driving system saw or planned, heights (a player puts road users on the map's road), and lights of
//! vehicles.

mod actions;
mod carla;
mod entity;
mod environment;
mod lanes;
mod natural;
mod pace;
mod space;
mod story;
mod style;
mod when;

use avastra_campaign::episode::Actor;
use avastra_road::{LanePlace, RoadMap};
use avastra_world::sim::DT_S;

use super::DATE;
use super::recording::Recording;
use super::vertices::{close_ticks, vertices};
use super::xml::Element;

use actions::{
    action, all, event_at, follow, from_time, lane_position, leaves, maneuver_group, of_entity, position,
    private, speed, teleport,
};
use entity::{ahead_of_centre_m, entity};
use environment::{environment, signals};
use natural::Natural;
use style::property;

pub use space::{SPEED_LIMIT, SpaceFile, SpaceFiles, space};
pub use style::{Ego, Others, Style, Version};

/// A file.
pub struct Written {
    pub text: String,
    /// The content that the file leaves out or says otherwise than its style promises.
    pub left_out: Vec<String>,
}

/// Writes a recording. `map_file` is the path of the map from the file.
pub fn openscenario(recording: &Recording, map_file: &str, style: Style) -> Written {
    let signals = (style.version != Version::Carla).then(|| signals(recording)).flatten();
    let network = Element::new("RoadNetwork")
        .holding(Element::new("LogicFile").with("filepath", map_file))
        .holding_all(signals);
    // Others that are exact in a natural version; ScenarioRunner plans a route over the points of their ways.
    let exact = match (style.version, style.others) {
        (Version::V1_2, Others::Natural) => natural::exact(recording),
        _ => Vec::new(),
    };
    let entities = recording.actors().map(|actor| match style.version {
        Version::Carla => carla::entity(recording, actor),
        Version::V1_2 => entity(actor, &actor.name(), style.ego),
    });
    let text = Element::new("OpenSCENARIO")
        .holding(header(recording, style, &exact))
        .holding(Element::new("CatalogLocations"))
        .holding(network)
        .holding(Element::new("Entities").holding_all(entities))
        .holding(storyboard(recording, style, &exact))
        .document();
    let left_out = match style.version {
        Version::Carla => carla::dropped(recording),
        Version::V1_2 if exact.is_empty() => Vec::new(),
        Version::V1_2 => {
            let names = natural::names(&exact);
            vec![format!(
                "actions of {names}, which turn back onto the road that they come from: as recorded"
            )]
        }
    };
    Written { text, left_out }
}

fn header(recording: &Recording, style: Style, exact: &[&Actor]) -> Element {
    let told = recording.docs.iter().find(|line| !line.starts_with("Emitted by"));
    let header = file_header(style.version, told.unwrap_or(&recording.name));
    if style.version == Version::Carla {
        return header;
    }
    let caveat = (style.others == Others::Natural).then(|| natural::caveat(exact));
    let facts = recording.facts.iter().chain(&caveat).map(|(name, value)| property(name, value));
    header.holding(Element::new("Properties").holding_all(facts))
}

/// The head of every file that is written here.
fn file_header(version: Version, description: &str) -> Element {
    Element::new("FileHeader")
        .with("revMajor", 1)
        .with("revMinor", if version == Version::Carla { 0 } else { 2 })
        .with("date", format!("{DATE}T00:00:00"))
        .with("description", description)
        .with("author", "avastra")
}

fn storyboard(recording: &Recording, style: Style, exact: &[&Actor]) -> Element {
    let version = style.version;
    let mut init = Vec::new();
    let mut groups = Vec::new();
    for actor in recording.actors() {
        let is_exact = match version {
            Version::Carla => actor.id == 0 && style.ego != Ego::Trajectory,
            Version::V1_2 if style.others == Others::Exact => true,
            Version::V1_2 => actor.id == 0 || exact.iter().any(|other| other.id == actor.id),
        };
        let (begins, events) = if is_exact {
            (begins(recording, actor, style), events(recording, actor, style))
        } else {
            let told = (version == Version::V1_2).then(|| natural::as_told(recording, actor)).flatten();
            let told = told.map(|(begins, events)| (Some(begins), events));
            told.unwrap_or_else(|| Natural::of(recording, actor, version).written())
        };
        init.extend(begins);
        if !events.is_empty() {
            let name = actor.name();
            groups.push(maneuver_group(&name, Some(&name), events));
        }
    }
    if version != Version::Carla {
        groups.extend(weather_group(recording, version));
    }
    let sky = recording.seen.skies.first().map(|sky| match version {
        Version::Carla => carla::environment(sky),
        Version::V1_2 => environment(sky, 0),
    });
    staged(version, "recording", sky.into_iter().chain(init), groups, recording.duration_s())
}

/// A storyboard of what is there at the beginning, and of one act of manoeuvres, if there are any, from the beginning to its end.
fn staged(
    version: Version,
    act: &str,
    init: impl Iterator<Item = Element>,
    groups: Vec<Element>,
    end_s: f64,
) -> Element {
    let at = |name: &str, moment_s: f64| all(vec![from_time(version, name, moment_s)]);
    let story = (!groups.is_empty()).then(|| {
        let played = Element::new("Act")
            .with("name", act)
            .holding_all(groups)
            .holding(Element::new("StartTrigger").holding(at("start", 0.0)));
        Element::new("Story").with("name", act).holding(played)
    });
    Element::new("Storyboard")
        .holding(Element::new("Init").holding(Element::new("Actions").holding_all(init)))
        .holding_all(story)
        .holding(Element::new("StopTrigger").holding(at("end", end_s)))
}

/// Where a road user is at the start, if it is there.
fn begins(recording: &Recording, actor: &Actor, style: Style) -> Option<Element> {
    if actor.first_tick() > 0 {
        return None;
    }
    let first = actor.samples[0];
    let place = first.pose.offset(ahead_of_centre_m(actor), 0.0);
    let private = Element::new("Private")
        .with("entityRef", actor.name())
        .holding(teleport(position(&place)))
        .holding(speed(first.velocity_mps.norm()));
    Some(match style.version {
        _ if actor.id > 0 || style.ego != Ego::Controller => private,
        Version::Carla => private.holding(carla::controller()),
        Version::V1_2 => private.holding(activation()).holding(destination(&recording.map, recording.goal)),
    })
}

/// The recorded actions of a road user; nothing if the player moves it.
fn events(recording: &Recording, actor: &Actor, style: Style) -> Vec<Element> {
    if actor.id == 0 && style.ego != Ego::Trajectory {
        return Vec::new();
    }
    let name = actor.name();
    let way = vertices(actor, ahead_of_centre_m(actor), &close_ticks(&recording.seen, actor));
    let first_s = actor.first_tick() as f64 * DT_S;
    let mut actions = Vec::new();
    if actor.first_tick() > 0 {
        let added = Element::new("AddEntityAction").holding(position(&way[0].pose));
        actions.push(action(&format!("{name}_appears"), of_entity(&name, added)));
    }
    // A single vertex is no way: the road user appears in the last tick.
    if way.len() > 1 {
        actions.push(action(&format!("{name}_follows"), follow(&name, &way)));
    }
    let mut events = Vec::new();
    if !actions.is_empty() {
        events.push(event_at(style.version, &format!("{name}_moves"), actions, first_s));
    }
    events.extend(leaves(recording.seen.end_tick, actor, style.version));
    events
}

/// Changes of weather and time of day after the start.
fn weather_group(recording: &Recording, version: Version) -> Option<Element> {
    let change = |(number, sky)| {
        let action = action(&format!("sky_{number}"), environment(sky, number));
        event_at(version, &format!("sky_{number}_begins"), vec![action], sky.time_s)
    };
    let events: Vec<Element> = recording.seen.skies.iter().enumerate().skip(1).map(change).collect();
    (!events.is_empty()).then(|| maneuver_group("sky", None, events))
}

fn activation() -> Element {
    let activate = Element::new("ActivateControllerAction").with("lateral", true).with("longitudinal", true);
    private(Element::new("ControllerAction").holding(activate))
}

/// Where the ego vehicle is to go.
fn destination(map: &RoadMap, goal: LanePlace) -> Element {
    let position = lane_position(map, LanePlace { offset_m: 0.0, ..goal });
    private(Element::new("RoutingAction").holding(Element::new("AcquirePositionAction").holding(position)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::{Pose, Vec2};
    use avastra_campaign::episode::Sample;

    #[test]
    fn a_road_user_sinks_a_tick_before_it_is_deleted_unless_it_stays() {
        let mut actor = Actor::ego();
        actor.id = 4;
        let pose = Pose::new(3.0, 2.0, 1.0);
        actor.samples.extend((10..=20).map(|tick| Sample { tick, pose, velocity_mps: Vec2::zeros() }));
        assert!(leaves(20, &actor, Version::V1_2).is_empty(), "it is there to the end");
        let [sinks, gone] = &leaves(50, &actor, Version::V1_2)[..] else { panic!("two events") };
        let (sinks, gone) = (sinks.clone().document(), gone.clone().document());
        for part in ["npc_4_leaves", "TeleportAction", "z=\"-100\"", "value=\"0.42\""] {
            assert!(sinks.contains(part), "{part}: {sinks}");
        }
        for part in ["npc_4_is_gone", "DeleteEntityAction", "value=\"0.44\""] {
            assert!(gone.contains(part), "{part}: {gone}");
        }
    }
}
