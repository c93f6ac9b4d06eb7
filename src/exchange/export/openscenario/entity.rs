//! Road users as OpenSCENARIO describes them.

use avastra_campaign::episode::Actor;
use avastra_lang::model::vocabulary::Body;
use avastra_world::sim::VehicleParameters;

use super::super::xml::Element;
use super::style::{Ego, property};

/// Diameter of a wheel, and how far the wheels of an axle are apart as a part of the width: usual values, which matter to
/// a picture alone.
const WHEEL_M: f64 = 0.65;
const TRACK_PART: f64 = 0.85;
/// Fast enough for every recording, m/s.
const SPEED_MPS_MAX: f64 = 60.0;

/// A vehicle is where the middle of its rear axle is, as the standard wants it; a pedestrian is where its middle is. How
/// far that lies before the middle of the outline, m.
pub fn ahead_of_centre_m(actor: &Actor) -> f64 {
    if actor.is_vehicle() { -actor.shape.rear_axle_m } else { 0.0 }
}

/// An entry of `Entities` of this name.
pub fn entity(actor: &Actor, name: &str, ego: Ego) -> Element {
    let entity = Element::new("ScenarioObject").with("name", name);
    let Some(category) = vehicle_category(actor.body) else {
        let other = without_wheels(actor, name);
        return entity.holding(other.holding(bounding_box(actor)).holding(properties()));
    };
    let vehicle = Element::new("Vehicle")
        .with("name", name)
        .with("vehicleCategory", category)
        .measured("mass", actor.shape.mass_t * 1000.0)
        .holding_all(build(actor))
        .holding(properties());
    let driven = (actor.id == 0 && ego == Ego::Controller).then(|| {
        let controller = Element::new("Controller").with("name", "ads").holding(Element::new("Properties"));
        Element::new("ObjectController").holding(controller)
    });
    entity.holding(vehicle).holding_all(driven)
}

/// A vehicle's outline, what it can do, and its axles.
pub fn build(actor: &Actor) -> [Element; 3] {
    let performance = Element::new("Performance")
        .measured("maxSpeed", SPEED_MPS_MAX)
        .measured("maxAcceleration", actor.shape.acceleration_mps2_max)
        .measured("maxDeceleration", actor.shape.deceleration_mps2_max);
    let axle = |kind, steer_rad, ahead_m| {
        Element::new(kind)
            .measured("maxSteering", steer_rad)
            .measured("wheelDiameter", WHEEL_M)
            .measured("trackWidth", actor.shape.width_m * TRACK_PART)
            .measured("positionX", ahead_m)
            .measured("positionZ", WHEEL_M / 2.0)
    };
    let axles = Element::new("Axles")
        // The largest steering angle of other vehicles is not known; the ego vehicle's serves for all.
        .holding(axle("FrontAxle", VehicleParameters::MKZ.steer_rad_max, actor.shape.wheelbase_m))
        .holding(axle("RearAxle", 0.0, 0.0));
    [bounding_box(actor), performance, axles]
}

/// esmini turns a road user late along a polyline unless it is told to turn evenly between the vertices; others ignore it.
fn properties() -> Element {
    Element::new("Properties").holding(property("plineInterpolation", "segment"))
}

pub fn bounding_box(actor: &Actor) -> Element {
    let shape = &actor.shape;
    let centre = Element::new("Center")
        .measured("x", -ahead_of_centre_m(actor))
        .with("y", 0)
        .measured("z", shape.height_m / 2.0);
    let dimensions = Element::new("Dimensions")
        .measured("width", shape.width_m)
        .measured("length", shape.length_m)
        .measured("height", shape.height_m);
    Element::new("BoundingBox").holding(centre).holding(dimensions)
}

/// A pedestrian, an animal or an object, without its outline and properties.
pub fn without_wheels(actor: &Actor, name: &str) -> Element {
    let element = match actor.body {
        Body::Object => Element::new("MiscObject").with("name", name).with("miscObjectCategory", "obstacle"),
        body => {
            let category = if body == Body::Animal { "animal" } else { "pedestrian" };
            Element::new("Pedestrian").with("name", name).with("pedestrianCategory", category)
        }
    };
    element.measured("mass", actor.shape.mass_t * 1000.0)
}

/// `None` for pedestrians, animals and objects.
pub fn vehicle_category(body: Body) -> Option<&'static str> {
    match body {
        Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback => Some("car"),
        Body::BoxTruck => Some("truck"),
        Body::SchoolBus => Some("bus"),
        Body::Motorcycle => Some("motorbike"),
        Body::Bicycle => Some("bicycle"),
        Body::Pedestrian | Body::Animal | Body::Object => None,
    }
}
