//! The differences that CARLA's ScenarioRunner (0.9.13 and later) needs, and what is lost.
//!
//! It reads OpenSCENARIO 1.0 alone. Vehicles are models of CARLA, and outlines of the file are ignored. All entities are
//! made as the scenario begins. Lights and changes of weather are not read or do not work. Polylines follow their times.
//! Its parser is public, and is where this comes from.

use std::collections::BTreeSet;

use avastra_campaign::episode::{Actor, Sky};
use avastra_lang::model::vocabulary::{Body, Level};

use super::super::recording::Recording;
use super::super::xml::Element;
use super::actions::private;
use super::entity::{bounding_box, build, vehicle_category, without_wheels};
use super::environment::{sun, time};
use super::natural;
use super::style::{BENEATH_M, property};

/// Above this it sees no fog, below nothing but fog, m.
const FOG_M: f64 = 1000.0;

/// The content that a file for ScenarioRunner leaves out or says only in part.
pub fn dropped(recording: &Recording) -> Vec<String> {
    let mut dropped = vec!["exact ways and times: whoever the file moves drives by actions".to_owned()];
    let bodies: BTreeSet<&str> = recording.actors().map(|actor| model(actor).1).collect();
    let bodies = bodies.into_iter().collect::<Vec<_>>().join(", ");
    dropped.push(format!("outlines and masses: those of CARLA's models count ({bodies})"));
    if !recording.seen.lights.is_empty() {
        dropped.push(format!("the phases of {} lights", recording.seen.lights.len()));
    }
    for sky in recording.seen.skies.iter().skip(1) {
        dropped.push(format!("the weather and time of day from {:.2} s on", sky.time_s));
    }
    if let Some(sky) = recording.seen.skies.first().filter(|sky| sky.visibility_m < FOG_M) {
        dropped
            .push(format!("how dense the fog is: one sees {:.0} m, there it is full fog", sky.visibility_m));
    }
    for actor in recording.seen.others.iter().filter(|actor| actor.first_tick() > 0) {
        let name = actor.name();
        dropped.push(format!(
            "that {name} is not there from the beginning: it waits {BENEATH_M} m beneath its place"
        ));
    }
    dropped
}

/// An entry of `Entities`. The ego vehicle's entry also holds the facts that the header has no room for.
pub fn entity(recording: &Recording, actor: &Actor) -> Element {
    let object = Element::new("ScenarioObject").with("name", actor.name());
    let (model, _) = model(actor);
    let kind = if actor.id == 0 { "ego_vehicle" } else { "simulation" };
    let properties = Element::new("Properties").holding(property("type", kind));
    let Some(category) = vehicle_category(actor.body) else {
        // The player takes the name of an object as its model.
        let other = match actor.body {
            Body::Object => without_wheels(actor, model),
            _ => without_wheels(actor, &actor.name()).with("model", model),
        };
        return object.holding(other.holding(bounding_box(actor)).holding(properties));
    };
    let facts = recording.facts.iter().cloned().chain([natural::caveat(&[])]);
    let facts = facts.filter(|_| actor.id == 0).map(|(name, value)| property(&name, &value));
    let vehicle = Element::new("Vehicle").with("name", model).with("vehicleCategory", category);
    object.holding(vehicle.holding_all(build(actor)).holding(properties.holding_all(facts)))
}

/// A program other than ScenarioRunner drives.
pub fn controller() -> Element {
    let module = property("module", "external_control");
    let controller =
        Element::new("Controller").with("name", "ads").holding(Element::new("Properties").holding(module));
    let off = |name| Element::new(name).with("active", false);
    let pedals = ["Throttle", "Brake", "Clutch", "ParkingBrake", "SteeringWheel"];
    let overrides = Element::new("OverrideControllerValueAction")
        .holding_all(pedals.map(|name| off(name).with("value", 0)))
        .holding(off("Gear").with("number", 0));
    let assigned = Element::new("AssignControllerAction").holding(controller);
    private(Element::new("ControllerAction").holding(assigned).holding(overrides))
}

/// A sky as a `GlobalAction`. Intensities are parts of the most: those of sunlight become clouds.
pub fn environment(sky: &Sky) -> Element {
    let rain = match sky.levels[0] {
        Level::None => 0.0,
        Level::Light => 0.2,
        Level::Moderate => 0.5,
        Level::High => 1.0,
    };
    let rains = rain > 0.0;
    let (sun, _) = sun(sky);
    let weather = Element::new("Weather")
        .with("cloudState", if rains { "rainy" } else { "free" })
        .holding(sun.measured("intensity", if rains { 0.0 } else { 1.0 }))
        .holding(Element::new("Fog").measured("visualRange", sky.visibility_m))
        .holding(
            Element::new("Precipitation")
                .with("precipitationType", if rains { "rain" } else { "dry" })
                .measured("intensity", rain),
        );
    let road = Element::new("RoadCondition").measured("frictionScaleFactor", sky.friction_scale);
    let environment =
        Element::new("Environment").with("name", "sky_0").holding(time(sky)).holding(weather).holding(road);
    Element::new("GlobalAction").holding(Element::new("EnvironmentAction").holding(environment))
}

/// The model of CARLA that comes nearest, and what is said of it.
fn model(actor: &Actor) -> (&'static str, &'static str) {
    if actor.id == 0 {
        return ("vehicle.lincoln.mkz_2020", "ego: lincoln.mkz_2020");
    }
    match actor.body {
        Body::Jeep => ("vehicle.jeep.wrangler_rubicon", "Jeep: jeep.wrangler_rubicon"),
        Body::Sedan => ("vehicle.tesla.model3", "Sedan: tesla.model3"),
        Body::SUV => ("vehicle.nissan.patrol_2021", "SUV: nissan.patrol_2021"),
        Body::Hatchback => ("vehicle.seat.leon", "Hatchback: seat.leon"),
        Body::BoxTruck => ("vehicle.carlamotors.carlacola", "BoxTruck: carlamotors.carlacola"),
        Body::SchoolBus => ("vehicle.mitsubishi.fusorosa", "SchoolBus: mitsubishi.fusorosa"),
        Body::Motorcycle => ("vehicle.yamaha.yzf", "Motorcycle: yamaha.yzf"),
        Body::Bicycle => ("vehicle.bh.crossbike", "Bicycle: bh.crossbike"),
        Body::Pedestrian => ("walker.pedestrian.0001", "Pedestrian: walker 0001"),
        // CARLA has no animals.
        Body::Animal => ("walker.pedestrian.0001", "Animal: walker 0001"),
        Body::Object => ("static.prop.box01", "Object: box01"),
    }
}
