//! The bodies of a file: what the engine has for a vehicle or a pedestrian, described in the file or in a catalogue.

use std::collections::BTreeMap;

use roxmltree::Node;

use avastra_lang::model::vocabulary::BodyField;

use super::Files;
use super::source::{Source, children, element, elements, filled};
use super::vocabulary;

/// Ours: farther from the axle than the longest body is long, m, the middle is a mistake.
const MIDDLE_M_MAX: f64 = 20.0;

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

pub fn body(source: &mut Source, root: Node, object: Node, files: &dyn Files) -> Option<Shape> {
    if let Some(reference) = element(object, "CatalogReference") {
        return of_catalogue(source, root, reference, files);
    }
    let described: Vec<Node> = children(object).filter(|node| is_described(*node)).collect();
    let [described] = described[..] else {
        return source.refuse(object, "only vehicles and pedestrians are read, one an object");
    };
    shape(described, &BTreeMap::new()).map_or_else(|reason| source.refuse(described, reason), Some)
}

fn is_described(node: Node) -> bool {
    matches!(node.tag_name().name(), "Vehicle" | "Pedestrian" | "MiscObject")
}

fn of_catalogue(source: &mut Source, root: Node, reference: Node, files: &dyn Files) -> Option<Shape> {
    let (catalogue, entry) = (source.text(reference, "catalogName")?, source.text(reference, "entryName")?);
    let mut assigned = BTreeMap::new();
    for one in elements(reference, "ParameterAssignments").flat_map(children) {
        assigned.insert(source.text(one, "parameterRef")?, source.text(one, "value")?);
    }
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
            let Ok(document) = avastra_road::well_formed(text) else { continue };
            let is_named = |node: &Node, name: &str| node.attribute("name") == Some(name);
            let list = document.descendants().find(|node| node.has_tag_name("Catalog"));
            let Some(list) = list.filter(|node| is_named(node, &catalogue)) else { continue };
            let found = children(list).find(|node| is_described(*node) && is_named(node, &entry));
            if let Some(found) = found {
                return described(found, &assigned).map_or_else(
                    |reason| source.refuse(reference, format!("`{entry}` of `{catalogue}`: {reason}")),
                    Some,
                );
            }
        }
    }
    source.refuse(reference, format!("no vehicle or pedestrian `{entry}` in a catalogue `{catalogue}`"))
}

/// The body of an entry of a catalogue, which no reader has looked at before.
fn described(entry: Node, assigned: &BTreeMap<String, String>) -> Result<Shape, String> {
    if let Some((node, reason)) = vocabulary::unknown(entry).first() {
        return Err(format!("`{}`: {reason}", node.tag_name().name()));
    }
    let declared = || elements(entry, "ParameterDeclarations").flat_map(children);
    let is_declared = |name: &&String| declared().any(|one| one.attribute("name") == Some(name.as_str()));
    if let Some(name) = assigned.keys().find(|name| !is_declared(name)) {
        return Err(format!("it declares no parameter `{name}`"));
    }
    shape(entry, assigned)
}

/// The body of a `Vehicle` or `Pedestrian`, with values for the parameters of an entry of a catalogue.
fn shape(node: Node, assigned: &BTreeMap<String, String>) -> Result<Shape, String> {
    let category = |name: &'static str| node.attribute(name).unwrap_or("");
    let like = match node.tag_name().name() {
        "Vehicle" => match category("vehicleCategory") {
            "car" => "Sedan",
            "van" => "SUV",
            "truck" => "BoxTruck",
            "bus" => "SchoolBus",
            "motorbike" => "Motorcycle",
            "bicycle" => "Bicycle",
            other => return Err(format!("no vehicle of the category `{other}` is known")),
        },
        "Pedestrian" => match category("pedestrianCategory") {
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
        let value = assigned.get(name).cloned().or_else(|| filled(value, &parameters).ok());
        if let Some(value) = value {
            parameters.insert(name.to_owned(), value);
        }
    }
    // Catalogues give every vehicle a trailer of a name that is empty until a file names one.
    let is_named = |name: &str| filled(name, &parameters).map_or(true, |name| !name.trim().is_empty());
    let mut names = element(node, "Trailer").into_iter().map(|trailer| {
        trailer.descendants().filter_map(|part| part.attribute("entityRef")).collect::<Vec<_>>()
    });
    if names.any(|names| names.is_empty() || names.into_iter().any(is_named)) {
        return Err("trailers are not read".to_owned());
    }
    let number = |name: &'static str, attribute: &str| {
        let found = element(bounds, name).and_then(|node| node.attribute(attribute));
        let found = found.and_then(|text| filled(text, &parameters).ok());
        let value = found.and_then(|text| text.trim().parse::<f64>().ok()).filter(|value| value.is_finite());
        value.ok_or_else(|| format!("`{attribute}` of its `{name}` is no number"))
    };
    let size = |attribute: &str, field: BodyField| {
        let value = number("Dimensions", attribute)?;
        match field.range() {
            Some((_, low, high)) if !(low..=high).contains(&value) => {
                Err(format!("`{attribute}` of its `Dimensions` is {value}: bodies have {low} to {high} m"))
            }
            _ => Ok(value),
        }
    };
    let middle_m = number("Center", "x")?;
    if middle_m.abs() > MIDDLE_M_MAX {
        return Err(format!("`x` of its `Center` is {middle_m}: more than {MIDDLE_M_MAX} m from the axle"));
    }
    Ok(Shape {
        like,
        length_m: size("length", BodyField::Length)?,
        width_m: size("width", BodyField::Width)?,
        height_m: size("height", BodyField::Height)?,
        middle_m,
    })
}
