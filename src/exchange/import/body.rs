//! The bodies of a file: what the engine has for a vehicle or a pedestrian, described in the file or in a catalogue.

use roxmltree::Node;

use avastra_lang::model::body::REAR_PART;
use avastra_lang::model::vocabulary::BodyField;

use super::catalogue;
use super::source::{Mark, Source, children, element, elements};

/// A vehicle's middle is not so far behind its rear axle, m.
const BEHIND_M: f64 = 0.05;

/// Ours: farther from the axle than the longest body is long, m, the middle is a mistake.
const MIDDLE_M_MAX: f64 = 20.0;

/// The body that the engine has for it, and its own size.
#[derive(Debug, Clone)]
pub struct Body {
    pub like: &'static str,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// From the reference point, a vehicle's rear axle, to the middle.
    pub middle_m: f64,
    /// How fast it may gain speed, and lose it, m/s².
    pub gains_mps2: f64,
    pub loses_mps2: f64,
    /// How fast it may be, m/s.
    pub most_mps: f64,
}

impl Body {
    /// Whether it is a vehicle with more than two wheels.
    pub fn has_more_than_two_wheels(&self) -> bool {
        !self.is_on_foot() && !matches!(self.like, "Bicycle" | "Motorcycle" | "Object")
    }

    pub fn is_on_foot(&self) -> bool {
        matches!(self.like, "Pedestrian" | "Animal")
    }
}

impl Body {
    /// Refuses a speed above that of the file's vehicle.
    pub fn drives(&self, source: &mut Source, mark: &Mark, mps: f64) -> Option<()> {
        let most_mps = self.most_mps;
        source.refuse_if(mps > most_mps, mark, format!("{mps:.1} m/s: its `maxSpeed` is {most_mps} m/s"))
    }
}

pub fn body(source: &mut Source, object: Node) -> Option<Body> {
    const KINDS: [catalogue::Kind; 3] = [catalogue::VEHICLE, catalogue::PEDESTRIAN, catalogue::OBJECT];
    if let Some(reference) = element(object, "CatalogReference") {
        return catalogue::body(source, reference, &KINDS, described);
    }
    let found: Vec<Node> = children(object).filter(|node| is_described(*node)).collect();
    let [found] = found[..] else {
        return source.refuse(object, "only vehicles, pedestrians and objects are read, one an object");
    };
    described(source, found)
}

/// The wheelbase of a body whose rear axle lies so far behind its middle, m: the inverse of the language's rule for bodies.
pub fn wheelbase_m(length_m: f64, middle_m: f64) -> f64 {
    let wheelbase_m = length_m - (length_m / 2.0 - middle_m) / REAR_PART;
    let (_, low_m, high_m) = BodyField::Wheelbase.range().expect("it is a length");
    // Shorter than the body, whatever its middle is.
    wheelbase_m.min(0.95 * length_m).clamp(low_m, high_m)
}

fn is_described(node: Node) -> bool {
    matches!(node.tag_name().name(), "Vehicle" | "Pedestrian" | "MiscObject")
}

/// The body of a `Vehicle`, a `Pedestrian` or a `MiscObject`.
fn described(source: &mut Source, node: Node) -> Option<Body> {
    source.scoped(node, |source| of_size(source, node))
}

fn of_size(source: &mut Source, node: Node) -> Option<Body> {
    let like = match node.tag_name().name() {
        "Vehicle" => match source.text(node, "vehicleCategory")?.as_str() {
            "car" => "Sedan",
            "van" => "SUV",
            "truck" | "semitrailer" => "BoxTruck",
            "bus" => "SchoolBus",
            "motorbike" => "Motorcycle",
            "bicycle" => "Bicycle",
            other => return source.refuse(node, format!("no vehicle of the category `{other}` is known")),
        },
        "Pedestrian" => match node.attribute("pedestrianCategory").unwrap_or("") {
            "pedestrian" | "" => "Pedestrian",
            "animal" => "Animal",
            other => return source.refuse(node, format!("no pedestrian of the category `{other}` is known")),
        },
        _ => "Object",
    };
    no_trailer(source, node)?;
    let bounds = source.required(node, "BoundingBox")?;
    let (centre, size) = (source.required(bounds, "Center")?, source.required(bounds, "Dimensions")?);
    let length_m = within(source, size, "length", BodyField::Length)?;
    let width_m = within(source, size, "width", BodyField::Width)?;
    let height_m = within(source, size, "height", BodyField::Height)?;
    let middle_m = source.number(centre, "x")?;
    let reason = format!("`x` is {middle_m}: more than {MIDDLE_M_MAX} m from the axle");
    source.refuse_if(middle_m.abs() > MIDDLE_M_MAX, centre, reason)?;
    let reason = format!(
        "`x` is {middle_m}: the reference point, of vehicles the rear axle, lies within the body and no vehicle's middle behind it"
    );
    let is_behind = node.has_tag_name("Vehicle") && middle_m < -BEHIND_M;
    source.refuse_if(is_behind || middle_m.abs() > length_m / 2.0, centre, reason)?;
    let (mut gains_mps2, mut loses_mps2, mut most_mps) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    if let Some(node) = element(node, "Performance") {
        gains_mps2 = source.amount(node, "maxAcceleration")?;
        loses_mps2 = source.amount(node, "maxDeceleration")?;
        most_mps = source.amount(node, "maxSpeed")?;
    }
    Some(Body { like, length_m, width_m, height_m, middle_m, gains_mps2, loses_mps2, most_mps })
}

fn within(source: &mut Source, node: Node, attribute: &str, field: BodyField) -> Option<f64> {
    let value = source.number(node, attribute)?;
    match field.range() {
        Some((_, low, high)) if !(low..=high).contains(&value) => {
            if (0.0..low).contains(&value) {
                source.note(format!("bodies are at least {low} m in each direction"));
                return Some(low);
            }
            source.refuse(node, format!("`{attribute}` is {value}: bodies have {low} to {high} m"))
        }
        _ => Some(value),
    }
}

/// Catalogues give every vehicle a trailer of a name that is empty until a file names one.
fn no_trailer(source: &mut Source, node: Node) -> Option<()> {
    for trailer in elements(node, "Trailer") {
        let mut names = Vec::new();
        for part in trailer.descendants().filter(|part| part.has_attribute("entityRef")) {
            names.push(source.text(part, "entityRef")?);
        }
        let is_named = names.is_empty() || names.iter().any(|name| !name.trim().is_empty());
        source.refuse_if(is_named, trailer, "trailers are not read")?;
    }
    Some(())
}
